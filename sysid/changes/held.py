"""The model that a run folder holds, for logs of an experiment's robot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .. import pipeline, run
from ..errors import ConfigError
from ..model import Model
from ..specs import Experiment


def held(
    folder: Path, experiment: Experiment, levels: Mapping[str, str]
) -> tuple[Model, np.ndarray]:  # fmt: skip
    """The model and the parameters x (size,) of a run folder of `sysid fit`, at a level of each
    group of logs.

    Raises:
        SysidError: a level that is not there, or is not said.
        ConfigError: the folder holds no fit, or one of another robot than the experiment's.
    """
    found = run.read_run(folder)
    _, own, _ = pipeline.build(experiment)
    if own.robot.joints != found.joints:
        raise ConfigError(
            f"the run moved {', '.join(found.joints)}",
            where=str(folder),
            allowed=", ".join(own.robot.joints),
            do="give the experiment that was fitted",
        )
    return found.model.at(levels, found.x)
