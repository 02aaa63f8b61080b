"""A fitted experiment -> where it fails, which effect is missing, and what its logs cannot show.

The whole loop on one page: fit; the noise floor; the ground of questions; every candidate asked; what held-out data
support joins the model, and again; is structure left that nothing explains; the verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from weakref import WeakKeyDictionary

import numpy as np

from .. import model, pipeline, rows
from ..config import Experiment, is_own
from ..effect import SensorEffect, vocabulary
from ..estimate import Fit, inverse
from ..filters import settled
from ..model import ROBOT, Model
from ..preprocess import Motion, Smoother, prepare, standstill_speed, without_standstill
from . import regions, search, structure
from .candidate import candidates
from .domain import CUTOFFS, questioned, stride_of
from .ground import Answer, Ground
from .noise import NoiseFloor, floor

_MOST_STEPS = 8
_UNSEEN = 0.05  # of its root mean square: below it a signature is absorbed by the model
_SHOWN = 12  # findings
_MUCH_THERE = 0.4  # of a joint's squared error, around standstill
# of what the effects took: where as much can still be foretold, or lies above the noise floor, they are not the whole of it
_LEFT, _UNEXPLAINED = 0.15, 0.25


@dataclass(frozen=True)
class Finding:
    """A candidate that held-out data support.

    joint: its name, or `*`. removed, removed_se: share of the misfit (squared error above the noise floor, on the test logs
    as the fit sees them) that it removes. parameters: {name: (value, std or NaN, unit)}. tied_with: words of other
    effects that this log cannot tell from it, with their joint where it is another. step: which step of the search it heads, or None.
    """

    answer: Answer
    joint: str
    q: float
    rms_before: float
    rms_after: float
    removed: float
    removed_se: float
    parameters: dict[str, tuple[float, float, str]]
    tied_with: tuple[str, ...]
    step: int | None

    @property
    def effect(self) -> str:
        """The effect's word."""
        return self.answer.candidate.name


@dataclass(frozen=True)
class Verdict:
    """complete, missing (effect, tied_with; also: further effects) or unknown (depends_on) for one joint."""

    joint: str
    status: str
    effect: str | None = None
    tied_with: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    structure: structure.Structure | None = None


@dataclass(frozen=True)
class Diagnosis:
    """Everything that `sysid diagnose` says. steps: the search's; grounds: the first and the last; notices: what to know of the
    error as the experiment filters it."""

    fit: Fit
    floors: dict[str, NoiseFloor]
    findings: tuple[Finding, ...]
    not_visible: tuple[Answer, ...]
    verdict: tuple[Verdict, ...]
    failures: tuple[regions.Failure, ...]
    steps: tuple[search.Step, ...]
    first: Ground
    last: Ground
    notices: tuple[str, ...] = ()


class Logs:
    """An experiment's logs, read once, as grounds under any low-pass."""

    def __init__(self, experiment: Experiment, fit: Fit):
        machine = fit.model.robot
        self.experiment, self.fit = experiment, fit
        self._from_angles: WeakKeyDictionary[Ground, np.ndarray] = WeakKeyDictionary()
        with pipeline.noticed():
            self.train = pipeline.read(experiment, machine, experiment.data.train)
            self.test = pipeline.read(experiment, machine, experiment.data.test)

    def ground(self, structure: Model, cutoff: float, weights=None, grid: bool = False) -> Ground | None:
        """A model's ground under a low-pass; None where a log is too short for it."""
        joints = structure.robot.joints
        train, test = questioned(self.train, joints, cutoff), questioned(self.test, joints, cutoff)
        if train is None or test is None or min(m.samples for m in (train, test)) < 50:
            return None
        stride = stride_of(train, cutoff)
        structure = structure if structure.scales else structure.scaled_by(train)
        make = lambda w: Ground(self.experiment, structure, train, test, self.fit.prior, stride=stride, weights=w, grid=grid)  # noqa: E731
        return make(weights) if weights is not None else make(inverse(make(None).rms("train")))

    def from_angles(self, ground: Ground) -> np.ndarray:
        """(dof,) RMS of the torque that the angles' own noise makes in the test residual of a ground under the first low-pass: as
        much again is added, and what that changes is looked at."""
        if ground not in self._from_angles:
            again = rows.predicted(ground.model, self._rougher, ground.settled.x, ground.stride)
            change = (again - ground.predicted[1]) * ground.held_out.use
            self._from_angles[ground] = np.sqrt((change**2).sum(0) / np.maximum(ground.held_out.use.sum(0), 1))
        return self._from_angles[ground]

    @cached_property
    def _rougher(self) -> Motion:
        """The test logs with as much noise again on their angles, the same whatever the model."""
        joints, rng = self.fit.model.robot.joints, np.random.default_rng(0)
        noise = np.max([piece.noise for piece in questioned(self.test, joints, CUTOFFS[0]).pieces], axis=0)
        logs = [replace(log, segments=tuple(replace(s, q=s.q + noise * rng.normal(size=s.q.shape)) for s in log.segments)) for log in self.test]
        return questioned(logs, joints, CUTOFFS[0])

    def as_fitted(self) -> Ground:
        """The fitted model on the logs as the experiment filters them, thinned; its shape values stay."""
        spec = settled(self.experiment.preprocess, self.fit.filters)
        joints = self.fit.joints
        train, test = prepare(self.train, spec, joints), prepare(self.test, spec, joints)
        return Ground(self.experiment, self.fit.model, train, test, self.fit.prior, stride=rows.stride_for(train, 6000), hold=True)


