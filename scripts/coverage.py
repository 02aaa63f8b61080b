"""Do the stated deviations hold? Robots with nothing hidden, fitted with default settings, compared with what is true.

    python scripts/coverage.py --seed 4107 --count 40 --jobs 2        # planar, leg and UR5, 40 of each
    python scripts/coverage.py --seed 1 --robots leg --count 12 --colour 0.3

What is compared with the truth, in stated deviations:

- friction: every viscous and Coulomb coefficient that has a deviation (one that is held at zero has none);
- inertial: every inertial parameter and motor inertia of which the data determine more than 0.9 (`from_data`);
- combination: every direction in the bodies' parameters of which the data determine more than 0.9, by the generalised
  eigenvectors of the data's and the prior's Hessians: these are independent, where single parameters repeat each other.

Runs resume: robots that are done stand in a journal in --out, named after the seed and the state of the source.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import math
import sys
import warnings
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
)  # of the processes that --jobs starts

import numpy as np  # noqa: E402

from scripts.blind_benchmark import source  # noqa: E402
from scripts.blind_parts.robots import RATE, SECONDS, experiment_of  # noqa: E402
from scripts.blind_parts.scoring import wilson  # noqa: E402
from sysid import fit_document, pipeline, whole_files  # noqa: E402
from sysid.studies.journal import Journal, run  # noqa: E402
from sysid.terminal import watched  # noqa: E402

DETERMINED = 0.9  # `from_data` above which a parameter is the data's
KINDS = ("viscous", "coulomb", "friction", "inertial", "combination")
LOW, HIGH = 0.92, 0.98


def one(robot: str, seed: int, colour: float | None, folder: str) -> dict:
    """A robot simulated (once; its folder is kept), fitted, and every error in stated deviations."""
    place = Path(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if not (place / "truth.json").exists():
            _simulate(robot, seed, colour, place)
        truth = json.loads((place / "truth.json").read_text())
        fit = pipeline.fit(pipeline.load(place))
    return {"robot": robot, "converged": fit.solution.converged, "rows": rows(fit, truth)}


def _simulate(robot: str, seed: int, colour: float | None, place: Path) -> None:
    from sysid.simulate import simulate, write

    place.parent.mkdir(parents=True, exist_ok=True)
    experiment, machine = experiment_of(robot, place.parent)
    conditions = {"seed": seed, "duration": SECONDS[robot], "rate": RATE[robot], "colour": colour}
    write(simulate(machine, **conditions), experiment, place)


def rows(fit, truth: dict) -> list[dict]:
    """One entry for each parameter or combination that counts: kind, name, z, and the error as a share of the truth."""
    x, std, share = fit.x, fit.uncertainty.std, fit.uncertainty.from_data
    true = _true(fit, truth)
    out = []
    for k, name in enumerate(fit.model.names):
        kind = _kind(name)
        known = np.isfinite(std[k]) and std[k] > 0 and np.isfinite(true[k])
        if known and (kind in ("viscous", "coulomb") or share[k] > DETERMINED):
            error = float(x[k] - true[k])
            out.append({"kind": kind, "name": name, "z": error / float(std[k]), "error": error, "true": float(true[k])})
    for number, z in enumerate(_combinations(fit, true)):
        out.append({"kind": "combination", "name": f"combination {number}", "z": float(z), "error": None, "true": None})
    return out


def _kind(name: str) -> str:
    word = name.partition(".")[0]
    return word if word in ("viscous", "coulomb") else "inertial"


def _true(fit, truth: dict) -> np.ndarray:
    """The true value of every parameter of the model, NaN where there is none."""
    bodies = [value for body in fit.model.robot.bodies for value in truth["inertias"][body.name]]
    out = []
    for name in fit.model.names[len(bodies) :]:
        effect, joint, symbol = name.split(".")
        if effect in ("viscous", "coulomb"):
            out.append(truth["friction"][joint][symbol])
        else:
            out.append(truth["armature"].get(joint, 0.0) if effect == "armature" else math.nan)
    return np.array(bodies + out)


def _combinations(fit, true) -> np.ndarray:
    """Errors in deviations of the directions in the bodies' parameters that the data determine."""
    from scipy.linalg import eigh

    from sysid.inertia import DIVERGENCES
    from sysid.objective import Objective, add_blocks
    from sysid.triangles import Compressed

    data: Compressed = fit.compressed
    spec = fit.experiment.prior
    objective = Objective(data.total(fit.weights), DIVERGENCES[spec.divergence](fit.prior), spec.weight)
    count = 10 * fit.model.bodies
    whole = objective.data_hessian()
    free = np.flatnonzero(np.isfinite(fit.uncertainty.std))
    inner, outer = free[free < count], free[free >= count]
    # what the bodies' own columns say beside those of friction
    cross = whole[np.ix_(inner, outer)]
    own = whole[np.ix_(inner, inner)] - cross @ np.linalg.pinv(whole[np.ix_(outer, outer)]) @ cross.T
    blocks = add_blocks(np.zeros((count, count)), objective.prior_hessian(fit.x))
    prior = blocks[np.ix_(inner, inner)]
    values, vectors = eigh(own, prior)  # v' prior v = 1
    chosen = vectors[:, values / (1.0 + values) > DETERMINED]
    functional = prior @ chosen  # coordinates of a parameter change along each direction
    error = functional.T @ (fit.x - true)[inner]
    covariance = fit.uncertainty.covariance[np.ix_(inner, inner)]
    return error / np.sqrt(np.einsum("ki,kl,li->i", functional, covariance, functional))


