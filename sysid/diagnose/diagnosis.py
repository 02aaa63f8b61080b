"""A fitted experiment -> where it fails, which effect is missing, and what its logs could have shown.

The whole loop on one page:

    fit (given, or made)
    training logs -> view: both sides under one low-pass, events and standstill left out
    view -> steps: every candidate asked at once, what is there and worth having joins, and again
    steps -> claims: each fitted as `sysid add` fits it; parameters, error and command are that fit's
    test logs, opened once -> errors, where the model fails
    claims + noise floors + what the motion still predicts -> the verdict on each joint
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from .. import model, pipeline
from ..config import Experiment, is_own
from ..effect import vocabulary
from ..errors import LogError
from ..estimate import Fit
from ..filters import settled
from ..noise import NoiseFloor, floors
from ..preprocess import prepare
from ..transfer import transfers
from . import claims as claiming
from . import regions, select
from .candidates import candidates
from .claims import Claim, Finding, Refused
from .detectable import Detectable, detectable
from .held_out import HeldOut
from .lowpass import lowpassed, narrowed, rougher, stride_of, widest
from .verdict import Verdict, verdicts
from .view import View, looked_at


@dataclass(frozen=True)
class Diagnosis:
    """Everything that `sysid diagnose` says. first, last: the model before and after all claims, on the test logs; notices: what to
    know beside it."""

    fit: Fit
    floors: dict[str, NoiseFloor]
    claims: tuple[Claim, ...]
    verdict: tuple[Verdict, ...]
    detectable: tuple[Detectable, ...]
    failures: tuple[regions.Failure, ...]
    events: tuple
    first: HeldOut
    last: HeldOut
    refused: tuple[Refused, ...] = ()
    notices: tuple[str, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of all claims, each head followed by what is tied with it."""
        return tuple(finding for claim in self.claims for finding in claim.findings)


def diagnose(experiment: Experiment, *, fit: Fit | None = None, level: float = select.LEVEL, progress: pipeline.Progress | None = None) -> Diagnosis:
    """Question an experiment's model.

    Args:
        fit: where it is at hand. level: family-wise, how often anything is accused where nothing is there.

    Raises:
        SysidError: bad input, or logs too short to question.
    """
    tell = progress or (lambda stage, share: None)
    fit = fit or pipeline.fit(experiment, progress=progress)
    extra = _own(experiment)
    with pipeline.noticed():
        logs = {part: _read(experiment, fit, part) for part in ("train", "test")}
        view = first_view(experiment, fit, logs["train"])
        steps, asked, _, undecided = select.search(view, extra, level=level, tell=tell)
        claims, refused = claiming.claimed(steps, fit, tell)
        refused += [claiming.undecided(choice, fit) for choice in undecided[-1:]]
        after = claiming.view_after(claims, view)
        last = claims[-1].after if claims else fit
        found = dict(zip(fit.joints, _floors(experiment, last, logs)))
        test = lowpassed(logs["test"], fit.joints, view.motion.pieces[0].smoother.cutoff)
        if test is None:
            raise _short()
        first, then = HeldOut(view, test), HeldOut(after, test)
        said = verdicts(fit, claims, after.unknown, view.unknown, list(found.values()), refused, transfers(last))
        levels = np.array([floor.rms if floor.rms is not None else last.rms("test")[j] for j, floor in found.items()])
        return Diagnosis(
            fit, found, tuple(claims), tuple(said), tuple(detectable(view, asked, candidates(view.model, extra))),
            tuple(regions.failures(first, fit.predictions["test"], levels)), _events(view, test), first, then,
            tuple(refused), tuple(_notices(claims, refused)),
        )  # fmt: skip


def _notices(claims, refused) -> Iterator[str]:
    yield from (f"{r.effect} on {r.joint} is not claimed: {r.why}" for r in refused)
    yield from (words for c in claims if (words := claiming.hidden_by_weights(c.head, c.after)) is not None)


