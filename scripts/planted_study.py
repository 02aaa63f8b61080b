"""Is an effect named that was added to the torque of a real log?

    SYSID_DATA_DIR=... python scripts/planted_study.py --cases 60 --seed 31 --jobs 2 --publish

A simulated log lacks what laboratories have: what else is wrong with a robot and its model, currents that spike, pieces of seconds. So the torque
of one joint of a real robot (those of `real_logs.py`) gets an effect of the catalogue added, in every log before anything else looks at it, made of the
log by `law` and not by the package, as large as 0.7 to 3 times the joint's error on the test logs. Robots, joints, effects and sizes are drawn.
It is visible where the model with that effect has 10 % less error on the test logs than the model without it. The diagnosis of the same logs
with nothing planted says what was there before.

Resumes: finished cases stand in a journal in --out, named after the seed and the state of the package's source and of this script.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import hashlib
import json
import sys
import warnings
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scipy.signal import savgol_filter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])

from scripts.real_logs import ROBOTS, path_of  # noqa: E402
from sysid import fit_document, log, pipeline, robot, whole_files  # noqa: E402
from sysid.addition import grown  # noqa: E402
from sysid.diagnose.diagnosis import Diagnosis, diagnose  # noqa: E402
from sysid.studies.journal import Journal, run  # noqa: E402
from sysid.terminal import watched  # noqa: E402

EFFECTS = ("spring", "cogging", "stribeck", "asymmetric_viscous", "quadratic_drag", "position_friction", "joint_coupling", "torque_gain")
SIZES = 0.7, 3.0  # of the joint's error on the test logs
VISIBLE, WINDOW = 0.10, 0.1  # of that error; s


def experiment_of(name: str):
    """A real robot's experiment; None where its logs are not there."""
    (path,) = [path_of(place) for own, place, _ in ROBOTS if own == name]
    return pipeline.load(path) if path.exists() else None


