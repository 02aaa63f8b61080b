"""Many places at which to start the search for an effect's shape values, and the profile of the
objective over each.

All combinations of the values that are worth trying are tried, or, where these are too many, a
Sobol sequence over them and then all combinations of each two of them about the best. Those that
are better than all about them are followed downhill, the best first. The profile of one value is
the objective at values of it from one end of its range to the other with everything else solved
for, the other shape values included: what lies lower there than where the search ended is followed
downhill too.

Source: Marti, Lozano-Duran & Savage, Multi-start methods, Handbook of Heuristics 2018; Raue et al.
2009 (profiles).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from . import rows as row
from .effect import NotFinite, TorqueEffect
from .landscape import Landscape
from .model import Model
from .motion import Motion

_MOST = 8192  # sets that are tried
ROWS = 1500  # they are tried on
_FOLLOWED, _FOLLOWED_PAIR = 24, 6  # starts followed downhill, of all values and of each two
_FEW, _LONGER = 8, 6  # steps that each is followed, and how many are followed to their ends
_ROUNDS, _BETTER = 3, 1e-9  # of pairs, as long as so large a share of the objective is gained
_APART = 1.5  # steps between values tried, by which starts differ
_AROUND = 27  # sets tried about each, of which the best is a start
_PROFILED = 25  # values of a profile


@dataclass(frozen=True)
class Searched:
    """What was done about a shape value: how many sets of values it was started from, at how many
    its profile was asked for, and whether the profile led to a lower place than the starts."""

    name: str
    starts: int
    profile: int
    lower: bool

    def checked_again(self, other: Searched) -> Searched:
        """This, with another check of the profile after it."""
        return replace(self, profile=other.profile, lower=self.lower or other.lower)


@dataclass(frozen=True)
class Place:
    """Values (K,) of an effect's free shape values, and what the objective falls by there."""

    values: np.ndarray
    gain: float


def places(
    rough: Landscape, fine: Landscape, tried: list[np.ndarray], begin=()
) -> tuple[list[Place], int]:
    """The best places found from many starts, best first and apart from each other, and how many
    sets were tried.

    Args:
        rough: the landscape of fewer rows, on which all are tried. fine: that of all rows.
        tried: for each value those worth trying, ascending. begin: sets of values (K,) that a
            user, or the model, begins at.
    """
    where, sets = _sets(tried)
    starts = [np.clip(np.asarray(at, dtype=float), fine.low, fine.high) for at in begin]
    starts += [sets[k] for k in _best(where, rough.gains(sets), _FOLLOWED)]
    done = _followed(starts, fine, tried)
    count = len(sets) + len(begin)
    for _ in range(_ROUNDS if len(tried) > 2 and done else 0):
        before = done[0].gain
        for pair in combinations(range(len(tried)), 2):
            where, two = _sets([tried[k] for k in pair])
            sets = np.tile(done[0].values, (len(two), 1))
            sets[:, pair] = two
            count += len(sets)
            starts = [sets[k] for k in _best(where, rough.gains(sets), _FOLLOWED_PAIR)]
            done = _distinct(
                sorted([*done, *_followed(starts, fine, tried)], key=lambda p: -p.gain), fine
            )
        if not done[0].gain > before + _BETTER * fine.objective:
            break
    return done, count


def _followed(starts: list[np.ndarray], fine: Landscape, tried) -> list[Place]:
    """Where starts lead, best first: all a few steps, the best of these to their ends."""
    begun = sorted((Place(*fine.descended(at, steps=_FEW)) for at in starts), key=lambda p: -p.gain)
    done = [Place(*fine.descended(p.values)) for p in _distinct(begun, fine)[:_LONGER]]
    done = _distinct(sorted(done, key=lambda p: -p.gain), fine)
    return [_ended(done[0], fine, tried), *done[1:]] if done else done


def _ended(place: Place, fine: Landscape, tried: list[np.ndarray]) -> Place:
    at, gain = fine.descended(place.values)
    # steps along each value find what slopes cannot: a corner, a jump, the next hollow
    reach = np.array([_gap(own, x) for own, x in zip(tried, at)])
    further, more = fine.stepped(at, reach)
    return Place(*fine.descended(further)) if more > gain else Place(at, gain)


def _gap(own: np.ndarray, at: float) -> float:
    """The step between the values tried on either side of a value."""
    if len(own) < 2:
        return 0.0
    k = int(np.clip(np.searchsorted(own, at), 1, len(own) - 1))
    return float(own[k] - own[k - 1])


