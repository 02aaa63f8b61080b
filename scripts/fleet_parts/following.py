"""`sysid.Online` on a simulated arm of seven joints: time a sample, a payload found, equality with
the batch fit, false alarms."""

from __future__ import annotations

import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import polars as pl

from scripts.fleet_parts.robots import Type, drawn, logged, payload
from sysid import Online, pipeline, robot
from sysid.robot_spec import RobotSpec

PANDA = "example-robot-data://panda_description/urdf/panda.urdf"
JOINTS = [f"panda_joint{k}" for k in range(1, 8)]
RATE, SLOW, STANDSTILL = 1000.0, 125.0, 0.03  # Hz, Hz of the long watch; rad/s
HOURS, PIECE = 24.0, 600.0  # s of one piece of the watch
# N m: 1.5 % of the RMS torque of six minutes of such motion
NOISE = np.array([0.20, 0.65, 0.15, 0.28, 0.042, 0.048, 0.029])
TEN = 599.9085  # s: as many rows as whole ticks, behind half a window on either side
CONFIG = (
    f"robot: {{urdf: '{PANDA}', joints: {JOINTS}}}\n"
    f"preprocess: {{standstill: {STANDSTILL}, events: keep}}\nprior: {{weight: 1.0e-2}}\n"
    "solver: {tolerance: 1.0e-10}\n"
)


def case(seed: int, number: int) -> dict:
    """The questions: payloads, equality and time, and false alarms in pieces of two hours."""
    kinds = ["payload", "batch", *["alarms"] * 12]
    return {"seed": seed * 1000 + number, "kind": kinds[number % len(kinds)]}


def panda() -> Type:
    """A Panda with friction in proportion to its joints' size."""
    machine = robot.load(RobotSpec(urdf=PANDA, joints=JOINTS))
    size = np.array([4.0, 4.0, 3.0, 3.0, 1.0, 1.0, 0.8])
    return Type(machine, size, size)


def trial(case: dict) -> dict:
    """One question."""
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as place:
        warnings.simplefilter("ignore")
        return {**case, **_WORK[case["kind"]](case["seed"], Path(place))}


def _fitted(seed: int, folder: Path, rate: float, train: float, test: float = 60.0):
    """A type, a robot of it, and its fit."""
    kind = panda()
    one = drawn(kind, np.random.default_rng([seed, 0]))
    (folder / "config.yaml").write_text(CONFIG)
    for k, (part, seconds) in enumerate((("train", train), ("test", test))):
        rng = np.random.default_rng([seed, 1, k])
        logged(kind, one, rng, seconds, rate=rate, noise=NOISE).write_csv(folder / f"{part}.csv")
    return kind, one, pipeline.fit(pipeline.load(folder))


def _samples(log) -> tuple[np.ndarray, np.ndarray]:
    columns = [[c for c in log.columns if c.startswith(word)] for word in ("q_", "tau_")]
    return tuple(log.select(own).to_numpy() for own in columns)


def _payload(seed: int, folder: Path) -> dict:
    """Twenty pick-ups of a kilogram: when each is told, as what, its mass after five seconds."""
    kind, one, fit = _fitted(seed, folder, RATE, 60.0)
    online, found = Online(fit, rate=RATE, follow=False), []
    for k in range(20):
        rng = np.random.default_rng([seed, 2, k])
        com = rng.uniform([-0.03, -0.03, 0.05], [0.03, 0.03, 0.15])
        both = _picked(kind, one, payload(1.0, com), rng)
        online.gap()
        online.clear()
        began = online.time
        early = online.add(*(v[:10_000] for v in both))
        told = named = None
        for at in range(10_000, 17_000, 20):
            told = online.add(*(v[at : at + 20] for v in both)) or told
            named = online.change if at == 12_000 - 20 else named
            if at >= 15_000 - 20:
                break
        said = online.change
        mass = said.parameters.get("payload.*.m") if said else None
        found.append({
            "early": early is not None, "after": told.time - began - 10.0 if told else None,
            "told": named.effect if named else None, "mass": mass and mass[:2],
        })  # fmt: skip
    return {"found": found}


