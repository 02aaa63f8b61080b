"""Bursts of a residual: stretches of tens of milliseconds in which it is out of the ordinary.

A knock that nobody felt in the log's own signals stands in what a model leaves of them: the arm
was accelerated by what no torque sensor saw.
"""

import numpy as np

from ..outliers import BURST, CHANCE, bursts, surprise

_FEWEST = 40  # windows that have a usual
# Mean squares of a Gaussian over a window: z75 - z50 of one independent value, the widest there is,
# over the median, and how much flatter its tail is from there on than from z50 to z75.
WHITE, TAIL = 0.19, 0.6


def calm(values: list[np.ndarray], kept: list[np.ndarray], steps: list[float], usual=None):
    """Which rows (n,) of each run are kept where none of a burst is.

    The mean square over windows of 0.05 s against that of all windows; about a burst, windows on
    half the evidence belong to it.

    Args:
        usual: (n,) size of the noise of each run, where it is known to differ from row to row.
    """
    places, squares = [], []
    for k, (v, counts, step) in enumerate(zip(values, kept, steps)):
        length = max(3, round(BURST / step))
        first = np.arange(0, max(len(v) - length + 1, 0), max(1, length // 2))
        own = np.where(counts, v if usual is None else v / usual[k], 0.0)
        total = np.concatenate([[0.0], np.cumsum(own**2)])
        number = np.concatenate([[0], np.cumsum(counts)])
        rows = number[first + length] - number[first]
        good = 2 * rows >= length
        square = (total[first + length] - total[first])[good] / rows[good]
        places += [(k, a, a + length) for a in first[good].tolist()]
        squares.append(square)
    squares = np.concatenate(squares) if squares else np.zeros(0)
    middle = float(np.median(squares)) if len(squares) else 0.0
    if len(squares) < _FEWEST or middle <= 0.0:
        return kept
    s, level = surprise(squares / middle, WHITE, tail=TAIL), np.log(len(squares) / CHANCE)
    out = [k.copy() for k in kept]
    for a, b in bursts(s, level):
        for k, first, last in places[a : b + 1]:
            out[k][first:last] = False
    return [a if a.sum() > 2 else b for a, b in zip(out, kept)]
