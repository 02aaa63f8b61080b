"""Which coordinates the torque of a kind of robot can tell at all: base parameters.

Most of a body's ten parameters enter a robot's torque only in sums with those of its neighbours.
The columns are asked on states that no motion ties together: effects first, then the bodies from
the base outwards. A parameter whose column is new stands for itself and for its share of those that
come later and are not new:

    beta = K x,    A x = A[:, base] K x for every motion.

Source: Gautier 1991 (numerical base parameters by QR).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base_parameters import independent
from ..linearised import Linearised
from ..model import Model
from ..motion import Motion, Piece
from ..reduction import triangle

# Of a column's size: below it, what is left of a column is rounding.
_ALIKE = 1e-6
_STATES = 30  # for each parameter
_STILL = 1e-6  # rad, rad/s, rad/s^2: what spreads by less is drawn from a unit spread


@dataclass(frozen=True)
class Coordinates:
    """Base parameters of a model with its free shape values.

    names, units: (base,). chosen: (base,) numbers of the parameters that stand for themselves.
    groups: (base, parameters), K. bodies: names.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    chosen: np.ndarray
    groups: np.ndarray
    bodies: tuple[str, ...]

    @property
    def size(self) -> int:
        """Number of base parameters."""
        return len(self.names)

    @cached_property
    def of_effects(self) -> np.ndarray:
        """Places of the base parameters that are no body's."""
        return np.flatnonzero(self.chosen >= 10 * len(self.bodies))

    def of_body(self, body: int) -> np.ndarray:
        """(base, 10): what base parameters become when a body's parameters do."""
        return self.groups[:, 10 * body : 10 * body + 10]


def coordinates(columns: Model | Linearised, motion: Motion, seed: int = 0) -> Coordinates:
    """The base parameters of a model, by the states of a motion without their order.

    Args:
        columns: the model, with slopes of its shape values where these are free.
    """
    model = columns.model if isinstance(columns, Linearised) else columns
    names, units = list(model.names), list(model.units)
    if isinstance(columns, Linearised):
        free = [model.shape_values[k] for k in columns.free]
        names, units = names + [v.name for v in free], units + [v.unit for v in free]
    piece = _shuffled(motion.pieces[0], _STATES * len(names), np.random.default_rng(seed))
    parts = columns.columns(piece, piece.core, columns.remembered(piece))
    rows = []
    for joint, values in enumerate(parts):
        wide = np.zeros((values.shape[1], len(names)))
        wide[:, columns.support(joint, piece)] = values.T
        rows.append(wide)
    factor = triangle(np.concatenate(rows))
    count = 10 * model.bodies
    order = np.roll(np.arange(len(names)), len(names) - count)  # effects, then bodies
    chosen, groups = _chosen(factor, order)
    bodies = tuple(body.name for body in model.robot.bodies)
    of = lambda words: tuple(words[k] for k in chosen)  # noqa: E731
    return Coordinates(of(names), of(units), chosen, groups, bodies)


def _chosen(factor, order) -> tuple[np.ndarray, np.ndarray]:
    """Columns that are new, in an order, and what each column is of them (new, columns)."""
    size = np.linalg.norm(factor, axis=0)
    scaled = factor / np.where(size > 0.0, size, 1.0)
    chosen, _ = independent(scaled, order[size[order] > 0.0], _ALIKE)
    own = scaled[:, chosen]
    groups = np.linalg.lstsq(own, scaled, rcond=None)[0]
    groups = groups * size[None] / size[chosen][:, None]
    groups[:, chosen] = np.eye(len(chosen))
    largest = np.abs(groups * size[chosen][:, None] / np.where(size > 0.0, size, 1.0))
    return np.array(chosen, dtype=int), np.where(largest > _ALIKE, groups, 0.0)


def _shuffled(piece: Piece, most: int, rng: np.random.Generator) -> Piece:
    """Rows of a piece, each joint's angle, speed and acceleration in an order of its own."""
    rows = np.linspace(piece.core.start, piece.core.stop - 1, min(most, piece.samples)).astype(int)
    repeats = -(-most // len(rows))
    rows = np.tile(rows, repeats)
    n = len(rows)

    def mixed(values) -> np.ndarray:
        out = rng.permuted(values[rows], axis=0)
        still = np.ptp(out, axis=0) < _STILL
        return out + still * rng.normal(size=out.shape)

    signals = {name: rng.permuted(values[rows]) for name, values in piece.signals.items()}
    arrays = {name: mixed(getattr(piece, name)) for name in ("q", "qd", "qdd")}
    return replace(
        piece,
        t=piece.t[0] + piece.step * np.arange(n),
        tau=piece.tau[rows],
        measured=piece.measured[rows],
        signals=signals,
        use=None,
        smoother=None,
        weight=None,
        sight=None,
        core=slice(0, n),
        load=None,
        deflection=None,
        **arrays,
    )
