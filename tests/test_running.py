"""Running medians, means and maxima are those of scipy.ndimage."""

import numpy as np
import pytest
from scipy import ndimage

from sysid.running import running

THEIRS = {"median": ndimage.median_filter, "mean": ndimage.uniform_filter1d, "max": ndimage.maximum_filter1d}


@pytest.mark.parametrize("what", THEIRS)
@pytest.mark.parametrize("edges, mode", [("symmetric", "reflect"), ("edge", "nearest")])
@pytest.mark.parametrize("size", [1, 2, 5, 12, 41])
@pytest.mark.parametrize("n", [1, 7, 300])
def test_as_scipy_has_it(what, edges, mode, size, n):
    values = np.round(np.random.default_rng(n + size).normal(size=n), 1)
    np.testing.assert_allclose(running(values, size, what, edges), THEIRS[what](values, size, mode=mode), rtol=0, atol=1e-12)


def test_columns_are_asked_one_by_one():
    values = np.random.default_rng(3).normal(size=(50, 3))
    np.testing.assert_array_equal(running(values, 5, "median"), ndimage.median_filter(values, (5, 1)))
    assert running(np.zeros(0), 5, "max").shape == (0,)
