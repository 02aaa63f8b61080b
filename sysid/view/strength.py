"""Does the strength of what a model leaves follow the motion? That of even noise does not.

A law with a memory leaves torque that no function of the motion predicts at any one time, and that
may be as slow as the motion, as a drift is. But it is strong where it acts, or changes quickly where
the joint goes quickly. So the logarithms of squares of what is left, and of its changes from row to
row, are asked by functions of the motion, beside those of noise that has one spectrum all the time,
and beside themselves at other times, as noise may be stronger for a while.
Drives and gears may be louder in motion than at rest: it tells where to look, and not what is there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from .. import blocks, flexible
from ..projection import NOISE
from .singles import beyond, noises
from .view import View

_DRAWS = 200  # as of `singles`
_SHIFTS = 99  # in time: the greatest of as many is passed by chance once in a hundred times
_WAVES = 4  # half waves over an angle's travel
_LEAST = 0.1  # of the mean square: what is less is as good as nothing


def strength(view: View, j: int, more: View | None = None) -> flexible.Law:
    """The function of the motion that the strength of what a view's model leaves of joint j follows
    most, on its logs or on these and `more`'s, where the same model is settled on others: two
    questions. Nothing, of logs in which the noise of the angles makes much of what is left: its
    strength does follow the motion.

    Its `share` is the square of its correlation with the logarithm of the strength, less what noise
    has of that.
    """
    if not _quiet(view, j):
        return flexible.Law(1.0, "", 0.0)
    found = [_greatest([view], j)]
    if more is not None and _quiet(more, j):
        found.append(_greatest([view, more], j))
    best = min(found, key=lambda law: law.chance)
    return replace(best, chance=min(len(found) * best.chance, 1.0))


def _quiet(view: View, j: int) -> bool:
    left, rough = view.design.residual[:, j], view.design.rough_residual[:, j]
    return bool(np.sum(rough**2) < NOISE * np.sum(left**2))


def _greatest(views: Sequence[View], j: int) -> flexible.Law:
    told, words, rng = 0.0, [], np.random.default_rng(j)
    for view in views:
        use = view.rows.use[:, j].astype(bool)
        own, noise = view.design.residual[use, j], _noise(view, j, rng)[use]
        words, columns = zip(*_functions(view, use))
        columns, log, piece = np.stack(columns, axis=1), _logs(view)[use], view.rows.piece[use]
        left = np.column_stack([own, _elsewhen(own, log, rng), noise])
        goes_on = (np.diff(np.flatnonzero(use)) == 1) & (np.diff(piece) == 0)
        steps = np.diff(left, axis=0)[goes_on]
        both = [
            _follow(left**2, columns, log),
            _follow(steps**2, columns[1:][goes_on], log[1:][goes_on]),
        ]
        told = told + len(left) * np.concatenate(both)
    told = told / sum(view.rows.use[:, j].sum() for view in views)
    even = told[:, 1 + _SHIFTS :]
    usual, scatter = (f(even, axis=1, keepdims=True) for f in (np.mean, np.std))
    out = np.abs(told - usual) / np.maximum(scatter, 1e-12)
    best = int(np.argmax(out[:, 0]))
    chance = beyond(out[best, 0], out[:, 1 + _SHIFTS :].max(axis=0))
    if out[:, 1 : 1 + _SHIFTS].max() >= out[best, 0]:
        chance = 1.0  # it wanders, whatever the motion does
    return flexible.Law(chance, words[best % len(words)], float((told - usual)[best, 0] ** 2))


def _noise(view: View, j: int, rng: np.random.Generator) -> np.ndarray:
    """(n, draws) of one spectrum all the time but for the part that the angles' noise makes, which is
    as strong as it is: once more drawn, with another sign in each block."""
    spans = blocks.by_block(view.blocks)
    noise, _ = noises(view, j, rng, _DRAWS, spans)
    rough, left = view.design.rough_residual[:, j], view.design.residual[:, j]
    share = np.sum(rough**2) / max(np.sum(left**2), 1e-300)
    signs = rng.choice([-1.0, 1.0], (len(spans), _DRAWS)).repeat(
        [s.stop - s.start for s in spans], 0
    )
    return np.sqrt(1.0 - share) * noise + rough[:, None] * signs


def _logs(view: View) -> np.ndarray:
    """(n,) the number of each row's log."""
    names = [piece.source for piece in view.motion.pieces]
    return np.unique(names, return_inverse=True)[1][view.rows.piece]


def _elsewhen(left: np.ndarray, log: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(n, shifts) what is left (n,) at other times of each log (n,), a tenth of it away at least: as
    strong, and as long, and no law of this motion."""
    out = np.empty((len(left), _SHIFTS))
    for number in np.unique(log):
        (rows,) = np.nonzero(log == number)
        for k, share in enumerate(rng.uniform(0.1, 0.9, _SHIFTS)):
            out[rows, k] = np.roll(left[rows], round(share * len(rows)))
    return out


def _follow(squares: np.ndarray, columns: np.ndarray, log: np.ndarray) -> np.ndarray:
    """(k, 1 + draws) correlations of columns (n, k) with how strong squares (n, 1 + draws) are, in each
    log (n,) about its mean: one may be louder than another, and elsewhere."""
    strong = np.log(squares + _LEAST * np.maximum(squares.mean(0), 1e-300))
    units = []
    for values in (columns.copy(), strong):
        for number in np.unique(log):
            values[log == number] -= values[log == number].mean(0)
        units.append(values / np.maximum(values.std(0), 1e-300))
    return units[0].T @ units[1] / max(len(squares), 1)


def _functions(view: View, use: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Variables and functions (n,) of each: speed and acceleration by size and by direction, and
    waves over an angle's travel."""
    for joint in view.model.robot.joints:
        for name in (f"qd_{joint}", f"qdd_{joint}"):
            own = view.variables[name][use]
            yield from ((name, np.abs(own)), (name, np.sign(own)))
        own = view.variables[f"q_{joint}"][use]
        phase = np.pi * (own - own.min()) / max(np.ptp(own), 1e-12)
        yield from ((f"q_{joint}", np.cos(m * phase)) for m in range(1, _WAVES + 1))
