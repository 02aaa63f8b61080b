"""Eigenvalues where LAPACK's fast way gives up."""

import numpy as np
import pytest

from sysid import eigen


@pytest.mark.parametrize("shape", [(30, 30), (3, 2, 12, 12)])
def test_what_does_not_converge_is_found_the_slower_way(monkeypatch, shape):
    rng = np.random.default_rng(0)
    half = rng.normal(size=(*shape[:-1], shape[-1] // 2))  # half of the rank
    matrices = half @ np.swapaxes(half, -1, -2)
    values, _ = np.linalg.eigh(matrices)

    def gives_up(matrix):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr(np.linalg, "eigh", gives_up)
    found, vectors = eigen.symmetric(np.tril(matrices) + np.triu(rng.normal(size=shape), 1))  # the lower triangle counts
    np.testing.assert_allclose(found, values, atol=1e-12 * values.max())
    np.testing.assert_allclose(vectors * found[..., None, :] @ np.swapaxes(vectors, -1, -2), matrices, atol=1e-12 * values.max())


def test_what_is_not_finite_has_none():
    with pytest.raises(np.linalg.LinAlgError):
        eigen.symmetric(np.full((3, 3), np.nan))


def test_usually_it_is_numpy():
    matrix = np.diag([3.0, 1.0, 2.0])
    for one, other in zip(eigen.symmetric(matrix), np.linalg.eigh(matrix)):
        np.testing.assert_array_equal(one, other)
