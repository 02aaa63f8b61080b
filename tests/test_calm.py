"""The noise of the angles neither bends what is asked for the unknown nor stands in its variables."""

import numpy as np
import pytest

from sysid.frequencies import low
from sysid.lowpass import calm
from sysid.projection import told
from sysid.view import Design, instrumented

STEP, N, BAND = 0.01, 4000, 1.2


def _angle(rng) -> np.ndarray:
    t = np.arange(N) * STEP
    waves = [rng.normal() * np.sin(2.0 * np.pi * rng.uniform(0.2, 1.1) * t + rng.uniform(0, 6)) for _ in range(5)]
    return np.sum(waves, axis=0)


def _acceleration(q) -> np.ndarray:
    """As a smooth differentiator gives it: noise of the angle up to a quarter of the rate."""
    from scipy.signal import savgol_filter

    return savgol_filter(q, 11, 4, deriv=2, delta=STEP)


def _design(a, r) -> Design:
    """Of one joint's columns, without a prior."""
    turn = told(a.T @ a, a.T @ a)
    return Design(a[None] @ turn, r[:, None], np.zeros(2), turn, np.zeros((1, N, 2)), np.zeros((N, 1)))


@pytest.mark.parametrize("seed", range(3))
def test_least_squares_leaves_the_motion_and_instruments_do_not(seed):
    """tau = 2 qdd + 5 sin q is all there is; the angle's noise is 2 % of it where it is fast."""
    rng = np.random.default_rng(seed)
    q = _angle(rng)
    noise = 4e-4 * np.gradient(q, STEP) * rng.normal(size=N) + 2e-3 * rng.normal(size=N)
    tau = 2.0 * _acceleration(q) + 5.0 * np.sin(q) + 0.05 * rng.normal(size=N)
    a = np.stack([_acceleration(q + noise), np.sin(q + noise)], axis=1)
    found = np.linalg.lstsq(a, tau, rcond=None)[0]
    r = tau - a @ found
    after = instrumented(_design(a, r), np.ones((N, 1), bool), np.zeros(N, int), BAND, STEP)[0][:, 0]
    true = np.stack([_acceleration(q), np.sin(q)], axis=1)

    def share(rest):
        """Share of a residual's square that the true motion tells."""
        return 1.0 - np.sum((rest - true @ np.linalg.lstsq(true, rest, rcond=None)[0]) ** 2) / np.sum(rest**2)

    assert share(r) > 0.02  # what was bent
    assert share(after) < 0.1 * share(r)


def test_without_noise_the_instruments_change_nothing():
    q = _angle(np.random.default_rng(0))
    a = np.stack([_acceleration(q), np.sin(q)], axis=1)
    tau = a @ [2.0, 5.0]
    r = tau - a @ np.linalg.lstsq(a, tau, rcond=None)[0]
    after, _ = instrumented(_design(a, r), np.ones((N, 1), bool), np.zeros(N, int), BAND, STEP)
    np.testing.assert_allclose(after[:, 0], 0.0, atol=1e-9)


def test_calm_keeps_the_motion_and_not_its_noise():
    rng = np.random.default_rng(1)
    q, noise = _angle(rng), 0.1 * rng.normal(size=N)
    piece = np.repeat([0, 1], N // 2)
    found = calm((q + noise)[:, None], piece, BAND, STEP)[:, 0]
    left = np.std(found - q) / np.std(noise)
    assert left < 1.3 * np.sqrt(3.0 * BAND * 2.0 * STEP)  # the share of the band that is kept
    # pieces know nothing of each other
    alone = calm((q + noise)[: N // 2, None], piece[: N // 2], BAND, STEP)[:, 0]
    np.testing.assert_array_equal(found[: N // 2], alone)
    np.testing.assert_array_equal(calm(q[:, None], piece, 0.0, STEP)[:, 0], q)


def test_low_goes_straight_on_at_the_ends():
    t = np.arange(500) * STEP
    np.testing.assert_allclose(low(3.0 * t + 1.0, 4.0, STEP), 3.0 * t + 1.0, atol=1e-4)
    assert low(t[:10], 4.0, STEP) is not None and np.array_equal(low(t, 60.0, STEP), t)
