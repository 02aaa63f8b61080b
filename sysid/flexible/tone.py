"""A steady tone in a residual: one line of its spectrum that stands above all that is about it."""

from __future__ import annotations

import numpy as np

from ..running import running

TONE = 1e-4  # probability of a line that strong by chance
_PARTS, _MOST = 10, 0.5  # of the time; of a tone's square in one of these, of one that is steady


def steady(residual, noise, step: float) -> tuple[float, float, float]:
    """The share of a residual's square that its strongest line holds, the chance of such a line
    above the spectrum about it, were it noise of any smooth colour (Fisher 1929, against a local
    median), with lines that `noise` has as well: a coarse encoder at a steady speed; and its
    frequency [Hz]. What rings for a while, as after a blow, is no tone: its chance is one."""
    n = len(residual)
    power, lines = (np.abs(np.fft.rfft(r * np.hanning(n))) ** 2 for r in (residual, noise))
    width = max(9, int(2.0 * n * step) | 1)  # two hertz
    level = running(power, width, "median") / np.log(2.0)
    # in which phase its grain is met is chance, and moves a line by less than it is wide
    level += running(lines, 5, "max")
    ratio = np.where(
        np.arange(len(power)) > n * step, power / np.maximum(level, 1e-300), 0.0
    )  # slower than 1 Hz is drift
    at = int(np.argmax(ratio))
    near = slice(max(0, at - 2), at + 3)
    share = float(power[near].sum() / max(power.sum(), 1e-300))
    by_chance = min(1.0, len(power) * np.exp(-min(ratio[at], 700.0)))
    turned = residual * np.exp(-2j * np.pi * at / n * np.arange(n))
    loud = np.array([abs(part.sum()) ** 2 for part in np.array_split(turned, _PARTS)])
    by_chance = by_chance if loud.max() <= _MOST * loud.sum() else 1.0
    return share, float(by_chance), at / (n * step)
