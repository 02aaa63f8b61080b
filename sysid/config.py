"""YAML -> Experiment: every key typed, every mistake named with its line.

YAML is loaded without tags: a file that carries one, or aliases that multiply, is refused. The file on disk
stays the truth; nothing here writes it.
"""

from __future__ import annotations

import difflib
import math
import re
from pathlib import Path
from pkgutil import iter_modules
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from .errors import ConfigError

_LARGEST_FILE = 1_000_000  # bytes
_MOST_ALIASED_NODES = 10_000
_DEEPEST = 50
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


class RobotSpec(_Spec):
    """The URDF, the joints that move, and the rotors that they drive."""

    urdf: Text = "robot.urdf"
    joints: list[str] | None = None
    lock: dict[str, Number] = {}
    gravity: Vector = [0.0, 0.0, -9.81]
    rotors: list[RotorSpec] = []
    transmission: dict[str, Annotated[dict[str, NonZero], Field(min_length=1)]] = {}


class LogSpec(_Spec):
    """A log: a path or a public dataset, or a piece of one: start <= t - t[0] < stop [s]."""

    file: Text
    start: Annotated[float, AfterValidator(_finite), Field(ge=0)] | None = None
    stop: Positive | None = None

    def model_post_init(self, _context: Any) -> None:
        if self.start is not None and self.stop is not None and not self.start < self.stop:
            raise ValueError(f"start {self.start:g} must be before stop {self.stop:g}")

    def overlaps(self, other: LogSpec) -> bool:
        """Whether both hold a piece, were they of one recording."""
        stops = [log.stop for log in (self, other) if log.stop is not None]
        return not stops or max(self.start or 0.0, other.start or 0.0) < min(stops)


def _log(value: Any) -> Any:
    if isinstance(value, str):
        return {"file": value}
    if isinstance(value, (dict, LogSpec)):
        return value
    raise ValueError("must be a path, or {file: path, start: seconds, stop: seconds}")


Logs = Annotated[list[Annotated[LogSpec, BeforeValidator(_log)]], Field(min_length=1)]


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
    columns: ColumnsSpec = ColumnsSpec()
    signals: dict[str, Annotated[Any, BeforeValidator(_column)]] = {}
    units: UnitsSpec = UnitsSpec()
    rate: Positive | None = None


class PreprocessSpec(_Spec):
    """The filter from logged angles to position, velocity and acceleration."""

    filter: Literal["savitzky-golay", "butterworth", "none"] = "savitzky-golay"
    order: Annotated[int, Field(ge=1, le=12)] = 4
    window: Annotated[Any, BeforeValidator(_auto_or_positive)] = 0.1
    cutoff: Annotated[Any, BeforeValidator(_auto_or_positive)] = 10.0
    torque: Literal["raw", "same"] = "raw"
    standstill: Annotated[Any, BeforeValidator(_standstill)] = "auto"
    events: Literal["mask", "keep"] = "mask"

    def model_post_init(self, _context: Any) -> None:
        if self.filter == "savitzky-golay" and self.order < 2:
            raise ValueError(f"order {self.order} has no acceleration: savitzky-golay needs 2 to 12")


def is_own(name: str) -> bool:
    """Whether an effect's name is a class in a Python file, `my_effects.py:Name`."""
    return re.fullmatch(r"[^\0]*[^\0/\\:]\.py:[A-Za-z_]\w*", name) is not None


def _known_effect(name: str) -> str:
    if is_own(name) or name == "formula":
        return name
    if ".py" in name:
        raise ValueError(f"{name!r} names no class; write {name.partition('.py')[0]}.py:Name")
    # the folder is the vocabulary; nothing of it is loaded here
    names = sorted(module.name for module in iter_modules([str(Path(__file__).parent / "effects")]))
    if name not in names:
        close = difflib.get_close_matches(name, names, n=3, cutoff=0.4) or names
        raise ValueError(f"there is no effect {name!r}; allowed: {', '.join(close)}; see `sysid effects`")
    return name


class EffectSpec(_Spec):
    """An effect of the vocabulary, the joints that have it (None: every joint), and its own options by name."""

    name: Annotated[str, AfterValidator(_known_effect)]
    joints: Annotated[list[str], Field(min_length=1)] | None = None
    options: dict[str, Any] = {}


def _own_keys(name: str, given) -> list[str]:
    """The keys that an effect has beside `joints`: its options, and its shape values, which may be held."""
    from .effect import find, vocabulary

    if is_own(name):
        return [key for key in given if key != "joints"]  # only the file can tell; it is not run here
    if name not in vocabulary():
        return []
    effect = find(name)
    return [*effect.options, *(shape.name for shape in effect.shapes())]


