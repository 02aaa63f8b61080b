"""Jumps of a torque are found, and the rows that the angles' filter bends about them do not count."""

import numpy as np
import pytest

from sysid.jumps import jumps
from sysid.log import Log, Segment
from sysid.preprocess import prepare
from sysid.specs import PreprocessSpec

STEP, INERTIA, NOISE = 1e-3, 2.0, 0.02


def moves(seconds: float = 12.0):
    """An inertia from rest to rest, over and over: its torque is one of three levels, its angle
    the exact double integral."""
    t = np.arange(round(seconds / STEP)) * STEP
    phase = t % 4.0
    level = np.select([phase < 0.5, phase < 1.5, phase < 2.0, phase < 2.5, phase < 3.5], [1, 0, -1, -1, 0], 1)
    qdd = 6.0 * level
    qd = np.concatenate([[0.0], np.cumsum(qdd)[:-1]]) * STEP
    q = np.concatenate([[0.0], np.cumsum(qd + 0.5 * qdd * STEP)[:-1]]) * STEP
    return t, q, qdd


def motion(tau, q, t, standstill="auto"):
    from pathlib import Path

    segment = Segment(t, STEP, q[:, None], tau[:, None], None, None, {})
    log = Log("moves", Path("moves"), "", (segment,))
    return prepare([log], PreprocessSpec(standstill=standstill), ("joint",))


def error(found) -> float:
    """RMS of what the true inertia leaves of the rows that count."""
    (piece,) = found.pieces
    use = np.ones(piece.q.shape, bool) if piece.use is None else piece.use
    rest = piece.measured - INERTIA * piece.qdd
    return float(np.sqrt(np.mean(rest[use] ** 2)))


def test_the_true_model_leaves_the_noise_where_the_torque_jumps():
    t, q, qdd = moves()
    tau = INERTIA * qdd + NOISE * np.random.default_rng(0).normal(size=len(t))
    assert error(motion(tau, q, t, "keep")) > 20.0 * NOISE  # what the filter bends
    found = motion(tau, q, t)
    assert error(found) == pytest.approx(NOISE, rel=0.1)
    # a jump or a reversal every half or whole second, and no more about each than the filter sees
    (piece,) = found.pieces
    assert 1.0 - piece.use.mean() < 18 * 0.1 / 12.0 + 0.01


def test_a_smooth_torque_with_noise_does_not_jump():
    rng, t = np.random.default_rng(1), np.arange(5000) * STEP
    hit = 0
    for _ in range(200):
        waves = np.sum(
            [rng.normal() * np.sin(2 * np.pi * rng.uniform(0.2, 3.0) * t + rng.uniform(0, 6)) for _ in range(6)],
            axis=0,
        )
        tau = 20.0 * waves[:, None] + rng.uniform(0.02, 2.0) * rng.normal(size=(len(t), 2))
        hit += bool(jumps(tau, 50).any())
    assert hit <= 8  # one log in a hundred is allowed one: more than eight of 200 is a chance of 1e-3


def test_a_jump_of_several_deviations_is_found_in_its_place():
    rng, n, places = np.random.default_rng(2), 8000, (2000, 5100)
    tau = 0.1 * rng.normal(size=(n, 1))
    for place in places:
        tau[place:] += 0.6
    rows = np.flatnonzero(jumps(tau, 50)[:, 0])
    assert all(np.abs(rows - place).min() <= 5 for place in places)
    assert np.min([np.abs(rows - place) for place in places], axis=0).max() <= 10


def test_neither_a_coarse_torque_nor_a_short_one_jumps():
    t = np.arange(4000) * STEP
    tau = np.round(np.sin(2.0 * np.pi * 0.7 * t) / 0.05)[:, None] * 0.05
    assert not jumps(tau, 50).any()
    assert not jumps(tau[:100], 50).any()
    assert not jumps(np.zeros((4000, 2)), 50).any()


def test_a_spike_is_no_jump():
    rng = np.random.default_rng(3)
    tau = 0.1 * rng.normal(size=(6000, 1))
    tau[[1000, 1001, 3000]] += 30.0
    assert not jumps(tau, 50).any() and not jumps(tau, 5).any()
