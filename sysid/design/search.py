"""Many starts, in several processes: random motions, and searches from the best of them.

Each start has a random stream of its own, and searches go on in slices that all of them share out, those
that are behind no further: the same seed gives the same motion whatever the number of processes, and
Ctrl-C keeps the best motion of the slices that have ended.

Source: Karnin, Koren & Somekh 2013 (successive halving).
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from itertools import chain, repeat

import numpy as np
from joblib import Parallel, cpu_count, delayed

from ..threads import single_threaded
from ..warned import warn
from . import solve
from .fourier import Fourier
from .problem import Problem, drawn, rests
from .solve import Climb, Found

_ROUNDS = (1, 2, 4, 8)  # of the slowest harmonic
DRAWN = 4  # random motions for each number of rounds
_DRAWS = 20  # more for each, where links touch in the pose that it is about
MANEUVERS = 0.4  # of the time: what maneuvers have where they are tried
_OF_EACH = 2  # of which so many begin a search
_GO_ON = (4, 2, 1)  # searches that go on after one slice, two, three: the last to its end
_CLEAR = 1.0  # of its worth: less is what one start is above another
_WORTH = 8.0  # s of work from which others help: a process takes two to begin
_SLICE = 12  # linear programs, less than a second or two


def searched(
    problem: Problem, pose, fastest: float, seed: int, *, processes: int | None = None,
    tell: Callable[[str, float], None] = lambda stage, share: None,
) -> tuple[Found | None, float]:  # fmt: skip
    """The best motion of all starts, None where no start keeps to the limits; and log det M of the
    best random one.

    Args:
        pose: (dof,) about which motions begin. fastest [Hz]: harmonics stay below. processes: as
            many as there are cores, where it is None.
    """
    work = _shared(1)
    asked = _starts(problem, pose, fastest, seed)
    starts = [found for found in work(start, asked) if np.isfinite(found.value)]
    random_best = max((f.log_det for f in starts if not f.family.maneuvers), default=-np.inf)
    if kinds := problem.known.maneuvers:
        family = problem.family.followed_by(kinds, problem.known.joints, MANEUVERS, fastest)
        asked = _starts(problem.of(family), pose, fastest, seed)
        starts += [found for found in work(start, asked) if np.isfinite(found.value)]
    climbs = begun = [Climb(found.family, found.z) for found in promising(starts)]
    try:
        for climbs in raced(problem, begun, processes):
            tell("design", float(np.mean([climb.share for climb in climbs])))
    except KeyboardInterrupt:
        said = "stopped before the search had ended: this is the best motion so far"
        warn(said)
    starts += work(solve.ended, [(problem, climb) for climb in climbs])
    plain = [found for found in starts if not found.family.maneuvers]
    best = max(starts, key=lambda found: found.value, default=None)
    simple = max(plain, key=lambda found: found.value, default=best)
    # what maneuvers add must be more than where searches happen to end
    best = best if best is None or best.value > simple.value + _CLEAR else simple
    if best is None:
        return None, random_best
    # the one that is played is looked at closely
    (last,) = work(Found.of, [(problem.of(best.family), best.z, 1)])
    return (last if np.isfinite(last.value) else None), random_best


def promising(starts: list[Found]) -> list[Found]:
    """The best random motions of each number of rounds: what a start is worth says little of where it leads,
    how often it goes round says much. Where some have maneuvers, which are asked for, fewer without."""
    asked, out = any(one.family.maneuvers for one in starts), []
    for one in sorted(starts, key=lambda found: -found.value):
        count = _OF_EACH if bool(one.family.maneuvers) == asked else 1
        if sum(other.family == one.family for other in out) < count:
            out.append(one)
    return out


def raced(
    problem: Problem, climbs: list[Climb], processes: int | None = None
) -> Iterator[list[Climb]]:
    """Searches that go on slice by slice, fewer and fewer: those that are worth most by then.

    Args:
        processes: that share them, as many as there are cores where it is None.
    """
    work, slices = _shared(1), sum(solve.STEPS) / _SLICE
    if climbs:
        begun = time.perf_counter()
        first = work(solve.climbed, [(problem, climbs[0], _SLICE)])
        more = len(climbs) + sum(_GO_ON[:-1]) + slices * _GO_ON[-1]
        if (time.perf_counter() - begun) * more > _WORTH:
            work = _shared(min(cpu_count() if processes is None else processes, len(climbs)))
        rest = work(solve.climbed, [(problem, climb, _SLICE) for climb in climbs[1:]])
        climbs = _leading(first + rest, _GO_ON[0])
        yield climbs
    for count in chain(_GO_ON[1:], repeat(_GO_ON[-1])):
        if all(climb.over for climb in climbs):
            return
        climbs = work(solve.climbed, [(problem, climb, _SLICE) for climb in climbs])
        climbs = _leading(climbs, count)
        yield climbs


def _leading(climbs: list[Climb], count: int) -> list[Climb]:
    """The best without maneuvers and with them, which tell little until they have found their sizes."""
    out: list[Climb] = []
    for one in sorted(climbs, key=lambda climb: -climb.merit):
        alike = sum(bool(other.family.maneuvers) == bool(one.family.maneuvers) for other in out)
        if alike < count:
            out.append(one)
    return out


def _starts(problem: Problem, pose, fastest: float, seed: int) -> list[tuple]:
    """What `start` is asked for: of as many rounds one problem, that its bases are made once."""
    own = [problem.with_rounds(r) for r in rounds(problem.family, fastest)]
    return [(one, pose, (seed, one.family.rounds, k)) for one in own for k in range(DRAWN)]


def rounds(family: Fourier, fastest: float) -> list[int]:
    """Numbers of rounds with which no harmonic is above a frequency [Hz]; one at least."""
    return [r for r in _ROUNDS if r * family.harmonics / family.time <= fastest] or [1]


def start(problem: Problem, pose, seed: tuple[int, int, int]) -> Found:
    """A random motion of seed[1] rounds that keeps to the limits, as large as they let it: of the poses that
    an arm may be drawn about, links touch in two of three."""
    posed, rng = problem.with_rounds(seed[1]), np.random.default_rng(seed)
    z = drawn(posed, pose, rng)
    for _ in range(_DRAWS):
        if rests(posed, z):
            break
        z = drawn(posed, pose, rng)
    return Found.of(posed, z)


def _shared(processes: int) -> Callable[[Callable, list[tuple]], list]:
    """work(function, arguments) -> results, in order."""
    if processes == 1:
        return lambda work, asked: [_alone(os.getpid(), work, *one) for one in asked]
    parallel = Parallel(n_jobs=processes, max_nbytes=None)
    return lambda work, asked: parallel(delayed(_alone)(os.getpid(), work, *one) for one in asked)


def _alone(owner: int, work: Callable, *arguments):
    """A piece of work in a process that leaves Ctrl-C to its owner."""
    if os.getpid() != owner:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return single_threaded(work)(*arguments)
