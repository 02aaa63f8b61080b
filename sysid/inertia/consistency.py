"""Is a body physically possible? Two tests that must agree: J > 0, and Theorem II.1 of the paper."""

import numpy as np

from .pseudo import rotational_inertia, to_pseudo


def is_consistent(pi) -> np.ndarray:
    """Full physical consistency by the pseudo-inertia: J(pi) positive definite. (..., 10) -> (...)."""
    pi = np.asarray(pi, dtype=float)
    finite = np.isfinite(pi).all(-1)
    smallest = np.linalg.eigvalsh(to_pseudo(np.where(finite[..., None], pi, 0.0)))[..., 0]
    return finite & (smallest > 0.0)


def violations(pi) -> dict[str, np.ndarray]:
    """The conditions of Theorem II.1 about the centre of mass, one by one. (..., 10) -> each (...).

    Returns `mass` [kg], `smallest_moment` [kg m^2] (smallest principal moment) and `triangle` [kg m^2]
    (the least of Dy + Dz - Dx and its like). All three are positive exactly for a possible body.

    The theorem's moments are taken about the centre of mass: about another origin the same three
    conditions are necessary but miss bodies whose h is too large for their inertia, as J > 0 does not.
    """
    pi = np.asarray(pi, dtype=float)
    mass, h = pi[..., 0], pi[..., 1:4]
    safe = np.where(mass == 0.0, 1.0, mass)[..., None, None]
    central = rotational_inertia(pi) - (
        np.sum(h * h, -1)[..., None, None] * np.eye(3) - h[..., :, None] * h[..., None, :]
    ) / safe
    moments = np.linalg.eigvalsh(central)
    return {
        "mass": mass,
        "smallest_moment": moments[..., 0],
        "triangle": moments[..., 0] + moments[..., 1] - moments[..., 2],
    }


def satisfies_theorem(pi) -> np.ndarray:
    """Theorem II.1: m > 0, moments positive, triangle inequalities. (..., 10) -> (...)."""
    found = violations(pi)
    return (found["mass"] > 0) & (found["smallest_moment"] > 0) & (found["triangle"] > 0)
