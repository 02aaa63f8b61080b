"""An experiment file that cannot be: the line, the key, what is allowed."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from .errors import ConfigError
from .specs import EffectSpec, Experiment
from .vocabulary import find, vocabulary
from .yaml_text import plain


def line_of(tree, location: tuple) -> int | None:
    """The line (from 1) of the deepest part of a location that the file itself holds."""
    line, node = None, tree
    for step in location:
        try:
            if isinstance(node, dict) and step not in node:
                if same := [key for key in node if str(plain(key)) == str(step)]:
                    step = same[0]  # pydantic shows a key that is no text as text
                else:
                    (node,) = node.values()  # an effect's options stand under its name
            line = (node.lc.key(step) if isinstance(node, dict) else node.lc.item(step))[0] + 1
            node = node[step]
        except (AttributeError, KeyError, IndexError, TypeError, ValueError):
            break
    return line


def keys_of(model) -> list[str]:
    """The keys that a class of specs has."""
    return [field.alias or name for name, field in model.model_fields.items() if (model, name) not in ((Experiment, "path"), (EffectSpec, "name"), (EffectSpec, "options"))]


def _model_at(location: tuple):
    """The model whose keys are allowed at the parent of a location."""
    model: Any = Experiment
    for step in location[:-1]:
        if isinstance(step, int) or not isinstance(model, type):
            continue
        field = model.model_fields.get(step)
        if field is None:
            continue
        found = inner_model(field.annotation)
        model = found or model
    return model


def inner_model(annotation):
    """The class of specs that an annotation holds; None where it holds none."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        if (found := inner_model(argument)) is not None:
            return found
    return None


def _spelled(location: tuple) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in location).lstrip(".")


def _of_effect(tree, location: tuple) -> list[str]:
    """The keys that an effect of the catalogue has beside those of every entry; none elsewhere."""
    if location[:2] not in (("model", "effects"), ("model", "candidates")) or len(location) != 4:
        return []
    entry = tree["model"][location[1]][location[2]]
    (name,) = entry if isinstance(entry, dict) and len(entry) == 1 else ("",)
    return own_keys(str(name)) if name in vocabulary() else []


def own_keys(name: str) -> list[str]:
    """The keys that an effect of the catalogue has beside those of every entry: its options, and its shape values, which may be held or be
    told where to be searched."""
    effect = find(name)
    return [*effect.options, *(shape.name for shape in effect.shapes())]


def unknown_key(tree, location: tuple, path: Path) -> ConfigError:
    """A key that is not known, with those that it may have been."""
    key, parent = str(location[-1]), _spelled(location[:-1])
    keys = [*_of_effect(tree, location), *keys_of(_model_at(location))]
    close = difflib.get_close_matches(key, keys, n=3, cutoff=0.4) or keys
    line = line_of(tree, location)
    return ConfigError(
        f"unknown key {key!r}" + (f" in {parent}" if parent else ""),
        where=f"{path} line {line}" if line else str(path),
        allowed=", ".join(close),
        do="correct or remove the key",
    )


_SAID = {
    "model_type": "must be a mapping of keys to values", "dict_type": "must be a mapping of names to values", "list_type": "must be a list",
    "float_type": "must be a number", "int_type": "must be a whole number", "string_type": "must be text", "missing": "is missing",
    "finite_number": "must be a finite number", "invalid_key": "a key must be text",
}  # fmt: skip


def named(error: ValidationError, tree, path: Path) -> ConfigError:
    """The first mistake of pydantic's list, as one line with the file's line number."""
    found = sorted(error.errors(), key=lambda e: (e["type"] != "extra_forbidden", line_of(tree, e["loc"]) or 0))[0]
    location, kind, context = found["loc"], found["type"], found.get("ctx", {})
    if location[-1:] == ("name",) and location[:2] == ("model", "effects"):
        location = location[:-1]  # an effect's name is its place in the list
    if kind == "extra_forbidden":
        return unknown_key(tree, location, path)
    if kind in ("too_short", "too_long"):
        needed = context.get("min_length") if kind == "too_short" else context.get("max_length")
        bound, entries = "at least" if kind == "too_short" else "at most", "entry" if needed == 1 else "entries"
        said = f"must have {bound} {needed} {entries}, not {context.get('actual_length')}"
    else:
        said = _SAID.get(kind, found["msg"].removeprefix("Value error, ").replace("Input should be", "must be"))
    return refused(location, said, found.get("input"), tree, path)


def refused(location: tuple, said: str, given, tree, path: Path) -> ConfigError:
    """A value that cannot be, with where it stands."""
    shown = (
        f" (given: {str(given)[:60]!r})"
        if isinstance(given, str)
        else f" (given: {str(given)[:60]})"
        if isinstance(given, (int, float, type(None)))
        else ""
    )
    line = line_of(tree, location)
    return ConfigError(f"{_spelled(location)}: {said}{shown}", where=f"{path} line {line}" if line else str(path))
