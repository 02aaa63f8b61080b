"""What an experiment says: every key typed. Plain data; how it is read from a file stands in `config`."""

from __future__ import annotations

import datetime
import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

AUTO = "auto"
_LARGEST = 1e12  # nothing of a robot is larger in SI units, and its square is still a number


def _finite(value: float) -> float:
    if not abs(value) <= _LARGEST:
        raise ValueError(f"must be a finite number, at most {_LARGEST:g} in size")
    return value


def _column(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise ValueError("must be a column's name or its number, counted from 0")
    return value


def _columns(value: Any) -> Any:
    if isinstance(value, str):
        return value
    if isinstance(value, list) and value:
        return [_column(item) for item in value]
    raise ValueError('must be a pattern such as "q_{joint}", a list of names, or a list of numbers counted from 0')


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= _LARGEST


def _auto_or_positive(value: Any) -> Any:
    if value == "auto":
        return value
    if _is_number(value) and value > 0:
        return float(value)
    raise ValueError("must be a positive number or auto")


def _weight(value: Any) -> Any:
    if value == AUTO:
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("must be a number or auto")
    if value < 0:
        raise ValueError("must be greater than or equal to 0, or auto")
    return float(_finite(value))


def _standstill(value: Any) -> Any:
    if value in ("auto", "keep", "mask"):
        return value
    if _is_number(value) and value >= 0:
        return float(value)
    raise ValueError("must be auto, keep, mask, or a speed [rad/s or m/s]")


def _nonzero(value: float) -> float:
    if value == 0:
        raise ValueError("must not be 0")
    return value


def _reference(value: str) -> str:
    if not value or "\0" in value:
        raise ValueError("must be the path of a file")
    return value


Text = Annotated[str, AfterValidator(_reference)]
Number = Annotated[float, AfterValidator(_finite)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
Positive = Annotated[float, AfterValidator(_finite), Field(gt=0)]
Columns = Annotated[Any, BeforeValidator(_columns)]


class _Spec(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class CylinderSpec(_Spec):
    """A cylinder along its frame's z axis [m]."""

    radius: Positive
    length: Positive


class InertiaSpec(_Spec):
    """A body: a uniform box or cylinder of a mass [kg] and centre of mass [m], or its ten parameters."""

    mass: Positive | None = None
    com: Vector = [0.0, 0.0, 0.0]
    box: Annotated[list[Positive], Field(min_length=3, max_length=3)] | None = None
    cylinder: CylinderSpec | None = None
    parameters: Annotated[list[Number], Field(min_length=10, max_length=10)] | None = None

    def model_post_init(self, _context: Any) -> None:
        shapes = [key for key in ("box", "cylinder", "parameters") if getattr(self, key) is not None]
        if len(shapes) != 1:
            raise ValueError("give exactly one of box, cylinder, parameters")
        if (self.mass is None) != (self.parameters is not None):
            raise ValueError("mass goes with box or cylinder; parameters holds its own")


def _ratio(value: float) -> float:
    if value == 0:
        raise ValueError("a gear ratio of 0 drives nothing; give motor turns per joint turn")
    return value


Ratio = Annotated[float, AfterValidator(_finite), AfterValidator(_ratio)]
NonZero = Annotated[float, AfterValidator(_finite), AfterValidator(_nonzero)]


def _direction(value: list[float]) -> list[float]:
    if math.hypot(*value) < 1e-6:
        raise ValueError("must be a direction, not 0 0 0")
    return value


class RotorSpec(_Spec):
    """A motor's rotor: a rigid body on a link, spinning `ratio` times as fast as its joint."""

    joint: str
    ratio: Ratio
    on: str
    xyz: Vector = [0.0, 0.0, 0.0]
    rpy: Vector = [0.0, 0.0, 0.0]
    axis: Annotated[Vector, AfterValidator(_direction)] = [0.0, 0.0, 1.0]
    inertia: InertiaSpec

    @model_validator(mode="before")
    @classmethod
    def _carrier(cls, value: Any) -> Any:
        """`link` is `on` in other words; tools of YAML 1.1 make a boolean of `on`."""
        given = [key for key in ("on", "link", True) if key in value] if isinstance(value, dict) else []
        if len(given) > 1:
            raise ValueError("on and link say the same: give one of them")
        return {"on" if key in given else key: entry for key, entry in value.items()} if given else value


class RobotSpec(_Spec):
    """The URDF, the joints that move, and the rotors that they drive."""

    urdf: Text = "robot.urdf"
    joints: list[str] | None = None
    lock: dict[str, Number] = {}
    gravity: Vector = [0.0, 0.0, -9.81]
    rotors: list[RotorSpec] = []
    transmission: dict[str, Annotated[dict[str, NonZero], Field(min_length=1)]] = {}


def _label(value: Any) -> Any:
    value = str(value) if isinstance(value, int) and not isinstance(value, bool) else value
    if not isinstance(value, str) or not re.fullmatch(r"[\w+-]+", value):
        raise ValueError("a name of a group or of a level must be of letters, digits, _, + and -; quote a date")
    return value


Label = Annotated[str, BeforeValidator(_label)]


def _date(value: Any) -> Any:
    if isinstance(value, datetime.date) and not isinstance(value, datetime.datetime):
        return value.isoformat()
    try:
        return datetime.date.fromisoformat(value).isoformat()
    except (TypeError, ValueError):
        raise ValueError("must be a day, as in 2026-03-31") from None


Day = Annotated[str, BeforeValidator(_date)]


def _episodes(value: Any) -> Any:
    listed = value if isinstance(value, list) else [value]
    if value is None or (listed and all(isinstance(k, int) and not isinstance(k, bool) and k >= 0 for k in listed)):
        return value
    raise ValueError("must be an episode's number, counted from 0, or a list of them")


class LogSpec(_Spec):
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


class ColumnsSpec(_Spec):
    """Which column of a log holds what; `{joint}` stands for each joint's name."""

    time: Annotated[Any, BeforeValidator(_column)] = "t"
    position: Columns = "q_{joint}"
    torque: Columns = "tau_{joint}"
    velocity: Columns | None = None
    acceleration: Columns | None = None
    signals: dict[str, Annotated[Any, BeforeValidator(_column)]] = {}


def _constants(value: Any) -> Any:
    if value is None or isinstance(value, dict):
        return value
    raise ValueError("must map each joint to its constant, {joint: N m per A}")


class FreeFactor(_Spec):
    """A factor to be found: from `start`, within two bounds; both chosen from the logs where they are left out."""

    start: NonZero | None = None
    within: Annotated[list[NonZero], Field(min_length=2, max_length=2)] | None = None

    def model_post_init(self, _context: Any) -> None:
        if self.within is not None and not (self.within[0] < self.within[1] and self.within[0] * self.within[1] > 0.0):
            raise ValueError(f"within must be two numbers of one sign that rise, not {self.within}")
        if self.within is not None and self.start is not None and not self.within[0] <= self.start <= self.within[1]:
            raise ValueError(f"start {self.start:g} must be within {self.within}")


def _free(value: Any) -> Any:
    if value == "free":
        return FreeFactor()
    if isinstance(value, dict) and set(value) <= set(FreeFactor.model_fields):
        try:
            return FreeFactor.model_validate(value)
        except ValidationError as error:
            raise ValueError(error.errors()[0]["msg"].removeprefix("Value error, ")) from None
    if isinstance(value, FreeFactor):
        return value
    if _is_number(value):
        return float(value)
    raise ValueError("must be a number, free, or {start: number, within: [low, high]}")


def _factor(value: Any) -> Any:
    value = _free(value)
    if value == 0.0:
        raise ValueError("must not be 0")
    return value


Factor = Annotated[Any, BeforeValidator(_factor)]
Sum = Annotated[dict[str, Factor], Field(min_length=1)]


class ActuatorSpec(_Spec):
    """What drives a joint whose torque was not logged: a position servo, tau = kp (command - q) - kd qd, or a DC motor,
    tau = k / R (voltage - k qd). `command` and `voltage` name logged columns; `delay` [s] is how late they act."""

    command: Annotated[Any, BeforeValidator(_column)] | None = None
    kp: Factor = FreeFactor()
    kd: Annotated[Any, BeforeValidator(_free)] = 0.0
    voltage: Annotated[Any, BeforeValidator(_column)] | None = None
    k: Factor = FreeFactor()
    R: Factor = FreeFactor()
    delay: Annotated[Any, BeforeValidator(_free)] = 0.0

    def model_post_init(self, _context: Any) -> None:
        if (self.command is None) == (self.voltage is None):
            raise ValueError("give command, of a position servo, or voltage, of a DC motor")
        alien = {"k", "R"} if self.command is not None else {"kp", "kd"}
        if wrong := sorted(alien & self.model_fields_set):
            raise ValueError(f"{wrong[0]} goes with {'voltage' if self.command is not None else 'command'}")
        if isinstance(self.k, FreeFactor) != isinstance(self.R, FreeFactor):
            raise ValueError("give both k and R, or leave both free")
        for name, value in (("kd", self.kd), ("delay", self.delay)):
            if isinstance(value, float) and value < 0.0:
                raise ValueError(f"{name} must be a number, at least 0, or free")


class UnitsSpec(_Spec):
    """The units of a log; everything behind the reader is SI."""

    time: Literal["s", "ms", "us", "ns"] = "s"
    position: Literal["rad", "deg", "m", "mm"] = "rad"
    torque: Literal["N m", "N", "A"] = "N m"
    torque_constant: Annotated[dict[str, NonZero] | None, BeforeValidator(_constants)] = None

    def model_post_init(self, _context: Any) -> None:
        if self.torque_constant is not None and self.torque != "A":
            raise ValueError(
                f"torque_constant turns current into torque, and torque is in {self.torque}: write torque: A, or leave the constants out"
            )


class DataSpec(_Spec):
    """The logs: what to fit, what to hold out, how to read them."""

    train: Logs = Field(default_factory=lambda: [LogSpec(file="train.csv")])
    test: Logs = Field(default_factory=lambda: [LogSpec(file="test.csv")])
    groups: dict[Label, Levels] = {}
    columns: ColumnsSpec = ColumnsSpec()
    signals: dict[str, Annotated[Any, BeforeValidator(_column)]] = {}
    units: UnitsSpec = UnitsSpec()
    rate: Positive | None = None
    torque: dict[str, Sum] = {}
    position: dict[str, Annotated[dict[str, NonZero], Field(min_length=1)]] = {}
    unused: list[str] = []
    date: Day | None = None

    @property
    def logged(self) -> tuple[str, ...]:
        """Names of what was logged beside the joints."""
        return tuple({**self.columns.signals, **self.signals})


class MaskSpec(_Spec):
    """A stretch of a log that counts in no fit and no error: start <= t <= stop [s] on the log's own clock; of some joints, or all."""

    log: Text
    start: Number
    stop: Number
    joints: Annotated[list[str], Field(min_length=1)] | None = None

    def model_post_init(self, _context: Any) -> None:
        if not self.start < self.stop:
            raise ValueError(f"start {self.start:g} must be before stop {self.stop:g}")


class PreprocessSpec(_Spec):
    """The filter from logged angles to position, velocity and acceleration."""

    filter: Literal["savitzky-golay", "butterworth", "none"] = "savitzky-golay"
    order: Annotated[int, Field(ge=1, le=12)] = 4
    window: Annotated[Any, BeforeValidator(_auto_or_positive)] = 0.1
    cutoff: Annotated[Any, BeforeValidator(_auto_or_positive)] = 10.0
    torque: Literal["raw", "same", "low-pass"] = "raw"
    standstill: Annotated[Any, BeforeValidator(_standstill)] = "auto"
    events: Literal["mask", "keep"] = "mask"
    mask: list[MaskSpec] = []

    def model_post_init(self, _context: Any) -> None:
        if self.filter == "savitzky-golay" and self.order < 2:
            raise ValueError(f"order {self.order} has no acceleration: savitzky-golay needs 2 to 12")


def is_own(name: str) -> bool:
    """Whether an effect's name is a class in a Python file, `my_effects.py:Name`."""
    return re.fullmatch(r"[^\0]*[^\0/\\:]\.py:[A-Za-z_]\w*", name) is not None


class EffectSpec(_Spec):
    """An effect of the vocabulary, the joints that have it (None: every joint), and its own options by name. `per` names the group
    of logs at each level of which it has parameters of its own, but for the levels of `except` (here `spared`), which lack it."""

    name: str
    joints: Annotated[list[str], Field(min_length=1)] | None = None
    per: Label | None = None
    spared: Annotated[list[Label], Field(min_length=1)] | None = Field(default=None, alias="except")
    options: dict[str, Any] = {}


ENTRY = tuple(field.alias or name for name, field in EffectSpec.model_fields.items() if name not in ("name", "options"))
"""The keys that every effect's entry may have beside the effect's own."""


class ModelSpec(_Spec):
    """How bodies are parameterized, and the effects on the joints."""

    inertia: Literal["log-cholesky", "exponential", "eigenvalue", "linear"] = "log-cholesky"
    effects: list[EffectSpec] = [EffectSpec(name="viscous"), EffectSpec(name="coulomb")]
    candidates: list[EffectSpec] = []


class PriorSpec(_Spec):
    """What the bodies are believed to be before any data, and how strongly; `known` bodies are exactly that."""

    divergence: Literal["log-det", "pullback", "euclidean"] = "log-det"
    weight: Annotated[Any, BeforeValidator(_weight)] = AUTO
    source: Text = "urdf"
    known: list[str] = []


class SolverSpec(_Spec):
    """When to stop, and whether each joint counts by its noise."""

    tolerance: Annotated[float, AfterValidator(_finite), Field(gt=0, lt=1)] = 1.0e-8
    max_iterations: Annotated[int, Field(ge=1)] = 200
    weighting: Literal["none", "noise"] = "none"
    handover: Annotated[float, AfterValidator(_finite), Field(ge=0, le=1)] = 0.5


class Experiment(_Spec):
    """An experiment file, every default filled in. `path` is the file; paths inside are relative to its folder."""

    robot: RobotSpec = RobotSpec()
    data: DataSpec = Field(default_factory=DataSpec)
    actuator: dict[str, ActuatorSpec] = {}
    preprocess: PreprocessSpec = PreprocessSpec()
    model: ModelSpec = ModelSpec()
    prior: PriorSpec = PriorSpec()
    solver: SolverSpec = SolverSpec()
    path: Path = Field(default=Path("experiment.yaml"), exclude=True)

    def __repr__(self) -> str:
        effects = ", ".join(effect.name for effect in self.model.effects) or "bodies alone"
        logs = f"{len(self.data.train)} training and {len(self.data.test)} test logs"
        return f"<Experiment {self.name}: {self.robot.urdf}, {effects}; {logs}>"

    __str__ = __repr__

    @property
    def folder(self) -> Path:
        """The folder that the experiment's paths are relative to."""
        return self.path.parent

    @property
    def name(self) -> str:
        """The file's name without its ending; for a folder with config.yaml, the folder's."""
        return self.path.resolve().parent.name if self.path.stem == "config" else self.path.stem
