"""Whether the promised standard deviations come true: a design's promise, made of a poor first log,
against the scatter of fits of both logs over draws of all their noise, and against what such fits
state themselves."""

from __future__ import annotations

import tempfile
import time
import warnings
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from scripts.blind_parts.robots import experiment_of
from scripts.design_parts.robots import FIRST, RATE, experiment_with

ROBOTS = ("planar", "leg", "ur5")
DRAWS = 80  # of the noise; the first `FEW` of them are counted by themselves, too
FEW = 20
_DETERMINED = 0.9  # of a parameter's variance that is the data's


def case(seed: int, number: int, robots=ROBOTS) -> dict:
    """Robot and seed."""
    return {"robot": robots[number % len(robots)], "seed": seed + number // len(robots)}


def trial(case: dict) -> dict:
    """Of each parameter that both logs determine, the promised deviation, the scatter, and what fits
    state."""
    from sysid import design, experiment_logs, pipeline
    from sysid.prior_weight import with_weight
    from sysid.simulate import Played, simulate

    robot, seed = case["robot"], case["seed"]
    poor = FIRST[robot][0]
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as place:
        warnings.simplefilter("ignore")
        folder = Path(place)
        first = experiment_with(robot, folder / "first", seed, first=poor)
        begun = time.process_time()
        found = design(first, processes=1)
        spent = time.process_time() - begun
        motions = [(found.t, found.q)]
        both = experiment_with(robot, folder / "both", seed, motions=motions, first=poor)
        how = dict(seed=seed, rate=RATE[robot], **asdict(poor))
        _, machine = experiment_of(robot, folder)
        plain = simulate(machine, **how)
        played = simulate(machine, trajectory=Played(found.t, found.q), **how)
        read = experiment_logs.read_all(both)
        fit = pipeline.fit(both, measured=read)
        # the prior's weight as it was chosen: another one would be another estimator
        held = with_weight(both, fit.strength.value)
        rng, drawn, stated = np.random.default_rng(seed), [], []
        for _ in range(DRAWS):
            noisy = [
                _again(log, one.train, plain.truth, rng)
                for log, one in zip(read.train, (plain, played))
            ]
            own = pipeline.fit(held, measured=replace(read, train=noisy))
            drawn.append(own.x)
            stated.append(own.uncertainty.std)
    spread = {n: np.std(drawn[:n], axis=0, ddof=1) for n in (FEW, DRAWS)}
    told = np.sqrt(np.mean(np.square(stated), axis=0))
    rows = [
        {
            "name": name, "promised": found.deviations[name]["after"], "stated": float(told[k]),
            "few": float(spread[FEW][k]), "all": float(spread[DRAWS][k]),
        }
        for k, name in enumerate(fit.model.names)
        if name in found.deviations
        and fit.uncertainty.from_data[k] > _DETERMINED
        and spread[FEW][k] > 0.0
    ]  # fmt: skip
    return {**case, "parameters": rows, "cpu": spent}


def _again(log, simulated, truth: dict, rng):
    """A log with its noise drawn once more: of the torque, and of encoders whose steps begin
    elsewhere."""
    std, step = (np.array(list(truth[k].values())) for k in ("torque_noise_std", "encoder_step"))
    clean, shift = simulated.clean, rng.random(len(step))
    angles = (np.round(clean.read / step + shift) - shift) * step
    torque = clean.sensed + std * rng.standard_normal(clean.sensed.shape)
    (segment,) = log.segments
    return replace(log, segments=(replace(segment, q=angles, tau=torque),))


def right(draws: int) -> float:
    """The share of deviations over so many draws that are within a quarter of the true one."""
    near = np.array([0.8, 1.25]) ** 2 * (draws - 1)
    return float(np.diff(chi2.cdf(near, draws - 1))[0])


def table(results: list[dict]) -> list[str]:
    """Ratios by robot: promised over achieved, and what a fit states over achieved."""
    out = []
    for n, word in ((FEW, "few"), (DRAWS, "all")):
        out.append(f"over {n} draws (a promise that is exact: {right(n):.0%} within a quarter)")
        for key in ("promised", "stated"):
            whole = []
            for r in results:
                ratio = np.array([p[key] / p[word] for p in r["parameters"]])
                whole.append(ratio)
                out.append(f"  {r['robot']:7s} seed {r['seed']} {key} / achieved: {_said(ratio)}")
            if len(whole) > 1:
                out.append(f"  all {key} / achieved: {_said(np.concatenate(whole))}")
    return out


def _said(ratio) -> str:
    within = np.mean(np.abs(np.log(ratio)) < np.log(1.25))
    return f"{len(ratio)} parameters, median {np.median(ratio):.2f}, within a quarter {within:.0%}"
