"""Two nonnegative coefficients, against SciPy's."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from sysid.nonnegative import least_squares


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_as_scipy(seed, first, second):
    rng = np.random.default_rng(seed)
    columns = np.abs(rng.normal(size=(30, 2)))
    values = columns @ [first, second] + 0.3 * rng.normal(size=30)
    found, wanted = least_squares(columns, values), nnls(columns, values)[0]
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_a_column_of_zeros_has_none():
    columns = np.stack([np.ones(5), np.zeros(5)], axis=1)
    np.testing.assert_allclose(least_squares(columns, 2.0 * np.ones(5)), [2.0, 0.0])
    np.testing.assert_allclose(least_squares(columns, -2.0 * np.ones(5)), [0.0, 0.0])
