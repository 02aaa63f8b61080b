"""The noise floor of a joint's torque, or the reason why a log does not determine it.

Where the motion repeats itself, the scatter between repeats is the noise. Elsewhere, what plain
functions of the motion explain is first taken off the residual, then what no noise does, and the
spectrum of the rest is weighed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from . import outliers, repeats
from .hum import hum
from .noise_floor import UNSURE, NoiseFloor
from .of_angles import OfAngles
from .rates import by_rate, of_each
from .rest import Shared, rest_of, shared_by
from .spectrum import spectrum_of, weighed
from .stretches import FEWEST_SAMPLES, bridged, whole
from .uneven import with_uneven


@dataclass(frozen=True)
class Estimate:
    """The floor as far as it can be estimated, however unsure: RMS, standard error [N m or N], how
    it was found, and what makes it unsure. least, own: RMS of what is noise in any case, and of the
    residual itself, which is the most it can be."""

    rms: float
    std: float
    method: str
    detail: str
    doubt: str
    own: float
    least: float = 0.0


def floor(
    residual: Sequence[np.ndarray], measured: Sequence[np.ndarray], q: Sequence[np.ndarray],
    step: Sequence[float], joint: int, *, use: Sequence[np.ndarray] | None = None,
    angles: OfAngles | None = None,
) -> NoiseFloor:  # fmt: skip
    """The noise floor of one joint's torque as logged; never above the residual's own RMS.

    One entry per contiguous stretch of samples. Noise slower than 0.3 Hz counts as drift, not as
    noise.

    Args:
        residual: (n, dof) measured minus predicted torque [N m or N], not filtered; the model may
            be wrong.
        measured: (n, dof) torque as logged [N m or N].
        q: (n, dof) smoothed positions [rad or m].
        step: [s].
        joint: which column.
        use: (n,) or (n, dof) bool, rows that count; what stands in others is not looked at. None:
            all.
        angles: what the noise of the angles, drawn again, adds. None: nothing.
    """
    return judged(estimate(residual, measured, q, step, joint, use=use, angles=angles))


def floors(
    residual: Sequence[np.ndarray], measured: Sequence[np.ndarray], q: Sequence[np.ndarray],
    step: Sequence[float], *, use: Sequence[np.ndarray] | None = None,
    angles: OfAngles | None = None,
) -> tuple[NoiseFloor, ...]:  # fmt: skip
    """The noise floors of all joints' torques: what `floor` says of each, at less cost."""
    memory: dict[bytes, Shared] = {}
    joints = range(residual[0].shape[1] if len(residual) else 0)
    given = {"use": use, "memory": memory, "angles": angles}
    return tuple(judged(estimate(residual, measured, q, step, j, **given)) for j in joints)


def judged(found: Estimate) -> NoiseFloor:
    """A floor where the estimate is sure enough to judge an error by, else None and the reason."""
    low, high = max(found.rms - 2.0 * found.std, 0.0), min(found.rms + 2.0 * found.std, found.own)
    if found.method == "none":
        return NoiseFloor(None, None, "none", found.doubt, None, found.own)
    if found.std > UNSURE * found.rms:
        why = f"not determined: {found.doubt} ({found.detail})"
        return NoiseFloor(None, None, "none", why, min(low, found.least), found.own, found.rms)
    return NoiseFloor(found.rms, found.std, found.method, found.detail, low, high)


