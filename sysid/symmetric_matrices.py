"""Symmetric 4 x 4 matrices as ten coordinates, and back."""


import numpy as np

# orthonormal basis of symmetric 4 x 4 matrices: coordinates of a scaled change of a body
BASIS = np.zeros((10, 4, 4))
for _k, (_i, _j) in enumerate(((0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
    BASIS[_k, _i, _j] = BASIS[_k, _j, _i] = 1.0 if _i == _j else np.sqrt(0.5)
_ROWS = BASIS.reshape(10, 16)


def packed(diagonals) -> np.ndarray:
    """Diagonal matrices (bodies, 4) in the basis, (10 bodies,)."""
    out = np.zeros((len(diagonals), 10))
    out[:, :4] = diagonals
    return out.ravel()


def unpacked(vector) -> np.ndarray:
    """Symmetric matrices (bodies, 4, 4) of coordinates (10 bodies,)."""
    return (vector.reshape(-1, 10) @ _ROWS).reshape(-1, 4, 4)


def coordinates(matrices) -> np.ndarray:
    """Symmetric matrices (..., 4, 4) in the orthonormal basis (..., 10)."""
    return matrices.reshape(matrices.shape[:-2] + (16,)) @ _ROWS.T
