"""Ties: how many does a second log resolve, designed to separate, designed for precision, or random?"""

from __future__ import annotations

import tempfile
import time
import warnings
from dataclasses import asdict
from pathlib import Path

import numpy as np

from scripts.design_parts.robots import (
    FIRST,
    JOINTS,
    RATE,
    ROBOTS,
    FirstLog,
    experiment_with,
    posed,
    random_motion,
)
from sysid.errors import SysidError
from sysid.simulate import hidden

ARMS = ("designed", "D-optimal", "random")
#: what short poor logs tie; not a bias beside asymmetric Coulomb friction, nor the gains of two joints:
#: beside a fit's own parameters these are one column, and no motion tells them apart
HIDDEN = (
    "stribeck", "asymmetric_viscous", "quadratic_drag", "sublinear_viscous", "load_friction",
    "directional_efficiency", "position_friction", "presliding", "encoder_offset", "warmup",
    "delay", "current_lag",
)  # fmt: skip
#: of an arm in one plane the offset of its first encoder is a tilt of its base: no motion tells them apart
TWINS = {("planar", "encoder_offset:shoulder")}
#: joints whose torque stands well above its noise in a poor log; of an arm's wrist none names anything
LOADED = {robot: joints[:4] for robot, joints in JOINTS.items()}
#: of a leg 4 s of sines name nothing, or name it alone
POOR = FIRST | {"leg": (FirstLog(10.0, "moves"),)}
_SIZES = (1.0, 2.5)  # of the simulation's usual
_TRIED = 30  # effects that are hidden in turn until one ends in a tie


def case(seed: int, number: int, robots=ROBOTS) -> dict:
    """Robot and seed of a trial."""
    rng = np.random.default_rng([seed, number])
    return {"robot": robots[number % len(robots)], "seed": int(rng.integers(2**31))}


def _sets(found) -> list[list[tuple[str, str, float]]]:
    """The 90 % set of every claim: the likeliest members that hold as much between them."""
    out = []
    for claim in found.claims:
        members = sorted(claim.set, key=lambda member: -member[2])
        before = np.cumsum([0.0, *(p for *_, p in members)])[:-1]
        held = [member for member, told in zip(members, before) if told < 0.9]
        out.append([(str(e), str(j), float(p)) for e, j, p in held])
    return out


def trial(case: dict, arms=ARMS) -> dict:
    """One robot: the tie after its first log, and what stands after the second."""
    from sysid import design, diagnose
    from sysid.statement.document import document

    rng = np.random.default_rng(case["seed"])
    told = {**case, "tried": [], "tie": None, "arms": {}, "seconds": {}}
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as place:
        warnings.simplefilter("ignore")
        folder = Path(place)
        for k in range(_TRIED):
            effect, joint = str(rng.choice(HIDDEN)), str(rng.choice(LOADED[case["robot"]]))
            own = f"{effect}:{joint}"
            if (case["robot"], own) in TWINS:
                continue
            asked = f"{own}:size={rng.choice(_SIZES):g}"
            first = POOR[case["robot"]][int(rng.integers(len(POOR[case["robot"]])))]
            told["tried"].append(asked)
            begun = time.process_time()
            try:
                experiment = experiment_with(
                    case["robot"], folder / f"first_{k}", case["seed"], [hidden(asked)],
                    first=first,
                )  # fmt: skip
                diagnosis = diagnose(experiment)
                sets = _sets(diagnosis)
            except SysidError as error:  # a size that this robot cannot have
                told["tried"][-1] += f" ({type(error).__name__})"
                continue
            told["seconds"]["diagnose"] = time.process_time() - begun
            held = [s for s in sets if any((e, j) == (effect, joint) for e, j, _ in s)]
            if held and len(held[0]) > 1:
                told |= {"hidden": own, "asked": asked, "first": asdict(first), "tie": held[0]}
                break
        else:
            return told
        problem, pose, rounds = posed(experiment)
        suspects, said = [(e, j) for e, j, _ in told["tie"]], document(diagnosis)
        for arm in arms:
            begun = time.process_time()
            if arm == "random":
                own_problem, z = random_motion(problem, pose, rounds, case["seed"] % 10**6)
                t = np.arange(int(20.0 * RATE[case["robot"]]) + 1) / RATE[case["robot"]]
                motion = t, own_problem.family.motion(z, t)[0]
                chance = None
            else:
                apart = suspects if arm == "designed" else []
                found = design(experiment, separate=apart, diagnosis=said, processes=1)
                motion, chance = (found.t, found.q), _chance(found.pairs, told["hidden"])
            told["seconds"][arm] = time.process_time() - begun
            try:
                both = experiment_with(
                    case["robot"], folder / arm, case["seed"], [hidden(told["asked"])], [motion],
                    first,
                )  # fmt: skip
            except SysidError as error:  # what is hidden keeps the robot from following the motion
                none = {"alone": False, "promised": chance, "sets": [], "error": str(error)}
                told["arms"][arm] = none
                continue
            begun = time.process_time()
            sets = _sets(diagnose(both))
            told["seconds"][f"diagnose {arm}"] = time.process_time() - begun
            alone = [s for s in sets if [f"{e}:{j}" for e, j, _ in s] == [told["hidden"]]]
            told["arms"][arm] = {"alone": bool(alone), "promised": chance, "sets": sets}
    return told


def _chance(pairs, own: str) -> float | None:
    """The smallest probability of any pair that holds the hidden effect."""
    chances = [p.probability for p in pairs if own in (p.a, p.b)]
    return min(chances) if chances else None


def table(results: list[dict]) -> list[str]:
    """The share named alone, by arm and robot, and how the promise held."""
    from scipy.stats import binomtest

    done = [r for r in results if r["tie"] and (r["robot"], r.get("hidden")) not in TWINS]
    out = [f"{len(results)} robots, {len(done)} with a tie that holds what is hidden"]
    for arm in ARMS:
        own = [r for r in done if arm in r["arms"]]
        if not own:
            continue
        k = sum(r["arms"][arm]["alone"] for r in own)
        low, high = binomtest(k, len(own)).proportion_ci(method="wilson")
        by = {}
        for r in own:
            by.setdefault(r["robot"], []).append(r["arms"][arm]["alone"])
        each = ", ".join(f"{name} {sum(v)}/{len(v)}" for name, v in by.items())
        out.append(
            f"  {arm:10s} alone {k}/{len(own)} = {k / len(own):.0%} ({low:.0%} to {high:.0%}); {each}"
        )
    told = [
        (r["arms"]["designed"]["promised"], r["arms"]["designed"]["alone"])
        for r in done
        if r["arms"].get("designed", {}).get("promised") is not None
    ]
    for low, high in ((0.0, 0.5), (0.5, 0.9), (0.9, 0.99), (0.99, 1.01)):
        own = [alone for p, alone in told if low <= p < high]
        if own:
            mean = np.mean([p for p, _ in told if low <= p < high])
            out.append(
                f"  promised {low:.2f} to {min(high, 1):.2f} (mean {mean:.2f}): alone {sum(own)}/{len(own)}"
            )
    return out
