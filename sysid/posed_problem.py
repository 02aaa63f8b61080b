"""The optimisation problem that an experiment poses on compressed data: objective, coordinates, start, weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .carried import BALL, WEAK, Carried, places_of
from .certificate import Certificate, certify
from .errors import ConfigError
from .inertia import DIVERGENCES, PARAMETERIZATIONS
from .interior import minimise
from .model import Model
from .nearby import from_nearby
from .objective import Objective, posed
from .prior_weight import number
from .solve import Coordinates, Solution, solve
from .specs import Experiment
from .triangles import Compressed


@dataclass(frozen=True)
class Problem:
    """Everything a solve needs: objective, coordinates, the default start."""

    objective: Objective
    coordinates: Coordinates
    start: np.ndarray
    weights: np.ndarray | None
    carried: Carried | None = None

    @property
    def every_body(self) -> np.ndarray:
        """(bodies, 10) where the parameters of the robot's bodies stand in x, and of those that effects carry."""
        own = np.arange(10 * self.objective.bodies).reshape(-1, 10)
        return own if self.carried is None else np.concatenate([own, self.carried.places])

    @property
    def _handed(self):
        """Objective, coordinates, and the order in which the solver is handed x."""
        if self.carried is None:
            return self.objective, self.coordinates, slice(None)
        return self.carried.handed(self.objective, self.coordinates)

    def _possible(self, x) -> np.ndarray:
        return np.array(x) if self.carried is None else self.carried.possible(x)

    def solve(self, experiment: Experiment, start=None, callback=None) -> Solution:
        """Solve from `start` (default: the prior) with the experiment's settings."""
        settings, (objective, coordinates, order) = experiment.solver, self._handed
        begun = self.start if start is None else start
        if self.carried is not None:
            begun = coordinates.theta(self._possible(self.coordinates.physical(begun))[order])
        found = solve(
            objective, coordinates, begun,
            tolerance=settings.tolerance, max_iterations=settings.max_iterations, handover=settings.handover,
            callback=callback,
        )  # fmt: skip
        return found if self.carried is None else replace(found, x=_back(found.x, order), trace=tuple(_back(x, order) for x in found.trace))

    def minimum(self, tolerance: float) -> np.ndarray:
        """The optimum (size,), by the interior-point method alone."""
        objective, coordinates, order = self._handed
        begun = self._possible(self.coordinates.physical(self.start))[order]
        return _back(minimise(objective, coordinates.positive, coordinates.held, begun, tolerance=tolerance)[0][-1], order)

    def from_nearby(self, x, tolerance: float) -> np.ndarray | None:
        """The optimum (size,) from that of a problem that differs a little; None where it is not near, or the prior is no barrier."""
        if not self.objective.barrier:
            return None
        begun, held = self._possible(x), 10 * self.coordinates.bodies + np.flatnonzero(self.coordinates.held)
        begun[held] = self.coordinates.physical(self.start)[held]
        objective, coordinates, order = self._handed
        found = from_nearby(objective, coordinates.positive, coordinates.held, begun[order], tolerance=tolerance)
        return None if found is None else _back(found, order)

    def certify(self, x) -> Certificate:
        """The certificate of x (size,)."""
        objective, coordinates, order = self._handed
        found = certify(objective, x[order], coordinates.positive, coordinates.held, constrained=coordinates.constrained(objective))
        if self.carried is None:
            return found
        left = order[10 * coordinates.bodies :] - 10 * self.coordinates.bodies  # which coefficients the solver's are
        return replace(found, at_zero={int(left[k]): push for k, push in found.at_zero.items()})


def _back(x: np.ndarray, order) -> np.ndarray:
    """What the solver calls x in the model's order."""
    out = np.empty_like(x)
    out[order] = x
    return out


def pose(experiment: Experiment, model: Model, compressed: Compressed, moving: np.ndarray, prior: np.ndarray, weights=None) -> Problem:
    """The compressed optimisation problem of an experiment.

    Args:
        compressed: may hold slopes of shape values after the model's own parameters: free coefficients that begin at zero.
        moving: (coefficients,) bool, False for coefficients to hold at their prior.
        prior: (bodies, 10).
        weights: (joints,) that multiply the rows of each joint, or None.
    """
    return replace(pose_triangle(experiment, model, compressed.total(weights), int(compressed.rows.sum()), moving, prior), weights=weights)


