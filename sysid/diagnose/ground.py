"""A model on its logs, ready for questions: what does everything in it leave, and what would one more effect take of that?

A candidate is fitted on the training rows together with everything that is in the model (which may absorb it: what is
absorbed is not visible), and judged on the test rows. Sums are kept by blocks of time, as residuals of smoothed signals
are correlated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import rows as row
from ..config import Experiment
from ..effect import SensorEffect
from ..model import ROBOT, Model
from ..preprocess import Motion
from ..rows import summed
from ..shape import Projection, prior_hessian, settle
from .candidate import Candidate

_BATCH = 64  # shape values whose columns stand in memory at once
_MOST_BLOCKS, _FEWEST, _SHORTEST = 48, 12, 0.4  # blocks a set of logs; s


@dataclass(frozen=True)
class Answer:
    """What one candidate does on a ground, at some shape values.

    coefficients (k,) of its columns, or its shape values where it is curved; visible: the share of its signature's
        root mean square that the model cannot absorb, `most_visible` the same at the shape values that show it best; gain: by how much the training objective falls.
    squares: (blocks, dof) sums of squared residuals on the test rows with the candidate; the ground has those without.
    score: fall of the held-out log-likelihood's minus, over all joints; forecast: standard errors from zero of the slope of the
        test residual on what the candidate foretells of it; p: probability of the training evidence by chance.
    """

    candidate: Candidate
    shapes: dict[str, float]
    coefficients: np.ndarray
    visible: float
    gain: float
    squares: np.ndarray
    score: float
    p: float
    allowed: bool
    most_visible: float = 0.0
    forecast: float = 0.0


class Ground:
    """A settled model on training and test motions."""

    def __init__(self, experiment: Experiment, model: Model, train: Motion, test: Motion, prior, *, stride: int, weights=None, grid: bool = True, hold: bool = False):
        """Settle the model on `train`; without `grid` from the shape values that it has; with `hold` at them."""
        self.experiment, self.train, self.test, self.prior, self.stride = experiment, train, test, prior, stride
        if weights is None:
            weights = np.ones(model.robot.dof)
        self.settled = settle(experiment, model, train, prior, weights=weights, stride=stride, grid=grid, hold=hold)
        self.weights = np.asarray(weights)
        self._asked: dict[tuple[Callable, Candidate], Answer | None] = {}
        self._holding: tuple[Candidate, dict[str, float], Ground] | None = None

    @property
    def model(self) -> Model:
        """The model, with its shape values found."""
        return self.settled.model

    @cached_property
    def rows(self) -> row.Rows:
        """Training rows."""
        return self.settled.rows

    @cached_property
    def held_out(self) -> row.Rows:
        """Test rows."""
        return row.stack(self.model, self.test, self.stride)

    @cached_property
    def residual(self) -> np.ndarray:
        """(n, dof) on the training rows."""
        return self.rows.residual(self.settled.x)

    @cached_property
    def residual_test(self) -> np.ndarray:
        """(n, dof) on the test rows."""
        return self.held_out.residual(self.settled.x)

    def rms(self, part: str = "test") -> np.ndarray:
        """(dof,) root mean square of the residual."""
        rows, residual = (self.held_out, self.residual_test) if part == "test" else (self.rows, self.residual)
        return np.sqrt((residual**2).sum(0) / np.maximum(rows.use.sum(0), 1))

    @cached_property
    def _slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of the model's own shape values on both motions."""
        x, model = self.settled.x, self.model
        if not model.shape_values:
            return tuple(np.zeros((model.robot.dof, len(r.t), 0)) for r in (self.rows, self.held_out))
        return tuple(row.tangents(model, motion, x, self.stride, rows.use) for motion, rows in ((self.train, self.rows), (self.test, self.held_out)))

    @cached_property
    def projection(self) -> Projection:
        """Least squares of everything in the model on the training rows."""
        slopes = self._slopes[0]
        columns = np.concatenate([self.rows.columns, slopes], axis=2) if slopes.shape[2] else self.rows.columns
        hessian = np.zeros((columns.shape[2],) * 2)
        hessian[: self.model.size, : self.model.size] = prior_hessian(self.settled)
        first = 10 * self.model.bodies
        positive = {first + k: float(self.settled.x[first + k]) for k, c in enumerate(self.model.coefficients) if c.positive}
        return Projection(columns, self.residual, hessian, self.weights, positive)

    @cached_property
    def _test_columns(self) -> np.ndarray:
        slopes = self._slopes[1]
        return np.concatenate([self.held_out.columns, slopes], axis=2) if slopes.shape[2] else self.held_out.columns

    @cached_property
    def blocks(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) the block of each training row, and of each test row."""
        return _blocks(self.rows), _blocks(self.held_out)

    @cached_property
    def squares(self) -> np.ndarray:
        """(blocks, dof) sums of squared residuals on the test rows."""
        return summed(self.blocks[1], self.residual_test**2)

    @cached_property
    def counts(self) -> np.ndarray:
        """(blocks, dof) test rows that count."""
        return summed(self.blocks[1], self.held_out.use.astype(float))

    @cached_property
    def _seen(self):
        return row.seen(self.model, self.train), row.seen(self.model, self.test)

    # ---- signatures

    def signature(self, candidate: Candidate, shapes: dict[str, float], part: str) -> np.ndarray:
        """Columns (n, k) of a joint, or (dof, n, k), that a candidate would add."""
        which = part == "test"
        motion, rows, pieces = ((self.train, self.rows, self._seen[0]), (self.test, self.held_out, self._seen[1]))[which]
        if not candidate.curved:
            return row.signature(self.model, motion, pieces, candidate.effect, candidate.joint, shapes, self.stride, rows.use)
        if isinstance(candidate.effect, SensorEffect):
            return self._read_otherwise(candidate, shapes, part)
        grown = self.grown(candidate, shapes)
        own = grown.last_shapes
        at_start = all(shapes[s.name] == s.start for s in candidate.effect.shapes() if s.start is not None)
        # where an effect does nothing yet, a value that only says how it does it changes nothing
        idle = [*grown.shape_values[: own.start], *(v for v in grown.shape_values[own] if at_start and v.shape.start is None)]
        held = tuple(((v.term, v.joint, v.shape.name), 0.0) for v in idle)
        slopes = row.tangents(
            replace(grown, held=(*grown.held, *held)), motion, self.settled.x, self.stride, rows.use, self.predicted[which] if at_start else None
        )  # fmt: skip
        return slopes[:, :, own]

    @cached_property
    def predicted(self) -> tuple[np.ndarray, np.ndarray]:
        """Torque (n, dof) that the model predicts on both motions' rows, low-passed as the columns are."""
        return tuple(row.predicted(self.model, motion, self.settled.x, self.stride) for motion in (self.train, self.test))

    @cached_property
    def _unsettled(self) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Torque (dof, n) that the model predicts over whole pieces, before the low-pass."""
        pi, c = self.pi, self.settled.x[10 * self.model.bodies :]
        bare = lambda piece: replace(piece, smoother=None, core=slice(0, len(piece.t)))  # noqa: E731
        return tuple([self.model.torque(bare(piece), pi, c).T for piece in motion.pieces] for motion in (self.train, self.test))

    def raw_rms(self) -> np.ndarray:
        """(dof,) root mean square on the test rows that count of torque as logged minus predicted torque, which was low-passed."""
        rows = self.held_out
        logged = np.concatenate([piece.measured[rows.index[rows.piece == k]] for k, piece in enumerate(self.test.pieces)])
        return np.sqrt((((logged - rows.tau + self.residual_test) * rows.use) ** 2).sum(0) / np.maximum(rows.use.sum(0), 1))

    def _read_otherwise(self, candidate: Candidate, shapes: dict[str, float], part: str) -> np.ndarray:
        """Slopes (n, k) of a sensor effect: what it makes of the predicted torque of its joint, by differences."""
        which = part == "test"
        motion, rows = ((self.train, self.rows), (self.test, self.held_out))[which]
        out = []
        for piece, torque, kept in zip(motion.pieces, self._unsettled[which], row.starts(motion, self.stride)):
            base, own = torque[None, candidate.joint], []
            for shape, low, high, _ in self.bounds(candidate):
                step = 1e-4 * (high - low)
                read = [candidate.effect.sensed(base, piece.step, **{**shapes, shape.name: shapes[shape.name] + h}) for h in (0.0, step)]
                slope = (read[1] - read[0])[0] / step
                own.append(slope[kept] if piece.smoother is None else piece.smoother.at(slope, kept))
            out.append(np.stack(own, axis=1))
        return np.concatenate(out) * rows.use[:, [candidate.joint]]

    def grown(self, candidate: Candidate, shapes: dict[str, float]) -> Model:
        """The model with a candidate, at shape values."""
        grown = self.model.with_effect(candidate.effect, (candidate.joint,))
        if candidate.effect.uses_load and grown.reference is None:
            grown = grown.with_reference(self.pi)
        own = grown.last_shapes
        asked = [shapes.get(value.shape.name, at) for value, at in zip(grown.shape_values[own], grown.shapes[own])]
        return grown.with_shapes([*grown.shapes[: own.start], *asked])

    def holding(self, answer: Answer) -> Ground:
        """This ground with an answer's candidate in the model, at the shape values found. The latest one is remembered."""
        asked = (answer.candidate, answer.shapes)
        if self._holding is None or self._holding[:2] != asked:
            grown = self.grown(*asked)
            held = Ground(self.experiment, grown, self.train, self.test, self.prior, stride=self.stride, weights=self.weights, hold=True)
            self._holding = (*asked, held)
        return self._holding[2]

    @property
    def pi(self) -> np.ndarray:
        """Bodies (bodies, 10)."""
        return self.settled.x[: 10 * self.model.bodies].reshape(-1, 10)

    def bounds(self, candidate: Candidate) -> list[tuple]:
        """(shape, low, high, angle travelled) of a candidate's shape values."""
        scales, joint = self.model.scales, candidate.joint
        angle = None if joint == ROBOT else float(scales.angle[joint])
        return [(s, s.low * scales.of(s.of, joint), s.high * scales.of(s.of, joint), angle) for s in candidate.effect.shapes()]

    def std(self) -> tuple[np.ndarray, np.ndarray]:
        """Standard deviations of the effects' coefficients (coefficients,) and of the shape values (shape values,), from
        blocks of time; NaN for what is held or not determined."""
        model, columns = self.model, self.projection.columns
        scores = np.zeros((int(self.blocks[0].max()) + 1, columns.shape[2]))
        for j, weight in enumerate(self.weights):
            scores += 2.0 * weight**2 * summed(self.blocks[0], columns[j] * self.residual[:, [j]])
        moves = scores @ self.projection.inverse
        blocks = len(moves)
        variance = (moves**2).sum(0) * blocks / max(blocks - 1, 1)
        found = np.where(np.diagonal(self.projection.inverse) > 0, np.sqrt(variance), np.nan)
        first = 10 * model.bodies
        shapes = found[model.size :] if len(found) > model.size else np.full(len(model.shape_values), np.nan)
        return found[first : model.size], np.where([v.held for v in model.shape_values], np.nan, shapes) if len(model.shape_values) else shapes

    # ---- answers

    def asked(self, candidate: Candidate, ask: Callable[[Ground, Candidate], Answer | None]) -> Answer | None:
        """What `ask` says of a candidate here, which is worked out once."""
        if (ask, candidate) not in self._asked:
            self._asked[ask, candidate] = ask(self, candidate)
        return self._asked[ask, candidate]

    def gains(self, candidate: Candidate, tried: list[dict[str, float]]) -> tuple[list[float], float]:
        """Fall of the training objective at several shape values of a torque effect, zero where a sign is not allowed; and
        the most of its signature that is visible at any of them."""
        out, most = [], 0.0
        for start in range(0, len(tried), _BATCH):
            batch = tried[start : start + _BATCH]
            for columns in row.signatures(self.model, self.train, self._seen[0], candidate.effect, candidate.joint, batch, self.stride, self.rows.use):
                c, _, _, gain, visible = self.projection.step(columns, candidate.joint)
                out.append(gain if _allowed(candidate, c) else 0.0)
                most = max(most, float(np.sqrt(visible.max(initial=0.0))))
        return out, most

    def answer(self, candidate: Candidate, shapes: dict[str, float], *, tests: int = 1) -> Answer | None:
        """What a candidate takes of the residual; None where it has no signature here.

        Args:
            tests: how many shape values were tried, for which p allows.
        """
        columns = self.signature(candidate, shapes, "train")
        if not np.isfinite(columns).all() or not np.any(columns):
            return None
        c, change, absorbed, gain, share = self.projection.step(columns, candidate.joint)
        if not np.isfinite(c).all():
            return None
        own = _apply(columns, c, candidate.joint, self.model.robot.dof)
        fitted = own + np.einsum("jnk,k->nj", self.projection.columns, change)
        held_out = self.signature(candidate, shapes, "test")
        after = self.residual_test - _apply(held_out, c, candidate.joint, self.model.robot.dof) - np.einsum("jnk,k->nj", self._test_columns, change)
        squares = summed(self.blocks[1], (after * self.held_out.use) ** 2)
        gained = score(self.squares, squares, self.counts)
        # what held-out data refuse needs no other evidence; it still counts as a question asked
        p = self._chance(columns, candidate.joint, c, absorbed, fitted) if gained > 0 else 1.0
        whole, alone = self._size(own), float(np.sqrt(share.max(initial=0.0)))
        seen = self._size(fitted) / whole if whole > 0 else alone
        return Answer(
            candidate, dict(shapes), c, float(min(seen, 1.0)), gain, squares, gained, min(1.0, p * tests),
            _allowed(candidate, c), max(alone, float(min(seen, 1.0))), self.forecast(after, candidate),
        )  # fmt: skip

    def forecast(self, after: np.ndarray, candidate: Candidate) -> float:
        """How far the slope of the test residual on what was foretold of it stands from zero, in standard errors.

        Blocks count by what is foretold in them, so that an effect at rare speeds is judged where it acts.

        Args:
            after: (n, dof) what is left of the test residual. candidate: what foretells.
        """
        own = candidate.judged_by(self.model.robot.dof)
        use = self.held_out.use[:, own]
        scale = 1.0 / np.maximum(np.sqrt((after[:, own] ** 2 * use).sum(0) / np.maximum(use.sum(0), 1)), 1e-300)
        before, left = self.residual_test[:, own] * use * scale, after[:, own] * use * scale
        return foretells(before - left, before, self.blocks[1])

    def _size(self, torque) -> float:
        return float(np.linalg.norm(torque * self.weights))

    def _chance(self, columns, joint: int, c, absorbed, fitted) -> float:
        """Probability of a candidate's coefficients under no effect: Wald's test with blocks of time as clusters (Cameron &
        Miller 2015), of as many degrees of freedom as blocks in which the candidate acts.

        Args:
            c: (k,); absorbed: (size, k) what the model takes of its columns; fitted: (n, dof) what it makes of the residual.
        """
        from scipy.stats import f

        weights = self.weights
        count, k = int(self.blocks[0].max()) + 1, columns.shape[-1]
        scores, size, system = np.zeros((count, k)), np.zeros(count), np.zeros((k, k))
        for j in range(len(weights)):
            own = -self.projection.columns[j] @ absorbed
            if columns.ndim == 3:
                own = own + columns[j]
            elif j == joint:
                own = own + columns
            told = own @ c
            scores += weights[j] ** 2 * summed(self.blocks[0], own * (self.residual - fitted)[:, [j]])
            size += weights[j] ** 2 * summed(self.blocks[0], (told**2)[:, None])[:, 0]
            system += weights[j] ** 2 * own.T @ own
        acting = size.sum() ** 2 / max(np.sum(size**2), 1e-300)
        scale = np.sqrt(np.where(np.diagonal(system) > 0, np.diagonal(system), 1.0))
        pull, spread = system @ c / scale, scores.T @ scores / np.outer(scale, scale) * count / max(count - 1, 1)
        values, vectors = np.linalg.eigh(spread)
        keep = values > 1e-9 * max(values[-1], 1e-300)
        rank = int(keep.sum())
        left = acting - rank
        if not rank or left < 1.0:
            return 1.0
        wald = float(np.sum((vectors[:, keep].T @ pull) ** 2 / values[keep]))
        return float(f.sf(wald * left / (rank * max(acting - 1.0, 1.0)), rank, left))


