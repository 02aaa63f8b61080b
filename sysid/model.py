"""Model = robot + effects: an ordered, named vector of parameters and the columns they multiply."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np

from . import regressor, two_masses
from .deflection import Deflection
from .effect import Effect, MotionEffect, SensorEffect, TorqueEffect, WrenchEffect
from .kept_columns import depends, once, stands
from .model_parameters import ROBOT
from .motion import Motion, Piece, never_move
from .needed import acting, add_over, needed
from .terms import Terms

_CHUNK = 4096  # samples whose columns stand in memory at once


@dataclass(frozen=True)
class Model(Terms):
    """A robot and the effects on its joints, with the torque that they need. Immutable; estimates live in `Fit`."""

    _links: dict = field(default_factory=dict, repr=False, compare=False)  # no shape value changes it

    def support(self, joint: int, piece: Piece | None = None) -> np.ndarray:
        """Indices of the parameters that can enter the torque of a joint, in a piece's log or in any, ascending."""
        robot = self.robot
        depends = np.abs(robot.transmission) > 0
        for row, parent in enumerate(robot.parents):  # parents first: a body moves with its carrier
            if parent >= 0:
                depends[row] |= depends[parent]
        bodies = [10 * b + k for b, body in enumerate(robot.bodies) if depends[body.row, joint] for k in range(10)]
        first = 10 * self.bodies
        there = {term for term, (effect, _) in enumerate(self.terms) if piece is None or effect.present(piece)}
        own = [first + k for k, c in enumerate(self.coefficients) if c.joint in (joint, ROBOT) and c.term in there]
        return np.array(bodies + own, dtype=int)

    @property
    def gains(self) -> list[int]:
        """Which free shape values multiply their joint's torque by one number in all logs."""
        effects = [self.terms[value.term][0] for value in self.shape_values]
        return [k for k, (effect, value) in enumerate(zip(effects, self.shape_values)) if isinstance(effect, SensorEffect) and effect.constant_gain and effect.level is None and not value.held]

    def gain_slope(self, k: int, step: float) -> float | None:
        """Of a shape value that multiplies its joint's torque by one number, the slope of that number's logarithm, by a difference;
        None of any other."""
        if k not in self.gains:
            return None
        value = self.shape_values[k]
        effect, at = self.terms[value.term][0], self.shapes_of(value.term, value.joint)
        here, there = effect.gain(**at), effect.gain(**{**at, value.shape.name: self.shapes[k] + step})
        return (there - here) / (step * here)

    @property
    def reach(self) -> int:
        """Samples on either side of a row that its columns look at."""
        return max([effect.reach for effect, _ in self.terms], default=0)

    def remembered(self, piece: Piece) -> dict:
        """What effects that look back to the start of a log make of a whole piece, by (term, joint): columns of those that add
        torque, how far a link stands behind its motor."""
        if not any(effect.memory for effect, _ in self.terms):
            return {}
        alive, robot = (self.robot, self.terms), id(self.robot)
        whole = cache(lambda: piece.part(slice(0, len(piece.t))))
        out = {}
        for term, (effect, joints) in enumerate(self.terms):
            for joint in joints if isinstance(effect, Deflection) else ():
                apart = lambda: effect.apart(*self._link_side(piece, joint), whole(), **self.shapes_of(term, joint))  # noqa: B023, E731
                out[term, joint] = once(piece, ("apart", robot, id(effect), joint), stands(self, term, joint), alive, apart)
        looking = [(term, effect, joints) for term, (effect, joints) in enumerate(self.terms) if effect.memory and not isinstance(effect, Deflection)]
        known = dict(out)
        part = cache(lambda: self._seen(piece, slice(0, len(piece.t)), known, [effect for _, effect, _ in looking]))
        for term, effect, joints in looking:
            for joint in joints:
                columns = lambda: effect.columns(part(), joint, **self.shapes_of(term, joint))  # noqa: B023, E731
                out[term, joint] = once(piece, ("columns", robot, id(effect), joint), depends(self, term, joint), alive, columns)
        return out

    def _link_side(self, piece: Piece, joint: int) -> tuple[np.ndarray, np.ndarray]:
        """Load and inertia of a joint's link over a whole piece."""
        key = (id(piece.q), joint)
        if key not in self._links:  # with the angles, so that no others come to their place
            self._links[key] = (piece.q, two_masses.link_side(self.robot, self._bodies, piece, joint))
        return self._links[key][1]

    @property
    def _bodies(self) -> np.ndarray:
        return self.robot.prior if self.reference is None else self.reference

    def seen(self, piece: Piece) -> Piece:
        """A whole piece as effects see it: moved, with the load that its bodies need."""
        return self._seen(piece, slice(0, len(piece.t)), self.remembered(piece), None)

    def moved(self, piece: Piece) -> Piece:
        """The same, with a load only where an effect of the model looks at it."""
        return self._seen(piece, slice(0, len(piece.t)), self.remembered(piece), [effect for effect, _ in self.terms if not isinstance(effect, Deflection)])

    def _seen(self, piece: Piece, rows: slice, remembered: dict, looking: Sequence[Effect] | None) -> Piece:
        """Rows of a piece moved as the motion effects say, with the load that the effects `looking` look at; None: whoever may."""
        part = piece.part(rows)
        for term, (effect, joints) in enumerate(self.terms):
            if isinstance(effect, MotionEffect):
                for joint in joints:
                    known = {"behind": remembered[term, joint][:, rows]} if isinstance(effect, Deflection) else {}
                    part = effect.moved(part, joint, **known, **self.shapes_of(term, joint))
        if looking is None or any(effect.uses_load for effect in looking):
            part = replace(part, load=self._load(piece, rows, part))
        if self.referred and (looking is None or any(effect.uses_needed for effect in looking)):
            part = replace(part, needed=needed(self, piece, part, rows, remembered))
        return part

    def seen_at(self, piece: Piece, rows: slice, remembered: dict) -> Piece:
        """Rows of a piece as effects that look back to no start of a log see them."""
        return self._seen(piece, rows, remembered, self._at_once)

    @cached_property
    def _at_once(self) -> list[Effect]:
        """The effects that look back to no start of a log."""
        return [effect for effect, _ in self.terms if not effect.memory]

    def _load(self, piece: Piece, rows: slice, part: Piece) -> np.ndarray:
        """Load (n, dof) of rows of a piece, seen as `part`; the last of a slice is kept."""
        moves = any(isinstance(effect, MotionEffect) for effect, _ in self.terms)
        key = ("load", rows.start, rows.stop, rows.step) if isinstance(rows, slice) and not moves else None
        robot, bodies, load = piece.kept.get(key, (None, None, None))
        if robot is not self.robot or bodies is not self._bodies:
            load = regressor.torque(self.robot, self._bodies, part.q, part.qd, part.qdd, gravity=part.gravity, deflection=part.deflection)
            if key is not None:
                piece.kept[key] = self.robot, self._bodies, load
        return load

    def columns(self, piece: Piece, rows: slice, remembered: dict | None = None) -> list[np.ndarray]:
        """For each joint the columns (support in this piece, n) of the rows `rows` of a piece, filtered where its torque is.

        Args:
            rows: a slice, or the rows' numbers where nothing looks beside them (filter, `reach`).
            remembered: `remembered(piece)`, where it is at hand.
        """
        wide, inner = self.widened(piece, rows)
        if remembered is None:
            remembered = self.remembered(piece)
        part = self.seen_at(piece, wide, remembered)
        by_joint: list[list[np.ndarray]] = [[] for _ in self.robot.joints]
        for term, (effect, joints) in enumerate(self.terms):
            for joint in joints if effect.present(piece) else ():
                if isinstance(effect, TorqueEffect) and effect.memory:
                    by_joint[joint].append(remembered[term, joint][:, wide])
                elif isinstance(effect, TorqueEffect):
                    by_joint[joint].append(effect.columns(part, joint, **self.shapes_of(term, joint)))
                elif isinstance(effect, WrenchEffect):
                    for own, values in zip(by_joint, effect.columns(part, self.robot, **self.shapes_of(term, joint))):
                        own.append(values)
        first = wide.start if isinstance(wide, slice) else 0
        own = [piece.settled(self.sensed(np.concatenate(one), piece, joint), inner, joint, first) if one else None for joint, one in enumerate(by_joint)]
        room = [0 if one is None else len(one) for one in own]
        out = []
        for joint, (rigid, effects) in enumerate(zip(self._bodies_of(piece, part, wide, inner, room), own)):
            size = len(self._support_of_bodies[joint])
            if len(rigid) == size:
                rigid = rigid if effects is None else np.concatenate([rigid, effects])
            elif effects is not None:
                rigid[size:] = effects
            out.append(rigid)
        return out

    @cached_property
    def _support_of_bodies(self) -> list[np.ndarray]:
        """Of each joint, the bodies' parameters that enter its torque."""
        count = 10 * self.bodies
        return [own[own < count] for own in (self.support(joint) for joint in range(self.robot.dof))]

    def _bodies_of(self, piece: Piece, part: Piece, wide: slice, inner: slice, room: list[int]) -> list[np.ndarray]:
        """The bodies' columns (support, n) in each joint's torque at rows of a piece, seen as `part`, filtered; with `room` for as many
        more where nothing is to be done to them."""
        plain = piece.smoother is None and inner == slice(None) and not any(isinstance(effect, SensorEffect) for effect, _ in self.terms)
        spare = room if plain else [0] * self.robot.dof
        inertial = regressor.by_joint(self.robot, part.q, part.qd, part.qdd, gravity=part.gravity, deflection=part.deflection, room=spare)
        if plain:
            return inertial
        first = wide.start if isinstance(wide, slice) else 0
        return [piece.settled(self.sensed(own, piece, joint), inner, joint, first) for joint, own in enumerate(inertial)]

    def torque(self, piece: Piece, pi, c, stride: int = 1) -> np.ndarray:
        """Predicted torque (samples, dof) over a piece's core, of bodies pi (bodies, 10) and coefficients c.

        Args:
            stride: predict every `stride`-th sample only.
        """
        out = np.empty((-(-piece.samples // stride), self.robot.dof))
        remembered, effects = self.remembered(piece), list(acting(self, c))
        for rows in chunks(piece, stride * max(1, (_CHUNK if piece.smoother is None else 4 * _CHUNK) // stride)):
            wide, inner = self.widened(piece, slice(rows.start, rows.stop, stride))
            part = self.seen_at(piece, wide, remembered)
            predicted = regressor.torque(self.robot, pi, part.q, part.qd, part.qdd, gravity=part.gravity, deflection=part.deflection)
            add_over(predicted, effects, piece, part, wide, remembered, self.robot)
            predicted = predicted.T
            for joint in range(self.robot.dof):
                predicted[joint] = self.sensed(predicted[None, joint], piece, joint)[0]
            settled = np.stack([piece.settled(own, inner, joint, wide.start) for joint, own in enumerate(predicted)], axis=1)
            start = (rows.start - piece.core.start) // stride
            out[start : start + len(settled)] = settled
        return out

    def sensed(self, values: np.ndarray, piece: Piece, joint: int) -> np.ndarray:
        """What the sensor of a joint makes of torque (k, n) over rows of a piece."""
        for term, (effect, joints) in enumerate(self.terms):
            if isinstance(effect, SensorEffect) and joint in joints and effect.present(piece):
                values = effect.sensed(values, piece.step, **self.shapes_of(term, joint))
        return values

    def widened(self, piece: Piece, rows: slice) -> tuple[slice, slice]:
        """Rows with the margin that filters and effects need for them to come out as over the whole piece, and where the
        rows stand among these."""
        margin = self.reach
        if piece.smoother is None and not margin:
            return rows, slice(None)
        if piece.smoother is not None:
            # a recursive filter forgets slowly: six times its one-per-cent reach leaves 1e-13
            margin += piece.smoother.reach * (6 if piece.smoother.kind == "butterworth" else 1)
        wide = slice(max(0, rows.start - margin), min(len(piece.t), rows.stop + margin))
        return wide, slice(rows.start - wide.start, rows.stop - wide.start, rows.step)


def chunks(piece: Piece, size: int) -> Iterator[slice]:
    """The rows of a piece's core in runs of at most `size`."""
    for start in range(piece.core.start, piece.core.stop, size):
        yield slice(start, min(start + size, piece.core.stop))


def moving_coefficients(model: Model, motion: Motion) -> np.ndarray:
    """(coefficients,) bool: False for those of a joint that never moves or whose torque is not used, which no data can tell, and for
    those that are given."""
    silent = (*motion.still, *motion.unused)
    told = lambda c: c.given is None and (c.joint == ROBOT or model.robot.joints[c.joint] not in silent)  # noqa: E731
    out = np.array([told(c) for c in model.coefficients], dtype=bool)
    for at in {c.at for c in model.coefficients} - {None}:  # a joint may stand in all of a level's
        here = [piece for piece in motion.pieces if piece.levels.get(at[0]) == at[1]]
        stays = never_move(here) if here else np.ones(model.robot.dof, dtype=bool)
        out &= np.array([c.at != at or c.joint == ROBOT or not stays[c.joint] for c in model.coefficients], dtype=bool)
    return out
