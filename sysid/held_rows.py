"""Values that only repeat those of the row before while the robot moves. Where angles and torques do,
nothing arrived: these rows are no samples, and are left out. Torque alone came at a rate of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from .motor_side import command_name
from .outliers import SHORT, quantum, runs
from .recording import Recording
from .repeats import held_angle
from .resampling import moved
from .segment import gaps
from .warned import warn

_OFTEN = 0.25  # of the rows: what comes so often is how a log was written
_GRAINS = 2.5  # of a torque's grain: two and the rounding; less is how coarse values move
_REGULAR = 0.8  # of the new values: coarse ones alike by chance come after any number of rows


def without_held(samples: Recording) -> Recording:
    """Samples without rows in which nothing came, which is told."""
    q, tau = samples.signals["q"], samples.signals["tau"]
    if len(q) < SHORT:
        return samples
    apart = _apart(samples)
    again = _again(np.column_stack([q, tau]), apart)
    if (every := _every(again)) > 1:
        step = every * float(np.median(np.diff(samples.t)))
        warn(
            f"{samples.where}: new values come every {every} rows ({step:.3g} s): the rows between "
            "only repeat them, and are left out",
            above=2,
        )
        return without_held(_with(samples, _one_of(again, every, every + 1)))
    went_on = _went_on(q, again, apart)
    if not went_on:
        return samples
    kept = np.ones(len(q), dtype=bool)
    for a, b in went_on:
        kept[a : b + 1] = False
    count = len(q) - int(kept.sum())
    if count > _OFTEN * len(q):
        every = max(round(len(q) / np.sum(~again)), 2)
        longest = max(b - a + 1 for a, b in went_on)
        warn(
            f"{samples.where}: new values come every {every} rows on average, {longest + 1} at most: the "
            "rows between only repeat them, and are left out",
            above=2,
        )
        return _with(samples, _one_of(again, every, longest))
    warn(
        f"{samples.where}: {count} rows, {len(went_on)} times, only repeat the row before while the "
        f"robot moves, the first at {samples.t[went_on[0][0]]:.4g} s: messages that did not arrive, "
        "which are left out",
        above=2,
    )
    return _with(samples, kept)


def dropouts(q, tau, apart) -> list[tuple[int, int]]:
    """First and last rows of runs in which neither angles nor torques (n, dof) came while the robot
    moved; none of a log that was written faster than its values came, however regularly. apart: rows
    before which a recording breaks off or has a gap."""
    if len(q) < SHORT:
        return []
    again = _again(np.column_stack([q, tau]), apart)
    found = _went_on(q, again, apart) if _every(again) < 2 else []
    return found if sum(b - a + 1 for a, b in found) <= _OFTEN * len(q) else []


def _went_on(q, again, apart) -> list[tuple[int, int]]:
    """As `dropouts`, by the rows (n - 1,) that are the one before `again`."""
    # the sample and its repeats; of numbers that nothing rounds next to none comes again
    found = {(a, b + 1) for a, b in runs(again)}
    if not found:
        return []
    # a joint at least went on as it came, and made up for it at once
    went_on = sorted(found & {run for own in q.T for run in held_angle(own, again)})
    return [(a + 1, b) for a, b in went_on if not np.any((apart > a) & (apart <= b + 1))]


def at_own_times(samples: Recording, joints: Sequence[str]) -> Recording:
    """Samples with torque that came more seldom than angles, and was held, as it was in the rows
    between: on average it is read half a hold late. What came nearest is moved along its slope.
    """
    t, tau = samples.t, samples.signals["tau"]
    if len(t) < SHORT:
        return samples
    apart, out, told = _apart(samples), tau.copy(), {}
    ends = [0, *apart, len(t)]
    # what a drive's command makes is held as the drive holds it
    made = [f"signals.{command_name(joint)}" in samples.signals for joint in joints]
    for j, own in enumerate(tau.T):
        again = _again(own, apart)
        if made[j] or (every := _of_torque(own, again)) < 2:
            continue
        told.setdefault(every, []).append(joints[j])
        new = np.flatnonzero(np.append(True, ~again))
        step = every * float(np.median(np.diff(t)))
        for first, last in pairwise(ends):
            fresh = new[(new >= first) & (new < last)]
            if len(fresh) > 2:
                here = slice(first, last)
                out[here, j] = moved(t[fresh], own[fresh, None], t[here], step)[:, 0]
        for a, b in runs(again):
            if b - a + 1 > every + 1:  # rest, or nothing arrived: as it was, for who looks for that
                out[a : b + 2, j] = own[a : b + 2]
    for every, names in told.items():
        warn(
            f"{samples.where}: the torque of {', '.join(names)} is new every {every} rows only and held "
            "between, which reads it late: there what came nearest is moved along its slope; where "
            "the drive held it so, write `resampling: held` under `data:`",
            above=2,
        )
    return replace(samples, signals=samples.signals | {"tau": out}) if told else samples


def seldom(samples: Recording) -> bool:
    """Whether the values of a log, or a joint's torque, come more seldom than its rows."""
    q, tau = samples.signals["q"], samples.signals["tau"]
    if len(q) < SHORT:
        return False
    apart = _apart(samples)
    return _every(_again(np.column_stack([q, tau]), apart)) > 1 or any(
        _of_torque(own, _again(own, apart)) > 1 for own in tau.T
    )


def _again(values, apart) -> np.ndarray:
    """(n - 1,) bool: rows (n, ...) whose values are those of the one before, in one go."""
    same = np.diff(values, axis=0) == 0.0
    again = same if same.ndim == 1 else same.all(axis=1)
    again[apart - 1] = False
    return again


def _of_torque(own, again) -> int:
    """As `_every`, of a joint's torque (n,); coarse values repeat as they come, and come in all rows."""
    jump = np.median(np.abs(np.diff(own))[~again]) if not again.all() else 0.0
    return 1 if jump < _GRAINS * quantum(own) else _every(again)


def _apart(samples: Recording) -> np.ndarray:
    """The rows before which a recording breaks off or has a gap."""
    return np.union1d(samples.breaks, gaps(samples.t)).astype(int)


def _every(again) -> int:
    """Rows from one new value to the next of rows (n,) that are the one before `again`: of a log
    that was written faster than its values came; one of any other."""
    steps = np.diff(np.flatnonzero(np.append(True, ~again)))
    if len(steps) < SHORT:
        return 1
    usual = int(np.median(steps))
    late = 1 if usual > 2 else 0  # rows that a value may come early or late
    return usual if np.mean(np.abs(steps - usual) <= late) > _REGULAR else 1


def _one_of(again, every: int, longest: int) -> np.ndarray:
    """One of each `every` rows (n,): the new ones, and where none came for longer than so many rows,
    as at rest, those that would have been."""
    kept = np.append(True, ~again)
    for a, b in runs(again):
        if b - a + 1 > longest:
            kept[a + every : b + 2 : every] = True
    return kept


def _with(samples: Recording, kept) -> Recording:
    """Samples with those rows (n,) alone that are kept."""
    place = np.cumsum(kept) - kept  # how many of the rows before each are kept
    signals = {name: values[kept] for name, values in samples.signals.items()}
    breaks = place[samples.breaks]
    return replace(samples, t=samples.t[kept], signals=signals, breaks=breaks, empty=())
