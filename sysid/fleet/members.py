"""One experiment of a fleet: fitted by itself, and what its logs alone say of base parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import experiment_logs, pipeline
from ..compress import compress
from ..errors import SysidError
from ..estimate import Fit
from ..filters import settled
from ..linearised import Linearised
from ..long_motion import prepare
from ..motion import Motion
from ..specs import Experiment
from ..triangles import Compressed, Factor
from .coordinates import Coordinates, coordinates
from .dates import Dated, dated
from .estimate import Estimate, estimate

_HELD_OUT = 24  # blocks: the test logs' own need tell no memory of noise


@dataclass(frozen=True)
class Member:
    """A robot, or a day of one. train, test: what its logs say; held_out: the test logs' triangles
    in base parameters; rms: of its own fit on its test logs, by joint; converged: of that fit."""

    name: str
    path: str
    date: Dated | None
    train: Estimate
    test: Estimate
    held_out: Compressed
    rms: dict[str, float | None]
    converged: bool
    notices: tuple[str, ...]


@dataclass(frozen=True)
class Kind:
    """What makes experiments comparable: names of the parameters, and the base parameters.
    filters: what every log is filtered with, so that all see the same motion."""

    joints: tuple[str, ...]
    parameters: tuple[str, ...]
    filters: dict
    coordinates: Coordinates


def first(experiment: Experiment) -> Kind:
    """The kind of robot that an experiment is of. Raises SysidError."""
    fit, train, _ = _fitted(experiment, None)
    columns, _ = _columns(fit)
    found = coordinates(columns, train)
    return Kind(fit.joints, _parameters(fit), fit.filters, found)


def member(experiment: Experiment, name: str, kind: Kind) -> Member:
    """What an experiment says in the base parameters of a kind.

    Raises:
        SysidError: its logs cannot be used, or it is of another kind.
    """
    fit, train, test = _fitted(experiment, kind.filters)
    if fit.joints != kind.joints or _parameters(fit) != kind.parameters:
        strange = sorted(set(_parameters(fit)) ^ set(kind.parameters))
        said = f"{strange[0]} is in one alone" if strange else "their order differs"
        raise SysidError(
            f"its parameters are not those of the other robots: {said}", where=str(experiment.path),
            allowed="one robot, with the same joints and effects", do="give a fleet of one type",
        )  # fmt: skip
    columns, values = _columns(fit)
    chosen = kind.coordinates.chosen
    known = fit.compressed if values is None else _shifted(compress(columns, train), values)
    other = _shifted(compress(columns, test), values)
    parts = [data.only(chosen.tolist()) for data in (known, other)]
    own, held_out = parts[0], parts[1].gathered(parts[1].stretches(_HELD_OUT))
    return Member(
        name, str(experiment.path), dated(experiment), estimate(own), estimate(held_out),
        held_out.gathered([range(held_out.blocks)]),
        {joint: rms for joint, rms in zip(fit.joints, fit.predictions["test"].told())},
        bool(fit.solution.converged), fit.notices,
    )  # fmt: skip


def _fitted(experiment: Experiment, filters: dict | None) -> tuple[Fit, Motion, Motion]:
    """An experiment's fit, and its training and its test motion."""
    _, structure, _ = pipeline.build(pipeline.started(experiment))
    read = experiment_logs.read_all(experiment, structure=structure)
    fit = pipeline.fit(experiment, filters=filters, measured=read)
    preprocess = settled(fit.experiment.preprocess, fit.filters)
    return fit, *(prepare(logs, preprocess, fit.joints) for logs in read.parts)


def _parameters(fit: Fit) -> tuple[str, ...]:
    return (*fit.model.names, *(value.name for value in fit.model.shape_values))


def _columns(fit: Fit):
    """The model's columns, with the slopes of free shape values; and these values, None where there
    are none."""
    slopes = Linearised(fit.model, fit.x)
    if not slopes.free:
        return slopes, None
    return slopes, np.append(np.zeros(fit.model.size), np.array(fit.model.shapes)[slopes.free])


def _shifted(data: Compressed, values: np.ndarray | None) -> Compressed:
    """Triangles whose slopes' coefficients are the shape values themselves, not their change."""
    if values is None:
        return data
    factors = []
    for f in data.factors:
        moved = f.triangle.copy()
        moved[:, -1] += moved[:, :-1] @ values[f.columns]
        factors.append(Factor(f.joint, f.block, f.columns, moved, f.rows))
    return Compressed(data.size, data.joints, tuple(factors), data.samples)
