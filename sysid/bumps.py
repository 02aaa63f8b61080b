"""Knocks that no signal shows by itself.

An arm that gives way to a push moves smoothly, and a smooth torque drives it: only what its
equations leave is the push. It stands in those of several joints at once and nowhere else, while
what a model lacks on one joint stays in that joint's equation. But a push may drive one joint: what
outweighs in a moment all that is usual in seconds says nothing of how the joint moves otherwise,
as no other moment confirms it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .events import Event
from .listed_effects import build
from .log import Log
from .lowpass import band, lowpassed, stride_of, widest
from .model import Model
from .motion import Motion
from .outliers import BURST, CHANCE, bursts, ratio, surprise
from .plain_model import PLAIN
from .projection import inverted
from .robot import Robot
from .rows import Rows, measured, telling
from .running import running
from .specs import EffectSpec
from .stretches import stretches

_NEARBY = 0.5  # s to either side whose median a burst must exceed
_OFTEN = 3.0  # s of log to a burst: what comes more often is how the machine moves, and no accident
_SHARE = 0.2  # of how far torque goes within twice a burst's time: of a quick move less is left
_FEWEST = 50  # rows of a joint that have a usual
_WHITE = 0.706  # z75 - z50 of a normal variable's size over its median
_PASSES = 2  # the second with every joint weighted by what the first leaves


def bumps(robot: Robot, logs: Sequence[Log], *, among: int = 1) -> list[Event]:
    """The knocks of logs of a robot: in what rigid bodies with friction, fitted to them, leave.

    The size of what is left, under the low-pass of a diagnosis, over the usual: the larger of the
    joint's own and of what is about it. A knock is where it surprises on two joints, or on one if
    its square is more than that of all that is usual on that joint. A quick move among slow ones is
    none, be it that the signals showed it: of how far torque goes meanwhile little is left, as
    equations follow it but for what they lack. Nor is torque at its limit.

    Args:
        logs: with the events that their signals show. among: as of `outliers.spikes`.
    """
    shown = [event for log in logs for event in log.events if event.kind == "knock"]
    # a knock is sudden in all joints as well: it is to be seen where a clock's correction had it
    calm = [
        replace(
            log,
            events=tuple(e for e in log.events if e.kind != "knock"),
            segments=tuple(replace(s, clock=None) for s in log.segments),
        )
        for log in logs
    ]
    cutoff = widest(logs, known=(own_band := band(logs)))
    if (motion := lowpassed(calm, robot.joints, cutoff, known=own_band)) is None:
        return shown
    model = build(robot, [EffectSpec(name=name) for name in PLAIN])
    stride, playing = stride_of(motion, cutoff), set[int]()
    while (seen := _seen(robot, model, motion, stride, shown, among, playing)).often:
        # what a joint does alone time and again is its own: the others say what else there is, two
        # of them at once, and what signals show on it stands
        if not (alone := [j for j in range(robot.dof) if (j,) in seen.members]):
            return shown
        playing.add(max(alone, key=lambda j: seen.members.count((j,))))
        if len(playing) > robot.dof - 2:
            return shown
    found = seen.found
    for event, near in zip(shown, seen.places):
        # where no row counts it costs none
        judged = not any(robot.joints[j] in event.joints for j in playing)
        if not judged or not seen.counted[near].any() or seen.most[near].max() > 0.5 * seen.level:
            found = _merged(found, event)
    return found


@dataclass(frozen=True)
class _Seen:
    """Bursts of logs: the events that they make, and the joints of each; `often` if they come too
    often. places: rows (n,) about each event that signals show. counted (n, dof) bool: rows that
    count; most (n, dof): how surprising what is left there is; level: from where on it is."""

    found: list[Event]
    members: list[tuple[int, ...]]
    often: bool
    places: list[np.ndarray]
    counted: np.ndarray
    most: np.ndarray
    level: float


def _seen(
    robot, model: Model, motion: Motion, stride: int, shown, among: int, but: set[int]
) -> _Seen:
    """The greatest bursts first, and the fit made again without them.

    Args:
        but: joints whose equations are not looked at.
    """
    rows, parts = apart(model, motion, stride)
    for j in but:
        rows.use[:, j], rows.tau[:, j], parts[j][1][:] = False, 0.0, 0.0
    step = stride * motion.pieces[0].step
    span = len(rows.t) * step
    level = np.log(span / BURST * robot.dof * among / CHANCE)
    found, kinds, joined = list[Event](), _kinds(motion)[rows.piece], list[tuple[int, ...]]()
    names = [piece.source for piece in motion.pieces]
    counted, most = rows.use.copy(), np.full(rows.use.shape, -1.0)
    source, aside = np.array(names)[rows.piece], np.zeros(len(rows.t), dtype=bool)
    places = [
        (source == e.log) & (rows.t >= e.start - BURST) & (rows.t <= e.stop + BURST) for e in shown
    ]
    for near in places:
        aside |= near  # a fit that has not seen them says whether they follow it
    often = lambda: len(found) * _OFTEN > span  # noqa: E731
    while not often():
        more, strange = _bursts(rows, parts, kinds, aside, step, level, alone=not but)
        most = np.maximum(most, strange)
        for a, b, members in more:
            start, stop = float(rows.t[a]), float(rows.t[b])
            joints = tuple(robot.joints[j] for j in members)
            joined.append(tuple(members))
            # what rings on
            found = _merged(
                found, Event("knock", names[rows.piece[a]], start, stop, joints, "both")
            )
            # what is left of the others is seen without them
            rows.use[a : b + 1], rows.tau[a : b + 1] = False, 0.0
            for _, columns in parts:
                columns[:, a : b + 1] = 0.0
        if not more:
            break
    return _Seen(found, joined, often(), places, counted, most, level)


def _same(events: list[Event], one: Event) -> list[Event]:
    """Those of events which an event overlaps, or follows within a burst."""
    own = [e for e in events if e.log == one.log]
    return [e for e in own if e.start <= one.stop + BURST and one.start <= e.stop + BURST]


def _merged(found: list[Event], event: Event) -> list[Event]:
    """Events, and one more that is one with those near to it."""
    whole = [*_same(found, event), event]
    joints = tuple(dict.fromkeys(joint for e in whole for joint in e.joints))
    start, stop = min(e.start for e in whole), max(e.stop for e in whole)
    rest = [e for e in found if e not in whole]
    return [*rest, replace(event, start=start, stop=stop, joints=joints)]


def _bursts(rows: Rows, parts, kinds, aside, step: float, level: float, alone: bool):
    """First and last row, and joints, of what stands out of what least squares leave; and how
    surprising what is left is (n, dof) where it is no small share of how far torque goes. alone:
    whether one joint may stand out, as its neighbours do not answer to its own blows."""
    left, weights = _left(rows, parts, kinds, aside)
    size, wide = np.abs(left), 2 * max(1, round(2.0 * BURST / step)) + 1
    own = np.stack([_surprise(a, u, rows.piece, step) for a, u in zip(size.T, rows.use.T)], axis=1)
    _spare_limits(own, left, weights, rows, level)
    strange, out = np.full(own.shape, -1.0), []
    for number in np.unique(rows.piece):
        (at,) = np.nonzero(rows.piece == number)
        goes = sum(
            running(np.where(rows.use[at], way * rows.tau[at], -np.inf), wide, "max")
            for way in (1.0, -1.0)
        )
        far = size[at] > _SHARE * weights * np.maximum(goes, 0.0)
        strange[at] = np.where(far & rows.use[at], own[at], -1.0)
        single = _outweighing(own, size, rows.use, at, step, level) if alone else []
        for a, b in [*_together(own[at], step, level), *single]:
            members = np.flatnonzero(own[at[a : b + 1]].max(axis=0) > 0.5 * level)
            tells = strange[at[a : b + 1]].max() > 0.5 * level
            a, b = int(at[a]), int(at[b])
            if tells and not any(a <= last and first <= b for first, last, _ in out):
                out.append((a, b, members.tolist()))
    # the others may be what these bend
    great = [own[a : b + 1].max() for a, b, _ in out]
    return [one for one, size in zip(out, great) if size > 0.5 * max(great)], strange


def _spare_limits(surprises, left, weights, rows: Rows, level: float) -> None:
    """Take from surprises (n, dof), in place, those of bursts in which torque is at its limit.

    What is left (n, dof) says there that torque should have gone further, and it is as great as
    anywhere but for noise: a reading that clips, or a drive that gives no more. A push comes
    wherever torque is.
    """
    for own, rest, tau, use, weight in zip(surprises.T, left.T, rows.tau.T, rows.use.T, weights):
        if not use.any():
            continue
        lower = np.where(tau > 0.0, tau[use].max() - tau, tau - tau[use].min())
        noise = surprise(weight * lower, _WHITE, among=np.abs(rest[use])) < 0.5 * level
        top = (rest * tau < 0.0) & noise
        for number in np.unique(rows.piece):
            (at,) = np.nonzero(rows.piece == number)
            for a, b in bursts(own[at], level):
                whole = at[a : b + 1]
                if top[whole[np.argmax(np.abs(rest[whole]))]]:
                    own[whole] = -1.0


def _together(surprises, step: float, level: float) -> list[tuple[int, int]]:
    """Where two joints surprise (n, dof) at once: within a burst, as each joint's rows may count at
    other moments of it."""
    if surprises.shape[1] < 2:
        return []
    wide = running(surprises, max(1, round(BURST / step)), "max")
    return bursts(np.sort(wide, axis=1)[:, -2], level)


def _outweighing(surprises, size, use, at, step: float, level: float) -> list[tuple[int, int]]:
    """Where a joint's burst, of rows `at`, has a greater square than what is usual on that joint:
    in the time in which one may come, or in all where they come oftener."""
    out = []
    for s, square, rows in zip(surprises.T, np.square(size).T, use.sum(axis=0)):
        every = bursts(s, level)
        calm = np.sum(square) - sum(np.sum(square[a : b + 1]) for a, b in every)
        if len(every) * _OFTEN < rows * step:
            calm *= min(2.0 * _OFTEN / (rows * step), 1.0)
        out += [(a, b) for a, b in bursts(s[at], level) if np.sum(square[at[a : b + 1]]) > calm]
    return out


def apart(model: Model, motion: Motion, stride: int) -> tuple[Rows, list[tuple]]:
    """The rows of a motion without columns, and of each joint the parameters that can enter its
    torque and their columns (support, n), in less memory than all that it has."""
    found = telling(model, motion, measured(motion, stride))
    supports = [model.support(joint) for joint in range(model.robot.dof)]
    columns = [np.zeros((len(support), len(found.tau))) for support in supports]
    for here, parts in stretches(model, motion, stride, keep=False):
        for own, (_, values) in zip(columns, parts):
            own[:, here] = values
    for own, use in zip(columns, found.use.T):
        own *= use
    return found, list(zip(supports, columns))


def _kinds(motion: Motion) -> np.ndarray:
    """(pieces,) number of the levels at which each piece's log is: where these differ, robots may,
    and each has an equation of its own."""
    each = [tuple(sorted(piece.levels.items())) for piece in motion.pieces]
    return np.array([[*dict.fromkeys(each)].index(own) for own in each])


def _left(
    rows: Rows, joints: list[tuple], kind: np.ndarray, aside: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What least squares leave (n, dof), every joint in units of its median, and one over these
    (dof,); of rows of each kind (n,) by itself.

    Args:
        joints: of each, its parameters and their columns (support, n). aside: rows (n,) that are
            foreseen and not fitted.
    """
    weights, left = np.ones(rows.tau.shape[1]), np.zeros(rows.tau.shape)
    every, parts = slice(None), []
    size = 1 + max(int(at.max(initial=-1)) for at, _ in joints)
    for own in (kind == number for number in np.unique(kind)):
        told = own & ~aside
        own, told = (every if part.all() else part for part in (own, told))
        squares, along = np.zeros((len(joints), size, size)), np.zeros((len(joints), size))
        for j, (at, values) in enumerate(joints):
            values = values[:, told]
            squares[j][np.ix_(at, at)] = values @ values.T
            along[j, at] = values @ rows.tau[told, j]
        parts.append((own, squares, along))
    for _ in range(_PASSES):
        for own, squares, along in parts:
            x = inverted(np.tensordot(weights**2, squares, 1)) @ (weights**2 @ along)
            for j, (at, values) in enumerate(joints):
                left[own, j] = rows.tau[own, j] - x[at] @ values[:, own]
        even = (rows.use & ~aside[:, None]).T
        usual = [np.median(np.abs(e[u])) if u.any() else 0.0 for e, u in zip(left.T, even)]
        weights = ratio(np.ones(len(usual)), np.array(usual))
    return left * weights, weights


def _surprise(size, use, piece, step: float) -> np.ndarray:
    """How surprising (n,) sizes are among those that count; less than nothing where none does."""
    out = np.full(len(size), -1.0)
    if use.sum() < _FEWEST:
        return out
    about = np.zeros(len(size))
    for number in np.unique(piece[use]):
        (own,) = np.nonzero(use & (piece == number))
        near = min(2 * round(_NEARBY / step) + 1, len(own))
        about[own] = running(size[own], near, "median", "edge")
    usual = np.median(size[use])
    out[use] = surprise(ratio(size[use], np.maximum(about[use], usual)), _WHITE)
    return out
