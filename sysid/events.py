"""Log -> events: what disturbed it and is no motion of its robot.

Found before the experiment's model is fitted, told, and left out.

knock       several joints pulsed or rang at once, for tens of milliseconds: a hit, a bump
spike       a sample or a few of one joint's torque stand alone
brake       one joint's torque repeats exactly while it rests: not the torque that holds it
frozen      one joint's torque or angle repeats exactly while it moves: the reading stood still
missing     one joint's torque never changes though it moves, or is 0 for a while
unwritten   no torque of a joint was written for a while; empty: in a sample or a few
saturation  as frozen, at the highest or lowest torque of the log: told, but not left out
glitch      a sample or a few of an angle stand alone: told, and what is about them in their place
slip        an angle steps between two samples as no motion does: told, and taken out of the angle
mask        no event: a stretch that the user leaves out (`masks`)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .knocks import knocks
from .outliers import spikes
from .repeats import held_angle, held_torque, rests
from .segment import Segment

WORDS = {
    "knock": "knock", "spike": "torque spike", "brake": "closed brake", "frozen": "frozen value",
    "missing": "missing torque", "unwritten": "stretch without torque",
    "empty": "empty sample of torque",
    "saturation": "flat top", "glitch": "angle spike", "slip": "step of an angle", "mask": "masked stretch",
}  # fmt: skip
KINDS = tuple(WORDS)
_OUT = "taken out of the angle"
#: told alone: no row is left out for them
TOLD = {"saturation": "not left out", "slip": _OUT, "glitch": _OUT}
#: a sample or a few, in whose place a straight line stands
MENDED = ("spike", "empty")
#: what no log can keep
UNWRITTEN = ("unwritten", "empty")
_PASSES = 3  # over the spikes: without the largest, those beside them stand out
_SHOWN = 4  # times of each kind and log that a notice gives
_AGAIN = 4  # knocks of a joint in one part of an experiment: more than accidents


@dataclass(frozen=True)
class Event:
    """What disturbed `joints` of `log`, from `start` to `stop` [s] on the log's own clock.

    kind: one of KINDS. signal: "torque", "position" or "both".
    """

    kind: str
    log: str
    start: float
    stop: float
    joints: tuple[str, ...]
    signal: str = "torque"


def find(
    segment: Segment, joints: Sequence[str], *, log: str = "", among: int = 1, angles=None
) -> tuple[Event, ...]:
    """The events of a segment, in order of time.

    Args:
        segment: a stretch of a log. joints: its joints' names, in order. log: the log's name.
        among: how many parts its log has that are looked at by themselves: a false event is as
            seldom in all of them as in a log that is looked at as one.
        angles: (n, dof) without their slips, by default the segment's.
    """
    found: list[Event] = []

    def tell(kind: str, first: int, last: int, members, signal: str = "torque") -> None:
        start, stop = float(segment.t[first]), float(segment.t[last])
        found.append(Event(kind, log, start, stop, tuple(joints[j] for j in members), signal))

    calm = segment.tau
    for _ in range(_PASSES):
        more = [(j, *run) for j, own in enumerate(spikes(calm, among=among)) for run in own]
        if not more:
            break
        for j, first, last in more:
            tell("spike", first, last, [j])
        calm = mended(segment, found, joints)
    usual = float(np.sqrt(np.mean(np.diff(segment.q, axis=0) ** 2, axis=0)).max())
    for j in range(len(joints)):
        tau, q = segment.tau[:, j], segment.q[:, j]
        for first, last in held_torque(tau, segment.step, among=among):
            extreme = tau[first] != 0.0 and tau[first] in (tau.min(), tau.max())  # no limit is 0
            kind = "brake" if rests(q, first, last, usual) else "frozen"
            kind = "saturation" if extreme else kind
            if kind == "frozen" and tau[first] == 0.0:
                kind = "missing"
            tell(kind, first, last, [j])
        if not tau.any() and segment.tau.any() and rests(q, 0, len(q) - 1, usual):
            tell("brake", 0, len(q) - 1, [j])
        for first, last in held_angle(q):
            tell("frozen", first, last, [j], "position")
    moved = segment.q if angles is None else angles
    struck = knocks(moved, calm, segment.step, spiked=segment.tau, among=among)
    for first, last, members in struck:
        tell("knock", first, last, members, "both")
    return ordered(found)


def clipped(events: Sequence[Event], start: float, stop: float) -> list[Event]:
    """The parts of events that stand between two times [s] on their log's clock."""
    within = [e for e in events if e.stop >= start and e.start <= stop]
    return [replace(e, start=max(e.start, start), stop=min(e.stop, stop)) for e in within]


