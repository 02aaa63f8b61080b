"""When an experiment's logs were recorded: as its file says, as the clock of its first log counts,
or as a file's name has it."""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass

from .. import datasets, units
from ..errors import SysidError
from ..readers import open_table
from ..specs import Experiment

_YEARS = (946684800.0, 4102444800.0)  # s since 1970: 2000 to 2099
_NAMED = re.compile(r"(?<!\d)(20\d\d)([-_]?)(0[1-9]|1[0-2])\2(0[1-9]|[12]\d|3[01])(?!\d)")
_DAY = 86400.0  # s


@dataclass(frozen=True)
class Dated:
    """A date, days since 1970 with their fraction, and which field says so."""

    days: float
    field: str

    @property
    def text(self) -> str:
        """ISO 8601, UTC."""
        return str(datetime.date(1970, 1, 1) + datetime.timedelta(days=int(self.days)))


def dated(experiment: Experiment) -> Dated | None:
    """The date of an experiment, None where nothing says it."""
    if experiment.data.date is not None:
        days = (datetime.date.fromisoformat(experiment.data.date) - datetime.date(1970, 1, 1)).days
        return Dated(float(days), "data.date")
    return _by_clock(experiment) or _by_name(experiment)


def _by_clock(experiment: Experiment) -> Dated | None:
    """By a clock that counts from 1970."""
    spec, data = experiment.data.train[0], experiment.data
    name = spec.names[0]
    if data.rate is not None or datasets.reference(name) is not None:
        return None
    try:
        table = open_table((experiment.folder / name).resolve(), spec.topic)
        column = data.columns.time
        usual = "time" in table.usual and not (isinstance(column, str) and table.has(column))
        column = table.resolve(table.usual["time"] if usual else column)
        first = float(table.load([column])[column][0])
    except (SysidError, IndexError):
        return None  # whoever reads the log says what is wrong with it
    seconds = first * units.TIME[table.clock or data.units.time]
    if not _YEARS[0] <= seconds < _YEARS[1]:
        return None
    return Dated(seconds / _DAY, f"the clock of {name} ({column})")


def _by_name(experiment: Experiment) -> Dated | None:
    """By a date in the path of the first log, as the experiment writes it, or in its own name."""
    log = experiment.data.train[0].names[0]
    for field, text in ((f"the name of {log}", log), ("the experiment's name", experiment.name)):
        if found := _NAMED.search(text):
            year, _, month, day = found.groups()
            try:
                own = datetime.date(int(year), int(month), int(day))
            except ValueError:
                continue
            return Dated(float((own - datetime.date(1970, 1, 1)).days), field)
    return None
