"""Is the missing effect found? Effects hidden in simulated robots, and what the diagnosis, told nothing, says of them.

    python scripts/blind_benchmark.py --seed 20261 --jobs 2                   # the whole benchmark
    python scripts/blind_benchmark.py --seed 20261 --conditions nuisances     # on logs as labs have them; or sines, one a joint
    python scripts/blind_benchmark.py --cases small --seed 1                  # one case of each kind
    python scripts/blind_benchmark.py --seed 1 --only leg/stribeck            # cases whose key has these parts
    python scripts/blind_benchmark.py --seed 1 --only leg/stribeck/2 --verbose  # one case, told in full, its folder kept
    python scripts/blind_benchmark.py --report runs/blind_benchmark --publish # the page again, from results.json

A case is a robot, what is hidden in it, and the conditions of its logs, all drawn from the base seed and the case's key
(ROBOT/WHAT/NUMBER). It is simulated, written as a folder, and given to `sysid discover` (at most 4 steps), which
knows nothing. The true model is the same experiment with the hidden effects in its list, refitted. The verdict that
counts is that of the first diagnosis.

Runs resume: finished cases stand in a journal in --out, named after the seed and the state of the package's source, so
that one journal never mixes two states of it. Killed and run again, the results are the same, up to seconds.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import hashlib
import json
import math
import shutil
import signal
import statistics
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from collections.abc import Callable
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from unittest import mock

ROOT = Path(__file__).resolve().parent.parent
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(ROOT), str(HERE)]
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), str(HERE), *filter(None, [os.environ.get("PYTHONPATH")])])  # of the processes that --jobs starts

import numpy as np  # noqa: E402
from benchmark_parts import claims, conditions  # noqa: E402 - beside this script
from benchmark_parts.claims import family, steps_on  # noqa: E402
from benchmark_parts.new_laws import NEW  # noqa: E402
from benchmark_parts.old_laws import OLD  # noqa: E402
from benchmark_parts.third_laws import THIRD  # noqa: E402

from sysid import addition, config, fit_document, loop, pipeline, whole_files  # noqa: E402
from sysid.errors import SysidError  # noqa: E402
from sysid.studies.journal import Journal, run  # noqa: E402
from sysid.terminal import watched  # noqa: E402

# ---- the robots

PLANAR = """<robot name="planar">
 <link name="base"/>
 <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="4"/><inertia ixx="0.01" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="fore"><inertial><origin xyz="0.18 0 0"/><mass value="2.5"/><inertia ixx="0.005" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="200" velocity="6"/></joint>
 <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="100" velocity="6"/></joint>
