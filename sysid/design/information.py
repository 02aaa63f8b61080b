"""What a motion tells: the information of its rows, on top of what existing logs tell.

    M = M_0 + P + (samples / nodes) sum_t sum_j c_jt c_jt' / s_j^2

with c the columns of joint j's torque, s its noise, M_0 the information of the logs that exist, and
P the prior as wide as the bodies themselves: of a body nobody knows more than its size. Directions
that no motion can show hold P in all designs alike, so log det M counts the others: what the prior
leaves open.

A suspect a of coefficients s_a is told from its rival b by lambda_ab = min_x |c_a s_a - (c, c_b) x|^2,
over the noise: the Schur complement of M, without what the old logs tell. The new log must say it by
itself: what is told apart by one log's bodies in another log's few slow rows is not confirmed by blocks
of time held apart, nor is a robot the same on another day.

Source: Fedorov 1972 (D-optimality); Atkinson & Fedorov 1975 (lambda); Rucker & Wensing 2022 for the
metric of P.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..inertia import DIVERGENCES
from ..model import Model
from ..model_parameters import ROBOT
from ..objective import STIFF, add_blocks
from .columns import columns
from .suspects import Suspect, along


@dataclass(frozen=True)
class Known:
    """What is known before a design.

    model: of the instant, at its shape values; x (size,): parameters; noise (dof,): standard
    deviation of a row's torque [N m], infinite where no row counts; suspects: what it may lack,
    whose coefficients stand after its parameters; before (all, all): information of the logs that
    exist and the prior, alone (all, all): of the prior. reach [s], slowest (dof,) [rad/s or m/s]: a joint's rows within so much of a
    reversal, or as slow, do not count, as a fit leaves them out.
    """

    model: Model
    x: np.ndarray
    noise: np.ndarray
    before: np.ndarray
    suspects: tuple[Suspect, ...] = ()
    alone: np.ndarray | None = None
    reach: float = 0.0
    slowest: np.ndarray | None = None

    @property
    def dof(self) -> int:
        """Joints."""
        return self.model.robot.dof

    @property
    def maneuvers(self) -> tuple[str, ...]:
        """Kinds of maneuvers that the suspects ask for, each once."""
        kinds = (kind for one in self.suspects for kind in one.candidate.effect.maneuvers)
        return tuple(dict.fromkeys(kinds))

    @property
    def joints(self) -> tuple[int, ...]:
        """The suspects' joints; none where one is of the whole robot."""
        found = sorted({one.candidate.joint for one in self.suspects})
        return () if ROBOT in found else tuple(found)

    @cached_property
    def places(self) -> list[np.ndarray]:
        """Where each suspect's coefficients stand among all."""
        ends = np.cumsum([self.model.size, *(len(one.size) for one in self.suspects)])
        return [np.arange(a, b) for a, b in zip(ends[:-1], ends[1:])]

    def all_columns(self, q, qd, qdd, own=None) -> np.ndarray:
        """(dof, all, n) of samples (n, dof), each over its joint's noise, as far as it counts. Zero of
        suspects that look back in time.

        Args:
            own: (dof, size, n) the model's columns, where they are at hand.
        """
        out = np.zeros((self.dof, len(self.before), len(q)))
        out[:, : self.model.size] = columns(self.model, q, qd, qdd) if own is None else own
        place, found = self.of_suspects(q, qd, qdd)
        out[:, place] = found
        return out * self.counted(qd, qdd)[:, None]

    def of_suspects(self, q, qd, qdd) -> tuple[np.ndarray, np.ndarray]:
        """Where the coefficients of suspects of the instant stand among all (k,), and their columns (dof, k,
        n); all at once, as the load that they look at is the same."""
        own = [(place, one) for place, one in zip(self.places, self.suspects) if not one.looks_back]
        if not own:
            return np.zeros(0, dtype=int), np.zeros((self.dof, 0, len(q)))
        place, suspects = zip(*own)
        return np.concatenate(place), along(suspects, self.model, self.x, q, qd, qdd)

    def counted(self, qd, qdd) -> np.ndarray:
        """(dof, n) what a row of each joint is multiplied by: one over its noise, less where it moves
        hardly faster than what does not count, nothing where it is slower. Smooth, so that slopes
        know of it."""
        over = np.repeat(1.0 / self.noise[:, None], len(qd), axis=1)
        if self.slowest is None:
            return over
        u = np.clip(np.abs(qd) / (self.slowest + self.reach * np.abs(qdd)) - 0.5, 0.0, 1.0).T
        return over * u**2 * (3.0 - 2.0 * u)


