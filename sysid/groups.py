"""data.groups: what differs between logs. A group (robot, payload, day) has levels, and each level
lists the logs that it is true of, by the names that data.train and data.test give them.

An effect that is `per` a group has parameters of its own at every level, which only the logs of
that level tell; all else in the model is shared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cache
from glob import has_magic
from posixpath import normpath

from .log_spec import DataSpec, LogSpec
from .specs import EffectSpec, ModelSpec

Groups = Mapping[str, Mapping[str, Sequence[LogSpec]]]
Mistake = tuple[tuple, str]  # where it stands, as keys and numbers; what is wrong


def levels_of(groups: Groups, log: LogSpec) -> dict[str, str]:
    """{group: level} of a log, without the groups that do not list it."""
    return {
        group: level
        for group, levels in groups.items()
        for level, members in levels.items()
        if any(names(entry, log) for entry in members)
    }


def names(entry: LogSpec, log: LogSpec) -> bool:
    """Whether an entry of a level names a log: its file, a folder that it is in, or a pattern that
    it matches; of a recording of several files, all of them. With a piece, a topic or episodes, the
    log that has the same; without, every log of the file.

    A pattern is held against the names of the logs, not against what lies on the disk.
    """
    if log.files is None and entry.files is not None:
        return False
    if not all(any(_is_in(own, name) for name in entry.names) for own in log.names):
        return False
    asked = {key: value for key in _PIECE if (value := getattr(entry, key)) is not None}
    return not asked or all(getattr(log, key) == asked.get(key) for key in _PIECE)


_PIECE = ("topic", "episode", "start", "stop")


def _is_in(own: str, name: str) -> bool:
    own_parts, parts = _parts(own), _parts(name)
    if own_parts[: len(parts)] == parts:
        return True
    return has_magic(name) and _matches(own_parts, parts)


@cache  # the same names are asked of every level
def _parts(name: str) -> tuple[str, ...]:
    return tuple(normpath(name).split("/"))


def _matches(own: tuple[str, ...], pattern: tuple[str, ...]) -> bool:
    if not pattern:
        return not own
    first, *rest = pattern
    if first == "**":
        return any(_matches(own[k:], tuple(rest)) for k in range(len(own) + 1))
    return bool(own) and fnmatchcase(own[0], first) and _matches(own[1:], tuple(rest))


def resolved(data: DataSpec) -> DataSpec:
    """The data with the logs of data.train and data.test themselves at each level."""
    found: dict[str, dict[str, list[LogSpec]]] = {}
    for group, levels in data.groups.items():
        for level, entries in levels.items():
            own = found.setdefault(group, {}).setdefault(level, [])
            for log in (*data.train, *data.test):
                if log not in own and any(names(entry, log) for entry in entries):
                    own.append(log)
    return data.model_copy(update={"groups": found})


def mistake(data: DataSpec, model: ModelSpec) -> Mistake | None:
    """What is wrong with groups and with effects that are per group; None where nothing is."""
    logs = [*data.train, *data.test]
    for group, levels in data.groups.items():
        for level, entries in levels.items():
            for k, entry in enumerate(entries):
                if not any(names(entry, log) for log in logs):
                    where = ("data", "groups", group, level, k)
                    return where, f"{entry.name} is in neither data.train nor data.test"
        for log in logs:
            at = [
                level
                for level, entries in levels.items()
                if any(names(entry, log) for entry in entries)
            ]
            if len(at) > 1:
                return ("data", "groups", group, at[1]), f"{log.name} is at {at[0]} too; one level"
    for k, spec in enumerate(model.candidates):
        if spec.per is not None or spec.spared is not None:
            where = ("model", "candidates", k)
            return where, "a candidate is asked of all logs together; leave per and except out"
    for k, spec in enumerate(model.effects):
        if (said := _wrong(spec, data)) is not None:
            key = "except" if spec.per is None or said.startswith("except") else "per"
            return ("model", "effects", k, key), said
    return None


def _wrong(spec: EffectSpec, data: DataSpec) -> str | None:
    """What is wrong with the group of an effect."""
    if spec.per is None:
        return None if spec.spared is None else "except names levels of a group; give per, too"
    if spec.per not in data.groups:
        there = ", ".join(data.groups) or "nothing: list logs there"
        return f"there is no group {spec.per!r}; data.groups has: {there}"
    levels, spared = data.groups[spec.per], spec.spared or []
    for level in spared:
        if level not in levels:
            return f"except: {spec.per} has no level {level!r}; allowed: {', '.join(levels)}"
    if set(spared) == set(levels):
        return f"except: no level of {spec.per} is left; leave the effect out"
    group, own = {spec.per: levels}, f"data.groups.{spec.per}"
    for log in [*data.train, *data.test]:
        if not levels_of(group, log):
            return f"{log.name} is at no level of {own}; list it under one"
    trained = {levels_of(group, log)[spec.per] for log in data.train}
    if untold := [level for level in levels if level not in (*spared, *trained)]:
        out = f"train on one, or give except: [{untold[0]}]"
        return f"no training log is at level {untold[0]} of {own}; {out}"
    return None
