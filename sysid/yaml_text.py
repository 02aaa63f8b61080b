"""YAML text as plain values with the lines they stand on, and what is wrong with it in words."""

from __future__ import annotations

from .errors import ConfigError

_MOST_ALIASED_NODES = 10_000


_DEEPEST = 50


def parse_yaml(text: str, *, where: str):
    """A YAML document with line numbers and comments kept; no tags, no multiplying aliases."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        _check_events(YAML(typ="rt", pure=True).parse(text), where)
        return YAML(typ="rt", pure=True).load(text)
    except ConfigError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f" line {mark.line + 1}" if mark else ""
        said = str(error.problem or error.context)
        raise ConfigError(f"not YAML ({said})", where=f"{where}{line}", do=_cure(said)) from None
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"not YAML ({str(error).splitlines()[0]})", where=where) from None


def _cure(said: str) -> str:
    """What to do about what a reader of YAML says, which speaks of its own parts."""
    if "'\\t'" in said:
        return "put spaces in the place of the tab"
    if "<block" in said or "mapping values" in said:
        return "bring the line to the column of its neighbours: keys of one mapping begin at the same one"
    if "',' or" in said:
        return "close the bracket, or part its entries with commas"
    return "correct the line"


def _check_events(events, where: str) -> None:
    """Refuse tags, and aliases whose expansion would be large."""
    from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, NodeEvent, ScalarEvent

    sizes: dict[str, int] = {}
    open_anchors: list[tuple[str | None, int]] = []
    total = 0
    for event in events:
        if isinstance(event, CollectionEndEvent):
            anchor, before = open_anchors.pop()
            if anchor:
                sizes[anchor] = total - before
            continue
        if not isinstance(event, NodeEvent):
            continue
        tag = getattr(event, "tag", None)
        if tag:
            raise ConfigError(f"the YAML tag {tag}", where=f"{where} line {event.start_mark.line + 1}", allowed="plain values", do="remove the tag")
        if isinstance(event, AliasEvent):
            if event.anchor not in sizes:
                raise ConfigError(f"the alias *{event.anchor} refers to itself or to nothing", where=f"{where} line {event.start_mark.line + 1}")
            total += sizes[event.anchor]
        else:
            total += 1
            if isinstance(event, CollectionStartEvent):
                open_anchors.append((event.anchor, total))
                if len(open_anchors) > _DEEPEST:
                    raise ConfigError(
                        f"lists and mappings more than {_DEEPEST} deep", where=f"{where} line {event.start_mark.line + 1}", do="write an experiment"
                    )
            elif isinstance(event, ScalarEvent) and event.anchor:
                sizes[event.anchor] = 1
        if total > _MOST_ALIASED_NODES:
            raise ConfigError(
                f"more than {_MOST_ALIASED_NODES} values, aliases counted",
                where=f"{where} line {event.start_mark.line + 1}",
                do="write the values out",
            )


def plain(node):
    """ruamel's round-trip nodes as plain Python values."""
    if isinstance(node, dict):
        return {plain(key): plain(value) for key, value in node.items()}
    if isinstance(node, list):
        return [plain(item) for item in node]
    if isinstance(node, bool) or node is None:
        return node
    for kind in (int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node