_ENOUGH = 100.0  # of lambda: ten standard deviations


def own_size(model: Model, prior, x, torque, known: Sequence[int] = ()) -> np.ndarray:
    """(size, size) information that bodies are about as the prior, and coefficients about as large
    as would make the joint's torque: nobody expects more.

    Args:
        prior: (bodies, 10). torque: (dof,) size of each joint's torque [N m]. known: bodies that are
            their prior.
    """
    metric = np.array(DIVERGENCES["log-det"](prior).hessian(prior))
    metric[list(known)] *= STIFF
    out = add_blocks(np.zeros((model.size, model.size)), metric)
    count = 10 * model.bodies
    for k, c in enumerate(model.coefficients):
        typical = abs(x[count + k]) or (torque.max() if c.joint < 0 else torque[c.joint])
        out[count + k, count + k] = typical**-2.0
    return out


def information(known: Known, columns, weights) -> np.ndarray:
    """M (all, all) of columns (dof, all, n) over their noise, each sample of which stands for so many
    (n,)."""
    flat = np.moveaxis(columns * np.sqrt(weights), 1, 2).reshape(-1, columns.shape[1])
    return known.before + flat.T @ flat


def log_det(information: np.ndarray) -> float:
    """log det of a positive definite matrix, scaled to a unit diagonal first."""
    scale = np.sqrt(np.diagonal(information))
    sign, value = np.linalg.slogdet(information / np.outer(scale, scale))
    return float(value + 2.0 * np.log(scale).sum()) if sign > 0 else -np.inf


def worth(known: Known, information: np.ndarray) -> tuple[float, np.ndarray]:
    """What a motion is worth, and the slope (all, all) of that in M: log det M, and

        p sum_ab log((lambda_ab + 1) / (lambda_ab + enough))

    over every suspect a and its rivals b, p the number of parameters: evidence that is not enough yet
    counts as much as all precision together, and none that is enough, nor where there is none to have.
    """
    scale = 1.0 / np.sqrt(np.diagonal(information))
    inverse = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
    total, slope, weight = log_det(information), inverse, float(known.model.size)
    fresh = information if known.alone is None else information - known.before + known.alone
    for told, way in evidence(known, fresh):
        total += weight * np.log((told + 1.0) / (told + _ENOUGH))
        share = weight * (1.0 / (told + 1.0) - 1.0 / (told + _ENOUGH))
        slope = slope + share * np.outer(way, way)
    return total, slope


def evidence(known: Known, information: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """lambda of each suspect against each rival (against nothing where there is one alone), and the
    way (all,) with lambda = way' M way: what is left of the suspect once the model's parameters and
    the rival have taken theirs."""
    out, base = [], np.arange(known.model.size)
    for i, (own, one) in enumerate(zip(known.places, known.suspects)):
        rivals = [other for j, other in enumerate(known.places) if j != i] or [own[:0]]
        for rival in rivals:
            rest = np.concatenate([base, rival])
            scale = 1.0 / np.sqrt(np.diagonal(information)[rest])
            inner = information[np.ix_(rest, rest)] * np.outer(scale, scale)
            pull = information[np.ix_(rest, own)] @ one.size
            way = np.zeros(len(information))
            way[own] = one.size
            way[rest] = -scale * np.linalg.solve(inner, scale * pull)
            out.append((max(float(way @ information @ way), 0.0), way))
    return out
