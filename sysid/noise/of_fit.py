"""The noise floors of a fit's joints, as the fit sees their torque."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..errors import SysidError
from ..estimate import Fit
from ..filters import settled
from ..log import Log
from ..model import Model
from ..motion import Motion
from ..plausible import ROWS
from ..prediction import Prediction, predict
from ..preprocess import on_both_sides, prepare
from ..projection import NOISE
from ..specs import Experiment, PreprocessSpec
from .noise_floor import DOUBT, NoiseFloor
from .of_angles import of_angles
from .of_pieces import filtered, floors_of
from .repeats import MADE, block_rms

# a polynomial of order n over a window is -3 dB at n + 1 times this of one over it (Schafer 2011)
_AS_FAR = 1 / 3.2
_ALL = "what the noise of the angles, drawn again, makes: all that is left"
_KEPT = 0.5  # of a joint's rows: a window that takes more, about its reversals, is too wide


def floors_of_fit(
    experiment: Experiment, fit: Fit, model: Model, x, logs: Sequence[Sequence[Log]]
) -> tuple[list[NoiseFloor], dict[str, float]]:
    """Each joint's noise floor, and {joint: RMS of what the model leaves}, as the fit sees torque.

    A low-pass on both sides leaves nothing of the frequencies at which noise is told from motion:
    what it carries through is told of the torque as logged; beside angles that are smoothed as far,
    where their noise would hide that of the torque.

    Args:
        model, x (size,): whose residual is looked at; in its parameters loud joints should not
            drown quiet ones. logs: of each part.
    """
    spec = settled(experiment.preprocess, fit.filters)
    plain = spec.model_copy(update={"torque": "raw"})
    motions = [prepare(part, plain, fit.joints) for part in logs]

    def floors(
        model: Model, x, parts: slice = slice(None)
    ) -> tuple[list[NoiseFloor], list[Prediction], np.ndarray]:
        pieces = [piece for motion in motions[parts] for piece in motion.pieces]
        told = [predict(model, x, motion) for motion in motions[parts]]
        predicted = np.concatenate([one.predicted for one in told])
        angles = of_angles(logs[parts], motions[parts], told, plain, (model, x))
        return list(floors_of(pieces, predicted, angles=angles)), told, angles.squares()

    found, told, made = floors(model, x)
    sides = on_both_sides(spec, motions[0].pieces[0].step)
    if sides is not None:
        loud = [m > NOISE * (f.rms or f.about or 0.0) ** 2 for f, m in zip(found, made)]
        if any(loud) and (wide := _as_far(spec, logs, motions)):
            plain, motions = wide
            found, told, made = floors(model, x)
        seen = [prepare(part, spec, fit.joints) for part in logs]
        told = [predict(model, x, motion) for motion in seen]
        angles = of_angles(logs, seen, told, spec, (model, x))
    left = np.max([one.errors()["rms"] for one in told], axis=0)
    # noise is in what every model leaves: whichever leaves less of a joint tells it
    most = np.max([list(fit.rms(part).values()) for part in ("train", "test")], axis=0)
    if np.any(more := left > (1.0 + DOUBT) * most):
        other, _, its = floors(fit.model, fit.x)
        found = [b if worse else a for a, b, worse in zip(found, other, more)]
        made = np.where(more, its, made)
    if sides is not None:
        found = filtered(found, sides, made, now := angles.squares())
        found = [_alone(*own) for own in zip(found, np.sqrt(now).tolist(), most.tolist())]
    elif not all(one.reached(error) for one, error in zip(found, most)):
        found = _halved(found, spec, fit, logs)
    found = [_in_both(one, fit, j) for j, one in enumerate(found)]
    if sides is None and not all(one.reached(error) for one, error in zip(found, most)):
        parts = [slice(k, k + 1) for k in range(len(logs))]
        each = [floors(model, x, part)[0] for part in parts]
        if np.any(more):
            others = [floors(fit.model, fit.x, part)[0] for part in parts]
            each = [[b if w else a for a, b, w in zip(*own, more)] for own in zip(each, others)]
        found = [
            one if one.reached(e) else _of_each(one, *own)
            for one, e, *own in zip(found, most, *each)
        ]
    return found, dict(zip(fit.joints, left))


def _of_each(found: NoiseFloor, train: NoiseFloor, test: NoiseFloor) -> NoiseFloor:
    """The floor of the test logs with that of the training logs, where noise is clearly louder in
    the one part than in the other; else the one of both."""
    if not (train.rms and test.rms):  # not known, or nothing is noisy
        return found
    least, most = sorted((train.rms, test.rms))
    if most - least <= max(2.0 * math.hypot(train.std, test.std), DOUBT * least):
        return found
    detail = f"{test.detail}; {train.rms:.3g} on the training logs"
    halved = found.halved
    if halved is not None:
        window, before, after = halved
        halved = window, before * test.rms / train.rms, after
    return replace(test, train=train.rms, detail=detail, halved=halved)


def _alone(found: NoiseFloor, made: float, error: float) -> NoiseFloor:
    """A floor; where it is not known and all that is left is what the angles' noise makes, that."""
    std = 0.5 * MADE * made
    own = NoiseFloor(made, std, "spectral", _ALL, made - 2.0 * std, made + 2.0 * std)
    return own if found.rms is None and own.reached(error) else found


