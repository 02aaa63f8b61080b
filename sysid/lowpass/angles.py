"""White noise on angles: its size, and a log with more of it."""

from __future__ import annotations

import numpy as np

_WINDOW = 0.1  # s


def noise_of(q, smooth, taken: float, step: float) -> np.ndarray:
    """RMS (dof,) of white noise on angles q (n, dof): the lesser of what a low-pass took off and of
    what third differences show, as either may hold motion too; each in the middle of all windows of
    time, as about a reversal there is more."""
    taken_off, differences_ = (_by_window(v, step) for v in ((q - smooth) / taken, _third(q)))
    return np.minimum(np.median(taken_off, axis=0), np.median(differences_, axis=0))


def _third(q) -> np.ndarray:
    """Third differences of angles q (n, dof), as large as white noise on them."""
    return np.diff(q, 3, axis=0) / np.sqrt(20.0)  # 1 + 9 + 9 + 1


def _by_window(values, step: float) -> np.ndarray:
    """RMS (windows, dof) of values (n, dof) in windows of time."""
    parts = np.array_split(values, max(1, len(values) // max(8, round(_WINDOW / step))))
    return np.sqrt([np.mean(own**2, axis=0) for own in parts])


def rougher(segment, noise, rng: np.random.Generator) -> np.ndarray:
    """The angles (n, dof) of a segment with noise drawn once more, of RMS `noise` (dof,) in the
    middle of the log and elsewhere as much more or less as third differences say: stamps that
    jitter make it grow with the speed."""
    from scipy.ndimage import median_filter

    q = segment.q
    local = median_filter(_by_window(_third(q), segment.step), size=(5, 1), mode="nearest")
    middle = np.median(local, axis=0)
    at = np.linspace(0, len(q) - 1, len(local) + 1)
    at = 0.5 * (at[1:] + at[:-1])
    profile = np.stack(
        [
            np.interp(np.arange(len(q)), at, one)
            for one in (local / np.where(middle > 0, middle, 1.0)).T
        ],
        axis=1,
    )
    return q + noise * profile * rng.normal(size=q.shape)
