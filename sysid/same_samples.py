"""Whether logs hold the same samples. Noise keeps two measurements apart: a torque that is another log's to the last digit, sample
by sample, was not measured in both."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

NOT_HELD_OUT = "is not held out"  # an error, in whatever says so
_FEWEST = 50  # rows in a row that no chance makes equal
_MOST = 0.5  # of the rows that two logs have beside each other


@dataclass(frozen=True)
class Sampled:
    """One log's samples, each as one number.

    name: of the log; part: "train" or "test". rows: how many there are. once (k,), at (k,): the torques that it has once, ascending,
    and their rows. angles (n,): of each row. t (n,) [s].
    """

    name: str
    part: str
    rows: int
    once: np.ndarray
    at: np.ndarray
    angles: np.ndarray
    t: np.ndarray


@dataclass(frozen=True)
class Same:
    """Logs whose torque is, sample by sample, that of another log that stands before them.

    first: that log; others: they. moved: whether their angles differ, else they are the same samples. rows: of the first of
    the others. since: when [s] they begin on its clock.
    """

    first: Sampled
    others: tuple[Sampled, ...]
    moved: bool
    rows: int
    since: float


def sampled(name: str, part: str, stretches: Sequence) -> Sampled:
    """Samples of a log.

    Args:
        stretches: each with t (n,) [s], q and tau (n, dof).
    """
    t, q, tau = (np.concatenate([getattr(own, word) for own in stretches]) for word in ("t", "q", "tau"))
    once, at, count = np.unique(_numbers(tau), return_index=True, return_counts=True)
    return Sampled(name, part, len(t), once[count == 1], at[count == 1], _numbers(q), t)


def same(logs: Sequence[Sampled]) -> Iterator[Same]:
    """Which of some logs, in order, hold what another does."""
    every, whose = np.concatenate([one.once for one in logs]), np.repeat(np.arange(len(logs)), [len(one.once) for one in logs])
    order = np.argsort(every, kind="stable")
    (twice,) = np.nonzero(np.diff(every[order]) == 0.0)
    asked = np.unique(whose[order][np.concatenate([twice, twice + 1])]) if len(twice) >= _FEWEST else ()
    taken: dict[tuple[int, bool, str], list] = {}
    for k in asked:
        for first in asked:
            if first >= k:
                break
            if found := _beside(logs[first], logs[k]):
                rows, moved, since = found
                taken.setdefault((first, moved, logs[k].part), []).append((logs[k], rows, since))
                break
    for (first, moved, _), own in taken.items():
        yield Same(logs[first], tuple(one for one, *_ in own), moved, *own[0][1:])


def _beside(one: Sampled, other: Sampled) -> tuple[int, bool, float] | None:
    """How many rows two logs share, whether the angles differ there, and when [s] these begin in the second; None where they do not."""
    _, a, b = np.intersect1d(one.once, other.once, assume_unique=True, return_indices=True)
    if len(a) < _FEWEST:
        return None
    rows, beside = one.at[a], other.at[b]
    later, count = np.unique(beside - rows, return_counts=True)
    by, most = int(later[np.argmax(count)]), int(count.max())
    reached = (one.at + by >= 0) & (one.at + by < other.rows)
    if most < max(_FEWEST, _MOST * reached.sum()):
        return None
    rows = rows[beside - rows == by]
    moved = np.mean(one.angles[rows] != other.angles[rows + by]) > _MOST
    return most, bool(moved), float(other.t[rows.min() + by])


def _numbers(values) -> np.ndarray:
    """Each row of values (n, k) as one number (n,); equal where all of a row are."""
    weights = np.random.default_rng(0).uniform(1.0, 2.0, np.shape(values)[1])
    return (np.asarray(values) * weights).sum(axis=1)


def told(found: Same) -> str:
    """In words."""
    names = ", ".join(one.name for one in found.others)
    test = found.others[0].part == "test"
    if found.moved:
        held = f"; an error on them {NOT_HELD_OUT}" if test and found.first.part == "train" else ""
        return f"the torque of {names} is that of {found.first.name} sample by sample, while the angles differ: a command that was played again, or a copied column, and no measurement{held}"
    hold = "holds" if len(found.others) == 1 else "hold"
    if test and found.first.part == "train":
        return f"{names} {hold} samples of the training log {found.first.name}, {found.rows} of them from {found.since:.4g} s on: an error on them {NOT_HELD_OUT}"
    return f"{names} {hold} samples of {found.first.name}: they count twice"
