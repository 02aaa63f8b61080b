"""Suspects: effects that a model may lack, and the columns that they would add along a motion.

A suspect's shape values and its size are those that the first logs suggest. An effect of the instant
has columns at any sample; one that looks back in time (presliding, elasticity, a delay) has them
along a whole motion alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType, SimpleNamespace

import numpy as np

from ..candidate_columns import bounds_of, columns_of, tried
from ..candidates import Candidate
from ..effect import SensorEffect
from ..effect_parameters import Shape
from ..estimate import Fit
from ..model import Model
from ..motion import Motion
from ..rows import Rows, moved, stack, starts
from ..source import Source
from .columns import piece
from .noise import noise_of

_RATE = 50.0  # Hz of the rows of a log that suspects are asked on
_TYPICAL = 0.1  # of the joint's torque, at most: an effect of which no log says any
_NOTHING = 1e-3  # of what is not known of its torque squared: what logs say of it is nothing


@dataclass(frozen=True)
class Suspect:
    """A candidate with its shape values and its likely coefficients size (k,)."""

    candidate: Candidate
    shapes: dict[str, float]
    size: np.ndarray

    @property
    def looks_back(self) -> bool:
        """Whether its columns are of a whole motion, not of an instant."""
        effect = self.candidate.effect
        return bool(effect.memory or effect.reach or not effect.instantaneous)

    def named(self, joints: Sequence[str]) -> str:
        """`effect:joint`, as `--separate` has it."""
        return f"{self.candidate.name}:{self.candidate.where(joints)}"


def along(
    suspects: Sequence[Suspect],
    model: Model,
    x,
    q,
    qd,
    qdd,
    step: float = 1.0,
    rows: slice = slice(None),
) -> np.ndarray:
    """Columns (dof, k of all, n) of suspects at the rows of a motion (samples, dof).

    Args:
        model: what lacks them, sized by a motion; x: its parameters.
    """
    first, _, stride = rows.indices(len(q))
    motion = played(q, qd, qdd, step, model.robot.joints, first)
    use = np.ones((-(-(len(q) - first) // stride), q.shape[1]), dtype=bool)
    loaded = any(one.candidate.effect.uses_load for one in suspects)
    source = (Source if loaded else _Unloaded)(model, np.asarray(x), motion, stride, use)
    found = [on_every_joint(source, one.candidate, one.shapes) for one in suspects]
    return np.moveaxis(np.concatenate(found, axis=2), 1, 2)


class _Unloaded(Source):
    """A source of effects none of which looks at the load, which takes longer than they do."""

    @cached_property
    def pieces(self) -> list:
        """Whole pieces as these effects see them."""
        return moved(self.model, self.motion)


def played(
    q,
    qd,
    qdd,
    step: float,
    joints: tuple[str, ...],
    first: int = 0,
    levels: Mapping[str, str] = MappingProxyType({}),
) -> Motion:
    """Samples (n, dof) of a designed motion as the motion of a log at {group: level}, whose rows
    count from one on."""
    own = replace(piece(q, qd, qdd, step), core=slice(first, len(q)), levels=levels)
    rest = np.zeros(q.shape[1])
    return Motion(joints, (own,), (), rest, rest.astype(int))


def on_every_joint(source: Source, candidate: Candidate, at: dict[str, float]) -> np.ndarray:
    """Columns (dof, n, k) of a candidate on the rows of a source."""
    if (own := _value(candidate)) and at[own.name] != own.start:
        found = _secant(source, candidate, at, own.name)
    else:
        found = columns_of(source, candidate, [at])[0]
    dof = source.use.shape[1]
    if len(found) == dof:
        return found
    out = np.zeros((dof, *found.shape[1:]))
    out[candidate.joint] = found[0]
    return out


def _value(candidate: Candidate) -> Shape | None:
    """The one value of a sensor effect, from zero on; None of any other."""
    if not isinstance(candidate.effect, SensorEffect):
        return None
    values = candidate.effect.shapes()
    return values[0] if len(values) == 1 and values[0].start == 0.0 else None


def _secant(source: Source, candidate: Candidate, at: dict[str, float], name: str) -> np.ndarray:
    """(1, n, 1) what a sensor effect of one value makes of the predicted torque of its joint, over that
    value: of a small delay and a small lag the slopes at zero are the same, and only what is beyond
    tells them apart."""
    out, joint = [], candidate.joint
    kept = starts(source.motion, source.stride)
    for part, torque, rows in zip(source.motion.pieces, source.unfiltered, kept):
        base = torque[None, joint]
        change = (candidate.effect.sensed(base, part.step, **at) - base)[0] / at[name]
        out.append(part.settled(change, rows, joint))
    return (np.concatenate(out) * source.use[:, joint])[None, :, None]


def _at_size(model: Model, suspect: Suspect) -> Suspect:
    """A suspect of a sensor effect of one value at that value, which is its size."""
    own = _value(suspect.candidate)
    if own is None:
        return suspect
    ((_, low, high, _),) = bounds_of(model, suspect.candidate)
    value = float(np.clip(suspect.size[0], low, high))
    return replace(suspect, shapes={own.name: value}, size=np.array([value])) if value else suspect


@dataclass(frozen=True)
class Seen:
    """Rows of a log under a fit: what suspects are asked on. weights (dof,): the root of how many
    samples a row stands for, over the noise."""

    rows: Rows
    source: Source
    weights: np.ndarray

    @classmethod
    def of(cls, fit: Fit, motion: Motion, samples: float) -> Seen:
        """A motion that stands for so many samples."""
        stride = max(1, int(round(1.0 / (_RATE * motion.pieces[0].step))))
        rows = stack(fit.model, motion, stride)
        source = Source(fit.model.scaled_by(motion), fit.x, motion, stride, rows.use)
        return cls(rows, source, np.sqrt(samples / max(len(rows.t), 1)) / noise_of(fit))

    def columns(self, suspect: Suspect) -> np.ndarray:
        """(dof, n, k)."""
        return on_every_joint(self.source, suspect.candidate, suspect.shapes)


def suspected(seen: Seen, fit: Fit, prior: np.ndarray, candidate: Candidate) -> Suspect:
    """A candidate with the shape values that take most of what the first logs leave once the model has
    taken what it can, as large as these logs and `usual` sizes suggest between them: what is expected
    of the square of its torque.

    Args:
        prior: (size, size) information of the model's parameters beside the logs.
    """
    weigh = lambda columns: (columns * seen.weights[:, None, None]).reshape(-1, columns.shape[2])  # noqa: E731
    target = (seen.rows.residual(fit.x) * seen.weights).T.ravel()
    base = weigh(seen.rows.columns)
    inner, pulled = base.T @ base + prior, base.T @ target
    asked = tried(seen.source, candidate)  # which looks at the model's scales alone
    torque = np.sqrt(np.mean(seen.rows.tau**2, axis=0))
    best = None
    for at in asked:
        columns = on_every_joint(seen.source, candidate, at)
        own = weigh(columns)
        if not np.all(np.isfinite(own)):
            continue
        cross = solved(inner, base.T @ own)
        size = usual(columns, torque)
        left = own.T @ own - own.T @ base @ cross + np.diag(size**-2.0)
        pull = own.T @ target - cross.T @ pulled
        spread = np.linalg.pinv(left * np.outer(size, size), hermitian=True) * np.outer(size, size)
        mean = spread @ pull
        if best is None or pull @ mean > best[0]:
            best = pull @ mean, at, mean, spread, own.T @ own, size
    if best is None:
        return Suspect(candidate, asked[0], np.ones(1))
    _, at, mean, spread, gram, size = best
    made = float(mean @ gram @ mean)
    if made <= _NOTHING * float(np.sum(spread * gram)):
        likely = size / np.sqrt(len(size))
    else:
        likely = mean * np.sqrt(1.0 + float(np.sum(spread * gram)) / made)
    return _at_size(seen.source.model, Suspect(candidate, at, likely))


def solved(gram, right) -> np.ndarray:
    """gram^-1 right of a positive semidefinite matrix, scaled to a unit diagonal first."""
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(gram), 1e-300))
    found = np.linalg.lstsq(gram * np.outer(scale, scale), scale[:, None] * right, rcond=1e-12)[0]
    return scale[:, None] * found


def usual(columns, torque) -> np.ndarray:
    """Coefficients (k,) that make a tenth of a joint's torque where they make most of it.

    Args:
        columns (dof, n, k); torque (dof,) of each joint [N m].
    """
    share = np.abs(columns).max(axis=1) / np.maximum(torque, 1e-12)[:, None]
    return _TYPICAL / np.maximum(share.max(axis=0), 1e-12)


def unseen(model: Model, x, q, qd, qdd, candidate: Candidate, torque) -> Suspect:
    """A candidate without any log: midway between the shape values that it may have, of the `usual`
    size in a usual motion (n, dof).

    Args:
        torque (dof,) of each joint [N m].
    """
    asked = tried(SimpleNamespace(model=model), candidate)
    at = asked[len(asked) // 2]
    blank = Suspect(candidate, at, np.zeros(0))
    columns = np.moveaxis(along([blank], model, x, q, qd, qdd), 1, 2)
    size = usual(columns, torque)
    return _at_size(model, Suspect(candidate, at, size / np.sqrt(len(size))))
