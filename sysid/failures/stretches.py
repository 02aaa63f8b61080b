"""The stretches of time that hold most of what a model leaves of all its logs: what acted there
acts nowhere else, and is no law of the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..motion import Motion
from ..noise.bursts import TAIL, WHITE
from ..outliers import CHANCE, bursts, surprise
from ..projection import inverted, prior_hessian
from ..running import running
from ..settled import Settled
from .held_out import HeldOut

_WINDOW = 0.2  # s: a push, a snag, a contact last longer
_APART = 0.6  # s: what is nearer is one
_MOST, _LESS = 0.8, 0.33  # of the squared error that they hold, in less of the time
_BENT = 0.2  # of the squared error: so much in a few windows bends a fit
_LITTLE = 0.005  # of the squared error: what holds less is no matter
_FEWEST = 40  # windows that have a usual
_LIKE = 31  # windows of the nearest pace, by which one is judged
_FAST = 25.0  # times the usual square: no pace makes more of an error
_SHOWN = 8  # stretches: more are how the robot moves
_PASSES, _DOUBT = 6, 4.0  # over the weights; times the usual square, of which a window counts half


@dataclass(frozen=True)
class Stretch:
    """A stretch of a log, from `start` to `stop` [s] on the log's own clock; error: the share that
    it holds of a joint's squares on all logs."""

    log: str
    start: float
    stop: float
    error: float


@dataclass(frozen=True)
class Stretches:
    """Where most of a joint's squared error is, on training and test logs: `error` of it, in `time`
    [s] of `whole`."""

    parts: tuple[Stretch, ...]
    error: float
    time: float
    whole: float

    def words(self) -> str:
        """As a sentence says it."""
        each: dict[str, list[str]] = {}
        for part in self.parts:
            each.setdefault(part.log, []).append(f"{part.start:.2f} to {part.stop:.2f} s")
        where = "; ".join(f"{log}, {', '.join(times)}" for log, times in each.items())
        return (
            f"{100 * self.error:.0f} % of the squared error of all logs lies in {self.time:.1f} s "
            f"of {self.whole:.0f} s: {where}"
        )


def stretches(held_out: HeldOut, train: Motion, weights) -> list[Stretches | None]:
    """Of each joint the stretches that hold most of its error, None where it is spread out.

    Squares over windows of time against that of most windows, as knocks' are of a residual; where
    any stands out, once more of what a fit leaves that doubts such windows, as they bend a fit.

    Args:
        train: the motion that the model was settled on. weights: (dof,) by which joints count.
    """
    settled, test = held_out.settled, held_out.rows
    parts = _with_pace(((settled.rows, train), (test, held_out.test)))
    # what bends a fit hides in it: any window that stands out is a reason to doubt it
    plain = _found(parts, settled.x, most=_BENT)
    if not any(plain):
        return plain
    return _found(parts, _doubting(settled, train, np.asarray(weights)), most=_MOST)


def _with_pace(parts) -> list[tuple]:
    """Rows and motion of parts, with how fast the robot moves there (n,): the squares of all speeds
    and accelerations over the usual ones."""
    paces = []
    for name in ("qd", "qdd"):
        squares = [rows.of(motion, name) ** 2 for rows, motion in parts]
        usual = np.mean(np.concatenate(squares), axis=0)
        paces.append([np.sum(own / np.where(usual > 0.0, usual, 1.0), axis=1) for own in squares])
    return [(*part, qd + qdd) for part, qd, qdd in zip(parts, *paces)]


def _found(parts, x, *, most: float) -> list[Stretches | None]:
    known = [(rows, rows.residual(x), motion, pace) for rows, motion, pace in parts]
    return [_of_joint(known, j, most) for j in range(known[0][0].tau.shape[1])]


