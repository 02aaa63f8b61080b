"""Tall rows reduced in parts: as exact as Householder's QR, whatever they are."""

import numpy as np
import pytest

from sysid.reduction import Reduction, triangle


def reduced(rows, sizes=(1000, 4096, 700, 50)):
    """The triangle of rows (n, k) that come in parts of these sizes, time after time."""
    reduction, at, k = Reduction(), 0, 0
    while at < len(rows):
        part = rows[at : at + sizes[k % len(sizes)]]
        reduction.add(np.ascontiguousarray(part.T))
        at, k = at + len(part), k + 1
    assert reduction.rows == len(rows)
    return reduction.triangle()


def ill_conditioned(condition, n=20_000, k=12, seed=0):
    """Rows (n, k) with singular values from one down to 1 / condition, and the directions of these."""
    rng = np.random.default_rng(seed)
    left, _ = np.linalg.qr(rng.normal(size=(n, k)))
    right, _ = np.linalg.qr(rng.normal(size=(k, k)))
    values = np.geomspace(1.0, 1.0 / condition, k)
    return left * values @ right.T, right, values


@pytest.mark.parametrize("condition", [1e2, 1e5, 1e8, 1e11])
def test_weak_directions_have_as_many_digits_as_with_householder(condition):
    rows, right, values = ill_conditioned(condition)
    weak, size = right[:, -1], values[-1]
    error = abs(np.linalg.norm(reduced(rows) @ weak) / size - 1.0)
    theirs = abs(np.linalg.norm(triangle(rows.copy()) @ weak) / size - 1.0)
    assert error < 10.0 * theirs + 10.0 * condition * np.finfo(float).eps
    # the products alone, which the module's docstring speaks of, have lost all but a digit or two at 1e8
    if condition == 1e8:
        square = weak @ (rows.T @ rows) @ weak / size**2
        assert abs(square - 1.0) > 1e-3 and error < 1e-6


def test_parts_of_any_size_make_one_triangle():
    rows, *_ = ill_conditioned(1e4)
    whole = triangle(rows.copy())
    for sizes in ((137,), (20_000,), (5000, 3), (1, 4000)):
        found = reduced(rows, sizes)
        np.testing.assert_allclose(found.T @ found, whole.T @ whole, rtol=0, atol=1e-13)
        x = np.random.default_rng(1).normal(size=11)
        fit = [np.linalg.lstsq(r[:, :-1], r[:, -1], rcond=None)[0] for r in (found, whole)]
        np.testing.assert_allclose(*fit, rtol=1e-9, atol=1e-9 * np.abs(x).max())


def test_columns_that_come_late_or_never():
    """A joint that stands still at first, one that always does, and one that two others make."""
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(30_000, 6))
    rows[:9000, 1] = 0.0
    rows[:, 3] = 0.0
    rows[:, 4] = rows[:, 0] - 2.0 * rows[:, 2]
    found = reduced(rows)
    np.testing.assert_allclose(found.T @ found, rows.T @ rows, rtol=1e-12, atol=1e-8)
    assert np.linalg.norm(found[:, 3]) == 0.0
    assert np.linalg.norm(found @ [1.0, 0, -2.0, 0, -1.0, 0]) < 1e-11 * np.linalg.norm(rows)


def test_few_rows_are_no_more_than_they_are():
    assert reduced(np.ones((3, 5))).shape == (3, 5)
    empty = Reduction()
    empty.add(np.zeros((5, 0)))
    assert empty.triangle().shape == (0, 5)
