"""Are odd robots found, named and sized, and is no sound one called odd?"""

from __future__ import annotations

import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

from scripts.fleet_parts.robots import Fault, drawn, payload, ur5, written
from sysid import fleet

ROBOTS, FAULTY = 40, 5  # in a fleet; every so many fleets, one has faults


def case(seed: int, number: int) -> dict:
    """Fleets without a fault, and after each four of them one with two."""
    return {"seed": seed * 1000 + number, "faulty": number % FAULTY == FAULTY - 1}


def trial(case: dict) -> dict:
    """Which robots of a fleet were called odd, in what, and the truth."""
    kind, rng = ur5(), np.random.default_rng([case["seed"], 99])
    faults = _faults(rng, kind.machine.dof) if case["faulty"] else []
    out: dict = {**case, "faults": [], "odd": []}
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as place:
        warnings.simplefilter("ignore")
        paths = written(Path(place), kind, ROBOTS, case["seed"], faults)
        begun = time.process_time()
        found = fleet(paths)
        out["cpu"] = time.process_time() - begun
    out["threshold"] = found.threshold
    out["odd"] = [
        {"robot": i, "causes": [[c.name, c.body, c.size, c.std] for c in causes]}
        for i, causes in found.odd.items()
    ]
    out["faults"] = [_judged(fault, found, kind, case["seed"]) for fault in faults]
    guilty = {fault.robot for fault in faults}
    out["false"] = sum(i not in guilty for i in found.odd)
    return out


def _faults(rng, dof: int) -> list[Fault]:
    """A worn joint on one robot, something left on the last link of another."""
    worn, loaded = rng.choice(ROBOTS, 2, replace=False).tolist()
    com = rng.uniform([-0.03, -0.03, 0.02], [0.03, 0.03, 0.08])
    return [
        Fault(worn, joint=int(rng.integers(dof)), factor=float(rng.uniform(1.8, 2.5))),
        Fault(loaded, body=dof - 1, added=payload(float(rng.uniform(0.5, 1.5)), com)),
    ]


def _judged(fault: Fault, found, kind, seed: int) -> dict:
    """Whether a fault was found, named first, and how many deviations its size is off."""
    causes = found.odd.get(fault.robot, [])
    machine = kind.machine
    if fault.body >= 0:
        body = machine.bodies[fault.body].name
        truth = {f"{body}.m": float(fault.added[0])}
    else:
        own = drawn(kind, np.random.default_rng([seed, fault.robot]))
        joint, more = machine.joints[fault.joint], fault.factor - 1.0
        truth = {
            f"viscous.{joint}.Fv": float(more * own.viscous[fault.joint]),
            f"coulomb.{joint}.Fc": float(more * own.coulomb[fault.joint]),
        }
    sizes = {name: (v, s) for c in causes for name, (v, s, _) in c.values.items()}
    off = {n: (sizes[n][0] - t) / sizes[n][1] for n, t in truth.items() if n in sizes}
    return {
        "truth": truth,
        "found": bool(causes),
        "named": bool(causes) and causes[0].name in truth,
        "alone": bool(causes) and all(c.name in truth for c in causes),
        "off": off,
    }


def _false(results: list[dict]) -> int:
    return sum(r["false"] > 0 for r in results)


def told(results: list[dict]) -> list[str]:
    """The table."""
    sound, faulty = ([r for r in results if r["faulty"] == kind] for kind in (False, True))
    faults = [f for r in faulty for f in r["faults"]]
    off = [abs(v) for f in faults for v in f["off"].values()]
    out = [
        f"{len(sound)} fleets of {ROBOTS} without a fault: {_false(sound)} with a false alarm",
        f"{len(faulty)} fleets with two faults: {_false(faulty)} with a false alarm",
        f"faults {len(faults)}: "
        + ", ".join(
            f"{word} {sum(f[word] for f in faults)}" for word in ("found", "named", "alone")
        ),
    ]
    if off:
        inside, rms = sum(v <= 3 for v in off), np.sqrt(np.mean(np.square(off)))
        out.append(
            f"sizes {len(off)}: {inside} within 3 deviations, largest {max(off):.2f}, RMS {rms:.2f}"
        )
    out.append(f"CPU a fleet {np.mean([r['cpu'] for r in results]):.1f} s")
    return out
