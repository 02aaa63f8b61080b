"""What drives a joint, as effects: factors that are free, the damping of a servo or a motor, signals that share a joint's torque.

A free leading factor f is the wrong scale of what is measured, `torque_gain` with 1 + e = f_start / f. Damping that is given
is a given coefficient; damping that is free is told with the joint's viscous friction, whose column is the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import motor_side
from .drive_spec import FreeFactor
from .effect import TorqueEffect
from .effect_parameters import Linear, Shape, called
from .effects.torque_gain import TorqueGain
from .effects.viscous import Viscous
from .errors import ConfigError
from .inertia import DIVERGENCES
from .model import Model
from .robot import Robot
from .specs import Experiment

_SCALES = 7.0  # of the logarithm of a scale: three decades either way
_WIDE = 10.0  # a free factor without bounds is sought within this many times its start, and this share of it


class FreeGain(TorqueGain):
    """The torque of one joint is a logged signal times a factor that is not known."""

    instantaneous = False  # the drive's side of the equation, not the joint's

    def __init__(self, factor: FreeFactor):
        start = motor_side.started(factor)
        low, high = factor.within or sorted((start / _WIDE, start * _WIDE))
        self.bounds = min(start / high, start / low) - 1.0, max(start / high, start / low) - 1.0

    def shapes(self):
        return (called(Shape("1", *self.bounds, start=0.0, says="share by which the signal is too large"), "e"),)


class DriveDamping(TorqueEffect):
    """A servo or a motor brakes in proportion to speed, as it was given."""

    instantaneous = False  # the drive's side of the equation, not the joint's

    name = "drive_damping"
    equation = "tau = kd qd"
    looks_like = "residual in proportion to speed"
    tied_with = ("viscous",)
    separate_by = "nothing: viscous friction is the same"
    source = "elementary; no reference"

    kd = Linear("N m s/rad", lower=0, says="of the drive, as given")

    def __init__(self, damping: float):
        self.given_coefficients = {"kd": damping}

    def columns(self, motion, joint):
        return motion.qd[None, :, joint]


class LateCommand(TorqueEffect):
    """A command acts a little later than the log was read with: a first-order correction of a delay that is nearly known."""

    instantaneous = False  # the drive's side of the equation, not the joint's

    name = "late_command"
    equation = "tau_measured = tau + factor d command / dt (delay - delay_0)"
    looks_like = "residual in proportion to the rate of the command"
    tied_with = ("viscous",)
    separate_by = "a load that changes fast beside the command: gravity, other joints in motion"
    source = "elementary; no reference"

    def __init__(self, joint: str):
        self.signal = motor_side.rate_name(joint)

    def coefficients(self):
        return (called(Linear("N m s/rad", says="factor times what the delay lacks"), "c"),)

    def columns(self, motion, joint):
        return motion.signals[self.signal][None]


class SharedTorque(TorqueEffect):
    """Motors share a joint: what a signal with a free factor adds to the joint's torque, taken from the side of the model."""

    instantaneous = False  # the drive's side of the equation, not the joint's

    name = "shared_torque"
    equation = "tau_measured = tau - sum_k f_k signal_k"
    looks_like = "residual in proportion to another motor's torque"
    separate_by = "motions in which the motors' torques differ"
    source = "elementary; no reference"

    def __init__(self, signals: tuple[str, ...]):
        self.signals = signals

    def coefficients(self):
        return tuple(called(Linear("1", says=f"factor of {name}"), name) for name in self.signals)

    def columns(self, motion, joint):
        return -np.stack([motion.signals[name] for name in self.signals])


#: what stands on the drive's side of a joint's equation, and is no part of the torque that the joint needs
DRIVE_EFFECTS = (FreeGain, DriveDamping, LateCommand, SharedTorque)


def leading_factors(experiment: Experiment) -> dict[str, float | FreeFactor]:
    """{joint: the factor of the signal that leads its torque} of joints whose torque was not logged as such."""
    sums = {joint: entry[motor_side.leading(entry)] for joint, entry in experiment.data.torque.items()}
    return sums | {joint: motor_side.drive(spec).factor for joint, spec in experiment.actuator.items()}


def with_drives(model: Model, experiment: Experiment) -> Model:
    """A model with what its experiment says of its drives.

    Raises:
        ConfigError: an effect that the drive itself brings stands in the model, or a joint that is none.
    """
    joints = model.robot.joints
    motor_side.check(experiment.data, experiment.actuator, joints)
    for joint, factor in leading_factors(experiment).items():
        if isinstance(factor, FreeFactor):
            if _has(model, TorqueGain.name, joints.index(joint)):
                raise ConfigError(
                    f"the torque of joint {joint!r} has a free factor and {TorqueGain.name}", where="model.effects", allowed="one of them: they are the same", do="leave torque_gain out there",
                )  # fmt: skip
            model = model.with_effect(FreeGain(factor), (joints.index(joint),))
    for joint, spec in experiment.actuator.items():
        damping, own = motor_side.drive(spec).damping, (joints.index(joint),)
        if damping is None and any(effect.name == Viscous.name and effect.level is not None and own[0] in joints_ for effect, joints_ in model.terms):
            raise ConfigError(f"viscous of joint {joint!r} is per group, and its drive's kd is free", where="model.effects", allowed="one of them: they are the same", do="give kd, or leave per out")
        if damping:
            model = model.with_effect(DriveDamping(damping), own)
        elif damping is None and not _has(model, Viscous.name, *own):
            model = model.with_effect(Viscous(), own)
        if isinstance(spec.delay, FreeFactor):
            model = model.with_effect(LateCommand(joint), own)
    for joint, entry in experiment.data.torque.items():
        if others := tuple(name for name in entry if name not in motor_side.told(entry)):
            if wrong := [name for name in others if name in joints]:
                raise ConfigError(
                    f"data.torque.{joint}: the factor of joint {wrong[0]!r} is free", allowed="free factors of logged signals", do="name the signal, or give the factor",
                )  # fmt: skip
            model = model.with_effect(SharedTorque(others), (joints.index(joint),))
    return model


