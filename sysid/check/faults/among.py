"""Whether a joint's torque has in one log the sign that it has in the others: what the same bodies
and friction leave of all logs says so, however far the URDF's are from them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..fault import ERROR, Fault
from ..look import Look, Seen

AFTER, SENSELESS = 2, ("wrong_unit", "angle_wrap")
# What other signs must leave of the squares that the logs' own do, and the other way round of each
# log that they turn: a factor of two in what is left.
_LEAVES = 0.25
_ROUNDS = 20
_FRICTION = (("coulomb", True), ("viscous", True))  # of the joint itself


def find(look: Look) -> Iterator[Fault]:
    """sign_flipped, of single logs."""
    if len(look.logs) < 2 or look.every is None:
        return
    for j, joint in enumerate(look.robot.joints):
        if not look.excited[j].enough:
            continue
        numbers, left = turned(look.every, j, len(look.logs))
        for log in (look.logs[k] for k in numbers):
            says = (
                f"the torque of {joint} has in {log.path.name} the sign against that of the other "
                f"logs: turned there, the same bodies and friction leave {100.0 * left:.0f} % of "
                "what they leave of it as it is"
            )
            do = "log it with the other sign, turn that file's column, or leave the file out"
            yield Fault("sign_flipped", ERROR, says, do, joint, log.path.name)


def turned(seen: Seen, j: int, count: int) -> tuple[list[int], float]:
    """Which of `count` logs have a joint's torque with the sign against the others', and the RMS
    that is left with these turned, as a share of what is left as they are.

    Least squares of one set of parameters with a sign for each log leaves y'y - s'M s, with M of
    what each log's torque has along the columns. Turned all at once they leave the same, and a load
    or an offset may turn a torque that is right: those are wrong in which friction drives the
    joint, while it brakes in the others.
    """
    use = seen.rows.use[:, j]
    columns, tau, log = seen.rows.columns[j][use], seen.rows.tau[use, j], seen.rows.log[use]
    length = np.linalg.norm(columns, axis=0)
    there = np.flatnonzero(length > 0.0)
    columns = columns[:, there] / length[there]
    along = np.stack([columns[log == k].T @ tau[log == k] for k in range(count)], axis=1)
    solve = np.linalg.pinv(columns.T @ columns, rcond=1e-10, hermitian=True)
    system, whole = along.T @ solve @ along, float(tau @ tau)
    left = lambda s: max(whole - float(s @ system @ s), 1e-12 * whole)  # noqa: E731
    first = np.ones(count)
    signs = min((_descended(s, left) for s in (first, _alike(system))), key=left)
    least, plain = left(signs), left(first)
    if not 0.0 < least < _LEAVES * plain:
        return [], 1.0
    named = [(c.effect, c.joint == j) for c in seen.model.coefficients]
    place = 10 * seen.model.bodies + np.arange(len(named))
    friction = np.isin(there, place[[own in _FRICTION for own in named]])
    coulomb = np.isin(there, place[[own == _FRICTION[0] for own in named]])
    brakes = [
        _braking(columns[own], tau[own], friction, coulomb)
        for own in (signs[log] > 0.0, signs[log] < 0.0)
    ]
    if brakes[0] < 0.0 < brakes[1]:
        signs, brakes = -signs, brakes[::-1]
    if not brakes[1] < 0.0 < brakes[0]:
        return [], 1.0
    each = [
        k
        for k in np.flatnonzero(signs < 0.0)
        if left(np.where(np.arange(count) == k, -signs, signs)) > least / _LEAVES
    ]
    return [int(k) for k in each], float(np.sqrt(least / plain))


def _braking(columns, tau, friction, coulomb) -> float:
    """What friction has along the direction of motion in some rows, by least squares of these
    alone: less than nothing where it drives, and nothing where it is less than what is left.

    Args:
        columns: (n, k) of one size, tau (n,). friction, coulomb: (k,) bool.
    """
    if len(tau) < 2 * columns.shape[1]:
        return 0.0
    found = np.linalg.lstsq(columns, tau, rcond=1e-8)[0]
    own, left = columns[:, friction] @ found[friction], tau - columns @ found
    return float(columns[:, coulomb].sum(axis=1) @ own) if own @ own > left @ left else 0.0


def _alike(system) -> np.ndarray:
    """Signs (logs,) of the direction in which the logs' torques are most alike."""
    return np.where(np.linalg.eigh(system)[1][:, -1] < 0.0, -1.0, 1.0)


def _descended(signs, left) -> np.ndarray:
    """Signs (logs,) of which no other one leaves less."""
    for _ in range(_ROUNDS):
        other = [np.where(np.arange(len(signs)) == k, -signs, signs) for k in range(len(signs))]
        best = min(other, key=left)
        if not left(best) < left(signs):
            break
        signs = best
    return signs
