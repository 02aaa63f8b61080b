"""Random bodies, the wrenches that move them, and what is measured of it."""

import numpy as np

from ..inertia import is_consistent
from ..inertia.eigenvalue import rotation
from ..inertia.pseudo import from_central
from ..regressor import BodyMotion, wrench_columns

IDENTITY = np.array([1.0, 0, 0, 0, 1.0, 1.0, 1.0, 0, 0, 0])  # the start: unit mass, unit inertia


_STEP, _END = 0.1, 2.0 * np.pi  # s


def draw(rng: np.random.Generator, about: str) -> np.ndarray:
    """One body of Table I: parameters (10,)."""
    while True:
        mass, com, moments = rng.uniform(0.01, 1.0), rng.uniform(-0.5, 0.5, 3), rng.uniform(0.01, 1.0, 3)
        direction = rng.normal(size=3)
        beta = 2.0 * np.pi * rng.uniform() ** (1 / 3) * direction / np.linalg.norm(direction)  # uniform in the ball
        turn = rotation(beta)
        sigma = (turn * moments) @ turn.T
        if about == "origin":
            sigma = sigma - mass * np.outer(com, com)
        pi = from_central(mass, com, np.trace(sigma) * np.eye(3) - sigma)
        if is_consistent(pi):
            return pi


def wrench(t, kind: str) -> np.ndarray:
    """Moment and force (6, n) at times t (n,) [N m, N]."""
    phases, load = _components(kind)
    return load[:, None] * np.sin(np.asarray(t)[None, :] + phases[:, None])


def _components(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Phases and amplitudes (6,) of moment and force."""
    if kind == "moment and force":
        return np.arange(6) * np.pi / 3.0, np.ones(6)
    return np.tile(np.arange(3) * np.pi / 3.0, 2), np.repeat([0.0, 1.0], 3)


def columns(velocity, acceleration) -> np.ndarray:
    """Y (6, 10, n) with moment and force = Y pi, for velocities (w, v) (6, n) and their derivatives (6, n)."""
    w, v = velocity[:3], velocity[3:]
    # the classical acceleration of the origin, seen from the turning body
    a = acceleration[3:] + np.cross(w, v, axis=0)
    motion = BodyMotion(w, acceleration[:3], a, {})
    out = np.empty((6, 10, velocity.shape[1]))
    for axis in range(3):
        unit, zero = np.zeros_like(w), np.zeros_like(w)
        unit[axis] = 1.0
        wrench_columns(motion, zero, unit, out[axis])
        wrench_columns(motion, unit, zero, out[3 + axis])
    return out


def measured(pi, rng: np.random.Generator, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Simulate a body from rest and discretize its noisy velocities: rows (6 n, 10) and wrenches (6 n,)."""
    from scipy.integrate import solve_ivp

    unit = np.zeros((6, 6))
    for k in range(6):
        acceleration = np.zeros((6, 1))
        acceleration[k] = 1.0
        unit[:, k] = np.einsum("rkn,k->r", columns(np.zeros((6, 1)), acceleration), pi)
    inverse = np.linalg.inv(unit)
    phases, load = _components(kind)

    def slope(t, state):
        # eq. 12: I xi' = w - xi x* I xi, with I the 6 x 6 spatial inertia
        momentum = unit @ state
        (w1, w2, w3), (v1, v2, v3) = state[:3], state[3:]
        (l1, l2, l3), (p1, p2, p3) = momentum[:3], momentum[3:]
        drift = np.array([
            w2 * l3 - w3 * l2 + v2 * p3 - v3 * p2, w3 * l1 - w1 * l3 + v3 * p1 - v1 * p3, w1 * l2 - w2 * l1 + v1 * p2 - v2 * p1,
            w2 * p3 - w3 * p2, w3 * p1 - w1 * p3, w1 * p2 - w2 * p1,
        ])  # fmt: skip
        return inverse @ (np.sin(t + phases) * load - drift)

    t = _STEP * np.arange(int(_END / _STEP) + 1)
    clean = solve_ivp(slope, (0.0, t[-1]), np.zeros(6), t_eval=t, method="DOP853", rtol=1e-9, atol=1e-11).y
    noisy = clean + rng.uniform(0.1 - 0.025, 0.1 + 0.025, clean.shape)
    middle, change = 0.5 * (noisy[:, 1:] + noisy[:, :-1]), np.diff(noisy, axis=1) / _STEP
    y = columns(middle, change)
    return np.moveaxis(y, 2, 0).reshape(-1, 10), wrench(t[:-1] + 0.5 * _STEP, kind).T.ravel()
