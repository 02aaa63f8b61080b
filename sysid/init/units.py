"""Numbers of a log -> the units they are in."""

from __future__ import annotations

import numpy as np

from ..errors import LogError
from ..full_turns import TURN
from ..log import DEGREES
from ..units import ANGLES, DEGREE, in_millimetres
from .guess import Guess
from .logged import Logged, Signals
from .words import UNITS, words

# Robots are logged at 5 to 5000 Hz: from the slowest to the fastest is a factor of 1000, as from a
# unit of time to the next, so that one unit alone brings any step in there.
_STEPS = (2e-4, 2e-1)  # s
_SLOWEST = 10.0  # s from sample to sample, of a clock whose start tells its unit
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_EPOCH = (0.9e9, 4.2e9)  # s since 1970: the years 1998 to 2103
_DIGITS = 3  # of a rate that speeds tell
_ALOHA, _ALOHA_RATE = "observations/qpos", 50.0  # Hz: DT = 0.02 s in ALOHA's constants
_COUNTS = (
    "0, 1, 2 ... may be the samples' numbers: then state their rate, `sysid init --rate HZ`, or "
    "write data.rate in place of data.columns.time"
)
_AS_MM = "as mm they are within the URDF's limits, and far beyond as m"
_OFTEN = 15.0  # times the angles of another log, as degrees are 57 times rad
_WHOLE = 50.0  # counts: angles in degrees that are whole numbers by chance reach no more values


def time_unit(t, column: str) -> Guess:
    """The unit of a clock t (n,) as logged, by its column's name, else by its numbers."""
    named = next((UNITS["time"][word] for word in words(column) if word in UNITS["time"]), "")
    step = float(np.median(np.diff(t)))
    key = "data.units.time"
    if named:
        return Guess(key, named, f"the column is called {column}: steps of {step:.6g} {named}")
    for unit, per in _PER_SECOND.items():
        # a clock of 3 s in ns reads like one of 1970 in s, but for its steps
        if _EPOCH[0] <= float(t[0]) / per <= _EPOCH[1] and step / per < _SLOWEST:
            return Guess(key, unit, f"the stamps count {unit} from 1970")
    for unit, per in _PER_SECOND.items():
        if _STEPS[0] <= step / per < _STEPS[1]:
            why = f"steps of {step:.6g} {unit}, {per / step:.4g} Hz"
            return Guess(key, unit, why, _COUNTS if _counted(t) else "")
    return Guess(key, "s", f"steps of {step:.6g}", "no unit makes a robot's rate of that")


def _counted(t) -> bool:
    """Whether a clock counts samples: 0, 1, 2 ..."""
    return bool(t[0] in (0.0, 1.0) and np.all(np.diff(t) == 1.0))


def seconds(t, samples: int, clock: str | None, said: dict) -> float:
    """How long a log is [s].

    Args:
        t: (n,) as logged, or None. clock: its unit where the format says it. said: {key: value} of
        what was guessed.
    """
    if "data.rate" in said:
        return samples / said["data.rate"]
    steps = np.diff(t)
    # episodes begin anew
    return float(np.sum(steps[steps > 0])) / _PER_SECOND[said.get("data.units.time") or clock]


def position_unit(
    q: dict[str, np.ndarray], slides: dict[str, bool], limits: dict[str, tuple], named: str
) -> Guess:
    """The unit of angles, from the largest of them; of a robot that only slides that of lengths.

    Args:
        q: {joint: (n,) as logged}. slides: {joint: whether it is prismatic}. limits: {joint: (low,
        high) [rad or m], infinite where it has none}. named: as the columns' names say.

    Raises:
        LogError: they are counts of an encoder, of which nobody knows how many make a turn.
    """
    key = "data.units.position"
    turning = {joint: values for joint, values in q.items() if not slides[joint]}
    if not turning:
        why = "the joints slide" + ("" if named else " and no name says another")
        return Guess(key, "m" if named in ANGLES else named or "m", why)
    if named == "counts" or all(_counts(values) for values in turning.values()):
        joint, values = next(iter(turning.items()))
        shown = f"{values.min():.0f} to {values.max():.0f}"
        raise LogError(
            f"the angle of {joint!r} is whole numbers from {shown}, counts of an encoder",
            allowed="rad, deg or turns",
            do="log 2 pi / (counts a turn) * (count - count at zero), of the joint",
        )
    if named in ANGLES:
        return Guess(key, named, f"the columns' names say {named}")
    largest = {joint: float(np.abs(values).max()) for joint, values in turning.items()}
    joint = max(largest, key=largest.get)
    if largest[joint] > DEGREES:
        turns = largest[joint] / TURN
        why = f"{joint} reaches {largest[joint]:.4g}, which in rad would be {turns:.2g} turns"
        far = [own for own, size in largest.items() if size > DEGREES]
        if not any(np.isfinite(limits[own]).all() for own in far):
            doubt = "write deg if these are degrees"
            return Guess(key, "rad", f"{why}, and it may turn without end", doubt)
        moving = [own for own, values in turning.items() if np.ptp(values) > 0.0]
        if len(moving) > 1 and len(far) == 1:  # of an arm in degrees more go so far
            doubt = "it alone: if its angle is in degrees, and the others' are in rad, write "
            doubt += f"{{{joint}: {{ITS COLUMN: {DEGREE}}}}} as data.position; deg if all are"
            return Guess(key, "rad", why, doubt, joint)
        return Guess(key, "deg", why, "write rad if a joint really makes many turns")
    return Guess(key, "rad", f"the largest angle is {largest[joint]:.3g}")