def _picked(kind, one, body, rng) -> tuple[np.ndarray, np.ndarray]:
    """17 s of samples, in which a body is picked up after ten."""
    from dataclasses import replace

    pi = one.pi.copy()
    pi[-1] += body
    state = rng.bit_generator.state
    without = _samples(logged(kind, one, rng, 17.0, rate=RATE, noise=NOISE))
    rng.bit_generator.state = state
    loaded = _samples(logged(kind, replace(one, pi=pi), rng, 17.0, rate=RATE, noise=NOISE))
    tau = np.where(np.arange(len(without[0]))[:, None] < 10_000, without[1], loaded[1])
    return without[0], tau


def _batch(seed: int, folder: Path) -> dict:
    """Ten minutes: processor time a sample, the distance from the batch fit of the same rows."""
    *_, fit = _fitted(seed, folder, RATE, TEN)
    q, tau = _samples(pl.read_csv(folder / "train.csv"))
    online = Online(fit, rate=RATE, standstill=STANDSTILL)
    seconds = []
    for first in range(0, len(q), 50_000):
        begun = time.process_time()
        for k in range(first, min(first + 50_000, len(q))):
            online.add(q[k], tau[k])
        online.x  # noqa: B018 - asked for every 50 s
        seconds.append(time.process_time() - begun)
    rows = fit.samples["train"]
    away = float(np.linalg.norm(online.x - fit.x) / np.linalg.norm(fit.x))
    worst = float(np.max(np.abs(online.x - fit.x) / np.maximum(np.abs(fit.x), 1e-3)))
    return {
        "microseconds": 1e6 * float(np.sum(seconds)) / len(q), "away": away, "worst": worst,
        "rows": [int(online._follower.rows), int(rows)], "alarm": online.alarm is not None,
    }  # fmt: skip


def _alarms(seed: int, folder: Path) -> dict:
    """Two hours without a change, at 125 Hz: alarms. In each ten minutes the noise is a share of
    what their motion needs, up to twice what it was on the sound logs."""
    kind, one, fit = _fitted(seed, folder, SLOW, 120.0, 120.0)
    online, raised, hours = Online(fit, rate=SLOW, follow=False), [], 0.0
    for k in range(round(HOURS / 12 * 3600 / PIECE)):
        both = _samples(logged(kind, one, np.random.default_rng([seed, 3, k]), PIECE, rate=SLOW))
        online.gap()
        for first in range(0, len(both[0]), 4096):
            if (alarm := online.add(*(v[first : first + 4096] for v in both))) is not None:
                raised.append([alarm.time, alarm.effect, alarm.joint, alarm.p])
                online.clear()
        hours += PIECE / 3600
    return {"hours": hours, "raised": raised}


_WORK = {"payload": _payload, "batch": _batch, "alarms": _alarms}


def told(results: list[dict]) -> list[str]:
    """The table."""
    out = []
    for r in (r for r in results if r["kind"] == "payload"):
        found = r["found"]
        after = [f["after"] for f in found if f["after"] is not None]
        right = [f for f in found if f["told"] == "payload"]
        off = [abs(f["mass"][0] - 1.0) for f in right if f["mass"]]
        out.append(
            f"payload of 1 kg: told {len(after)} of {len(found)}, latest after {max(after):.2f} s, "
            f"as a payload {len(right)}, mass after 5 s off by at most {100 * max(off):.2f} %, "
            f"within 3 % {sum(v <= 0.03 for v in off)}; before it {sum(f['early'] for f in found)}"
        )
    for r in (r for r in results if r["kind"] == "batch"):
        out.append(
            f"{r['microseconds']:.0f} us a sample; {r['rows'][0]} of {r['rows'][1]} rows; from the "
            f"batch fit {r['away']:.1e}, worst parameter {r['worst']:.1e}; alarm {r['alarm']}"
        )
    watched = [r for r in results if r["kind"] == "alarms"]
    if watched:
        raised = [alarm for r in watched for alarm in r["raised"]]
        hours = sum(r["hours"] for r in watched)
        out.append(f"{hours:.0f} h without a change: {len(raised)} alarms {raised[:3]}")
    return out
