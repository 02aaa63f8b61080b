"""Stretches of logs during which something is there: when, where it is known what it does; and in the clock of each log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .blocks import by_block
from .motion import Piece

SHORTEST = 1.0  # s: of a stretch


def twice(pieces: Sequence[Piece]) -> bool:
    """Whether two logs of one name have the same times: no stretch of a name tells which."""
    spans: dict[str, dict[int, list[float]]] = {}
    for piece in pieces:
        own = spans.setdefault(piece.source, {}).setdefault(piece.log, [np.inf, -np.inf])
        own[:] = min(own[0], piece.t[0]), max(own[1], piece.t[-1])
    every = [sorted(logs.values()) for logs in spans.values()]
    return any(one[1] > other[0] for logs in every for one, other in zip(logs, logs[1:]))


def stretches(t, logs: Sequence[slice], left, torque) -> np.ndarray:
    """(n,) bool: when a body of a known torque (n, dof) is there, by what is left (n, dof) without it, log by log; a stretch or a gap
    that takes less than what a second of it takes on the average is none.

    Args:
        t: (n,) [s].

    Source: the two-state path of least loss (Viterbi 1967).
    """
    square = np.sum(torque**2, axis=1)
    gain, path = 2.0 * np.sum(left * torque, axis=1) - square, np.zeros(len(t), dtype=bool)
    for rows in (rows for rows in logs if rows.stop - rows.start > 1):
        price = 0.5 * SHORTEST * float(square.mean() / np.median(np.diff(t[rows])))
        without, with_, came = 0.0, 0.0, []  # came: whether the state before was the other one
        for own in gain[rows].tolist():
            came.append((with_ - price > without, without - price > with_))
            without, with_ = max(without, with_ - price), max(with_, without - price) + own
        there = with_ > without
        for k in range(rows.stop - 1, rows.start - 1, -1):
            path[k] = there
            there ^= came[k - rows.start][there]
    return path


def told(rows, there: np.ndarray, pieces: Sequence[Piece]) -> list[str]:
    """Stretches (n,) bool of the rows of a motion as an option of the payload gives them; what goes on to the end of a log goes on
    beyond what a low-pass has of it.

    Args:
        rows: `rows.Rows` of the pieces, those of one log together.
    """
    out = []
    for own in (own for own in by_block(rows.log) if own.stop - own.start > 1):
        name, clock = pieces[rows.piece[own.start]].source, rows.t[own]
        whole = [piece for piece in pieces if piece.log == rows.log[own.start]]
        hidden = (3 + (whole[0].smoother.reach if whole[0].smoother else 0)) * whole[0].step
        first, last = whole[0].t[0] - hidden, whole[-1].t[-1] + hidden
        step = float(np.median(np.diff(clock)))
        begins, ends = (np.flatnonzero(np.diff(there[own].astype(int), prepend=0, append=0) == sign) for sign in (1, -1))
        for a, b in zip(begins, ends):
            start, stop = (first if a == 0 else clock[a]), (last if b == len(clock) else clock[b - 1] + step)
            if stop - start > 0.5 * SHORTEST:
                out.append(f"{name} {start:.2f} {stop:.2f}")
    return out
