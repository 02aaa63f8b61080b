"""Model x compressed data -> Fit: the estimate with its certificate, its uncertainty and its errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from . import uncertainty
from .certificate import Certificate, certify
from .differences import difference
from .errors import ConfigError
from .inertia import DIVERGENCES, PARAMETERIZATIONS
from .inertia.consistency import is_consistent
from .inverse_dynamics import WithTorque
from .model import Model, moving_coefficients
from .motion import Motion, Piece
from .multistart import Searched
from .nearby import from_nearby
from .objective import Objective, posed
from .prior_weight import PriorWeight, number, with_weight
from .robot import Robot
from .solve import Coordinates, Solution, solve
from .specs import Experiment
from .triangles import Compressed


@dataclass(frozen=True)
class States:
    """Where the joints were in some rows of a prediction, spread evenly over it: index (m,) of the row; q, qd (m, dof)."""

    index: np.ndarray
    q: np.ndarray
    qd: np.ndarray


@dataclass(frozen=True)
class Sums:
    """What errors are made of, over the rows that count, each (dof,): squared residuals, squared torques, torques, and how many rows."""

    squares: np.ndarray
    size: np.ndarray
    total: np.ndarray
    counts: np.ndarray

    def __add__(self, other: Sums) -> Sums:
        return Sums(self.squares + other.squares, self.size + other.size, self.total + other.total, self.counts + other.counts)


@dataclass(frozen=True)
class Prediction:
    """Measured and predicted torque over the pieces of one set of logs.

    log (n,) number of the log; t (n,) [s]; measured (n, dof) as logged, filtered where the fit filtered torque;
    predicted (n, dof); use (n, dof) bool, None where every row counts; joints: names, units: N m or N, of each;
    states: of at most `_STATES` rows, None where nobody kept them.
    """

    log: np.ndarray
    t: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    use: np.ndarray | None
    joints: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    states: States | None = None

    def __repr__(self) -> str:
        errors = ", ".join(f"{joint} {rms:.4g}" for joint, rms in zip(self.joints, self.told()) if rms is not None)
        return f"<Prediction of {len(self.t)} samples: RMS {errors}>"

    def to_dataframe(self):
        """A polars data frame: log, t [s], measured_ and predicted_ torque of each joint, used_ where rows are left out."""
        import polars

        columns = {"log": self.log, "t": self.t}
        for k, joint in enumerate(self.joints):
            columns |= {f"measured_{joint}": self.measured[:, k], f"predicted_{joint}": self.predicted[:, k]}
            columns |= {} if self.use is None else {f"used_{joint}": self.use[:, k]}
        return polars.DataFrame(columns)

    def lazy(self):
        """`to_dataframe` as polars' lazy frame: of what is in files nothing is read."""
        return self.to_dataframe().lazy()

    @property
    def residual(self) -> np.ndarray:
        """measured - predicted (n, dof), zero on rows that do not count."""
        residual = self.measured - self.predicted
        return residual if self.use is None else np.where(self.use, residual, 0.0)

    def counted_residual(self, joint: int) -> np.ndarray:
        """(n,) measured minus predicted torque of a joint, NaN where a row does not count."""
        left = self.measured[:, joint] - self.predicted[:, joint]
        return left if self.use is None else np.where(self.use[:, joint], left, np.nan)

    @property
    def counts(self) -> np.ndarray:
        """(dof,) rows that count."""
        n, dof = self.measured.shape
        return np.full(dof, n) if self.use is None else self.use.sum(0)

    def sums(self) -> Sums:
        """What errors are made of."""
        kept = self.measured if self.use is None else np.where(self.use, self.measured, 0.0)
        return Sums(_sum(self.residual**2), _sum(kept**2), _sum(kept), self.counts)

    def greatest(self, count: int) -> np.ndarray:
        """(count, dof) the greatest sizes of each joint's measured torque, falling; fewer where there are fewer rows."""
        size, count = np.abs(self.measured), min(count, len(self.measured))
        return -np.sort(-np.partition(size, len(size) - count, axis=0)[len(size) - count :], axis=0)

    def told(self) -> list[float | None]:
        """RMS [N m] of each joint, None where no row of it counts."""
        return [float(rms) if count else None for rms, count in zip(self.errors()["rms"], self.counts)]

    def errors(self) -> dict[str, np.ndarray]:
        """`rms` [N m], `relative_error` (norm of the residual over that of the torque), `r2`, each (dof,), and their
        totals over all joints under `total`; NaN where the torque itself is zero or constant. The RMS of a joint no row
        of which counts is zero: `told` says None."""
        sums = self.sums()
        squares, size, counts = sums.squares, sums.size, np.maximum(sums.counts, 1)
        spread = size - sums.total**2 / counts
        # a spread that is rounding of a constant is none
        spread = np.where(spread > 1e-12 * size, spread, 0.0)
        share = lambda part, whole: np.divide(part, whole, out=np.full(np.shape(whole), np.nan), where=np.asarray(whole) > 0)  # noqa: E731
        return {
            "rms": np.sqrt(squares / counts),
            "relative_error": np.sqrt(share(squares, size)),
            "r2": 1.0 - share(squares, spread),
            "total": np.array([
                np.sqrt(squares.sum() / max(self.counts.sum(), 1)), float(np.sqrt(share(squares.sum(), size.sum()))), 1.0 - float(share(squares.sum(), spread.sum())),
            ]),
        }  # fmt: skip

    def plot(self):
        """Measured and predicted torque of every joint, as a Matplotlib figure."""
        from .picture import Picture

        dof = len(self.joints)
        figure = Picture(10.0, 1.0 + 1.8 * dof)
        for j, axes in enumerate(np.atleast_1d(figure.subplots(dof, 1, sharex=True))):
            for values, label in ((self.measured, "measured"), (self.predicted, "predicted")):
                axes.plot(self.t, values[:, j], linewidth=0.8, label=label)
            axes.set_ylabel(f"{self.joints[j]} [{self.units[j]}]")
        axes.set_xlabel("time [s]")
        figure.axes[0].legend(loc="upper right")
        return figure


