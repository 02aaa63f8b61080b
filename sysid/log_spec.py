"""What an experiment says of its logs: files, columns, units, groups."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from .drive_spec import Sum
from .spec_values import Columns, Day, Label, NonZero, Positive, Spec, Text, _finite, checked_column


def _episodes(value: Any) -> Any:
    listed = value if isinstance(value, list) else [value]
    if value is None or (listed and all(isinstance(k, int) and not isinstance(k, bool) and k >= 0 for k in listed)):
        return value
    raise ValueError("must be an episode's number, counted from 0, or a list of them")


class LogSpec(Spec):
    """A log: a path or a public dataset, or several files that are one recording; a topic of a bag, episodes of a data
    set; or a piece of it: start <= t - t[0] < stop [s]."""

    file: Text | None = None
    files: Annotated[list[Text], Field(min_length=1)] | None = None
    topic: Text | None = None
    episode: Annotated[int | list[int] | None, BeforeValidator(_episodes)] = None
    start: Annotated[float, AfterValidator(_finite), Field(ge=0)] | None = None
    stop: Positive | None = None

    def model_post_init(self, _context: Any) -> None:
        if (self.file is None) == (self.files is None):
            raise ValueError("must have either file: a path, or files: a list of paths that are one recording")
        if self.start is not None and self.stop is not None and not self.start < self.stop:
            raise ValueError(f"start {self.start:g} must be before stop {self.stop:g}")

    @property
    def names(self) -> tuple[str, ...]:
        """Every file, as written."""
        return (self.file,) if self.file is not None else tuple(self.files)

    @property
    def name(self) -> str:
        """What the log is called: its file, or its files."""
        return " + ".join(self.names)

    @property
    def episodes(self) -> frozenset[int] | None:
        """Which episodes it holds; None for all."""
        return None if self.episode is None else frozenset(self.episode if isinstance(self.episode, list) else [self.episode])

    def overlaps(self, other: LogSpec) -> bool:
        """Whether both hold a piece, were they of one recording."""
        if None not in (self.topic, other.topic) and self.topic != other.topic:
            return False
        if None not in (self.episodes, other.episodes):
            if self.episodes != other.episodes:
                return not self.episodes.isdisjoint(other.episodes)
        elif self.episodes != other.episodes:
            return True  # start and stop count from other samples
        stops = [log.stop for log in (self, other) if log.stop is not None]
        return not stops or max(self.start or 0.0, other.start or 0.0) < min(stops)


def _log(value: Any) -> Any:
    if isinstance(value, str):
        return {"file": value}
    if isinstance(value, (dict, LogSpec)):
        return value
    raise ValueError("must be a path, {file: path, start: seconds, stop: seconds}, or {files: [paths of one recording]}")


Logs = Annotated[list[Annotated[LogSpec, BeforeValidator(_log)]], Field(min_length=1)]


Levels = Annotated[dict[Label, Logs], Field(min_length=1)]


class ColumnsSpec(Spec):
    """Which column of a log holds what; `{joint}` stands for each joint's name."""

    time: Annotated[Any, BeforeValidator(checked_column)] = "t"
    position: Columns = "q_{joint}"
    torque: Columns = "tau_{joint}"
    velocity: Columns | None = None
    acceleration: Columns | None = None
    signals: dict[str, Annotated[Any, BeforeValidator(checked_column)]] = {}


def _constants(value: Any) -> Any:
    if value is None or isinstance(value, dict):
        return value
    raise ValueError("must map each joint to its constant, {joint: N m per A}")


class UnitsSpec(Spec):
    """The units of a log; everything behind the reader is SI."""

    time: Literal["s", "ms", "us", "ns"] = "s"
    position: Literal["rad", "deg", "turns", "m", "mm"] = "rad"
    torque: Literal["N m", "N", "A", "mN m", "N cm", "kN m", "mN", "kN"] = "N m"
    torque_constant: Annotated[dict[str, NonZero] | None, BeforeValidator(_constants)] = None

    def model_post_init(self, _context: Any) -> None:
        if self.torque_constant is not None and self.torque != "A":
            raise ValueError(
                f"torque_constant turns current into torque, and torque is in {self.torque}: write torque: A, or leave the constants out"
            )


class DataSpec(Spec):
    """The logs: what to fit, what to hold out, how to read them."""

    train: Logs = Field(default_factory=lambda: [LogSpec(file="train.csv")])
    test: Logs = Field(default_factory=lambda: [LogSpec(file="test.csv")])
    groups: dict[Label, Levels] = {}
    columns: ColumnsSpec = ColumnsSpec()
    signals: dict[str, Annotated[Any, BeforeValidator(checked_column)]] = {}
    units: UnitsSpec = UnitsSpec()
    rate: Positive | None = None
    resampling: Literal["nearest", "linear", "held"] = "nearest"
    torque: dict[str, Sum] = {}
    position: dict[str, Annotated[dict[str, NonZero], Field(min_length=1)]] = {}
    zero: dict[str, Annotated[float, AfterValidator(_finite)]] = {}
    unused: list[str] = []
    date: Day | None = None

    @property
    def logged(self) -> tuple[str, ...]:
        """Names of what was logged beside the joints."""
        return tuple({**self.columns.signals, **self.signals})
