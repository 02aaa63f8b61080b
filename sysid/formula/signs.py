"""Which values inside a formula need both signs: those whose turning changes the columns by more
than a factor."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from .search_range import Range

_POINTS, _WITH = 6, 5  # places at which a sign is turned; other values turned with it, at most


def one_sided(found: dict[str, Range], columns: Callable[[dict], np.ndarray]) -> dict[str, Range]:
    """Ranges by name without the negative half of values that lose nothing by it.

    Args:
        columns: called with values by name, gives the formula's columns (k, n), not finite where
            it cannot.
    """
    rng = np.random.default_rng(0)
    points = [{n: float(rng.choice(r.tried)) for n, r in found.items()} for _ in range(_POINTS)]
    out = dict(found)
    mirrored = lambda name: out[name].low == -out[name].high  # noqa: E731
    for name in found:
        if not mirrored(name) or out[name].spacing == "even":
            continue
        others = [n for n in found if n != name and mirrored(n)][:_WITH]
        sets = [(name, *more) for k in range(len(others) + 1) for more in combinations(others, k)]
        if any(all(_alike(columns, at, turned) for at in points) for turned in sets):
            out[name] = out[name].positive()
    return out


def _alike(columns, at: dict, turned) -> bool:
    """Whether turning the signs of some values leaves the columns what they were, but for a factor
    each."""
    with np.errstate(all="ignore"):
        one, other = columns(at), columns({**at, **{name: -at[name] for name in turned}})
    finite = np.isfinite(one).all(), np.isfinite(other).all()
    if not all(finite):
        return not any(finite)
    size = lambda x: np.max(np.abs(x), axis=-1, keepdims=True)  # noqa: E731
    a, b = (x / np.where(size(x) > 0, size(x), 1.0) for x in (one, other))
    norms = np.sqrt(np.sum(a**2, -1) * np.sum(b**2, -1))
    return bool(np.all(np.abs(np.sum(a * b, axis=-1)) >= (1.0 - 1e-9) * norms))
