"""Whether the URDF's links weigh what the torque says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ... import blocks
from ...model import build
from ...projection import inverted
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
    ),
)
# Times the URDF's: weights of simulated arms with masses and centres drawn about theirs, and of
# five real ones, stand between a quarter and twice these
_WEIGHT = (1.0 / 6.0, 3.0)
_CLEAR = 4.0  # standard errors
_FELT = 0.1  # of a joint's torque, RMS: a weight that is less says nothing
_PASSES = 3  # the last two with every joint weighted by what the one before left


def find(look: Look) -> Iterator[Fault]:
    """mass_implausible: by the torque that holds each link, and by a fit of the experiment as it
    is, which says what brings masses back."""
    if look.seen is None:
        return
    times, error, felt = weights(look.seen)
    far = {} if look.fit is None else look.fit.masses
    cured = {link["link"] for link in far["far"]} if far.get("effect") else set()
    held = set()
    for b, body in enumerate(look.robot.bodies):
        own, se = float(times[b]), float(error[b])
        low, high = own - _CLEAR * se, own + _CLEAR * se
        # of a centre of mass on the other side the mass says nothing
        implausible = low > _WEIGHT[1] or (high < _WEIGHT[0] and own > -_WEIGHT[0])
        if body.kind != "link" or felt[b] < _FELT or not implausible:
            continue
        held.add(body.name)
        word = (
            "a payload that the URDF lacks, or its mass"
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
    for link in far.get("far", ()):
        if link["link"] not in held:
            says = (
                f"a fit gives the link of {link['joint']} {link['mass']:.3g} kg, the URDF "
                f"{link['urdf']:.3g} kg"
            )
            yield Fault("mass_implausible", WARNING, says, far["do"], link["joint"])


def weights(seen: Seen) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """By how much the torque of each body's weight (bodies,) is what the URDF says, its standard
    error, and the greatest share of a joint's torque that this weight makes, by the URDF or by the
    logs.

    Least squares of the torque by each body's weight and by the rest of its torque, in factors of
    their own, beside what any joint has.
    """
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
        x = inverse @ np.einsum("jnk,nj,j->k", a, rows.tau * rows.use, w**2, optimize=True)
        left = rows.tau - np.einsum("jnk,k->nj", a, x)
        w = 1.0 / np.sqrt((left**2).sum(0) / count + 1e-300)
    number = blocks.numbered(
        rows.t, rows.piece, memory=blocks.memory(left, rows.use, rows.piece, seen.step)
    )
    scores = blocks.summed(number, np.einsum("jnk,nj,j->nk", a, left, w**2, optimize=True))
    error = np.sqrt(np.sum((scores @ inverse) ** 2, axis=0))
    rms = lambda values: np.sqrt((values**2).sum(1) / count[:, None])  # noqa: E731
    torque = np.sqrt((rows.tau**2).sum(0) / count + 1e-300)
    felt = (rms(weight) / torque[:, None]).max(axis=0)
    return x[:bodies], error[:bodies], felt * np.maximum(1.0, np.abs(x[:bodies]))