def _has(model: Model, name: str, joint: int) -> bool:
    return any(effect.name == name and joint in joints for effect, joints in model.terms)


@dataclass(frozen=True)
class Found:
    """A value of a drive that was free: its name, value, standard deviation (NaN where the log does not tell it) and unit."""

    joint: str
    name: str
    value: float
    std: float
    unit: str


def found(experiment: Experiment, model: Model, x, std, shape_std) -> list[Found]:
    """What was found of the drives.

    Args:
        x, std (size,) of the linear parameters; shape_std (shape values,).
    """
    known, spread = factors(experiment, model), {v.name: s for v, s in zip(model.shape_values, shape_std)}
    linear = dict(zip(model.names, zip(np.asarray(x).tolist(), np.asarray(std).tolist())))
    out = []
    for joint, factor in leading_factors(experiment).items():
        spec = experiment.actuator.get(joint)
        if isinstance(factor, FreeFactor):
            value, start = known[joint], motor_side.started(factor)
            deviation = value**2 / abs(start) * spread[f"{FreeGain.name}.{joint}.e"]  # of start / (1 + e)
            word = motor_side.leading(experiment.data.torque[joint]) if spec is None else "kp" if spec.command is not None else "k/R"
            out.append(Found(joint, word, value, deviation, _unit(model, joint, spec)))
        if spec is None:
            continue
        own = motor_side.drive(spec)
        if own.damping is None:
            word = "kd + Fv" if own.servo else "k^2/R + Fv"
            out.append(Found(joint, word, *linear[f"viscous.{joint}.Fv"], model.units[model.names.index(f"viscous.{joint}.Fv")]))
        if isinstance(spec.delay, FreeFactor):
            more, deviation = linear[f"{LateCommand.name}.{joint}.c"]
            out.append(Found(joint, "delay", own.delay + more / known[joint], abs(deviation / known[joint]), "s"))
    for joint, entry in experiment.data.torque.items():
        out += [Found(joint, name, *linear[f"{SharedTorque.name}.{joint}.{name}"], "1") for name in entry if name not in motor_side.told(entry)]
    return out


def _unit(model: Model, joint: str, spec) -> str:
    if spec is None:
        return "1"
    slides = bool(model.robot.prismatic[model.robot.joints.index(joint)])
    return ("N/m" if slides else "N m/rad") if spec.command is not None else ("N/V" if slides else "N m/V")


def rescaled(model: Model, experiment: Experiment, pi, prior) -> Model:
    """The model at the scale of all torques that the prior prefers, where no log tells it.

    All bodies, coefficients and free factors times one number fit a log alike: along that valley the objective is the prior's
    alone, too flat for steps that go by the whole.

    Args:
        pi, prior: (bodies, 10) found, and before any data.
    """
    from scipy.optimize import minimize_scalar  # its import takes as long as a small fit

    if scale_is_told(experiment, model.robot.joints) or not experiment.prior.weight:
        return model
    divergence = DIVERGENCES[experiment.prior.divergence](prior)
    cost = lambda log: float(np.sum(divergence.value(np.exp(log) * pi)))  # noqa: E731
    scale = np.exp(minimize_scalar(cost, bounds=(-_SCALES, _SCALES), method="bounded").x)
    gains = [v.shape.name == "e" and isinstance(model.terms[v.term][0], FreeGain) for v in model.shape_values]
    values = [
        float(np.clip((1.0 + at) / scale - 1.0, v.low, v.high)) if gain else at
        for v, at, gain in zip(model.shape_values, model.shapes, gains)
    ]  # fmt: skip
    return model.with_shapes(values)


def factors(experiment: Experiment, model: Model) -> dict[str, float]:
    """{joint: the factor of the signal that leads its torque}, as found where it was free."""
    shapes = {v.name: value for v, value in zip(model.shape_values, model.shapes)}
    return {
        joint: motor_side.started(factor) / (1.0 + shapes.get(f"{FreeGain.name}.{joint}.e", 0.0) * isinstance(factor, FreeFactor))
        for joint, factor in leading_factors(experiment).items()
    }  # fmt: skip


def slowest(experiment: Experiment, robot: Robot, prior, q) -> float:
    """The lowest frequency [Hz] at which a joint swings on its servo, with the bodies at rest (bodies, 10), over angles q (n, dof);
    infinite where no joint has a servo."""
    import pinocchio as pin

    own = {robot.joints.index(j): motor_side.drive(spec).start for j, spec in experiment.actuator.items() if spec.command is not None}
    tree, G = robot.with_inertias(prior), np.asarray(robot.transmission)
    data = tree.createData()
    inertia = np.mean([np.diagonal(G.T @ pin.crba(tree, data, G @ at) @ G) for at in q], axis=0)
    swings = [np.sqrt(abs(kp) / inertia[j]) / (2.0 * np.pi) for j, kp in own.items() if inertia[j] > 0.0]
    return min(swings, default=np.inf)


def scale_is_told(experiment: Experiment, joints: tuple[str, ...]) -> bool:
    """Whether a joint's torque is known in N m, or a body's mass, so that the scale of all torques against all masses is."""
    if experiment.prior.known:
        return True
    free = {joint for joint, factor in leading_factors(experiment).items() if isinstance(factor, FreeFactor)}
    return any(joint not in free and joint not in experiment.data.unused for joint in joints)
