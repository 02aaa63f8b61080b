"""Under which conditions logs are made: clean, as labs have them, or one slow sine a joint."""

from __future__ import annotations

from dataclasses import replace
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


def noise_seen(simulation, fit, folder: Path) -> dict[str, dict[str, float]]:
    """RMS [N m] of each joint's noise as a fit sees it, over all logs: {"all": of torque, encoder
    and clock, "torque": of the torque alone}. Spikes and closed brakes are no noise.

    An encoder's own law, an offset or an eccentricity, is no noise. What the sensors added is the difference of two residuals of the same fit: on the log, and on
    what no sensor saw at the same times. So all that is filtered, resampled and left out of the
    log is filtered, resampled and left out of its noise.
    """
    joints = simulation.robot.joints
    squares = {kind: np.zeros(len(joints)) for kind in ("all", "torque")}
    rows = {kind: np.zeros(len(joints)) for kind in squares}
    for log in simulation.logs.values():
        clean, tau = log.clean, log.tau.copy()
        away = []
        for event in log.events:
            if event["kind"] != "knock":
                j = joints.index(event["joints"][0])
                part = slice(*event["rows"])
                tau[part, j] = clean.sensed[part, j]
                if event["kind"] == "brake":
                    away.append((j, event["start"], event["stop"]))
        seen = {
            "none": _residual(simulation, fit, log, clean.read, clean.sensed, folder),
            "all": _residual(simulation, fit, log, log.q, tau, folder),
            "torque": _residual(simulation, fit, log, clean.read, tau, folder),
        }
        for kind in squares:
            noise, use, t = _difference(seen[kind], seen["none"])
            for j, start, stop in away:
                use[(t >= start) & (t <= stop), j] = False
            squares[kind] += np.sum(np.where(use, noise, 0.0) ** 2, axis=0)
            rows[kind] += use.sum(axis=0)
    return {
        kind: dict(zip(joints, np.sqrt(squares[kind] / np.maximum(rows[kind], 1)).tolist()))
        for kind in squares
    }


def _residual(simulation, fit, log, q, tau, folder: Path):
    """What a fit says of a log with angles q and torque tau (n, dof) in place of its own."""
    from sysid import pipeline
    from sysid.simulate.folder import _csv

    file = folder / "noise.csv"
    file.write_text(_csv(replace(log, q=q, tau=tau), simulation.robot), encoding="utf-8")
    return pipeline.predict_log(fit, str(file.resolve()))


def _difference(one, other) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Difference of two residuals (n, dof) at the times that both have, where both count (n, dof),
    and the times (n,) [s]."""
    t, first, second = np.intersect1d(np.round(one.t, 7), np.round(other.t, 7), return_indices=True)
    use = np.ones((len(t), one.measured.shape[1]), dtype=bool)
    for seen, rows in ((one, first), (other, second)):
        if seen.use is not None:
            use &= seen.use[rows]
    return (
        (one.measured - one.predicted)[first] - (other.measured - other.predicted)[second],
        use,
        t,
    )
