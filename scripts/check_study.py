"""How often the log doctor is right: python scripts/check_study.py --logs 5 --clean 40 --seed 11

Every fault that `sysid check` knows is planted in simulated logs of several robots, one at a time, at a size drawn from a range
that would spoil or bend a fit; and clean logs of the same robots are checked as they are. A fault is found where it is named on
its joint (any joint of it where it is of several). What else is named beside it is counted apart.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import sys
import tempfile
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts.blind_parts.robots import RATE, SECONDS, experiment_of  # noqa: E402
from scripts.check_parts import faults  # noqa: E402
from scripts.check_parts.faults import MADE, Planted  # noqa: E402
from sysid import pipeline, whole_files  # noqa: E402
from sysid.check import ERROR, FAULTS, check  # noqa: E402
from sysid.simulate import simulate, write  # noqa: E402

ROBOTS = ("planar", "leg", "ur5", "panda")


def one(task: tuple[str, int, int]) -> dict:
    """Plant a fault ("" for none) in a robot's logs, and what the check says of them."""
    fault, number, seed = task
    rng = np.random.default_rng([seed, number, FAULTS.index(fault) if fault else len(FAULTS)])
    robot = ROBOTS[number % len(ROBOTS)]
    out = {"fault": fault, "number": number, "robot": robot}
    with tempfile.TemporaryDirectory() as where, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(where)
        experiment, machine = experiment_of(robot, folder)
        options = {
            "duration": SECONDS[robot],
            "rate": RATE[robot],
            "colour": float(rng.choice([0.0, 0.02, 0.1])) or None,
            **MADE.get(fault, {}),
        }
        try:
            write(
                simulate(machine, seed=int(rng.integers(1 << 30)), **options),
                experiment,
                folder / "logs",
            )
            joint: str | tuple = tuple(machine.joints)
            if fault and fault not in MADE:
                planted = Planted(folder / "logs", machine.joints, rng)
                planted.step = 1.0 / RATE[robot]
                getattr(faults, fault)(planted)
                planted.save()
                joint = planted.joint
            found = check(pipeline.load(folder / "logs"))
        except Exception as error:  # noqa: BLE001 - told with the others
            return out | {"error": repr(error)[:300], "found": False, "beside": []}
    named = {(f.fault, f.joint) for f in found}
    hit = (
        (fault, joint) in named
        if isinstance(joint, str)
        else any((fault, j) in named for j in (*joint, ""))
    )
    beside = [(f.fault, f.severity, f.joint, f.says) for f in found if f.fault != fault]
    return out | {"joint": joint, "found": hit, "beside": beside}


def main() -> None:
    """Run, print and write what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=5, help="of each fault")
    parser.add_argument("--clean", type=int, default=40)
    parser.add_argument(
        "--seed", type=int, default=1, help="base seed; 1 was used while developing"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--out", type=Path, default=Path("runs/check_study"))
    options = parser.parse_args()
    faults = options.only or FAULTS
    tasks = [(fault, k, options.seed) for fault in faults for k in range(options.logs)]
    tasks += [("", k, options.seed) for k in range(options.clean)]
    with ProcessPoolExecutor(options.jobs) as pool:
        records = list(pool.map(one, tasks))
    for fault in faults:
        own = [r for r in records if r["fault"] == fault]
        missed = [
            f"{r['robot']}{': ' + r['error'] if 'error' in r else ''}"
            for r in own
            if not r["found"]
        ]
        others = sorted({f"{b[0]}" for r in own for b in r["beside"]})
        print(
            f"{fault:20} {sum(r['found'] for r in own)} of {len(own)}  missed: {missed}  beside: {others}"
        )
    clean = [r for r in records if not r["fault"]]
    told = [b for r in clean for b in r["beside"]]
    print(
        f"clean: {len(clean)} logs, {sum(b[1] == ERROR for b in told)} errors, {sum(b[1] != ERROR for b in told)} warnings"
    )
    for record in clean:
        for entry in record["beside"]:
            print("  ", record["robot"], entry)
    planted = [r for r in records if r["fault"]]
    print(json.dumps({"planted": len(planted), "found": sum(r["found"] for r in planted)}))
    whole_files.write_json(
        whole_files.folder(options.out) / "check_study.json", {"records": records}
    )


if __name__ == "__main__":
    main()