def units(robot: Robot) -> tuple[str, ...]:
    """The unit of each joint's torque."""
    return tuple("N" if slides else "N m" for slides in robot.prismatic)


def _sum(values):
    return values.sum(axis=0)


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

        from .results import document

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


def given_shapes(fit: Fit) -> str:
    """What a certificate takes as given, in words: it proves the rest of the model at the shape values that stand there, of which
    the objective is no convex function. Empty where the model has none."""
    count = len(fit.model.shape_values)
    return f"given the shape value{'s' * (count > 1)}" if count else ""


def said_of_shapes(fit: Fit) -> list[str]:
    """What was done about the shape values that a certificate takes as given, in sentences."""
    out, alike = [], {}
    for one in fit.searched:
        alike.setdefault((one.starts, one.lower), []).append(one)
    for (starts, lower), group in alike.items():
        counts = sorted({one.profile for one in group})
        each = "its profile" if len(group) == 1 else "the profile over each"
        at = " to ".join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))
        begun = f"started from {starts} places" if starts > 1 else "started where nothing is done"
        checked = f"{each} was checked at {at} values, {'which led to a lower place, and the search went on there' if lower else 'and none lay lower'}"
        out.append(f"{', '.join(one.name for one in group)}: {begun}; {checked if counts[-1] else 'no profile was checked'}")
    if held := [v.name for v in fit.model.shape_values if v.held]:
        out.append(f"{', '.join(held)}: held as the experiment says")
    for value, at in zip(fit.model.shape_values, fit.model.shapes):
        if at_edge(value, at):
            out.append(f"{value.name} = {at:.4g} {value.unit} is at the edge of its range, {value.low:.4g} to {value.high:.4g}")
    return out


def at_edge(value, at: float) -> bool:
    """Whether a shape value ended at an end of its range, where the objective may fall further beyond."""
    near = 1e-6 * (value.high - value.low)
    ends = [end for end in (value.low, value.high) if end != value.shape.start]
    return not value.held and any(abs(at - end) <= min(near, 1e-3 * abs(end) or near) for end in ends)


@dataclass(frozen=True)
class Problem:
    """Everything a solve needs: objective, coordinates, the default start."""

    objective: Objective
    coordinates: Coordinates
    start: np.ndarray
    weights: np.ndarray | None

    def solve(self, experiment: Experiment, start=None, callback=None) -> Solution:
        """Solve from `start` (default: the prior) with the experiment's settings."""
        settings = experiment.solver
        return solve(
            self.objective, self.coordinates, self.start if start is None else start,
            tolerance=settings.tolerance, max_iterations=settings.max_iterations, handover=settings.handover,
            callback=callback,
        )  # fmt: skip

    def from_nearby(self, x, tolerance: float) -> np.ndarray | None:
        """The optimum (size,) from that of a problem that differs a little; None where it is not near, or the prior is no barrier."""
        if not self.objective.barrier:
            return None
        begun, held = np.array(x), 10 * self.coordinates.bodies + np.flatnonzero(self.coordinates.held)
        begun[held] = self.coordinates.physical(self.start)[held]
        return from_nearby(self.objective, self.coordinates.positive, self.coordinates.held, begun, tolerance=tolerance)

    def certify(self, x) -> Certificate:
        """The certificate of x (size,)."""
        coordinates = self.coordinates
        return certify(self.objective, x, coordinates.positive, coordinates.held, constrained=coordinates.constrained(self.objective))


