"""The logs that a user names, opened: what of each joint they hold, and the numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import LogError
from ..finite import check_finite, filled
from ..readers.table import Table
from .columns import Found, found
from .words import is_time, words

_EPISODE = "episode_index"
_TORQUES = ("torque", "current"), ("command",)


@dataclass(frozen=True)
class Signals:
    """Which columns hold what, in every log: angles of every joint found; torque, or what stands
    for it (its meaning's signal: torque, current, or the command of a servo); speed where one was
    logged; time, None where there is none; rest: columns that nothing was made of."""

    position: Found
    torque: Found
    velocity: Found | None
    time: str | None
    rest: tuple[str, ...]

    @property
    def joints(self) -> list[str]:
        """The joints that have an angle and a torque."""
        return [joint for joint in self.position.columns if joint in self.torque.columns]


@dataclass(frozen=True)
class Logged:
    """One log: its name as given, its table, t (n,) as logged (None without a clock), q, tau and qd
    {joint: (n,)} as logged, and the numbers of its episodes."""

    name: str
    table: Table
    t: np.ndarray | None
    q: dict[str, np.ndarray]
    tau: dict[str, np.ndarray]
    qd: dict[str, np.ndarray]
    episodes: tuple[int, ...]

    @property
    def samples(self) -> int:
        """Rows."""
        return len(next(iter(self.q.values())))


def signals(tables: dict[str, Table], joints: list[str], arm: int) -> Signals:
    """What the columns of the logs are.

    Args:
        joints: what may move, grippers last. arm: how many of them are no gripper's.

    Raises:
        LogError: no angle or no torque is found, or the logs differ.
    """
    (name, first), *others = tables.items()
    groups = found(first, joints)
    position = _best(groups, ("position",), "angles", first, joints, arm)
    known = list(position.columns)
    kinds = next((kinds for kinds in _TORQUES if any(map(groups.get, kinds))), _TORQUES[0])
    torque = _best(groups, kinds, "torques, currents or commands", first, known, arm)
    velocity = next(
        (f for f in groups.get("velocity", []) if set(torque.columns) <= set(f.columns)), None
    )
    time = _time(first)
    used = [*position.columns.values(), *torque.columns.values(), *([time] if time else [])]
    for other, table in others:
        if missing := [column for column in used if column not in table.names]:
            raise LogError(
                f"it has no column {missing[0]!r}, which {Path(name).name} has",
                where=other,
                allowed=table.some_names(),
                do="give logs of one kind to one experiment",
            )
    more = {c for f in (position, torque, velocity) if f for c in (*f.columns.values(), *f.more)}
    rest = tuple(n for n in first.names if n not in {*used, *more, _EPISODE} and "[" not in n)
    return Signals(position, torque, velocity, time, rest)


def _best(groups, kinds, what: str, table: Table, joints: list[str], arm: int) -> Found:
    """The likeliest columns: of as many joints as there are, measured rather than asked for."""
    tried = [f for kind in kinds for f in groups.get(kind, []) if set(f.columns) & set(joints)]
    if not tried and all(name.isdigit() for name in table.names):
        raise LogError(
            "the file has no header, so that nobody says what its columns are",
            where=str(table.path),
            do="put a line such as t,q_elbow,tau_elbow above, or write data.columns by number",
        )
    if not tried:
        shown = ", ".join(joints[:8]) + (" ..." if len(joints) > 8 else "")
        raise LogError(
            f"no column looks like the {what} of {shown}",
            where=str(table.path),
            allowed=f"names like q_elbow, elbow.pos, tau1, effort[0]; here: {table.some_names()}",
            do="rename the columns, or write data.columns into an experiment file yourself",
        )
    best = min(tried, key=lambda f: (-min(len(set(f.columns) & set(joints)), arm), f.meaning.away))
    count = len(best.columns) + len(best.more)
    # a gripper may be one column more than the arm, or as many as its joints
    if best.counted and not arm <= count <= max(arm + 1, len(joints)):
        shown = best.why.partition(",")[0]
        raise LogError(
            f"{count} column{'s' * (count > 1)} of {what} ({shown}) for {arm} joints",
            where=str(table.path),
            allowed=", ".join(joints[:arm]),
            do="name the joints that they are of with --joints, or write data.columns",
        )
    return best


def _time(table: Table) -> str | None:
    """The clock: what the format says, else the column with the shortest name that says so."""
    if (usual := table.usual.get("time")) in table.names:
        return usual
    named = [n for n in table.names if table.width(n) == 1 and is_time(n)]
    return min(named, key=lambda n: (len(words(n)), len(n)), default=None)


def read(tables: dict[str, Table], signals: Signals) -> list[Logged]:
    """The numbers of every log. Raises LogError where a column holds no numbers."""
    return [_one(name, table, signals) for name, table in tables.items()]


def _one(name: str, table: Table, signals: Signals) -> Logged:
    joints = signals.joints
    chosen = {"q": signals.position.of(joints).columns, "tau": signals.torque.of(joints).columns}
    if signals.velocity:
        chosen["qd"] = signals.velocity.of(joints).columns
    counted = [_EPISODE] if _EPISODE in table.names else []
    time = [signals.time] if signals.time else []
    names = [*time, *counted, *(c for columns in chosen.values() for c in columns.values())]
    torques = tuple(chosen["tau"].values())
    values = table.load(list(dict.fromkeys(names)), torques)
    for column in torques:
        own = values[column] if values[column].ndim > 1 else values[column][:, None]
        whole = [filled(one, column, str(table.path))[0] for one in np.asarray(own, dtype=float).T]
        values[column] = np.stack(whole, axis=1).reshape(values[column].shape)
    for column in (*time, *chosen["q"].values(), *chosen["tau"].values()):
        check_finite(values[column], column, str(table.path))  # as a fit would, before a guess
    of = {kind: {j: values[c] for j, c in columns.items()} for kind, columns in chosen.items()}
    for joint, column in signals.position.columns.items():
        if joint not in joints:
            try:  # a gripper may be logged on its own
                of["q"][joint] = table.load([column])[column]
            except LogError:
                continue
    episodes = tuple(int(k) for k in np.unique(values[_EPISODE])) if counted else ()
    t = values[signals.time] if signals.time else None
    return Logged(name, table, t, of["q"], of["tau"], of.get("qd", {}), episodes)
