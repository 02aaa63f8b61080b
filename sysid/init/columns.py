"""Names of columns and joints -> which column holds which joint's angle, speed and torque.

By the joint's name where columns carry it, whatever stands before and behind; else by numbers or
places in a matrix, which count the joints in the order of the URDF.
"""

from __future__ import annotations

from collections.abc import Iterable

from ..readers.table import Table
from .named_columns import Found, merged, pattern
from .words import Meaning, meaning, words


def found(table: Table, joints: list[str]) -> dict[str, list[Found]]:
    """What a table has of each signal, {signal: the likeliest first}.

    Args:
        joints: names of what may move, in the order of the URDF, grippers last.
    """
    groups: dict[str, list[Found]] = {}
    for entry in [*_usual(table, joints), *_named(table, joints), *_counted(table, joints)]:
        groups.setdefault(entry.meaning.signal, []).append(entry)
    for entries in groups.values():
        entries += merged([f for f in entries if not f.counted], joints)
    # stable: what covers more joints, what is measured, what is found by name comes first
    for entries in groups.values():
        entries.sort(key=lambda f: (-len(f.columns), f.meaning.away))
    return groups


def _usual(table: Table, joints: list[str]) -> Iterable[Found]:
    """What the format itself says; of names that are not the joints' nothing."""
    for signal, said in table.usual.items():
        if signal == "time" or "{joint}" not in said:
            continue
        columns = {j: c for j in joints if (c := said.replace("{joint}", j)) in table.names}
        if columns:
            yield Found(columns, said, False, (), Meaning(signal, -1, ""))


def _bases(table: Table) -> dict[str, str]:
    """{matrix or what the names of its elements begin with: signal}, as the format says."""
    return {said.removesuffix(".{joint}"): signal for signal, said in table.usual.items()}


def _named(table: Table, joints: list[str]) -> Iterable[Found]:
    """Columns that carry the names of joints, grouped by what else their names say."""
    known = _aliases(joints)
    by_rest: dict[tuple, dict[str, str]] = {}
    for column in _single(table):
        said = words(table.titled(column))
        hits = [
            (len(alias), alias, joint) for alias, joint in known.items() if _at(said, alias) >= 0
        ]
        if not hits:
            continue
        _, alias, joint = max(hits)
        at = _at(said, alias)
        rest = (*said[:at], "{joint}", *said[at + len(alias) :])
        by_rest.setdefault(rest, {}).setdefault(joint, column)
    for rest, columns in by_rest.items():
        means = meaning(tuple(word for word in rest if word != "{joint}"))
        bases = {column.rpartition(".")[0] for column in columns.values()} & set(_bases(table))
        if bases:
            means = Meaning(_bases(table)[bases.pop()], -1, "")
        if means.signal:
            ordered = {joint: columns[joint] for joint in joints if joint in columns}
            yield Found(ordered, pattern(ordered), False, (), means)


def _counted(table: Table, joints: list[str]) -> Iterable[Found]:
    """Numbered columns q1, q2, ... or q_0, q_1, ..., and the columns of a matrix."""
    by_name: dict[tuple, dict[int, str]] = {}
    for column in _single(table):
        said = words(table.titled(column))
        if said and said[-1].isdigit():
            by_name.setdefault(said[:-1], {}).setdefault(int(said[-1]), column)
        elif len(digits := [k for k, word in enumerate(said) if word.isdigit()]) == 1:
            rest = (*said[: digits[0]], *said[digits[0] + 1 :])
            by_name.setdefault(rest, {}).setdefault(int(said[digits[0]]), column)
    for name in table.names:
        if table.width(name) > 1:
            by_name[(*words(name), "[]")] = {k: f"{name}[{k}]" for k in range(table.width(name))}
    labels = _labels(table)
    for rest, columns in by_name.items():
        means, numbers = meaning(rest), sorted(columns)
        if means.signal and set(numbers) <= set(labels):
            told = {joint: c for k, c in columns.items() if (joint := labels[k]) in joints}
            yield Found({j: told[j] for j in joints if j in told}, None, False, (), means)
            continue
        matrix = rest[-1:] == ("[]",)
        if matrix and (signal := _bases(table).get(columns[0].removesuffix("[0]"))):
            means = Meaning(signal, -1, "")
        whole = numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        if not means.signal or numbers[0] not in (0, 1) or not whole:
            continue
        ordered = [columns[k] for k in numbers]
        yield Found(dict(zip(joints, ordered)), None, True, tuple(ordered[len(joints) :]), means)


def _labels(table: Table) -> dict[int, str]:
    """The joint of each number where the first row of a CSV file names it: `rostopic echo -p`
    writes field.name0, ..., field.position0, ..."""
    named = {
        int(w[-1]): n
        for n in table.names
        if (w := words(n))[-2:-1] == ("name",) and w[-1].isdigit()
    }
    if not named or table.path.suffix.lower() != ".csv":
        return {}
    import polars as pl

    try:
        frame = pl.read_csv(table.path, n_rows=1, infer_schema=False, columns=list(named.values()))
    except pl.exceptions.PolarsError:
        return {}
    return {k: str(frame[name].first()) for k, name in named.items() if frame.height}


def _single(table: Table) -> list[str]:
    """Columns that are no part of a matrix."""
    matrices = tuple(f"{name}[" for name in table.names if table.width(name) > 1)
    return [n for n in table.names if table.width(n) == 1 and not n.startswith(matrices or ("\0",))]


def _at(said: tuple, part: tuple) -> int:
    """Where a run of words stands among others; -1 where it does not."""
    places = range(len(said) - len(part) + 1)
    return next((k for k in places if said[k : k + len(part)] == part), -1)


def _aliases(joints: list[str]) -> dict[tuple, str]:
    """{words: joint}: its own name, and without what the names of all joints begin or end with."""
    whole = [words(joint) for joint in joints]
    before, behind = _shared(whole), _shared([w[::-1] for w in whole])
    out: dict[tuple, str] = {}
    twice = set()
    for joint, own in zip(joints, whole):
        short = len(own) - behind
        for alias in {own, own[before:], own[:short], own[before:short]}:
            # a number alone is no name: which joint it counts is another question
            if alias and not all(word.isdigit() for word in alias):
                twice |= {alias} if out.get(alias, joint) != joint else set()
                out[alias] = joint
    return {alias: joint for alias, joint in out.items() if alias not in twice}


def _shared(all_words: list[tuple]) -> int:
    """How many words all of several names begin with; 0 of one name alone."""
    if len(all_words) < 2:
        return 0
    count = 0
    for group in zip(*all_words):
        if len(set(group)) > 1:
            break
        count += 1
    return min(count, min(map(len, all_words)) - 1)