def _sets(tried: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Sets of values (B, K), with where (B, K) they stand in their lists, in steps from one to the
    next."""
    lists = list(tried)
    count = lambda: int(np.prod([len(own) for own in lists]))  # noqa: E731
    if _MOST < count() <= 2 * _MOST and len(lists) > 1:
        shortest = min(range(len(lists)), key=lambda k: len(lists[k]))
        lists[shortest] = lists[shortest][::2]
    if count() <= _MOST:
        rank = np.array(list(product(*(range(len(own)) for own in lists))))
        return rank, np.column_stack([own[rank[:, k]] for k, own in enumerate(lists)])
    from scipy.stats import qmc

    where = qmc.Sobol(len(tried), scramble=False).random(_MOST)
    place = [u * (len(own) - 1) for u, own in zip(where.T, tried)]
    sets = [np.interp(x, np.arange(len(own)), own) for x, own in zip(place, tried)]
    return where * _MOST ** (1.0 / len(tried)), np.column_stack(sets)


def _best(where: np.ndarray, gains: np.ndarray, most: int) -> list[int]:
    """Sets that gain more than all about them, best first; then others that stand apart."""
    from scipy.spatial import cKDTree

    gains = np.where(np.isfinite(gains), gains, -np.inf)
    count = min(_AROUND, 3 ** where.shape[1], len(where))
    _, about = cKDTree(where).query(where, k=count, p=np.inf)
    tops = gains >= gains[about.reshape(len(where), count)].max(1)
    order = np.argsort(-gains, kind="stable")
    chosen: list[int] = []
    for k in [*order[tops[order]], *order[: 40 * most]]:
        if len(chosen) == most:
            break
        apart = (np.abs(where[k] - where[j]).max() > _APART for j in chosen)
        if np.isfinite(gains[k]) and all(apart):
            chosen.append(int(k))
    return chosen


def _distinct(sorted_places: list[Place], fine: Landscape) -> list[Place]:
    """Without places that are one with a better one."""
    out: list[Place] = []
    for place in sorted_places:
        size = np.maximum(np.abs(place.values), fine.least)
        if np.isfinite(place.gain) and all(
            np.any(np.abs(place.values - other.values) > 1e-3 * size) for other in out
        ):
            out.append(place)
    return out


def lower_on_profile(
    fine: Landscape, tried: list[np.ndarray], tolerance: float
) -> tuple[Place | None, list[int]]:
    """The lowest place that the profiles lead to, where it is lower than where the model stands by
    a share `tolerance` of the objective, and at how many values each profile was asked for."""
    best, counts, here = None, [], float(fine.gains(fine.here[None])[0])
    for k, own in enumerate(tried):
        values = _spread(own, fine.here[k])
        counts.append(len(values))
        others = np.arange(len(fine.here)) != k
        for side in (values[values >= fine.here[k]], values[values < fine.here[k]][::-1]):
            last = fine.here
            for at in side:
                place = _along(fine, last, k, at, others)
                if not np.isfinite(place.gain):
                    continue
                last = place.values
                if place.gain > here + tolerance * fine.objective and (
                    best is None or place.gain > best.gain
                ):
                    best = place
    return (None if best is None else _ended(best, fine, tried)), counts


def _along(fine: Landscape, base: np.ndarray, k: int, at: float, others: np.ndarray) -> Place:
    """The best place with one value given, sought from a base."""
    start = np.array(base)
    start[k] = at
    if not others.any():
        return Place(start, float(fine.gains(start[None])[0]))
    return Place(*fine.descended(start, free=others, steps=_FEW))


def _spread(own: np.ndarray, here: float) -> np.ndarray:
    """Values of a profile, ascending: from those tried, with the ends, closer about where the model
    stands.
    """
    picked = (
        own[np.unique(np.linspace(0, len(own) - 1, _PROFILED).astype(int))]
        if len(own) > _PROFILED
        else own
    )
    gap = _gap(own, here)
    close = here + gap * np.array([-0.5, -0.25, 0.25, 0.5])
    return np.unique(np.concatenate([picked, close[(close > own[0]) & (close < own[-1])]]))


def finite(model: Model, motion: Motion) -> Model:
    """A model with the shape values of each torque effect where it is a finite number: as they are,
    or of those that are tried the ones nearest to the middle.

    Raises:
        NotFinite: there are none.
    """
    found = dict.fromkeys((v.term, v.joint) for v in model.shape_values if not v.held)
    blocks = [block for block in found if isinstance(model.terms[block[0]][0], TorqueEffect)]
    pieces = row.seen(model, motion) if blocks else []
    for block in blocks:
        model = _finite(model, pieces, *block)
    return model


def _finite(model: Model, pieces: list, term: int, joint: int) -> Model:
    effect, values = model.terms[term][0], model.shape_values
    own = [k for k, v in enumerate(values) if (v.term, v.joint) == (term, joint) and not v.held]
    where, sets = _sets([values[k].shape.values(values[k].low, values[k].high) for k in own])
    nearest = sets[np.argsort(np.abs(where - np.median(where, axis=0)).sum(1), kind="stable")]
    for at in [[model.shapes[k] for k in own], *nearest]:
        tried = model.with_some_shapes(dict(zip(own, at)))
        try:
            for piece in pieces:
                effect.columns(piece, joint, **tried.shapes_of(term, joint))
        except NotFinite as error:
            refused = error
        else:
            return tried
    raise refused
