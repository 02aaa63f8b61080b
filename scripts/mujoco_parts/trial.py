"""One arm: its logs, the diagnosis of them, and what that is worth."""

from __future__ import annotations

import tempfile
import time
import warnings
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import numpy as np
import yaml

from scripts.blind_parts.robots import PLANAR
from scripts.mujoco_parts.plant import HIDDEN, MANNERS, Manner, arm_of, built, logged
from tests.servos import arm_urdf

ARMS = ("planar", "arm of 3", "arm of 5")
CONTROLS = 5  # one case in so many has nothing hidden
VISIBLE = 0.1  # of a held-out error


def case(seed: int, number: int, manner: str = "clean") -> dict:
    """What the number-th case of a seed is: every effect in turn, nothing in between, on an arm drawn that
    moves and is logged in a manner of `plant.MANNERS`."""
    rng = np.random.default_rng([seed, number])
    turn, control = divmod(number, CONTROLS)
    effect = None if control == CONTROLS - 1 else HIDDEN[(turn * (CONTROLS - 1) + control) % len(HIDDEN)]
    drawn = {"seed": int(rng.integers(2**31)), "arm": ARMS[int(rng.integers(len(ARMS)))], "effect": effect}
    return {**drawn, "manner": asdict(MANNERS[manner](rng))}


def trial(case: dict) -> dict:
    """The case's joints with what is claimed, refused and said of them."""
    from sysid import diagnose, pipeline
    from sysid.addition import grown

    rng, effect = np.random.default_rng(case["seed"]), case["effect"]
    urdf = PLANAR if case["arm"] == "planar" else arm_urdf(rng, int(case["arm"][-1]))
    arm = arm_of(urdf, rng)
    k = int(rng.integers(min(len(arm.names), 4)))
    model = built(arm, effect, k, rng)
    with tempfile.TemporaryDirectory() as place, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(place)
        written(folder, arm, [logged(arm, model, effect, k, rng, Manner(**case["manner"])) for _ in range(2)])
        begun = time.process_time()
        found = diagnose(pipeline.load(folder))
        seconds = time.process_time() - begun
        first = found.fit.rms("test")
        whole = effect == "gravity_tilt"
        joint, own = ("*", arm.names) if whole else (arm.names[k], [arm.names[k]])
        falls = 0.0
        if effect:
            true = pipeline.fit(grown(found.fit.experiment, effect, None if whole else [joint], {}))
            falls = max(1.0 - true.rms("test")[j] / first[j] for j in own)
    claims = [[(e, j) for e, j, _ in claim.set] for claim in found.claims]
    heads = [(claim.head.effect, claim.head.joint) for claim in found.claims]
    return {
        **case, "joint": joint, "visible": falls >= VISIBLE, "falls": falls, "heads": heads, "sets": claims,
        "status": {v.joint: v.status for v in found.verdict}, "seconds": seconds,
        "refused": [(r.effect, r.joint, r.why) for r in found.refused],
    }  # fmt: skip


def written(folder: Path, arm, logs: list[np.ndarray]) -> None:
    """An experiment folder with a log to train on and one to test on."""
    (folder / "robot.urdf").write_text(arm.urdf)
    head = ",".join(["t", *(f"q_{name}" for name in arm.names), *(f"tau_{name}" for name in arm.names)])
    for name, log in zip(("train", "test"), logs):
        np.savetxt(folder / f"{name}.csv", log, delimiter=",", header=head, comments="", fmt="%.10g")
    experiment = {
        "robot": {"urdf": "robot.urdf", "joints": arm.names},
        "data": {"train": ["train.csv"], "test": ["test.csv"]},
        "model": {"effects": ["viscous", "coulomb", "armature"]},
    }
    (folder / "config.yaml").write_text(yaml.safe_dump(experiment))


def table(results: list[dict]) -> list[str]:
    """The shares named, in a set, and not there; and of each effect what became of it."""
    hidden = [r for r in results if r["effect"]]
    visible = [r for r in hidden if r["visible"]]
    controls = [r for r in results if not r["effect"]]
    own = lambda r: [r["effect"], r["joint"]]  # noqa: E731
    there = lambda r, among: any(list(one) == own(r) for one in among)  # noqa: E731
    head = [r for r in visible if there(r, r["heads"])]
    inside = [r for r in visible if any(there(r, one) for one in r["sets"])]
    sets = [(r, one) for r in results for one in r["sets"]]
    wrong = [(r, one) for r, one in sets if not (r["effect"] and there(r, one))]
    peace = [r for r in controls if set(r["status"].values()) <= {"complete", "unresolved"}]
    out = [
        f"{len(results)} arms, {len(visible)} of {len(hidden)} effects visible",
        f"  named {len(head)}/{len(visible)}, in the set {len(inside)}/{len(visible)}",
        f"  claims not there, by sets {len(wrong)}/{len(sets)}: " + ", ".join(f"{one[0][0]} for {r['effect']}" for r, one in wrong),
        f"  controls neither accused nor unknown {len(peace)}/{len(controls)}",
    ]
    for effect, count in Counter(r["effect"] for r in visible).items():
        done = [r for r in inside if r["effect"] == effect]
        said = {word for r in visible if r["effect"] == effect and r not in done for word in r["status"].values()}
        out.append(f"    {effect:20} {len(done)}/{count}" + (f" ({', '.join(sorted(said))})" if said else ""))
    return out