def _effect(value: Any) -> Any:
    if isinstance(value, EffectSpec):
        return value
    if value == "formula" or (isinstance(value, dict) and "formula" in value):
        return _formula(value)
    if isinstance(value, str):
        return {"name": value}
    if isinstance(value, dict) and len(value) == 1:
        ((name, options),) = value.items()
        if isinstance(name, str) and isinstance(options, dict) and not {"name", "options"} & set(options):
            own = {key: options[key] for key in _own_keys(name, options) if key in options}
            return {"name": name, **{key: given for key, given in options.items() if key not in own}, **({"options": own} if own else {})}
    raise ValueError("must be an effect's name, or {name: {joints: [...]}}; see `sysid effects`")


def _formula(value: Any) -> dict:
    """The entry {formula: text, joints: [...], name: ..., and shape values that are held}."""
    from .formula import option_names

    text = value.get("formula") if isinstance(value, dict) else None
    if not isinstance(text, str) or "options" in value:
        raise ValueError('must be {formula: "a*sin(3*q)", joints: [...]}')
    try:
        keys = option_names(text)
    except ConfigError as error:
        raise ValueError(str(error).removeprefix("model.effects: ")) from None
    own = {key: given for key, given in value.items() if key in keys}
    return {**{key: given for key, given in value.items() if key not in own}, "name": "formula", "options": own}


class ModelSpec(_Spec):
    """How bodies are parameterized, and the effects on the joints."""

    inertia: Literal["log-cholesky", "exponential", "eigenvalue", "linear"] = "log-cholesky"
    effects: list[Annotated[EffectSpec, BeforeValidator(_effect)]] = [EffectSpec(name="viscous"), EffectSpec(name="coulomb")]
    candidates: list[Annotated[EffectSpec, BeforeValidator(_effect)]] = []


class PriorSpec(_Spec):
    """What the bodies are believed to be before any data, and how strongly."""

    divergence: Literal["log-det", "pullback", "euclidean"] = "log-det"
    weight: Annotated[float, AfterValidator(_finite), Field(ge=0)] = 1.0e-2
    source: Text = "urdf"


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
    preprocess: PreprocessSpec = PreprocessSpec()
    model: ModelSpec = ModelSpec()
    prior: PriorSpec = PriorSpec()
    solver: SolverSpec = SolverSpec()
    path: Path = Field(default=Path("experiment.yaml"), exclude=True)

    @property
    def folder(self) -> Path:
        """The folder that the experiment's paths are relative to."""
        return self.path.parent

    @property
    def name(self) -> str:
        """The file's name without its ending; for a folder with config.yaml, the folder's."""
        return self.path.resolve().parent.name if self.path.stem == "config" else self.path.stem


def file_of(path: str | Path) -> Path:
    """The experiment file that a path means: itself, or the config.yaml of a folder."""
    path = Path(path)
    return path / "config.yaml" if path.is_dir() else path


_LOGS = (".csv", ".parquet", ".npz", ".mat", ".h5", ".hdf5", ".mcap", ".db3", ".bag", ".gz")
_ROBOTS = (".urdf", ".xacro", ".xml", ".mjcf", ".sdf")


def load(path: str | Path) -> Experiment:
    """Read an experiment file, or the config.yaml of a folder.

    Raises:
        ConfigError: with the line, the key, and what is allowed there.
    """
    path = file_of(path)
    for word, endings in (("a log", _LOGS), ("a robot", _ROBOTS)):
        if path.suffix.lower() in endings:
            raise ConfigError(
                f"{word}, and no experiment", where=str(path), allowed="a YAML file, or a folder with config.yaml",
                do="put robot.urdf, train.csv, test.csv and an empty config.yaml into a folder and give that, or name the files in a config.yaml",
            )  # fmt: skip
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"the experiment file cannot be read ({error.strerror})", where=str(path), do="check its name") from None
    if len(data) > _LARGEST_FILE:
        raise ConfigError(f"an experiment file of {len(data)} bytes", where=str(path), allowed=f"at most {_LARGEST_FILE}")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigError("not UTF-8 text", where=str(path), do="give an experiment in YAML") from None
    return loads(text, path)


