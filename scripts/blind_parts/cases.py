"""The cases of a seed: which robot, what is hidden in it, under which conditions it is logged."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, replace

import numpy as np

from . import conditions
from .hidden import ABSORBED, EFFECTS, LARGEST, OUTSIDE, ROBOT_WIDE, SIZES
from .robots import JOINTS, RATE, SECONDS

SINGLES = (
    "planar",
    "leg",
    "planar",
    "leg",
    "planar",
    ("ur5", "panda"),
)  # the robots of each effect's cases; of two, in turn
_PAIRS = {"planar": 14, "leg": 10, "ur5": 4, "panda": 2}
_CONTROLS = {"planar": 54, "leg": 38, "ur5": 8, "panda": 4}
_OUTSIDE = ("planar", "leg", "planar", "leg", ("ur5", "panda"))


@dataclass(frozen=True)
class Case:
    """One simulation: what is hidden ({effect, joint, size}; outside the catalogue also `other`), and how it is logged.

    kind: one, two, outside or control. colour [s], encoder [bits], pace (of the robot's usual top speed): None is the
    simulator's default. seed: the simulation's own. nuisances: what more `simulate` is given.
    """

    key: str
    robot: str
    kind: str
    hidden: tuple[dict, ...]
    seed: int
    colour: float | None = None
    encoder: int | None = None
    pace: float | None = None
    nuisances: dict | None = None


def cases(seed: int, which: str = "full", under: str = "clean") -> list[Case]:
    """Every case of the benchmark, in an order in which each beginning is a fair sample. The small one is a subset.

    Args:
        under: the conditions of the logs.
    """
    one, few = (
        _clean(seed)
        if under == "clean"
        else _bothered(seed)
        if under == "nuisances"
        else _sines(seed)
    )
    chosen = one if which == "full" else few
    order = np.random.default_rng([seed, 1]).permutation(len(chosen))
    return [chosen[k] for k in order]


def _clean(seed: int) -> tuple[list[Case], list[Case]]:
    one, few = [], []
    for n, effect in enumerate(EFFECTS):
        own = [
            single(seed, robot if isinstance(robot, str) else robot[n % 2], effect, number)
            for number, robot in enumerate(SINGLES)
        ]
        one += own
        few.append(own[n % len(own)])
    for effect in ABSORBED:
        own = [
            single(seed, robot, effect, number) for number, robot in enumerate(("planar", "leg"))
        ]
        one += own
        few.append(own[0])
    for n, kind in enumerate(OUTSIDE):
        own = []
        for number, robot in enumerate(_OUTSIDE):
            own.append(
                outside(seed, robot if isinstance(robot, str) else robot[n % 2], kind, number)
            )
        one += own
        few.append(own[n % len(own)])
    for counts, make, most in ((_PAIRS, pair, 4), (_CONTROLS, control, 8)):
        robots = [robot for robot, count in counts.items() for _ in range(count)]
        own = [make(seed, robot, number) for number, robot in enumerate(robots)]
        one += own
        few += own[:: math.ceil(len(own) / most)]
    return one, few


def _bothered(seed: int) -> tuple[list[Case], list[Case]]:
    """About 200 cases of all kinds whose logs have nuisances."""
    mark = conditions.MARKS["nuisances"]
    own = [
        single(seed, robot if isinstance(robot, str) else robot[n % 2], effect, number, mark)
        for n, effect in enumerate(EFFECTS)
        for number, robot in enumerate(("planar", "leg", ("planar", "leg"), ("ur5", "panda")))
    ]
    for n, law in enumerate(OUTSIDE):
        own += [
            outside(seed, robot, law, number, mark)
            for number, robot in enumerate(("planar", ("leg", "ur5", "leg", "panda")[n % 4]))
        ]
    for counts, make in (
        ({"planar": 10, "leg": 8, "ur5": 4, "panda": 2}, pair),
        ({"planar": 20, "leg": 18, "ur5": 7, "panda": 5}, control),
    ):
        robots = [robot for robot, count in counts.items() for _ in range(count)]
        own += [make(seed, robot, number, mark) for number, robot in enumerate(robots)]
    own = [
        replace(
            case,
            encoder=None,
            pace=None,
            nuisances=conditions.drawn(_rng(seed, f"{case.key}/nuisances"))[1],
        )
        for case in own
    ]
    return own, own[::5]


def _sines(seed: int) -> tuple[list[Case], list[Case]]:
    """60 cases of one large effect each, on the poorest of motions."""
    places = [(effect, robot) for robot in ("planar", "leg") for effect in EFFECTS]
    places += [(effect, ("ur5", "panda")[n % 2]) for n, effect in enumerate(EFFECTS[::2])]
    # an odd number: the larger half of the sizes
    own = [single(seed, robot, effect, 1, conditions.MARKS["sines"]) for effect, robot in places]
    own = [replace(case, nuisances={"motion": "sines"}) for case in own]
    return own, own[::4]


def _rng(seed: int, key: str) -> np.random.Generator:
    return np.random.default_rng([seed, zlib.crc32(key.encode())])


def _simulated(rng) -> dict:
    """Conditions of a case with something hidden: noise white or coloured."""
    return {
        "seed": int(rng.integers(2**31)),
        "colour": (None, None, 0.02, 0.1)[int(rng.integers(4))],
    }


def _size(rng, effect: str, half: int | None = None) -> float:
    """Log-uniform; half 0 or 1 is the smaller or the larger half of the range."""
    low, high = np.log(SIZES[0]), np.log(min(SIZES[1], LARGEST.get(effect, np.inf)))
    middle = 0.5 * (low + high)
    low, high = (low, high) if half is None else ((low, middle), (middle, high))[half]
    return round(float(np.exp(rng.uniform(low, high))), 4)


def _joint(rng, robot: str, effect: str) -> str:
    joint = JOINTS[robot][int(rng.integers(len(JOINTS[robot])))]
    return "*" if effect in ROBOT_WIDE else joint


def single(seed: int, robot: str, effect: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/{effect}/{mark}{number}"
    rng = _rng(seed, key)
    return Case(
        key,
        robot,
        "one",
        (
            {
                "effect": effect,
                "joint": _joint(rng, robot, effect),
                "size": _size(rng, effect, number % 2),
            },
        ),
        **_simulated(rng),
    )


def outside(seed: int, robot: str, kind: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/{kind}/{mark}{number}"
    rng = _rng(seed, key)
    joint = _joint(rng, robot, kind)
    other = JOINTS[robot][
        (JOINTS[robot].index(joint) + 1 + int(rng.integers(len(JOINTS[robot]) - 1)))
        % len(JOINTS[robot])
    ]
    return Case(
        key,
        robot,
        "outside",
        ({"effect": kind, "joint": joint, "size": _size(rng, kind, number % 2), "other": other},),
        **_simulated(rng),
    )


def pair(seed: int, robot: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/two/{mark}{number}"
    rng = _rng(seed, key)
    together = number % 2 == 0  # on one joint
    while True:
        names = [EFFECTS[k] for k in rng.choice(len(EFFECTS), 2, replace=False)]
        if {"elasticity", "backlash"} != set(names):  # a drive is one or the other
            break
    joints = [JOINTS[robot][k] for k in rng.choice(len(JOINTS[robot]), 2, replace=False)]
    hidden = [
        {
            "effect": name,
            "joint": "*" if name in ROBOT_WIDE else joints[0 if together else place],
            "size": _size(rng, name, int(rng.integers(2))),
        }
        for place, name in enumerate(names)
    ]
    return Case(key, robot, "two", tuple(hidden), **_simulated(rng))


def control(seed: int, robot: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/control/{mark}{number}"
    rng = _rng(seed, key)
    bits = (
        (None, None, 12, 10) if robot == "leg" else (None, None, 20, 17, 15)
    )  # of the leg's motors, of the other robots' joints
    return Case(
        key, robot, "control", (), seed=int(rng.integers(2**31)), colour=(None, 0.005, 0.02, 0.1, 0.3)[int(rng.integers(5))],
        encoder=bits[int(rng.integers(len(bits)))], pace=(None, 0.5, 0.75, 1.25)[int(rng.integers(4))],
    )  # fmt: skip


def matches(key: str, wanted: str) -> bool:
    """Whether a key has the parts of ROBOT/WHAT/NUMBER; parts left out or empty match everything."""
    if "/" not in wanted and wanted not in JOINTS:
        wanted = f"/{wanted}"
    return all(not part or part == own for part, own in zip(wanted.split("/"), key.split("/")))


def logged(case: Case) -> dict:
    """What `simulate` is told of a case's logs, but for its pace and nuisances."""
    return {
        "seed": case.seed,
        "duration": SECONDS[case.robot],
        "rate": RATE[case.robot],
        "colour": case.colour,
        "encoder": case.encoder,
    }


def conditions_of(case: Case) -> dict:
    """What a record tells of a case's logs."""
    usual = logged(case) | {"pace": case.pace}
    return usual | ({"nuisances": case.nuisances} if case.nuisances else {})
