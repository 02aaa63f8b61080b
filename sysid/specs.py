"""What an experiment says: every key typed. Plain data; how it is read from a file stands in `config`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from .drive_spec import ActuatorSpec
from .log_spec import DataSpec
from .robot_spec import RobotSpec
from .spec_values import AUTO, Label, Number, Spec, Text, _finite, auto_or_positive, checked_standstill, checked_weight


class MaskSpec(Spec):
    """A stretch of a log that counts in no fit and no error: start <= t <= stop [s] on the log's own clock; of some joints, or all."""

    log: Text
    start: Number
    stop: Number
    joints: Annotated[list[str], Field(min_length=1)] | None = None

    def model_post_init(self, _context: Any) -> None:
        if not self.start < self.stop:
            raise ValueError(f"start {self.start:g} must be before stop {self.stop:g}")


class PreprocessSpec(Spec):
    """The filter from logged angles to position, velocity and acceleration."""

    filter: Literal["savitzky-golay", "butterworth", "none"] = "savitzky-golay"
    order: Annotated[int, Field(ge=1, le=12)] = 4
    window: Annotated[Any, BeforeValidator(auto_or_positive)] = 0.1
    cutoff: Annotated[Any, BeforeValidator(auto_or_positive)] = 10.0
    torque: Literal["raw", "same", "low-pass"] = "raw"
    standstill: Annotated[Any, BeforeValidator(checked_standstill)] = "auto"
    events: Literal["mask", "keep"] = "mask"
    mask: list[MaskSpec] = []

    def model_post_init(self, _context: Any) -> None:
        if self.filter == "savitzky-golay" and self.order < 2:
            raise ValueError(f"order {self.order} has no acceleration: savitzky-golay needs 2 to 12")


def is_own(name: str) -> bool:
    """Whether an effect's name is a class in a Python file, `my_effects.py:Name`."""
    return re.fullmatch(r"[^\0]*[^\0/\\:]\.py:[A-Za-z_]\w*", name) is not None


class EffectSpec(Spec):
    """An effect of the vocabulary, the joints that have it (None: every joint), and its own options by name. `per` names the group
    of logs at each level of which it has parameters of its own, but for the levels of `except` (here `spared`), which lack it."""

    name: str
    joints: Annotated[list[str], Field(min_length=1)] | None = None
    per: Label | None = None
    spared: Annotated[list[Label], Field(min_length=1)] | None = Field(default=None, alias="except")
    options: dict[str, Any] = {}


ENTRY = tuple(field.alias or name for name, field in EffectSpec.model_fields.items() if name not in ("name", "options"))
"""The keys that every effect's entry may have beside the effect's own."""


class ModelSpec(Spec):
    """How bodies are parameterized, and the effects on the joints."""

    inertia: Literal["log-cholesky", "exponential", "eigenvalue", "linear"] = "log-cholesky"
    effects: list[EffectSpec] = [EffectSpec(name="viscous"), EffectSpec(name="coulomb")]
    candidates: list[EffectSpec] = []


class PriorSpec(Spec):
    """What the bodies are believed to be before any data, and how strongly; `known` bodies are exactly that."""

    divergence: Literal["log-det", "pullback", "euclidean"] = "log-det"
    weight: Annotated[Any, BeforeValidator(checked_weight)] = AUTO
    source: Text = "urdf"
    known: list[str] = []


class SolverSpec(Spec):
    """When to stop, and whether each joint counts by its noise."""

    tolerance: Annotated[float, AfterValidator(_finite), Field(gt=0, lt=1)] = 1.0e-8
    max_iterations: Annotated[int, Field(ge=1)] = 200
    weighting: Literal["auto", "none", "noise"] = AUTO
    handover: Annotated[float, AfterValidator(_finite), Field(ge=0, le=1)] = 0.5


class Experiment(Spec):
    """An experiment file, every default filled in. `path` is the file; paths inside are relative to its folder."""

    robot: RobotSpec = RobotSpec()
    data: DataSpec = Field(default_factory=DataSpec)
    actuator: dict[str, ActuatorSpec] = {}
    preprocess: PreprocessSpec = PreprocessSpec()
    model: ModelSpec = ModelSpec()
    prior: PriorSpec = PriorSpec()
    solver: SolverSpec = SolverSpec()
    path: Path = Field(default=Path("experiment.yaml"), exclude=True)

    def model_post_init(self, _context: Any) -> None:
        if self.solver.weighting == AUTO:  # where the prior's weight is given, it is beside the sum of squares as it stands
            weighting = "noise" if self.prior.weight == AUTO else "none"
            object.__setattr__(self, "solver", self.solver.model_copy(update={"weighting": weighting}))

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
