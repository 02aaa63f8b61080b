"""Whether the columns of one log are read otherwise than those of the others: what these tell of the
robot predicts its torque, so that no mass of the URDF needs to be right.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...motion import Piece
from ...rows import stack
from ..equations import FEWEST, Reading
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
_PASSES = 2  # over the weights of the joints


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
    asked = [
        j for j in range(look.robot.dof) if look.excited[j].enough and rest[:, j].sum() > FEWEST
    ]
    asked = [j for j in asked if here[:, j].sum() > FEWEST]
    if not asked:
        return None
    x, usual = _told_by(seen, rest)
    plain = _squares(rows.tau[own], rows.columns[:, own], rows.use[own], x)
    if not np.any(np.sqrt(plain[asked]) > _ODD * usual[asked]):
        return None
    best = None
    for reading, (kind, joints, word) in readings(Reading.plain(look.robot.dof), look.robot.dof):
        if not set(joints) <= set(asked):
            continue
        tau, columns, use = _as_read(seen, k, reading)
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


def _told_by(seen: Seen, use) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (size,) by least squares about the URDF's, of rows (n, dof) that are used, each
    joint in units of what is left of it, and this (dof,)."""
    rows, model = seen.rows, seen.model
    start = np.zeros(model.size)
    start[: 10 * model.bodies] = model.robot.prior.ravel()
    tau = rows.residual(start)
    scale = np.sqrt(np.einsum("jnk,jnk->k", rows.columns, rows.columns))
    scale = np.where(scale > 0.0, 1.0 / np.maximum(scale, 1e-300), 0.0)
    count = np.maximum(use.sum(axis=0), 1)
    usual = np.sqrt(np.sum(tau**2 * use, axis=0) / count)
    for _ in range(_PASSES):
        weights = np.divide(1.0, usual, out=np.zeros_like(usual), where=usual > 0.0)
        counted = rows.columns * (use.T * weights[:, None])[:, :, None] * scale
        a = counted.reshape(-1, counted.shape[2])
        y = ((tau * use) * weights).T.ravel()
        step = scale * (np.linalg.pinv(a.T @ a, rcond=1e-10, hermitian=True) @ (a.T @ y))
        usual = np.sqrt(np.sum(rows.residual(start + step) ** 2 * use, axis=0) / count)
    return start + step, usual


def _as_read(seen: Seen, k: int, reading: Reading) -> tuple:
    """Torque (n, dof), columns (dof, n, size) and which rows count (n, dof), of log k as another
    reading has it."""
    rows, order, turn = seen.rows, list(reading.angle), np.array(reading.angle_factor)
    own = rows.log == k
    tau = rows.of(seen.motion, "tau")[own][:, list(reading.torque)]
    tau = tau * np.array(reading.torque_factor)
    if order == sorted(order) and np.all(turn > 0.0):
        return tau, rows.columns[:, own], rows.use[own]
    pieces = tuple(_turned(p, order, turn) for p in seen.motion.pieces if p.log == k)
    found = stack(seen.model, replace(seen.motion, pieces=pieces), seen.stride)
    return tau, found.columns, found.use


def _turned(piece: Piece, order: list[int], turn) -> Piece:
    """A piece with its joints' motion in another order, and with other signs."""
    own = {name: getattr(piece, name)[:, order] * turn for name in ("q", "qd", "qdd")}
    return replace(piece, **own, use=None if piece.use is None else piece.use[:, order])


def _squares(tau, columns, use, x) -> np.ndarray:
    """(dof,) mean square that parameters leave of rows that count, about its mean: another zero is no
    other column."""
    left, count = tau - np.einsum("jnk,k->nj", columns, x), np.maximum(use.sum(axis=0), 1)
    return np.sum((left - np.sum(left * use, axis=0) / count) ** 2 * use, axis=0) / count
