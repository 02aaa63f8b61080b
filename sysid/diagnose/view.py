"""What a diagnosis looks at: a model settled on the training motion under one low-pass, and the same motion once more with
the noise of its angles drawn again. Frozen data; the functions stand beside it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import blocks
from .. import rows as row
from ..config import Experiment
from ..estimate import inverse
from ..model import Model
from ..preprocess import Motion
from ..shape import Settled, inverted, prior_hessian, settle
from . import flexible

_FOLDS = 10


@dataclass(frozen=True)
class Source:
    """One motion under one model at parameters x (size,): what candidates make their columns of.

    use: (n, dof) bool of the rows that a stride keeps.
    """

    model: Model
    x: np.ndarray
    motion: Motion
    stride: int
    use: np.ndarray

    @cached_property
    def pieces(self) -> list:
        """Whole pieces as effects see them."""
        return row.seen(self.model, self.motion)

    @cached_property
    def _bent(self) -> dict:
        return {}

    def bent(self, joint: int) -> list:
        """What a joint's link would change if it stood apart from its motor: the same for whatever parts them."""
        if joint not in self._bent:
            self._bent[joint] = row.bent(self.model, self.motion, self.x, joint)
        return self._bent[joint]

    @cached_property
    def predicted(self) -> np.ndarray:
        """Torque (n, dof), low-passed as the columns are."""
        return row.predicted(self.model, self.motion, self.x, self.stride)

    @cached_property
    def unfiltered(self) -> list[np.ndarray]:
        """Torque (dof, n) over whole pieces, before the low-pass."""
        count = 10 * self.model.bodies
        pi, c = self.x[:count].reshape(-1, 10), self.x[count:]
        bare = (replace(p, smoother=None, core=slice(0, len(p.t))) for p in self.motion.pieces)
        return [self.model.torque(piece, pi, c).T for piece in bare]


@dataclass(frozen=True)
class View:
    """A model settled on the training motion.

    motion: training logs under one low-pass; rough: the same with the angles' noise once more.
    weights: (dof,) inverse RMS by which joints count. prior: (bodies, 10).
    """

    experiment: Experiment
    motion: Motion
    rough: Motion
    prior: np.ndarray
    stride: int
    weights: np.ndarray
    settled: Settled

    @property
    def model(self) -> Model:
        """The model, with its shape values found."""
        return self.settled.model

    @property
    def rows(self) -> row.Rows:
        """Training rows."""
        return self.settled.rows

    @property
    def step(self) -> float:
        """Seconds from row to row."""
        return self.stride * self.motion.pieces[0].step

    @cached_property
    def variables(self) -> dict[str, np.ndarray]:
        """{q_joint, qd_joint, qdd_joint, load_joint, time: (n,)} on the rows."""
        rows, joints = self.rows, self.model.robot.joints
        pieces = [(piece, rows.index[rows.piece == k]) for k, piece in enumerate(self.motion.pieces)]
        pick = lambda name: np.concatenate([getattr(piece, name)[own] for piece, own in pieces])  # noqa: E731
        parts = {"q": pick("q"), "qd": pick("qd"), "qdd": pick("qdd"), "load": self.source.predicted}
        out = {f"{kind}_{joint}": values[:, j] for kind, values in parts.items() for j, joint in enumerate(joints)}
        return out | {"time": rows.t - rows.t.min()}

    @cached_property
    def unknown(self) -> tuple[flexible.Unknown, ...]:
        """What a flexible function of the motion takes of each joint."""
        # three stretches a fold, so that what is left out is seldom a place where nothing else was
        rows = self.rows
        fold = blocks.numbered(rows.t, rows.piece, shortest=np.inf, fewest=3 * _FOLDS) % _FOLDS
        return tuple(
            flexible.unknown(
                self.variables, name, self.design.residual[:, j], rows.use[:, j], fold, rows.piece, self.step,
                np.random.default_rng(j),
            )
            for j, name in enumerate(self.model.robot.joints)
        )  # fmt: skip

    @cached_property
    def blocks(self) -> np.ndarray:
        """(n,) the block of each row, long against the memory of what no function of the motion predicts."""
        rows = self.rows
        left = self.design.residual - np.stack([found.told for found in self.unknown], axis=1)
        return blocks.numbered(rows.t, rows.piece, memory=blocks.memory(left, rows.use, rows.piece, self.step))

    @cached_property
    def source(self) -> Source:
        """The motion as measured."""
        return Source(self.model, self.settled.x, self.motion, self.stride, self.rows.use)

    @cached_property
    def rough_source(self) -> Source:
        """The motion with the angles' noise once more; the same rows count."""
        return replace(self.source, motion=self.rough)

    @cached_property
    def design(self) -> Design:
        """Least squares of everything in the model."""
        return _design(self)

    @cached_property
    def sums(self) -> Sums:
        """The design's sums over blocks."""
        return _sums(self.design, by_block(self.blocks))

    def rms(self) -> np.ndarray:
        """(dof,) of the low-passed residual on the training rows."""
        left = self.rows.residual(self.settled.x)
        return np.sqrt((left**2).sum(0) / np.maximum(self.rows.use.sum(0), 1))


