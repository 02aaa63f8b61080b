"""Which columns of a table are what: by pattern, by name, by number, and what their headers say."""

from __future__ import annotations

from . import units
from .errors import LogError
from .log_spec import ColumnsSpec, DataSpec
from .readers.table import Table
from .warned import warn

_DEFAULTS = ColumnsSpec()

#: the signals of the joints, and what an experiment's data.columns calls each
KEYS = {"q": "position", "tau": "torque", "qd": "velocity", "qdd": "acceleration"}
_QUANTITIES = {"q": "position", "qd": "position", "qdd": "position", "tau": "torque"}


def check_headers(table: Table, data: DataSpec, wanted: dict, time: str | None) -> None:
    """Refuse a unit that the header states and that nobody spoke of; where the experiment names
    another, it stands, and is told.

    Raises:
        LogError: a column is in other units than it would be read in.
    """
    asked = [("time", time)] if time and not (table.clock and time == table.usual.get("time")) else []
    asked += [
        (quantity, name)
        for key, quantity in _QUANTITIES.items()
        for name in wanted.get(key, ())
        if name
    ]
    for quantity, name in asked:
        name = table.titled(name)
        stated, taken = units.in_header(name, quantity), getattr(data.units, quantity)
        if not stated or units.agree(stated, taken):
            continue
        said = f"the header {name!r} says {stated}, and data.units.{quantity} is {taken}"
        if quantity not in data.units.model_fields_set:
            raise LogError(
                said, where=str(table.path),
                do=f"write data.units.{quantity}: {stated}, or {taken} where the header is wrong",
            )  # fmt: skip
        warn(f"{table.path}: {said}; read in {taken}", above=4)


def meant(table: Table, spec: ColumnsSpec, key: str):
    """What the experiment says of a signal; where it says nothing, what files of this format call
    it. Velocity and acceleration are read where the experiment names them."""
    own, default = getattr(spec, key), getattr(_DEFAULTS, key)
    return table.usual.get(key, own) if own == default and own is not None else own


def time_of(table: Table, column) -> str:
    """The column of time. Raises LogError: there is none."""
    if not isinstance(column, int) and not table.has(column):
        raise LogError(
            f"there is no column {column!r} for time",
            where=str(table.path),
            allowed=table.some_names(),
            do="name it in data.columns.time, or give data.rate [Hz] where no time was logged",
        )
    return single(table, column, "time")


def names_of(table: Table, pattern, joints, signal: str, needed: list[bool]) -> list[str | None]:
    """The column of each joint, None where it is not needed; or the one matrix of all."""
    if isinstance(pattern, str) and "{joint}" not in pattern:
        name = table.resolve(pattern)
        if table.width(name) != len(joints):
            raise LogError(
                f"{signal}: column {name!r} is {table.width(name)} wide for {len(joints)} joints",
                where=str(table.path),
                allowed="a pattern with {joint}, a list of a column a joint, or a matrix that wide",
                do="correct data.columns",
            )
        return [name]
    if isinstance(pattern, str):
        pattern = [pattern.replace("{joint}", joint) for joint in joints]
        for joint, name, looked_at in zip(joints, pattern, needed):
            if looked_at and not table.has(name):
                raise LogError(
                    f"joint {joint!r} has no column: {name!r} is not there",
                    where=str(table.path),
                    allowed=table.some_names(),
                    do="correct data.columns or robot.joints",
                )
    if len(pattern) != len(joints):
        raise LogError(
            f"{signal}: {len(pattern)} columns for {len(joints)} joints",
            where=str(table.path),
            allowed=f"one for each of {', '.join(joints)}",
            do="correct data.columns",
        )
    return [single(table, c, signal) if own else None for c, own in zip(pattern, needed)]


def refuse_shared(table: Table, wanted: dict, joints) -> None:
    """Refuse a column that is said to be two things: of two joints, or two quantities of one.

    Args:
        wanted: {q, tau, qd or qdd: the column of each joint, or the one matrix of all}.

    Raises:
        LogError: which column, and what it is said to be.
    """
    said: dict[str, str] = {}
    for key, names in wanted.items():
        kind = KEYS[key]
        whole = len(names) < len(joints)  # a matrix
        for k, name in enumerate(names):
            own = f"the {kind} of {'every joint' if whole else joints[k]}"
            if name is not None and name in said:
                raise LogError(
                    f"column {name!r} is said to be {said[name]} and {own}",
                    where=str(table.path),
                    allowed="a column of its own for each joint's position, torque, velocity ...",
                    do="correct data.columns",
                )
            said[name] = own


def single(table: Table, column, signal: str) -> str:
    """The one column that a signal is."""
    name = table.resolve(column)
    if (width := table.width(name)) > 1:
        raise LogError(
            f"{signal}: {name!r} is {width} columns",
            where=str(table.path),
            allowed=f"one of {name}[0] to {name}[{width - 1}]",
            do="correct data.columns",
        )
    return name


def time_column(table: Table, spec: ColumnsSpec) -> str:
    """The column of a table that is its clock. Raises LogError."""
    return time_of(table, meant(table, spec, "time"))
