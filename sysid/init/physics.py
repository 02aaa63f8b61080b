"""What the URDF's robot says of units that no name tells: degrees in small motion, and torques that
are no joint's.

A log read as it stands is held against the equations of `sysid check`: the URDF's torque with
masses up to three times off, inertia of motors, friction and a bias.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from .. import check, config
from ..check.equations import LIKELY, Equations, Reading
from ..check.look import Look, looked
from ..errors import LogError
from ..inertials import unmeant
from ..units import DEGREE, of_joint
from ..warned import noticed
from . import shafts
from .guess import Draft, Guess
from .logged import Signals

_BETTER = 1.0  # log of the squares a joint: what is left falls to a third of its power
_TAKES = 0.01  # of a joint's torque squared: less of the URDF's torque tells no factor


def in_degrees(look: Look, *, currents: bool, alone: str = "") -> list[str]:
    """The joints whose angles, taken for rad, explain the torque as degrees, and not as they are:
    all that turn, the one that may be so alone, or none.

    Args:
        currents: the torques may have any factor. Otherwise the URDF's robot must also need more
        torque than there
            is at all, were the angles rad.
        alone: a joint that may be the only one in degrees.
    """
    equations = look.equations
    if equations is None:
        return []
    plain = Reading.plain(look.robot.dof)
    turning = ~np.asarray(look.robot.prismatic)
    joints = np.array(look.robot.joints)
    scored = lambda reading: equations.scored(reading, free=currents)  # noqa: E731
    as_rad, as_deg = scored(plain), scored(_turned(plain, turning))
    least = min(as_deg.loss, as_rad.loss - _BETTER)
    if alone and scored(_turned(plain, joints == alone)).loss < least:
        return [alone]
    if _only_as_rad_within_limits(look)[turning].any():
        return []
    known = as_rad.known & as_deg.known & turning
    gain = np.log(as_rad.left / as_deg.left)[known]
    impossible = (as_rad.left > as_rad.whole)[known]
    if not known.any() or not (currents or np.mean(impossible) > 0.5):
        return []
    return joints[turning].tolist() if gain.sum() > _BETTER * known.sum() else []


def _only_as_rad_within_limits(look: Look) -> np.ndarray:
    """(dof,) whether all of a joint's angles are within its limits as rad, and none as degrees."""
    low, high = look.robot.limits.T
    least = np.min([log.tally.low[0] for log in look.logs], axis=0)
    most = np.max([log.tally.high[0] for log in look.logs], axis=0)
    within = (least >= low) & (most <= high)
    return within & ((DEGREE * most < low) | (DEGREE * least > high))


def torque_unit(look: Look) -> list[Guess]:
    """The unit of torques that are a thousand times what the URDF's masses need, or a thousandth:
    of all joints that tell a factor."""
    if look.equations is None:
        return []
    plain = Reading.plain(look.robot.dof)
    bounded, free = look.equations.scored(plain), look.equations.scored(plain, free=True)
    tells = bounded.known & free.known & (free.factor > 0.0) & (free.taken > _TAKES)
    gain, factor = np.log(bounded.left / free.left)[tells], free.factor[tells]
    large = factor > 1.0
    off = np.abs(np.abs(np.log10(factor)) - 3.0)
    if not tells.any() or gain.sum() < _BETTER * len(gain) or off.max() > np.log10(LIKELY[1]):
        return []
    if large.any() and not large.all():
        return []
    times = "a thousand times what" if large.all() else "a thousandth of what"
    why = f"they are {times} the URDF's masses need"
    doubt = "masses and friction follow it"
    slides = np.asarray(look.robot.prismatic)
    if slides.any() and not slides.all():
        scale = 1e-3 if large.all() else 1e3
        columns = {joint: look.column("torque", joint) for joint in look.robot.joints}
        if None in columns.values():
            return []
        return [Guess("data.torque", {j: {c: scale} for j, c in columns.items()}, why, doubt)]
    unit = ("m" if large.all() else "k") + of_joint("N m", prismatic=bool(slides.all()))
    return [Guess("data.units.torque", unit, why, doubt)]


def _turned(plain: Reading, own: np.ndarray) -> Reading:
    """The reading in which some joints' (dof,) angles are in degrees."""
    return replace(plain, angle_factor=tuple(np.where(own, np.pi / 180.0, 1.0)))


