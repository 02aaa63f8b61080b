"""An effect's entry in the text of an experiment file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import contextmanager
from pathlib import Path

from . import yaml_edit, yaml_text
from .addition import remaining
from .errors import ConfigError, SysidError
from .trusted import Untrusted


def with_effect(
    text: str, effect: str, joints: list[str] | None, options: dict, where: str = "", *, every: Sequence[str] = ()
) -> str:  # fmt: skip
    """The text of an experiment file with one more effect, its comments kept. With options, it takes the place of the same
    effect with others on these joints.

    Args:
        joints: None for every joint, or for an effect of the whole robot. every: the robot's joints.

    Raises:
        ConfigError: the effect is there already.
    """
    return yaml_edit.edited(text, lambda tree: _join(tree, effect, joints, options, where, every), where=where)


def _join(tree, effect: str, joints: list[str] | None, options: dict, where: str, every: Sequence[str]) -> None:
    """Put an effect into the tree of an experiment file."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

    model = tree.setdefault("model", CommentedMap())
    if model.get("effects") is None:
        model["effects"] = CommentedSeq(["viscous", "coulomb"])
        model["effects"].fa.set_flow_style()
    listed = model["effects"]
    formula = options.get("formula") if effect == "formula" else None
    if effect == "formula" and formula is None:
        raise ConfigError("add formula: which formula?", allowed="--option 'formula=a*sin(3*q)'", do="`sysid effects formula` says what may stand in it")
    own = {**({"joints": list(joints)} if joints is not None else {}), **options}
    for entry in list(listed):
        if formula is not None or _word(entry) != effect:
            continue
        there = entry[effect] if isinstance(entry, dict) else {}
        had = {k: v for k, v in there.items() if k != "joints"}
        stands = there.get("joints")
        left = remaining(every if stands is None else stands, had, joints, options)
        if left is not None:
            at = listed.index(entry)
            if left:
                listed[at] = CommentedMap({effect: yaml_edit.flow({"joints": left, **had})})
                listed[at].fa.set_flow_style()
            else:
                del listed[at]
            continue
        taken = set(there.get("joints") or []) if there.get("joints") is not None else None
        if taken is None or joints is None or taken & set(joints):
            said = "" if not taken or joints is None else f" on {', '.join(sorted(taken & set(joints)))}"
            raise ConfigError(f"{effect} is in the model already{said}", where=where, do="add another effect, or another joint")
        if had == options:
            there["joints"].extend(joints)
            break
    else:
        listed.append(yaml_edit.flow(own) if formula is not None else effect if not own else CommentedMap({effect: yaml_edit.flow(own)}))
        if listed and isinstance(listed[-1], CommentedMap):
            listed[-1].fa.set_flow_style()


def _word(entry) -> str:
    return str(next(iter(entry))) if isinstance(entry, dict) else str(entry)


@contextmanager
def asked(file: Path):
    """Errors in what was typed or clicked without the line of a text that was never written. Raises SysidError."""
    try:
        yield
    except Untrusted:
        raise
    except ConfigError as error:
        said = re.sub(rf"^{re.escape(str(file))}( line \d+)?: ", "", str(error))
        said = re.sub(r"^(unknown) key (.*) in model\.effects\[\d+\]", r"\1 option \2", said)
        said = re.sub(r"unknown key (.*?): ", r"unknown option \1: ", said).replace("leave `joints` out", "leave --joint out")
        raise SysidError(re.sub(r"^model\.effects(\[\d+\])?[:.] ?", "", said)) from None


def options(texts: list[str]) -> dict:
    """Options of an effect from NAME=VALUE texts, the value in YAML. Raises ConfigError."""
    out = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise ConfigError(f"--option {text!r}", allowed="NAME=VALUE", do="correct it")
        out[name.strip()] = yaml_text.parse_yaml(value, where="--option")
    return out
