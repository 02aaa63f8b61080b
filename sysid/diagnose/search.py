"""Which effect is missing? Every candidate is asked, the best that held-out data support joins the model, and again.

A candidate must pass four gates: its training evidence against chance, allowing for correlated residuals and for the
number of questions; a fall of the held-out error that stands out from block to block; a fall worth having; and all of
that once more under another low-pass. Candidates that this log cannot tell from the best stand with it as one family.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .candidate import Candidate
from .ground import Answer, Ground, score

Q_LEVEL, SUPPORT, WORTH = 0.01, 3.0, 0.02  # false discoveries; standard errors; share of the joint's squared residual
_SHORTLIST, _NEAR = 8, 0.5  # how many are refitted exactly, and how near to the best they must be
# standard errors; share of what the best removes and of what it leaves; share of the former that is never a tie
_TIED, _TIED_SHARE, _TIED_MOST = 2.0, 0.02, 0.15
_CLEARLY = 0.9  # of what another leaves
_SEEN = 0.03  # share of a signature's root mean square that the model must leave for it to be judged
_SAME = 0.99  # share of a signature that another one holds


@dataclass(frozen=True)
class Support:
    """What held-out data say of one answer against none: share of the squared residual removed on its joints, its
    standard errors away from zero."""

    share: float
    away: float


@dataclass(frozen=True)
class Step:
    """One effect that joined: the family (simplest first) of answers that the log cannot tell apart, their q-values, the
    ground after it, and what it took of each joint's held-out squared residual (dof,), and what that was before (dof,)."""

    family: tuple[Answer, ...]
    q: dict[Candidate, float]
    support: Support
    ground: Ground
    shares: np.ndarray
    before: np.ndarray

    @property
    def head(self) -> Answer:
        """The simplest of the family."""
        return self.family[0]


def ask(ground: Ground, candidates: list[Candidate], progress: Callable[[float], None] | None = None) -> list[Answer]:
    """The best answer of every candidate, over the shape values tried."""
    out = []
    for number, candidate in enumerate(candidates):
        if (answer := ground.asked(candidate, _best)) is not None:
            out.append(answer)
        if progress:
            progress((number + 1) / len(candidates))
    return out


def _best(ground: Ground, candidate: Candidate) -> Answer | None:
    bounds = ground.bounds(candidate)
    if candidate.curved:
        return ground.answer(candidate, {s.name: s.start if s.start is not None else float(np.sqrt(low * high)) for s, low, high, _ in bounds})
    if not bounds:
        return ground.answer(candidate, {})
    if not candidate.effect.coefficients():
        return None
    middle = {s.name: float(np.median(s.values(low, high))) for s, low, high, _ in bounds}
    tests, most = 0, 0.0
    for shape, low, high, angle in bounds:
        tried = shape.values(low, high, angle)
        gains, seen = ground.gains(candidate, [{**middle, shape.name: float(v)} for v in tried])
        most = max(most, seen)
        tests += len(tried)
        best = int(np.argmax(gains))
        if 0 < best < len(tried) - 1:
            finer = np.linspace(tried[best - 1], tried[best + 1], 9) if shape.even or low <= 0 else np.geomspace(tried[best - 1], tried[best + 1], 9)
            again, _ = ground.gains(candidate, [{**middle, shape.name: float(v)} for v in finer])
            middle[shape.name] = float(finer[int(np.argmax(again))])
        else:
            middle[shape.name] = float(tried[best])
    answer = ground.answer(candidate, middle, tests=tests)
    return None if answer is None else replace(answer, most_visible=max(answer.most_visible, most))