def factors(look: Look, *, certain: bool) -> dict[str, float] | None:
    """Factors that bring the logged torques to the joints' side, by the masses of the URDF; None
    where the torques are the joints' as they are, or where nothing can be told.

    Args:
        certain: the torques are currents. Otherwise most joints must show it: a third of the URDF's
        masses already
            needs more torque than was logged at all, and a smaller factor explains what was.
    """
    equations: Equations | None = look.equations
    if equations is None:
        return None
    plain = Reading.plain(look.robot.dof)
    bounded, free = equations.scored(plain), equations.scored(plain, free=True)
    known = bounded.known & free.known
    if not certain:
        off = (bounded.left > bounded.whole) & (np.log(bounded.left / free.left) > _BETTER)
        if np.sum(off & known) <= 0.5 * np.sum(known):
            return None
    tells = known & (free.factor > 0.0) & (free.taken > _TAKES)
    if not tells.any():
        return None
    own = np.where(tells, 1.0 / np.where(tells, free.factor, 1.0), 0.0)
    usual = float(np.exp(np.median(np.log(own[tells]))))
    return {joint: float(f"{value or usual:.3g}") for joint, value in zip(look.robot.joints, own)}


def held_against(
    out: Draft, found: Signals, folder: Path, wrapped: tuple[str, ...] = (), *, rad: bool = False
) -> Draft:
    """The draft with units that the robot's equations tell, and what `sysid check` finds in it.

    Args:
        wrapped: what is told of angles that jump by a turn; a check that says it too says where.
        rad: that these jumps say that all are in rad.
    """
    path, named = folder / "config.yaml", out.guesses.get("data.units.torque")
    amperes = named if named and named.value == "A" else None
    servos = found.torque.meaning.signal == "command"
    if amperes:  # in N m, until the factors are found
        out = replace(out, guesses={k: g for k, g in out.guesses.items() if g is not amperes})
    with noticed():
        look = looked(config.experiment(out.tree, path))
        why = unmeant(look.robot)  # then no unit is held against it
        if not (why or named or servos or found.torque.meaning.unit) and (
            unit := torque_unit(look)
        ):
            out = out.having(*unit)
            look = looked(config.experiment(out.tree, path))
        angles = out.guesses["data.units.position"]
        small = angles.value == "rad" and not (found.position.meaning.unit or rad or why)
        how = {"currents": amperes is not None or servos, "alone": angles.alone}
        gear = shafts.ratio(look, angles.alone) if small and angles.alone else None
        if small and (turned := [angles.alone] if gear else in_degrees(look, **how)):
            told = shafts.told(look, angles, gear) if gear else _degrees(look, angles, turned)
            if (beside := out.guesses.get(told.key)) and told.key == "data.position":
                told = replace(told, value=beside.value | told.value)
            out = out.having(replace(angles, doubt=""), told)
            look = looked(config.experiment(out.tree, path))
        told = amperes is not None
        scales = None if servos or (why and not told) else factors(look, certain=told)
        if scales:
            out = out.having(*_scaled(amperes, scales, out.guesses["robot.joints"].value))
            look = looked(config.experiment(out.tree, path))
        faults = [fault for fault in check.faults_of(look) if fault.severity == check.ERROR]
    if amperes and scales is None:
        raise LogError(
            "the torques are currents, and the URDF's masses do not tell the drives' factors",
            allowed="columns of torque in N m",
            do="log torques, or write data.units.torque_constant into an experiment file",
        )
    if any(fault.fault == "angle_wrap" for fault in faults):
        out = replace(out, notes=tuple(note for note in out.notes if note not in wrapped))
    out = replace(out, notes=(*out.notes, *([f"{why}; correct it"] if why else [])))
    return replace(out, notes=(*out.notes, *dict.fromkeys(f"{f.says}: {f.do}" for f in faults)))


def _degrees(look: Look, angles: Guess, joints: list[str]) -> Guess:
    """That angles are in degrees: all of them, or one joint's."""
    why = "only as degrees do such angles go with the torques of the URDF's robot"
    if len(joints) > 1 or (column := look.column("position", joints[0])) is None:
        return Guess(angles.key, "deg", f"{angles.why}, and {why}")
    doubt = f"{angles.why}; the others' stay as they are; of a motor's shaft write 1 / (gear ratio)"
    return Guess("data.position", {joints[0]: {column: DEGREE}}, why, doubt)


def _scaled(amperes: Guess | None, scales: dict[str, float], joints: list[str]) -> list[Guess]:
    """The factors of the torques, as torque constants."""
    why = "with the URDF's masses the joints need far more torque than was logged: these are "
    why += "currents, or torques of the motors; A stands for either"
    factor = "with these the logged torques are those that the URDF's masses need"
    doubt = "masses and friction follow these: where you know it, "
    doubt += "write the gear's ratio, times the torque constant [N m/A] of a current"
    return [
        Guess("data.units.torque", "A", amperes.why if amperes else why),
        Guess("data.units.torque_constant", {j: scales[j] for j in joints}, factor, doubt),
    ]
