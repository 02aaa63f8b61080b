"""Eigenvalues of symmetric matrices, found whatever their rank.

LAPACK divides and conquers, which is fast, and for a few matrices that lack a good part of their rank does not converge. QR
iteration is slower and does.
"""

from __future__ import annotations

import numpy as np


def symmetric(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (..., k), ascending, and eigenvectors (..., k, k) of symmetric matrices, of which the lower triangle counts.

    Raises:
        numpy.linalg.LinAlgError: they are not finite.
    """
    try:
        return np.linalg.eigh(matrices)
    except np.linalg.LinAlgError:
        if not np.isfinite(matrices).all():
            raise
    from scipy.linalg import eigh

    k = matrices.shape[-1]
    found = [eigh(one, driver="ev") for one in matrices.reshape(-1, k, k)]
    values, vectors = (np.stack(part) for part in zip(*found))
    return values.reshape(matrices.shape[:-1]), vectors.reshape(matrices.shape)
