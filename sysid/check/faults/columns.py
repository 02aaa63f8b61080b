"""Whether another reading of the columns explains the torque better: order, signs, units."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import combinations, product

import numpy as np

from ...inertials import unmeant
from ...units import ANGLES, TORQUE, of_joint
from .. import written
from ..as_read import left_free
from ..equations import LIKELY, Equations, Reading, Scored
from ..fault import ERROR, WARNING, Fault
from ..look import Look
from ..mounting import gravities

AFTER, SENSELESS = 2, ("wrong_unit", "angle_wrap")
# Log of squares that another reading must take off, in all and of each joint whose column it reads
# otherwise: what is left falls to a third of its power.
_BETTER = 1.0
_LOSES = 0.1  # of that logarithm: by what a joint that hardly tells may seem to lose
_ROUNDS = 4, 8  # at least, and at most: each joint may have one thing in which it differs
_TRIED = 8  # readings that are clear, of which each is a fit
_QUARTERS = (1, 2, -1)  # turns by which a log's zero may be off the URDF's
_EXPLAINS = 0.2  # of a joint's torque squared: less of the URDF's torque tells no factor
# and of so much that a factor, were it free, explains much more
_TAKES, _CLEAR = 0.01, 3.0  # the same; logarithm of the squares that are left
_THOUSAND = (500.0, 2000.0)


def find(look: Look) -> Iterator[Fault]:
    """joint_order, sign_flipped, limit_exceeded, wrong_unit, torque_in_amperes."""
    equations = look.equations
    if equations is None:
        return
    if why := unmeant(look.robot):  # then nothing is held against its masses
        yield Fault(
            "mass_implausible", WARNING, why, "correct it; what a fit finds is the logs' own"
        )
        return
    reading = Reading.plain(look.robot.dof)
    scored, free = equations.scored(reading), cache(partial(left_free, look.seen))
    mounted = gravities(equations)
    turning = np.flatnonzero(~np.asarray(look.robot.prismatic)).tolist()
    for _ in range(np.clip(look.robot.dof, *_ROUNDS)):
        # of joints that hardly move any reading of the columns tells as little
        others = [
            own
            for own in readings(reading, look.robot.dof, turning)
            if any(look.excited[j].enough for j in own[1][1])
        ]
        others += _of_all(
            reading, [j for j in np.flatnonzero(scored.known) if look.excited[j].enough]
        )
        others += [
            (replace(reading, gravity=down), ("mass_implausible", (), down)) for down in mounted
        ]
        tried = [(made, told, equations.scored(made)) for made, told in others]
        # that all masses are as wrong explains as much where nothing has weight
        loose = equations.scored(reading, free=True).loss
        units = ((made, told, equations.scored(made)) for made, told in _in_units(look, reading))
        tried += [own for own in units if own[2].loss < loose - _BETTER]
        tried = [
            (s.loss, made, told, s)
            for made, told, s in tried
            if _clear(scored, s, told[1]) and _masses_tell(free, reading, made, s, *told[1:])
        ]
        # as it is, and in another unit, it may leave the least
        if not tried or loose < min(loss for loss, *_ in tried):
            break
        reading, scored = _likeliest(free, tried)
    for other in _differences(reading):
        yield from written.told(look, reading, *other)
    yield from _factors(look, equations, reading, scored)


def _likeliest(free: Callable, tried: list[tuple]) -> tuple[Reading, Scored]:
    """Of readings (loss, made, told, scored) that are all clear, the one of least loss among those by
    which bodies, whatever these are, explain the torque as well as by any.

    Masses of a URDF are wrong by more than two readings of one column differ: an axis that points the
    other way turns gravity round as another zero does.
    """
    near = sorted(tried, key=lambda one: one[0])[:_TRIED]
    left = [free(made) for _, made, *_ in near] if len(near) > 1 else [0.0]
    _, made, _, scored = next(o for o, own in zip(near, left) if own <= min(left) + _BETTER)
    return made, scored


def readings(
    reading: Reading, dof: int, turning: Sequence[int] = ()
) -> Iterator[tuple[Reading, tuple]]:
    """Readings that differ from one in one thing, with (fault, joints, what).

    Args:
        turning: the joints of which another zero of the angle is asked.
    """
    for i, j in combinations(range(dof), 2):
        angle, torque = _swapped(reading.angle, i, j), _swapped(reading.torque, i, j)
        yield replace(reading, torque=torque), ("joint_order", (i, j), "torque")
        yield replace(reading, angle=angle), ("joint_order", (i, j), "angle")
        yield replace(reading, angle=angle, torque=torque), ("joint_order", (i, j), "")
    for j, quarters in product(turning, _QUARTERS):
        zero = tuple(quarters * np.pi / 2 if k == j else z for k, z in enumerate(reading.zero))
        yield replace(reading, zero=zero), ("limit_exceeded", (j,), quarters)
    for j in range(dof):
        angle, torque = _turned(reading.angle_factor, j), _turned(reading.torque_factor, j)
        yield replace(reading, torque_factor=torque), ("sign_flipped", (j,), "torque")
        yield replace(reading, angle_factor=angle), ("sign_flipped", (j,), "angle")
        yield (
            replace(reading, angle_factor=angle, torque_factor=torque),
            ("sign_flipped", (j,), "angle and torque"),
        )


def _of_all(reading: Reading, joints: Sequence[int]) -> Iterator[tuple[Reading, tuple]]:
    """Readings in which the torques, or the angles, of some joints have the other sign: of all that
    tell, one cause, of which each shows a part."""
    if len(joints) < 2:
        return
    for word in ("torque", "angle"):
        factors = getattr(reading, f"{word}_factor")
        for j in joints:
            factors = _turned(factors, j)
        yield (
            replace(reading, **{f"{word}_factor": factors}),
            ("sign_flipped", tuple(joints), word),
        )


def _in_units(look: Look, reading: Reading) -> Iterator[tuple[Reading, tuple]]:
    """Readings in which the angles of all joints that turn are in another unit, however little they
    move in that of the experiment."""
    data, turns = look.experiment.data, ~np.asarray(look.robot.prismatic)
    own = data.units.position
    # one unit is named for all, and what is a length in it would be another
    if data.position or data.zero or reading.unit or (own not in ANGLES and not turns.all()):
        return
    for unit, size in ANGLES.items():
        if (times := size / ANGLES.get(own, 1.0)) != 1.0:
            scale = tuple(np.where(turns, times, 1.0).tolist())
            yield replace(reading, unit=unit, scale=scale), ("wrong_unit", (), unit)


def _swapped(order, i: int, j: int) -> tuple:
    return tuple(order[{i: j, j: i}.get(k, k)] for k in range(len(order)))


def _turned(factors, j: int) -> tuple:
    return tuple(-f if k == j else f for k, f in enumerate(factors))


def _clear(before: Scored, after: Scored, joints) -> bool:
    known = before.known & after.known
    gain = np.log(before.left / after.left) * known
    if not len(joints):  # all joints feel gravity, and a unit: none loses by it
        return bool(gain.sum() > 2.0 * _BETTER and gain.min() > -_LOSES)
    return bool(gain.sum() > _BETTER * len(joints) and np.all(gain[list(joints)] > 0.0))


def _masses_tell(
    free: Callable, before: Reading, made: Reading, scored: Scored, joints, word
) -> bool:
    """Whether a reading is told by masses where these alone can: with both signs turned friction is as
    it was. They do where the URDF's explain the torque, or where others explain it better so."""
    if word != "angle and torque" or np.all(scored.taken[list(joints)] > _EXPLAINS):
        return True
    return free(made) < free(before) - _BETTER * len(joints)


