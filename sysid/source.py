"""What one model at its parameters makes of one motion, computed once for all who ask."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from . import rows as row
from .effect import MotionEffect
from .model import Model
from .motion import Motion, Piece
from .tangents import tangents


@dataclass(frozen=True)
class Source:
    """One motion under one model at parameters x (size,): what candidates make their columns of.

    use: (n, dof) bool of the rows that a stride keeps. beside: the same on another motion, which will
    be asked the same: what is integrated step by step is integrated for both at once.
    """

    model: Model
    x: np.ndarray
    motion: Motion
    stride: int
    use: np.ndarray
    beside: Source | None = None

    @cached_property
    def pieces(self) -> list:
        """Whole pieces as effects see them: under the load of the bodies found, not the URDF's."""
        return row.seen(self.referenced, self.motion)

    @cached_property
    def referenced(self) -> Model:
        """The model with bodies that effects of the load look at: its own, or those of x."""
        return self.model if self.model.reference is not None else self.model.referring_to(self.x)

    @cached_property
    def _seen(self) -> list:
        if self.referenced is self.model:
            return self.pieces
        return row.moved(self.model, self.motion)

    @cached_property
    def _bent(self) -> dict:
        return {}

    def bent(self, joint: int, among: Iterable[int] = ()) -> list:
        """What a joint's link would change if it stood apart from its motor: the same for whatever
        parts them. among: joints that will be asked alike."""
        if joint not in self._bent:
            new = [j for j in {joint, *among} if j not in self._bent]
            self._bent.update(row.bent(self.model, self.motion, self.x, new, self._seen))
        return self._bent[joint]

    @cached_property
    def _shifted(self) -> dict:
        return {}

    def shifted(self, joint: int) -> list[np.ndarray]:
        """Of each whole piece, slopes (3, dof, n) of the torque before sensors in the angle, speed and
        acceleration of a joint as measured: the same for whatever says that it moved otherwise."""
        if joint not in self._shifted:
            out, model, x = [], self.model.unsensed, self.x
            own = model.robot.turned(joint)
            moves = any(isinstance(effect, MotionEffect) for effect, _ in model.terms)
            # what the link carries is known: it moves as if behind its motor, the other way
            if apart := not moves and not (own & model.robot.carried(joint)).any():
                bodies, rest = np.split(x, [10 * model.bodies])
                x = np.concatenate([np.where(own.repeat(10), bodies, 0.0), rest])
            bases = [self._torque(model, p, x) for p in self._whole] if apart else self._base
            for piece, base, known in zip(self._whole, bases, self.bent(joint)):
                slopes = -known.slopes if apart else np.zeros_like(known.slopes)
                for k, (name, nudge) in enumerate(zip(("q", "qd", "qdd"), row.NUDGES)):
                    moved = {"q": piece.q.copy(), name: getattr(piece, name).copy()}
                    moved[name][:, joint] += nudge
                    slopes[k] += (self._torque(model, replace(piece, **moved), x) - base) / nudge
                out.append(slopes)
            self._shifted[joint] = out
        return self._shifted[joint]

    @cached_property
    def _flights(self) -> dict:
        return {}

    def flew(self, key, joint: int) -> bool:
        """Whether `flights` has those of a joint."""
        return joint in self._flights.get(key, {})

    def flights(self, key, effect, tries: dict[int, list[dict]]) -> dict[int, list]:
        """{joint: how far its link stands apart, of each piece (tried, 3, n)}, at sets of shape values that are tried on
        joints: all these links at once, once for all who ask with a `key`."""
        known = self._flights.setdefault(key, {})
        if more := {joint: own for joint, own in tries.items() if joint not in known}:
            both = [self] if self.beside is None else [self, self.beside]
            bent = [{joint: source.bent(joint, more) for joint in more} for source in both]
            found = [{joint: [] for joint in more} for _ in both]
            for k in range(len(self.motion.pieces)):
                parts = [(b[joint][k], own) for b in bent for joint, own in more.items()]
                cases = [(b.load, b.inertia, b.seen, s) for b, own in parts for s in own]
                each = iter(effect.several(cases))
                for pieces in found:
                    for joint, own in more.items():
                        pieces[joint].append([next(each) for _ in own])
            for source, pieces in zip(both, found):
                source._flights.setdefault(key, {}).update(pieces)
        return known

    @cached_property
    def predicted(self) -> np.ndarray:
        """Torque (n, dof), low-passed as the columns are."""
        return row.low_passed(self.motion, self.unfiltered, self.stride).T

    @cached_property
    def unfiltered(self) -> list[np.ndarray]:
        """Torque (dof, n) over whole pieces as sensors show it, before the low-pass."""
        return [self._torque(self.model, piece, self.x) for piece in self._whole]

    @cached_property
    def _base(self) -> list[np.ndarray]:
        if self.model.unsensed is self.model:
            return self.unfiltered
        return [self._torque(self.model.unsensed, piece, self.x) for piece in self._whole]

    def _torque(self, model: Model, piece: Piece, x: np.ndarray) -> np.ndarray:
        bodies, rest = np.split(x, [10 * model.bodies])
        return model.torque(piece, bodies.reshape(-1, 10), rest).T

    @cached_property
    def _whole(self) -> list[Piece]:
        """The pieces without their low-pass, all of their rows."""
        return row.whole(self.motion)

    def full(self, columns: np.ndarray) -> np.ndarray:
        """The model's columns with the slopes of its free shape values after them."""
        free = [k for k, value in enumerate(self.model.shape_values) if not value.held]
        if not free:
            return columns
        slopes = tangents(
            self.model, self.motion, self.x, self.stride, self.use, self.predicted
        )
        return np.concatenate([columns, slopes[:, :, free]], axis=2)
