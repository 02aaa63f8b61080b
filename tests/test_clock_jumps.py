"""Jumps of accelerations are found where a clock's correction has spread them; what a torque does by itself is none."""

import json
from pathlib import Path

import numpy as np
import pytest

from sysid import jumps, pipeline
from sysid.clock_jumps import spread
from sysid.log import Log, Segment
from sysid.lowpass import lowpassed

RATE = 100.0
SIZES = np.array([1.0, -0.6, 0.4])  # of three joints that move together
REACH = 10


@pytest.mark.long
@pytest.mark.parametrize(
    "seed",
    [
        # 2.1 on average: for a fifth of a second its stamps are corrected wrongly, and with them the shoulder's acceleration
        pytest.param(1, marks=pytest.mark.xfail(strict=True)),
        2,
        3,
    ],
)
def test_errors_are_near_the_noise_where_stamps_were_wrong(simulated, monkeypatch, seed):
    """Moves as a slow logger has them, whose stamps are a millisecond beside its values: with those rows, and without them."""
    folder = simulated(f"jittered {seed}", seed=seed, duration=20.0, rate=RATE, motion="moves", jitter=1.0)
    noise = json.loads((folder / "truth.json").read_text())["logs"]["train"]["noise_rms"]
    over = lambda: [error / noise[joint] for joint, error in pipeline.fit(pipeline.load(folder)).rms("train").items()]  # noqa: E731
    without = over()
    monkeypatch.setattr(jumps, "spread", lambda told, *_: (np.zeros(0, dtype=int), np.zeros(0)))
    # a jump that was spread is told by several waves as well, in some logs
    monkeypatch.setattr(jumps._Seen, "superposed", lambda seen, *_: np.zeros(len(seen.tops[0])))
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


def moved(every: int, seed: int, noise: float):
    """Errors under a low-pass of a joint that starts, stops and turns at times of its own, of which every so many tenths of a
    millisecond are logged, and which rows count; the torque's noise is of one sample of `every`."""
    rng, step, n = np.random.default_rng(seed), 1e-4, 200_000
    ends = np.sort(rng.choice(n, 16, replace=False))
    ends = np.concatenate([[0], ends[np.diff(ends, prepend=-n) > 6000], [n]])
    qdd = np.repeat(rng.choice([-3.0, 1.0, 2.0, 4.0], len(ends) - 1), np.diff(ends))
    qd = np.concatenate([[0.0], np.cumsum(qdd)[:-1]]) * step + 50.0  # it never turns back
    q = np.concatenate([[0.0], np.cumsum(qd + 0.5 * qdd * step)[:-1]]) * step
    t, q, torque = step * np.arange(n)[::every], q[::every], 2.0 * qdd[::every]
    torque = torque + noise * rng.normal(size=len(t))
    (piece,) = lowpassed([Log("made", Path("made"), "", (Segment(t, step * every, q[:, None], torque[:, None], None, None, {}),))], ("a",), 15.0).pieces
    error = (piece.tau - 2.0 * piece.smoother(piece.qdd, axis=0))[piece.core, 0]
    return error, np.ones(len(error), bool) if piece.use is None else piece.use[piece.core, 0]


@pytest.mark.parametrize("every, seed", [(20, 1), (20, 2), (50, 3), (100, 4)])
def test_a_log_does_not_tell_when_between_two_samples_a_torque_jumped(every, seed):
    """The errors of rows that count are their noise; of the others, far more. Where noise is greater than that, all count."""
    error, counts = moved(every, seed, 0.01)
    low = lambda values: np.sqrt(np.mean(values**2))  # noqa: E731
    usual = 1.4826 * np.median(np.abs(error))
    assert 0.5 < np.mean(counts) < 0.99
    assert low(error[counts]) < 1.5 * usual < 5.0 * usual < low(error[~counts])
    _, counts = moved(every, seed, 10.0)
    assert counts.all()
