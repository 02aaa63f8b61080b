"""Simulated robots with poor first logs, and the motions that are compared on them."""

from __future__ import annotations

import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from scripts.blind_parts.robots import JOINTS, ROOT, experiment_of
from sysid import pipeline
from sysid.design import designed, search
from sysid.design.basis import basis
from sysid.design.problem import Problem
from sysid.log_spec import DataSpec
from sysid.simulate import Played, simulate, write
from sysid.specs import EffectSpec

ROBOTS = ("planar", "leg", "ur5", "panda")
RATE = {"planar": 500.0, "leg": 500.0, "ur5": 250.0, "panda": 250.0}  # Hz
NEXT = 20.0  # s: of the next log


@dataclass(frozen=True)
class FirstLog:
    """A poor first log: its duration [s] and kind of motion, as `simulate` has them."""

    duration: float = 4.0
    motion: str = "sines"


#: of an arm 4 s of slow sines tell nothing of its 60 parameters, and the diagnosis leaves every joint
#: `unresolved`: its first log is somewhat longer, or goes from point to point as a first log often does
FIRST = {
    robot: (FirstLog(10.0), FirstLog(10.0, "moves")) if robot in ("ur5", "panda") else (FirstLog(),)
    for robot in ROBOTS
}

__all__ = [
    "FIRST",
    "FirstLog",
    "JOINTS",
    "NEXT",
    "RATE",
    "ROBOTS",
    "experiment_with",
    "posed",
    "random_motion",
    "unlogged",
]


def experiment_with(
    robot: str, folder: Path, seed: int, hide=(), motions=(),
    first: FirstLog = FirstLog(),  # noqa: B008 - frozen
):  # fmt: skip
    """The experiment of a simulated robot with a poor first log, and a log of each of the motions
    (t, q) after it, all of one robot."""
    folder.mkdir(parents=True, exist_ok=True)
    experiment, machine = experiment_of(robot, folder)
    how = dict(hide=list(hide), seed=seed, rate=RATE[robot], **asdict(first))
    write(simulate(machine, **how), experiment, folder / "case")
    names = ["train.csv"]
    for k, (t, q) in enumerate(motions):
        own = folder / f"next_{k}"
        write(simulate(machine, trajectory=Played(t, q), **how), experiment, own)
        (own / "train.csv").rename(folder / "case" / f"next_{k}.csv")
        names.append(f"next_{k}.csv")
    file = folder / "case" / "config.yaml"
    file.write_text(file.read_text().replace("train: [train.csv]", f"train: [{', '.join(names)}]"))
    return pipeline.load(folder / "case")


def posed(experiment, duration: float = NEXT, spec=None) -> tuple[Problem, np.ndarray, list[int]]:
    """The problem of a design, the pose that its motions are about, and the numbers of rounds that
    its filter lets through: what `sysid.design` poses itself."""
    base = basis(experiment, [], lambda stage, share: None)
    problem, _ = designed.posed(base, duration, spec)
    return problem, base.pose, search.rounds(problem.family, base.fastest)


def random_motion(problem: Problem, pose, rounds, seed: int) -> tuple[Problem, np.ndarray]:
    """A random motion that keeps to the limits, and its problem."""
    rng = np.random.default_rng([seed, 5])
    for k in range(100):
        own = int(rng.choice(rounds))
        found = search.start(problem, pose, (seed, own, 1000 + k))
        if np.isfinite(found.value):
            return problem.with_rounds(own), found.z
    raise RuntimeError("no random motion keeps to the limits")


def unlogged_experiment(robot: str, folder: Path):
    """The experiment of a robot of which there is no log yet, with friction in its model."""
    effects = [EffectSpec(name="viscous"), EffectSpec(name="coulomb")]
    if robot == "ur10e":
        experiment = pipeline.load(ROOT / "configs" / "ur10e.yaml")
    else:
        experiment, _ = experiment_of(robot, folder)
    own = experiment.model.model_copy(update={"effects": effects})
    return experiment.model_copy(update={"data": DataSpec(), "model": own})


def unlogged(
    robot: str, duration: float = NEXT, spec=None
) -> tuple[Problem, np.ndarray, list[int]]:
    """`posed` of a robot of which there is no log yet."""
    with tempfile.TemporaryDirectory() as place:
        return posed(unlogged_experiment(robot, Path(place)), duration, spec)