def _read(experiment: Experiment, fit: Fit, part: str):
    return pipeline.read(experiment, fit.model.robot, getattr(experiment.data, part))


def first_view(experiment: Experiment, fit: Fit, logs=None) -> View:
    """The fitted model on the training logs, and on the same with the noise of the angles drawn once more; in the widest band
    that this noise leaves.

    Args:
        logs: the training logs, where they are at hand.
    """
    logs = _read(experiment, fit, "train") if logs is None else logs
    cutoff = widest(logs)
    view = _under(experiment, fit, logs, cutoff)
    # in the middle of the rows: about reversals, and where something is missing, there is more of either
    square = lambda values: np.array([np.median(v[u] ** 2) if u.any() else 1.0 for v, u in zip(values.T, view.rows.use.T)])  # noqa: E731
    share = square(view.design.rough_residual) / np.maximum(square(view.design.residual), 1e-300)
    lower = narrowed(cutoff, float(np.median(share)))
    return view if lower > 0.9 * cutoff else _under(experiment, fit, logs, lower)


def _under(experiment: Experiment, fit: Fit, logs, cutoff: float) -> View:
    motion = lowpassed(logs, fit.joints, cutoff)
    if motion is None or motion.samples < 50:
        raise _short()
    rng = np.random.default_rng(0)
    noise = np.max([piece.noise for piece in motion.pieces], axis=0)
    again = [replace(log, segments=tuple(replace(s, q=rougher(s, noise, rng)) for s in log.segments)) for log in logs]
    return looked_at(
        experiment, fit.model, motion, lowpassed(again, fit.joints, cutoff), fit.prior, stride=stride_of(motion, cutoff)
    )  # fmt: skip


def _short() -> LogError:
    return LogError(
        "the logs are too short to question", where="diagnose", allowed="some seconds of training and of test logs", do="log longer"
    )  # fmt: skip


def _own(experiment: Experiment) -> list:
    """The user's own effects, those named as candidates and those in the model, to be asked on every joint."""
    specs = experiment.model.candidates + [s for s in experiment.model.effects if is_own(s.name) or "formula" in s.options]
    found = {}
    for spec in specs:
        effect = model.found(spec, experiment.folder)
        found.setdefault(effect.name, effect)
    return [effect for name, effect in found.items() if name not in vocabulary()]


def _floors(experiment: Experiment, fit: Fit, logs: dict) -> list[NoiseFloor]:
    """The noise floor of each joint, as the fit sees its torque: of what the model with all claims leaves."""
    spec = settled(experiment.preprocess, fit.filters)
    pieces, residuals = [], []
    for part in ("train", "test"):
        motion, predicted, at = prepare(logs[part], spec, fit.joints), fit.predictions[part].predicted, 0
        for piece in motion.pieces:
            pieces.append(piece)
            residuals.append(piece.measured[piece.core] - predicted[at : at + piece.samples])
            at += piece.samples
    pick = lambda name: [getattr(p, name)[p.core] for p in pieces]  # noqa: E731
    use = None if pieces[0].use is None else pick("use")
    found = floors(residuals, pick("measured"), pick("q"), [p.step for p in pieces], use=use)
    smoother = pieces[0].smoother
    if smoother is None:
        return list(found)
    # the fit filters torque: of white noise this much comes through
    impulse = np.zeros(20 * smoother.reach + 1)
    impulse[len(impulse) // 2] = 1.0
    gain = float(np.sqrt(np.sum(smoother(impulse) ** 2)))
    scaled = lambda value: None if value is None else value * gain  # noqa: E731
    return [
        replace(f, rms=scaled(f.rms), std=scaled(f.std), low=scaled(f.low), high=scaled(f.high), detail=f"{f.detail}; carried through the fit's filter")
        for f in found
    ]  # fmt: skip


def _events(view: View, test) -> tuple:
    return (*getattr(view.motion, "events", ()), *getattr(test, "events", ()))