def motion(segment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, speeds and accelerations (n, dof) of a segment."""
    window = max(7, round(WINDOW / segment.step) | 1)
    if len(segment.q) <= window:
        return segment.q, 0.0 * segment.q, 0.0 * segment.q
    return tuple(savgol_filter(segment.q, window, 3, deriv=d, delta=segment.step, axis=0) for d in range(3))


def law(effect: str, segment, j: int, about: dict) -> np.ndarray:
    """Torque (n,) of an effect on a joint, of unit size.

    Args:
        about: of the logs, `middle` and `travel` of the angles (dof,), `speed`, the root mean square of the speeds (dof,), `turns`
            of a cogging over the travel, and `other`, the joint that a coupling is with.
    """
    q, v, a = motion(segment)
    speed, x, side = about["speed"][j], q[:, j] - about["middle"][j], np.tanh(v[:, j] / (0.03 * about["speed"][j]))
    return {
        "spring": lambda: x,
        "cogging": lambda: np.sin(2.0 * np.pi * about["turns"] * x / about["travel"][j]),
        "stribeck": lambda: side * np.exp(-((v[:, j] / (0.2 * speed)) ** 2)),
        "asymmetric_viscous": lambda: np.abs(v[:, j]),
        "quadratic_drag": lambda: v[:, j] * np.abs(v[:, j]),
        "position_friction": lambda: side * np.sin(q[:, j]),
        "joint_coupling": lambda: a[:, about["other"]],
        "torque_gain": lambda: segment.tau[:, j],
    }[effect]()


@contextmanager
def planted(effect: str, j: int, about: dict, size: float):
    """Every log that is read meanwhile has the effect, `size` [N m or N] times `law`."""
    plain = log.segment

    def more(*args):
        segment = plain(*args)
        tau = segment.tau.copy()
        tau[:, j] += size * law(effect, segment, j, about)
        return replace(segment, tau=tau)

    with patch.object(log, "segment", more):
        yield


def cases(seed: int, count: int, joints: dict[str, list[str]]) -> list[dict]:
    """Robot, joint, effect and size of each case."""
    rng, out = np.random.default_rng(seed), []
    for _ in range(count):
        name = str(rng.choice(sorted(joints)))
        own = {"robot": name, "joint": int(rng.integers(len(joints[name]))), "turns": float(rng.uniform(4.0, 10.0))}
        effects = [e for e in EFFECTS if len(joints[name]) > 1 or e != "joint_coupling"]
        out.append({**own, "effect": str(rng.choice(effects)), "times": float(np.exp(rng.uniform(*np.log(SIZES)))), "turn": int(rng.integers(1, 1000))})
    return out


def said(found: Diagnosis) -> dict:
    """Of each joint its status, who is claimed on it, first the first, and the sets of these."""
    return {
        v.joint: {
            "status": v.status, "claimed": [c.head.effect for c in v.claims if c.head.joint in (v.joint, "*")],
            "sets": [effect for c in v.claims for effect, joint, p in c.set if joint in (v.joint, "*") and p >= 0.05],
        }
        for v in found.verdict
    }  # fmt: skip


def one(case: dict) -> dict:
    """What the diagnosis says of a robot's logs, with an effect planted or as they are."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        experiment, segments, plain = experiment_of(case["robot"]), [], log.segment

        def seen(*args):
            segments.append(plain(*args))
            return segments[-1]

        with patch.object(log, "segment", seen):
            before = pipeline.fit(experiment)
        if "effect" not in case:
            return {**case, "said": said(diagnose(experiment, fit=before))}
        j, q = case["joint"], np.concatenate([s.q for s in segments])
        speed = np.sqrt(np.mean(np.concatenate([motion(s)[1] for s in segments]) ** 2, axis=0))
        others = [i for i in range(q.shape[1]) if i != j]
        about = {"middle": q.mean(0), "travel": np.ptp(q, axis=0), "speed": speed, "turns": case["turns"]}
        about["other"] = others[case["turn"] % len(others)] if others else j
        unit = np.concatenate([law(case["effect"], s, j, about) for s in segments])
        joint = before.joints[j]
        size = case["times"] * before.rms("test")[joint] / max(np.sqrt(np.nanmean(unit**2)), 1e-300)
        if not np.isfinite(size * np.nanmax(np.abs(unit))):
            return {**case, "name": joint, "impossible": "the joint does not move"}
        with planted(case["effect"], j, about, size):
            fit = pipeline.fit(experiment)
            options = {"other": before.joints[about["other"]]} if case["effect"] == "joint_coupling" else {}
            true = pipeline.fit(grown(fit.experiment, case["effect"], [joint], options), filters=fit.filters)
            found = diagnose(experiment, fit=fit)
        errors = {"before": before.rms("test")[joint], "planted": fit.rms("test")[joint], "true": true.rms("test")[joint]}
        return {**case, "name": joint, "size": float(size), "errors": errors, "said": said(found)}


def beside(records: list[dict]) -> list[tuple[dict, dict, bool]]:
    """Of each case its record, what is said of the logs as they are, and whether what was planted is visible."""
    as_they_are = {r["robot"]: r["said"] for r in records if "effect" not in r}
    own = (r for r in records if "said" in r and "effect" in r)
    return [(r, as_they_are[r["robot"]], r["errors"]["true"] <= (1.0 - VISIBLE) * r["errors"]["planted"]) for r in own]


def told(records: list[dict]) -> dict:
    """How many visible effects are named, and what is claimed on other joints that is not claimed of the logs as they are."""
    out = {"others": 0, "visible": 0, "claimed": 0, "first": 0, "in a set": 0, "there before": 0, "elsewhere, more": 0, "cases": 0, "missed": []}
    for r, before, visible in beside(records):
        own = r["said"][r["name"]]
        out["cases"] += 1
        out["others"] += len(r["said"]) - 1
        out["elsewhere, more"] += sum(bool(set(v["claimed"]) - set(before[j]["claimed"])) for j, v in r["said"].items() if j != r["name"])
        if not visible:
            continue
        if r["effect"] in before[r["name"]]["claimed"]:
            out["there before"] += 1
            continue
        named = r["effect"] in own["claimed"]
        out["visible"] += 1
        out["claimed"] += named
        out["first"] += own["claimed"][:1] == [r["effect"]]
        out["in a set"] += named or r["effect"] in own["sets"]
        if not named:
            rest = {k: round(v, 4) for k, v in r["errors"].items()}
            out["missed"].append({"case": f"{r['robot']}, {r['name']}, {r['effect']} x {r['times']:.2g}", **rest, **own})
    return out


def page(found: dict, records: list[dict], command: str) -> str:
    """The study as a page."""
    rows = []
    for r, before, visible in sorted(beside(records), key=lambda one: (one[0]["robot"], one[0]["name"], one[0]["effect"])):
        e, own, seen = r["errors"], r["said"][r["name"]], "yes" if visible else "no"
        words = [", ".join(f"`{effect}`" for effect in v["claimed"]) or "nothing" for v in (before[r["name"]], own)]
        hit = "**yes**" if r["effect"] in own["claimed"] else "in a set" if r["effect"] in own["sets"] else "no"
        rows.append(
            f"| {r['robot']}, {r['name']} | `{r['effect']}` | {r['times']:.1f} | {e['before']:.3g} | {e['planted']:.3g} | {e['true']:.3g} | {seen} | "
            f"{words[0]} | {words[1]}; {own['status']} | {hit} |"
        )
    count = found["visible"]
    lines = [
        "# Effects planted in real logs", "",
        "Written by `scripts/planted_study.py --publish`; nothing in it is edited by hand, and nothing in the code knows these logs.", "",
        f"    {command}", "",
        "A simulated log lacks what laboratories have: what else is wrong with a robot and its model, currents that spike, runs of a few seconds. Here the torque of",
        "one joint of a real robot got an effect of the catalogue added before anything looked at it, made of the log by a few lines of the script and not by the package.",
        f"Robot, joint, effect and size (as a multiple of the joint's error on the test logs) are drawn. It is visible where the model with it has {100 * VISIBLE:.0f} % less error on the",
        "test logs than the model without it; what the diagnosis claims of the logs as they are stands beside what it claims with the effect planted.", "",
        "| | |", "|---|---:|",
        f"| planted | {found['cases']} |",
        f"| visible, and not claimed of the logs as they are | {count} |",
        f"| of these claimed | {found['claimed']} of {count} |",
        f"| of these claimed first on the joint | {found['first']} of {count} |",
        f"| of these claimed, or in the set of a claim | {found['in a set']} of {count} |",
        f"| of all other joints, in all cases, those of which more is claimed than of the logs as they are | {found['elsewhere, more']} of {found['others']} |", "",
        "What robots lack already stands beside what was planted, so that more than one claim on a joint is no fault, and a larger misfit than the planted one may be told first.", "",
        "| joint | planted | times its error | error before | with it planted | with the true model | visible | claimed of the logs as they are | claimed | the planted one |",
        "|---|---|---:|---:|---:|---:|---|---|---|---|",
        *rows,
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run what the journal lacks and print what became of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--seed", type=int, default=31)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", action="append", default=[], choices=[name for name, *_ in ROBOTS])
    parser.add_argument("--out", type=Path, default=Path("runs/planted_study"))
    parser.add_argument("--publish", action="store_true", help="write docs/planted.md too")
    options = parser.parse_args()
    names = options.only or [name for name, *_ in ROBOTS]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        there = {name: found for name in names if (found := experiment_of(name)) is not None}
        joints = {name: list(robot.load(one.robot, one.folder).joints) for name, one in there.items()}
    own = cases(options.seed, options.cases, joints)
    digest, out = fit_document.program()[:10], whole_files.folder(options.out)
    own_digest = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:10]
    settings = {"seed": options.seed, "source": digest, "script": own_digest, "robots": sorted(joints)}
    journal = Journal(out / f"planted-{options.seed}-{digest}-{own_digest}.jsonl", settings)
    plain = sorted({case["robot"] for case in own})
    tasks = [(f"{name} as it is", ({"robot": name},)) for name in plain] + [(str(k), (case,)) for k, case in enumerate(own)]
    with watched.progress_bar() as progress:
        done = run(journal, tasks, one, jobs=options.jobs, progress=lambda s: progress("planted", s))
    found = told(list(done.values()))
    whole_files.write_json(out / "planted.json", {"settings": settings, **found, "records": list(done.values())})
    only = "".join(f' --only "{name}"' for name in options.only)
    text = page(found, list(done.values()), f"python scripts/planted_study.py --cases {options.cases} --seed {options.seed}{only} --publish")
    for folder in [out, *([ROOT / "docs"] if options.publish else [])]:
        whole_files.write_atomically(folder / "planted.md", lambda p: p.write_text(text, encoding="utf-8"))
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
