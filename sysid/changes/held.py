"""The model that a run folder holds, for logs of its robot: read once, asked of many."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import pipeline, run
from ..errors import ConfigError
from ..model import Model
from ..specs import Experiment, PreprocessSpec


@dataclass(frozen=True)
class Held:
    """A model and its parameters x (size,), and the experiment that says how logs are read.
    preprocess: how the run's own fit saw them."""

    experiment: Experiment
    model: Model
    x: np.ndarray
    preprocess: PreprocessSpec


def held(
    folder: Path, experiment: Experiment | None = None, levels: Mapping[str, str] | None = None
) -> Held:  # fmt: skip
    """The model and the parameters of a run folder of `sysid fit`, at a level of each group of
    logs.

    Args:
        experiment: of the logs; by default the run's own.

    Raises:
        SysidError: a level that is not there, or is not said.
        ConfigError: the folder holds no fit, or one of another robot than the experiment's.
    """
    found = run.read_run(folder)
    experiment = found.experiment if experiment is None else experiment
    if experiment is not found.experiment:
        _, own, _ = pipeline.build(experiment)
        if own.robot.joints != found.joints:
            raise ConfigError(
                f"the run moved {', '.join(found.joints)}",
                where=str(folder),
                allowed=", ".join(own.robot.joints),
                do="give the experiment that was fitted",
            )
    own = found.model.at(levels or {}, found.x)
    return Held(experiment, *own, found.experiment.preprocess)
