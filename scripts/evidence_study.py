"""Does the evidence keep its word? Three studies of the diagnosis on simulated logs.

    python scripts/evidence_study.py size --logs 400 --seed 31 --jobs 2     # nothing hidden: how often is anything accused?
    python scripts/evidence_study.py power --logs 200 --seed 31 --jobs 2    # effects of the detectable size: how many are named?
    python scripts/evidence_study.py soft --logs 80 --seed 31 --jobs 2      # elasticity and play: how many are named where they matter?

size: robots with nothing hidden, noise white or coloured, encoders fine or coarse. The search runs at a family-wise level of
5 %; what it accuses is an error of the first kind, worth having or not (`--worth 0`, the default), so the share must be
about 5 %.

power: of such a robot's log the smallest detectable sizes are taken; an effect is hidden at that size on a second robot of the
same seed, and the search of its log is asked at the diagnosis's own level.

soft: elasticity and backlash in turn, of the benchmark's sizes. Counted are the logs whose fit, on the test log, has an error a
tenth lower on some joint where the same robot is simulated without the effect: there it is to be named, alone or in a set of
two. `shown`: of these, where the training log, of which alone anything is named, shows it as well. `others`: the same robots
with a delay, a current's lag, or nothing, in which neither may be named.

All resume: finished logs stand in a journal in --out, named after the seed and the state of the package's source.
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

import numpy as np  # noqa: E402

from scripts.blind_parts import cases  # noqa: E402
from scripts.blind_parts.robots import JOINTS, RATE, SECONDS, experiment_of  # noqa: E402
from scripts.blind_parts.trial import simulated  # noqa: E402
from sysid import fit_document, pipeline, whole_files  # noqa: E402
from sysid.errors import SysidError  # noqa: E402
from sysid.studies.journal import Journal, run  # noqa: E402
from sysid.terminal import watched  # noqa: E402

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


def view_of(case: dict, folder: Path, hide=(), **how):
    """The first view of a simulated case; `how`: more of `simulate`."""
    from sysid.simulate import simulate, write
    from sysid.view import first_view

    folder.mkdir(parents=True, exist_ok=True)
    experiment, machine = experiment_of(case["robot"], folder)
    told = simulate(
        machine, hide=list(hide), seed=case["seed"], duration=SECONDS[case["robot"]], rate=RATE[case["robot"]],
        colour=case["colour"], encoder=case["encoder"], **how,
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
        try:
            view = view_of(case, Path(folder))
        except SysidError as error:  # this robot does not follow its reference
            return {**case, "impossible": str(error)[:120]}
        asked = ask(view)
        best = int(np.nanargmax(asked.statistics)) if len(asked.groups) else -1
        steps, *_ = select.search(view, level=level, worth=worth, most=1)
        first = [] if best < 0 else [asked.groups[best].candidate.name, asked.p(best)]
    return {**case, "accused": [s.candidate.name for s in steps], "greatest": first}


def power(case: dict, level: float, worth: float) -> dict:
    """Whether an effect of the smallest detectable size is named."""
    from sysid.candidates import candidates
    from sysid.diagnose import select
    from sysid.diagnose.ask import ask
    from sysid.diagnose.detectable import detectable
    from sysid.simulate import hidden

    rng = np.random.default_rng(case["seed"])
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        try:
            view = view_of(case, Path(folder) / "plain")
        except SysidError as error:
            return {**case, "hidden": None, "impossible": str(error)[:120]}
        joints = JOINTS[case["robot"]]
        found = [d for d in detectable(view, ask(view), candidates(view.model)) if d.size and d.candidate.name in HIDDEN]
        for pick in rng.permutation(len(found)):
            one = found[pick]
            joint, sign = joints[one.candidate.joint], 1.0
            values = {one.parameter: sign * one.size, **one.at}
            text = f"{one.candidate.name}:{joint}:{','.join(f'{name}={value:.6g}' for name, value in values.items())}"
            try:
                view = view_of(case, Path(folder) / f"hidden{pick}", [hidden(text)])
            except Exception as error:  # noqa: BLE001 - a size that this robot cannot have
                case = {**case, "impossible": f"{text}: {error}"[:120]}
                continue
            steps, *_ = select.search(view, level=level, worth=worth, most=3)
            members = [(m.candidate.name, joints[m.candidate.joint]) for s in steps for m, _ in s.choice.members]
            heads = [(s.candidate.name, joints[s.candidate.joint]) for s in steps]
            wanted = (one.candidate.name, joint)
            return {**case, "hidden": text, "named": wanted in heads, "in_set": wanted in members, "heads": heads}
    return {**case, "hidden": None}


SOFT, OTHERS = ("elasticity", "backlash"), ("control", "delay", "control", "control", "current_lag", "control")
ARMS = ("planar", "leg", "planar", "leg", "planar", "leg", "ur5")
_MATTERS = 0.9  # times the error with it


def drawn(seed: int, number: int, effects: tuple[str, ...]) -> dict:
    """A case of the benchmark's: effects in turn, on robots in turn."""
    effect, place = effects[number % len(effects)], number // len(effects)
    robot = ARMS[(place + number) % len(ARMS)]
    if effect == "control":
        case = cases.control(seed, robot, number, "s")
    else:
        # a stiff joint's elasticity never matters by a tenth: of the sizes the larger half
        case = cases.single(seed, robot, effect, 2 * place + 1 if effect == "elasticity" else place, "s")
    return {"robot": robot, "seed": case.seed, "colour": case.colour, "encoder": case.encoder, "pace": case.pace, "hidden": list(case.hidden)}


