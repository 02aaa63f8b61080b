"""Candidates' columns, projected off the model: the groups that are asked."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from ..candidates import Candidate, columns_of, tried
from ..projection import directions
from ..view import View, by_block
from ..view.stationary import covariance
from .evidence import Group

_BATCH = 256  # columns' sets that stand in memory at once

Asked = tuple[Candidate, dict[str, float]]  # a candidate at shape values


def groups(view: View, candidates: Sequence[Candidate]) -> list[Group]:
    """The groups of candidates, one for each set of shape values tried; none of those that the
    model absorbs."""
    asked = [(candidate, at) for candidate in candidates for at in tried(view, candidate)]
    return groups_at(view, asked)


def groups_at(view: View, asked: Sequence[Asked]) -> list[Group]:
    """The groups of candidates at shape values; those on the same joints with as many columns are
    made together."""
    dof, alike = view.model.robot.dof, {}
    for candidate, found in groupby(asked, key=lambda one: one[0]):
        own = [shapes for _, shapes in found]
        plain, rough = (columns_of(s, candidate, own) for s in (view.source, view.rough_source))
        key = (tuple(candidate.touches(dof)), plain.shape[3])
        alike.setdefault(key, []).append(([(candidate, shapes) for shapes in own], plain, rough))
    out = []
    for (joints, _), parts in alike.items():
        names = [one for part in parts for one in part[0]]
        out += made(view, names, joints, *(np.concatenate([p[i] for p in parts]) for i in (1, 2)))
    return out


def made(view: View, asked: Sequence, joints: Sequence[int], plain, rough) -> list[Group]:
    """Groups of columns (asked, joints, n, k) on the motion, and on the rough one."""
    parts = [slice(some, some + _BATCH) for some in range(0, len(asked), _BATCH)]
    return [g for p in parts for g in _made(view, asked[p], joints, plain[p], rough[p])]


def _made(view: View, asked, joints, plain: np.ndarray, rough: np.ndarray) -> list[Group]:
    design, sums, spans = view.design, view.sums, by_block(view.blocks)
    count, _, n, k = plain.shape
    size, kk, parts = design.columns.shape[2], count * k, len(sums.scores)  # a prior has no columns
    cross, own = np.zeros((parts, size, kk)), np.zeros((parts, count, k, k))
    score, rough_cross = np.zeros((parts, kk)), np.zeros((size, kk))
    rough_own = np.zeros((count, k, k))
    square = lambda a: np.einsum("nsk,nsl->skl", a, a)  # noqa: E731
    for i, j in enumerate(joints):
        values, noisy = (
            view.weights[j] * np.moveaxis(a[:, i], 1, 0).reshape(n, kk) for a in (plain, rough)
        )
        more = noisy - values
        noise = more * design.rough_residual[:, j, None]
        rough_cross += design.rough_columns[j].T @ more
        rough_own += square(more.reshape(n, count, k))
        for b, rows in enumerate(spans):
            cross[b] += design.columns[j][rows].T @ values[rows]
            score[b] += design.residual[rows, j] @ values[rows] - noise[rows].sum(0)
            own[b] += square(values[rows].reshape(-1, count, k))
    absorbed = cross.sum(0)  # in the design's directions, in which the system is one
    foreseen = np.zeros((count, k, k))
    for i, j in enumerate(joints):
        left = view.weights[j] * np.moveaxis(plain[:, i], 1, 0)
        left = left - (design.columns[j] @ absorbed).reshape(n, count, k)
        foreseen += covariance(left, view.spectra[j])
    loss = float(np.sum(design.residual[:, joints] ** 2))
    score = (score - (sums.scores - sums.rough_scores) @ absorbed).reshape(parts, count, k)
    # what stands across a candidate's columns and the model's, in each block and in the noise
    pair = lambda a, b: np.einsum("...psk,...psl->...skl", a, b, optimize=True)  # noqa: E731
    split = lambda a: a.reshape(*a.shape[:-1], count, k)  # noqa: E731
    by, mixed = split(absorbed), split(cross - sums.squares @ absorbed)
    squares = own - pair(split(cross), by) - pair(by, mixed)
    # the model's own columns took a part of the noise: as loud as before they did
    freed = split(sums.freed @ mixed.reshape(cross.shape))
    more, scores = pair(mixed, freed), sums.scores - sums.rough_scores
    loud = score + np.einsum("bp,bpsk->bsk", scores, freed, optimize=True)
    noise = split(rough_cross - sums.rough_squares @ absorbed)
    rough_square = rough_own - pair(split(rough_cross), by) - pair(by, noise)
    whole, data = own.sum(0) - pair(by, by), squares[:-1].sum(0)
    out = []
    for s in range(count):
        found = directions(own[:, s].sum(0), whole[s], data[s], rough_square[s])
        if found is None:
            continue
        (candidate, shapes), (turn, sizes) = asked[s], found
        turned = turn.T @ squares[:, s] @ turn
        told = score[:, s] @ turn, turned, loud[:, s] @ turn, turned + turn.T @ more[:, s] @ turn
        rest = turn, sizes, turn.T @ foreseen[s] @ turn, loss
        out.append(Group(candidate, dict(shapes), *told, *rest))
    return out
