"""Columns that hold one signal of several joints, and what their names have in common."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from .words import Meaning


@dataclass(frozen=True)
class Found:
    """Columns of one signal. columns: {joint: column}; pattern: with {joint}, where one says it
    all; counted: they were given to joints by their number, not by a name; more: numbered columns
    beyond the joints; meaning: what their names say; units: {joint: unit}, where they differ."""

    columns: dict[str, str]
    pattern: str | None
    counted: bool
    more: tuple[str, ...]
    meaning: Meaning
    units: dict[str, str] = field(default_factory=dict)

    @property
    def said(self):
        """What an experiment file says of them."""
        return self.pattern or list(self.columns.values())

    @property
    def why(self) -> str:
        """How their joints were found."""
        if not self.counted:
            return "the columns carry the joints' names"
        own = [*self.columns.values(), *self.more]
        named = own[0] if len(own) == 1 else f"{own[0]} to {own[-1]}"
        return f"{named}, taken in the order of the URDF's joints"

    def of(self, joints: Iterable[str]) -> Found:
        """The columns of some of the joints."""
        return replace(self, columns={joint: self.columns[joint] for joint in joints})


def merged(named: list[Found], joints: list[str]) -> list[Found]:
    """Columns of one signal under names that differ by more than the joint's, of some joints each:
    "x_pos [mm]" beside "w_pos [deg]"."""
    out = []
    for first in named:
        own = {joint: first for joint in first.columns}
        for other in named:
            if other.meaning.away == first.meaning.away and not own.keys() & other.columns.keys():
                own |= {joint: other for joint in other.columns}
        if len(own) > len(first.columns):
            columns = {joint: own[joint].columns[joint] for joint in joints if joint in own}
            units = {joint: found.meaning.unit for joint, found in own.items()}
            alike = len(set(units.values())) == 1
            means = first.meaning if alike else replace(first.meaning, unit="")
            out.append(Found(columns, pattern(columns), False, (), means, {} if alike else units))
    return out


def pattern(columns: dict[str, str]) -> str | None:
    """The pattern of columns that hold their joints' names as they are."""
    patterns = {c.replace(j, "{joint}") for j, c in columns.items() if c.count(j) == 1}
    if len(patterns) != 1:
        return None
    (said,) = patterns
    same = all(said.replace("{joint}", j) == c for j, c in columns.items())
    return said if same and said.count("{joint}") == 1 else None
