"""Precision: information against random motions and a design for the condition number."""

from __future__ import annotations

import time
import warnings

import numpy as np

from scripts.design_parts.robots import unlogged
from sysid.design import search, solve
from sysid.design.problem import told, value

ROBOTS = ("leg", "ur5", "panda", "ur10e")
RANDOM = 1000  # motions that keep to the limits
_SPREAD = 1e-9  # of the largest eigenvalue: below, no motion shows a direction


def case(seed: int, number: int, robots=ROBOTS) -> dict:
    """Robot and seed."""
    return {"robot": robots[number % len(robots)], "seed": seed + number // len(robots)}


def trial(case: dict) -> dict:
    """log det of three designs, from the URDF."""
    out = {**case, "cpu": {}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem, pose, rounds = unlogged(case["robot"])
        fastest = max(rounds) * problem.family.harmonics / problem.family.duration
        begun = time.process_time()
        found, _ = search.searched(problem, pose, fastest, case["seed"], processes=1)
        out["cpu"]["designed"] = time.process_time() - begun
        out["designed"] = found.log_det
        begun = time.process_time()
        best, count, k = -np.inf, 0, 0
        while count < RANDOM and k < 20 * RANDOM:
            own = search.start(problem, pose, (case["seed"], rounds[k % len(rounds)], 10_000 + k))
            best, count, k = max(best, own.log_det), count + bool(np.isfinite(own.value)), k + 1
        out["cpu"]["random"] = time.process_time() - begun
        out["random"], out["drawn"] = best, count
        begun = time.process_time()
        out["condition"], out["kappa"], out["kappa_designed"] = _condition(
            problem, pose, rounds, case["seed"], found
        )
        out["cpu"]["condition"] = time.process_time() - begun
    return out


def _condition(problem, pose, rounds, seed: int, designed) -> tuple[float, float, float]:
    """log det of the motion with the least condition number that the same search finds, that number,
    and the designed motion's own. Of base parameters, each in units of what a random motion tells of
    it: the usual design, Gautier & Khalil 1992."""
    known = problem.known
    grams = []
    for k in range(8):
        start = search.start(problem, pose, (seed, rounds[k % len(rounds)], 5000 + k))
        grams.append(_gram(told(problem.of(start.family), start.z)))
    typical = np.sum(grams, axis=0)
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(typical), 1e-300))
    values, vectors = np.linalg.eigh(typical * np.outer(scale, scale))
    shown = values > _SPREAD * values[-1]
    base = scale[:, None] * vectors[:, shown] / np.sqrt(values[shown])

    def worth(known, information):
        own = base.T @ (information - known.before) @ base
        values, vectors = np.linalg.eigh(own)
        low, high = base @ vectors[:, 0], base @ vectors[:, -1]
        slope = np.outer(low, low) / values[0] - np.outer(high, high) / values[-1]
        return float(np.log(values[0] / values[-1])), slope

    # of the order of hundreds, as log det is, so that prices and thresholds mean the same
    weight = float(known.model.size)
    kept = solve.worth
    solve.worth = lambda *asked: tuple(weight * part for part in worth(*asked))
    try:
        starts = [
            search.start(problem, pose, (seed, r, k)) for r in rounds for k in range(search.DRAWN)
        ]
        starts = [one for one in starts if np.isfinite(one.value)]

        def kappa(found) -> float:
            own = problem.of(found.family)
            weights = own.samples / len(own.nodes)
            return -worth(known, known.before + weights * _gram(told(own, found.z)))[0]

        starts = sorted(starts, key=kappa)[: search.IMPROVED]
        ended = []
        for one in starts:
            climb = solve.Climb(one.family, one.z)
            while not climb.over:
                climb = solve.climbed(problem, climb, 100)
            ended.append(solve.Found.of(problem.of(climb.family), climb.z))
    finally:
        solve.worth = kept
    best = min((one for one in ended if np.isfinite(one.value)), key=kappa)
    log_det = value(problem.of(best.family), best.z)[1]
    return log_det, float(np.exp(kappa(best))), float(np.exp(kappa(designed)))


def _gram(columns) -> np.ndarray:
    flat = np.moveaxis(columns, 1, 2).reshape(-1, columns.shape[1])
    return flat.T @ flat


def table(results: list[dict]) -> list[str]:
    """log det beside the others'."""
    out = ["robot     designed   best random     condition number (kappa; of the designed motion)"]
    for r in results:
        out.append(
            f"{r['robot']:8s} {r['designed']:9.1f}  {r['random']:9.1f} of {r['drawn']}  "
            f"{r['condition']:9.1f}  ({r['kappa']:.0f}; {r['kappa_designed']:.0f})"
        )
    return out
