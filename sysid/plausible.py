"""What a fit says that cannot be meant: sentences, each with its figure."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .estimate import Fit

# Times the URDF's mass, or parts of it: simulated arms whose masses are drawn about the URDF's, and
# real ones, are given a quarter to four times, where the logs tell a mass and where they do not
_MASS = 5.0
_EFFORT, _FEWEST = 1.5, 3  # times what the URDF allows the drive, and in how many samples
_ASK = "are its columns, signs and units right? `sysid check` says"


def implausible(fit: Fit) -> Iterator[str]:
    """Joints that the model explains worse than their mean, links far from their masses in the URDF,
    torque beyond the drive's."""
    test = fit.predictions["test"].errors()
    worse = [f"{joint} (R2 {r2:.2g})" for joint, r2 in zip(fit.joints, test["r2"]) if r2 < 0.0]
    if worse:
        yield f"implausible: the model is worse than none on the test logs of {', '.join(worse)}; {_ASK}"
    robot, heavy = fit.model.robot, []
    for b, body in enumerate(robot.bodies):
        mass, stated = float(fit.pi[b, 0]), float(robot.prior[b, 0])
        if body.kind == "link" and not 1.0 / _MASS <= mass / stated <= _MASS:
            heavy.append(f"{body.name} {mass:.3g} kg ({stated:.3g} kg)")
    if heavy:
        yield (
            f"implausible masses, the URDF's in brackets: {', '.join(heavy)}; a motor's inertia that the URDF lacks goes into them "
            "(effect armature), or the logs do not tell them (raise prior.weight), or units are wrong (`sysid check`)"
        )
    for j, joint in enumerate(fit.joints):
        allowed = robot.source.joints[joint].effort
        torque = np.abs(fit.predictions["train"].measured[:, j])
        if np.sum(torque > _EFFORT * allowed) >= _FEWEST:
            yield f"implausible: the torque of {joint} reaches {torque.max():.4g}, the URDF allows its drive {allowed:.4g}; {_ASK}"