def _as_far(spec: PreprocessSpec, logs, motions) -> tuple[PreprocessSpec, list[Motion]] | None:
    """The preprocessing that leaves torque as logged and smooths angles as far as a low-pass on
    both sides smooths what they make, and logs prepared with it; None where that takes the rows
    that motions prepared otherwise have."""
    if spec.torque != "low-pass" or spec.filter != "savitzky-golay":
        return None
    window = max((spec.order + 1) * _AS_FAR / spec.cutoff, spec.window)
    wide = spec.model_copy(update={"torque": "raw", "window": window})
    try:
        others = [prepare(part, wide, motions[0].joints) for part in logs]
    except SysidError:  # logs shorter than that
        return None
    rows = lambda motion: motion.samples - motion.left_out  # noqa: E731 - of each joint
    few = [rows(other) < _KEPT * rows(motion) for other, motion in zip(others, motions)]
    return None if np.any(few) else (wide, others)


def _in_both(found: NoiseFloor, fit: Fit, joint: int) -> NoiseFloor:
    """A floor that neither the training logs nor the test logs deny: where they are left with
    clearly less than what all have as noise, that is louder elsewhere, or misfit stands in it."""
    if found.rms is None:
        return found
    for part, told in fit.predictions.items():
        left = told.thinned(ROWS).of_joint(joint)[2]
        squares = left[np.isfinite(left)] ** 2
        if not len(squares):
            continue
        error, doubt = block_rms(squares)
        if found.rms - (1.0 + DOUBT) * error > 2.0 * math.hypot(found.std, doubt):
            times = f"{found.rms / max(error, 1e-300):.2g} times the error on the {part} logs"
            why = "noise is louder in some logs than in others, or misfit stands in it"
            why = f"not determined: what nothing predicts is {times}: {why} ({found.detail})"
            return NoiseFloor(None, None, "none", why, None, found.high, error, found.halved)
    return found


def _halved(found: list[NoiseFloor], spec: PreprocessSpec, fit: Fit, logs) -> list[NoiseFloor]:
    """Floors with what the fit leaves where angles are smoothed over half of their window."""
    if spec.filter != "savitzky-golay" or spec.torque == "low-pass":
        return found
    half = spec.model_copy(update={"window": spec.window / 2})
    try:
        motions = [prepare(part, half, fit.joints) for part in logs]
    except SysidError:  # shorter than its polynomial
        return found
    errors = np.transpose([predict(fit.model, fit.x, one).errors()["rms"] for one in motions])
    return [replace(f, halved=(half.window, *own)) for f, own in zip(found, errors.tolist())]
