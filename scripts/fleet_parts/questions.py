"""A held model, and many logs of 10 s: what changed on each, and how long that takes."""

from __future__ import annotations

import resource
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

from scripts.fleet_parts.robots import CONFIG, Fault, drawn, logged, payload, ur5, with_fault
from sysid import pipeline, results
from sysid.changes import many

LOGS, SECONDS, RATE, JOBS = 200, 10.0, 1000.0, 2
KINDS = ("nothing", "nothing", "payload", "coulomb", "torque_bias", "nothing")


def case(seed: int, number: int) -> dict:
    """One robot and its logs."""
    return {"seed": seed * 1000 + number}


def trial(case: dict) -> dict:
    """What was found on each log, and the truth; seconds of wall clock and of processors."""
    kind = ur5()
    one = drawn(kind, np.random.default_rng([case["seed"], 0]))
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as place:
        warnings.simplefilter("ignore")
        folder = Path(place)
        (folder / "config.yaml").write_text(CONFIG)
        for k, (part, seconds) in enumerate((("train", 40.0), ("test", 20.0))):
            rng = np.random.default_rng([case["seed"], 1, k])
            logged(kind, one, rng, seconds, rate=RATE).write_csv(folder / f"{part}.csv")
        results.write(pipeline.fit(pipeline.load(folder)), folder / "run")
        truth = {}
        for k in range(LOGS):
            rng = np.random.default_rng([case["seed"], 2, k])
            changed, bias, name = _changed(kind, one, KINDS[k % len(KINDS)], rng)
            log = folder / f"log{k:03d}.csv"
            logged(kind, changed, rng, SECONDS, rate=RATE, bias=bias).write_csv(log)
            truth[str(log)] = name
        begun, before = time.perf_counter(), _processors()
        found, failed = many(folder / "run", list(truth), jobs=JOBS)
        wall, cpu = time.perf_counter() - begun, _processors() - before
    named = [
        [name, [[c.effect, c.joint] for c in found[log].changes]] for log, name in truth.items()
    ]
    return {"wall": wall, "cpu": cpu, "failed": len(failed), "named": named}


def _changed(kind, one, word: str, rng):
    """A robot with a change, a bias, and the change's (effect, joint)."""
    dof, bias = kind.machine.dof, np.zeros(kind.machine.dof)
    j = int(rng.integers(dof))
    if word == "payload":
        com = rng.uniform([-0.03, -0.03, 0.02], [0.03, 0.03, 0.1])
        fault = Fault(0, body=dof - 1, added=payload(float(rng.uniform(0.5, 2.0)), com))
        return with_fault(one, fault), bias, ["payload", "*"]
    if word == "coulomb":
        more = one.coulomb.copy()
        more[j] *= rng.uniform(1.6, 2.5)
        return type(one)(one.pi, one.viscous, more), bias, ["coulomb", kind.machine.joints[j]]
    if word == "torque_bias":
        bias[j] = rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 1.0) * kind.coulomb[j]
        return one, bias, ["torque_bias", kind.machine.joints[j]]
    return one, bias, None


def _processors() -> float:
    """Seconds of processors that this process and those that it waited for have used."""
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor().shutdown(wait=True)
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(own.ru_utime + own.ru_stime for own in both)


def told(results: list[dict]) -> list[str]:
    """The table."""
    out = []
    for r in results:
        sound = [found for truth, found in r["named"] if truth is None]
        changed = [(truth, found) for truth, found in r["named"] if truth is not None]
        alone = sum(found == [truth] for truth, found in changed)
        there = sum(truth in found for truth, found in changed)
        out.append(
            f"{len(r['named'])} logs in {r['wall']:.0f} s on {JOBS} processes, {r['cpu']:.0f} s of "
            f"processors; unchanged {len(sound)}, called changed {sum(map(bool, sound))}; changed "
            f"{len(changed)}, named {there}, named alone {alone}; failed {r['failed']}"
        )
    return out
