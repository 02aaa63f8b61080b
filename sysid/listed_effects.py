"""From the effects that an experiment lists to a model: found by name, with their options, on their joints."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from . import own_effects
from .effect import Effect, LinkEffect
from .effect_parameters import Asked, Shape
from .errors import ConfigError, meant
from .formula import Formula
from .model import Model
from .model_parameters import ROBOT, holds
from .per_level import at_level
from .robot import Robot
from .specs import is_own
from .terms import initial
from .vocabulary import find
from .warned import warn


def build(robot: Robot, effects, folder: Path = Path(), signals=(), groups: Mapping[str, Mapping] = MappingProxyType({})) -> Model:
    """The model of an experiment's `model.effects`; files of own effects are relative to `folder`, `signals` are logged, `groups` are
    {group: {level: its logs}}.

    Raises:
        ConfigError: an effect or joint that is not there, or an effect twice on a joint, or an option it does not have, or
            an own effect that fails.
    """
    terms, seen, held = [], set(), {}
    for spec in effects:
        effect = found(spec, folder, signals)
        if effect.scope == "robot" and spec.joints is not None:
            raise ConfigError(f"model.effects: {effect.name} is an effect of the whole robot", allowed="no joints", do="leave `joints` out")
        if effect.needs_logs and effect.logs is None and spec.per is None:
            raise ConfigError(f"model.effects: {effect.name} needs logs", allowed="the logs that have it, as logs: [after.csv]", do="name them, or the group that it is per")
        names = ["*"] if effect.scope == "robot" else spec.joints if spec.joints is not None else list(robot.joints)
        joints = []
        for name in names:
            if effect.scope != "robot" and name not in robot.joints:
                raise ConfigError(f"model.effects: {effect.name} names the joint {name!r}", allowed=", ".join(robot.joints), do=meant(name, robot.joints, "leave the joint out for all of them"))
            if (effect.name, name) in seen:
                where = "" if name == "*" else f" on joint {name!r}"
                do = "give each a `name` of its own" if "formula" in spec.options else "leave one out"
                raise ConfigError(f"model.effects: {effect.name} stands twice{where}", do=do)
            seen.add((effect.name, name))
            joints.append(ROBOT if effect.scope == "robot" else robot.joints.index(name))
        for joint in joints:
            effect = effect.bound(robot, joint)
            if is_own(spec.name):
                own_effects.check(effect, robot, joint)
        for own in _levels(effect, spec, groups):
            held |= holds(len(terms), own, joints)
            terms.append((own, tuple(joints)))
    made = Model(robot, tuple(terms), held=tuple(held.items()))
    return made.with_shapes(initial(made))


def _levels(effect: Effect, spec, groups: Mapping[str, Mapping]) -> list[Effect]:
    """An effect at each level of the group that it is per, but for those that its entry excepts; itself where it is in all logs."""
    if spec.per is None:
        return [effect]
    if named := [name for name in ("logs", "stretches") if getattr(effect, name, None) is not None]:
        raise ConfigError(f"model.effects: {effect.name} has both {named[0]} and per", allowed="one of them", do=f"leave {named[0]} out: data.groups says which logs")
    levels = tuple(groups[spec.per])
    own = [level for level in levels if level not in (spec.spared or ())]
    if effect.mimics_mass and isinstance(effect, LinkEffect) and len(own) == len(levels):
        warn(f"{effect.name} is in every log: what all levels of {spec.per} share of it is the link's own, and the prior alone tells them apart; except: [LEVEL] names the logs without it")
    return [at_level(effect, spec.per, level, levels) for level in own]


def found(spec, folder: Path = Path(), signals=()) -> Effect:
    """The effect that an entry of `model.effects` names, with its options; a file of own effects is relative to `folder`.

    Args:
        signals: names of logged signals, which formulas may use.

    Raises:
        ConfigError: there is none, or not with these options.
    """
    if "formula" in spec.options:
        effect = Formula(spec.options["formula"], spec.options.get("name", "formula"), signals)
        own = {name: value for name, value in spec.options.items() if name not in ("formula", "name")}
    else:
        effect = own_effects.load(spec.name, folder) if is_own(spec.name) else find(spec.name)
        own = spec.options
    words = {shape.name for shape in effect.shapes()}
    chosen = effect.given(**{name: value for name, value in own.items() if name not in words})
    shapes = {shape.name: shape for shape in chosen.shapes()}
    if idle := sorted(words & set(own) - set(shapes)):
        raise ConfigError(f"model.effects: {effect.name} with these options has no {idle[0]}", do="leave it out")
    asked = {name: _asked(effect, shapes[name], value) for name, value in own.items() if name in shapes}
    if asked:
        vars(chosen)["asked"] = asked
    if "formula" in spec.options or is_own(spec.name):
        vars(chosen)["spelled"] = (spec.name, dict(spec.options))
    return chosen


_SAYS = "a number, which is then held, or {start: number, within: [low, high]}"


def _number(effect: Effect, word: str, value) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise ConfigError(f"model.effects: {effect.name}.{word} is {value!r}", allowed=_SAYS, do="give a number or leave it out")
    return float(value)


def _asked(effect: Effect, shape: Shape, value) -> Asked:
    """What an entry says of a shape value."""
    if not isinstance(value, dict):
        return Asked(held=_number(effect, shape.name, value))
    where = f"model.effects: {effect.name}.{shape.name}"
    if not value or set(value) - {"start", "within"}:
        odd = sorted(map(str, set(value) - {"start", "within"}))
        raise ConfigError(f"{where} has {'the key ' + repr(odd[0]) if odd else 'neither start nor within'}", allowed=_SAYS)
    start = None if value.get("start") is None else _number(effect, f"{shape.name}.start", value["start"])
    bounds = value.get("within")
    if bounds is not None:
        if not isinstance(bounds, (list, tuple)) or len(bounds) != 2:
            raise ConfigError(f"{where}.within is {bounds!r}", allowed="[low, high]")
        bounds = tuple(_number(effect, f"{shape.name}.within", end) for end in bounds)
        if not bounds[0] < bounds[1]:
            raise ConfigError(f"{where}.within is {list(bounds)}", allowed="[low, high], the low below the high")
        if start is not None and not bounds[0] <= start <= bounds[1]:
            raise ConfigError(f"{where}.start is {start:g}, outside {list(bounds)}", do="move the start or widen `within`")
    # of a vocabulary effect a value that has no negative side has none in any file
    signed = "formula" in effect.options or shape.low < 0
    lowest = min(x for x in (start, *(bounds or ())) if x is not None)
    if not signed and (lowest < 0 or (lowest == 0 and shape.low > 0)):
        raise ConfigError(f"{where} may be {lowest:g}", allowed="values above zero" if shape.low > 0 else "values from zero on")
    return Asked(start, bounds)
