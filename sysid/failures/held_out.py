"""A settled model on the test logs: opened once, after everything is chosen."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import rows as row
from ..model import Model
from ..motion import Motion
from ..settled import Settled


@dataclass(frozen=True)
class HeldOut:
    """A model settled on the training motion, and the test motion under the same low-pass."""

    settled: Settled
    test: Motion

    @property
    def model(self) -> Model:
        """The model, with its shape values found."""
        return self.settled.model

    @cached_property
    def rows(self) -> row.Rows:
        """Test rows."""
        return row.stack(self.model, self.test, self.settled.stride)

    @cached_property
    def residual(self) -> np.ndarray:
        """(n, dof) on the test rows."""
        return self.rows.residual(self.settled.x)

    def rms(self) -> np.ndarray:
        """(dof,) root mean square of the residual on the test rows that count."""
        return self.rows.rms(self.residual)

    @cached_property
    def variables(self) -> dict[str, tuple[str, np.ndarray]]:
        """{q_joint, qd_joint: (unit, (n,))} and time on the test rows."""
        robot, out = self.model.robot, {"time": ("s", self.rows.t)}
        for name, per in (("q", ""), ("qd", "/s")):
            values = self.rows.of(self.test, name)
            for j, joint in enumerate(robot.joints):
                unit = ("m" if robot.prismatic[j] else "rad") + per
                out[f"{name}_{joint}"] = (unit, values[:, j])
        return out


def taken(before: Settled, after: Settled, test: Motion) -> np.ndarray:
    """(dof,) the share of each joint's squared residual on a test motion that goes from one settled
    model to another; negative where it grows."""
    return fallen(*(HeldOut(one, test) for one in (before, after)))


def fallen(before: HeldOut, after: HeldOut) -> np.ndarray:
    """(dof,) the share of each joint's squared residual that goes; negative where it grows."""
    return 1.0 - (after.rms() / np.maximum(before.rms(), 1e-300)) ** 2
