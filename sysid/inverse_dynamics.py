"""q, qd, qdd -> torque of a model at its parameters, at the speed of Pinocchio's own inverse
dynamics: for a controller.

`Model.torque` predicts a log, with all that looks back in time. Here an instant stands for itself:
every effect whose torque follows from q, qd and qdd of that instant takes part, the others are
named in `omitted`.

Bodies and rotors are put once into a Pinocchio model of the full tree, tau = G' rnea(G q, G qd, G
qdd). Of effects that act on each joint by itself the joints are treated as samples of one joint,
so that one call serves all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from . import own_effects, regressor
from .drives import DRIVE_EFFECTS
from .effect import Effect, MotionEffect, SensorEffect
from .errors import SysidError
from .instants import Instants, at_no_time
from .model import Model
from .model_parameters import place
from .needed import Acting, add, behind
from .robot import Robot

NOWHERE: Mapping[str, str] = MappingProxyType({})
_CHUNK = 4096  # samples: the arrays of one body stay in cache
# Up to so many samples calls one by one are faster than arrays over all of them, whose overhead is
# about a millisecond.
_FEW = 500


@dataclass(frozen=True)
class _Rigid:
    """Bodies pi (bodies, 10) of a robot as a Pinocchio model of the full tree."""

    robot: Robot
    pi: np.ndarray
    model: pin.Model
    data: pin.Data
    drive: np.ndarray | None  # G, None where it changes nothing

    @classmethod
    def of(cls, robot: Robot, pi) -> _Rigid:
        model = robot.with_inertias(pi)
        plain = np.array_equal(robot.transmission, np.eye(robot.dof))
        return cls(
            robot, pi, model, model.createData(), None if plain else np.array(robot.transmission)
        )

    def one(self, q, qd, qdd) -> np.ndarray:
        """Torque (dof,) of one sample."""
        if self.drive is None:
            return pin.rnea(self.model, self.data, q, qd, qdd)
        drive = self.drive
        return pin.rnea(self.model, self.data, drive @ q, drive @ qd, drive @ qdd) @ drive

    def many(self, q, qd, qdd, gravity=None) -> np.ndarray:
        """Torque (n, dof) of samples (n, dof); gravity (3,) where it is not the robot's own."""
        if len(q) > _FEW:
            return regressor.torque(self.robot, self.pi, q, qd, qdd, gravity=gravity)
        self.model.gravity.linear = self.robot.gravity if gravity is None else np.asarray(gravity)
        return np.array([self.one(*sample) for sample in zip(q, qd, qdd)]).reshape(q.shape)


@dataclass(frozen=True)
class _Alike:
    """An elementwise effect on all joints at once: k coefficients (dof,), zero on joints that lack
    it; shape values (dof,)."""

    effect: Effect
    coefficients: tuple[np.ndarray, ...]
    shapes: dict[str, np.ndarray]


@dataclass(frozen=True)
class InverseDynamics:
    """Torque of an identified model, one sample or many at a time; see `inverse_dynamics`.

    joints: names, in the order of every array. omitted: effects that it leaves out as they look
        back in time, at a clock, or at other signals than q, qd and qdd, as `effect.joint`.

    It holds the working memory of Pinocchio: threads need one each.
    """

    joints: tuple[str, ...]
    omitted: tuple[str, ...]
    _bodies: _Rigid
    _load: _Rigid | None
    _behind: tuple[Acting, ...] | None
    _alike: tuple[_Alike, ...]
    _single: tuple[Acting, ...]
    _moving: tuple[Acting, ...]
    _sensors: tuple[Acting, ...]

    def __repr__(self) -> str:
        left = f"; without {', '.join(self.omitted)}" if self.omitted else ""
        return f"<InverseDynamics of {', '.join(self.joints)}{left}>"

    def __call__(self, q, qd, qdd) -> np.ndarray:
        """Torque [N m or N] of one sample (dof,) or many (n, dof), in the shape of q.

        Args:
            q, qd, qdd: positions [rad or m], velocities and accelerations, all (dof,) or all (n,
                dof).

        Raises:
            SysidError: shapes that are neither, or not alike.
        """
        dof = len(self.joints)
        try:
            q, qd, qdd = (np.asarray(x, dtype=float) for x in (q, qd, qdd))
        except (TypeError, ValueError):
            raise _refused("q, qd or qdd is no array of numbers", self.joints) from None
        shapes = {q.shape, qd.shape, qdd.shape}
        if len(shapes) > 1 or q.ndim not in (1, 2) or q.shape[-1] != dof:
            raise _refused(f"q, qd and qdd are {q.shape}, {qd.shape}, {qdd.shape}", self.joints)
        if q.ndim == 1:
            return self._one(q, qd, qdd)
        if len(q) <= _CHUNK:
            return self._torque(q, qd, qdd)
        parts = (slice(start, start + _CHUNK) for start in range(0, len(q), _CHUNK))
        return np.concatenate([self._torque(q[rows], qd[rows], qdd[rows]) for rows in parts])

    def _one(self, q, qd, qdd) -> np.ndarray:
        if self._moving or self._single or self._sensors:
            return self._torque(q[None], qd[None], qdd[None])[0]
        load = None if self._load is None else self._load.one(q, qd, qdd)
        out = self._bodies.one(q, qd, qdd)
        if self._alike:
            self._add_alike(out, q, qd, qdd, load)
        return out

    def _torque(self, q, qd, qdd) -> np.ndarray:
        part, gravity = None, None
        if self._moving or self._single:
            part = at_no_time(q, qd, qdd)
            for own in self._moving:
                part = own.effect.moved(part, own.joint, **own.shapes)
            q, qd, qdd, gravity = part.q, part.qd, part.qdd, part.gravity
        load = None if self._load is None else self._load.many(q, qd, qdd, gravity)
        if part is not None:
            part = replace(part, load=load)
        if self._behind is not None:
            needed = load.copy()
            add(needed, self._behind, part, self._bodies.robot)
            part = replace(part, needed=needed)
        if len(q) == 1 and gravity is None:
            out = self._bodies.one(q[0], qd[0], qdd[0])[None]
        else:
            out = self._bodies.many(q, qd, qdd, gravity)
        if self._alike:
            self._add_alike(out.reshape(-1), q, qd, qdd, load, len(q))
        add(out, self._single, part, self._bodies.robot)
        for own in self._sensors:
            out[:, own.joint] = own.effect.sensed(out[None, :, own.joint], 1.0, **own.shapes)[0]
        return out

    def _add_alike(self, out, q, qd, qdd, load, n: int = 1) -> None:
        """Add what elementwise effects make of n samples to out (n dof,), the joints being so many
        samples of one."""
        part = Instants(q, qd, qdd, load)
        for own in self._alike:
            coefficients, shapes = own.coefficients, own.shapes
            if n > 1:
                coefficients = [np.tile(c, n) for c in coefficients]
                shapes = {name: np.tile(at, n) for name, at in shapes.items()}
            for coefficient, column in zip(coefficients, own.effect.columns(part, 0, **shapes)):
                out += coefficient * column