def summary(records: list[dict]) -> list[dict]:
    """Coverage by robot and kind, with Wilson's interval and a standard error over robots, which share what is in them."""
    out = []
    robots = list(dict.fromkeys(record["robot"] for record in records))
    for robot in [*robots, *(["all"] if len(robots) > 1 else [])]:
        own = [record for record in records if robot in ("all", record["robot"])]
        for kind in KINDS:
            each = [np.array([row["z"] for row in record["rows"] if _counts(kind, row["kind"])]) for record in own]
            z = np.concatenate(each)
            if not len(z):
                continue
            inside = np.abs(z) < 2.0
            low, high = wilson(int(inside.sum()), len(z))
            share = inside.mean()
            scatter = [np.sum(np.abs(e) < 2.0) - share * len(e) for e in each]
            error = math.sqrt(np.sum(np.square(scatter)) * len(own) / max(len(own) - 1, 1)) / len(z)
            out.append({
                "robot": robot, "kind": kind, "count": len(z), "within": float(share), "low": low, "high": high,
                "error": error, "mean_z": float(z.mean()), "rms_z": float(np.sqrt(np.mean(z**2))),
                "median_size": float(np.median(np.abs(z))) / 0.6745,
            })  # fmt: skip
    return out


def _counts(kind: str, own: str) -> bool:
    return own in ("viscous", "coulomb") if kind == "friction" else own == kind


def table(found: list[dict]) -> str:
    """The summary as lines of text; `scale` is the median size of an error in deviations, 1 where they are right."""
    lines = [f"{'robot':8} {'kind':12} {'count':>6} {'within 2':>9} {'95 %':>17} {'+- (robots)':>11} {'mean z':>7} {'rms z':>6} {'scale':>6}"]
    for e in found:
        met = "" if LOW <= e["within"] <= HIGH else "  outside 92 to 98 %"
        lines.append(
            f"{e['robot']:8} {e['kind']:12} {e['count']:6d} {100 * e['within']:8.1f}% {100 * e['low']:7.1f} to {100 * e['high']:5.1f} "
            f"{100 * e['error']:11.1f} {e['mean_z']:+7.2f} {e['rms_z']:6.2f} {e['median_size']:6.2f}{met}"
        )
    return "\n".join(lines)


def main() -> None:
    """Run the robots that the journal lacks, print the table, write coverage.json."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="base seed")
    parser.add_argument("--robots", default="planar,leg,ur5", help="of planar, leg, ur5, panda")
    parser.add_argument("--count", type=int, default=40, help="robots of each kind")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--colour", type=float, help="s, time constant of half of the torque noise's variance")
    parser.add_argument("--out", type=Path, default=Path("runs/coverage"))
    options = parser.parse_args()
    out = whole_files.folder(options.out)
    shade = "" if options.colour is None else f"-{options.colour:g}"
    settings = {"seed": options.seed, "colour": options.colour, "source": source(), "versions": fit_document.versions()}
    journal = Journal(out / f"journal-{options.seed}{shade}-{source()}.jsonl", settings)
    tasks = []
    for robot in options.robots.split(","):
        for number in range(options.count):
            drawn = int(np.random.default_rng([options.seed, number]).integers(2**31))
            place = out / "robots" / f"{robot}-{options.seed}-{number}{shade}" / "case"
            tasks.append((f"{robot}/{number}", (robot, drawn, options.colour, str(place))))
    with watched.progress_bar() as progress:
        done = run(journal, tasks, one, jobs=options.jobs, progress=lambda s: progress(f"{len(tasks)} robots", s))
    found = summary(list(done.values()))
    whole_files.write_json(out / "coverage.json", {"settings": settings, "summary": found, "records": done})
    print(table(found))
    print(f"results: {out}/coverage.json")


if __name__ == "__main__":
    main()