def estimate(
    residual, measured, q, step, joint: int, *, use=None, memory=None, angles=None
) -> Estimate:
    """The floor of one joint and how sure it is. See `floor`."""
    lengths = [len(r) for r in residual]
    use = [np.ones(n, dtype=bool) for n in lengths] if use is None else _of_joint(use, joint)
    memory = {} if memory is None else memory
    given = (residual, measured, q, step), joint, use, memory, angles
    if len(rates := by_rate(step)) > 1:
        return of_each(rates, estimate, *given, "each sampling rate by itself")
    columns, logged = (_of_joint(x, joint) for x in (residual, measured))
    inside = np.concatenate([c[u] for c, u in zip(columns, use)]) if lengths else np.zeros(0)
    size = max((float(np.abs(m[u]).max(initial=0.0)) for m, u in zip(logged, use)), default=0.0)
    own = math.sqrt(float(np.mean(inside**2))) if len(inside) else 0.0
    if not len(inside):
        return Estimate(own, own, "none", "", "no sample counts", own)
    if own <= 1e-12 * size:
        return _certain(own, "the model leaves nothing of the torque", own)
    shared = shared_by(q, step, use, memory, angles)
    runs, bandwidth = shared.runs, shared.bandwidth
    if not runs:
        why = f"{len(inside)} samples, no {FEWEST_SAMPLES} of them together, are too few"
        return Estimate(own, own, "none", "", why, own)
    raw, torque = ([run.of(x[run.stretch]) for run in runs] for x in (columns, logged))
    if bandwidth == 0.0:
        mean = float(np.mean(np.concatenate([v[run.counts] for v, run in zip(raw, runs)])))
        counts, steps = zip(*((run.counts, run.step) for run in runs))
        kept, rest = outliers.without([v - mean for v in raw], counts, steps, 0.0)
        found = repeats.block_rms(np.concatenate([v[k] for v, k in zip(rest, kept)]) ** 2)
        words = "nothing moves: all but the residual's mean"
        return _bounded(*found, "spectral", words, "the log is too short", own)
    drawn = None
    if angles is not None:
        columns = [again[:, :, joint] for again in angles.torque]
        drawn = [np.stack([run.of(once) for once in columns[run.stretch]]) for run in runs]
        drawn = drawn if any(v.any() for v in drawn) else None
    rest, kept, number, removed = rest_of(shared, raw, torque, joint, drawn)
    if math.sqrt(max(np.mean(v**2) for v in rest)) <= 1e-12 * max(size, own):
        return _certain(0.0, "the residual is a constant, or a function of the motion", own)
    if any(period is not None for period in shared.periods):
        logged, *left = (whole(runs, v, lengths) for v in (torque, rest, raw))
        made = repeats.mean_square(drawn, kept)
        found = repeats.scatter(left, logged, whole(runs, kept, lengths), shared.periods, made)
        if found is not None:
            k = next(k for k, period in enumerate(shared.periods) if period is not None)
            count = int(lengths[k] / shared.periods[k] + 0.01)
            words = f"period of {shared.periods[k] * step[k]:.3f} s found, {count} repeats"
            repeated = _bounded(*found, "repeats", words, "the repeats differ", own)
            again, once = shared.repeating
            if not once or repeated.std <= UNSURE * repeated.rms:
                return repeated
            # noise is not the same in all, as where it is louder in faster motion
            return of_each(
                [again, once],
                estimate,
                *given,
                "logs that repeat, and the others, each by themselves",
            )
    steps = [run.step for run in runs]
    spectrum = spectrum_of(rest, kept, steps)
    made = None
    if drawn is not None:
        each = [[bridged(v, k) for v, k in zip(once, kept)] for once in zip(*drawn)]
        made = np.mean([spectrum_of(once, kept, steps).density for once in each], axis=0)
    # what the functions took off was mostly in the band, noise as well as misfit
    freedom = 2.0 * bandwidth * sum(len(run.q) * run.step for run in runs)
    spectrum.density[spectrum.centre < bandwidth] /= 1.0 - min(0.5, number / max(freedom, 1.0))
    found = weighed(spectrum, bandwidth, min(steps), removed, made)
    if drawn is not None:
        counts = [run.counts for run in runs]
        times = min(1.0, outliers.of_drawn(rest, kept, drawn, steps, bandwidth))
        found = with_uneven(found, drawn, counts, times, float(made @ spectrum.width))
    words = f"residual above {bandwidth:.2g} Hz, {found.colour}{hum(rest, steps)}"
    return _bounded(found.rms, found.std, "spectral", words, found.doubt, own, found.least)


def _bounded(
    rms: float, std: float, method: str, detail: str, doubt: str, own: float, least: float = 0.0
) -> Estimate:
    """An estimate held below the residual's own RMS; by how much it had to be is an error of it."""
    if rms > own:
        rms, std = own, math.hypot(std, rms - own)
    return Estimate(rms, std, method, detail, doubt, own, min(least, own))


def _certain(rms: float, detail: str, own: float) -> Estimate:
    return Estimate(rms, 0.0, "spectral", detail, "", own)


def _of_joint(values, joint: int) -> list[np.ndarray]:
    """A joint's column (n,) of each stretch; what has no columns is the same for all joints."""
    return [x[:, joint] if x.ndim == 2 else x for x in map(np.asarray, values)]