</robot>
"""
JOINTS = {
    "planar": ("shoulder", "elbow"), "leg": ("abad", "hip", "knee"),
    "ur5": ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
    "panda": tuple(f"panda_joint{k}" for k in range(1, 8)),
}  # fmt: skip
SPECS = {
    "ur5": {"urdf": "example-robot-data://ur_description/urdf/ur5_robot.urdf"},
    "panda": {"urdf": "example-robot-data://panda_description/urdf/panda.urdf", "joints": list(JOINTS["panda"])},
}
RATE = {"planar": 1000.0, "leg": 1000.0, "ur5": 500.0, "panda": 500.0}
SECONDS = {"planar": 20.0, "leg": 20.0, "ur5": 16.0, "panda": 16.0}  # of each log

# ---- what is hidden

BASELINE = ("viscous", "coulomb", "armature")  # in every model from the start
ABSORBED = ("payload", "external_force")  # no model predicts them on another log: the last link's own inertia, and when somebody pushes
ROBOT_WIDE = ("gravity_tilt", "payload", "external_force")
EFFECTS = (
    "asymmetric_coulomb", "asymmetric_viscous", "stribeck", "quadratic_drag", "sublinear_viscous", "presliding", "load_friction",
    "directional_efficiency", "position_friction", "warmup", "joint_coupling", "elasticity", "backlash", "cogging", "torque_bias", "torque_gain",
    "torque_saturation", "current_lag", "delay", "encoder_offset", "encoder_eccentricity", "gravity_tilt", "spring", "cable",
)  # fmt: skip
SIZES = (0.3, 3.0)  # times the simulator's default strength
LARGEST = {"asymmetric_coulomb": 2.0, "asymmetric_viscous": 2.0, "torque_saturation": 1.9}  # beyond it friction turns negative, or little torque is read
SINGLES = ("planar", "leg", "planar", "leg", "planar", ("ur5", "panda"))  # the robots of each effect's cases; of two, in turn
_PAIRS = {"planar": 14, "leg": 10, "ur5": 4, "panda": 2}
_CONTROLS = {"planar": 54, "leg": 38, "ur5": 8, "panda": 4}
_OUTSIDE = ("planar", "leg", "planar", "leg", ("ur5", "panda"))
MOST_STEPS = 4
_LIMIT = 1200  # s a case may take


#: what the catalogue does not have: (equation, maker of the torque of joint j)
OUTSIDE: dict[str, tuple[str, Callable]] = {**OLD, **NEW, **THIRD}

# ---- the cases


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
    one, few = _clean(seed) if under == "clean" else _bothered(seed) if under == "nuisances" else _sines(seed)
    chosen = one if which == "full" else few
    order = np.random.default_rng([seed, 1]).permutation(len(chosen))
    return [chosen[k] for k in order]


def _clean(seed: int) -> tuple[list[Case], list[Case]]:
    one, few = [], []
    for n, effect in enumerate(EFFECTS):
        own = [_single(seed, robot if isinstance(robot, str) else robot[n % 2], effect, number) for number, robot in enumerate(SINGLES)]
        one += own
        few.append(own[n % len(own)])
    for effect in ABSORBED:
        own = [_single(seed, robot, effect, number) for number, robot in enumerate(("planar", "leg"))]
        one += own
        few.append(own[0])
    for n, kind in enumerate(OUTSIDE):
        own = []
        for number, robot in enumerate(_OUTSIDE):
            own.append(_outside(seed, robot if isinstance(robot, str) else robot[n % 2], kind, number))
        one += own
        few.append(own[n % len(own)])
    for counts, make, most in ((_PAIRS, _pair, 4), (_CONTROLS, _control, 8)):
        robots = [robot for robot, count in counts.items() for _ in range(count)]
        own = [make(seed, robot, number) for number, robot in enumerate(robots)]
        one += own
        few += own[:: math.ceil(len(own) / most)]
    return one, few


def _bothered(seed: int) -> tuple[list[Case], list[Case]]:
    """About 200 cases of all kinds whose logs have nuisances."""
    mark = conditions.MARKS["nuisances"]
    own = [
        _single(seed, robot if isinstance(robot, str) else robot[n % 2], effect, number, mark)
        for n, effect in enumerate(EFFECTS)
        for number, robot in enumerate(("planar", "leg", ("planar", "leg"), ("ur5", "panda")))
    ]
    for n, law in enumerate(OUTSIDE):
        own += [_outside(seed, robot, law, number, mark) for number, robot in enumerate(("planar", ("leg", "ur5", "leg", "panda")[n % 4]))]
    for counts, make in (({"planar": 10, "leg": 8, "ur5": 4, "panda": 2}, _pair), ({"planar": 20, "leg": 18, "ur5": 7, "panda": 5}, _control)):
        robots = [robot for robot, count in counts.items() for _ in range(count)]
        own += [make(seed, robot, number, mark) for number, robot in enumerate(robots)]
    own = [replace(case, encoder=None, pace=None, nuisances=conditions.drawn(_rng(seed, f"{case.key}/nuisances"))[1]) for case in own]
    return own, own[::5]


def _sines(seed: int) -> tuple[list[Case], list[Case]]:
    """60 cases of one large effect each, on the poorest of motions."""
    places = [(effect, robot) for robot in ("planar", "leg") for effect in EFFECTS]
    places += [(effect, ("ur5", "panda")[n % 2]) for n, effect in enumerate(EFFECTS[::2])]
    # an odd number: the larger half of the sizes
    own = [_single(seed, robot, effect, 1, conditions.MARKS["sines"]) for effect, robot in places]
    own = [replace(case, nuisances={"motion": "sines"}) for case in own]
    return own, own[::4]


def _rng(seed: int, key: str) -> np.random.Generator:
    return np.random.default_rng([seed, zlib.crc32(key.encode())])


def _simulated(rng) -> dict:
    """Conditions of a case with something hidden: noise white or coloured."""
    return {"seed": int(rng.integers(2**31)), "colour": (None, None, 0.02, 0.1)[int(rng.integers(4))]}


def _size(rng, effect: str, half: int | None = None) -> float:
    """Log-uniform; half 0 or 1 is the smaller or the larger half of the range."""
    low, high = np.log(SIZES[0]), np.log(min(SIZES[1], LARGEST.get(effect, np.inf)))
    middle = 0.5 * (low + high)
    low, high = (low, high) if half is None else ((low, middle), (middle, high))[half]
    return round(float(np.exp(rng.uniform(low, high))), 4)


def _joint(rng, robot: str, effect: str) -> str:
    joint = JOINTS[robot][int(rng.integers(len(JOINTS[robot])))]
    return "*" if effect in ROBOT_WIDE else joint


def _single(seed: int, robot: str, effect: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/{effect}/{mark}{number}"
    rng = _rng(seed, key)
    return Case(key, robot, "one", ({"effect": effect, "joint": _joint(rng, robot, effect), "size": _size(rng, effect, number % 2)},), **_simulated(rng))


def _outside(seed: int, robot: str, kind: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/{kind}/{mark}{number}"
    rng = _rng(seed, key)
    joint = _joint(rng, robot, kind)
    other = JOINTS[robot][(JOINTS[robot].index(joint) + 1 + int(rng.integers(len(JOINTS[robot]) - 1))) % len(JOINTS[robot])]
    return Case(key, robot, "outside", ({"effect": kind, "joint": joint, "size": _size(rng, kind, number % 2), "other": other},), **_simulated(rng))


def _pair(seed: int, robot: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/two/{mark}{number}"
    rng = _rng(seed, key)
    together = number % 2 == 0  # on one joint
    while True:
        names = [EFFECTS[k] for k in rng.choice(len(EFFECTS), 2, replace=False)]
        if {"elasticity", "backlash"} != set(names):  # a drive is one or the other
            break
    joints = [JOINTS[robot][k] for k in rng.choice(len(JOINTS[robot]), 2, replace=False)]
    hidden = [
        {"effect": name, "joint": "*" if name in ROBOT_WIDE else joints[0 if together else place], "size": _size(rng, name, int(rng.integers(2)))}
        for place, name in enumerate(names)
    ]
    return Case(key, robot, "two", tuple(hidden), **_simulated(rng))


def _control(seed: int, robot: str, number: int, mark: str = "") -> Case:
    key = f"{robot}/control/{mark}{number}"
    rng = _rng(seed, key)
    bits = (None, None, 12, 10) if robot == "leg" else (None, None, 20, 17, 15)  # of the leg's motors, of the other robots' joints
    return Case(
        key, robot, "control", (), seed=int(rng.integers(2**31)), colour=(None, 0.005, 0.02, 0.1, 0.3)[int(rng.integers(5))],
        encoder=bits[int(rng.integers(len(bits)))], pace=(None, 0.5, 0.75, 1.25)[int(rng.integers(4))],
    )  # fmt: skip


def matches(key: str, wanted: str) -> bool:
    """Whether a key has the parts of ROBOT/WHAT/NUMBER; parts left out or empty match everything."""
    if "/" not in wanted and wanted not in JOINTS:
        wanted = f"/{wanted}"
    return all(not part or part == own for part, own in zip(wanted.split("/"), key.split("/")))


# ---- one case


def experiment_of(robot: str, folder: Path):
    """The experiment and the robot of a name; `folder` for what has to be a file."""
    from sysid import robot as robots
    from sysid.simulate import load

    if robot == "leg":
        experiment, machine, _ = load(ROOT / "configs" / "cheetah3.yaml")
        return experiment, machine
    spec = SPECS.get(robot)
    if spec is None:
        file = folder / "planar.urdf"
        file.write_text(PLANAR)
        spec = {"urdf": str(file)}
    experiment = config.experiment({"robot": spec})
    return experiment, robots.load(experiment.robot)


def one(case: dict, keep: str | None = None) -> dict:
    """Simulate a case, discover, and fit the true model; what was found, as JSON can hold it.

    Args:
        keep: a folder to leave the case's experiment and its run in.
    """
    case = Case(**{**case, "hidden": tuple(case["hidden"])})
    found: dict = {"key": case.key, "robot": case.robot, "kind": case.kind, "hidden": [dict(h) for h in case.hidden], "conditions": _conditions(case)}
    found |= {"rms": {}, "error": None, "seconds": {}}
    stage = ["simulate"]
    clock = time.perf_counter()
    try:
        with warnings.catch_warnings(), _limited(_LIMIT), nullcontext(keep) if keep else tempfile.TemporaryDirectory() as folder:
            warnings.simplefilter("ignore")
            _one(case, Path(folder), found, stage)
    except Exception as error:  # noqa: BLE001 - a crash is a failure of the benchmark, not its end
        found["error"] = {"stage": stage[0], "message": f"{type(error).__name__}: {error}"[:500], "trace": traceback.format_exc()[-1500:]}
    found["seconds"]["all"] = time.perf_counter() - clock
    return found


def _conditions(case: Case) -> dict:
    usual = {"seed": case.seed, "duration": SECONDS[case.robot], "rate": RATE[case.robot], "colour": case.colour, "encoder": case.encoder, "pace": case.pace}
    return usual | ({"nuisances": case.nuisances} if case.nuisances else {})


@contextmanager
def _limited(seconds: int):
    """Give up after so many seconds."""

    def stop(number, frame):
        raise TimeoutError(f"not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _one(case: Case, folder: Path, found: dict, stage: list[str]) -> None:
    from sysid.simulate import motion, write
    from sysid.statement.document import document

    def timed(name: str, work: Callable):
        stage[0] = name
        start = time.perf_counter()
        out = work()
        found["seconds"][name] = round(found["seconds"].get(name, 0.0) + time.perf_counter() - start, 3)
        return out

    def rms(fit) -> dict:
        return fit.rms("test")

    folder.mkdir(parents=True, exist_ok=True)
    experiment, machine = timed("simulate", lambda: experiment_of(case.robot, folder))
    options = {"seed": case.seed, "duration": SECONDS[case.robot], "rate": RATE[case.robot], "colour": case.colour, "encoder": case.encoder}
    options["speed"] = None if case.pace is None else case.pace * float(motion.top_speeds(machine).max())
    options |= case.nuisances or {}
    plain = None
    if case.kind in ("one", "outside"):  # the same logs without it
        plain = timed("simulate", lambda: _simulate(machine, [], options)[0])
    simulation, softer = timed("simulate", lambda: _simulate(machine, case.hidden, options, plain))
    for entry, told in zip(found["hidden"], simulation.truth["hidden"]):
        entry["size"] = round(entry["size"] * softer, 4)
        entry["values"] = told.get("values", {})
    found["noise"] = simulation.truth["logs"]["test"]["noise_rms"]
    found["softened"] = softer < 1.0
    timed("write", lambda: write(simulation, experiment, folder / "case"))
    blind = pipeline.load(folder / "case")

    # the true model
    if plain is not None:
        timed("write", lambda: write(plain, experiment, folder / "plain"))
        found["rms"]["plain"] = rms(timed("true", lambda: pipeline.fit(pipeline.load(folder / "plain"))))
    if case.kind == "outside" or any(h["effect"] in ABSORBED for h in case.hidden):
        found["rms"]["true"] = found["rms"]["plain"]
    elif case.hidden:
        told = _grown(blind, found["hidden"])
        found["rms"]["true"] = rms(timed("true", lambda: pipeline.fit(told)))
    if case.kind == "two":
        # without each of them in turn: which of the two does the log show?
        lacking = [_grown(blind, [h for h in found["hidden"] if h is not entry]) for entry in found["hidden"]]
        found["rms"]["without"] = [rms(timed("true", lambda e=e: pipeline.fit(e))) for e in lacking]

    said = []

    def remembered(*arguments, **named):
        said.append(loop_diagnose(*arguments, **named))
        return said[-1]

    loop_diagnose = loop.diagnose
    with mock.patch.object(loop, "diagnose", remembered):
        discovery = timed("discover", lambda: loop.discover(blind, folder / "run", most=MOST_STEPS))
    first = json.loads(json.dumps(document(said[0])))
    found["rms"]["before"], found["rms"]["after"] = rms(discovery.fits[0]), rms(discovery.fits[-1])
    found["floors"] = {joint: entry.get("noise_floor") for joint, entry in first["joints"].items()}
    found["noise_seen"] = timed("noise", lambda: conditions.noise_seen(simulation, discovery.fits[0], folder))
    found["events"] = {name: len(log["events"]) for name, log in simulation.truth["logs"].items()}
    found["verdict"] = [
        {k: v for k, v in entry.items() if k != "depends_on"} | {"depends_on": [d["variable"] for d in entry.get("depends_on", [])][:3]} for entry in first["verdict"]
    ]
    found["findings"] = [
        {"effect": f["effect"], "joint": f["joint"], "tied_with": f.get("tied_with", []), "step": f.get("joins_as_step"), "removed": f.get("misfit_removed"),
         "visible": f.get("visible"), "probability": f.get("probability"), "parameters": {name: p["value"] for name, p in f.get("parameters", {}).items()}}
        for f in first["findings"]
    ]  # fmt: skip
    unseen = {(entry["effect"], entry["joint"]) for entry in first.get("absorbed", [])}
    found["said_not_visible"] = [(h["effect"], h["joint"]) in unseen for h in found["hidden"]]
    found["added"] = [[step["added"], step["joint"]] for step in discovery.steps[1:]]
    found["refused"] = [[entry["effect"], entry["joint"]] for entry in discovery.refused]
    found["last"] = [{"joint": v.joint, "status": v.status} for v in discovery.diagnosis.verdict]


def _simulate(machine, hidden, options: dict, plain=None):
    """The simulation, and what its sizes had to be multiplied by until the robot followed its reference."""
    from sysid.simulate import Hidden, simulate

    for attempt in range(6):
        softer = 0.7**attempt
        hide = []
        for entry in hidden:
            size = softer * entry["size"]
            if entry["effect"] in OUTSIDE:
                hide.append(_custom(machine, entry, size, plain))
            else:
                hide.append(Hidden(entry["effect"], entry["joint"], {"size": size}))
        try:
            return simulate(machine, hide=hide, **options), softer
        except SysidError:
            if attempt == 5 or not hide:
                raise


def _custom(machine, entry: dict, size: float, plain) -> Callable:
    """The torque (dof,) of an effect that the catalogue does not have; `plain` the simulation without it."""
    truth = plain.truth
    j, i = machine.joints.index(entry["joint"]), machine.joints.index(entry["other"])
    scales = {name: truth["scales"][name][entry["joint"]] for name in ("torque", "inertia", "speed")} | {"coulomb": truth["friction"][entry["joint"]]["Fc"]}
    angles = plain.train.clean.link_q[:, j]
    scales |= {"low": float(angles.min()), "high": float(angles.max())}
    own, dof = OUTSIDE[entry["effect"]][1](size, j, i, scales), machine.dof

    def torque(*state):
        out = np.zeros(dof)
        out[j] = own(*state)
        return out

    return torque


def _grown(experiment, hidden: list[dict]):
    """The experiment with the hidden effects in its model."""
    for entry in hidden:
        options = {"other": entry["values"]["other"]} if entry["effect"] == "joint_coupling" else {}
        experiment = addition.grown(experiment, entry["effect"], None if entry["joint"] == "*" else [entry["joint"]], options)
    return experiment


# ---- scoring

VISIBLE = 0.10  # of the held-out RMS
WITHIN = 0.05  # of the true model's held-out RMS
EXPLAINED = 0.80  # of the misfit
NAMED = ("alone", "head of family")
#: what can become of a hidden effect, best first
CATEGORIES = (*NAMED, "in family, not head", "named among also", "wrong", "unknown", "unresolved", "missed", "error")
MEANS = {
    "alone": "the verdict on its joint is this effect, tied with none", "head of family": "the verdict, and tied with others",
    "in family, not head": "tied with the verdict, which is another", "named among also": "a later step on the joint, after a wrong one",
    "wrong": "the verdict is another effect", "unknown": "structure that nothing explains",
    "unresolved": "error above the floor, and the log does not say why", "missed": "the joint is called complete", "error": "a crash",
}  # fmt: skip


def category(record: dict, effect: str, joint: str, others: set[str]) -> tuple[str, str]:
    """What became of an effect hidden on a joint, and the effect that was named there (or unknown, or complete).

    Args:
        others: effects hidden on the same joint, or in the whole robot; a verdict that names them is passed over.
    """
    (verdict,) = [v for v in record["verdict"] if v["joint"] == joint]
    steps = steps_on(record, joint)
    left = [s for s in steps if s["effect"] == effect or s["effect"] not in others]
    if left:
        head, *later = left
        if head["effect"] == effect:
            return ("head of family" if head["tied_with"] else "alone"), effect
        if effect in head["tied_with"]:
            return "in family, not head", head["effect"]
        return ("named among also" if any(effect in (s["effect"], *s["tied_with"]) for s in later) else "wrong"), head["effect"]
    if any(effect in s["tied_with"] for s in steps):
        return "in family, not head", steps[0]["effect"]
    if verdict["status"] in ("unresolved", "explained"):  # explained: by an effect of another joint's equation
        return ("unresolved" if verdict["status"] == "unresolved" else "missed"), verdict["status"]
    return ("unknown", "unknown") if verdict["status"] == "unknown" or (steps and "share_left" in verdict) else ("missed", "complete")


def score(record: dict) -> list[dict]:
    """A row for each hidden effect of a record."""
    rows = []
    for k, entry in enumerate(record["hidden"]):
        effect, joint = entry["effect"], entry["joint"]
        rms, row = record["rms"], {"key": record["key"], "robot": record["robot"], "kind": record["kind"], "effect": effect, "joint": joint, "size": entry["size"]}
        base = rms["without"][k] if "without" in rms else rms.get("before")
        if "true" in rms and base is not None:
            # a joint that stands still on the test logs, or is braked, has no error there
            lowered = {j: 1.0 - rms["true"][j] / base[j] if base[j] > 0.0 else 0.0 for j in base}
            joint = max(lowered, key=lowered.get) if joint == "*" else joint
            # what no model predicts on another log is not visible, whatever the log without it says
            row |= {"joint": joint, "lowered": lowered[joint], "visible": 0.0 < base[joint] and rms["true"][joint] <= (1.0 - VISIBLE) * base[joint] and effect not in ABSORBED}
        else:
            # a crash counts against us; where the simulator made no log there is nothing to see
            row |= {"lowered": None, "visible": (record["error"] or {}).get("stage") != "simulate"}
        if record["error"] is not None:
            rows.append(row | {"category": "error", "named": "error", "extra": [], "innocent": []})
            continue
        others = {h["effect"] for i, h in enumerate(record["hidden"]) if i != k and (h["joint"] in (joint, "*") or entry["joint"] == "*")}
        places = [joint] if entry["joint"] != "*" else [joint, *(v["joint"] for v in record["verdict"] if v["joint"] != joint)]
        found = [category(record, effect, place, others) for place in places]
        best = min((c for c in found if c[0] in CATEGORIES[:4]), key=lambda c: CATEGORIES.index(c[0]), default=found[0])
        guilty = {h["joint"] for h in record["hidden"]}
        row |= {
            "category": best[0], "named": best[1], "before": rms["before"][joint], "after": rms["after"][joint], "true": rms["true"][joint],
            "extra": [s["effect"] for s in steps_on(record, joint) if s["effect"] not in {effect, *others}],
            "innocent": [] if "*" in guilty else [v["joint"] for v in record["verdict"] if v["status"] == "missing" and v["joint"] not in guilty],
            "within": rms["after"][joint] <= (1.0 + WITHIN) * rms["true"][joint],
        }  # fmt: skip
        if "plain" in rms:
            row["hurts"] = 1.0 - rms["plain"][joint] / rms["before"][joint] if rms["before"][joint] > 0.0 else 0.0
        if record["kind"] == "outside":
            misfit = rms["before"][joint] ** 2 - rms["true"][joint] ** 2
            removed = (rms["before"][joint] ** 2 - rms["after"][joint] ** 2) / misfit if misfit > 0 else None
            (verdict,) = [v for v in record["verdict"] if v["joint"] == joint]
            status = verdict["status"]
            called = {"unknown": "unknown", "unresolved": "unresolved", "complete": "missed"}.get(status, "explained" if removed is not None and removed >= EXPLAINED else "wrong")
            row |= {"category": called, "named": verdict.get("effect") or status, "removed": removed, "admits": "share_left" in verdict}
        steps = steps_on(record, joint)
        row["said"] = [[step["effect"], *step["tied_with"]] for step in steps]
        rows.append(row)
    return rows


def wilson(successes: int, count: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """The interval of a share that a count of successes leaves (Wilson 1927); (0, 1) where nothing was counted."""
    if count == 0:
        return 0.0, 1.0
    share = successes / count
    middle, half = share + z * z / (2 * count), z * math.sqrt(share * (1.0 - share) / count + z * z / (4.0 * count * count))
    low, high = (middle - half) / (1 + z * z / count), (middle + half) / (1 + z * z / count)
    return 0.0 if successes == 0 else low, 1.0 if successes == count else high


def share(successes: int, count: int) -> dict:
    """A share with its interval."""
    low, high = wilson(successes, count)
    return {"count": successes, "of": count, "share": successes / count if count else None, "low": low, "high": high}


def summary(records: list[dict], under: str = "clean") -> dict:
    """Everything that the page says, from the records made under some conditions."""
    rows = [row for record in records for row in score(record)]
    known = [r for r in rows if r["kind"] in ("one", "two") and r["effect"] not in ABSORBED]
    seen, unseen = [r for r in known if r["visible"]], [r for r in known if not r["visible"]]
    absorbed = [r for r in rows if r["effect"] in ABSORBED]
    outside = [r for r in rows if r["kind"] == "outside"]
    out_seen = [r for r in outside if r["visible"]]
    controls = [r for r in records if r["kind"] == "control"]
    failed = [r for r in records if r["error"] is not None]
    count = lambda of, key, *values: sum(r[key] in values for r in of)  # noqa: E731
    accused = [r for r in controls if r["error"] is not None or any(v["status"] in ("missing", "explained") for v in r["verdict"])]
    unknown = [r for r in controls if r["error"] is None and any(v["status"] == "unknown" for v in r["verdict"])]
    named = [r for r in seen if r["category"] in NAMED]
    whole = [r for r in rows if r["category"] != "error"]
    unresolved = [r for r in controls if r["error"] is None and any(v["status"] == "unresolved" for v in r["verdict"])]
    at_peace = [r for r in controls if r not in accused and r not in unknown]
    said = claims.counts(records)
    sets = [r for r in seen if r.get("said")]
    held = [r for r in sets if any(r["effect"] in words for words in r["said"])]
    ask = _ASKED[under]
    bars = [
        _bar("cases", f"cases, controls included ({len(records) - len(controls)} with something hidden)", len(records), ask["cases"]),
        _bar("controls", "controls", len(controls), ask["controls"]),
        _bar("named", "visible effects named, alone or at the head of a family", share(len(named), len(seen)), ask["named"]),
        _bar("alone", "visible effects named alone", share(count(seen, "category", "alone"), len(seen)), ask["alone"]),
        _bar("false claims", "claims of the first verdict that are not there, of all claims", share(*said["false claims"]), ask["false"], most=True),
        _bar("sets", "visible effects in the set (or family) of a verdict that names something on their joint", share(len(held), len(sets)), 0.87),
        _bar("controls accused", "controls with any accusation", share(len(accused), len(controls)), ask["accused"], most=True),
        _bar("controls unknown", "controls called unknown", share(len(unknown), len(controls)), ask["unknown"], most=True),
        _bar("controls at peace", "controls neither accused nor unknown", share(len(at_peace), len(controls)), ask["at peace"]),
        _bar("floors", "joints whose noise floor is within 25 % of the true noise, or null", share(*said["floors"]), 0.90),
        _bar("after discover", "named cases whose held-out RMS after discover is within 5 % of the true model's", share(sum(r["within"] for r in named), len(named)), 0.90),
        *(
            _bar(name, f"visible effects outside the catalogue, {says}, called unknown, or explained by 80 %",
                 share(count(own, "category", "unknown", "explained"), len(own)), bound)
            for name, says, laws, bound in _LAWS for own in [[r for r in out_seen if r["effect"] in laws]]
        ),
    ]  # fmt: skip
    bars = [bar for bar in bars if bar["bound"] is not None]
    table = lambda of: {c: count(of, "category", c) for c in CATEGORIES}  # noqa: E731
    seconds = {robot: [r["seconds"]["all"] for r in records if r["robot"] == robot] for robot in JOINTS}
    return {
        "bars": bars,
        "cases": {kind: sum(r["kind"] == kind for r in records) for kind in ("one", "two", "outside", "control")},
        "visible": {"all": table(seen), "one": table([r for r in seen if r["kind"] == "one"]), "two": table([r for r in seen if r["kind"] == "two"])},
        "not_visible": table(unseen),
        "robots": {robot: table([r for r in seen if r["robot"] == robot]) for robot in JOINTS},
        "effects": {e: {"hidden": count(known, "effect", e), **table([r for r in seen if r["effect"] == e])} for e in EFFECTS},
        "absorbed": {e: table([r for r in absorbed if r["effect"] == e]) for e in ABSORBED},
        "outside": {
            kind: {"hidden": count(outside, "effect", kind), "visible": len(own), **{c: count(own, "category", c) for c in ("unknown", "explained", "wrong", "unresolved", "missed", "error")},
                   "admits": sum(bool(r.get("admits")) and r["category"] == "wrong" for r in own)}
            for kind in OUTSIDE for own in [[r for r in out_seen if r["effect"] == kind]]
        },
        "claims": {
            "false": share(*said["false claims"]), "false_families_too": share(*said["false claims, families too"]), "list": said["false"],
            "members": statistics.fmean(len(words) for r in sets for words in r["said"][:1]) if sets else None,
        },
        "floors": {"good": share(*said["floors"]), "null": share(*said["floors null"]), "ratio": said["ratios"]},
        "controls": {"accused": share(len(accused), len(controls)), "unknown": share(len(unknown), len(controls)),
            "unresolved": share(len(unresolved), len(controls)), "at_peace": share(len(at_peace), len(controls)), "unknown_joints": share(
            *(sum(v["status"] in of for r in controls for v in r.get("verdict", [])) for of in (("unknown",), ("unknown", "missing", "complete", "explained", "unresolved")))), "by_robot": {
            robot: {"controls": count(controls, "robot", robot), "accused": count(accused, "robot", robot), "unknown": count(unknown, "robot", robot)} for robot in JOINTS}},
        "by_lowered": [
            {"from": low, "to": high, "named": share(sum(r["category"] in NAMED for r in own), len(own)), "alone": share(count(own, "category", "alone"), len(own)),
             "wrong": share(count(own, "category", "wrong", "named among also"), len(own))}
            for low, high in zip(_LOWERED, _LOWERED[1:]) for own in [[r for r in known if r["lowered"] is not None and low <= r["lowered"] < high]]
        ],
        "named_with_extras": share(sum(bool(r["extra"]) for r in named), len(named)),
        "innocent_joints": share(len({r["key"] for r in whole if r["innocent"]}), len({r["key"] for r in whole})),
        "true_beaten": sorted({r["key"] for r in known if r["category"] != "error" and r["after"] < (1.0 - WITHIN) * r["true"]}),
        "true_fails": [
            {k: r[k] for k in ("key", "effect", "joint", "size", "hurts", "lowered", "category", "named")} for r in unseen if r.get("hurts", 0.0) >= VISIBLE
        ],
        "confusion": confusion(rows, controls), "errors": [{"key": r["key"], **r["error"]} for r in failed],
        "seconds": {robot: {"cases": len(own), "median": statistics.median(own), "most": max(own)} for robot, own in seconds.items() if own},
        "rows": rows,
    }  # fmt: skip


#: what is asked under each of the conditions; None: not asked
_ASKED = {
    "clean": {"cases": 300, "controls": 100, "named": 0.95, "alone": 0.87, "false": 0.03, "accused": 0.01, "unknown": 0.02, "at peace": 0.97},
    "nuisances": {"cases": 200, "controls": 50, "named": 0.90, "alone": None, "false": 0.05, "accused": None, "unknown": None, "at peace": 0.95},
    "sines": {"cases": 60, "controls": None, "named": None, "alone": None, "false": None, "accused": None, "unknown": None, "at peace": None},
}
_LAWS = (
    ("outside, old laws", "old laws (known while the method was tuned)", OLD, 0.80),
    ("outside, new laws", "new laws (no change of the method was made for them)", NEW, 0.85),
    ("outside, third laws", "third laws (written later, by somebody who had not seen the method)", THIRD, 0.85),
)
_LOWERED = (-1e9, 0.02, 0.05, 0.10, 0.20, 0.35, 0.50, 1.01)


def _bar(name: str, says: str, reached, bound: float, most: bool = False) -> dict:
    value = reached if isinstance(reached, int) else reached["share"]
    met = value is not None and bound is not None and (value <= bound if most else value >= bound)
    return {"name": name, "says": says, "reached": reached, "bound": bound, "most": most, "met": met}


def confusion(rows: list[dict], controls: list[dict]) -> dict:
    """Visible hidden effects by what was named on their joint; the controls' joints by what was named on them."""
    hidden = [*EFFECTS, *OUTSIDE, "nothing"]
    table: dict[str, dict[str, int]] = {name: {} for name in hidden}
    for row in rows:
        if row["visible"] and row["effect"] in table:
            table[row["effect"]][row["named"]] = table[row["effect"]].get(row["named"], 0) + 1
    for record in controls:
        for verdict in record.get("verdict", []):
            named = verdict.get("effect") or verdict["status"]
            table["nothing"][named] = table["nothing"].get(named, 0) + 1
    words = [*EFFECTS, *sorted({n for own in table.values() for n in own} - {*EFFECTS, "unknown", "unresolved", "complete", "error"}), "unknown", "unresolved", "complete", "error"]
    return {"hidden": hidden, "named": words, "counts": [[table[h].get(n, 0) for n in words] for h in hidden]}


