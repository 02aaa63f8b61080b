"""Rows of logs whose columns are read in another way, and what rigid bodies make of them, whatever
these are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model import Model
from ..motion import Piece
from ..rows import Rows, stack
from .equations import Reading
from .look import Seen

_PASSES = 2  # over the weights of the joints


def as_read(
    seen: Seen, reading: Reading, log: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Torque (n, dof), columns (dof, n, size) and which rows count (n, dof) as a reading has them,
    of one log or of all of them.
    """
    rows, order, turn = seen.rows, list(reading.angle), reading.turned
    own = rows.log == log if log is not None else np.ones(len(rows.log), dtype=bool)
    tau = rows.of(seen.motion, "tau")[own][:, list(reading.torque)]
    tau = tau * np.array(reading.torque_factor)
    plain = order == sorted(order) and np.all(turn == 1.0) and not any(reading.zero)
    if plain and reading.gravity is None:
        return tau, rows.columns[:, own], rows.use[own]
    pieces = (p for p in seen.motion.pieces if log is None or p.log == log)
    read = tuple(_read(piece, order, turn, reading) for piece in pieces)
    found = stack(seen.model, replace(seen.motion, pieces=read), seen.stride)
    return tau, found.columns, found.use


def _read(piece: Piece, order: list[int], turn, reading: Reading) -> Piece:
    """A piece as a reading has it."""
    own = {name: getattr(piece, name)[:, order] * turn for name in ("q", "qd", "qdd")}
    own["q"] = own["q"] + reading.zero
    down = piece.gravity if reading.gravity is None else np.array(reading.gravity)
    use = None if piece.use is None else piece.use[:, order]
    return replace(piece, **own, use=use, gravity=down)


def told_by(rows: Rows, model: Model, use) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (size,) by least squares about the URDF's, of rows (n, dof) that are used, each
    joint in units of what is left of it, and this, the root of its mean square (dof,)."""
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


def left_free(seen: Seen, reading: Reading) -> float:
    """Sum of the logarithms of the squares of each joint that bodies leave, whatever these are, of
    a reading.
    """
    tau, columns, use = as_read(seen, reading)
    rows = replace(seen.rows, columns=columns, tau=np.where(use, tau, 0.0), use=use)
    _, left = told_by(rows, seen.model, use)
    return 2.0 * float(np.sum(np.log(np.maximum(left[left > 0.0], 1e-300))))
