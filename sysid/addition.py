"""An effect that joins an experiment: as its file would say it, as a command that is typed, as the experiment that comes of it."""

from __future__ import annotations

import shlex

from .config import EffectSpec, Experiment


def spelled(candidate, joint: str) -> tuple[str, list[str] | None, dict]:
    """A candidate as an experiment file names it: word, joints, options."""
    spec = getattr(candidate.effect, "spelled", None)
    name, own = (candidate.name, {}) if spec is None else spec
    return name, None if joint == "*" else [joint], {**own, **dict(candidate.options)}


def grown(experiment: Experiment, effect: str, joints: list[str] | None, options: dict) -> Experiment:
    """The experiment with one more effect, as its file would say it."""
    spec = EffectSpec(name=effect, joints=joints, options=options)
    model = experiment.model.model_copy(update={"effects": [*experiment.model.effects, spec]})
    return experiment.model_copy(update={"model": model})


def command(path, effect: str, joints: list[str] | None, options: dict) -> str:
    """What is typed to add an effect to the experiment in a file."""
    target = path.parent if path.name == "config.yaml" else path
    words = ["sysid", "add", str(target), effect]
    for joint in joints or []:
        words += ["--joint", joint]
    for name, value in options.items():
        words += ["--option", f"{name}={value}"]
    return shlex.join(words)