def foretells(told, residual, blocks) -> float:
    """How far the slope of a residual (n, k) on what was foretold of it (n, k) stands from zero, in standard errors."""
    size = summed(blocks, told**2).sum(1)
    if not size.sum() > 0:
        return 0.0
    slope = float((residual * told).sum() / size.sum())
    return standard(slope * size.sum(), summed(blocks, told * (residual - slope * told)).sum(1), size)


def standard(pull: float, scores, size) -> float:
    """A sum over blocks in standard errors, as a normal variable would have them: `scores` of the blocks give its spread,
    their `size` how many blocks count."""
    from scipy.stats import norm, t

    acting = size.sum() ** 2 / max(np.sum(size**2), 1e-300)
    spread = np.sqrt(np.sum(scores**2) * len(scores) / max(len(scores) - 1, 1))
    if acting < 2.0 or not spread > 0:
        return 0.0
    return float(np.clip(norm.isf(max(t.sf(pull / spread, acting - 1.0), 1e-300)), -37.0, 37.0))


def _apply(columns, c, joint: int, dof: int) -> np.ndarray:
    """Torque (n, dof) of columns with coefficients c."""
    if columns.ndim == 3:
        return np.einsum("jnk,k->nj", columns, c)
    out = np.zeros((len(columns), dof))
    out[:, joint] = columns @ c
    return out


