"""Logs as poor as labs have them, given to a diagnosis: verdicts or one line, never a traceback, a warning or a number that is none.

    python scripts/fuzz_logs.py --number 200 --seed 1 --jobs 2

A case is a simulated robot, with something hidden or nothing, and logs that are short, slow, coarse, knocked, braked, loud or
without noise, one or several; in some of them a column is wrong: a joint that never moves, torque that is all zero, of the
other sign or of another joint, angles in degrees, a recording that is cut. All is drawn from the seed and the number of the
case, and written as `sysid simulate` writes it. `sysid diagnose --json` must end with status 0 and a document, or with 2 and
one line. Prints what it found, and exits with 1 where anything was.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import argparse
import contextlib
import io
import json
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from unittest import mock

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts.blind_parts.robots import JOINTS, experiment_of  # noqa: E402

HIDDEN = ("stribeck", "asymmetric_viscous", "load_friction", "position_friction", "presliding", "encoder_offset", "warmup", "delay")
WRONG = ("still", "zero torque", "torque's sign", "torques swapped", "degrees", "cut")


def drawn(seed: int, number: int) -> dict:
    """A case: robot, what is hidden, how `simulate` makes its logs, and what is wrong with them, if anything."""
    rng = np.random.default_rng([seed, number])
    one_of = lambda *values: values[int(rng.integers(len(values)))]  # noqa: E731
    robot = one_of("planar", "planar", "leg", "leg", "ur5")
    how = {
        "duration": one_of(1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0), "rate": one_of(100.0, 250.0, 500.0, 1000.0),
        "motion": one_of("moves", "sines", "exciting"), "logs": one_of(1, 1, 2, 4), "knocks": one_of(0, 0, 2), "spikes": one_of(0.0, 0.0, 0.5),
        "jitter": one_of(0.0, 0.0, 2.0), "current": one_of(None, None, "2%", "10%"), "encoder": one_of(None, None, 0, 8),
        "colour": one_of(None, None, 0.1, 1.0), "noise": one_of(None, None, 1e-6, 2.0), "seed": int(rng.integers(2**31)),
    }  # fmt: skip
    how["brakes"] = how["motion"] == "moves" and one_of(False, True)
    effect = f"{one_of(*HIDDEN)}:{one_of(*JOINTS[robot])}:size={one_of(1, 2.5)}"
    return {"robot": robot, "hide": one_of(effect, effect, None), "how": how, "wrong": one_of(None, None, *WRONG)}


def spoilt(folder: Path, wrong: str, joint: str, other: str) -> None:
    """Write the training logs of a case again, with something wrong with a joint's columns."""
    import polars as pl

    q, tau, tau_other = (pl.col(name) for name in (f"q_{joint}", f"tau_{joint}", f"tau_{other}"))
    columns = {
        "still": [q.first().alias(f"q_{joint}")],
        "zero torque": [(0.0 * tau).alias(f"tau_{joint}")],
        "torque's sign": [-tau],
        "torques swapped": [tau.alias(f"tau_{other}"), tau_other.alias(f"tau_{joint}")],
        "degrees": [q * 57.29577951308232],
        "cut": [],
    }[wrong]
    for file in folder.glob("train*.csv"):
        table = pl.read_csv(file).with_columns(columns)
        (table.head(max(4, table.height // 3)) if wrong == "cut" else table).write_csv(file)


def made(case: dict, folder: Path) -> bool:
    """Write a case's experiment; False where this robot cannot have what is asked."""
    from sysid.errors import SysidError
    from sysid.simulate import hidden, simulate, write

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            experiment, machine = experiment_of(case["robot"], folder)
            simulation = simulate(machine, hide=[hidden(case["hide"])] if case["hide"] else [], **case["how"])
            write(simulation, experiment, folder / "case")
    except SysidError:
        return False
    if case["wrong"]:
        spoilt(folder / "case", case["wrong"], *JOINTS[case["robot"]][:2])
    return True


def diagnosed(folder: Path) -> str:
    """What a diagnosis of an experiment comes to: "told", "refused", or what is wrong with it."""
    from sysid.cli import main

    out, err, status = io.StringIO(), io.StringIO(), 0
    asked = ["sysid", "diagnose", str(folder), "--json", "--quiet", "--out", str(folder.parent / "run")]
    try:
        with mock.patch.object(sys, "argv", asked), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("error")
            main()
    except SystemExit as end:
        status = end.code or 0
    except Exception as error:  # noqa: BLE001 - what is looked for
        last = [f"{Path(f.filename).name}:{f.lineno} {f.name}" for f in traceback.extract_tb(error.__traceback__) if "sysid" in f.filename]
        return f"{type(error).__name__}: {error} ({', '.join(last[-3:])})"
    if status == 2:
        lines = err.getvalue().strip().splitlines()
        return "refused" if lines and "Traceback" not in err.getvalue() else f"refused in {len(lines)} lines: {err.getvalue()[-300:]}"
    if status != 0:
        return f"status {status}: {err.getvalue()[-300:]}"
    try:
        json.loads(out.getvalue(), parse_constant=lambda name: (_ for _ in ()).throw(ValueError(f"{name} in the document")))
    except ValueError as error:
        return str(error)
    return "told"


def one(seed: int, number: int) -> tuple[dict, str]:
    """A case and what became of it."""
    case = drawn(seed, number)
    with tempfile.TemporaryDirectory() as place:
        return case, diagnosed(Path(place) / "case") if made(case, Path(place)) else "not made"


def main(arguments: list[str] | None = None) -> int:
    """Draw cases, diagnose them, print what is wrong; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args(arguments)
    numbers, count, bad = range(options.first, options.first + options.number), Counter(), 0
    # a process that is forked while polars' threads are at work may wait for them for ever
    several = ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) if options.jobs > 1 else contextlib.nullcontext()
    with several as pool:
        every = (pool.map if pool else map)(one, [options.seed] * len(numbers), numbers)
        for number, (case, came_to) in zip(numbers, every):
            usual = came_to in ("told", "refused", "not made")
            count[came_to if usual else "WRONG"] += 1
            bad += not usual
            if not usual:
                print(f"{number}: {came_to}\n    {json.dumps(case)}", flush=True)
    print(", ".join(f"{name} {k}" for name, k in count.most_common()))
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
