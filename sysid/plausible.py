"""What a fit says that cannot be meant: sentences, each with its figure."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .estimate import Fit

_EFFORT, _FEWEST = 1.5, 3  # times what the URDF allows the drive, and in how many samples
ASK = "are its columns, signs and units right? `sysid check` says"


def implausible(fit: Fit) -> Iterator[str]:
    """Joints that the model explains worse than their mean, torque beyond the drive's. Of masses see `masses`."""
    test = fit.predictions["test"].errors()
    worse = [f"{joint} (R2 {r2:.2g})" for joint, r2 in zip(fit.joints, test["r2"]) if r2 < 0.0]
    if worse:
        yield f"implausible: the model is worse than none on the test logs of {', '.join(worse)}; {ASK}"
    robot, greatest = fit.model.robot, fit.predictions["train"].greatest(_FEWEST)
    for j, joint in enumerate(fit.joints):
        allowed = robot.source.joints[joint].effort
        torque = greatest[:, j]
        if np.sum(torque > _EFFORT * allowed) >= _FEWEST:
            yield f"implausible: the torque of {joint} reaches {torque.max():.4g}, the URDF allows its drive {allowed:.4g}; {ASK}"