def pose_triangle(experiment: Experiment, model: Model, total: np.ndarray, rows: int, moving: np.ndarray, prior: np.ndarray, signs: Sequence[bool] = ()) -> Problem:
    """The same of the triangle (size + 1, size + 1) of the data, of so many rows.

    Args:
        signs: (slopes,) True for slopes that must not be negative; none by default.
    """
    spec = experiment
    objective = posed(total, DIVERGENCES[spec.prior.divergence](prior), number(spec), known_bodies(spec, model))
    slopes = total.shape[1] - 1 - 10 * model.bodies - len(model.coefficients)
    positive = np.array([*(c.positive for c in model.coefficients), *(signs if len(signs) else slopes * [False])], dtype=bool)
    moving = np.append(moving, np.ones(slopes, dtype=bool))
    own = carried(total, model, rows)
    if own is not None:  # of a body the prior says what data do not
        moving[own.places.ravel() - 10 * model.bodies] = False
    held = ~moving | undetermined(objective, model, moving)
    if own is not None:
        held[own.places.ravel() - 10 * model.bodies] = False
    coordinates = Coordinates(PARAMETERIZATIONS[spec.model.inertia](), model.bodies, positive, held)
    x = np.concatenate([prior.ravel(), _starting_coefficients(model, objective, prior, positive, held)])
    if own is not None:
        x[own.places] = BALL
    return Problem(objective, coordinates, coordinates.theta(x), None, own)


def carried(total: np.ndarray, model: Model, rows: int) -> Carried | None:
    """The bodies among a model's coefficients that any log shows; None where there is none.

    Args:
        total: (size + 1, size + 1) triangle of the data, weighted, of so many rows.
    """
    places = places_of(model.coefficients, 10 * model.bodies)
    given = [one for one in places if total[:, one].any() and all(model.coefficients[k - 10 * model.bodies].given is None for k in one)]
    if not given:
        return None
    # what the best coefficients leave, bodies possible or not; of a log without noise a millionth of the torque
    variance = max(total[-1, -1] ** 2 / max(rows - (len(total) - 1), 1), 1e-12 * np.sum(total[:, -1] ** 2) / max(rows, 1))
    return Carried(np.array(given), WEAK * max(variance, np.finfo(float).tiny))


def known_bodies(experiment: Experiment, model: Model) -> list[int]:
    """The numbers of the bodies that `prior.known` names. Raises ConfigError: there is none of that name."""
    names = [body.name for body in model.robot.bodies]
    for name in experiment.prior.known:
        if name not in names:
            raise ConfigError(f"prior.known names the body {name!r}", allowed=", ".join(names), do="correct the name")
    return [names.index(name) for name in experiment.prior.known]


# A coefficient's column that others match to this share of its size is told from them by rounding alone.
_ALIKE = 1e-6


# Nothing of a robot is larger in SI units: what would have to be, to make torque of the size that was measured, is no number here.
_LARGEST = 1e12


def undetermined(objective: Objective, model: Model, moving) -> np.ndarray:
    """(coefficients,) bool: those that no data of this kind can tell from what stands before them in the model."""
    count = 10 * model.bodies
    out = np.zeros(len(moving), dtype=bool)
    columns, measured = objective.triangle[:, :-1], np.linalg.norm(objective.triangle[:, -1])
    # bodies have a prior; only coefficients can be left without any hold
    basis = np.zeros((len(columns), 0))
    for k in np.flatnonzero(moving):
        column = columns[:, count + k]
        size = np.linalg.norm(column)
        rest = column - basis @ (basis.T @ column)
        rest -= basis @ (basis.T @ rest)
        left = np.linalg.norm(rest)
        if left <= _ALIKE * size or size * _LARGEST <= measured:
            out[k] = True
        else:
            basis = np.column_stack([basis, rest / left])
    return out


def _starting_coefficients(model: Model, objective: Objective, prior, positive, held) -> np.ndarray:
    """Held: what is given, or what the URDF states (viscous, coulomb), else zero. The rest: the size that the data alone suggest."""
    count = prior.size
    robot = model.robot
    stated = {"viscous": robot.damping, "coulomb": robot.friction}
    urdf = np.array([stated[c.effect][c.joint] if c.effect in stated else 0.0 for c in model.coefficients])
    urdf = np.array([own if c.given is None else c.given for own, c in zip(urdf, model.coefficients)])
    urdf = np.append(urdf, np.zeros(len(held) - len(urdf)))
    columns = objective.triangle[:, count:-1]
    rest = objective.triangle[:, -1] - objective.triangle[:, :count] @ prior.ravel()
    squares = np.sum(columns**2, axis=0)
    alone = columns.T @ rest / np.where(squares > 0, squares, 1.0)
    size = np.linalg.norm(objective.triangle[:, -1]) / np.sqrt(np.where(squares > 0, squares, np.inf))
    guess = np.where(positive, np.maximum(alone, 1e-3 * size), 0.0)
    return np.where(held, urdf, guess)


def noise_weights(compressed: Compressed, x) -> np.ndarray:
    """(joints,) inverse residual RMS, scaled so that their geometric mean is one.

    The objective is then the weighted sum; no single joint, however quiet, sets its size against the prior.
    """
    return inverse(np.sqrt(compressed.squares(x) / np.maximum(compressed.rows, 1)))


def inverse(rms: np.ndarray) -> np.ndarray:
    """(joints,) weights: the inverse of residual RMS, with a geometric mean of one; one for a joint that has no residual."""
    there = rms > 0.0
    weights = 1.0 / np.maximum(np.where(there, rms, 1.0), 1e-9 * rms.max())
    return np.where(there, weights / np.exp(np.mean(np.log(weights[there]))), 1.0) if there.any() else np.ones(len(rms))
