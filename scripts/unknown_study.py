"""How often does a function of the motion stand out of a joint where nothing is missing?

    python scripts/unknown_study.py --logs 120 --seed 41 --jobs 2

Robots as in `evidence_study.py`, with nothing hidden, in motion without a stop and from point to point with brakes, in noise that is
white or remembers up to 0.3 s. The diagnosis asks functions of the motion of joints alone that stand above their noise floors; here they
are asked of every joint, one by one (on training and test logs) and all together, and the shares with a chance below 5 and 1 % are to be these.

Resumes: finished logs stand in a journal in --out, named after the seed and the state of the package's source.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import sys
import tempfile
import warnings
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])

from scripts.evidence_study import conditions, view_of  # noqa: E402
from sysid import fit_document, whole_files  # noqa: E402
from sysid.errors import SysidError  # noqa: E402
from sysid.studies.journal import Journal, run  # noqa: E402
from sysid.terminal import watched  # noqa: E402

MOTIONS, SLOW, LEVELS = ("exciting", "moves"), 0.1, (0.05, 0.01)


def one(case: dict) -> dict:
    """Of every joint, the chance of the function that stands out most, and that of all together."""
    from sysid.experiment_logs import read
    from sysid.view import elsewhere, law

    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        try:
            view = view_of(case, Path(folder), motion=case["motion"], brakes=case["motion"] == "moves")
        except SysidError as error:  # this robot does not follow its reference
            return {**case, "impossible": str(error)[:120]}
        more = elsewhere(view, read(view.experiment, view.model.robot, view.experiment.data.test))
        single = [law(view, j, more).chance for j in range(view.model.robot.dof)]
    return {**case, "single": single, "together": [found.chance for found in view.unknown]}


def told(records: list[dict]) -> dict:
    """The shares of joints, by motion and by how long the noise remembers."""
    groups: dict[str, list[dict]] = {}
    for record in records:
        if "impossible" not in record:
            noise = "slow noise" if (record["colour"] or 0.0) >= SLOW else "quick noise"
            groups.setdefault(f"{record['motion']}, {noise}", []).append(record)
    out = {}
    for name, own in sorted(groups.items()):
        out[name] = {"logs": len(own)}
        for asked in ("single", "together"):
            chances = [chance for record in own for chance in record[asked]]
            out[name][asked] = {f"below {level:g}": round(sum(c < level for c in chances) / len(chances), 3) for level in LEVELS}
    return out


def main() -> None:
    """Run what the journal lacks and print the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/unknown_study"))
    options = parser.parse_args()
    digest, out = fit_document.program()[:10], whole_files.folder(options.out)
    settings = {"seed": options.seed, "source": digest}
    journal = Journal(out / f"unknown-{options.seed}-{digest}.jsonl", settings)
    # a colour's turn comes every fifth log, a motion's after as many
    tasks = [(str(k), ({**conditions(options.seed, k), "motion": MOTIONS[k // 5 % 2]},)) for k in range(options.logs)]
    with watched.progress_bar() as progress:
        done = run(journal, tasks, one, jobs=options.jobs, progress=lambda s: progress("unknown", s))
    found = told(list(done.values()))
    whole_files.write_json(out / "unknown.json", {"settings": settings, **found, "records": list(done.values())})
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