# ---- figures

_BLUE, _ORANGE, _GREEN, _RED, _GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#999999"
_COLOURS = {"alone": _BLUE, "head of family": "#56B4E9", "in family, not head": _GREEN, "named among also": "#F0E442", "wrong": _RED, "unknown": _ORANGE, "unresolved": "#CC79A7", "missed": _GREY, "error": "black"}


def figures(found: dict, records: list[dict], out: Path, name: str = "blind_benchmark") -> list[Path]:
    """Write the figures into a folder."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    out.mkdir(parents=True, exist_ok=True)
    style = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "savefig.dpi": 140, "figure.constrained_layout.use": True}
    with matplotlib.rc_context(style):
        drawn = {"confusion": _draw_confusion(plt, found["confusion"]), "errors": _draw_errors(plt, found["rows"], records), "effects": _draw_effects(plt, found)}
        paths = []
        for part, figure in drawn.items():
            path = out / f"{name}_{part}.png"
            whole_files.write_atomically(path, lambda p, f=figure: f.savefig(p, format="png"))
            plt.close(figure)
            paths.append(path)
    return paths


def _draw_confusion(plt, table: dict):
    counts = np.array(table["counts"], dtype=float)
    rows = np.flatnonzero(counts.sum(1))
    columns = np.flatnonzero(counts.sum(0))
    counts = counts[np.ix_(rows, columns)] if len(rows) else np.zeros((1, 1))
    total = np.maximum(counts.sum(1, keepdims=True), 1.0)
    figure, axis = plt.subplots(figsize=(2.5 + 0.27 * counts.shape[1], 2.2 + 0.22 * counts.shape[0]))
    axis.imshow(counts / total, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for y, x in zip(*np.nonzero(counts)):
        axis.text(x, y, f"{counts[y, x]:.0f}", ha="center", va="center", fontsize=7, color="white" if counts[y, x] > 0.6 * total[y, 0] else "black")
    axis.set_xticks(range(len(columns)), [table["named"][k] for k in columns], rotation=60, ha="right", fontsize=7)
    axis.set_yticks(range(len(rows)), [table["hidden"][k] for k in rows], fontsize=7)
    border = sum(table["hidden"][k] in EFFECTS for k in rows)
    for line in (border, sum(table["hidden"][k] != "nothing" for k in rows)):
        axis.axhline(line - 0.5, color="black", linewidth=0.8)
    axis.set_xlabel("named on its joint (colour: share of the row)")
    axis.set_ylabel("hidden and visible; below the lines: outside the catalogue, nothing (by joint)")
    return figure


def _draw_errors(plt, rows: list[dict], records: list[dict]):
    noise = {r["key"]: r.get("noise") for r in records}
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.2))
    whole = [r for r in rows if r["category"] != "error" and r["visible"] and noise[r["key"]]]
    for says, colour, own in (
        ("named", _BLUE, [r for r in whole if r["category"] in (*NAMED, "explained")]),
        ("called unknown", _ORANGE, [r for r in whole if r["category"] == "unknown"]),
        ("else", _RED, [r for r in whole if r["category"] not in (*NAMED, "explained", "unknown")]),
    ):  # fmt: skip
        for axis, key, marker in ((left, "before", "x"), (left, "after", "o"), (right, "after", "o")):
            if key == "before":
                axis.scatter([r["true"] / r["scale"] for r in _scaled(own, noise)], [r["before"] / r["scale"] for r in _scaled(own, noise)], s=12, marker=marker, color=colour, alpha=0.35, linewidths=0.8)
            elif axis is left:
                axis.scatter([r["true"] / r["scale"] for r in _scaled(own, noise)], [r["after"] / r["scale"] for r in _scaled(own, noise)], s=12, color=colour, alpha=0.8, label=f"{says} ({len(own)})")
            else:
                own = [r for r in own if r["true"] > 0.0]
                axis.scatter([r["lowered"] for r in own], [r["after"] / r["true"] for r in own], s=12, color=colour, alpha=0.8)
    left.scatter([], [], marker="x", color=_GREY, label="before")
    left.scatter([], [], color=_GREY, label="after discover")
    low, high = left.get_xlim()[0], left.get_ylim()[1]
    left.plot([max(low, 0.5), high], [max(low, 0.5), high], color="black", linewidth=0.8)
    left.set_xscale("log")
    left.set_yscale("log")
    left.set_xlabel("held-out RMS of the true model, in units of the torque noise")
    left.set_ylabel("held-out RMS, same units")
    left.legend(frameon=False, fontsize=8)
    right.axhline(1.0 + WITHIN, color="black", linewidth=0.8, linestyle="--")
    right.axhline(1.0, color="black", linewidth=0.8)
    right.set_yscale("log")
    for which in (right.yaxis.set_major_formatter, right.yaxis.set_minor_formatter):
        which(plt.FuncFormatter(lambda value, place: f"{value:g}"))
    right.set_xlabel("share of the held-out RMS that the true model takes away")
    right.set_ylabel("held-out RMS after discover / of the true model")
    return figure


def _scaled(rows: list[dict], noise: dict) -> list[dict]:
    return [r | {"scale": max(noise[r["key"]][r["joint"]], 1e-300)} for r in rows]


def _draw_effects(plt, found: dict):
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 5.6), width_ratios=(1.2, 1.0))
    names = [e for e in EFFECTS if found["effects"][e]["hidden"]][::-1]
    at = np.zeros(len(names))
    for c in CATEGORIES:
        values = np.array([found["effects"][e][c] for e in names], dtype=float)
        if values.any():
            left.barh(range(len(names)), values, left=at, color=_COLOURS[c], label=c, height=0.75)
        at = at + values
    hidden = [found["effects"][e]["hidden"] for e in names]
    left.barh(range(len(names)), np.array(hidden) - at, left=at, color="none", edgecolor=_GREY, linewidth=0.6, height=0.75, label="not visible")
    left.set_yticks(range(len(names)), names, fontsize=8)
    left.set_xlabel("cases")
    left.xaxis.get_major_locator().set_params(integer=True)
    left.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    bins = [b for b in found["by_lowered"] if b["named"]["of"]]
    for key, colour, shift in (("named", _BLUE, -0.08), ("alone", _GREEN, 0.0), ("wrong", _RED, 0.08)):
        values = np.array([[b[key]["share"], b[key]["low"], b[key]["high"]] for b in bins]) if bins else np.zeros((0, 3))
        right.errorbar(np.arange(len(bins)) + shift, values[:, 0], [values[:, 0] - values[:, 1], values[:, 2] - values[:, 0]], fmt="o-", color=colour, markersize=4, linewidth=1, capsize=2, label={"named": "named (alone or head)", "alone": "named alone", "wrong": "another effect named"}[key])
    right.set_xticks(range(len(bins)), [f"{_range(b).replace(' %', '')}\n({b['named']['of']})" for b in bins], fontsize=8)
    right.set_ylim(0.0, 1.02)
    right.grid(alpha=0.25)
    right.set_xlabel("what the true model takes away of the held-out RMS [%] (cases)")
    right.set_ylabel("share of cases, 95 % intervals")
    right.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def _range(entry: dict) -> str:
    low, high = 100 * entry["from"], 100 * entry["to"]
    return f"< {high:g} %" if low < 0 else f"> {low:g} %" if high > 100 else f"{low:g}–{high:g} %"


# ---- the page


def _percent(entry: dict) -> str:
    if not entry["of"]:
        return "–"
    return f"{100 * entry['share']:.1f} % ({entry['count']} of {entry['of']}; {100 * entry['low']:.0f} to {100 * entry['high']:.0f} %)"


def _table(heads: list[str], rows: list[list]) -> str:
    lines = ["| " + " | ".join(heads) + " |", "|" + "|".join("---" if k == 0 else "---:" for k in range(len(heads))) + "|"]
    return "\n".join(lines + ["| " + " | ".join("·" if value == 0 and not isinstance(value, str) else str(value) for value in row) + " |" for row in rows])


def _spelled(nuisances: dict | None) -> str:
    return ", ".join(f"{word} {value}" for word, value in (nuisances or {}).items()) or "–"


def _name(under: str) -> str:
    return "blind_benchmark" + ("" if under == "clean" else f"_{under}")


def _quantiles(values: list[float]) -> str:
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f"median {middle:.2f}, 5 to 95 % {low:.2f} to {high:.2f}, largest {max(values):.2f}"


def _listed(words) -> str:
    *most, last = (f"`{word}`" for word in words)
    return f"{', '.join(most)} and {last}"


def page(found: dict, records: list[dict], settings: dict, notes: str = "") -> str:
    """The page of docs/, as Markdown."""
    bars, cases_, under = found["bars"], found["cases"], settings.get("conditions", "clean")
    name, mark = _name(under), "" if under == "clean" else f" --conditions {under}"
    hidden = sum(n for kind, n in cases_.items() if kind != "control")
    command = f"python scripts/blind_benchmark.py --cases {settings['cases']} --seed {settings['seed']}{mark}" + "".join(f" --only {w}" for w in settings["only"]) + (f" --limit {settings['limit']}" if settings["limit"] else "")
    met = [
        [b["says"], ("at most " if b["most"] else "at least ") + (f"{b['bound']}" if isinstance(b["reached"], int) else f"{100 * b['bound']:.0f} %"), b["reached"] if isinstance(b["reached"], int) else _percent(b["reached"]), "yes" if b["met"] else "**no**"]
        for b in bars
    ]
    short = [c for c in CATEGORIES if c != "error" or found["errors"]]
    by = lambda entry: [entry[c] for c in short]  # noqa: E731
    total = lambda entry: sum(entry[c] for c in CATEGORIES)  # noqa: E731
    rows = found["rows"]
    misnamed = [r for r in rows if r["kind"] in ("one", "two") and r["visible"] and r["effect"] not in ABSORBED and r["category"] not in NAMED]
    accused = [(r, v) for r in records if r["kind"] == "control" and r["error"] is None for v in r["verdict"] if v["status"] != "complete"]
    outside = [r for r in rows if r["kind"] == "outside" and r["visible"] and r["category"] not in ("unknown", "explained")]
    far = [r for r in rows if r["kind"] in ("one", "two") and r["visible"] and r["category"] in NAMED and not r["within"]]
    invisible = [r for r in rows if r["kind"] in ("one", "two") and not r["visible"]]
    parts = [
        "# Blind benchmark: is the missing effect found?",
        "This page is written by `scripts/blind_benchmark.py` from its results; nothing in it is edited by hand except the notes at its end.",
        f"    {command} --jobs 2 --publish",
        f"{hidden} simulated experiments with something hidden ({cases_['one']} with one effect of the catalogue, {cases_['two']} with two, {cases_['outside']} with one "
        f"that the catalogue does not have) and {cases_['control']} controls with nothing hidden; two logs of {min(SECONDS.values()):g} to {max(SECONDS.values()):g} s each, one to train and one held out; "
        f"base seed {settings['seed']}, from which every case draws a seed of its own. `sysid discover` sees the folder that `sysid simulate` writes and nothing of "
        "the truth. Joints, sizes (log-uniform from 0.3 to 3 times the simulator's default), masses, friction, motion and the colour of the noise are drawn.",
        conditions.SAYS[under],
        "An effect is **visible** when the true model, refitted, lowers the held-out RMS of its joint by at least 10 % (of any joint for an effect of the whole robot; "
        "of two effects, against the model that has the other one). Intervals are Wilson's, 95 %.",
        "## What was asked and what was reached",
        _table(["", "asked", "reached", "met"], met),
        "## Visible effects",
        _table(["", *short, "visible"], [
            ["all", *by(found["visible"]["all"]), total(found["visible"]["all"])], ["one hidden", *by(found["visible"]["one"]), total(found["visible"]["one"])],
            ["two hidden", *by(found["visible"]["two"]), total(found["visible"]["two"])], *[[robot, *by(entry), total(entry)] for robot, entry in found["robots"].items()],
        ]),
        "\n".join(f"- {c}: {MEANS[c]}." for c in short),
        f"Of the named, {_percent(found['named_with_extras'])} have a further effect on the same joint that is not there. With anything hidden, "
        f"{_percent(found['innocent_joints'])} of the cases accuse a joint in which nothing is hidden.",
        "### By effect",
        _table(["hidden", "cases", "visible", *short], [[e, entry["hidden"], total(entry), *by(entry)] for e, entry in found["effects"].items()]),
        f"![Naming by effect and by visibility](figures/{name}_effects.png)",
        f"![Confusion matrix](figures/{name}_confusion.png)",
        "### By visibility",
        _table(["the true model takes away, of the RMS", "named", "alone", "another named"], [[_range(b), _percent(b["named"]), _percent(b["alone"]), _percent(b["wrong"])] for b in found["by_lowered"]]),
        f"Hidden and not visible: {len(invisible)}; of these " + ", ".join(f"{n} {c}" for c in CATEGORIES if (n := sum(r["category"] == c for r in invisible))) + "." if invisible else "",
        "Not visible, although the same logs without the effect have a held-out RMS at least 10 % lower: here the catalogue's own model of the effect, refitted, does not "
        "describe what the simulator does, or its values are not found.",
        _table(["case", "hidden", "on", "size", "RMS lower without the effect", "lowered by the true model", "outcome", "named"], [
            [f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", f"{100 * r['hurts']:.0f} %", _lowered(r), r["category"], r["named"]] for r in found["true_fails"]
        ]) if found["true_fails"] else "None.",
        "Payload in every log is the last link's own inertia, and pushes come at other times in the held-out log: no model can predict either, so they count as not visible. "
        + "; ".join(f"{e}: " + (", ".join(f"{n} {c}" for c, n in entry.items() if n) or "none run") for e, entry in found["absorbed"].items()) + ".",
        "## Controls",
        f"Accused: {_percent(found['controls']['accused'])}. Called unknown on some joint: {_percent(found['controls']['unknown'])}. White and coloured noise (5 to 300 ms), "
        "encoders from exact enough to coarse, speeds from half to 1.25 times the usual.",
        _table(["robot", "controls", "accused", "unknown"], [[robot, *entry.values()] for robot, entry in found["controls"]["by_robot"].items()]),
        f"Unresolved on some joint, which is no accusation: {_percent(found['controls']['unresolved'])}.",
        "## Claims that are not there, and the noise floor",
        f"Claims are the (effect, joint) pairs that first verdicts name, on the joint of an outside law excepted. Not there: {_percent(found['claims']['false'])}; "
        f"where the family or set is counted with it: {_percent(found['claims']['false_families_too'])}."
        + (f" Effects in a set that names something: {found['claims']['members']:.1f} on average." if found["claims"]["members"] else ""),
        "True noise is what torque noise, encoder and clock add to the residual of the first fit, over all logs; spikes and closed brakes are none.",
        f"Noise floor within 25 % of the true noise, or null: {_percent(found['floors']['good'])} of the joints; null: {_percent(found['floors']['null'])}."
        + (f" Floor over true noise: {_quantiles(found['floors']['ratio'])}." if found["floors"]["ratio"] else ""),
        _table(["case", "claimed", "on", "its family holds what is hidden"], [[f"`{c['key']}`", c["effect"], c["joint"], "yes" if c["held"] else "no"] for c in found["claims"]["list"]])
        if found["claims"]["list"] else "",
        "## Effects outside the catalogue",
        f"{_listed(OLD)} are old: they were known when the method was last tuned. {_listed(NEW)} were written before the method was changed, which is never done for one of them. "
        f"{_listed(THIRD)} were written later, before it was changed again, by somebody who had not seen it.",
        _table(["torque", "cases", "visible", "unknown", f"explained ({100 * EXPLAINED:.0f} % of the misfit)", "wrong", "of these, structure left is said", "unresolved", "missed"],
               [[f"{kind}: {OUTSIDE[kind][0]}", e["hidden"], e["visible"], e["unknown"], e["explained"], e["wrong"], e["admits"], e["unresolved"], e["missed"]] for kind, e in found["outside"].items()]),
        f"To be read beside the controls, of whose joints {_percent(found['controls']['unknown_joints'])} are called unknown with nothing hidden: the word is worth what they leave of it.",
        "## The error before, after, and with the true model",
        f"![Held-out error](figures/{name}_errors.png)",
        f"Discovered models that beat the true one, refitted, by more than 5 % of the RMS: {', '.join(f'`{k}`' for k in found['true_beaten']) or 'none'}.",
        "## What went wrong, case by case",
        f"Each can be looked at again: `python scripts/blind_benchmark.py --seed {settings['seed']}{mark} --only KEY --verbose`.",
        "### Visible effects not named",
        _table(["case", "hidden", "on", "size", "RMS taken away by the true model", "outcome", "named", "RMS after / true"], [
            [f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", _lowered(r), r["category"], r["named"], f"{r['after'] / r['true']:.2f}" if r.get("true") else "–"] for r in misnamed
        ]) if misnamed else "None.",
        "### Named, and yet farther than 5 % from the true model",
        _table(["case", "hidden", "on", "size", "RMS taken away by the true model", "RMS after / true"], [[f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", _lowered(r), f"{r['after'] / r['true']:.2f}"] for r in far]) if far else "None.",
        "### Controls that are not complete",
        _table(["case", "joint", "verdict", "noise's colour [s]", "encoder [bits]", "pace", "nuisances"], [
            [f"`{r['key']}`", v["joint"], " ".join([v["effect"], *(f"(or {t})" for t in family(v, v["joint"]))]) if v["status"] == "missing" else v["status"], *(str(r["conditions"][k] or "–") for k in ("colour", "encoder", "pace")), _spelled(r["conditions"].get("nuisances"))]
            for r, v in accused
        ]) if accused else "None.",
        "### Outside the catalogue, neither unknown nor explained",
        _table(["case", "hidden", "on", "size", "RMS taken away without it", "named", "misfit removed", "structure left is said"], [
            [f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", _lowered(r), r["named"], f"{100 * r['removed']:.0f} %" if r.get("removed") is not None else "–", "yes" if r.get("admits") else "no"] for r in outside
        ]) if outside else "None.",
        "### Crashes",
        "\n".join(f"- `{e['key']}` in {e['stage']}: {e['message']}" for e in found["errors"]) or "None.",
        "## Time",
        _table(["robot", "cases", "median [s]", "longest [s]"], [[robot, e["cases"], f"{e['median']:.1f}", f"{e['most']:.1f}"] for robot, e in found["seconds"].items()]),
        "One case is two simulated logs, one or more fits of the true model, and `sysid discover`, in one process of several on a shared machine.",
        f"Package source {settings['source']}; " + ", ".join(f"{name} {version}" for name, version in settings["versions"].items()) + ".",
        notes.strip(),
    ]  # fmt: skip
    return "\n\n".join(part for part in parts if part) + "\n"


def _lowered(row: dict) -> str:
    return "–" if row["lowered"] is None else f"{100 * row['lowered']:.0f} %"


# ---- one case, told in full


def tell(record: dict, folder: Path) -> None:
    """Print a record for a person."""
    print(f"{record['key']}  ({record['kind']}), {record['conditions']}")
    for entry in record["hidden"]:
        print(f"  hidden: {entry['effect']} on {entry['joint']}, size {entry['size']}, {entry.get('values')}")
    if record["error"]:
        print(f"  ERROR in {record['error']['stage']}: {record['error']['message']}\n{record['error']['trace']}")
    if "before" in record["rms"]:
        print(f"  {'joint':22s} {'noise':>9s} {'floor':>9s} {'before':>9s} {'after':>9s} {'true':>9s}   verdict")
        for v in record["verdict"]:
            j, rms = v["joint"], record["rms"]
            said = v["status"] if v["status"] != "missing" else " ".join([v["effect"], f"tied {family(v, v['joint'])}" if family(v, v["joint"]) else "", f"also {v['also']}" if v.get("also") else ""])
            left = f"  left {v['share_left']:.2f} by {v['depends_on']}" if "share_left" in v else ""
            print(f"  {j:22s} {record['noise_seen']['all'][j]:9.4f} {math.nan if record['floors'][j] is None else record['floors'][j]:9.4f} {rms['before'][j]:9.4f} {rms['after'][j]:9.4f} {rms.get('true', {}).get(j, math.nan):9.4f}   {said}{left}")
        for f in record["findings"]:
            step = f"step {f['step']}" if f["step"] is not None else ""
            print(f"  finding: {f['effect']}:{f['joint']} removes {f['removed']}, tied {f['tied_with']} {step} { {n: float(f'{v:.3g}') for n, v in f['parameters'].items() if v is not None} }")
        print(f"  discover added {record['added']}, refused {record['refused']}, ended {[(v['joint'], v['status']) for v in record['last'] if v['status'] != 'complete']}")
    for row in score(record):
        more = "" if row["lowered"] is None else f", the true model lowers the RMS by {100 * row['lowered']:.1f} %" + (f" (without the effect it is {100 * row['hurts']:.1f} % lower)" if "hurts" in row else "")
        print(f"  -> {row['effect']} on {row['joint']}: {row['category'].upper()} ({row['named']}){more}, {'visible' if row['visible'] else 'not visible'}"
              + (f", after/true {row['after'] / row['true']:.3f}" if "after" in row else "") + (f", misfit removed {row['removed']:.2f}" if row.get("removed") is not None else ""))  # fmt: skip
    print(f"  {({k: round(v, 1) for k, v in record['seconds'].items()})}; folder {folder}", flush=True)


# ---- the whole


def source() -> str:
    """A short name of the state of the package's source and of this script."""
    digest = hashlib.sha256()
    for file in [*sorted((ROOT / "sysid").rglob("*.py")), *sorted((HERE / "benchmark_parts").glob("*.py")), Path(__file__)]:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:10]


