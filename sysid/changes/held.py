"""The model that a run folder holds, on the robot of an experiment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import pipeline
from ..errors import ConfigError
from ..model import Model
from ..results import read_fit
from ..specs import Experiment


def read_run(run: Path, experiment: Experiment) -> tuple[Model, np.ndarray]:
    """The model and the parameters x (size,) of a run folder of `sysid fit`, on the experiment's
    robot.

    Raises:
        ConfigError: the folder holds no fit, or one of another robot.
    """
    values, _ = read_fit(run / "fit.json", "--model")
    _, structure, _ = pipeline.build(pipeline.load(run / "experiment.yaml"))
    missing = [
        name
        for name in (*structure.names, *(v.name for v in structure.shape_values))
        if name not in values
    ]
    if missing:
        raise ConfigError(
            f"the run has no value for {missing[0]}", where=str(run), do="fit it again"
        )
    _, own, _ = pipeline.build(experiment)
    if own.robot.joints != structure.robot.joints:
        raise ConfigError(
            f"the run moved {', '.join(structure.robot.joints)}",
            where=str(run),
            allowed=", ".join(own.robot.joints),
            do="give the experiment that was fitted",
        )
    x = np.array([values[name] for name in structure.names])
    structure = structure.with_shapes([values[v.name] for v in structure.shape_values])
    return structure.with_reference(x[: 10 * structure.bodies].reshape(-1, 10)), x
