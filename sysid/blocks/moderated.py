"""How sure a sum is whose own blocks are too few to tell: by what noise that is always the same
foresees for it, as far as that has been right elsewhere in the log.

Many sums are asked of one log. Blocks tell the squared deviation v of each, with d degrees of
freedom; noise of one spectrum foresees f. Their ratios scatter like F with d and d0 degrees of
freedom about a scale: their middle tells the scale, how many stand between its quartiles d0, and

    (d0 f + d v) / (d0 + d)      with d0 + d degrees of freedom

is the deviation. Where noise is louder here than there the ratios scatter wide, d0 is small, and
blocks speak for themselves.

Source: Smyth 2004 (moderated t), by quartiles: what is there stands in the tail.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_FEWEST = 10  # ratios whose quartiles tell anything
_SIZES = np.geomspace(0.05, 1e4, 100)  # of ratios
_LEAST, _MOST = 0.5, 100.0  # degrees of freedom: fewer count for nothing, more make no difference


@dataclass(frozen=True)
class Belief:
    """`scale` of what is foreseen, and its degrees of `freedom` d0: none, unless some are told."""

    scale: float = 1.0
    freedom: float = 0.0

    def moderated(self, seen, foreseen, own, drawn=None):
        """Squared deviations, and their degrees of freedom. What is foreseen counts less where
        blocks tell that the noise is louder than nearly any scatter of d0 would have it (Phipson et
        al. 2016).

        Args:
            seen, foreseen, own: as of `believed`. drawn: (..., sums) what draws see in place of
                `seen`.
        """
        drawn = seen if drawn is None else drawn
        if not self.freedom:
            return drawn, own
        foreseen = self.scale * np.asarray(foreseen)
        ratio = np.asarray(seen) / np.maximum(foreseen, 1e-300)
        more = self.freedom * np.minimum(1.0, 2.0 * _beyond(ratio, own, self.freedom))
        return (own * drawn + more * foreseen) / (own + more), own + more


def _beyond(ratio, own, freedom: float):
    """Probability of F ratios (..., sums) as great, with `own` (sums,) and `freedom` degrees of
    freedom; of many draws to a hundredth, by lines between the sizes of a table."""
    from scipy.special import fdtrc  # not scipy.stats, whose import takes longer than a fit

    if ratio.ndim < 2 or len(ratio) <= len(_SIZES):
        return fdtrc(own, freedom, ratio)
    known = fdtrc(own[:, None], freedom, _SIZES)
    return np.stack([np.interp(r, _SIZES, p) for r, p in zip(ratio.T, known)], axis=1)


UNTOLD = Belief()  # blocks alone count


def believed(seen, foreseen, own, most: float = _MOST) -> Belief:
    """Read off all sums of a log.

    Args:
        seen, foreseen: (sums,) squared deviations, as blocks tell them and as noise of one spectrum
            would have them. own: (sums,) degrees of freedom of the first. most: of d0, the blocks
            of the log, by which the spectrum is told.
    """
    from scipy.special import fdtri

    known = (np.asarray(seen) > 0) & (np.asarray(foreseen) > 0)
    if known.sum() < _FEWEST:
        return Belief()
    seen, foreseen, own = (np.asarray(a, dtype=float)[known] for a in (seen, foreseen, own))
    ratio = seen / foreseen
    own, which = np.unique(np.round(own), return_inverse=True)
    own = np.maximum(own, 1.0)
    for d0 in np.geomspace(_LEAST, most, 30):
        low, middle, high = (fdtri(own, d0, p)[which] for p in (0.25, 0.5, 0.75))
        scale = float(np.median(ratio / middle))
        # the more d0, the narrower F, and the fewer ratios stand between its quartiles
        if np.mean((ratio > scale * low) & (ratio < scale * high)) < 0.5:
            break
    return Belief(scale, float(d0))
