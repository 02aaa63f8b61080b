"""Does the evidence keep its word? Two studies of the diagnosis on simulated logs.

    python scripts/evidence_study.py size --logs 400 --seed 31 --jobs 2     # nothing hidden: how often is anything accused?
    python scripts/evidence_study.py power --logs 200 --seed 31 --jobs 2    # effects of the detectable size: how many are named?

size: robots with nothing hidden, noise white or coloured, encoders fine or coarse. The search runs at a family-wise level of
5 %; what it accuses is an error of the first kind, worth having or not (`--worth 0`, the default), so the share must be
about 5 %.

power: of such a robot's log the smallest detectable sizes are taken; an effect is hidden at that size on a second robot of the
same seed, and the search of its log is asked at the diagnosis's own level.

Both resume: finished logs stand in a journal in --out, named after the seed and the state of the package's source.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import hashlib
import json
import sys
import tempfile
import warnings
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])

import numpy as np  # noqa: E402

from scripts.blind_benchmark import JOINTS, RATE, SECONDS, experiment_of  # noqa: E402
from sysid import pipeline, results, terminal  # noqa: E402
from sysid.studies.journal import Journal, run  # noqa: E402

ROBOTS = ("planar", "planar", "leg")
#: effects that `simulate` hides by the same parameter that `detectable` states, and that other effects of it are left to chance
HIDDEN = (
    "asymmetric_coulomb", "asymmetric_viscous", "stribeck", "quadratic_drag", "load_friction", "directional_efficiency",
    "torque_bias", "torque_gain", "encoder_offset", "delay", "current_lag",
)  # fmt: skip


def conditions(seed: int, number: int) -> dict:
    """Robot, noise and encoder of a log."""
    rng = np.random.default_rng([seed, number])
    robot = ROBOTS[number % len(ROBOTS)]
    bits = (None, None, 12, 10) if robot == "leg" else (None, None, 17, 15)
    return {
        "robot": robot, "seed": int(rng.integers(2**31)), "colour": (None, 0.005, 0.02, 0.1, 0.3)[number % 5],
        "encoder": bits[int(rng.integers(len(bits)))],
    }  # fmt: skip


def _view(case: dict, folder: Path, hide=()):
    from sysid.diagnose.diagnosis import first_view
    from sysid.simulate import simulate, write

    folder.mkdir(parents=True, exist_ok=True)
    experiment, machine = experiment_of(case["robot"], folder)
    told = simulate(
        machine, hide=list(hide), seed=case["seed"], duration=SECONDS[case["robot"]], rate=RATE[case["robot"]],
        colour=case["colour"], encoder=case["encoder"],
    )  # fmt: skip
    write(told, experiment, folder / "case")
    experiment = pipeline.load(folder / "case")
    return first_view(experiment, pipeline.fit(experiment))


def size(case: dict, level: float, worth: float) -> dict:
    """What the search accuses where nothing is hidden."""
    from sysid.diagnose import select
    from sysid.diagnose.ask import ask

    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        view = _view(case, Path(folder))
        asked = ask(view)
        best = int(np.nanargmax(asked.statistics)) if len(asked.groups) else -1
        steps, *_ = select.search(view, level=level, worth=worth, most=1)
        first = [] if best < 0 else [asked.groups[best].candidate.name, asked.p(best)]
    return {**case, "accused": [s.candidate.name for s in steps], "greatest": first}


def power(case: dict, level: float, worth: float) -> dict:
    """Whether an effect of the smallest detectable size is named."""
    from sysid.diagnose import select
    from sysid.diagnose.ask import ask
    from sysid.diagnose.candidates import candidates
    from sysid.diagnose.detectable import detectable
    from sysid.simulate import hidden

    rng = np.random.default_rng(case["seed"])
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        view = _view(case, Path(folder) / "plain")
        joints = JOINTS[case["robot"]]
        found = [d for d in detectable(view, ask(view), candidates(view.model)) if d.size and d.candidate.name in HIDDEN]
        for pick in rng.permutation(len(found)):
            one = found[pick]
            joint, sign = joints[one.candidate.joint], 1.0
            text = f"{one.candidate.name}:{joint}:{one.parameter}={sign * one.size:.6g}"
            try:
                view = _view(case, Path(folder) / f"hidden{pick}", [hidden(text)])
            except Exception as error:  # noqa: BLE001 - a size that this robot cannot have
                case = {**case, "impossible": f"{text}: {error}"[:120]}
                continue
            steps, *_ = select.search(view, level=level, worth=worth, most=3)
            members = [(m.candidate.name, joints[m.candidate.joint]) for s in steps for m, _ in s.choice.members]
            heads = [(s.candidate.name, joints[s.candidate.joint]) for s in steps]
            wanted = (one.candidate.name, joint)
            return {**case, "hidden": text, "named": wanted in heads, "in_set": wanted in members, "heads": heads}
    return {**case, "hidden": None}


def told(kind: str, records: list[dict]) -> dict:
    """The shares with their intervals (Wilson 1927)."""
    from scipy.stats import binomtest

    def share(count: int, of: int) -> dict:
        if not of:
            return {"count": 0, "of": 0}
        low, high = binomtest(count, of).proportion_ci(method="wilson")
        return {"count": count, "of": of, "share": count / of, "low": float(low), "high": float(high)}

    if kind == "size":
        by = {name: [r for r in records if r["robot"] == name] for name in dict.fromkeys(ROBOTS)}
        return {"accused": share(sum(bool(r["accused"]) for r in records), len(records))} | {
            name: share(sum(bool(r["accused"]) for r in own), len(own)) for name, own in by.items()
        }
    asked = [r for r in records if r["hidden"]]
    return {key: share(sum(r[key] for r in asked), len(asked)) for key in ("named", "in_set")}


def main() -> None:
    """Run what the journal lacks and print the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study", choices=["size", "power"])
    parser.add_argument("--logs", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1, help="base seed; 1 was used while developing")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--level", type=float, default=None, help="family-wise (default 0.05 for size, the diagnosis's own for power)")
    parser.add_argument("--worth", type=float, default=None, help="least share of a joint's error (default 0 for size, the diagnosis's own for power)")
    parser.add_argument("--out", type=Path, default=Path("runs/evidence_study"))
    options = parser.parse_args()
    from sysid.diagnose.select import LEVEL, WORTH

    level = options.level if options.level is not None else 0.05 if options.study == "size" else LEVEL
    worth = options.worth if options.worth is not None else 0.0 if options.study == "size" else WORTH
    digest = hashlib.sha256(b"".join(f.read_bytes() for f in sorted((ROOT / "sysid").rglob("*.py")))).hexdigest()[:10]
    out = results.folder(options.out)
    settings = {"study": options.study, "seed": options.seed, "level": level, "worth": worth, "source": digest}
    journal = Journal(out / f"{options.study}-{options.seed}-{level:g}-{worth:g}-{digest}.jsonl", settings)
    tasks = [(str(k), (conditions(options.seed, k), level, worth)) for k in range(options.logs)]
    with terminal.progress_bar() as progress:
        done = run(journal, tasks, {"size": size, "power": power}[options.study], jobs=options.jobs, progress=lambda s: progress(options.study, s))
    found = told(options.study, list(done.values()))
    results.write_json(out / f"{options.study}.json", {"settings": settings, **found, "records": list(done.values())})
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
