"""The noise floor of a joint's torque, or the reason why a log does not determine it.

Where the motion repeats itself, the scatter between repeats is the noise. Elsewhere, what plain functions of the motion
explain is first taken off the residual, then what no noise does, and the spectrum of the rest is weighed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from . import outliers, repeats
from .motion_functions import Functions, Kinematics, kinematics
from .spectrum import spectrum_of, weighed
from .stretches import Run, bandwidth_of, bridged, runs_of

#: standard error over RMS beyond which a floor is not given: two of them are the 25 % that one can judge an error by
UNSURE = 0.12


@dataclass(frozen=True)
class NoiseFloor:
    """RMS of a joint's torque noise [N m or N] and its standard error, None where the log does not determine them.

    method: "repeats", "spectral" or "none". detail: how it was found, or why not. low, high: at least and at most [N m or
    N], None where nothing is known.
    """

    rms: float | None
    std: float | None
    method: str
    detail: str
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Estimate:
    """The floor as far as it can be estimated, however unsure: RMS, standard error [N m or N], how it was found, and what makes
    it unsure. least, own: RMS of what is noise in any case, and of the residual itself, which is the most it can be."""

    rms: float
    std: float
    method: str
    detail: str
    doubt: str
    own: float
    least: float = 0.0


@dataclass(frozen=True)
class _Shared:
    """What joints have in common whose rows that count are the same."""

    runs: list[Run]
    motion: Kinematics | None
    bandwidth: float
    periods: list[float | None]


def floor(
    residual: Sequence[np.ndarray], measured: Sequence[np.ndarray], q: Sequence[np.ndarray],
    step: Sequence[float], joint: int, *, use: Sequence[np.ndarray] | None = None,
) -> NoiseFloor:  # fmt: skip
    """The noise floor of one joint's torque as logged; never above the residual's own RMS.

    One entry per contiguous stretch of samples. Noise slower than 0.3 Hz counts as drift, not as noise.

    Args:
        residual: (n, dof) measured minus predicted torque [N m or N], not filtered; the model may be wrong.
        measured: (n, dof) torque as logged [N m or N].
        q: (n, dof) smoothed positions [rad or m].
        step: [s].
        joint: which column.
        use: (n,) or (n, dof) bool, rows that count; what stands in others is not looked at. None: all.
    """
    return judged(estimate(residual, measured, q, step, joint, use=use))


def floors(
    residual: Sequence[np.ndarray], measured: Sequence[np.ndarray], q: Sequence[np.ndarray],
    step: Sequence[float], *, use: Sequence[np.ndarray] | None = None,
) -> tuple[NoiseFloor, ...]:  # fmt: skip
    """The noise floors of all joints' torques; what `floor` says of each, at less cost. See there."""
    memory: dict[bytes, _Shared] = {}
    joints = range(residual[0].shape[1] if len(residual) else 0)
    found = (estimate(residual, measured, q, step, j, use=use, memory=memory) for j in joints)
    return tuple(judged(one) for one in found)


def judged(found: Estimate) -> NoiseFloor:
    """A floor where the estimate is sure enough to judge an error by, else None and the reason."""
    low, high = max(found.rms - 2.0 * found.std, 0.0), min(found.rms + 2.0 * found.std, found.own)
    if found.method == "none":
        return NoiseFloor(None, None, "none", found.doubt, None, found.own)
    if found.std > UNSURE * found.rms:
        why = f"not determined: {found.doubt} ({found.detail})"
        return NoiseFloor(None, None, "none", why, min(low, found.least), found.own)
    return NoiseFloor(found.rms, found.std, found.method, found.detail, low, high)


