"""What disturbed a log and is no motion of its robot: `sysid.events`, told."""

from __future__ import annotations

from collections.abc import Iterator

from ...held_rows import dropouts
from ...segment import gaps
from ..fault import WARNING, Fault
from ..logged import Logged
from ..look import Look

AFTER, SENSELESS = 0, ()
#: {kind of event: (fault, what it is, what to do)}
_KINDS = {
    "spike": (
        "spikes",
        "the torque of {joint} has spikes of a sample or a few",
        "a fit leaves these samples out; where there are many, mend the reading of the torque",
    ),
    "knock": (
        "knock",
        "the torque leaps as where the arm is pushed or hit, or its own parts strike",
        "a fit leaves these rows out; log again where somebody pushes it often, and write "
        "`events: keep` under `preprocess:` where the machine strikes by itself: play, an end stop",
    ),
    "brake": (
        "brake_closed",
        "the torque of {joint} is held while it rests, as by a closed brake",
        "a fit leaves these rows out; nothing to mend where the joint has a brake",
    ),
    "frozen": (
        "values_held",
        "the reading of {joint} stood still while it moved",
        "a fit leaves these rows out; mend the logger, which writes a value twice",
    ),
    "missing": (
        "effort_missing",
        "the torque of {joint} is 0 for a while in which it moves",
        "a fit leaves these rows out; the drive was off, or its telemetry was lost",
    ),
    "unwritten": (
        "effort_missing",
        "no torque of {joint} was written for a while",
        "a fit leaves these rows out; log it with every sample",
    ),
    "empty": (
        "effort_missing",
        "the torque of {joint} was not written in single samples",
        "a fit leaves these samples out; log it with every sample",
    ),
    "glitch": (
        "spikes",
        "the angle of {joint} has spikes of a sample or a few",
        "a fit takes these samples out but with `events: keep`; look after the encoder's wire",
    ),
    "slip": (
        "clock_jitter",
        "the angle of {joint} steps between two samples, as where one is taken early or late",
        "a fit takes these steps out but with `events: keep`; log when each value was measured",
    ),
    "saturation": (
        "saturation",
        "the torque of {joint} has flat tops at its extreme",
        ("raise the sensor's range or move slower; see the effect torque_saturation"),
    ),
}
_SHOWN = 8
_AGAIN = 0.2  # of the rows: that many which only repeat the row before


def find(look: Look) -> Iterator[Fault]:
    """spikes, knock, brake_closed, values_held, clock_jitter, saturation, effort_missing."""
    for log in look.logs:
        groups: dict[tuple[str, str], list] = {}
        for event in (one for one in log.log.events if one.kind in _KINDS):
            if event.kind == "missing" and _throughout(event, log.log):
                continue  # what moves without any torque is told as a whole
            for joint in event.joints if event.kind != "knock" else ("",):
                groups.setdefault((event.kind, joint), []).append(event)
        for (kind, joint), own in groups.items():
            fault, says, do = _KINDS[kind]
            times = tuple(round(e.start, 6) for e in own[:_SHOWN])
            rows = sum(max(1, round((e.stop - e.start) / log.step) + 1) for e in own)
            shown = ", ".join(f"{at:.4g}" for at in times[:4]) + (", ..." if len(own) > 4 else "")
            yield Fault(
                fault,
                WARNING,
                (
                    f"{says.format(joint=joint)}, {len(own)} time{'s' * (len(own) > 1)} in "
                    f"{log.log.name}, at {shown} s"
                ),
                do,
                joint,
                log.log.name,
                times,
                rows,
            )
        yield from _dropouts(log)
        again = log.tally.again
        share = again.count / max(log.samples - 1, 1)
        if log.tally.travel.any() and share > _AGAIN:
            yield Fault(
                "values_held",
                WARNING,
                (
                    f"{100 * share:.0f} % of the rows of {log.log.name} only "
                    "repeat the row before: it was written faster than it was measured"
                ),
                "log at the rate of the measurement",
                "",
                log.log.name,
                again.times[:1],
                again.count,
            )


def _dropouts(log: Logged) -> Iterator[Fault]:
    """Rows in which nothing came, which are no samples; of a long log in what is shown of it."""
    parts = [(own, dropouts(own.q, own.tau, gaps(own.t))) for own in log.shown]
    found = [(own.t[a], own.t[b]) for own, runs in parts for a, b in runs]
    if not found:
        return
    longest = 1e3 * max(stop - start for start, stop in found)
    yield Fault(
        "values_held",
        WARNING,
        (
            f"all angles and torques of {log.log.name} stay as they were while the robot moves, {len(found)} "
            f"time{'s' * (len(found) > 1)}, for {longest + 1e3 * log.step:.3g} ms at most, first at {found[0][0]:.4g} s: "
            "messages that did not arrive"
        ),
        "a fit leaves these rows out; look for what stalls the logger",
        "",
        log.log.name,
        tuple(round(float(start), 6) for start, _ in found[:_SHOWN]),
        sum(b - a + 1 for _, runs in parts for a, b in runs),
    )


def _throughout(event, log) -> bool:
    """Whether an event is as long as its log."""
    return event.start <= log.segments[0].t[0] and event.stop >= log.segments[-1].t[-1]
