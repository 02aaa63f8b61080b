"""Which values inside a formula need both signs: those whose turning changes the columns by more than a factor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np


def one_sided(found: dict, columns: Callable[[dict], np.ndarray]) -> dict:
    """Ranges by name without the negative half of values that lose nothing by it.

    Args:
        columns: called with values by name, gives the formula's columns (k, n), not finite where it cannot.
    """
    both = [name for name, r in found.items() if r.low == -r.high and r.spacing != "even"]
    turned = [name for name, r in found.items() if r.low == -r.high]
    rng = np.random.default_rng(0)
    points = [{name: float(rng.choice(r.tried)) for name, r in found.items()} for _ in range(6)]
    out = dict(found)
    for name in both:
        others = [n for n in turned if n != name and out[n].low == -out[n].high][:5]
        patterns = [
            (name, *extra)
            for count in range(len(others) + 1)
            for extra in combinations(others, count)
        ]
        if any(all(_alike(columns, at, pattern) for at in points) for pattern in patterns):
            own = tuple(at for at in out[name].tried if at > 0)
            out[name] = replace(out[name], low=min(own), tried=own)
    return out


def _alike(columns, at: dict, pattern) -> bool:
    """Whether turning the signs of some values leaves the columns what they were, but for a factor each."""
    with np.errstate(all="ignore"):
        one, other = columns(at), columns({**at, **{name: -at[name] for name in pattern}})
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        return bool((np.isfinite(one) == np.isfinite(other)).all() and not np.isfinite(one).all())
    size = lambda x: np.max(np.abs(x), axis=-1, keepdims=True)  # noqa: E731
    a, b = (x / np.where(size(x) > 0, size(x), 1.0) for x in (one, other))
    cross = np.abs(np.sum(a * b, axis=-1))
    return bool(np.all(cross >= (1.0 - 1e-9) * np.sqrt(np.sum(a**2, -1) * np.sum(b**2, -1))))
