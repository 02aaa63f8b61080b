"""An effect that joins an experiment: as its file would say it, as a command that is typed, as the experiment that comes of it."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

from .specs import EffectSpec, Experiment
from .vocabulary import find, vocabulary

#: below it a probability is told as "less than"
LIKELY = 0.01


def spelled(candidate, joint: str) -> tuple[str, list[str] | None, dict]:
    """A candidate as an experiment file names it: word, joints, options."""
    spec = getattr(candidate.effect, "spelled", None)
    name, own = (candidate.name, {}) if spec is None else spec
    options = {k: list(v) if isinstance(v, tuple) else v for k, v in candidate.options}
    return name, None if joint == "*" else [joint], {**own, **options}


def grown(
    experiment: Experiment, effect: str, joints: list[str] | None, options: dict, *, every: Sequence[str] = ()
) -> Experiment:  # fmt: skip
    """The experiment with one more effect, as its file would say it; with options, in the place of
    the same effect with others on these joints.

    Args:
        every: the robot's joints, which an entry without `joints` stands for.
    """
    spec = EffectSpec(name=effect, joints=joints, options=options)
    rest = [one for old in experiment.model.effects if (one := _apart(old, spec, every)) is not None]
    model = experiment.model.model_copy(update={"effects": [*rest, spec]})
    return experiment.model_copy(update={"model": model})


def _apart(old: EffectSpec, new: EffectSpec, every: Sequence[str]) -> EffectSpec | None:
    if old.name != new.name or "formula" in new.options:
        return old
    there = list(every) if old.joints is None else old.joints
    left = remaining(there, old.options, new.joints, new.options)
    return old if left is None else old.model_copy(update={"joints": left}) if left else None


def remaining(there: Sequence[str], had: dict, joints: Sequence[str] | None, options: dict) -> list[str] | None:
    """The joints that keep an effect as it is where it comes again with other options; None where it does not take
    its place: it has no options, the same ones, or other joints. What is per group on every joint takes every joint's place."""
    if joints is None and "per" in options and options != had:
        return []
    if not options or options == had or joints is None or not set(joints) & set(there):
        return None
    return [joint for joint in there if joint not in joints]


def typed(path: Path) -> Path:
    """An experiment's file as it is typed: its folder, or the file where it has a name of its own."""
    return path.parent if path.name == "config.yaml" else path


def flow(value) -> str:
    """An option's value as YAML has it on one line; of a list as JSON has it, which YAML reads."""
    return json.dumps(list(value), ensure_ascii=False) if isinstance(value, (list, tuple)) else str(value)


def command(path, effect: str, joints: list[str] | None, options: dict) -> str:
    """What is typed to add an effect to the experiment in a file."""
    words = ["sysid", "add", str(typed(path)), effect]
    for joint in joints or []:
        words += ["--joint", joint]
    for name, value in options.items():
        words += ["--option", f"{name}={flow(value)}"]
    return shlex.join(words)


def apart(head: tuple[str, str], others) -> list[str]:
    """An effect and what it is not told from, as `sysid design --separate` names them; nothing where no motion can tell them."""
    told = likely(others) or others[:1]
    return told_by_motion([head, *(m[:2] for m in told)])


def told_by_motion(suspects: Sequence[tuple[str, str]]) -> list[str]:
    """Of (effect, joint) those that a motion may tell from each other, as `sysid design --separate` names them: of some that are one
    while a joint moves the first; nothing of one alone."""
    each: dict[tuple, str] = {}
    for effect, joint in suspects:
        if moved(effect):
            each.setdefault((frozenset((effect, *same_in_motion(effect))), joint), f"{effect}:{joint}")
    return list(each.values()) if len(each) > 1 else []


def same_in_motion(effect: str) -> tuple[str, ...]:
    """The effects of which one of that name cannot be told while its joint moves."""
    return find(effect).same_in_motion if effect in vocabulary() else ()


def likely(others) -> list:
    """Of what an effect is not told from, (effect, joint, probability), what is likely enough to be worth a motion."""
    return [m for m in others if m[2] >= LIKELY]


def moved(effect: str) -> bool:
    """Whether a motion can show an effect of that name: not what is there in some logs and not in others, whatever moves."""
    return not (effect in vocabulary() and find(effect).needs_logs)


def one_in_motion(fit) -> list[str]:
    """Effects in the model of a fit that may be others, which no motion tells from them."""
    own = [(effect, j) for effect, joints in fit.model.terms for j in joints]
    there = {(effect.name, j) for effect, j in own}
    return [
        f"{effect.name} on {fit.joints[j]}, which is in the model, may be {other} as well: while the "
        f"joint moves they are one. What tells them: {effect.separate_by}"
        for effect, j in own
        for other in effect.same_in_motion
        if (other, j) not in there
    ]


def designs(added: str, head: tuple[str, str], others) -> str:
    """What is typed for a motion that separates an effect (effect, joint), which the command
    `added` adds, from those it is not told from: (effect, joint, probability); empty where none can."""
    suspects = apart(head, others)
    return separating(shlex.split(added)[2], suspects) if suspects else ""


def separating(target: str, suspects: Sequence[str]) -> str:
    """What is typed for a motion that tells suspects EFFECT:JOINT of an experiment, as it is typed, from each other."""
    return shlex.join(["sysid", "design", target, "--separate", ",".join(suspects), "--out", "next"])


def another_log(path) -> str:
    """What is typed for the motion that tells most of what the logs of an experiment's file leave open."""
    return shlex.join(["sysid", "design", str(typed(path)), "--out", "next"])
