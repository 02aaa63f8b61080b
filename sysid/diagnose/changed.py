"""A fitted model, held, and a new log: what is different? A payload, friction, a bias, a tilt of the base.

Nothing of the fitted model moves. Each change is fitted on one half of the new log and judged on the other, joins where it
takes a share worth having that stands out from block to block, and is looked at again with the others. What joined is at
last fitted on the whole log, a payload as a body that is physically possible; standard deviations are those of
leaving a block of time out (jackknife).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import datasets, pipeline, rows
from ..blocks import away, jackknife, summed
from ..config import Experiment, LogSpec
from ..effect import MotionEffect, find
from ..errors import ConfigError, LogError
from ..inertia import DIVERGENCES, PARAMETERIZATIONS, pseudo
from ..model import ROBOT, Model
from ..noise import floors
from ..objective import Objective
from ..results import number, read_fit
from ..shape import inverted
from ..solve import Coordinates, solve
from .lowpass import LEAST, lowpassed, stride_of

_BLOCKS, _MOST = 24, 12
_SUPPORT = 3.0  # standard errors
_WORTH = 0.1  # of the squared residual: below it, a held model's own errors on another motion look like changes
_PER_JOINT = ("coulomb", "viscous", "torque_bias")
_WEAK = 1e-2  # of the noise's square: the weight of the payload's prior, a ball of a kilogram


@dataclass(frozen=True)
class Change:
    """A change that the new log supports. columns (dof, n, k) on its rows; parameters {name: (value, std, unit)};
    removed: share of the squared residual of the held-out half that it removes, away: its standard errors from zero."""

    effect: str
    joint: str
    removed: float
    away: float
    parameters: dict[str, tuple[float, float, str]]


@dataclass(frozen=True)
class Changed:
    """What is different on a log: RMS [N m] per joint of the held model and with the changes, the noise floor, the changes,
    and what had no visible signature. notes: what to know of the numbers."""

    joints: tuple[str, ...]
    rms_held: np.ndarray
    rms_after: np.ndarray
    floors: tuple
    changes: tuple[Change, ...]
    notes: tuple[str, ...]


def read_run(run: Path, experiment: Experiment) -> tuple[Model, np.ndarray]:
    """The model and the parameters x (size,) of a run folder of `sysid fit`, on the experiment's robot.

    Raises:
        ConfigError: the folder holds no fit, or one of another robot.
    """
    values, _ = read_fit(run / "fit.json", "--model")
    _, structure, _ = pipeline.build(pipeline.load(run / "experiment.yaml"))
    missing = [name for name in (*structure.names, *(v.name for v in structure.shape_values)) if name not in values]
    if missing:
        raise ConfigError(f"the run has no value for {missing[0]}", where=str(run), do="fit it again")
    _, own, _ = pipeline.build(experiment)
    if own.robot.joints != structure.robot.joints:
        raise ConfigError(f"the run moved {', '.join(structure.robot.joints)}", where=str(run), allowed=", ".join(own.robot.joints), do="give the experiment that was fitted")
    x = np.array([values[name] for name in structure.names])
    structure = structure.with_shapes([values[v.name] for v in structure.shape_values])
    return structure.with_reference(x[: 10 * structure.bodies].reshape(-1, 10)), x


def changed(experiment: Experiment, run: Path, logs: list[str]) -> Changed:
    """What is different on logs, with a run's model held.

    Args:
        logs: file names relative to the working directory, or names of public logs.

    Raises:
        SysidError: no such run or log, or a log too short to be split in halves.
    """
    structure, x = read_run(run, experiment)
    robot = structure.robot
    specs = [LogSpec(file=_located(log)) for log in logs]
    with pipeline.noticed():
        motion = lowpassed(pipeline.read(experiment, robot, specs), robot.joints, LEAST)
    if motion is None or motion.duration < 4.0:
        raise LogError("the log is too short to say what changed", where=", ".join(logs), allowed="4 s or more of motion", do="give a longer log")
    structure = structure.scaled_by(motion)
    stride = stride_of(motion, LEAST)
    data = rows.stack(structure, motion, stride)
    residual = data.residual(x)
    counts = np.maximum(data.use.sum(0), 1)
    by_size = lambda left: 1.0 / np.maximum(np.sqrt((left**2).sum(0) / counts), 1e-12)  # noqa: E731
    weights = by_size(residual)
    blocks = np.minimum(np.arange(len(data.t)) * _BLOCKS // len(data.t), _BLOCKS - 1)
    tried = {key: columns for key, columns in _signatures(structure, x, motion, stride, data.use).items() if np.any(columns)}
    chosen = _chosen(tried, residual, weights, blocks)
    changes, after = _settled(structure, tried, chosen, residual, weights, blocks)
    if changes:  # a joint counts by what is left of it, not by what the changes made of it
        weights = by_size(after)
        changes, after = _settled(structure, tried, _chosen(tried, residual, weights, blocks) or chosen, residual, weights, blocks)
    floors = _floors(structure, x, motion)
    return Changed(
        robot.joints, np.sqrt((residual**2).sum(0) / counts), np.sqrt((after**2).sum(0) / counts), floors, changes, _notes(experiment, changes),
    )  # fmt: skip


def _located(log: str) -> str:
    return log if datasets.reference(log) is not None else str(Path(log).resolve())


def _signatures(structure: Model, x, motion, stride: int, use) -> dict[tuple[str, int], np.ndarray]:
    """Columns (dof, n, k) of every change, by (effect, joint)."""
    robot, pieces = structure.robot, rows.seen(structure, motion)
    out = {}
    for joint in range(robot.dof):
        for name in _PER_JOINT:
            columns = np.zeros((robot.dof, len(use), 1))
            columns[joint] = rows.signature(structure, motion, pieces, find(name), joint, {}, stride, use)
            out[name, joint] = columns
    for name in ("payload", "gravity_tilt"):
        effect = find(name).bound(robot, ROBOT)
        if isinstance(effect, MotionEffect):
            if any(term.name == name for term, _ in structure.terms):
                continue
            grown = structure.with_effect(effect, (ROBOT,))
            out[name, ROBOT] = rows.tangents(grown, motion, x, stride, use)[:, :, grown.last_shapes]
        else:
            out[name, ROBOT] = rows.signature(structure, motion, pieces, effect, ROBOT, {}, stride, use)
    return out


def _chosen(tried, residual, weights, blocks) -> list[tuple]:
    """The changes that the halves of the log support, each fitted on one and judged on the other."""
    halves = blocks < _BLOCKS // 2
    chosen: list[tuple] = []
    current = _halves(tried, chosen, residual, weights, halves)
    while len(chosen) < _MOST:
        best = None
        for key in tried:
            if key in chosen:
                continue
            after = _halves(tried, [*chosen, key], residual, weights, halves)
            own = slice(None) if key[1] == ROBOT else [key[1]]
            fall = summed(blocks, ((current**2 - after**2) * weights**2)[:, own]).sum(1)
            share, far = float(fall.sum() / max(np.sum((current * weights)[:, own] ** 2), 1e-300)), away(fall)
            if share >= _WORTH and far >= _SUPPORT and (best is None or share > best[0]):
                best = (share, key, after)
        if best is None:
            return chosen
        chosen, current = [*chosen, best[1]], best[2]
    return chosen


def _halves(tried, keys, residual, weights, halves) -> np.ndarray:
    """The residual of each half after what the other half says of the changes."""
    if not keys:
        return residual
    columns = np.concatenate([tried[key] for key in keys], axis=2)
    out = np.empty_like(residual)
    for half in (halves, ~halves):
        c = _least_squares(columns[:, ~half], residual[~half], weights)
        out[half] = residual[half] - np.einsum("jnk,k->nj", columns[:, half], c)
    return out


def _least_squares(columns, residual, weights) -> np.ndarray:
    system = sum(w**2 * a.T @ a for w, a in zip(weights, columns))
    return inverted(system) @ sum(w**2 * a.T @ r for w, a, r in zip(weights, columns, residual.T))


def _settled(structure: Model, tried, chosen, residual, weights, blocks) -> tuple[tuple[Change, ...], np.ndarray]:
    """The changes fitted together on the whole log, and what they leave (n, dof)."""
    if not chosen:
        return (), residual
    columns = np.concatenate([tried[key] for key in chosen], axis=2)
    body = next((k for k, key in enumerate(chosen) if key[0] == "payload"), None)
    ends = np.cumsum([tried[key].shape[2] for key in chosen])
    own = None if body is None else slice(int(ends[body]) - 10, int(ends[body]))
    fitted = lambda kept: _possible(columns[:, kept], residual[kept], weights, own)  # noqa: E731
    c = fitted(np.ones(len(residual), dtype=bool))
    without = np.array([fitted(blocks != b) for b in range(_BLOCKS)])
    std = jackknife(without)
    after = residual - np.einsum("jnk,k->nj", columns, c)
    halves, out = blocks < _BLOCKS // 2, []
    with_all = _halves(tried, chosen, residual, weights, halves)
    for k, (name, joint) in enumerate(chosen):
        rest = _halves(tried, [key for key in chosen if key != (name, joint)], residual, weights, halves)
        own = slice(None) if joint == ROBOT else [joint]
        fall = summed(blocks, ((rest**2 - with_all**2) * weights**2)[:, own]).sum(1)
        share = float(fall.sum() / max(np.sum((rest * weights)[:, own] ** 2), 1e-300))
        span = slice(int(ends[k]) - tried[name, joint].shape[2], int(ends[k]))
        out.append(Change(name, "*" if joint == ROBOT else structure.robot.joints[joint], share, away(fall), _parameters(structure, name, joint, c[span], std[span], without[:, span])))
    return tuple(sorted(out, key=lambda change: -change.removed)), after


def _possible(columns, residual, weights, own: slice | None) -> np.ndarray:
    """Least squares, with a body's ten columns kept physically possible."""
    if own is None:
        return _least_squares(columns, residual, weights)
    order = [*range(own.start, own.stop), *(k for k in range(columns.shape[2]) if not own.start <= k < own.stop)]
    stacked = np.concatenate([w * np.column_stack([a[:, order], r]) for w, a, r in zip(weights, columns, residual.T)])
    triangle = np.linalg.qr(stacked, mode="r")
    ball = pseudo.sphere(1.0, np.zeros(3), 0.05)
    objective = Objective(triangle, DIVERGENCES["log-det"](ball[None]), _WEAK)
    flat = np.zeros(len(order) - 10, dtype=bool)
    coordinates = Coordinates(PARAMETERIZATIONS["log-cholesky"](), 1, flat, flat)
    start = np.concatenate([ball, _least_squares(columns, residual, weights)[order[10:]]])
    found = solve(objective, coordinates, coordinates.theta(start), tolerance=1e-10, max_iterations=200, handover=0.5).x
    out = np.empty(len(order))
    out[order] = found
    return out