def q_values(ground: Ground, answers: list[Answer]) -> dict[Candidate, float]:
    """False discovery rates (Benjamini & Hochberg 1995) of all answers, from two logs that know nothing of each other: the
    training evidence and the fall of the held-out error (combined as Fisher 1925)."""
    from scipy.stats import chi2, t

    p = np.array([a.p for a in answers])
    far = np.array([support(ground, a).away for a in answers])
    # three measures of the fall were tried
    other = np.clip(3.0 * t.sf(far, max(len(ground.squares) // 2 - 1, 2)), 1e-300, 1.0)
    p = chi2.sf(-2.0 * (np.log(np.maximum(p, 1e-300)) + np.log(other)), 4)
    order = np.argsort(p)
    scaled = p[order] * len(p) / (1 + np.arange(len(p)))
    q = np.minimum.accumulate(scaled[::-1])[::-1]
    return {answers[i].candidate: float(min(1.0, value)) for i, value in zip(order, q)}


def support(ground: Ground, answer: Answer) -> Support:
    """What the test rows say of an answer."""
    joints = answer.candidate.judged_by(ground.model.robot.dof)
    weights = 1.0 / np.maximum(answer.squares.sum(0) / np.maximum(ground.counts.sum(0), 1), 1e-300)
    before, after = ground.squares[:, joints] @ weights[joints], answer.squares[:, joints] @ weights[joints]
    total = before.sum()
    return Support(float((total - after.sum()) / total) if total > 0 else 0.0, max(stands_out(before, after), answer.forecast))


def stands_out(before, after) -> float:
    """Standard errors by which squares over blocks fall: of their sum, or of the mean of their logarithms, which a few blocks
    with most of the error do not drown."""
    there = (before > 0) & (after > 0)
    return max(away(before - after), away(np.log(before[there] / after[there])))


def away(differences) -> float:
    """Standard errors that a sum over blocks is away from zero; neighbouring blocks count together (jackknife of pairs)."""
    d = np.asarray(differences)
    if len(d) > 7:
        d = d[: len(d) // 2 * 2].reshape(-1, 2).sum(1)
    if len(d) < 3:
        return 0.0
    se = np.sqrt(len(d) * np.var(d, ddof=1))
    return float(d.sum() / se) if se > 0 else 0.0


def passes(ground: Ground, answer: Answer, q: float) -> bool:
    """The gates of one low-pass."""
    found = support(ground, answer)
    return answer.allowed and answer.visible >= _SEEN and q <= Q_LEVEL and found.away >= SUPPORT and found.share >= WORTH and answer.score > 0


def next_step(ground: Ground, other: Callable[[], Ground | None], answers: list[Answer], refused: Callable[[Answer], bool] = lambda _: False) -> Step | None:
    """The effect that joins next, or None where no candidate passes.

    Args:
        other: makes the ground of the same model under another low-pass.
        answers: `ask(ground, ...)`.
        refused: whether an answer is refused on other grounds.
    """
    q = q_values(ground, answers)
    hopeful = [a for a in answers if passes(ground, a, q[a.candidate])]
    while hopeful:
        best = max(hopeful, key=lambda a: a.score)
        short = sorted((a for a in hopeful if a.score >= _NEAR * best.score), key=lambda a: -a.score)[:_SHORTLIST]
        standing = [a for a in short if survives(ground, other(), a)]
        refined = [(a, g) for a, g in (refit(ground, a) for a in standing) if passes(ground, a, q[a.candidate])]
        family = _family(ground, [a for a, _ in refined]) if refined else []
        helpful = [a for a in family if not refused(a)]
        if helpful:
            head = _clearer(other(), helpful[0], [a for a, _ in refined])
            if head is helpful[0]:
                family = [head, *(a for a in family if a is not head), *_alike(other(), head, standing, family)]
            else:
                family = [head]
            after = dict((a.candidate, g) for a, g in refined)[head.candidate] or refit(ground, head, always=True)[1]
            shares = 1.0 - after.squares.sum(0) / np.maximum(ground.squares.sum(0), 1e-300)
            return Step(tuple(family), q, support(ground, head), after, shares, ground.squares.sum(0))
        leave = {a.candidate for a in short}
        hopeful = [a for a in hopeful if a.candidate not in leave]
    return None


def refit(ground: Ground, answer: Answer, always: bool = False) -> tuple[Answer, Ground | None]:
    """An answer with everything that is not linear in it refitted; columns that are linear have nothing to refit."""
    candidate = answer.candidate
    if not (candidate.curved or always):
        return answer, None
    shapes = dict(answer.shapes)
    if candidate.curved:
        for shape, low, high, _ in ground.bounds(candidate):
            index = [s.name for s in candidate.effect.shapes()].index(shape.name)
            shapes[shape.name] = float(np.clip(shapes[shape.name] + answer.coefficients[index], low, high))
    grown = Ground(
        ground.experiment, ground.grown(candidate, shapes), ground.train, ground.test, ground.prior, stride=ground.stride, weights=ground.weights, grid=False
    )
    found = score(ground.squares, grown.squares, ground.counts)
    own = grown.model.last_shapes
    mine = {v.shape.name: s for v, s in zip(grown.model.shape_values[own], grown.model.shapes[own])}
    forecast = ground.forecast(grown.residual_test, candidate)
    return replace(answer, shapes=mine, squares=grown.squares, score=found, forecast=forecast), grown


# the factor by which encoder noise changes an effect's size between these low-passes is 3.5
_AGREE, _WORTH_BELOW = 1.7, 0.1  # how far apart an effect's size may be under two low-passes; share


def survives(ground: Ground, other: Ground | None, answer: Answer) -> bool:
    """Whether an effect is supported under another low-pass too, and of the same size there: what encoder noise makes of a
    second derivative also lowers the held-out error, but by another amount in every band."""
    if other is None:
        return True
    again = other.asked(answer.candidate, _best)
    if again is None or not again.allowed:
        return False
    found = support(other, again)
    # of the load's second derivative encoder noise makes most near the cutoff: the effect must be worth much below it
    least = _WORTH_BELOW if answer.candidate.curved and answer.candidate.effect.uses_load else 0.5 * WORTH
    if found.away < SUPPORT - 1.0 or found.share < least:
        return False
    if answer.candidate.curved:
        shapes = answer.candidate.effect.shapes()
        k = int(np.argmax(np.abs(answer.coefficients) * [s.start is not None for s in shapes]))
        if _agree(answer.coefficients[k], again.coefficients[k]):
            return True
        # one step from where an effect does nothing may fall far short of a large one: how large is it once it is refitted?
        size = lambda at: at.asked(answer.candidate, _refitted).shapes[shapes[k].name] - (shapes[k].start or 0.0)  # noqa: E731
        return _agree(size(ground), size(other))
    if len(answer.coefficients) == 1:
        same = all(0.7 < again.shapes[n] / v < 1.4 for n, v in answer.shapes.items() if v)
        return _agree(answer.coefficients[0], again.coefficients[0]) or (not same and again.coefficients[0] * answer.coefficients[0] > 0)
    return True


def _refitted(ground: Ground, candidate: Candidate) -> Answer:
    """The best answer of a candidate that has one, refitted."""
    return refit(ground, ground.asked(candidate, _best))[0]


def _agree(first: float, second: float) -> bool:
    """Whether two sizes are about the same."""
    return bool(first) and 1.0 / _AGREE < second / first < _AGREE


def _family(ground: Ground, answers: list[Answer]) -> list[Answer]:
    """The answers that held-out data cannot tell from the best: those that leave as little, the simplest first, then those
    that leave more, but not in enough blocks to be told apart. More general forms of the head that bring nothing are
    left out."""
    best = max(answers, key=lambda a: a.score)
    rms2 = best.squares.sum(0) / np.maximum(ground.counts.sum(0), 1)
    weigh = lambda squares: squares @ (1.0 / np.maximum(rms2, 1e-300))  # noqa: E731
    base, top = weigh(ground.squares), weigh(best.squares)
    removed = (base - top).sum()
    close, loose = [], []
    for answer in answers:
        worse = weigh(answer.squares) - top
        # what the best leaves is the measure: of a large misfit, one hundredth may still stand clear of the noise
        if worse.sum() <= _TIED_SHARE * min(removed, top.sum()):
            close.append(answer)
        elif worse.sum() <= _TIED_MOST * removed and stands_out(weigh(answer.squares), top) < _TIED:
            loose.append(answer)
    order = lambda a: (a.candidate.simplicity, -a.score)  # noqa: E731
    family = sorted(close, key=order) + sorted(loose, key=order)
    head = family[0]
    kept, names = [], set()
    for answer in family:
        key = (answer.candidate.name, answer.candidate.joint)
        if key in names or (answer is not head and answer.candidate.parameters > head.candidate.parameters and _holds(ground, answer, head)):
            continue
        names.add(key)
        kept.append(answer)
    return kept


def _clearer(other: Ground | None, head: Answer, refined: list[Answer]) -> Answer:
    """The head, or another curved effect of its joint that under the lower low-pass leaves clearly less, all refitted: a lag
    passes on more of the encoder's noise than a delay does, which counts against it the more the higher the cutoff."""
    rivals = [a for a in refined if a.candidate.curved and a.candidate.joint == head.candidate.joint and a.candidate.name != head.candidate.name]
    if other is None or not head.candidate.curved or not rivals:
        return head
    own = head.candidate.judged_by(other.model.robot.dof)
    # all of them survived there: none is without an answer
    left = {a.candidate: other.asked(a.candidate, _refitted).squares[:, own].sum(1) for a in (head, *rivals)}
    best = min(rivals, key=lambda a: left[a.candidate].sum())
    first, second = left[head.candidate], left[best.candidate]
    return best if second.sum() < _CLEARLY * first.sum() and stands_out(first, second) >= SUPPORT else head


def _alike(other: Ground | None, head: Answer, answers: list[Answer], family: list[Answer]) -> list[Answer]:
    """Curved effects of the head's joint that stand outside its family only because they pass on more of the encoder's noise:
    under the lower low-pass, to first order, they leave the same."""
    if other is None or not head.candidate.curved:
        return []
    rivals = [a for a in answers if a.candidate.curved and a.candidate.joint == head.candidate.joint and a.candidate.name not in {f.candidate.name for f in family}]
    if not rivals:
        return []
    again = {a.candidate: other.asked(a.candidate, _best) for a in (head, *rivals)}
    top = again[head.candidate]
    if top is None:
        return []
    own = head.candidate.joint
    left = top.squares[:, own].sum()
    return [a for a in rivals if again[a.candidate] is not None and again[a.candidate].squares[:, own].sum() <= (1.0 + _TIED_SHARE) * left]


def _holds(ground: Ground, general: Answer, special: Answer) -> bool:
    """Whether the torque of one answer is within reach of another's columns: then the other only adds freedom."""
    if general.candidate.joint != special.candidate.joint or general.candidate.curved or special.candidate.curved:
        return False
    columns = ground.signature(general.candidate, general.shapes, "train")
    target = ground.signature(special.candidate, special.shapes, "train") @ special.coefficients
    if columns.ndim == 3:
        return False
    base = ground.projection.columns[general.candidate.joint]
    both = np.concatenate([columns, base], axis=1)
    rest = lambda a: target - a @ np.linalg.lstsq(a, target, rcond=1e-9)[0]  # noqa: E731
    alone = np.sum(rest(base) ** 2)
    return bool(alone > 0 and np.sum(rest(both) ** 2) < (1.0 - _SAME) * alone)
