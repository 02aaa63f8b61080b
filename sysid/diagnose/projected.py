"""Candidates' columns, projected off the model: the groups that are asked."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from ..candidate_columns import columns_of, tried
from ..candidates import Candidate
from ..projection import NOISE, directions_of
from ..view import View, by_block, slow_part
from ..view.stationary import covariance
from .evidence import Group, known_together

_BATCH = 64  # sets of columns at once: of 3500 rows they stand in a processor's cache

Asked = tuple[Candidate, dict[str, float]]  # a candidate at shape values


def groups(view: View, candidates: Sequence[Candidate], among: Sequence[int] = ()) -> list[Group]:
    """The groups of candidates, one for each set of shape values tried; none of those that the
    model absorbs. among: joints that will be asked alike."""
    asked = [(candidate, at) for candidate in candidates for at in tried(view, candidate)]
    return groups_at(view, asked, among)


def groups_at(view: View, asked: Sequence[Asked], among: Sequence[int] = ()) -> list[Group]:
    """The groups of candidates at shape values; those on the same joints with as many columns are
    made together."""
    sources, alike, out = (view.rough_source, view.source), {}, []

    def together(key) -> list[Group]:
        names, *values = zip(*alike.pop(key))
        return made(view, sum(names, []), key[0], *map(np.concatenate, values[::-1]))

    for candidate, found in groupby(asked, key=lambda one: one[0]):
        every = list(found)
        for own in (every[some : some + _BATCH] for some in range(0, len(every), _BATCH)):
            # the rough one first: what it integrates step by step it does for both
            rough, plain = (columns_of(s, candidate, [at for _, at in own], among) for s in sources)
            key = tuple(candidate.touches(view.model.robot.dof)), plain.shape[3]
            alike.setdefault(key, []).append((own, rough, plain))
            if sum(len(part[0]) for part in alike[key]) >= _BATCH:
                out += together(key)
    return out + [group for key in list(alike) for group in together(key)]


def made(
    view: View, asked, joints: Sequence[int], plain: np.ndarray, rough, slow: bool = False
) -> list[Group]:
    """Groups of columns (asked, joints, n, k) on the motion, and on the rough one.

    Of what is read late and is mostly noise, what is as slow as the motion is asked: `slow`.
    """
    design, sums, spans = view.design, view.sums, by_block(view.blocks)
    count, _, n, k = plain.shape
    size, kk, parts = design.columns.shape[2], count * k, len(sums.scores)  # a prior has no columns
    cross, own = np.zeros((parts, kk, size + 1)), np.zeros((parts, count, k, k))
    score, rough_cross = np.zeros((parts, kk)), np.zeros((kk, size))
    rough_own = np.zeros((count, k, k))
    # what stands across columns (..., k, n) of the same set
    pair = lambda a, b: np.einsum("...kn,...ln->...kl", a, b)  # noqa: E731
    by_blocks = lambda a: np.add.reduceat(a, [s.start for s in spans], axis=1)  # noqa: E731
    split = lambda a: a.reshape(*a.shape[:-2], count, k, a.shape[-1])  # noqa: E731
    last = lambda a: np.swapaxes(a, 1, 2).reshape(kk, n)  # noqa: E731 - samples last, as in memory
    weighted = [view.weights[j] * last(plain[:, i]) for i, j in enumerate(joints)]
    for i, (j, values) in enumerate(zip(joints, weighted)):
        more = view.weights[j] * last(rough[:, i]) - values
        rough_cross += more @ design.rough_columns[j]
        rough_own += pair(split(more), split(more))
        score[:-1] -= by_blocks(more * design.rough_residual[:, j]).T
        if k == 1:
            own[:-1, :, 0, 0] += by_blocks(values**2).T
        columns = np.column_stack([design.columns[j], design.residual[:, j]])
        for b, rows in enumerate(spans):
            here = values[:, rows]
            cross[b] += here @ columns[rows]
            own[b] += pair(split(here), split(here)) if k > 1 else 0.0
    score, cross = score + cross[:, :, -1], cross[:, :, :-1]
    absorbed = cross.sum(0)  # in the design's directions, in which the system is one
    foreseen = np.zeros((count, k, k))
    for j, values in zip(joints, weighted):
        foreseen += covariance(split(values - absorbed @ design.columns[j].T), view.spectra[j])
    loss, scores = np.sum(design.residual[:, joints] ** 2), sums.scores - sums.rough_scores
    score = (score - scores @ absorbed.T).reshape(parts, count, k)
    # what stands across a candidate's columns and the model's, in each block and in the noise
    by, mixed = split(absorbed), cross - absorbed @ sums.squares
    squares = own - pair(split(cross), by) - pair(by, split(mixed))
    # the model's own columns took a part of the noise: as loud as before they did
    freed = split(mixed @ sums.freed)
    more = pair(split(mixed), freed)
    loud = score + np.einsum("bp,bskp->bsk", scores, freed)
    noise = rough_cross - absorbed @ sums.rough_squares
    rough_square = rough_own - pair(split(rough_cross), by) - pair(by, split(noise))
    whole, data = own.sum(0) - pair(by, by), squares[:-1].sum(0)
    out, told_by = [], directions_of(own.sum(0), whole, data, rough_square)
    for s, found in enumerate(told_by):
        if found is None:
            continue
        (candidate, shapes), (turn, sizes) = asked[s], found
        turned = turn.T @ squares[:, s] @ turn
        told = score[:, s] @ turn, turned, loud[:, s] @ turn, turned + turn.T @ more[:, s] @ turn
        rest = turn, sizes, turn.T @ foreseen[s] @ turn, float(loss)
        out.append(Group(candidate, dict(shapes), *told, *rest, slow=slow))
    known_together(out)
    none = (s for s, found in enumerate(told_by) if found is None and not slow)
    late = [s for s in none if asked[s][0].late is not None]
    late = [s for s in late if np.trace(rough_square[s]) > NOISE * np.trace(whole[s]) > 0.0]
    if not late:
        return out
    both = (slow_part(view, columns[late]) for columns in (plain, rough))
    return out + made(view, [asked[s] for s in late], joints, *both, slow=True)