def diagnose(experiment: Experiment, *, fit: Fit | None = None, progress: pipeline.Progress | None = None) -> Diagnosis:
    """Question an experiment's model.

    Args:
        fit: where it is at hand.

    Raises:
        SysidError: bad input, or logs too short to question.
    """
    tell = progress or (lambda stage, share: None)
    fit = fit or pipeline.fit(experiment, progress=progress)
    extra = _own(experiment)
    with pipeline.noticed():
        logs = Logs(experiment, fit)
        ground = logs.ground(fit.model, CUTOFFS[0])
        if ground is None:
            from ..errors import LogError

            raise LogError("the logs are too short to question", where="diagnose", allowed="some seconds of training and of test logs", do="log longer")
        fitted = logs.as_fitted()
        levels = _levels(fitted, fit)
        floors = _floors(fitted, fit, levels)
        answers = search.ask(ground, candidates(ground.model, extra), lambda share: tell("ask", share))
        other = cache(lambda: logs.ground(ground.model, CUTOFFS[1], weights=ground.weights))
        writer, steps, found = _Writer(fit, floors, fitted), [], []
        for step, at in _steps(logs, ground, other, fitted, answers, extra, tell):
            found += writer.joined(at, step, len(steps))
            steps.append(step)
        last = steps[-1].ground if steps else ground
        left = structure.structures(last)
        found += writer.apart(fitted, ground, other, answers, found)
        failures = regions.failures(ground, (_residuals(fitted, fit, "test"), [p.step for p in fitted.test.pieces]), np.array([floors[j].rms for j in fit.joints]))
        return Diagnosis(
            fit, floors, tuple(found), tuple(_not_visible(answers)), tuple(_verdict(fit, levels, steps, last, left, logs)), tuple(failures), tuple(steps), ground, last,
            tuple(_around_standstill(fitted, fit)),
        )  # fmt: skip


def _steps(logs: Logs, ground: Ground, other, fitted: Ground, answers: list[Answer], extra, tell: Callable) -> Iterator[tuple[search.Step, Ground]]:
    """The steps of the search, each with the fitted model before it, on the logs as the experiment filters them."""
    for _ in range(_MOST_STEPS):
        refused = lambda answer, at=fitted, ground=ground: _harms(at, answer) or _smooths(logs, ground, answer)  # noqa: E731
        step = search.next_step(ground, other, answers, refused)
        if step is None:
            return
        before, ground, fitted = fitted, step.ground, fitted.holding(step.head)
        yield step, before
        other = cache(lambda at=ground: logs.ground(at.model, CUTOFFS[1], weights=at.weights))
        stage = f"ask, with {step.head.candidate.name}"
        answers = search.ask(ground, candidates(ground.model, extra), lambda share, stage=stage: tell(stage, share))


