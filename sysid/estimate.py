"""Model x compressed data -> Fit: the estimate with its certificate, its uncertainty and its errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from . import uncertainty
from .certificate import Certificate
from .differences import difference
from .given_shapes import given_shapes
from .inertia.consistency import is_consistent
from .model import Model, moving_coefficients
from .motion import Motion
from .multistart import Searched
from .objective import posed
from .posed_problem import known_bodies, noise_weights, pose
from .prediction import Prediction
from .prior_weight import PriorWeight, number, with_weight
from .solve import Solution
from .specs import Experiment
from .triangles import Compressed
from .with_torque import WithTorque


@dataclass(frozen=True)
class Fit(WithTorque):
    """What identification found.

    pi (bodies, 10) about the joints' frames, `prior` the same before any data, `known` (bodies, 10, 10) the Hessian by which some are held to it, or None; coefficients of the effects in `model.coefficients`' order;
    x both in one vector. `experiment` has the prior's weight as a number; `strength` says whether it was chosen. `shape_std` of the model's shape values, NaN where held or undetermined, `shape_covariance` with it. `predictions` by "train" and "test". `notices`: what was decided on the way.
    `masses`: links that are far from their URDF's, as `masses.document` has them; empty where none is.
    `drives`: what was free of the drives, as found; `rollout`: {joint: RMS [rad or m]} by which they, let go, miss the test logs.
    `searched`: what was done about the shape values.
    """

    experiment: Experiment
    model: Model
    x: np.ndarray
    objective: float
    solution: Solution
    certificate: Certificate
    uncertainty: uncertainty.Uncertainty
    held: np.ndarray
    weights: np.ndarray | None
    compressed: Compressed
    physically_consistent: bool
    prior: np.ndarray
    strength: PriorWeight
    known: np.ndarray | None = None
    shape_std: np.ndarray = field(default_factory=lambda: np.zeros(0))
    shape_covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    predictions: dict[str, Prediction] = field(default_factory=dict)
    samples: dict[str, int] = field(default_factory=dict)
    left_out: dict[str, dict[str, int]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    filters: dict = field(default_factory=dict)
    masses: dict = field(default_factory=dict)
    logs: tuple[dict, ...] = ()
    events: tuple[dict, ...] = ()
    notices: tuple[str, ...] = ()
    drives: tuple = ()
    rollout: dict[str, float] | None = None
    searched: tuple[Searched, ...] = ()

    def __repr__(self) -> str:
        said = ["converged" if self.solution.converged else "not converged", *([f"proven optimal {given_shapes(self)}".strip()] if self.certificate.globally_optimal else [])]
        errors = ", ".join(f"{joint} {rms:.4g}" for joint, rms in zip(self.joints, self.predictions["test"].told()) if rms is not None) if "test" in self.predictions else "none"
        return f"<Fit of {self.experiment.name}: {len(self.x)} parameters, {', '.join(said)}; RMS on the test logs: {errors}>"

    def to_dataframe(self):
        """The parameters as a polars data frame: name, value, unit, std, from_data."""
        import polars

        from .fit_document import document

        return polars.DataFrame([{key: p[key] for key in ("name", "value", "unit", "std", "from_data")} for p in document(self)["parameters"]])

    def plot(self, part: str = "test"):
        """Measured and predicted torque of every joint on "train" or "test", as a Matplotlib figure."""
        return self.predictions[part].plot()

    @property
    def pi(self) -> np.ndarray:
        """Inertial parameters (bodies, 10)."""
        return self.x[: 10 * self.model.bodies].reshape(-1, 10)

    @property
    def coefficients(self) -> np.ndarray:
        """Coefficients of the effects."""
        return self.x[10 * self.model.bodies :]

    @property
    def joints(self) -> tuple[str, ...]:
        """Joint names."""
        return self.model.robot.joints

    @property
    def unused(self) -> tuple[str, ...]:
        """The joints of which no torque is used: those that the experiment says, and those of which none was logged."""
        lacking = {joint for event in self.events if event["kind"] == "missing" for joint in event["joints"]}
        seen = sum(prediction.counts for prediction in self.predictions.values())
        return tuple(j for k, j in enumerate(self.joints) if j in self.experiment.data.unused or (j in lacking and not seen[k]))

    def parameters_of(self, effect: str, joint: int) -> dict[str, tuple[float, float, str]]:
        """{name: (value, std or NaN, unit)} of an effect's parameters on a joint's number, -1 where its scope is the robot."""
        own, model = (effect, joint), self.model
        linear = zip(model.coefficients, self.coefficients, self.uncertainty.std[10 * model.bodies :])
        out = {c.name: (float(at), float(std), c.unit) for c, at, std in linear if (c.effect, c.joint) == own}
        shaped = zip(model.shape_values, model.shapes, self.shape_std)
        return out | {v.name: (float(at), float(std), v.unit) for v, at, std in shaped if (model.terms[v.term][0].name, v.joint) == own}

    def difference(self, parameter: str, a: str, b: str) -> tuple[float, float]:
        """Value of a parameter that is per group of logs at level b less that at level a, and its standard deviation.

        Args:
            parameter: its name without a level, `viscous.hip.Fv`.

        Raises:
            SysidError: there is no such parameter per group, or no such level of it.
        """
        return difference(self, parameter, a, b)

    def rms(self, part: str) -> dict[str, float]:
        """RMS residual of each joint on "train" or "test" [N m or N]."""
        return dict(zip(self.joints, self.predictions[part].errors()["rms"].tolist()))


def _room(model: Model, x, positive, slopes: int) -> np.ndarray:
    """(2, parameters and free shape values) how far down and up each may go."""
    out = np.full((2, len(x) + slopes), np.inf)
    own = 10 * model.bodies + np.flatnonzero(positive)
    out[0, own] = np.maximum(x[own], 0.0)
    free = [k for k, value in enumerate(model.shape_values) if not value.held][:slopes]
    for place, k in enumerate(free, len(x)):
        value, at = model.shape_values[k], model.shapes[k]
        out[:, place] = max(at - value.low, 0.0), max(value.high - at, 0.0)
    return out


def identify(experiment: Experiment, model: Model, motion: Motion, data: Compressed, prior: np.ndarray, callback=None, near=None, told: tuple[Sequence[int], np.ndarray] | None = None) -> Fit:
    """Solve, certify and say how sure; the predictions are added by the pipeline.

    Args:
        near: (size,) where the optimum is not far from, where that is known; the search begins at the prior otherwise.
        data: the training logs; where it holds slopes of shape values after the model's own parameters, these count in
            the uncertainty.
        told: numbers of shape values that other rows than these told, and their covariance.
    """
    experiment = with_weight(experiment, number(experiment))
    compressed = data if data.size == model.size else data.first(model.size)
    moving = moving_coefficients(model, motion)
    problem = pose(experiment, model, compressed, moving, prior)
    begun = None if near is None else problem.from_nearby(near, experiment.solver.tolerance)
    solution = problem.solve(experiment, None if begun is None else problem.coordinates.theta(begun), callback=callback)
    if experiment.solver.weighting == "noise":
        problem = pose(experiment, model, compressed, moving, prior, noise_weights(compressed, solution.x))
        solution = problem.solve(experiment, callback=callback)
    held = problem.coordinates.held
    certificate = problem.certify(solution.x)
    if certificate.globally_optimal and not solution.converged:
        solution = replace(solution, converged=True)  # a proven optimum needs no other test
    count = 10 * model.bodies
    fixed = np.zeros(len(solution.x), dtype=bool)
    fixed[count:] = held
    for body in known_bodies(experiment, model):
        fixed[10 * body : 10 * body + 10] = True
    slopes = data.size - model.size
    objective = problem.objective if not slopes else posed(data.total(problem.weights), problem.objective.divergence, problem.objective.weight, known_bodies(experiment, model))
    sure = uncertainty.estimate(objective, data, np.append(solution.x, np.zeros(slopes)), np.append(fixed, np.zeros(slopes, dtype=bool)), problem.weights, [count + k for k in certificate.at_zero], _room(model, solution.x, problem.coordinates.positive, slopes))
    free = [k for k, value in enumerate(model.shape_values) if not value.held][:slopes]
    sure = sure.told_elsewhere([model.size + free.index(k) for k in told[0]], told[1]) if told else sure
    shape_std = np.full(len(model.shape_values), np.nan)
    shape_std[free] = sure.std[model.size :]
    shape_covariance = np.full((len(shape_std), len(shape_std)), np.nan)
    shape_covariance[np.ix_(free, free)] = sure.covariance[model.size :, model.size :]
    kept = uncertainty.Uncertainty(sure.covariance[: model.size, : model.size], sure.std[: model.size], sure.from_data[: model.size])
    return Fit(
        experiment=experiment, model=model, x=solution.x, objective=solution.objective, solution=solution,
        certificate=certificate, held=held, weights=problem.weights, compressed=compressed,
        uncertainty=kept, shape_std=shape_std, shape_covariance=shape_covariance, prior=prior, known=problem.objective.known, strength=PriorWeight(number(experiment)),
        physically_consistent=bool(is_consistent(solution.x[problem.every_body]).all()),
    )  # fmt: skip
