"""Which test logs have what training logs say that only some of these have: a load may be in any log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import blocks
from . import rows as row
from .candidates import Candidate, made
from .estimate import Fit
from .for_a_while import stretches, told
from .inertia.consistency import is_consistent
from .inertia.pseudo import from_central
from .motion import Motion

_PARTS, _CLEAR = 12, 2.0  # stretches of a log's rows, by which a fall is held against its standard error


def with_tests(choice, fit: Fit, test: Motion):
    """A choice of which what is in some training logs alone is also in the test logs that have it, as the training logs' own values for
    it say.

    A log has it or has not; no other number of it is looked for there.

    Args:
        choice: a head and members, refitted on the training logs. test: the test logs under a low-pass.
    """
    every = {id(member): _with_tests(member, fit, test) for member, _ in choice.members}
    members = tuple((every[id(member)], p) for member, p in choice.members)
    return replace(choice, head=every.get(id(choice.head), choice.head), members=members)


def _with_tests(member, fit: Fit, test: Motion):
    options = dict(member.candidate.options)
    for name, find in (("logs", _carriers), ("stretches", _stretches)):
        if name in options and (more := find(member.candidate, member.view, fit, test)):
            grown = _in(member.candidate, {name: [*options[name], *more]}, fit)
            return replace(member, group=replace(member.group, candidate=grown))
    return member


def _carriers(candidate: Candidate, view, fit: Fit, test: Motion) -> list[str]:
    """The test logs whose error falls where an effect is in them, of the size that a view of the training logs gives it."""
    trained = {piece.source for piece in view.motion.pieces}
    names = [name for name in dict.fromkeys(piece.source for piece in test.pieces) if name not in trained]
    if not names:
        return []
    found, left, torque = _weighed(_in(candidate, {"logs": names}, fit), view, fit, test)
    gain = np.sum(left**2 - (left - torque) ** 2, axis=1)
    source = np.array([piece.source for piece in test.pieces])[found.piece]
    return [name for name in names if _falls(gain[source == name])]


def _stretches(candidate: Candidate, view, fit: Fit, test: Motion) -> list[str]:
    """The stretches of the test logs that have a load that parts of training logs have."""
    names = dict.fromkeys(piece.source for piece in test.pieces)
    found, left, torque = _weighed(_in(candidate, {"logs": list(names)}, fit), view, fit, test)
    gain, there = np.sum(left**2 - (left - torque) ** 2, axis=1), stretches(found.t, blocks.by_block(found.log), left, torque)
    # of each log on its own: by stretches that were chosen for it the error falls somewhat in any case
    own = [rows for rows in blocks.by_block(found.log) if _falls(gain[rows][there[rows]])]
    kept = np.zeros_like(there)
    for rows in own:
        kept[rows] = there[rows]
    return told(found, kept, test.pieces)


def _falls(gain: np.ndarray) -> bool:
    """Whether what rows (n,) take falls together by more than twice its standard error over stretches of them."""
    parts = [part.sum() for part in np.array_split(gain, min(_PARTS, max(len(gain), 1)))]
    return bool(np.sum(parts) > _CLEAR * blocks.standard_error(np.array(parts)) and np.sum(parts) > 0.0)


def _weighed(candidate: Candidate, view, fit: Fit, test: Motion) -> tuple:
    """The rows of test logs, what is left of them (n, dof) without a candidate, and its torque (n, dof) at the size that a view of the
    training logs gives it; each joint by its error in the fit."""
    found, model = row.measured(test, 1), view.model
    error = np.array(list(fit.rms("train").values()))
    weight = np.where(error > 0.0, 1.0 / np.maximum(error, 1e-300), 0.0)
    # with the bodies that stand beside it: those of a model without it have a part of it already
    without = row.predicted(model, test, view.x, 1)
    return found, (found.tau - without) * found.use * weight, _torque(candidate, view, test, found, without) * weight


def _torque(candidate: Candidate, view, test: Motion, found, without: np.ndarray) -> np.ndarray:
    """The torque (n, dof) of a candidate in test logs, at the size that a view of the training logs gives it: of one that is no
    column, what it changes of what is predicted `without` it."""
    model, effect = view.model, candidate.effect
    if candidate.nonlinear:
        terms = tuple((effect, js) if (one.name, js) == (effect.name, (candidate.joint,)) else (one, js) for one, js in model.terms)
        return (row.predicted(replace(model, terms=terms), test, view.x, 1) - without) * found.use
    first = 10 * model.bodies
    own = [first + k for k, c in enumerate(model.coefficients) if (c.effect, c.joint) == candidate.key]
    size = view.x[own] if not model.coefficients[own[0] - first].of_body else _possible(view.x[own])
    columns = row.signature(model, test, row.seen(model, test), effect, candidate.joint, {}, 1, found.use)
    out = np.zeros_like(without)
    out.T[candidate.touches(model.robot.dof)] = columns @ size
    return out


def _possible(pi: np.ndarray) -> np.ndarray:
    """A load (10,) as its mass and where that is say it, where its moments of inertia are those of no body: in a view coefficients
    have no bounds, and slow arms hardly tell moments."""
    return pi if pi[0] <= 0.0 or is_consistent(pi) else from_central(pi[0], pi[1:4] / pi[0], np.zeros((3, 3)))


def _in(candidate: Candidate, where: dict, fit: Fit) -> Candidate:
    """A candidate in other logs, or stretches of them."""
    anywhere = {"logs": None, "stretches": None}
    options = {name: value for name, value in candidate.options if name not in anywhere}
    effect = candidate.effect.given(**{k: v for k, v in anywhere.items() if hasattr(candidate.effect, k)})
    return made(effect, candidate.joint, options | where, fit.model.robot)