def _own(experiment: Experiment) -> list:
    """The user's own effects, those named as candidates and those in the model, to be asked on every joint."""
    specs = experiment.model.candidates + [s for s in experiment.model.effects if is_own(s.name) or "formula" in s.options]
    found = {}
    for spec in specs:
        effect = model.found(spec, experiment.folder)
        found.setdefault(effect.name, effect)
    return [effect for name, effect in found.items() if name not in vocabulary()]


def _harms(fitted: Ground, answer: Answer) -> bool:
    """Whether the held-out error as the experiment filters it rises, on the joints that an answer is judged by."""
    squares = _as_fitted(fitted, answer)
    own = answer.candidate.judged_by(squares.shape[1])
    rise = (squares - fitted.squares)[:, own].sum(1)
    return rise.sum() > 0 and (search.away(rise) > 1.0 or rise.sum() > 0.002 * fitted.squares[:, own].sum())


def _smooths(logs: Logs, ground: Ground, answer: Answer) -> bool:
    """Whether an effect that filters torque takes no more than the angles' noise makes of it: any filter lessens that."""
    candidate = answer.candidate
    if not (isinstance(candidate.effect, SensorEffect) or (candidate.curved and candidate.effect.uses_load)):
        return False
    j = candidate.joint
    return (ground.squares - answer.squares)[:, j].sum() <= ground.counts[:, j].sum() * logs.from_angles(ground)[j] ** 2


# ---- the noise floor


def _residuals(fitted: Ground, fit: Fit, part: str) -> list[np.ndarray]:
    """Raw measured minus predicted torque of each piece."""
    motion, predicted = (fitted.train if part == "train" else fitted.test), fit.predictions[part].predicted
    out, at = [], 0
    for piece in motion.pieces:
        out.append(piece.measured[piece.core] - predicted[at : at + piece.samples])
        at += piece.samples
    return out


def _levels(fitted: Ground, fit: Fit) -> dict[str, NoiseFloor]:
    """The noise floor of each joint's torque as logged."""
    pieces = (*fitted.train.pieces, *fitted.test.pieces)
    residuals = _residuals(fitted, fit, "train") + _residuals(fitted, fit, "test")
    measured, q = [p.measured[p.core] for p in pieces], [p.q[p.core] for p in pieces]
    return {joint: floor(residuals, measured, q, [p.step for p in pieces], j) for j, joint in enumerate(fit.joints)}