def estimate(residual, measured, q, step, joint: int, *, use=None, memory=None) -> Estimate:
    """The floor of one joint and how sure it is. See `floor`."""
    use = _columns(residual, joint, use)
    columns = [np.asarray(r, dtype=float)[:, joint] for r in residual]
    logged = [np.asarray(m, dtype=float)[:, joint] for m in measured]
    every = [u if u is not None else slice(None) for u in use] if use else [slice(None)] * len(columns)
    inside = np.concatenate([c[u] for c, u in zip(columns, every)]) if columns else np.zeros(0)
    size = max((float(np.abs(m[u]).max(initial=0.0)) for m, u in zip(logged, every)), default=0.0)
    own = math.sqrt(float(np.mean(inside**2))) if len(inside) else 0.0
    nothing = lambda why: Estimate(own, own, "none", "", why, own)  # noqa: E731
    if not len(inside):
        return nothing("no sample counts")
    if own <= 1e-12 * size:
        return Estimate(own, 0.0, "spectral", "the model leaves nothing of the torque", "", own)
    shared = _shared(q, step, use, {} if memory is None else memory)
    runs = shared.runs
    if not runs:
        return nothing(f"{len(inside)} samples, in pieces too short to tell noise from misfit, are too few")
    kept = [run.counts for run in runs]
    raw, torque = ([run.of(x[run.stretch]) for run in runs] for x in (columns, logged))
    if shared.bandwidth == 0.0:
        mean = np.mean(np.concatenate([v[k] for v, k in zip(raw, kept)]))
        kept, rest = outliers.without([v - mean for v in raw], kept, [r.step for r in runs], 0.0)
        rms, std = repeats.block_rms(np.concatenate([v[k] for v, k in zip(rest, kept)]) ** 2)
        return Estimate(rms, std, "spectral", "nothing moves: all but the residual's mean", "too short a log", own)
    asked = Functions(runs, shared.motion, [m - r for m, r in zip(torque, raw)], joint, shared.bandwidth)
    steps = [run.step for run in runs]
    rest, _, _ = asked.removed_from(raw, kept)
    kept = outliers.away_from_reversals(runs, shared.motion.v, rest, kept)
    rest = [bridged(v, k) for v, k in zip(rest, kept)]
    kept, _ = outliers.without(rest, kept, steps, shared.bandwidth)
    # once more, without what no noise does
    rest, number, removed = asked.removed_from(raw, kept)
    rest = [bridged(v, k) for v, k in zip(rest, kept)]
    if math.sqrt(max(np.mean(v**2) for v in rest)) <= 1e-12 * max(size, own):
        return Estimate(0.0, 0.0, "spectral", "the residual is a constant, or a function of the motion", "", own)
    if (found := repeats.scatter((rest, raw, torque), kept, shared.periods)) is not None:
        run, period = next((r, p) for r, p in zip(runs, shared.periods) if p is not None)
        words = f"period of {period * run.step:.3f} s found, {int(len(run.q) / period + 0.01)} repeats"
        return _bounded(*found, "repeats", words, "the repeats differ", own)
    spectrum = spectrum_of(rest, kept, steps)
    # what the functions took off was mostly in the band, noise as well as misfit
    freedom = 2.0 * shared.bandwidth * sum(len(run.q) * run.step for run in runs)
    spectrum.density[spectrum.centre < shared.bandwidth] /= 1.0 - min(0.5, number / max(freedom, 1.0))
    found = weighed(spectrum, shared.bandwidth, min(steps), removed)
    words = f"residual above {shared.bandwidth:.2g} Hz, {found.colour}"
    return _bounded(found.rms, found.std, "spectral", words, found.doubt, own, found.least)


def _bounded(rms: float, std: float, method: str, detail: str, doubt: str, own: float, least: float = 0.0) -> Estimate:
    """An estimate held below the residual's own RMS; by how much it had to be is an error of it."""
    if rms > own:
        rms, std = own, math.hypot(std, rms - own)
    return Estimate(rms, std, method, detail, doubt, own, min(least, own))


def _columns(residual, joint: int, use) -> list[np.ndarray] | None:
    if use is None:
        return None
    columns = [np.asarray(u, dtype=bool) for u in use]
    return [u[:, joint] if u.ndim == 2 else u for u in columns]


def _shared(q, step, use, memory: dict) -> _Shared:
    key = b"" if use is None else b"".join(np.packbits(u).tobytes() for u in use)
    if key not in memory:
        runs = runs_of(q, step, use)
        motion = kinematics(runs) if runs else None
        periods = [repeats.period_of(run) for run in runs]
        memory[key] = _Shared(runs, motion, bandwidth_of(runs) if runs else 0.0, periods)
    return memory[key]