def _doubting(settled: Settled, motion: Motion, weights: np.ndarray) -> np.ndarray:
    """Parameters (size,) of least squares with the prior in which windows count the less the more
    is left there (Cauchy's weights)."""
    rows, x = settled.rows, settled.x
    residual, prior = rows.residual(x), prior_hessian(settled)
    scale = 2.0 * weights**2
    pull = np.einsum("j,jnk,nj->k", scale, rows.columns, residual, optimize=True)
    window = np.unique(
        np.stack([rows.log, np.floor(rows.t / _WINDOW).astype(np.int64)], axis=1),
        axis=0, return_inverse=True,
    )[1].ravel()  # fmt: skip
    change = np.zeros_like(x)
    for _ in range(_PASSES):
        left = residual - np.einsum("jnk,k->nj", rows.columns, change, optimize=True)
        system, right = prior.copy(), -pull
        for j, columns in enumerate(rows.columns):
            count = np.bincount(window, rows.use[:, j])
            square = np.bincount(window, left[:, j] ** 2) / np.maximum(count, 1.0)
            there = square[count > 0]
            usual = float(np.median(there)) if len(there) else 0.0
            counts = scale[j] / (1.0 + (square / max(_DOUBT * usual, 1e-300))[window])
            system += columns.T @ (columns * counts[:, None])
            right = right + columns.T @ (counts * residual[:, j])
        change = inverted(system) @ right
    return x + change


def _of_joint(parts: Sequence[tuple], j: int, most: float) -> Stretches | None:
    logs = [log for part in parts for log in _windows(*part, j)]
    squares, pace = (np.concatenate([log[k] for log in logs] or [np.zeros(0)]) for k in (2, 3))
    middle = float(np.median(squares)) if len(squares) else 0.0
    if len(squares) < _FEWEST or middle <= 0.0:
        return None
    s = _surprise(squares, pace, middle)
    level, first, out, whole = np.log(len(squares) / CHANCE), 0, [], float(squares.sum())
    for name, starts, own, _ in logs:
        mine = s[first : first + len(own)]
        first += len(own)
        apart = np.flatnonzero(np.diff(starts) > _APART) + 1
        for index in np.split(np.arange(len(own)), apart):
            for a, b in bursts(mine[index], level):
                error = float(own[index[a : b + 1]].sum()) / whole
                # what begins and ends softly is there a little longer than it stands out
                start, stop = float(starts[index[a]]), float(starts[index[b]]) + _WINDOW
                out.append(Stretch(name, max(start - _WINDOW, 0.0), stop + _WINDOW, error))
    # a window of noise that stands out holds next to nothing of the whole
    out = [one for one in _joined(out) if one.error > _LITTLE]
    time, length = sum(one.stop - one.start for one in out), _WINDOW * len(squares)
    error = sum(one.error for one in out)
    few = error > most and time < _LESS * length and len(out) <= _SHOWN
    return Stretches(tuple(out), error, time, length) if few else None


def _surprise(squares, pace, middle: float) -> np.ndarray:
    """How surprising (k,) windows are beside those in which the robot moves as fast: where all is
    fast there is more of any error. What stands out is none of these the next time."""
    order, calm = np.argsort(pace, kind="stable"), np.ones(len(squares), dtype=bool)
    for _ in range(_PASSES):
        usual = order[calm[order]]
        size = min(_LIKE, 2 * (len(usual) // 20) + 1)
        near = running(squares[usual], size, "median", "edge")
        like = np.clip(np.interp(pace, pace[usual], near), middle, _FAST * middle)
        s = surprise(squares / like, WHITE, tail=TAIL)
        now = s <= 0.5 * np.log(len(squares) / CHANCE)
        if np.array_equal(calm, now) or now.sum() < _LIKE:
            break
        calm = now
    return s


def _windows(rows, residual, motion: Motion, pace, j: int) -> list[tuple]:
    """Of each log: its name, the starts (k,) [s] of its windows that have enough rows of a joint,
    the mean squares (k,) there and the mean pace (k,)."""
    names = {piece.log: piece.source for piece in motion.pieces}
    use, out = rows.use[:, j], []
    for log in np.unique(rows.log):
        own = use & (rows.log == log)
        if not own.any():
            continue
        number = np.floor(rows.t[own] / _WINDOW).astype(np.int64)
        unique, index, count = np.unique(number, return_inverse=True, return_counts=True)
        square = np.bincount(index, residual[own, j] ** 2) / count
        enough = 2 * count >= np.median(count)
        fast = np.bincount(index, pace[own]) / count
        out.append((names[int(log)], unique[enough] * _WINDOW, square[enough], fast[enough]))
    return out


def _joined(found: Sequence[Stretch]) -> list[Stretch]:
    """Stretches of which those that are near each other are one."""
    out: list[Stretch] = []
    for one in found:
        last = out[-1] if out else None
        if last and last.log == one.log and one.start - last.stop <= _APART:
            out[-1] = Stretch(one.log, last.start, one.stop, last.error + one.error)
        else:
            out.append(one)
    return out
