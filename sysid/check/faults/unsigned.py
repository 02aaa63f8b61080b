"""Whether a joint's torque was logged without its sign: its size alone, or a current's RMS. It stays
on one side of zero and comes back from it like a mirror's image, and rigid bodies with friction
explain it as the size of what they need, where they do not explain it as it is.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...uncertainty import whitening
from ..fault import ERROR, Fault
from ..look import Look, Seen

AFTER, SENSELESS = 1, ("wrong_unit", "angle_wrap")
_LEAVES = 0.25  # of the squares that it leaves as it is: what it must leave with signs
_ROUNDS = 50


def find(look: Look) -> Iterator[Fault]:
    """sign_flipped, of a torque that has no sign."""
    if look.every is None:
        return
    for j, joint in enumerate(look.robot.joints):
        if look.excited[j].enough and _one_sided(look, j):
            left = mirrored(look.every, j)
            if left < 1.0:
                says = (
                    f"the torque of {joint} looks logged without its sign: it is never on the "
                    f"other side of zero, and with signs rigid bodies and friction leave "
                    f"{100.0 * left:.0f} % of what they leave of it as it is"
                )
                do = (
                    "log it with its sign: no fit can tell friction from gravity without; or "
                    "name the joint in data.unused"
                )
                yield Fault("sign_flipped", ERROR, says, do, joint)


def _one_sided(look: Look, j: int) -> bool:
    """Whether no log has torque on both sides of zero, and any has some."""
    told = [log.column("tau", j) for log in look.logs if log.tally.swing[j] > 0.0]
    low = min((float(tau.min()) for tau in told), default=0.0)
    high = max((float(tau.max()) for tau in told), default=0.0)
    return low >= 0.0 < high or high <= 0.0 > low


def mirrored(seen: Seen, j: int) -> float:
    """The RMS that is left of a joint's torque when it may have either sign at every row, as a share
    of what is left as it is; one where that is no clear matter.

    By turns the signs are those of the fit, and the fit that of the signs; begun at what the URDF's
    bodies need, and at the direction of motion.

    Source: Gerchberg & Saxton 1972 (the same of a Fourier transform).
    """
    use = seen.rows.use[:, j]
    tau = np.abs(seen.rows.tau[use, j])
    columns = seen.columns(j)[use]
    if len(tau) < 4 * columns.shape[1]:
        return 1.0
    basis = columns @ whitening(columns.T @ columns)
    bodies = 10 * seen.model.bodies
    needed = seen.rows.columns[j][use, :bodies] @ seen.model.robot.prior.ravel()
    speed = seen.rows.of(seen.motion, "qd")[use, j]
    plain = float(tau @ tau - np.sum((basis.T @ tau) ** 2))
    least = plain
    for start in (needed, speed):
        signs = np.sign(start)
        for _ in range(_ROUNDS):
            own = np.where(basis @ (basis.T @ (signs * tau)) < 0.0, -1.0, 1.0)
            if np.array_equal(own, signs):
                break
            signs = own
        least = min(least, float(tau @ tau - np.sum((basis.T @ (signs * tau)) ** 2)))
    return float(np.sqrt(max(least, 0.0) / plain)) if least < _LEAVES * plain else 1.0