def _differences(reading: Reading) -> Iterator[tuple[str, tuple[int, ...], str | int]]:
    """In which a reading differs from the experiment's: (fault, joints, what)."""
    orders = {"angle": reading.angle, "torque": reading.torque}
    orders = {"": reading.angle} if reading.angle == reading.torque else orders
    for word, order in orders.items():
        left = {k for k, own in enumerate(order) if own != k}
        while left:
            ring = [min(left)]
            while order[ring[-1]] != ring[0]:
                ring.append(order[ring[-1]])
            left -= {*ring}
            yield "joint_order", tuple(ring), word
    for j, factors in enumerate(zip(reading.angle_factor, reading.torque_factor)):
        turned = [word for word, factor in zip(("angle", "torque"), factors) if factor < 0.0]
        if turned:
            yield "sign_flipped", (j,), " and ".join(turned)
    if reading.unit:
        yield "wrong_unit", (), reading.unit
    if reading.gravity is not None:
        yield "mass_implausible", (), reading.gravity
    for j, zero in enumerate(reading.zero):
        if quarters := round(zero / (np.pi / 2)):
            yield "limit_exceeded", (j,), quarters


def _factors(look: Look, equations: Equations, reading: Reading, scored: Scored) -> Iterator[Fault]:
    """How much larger or smaller the torque is than the URDF's masses ask for."""
    if why := unmeant(look.robot):
        yield Fault(
            "mass_implausible", WARNING, why, "correct it; what a fit finds is the logs' own"
        )
        return
    free = equations.scored(reading, free=True)
    logged = np.any([log.tally.swing > 0.0 for log in look.logs], axis=0)  # else none was
    clear = (free.taken > _TAKES) & (np.log(scored.left / free.left) > _CLEAR)
    tells = logged & free.known & ((free.taken > _EXPLAINS) | clear) & (free.factor > 0.0)
    off = (
        tells
        & ((free.factor < LIKELY[0]) | (free.factor > LIKELY[1]))
        & (np.log(scored.left / free.left) > 0.1)
    )
    # one link's mass may be anything; that of all is a unit, and no link is off by a thousand
    every = off.sum() > 0.5 * tells.sum()
    for j in np.flatnonzero(tells if every else off):
        name, own = look.robot.joints[j], float(free.factor[j])
        says = f"the torque of {name} is {times(own)} what the URDF's masses need"
        thousand = _THOUSAND[0] < max(own, 1.0 / own) < _THOUSAND[1]
        if not (every or thousand):
            if np.log(scored.left[j] / free.left[j]) > _BETTER:
                do = (
                    "is it the motor's, before a gear? give it in N m, on the joint's side; else "
                    "the URDF's masses beyond this joint are far off"
                )
                yield Fault("wrong_unit", WARNING, says, do, name)
            continue
        if thousand:
            do = _thousandth(look, reading, name, own, bool(np.all((off == tells)[tells])))
            yield Fault("wrong_unit", ERROR, says, do, name)
        elif own < 1.0:
            yield Fault(
                "torque_in_amperes",
                ERROR,
                says,
                (
                    "if it is a current set data.units.torque: A and torque_constant, the "
                    "gear's ratio included; or the masses of the robot's file are so much too large"
                    if every
                    else "is it the motor's, before a gear, or a current? give it in N m, on the "
                    "joint's side"
                ),
                name,
            )
        else:
            yield Fault(
                "wrong_unit", ERROR, says, "give it in N m, on the joint's side of the gear", name
            )


