"""Model x motion -> rows that stand in memory: a thinned log's columns, and what effects would add to them.

Triangles hold all of a log but only for one set of shape values. Rows are what a search over these works on, and
what a diagnosis asks its questions of: few enough to keep, spread over the whole motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from .both_sides import settled
from .effect import NotFinite
from .model import Model
from .motion import Motion, Piece
from .slides import counted
from .standing_apart import standing_apart
from .stretches import stretches
from .two_masses import link_load


@dataclass(frozen=True)
class Rows:
    """Every `stride`-th row of a motion.

    columns (dof, n, size; in memory samples last) and tau (n, dof), zero where a row does not count for a joint; use (n, dof) bool; t (n,) [s];
    log (n,) the number of the log; piece (n,) the number of the piece and index (n,) the row in it.
    """

    columns: np.ndarray
    tau: np.ndarray
    use: np.ndarray
    t: np.ndarray
    log: np.ndarray
    piece: np.ndarray
    index: np.ndarray

    def residual(self, x) -> np.ndarray:
        """tau - columns x (n, dof), zero where a row does not count."""
        return self.tau - np.einsum("jnk,k->nj", self.columns, x)

    def rms(self, residual) -> np.ndarray:
        """Root mean square (dof,) of a residual (n, dof) over the rows that count."""
        return np.sqrt((residual**2).sum(0) / np.maximum(self.use.sum(0), 1))

    def of(self, motion: Motion, name: str) -> np.ndarray:
        """What the pieces of the motion call `name`, on the rows."""
        return np.concatenate([getattr(p, name)[self.index[self.piece == k]] for k, p in enumerate(motion.pieces)])


def stride_for(motion: Motion, most: int) -> int:
    """The stride that leaves at most `most` rows, and of rows that a low-pass makes alike one."""
    alike = min((1 if piece.smoother is None else piece.smoother.every for piece in motion.outlines), default=1)
    return max(alike, -(-motion.samples // most))


def starts(motion: Motion, stride: int) -> list[slice]:
    """The rows of each piece that a stride keeps."""
    return [slice(piece.core.start, piece.core.stop, stride) for piece in motion.pieces]


def measured(motion: Motion, stride: int) -> Rows:
    """The rows of a motion, without columns (dof, n, 0)."""
    kept = [np.arange(rows.start, rows.stop, stride) for rows in starts(motion, stride)]
    joined = lambda pick: np.concatenate([pick(piece)[own] for piece, own in zip(motion.pieces, kept)])  # noqa: E731
    use = joined(lambda p: np.ones(p.q.shape, dtype=bool) if p.use is None else p.use)
    tau = np.where(use, joined(lambda p: p.tau), 0.0)
    return Rows(
        np.zeros((tau.shape[1], len(tau), 0)), tau, use, joined(lambda p: p.t), joined(lambda p: np.full(len(p.t), p.log)),
        np.concatenate([np.full(len(own), k) for k, own in enumerate(kept)]), np.concatenate(kept),
    )  # fmt: skip


def telling(model: Model, motion: Motion, found: Rows) -> Rows:
    """Measured rows of which those count that say something of a model."""
    uses = [counted(model, piece) for piece in motion.pieces]
    if all(use is piece.use for use, piece in zip(uses, motion.pieces)):
        return found
    kept = [use[found.index[found.piece == k]] for k, use in enumerate(uses)]
    use = found.use & np.concatenate(kept)
    return replace(found, use=use, tau=np.where(use, found.tau, 0.0))


def stack(model: Model, motion: Motion, stride: int) -> Rows:
    """The rows of a motion under a model."""
    found = telling(model, motion, measured(motion, stride))
    columns = np.zeros((model.robot.dof, model.size, len(found.tau)))  # samples last, as they come and as a product wants them
    for here, parts in stretches(model, motion, stride):
        for joint, (support, values) in enumerate(parts):
            columns[joint, support, here] = values
    for own, use in zip(columns, found.use.T):
        if not use.all():
            own[:, ~use] = 0.0
    return replace(found, columns=np.swapaxes(columns, 1, 2))


def predicted(model: Model, motion: Motion, x, stride: int) -> np.ndarray:
    """Torque (n, dof) that parameters x (size,) predict at the rows that a stride keeps."""
    count = 10 * model.bodies
    pi, c = np.asarray(x)[:count].reshape(-1, 10), np.asarray(x)[count:]
    return np.concatenate([model.torque(piece, pi, c, stride) for piece in motion.pieces])


def whole(motion: Motion) -> list[Piece]:
    """The pieces without their low-pass, all of their rows."""
    return [replace(piece, smoother=None, core=slice(0, len(piece.t))) for piece in motion.pieces]


def seen(model: Model, motion: Motion) -> list:
    """Each whole piece as effects of a model see it: moved, with the load that its bodies need."""
    return [model.seen(piece) for piece in motion.pieces]


def moved(model: Model, motion: Motion) -> list:
    """The same, with a load only where an effect of the model looks at it."""
    return [model.moved(piece) for piece in motion.pieces]


NUDGES = (1e-4, 1e-3, 1e-1)  # rad, rad/s, rad/s²: torque bends little over them


@dataclass(frozen=True)
class Bent:
    """What a link that stands apart from its motor changes, over a whole piece: slopes (3, dof, n) of the torque in its angle, speed
    and acceleration behind the motor; load and inertia (n,) of the link; the piece as effects see it."""

    slopes: np.ndarray
    load: np.ndarray
    inertia: np.ndarray
    seen: Piece


def bent(model: Model, motion: Motion, x, joints: Sequence[int], pieces: list | None = None) -> dict[int, list[Bent]]:
    """{joint: of each piece}, at parameters x (size,): what changes is the torque of what the link carries.

    Args:
        pieces: `seen(model, motion)`, where it is at hand.
    """
    pi, out = np.asarray(x)[: 10 * model.bodies].reshape(-1, 10), {joint: [] for joint in joints}
    for parts in _alike(seen(model, motion) if pieces is None else pieces):
        part = _joined(parts)
        moves, how = (part.q, part.qd, part.qdd), {"gravity": part.gravity, "deflection": part.deflection}
        plain, ends = part.deflection is None and part.gravity is None, np.cumsum([len(one.q) for one in parts])[:-1]
        for joint, (base, slopes) in standing_apart(model.robot, pi, *moves, joints, NUDGES, **how).items():
            inertia = -slopes[-1][joint]  # of the link alone: its rotor stays with the motor
            alone = not (model.robot.carried(joint) & model.robot.turned(joint)).any()
            load = base[joint] if plain and alone else link_load(model.robot, pi, part, joint)
            each = (np.split(values, ends, axis=-1) for values in (slopes, load, inertia))
            out[joint] += [Bent(*known, one) for *known, one in zip(*each, parts)]
    return out


def _alike(pieces: list[Piece]) -> Iterator[list[Piece]]:
    """Pieces that stand one after the other under one gravity, all with a link that stands apart from its motor or none."""
    how = lambda piece: (piece.deflection is None, None if piece.gravity is None else tuple(piece.gravity))  # noqa: E731
    return (list(own) for _, own in groupby(pieces, how))


def _joined(pieces: list[Piece]) -> Piece:
    """What rigid bodies see of pieces, as one: they look at a row alone, and short pieces cost their calls."""
    if len(pieces) == 1:
        return pieces[0]
    q, qd, qdd = (np.concatenate([getattr(piece, name) for piece in pieces]) for name in ("q", "qd", "qdd"))
    deflection = None if pieces[0].deflection is None else np.concatenate([piece.deflection for piece in pieces], axis=1)
    return replace(pieces[0], q=q, qd=qd, qdd=qdd, deflection=deflection)


def secants(model: Model, motion: Motion, known: list[Bent], effect, tried: list[dict], stride: int, use: np.ndarray, apart=None) -> np.ndarray:
    """What a link's standing apart from its motor would change of the predicted torque, (tried, dof, n), at several sets of
    shape values: as torque's slopes have it.

    Args:
        known: `bent` of its joint. effect: a Deflection that the model lacks, or that does nothing in it. use: (n, dof) bool.
        apart: of each piece (tried, 3, n) how far, where it is at hand.
    """
    out = []
    apart = apart or [effect.several([(one.load, one.inertia, one.seen, shapes) for shapes in tried]) for one in known]
    for piece, one, own in zip(motion.pieces, known, apart):
        out.append(sensed(model, piece, np.einsum("ojn,ton->tjn", one.slopes, np.stack(own))))
    return low_passed(motion, out, stride) * use.T


def sensed(model: Model, piece: Piece, torque: np.ndarray) -> np.ndarray:
    """What the sensors of a model show of torque (k, dof, n) over a whole piece."""
    return np.stack([model.sensed(torque[:, j], piece, j) for j in range(model.robot.dof)], axis=1)


def low_passed(motion: Motion, torque: list[np.ndarray], stride: int) -> np.ndarray:
    """What sensors show of torque (..., dof, n) over each whole piece, on the rows that a stride keeps, as both sides are seen."""
    return settled(motion.pieces, torque, starts(motion, stride), range(torque[0].shape[-2]))


def signature(model: Model, motion: Motion, pieces: list, effect, joint: int, shapes: dict, stride: int, use: np.ndarray) -> np.ndarray:
    """Columns (dof, n, k), or (n, k) of the joint alone, that a torque effect would add to a model's rows.

    Args:
        pieces: `seen(model, motion)`. joint: its joint, -1 for the robot. use: (n, dof) bool.
    """
    (out,) = signatures(model, motion, pieces, effect, joint, [shapes], stride, use)
    return out[0] if joint >= 0 else out


def signatures(model: Model, motion: Motion, pieces: list, effect, joint: int, tried: list[dict], stride: int, use: np.ndarray) -> np.ndarray:
    """`signature` at several shape values at once, (tried, joints, n, k): its own joint's or every joint's. In memory samples come last,
    as a product with them wants it."""
    out, joints = [], range(model.robot.dof) if joint < 0 else [joint]
    for piece, part in zip(motion.pieces, pieces):
        if joint < 0:
            values = np.stack([effect.columns(part, model.robot, **shapes) for shapes in tried], axis=1)
        else:
            values = effect.columns_at(part, joint, tried)[None]
        # (joints, tried, k, n): everything that follows is linear and the same for each
        sets, count = values.shape[1:3], values.shape[-1]
        read = [model.sensed(own.reshape(-1, count), piece, j) for j, own in zip(joints, values)]
        out.append(np.stack(read, axis=1) if len(read) > 1 else read[0][:, None])
    joined = np.swapaxes(settled(motion.pieces, out, starts(motion, stride), joints), 0, 1)
    joined = joined.reshape(len(joints), *sets, joined.shape[-1])
    counts = use[:, joints].T[:, None, None]
    return np.transpose(joined if counts.all() else joined * counts, (1, 0, 3, 2))


def signatures_where_finite(model: Model, motion: Motion, pieces: list, effect, joint: int, tried: list[dict], stride: int, use: np.ndarray) -> np.ndarray:
    """`signatures`, NaN at shape values where the effect is no finite number."""
    try:
        return signatures(model, motion, pieces, effect, joint, tried, stride, use)
    except NotFinite:
        if len(tried) > 1:
            return np.concatenate([signatures_where_finite(model, motion, pieces, effect, joint, [at], stride, use) for at in tried])
        size = model.robot.dof if joint < 0 else 1, len(use), len(effect.coefficients())
        return np.full((1, *size), np.nan)
