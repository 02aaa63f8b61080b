"""Says when torque leaves what a held model foresaw, and what changed.

Every change that could be has columns: Coulomb and viscous friction and a bias of each joint, a
body on the last link. Whitened, residual = columns theta + white noise, so that over a window of
ticks

    S = b' V^-1 b / f,      b = sum columns' residual,
    V = sum columns' columns + H P H',      H = sum columns' A,

is a chi-square where nothing changed: A are the model's own columns, P the covariance that its
parameters have by logs known to be sound. f is what S was on these logs over its freedom, at
least 1: whatever the whitening leaves of the noise's memory, and what the model lacks, is in it.
As these logs are short, S is judged by F, with as many degrees of freedom as they hold windows. The
level is the rate of false alarms, shared among all changes, windows and ticks of an hour
(Bonferroni: windows overlap, so the true rate is lower).

Source: Willsky & Jones 1976 (generalized likelihood ratio); Basseville & Nikiforov 1993.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from .. import eigen
from .whitening import Whitening

WINDOWS = (1.0, 4.0)  # s
PER_TICK = 8  # averages
PER_JOINT = ("coulomb", "viscous", "torque_bias")
PAYLOAD = "payload"
_TOLD = 1e-10  # of the largest eigenvalue: below, no motion shows a direction


@dataclass(frozen=True)
class Ticks:
    """Sums over ticks: own b, g (ticks, dof, 3) of friction and bias, body b (ticks, 10) and g
    (ticks, 10, 10) of a body on the last link; own a (ticks, dof, 3, r), body a (ticks, 10, r) of
    their products with what the held model is unsure of. t: (ticks,) [s] their ends."""

    t: np.ndarray
    own_b: np.ndarray
    own_g: np.ndarray
    body_b: np.ndarray
    body_g: np.ndarray
    own_a: np.ndarray
    body_a: np.ndarray

    def __getitem__(self, rows) -> Ticks:
        return Ticks(*(values[rows] for values in vars(self).values()))

    def __add__(self, other: Ticks) -> Ticks:
        parts = zip(vars(self).values(), vars(other).values())
        return Ticks(*(np.concatenate(pair) for pair in parts))


@dataclass(frozen=True)
class Level:
    """What S is compared with. inflation, freedom: (windows, changes) f and F's second freedom."""

    inflation: np.ndarray
    freedom: np.ndarray
    p: float


def ticks_of(white: np.ndarray, t: np.ndarray, per_tick: int) -> Ticks:
    """Sums of innovations.

    Args:
        white: (dof, n, 14 + r): columns of friction and bias, of the body, the residual, what the
            held model is unsure of.
        t: (n / per_tick,) [s].
    """
    dof, n, size = white.shape
    parts = white.reshape(dof, n // per_tick, per_tick, size)
    own, left, model = parts[..., :3], parts[..., 13], parts[..., 14:]
    body_left = np.moveaxis(parts[..., 3:], 0, 1).reshape(n // per_tick, dof * per_tick, size - 3)
    body_rows = np.swapaxes(body_left[..., :10], 1, 2)
    return Ticks(
        t,
        np.einsum("jtni,jtn->tji", own, left),
        np.einsum("jtni,jtni->tji", own, own),
        (body_rows @ body_left[..., 10:11])[..., 0],
        body_rows @ body_left[..., :10],
        np.moveaxis(np.swapaxes(own, 2, 3) @ model, 0, 1),
        body_rows @ body_left[..., 11:],
    )


def windows_of(ticks: Ticks, length: int) -> Ticks:
    """Sums over the last `length` ticks at every tick that has so many behind it."""

    def summed(values):
        total = np.cumsum(np.concatenate([np.zeros((1, *values.shape[1:])), values]), axis=0)
        return total[length:] - total[:-length]

    sums = (summed(values) for name, values in vars(ticks).items() if name != "t")
    return Ticks(ticks.t[length - 1 :], *sums)


def worth(sums: Ticks) -> tuple[np.ndarray, np.ndarray]:
    """S / freedom (n, changes) of every change at every window, and the freedoms (changes,): each
    joint's Coulomb and viscous friction and bias, then the body."""
    n = len(sums.t)
    g = sums.own_g + (sums.own_a**2).sum(axis=-1)
    body_g = sums.body_g + sums.body_a @ np.swapaxes(sums.body_a, 1, 2)
    own = np.where(g > 0.0, sums.own_b**2 / np.where(g > 0.0, g, 1.0), 0.0).reshape(n, -1)
    size = np.sqrt(np.maximum(np.einsum("nii->ni", body_g), 1e-300))
    scaled = body_g / size[:, :, None] / size[:, None, :]
    values, vectors = eigen.symmetric(scaled)
    along = np.einsum("nki,nk->ni", vectors, sums.body_b / size)
    kept = values > 1e-9 * values[:, -1:]
    body = np.where(kept, along**2 / np.where(kept, values, 1.0), 0.0).sum(axis=1)
    freedom = np.append(np.ones(own.shape[1]), 10.0)
    return np.column_stack([own, body]) / freedom, freedom


def explained(ticks: Ticks) -> np.ndarray:
    """(changes,) what each explains of all ticks, less what so many free parameters explain by
    chance (Schwarz 1978)."""
    found, freedom = worth(windows_of(ticks, len(ticks.t)))
    return found[0] * freedom - freedom * np.log(1.0 + len(ticks.t) * PER_TICK)


def calibrated(ticks: Ticks, lengths, rate: float, tick: float) -> Level:
    """The level for a rate of false alarms, from the ticks of logs known to be sound.

    Args:
        lengths: of the windows [ticks]. rate: [1/h]. tick: [s].
    """
    inflation, freedom = [], []
    for length in lengths:
        if len(ticks.t) < 2 * length:
            break
        found, _ = worth(windows_of(ticks, length))
        inflation.append(np.maximum(found.mean(axis=0), 1.0))
        freedom.append(np.full(found.shape[1], len(ticks.t) / length))
    changes = ticks.own_b.shape[1] * 3 + 1
    asked = 3600.0 / tick * changes * max(len(inflation), 1)
    return Level(np.array(inflation), np.array(freedom), rate / asked)


def unsure(parts: list[np.ndarray]) -> np.ndarray:
    """(size, r): coordinates of the model's parameters in which these logs leave a variance of one.

    Args:
        parts: whitened columns (dof, n, size) of sound logs.
    """
    information = sum(np.einsum("jni,jnk->ik", own, own, optimize=True) for own in parts)
    size = np.sqrt(np.maximum(np.diagonal(information), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    values, vectors = eigen.symmetric(information / np.outer(size, size))
    kept = values > _TOLD * values[-1]
    return vectors[:, kept] / np.sqrt(values[kept]) / size[:, None]


def names(joints: tuple[str, ...]) -> list[tuple[str, str]]:
    """(effect, joint) of every change, in the order of `worth`."""
    return [(word, joint) for joint in joints for word in PER_JOINT] + [(PAYLOAD, "*")]


def p_values(sums: Ticks, level: Level, window: int) -> np.ndarray:
    """log p (n, changes) of every change at every window."""
    found, freedom = worth(sums)
    scaled = found / level.inflation[window]
    return stats.f.logsf(scaled, freedom, level.freedom[window])


__all__ = ["Level", "Ticks", "Whitening", "calibrated", "names", "p_values", "ticks_of", "worth"]