def millimetres(q: dict[str, np.ndarray], slides: dict[str, bool], limits: dict) -> list[str]:
    """The sliding joints whose positions are within their limits as mm, and far beyond as m."""
    return [j for j, values in q.items() if slides[j] and in_millimetres(values, *limits[j])]


def in_mm(joints: list[str], columns: dict[str, str]) -> list[Guess]:
    """That positions of sliding joints are in mm, beside angles in a unit of their own."""
    said = {joint: {columns[joint]: 1e-3} for joint in joints}
    return [Guess("data.position", said, _AS_MM)] if said else []


def mixed(data: list[Logged], turning: list[str]) -> str:
    """What to say where the angles of some logs seem to be in degrees and others' in rad."""
    sizes = {one.name: np.array([np.abs(one.q[j]).max() for j in turning]) for one in data}
    far = {name: size for name, size in sizes.items() if size.max(initial=0.0) > DEGREES}
    near = {name: size for name, size in sizes.items() if name not in far}
    if not far or not near:
        return ""
    usual = [np.median(list(part.values()), axis=0) for part in (far, near)]
    moves = usual[1] > 0.0
    if not moves.any() or np.median(usual[0][moves] / usual[1][moves]) < _OFTEN:
        return ""
    return (
        f"the angles of {', '.join(far)} are many times those of {', '.join(near)}: if these are "
        "in rad, bring all logs to one unit"
    )


def _counts(values) -> bool:
    return bool(np.ptp(values) > _WHOLE and np.all(values == np.round(values)))


def rate_of(q: dict[str, np.ndarray], qd: dict[str, np.ndarray]) -> float | None:
    """Samples a second of a log without a clock, from angles and speeds in the same unit: the rate
    at which the speeds integrate to the angles. None where nothing moves or they do not agree.

    Least squares of mean speed times step against the angle's step, over all joints.
    """
    dq = np.concatenate([np.diff(values) for values in q.values()])
    mean = np.concatenate([0.5 * (v[1:] + v[:-1]) for v in (qd[joint] for joint in q)])
    both = float(dq @ mean)
    if both <= 0.0 or both**2 < 0.5 * float(dq @ dq) * float(mean @ mean):
        return None
    return float(mean @ mean) / both


def clock(data: list[Logged], found: Signals, stated: float | None) -> list[Guess]:
    """The column of time and its unit, or the rate of logs without one."""
    if stated is not None:
        return [Guess("data.rate", stated, "stated with --rate")]
    if found.time is not None:
        own = found.time == data[0].table.usual.get("time")
        why = "the clock of the log's format" if own else "its name says so"
        out = [Guess("data.columns.time", found.time, why)]
        named = data[0].table.titled(found.time)
        return out if own and data[0].table.clock else [*out, time_unit(data[0].t, named)]
    if (rate := data[0].table.rate) is not None:
        return [
            Guess("data.rate", rate, "the logs have no clock; an attribute of the file says so")
        ]
    rates = [rate for one in data if one.qd and (rate := rate_of(one.q, one.qd))]
    if rates:
        rate = float(f"{np.median(rates):.{_DIGITS}g}")
        why = "the logs have no clock; at this rate the logged speeds lead from angle to angle"
        return [Guess("data.rate", rate, why)]
    if data[0].table.usual.get("position") == _ALOHA:
        why = "the logs have no clock; ALOHA takes 50 samples a second"
        return [Guess("data.rate", _ALOHA_RATE, why, "state another with --rate")]
    raise LogError(
        "no column is a clock, and nothing tells the rate",
        where=data[0].name,
        allowed="a column t, time or timestamp",
        do="state the rate with --rate HZ",
    )
