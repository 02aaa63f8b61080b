"""What a body is believed to be before any data: the URDF's inertia, made usable where it is not.

The prior must be physically possible, or no divergence from it exists. A URDF that states nothing, zero or
the impossible gets the nearest usable thing, in this order, and a warning that says which:
the same mass and centre of mass with its second moments raised to be positive; the uniform solid of its
primitive shapes; a ball. A stated mass is kept in all of them.
"""

import numpy as np

from .inertia import pseudo
from .inertia.consistency import is_consistent
from .warned import warn

# A second moment below this share of the body's mean one is no thickness that a link has (a 1 : 30 sheet).
_THINNEST = 1e-3
# kg, and of a radius of gyration m^2 (a micrometre): no body of a robot has less, and squares of much less are zero
LIGHTEST = _SMALLEST = 1e-12
IMPOSSIBLE = "has an impossible inertia"
_DEFAULT_MASS = 1.0  # kg, where no other body of the robot states one


def usable(name: str, stated: np.ndarray | None, geometry: np.ndarray | None, reach: np.ndarray, typical_mass: float | None, *, light: bool = False):
    """A possible prior body (10,) about its joint frame.

    Args:
        name: the body's name, for the warning.
        stated: what the URDF's inertials add up to (10,), or None where it states none.
        geometry: uniform solid of its primitive shapes (10,), or None.
        reach: (3,) [m], from its joint's frame to the farthest next joint; zero for a last link.
        typical_mass: median mass [kg] of the robot's usable bodies, or None.
        light: that it is not stated as no link of the robot's file weighs a gram.
    """
    if stated is not None and not stated[0] == 0.0 and abs(stated[0]) < LIGHTEST:
        stated = None
    if stated is not None and is_consistent(stated) and _well_conditioned(stated):
        return stated
    mass = float(stated[0]) if stated is not None and stated[0] > 0.0 else None
    problem = "states no inertia" if stated is None or not np.any(stated) else IMPOSSIBLE
    problem = "weighs next to nothing, as all links do," if light else problem
    if mass is not None and (raised := _raised(stated)) is not None:
        _tell(name, problem, "its mass and centre of mass are kept and its second moments raised to be positive")
        return raised
    if geometry is not None and is_consistent(geometry):
        solid = geometry if mass is None else geometry * (mass / geometry[0])
        _tell(
            name,
            problem,
            f"the prior is the uniform solid of its shapes, {solid[0]:.3g} kg ({'at 1000 kg/m^3' if mass is None else 'its mass is kept'})",
        )
        return solid
    radius = max(0.5 * float(np.linalg.norm(reach)), 0.05)
    if mass is not None:
        _tell(name, problem, f"the prior is a ball of {mass:.3g} kg and radius {radius:.3g} m at its centre of mass")
        return pseudo.sphere(mass, stated[1:4] / mass, radius)
    mass = typical_mass or _DEFAULT_MASS
    _tell(name, problem, f"the prior is a ball of {mass:.3g} kg and radius {radius:.3g} m midway to the next joint")
    return pseudo.sphere(mass, 0.5 * np.asarray(reach), radius)


def wider(pi, radius: float) -> bool:
    """Whether the radius of gyration of a body (10,) of some mass is greater than a radius [m]."""
    return bool(pi[0] >= LIGHTEST and np.sqrt(np.abs(_moments(pi)).max() / pi[0]) > radius)


def measurable(pi) -> bool:
    """Whether a possible body (10,) has a mass and a size that double precision can square."""
    return bool(pi[0] >= LIGHTEST and _moments(pi).max() > _SMALLEST * pi[0])


def _moments(pi) -> np.ndarray:
    """(3,) principal second moments [kg m^2] about the centre of mass."""
    _, _, central = pseudo.to_central(pi)
    return 0.5 * np.trace(central) - np.linalg.eigvalsh(central)


def _well_conditioned(pi) -> bool:
    moments = _moments(pi)
    return bool(moments.min() > 1e-9 * moments.max()) and measurable(pi)


def _raised(pi) -> np.ndarray | None:
    mass, com, central = pseudo.to_central(pi)
    values, axes = np.linalg.eigh(0.5 * np.trace(central) * np.eye(3) - central)
    mean = np.clip(values, 0.0, None).mean()
    if not mean > _SMALLEST * mass:
        return None
    values = np.maximum(values, _THINNEST * mean)
    sigma = (axes * values) @ axes.T
    return pseudo.from_central(mass, com, np.trace(sigma) * np.eye(3) - sigma)


def _tell(name: str, problem: str, remedy: str) -> None:
    warn(f"body {name!r} {problem} in the URDF; {remedy}", above=2)
