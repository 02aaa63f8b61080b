"""Are knocks found, and nothing else taken for one? Logs of simulated arms that were pushed, and of arms that were not.

    python scripts/knock_study.py --number 120 --seed 1 --jobs 2 --out runs/knocks
    python scripts/knock_study.py --seed 1 --out runs/knocks --table      # of what is done, and nothing more

Planar arms, legs and UR5s, half of them with an effect that a rigid body with friction does not have, go from point to point, in
sines or in exciting motions for 12 s. Half are pushed three times in each log. A push is found where a knock is told within a
tenth of a second of it; a false knock is one that no push is near.

Resumes: finished cases stand in a journal in --out, named after the seed and the state of the package's source.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])

ROBOTS, MOTIONS = ("planar", "leg", "ur5"), ("moves", "sines", "exciting")
HIDDEN = (
    "stribeck", "asymmetric_coulomb", "asymmetric_viscous", "quadratic_drag", "sublinear_viscous", "load_friction",
    "directional_efficiency", "position_friction", "presliding", "encoder_offset", "warmup", "delay", "current_lag", "backlash",
    "elasticity", "torque_saturation", "cogging", "torque_gain", "torque_bias", "spring", "cable", "joint_coupling",
)  # fmt: skip
JARRING = ("backlash", "elasticity")  # which strike or swing by themselves
_NEAR, _PUSHES, _SECONDS = 0.1, 3, 12.0


def case(seed: int, number: int) -> dict:
    """Robot, motion, what is hidden and whether it is pushed."""
    rng = np.random.default_rng([seed, number])
    effect = str(rng.choice(HIDDEN)) if rng.random() < 0.5 else None
    return {
        "robot": ROBOTS[number % 3], "motion": MOTIONS[number // 3 % 3], "pushed": bool(number // 9 % 2), "effect": effect,
        "size": float(rng.choice([1.0, 2.5])), "seed": int(rng.integers(2**31)),
    }  # fmt: skip


def trial(case: dict) -> dict:
    """How many pushes were found, how many knocks are false, of each log."""
    from scripts.design_parts.robots import JOINTS, RATE, experiment_of
    from sysid import experiment_logs, pipeline, simulate
    from sysid.errors import SysidError

    rng = np.random.default_rng(case["seed"])
    joint = str(rng.choice(JOINTS[case["robot"]][:4]))
    hide = [f"{case['effect']}:{joint}:size={case['size']:g}"] if case["effect"] else []
    told = {**case, "pushes": 0, "found": 0, "false": 0, "logs": 0}
    with tempfile.TemporaryDirectory() as place, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        experiment, machine = experiment_of(case["robot"], Path(place))
        how = {"duration": _SECONDS, "rate": RATE[case["robot"]], "motion": case["motion"], "knocks": _PUSHES * case["pushed"]}
        try:
            made = simulate.simulate(machine, hide=[simulate.hidden(h) for h in hide], seed=case["seed"] % 10**6, **how)
        except SysidError:  # a size that this robot cannot have
            return told
        simulate.write(made, experiment, Path(place) / "case")
        experiment = pipeline.load(Path(place) / "case")
        for part in (experiment.data.train, experiment.data.test):
            for log in experiment_logs.read(experiment, machine, part):
                pushes = [(e["start"], e["stop"]) for e in made.logs[log.path.stem].events if e["kind"] == "knock"]
                knocks = [(e.start, e.stop) for e in log.events if e.kind == "knock"]
                told["logs"] += 1
                told["pushes"] += len(pushes)
                told["found"] += sum(any(_near(one, knock) for knock in knocks) for one in pushes)
                told["false"] += sum(not any(_near(one, knock) for one in pushes) for knock in knocks)
    return told


def _near(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one[0] <= other[1] + _NEAR and other[0] <= one[1] + _NEAR


def table(results: list[dict]) -> list[str]:
    """By motion: pushes found, and cases with a knock that is none."""
    out = []
    for motion in MOTIONS:
        own = [r for r in results if r["motion"] == motion and r["logs"]]
        plain = [r for r in own if r["effect"] not in JARRING]
        jarring = [r for r in own if r["effect"] in JARRING]
        out.append(
            f"{motion:9} pushes found {sum(r['found'] for r in own)}/{sum(r['pushes'] for r in own)}; "
            f"arms with a knock that is none {sum(r['false'] > 0 for r in plain)}/{len(plain)}, "
            f"of soft and loose ones {sum(r['false'] > 0 for r in jarring)}/{len(jarring)}"
        )
    return out


def main(arguments: list[str] | None = None) -> None:
    """Run the study, print its table."""
    from scripts.journaled import results
    from sysid import fit_document

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=60)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/knocks"))
    parser.add_argument("--table", action="store_true", help="of what is done, and nothing more")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    settings = {"seed": options.seed, "source": fit_document.program()[:8]}
    path = options.out / f"knocks_{options.seed}_{settings['source']}.jsonl"
    tasks = [(str(n), (case(options.seed, n),)) for n in range(options.number)]
    how = {"jobs": options.jobs, "more": not options.table}
    print("\n".join(table(results(path, settings, tasks, trial, **how))))


if __name__ == "__main__":
    main()
