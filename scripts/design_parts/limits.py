"""Limits: every design looked at again at a kilohertz, by code that shares none with the design."""

from __future__ import annotations

import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.interpolate import BPoly
from scipy.spatial import ConvexHull

from scripts.design_parts import capsules
from scripts.design_parts.robots import experiment_with, unlogged_experiment
from sysid import robot as robots
from sysid.design.limits import LimitsSpec

ROBOTS = ("planar", "leg", "ur5", "panda", "ur10e")
_EVERY = 7  # instants of a kilohertz between two looks at distances; a design looks at every tenth
_PAIR = ("stribeck", "presliding", "delay", "torque_bias", "quadratic_drag", "elasticity")
_LOGGED = 3  # of so many designs one rests on a log


def case(seed: int, number: int, robots=ROBOTS) -> dict:
    """Robot, seed, duration and limits of a design."""
    rng = np.random.default_rng([seed, number])
    return {
        "robot": robots[number % len(robots)], "seed": int(rng.integers(2**31)),
        "duration": float(rng.choice([5.0, 8.0, 12.0])), "margin": float(rng.choice([0.02, 0.05, 0.1])),
        "clearance": float(rng.choice([0.01, 0.03])),
        "logged": number // len(robots) % _LOGGED == _LOGGED - 1,
    }  # fmt: skip


def trial(case: dict) -> dict:
    """The largest share of each limit that a design uses (1: at the margin's edge), and the least
    distance [m] over the clearance."""
    from sysid import design

    spec = LimitsSpec(margin=case["margin"], clearance=case["clearance"])
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as place:
        warnings.simplefilter("ignore")
        if case["logged"] and case["robot"] != "ur10e":
            experiment = experiment_with(case["robot"], Path(place), case["seed"])
        else:
            experiment = unlogged_experiment(case["robot"], Path(place))
        begun = time.process_time()
        found = design(
            experiment, duration=case["duration"], limits_spec=spec, seed=case["seed"] % 1000,
            separate=_suspects(experiment, case), processes=1,
        )  # fmt: skip
        told = {**case, "maneuvers": [own.kind for own in found.family.maneuvers], "cpu": time.process_time() - begun}
        return told | checked(experiment, found, case)


def _suspects(experiment, case: dict) -> list[tuple[str, str]]:
    """Two effects on a joint, in half of all designs."""
    rng = np.random.default_rng(case["seed"])
    if rng.random() < 0.5:
        return []
    joint = str(rng.choice(robots.load(experiment.robot, experiment.folder).joints))
    return [(str(e), joint) for e in rng.choice(_PAIR, 2, replace=False)]


def checked(experiment, found, case: dict) -> dict:
    """From the coefficients in design.json's own words: position, velocity, torque by Pinocchio with
    friction by hand, distance by hulls made here or by rods in closed form."""
    machine = robots.load(experiment.robot, experiment.folder)
    family = found.family
    t = np.arange(0.0, family.duration + 5e-4, 1e-3)
    q, qd, qdd = along(found, t)
    kept = 1.0 - case["margin"]
    own, shares = [machine.source.joints[j] for j in machine.joints], {}
    low, high = np.array([j.limits for j in own]).T
    finite = np.isfinite(low) & np.isfinite(high)
    middle, half = 0.5 * (low + high)[finite], 0.5 * kept * (high - low)[finite]
    shares["position"] = float(np.max(np.abs(q[:, finite] - middle) / half, initial=0.0))
    top = np.array([j.velocity if j.velocity > 0.0 else np.inf for j in own])
    shares["velocity"] = float((np.abs(qd) / (kept * top)).max())
    shares["rest"] = float(max(np.abs(qd[[0, -1]]).max(), np.abs(qdd[[0, -1]]).max()))
    shares["torque"] = _torque(experiment, machine, found, q, qd, qdd, kept)
    told = {"shares": shares, "distance": None, "least": None}
    shapes, base, clearance = _shapes(machine), found_pose(experiment, machine), case["clearance"]
    if shapes is None:
        least = capsules.least(machine, q[::_EVERY], base, clearance)
    else:
        least = _least(machine, *shapes, q[::_EVERY], base, clearance)
    if np.isfinite(least):  # two links have none that are no neighbours
        told |= {"least": least, "distance": least - clearance}
    return told


def along(found, t):
    """q, qd, qdd (n, dof) of a design at times t (n,) [s], without the design's own code."""
    return _played(found, t) if found.family.maneuvers else summed(found, t)


def summed(found, t):
    """q, qd, qdd (n, dof) at times t (n,) [s] of the harmonics, by hand."""
    w = 2.0 * np.pi * found.family.rounds / found.family.duration
    w = w * np.arange(1, found.family.harmonics + 1)
    c, a, b = np.split(found.coefficients, [1, 1 + found.family.harmonics], axis=1)
    angle = w * t[:, None]
    q = c.T + np.sin(angle) @ a.T + np.cos(angle) @ b.T
    qd = np.cos(angle) @ (w * a).T - np.sin(angle) @ (w * b).T
    return q, qd, -np.sin(angle) @ (w**2 * a).T - np.cos(angle) @ (w**2 * b).T


