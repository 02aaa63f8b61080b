"""The eigenvalue parameterization (paper, III): principal second moments and a rotation.

It is singular wherever two second moments agree: there a turn about the third axis changes nothing, and
det(d pi / d phi) has the factors Lx - Ly, Ly - Lz, Lx - Lz (III-A).
"""

import numpy as np

from .parameterization import Parameterization
from .pseudo import dual, from_pseudo, to_pseudo

_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k], _LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0
_SKEW = -_LEVI_CIVITA  # S(x) = sum_i x_i _SKEW[i], S(x) y = x cross y


def _rotation_functions(square):
    """a = sin(t)/t and b = (1 - cos t)/t^2 with their first two derivatives in s = t^2."""
    small = square < 0.25
    s = np.where(small, 1.0, square)
    t = np.sqrt(s)
    a, b = np.sin(t) / t, (1.0 - np.cos(t)) / s
    a1 = (np.cos(t) - a) / (2.0 * s)
    b1 = (a - 2.0 * b) / (2.0 * s)
    a2 = (-0.5 * a - 3.0 * a1) / (2.0 * s)
    b2 = (a1 - 4.0 * b1) / (2.0 * s)
    # series: a = sum (-s)^k / (2k+1)!, b = sum (-s)^k / (2k+2)!
    series = [np.zeros_like(s) for _ in range(6)]
    factorial = 1.0
    x = np.where(small, square, 0.0)
    for k in range(10):
        for offset, divisor in ((0, factorial), (3, factorial * (2 * k + 2))):
            sign = (-1.0) ** k
            series[offset] += sign * x**k / divisor
            if k >= 1:
                series[offset + 1] += sign * k * x ** (k - 1) / divisor
            if k >= 2:
                series[offset + 2] += sign * k * (k - 1) * x ** (k - 2) / divisor
        factorial *= (2 * k + 2) * (2 * k + 3)
    return [np.where(small, q, p) for p, q in zip((a, a1, a2, b, b1, b2), series)]


def rotation(beta) -> np.ndarray:
    """exp(S(beta)) (..., 3, 3) for exponential coordinates (..., 3)."""
    return _rotation_derivatives(beta)[0]


def _rotation_derivatives(beta):
    """R, dR/dbeta_i (..., 3, 3, 3) and d2R/dbeta_i dbeta_j (..., 3, 3, 3, 3); derivative indices first."""
    beta = np.asarray(beta, dtype=float)
    a, a1, a2, b, b1, b2 = (f[..., None, None] for f in _rotation_functions(np.sum(beta**2, -1)))
    skew = np.einsum("...i,ijk->...jk", beta, _SKEW)
    square = skew @ skew
    value = np.eye(3) + a * skew + b * square
    mixed = np.einsum("ijk,...kl->...ijl", _SKEW, skew)
    mixed = mixed + np.einsum("...jk,ikl->...ijl", skew, _SKEW)  # d(S^2)/dbeta_i
    x = beta[..., :, None, None]
    low = lambda f: f[..., None, :, :]  # noqa: E731 - one axis for the derivative index
    s_, q_ = low(skew), low(square)
    first = 2 * x * (low(a1) * s_ + low(b1) * q_) + low(a) * _SKEW + low(b) * mixed
    pair = np.einsum("iab,jbc->ijac", _SKEW, _SKEW)
    pair = pair + np.swapaxes(pair, 0, 1)
    xi, xj = beta[..., :, None, None, None], beta[..., None, :, None, None]
    two = lambda f: f[..., None, None, :, :]  # noqa: E731
    identity = np.eye(3)[:, :, None, None]
    second = (
        (4 * xi * xj) * (two(a2) * two(skew) + two(b2) * two(square))
        + 2 * identity * (two(a1) * two(skew) + two(b1) * two(square))
        + 2 * xi * (two(a1) * _SKEW[None, :] + two(b1) * mixed[..., None, :, :, :])
        + 2 * xj * (two(a1) * _SKEW[:, None] + two(b1) * mixed[..., :, None, :, :])
        + two(b) * pair
    )
    return value, first, second


