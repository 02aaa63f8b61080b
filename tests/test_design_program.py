"""The best step within many limits, found within few of them, is the best within all."""

import numpy as np
import pytest
from scipy.optimize import linprog

from sysid.design import linear_program

_PRICE = 1e4


def _posed(rng, count, size):
    """Limits along a smooth motion, as a design has them: |share + slopes d| <= 1 of two quantities."""
    t = np.linspace(0.0, 1.0, count)
    waves = np.stack([np.sin(2.0 * np.pi * (k + 1) * t + rng.uniform(0.0, 6.0)) for k in range(size)], axis=1)
    shares = [waves @ rng.normal(0.0, 0.25, size), waves @ rng.normal(0.0, 0.25, size)]
    slopes = [waves, waves * np.arange(1, size + 1) * 0.3]
    return shares, slopes


def _whole(slope, shares, slopes, radius):
    """The same by interior points with every limit at once."""
    rows = np.concatenate([sign * own for own in slopes for sign in (1.0, -1.0)])
    most = np.concatenate([1.0 - sign * own for own in shares for sign in (1.0, -1.0)])
    matrix = np.column_stack([rows, -np.ones(len(rows))])
    bounds = [(-radius, radius)] * len(slope) + [(0.0, None)]
    return linprog(np.append(-slope, _PRICE), A_ub=matrix, b_ub=most, bounds=bounds, method="highs-ipm")


@pytest.mark.parametrize("radius", [0.01, 0.1, 0.5, 5.0])
@pytest.mark.parametrize("seed", range(5))
def test_few_limits_give_the_step_of_all(seed, radius):
    rng = np.random.default_rng(seed)
    shares, slopes = _posed(rng, 400, 9)
    first = np.zeros(0, dtype=int)
    for _ in range(3):  # from nothing, then from what another step has touched
        slope = rng.normal(size=9)
        told = _whole(slope, shares, slopes, radius)
        limits = [one for share, own in zip(shares, slopes) for one in linear_program.both(share, own)]
        step = linear_program.best(slope, limits, radius=radius, price=_PRICE, first=first)
        assert step.gain == pytest.approx(-told.fun, rel=1e-6, abs=1e-6)
        np.testing.assert_allclose(step.change, told.x[:-1], atol=1e-5 * max(radius, 1.0))
        first = step.touched


def test_a_step_without_limits_goes_as_far_as_it_may():
    limits = list(linear_program.both(np.zeros(3), 1e-3 * np.ones((3, 2))))
    step = linear_program.best(np.array([2.0, -1.0]), limits, radius=0.5, price=_PRICE, first=[])
    np.testing.assert_allclose(step.change, [0.5, -0.5])
    assert step.gain == pytest.approx(1.5) and not len(step.touched)