def _parameters(structure: Model, name: str, joint: int, c, std, without) -> dict[str, tuple[float, float, str]]:
    grown = structure.with_effect(find(name).bound(structure.robot, joint), (joint,))
    listed = [*grown.coefficients[len(structure.coefficients) :], *grown.shape_values[grown.last_shapes]]
    out = {p.name: (float(value), float(s), p.unit) for p, value, s in zip(listed, c, std)}
    if name == "payload":
        for axis, word in enumerate("xyz"):
            each = without[:, 1 + axis] / without[:, 0]
            out[f"payload.*.com_{word}"] = (float(c[1 + axis] / c[0]), float(jackknife(each)), "m")
    return out


def _floors(structure: Model, x, motion) -> tuple:
    count = 10 * structure.bodies
    residuals = [piece.measured[piece.core] - structure.torque(piece, x[:count].reshape(-1, 10), x[count:]) for piece in motion.pieces]
    measured, q = [p.measured[p.core] for p in motion.pieces], [p.q[p.core] for p in motion.pieces]
    use = [p.use[p.core] for p in motion.pieces]
    return floors(residuals, measured, q, [p.step for p in motion.pieces], use=use)


def _notes(experiment: Experiment, changes) -> tuple[str, ...]:
    out = []
    if any(change.effect == "payload" for change in changes):
        if experiment.data.units.torque == "A":
            out.append("the payload's mass is proportional to the torque constants: were all of them 10 % larger, it would be 10 % larger, and nothing in these logs can tell")
        else:
            out.append("the payload's mass is proportional to the torque sensors' gain")
    if any(change.effect == "torque_bias" for change in changes) and any(change.effect == "payload" for change in changes):
        out.append("a bias and a payload were told apart by the poses of this log alone; a pose held at rest would say more")
    return tuple(out)


