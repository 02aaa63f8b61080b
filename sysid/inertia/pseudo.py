"""The ten inertial parameters of a rigid body and its 4 x 4 pseudo-inertia.

Everywhere in sysid a body is the vector of the paper's eq. 3, about its joint frame,

    pi = [m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Iyz, Ixz]    [kg, kg m, kg m^2],

and J = [[Sigma, h], [h', m]] with Sigma = Tr(I)/2 1 - I (eq. 6). The map between the two is linear; a
body is physically possible exactly when J is positive definite. Pinocchio orders the same ten numbers
differently; `to_pinocchio` and `from_pinocchio` are the only places that know it.

All functions take any number of leading axes.

Source: Rucker & Wensing 2022, "Smooth Parameterization of Rigid-Body Inertia"; Wensing, Kim & Slotine 2018.
"""

import numpy as np

PARAMETERS = ("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Ixz")
UNITS = ("kg",) + ("kg m",) * 3 + ("kg m^2",) * 6

# pinocchio.Inertia.toDynamicParameters: m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz
_PINOCCHIO_FROM_PAPER = np.array([0, 1, 2, 3, 4, 7, 5, 9, 8, 6])
_PAPER_FROM_PINOCCHIO = np.argsort(_PINOCCHIO_FROM_PAPER)


def _pseudo_basis() -> np.ndarray:
    basis = np.zeros((10, 4, 4))
    basis[0, 3, 3] = 1.0
    for axis in range(3):
        basis[1 + axis, axis, 3] = basis[1 + axis, 3, axis] = 1.0
        basis[4 + axis, range(3), range(3)] = 0.5
        basis[4 + axis, axis, axis] = -0.5
    for k, (i, j) in zip((7, 8, 9), ((0, 1), (1, 2), (0, 2))):
        basis[k, i, j] = basis[k, j, i] = -1.0
    return basis


def _parameter_basis() -> np.ndarray:
    """P with pi_k = <P_k, J>, every P_k symmetric."""
    basis = np.zeros((10, 4, 4))
    basis[0, 3, 3] = 1.0
    for axis in range(3):
        basis[1 + axis, axis, 3] = basis[1 + axis, 3, axis] = 0.5
        basis[4 + axis, range(3), range(3)] = 1.0
        basis[4 + axis, axis, axis] = 0.0
    for k, (i, j) in zip((7, 8, 9), ((0, 1), (1, 2), (0, 2))):
        basis[k, i, j] = basis[k, j, i] = -0.5
    return basis


PSEUDO_BASIS = _pseudo_basis()  # (10, 4, 4): J = sum_k pi_k PSEUDO_BASIS[k]
PARAMETER_BASIS = _parameter_basis()  # (10, 4, 4): pi_k = <PARAMETER_BASIS[k], J>
PSEUDO_BASIS.setflags(write=False)
PARAMETER_BASIS.setflags(write=False)
_PSEUDO_ROWS = PSEUDO_BASIS.reshape(10, 16)
_PARAMETER_COLUMNS = PARAMETER_BASIS.reshape(10, 16).T.copy()


def to_pseudo(pi) -> np.ndarray:
    """Pseudo-inertia matrices (..., 4, 4) of parameters (..., 10) (eq. 6)."""
    pi = np.asarray(pi)
    return (pi @ _PSEUDO_ROWS).reshape(pi.shape[:-1] + (4, 4))


def from_pseudo(pseudo) -> np.ndarray:
    """Parameters (..., 10) of symmetric pseudo-inertia matrices (..., 4, 4)."""
    pseudo = np.asarray(pseudo)
    return pseudo.reshape(pseudo.shape[:-2] + (16,)) @ _PARAMETER_COLUMNS


def dual(gradient) -> np.ndarray:
    """Symmetric matrices G (..., 4, 4) with <G, J> = gradient . pi for gradients (..., 10)."""
    gradient = np.asarray(gradient)
    return (gradient @ PARAMETER_BASIS.reshape(10, 16)).reshape(gradient.shape[:-1] + (4, 4))


def to_pinocchio(pi) -> np.ndarray:
    """The same numbers in the order of pinocchio.Inertia.toDynamicParameters."""
    return np.asarray(pi)[..., _PINOCCHIO_FROM_PAPER]


def from_pinocchio(dynamic_parameters) -> np.ndarray:
    """The paper's order from that of pinocchio.Inertia.toDynamicParameters."""
    return np.asarray(dynamic_parameters)[..., _PAPER_FROM_PINOCCHIO]


def rotational_inertia(pi) -> np.ndarray:
    """Rotational inertia about the frame's origin (..., 3, 3) [kg m^2]."""
    pi = np.asarray(pi)
    xx, yy, zz, xy, yz, xz = np.moveaxis(pi[..., 4:], -1, 0)
    return np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(pi.shape[:-1] + (3, 3))


def from_central(mass, com, inertia) -> np.ndarray:
    """Parameters (..., 10) from mass [kg], centre of mass (..., 3) [m] and inertia about it (..., 3, 3) [kg m^2]."""
    mass, com, inertia = (np.asarray(a, dtype=float) for a in (mass, com, inertia))
    sigma = 0.5 * np.trace(inertia, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - inertia
    sigma = sigma + mass[..., None, None] * com[..., :, None] * com[..., None, :]
    pseudo = np.zeros(sigma.shape[:-2] + (4, 4))
    pseudo[..., :3, :3] = sigma
    pseudo[..., :3, 3] = pseudo[..., 3, :3] = mass[..., None] * com
    pseudo[..., 3, 3] = mass
    return from_pseudo(pseudo)


def to_central(pi) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, centre of mass and rotational inertia about it, of parameters (..., 10) with m > 0."""
    pi = np.asarray(pi, dtype=float)
    mass, h = pi[..., 0], pi[..., 1:4]
    com = h / mass[..., None]
    parallel = np.sum(h * com, -1)[..., None, None] * np.eye(3) - h[..., :, None] * com[..., None, :]
    return mass, com, rotational_inertia(pi) - parallel


def box(mass: float, com, edges) -> np.ndarray:
    """Parameters (10,) of a uniform box: mass [kg], centre of mass [m], edge lengths along x, y, z [m]."""
    squares = np.asarray(edges, dtype=float) ** 2
    return from_central(mass, com, mass / 12.0 * np.diag(squares.sum() - squares))


def cylinder(mass: float, com, radius: float, length: float) -> np.ndarray:
    """Parameters (10,) of a uniform cylinder along z: mass [kg], centre of mass, radius, length [m]."""
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    return from_central(mass, com, np.diag([across, across, 0.5 * mass * radius**2]))


def sphere(mass: float, com, radius: float) -> np.ndarray:
    """Parameters (10,) of a uniform sphere: mass [kg], centre of mass, radius [m]."""
    return from_central(mass, com, 0.4 * mass * radius**2 * np.eye(3))


def displaced(pi, rotation, translation) -> np.ndarray:
    """The same bodies seen from another frame: x_new = rotation x + translation, J_new = T J T'."""
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation
    return from_pseudo(transform @ to_pseudo(pi) @ transform.T)