def _thousandth(look: Look, reading: Reading, joint: str, factor: float, every: bool) -> str:
    """What to write where torque is a thousand times off: as that of all joints is, or of one."""
    data, slides = look.experiment.data, look.robot.prismatic[look.robot.joints.index(joint)]
    plain = of_joint("N m", prismatic=bool(slides))
    own = joint in data.torque or joint in look.experiment.actuator
    said, size = data.units.torque, TORQUE.get(data.units.torque, 1.0)
    if said not in ("A", "N m", "N") and not own and 0.5 < size / factor < 2.0:
        return f"if it is in {plain}, and not in {said}, set data.units.torque: {plain}"
    if said not in ("N m", "N") or own:
        return f"is it in mN m, or kN m? give it in {plain}"
    unit = ("m" if factor > 1.0 else "k") + plain
    at = look.robot.joints.index(joint)
    column = written.in_order(look, "torque", reading)[at]
    if every and not look.robot.prismatic.any():
        return f"if it is in {unit} set data.units.torque: {unit}"
    if column is None:
        return f"if it is in {unit} give it in {plain}"
    sign = "-" if reading.torque_factor[at] < 0.0 else ""
    scale, how = "0.001" if factor > 1.0 else "1000", "add to" if data.torque else "write"
    return f"if it is in {unit} {how} data.torque: {{{joint}: {{{column}: {sign}{scale}}}}}"


def times(factor: float) -> str:
    """A factor in words, before "what"."""
    digits = lambda number: f"{float(f'{number:.2g}'):.6g}"  # noqa: E731 - 1000, and not 1e+03
    return f"{digits(factor)} times" if factor >= 1.0 else f"1/{digits(1.0 / factor)} of"