def document(found: Changed, run="") -> dict:
    """The document of `sysid diagnose --model`, of the same form as without."""
    touched = lambda joint: [c for c in found.changes if c.joint in (joint, "*")]  # noqa: E731
    return {
        "joints": {
            joint: {
                "rms": {"held": float(found.rms_held[j]), "after": float(found.rms_after[j])}, "noise_floor": found.floors[j].rms,
                "noise_floor_se": None if found.floors[j].std is None else number(found.floors[j].std), "floor_method": found.floors[j].method, "status": "missing" if touched(joint) else "complete",
            }
            for j, joint in enumerate(found.joints)
        },
        "findings": [
            {
                "effect": c.effect, "joint": c.joint, "misfit_removed": c.removed, "misfit_removed_se": number(c.removed / c.away if c.away else float("nan")),
                "parameters": {name: {"value": v, "std": number(s), "unit": u} for name, (v, s, u) in c.parameters.items()}, "tied_with": [],
            }
            for c in found.changes
        ],
        "not_visible": [],
        "verdict": [
            {"joint": joint, "status": "missing", "effect": touched(joint)[0].effect, "tied_with": [], "also": [c.effect for c in touched(joint)[1:]]}
            if touched(joint) else {"joint": joint, "status": "complete"}
            for joint in found.joints
        ],
        "notices": list(found.notes), "run": str(run),
    }  # fmt: skip
