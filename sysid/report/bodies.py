"""The bodies in space: each as the ellipsoid that its parameters make it, on the robot."""

from __future__ import annotations

import numpy as np

from ..estimate import Fit
from . import ellipsoids, solids
from .section import Section
from .words import number


def bodies(fit: Fit) -> Section:
    """The bodies as ellipsoids on the robot, at the middle of its motion."""
    robot = fit.model.robot
    states = fit.predictions["train"].states
    q = np.zeros((1, robot.dof)) if states is None or not len(states.q) else states.q
    middle = (q.min(0) + q.max(0)) / 2
    placed = solids.frames(robot, middle)
    now, before = solids.solids(robot, fit.pi, placed), solids.solids(robot, fit.prior, placed)
    found, rows = [], []
    for b, (body, one, other) in enumerate(zip(robot.bodies, now, before)):
        mass, prior = number(float(fit.pi[b, 0])), number(float(fit.prior[b, 0]))
        found.append({
            "name": body.name,
            "kind": body.kind,
            "words": f"mass {mass} kg",
            "identified": one,
            "prior": other,
        })  # fmt: skip
        centre = _triple(one.centre) if one else "–"
        semi = _axes(one) if one else "not physically possible"
        rows.append(
            [body.name, body.kind, mass, prior, centre, semi, _axes(other) if other else "–"]
        )
    chart = ellipsoids.bodies("solids", found, solids.skeleton(robot, placed))
    angles = [
        f"{joint} {number(value, 3)} {'m' if slides else 'rad'}"
        for joint, value, slides in zip(fit.joints, middle, robot.prismatic)
    ]
    values = {"angles": angles, "rows": rows, "chart": chart}
    return Section("Bodies", "bodies", values, [chart])


def _triple(values) -> str:
    return ", ".join(number(v, 3) for v in values)


def _axes(solid: solids.Solid) -> str:
    """Semi-axes, the longest first."""
    return _triple(sorted(solid.axes)[::-1])
