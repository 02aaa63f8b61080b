"""Under which conditions logs are made: clean, as labs have them, or one slow sine a joint."""

from __future__ import annotations

from pathlib import Path

import numpy as np

CONDITIONS = ("clean", "nuisances", "sines")
MARKS = {"clean": "", "nuisances": "n", "sines": "s"}  # before a case's number
SAYS = {
    "clean": "",
    "nuisances": "Each case's logs have one to three nuisances, drawn: moves with stops, knocks, "
    "spikes in the torque, brakes that close at rest, several short logs, a 100 Hz logger with "
    "jitter, a coarse current.",
    "sines": "The motion is one slow sine a joint; sizes are drawn from the larger half.",
}
KINDS = ("moves", "knocks", "spikes", "brakes", "short logs", "slow logger", "coarse current")
MOST = 3  # of them in a case
_LOGS, _SECONDS = (4, 8), (3.0, 5.0)  # several short logs
_KNOCKS, _SPIKES = (2, 4), (0.1, 1.0)  # in each log; a second and joint
_JITTER, _CURRENT = (0.5, 2.5), (0.5, 3.0)  # ms; per cent of the peak torque


def drawn(rng: np.random.Generator) -> tuple[list[str], dict]:
    """One to three nuisances: their kinds, and what `simulate` is to be given for them."""
    count = 1 + int(rng.integers(MOST))
    kinds = [KINDS[k] for k in sorted(rng.choice(len(KINDS), count, replace=False))]
    options: dict = {}
    if {"moves", "brakes"} & set(kinds):
        options["motion"] = "moves"
    if "brakes" in kinds:
        options["brakes"] = True
    if "knocks" in kinds:
        options["knocks"] = int(rng.integers(_KNOCKS[0], _KNOCKS[1] + 1))
    if "spikes" in kinds:
        options["spikes"] = round(float(np.exp(rng.uniform(*np.log(_SPIKES)))), 3)
    if "short logs" in kinds:
        options["logs"] = int(rng.integers(_LOGS[0], _LOGS[1] + 1))
        options["duration"] = round(float(rng.uniform(*_SECONDS)), 1)
        if "knocks" in options:
            options["knocks"] = 1  # in each
    if "slow logger" in kinds:
        options |= {"rate": 100.0, "jitter": round(float(rng.uniform(*_JITTER)), 2)}
    if "coarse current" in kinds:
        options["current"] = f"{rng.uniform(*_CURRENT):.1f}%"
    return kinds, options


def noise_seen(simulation, fit, folder: Path) -> dict[str, float]:
    """RMS [N m] of each joint's random torque noise as a fit's preprocessing leaves it, over all
    logs; spikes and closed brakes are no noise.

    The noise alone is logged in place of the torque and read as every log is, so that what is
    filtered or resampled of the torque is filtered and resampled of it.
    """
    from dataclasses import replace

    from sysid import pipeline
    from sysid.simulate.folder import _csv

    joints = simulation.robot.joints
    squares, rows = np.zeros(len(joints)), np.zeros(len(joints))
    for name, log in simulation.logs.items():
        noise = log.tau - log.clean.sensed
        brakes = []
        for event in log.events:
            if event["kind"] == "knock":
                continue
            j = joints.index(event["joints"][0])
            noise[slice(*event["rows"]), j] = 0.0
            if event["kind"] == "brake":
                brakes.append((j, event["start"], event["stop"]))
        file = folder / f"noise_{name}.csv"
        text = _csv(replace(log, tau=noise), simulation.robot)
        file.write_text(text, encoding="utf-8")
        seen = pipeline.predict_log(fit, str(file.resolve()))
        use = np.ones(seen.measured.shape, dtype=bool) if seen.use is None else seen.use.copy()
        for j, start, stop in brakes:
            use[(seen.t >= start) & (seen.t <= stop), j] = False
        squares += np.sum(np.where(use, seen.measured, 0.0) ** 2, axis=0)
        rows += use.sum(axis=0)
    rms = np.sqrt(squares / np.maximum(rows, 1))
    return {joint: float(value) for joint, value in zip(joints, rms)}
