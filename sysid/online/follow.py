"""What all rows so far say, as one triangle with forgetting; its optimum, physically possible.

    |R [x; -1]|^2 = sum_i lambda^(now - i) (a_i x - tau_i)^2

New rows are stacked under the triangle, each weighed by how long ago it was, and reduced by
Householder reflections: the square root of the information, never the information itself, so that a
condition number of 1e8 keeps half of all digits. The optimum of the experiment's objective is found
from the last by a few steps of Newton's in log-Cholesky coordinates, when it is asked for.

Source: Bierman 1977 (square-root information filters).
"""

from __future__ import annotations

import numpy as np

from ..model import Model
from ..posed_problem import Problem, pose
from ..reduction import triangle
from ..specs import Experiment
from ..triangles import Compressed, Factor
from .stream import Rows


class Follower:
    """Follows a robot.

    Args:
        prior: (bodies, 10). moving: (coefficients,) bool, False for those that are held.
        forgetting: lambda of a row, 1 to forget nothing.
    """

    def __init__(
        self, experiment: Experiment, model: Model, prior, moving, forgetting: float
    ):  # fmt: skip
        self.experiment, self.model = experiment, model
        self.prior, self.moving, self.forgetting = np.asarray(prior), moving, forgetting
        self.factor = np.zeros((model.size + 1, model.size + 1))
        self.rows, self._counted = 0, 0.0  # and the joints' rows, each as much as is left of it
        self._x: np.ndarray | None = None
        self._asked_at = -1

    def add(self, rows: Rows) -> None:
        """Take rows in."""
        n, dof = len(rows.t), rows.tau.shape[1]
        weight = self.forgetting ** (0.5 * np.arange(n - 1, -1, -1))
        stacked = np.zeros((len(self.factor) + n * dof, self.model.size + 1), order="F")
        stacked[: len(self.factor)] = self.factor * self.forgetting ** (0.5 * n)
        for joint in range(dof):
            own = slice(len(self.factor) + joint * n, len(self.factor) + (joint + 1) * n)
            stacked[own, :-1] = rows.columns[joint] * weight[:, None]
            stacked[own, -1] = rows.tau[:, joint] * weight
        self.factor = triangle(stacked)
        self.rows += n
        self._counted = self._counted * self.forgetting**n + dof * float(np.sum(weight**2))

    @property
    def x(self) -> np.ndarray:
        """The optimum (size,) of all rows so far."""
        if self._asked_at != self.rows or self._x is None:
            whole = np.arange(self.model.size)
            factor = Factor(0, 0, whole, self.factor, max(round(self._counted), 1))
            data = Compressed(self.model.size, 1, (factor,), max(self.rows, 1))
            problem = pose(self.experiment, self.model, data, self.moving, self.prior)
            # without a barrier a body may stand on the edge of what is possible, where no search
            # can begin
            inside = self._x is not None and problem.objective.barrier
            start = self._begun(problem) if inside else None
            self._x = problem.solve(self.experiment, start).x
            self._asked_at = self.rows
        return self._x

    def _begun(self, problem: Problem) -> np.ndarray:
        """The last optimum in a problem's coordinates. What is held stays where the problem holds
        it; what stood at zero begins where the problem would begin."""
        coordinates, x, count = problem.coordinates, self._x.copy(), 10 * self.model.bodies
        fresh = coordinates.physical(problem.start)[count:]
        again = coordinates.held | (coordinates.positive & (x[count:] <= 0.0))
        x[count:] = np.where(again, fresh, x[count:])
        return coordinates.theta(x)
