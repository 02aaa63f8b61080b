"""Does `sysid fleet` keep its word? Studies on simulated robots.

    python scripts/fleet_study.py oddities --number 25 --seed 1 --out runs/fleet
    python scripts/fleet_study.py questions --number 1 --seed 1 --out runs/fleet

oddities: fleets of 40 arms with drawn differences; four of five without a fault, in each fifth one
has a worn joint and another something left on its hand: found, named, sized, and false alarms.

questions: a held model and 200 logs of 10 s, each asked what changed on it; seconds.

All resume: finished cases stand in a journal in --out, named after the seed and the state of the
package's source.
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
STUDIES = ("oddities", "questions", "following")


def main(arguments: list[str] | None = None) -> None:
    """Run a study, print its table."""
    import importlib

    from sysid import fit_document
    from sysid.studies.journal import Journal, run

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", choices=STUDIES)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=25)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/fleet"))
    given = parser.parse_args(arguments)
    part = importlib.import_module(f"scripts.fleet_parts.{given.study}")
    given.out.mkdir(parents=True, exist_ok=True)
    path = given.out / f"{given.study}-{given.seed}-{fit_document.program()[:8]}.jsonl"
    cases = [part.case(given.seed, k) for k in range(given.number)]
    tasks = [(str(k), (case,)) for k, case in enumerate(cases)]
    journal = Journal(path, {"study": given.study, "seed": given.seed})
    results = run(journal, tasks, part.trial, jobs=given.jobs)
    print("\n".join(part.told(list(results.values()))))


if __name__ == "__main__":
    main()