def joined(events: Sequence[Event], step: float) -> tuple[Event, ...]:
    """Events of a log that was looked at span by span, in order of time: one that goes on in the
    next span, a `step` [s] later, is one."""
    out: list[Event] = []
    last: dict[tuple, int] = {}
    for event in ordered(events):
        key = (event.kind, event.log, event.joints, event.signal)
        before = out[last[key]] if key in last and event.kind != "spike" else None
        if before is not None and 0.0 < event.start - before.stop <= 1.5 * step:
            out[last[key]] = replace(before, stop=event.stop)
            continue
        last[key] = len(out)
        out.append(event)
    return tuple(out)


def ordered(events: Sequence[Event]) -> tuple[Event, ...]:
    """Events in order of time."""
    return tuple(sorted(events, key=lambda event: (event.start, event.stop, event.kind)))


def mended(segment: Segment, events: Sequence[Event], joints: Sequence[str]) -> np.ndarray:
    """Torque (n, dof) with straight lines in place of its spikes: no low-pass spreads those."""
    spiked = [event for event in events if event.kind == "spike"]
    if not spiked:
        return segment.tau
    tau = segment.tau.copy()
    good = usable(segment.t, joints, spiked)
    for own, values in zip(good.T, tau.T):
        values[~own] = np.interp(segment.t[~own], segment.t[own], values[own])
    return tau


def with_clock(found: Sequence[Event], segment: Segment) -> Sequence[Event]:
    """Events of which a knock is as long as the motion about it does not tell the segment's clock:
    the errors of stamps that stay there make of an acceleration several times what they do
    elsewhere."""
    if segment.clock is None or not any(event.kind == "knock" for event in found):
        return found
    t, fast = segment.t, np.concatenate([[False], segment.clock.fast, [False]])
    ends = np.flatnonzero(np.diff(fast))
    runs = np.stack([t[ends[::2]], t[ends[1::2] - 1]], axis=1)
    return [
        _as_long(event, runs, segment.spread) if event.kind == "knock" else event for event in found
    ]


def _as_long(event: Event, runs: np.ndarray, near: float) -> Event:
    """An event as long as those of some runs (k, 2) [s] that come near it, within twice as much."""
    own = runs[(runs[:, 0] <= event.stop + near) & (runs[:, 1] >= event.start - near)]
    start, stop = own[:, 0].min(initial=event.start), own[:, 1].max(initial=event.stop)
    # beyond a period of the usual frequency it is the motion that is fast
    start, stop = max(start, event.start - 2.0 * near), min(stop, event.stop + 2.0 * near)
    return replace(event, start=float(start), stop=float(stop))


def usable(
    t, joints: Sequence[str], events: Sequence[Event], *, angles: float = 0.0, torque: float = 0.0
) -> np.ndarray:
    """Rows (n, dof) bool at times t (n,) that no event reaches, for each joint's equation.

    A knock is in the equations of all joints that bear it, whichever show it, and a wrong angle in
    every joint's. What is MENDED before any filter reaches nothing beside it.

    Args:
        angles, torque: how far [s] the filters of the angles and of the torque see to either side.
    """
    use = np.ones((len(t), len(joints)), dtype=bool)
    place = {joint: j for j, joint in enumerate(joints)}
    for event in events:
        if event.kind in TOLD:
            continue
        of_signal = {"torque": torque, "position": angles, "both": max(angles, torque)}
        reach = 0.0 if event.kind in MENDED else of_signal[event.signal]
        rounding = 1e-9 * max(abs(event.start), abs(event.stop), 1.0)
        first = np.searchsorted(t, event.start - reach - rounding)
        last = np.searchsorted(t, event.stop + reach + rounding, side="right")
        whole = event.kind == "knock" or event.signal == "position"
        own = joints if whole else event.joints
        use[first:last, [place[joint] for joint in own]] = False
    return use


