"""A model with the slopes of its torque in its free shape values beside its columns."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .effect import NotFinite
from .model import Model
from .motion import Piece
from .tangents import difference_step


@dataclass(frozen=True)
class Linearised:
    """A model at parameters x (size,) with one more column for each free shape value: the slope of
    its torque there."""

    model: Model
    x: np.ndarray

    @property
    def robot(self):
        """The model's robot."""
        return self.model.robot

    @cached_property
    def free(self) -> list[int]:
        """Which of the model's shape values are not held by the user."""
        return [k for k, value in enumerate(self.model.shape_values) if not value.held]

    @property
    def size(self) -> int:
        """Linear parameters and free shape values."""
        return self.model.size + len(self.free)

    @property
    def reach(self) -> int:
        """The model's."""
        return self.model.reach

    @property
    def terms(self):
        """The model's."""
        return self.model.terms

    def support(self, joint: int, piece: Piece | None = None) -> np.ndarray:
        """The model's, and every slope of values that are there."""
        slopes = [self.model.size + n for n, k in enumerate(self.free) if piece is None or self._there(k, piece)]
        return np.append(self.model.support(joint, piece), slopes).astype(int)

    def _there(self, k: int, piece: Piece) -> bool:
        return self.model.terms[self.model.shape_values[k].term][0].present(piece)

    @cached_property
    def _beside(self) -> list[tuple[Model, float]]:
        return [self._stepped(k, difference_step(self.model.shape_values[k], self.model.shapes[k])) for k in self.free]

    def _stepped(self, k: int, step: float) -> tuple[Model, float]:
        return self.model.with_shapes([s + step * (i == k) for i, s in enumerate(self.model.shapes)]), step

    def remembered(self, piece: Piece) -> list[dict]:
        """What the model remembers of a piece, at its shape values and a step beside each that is there."""
        beside = [model for k, (model, _) in zip(self.free, self._beside) if self._there(k, piece)]
        return [model.remembered(piece) for model in (self.model, *beside)]

    def columns(self, piece, rows: slice, remembered: list[dict]) -> list[np.ndarray]:
        """As `Model.columns`, with the slopes after the others."""
        out = self.model.columns(piece, rows, remembered[0])
        slopes: list[list[np.ndarray]] = [[] for _ in out]
        supports = [self.model.support(joint, piece) for joint in range(len(out))]
        there = [(k, beside) for k, beside in zip(self.free, self._beside) if self._there(k, piece)]
        for (k, (beside, step)), known in zip(there, remembered[1:]):
            if (slope := self.model.gain_slope(k, step)) is not None:  # all else stays
                own = self.model.shape_values[k].joint
                for joint, values in enumerate(out):
                    gained = slope * (self.x[supports[joint]] @ values) if joint == own else np.zeros(values.shape[1])
                    slopes[joint].append(gained)
                continue
            try:
                moved = beside.columns(piece, rows, known)
            except NotFinite:  # at the end of a formula's domain the slope is that of the other side
                beside, step = self._stepped(k, -step)
                moved = beside.columns(piece, rows)
            for joint, values in enumerate(moved):
                slopes[joint].append(self.x[supports[joint]] @ (values - out[joint]) / step)
        return [np.concatenate([values, *(s[None] for s in own)]) for values, own in zip(out, slopes)]