def rotation_vector(matrix) -> np.ndarray:
    """Exponential coordinates (..., 3), of length at most pi, of rotations (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    matrix = np.asarray(matrix, dtype=float)
    return Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_rotvec().reshape(matrix.shape[:-2] + (3,))


class Eigenvalue(Parameterization):
    """phi = [log m, c, beta, log Lx, log Ly, log Lz]: mass, centre of mass [m], R = exp(S(beta)), second moments.

    The paper leaves m > 0 and L > 0 as constraints; their logarithms make the search unconstrained. The
    second moments are those about the centre of mass, Sigma = R diag(L) R' + m c c'.
    """

    name = "eigenvalue"
    coordinates = ("log_m", "cx", "cy", "cz", "beta1", "beta2", "beta3", "log_Lx", "log_Ly", "log_Lz")

    def parameters(self, theta):
        theta = np.asarray(theta, dtype=float)
        turn = rotation(theta[..., 4:7])
        return self._assemble(
            np.exp(theta[..., 0]),
            theta[..., 1:4],
            (turn * np.exp(theta[..., None, 7:])) @ np.swapaxes(turn, -1, -2),
        )

    @staticmethod
    def _assemble(mass, com, central):
        mass = mass[..., None]
        pseudo = np.empty(com.shape[:-1] + (4, 4))
        pseudo[..., :3, :3] = central + mass[..., None] * com[..., :, None] * com[..., None, :]
        pseudo[..., :3, 3] = pseudo[..., 3, :3] = mass * com
        pseudo[..., 3, 3] = mass[..., 0]
        return from_pseudo(pseudo)

    def inverse(self, pi):
        pseudo = to_pseudo(pi)
        mass = pseudo[..., 3, 3]
        com = pseudo[..., :3, 3] / mass[..., None]
        central = pseudo[..., :3, :3] - mass[..., None, None] * com[..., :, None] * com[..., None, :]
        moments, axes = np.linalg.eigh(central)
        if np.any(moments <= 0.0) or np.any(mass <= 0.0):
            raise np.linalg.LinAlgError("pseudo-inertia is not positive definite")
        axes[..., 0] *= np.sign(np.linalg.det(axes))[..., None]
        return np.concatenate([np.log(mass)[..., None], com, rotation_vector(axes), np.log(moments)], -1)

    def jacobian(self, theta):
        # every pi_k is <P_k, J>: one derivative of J for each coordinate
        derivative = self._pseudo_derivatives(np.asarray(theta, dtype=float))
        return np.swapaxes(from_pseudo(derivative), -1, -2)

    def _pseudo_derivatives(self, theta):
        mass, com, moments = np.exp(theta[..., 0]), theta[..., 1:4], np.exp(theta[..., 7:])
        turn, turn1, _ = _rotation_derivatives(theta[..., 4:7])
        point = np.concatenate([com, np.ones(com.shape[:-1] + (1,))], -1)
        out = np.zeros(theta.shape[:-1] + (10, 4, 4))
        m = mass[..., None, None]
        out[..., 0, :, :] = m * point[..., :, None] * point[..., None, :]
        for i in range(3):
            step = np.zeros(4)
            step[i] = 1.0
            half = m * step[:, None] * point[..., None, :]
            out[..., 1 + i, :, :] = half + np.swapaxes(half, -1, -2)
            half = (turn1[..., i, :, :] * moments[..., None, :]) @ np.swapaxes(turn, -1, -2)
            out[..., 4 + i, :3, :3] = half + np.swapaxes(half, -1, -2)
            axis = turn[..., :, i]
            out[..., 7 + i, :3, :3] = moments[..., i, None, None] * axis[..., :, None] * axis[..., None, :]
        return out

    def hessian(self, theta, gradient):
        theta = np.asarray(theta, dtype=float)
        pull = dual(gradient)
        mass, com, moments = np.exp(theta[..., 0]), theta[..., 1:4], np.exp(theta[..., 7:])
        turn, turn1, turn2 = _rotation_derivatives(theta[..., 4:7])
        point = np.concatenate([com, np.ones(com.shape[:-1] + (1,))], -1)
        block = pull[..., :3, :3]
        out = np.zeros(theta.shape[:-1] + (10, 10))
        force = (pull @ point[..., None])[..., 0]
        out[..., 0, 0] = mass * np.sum(point * force, -1)
        out[..., 0, 1:4] = out[..., 1:4, 0] = 2.0 * mass[..., None] * force[..., :3]
        out[..., 1:4, 1:4] = 2.0 * mass[..., None, None] * block
        # <G, R L R'> in beta and log L
        gl = moments[..., None, :]
        image = block @ turn * gl  # G R L
        cross = np.einsum("...iab,...ac,...jcd,...bd->...ij", turn1, block, turn1, _diagonal(moments), optimize=True)
        out[..., 4:7, 4:7] = 2.0 * (cross + np.einsum("...ijab,...ab->...ij", turn2, image))
        mixed = 2.0 * np.einsum("...iab,...ab->...ib", turn1, image)
        out[..., 4:7, 7:] = mixed
        out[..., 7:, 4:7] = np.swapaxes(mixed, -1, -2)
        diagonal = np.arange(7, 10)
        out[..., diagonal, diagonal] = np.einsum("...ab,...ab->...b", turn, image)
        return out


def _diagonal(values):
    return values[..., :, None] * np.eye(values.shape[-1])