def soft(case: dict, level: float, worth: float) -> dict:
    """What the diagnosis claims of a log, where what is hidden matters; without anything hidden, or with something else, always."""
    from sysid.diagnose.diagnosis import diagnose
    from sysid.simulate import motion, write

    def fitted(simulation, name: str):
        write(simulation, experiment, folder / name)
        return pipeline.fit(pipeline.load(folder / name))

    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as where:
        warnings.simplefilter("ignore")
        folder = Path(where)
        experiment, machine = experiment_of(case["robot"], folder)
        options = {"seed": case["seed"], "duration": SECONDS[case["robot"]], "rate": RATE[case["robot"]], "colour": case["colour"], "encoder": case["encoder"]}
        options["speed"] = None if case["pace"] is None else case["pace"] * float(motion.top_speeds(machine).max())
        (hidden,) = case["hidden"] or [None]
        asked = hidden is None or hidden["effect"] not in SOFT
        without = None if asked else simulated(machine, [], options)[0]
        simulation, softer = simulated(machine, case["hidden"], options)
        fit = fitted(simulation, "case")
        case = {**case, "softer": softer, "error": fit.rms("test")}
        if not asked:
            plain = fitted(without, "plain")
            falls = lambda part: any(plain.rms(part)[joint] <= _MATTERS * error for joint, error in fit.rms(part).items())
            case |= {"plain": plain.rms("test"), "matters": falls("test"), "shown": falls("train")}
        if asked or case["matters"]:
            found = diagnose(fit.experiment, fit=fit)
            case["sets"] = [[[effect, joint, chance] for effect, joint, chance in claim.set] for claim in found.claims]
            case["heads"] = [[claim.head.effect, claim.head.joint] for claim in found.claims]
            case["refused"] = [[r.effect, r.joint, r.why] for r in found.refused]
            case["after"] = found.claims[-1].after.rms("test") if found.claims else case["error"]
            case["soft"] = any(effect in SOFT for effect, _ in case["heads"])
            if hidden is not None:
                wanted = (hidden["effect"], hidden["joint"])
                own = [s for s in case["sets"] if wanted in [(effect, joint) for effect, joint, _ in s]]
                case["head"] = list(wanted) in case["heads"]
                case["named"] = any(len(s) <= 2 for s in own)
                case["in_set"] = bool(own)
    return case


def told(kind: str, records: list[dict]) -> dict:
    """The shares with their intervals (Wilson 1927)."""
    from scipy.stats import binomtest

    def share(count: int, of: int) -> dict:
        if not of:
            return {"count": 0, "of": 0}
        low, high = binomtest(count, of).proportion_ci(method="wilson")
        return {"count": count, "of": of, "share": count / of, "low": float(low), "high": float(high)}

    if kind == "soft":
        out = {"logs": len(records)}
        for effect in SOFT:
            own = [r for r in records if r.get("matters") and r["hidden"][0]["effect"] == effect]
            out[effect] = {key: share(sum(r[key] for r in own), len(own)) for key in ("named", "head", "in_set")}
            out[effect]["shown"] = share(sum(r["named"] for r in own if r["shown"]), sum(r["shown"] for r in own))
            claims = [tuple(head) for r in own for head in r["heads"]]
            right = sum(list((r["hidden"][0]["effect"], r["hidden"][0]["joint"])) in r["heads"] for r in own)
            out[effect]["other_claims"] = share(len(claims) - right, len(claims))
        return out
    if kind == "others":
        groups = {"control": [r for r in records if not r["hidden"]], "delay and current_lag": [r for r in records if r["hidden"]]}
        return {name: {"called_soft": share(sum(r["soft"] for r in own), len(own))} for name, own in groups.items()}
    if kind == "size":
        records = [r for r in records if "impossible" not in r]
        by = {name: [r for r in records if r["robot"] == name] for name in dict.fromkeys(ROBOTS)}
        return {"accused": share(sum(bool(r["accused"]) for r in records), len(records))} | {
            name: share(sum(bool(r["accused"]) for r in own), len(own)) for name, own in by.items()
        }
    asked = [r for r in records if r["hidden"]]
    return {key: share(sum(r[key] for r in asked), len(asked)) for key in ("named", "in_set")}


def main() -> None:
    """Run what the journal lacks and print the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study", choices=["size", "power", "soft", "others"])
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
    digest, out = fit_document.program()[:10], whole_files.folder(options.out)
    settings = {"study": options.study, "seed": options.seed, "level": level, "worth": worth, "source": digest}
    journal = Journal(out / f"{options.study}-{options.seed}-{level:g}-{worth:g}-{digest}.jsonl", settings)
    draw = {"soft": lambda s, k: drawn(s, k, SOFT), "others": lambda s, k: drawn(s, k, OTHERS)}.get(options.study, conditions)
    tasks = [(str(k), (draw(options.seed, k), level, worth)) for k in range(options.logs)]
    with watched.progress_bar() as progress:
        done = run(journal, tasks, {"size": size, "power": power, "soft": soft, "others": soft}[options.study], jobs=options.jobs, progress=lambda s: progress(options.study, s))
    found = told(options.study, list(done.values()))
    whole_files.write_json(out / f"{options.study}.json", {"settings": settings, **found, "records": list(done.values())})
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
