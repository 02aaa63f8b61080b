"""Whether the columns of one log are read otherwise than those of the others: what these tell of the
robot predicts its torque, so that no mass of the URDF needs to be right.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..as_read import as_read, told_by
from ..equations import Reading
from ..fault import ERROR, Fault
from ..look import Look, Seen
from .columns import readings

AFTER = 3
SENSELESS = ("wrong_unit", "angle_wrap", "joint_order", "sign_flipped")
# What another reading leaves of the squares of every joint whose column it reads otherwise: a
# factor of two in what is left, as of a torque's sign.
_LEAVES = 0.25
# Times the error that a joint has in the other logs: no reading is asked for of less, and what is
# read rightly has no more
_ODD = 2.0


def find(look: Look) -> Iterator[Fault]:
    """joint_order, sign_flipped, of single logs."""
    if len(look.logs) < 2 or look.every is None:
        return
    found = [own for k in range(len(look.logs)) if (own := _read_otherwise(look, look.every, k))]
    # an odd log bends what the others tell: where two are, the clearest is told
    if found:
        _, k, kind, joints, word, left = min(found, key=lambda own: own[0])
        name, names = look.logs[k].path.name, [look.robot.joints[j] for j in joints]
        if kind == "joint_order":
            what = f"the {word} columns" if word else "the columns"
            says = f"{what} of {' and '.join(names)} look exchanged in {name} alone"
        else:
            says = f"the {word} of {names[0]} has in {name} alone the sign against the other logs'"
        predicted = (
            f"read so, what the other logs tell of the robot leaves {100 * left:.0f} % of its error"
        )
        do = "correct that file's columns, or leave the file out"
        for joint in names:
            yield Fault(kind, ERROR, f"{says}: {predicted}", do, joint, name)


def _read_otherwise(look: Look, seen: Seen, k: int) -> tuple | None:
    """(loss, log, fault, joints, what, RMS left as a share) of the reading of log k that the other
    logs ask for; None where they ask for none."""
    rows = seen.rows
    own = rows.log == k
    rest = rows.use & ~own[:, None]
    here = rows.use & own[:, None]
    asked = [j for j in look.asked(rest) if j in look.asked(here)]
    if not asked:
        return None
    x, usual = told_by(seen.rows, seen.model, rest)
    plain = _squares(rows.tau[own], rows.columns[:, own], rows.use[own], x)
    if not np.any(np.sqrt(plain[asked]) > _ODD * usual[asked]):
        return None
    best = None
    for reading, (kind, joints, word) in readings(Reading.plain(look.robot.dof), look.robot.dof):
        if not set(joints) <= set(asked):
            continue
        tau, columns, use = as_read(seen, reading, k)
        left = _squares(tau, columns, use, x)
        fallen = left / np.maximum(plain, 1e-300)
        loss = float(np.sum(np.log(fallen[asked])))
        rises = np.any(fallen[here.any(axis=0)] > 1.0 / _LEAVES)  # of others, whatever is asked
        these = list(joints)
        # read rightly, it is predicted as the other logs are: else they tell too little of this one
        usually = np.all(np.sqrt(left[these]) <= _ODD * usual[these])
        clear = np.all(fallen[these] < _LEAVES) and usually and not rises
        if clear and (best is None or loss < best[0]):
            best = loss, k, kind, joints, word, float(np.sqrt(fallen[list(joints)].max()))
    return best


def _squares(tau, columns, use, x) -> np.ndarray:
    """(dof,) mean square that parameters leave of rows that count, about its mean: another zero is no
    other column."""
    left, count = tau - np.einsum("jnk,k->nj", columns, x), np.maximum(use.sum(axis=0), 1)
    return np.sum((left - np.sum(left * use, axis=0) / count) ** 2 * use, axis=0) / count