def _floors(fitted: Ground, fit: Fit, levels: dict[str, NoiseFloor]) -> dict[str, NoiseFloor]:
    """The noise floor of each joint, as the fit sees its torque."""
    out, limit = {}, fit.predictions["test"].errors()["rms"]
    for j, joint in enumerate(fit.joints):
        found = levels[joint]
        if (smoother := fitted.train.pieces[0].smoother) is not None:
            # the fit filters torque: of white noise this much comes through
            impulse = np.zeros(20 * smoother.reach + 1)
            impulse[len(impulse) // 2] = 1.0
            gain = float(np.sqrt(np.sum(smoother(impulse) ** 2)))
            found = replace(found, rms=found.rms * gain, std=found.std * gain, detail=found.detail + "; carried through the fit's filter")
        out[joint] = replace(found, rms=float(min(found.rms, limit[j])))
    return out


def _around_standstill(fitted: Ground, fit: Fit) -> Iterator[str]:
    """Joints whose held-out error stands where the angles' filter sees standstill: there it smears the jump of friction, which no
    effect takes away."""
    spec = settled(fit.experiment.preprocess, fit.filters)
    if spec.standstill != "keep" or spec.filter == "none":
        return
    pieces, residuals = fitted.test.pieces, _residuals(fitted, fit, "test")
    speed = standstill_speed(pieces)
    near = np.concatenate([~without_standstill(p, speed, Smoother(spec, p.step).reach).use[p.core] for p in pieces])
    square = np.concatenate(residuals) ** 2
    for j, joint in enumerate(fit.joints):
        error, share = square[near[:, j], j].sum() / max(square[:, j].sum(), 1e-300), near[:, j].mean()
        if error > _MUCH_THERE and error > 2.0 * share:
            yield (
                f"joint {joint!r}: {100 * error:.0f} % of its held-out squared error stands in the {100 * share:.0f} % of the rows around standstill, where the filter "
                "smears friction's jump and no effect helps; preprocess.standstill: mask leaves them out"
            )


# ---- findings


class _Writer:
    """Writes findings: what an answer does to the fit's own held-out error, which is found on thinned rows and told as of all."""

    def __init__(self, fit: Fit, floors: dict[str, NoiseFloor], fitted: Ground):
        self.fit = fit
        self.scale = np.array([fit.rms("test")[joint] for joint in fit.joints]) / np.maximum(fitted.rms(), 1e-300)
        self.levels = np.array([floors[joint].rms for joint in fit.joints]) / np.maximum(self.scale, 1e-300)

    def joined(self, at: Ground, step: search.Step, number: int) -> list[Finding]:
        """A step's family, against the model that it joined, as the experiment filters its logs."""
        out = []
        for member in step.family:
            heads, tied = member is step.head, _tied(step, member, self.fit.joints)
            out.append(self._finding(at, step.ground if heads else None, member, step.q[member.candidate], tied, number if heads else None))
        return out

    def apart(self, fitted: Ground, ground: Ground, other: Callable[[], Ground | None], answers: list[Answer], said: list[Finding]) -> list[Finding]:
        """What else stands out alone, beside the findings said."""
        q, there, rest = search.q_values(ground, answers), {(f.answer.candidate.name, f.answer.candidate.joint) for f in said}, []
        for answer in sorted(answers, key=lambda a: -a.score):
            key = (answer.candidate.name, answer.candidate.joint)
            if key not in there and search.passes(ground, answer, q[answer.candidate]) and search.survives(ground, other(), answer) and not _harms(fitted, answer):
                there.add(key)
                rest.append(answer)
        return [self._finding(fitted, None, a, q[a.candidate], (), None) for a in rest[: max(0, _SHOWN - len(said))]]

    def _finding(self, at: Ground, after: Ground | None, answer: Answer, q: float, tied, step: int | None) -> Finding:
        candidate, joints = answer.candidate, self.fit.joints
        own = candidate.judged_by(len(joints))
        squares = _as_fitted(at, answer)
        rows_ = np.maximum(at.counts.sum(0), 1)[own]
        before, then = (np.sum(s[:, own], 0) / rows_ for s in (at.squares, squares))
        blocks = ((at.squares - squares)[:, own] / rows_).sum(1)
        fall = float(blocks.sum())
        misfit = max(float((before - self.levels[own] ** 2).sum()), fall, 1e-300)
        se = float(np.sqrt(len(blocks) * np.var(blocks, ddof=1))) / misfit if len(blocks) > 2 else float("nan")
        name = "*" if candidate.joint == ROBOT else joints[candidate.joint]
        return Finding(
            answer, name, q, _together(np.sqrt(before) * self.scale[own]), _together(np.sqrt(then) * self.scale[own]), fall / misfit, se,
            _parameters(after, answer, self.fit), tied, step,
        )  # fmt: skip


def _tied(step: search.Step, member: Answer, joints) -> tuple[str, ...]:
    """Words for the rest of a family; what stands on another joint with that joint's name."""
    own, words = member.candidate.joint, []
    for candidate in (a.candidate for a in step.family if a is not member):
        if own == ROBOT or candidate.joint in (own, ROBOT):
            words.append(candidate.name)
        else:
            words.append(f"{candidate.name} on {joints[candidate.joint]}")
    return tuple(dict.fromkeys(word for word in words if word != member.candidate.name))


def _together(rms) -> float:
    return float(np.sqrt(np.mean(np.square(rms))))


def _as_fitted(fitted: Ground, answer: Answer) -> np.ndarray:
    """(blocks, dof) squares on the test rows as the fit sees them, with a candidate at the shape values found."""
    starts = {s.name: s.start for s in answer.candidate.effect.shapes()}
    if answer.candidate.curved and any(answer.shapes[name] != start for name, start in starts.items() if start is not None):
        return fitted.holding(answer).squares
    again = fitted.answer(answer.candidate, answer.shapes)
    return fitted.squares if again is None else again.squares


def _parameters(after: Ground | None, answer: Answer, fit: Fit) -> dict[str, tuple[float, float, str]]:
    """The parameters of a finding: from the model that it joined, else from its answer, without their deviations."""
    candidate = answer.candidate
    if after is not None:
        grown, first = after.model, 10 * after.model.bodies
        stds, shape_stds = after.std()
        out = {c.name: (float(after.settled.x[first + k]), float(stds[k]), c.unit) for k, c in enumerate(grown.coefficients) if (c.effect, c.joint) == (candidate.name, candidate.joint)}
        own = grown.last_shapes
        out |= {v.name: (float(at), float(std), v.unit) for v, at, std in zip(grown.shape_values[own], grown.shapes[own], shape_stds[own])}
        return out
    grown = fit.model.with_effect(candidate.effect, (candidate.joint,))
    nan = float("nan")
    linear = [c for c in grown.coefficients[len(fit.model.coefficients) :]]
    out = {} if candidate.curved else {c.name: (float(v), nan, c.unit) for c, v in zip(linear, answer.coefficients)}
    for value in grown.shape_values[grown.last_shapes]:
        at = answer.shapes.get(value.shape.name, nan)
        if candidate.curved and value.shape.start is not None and at == value.shape.start:
            at += float(answer.coefficients[[s.name for s in candidate.effect.shapes()].index(value.shape.name)])
        out[value.name] = (float(at), nan, value.unit)
    return out


def _not_visible(answers: list[Answer]) -> list[Answer]:
    """Effects whose signature the model absorbs on this log, under every variant."""
    best: dict[tuple, Answer] = {}
    for answer in answers:
        key = (answer.candidate.name, answer.candidate.joint)
        if key not in best or answer.most_visible > best[key].most_visible:
            best[key] = answer
    return [a for a in best.values() if a.most_visible < _UNSEEN]


# ---- the verdict


def _verdict(fit: Fit, levels, steps, last: Ground, left: list[structure.Structure], logs: Logs) -> list[Verdict]:
    out = []
    raw, angles = last.raw_rms() ** 2, lambda j: logs.from_angles(last)[j] ** 2
    for j, joint in enumerate(fit.joints):
        own = [s for s in steps if s.head.candidate.joint == j or (s.head.candidate.joint == ROBOT and s.shares[j] >= search.WORTH)]
        after, count = last.squares[:, j].sum(), max(last.counts[:, j].sum(), 1.0)
        # the other places of effects that were found on another joint: two gains that only their ratio is seen of
        elsewhere = [(s, a) for s in steps for a in s.family[1:] if a.candidate.joint == j and s.head.candidate.joint not in (j, ROBOT)]
        foretold = left[j].share * after / count
        # the angles' noise is in the residual too and hangs on the motion a little, but is no tone and comes in no bursts
        there = left[j].there and (left[j].bursts or left[j].tone or foretold > 0.5 * angles(j))
        kept = left[j] if there else None
        above = lambda doubt, j=j, level=levels[joint]: _above(raw[j], level, doubt, lambda: angles(j))  # noqa: E731
        if own:
            taken = (steps[0].before[j] - after) / count
            words = tuple(s.head.candidate.name for s in own)
            # a tone that two logs share is no part of any effect
            if (there and (left[j].tone or foretold > _LEFT * taken)) or above(1.0) > _UNEXPLAINED * taken:
                # what was found is not most of what is wrong
                out.append(Verdict(joint, "unknown", also=words, structure=left[j]))
            else:
                out.append(Verdict(joint, "missing", words[0], _tied(own[0], own[0].head, fit.joints), words[1:], kept))
        elif there or above(2.0) > 0.5 * raw[j]:
            out.append(Verdict(joint, "unknown", structure=left[j]))
        elif elsewhere:
            step, member = elsewhere[0]
            out.append(Verdict(joint, "missing", member.candidate.name, _tied(step, member, fit.joints)))
        else:
            out.append(Verdict(joint, "complete"))
    return out


def _above(square: float, level: NoiseFloor, doubt: float, angles: Callable[[], float]) -> float:
    """How far a joint's mean squared error lies above its noise floor, so many standard deviations of the floor in doubt, and
    above what the angles' noise makes."""
    above = square - (level.rms + doubt * level.std) ** 2
    return above - angles() if above > 0 else above
