"""A steady tone in a residual: one line of its spectrum that stands above all that is about it."""

from __future__ import annotations

import numpy as np

from ..running import running

TONE = 1e-4  # probability of a line that strong by chance


def steady(residual, noise, step: float) -> tuple[float, float, float]:
    """The share of a residual's square that its strongest line holds, the chance of such a line
    above the spectrum about it, were it noise of any smooth colour (Fisher 1929, against a local
    median), with lines that `noise` has as well: a coarse encoder at a steady speed; and its
    frequency [Hz]."""
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
    return share, float(by_chance), at / (n * step)
