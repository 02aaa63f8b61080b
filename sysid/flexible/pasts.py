"""Functions of what the motion was: what a law may remember of it.

dragged     a place that lags behind a signal by a width and is dragged along beyond it (the play of
            Prandtl and Ishlinskii, of whose sums hystereses are made)
fading      a signal as it was a while ago, by first-order lags
swinging    what hangs on a joint by a spring and is pushed by its acceleration, at one frequency
turned      how long ago the speed last changed its sign, and how far the joint went since
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .functions import by_piece, remembered

_WIDTHS = (0.05, 0.15, 0.4)  # of a signal's range
_SPANS = (0.1, 0.3, 1.0, 3.0)  # s
_SWINGS = (1.0, 2.0, 4.0, 8.0)  # Hz
_DAMPING = 0.15
_AGES = (0.05, 0.2, 0.8)  # s


def pasts(known: dict[str, np.ndarray], joint: str, piece, step: float) -> Iterator:
    """(variables in words, function (n,)) of the past of a joint's motion; each piece begins anew.

    Args:
        known, piece, step: as of `functions.groups`.
    """
    angle, speed, push, load = (known[f"{k}_{joint}"] for k in ("q", "qd", "qdd", "load"))
    for late in remembered([speed, np.sign(speed), np.abs(speed)], piece, step).T:
        yield _past(f"qd_{joint}"), late
    of = {f"q_{joint}": angle, f"load_{joint}": load}
    for name, values in of.items():
        widths = 0.5 * np.ptp(values) * np.array(_WIDTHS)
        for places in by_piece(piece, dragged, values, widths):
            yield _past(name), places
            yield _past(name), values - places
    sizes = ((f"load_{joint}", np.abs(load)), (f"qd_{joint}", np.abs(speed)))
    for name, values in (*of.items(), *sizes, (f"load_{joint}", load * speed)):
        for late in by_piece(piece, fading, values - values.mean(), step):
            yield _past(name), late
    for swing in by_piece(piece, swinging, push, step):
        yield _past(f"qdd_{joint}"), swing
    for own in by_piece(piece, turned, np.stack([angle, speed]), step):
        yield _past(f"qd_{joint}"), own


def _past(name: str) -> str:
    return f"{name} and its past"


def dragged(values: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """Places (widths, n) that stand still while a signal (n,) is within a width of them."""
    out = np.empty((len(widths), len(values)))
    place = np.full(len(widths), values[0])
    for k, value in enumerate(values.tolist()):
        place = np.minimum(np.maximum(place, value - widths), value + widths)
        out[:, k] = place
    return out


def fading(values: np.ndarray, step: float) -> np.ndarray:
    """A signal (n,) behind lags of several spans (spans, n), at rest before it began."""
    keep = np.exp(-step / np.array(_SPANS))
    return np.stack([_recursive([1.0 - a], [1.0, -a], values) for a in keep])


def swinging(push: np.ndarray, step: float) -> np.ndarray:
    """The accelerations (swings, n) of what a spring and a damper hold on a joint whose own (n,) is
    given."""
    out, twice = [], 2.0 / step
    for omega in 2.0 * np.pi * np.array(_SWINGS):
        if omega * step < 0.5 * np.pi:  # four samples a swing
            # (drag s + omega²) / (s² + drag s + omega²), s by Tustin's rule
            drag, square = 2.0 * _DAMPING * omega * twice, omega**2
            over = [drag + square, 2.0 * square, square - drag]
            under = [over[0] + twice**2, over[1] - 2.0 * twice**2, over[2] + twice**2]
            out.append(_recursive(over, under, push))
    return np.array(out).reshape(-1, len(push))


def _recursive(over, under, values: np.ndarray) -> np.ndarray:
    """A signal (n,) through the filter of two polynomials of the unit delay, from rest: the
    solution of a banded system (scipy.signal alone takes half a second to import)."""
    from scipy.linalg.lapack import dtbtrs

    if not len(values):
        return np.zeros(0)
    right = np.convolve(values, over)[: len(values)]
    band = np.repeat(np.array(under)[:, None], len(values), axis=1)
    return dtbtrs(band, right, uplo="L")[0]


def turned(motion: np.ndarray, step: float) -> np.ndarray:
    """Of an angle and its speed (2, n): how the time since the last reversal fades, and how far the
    joint went since; zero before the first one, as nobody knows when the last was."""
    angle, speed = motion
    number = np.arange(len(speed))
    turns = np.diff(np.sign(speed), prepend=np.sign(speed[0])) != 0
    last = np.maximum.accumulate(np.where(turns, number, -1))
    age = step * (number - last)
    out = np.stack([*(np.exp(-age / span) for span in _AGES), angle - angle[last]])
    return np.where(last < 0, 0.0, out)
