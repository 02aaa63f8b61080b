"""A designed motion and what it promises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .fourier import Fourier
from .limits import Limits
from .promise import Pair


@dataclass(frozen=True)
class Design:
    """A motion and what it promises.

    coefficients (dof, 1 + 2 harmonics): of sines and cosines, amounts (dof, maneuvers): of the family's
    maneuvers. t (n,) [s]; q, qd, qdd (n, dof); torque (n, dof) as predicted, and its deviation; log_det of the
    information, and that of the best random motion; deviations: {parameter: {now, after}}; pairs of
    suspects; margins: shares of each range that are left, and metres. said: what to know of it.
    """

    joints: tuple[str, ...]
    family: Fourier
    coefficients: np.ndarray
    amounts: np.ndarray
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    torque: np.ndarray
    log_det: float
    random_best: float
    deviations: dict[str, dict[str, float]]
    pairs: tuple[Pair, ...]
    margins: dict[str, float]
    limits: Limits
    said: tuple[str, ...]

    def __repr__(self) -> str:
        told = "".join(f"; {p.a} against {p.b} {p.probability:.2f}" for p in self.pairs)
        more = self.log_det - self.random_best
        return f"<Design of {self.t[-1]:.4g} s for {len(self.joints)} joints, {more:+.1f} of log det on random{told}>"

    def to_dataframe(self):
        """The motion as a polars data frame: t, then q, qd, qdd and torque of every joint."""
        import polars

        parts = {"q": self.q, "qd": self.qd, "qdd": self.qdd, "torque": self.torque}
        columns = {
            f"{kind}_{j}": v[:, k] for kind, v in parts.items() for k, j in enumerate(self.joints)
        }
        return polars.DataFrame({"t": self.t, **columns})

    def plot(self):
        """Position, velocity and torque of every joint against their limits (dashed), as a
        Matplotlib figure."""
        from ..picture import Picture  # Matplotlib takes as long as a tenth of a design

        own = self.limits
        shown = (
            ("position", self.q, own.position), ("velocity", self.qd, _both(own.velocity)),
            ("torque", self.torque, _both(own.torque)),
        )  # fmt: skip
        figure = Picture(12.0, 1.0 + 1.8 * len(self.joints))
        grid = np.atleast_2d(figure.subplots(len(self.joints), 3, sharex=True))
        for j, joint in enumerate(self.joints):
            for axes, (name, values, bounds) in zip(grid[j], shown):
                axes.plot(self.t, values[:, j], linewidth=0.8)
                for bound in bounds[j][np.isfinite(bounds[j])]:
                    axes.axhline(bound, linestyle="--", linewidth=0.7, color="0.5")
                axes.set_ylabel(f"{joint} {name}")
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        return figure


def _both(most: np.ndarray) -> np.ndarray:
    """(dof, 2) of limits to both sides."""
    return most[:, None] * np.array([-1.0, 1.0])
