"""What a robot picks up and puts down within a log: when, by the torque that a body on its last link, or in another hand, needs.

A model of the whole log has a part of such a load all the time and lacks the rest for a while, and no function of the motion
predicts which. Two times and a body are looked for together: the body by least squares beside everything in the model, the times
by how far the residual falls. Only stretches that take more than chance gives over all of them are asked.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from .blocks import by_block
from .candidate_columns import columns_of
from .candidates import made
from .effects.payload import Payload
from .for_a_while import SHORTEST, stretches, told, twice
from .model_parameters import ROBOT
from .vocabulary import find

_CELLS = 240  # of time, in all logs: where a stretch may begin and end at first
_TIMES = 1.4  # how much longer the next length that is tried is
_DRAWS = 99  # of chance: a residual that beats them all is there at one per cent
MASS = slice(0, 4)  # m and m c: what a load is seen by first
_TURN = 0.1  # of a log, at least: by less it is much as it was
_RIDGE = 1e-6  # of what the body takes, where a short stretch tells a part of it alone
_ROUNDS = 10  # of body and times in turn
TAKES = 0.25  # of some joint's squared residual: less hides behind whatever else is missing
_MORE = 1.25  # times what all that acts on each joint alone takes: of a torque's zero that moved it is as much
_WHOLE = 0.95  # of a log's rows: that is all of it


class Picked(Payload):
    """A payload that is asked during stretches that were found, on the link by which they were."""

    def __init__(self, found: Sequence[str] = (), place: Mapping[str, str] = MappingProxyType({})):
        self.found, self.place = list(found), dict(place)

    def variants(self, robot, joint):
        return [{"stretches": self.found, **self.place}]

    def among(self, logs):
        return []

    def places(self, robot):
        return [{}]


def picked(view) -> list[Payload]:
    """The payload to be asked during stretches of a view's training logs, by the hand that has it; none where no stretch stands out.

    Args:
        view: of the model, a `view.View`.
    """
    name = find(Payload.name)
    if any(effect.name == name.name for effect, _ in view.model.terms):
        return []
    if twice(view.motion.pieces):
        return []
    places = name.places(view.model.robot)
    parts = [_Parts.of(view, _column(view, place)) for place in places]
    chance = max(own.first[1][1:].max() for own in parts)  # of whichever place takes most in a draw
    found = [own for place, one in zip(places, parts) if (own := _by(view, one, place, chance))]
    return [max(found, key=lambda own: own[0])[1]] if found else []


def _column(view, place: Mapping[str, str]) -> np.ndarray:
    """Weighted columns (dof, n, 4) of a payload that is held where a place says."""
    (columns,) = columns_of(view.source, made(find(Payload.name), ROBOT, dict(place), view.model.robot), [{}])
    return columns[:, :, MASS] * view.weights[:, None, None]


def _by(view, parts: _Parts, place: Mapping[str, str], chance: float) -> tuple[float, Picked] | None:
    """What a payload of stretches takes of the squared residual, held where a place says, and that payload; None where there is none.

    Args:
        chance: what draws of chance take, at most.
    """
    if (found := parts.found(chance)) is None:
        return None
    there, *_ = found
    if all(share < 1.0 - _WHOLE or share > _WHOLE for share in (there[rows].mean() for rows in parts.logs)):
        return None  # whole logs are asked anyway
    # what acts on single joints for a while, a torque's zero, a friction, is no body
    speed, takes = view.rows.of(view.motion, "qd"), parts.takes(parts.body, there)
    plain = np.stack([np.ones_like(speed), speed, np.sign(speed)], axis=2).transpose(1, 0, 2) * view.rows.use.T[:, :, None]
    if takes < _MORE * parts.takes(_apart(plain), there):
        return None
    said = told(view.rows, there, view.motion.pieces)
    return (takes, Picked(said, place)) if said else None


def _apart(columns: np.ndarray) -> np.ndarray:
    """Columns (dof, n, k) of every joint as columns of all (dof, n, dof k), each of size one."""
    dof, n, k = columns.shape
    out = np.zeros((dof, n, dof, k))
    for j, own in enumerate(columns):
        out[j, :, j] = own / np.maximum(np.linalg.norm(own, axis=0), 1e-300)
    return out.reshape(dof, n, dof * k)


@dataclass(frozen=True)
class _Parts:
    """What is looked at: weighted columns of the body (dof, n, 4), each of size one, of the model (dof, n, k) and the residual
    (n, dof); the rows of each log; t (n,) [s]; which rows count, use (n, dof)."""

    body: np.ndarray
    model: np.ndarray
    residual: np.ndarray
    logs: tuple[slice, ...]
    t: np.ndarray
    use: np.ndarray

    @classmethod
    def of(cls, view, columns: np.ndarray) -> _Parts:
        size = np.sqrt(np.einsum("jnk,jnk->k", columns, columns))
        logs = tuple(by_block(view.rows.log))
        return cls(columns / np.maximum(size, 1e-300), view.design.columns, view.design.residual, logs, view.rows.t, view.rows.use)

    @cached_property
    def first(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the residual and of each draw of chance the rows (1 + draws, 2), from one to before another, of the stretch that takes
        most, and what that takes (1 + draws,)."""
        cells = self._cells()
        sums = lambda a, b: np.stack([sum(a[j][s].T @ b[j][s] for j in range(len(a))) for s in cells])  # noqa: E731
        shifted = self.drawn
        squares, cross = sums(self.body, self.body), sums(self.model, self.body)
        scores = sums(self.body, shifted)  # (cells, 4, 1 + draws)
        level = sum(a.T @ own for a, own in zip(self.model, shifted))  # what the model takes of each (k, 1 + draws)
        best, most = np.zeros((shifted.shape[2], 2), dtype=int), np.zeros(shifted.shape[2])
        for spans in self._spans(cells):
            within = lambda a: _between(a, spans)  # noqa: E731, B023
            own, shared = within(squares), within(cross)
            ridge = _RIDGE * np.trace(own, axis1=1, axis2=2)[:, None, None] + 1e-12
            left = own - np.swapaxes(shared, 1, 2) @ shared + ridge * np.eye(own.shape[1])
            score = within(scores) - np.swapaxes(shared, 1, 2) @ level
            size = np.linalg.solve(left, score)
            gain = np.where(size[:, 0] > 0.0, np.sum(size * score, axis=1), 0.0)  # no load is lighter than none
            here, more = spans[gain.argmax(axis=0)], gain.max(axis=0) > most
            best[more], most = here[more], np.maximum(most, gain.max(axis=0))
        starts, stops = np.array([cell.start for cell in cells]), np.array([cell.stop for cell in cells])
        return np.column_stack([starts[best[:, 0]], stops[np.maximum(best[:, 1], 1) - 1]]), most

    def found(self, chance: float = 0.0) -> tuple[np.ndarray, np.ndarray, float] | None:
        """The stretches (n,) bool, what the body takes of each joint's squares (dof,), and its mass on the scale of its column; None
        where chance takes as much, or where the body is none.

        Args:
            chance: what draws of chance take for other bodies, at most.
        """
        rows, most = self.first
        if not most[0] > max(most[1:].max(), chance):
            return None
        within = lambda k: (np.arange(len(self.t)) >= rows[k, 0]) & (np.arange(len(self.t)) < rows[k, 1])  # noqa: E731
        there, shares, mass = self.settled(within(0))
        if not mass > 0.0 or shares.max() < TAKES:
            return None
        takes = self.takes(self.body, there)
        for k in range(1, len(most)):  # and so do stretches that are found in a draw as these were
            one = replace(self, residual=self.drawn[:, :, k].T)
            if one.takes(self.body, one.settled(within(k))[0]) >= takes:
                return None
        return there, shares, mass

    def settled(self, there: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """(n,) bool of all stretches that have the body of some, body and stretches found in turn; what it takes of each joint's
        squared residual (dof,); and its mass, on the scale of its column."""
        for _ in range(_ROUNDS):
            size, bare = self._fitted(self.body, there)
            again = stretches(self.t, self.logs, bare, (self.body @ size).T)
            if (again == there).all() or not again.any():
                break
            there = again
        size, bare = self._fitted(self.body, there)
        left = np.sum((bare - (self.body @ size).T * there[:, None]) ** 2, axis=0)
        return there, 1.0 - left / np.maximum(np.sum(self.residual**2, axis=0), 1e-300), float(size[0])

    def takes(self, columns: np.ndarray, there: np.ndarray) -> float:
        """What columns (dof, n, k) on some rows take of the squared residual, all else fitted anew."""
        size, bare = self._fitted(columns, there)
        return float(np.sum(self.residual**2) - np.sum((bare - (columns @ size).T * there[:, None]) ** 2))

    def _fitted(self, columns: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The sizes (k,) of columns (dof, n, k) on some rows, and what is left (n, dof) without them and without what the model made of
        them."""
        body = columns * there[:, None]
        shared = sum(a.T @ p for a, p in zip(self.model, body))
        left = sum(p.T @ p for p in body) - shared.T @ shared
        size = np.linalg.lstsq(left, sum(p.T @ self.residual[:, j] for j, p in enumerate(body)), rcond=1e-9)[0]
        return size, self.residual + (self.model @ (shared @ size)).T

    def _cells(self) -> list[slice]:
        """Rows of short stretches of time, none in two logs."""
        seconds = sum(self.t[rows][-1] - self.t[rows][0] for rows in self.logs)
        size, out = max(0.5 * SHORTEST, seconds / _CELLS), []
        for rows in self.logs:
            number = ((self.t[rows] - self.t[rows][0]) / size).astype(int)
            out += [slice(rows.start + own.start, rows.start + own.stop) for own in by_block(number)]
        return out

    def _spans(self, cells: list[slice]) -> Iterator[np.ndarray]:
        """Cells (spans, 2) from one to before another of the same log, those of one length together."""
        log = np.array([next(k for k, rows in enumerate(self.logs) if rows.start <= cell.start < rows.stop) for cell in cells])
        length, least = 2.0, 2
        while least <= len(cells):
            begin = np.arange(len(cells) - least + 1)
            own = begin[log[begin] == log[begin + least - 1]]
            if len(own):
                yield np.stack([own, own + least], axis=1)
            length *= _TIMES
            least = max(least + 1, int(length))

    @cached_property
    def drawn(self) -> np.ndarray:
        """The residual (dof, n, 1 + draws), first as it is, then each log's turned round in time: what it is, and not when."""
        rng, out = np.random.default_rng(1), [self.residual]
        for _ in range(_DRAWS):
            own = np.zeros_like(self.residual)
            for rows in self.logs:
                turn = rng.uniform(_TURN, 1.0 - _TURN)
                for j, use in enumerate(self.use[rows].T):  # among the rows that count: elsewhere there is nothing to take
                    there = rows.start + np.flatnonzero(use)
                    own[there, j] = np.roll(self.residual[there, j], int(turn * len(there)))
            out.append(own)
        return np.stack(out, axis=2).transpose(1, 0, 2)


def _between(each: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Sums of what each cell has over spans of them."""
    total = np.concatenate([np.zeros((1, *each.shape[1:])), np.cumsum(each, axis=0)])
    return total[spans[:, 1]] - total[spans[:, 0]]