def _allowed(candidate: Candidate, c) -> bool:
    """Whether the coefficients have the signs that the effect allows; a curved effect's bounds are kept when it is refitted."""
    if candidate.curved:
        return all(not (s.low == 0.0 and s.start == 0.0 and value < 0) for s, value in zip(candidate.effect.shapes(), c))
    return all(not (linear.lower == 0 and value < 0) for linear, value in zip(candidate.effect.coefficients(), c))


def _blocks(rows: row.Rows) -> np.ndarray:
    """Blocks of equal numbers of rows within each piece, none shorter than they must be."""
    n = len(rows.t)
    step = float(np.median(np.diff(rows.t))) if n > 1 else 1.0
    length = max(n // _MOST_BLOCKS, int(_SHORTEST / max(step, 1e-9)), 1)
    if n // length < _FEWEST:
        length = max(n // _FEWEST, 1)
    out, first = np.zeros(n, dtype=int), 0
    for piece in range(rows.piece.max() + 1):
        own = np.flatnonzero(rows.piece == piece)
        count = max(1, round(len(own) / length))
        out[own] = first + np.minimum(np.arange(len(own)) * count // len(own), count - 1)
        first += count
    return out


def score(before, after, counts) -> float:
    """Held-out log-likelihood ratio over joints: half the rows times the log of the ratio of squares."""
    rows = counts.sum(0)
    b, a = before.sum(0), after.sum(0)
    tiny = 1e-12 * np.maximum(b, 1e-300)
    return float(np.sum(0.5 * rows * np.log(np.maximum(b, 1e-300) / np.maximum(a, tiny))))
