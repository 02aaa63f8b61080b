"""The views that a diagnosis opens: of the training logs, in the band that the noise of their angles
leaves, and of other logs.
"""

from __future__ import annotations

import numpy as np

from .. import experiment_logs
from ..effect import NotFinite
from ..errors import LogError
from ..estimate import Fit
from ..lowpass import (
    MOTION,
    band,
    hardly_moving,
    lowpassed,
    narrowed,
    noisier,
    on_same_rows,
    stride_of,
    widest,
)
from ..notices import samples_of
from ..posed_problem import inverse
from ..prior_weight import USUAL, weakest, with_weight
from ..same_samples import same
from ..specs import Experiment
from .view import View, looked_at

_NARROWER = 3  # times
_KEPT = 0.8  # of the time: less is whole logs, and not their ends
_FEWEST = 50  # samples under the low-pass, or rows of other logs
# of a step between two rows: what was a second ago is then taken for what was 0.98 s ago
_APART = 0.02


def first_view(experiment: Experiment, fit: Fit, logs=None, others=()) -> View:
    """The fitted model on the training logs, and on the same with the noise of the angles drawn
    once more; in the widest band that this noise leaves.

    A weight of the prior that was chosen bends the bodies by as much as one standard error allows.
    A diagnosis is finer than that and would call it missing physics: it asks under the usual one,
    or, where torques are small, under one that says no more than that bodies are plausible.

    Args:
        logs: the training logs, where they are at hand. others: logs that will be looked at in the
            same band, which must not be too short for it.
    """
    if fit.strength.auto:
        # with weights of a geometric mean of one, every joint's residual has this variance
        rms = np.array(list(fit.rms("train").values()))
        alike = (rms * inverse(rms))[rms > 0.0]
        variance = float(np.median(alike)) ** 2 if len(alike) else np.inf
        experiment = with_weight(experiment, min(USUAL, weakest(variance)))
    if logs is None:
        logs = experiment_logs.read(experiment, fit.model.robot, experiment.data.train)
    cutoff = widest(logs, known=(own_band := band(logs)))
    view = _under(experiment, fit, logs, cutoff, own_band)
    if view is None:
        raise too_short()
    for _ in range(_NARROWER):  # rounding of slow motion is slow, and grows less with frequency
        rough, residual = view.design.rough_residual, view.design.residual
        # in the middle of the rows: about reversals, and where something is missing, there is more
        share = _middle(rough, view.rows.use) / np.maximum(_middle(residual, view.rows.use), 1e-300)
        lower = max(narrowed(view.cutoff, float(np.median(share))), MOTION * own_band)
        narrow = lower <= 0.9 * view.cutoff and _under(experiment, fit, logs, lower, own_band)
        # of short logs a narrow low-pass leaves nothing
        if not narrow or _seconds(narrow) < _KEPT * _seconds(view):
            break
        if others and lowpassed(others, fit.joints, lower, known=own_band) is None:
            break
        view = narrow
    return view


def _seconds(view: View) -> float:
    """How long the motion is that counts."""
    return sum((piece.core.stop - piece.core.start) * piece.step for piece in view.motion.pieces)


def _middle(values, use) -> np.ndarray:
    return np.array([np.median(v[u] ** 2) if u.any() else 1.0 for v, u in zip(values.T, use.T)])


def _under(experiment: Experiment, fit: Fit, logs, cutoff: float, own: float) -> View | None:
    if (motions := _motions(logs, fit.joints, cutoff, own)) is None:
        return None
    stride = stride_of(motions[0], cutoff)
    return looked_at(experiment, fit.model, *motions, fit.prior, stride=stride)


def _motions(logs, joints, cutoff: float, own: float, seed: int = 0):
    """Logs as a Motion under one low-pass, and with the noise of their angles drawn once more; None
    where too little of them is left."""
    motion = lowpassed(logs, joints, cutoff, known=own)
    if motion is None or motion.samples < _FEWEST:
        return None
    rng = np.random.default_rng(seed)
    slow = hardly_moving(cutoff, own)
    noise = np.max([piece.noise for piece in motion.pieces], axis=0)
    noisy = noisier(logs, lambda _: noise, slow, rng)
    return on_same_rows(motion, lowpassed(noisy, joints, cutoff, known=own))


def elsewhere(view: View, logs, but=()) -> View | None:
    """The model of a view, settled anew on other logs; None where it cannot be: they are too short,
    their rows are not as far apart, an effect is no finite number there, or they hold samples of
    the logs `but`, and would say the same twice."""
    read = [*samples_of("train", but), *samples_of("test", logs)] if but else []
    found = same(read) if len(read) > 1 else ()
    if any((one.first.part, one.others[0].part) == ("train", "test") for one in found):
        return None
    motions = _motions(logs, view.model.robot.joints, view.cutoff, view.motion.band, seed=1)
    if motions is None:
        return None
    steps = view.step / np.array([piece.step for piece in motions[0].pieces])
    stride = max(1, round(steps[0]))
    if np.abs(steps - stride).max() > _APART * stride or motions[0].samples < _FEWEST * stride:
        return None
    options = {"stride": stride, "weights": view.weights, "grid": False}
    try:
        return looked_at(view.experiment, view.model, *motions, view.prior, **options)
    except NotFinite:
        return None


def too_short() -> LogError:
    """Of logs that the low-pass leaves nothing of."""
    return LogError(
        "the logs are too short to question",
        where="diagnose",
        allowed="some seconds of training and of test logs",
        do="log longer",
    )
