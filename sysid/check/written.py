"""What is said of a reading of the columns that explains the torque better, and how an experiment
file says it: each line says all that is to be written, as one entry replaces another."""

from __future__ import annotations

from collections.abc import Iterator

from .equations import Reading
from .fault import ERROR, WARNING, Fault
from .look import Look

_KEYS = {"angle": "position", "torque": "torque"}
_OUT_OF = "or take it as it is, where the URDF is what is wrong"
_MOUNTED = ", as of one that hangs on a wall or a ceiling"
_OUT_OF_ZERO = f"{_OUT_OF}, an axis of it, or where gravity points"


def told(look: Look, reading: Reading, kind: str, joints, word) -> Iterator[Fault]:
    """What is said of one thing in which a reading differs from the experiment's."""
    names = [look.robot.joints[j] for j in joints]
    if kind == "mass_implausible":
        told = f"[{', '.join(f'{g:g}' for g in word)}]"
        if not any(word):
            says = (
                "the torques have nothing of gravity, as where drives, springs or counterweights "
                "take it off: so the URDF's robot explains them"
            )
            do = (
                f"write robot.gravity: {told} where drives take it off, or log torques that have "
                "it; springs and counterweights belong in the URDF, or in the model as `spring`"
            )
        else:
            says = (
                f"gravity looks like {told} m/s^2 in the axes of the robot's base"
                f"{_MOUNTED if look.robot.gravity.any() else ', and the experiment says none'}: so "
                "the URDF's robot explains the torques"
            )
            do = f"write robot.gravity: {told}, where it is mounted so"
        yield Fault(kind, ERROR, says, do)
        return
    if kind == "wrong_unit":
        says = f"the angles look to be in {word}: so the URDF's robot explains the torques"
        yield Fault(kind, ERROR, says, f"set data.units.position: {word}")
        return
    if kind == "limit_exceeded":
        turn = {1: "a quarter turn", 2: "half a turn", -1: "a quarter turn back"}[word]
        says = (
            f"the zero of {names[0]}'s angle looks {turn} from the URDF's: from there the URDF's "
            "robot explains the torques"
        )
        do = f"write data.zero: {_zeros(look, reading)}; {_OUT_OF_ZERO}"
        yield Fault(kind, WARNING, says, do, names[0])
        return
    kinds = ["position", "torque"] if word in ("", "angle and torque") else [_KEYS[word]]
    for name in names:
        if kind == "joint_order":
            what = f"the {word} columns" if word else "the columns"
            says = (
                f"{what} of {', '.join(names[:-1])} and {names[-1]} look exchanged: the URDF's "
                "robot explains them in the other order"
            )
            do = "; ".join(_exchanged(look, key, reading) for key in kinds)
        else:
            says = (
                f"the {word} of {name} has the sign against the URDF's: as it is, "
                "friction would drive the joint or gravity lift it"
                if word != "angle and torque"
                else f"the angle and the torque of {name} have the sign against the URDF's: its "
                "axis points the other way there"
            )
            do = "; ".join(_negated(look, key, name, reading) for key in kinds)
        if "position" in kinds and look.experiment.data.zero:  # which is of the angle as it is read
            do += f"; write data.zero: {_zeros(look, reading)}"
        yield Fault(kind, ERROR, says, f"{do}; {_OUT_OF}", name)


def _zeros(look: Look, reading: Reading) -> str:
    """The zeros of all joints, those that the experiment has among them."""
    known, joints = look.experiment.data.zero, look.robot.joints
    own = zip(joints, reading.angle, reading.angle_factor, reading.zero)
    zeros = {joint: turn * known.get(joints[k], 0.0) + more for joint, k, turn, more in own}
    return f"{{{', '.join(f'{joint}: {at:.6g}' for joint, at in zeros.items() if at)}}}"


def in_order(look: Look, key: str, reading: Reading) -> list[str | None]:
    """The column of each joint in the order of a reading; None where it is no single one."""
    order = reading.angle if key == "position" else reading.torque
    return [look.column(key, look.robot.joints[k]) for k in order]


def _exchanged(look: Look, key: str, reading: Reading) -> str:
    every = in_order(look, key, reading)
    if None in every:
        return f"exchange them in data.columns.{key}"
    return f"write data.columns.{key}: [{', '.join(every)}]"


def _negated(look: Look, key: str, joint: str, reading: Reading) -> str:
    """How an experiment says that a column has the other sign."""
    factors = reading.angle_factor if key == "position" else reading.torque_factor
    own = zip(look.robot.joints, factors, in_order(look, key, reading))
    sums = getattr(look.experiment.data, key)
    turned = {n: c for n, factor, c in own if factor < 0.0 and c is not None and n not in sums}
    if joint not in turned:
        return f"log the {key} with the other sign"
    written = ", ".join(f"{name}: {{{column}: -1}}" for name, column in turned.items())
    return f"{'add to' if sums else 'write'} data.{key}: {{{written}}}"