def told(events: Sequence[Event], left_out: float, part: str, joints: int) -> list[str]:
    """What a user is told of the events of a part, "training" or "test".

    Args:
        left_out: the share of the part's rows that does not count for them. joints: how many the
            robot has.
    """
    masked, out = [e for e in events if e.kind not in TOLD], []
    if masked:
        own = [e.kind == "mask" for e in masked]
        why = "masked" if all(own) else "disturbed or masked" if any(own) else "disturbed"
        share = f"{100 * left_out:.1f} % of the {part} rows left out as {why}"
        kept = any(e.kind not in ("mask", *UNWRITTEN) for e in masked) and not any(own)
        keeps = "; preprocess.events: keep keeps them" if kept else ""
        out.append(f"{share}: {_summary(masked)}{keeps}")
        if said := again([j for e in masked if e.kind == "knock" for j in e.joints], joints):
            out.append(f"{said} ({part} logs)")
    said = {
        "saturation": "flat tops of the torque",
        "glitch": "samples of an angle that stand alone, as of a bad encoder or wire",
        "slip": "samples that were taken early or late, or of an encoder that slipped",
    }
    for kind, words in said.items():
        if own := [e for e in events if e.kind == kind]:
            out.append(f"{words}, on {part} logs, {TOLD[kind]}: {_summary(own)}")
    return out


def again(struck: Sequence[str], joints: int) -> str:
    """What may strike where few joints are knocked time and again: `struck` has all joints of every
    knock; empty where none is, or where most of the robot's are, as by somebody who pushes it."""
    if not (who := most_struck(struck, joints)):
        return ""
    most = struck.count(who[0])
    where = " and ".join([", ".join(who[:-1]), who[-1]] if len(who) > 1 else who)
    why = "where nobody pushed, its own play or an end stop strikes, or its gear is soft and rings"
    keep = "a diagnosis with `events: keep` under `preprocess:` can name it"
    return f"{most} knocks are on {where}: {why}; {keep}"


def most_struck(struck: Sequence[str], joints: int) -> list[str]:
    """The joints that are knocked most, where few are time and again; as of `again`."""
    each = {joint: struck.count(joint) for joint in struck}
    most = max(each.values(), default=0)
    near = [joint for joint, count in each.items() if 4 * count > 3 * most]
    if most < _AGAIN or 2 * len(near) > max(joints, 2):
        return []
    return [joint for joint, count in each.items() if count == most]


def _summary(events: Sequence[Event]) -> str:
    out = []
    for kind in KINDS:
        own = [e for e in events if e.kind == kind]
        logs = list(dict.fromkeys(e.log for e in own))
        where = [_where(log, [e for e in own if e.log == log]) for log in logs[:_SHOWN]]
        left = len(logs) - _SHOWN
        more = [f"{left} more log{'s' * (left > 1)}"] if left > 0 else []
        if own:
            words = plural(kind, len(own))
            out.append(f"{len(own)} {words} ({'; '.join(where + more)})")
    return ", ".join(out)


def plural(kind: str, count: int) -> str:
    """The word for so many events of a kind."""
    first, *rest = WORDS.get(kind, kind).split(" of ")
    ending = "" if count == 1 else "es" if first.endswith("ch") else "s"
    return " of ".join([first + ending, *rest])


def _where(log: str, events: Sequence[Event]) -> str:
    joints = list(dict.fromkeys(joint for e in events for joint in e.joints))
    times = [f"{e.start:.4g}" for e in events[:_SHOWN]] + ["..."] * (len(events) > _SHOWN)
    times, on = ", ".join(times), ", ".join(joints[:_SHOWN])
    on += f" and {len(joints) - _SHOWN} more" if len(joints) > _SHOWN else ""
    return f"{log} at {times} s on {on}"
