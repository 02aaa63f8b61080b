"""Does a designed motion keep its word? Five studies of `sysid design` on simulated robots.

    python scripts/design_study.py ties --number 20 --seed 7 --out runs/design
    python scripts/design_study.py precision --number 4 --seed 7 --out runs/design
    python scripts/design_study.py promise --number 6 --seed 7 --out runs/design
    python scripts/design_study.py limits --number 20 --seed 7 --out runs/design
    python scripts/design_study.py solvers --number 3 --seed 7 --out runs/design

ties: robots with a poor first log that leaves a tie of two or more that holds what is hidden; a second log of 20 s, designed to
separate them, designed for precision, or random; how many are then named alone.

precision: log det of the designed motion against the best of many random ones and a design for the condition number.

promise: predicted against achieved standard deviations over draws of the noise.

limits: every design is looked at again at a kilohertz by code that shares none with the design.

solvers: the same criterion and limits, from the same starts, by the package's linear programs and by others.

All resume: finished cases stand in a journal in --out, named after the seed and the state of the package's source.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
)


def main(arguments: list[str] | None = None) -> None:
    """Run a study, print its table."""
    import importlib

    from scripts.journaled import results
    from sysid import fit_document

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", choices=("ties", "precision", "promise", "limits", "solvers"))
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--number", type=int, default=8)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--robots", help="planar,leg,ur5,panda: these alone")
    parser.add_argument("--out", type=Path, default=Path("runs/design"))
    parser.add_argument("--table", action="store_true", help="of what is done, and nothing more")
    options = parser.parse_args(arguments)
    part = importlib.import_module(f"scripts.design_parts.{options.study}")
    robots = tuple(options.robots.split(",")) if options.robots else part.ROBOTS
    options.out.mkdir(parents=True, exist_ok=True)
    settings = {"seed": options.seed, "source": fit_document.program()[:8], "robots": robots}
    path = (
        options.out
        / f"{options.study}_{options.seed}_{'_'.join(robots)}_{settings['source']}.jsonl"
    )
    tasks = [(str(n), (part.case(options.seed, n, robots),)) for n in range(options.number)]
    how = {"jobs": options.jobs, "more": not options.table}
    done = results(path, settings, tasks, part.trial, **how)
    print("\n".join(part.table(done)))


if __name__ == "__main__":
    main()
