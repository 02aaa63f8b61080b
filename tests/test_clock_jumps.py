"""Jumps of accelerations are found where a clock's correction has spread them; what a torque does by itself is none."""

import json

import numpy as np
import pytest

from sysid import jumps, pipeline
from sysid.clock_jumps import spread

RATE = 100.0
SIZES = np.array([1.0, -0.6, 0.4])  # of three joints that move together
REACH = 10


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_errors_are_near_the_noise_where_stamps_were_wrong(simulated, monkeypatch, seed):
    """Moves as a slow logger has them, whose stamps are a millisecond beside its values: with those rows, and without them."""
    folder = simulated(f"jittered {seed}", seed=seed, duration=20.0, rate=RATE, motion="moves", jitter=1.0)
    noise = json.loads((folder / "truth.json").read_text())["logs"]["train"]["noise_rms"]
    over = lambda: [error / noise[joint] for joint, error in pipeline.fit(pipeline.load(folder)).rms("train").items()]  # noqa: E731
    without = over()
    monkeypatch.setattr(jumps, "spread", lambda told, *_: (np.zeros(0, dtype=int), np.zeros(0)))
    assert all(a < b for a, b in zip(without, over())) and np.mean(without) < 1.5 < np.mean(over())


@pytest.mark.parametrize("inertia", [0.2, 1.0, 2.0, 5.0])
def test_what_a_torque_does_by_itself_is_no_jump(inertia):
    """Steps of friction or of a load, as large as what inertia makes and less, while accelerations are smooth: one in twenty may look like one."""
    rng, hits, tried = np.random.default_rng(5), 0, 0
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    for _ in range(40):
        w, a, p = 2.0 * np.pi * rng.uniform(0.1, 1.5, (5, 3)), rng.normal(size=(5, 3)), rng.uniform(0.0, 6.0, (5, 3))
        qdd = np.sum(a * np.sin(w * t[:, None, None] + p), axis=1) * SIZES
        at = np.sort(rng.choice(np.arange(60, len(t) - 60, 80), 12, replace=False))
        torque = np.sum([rng.choice([-1.0, 1.0]) * 3.0 * (np.arange(len(t)) >= k) for k in at], axis=0) + 0.05 * rng.normal(size=len(t))
        told = np.zeros(len(t))
        told[at] = 3.0
        hits, tried = hits + len(spread(told, 1.0, torque + inertia * qdd[:, 0], qdd, REACH)[0]), tried + len(at)
    assert hits <= 0.05 * tried, (hits, tried)


def test_a_jump_that_was_spread_is_found_in_its_place():
    """In all joints, in one, and near an end of the log; not nearer to it than half a period."""
    n = 400
    rows = np.arange(n)
    for places, found in (([200], [200]), ([100, 300], [100, 300]), ([12, 390], [12]), ([5], [])):
        level = np.sum([np.tanh((rows - k) / 4.0) for k in places], axis=0)
        torque, told = np.sum([np.sign(rows - k + 0.5) for k in places], axis=0).astype(float), np.zeros(n)
        told[places] = -2.0
        for joints in (SIZES, np.array([0.0, 0.0, 1.0])):
            at, by = spread(told, 0.5, torque, level[:, None] * joints, REACH)
            assert sorted(at.tolist()) == found and (by == 2.0).all()