def pose(experiment: Experiment, model: Model, compressed: Compressed, moving: np.ndarray, prior: np.ndarray, weights=None) -> Problem:
    """The compressed optimisation problem of an experiment.

    Args:
        compressed: may hold slopes of shape values after the model's own parameters: free coefficients that begin at zero.
        moving: (coefficients,) bool, False for coefficients to hold at their prior.
        prior: (bodies, 10).
        weights: (joints,) that multiply the rows of each joint, or None.
    """
    spec = experiment
    objective = posed(compressed.total(weights), DIVERGENCES[spec.prior.divergence](prior), number(spec), known_bodies(spec, model))
    size = 10 * model.bodies + len(model.coefficients)
    slopes = objective.triangle.shape[1] - 1 - size
    positive = np.array([c.positive for c in model.coefficients] + [False] * slopes, dtype=bool)
    moving = np.append(moving, np.ones(slopes, dtype=bool))
    held = ~moving | undetermined(objective, model, moving)
    coordinates = Coordinates(PARAMETERIZATIONS[spec.model.inertia](), model.bodies, positive, held)
    x = np.concatenate([prior.ravel(), _starting_coefficients(model, objective, prior, positive, held)])
    x[size:] = 0.0
    return Problem(objective, coordinates, coordinates.theta(x), weights)


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


def identify(experiment: Experiment, model: Model, motion: Motion, data: Compressed, prior: np.ndarray, callback=None, near=None) -> Fit:
    """Solve, certify and say how sure; the predictions are added by the pipeline.

    Args:
        near: (size,) where the optimum is not far from, where that is known; the search begins at the prior otherwise.
        data: the training logs; where it holds slopes of shape values after the model's own parameters, these count in
            the uncertainty.
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
    fixed[[count + k for k in certificate.at_zero]] = True
    slopes = data.size - model.size
    objective = problem.objective if not slopes else posed(data.total(problem.weights), problem.objective.divergence, problem.objective.weight, known_bodies(experiment, model))
    sure = uncertainty.estimate(objective, data, np.append(solution.x, np.zeros(slopes)), np.append(fixed, np.zeros(slopes, dtype=bool)), problem.weights)
    shape_std = np.full(len(model.shape_values), np.nan)
    shape_std[[k for k, value in enumerate(model.shape_values) if not value.held][:slopes]] = sure.std[model.size :]
    shape_covariance = np.full((len(shape_std), len(shape_std)), np.nan)
    told = np.ix_(*2 * [[k for k, value in enumerate(model.shape_values) if not value.held][:slopes]])
    shape_covariance[told] = sure.covariance[model.size :, model.size :]
    kept = uncertainty.Uncertainty(sure.covariance[: model.size, : model.size], sure.std[: model.size], sure.from_data[: model.size])
    return Fit(
        experiment=experiment, model=model, x=solution.x, objective=solution.objective, solution=solution,
        certificate=certificate, held=held, weights=problem.weights, compressed=compressed,
        uncertainty=kept, shape_std=shape_std, shape_covariance=shape_covariance, prior=prior, known=problem.objective.known, strength=PriorWeight(number(experiment)),
        physically_consistent=bool(is_consistent(solution.x[:count].reshape(-1, 10)).all()),
    )  # fmt: skip


def predict(model: Model, x, motion: Motion) -> Prediction:
    """Torque that a model with parameters x (size,) predicts over a motion."""
    count = 10 * model.bodies
    pi, c = np.asarray(x)[:count].reshape(-1, 10), np.asarray(x)[count:]
    pieces = motion.pieces
    joined = lambda parts: parts[0] if len(parts) == 1 else np.concatenate(parts)  # noqa: E731 - no copy of a long log
    return Prediction(
        log=joined([np.full(piece.samples, piece.log, dtype=np.int16) for piece in pieces]),
        t=joined([piece.t[piece.core] for piece in pieces]),
        measured=joined([piece.tau[piece.core] for piece in pieces]),
        predicted=joined([model.torque(piece, pi, c) for piece in pieces]),
        use=None if pieces[0].use is None else joined([piece.use[piece.core] for piece in pieces]),
        joints=model.robot.joints, units=units(model.robot), states=_states(motion),
    )


_STATES = 20_000  # rows: more than a screen has points


def _states(motion: Motion) -> States:
    first, parts = 0, []
    for piece in motion.pieces:
        parts.append(states(piece, first, motion.samples))
        first += piece.samples
    return joined_states(parts)


def states(piece: Piece, first: int, samples: int) -> States:
    """Where the joints were in a piece that stands from row `first` on in a prediction of so many rows."""
    stride = max(1, -(-samples // _STATES))
    own = np.arange(-first % stride, piece.samples, stride)
    rows = piece.core.start + own
    return States(first + own, piece.q[rows], piece.qd[rows])


def joined_states(parts: Sequence[States]) -> States:
    """Those of all pieces, one after the other."""
    return States(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("index", "q", "qd")))
