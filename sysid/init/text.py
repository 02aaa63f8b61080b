"""A draft -> the YAML of an experiment, each guess with its reason above it."""

from __future__ import annotations

import json
import re
import textwrap

from .guess import Draft

_PLAIN = re.compile(r"(\.\./)*[A-Za-z_][\w./-]*( [\w./-]+)*")
_RESERVED = {"true", "false", "null", "on", "off", "yes", "no", "y", "n", "nan", "inf"}
_WIDTH = 100


def yaml(draft: Draft, command: str) -> str:
    """The experiment file. command: what wrote it."""
    lines = [
        *_comment(
            f"Written by `{command}`. Each guess has its reason above it: correct what is wrong.", 0
        )
    ]
    for note in draft.notes:
        lines += _comment(f"LOOK: {note}", 0)
    lines += _node(draft.tree, "", draft, 0)
    if draft.rest:
        lines += _comment(
            f"also logged: {', '.join(draft.rest[:40])}; effects may use them as data.signals", 0
        )
    return "\n".join(lines) + "\n"


def _node(tree: dict, at: str, draft: Draft, depth: int) -> list[str]:
    out = []
    for key, value in tree.items():
        path = f"{at}{key}"
        guess = draft.guesses.get(path)
        if guess is not None:
            out += _comment(str(guess), depth)
        if value == {} and guess is None:
            continue
        if isinstance(value, dict) and guess is None:
            out += ["  " * depth + f"{key}:", *_node(value, f"{path}.", draft, depth + 1)]
        else:
            out += _entry(key, value, depth)
    return out


def _entry(key: str, value, depth: int) -> list[str]:
    pad = "  " * depth
    line = f"{pad}{key}: {flow(value)}"
    if len(line) <= _WIDTH or not isinstance(value, (list, dict)):
        return [line]
    if isinstance(value, dict):
        return [
            f"{pad}{key}:",
            *(f"{pad}  {flow(name)}: {flow(own)}" for name, own in value.items()),
        ]
    return [f"{pad}{key}:", *(f"{pad}  - {flow(item)}" for item in value)]


def flow(value) -> str:
    """A plain value as YAML on one line; text is quoted where it would read as something else."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(key)}: {flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, str):
        plain = _PLAIN.fullmatch(value) and value.lower() not in _RESERVED
        return value if plain else json.dumps(value, ensure_ascii=False)
    return json.dumps(value)


def _comment(text: str, depth: int) -> list[str]:
    """Lines of a comment; whatever a log's names hold, it stays one."""
    pad = "  " * depth + "# "
    clean = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return textwrap.wrap(
        clean, _WIDTH, initial_indent=pad, subsequent_indent=pad, break_on_hyphens=False
    )
