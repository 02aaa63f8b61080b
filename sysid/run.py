"""A run folder -> Run: an identified model, ready to be used where no log is at hand.

The folder is all that it needs: the robot is that of identified.urdf, with the rotors, joints and
effects of identified.yaml and the values of fit.json.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import bounded, config, pipeline
from .earlier_fit import read_fit
from .errors import ConfigError
from .inertia import PARAMETERS
from .model import Model
from .prediction import Prediction, units
from .specs import Experiment
from .warned import noticed
from .with_torque import WithTorque


@dataclass(frozen=True)
class Run(WithTorque):
    """A run folder of `sysid fit`.

    experiment: that of identified.yaml, whose logs need not be there. model: robot and effects
    with their shape values.
    x: (size,) all linear parameters, named by `model.names`. document: fit.json.
    """

    folder: Path
    experiment: Experiment
    model: Model
    x: np.ndarray
    document: dict

    def __repr__(self) -> str:
        errors = ", ".join(
            f"{joint} {rms:.4g}" for joint, rms in self.rms("test").items() if rms is not None
        )
        left = f"; torque is without {', '.join(self.omitted)}" if self.omitted else ""
        return (
            f"<Run {self.folder}: {len(self.x)} parameters; RMS on the test logs: {errors}{left}>"
        )

    @property
    def joints(self) -> tuple[str, ...]:
        """Joint names, in the order of every array."""
        return self.model.robot.joints

    def rms(self, part: str) -> dict[str, float | None]:
        """RMS residual of each joint on "train" or "test" [N m or N], as the fit found it; None of
        a joint whose torque is not used."""
        return dict(self.document["rms"][part])

    def prediction(self, part: str = "test") -> Prediction:
        """Measured and predicted torque on "train" or "test", as the fit wrote them. Raises
        ConfigError."""
        import polars

        path = self.folder / "predictions.parquet"
        try:
            table = polars.read_parquet(path).filter(polars.col("part") == part)

            def taken(word):
                return table.select([f"{word}_{j}" for j in self.joints]).to_numpy()

            masked = f"used_{self.joints[0]}" in table.columns
            times = table["log"].to_numpy(), table["t"].to_numpy()
            return Prediction(
                *times,
                taken("measured"),
                taken("predicted"),
                taken("used") if masked else None,
                self.joints,
                units(self.model.robot),
            )
        except (OSError, polars.exceptions.PolarsError) as error:
            said = getattr(error, "strerror", None) or "not as `sysid fit` writes it"
            raise ConfigError(
                f"the predictions cannot be read ({said})", where=str(path), do="fit it again"
            ) from None

    def to_dataframe(self):
        """The parameters as a polars data frame: name, value, unit, std, from_data."""
        import polars

        keys = ("name", "value", "unit", "std", "from_data")
        return polars.DataFrame(
            [{key: p[key] for key in keys} for p in self.document["parameters"]]
        )

    def plot(self, part: str = "test"):
        """Measured and predicted torque of every joint on "train" or "test", as a Matplotlib
        figure."""
        return self.prediction(part).plot()


def read_run(folder: str | Path) -> Run:
    """What a run folder of `sysid fit` holds: parameters, errors, and `torque(q, qd, qdd)`.

        run = sysid.read_run("runs/cheetah3")
        run.torque(q, qd, qdd)

    Args:
        folder: the folder that `sysid fit` or `sysid.write` wrote. Its logs need not be there.

    Raises:
        SysidError: the folder holds no fit.
    """
    folder = Path(folder)
    values, _ = read_fit(folder / "fit.json", "the run")
    experiment = config.load(folder / "identified.yaml")
    with noticed():  # what is odd in the URDF was told by the fit
        _, model, _ = pipeline.build(experiment)
    document = json.loads(bounded.read_text(folder / "fit.json"))
    wanted = (*model.names, *(value.name for value in model.shape_values))
    if missing := [name for name in wanted if name not in values]:
        raise ConfigError(
            f"the run has no value for {missing[0]}", where=str(folder), do="fit it again"
        )
    x = np.array([values[name] for name in model.names])
    model = model.with_shapes([values[value.name] for value in model.shape_values])
    c = x[10 * model.bodies :]
    model = model.with_reference(_load_bodies(model, document, x), c)
    return Run(folder, experiment, model, x, document)


def _load_bodies(model: Model, document: dict, x: np.ndarray) -> np.ndarray:
    """Bodies (bodies, 10) behind the model's load: those of the fit, where it had any."""
    bodies = x[: 10 * model.bodies].reshape(-1, len(PARAMETERS))
    known = document.get("load_bodies")
    return (
        bodies
        if known is None
        else np.array([known[body.name] for body in model.robot.bodies], dtype=float)
    )
