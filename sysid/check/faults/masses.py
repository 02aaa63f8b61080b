"""Whether the URDF's links weigh what the torque says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ... import blocks
from ...listed_effects import build
from ...masses import SAYS_CHECK
from ...prior import IMPOSSIBLE
from ...projection import inverted, spanned
from ...robot import Robot
from ...rows import stack
from ..fault import WARNING, Fault
from ..look import Look, Seen

AFTER, SENSELESS = (
    4,
    (
        "wrong_unit",
        "angle_wrap",
        "joint_order",
        "sign_flipped",
        "torque_in_amperes",
        "commanded_torque",
        "effort_missing",
        "mass_implausible",  # as an error: gravity is another
    ),
)
# Times the URDF's: weights of simulated arms with masses and centres drawn about theirs, and of
# five real ones, stand between a quarter and twice these
_WEIGHT = (1.0 / 6.0, 3.0)
_CLEAR = 4.0  # standard errors
_PASSES = 3  # the last two with every joint weighted by what the one before left


def find(look: Look) -> Iterator[Fault]:
    """mass_implausible: by the torque that holds each link, and by a fit of the experiment as it
    is, which says what brings masses back; and inertias of the robot's file that no body has."""
    for told in look.of_the_robot:
        if IMPOSSIBLE in told:
            says, _, do = told.partition("; ")
            yield Fault("mass_implausible", WARNING, says, f"correct the file; as it is, {do}")
    if look.seen is None:
        return
    weights = weighed(look.seen)
    far = {} if look.fit is None else look.fit.masses
    cured = {link["link"] for link in far["far"]} if far.get("effect") else set()
    clear = weights.misfit > 1.0  # else other weights, all of them plausible, do as well
    held = set()
    for b, body in enumerate(look.robot.bodies):
        own, se = float(weights.times[b]), float(weights.error[b])
        low, high = own - _CLEAR * se, own + _CLEAR * se
        least, most = weights.plausible[:, b]
        # of a centre of mass on the other side the mass says nothing
        implausible = low > most or (high < least and own > -least)
        if body.kind != "link" or not (clear and implausible):
            continue
        held.add(body.name)
        word = (
            "a payload that the URDF lacks, its mass, or a spring that it hangs on"
            if own > 1.0
            else "its mass, or its centre of mass"
        )
        yield Fault(
            "mass_implausible",
            WARNING,
            (
                f"the link of {body.joint} weighs {own:.2g} +- {se:.1g} times what the "
                "URDF says, by the torque that holds it"
            ),
            far["do"] if body.name in cured else f"check {word}",
            body.joint,
        )
    # where no effect stands for it, what the logs hardly tell of a mass is no fault of theirs
    for link in far.get("far", ()) if cured or clear else ():
        if link["link"] not in held:
            says = (
                f"a fit gives the link of {link['joint']} {link['mass']:.3g} kg, the URDF "
                f"{link['urdf']:.3g} kg"
            )
            do = far["do"].replace(SAYS_CHECK, "")
            yield Fault("mass_implausible", WARNING, says, do, link["joint"])


@dataclass(frozen=True)
class Weights:
    """By how much the torque of each body's weight is what the URDF says, times (bodies,), with its
    standard error and what is plausible (2, bodies).

    misfit: what torque the plausible ones cannot give, over what none can, RMS of the joint with
    the most. Up to 1 what passes for a weight may be misfit as well as the rest of the misfit is.
    """

    times: np.ndarray
    error: np.ndarray
    plausible: np.ndarray
    misfit: float


def weighed(seen: Seen) -> Weights:
    """Least squares of the torque by each body's weight and by the rest of its torque, in factors
    of their own, beside what any joint has; and the same with plausible weights alone."""
    robot, rows, bodies = seen.model.robot, seen.rows, seen.model.bodies
    pieces = tuple(replace(p, qd=0.0 * p.qd, qdd=0.0 * p.qdd) for p in seen.motion.pieces)
    still = stack(build(robot, []), replace(seen.motion, pieces=pieces), seen.stride).columns
    of = lambda columns: np.einsum(
        "jnbk,bk->jnb", columns.reshape(*columns.shape[:2], bodies, 10), robot.prior
    )  # noqa: E731
    weight, whole = of(still), of(rows.columns[:, :, : 10 * bodies])
    a = np.concatenate([weight, whole - weight, rows.columns[:, :, 10 * bodies :]], axis=2)
    count, w = np.maximum(rows.use.sum(0), 1), np.ones(robot.dof)
    for _ in range(_PASSES):
        system = np.einsum("jnk,jnl,j->kl", a, a, w**2, optimize=True)
        inverse = inverted(system)
        asked = np.einsum("jnk,nj,j->k", a, rows.tau * rows.use, w**2, optimize=True)
        x = inverse @ asked
        left = rows.tau - np.einsum("jnk,k->nj", a, x)
        w = 1.0 / np.sqrt((left**2).sum(0) / count + 1e-300)
    number = blocks.numbered(
        rows.t, rows.piece, memory=blocks.memory(left, rows.use, rows.piece, seen.step)
    )
    scores = blocks.summed(number, np.einsum("jnk,nj,j->nk", a, left, w**2, optimize=True))
    error = np.sqrt(np.sum((scores @ inverse) ** 2, axis=0))
    plausible = _plausible(robot, np.sqrt((weight**2).sum(1) / count[:, None]))
    bounds = np.full((2, len(x)), [[-np.inf], [np.inf]])
    bounds[:, :bodies] = plausible
    other = np.einsum("jnk,k->nj", a, x - _bounded(system, asked, bounds))
    misfit = np.sqrt((other**2).sum(0) / np.maximum((left**2).sum(0), 1e-300)).max()
    return Weights(x[:bodies], error[:bodies], plausible, float(misfit))


def _plausible(robot: Robot, torque) -> np.ndarray:
    """The least and the most (2, bodies) that weights may be, over the URDF's; torque (dof, bodies)
    [N m or N] is what they make, RMS.

    A joint feels a weight by its lever alone, so a factor of it may be a centre of mass elsewhere:
    a body's mass is its radius of gyration away from its centre, on the mean, and so far the centre
    may be off. Where the lever is short, as under an upright axis, that is any factor.
    """
    mass, first, second = robot.prior[:, 0], robot.prior[:, 1:4], robot.prior[:, 4:7]
    square = 0.5 * second.sum(1) / mass - (first**2).sum(1) / mass**2
    slides = np.asarray(robot.prismatic)[:, None]  # carries the weight itself, wherever it is
    heavy = mass * np.linalg.norm(robot.gravity) + 1e-300
    lever = np.where(slides, np.where(torque > 0.0, np.inf, 0.0), torque / heavy).max(0)
    moved = np.sqrt(np.maximum(square, 0.0)) / np.maximum(lever, 1e-300)
    return np.array([np.minimum(_WEIGHT[0], 1.0 - moved), np.maximum(_WEIGHT[1], 1.0 + moved)])


def _bounded(system, asked, bounds) -> np.ndarray:
    """Least squares within bounds (2, k), from products (k, k) and (k,)."""
    from scipy.optimize import lsq_linear

    size, values, vectors = spanned(system)
    a = np.sqrt(values)[:, None] * vectors.T
    b = vectors.T @ (asked / size) / np.sqrt(values)
    return lsq_linear(a, b, bounds * size, method="bvls").x / size
