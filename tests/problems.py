"""Compressed problems for tests: the leg's own, and a six-joint arm moving on a Fourier series."""

from functools import cache
from pathlib import Path

import numpy as np

from sysid import config, posed_problem, regressor, robot, specs
from sysid.compress import compress
from sysid.listed_effects import build
from sysid.log import Log, Segment
from sysid.model import moving_coefficients
from sysid.preprocess import prepare
from sysid.studies import prepared

ROOT = Path(__file__).resolve().parent.parent
UR5 = "example-robot-data://ur_description/urdf/ur5_robot.urdf"


@cache
def leg() -> tuple:
    """Experiment, model, motion, compressed data and prior of configs/cheetah3.yaml."""
    experiment = config.load(ROOT / "configs" / "cheetah3.yaml")
    found = prepared.prepared(experiment)
    return experiment, found.model, found.motion, found.train, found.prior


def fourier_motion(rng: np.random.Generator, seconds: float, rate: float, dof: int):
    """t, q, qd, qdd of a sum of five sines a joint, smooth and exciting."""
    t = np.arange(int(seconds * rate)) / rate
    w = 2 * np.pi * rng.uniform(0.1, 1.2, (5, 1, dof))
    a, p = rng.uniform(0.1, 0.5, (5, 1, dof)), rng.uniform(0, 2 * np.pi, (5, 1, dof))
    phase = w * t[None, :, None] + p
    return t, (a * np.sin(phase)).sum(0), (a * w * np.cos(phase)).sum(0), -(a * w**2 * np.sin(phase)).sum(0)


def arm_log(machine, rng, *, seconds=20.0, rate=200.0, noise=0.3, pi=None, viscous=2.0, coulomb=1.0, wide=1.0) -> Log:
    """A log of a robot whose bodies are pi, with friction and white torque noise."""
    t, *motion = fourier_motion(rng, seconds, rate, machine.dof)
    q, qd, qdd = (wide * values for values in motion)
    tau = regressor.torque(machine, machine.prior if pi is None else pi, q, qd, qdd) + viscous * qd + coulomb * np.sign(qd)
    tau += noise * rng.normal(size=tau.shape)
    return Log("made", Path("made"), "", (Segment(t, 1.0 / rate, q, tau, None, None, {}),))


@cache
def arm() -> tuple:
    """The same as `leg` for a UR5 with other bodies than its URDF's."""
    experiment = config.experiment({
        "robot": {"urdf": UR5}, "model": {"effects": ["viscous", "coulomb", "torque_bias"]},
    })  # fmt: skip
    machine = robot.load(experiment.robot)
    structure = build(machine, experiment.model.effects)
    rng = np.random.default_rng(42)
    from sysid.inertia import LogCholesky

    pi = LogCholesky(machine.prior).parameters(rng.normal(scale=0.1, size=(machine.dof, 10)))
    motion = prepare([arm_log(machine, rng, pi=pi)], experiment.preprocess, machine.joints)
    return experiment, structure, motion, compress(structure, motion), np.array(machine.prior)


def posed(case: tuple, **changes) -> tuple[specs.Experiment, posed_problem.Problem]:
    """The optimisation problem of a case, with sections of its experiment changed."""
    experiment, structure, motion, data, prior = case
    update = {key: getattr(experiment, key).model_copy(update=value) for key, value in changes.items()}
    experiment = experiment.model_copy(update=update)
    return experiment, posed_problem.pose(experiment, structure, data, moving_coefficients(structure, motion), prior)