def finish(records: list[dict], settings: dict, out: Path, publish: bool) -> dict:
    """Write results.json, the figures and the page; into docs/ too where they are to be published."""
    under = settings.get("conditions", "clean")
    found, name = summary(records, under), _name(under)
    whole_files.write_json(out / "results.json", _plain({"settings": settings, "summary": found, "records": records}))
    notes = ROOT / "docs" / f"{name}_notes.md"
    text = page(found, records, settings, notes.read_text(encoding="utf-8") if notes.exists() else "")
    for folder in [out, *([ROOT / "docs"] if publish else [])]:
        figures(found, records, folder / "figures", name)
        whole_files.write_atomically(folder / f"{name}.md", lambda p: p.write_text(text, encoding="utf-8"))
    return found


def _plain(value):
    """A document without NaN and infinity."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return fit_document.number(value) if isinstance(value, float) else value


def main(arguments: list[str] | None = None) -> None:
    """Run the cases that the journal lacks, and write the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", choices=["full", "small"], default="full")
    parser.add_argument("--conditions", choices=conditions.CONDITIONS, default="clean", help="of the logs: clean, with what labs' logs have, or one slow sine a joint")
    parser.add_argument("--seed", type=int, default=1, help="base seed; 1 was used while developing (default)")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="default runs/blind_benchmark, with the conditions' name behind it")
    parser.add_argument("--only", action="append", default=[], metavar="ROBOT/WHAT/NUMBER", help="cases whose key has these parts; may be repeated; list with --list")
    parser.add_argument("--limit", type=int, default=0, help="at most so many cases")
    parser.add_argument("--list", action="store_true", help="print the cases and leave")
    parser.add_argument("--verbose", action="store_true", help="run again, tell each case in full and keep its folder; nothing is recorded")
    parser.add_argument("--publish", action="store_true", help="write the page and its figures into docs/ too")
    parser.add_argument("--report", type=Path, metavar="DIR", help="write the page again from DIR/results.json")
    options = parser.parse_args(arguments)
    if options.report:
        read = json.loads((options.report / "results.json").read_text())
        _tell_bars(finish(read["records"], read["settings"], options.report, options.publish))
        return
    options.out = options.out or Path("runs") / _name(options.conditions)
    chosen = [c for c in cases(options.seed, options.cases, options.conditions) if not options.only or any(matches(c.key, w) for w in options.only)]
    chosen = chosen[: options.limit or None]
    if not chosen:
        parser.error("no case has such a key; see --list")
    if options.list:
        for case in chosen:
            print(case.key, case.kind, " ".join(f"{h['effect']}:{h['joint']}:{h['size']:.2f}" for h in case.hidden), _conditions(case))
        return
    if options.verbose:
        for case in chosen:
            folder = options.out / "cases" / case.key.replace("/", "-")
            shutil.rmtree(folder, ignore_errors=True)
            tell(json.loads(json.dumps(one(asdict(case), str(folder)))), folder)
        return
    out = whole_files.folder(options.out)
    state = source()
    settings = {"seed": options.seed, "conditions": options.conditions, "duration": SECONDS, "rate": RATE, "most": MOST_STEPS, "source": state, "versions": fit_document.versions()}
    journal = Journal(out / f"journal-{conditions.MARKS[options.conditions]}{options.seed}-{state}.jsonl", settings)
    with watched.progress_bar() as progress:
        done = run(journal, [(case.key, (asdict(case),)) for case in chosen], one, jobs=options.jobs, progress=lambda s: progress(f"{len(chosen)} cases", s))
    records = sorted(done.values(), key=lambda r: r["key"])
    settings |= {"cases": options.cases, "only": options.only, "limit": options.limit}
    _tell_bars(finish(records, settings, out, options.publish))
    print(f"results: {out}/results.json, {out}/{_name(options.conditions)}.md")


def _tell_bars(found: dict) -> None:
    for bar in found["bars"]:
        reached = bar["reached"] if isinstance(bar["reached"], int) else _percent(bar["reached"])
        print(f"{'met    ' if bar['met'] else 'NOT MET'}  {bar['says']}: {reached}")
    print(f"controls called unknown: {_percent(found['controls']['unknown'])}; crashes: {len(found['errors'])}")


if __name__ == "__main__":
    main()
