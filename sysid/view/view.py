"""What a diagnosis looks at: a model settled on the motion of training logs, or of others, under
one low-pass, and the same motion once more with the noise of its angles drawn again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import blocks, flexible
from .. import rows as row
from ..lowpass import calm
from ..model import Model
from ..motion import Motion
from ..posed_problem import inverse
from ..settled import Settled
from ..shape import settle
from ..source import Source
from ..specs import Experiment
from .design import Design, Sums, designed, instrumented, summed
from .stationary import spectra

_FOLDS = 10


@dataclass(frozen=True)
class View:
    """A model settled on the training motion.

    motion: training logs under one low-pass; rough: the same with the angles' noise once more.
    weights: (dof,) inverse RMS by which joints count. prior: (bodies, 10). inherited: (n,) blocks
    of the model that this one grew from, so that both lose in the same blocks; asked: what was
    `unknown` of it. like: a view of the same motion whose noise is this one's.
    """

    experiment: Experiment
    motion: Motion
    rough: Motion
    prior: np.ndarray
    stride: int
    weights: np.ndarray
    settled: Settled
    inherited: np.ndarray | None = None
    asked: tuple[flexible.Unknown, ...] = ()
    like: View | None = None

    @property
    def model(self) -> Model:
        """The model, with its shape values found."""
        return self.settled.model

    @property
    def x(self) -> np.ndarray:
        """The model's parameters at the design's optimum."""
        return self.settled.x + self.design.change[: self.model.size]

    @property
    def rows(self) -> row.Rows:
        """Training rows."""
        return self.settled.rows

    @property
    def step(self) -> float:
        """Seconds from row to row."""
        return self.stride * self.motion.pieces[0].step

    @property
    def cutoff(self) -> float:
        """Of the low-pass [Hz]."""
        return self.motion.pieces[0].smoother.cutoff

    @cached_property
    def variables(self) -> dict[str, np.ndarray]:
        """{q_joint, qd_joint, qdd_joint, load_joint, time: (n,)} on the rows, without the noise of
        the angles."""
        return self._variables(self.source)

    @cached_property
    def rough_variables(self) -> dict[str, np.ndarray]:
        """The same of the motion with the angles' noise once more: what is left of it there."""
        return self._variables(self.rough_source)

    def _variables(self, source: Source) -> dict[str, np.ndarray]:
        known = {name: self.rows.of(source.motion, name) for name in ("q", "qd", "qdd")}
        known["load"] = source.predicted
        piece, band = self.rows.piece, self.motion.band
        known = {name: calm(v, piece, band, self.step) for name, v in known.items()}
        joints = self.model.robot.joints
        out = {f"{kind}_{j}": v for kind, all_ in known.items() for j, v in zip(joints, all_.T)}
        return out | {"time": self.rows.t - self.rows.t.min()}

    @cached_property
    def unknown(self) -> tuple[flexible.Unknown, ...]:
        """What a flexible function of the motion takes of each joint; where the residual is that of
        the view that this one grew from, what it took there."""
        # three stretches a fold, so that what is left out is seldom where nothing else was
        rows = self.rows
        residual, _ = instrumented(self.design, rows.use, rows.piece, self.motion.band, self.step)
        stretch = blocks.numbered(rows.t, rows.piece, shortest=np.inf, fewest=3 * _FOLDS)
        fold, names = stretch % _FOLDS, self.model.robot.joints
        same = [one.of(residual[:, j]) for j, one in enumerate(self.asked)] or [None] * len(names)
        rest = fold, rows.piece, self.step
        take = lambda j, name: flexible.unknown(  # noqa: E731
            self.variables, name, residual[:, j], rows.use[:, j], *rest, np.random.default_rng(j),
            self.design.rough_residual[:, j],
        )  # fmt: skip
        return tuple(same[j] or take(j, name) for j, name in enumerate(names))

    @property
    def answers(self) -> tuple[flexible.Unknown, ...]:
        """What is `unknown`, or was of the model that this one grew from, as far as it was asked."""
        return vars(self).get("unknown", self.asked)

    @cached_property
    def blocks(self) -> np.ndarray:
        """(n,) the block of each row, long against the memory of what no function of the motion
        predicts."""
        if self.inherited is not None:
            return self.inherited
        return blocks.numbered(self.rows.t, self.rows.piece, memory=self._left[1])

    @cached_property
    def _left(self) -> tuple[np.ndarray, float]:
        """What no function of the motion predicts (n, dof), and its memory [s]."""
        rows = self.rows
        left = self.design.residual - np.stack([found.told for found in self.unknown], axis=1)
        return left, blocks.memory(left, rows.use, rows.piece, self.step)

    @cached_property
    def spectra(self) -> np.ndarray:
        """(dof, frequencies) of what no function of the motion predicts, as noise that is always
        the same has it."""
        if self.like is not None:
            return self.like.spectra * ((self.weights / self.like.weights) ** 2)[:, None]
        left, memory = self._left
        return spectra(left, self.design.columns, self.rows.use, memory, self.step)

    @cached_property
    def source(self) -> Source:
        """The motion as measured."""
        return Source(self.model, self.settled.x, self.motion, self.stride, self.rows.use)

    @cached_property
    def rough_source(self) -> Source:
        """The motion with the angles' noise once more; the same rows count."""
        return replace(self.source, motion=self.rough, beside=self.source)

    @cached_property
    def design(self) -> Design:
        """Least squares of everything in the model."""
        return designed(self.settled, self.weights, self.source, self.rough_source)

    @cached_property
    def sums(self) -> Sums:
        """The design's sums over blocks."""
        return summed(self.design, blocks.by_block(self.blocks))

    def rms(self) -> np.ndarray:
        """(dof,) of the low-passed residual on the training rows."""
        return self.rows.rms(self.rows.residual(self.settled.x))


def looked_at(
    experiment: Experiment,
    model: Model,
    motion: Motion,
    rough: Motion,
    prior,
    *,
    stride: int,
    weights=None,
    grid: bool = True,
    tolerance: float = 1e-7,
    strikes: bool = False,
    grown: View | None = None,
    like: View | None = None,
) -> View:
    """Settle a model on a motion.

    Args:
        weights: (dof,); None: the inverse RMS that the joints are left with when all count alike.
        grid: search the grids of shape values; without it, from those that the model has.
        tolerance: share of the objective by which a step of the shape values must lower it for
            another to follow.
        strikes: look all about the values of effects by which a link strikes.
        grown: the view whose model this one grew from. like: whose noise it has, where that is known.
    """

    def view(weights, model: Model, grid: bool) -> View:
        options = {"weights": weights, "stride": stride, "grid": grid, "tolerance": tolerance}
        found = settle(experiment, model, motion, prior, strikes=strikes, **options)
        own = stride, np.asarray(weights), found
        before = (grown.blocks, grown.answers) if grown else (None, ())
        return View(experiment, motion, rough, prior, *own, *before, like)

    model = model if model.scales else model.scaled_by(motion)
    if weights is not None:
        return view(weights, model, grid)
    first = view(np.ones(model.robot.dof), model, grid)
    return view(inverse(first.rms()), first.model, False)
