"""Links far from their masses in the URDF, and the effect that brings them back.

A body far from its URDF is a symptom: what the model lacks stands in it. Of a robot whose URDF
has no rotors the links carry the motors' inertia. So a prior is tried whose weight is chosen;
then, under it, every effect that can hide in bodies, on all joints that lack it, on columns that
are compressed once: what adds torque first, then what bends motion or torque, by its slope. What
is named brings all masses back at no larger error on stretches held apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from . import rows
from .addition import command
from .blocks import within_one_error
from .compress import compress
from .estimate import Fit
from .held_apart import FEWEST, HeldApart, above, held_apart, judged, solved, strongest
from .linearised import Linearised
from .model import Model, moving_coefficients
from .model_parameters import ROBOT, Coefficient
from .motion import Motion
from .posed_problem import pose
from .prior_weight import PLAUSIBLE, USUAL
from .robot import Robot
from .triangles import Compressed
from .vocabulary import find, vocabulary

# A stronger prior is told that costs no more of the error, root mean square, than nobody sees; of
# so many, each three times the last
_UNSEEN, _STRONGER = 0.01, 8
SAYS_CHECK = " (`sysid check` says)"
_ROWS = 6000  # enough to tell masses from effects; a long log need not be read whole for it


@dataclass(frozen=True)
class Masses:
    """Links whose masses are not plausible, and what brings all of them back.

    far: (link, its joint, mass, the URDF's mass) [kg]. weight: of a prior, where that it is chosen
    is part of the cure. effect: a word of the vocabulary, "" where none is part of it; joints: that
    lack it, None for all or the robot. command: what adds it. doubted: columns may be wrong, and are
    asked first.
    """

    far: tuple[tuple[str, str, float, float], ...]
    weight: float | None = None
    effect: str = ""
    joints: tuple[str, ...] | None = None
    command: str = ""
    stronger: float | None = None
    costs: float = 0.0
    doubted: bool = False

    @property
    def says(self) -> str:
        """Which links, and what brings them back."""
        links = ", ".join(
            f"{name} {mass:.3g} kg ({urdf:.3g} kg)" for name, _, mass, urdf in self.far
        )
        return f"implausible masses, the URDF's in brackets: {links}; {self.do}"

    @property
    def do(self) -> str:
        """The cure, in words."""
        if self.doubted:
            return f"columns, signs or units may be wrong, and come first{SAYS_CHECK}"
        auto = "" if self.weight is None else f"`prior.weight: auto` (it takes {self.weight:g})"
        where = f" on {', '.join(self.joints)}" if self.joints else ""
        if self.stronger is not None:
            return (
                "no effect that can hide in them brings them back, and these logs hardly tell them: "
                f"`prior.weight: {self.stronger:g}` does, and costs {_percent(self.costs)} of the "
                "error on data held apart; where the URDF's are what is wrong, keep these"
            )
        if not (auto or self.effect):
            return (
                "no effect that can hide in them brings them back: columns or units may be wrong"
                f"{SAYS_CHECK}, or the logs do not tell them (a larger prior.weight)"
            )
        effect = f"the effect {self.effect}{where}" if self.effect else ""
        what = f"{effect} with {auto}" if effect and auto else effect or auto
        typed = f": `{self.command}`" if self.command else ""
        return f"{what} brings them back at no larger error on data held apart{typed}"


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share >= 1e-3 else "less than 0.1 %"


def document(found: Masses | None) -> dict:
    """What `fit.json` has of it; empty where there is nothing."""
    if found is None:
        return {}
    return {
        "far": [
            {"link": link, "joint": joint, "mass": mass, "urdf": urdf}
            for link, joint, mass, urdf in found.far
        ],
        "effect": found.effect or None,
        "joints": None if found.joints is None else list(found.joints),
        "prior_weight": found.weight,
        "stronger": found.stronger,
        "costs": found.costs,
        "command": found.command or None,
        "says": found.says,
        "do": found.do,
    }


def far(robot: Robot, pi) -> list[int]:
    """Numbers of the links of pi (bodies, 10) whose mass is not plausible; a link of which the URDF
    states no mass has none that it could be far from."""
    times = np.abs(np.log(np.maximum(pi[:, 0], 1e-300) / robot.prior[:, 0]))
    links = [b for b, body in enumerate(robot.bodies) if body.kind == "link"]
    return [b for b in links if times[b] > np.log(PLAUSIBLE) and _stated(robot, b)]


def _stated(robot: Robot, b: int) -> bool:
    link = robot.source.links.get(robot.bodies[b].name)
    return link is None or (link.inertial is not None and link.inertial[0] > 0.0)


def implausible(found: Fit, motion: Motion | None) -> Masses | None:
    """The links of a fit that are far from their URDF's masses, and a cure; None where none is far.

    Args:
        motion: of the training logs; None: no cure is looked for.
    """
    robot = found.model.robot
    listed = tuple(
        (
            robot.bodies[b].name,
            robot.bodies[b].joint,
            float(found.pi[b, 0]),
            float(robot.prior[b, 0]),
        )
        for b in far(robot, found.pi)
    )
    if not listed:
        return None
    return Masses(listed) if motion is None else replace(_cure(found, motion), far=listed)


def doubted(found: Masses | None, worse: bool) -> Masses | None:
    """The masses of a fit; without a cure where it is worse than none on a joint: its columns come
    first, for which what brings masses back may make up."""
    return Masses(found.far, doubted=True) if found and worse else found


@dataclass(frozen=True)
class _Columns:
    """What `pose` looks at of a model: its robot and the coefficients after its bodies."""

    robot: Robot
    coefficients: tuple[Coefficient, ...]

    @property
    def bodies(self) -> int:
        """Number of bodies."""
        return len(self.robot.bodies)


@dataclass(frozen=True)
class _Asked:
    """Data with the columns of what may join: the bodies under a weight of the prior, and squares
    (stretches, joints) of each stretch held apart, rows (stretches, joints). bounds: between which
    the last coefficients may be."""

    found: Fit
    data: Compressed
    coefficients: tuple[Coefficient, ...]
    moving: np.ndarray
    bounds: tuple[tuple[float, float], ...] = ()

    @property
    def _posing(self) -> tuple:
        model = _Columns(self.found.model.robot, self.coefficients)
        return self.found.experiment, model, self.data, self.moving, self.found.prior

    @cached_property
    def apart(self) -> HeldApart:
        """Its stretches."""
        return held_apart(*self._posing, self.found.weights)

    def plausible(self, weight: float) -> bool:
        """Whether all masses are, and slopes are gone along no farther than their values may go:
        nothing tells a tilt about the axis that two joints share, and 9000 rad of it took a mass."""
        x = solved(pose(*self._posing, self.found.weights), weight)
        last = x[len(x) - len(self.bounds) :]
        if not all(low <= value <= high for value, (low, high) in zip(last, self.bounds)):
            return False
        robot = self.found.model.robot
        return not far(robot, x[: 10 * len(robot.bodies)].reshape(-1, 10))

    def error(self, weight: float, before: np.ndarray) -> float:
        """Its error in units of that of `before`, squares (stretches, joints); infinite where it is
        larger by more than one standard error."""
        errors, _ = judged(np.array([before, self.apart.squares(weight)]), self.apart.rows)
        return (
            float(errors[1].mean() / errors[0].mean()) if within_one_error(errors, 0)[1] else np.inf
        )


def _cure(found: Fit, motion: Motion) -> Masses:
    moving = moving_coefficients(found.model, motion)
    now = _Asked(found, found.compressed, found.model.coefficients, moving)
    weight, chosen = found.strength.value, None
    if not found.strength.auto and found.compressed.blocks >= FEWEST:
        weight = chosen = strongest(now.apart).value
        before = now.apart.squares(found.strength.value)
        if now.plausible(weight) and now.error(weight, before) < np.inf:
            return Masses((), weight)
    thin = rows.stride_for(motion, _ROWS)
    for bends in (False, True):
        passed = _passed(found, motion, thin, weight / thin, bends)
        if passed:
            effect, joints = min(passed, key=passed.get)
            typed = command(found.experiment.path, effect, list(joints) if joints else None, {})
            return Masses((), chosen, effect, joints, typed)
    return _stronger(now) if found.compressed.blocks >= FEWEST else Masses(())


def _stronger(now: _Asked) -> Masses:
    """The strongest prior that hardly costs anything, where it brings all masses back."""
    given, found = now.found.strength.value, Masses(())
    before, weight = now.apart.squares(given), given or USUAL
    for _ in range(_STRONGER):
        weight = above(weight)
        errors, _ = judged(np.array([before, now.apart.squares(weight)]), now.apart.rows)
        costs = float(np.sqrt(errors[1].mean() / errors[0].mean())) - 1.0
        if costs > _UNSEEN:
            break
        if now.plausible(weight):
            found = Masses((), stronger=weight, costs=costs)
    return found


def _passed(found: Fit, motion: Motion, thin: int, weight: float, bends: bool) -> dict:
    """{(effect, joints that lack it, None for all): error} of those that bring all masses back.

    Args:
        bends: whether those that bend motion or torque are tried, or those that add torque.
    """
    wide = _widened(found.model, motion, bends)
    if wide is found.model:
        return {}
    x = np.zeros(wide.size)
    x[: found.model.size] = np.append(found.prior.ravel(), found.coefficients)
    source = Linearised(wide, x) if bends else wide
    data = compress(source, motion, thin=thin)
    base, names = range(found.model.size), found.model.coefficients
    was = _Asked(found, data.only(base), names, moving_coefficients(found.model, motion))
    before, out = was.apart.squares(found.strength.value / thin), {}
    for term, (effect, joints) in enumerate(
        wide.terms[len(found.model.terms) :], len(found.model.terms)
    ):
        bounds: tuple[tuple[float, float], ...] = ()
        if bends:
            free = [(wide.shape_values[k], wide.shapes[k]) for k in source.free]
            slopes = [k for k, (value, _) in enumerate(free) if value.term == term]
            own = [free[k] for k in slopes]
            more = [Coefficient(effect.name, v.joint, v.name, v.unit, False) for v, _ in own]
            bounds = tuple((v.low - at, v.high - at) for v, at in own)
            columns = [wide.size + k for k in slopes]
        else:
            more = [c for c in wide.coefficients[len(names) :] if c.effect == effect.name]
            columns = [10 * wide.bodies + wide.coefficients.index(c) for c in more]
        joined = (*names, *more)
        moves = moving_coefficients(_Columns(wide.robot, joined), motion)
        asked = _Asked(found, data.only([*base, *columns]), joined, moves, bounds)
        if asked.plausible(weight) and (error := asked.error(weight, before)) < np.inf:
            every = len(joints) == wide.robot.dof or joints == (ROBOT,)
            out[effect.name, None if every else tuple(wide.robot.joints[j] for j in joints)] = error
    return out


def _widened(model: Model, motion: Motion, bends: bool) -> Model:
    """The model with every effect that can hide in bodies, on all joints that lack it."""
    there, wide = (
        {(effect.name, joint) for effect, joints in model.terms for joint in joints},
        model,
    )
    for effect in map(find, vocabulary()):
        if not effect.mimics_mass or bool(effect.shapes()) is not bends:
            continue
        every = (ROBOT,) if effect.scope == "robot" else range(model.robot.dof)
        if joints := tuple(joint for joint in every if (effect.name, joint) not in there):
            wide = wide.with_effect(effect.bound(model.robot, joints[0]), joints)
    return wide.scaled_by(motion) if wide is not model else model