@dataclass(frozen=True)
class Design:
    """Everything in a model as weighted columns (dof, n, size), slopes of shape values last; the residual (n, dof) at their
    optimum, weighted; `system` (size, size), columns' columns plus half of the prior's Hessian, and its inverse; `change`
    (size,) from the model's own optimum, whose friction may be held at zero, to this one, where it is free; what the
    angles' noise, once more, adds to columns and residual: `rough_columns`, `rough_residual`."""

    columns: np.ndarray
    residual: np.ndarray
    system: np.ndarray
    inverse: np.ndarray
    change: np.ndarray
    rough_columns: np.ndarray
    rough_residual: np.ndarray


@dataclass(frozen=True)
class Sums:
    """Over blocks: squares (blocks, size, size) of the columns, scores (blocks, size) of columns and residual, `rough_scores`
    of what the angles' noise adds to both; over all, `rough_squares` (size, size)."""

    squares: np.ndarray
    scores: np.ndarray
    rough_scores: np.ndarray
    rough_squares: np.ndarray


def looked_at(
    experiment: Experiment, model: Model, motion: Motion, rough: Motion, prior, *, stride: int,
    weights=None, grid: bool = True, tolerance: float = 1e-7,
) -> View:  # fmt: skip
    """Settle a model on a motion.

    Args:
        weights: (dof,); None: the inverse RMS that the joints are left with when all count alike.
        grid: search the grids of shape values; without it, from those that the model has.
        tolerance: share of the objective by which a step of the shape values must lower it for another to follow.
    """
    model = model if model.scales else model.scaled_by(motion)
    ones = np.ones(model.robot.dof)
    make = lambda w, m, g: settle(experiment, m, motion, prior, weights=w, stride=stride, grid=g, tolerance=tolerance)  # noqa: E731
    if weights is None:
        first = make(ones, model, grid)
        left = first.rows.residual(first.x)
        weights = inverse(np.sqrt((left**2).sum(0) / np.maximum(first.rows.use.sum(0), 1)))
        model, grid = first.model, False
    return View(experiment, motion, rough, prior, stride, np.asarray(weights), make(weights, model, grid))


def by_block(number: np.ndarray) -> list[slice]:
    """The rows of each block; blocks are numbered in the order of the rows."""
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(number)) + 1, [len(number)]])
    return [slice(a, b) for a, b in zip(cuts, cuts[1:])]


def _full(view: View, source: Source, columns: np.ndarray) -> np.ndarray:
    slopes = row.tangents(source.model, source.motion, source.x, source.stride, source.use, source.predicted)
    free = [k for k, value in enumerate(source.model.shape_values) if not value.held]
    return np.concatenate([columns, slopes[:, :, free]], axis=2) * view.weights[:, None, None]


def _design(view: View) -> Design:
    found, weights = view.settled, view.weights
    columns = _full(view, view.source, found.rows.columns)
    size = columns.shape[2]
    half = np.zeros((size, size))
    half[: view.model.size, : view.model.size] = 0.5 * prior_hessian(found)
    system = np.einsum("jnk,jnl->kl", columns, columns, optimize=True) + half
    inverse_ = inverted(system)
    residual = found.rows.residual(found.x) * weights
    # what is held at zero, and what was settled to a tolerance only, takes its last step here
    pull = np.zeros(size)
    pull[: view.model.size] = -0.5 * found.problem.objective.gradient(found.x)
    pull[view.model.size :] = np.einsum("jnk,nj->k", columns[:, :, view.model.size :], residual)
    change = inverse_ @ pull
    residual = residual - np.einsum("jnk,k->nj", columns, change)
    more = _full(view, view.rough_source, _stacked(view)) - columns
    x = np.append(found.x, np.zeros(size - view.model.size)) + change
    rough = -np.einsum("jnk,k->nj", more, x)
    return Design(columns, residual, system, inverse_, change, more, rough)


def _sums(design: Design, spans: list[slice]) -> Sums:
    more, columns = design.rough_columns, design.columns
    products = lambda a, r: np.stack([sum(a[j][s].T @ r[s, j] for j in range(len(a))) for s in spans])  # noqa: E731
    return Sums(
        np.stack([sum(a[s].T @ a[s] for a in columns) for s in spans]), products(columns, design.residual),
        products(more, design.rough_residual), np.einsum("jnk,jnl->kl", more, more, optimize=True),
    )  # fmt: skip


def _stacked(view: View) -> np.ndarray:
    """The model's columns on the rough motion, on the rows that count in the view: near a reversal the noise, drawn again, would
    leave out others, and a row that is missing is no noise."""
    pieces = [replace(rough, use=piece.use) for rough, piece in zip(view.rough.pieces, view.motion.pieces)]
    return row.stack(view.model, replace(view.rough, pieces=tuple(pieces)), view.stride).columns
