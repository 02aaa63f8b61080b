"""Two fits compared over all joints, against sums by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import comparison
from sysid.prediction import Prediction

LOGS = ({"part": "test", "sha256": "a", "start": None, "stop": None},)


def fitted(scale, weights=None):
    """A fit that leaves noise of this size (2,), or at each time (2000, 2), on two joints over twenty seconds."""
    rng, n = np.random.default_rng(2), 2000
    left = rng.normal(size=(n, 2)) * scale
    told = Prediction(np.zeros(n, int), np.arange(n) * 0.01, left, np.zeros((n, 2)), None)
    rms = lambda part: dict(zip(("loud", "quiet"), np.sqrt((left**2).mean(0))))  # noqa: E731, ARG005
    return SimpleNamespace(joints=("loud", "quiet"), logs=LOGS, predictions={"test": told}, weights=weights, rms=rms, experiment=SimpleNamespace(name="made"))


@pytest.mark.parametrize(
    ("weights", "expected"),
    [
        # in N m: the loud joint falls from 2 to 1, the quiet one rises from 0.1 to 0.3
        (None, np.sqrt(0.5 * (1.0 + 0.09)) - np.sqrt(0.5 * (4.0 + 0.01))),
        # each by its own RMS: a quarter, and nine times
        ([0.5, 10.0], np.sqrt(0.5 * (0.25 + 9.0)) - 1.0),
    ],
)
def test_all_joints_together_as_the_fit_weighs_them(weights, expected):
    weights = None if weights is None else np.array(weights)
    found = comparison.together(fitted([2.0, 0.1], weights), fitted([1.0, 0.3]), weighed=True)
    assert found.delta_rms == pytest.approx(expected, rel=0.05)
    assert 0.0 < found.se < 0.2 * abs(found.delta_rms)


def test_all_joints_together_by_what_their_errors_were():
    found = comparison.together(fitted([2.0, 0.1]), fitted([1.0, 0.3]))
    assert found.delta_rms == pytest.approx(np.sqrt(0.5 * (0.25 + 9.0)) - 1.0, rel=0.01)


@pytest.mark.parametrize(("grows", "risen"), [(1e-13, ()), (1e-3, ("loud",))])
def test_rounding_is_no_rise(grows, risen):
    """Everywhere the same share more: the standard error of that is as small as the share."""
    found = comparison.rises(fitted([2.0, 0.1]), fitted(np.array([2.0 * (1 + grows), 0.1])), ["loud"])
    assert tuple(d.joint for d in found) == risen