def _refused(what: str, joints: tuple[str, ...]) -> SysidError:
    allowed = f"all ({len(joints)},) or all (samples, {len(joints)})"
    do = f"the joints are {', '.join(joints)}"
    return SysidError(what, where="torque", allowed=allowed, do=do)


def inverse_dynamics(model: Model, x, levels: Mapping[str, str] = NOWHERE) -> InverseDynamics:
    """The inverse dynamics of a model at its parameters.

    Included is every effect whose torque follows from q, qd and qdd of one instant: friction and
    its Stribeck bump, armature, springs, cogging, coupling, loads, biases, gains, tilt, encoder
    offsets, formulas. What looks back in time (`presliding`, `backlash`, `elasticity`, `delay`,
    `current_lag`), at the clock (`external_force`, `warmup`, a payload of some logs, a formula of
    t) or at logged signals is left out, and named by `omitted`.

    Args:
        x: (size,) of all linear parameters, as `Fit.x`.
        levels: {group: level} of every group of logs that effects are per.

    Raises:
        SysidError: a group that effects are per is left out, or has no such level.
    """
    model, x = model.at(levels, x)
    robot, count = model.robot, 10 * model.bodies
    pi, rest = np.asarray(x)[:count].reshape(-1, 10), np.asarray(x)[count:]
    kept: dict[str, list] = {"alike": [], "single": [], "moving": [], "sensors": []}
    omitted, uses_load, k = [], False, 0
    for term, (effect, joints) in enumerate(model.terms):
        size = len(effect.coefficients())
        own = rest[k : k + size * len(joints)].reshape(len(joints), size)
        k += size * len(joints)
        named = [model.shapes_of(term, joint) for joint in joints]
        if isinstance(effect, DRIVE_EFFECTS):
            continue  # torque is the joint's, whatever turns it
        if not (effect.instantaneous and _keeps_its_word(effect, robot, joints, named)):
            omitted += [f"{effect.name}.{place(joint, robot.joints)}" for joint in joints]
            continue
        uses_load |= effect.uses_load
        if effect.elementwise and not effect.uses_needed:
            kept["alike"].append(_alike(effect, robot.dof, joints, own, named))
            continue
        kind = (
            "moving"
            if isinstance(effect, MotionEffect)
            else "sensors"
            if isinstance(effect, SensorEffect)
            else "single"
        )
        kept[kind] += [
            Acting(term, joint, effect, c, at) for joint, c, at in zip(joints, own, named)
        ]
    load = (
        _Rigid.of(robot, robot.prior if model.reference is None else model.reference)
        if uses_load
        else None
    )
    return InverseDynamics(
        robot.joints,
        tuple(omitted),
        _Rigid.of(robot, pi),
        load,
        _behind(model, kept["single"]),
        **{f"_{kind}": tuple(v) for kind, v in kept.items()},
    )


def _behind(model: Model, single: list[Acting]) -> tuple[Acting, ...] | None:
    """What acts beside the load where an effect looks at what is needed, None where none does or
    nobody knows."""
    if not model.referred or not any(own.effect.uses_needed for own in single):
        return None
    return tuple(one for one in behind(model) if one.effect.instantaneous)


def _keeps_its_word(
    effect: Effect, robot: Robot, joints: tuple[int, ...], shapes: list[dict]
) -> bool:
    """Whether an effect that a user wrote is as instantaneous as it says; those of the vocabulary
    are tested."""
    own = "spelled" in vars(effect)
    return not own or all(
        own_effects.instantaneous(effect, robot, *at) for at in zip(joints, shapes)
    )


def _alike(
    effect: Effect, dof: int, joints: tuple[int, ...], coefficients: np.ndarray, shapes: list[dict]
) -> _Alike:
    c = np.zeros((coefficients.shape[1], dof))
    c[:, list(joints)] = coefficients.T
    # a joint without the effect gets the shape values of one that has it: its coefficient is zero
    values = {name: np.full(dof, at) for name, at in (shapes[0].items() if shapes else ())}
    for joint, own in zip(joints, shapes):
        for name, at in own.items():
            values[name][joint] = at
    return _Alike(effect, tuple(c), values)