def _played(found, t):
    """The same of a motion with maneuvers, by polynomials of the fifth degree between the samples of
    what will be played."""
    rows = np.stack([found.q, found.qd, found.qdd], axis=1)
    own = BPoly.from_derivatives(found.t, rows)
    return own(t), own.derivative()(t), own.derivative(2)(t)


def found_pose(experiment, machine) -> np.ndarray:
    """The pose that motions are about, pairs too close in which are not looked at."""
    from sysid.design.basis import basis

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what they say the design has said
        return basis(experiment, [], lambda stage, share: None).pose


def _torque(experiment, machine, found, q, qd, qdd, kept) -> float:
    from sysid import pipeline

    most = np.array([j.effort if j.effort > 0.0 else np.inf for j in _stated(machine)])
    if (experiment.folder / "train.csv").exists():
        fit = pipeline.fit(experiment)
        pi, values = fit.pi, dict(zip([c.name for c in fit.model.coefficients], fit.coefficients))
    else:
        pi, values = machine.prior, {}
    model = machine.with_inertias(pi)
    data, G = model.createData(), machine.transmission
    full = [x @ G.T for x in (q, qd, qdd)]
    torque = np.array([pin.rnea(model, data, *row) for row in zip(*full)]) @ G
    of = lambda effect, name: np.array(  # noqa: E731
        [values.get(f"{effect}.{j}.{name}", 0.0) for j in machine.joints]
    )
    torque += qd * of("viscous", "Fv") + np.sign(qd) * of("coulomb", "Fc")
    torque += qdd * of("armature", "Ia")
    return float((np.abs(torque) / (kept * most)).max())


def _stated(machine):
    return [machine.source.joints[j] for j in machine.joints]


def _shapes(machine):
    """The whole URDF's model and collision shapes, each mesh as the points of its hull; None where it
    has no meshes."""
    from sysid.urdf_files import example_root, package_folders

    folders = [
        str(p) for p in (*package_folders(), example_root().parents[1], *machine.path.parents)
    ]
    try:
        model = pin.buildModelFromUrdf(str(machine.path))
        shapes = pin.buildGeomFromUrdf(
            model, str(machine.path), pin.GeometryType.COLLISION, package_dirs=folders
        )
    except (ValueError, RuntimeError):
        return None
    if not shapes.ngeoms or model.nq != model.nv:
        return None
    for shape in shapes.geometryObjects:
        if hasattr(shape.geometry, "vertices"):
            points = np.array(shape.geometry.vertices())
            shape.geometry = _convex(points[ConvexHull(points).vertices])
    return model, shapes


def _convex(points):
    import coal

    own = coal.StdVec_Vec3s()
    for point in points:
        own.append(point)
    return coal.ConvexBase.convexHull(own, True, "Qt")


def _least(machine, model, shapes, q, base, clearance: float) -> float:
    """The least distance of any pair of shapes on links that are no neighbours and move against each
    other, but for those that are closer than the clearance in the base pose."""
    moving = [model.getJointId(j) for j in machine.joints]
    place = [model.joints[k].idx_q for k in moving]
    whole = pin.neutral(model)
    for name, angle in machine.locked.items():
        whole[model.joints[model.getJointId(name)].idx_q] = angle

    def carrier(joint: int) -> int:
        while joint and joint not in moving:
            joint = model.parents[joint]
        return joint

    objects = shapes.geometryObjects
    for a in range(len(objects)):
        for b in range(a):
            i, j = carrier(objects[a].parentJoint), carrier(objects[b].parentJoint)
            if (
                i == j
                or (i and carrier(model.parents[i]) == j)
                or (j and carrier(model.parents[j]) == i)
            ):
                continue
            shapes.addCollisionPair(pin.CollisionPair(b, a))
    data, found = model.createData(), shapes.createData()

    def distances(pose) -> np.ndarray:
        whole[place] = pose
        pin.computeDistances(model, data, shapes, found, whole)
        return np.array([r.min_distance for r in found.distanceResults])

    looked = distances(base) > clearance
    return float(min(distances(pose)[looked].min(initial=np.inf) for pose in q))


def table(results: list[dict]) -> list[str]:
    """The worst share of each limit, and how many designs pass any."""
    out = [f"{len(results)} designs"]
    beyond = 0
    for robot in dict.fromkeys(r["robot"] for r in results):
        own = [r for r in results if r["robot"] == robot]
        worst = {k: max(r["shares"][k] for r in own) for k in own[0]["shares"]}
        near = min((r["distance"] for r in own if r["distance"] is not None), default=None)
        said = ", ".join(f"{k} {v:.6f}" for k, v in worst.items())
        said += "" if near is None else f", distance over the clearance {1000 * near:.3f} mm"
        out.append(f"  {robot:7s} {len(own)}: {said}")
    for r in results:
        over = any(r["shares"][k] > 1.0 + 1e-6 for k in ("position", "velocity", "torque"))
        beyond += over or (r["distance"] is not None and r["distance"] < -1e-5)
    out.append(f"  beyond any limit: {beyond}")
    return out