def loads(text: str, path: Path) -> Experiment:
    """The experiment that a text is, as if it stood in the file `path`. Raises ConfigError, as `load`."""
    tree = parse_yaml(text, where=str(path))
    if tree is None:
        tree = {}
    if not isinstance(tree, dict):
        raise ConfigError("the file holds no mapping", where=str(path), allowed=", ".join(_keys(Experiment)))
    plain = _plain(tree)
    if "path" in plain:
        raise _unknown_key(tree, ("path",), path)
    try:
        return Experiment.model_validate({**plain, "path": path})
    except ValidationError as error:
        raise _named(error, tree, path) from None


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
        raise ConfigError(f"not YAML ({error.problem or error.context})", where=f"{where}{line}", do="correct the line") from None
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"not YAML ({str(error).splitlines()[0]})", where=where) from None


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


def _plain(node):
    """ruamel's round-trip nodes as plain Python values."""
    if isinstance(node, dict):
        return {_plain(key): _plain(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_plain(item) for item in node]
    if isinstance(node, bool) or node is None:
        return node
    for kind in (int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node


def _line(tree, location: tuple) -> int | None:
    """The line (from 1) of the deepest part of a location that the file itself holds."""
    line, node = None, tree
    for step in location:
        try:
            if isinstance(node, dict) and step not in node:
                if same := [key for key in node if str(_plain(key)) == str(step)]:
                    step = same[0]  # pydantic shows a key that is no text as text
                else:
                    (node,) = node.values()  # an effect's options stand under its name
            line = (node.lc.key(step) if isinstance(node, dict) else node.lc.item(step))[0] + 1
            node = node[step]
        except (AttributeError, KeyError, IndexError, TypeError, ValueError):
            break
    return line


def _keys(model) -> list[str]:
    return [name for name in model.model_fields if (model, name) not in ((Experiment, "path"), (EffectSpec, "name"), (EffectSpec, "options"))]


def _model_at(location: tuple):
    """The model whose keys are allowed at the parent of a location."""
    model: Any = Experiment
    for step in location[:-1]:
        if isinstance(step, int) or not isinstance(model, type):
            continue
        field = model.model_fields.get(step)
        if field is None:
            continue
        found = _inner_model(field.annotation)
        model = found or model
    return model


def _inner_model(annotation):
    from typing import get_args

    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        if (found := _inner_model(argument)) is not None:
            return found
    return None


def _spelled(location: tuple) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in location).lstrip(".")


def _unknown_key(tree, location: tuple, path: Path) -> ConfigError:
    key, parent = str(location[-1]), _spelled(location[:-1])
    keys = _keys(_model_at(location))
    close = difflib.get_close_matches(key, keys, n=3, cutoff=0.4) or keys
    line = _line(tree, location)
    return ConfigError(
        f"unknown key {key!r}" + (f" in {parent}" if parent else ""),
        where=f"{path} line {line}" if line else str(path),
        allowed=", ".join(close),
        do="correct or remove the key",
    )


_SAID = {
    "model_type": "must be a mapping of keys to values", "dict_type": "must be a mapping of names to values", "list_type": "must be a list",
    "float_type": "must be a number", "int_type": "must be a whole number", "string_type": "must be text", "missing": "is missing",
    "finite_number": "must be a finite number", "invalid_key": "a key must be text",
}  # fmt: skip


def _named(error: ValidationError, tree, path: Path) -> ConfigError:
    """The first mistake of pydantic's list, as one line with the file's line number."""
    found = sorted(error.errors(), key=lambda e: (e["type"] != "extra_forbidden", _line(tree, e["loc"]) or 0))[0]
    location, kind, context = found["loc"], found["type"], found.get("ctx", {})
    if location[-1:] == ("name",) and location[:2] == ("model", "effects"):
        location = location[:-1]  # an effect's name is its place in the list
    if kind == "extra_forbidden":
        return _unknown_key(tree, location, path)
    if kind in ("too_short", "too_long"):
        needed = context.get("min_length") if kind == "too_short" else context.get("max_length")
        bound, entries = "at least" if kind == "too_short" else "at most", "entry" if needed == 1 else "entries"
        said = f"must have {bound} {needed} {entries}, not {context.get('actual_length')}"
    else:
        said = _SAID.get(kind, found["msg"].removeprefix("Value error, ").replace("Input should be", "must be"))
    given = found.get("input")
    shown = (
        f" (given: {str(given)[:60]!r})"
        if isinstance(given, str)
        else f" (given: {str(given)[:60]})"
        if isinstance(given, (int, float, type(None)))
        else ""
    )
    line = _line(tree, location)
    return ConfigError(f"{_spelled(location)}: {said}{shown}", where=f"{path} line {line}" if line else str(path))
