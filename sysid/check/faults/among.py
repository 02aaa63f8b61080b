"""Whether a joint's torque has in one log the sign that it has in the others: what the same bodies and
friction leave of all logs says so, however far the URDF's are from them.
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
    what each log's torque has along the columns. Turned all at once they leave the same: it is the
    fewer that are wrong, and of as many those against which friction drives.
    """
    rows = seen.rows
    use = rows.use[:, j]
    columns, tau, log = rows.columns[j][use], rows.tau[use, j], rows.log[use]
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
    if signs.sum() < 0.0 or (signs.sum() == 0.0 and _driven(seen, there, solve @ along @ signs, j)):
        signs = -signs
    each = [
        k
        for k in np.flatnonzero(signs < 0.0)
        if left(np.where(np.arange(count) == k, -signs, signs)) > least / _LEAVES
    ]
    return [int(k) for k in each], float(np.sqrt(least / plain))


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


def _driven(seen: Seen, there, found, j: int) -> bool:
    """Whether friction, of parameters found (there,), drives the joint."""
    friction = [
        10 * seen.model.bodies + k
        for k, c in enumerate(seen.model.coefficients)
        if c.joint == j and c.positive
    ]
    return bool(found[np.isin(there, friction)].sum() < 0.0)
