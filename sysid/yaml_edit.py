"""A change in the text of an experiment file, in which all else stays as it was written: comments,
quotes, indentation, and spaces.
"""

from __future__ import annotations

import io
from collections.abc import Callable

from . import experiment_file, yaml_text
from .errors import ConfigError


def edited(text: str, edit: Callable[[dict], None], *, where: str = "") -> str:
    """A text after a change of the tree that it is.

    Args:
        edit: changes the tree in place. where: the file, as errors name it.

    Raises:
        ConfigError: the text is no YAML that an experiment can be, or `edit` refuses.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.comments import CommentedMap

    writer = YAML()
    writer.preserve_quotes, writer.width = True, 4096
    # checked as every experiment file is, then read once more as it is written
    only_comments = yaml_text.parse_yaml(text, where=where) is None
    tree = CommentedMap() if only_comments else writer.load(text)
    edit(tree)
    changed = _dumped(writer, tree)
    if only_comments:
        return (text.rstrip("\n") + "\n" if text.strip() else "") + changed
    kept = experiment_file.grafted(text, _dumped(writer, writer.load(text)), changed)
    try:
        same = _tree(kept, where) == _tree(changed, where)
    except ConfigError:
        same = False
    return kept if same else changed


def flow(own: dict):
    """A mapping written in one line, {like: [this]}."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

    out = CommentedMap()
    for key, value in own.items():
        if isinstance(value, list):
            value = CommentedSeq(value)
            value.fa.set_flow_style()
        out[key] = value
    out.fa.set_flow_style()
    return out


def _tree(text: str, where: str):
    return yaml_text.plain(yaml_text.parse_yaml(text, where=where))


def _dumped(writer, tree) -> str:
    stream = io.StringIO()
    writer.dump(tree, stream)
    return stream.getvalue()
