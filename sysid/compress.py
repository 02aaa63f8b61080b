"""Any number of samples -> small triangles that hold all the data say.

The rows of one joint over one stretch of time, [A | tau], are reduced by QR to a triangle R with
||A x - tau|| = ||R [x; -1]|| for every x. Triangles stack: over time, logs, machines, joints (with
a weight), and leaving one out is leaving it out of the stack. Every solve, restart, fold, score and
certificate works on them.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .blocks import FEWEST, divided
from .effect import NotFinite
from .model import Model
from .motion import Motion, Piece
from .reduction import Reduction, triangle
from .rows import difference_step

# samples: with fewer rows than columns a triangle would be no smaller than they are
_SHORTEST_BLOCK = 200
# samples whose columns stand in memory at once: a filter needs margins on each stretch
_STRETCH, _FILTERED_STRETCH = 8192, 16384


@dataclass(frozen=True)
class Linearised:
    """A model at parameters x (size,) with one more column for each free shape value: the slope of
    its torque there."""

    model: Model
    x: np.ndarray

    @property
    def robot(self):
        """The model's robot."""
        return self.model.robot

    @cached_property
    def free(self) -> list[int]:
        """Which of the model's shape values are not held by the user."""
        return [k for k, value in enumerate(self.model.shape_values) if not value.held]

    @property
    def size(self) -> int:
        """Linear parameters and free shape values."""
        return self.model.size + len(self.free)

    @property
    def reach(self) -> int:
        """The model's."""
        return self.model.reach

    def support(self, joint: int, piece: Piece | None = None) -> np.ndarray:
        """The model's, and every slope of values that are there."""
        slopes = [self.model.size + n for n, k in enumerate(self.free) if piece is None or self._there(k, piece)]
        return np.append(self.model.support(joint, piece), slopes).astype(int)

    def _there(self, k: int, piece: Piece) -> bool:
        return self.model.terms[self.model.shape_values[k].term][0].present(piece)

    @cached_property
    def _beside(self) -> list[tuple[Model, float]]:
        return [self._stepped(k, difference_step(self.model.shape_values[k], self.model.shapes[k])) for k in self.free]

    def _stepped(self, k: int, step: float) -> tuple[Model, float]:
        return self.model.with_shapes([s + step * (i == k) for i, s in enumerate(self.model.shapes)]), step

    def remembered(self, piece: Piece) -> list[dict]:
        """What the model remembers of a piece, at its shape values and a step beside each that is there."""
        beside = [model for k, (model, _) in zip(self.free, self._beside) if self._there(k, piece)]
        return [model.remembered(piece) for model in (self.model, *beside)]

    def columns(self, piece, rows: slice, remembered: list[dict]) -> list[np.ndarray]:
        """As `Model.columns`, with the slopes after the others."""
        out = self.model.columns(piece, rows, remembered[0])
        slopes: list[list[np.ndarray]] = [[] for _ in out]
        supports = [self.model.support(joint, piece) for joint in range(len(out))]
        there = [(k, beside) for k, beside in zip(self.free, self._beside) if self._there(k, piece)]
        for (k, (beside, step)), known in zip(there, remembered[1:]):
            if (slope := self.model.gain_slope(k, step)) is not None:  # all else stays
                own = self.model.shape_values[k].joint
                for joint, values in enumerate(out):
                    gained = slope * (self.x[supports[joint]] @ values) if joint == own else np.zeros(values.shape[1])
                    slopes[joint].append(gained)
                continue
            try:
                moved = beside.columns(piece, rows, known)
            except NotFinite:  # at the end of a formula's domain the slope is that of the other side
                beside, step = self._stepped(k, -step)
                moved = beside.columns(piece, rows)
            for joint, values in enumerate(moved):
                slopes[joint].append(self.x[supports[joint]] @ (values - out[joint]) / step)
        return [np.concatenate([values, *(s[None] for s in own)]) for values, own in zip(out, slopes)]


@dataclass(frozen=True)
class Factor:
    """The triangle of one joint over one block: R (r, k + 1) for the k parameters `columns`, then
    torque."""

    joint: int
    block: int
    columns: np.ndarray
    triangle: np.ndarray
    rows: int

    def misfit(self, x) -> np.ndarray:
        """R [x; -1]: as long as the residual over the block, for all parameters x."""
        return self.triangle[:, :-1] @ np.asarray(x)[self.columns] - self.triangle[:, -1]


@dataclass(frozen=True)
class Compressed:
    """A log's, or several logs', triangles by joint and block. `size` is the number of
    parameters."""

    size: int
    joints: int
    factors: tuple[Factor, ...]
    samples: int

    @cached_property
    def blocks(self) -> int:
        """Number of blocks of time."""
        return 1 + max((factor.block for factor in self.factors), default=-1)

    @cached_property
    def rows(self) -> np.ndarray:
        """(joints,) rows counted for each joint."""
        out = np.zeros(self.joints, dtype=int)
        for factor in self.factors:
            out[factor.joint] += factor.rows
        return out

    @cached_property
    def by_joint(self) -> tuple[Factor, ...]:
        """One factor for each joint, all blocks merged."""
        return tuple(_merged(self.factors, joint) for joint in range(self.joints))

    def total(self, weights=None) -> np.ndarray:
        """The triangle (size + 1, size + 1) of all joints; rows of a joint scaled by its weight."""
        stack = []
        for factor in self.by_joint:
            rows = np.zeros((len(factor.triangle), self.size + 1))
            rows[:, np.append(factor.columns, self.size)] = factor.triangle
            stack.append(rows if weights is None else rows * weights[factor.joint])
        merged = triangle(np.concatenate(stack))
        out = np.zeros((self.size + 1, self.size + 1))
        out[: len(merged)] = merged
        return out

    @cached_property
    def told(self) -> np.ndarray:
        """(size,) how many blocks have a parameter at all."""
        found = {(factor.block, k) for factor in self.factors for k in factor.columns.tolist()}
        return np.bincount([k for _, k in found], minlength=self.size)

    def stretches(self, count: int) -> list[np.ndarray]:
        """The blocks in at most so many parts of neighbours, in each of which every parameter has its share: blocks of logs that
        have parameters of their own are parted by themselves."""
        kinds: dict[int, set[int]] = {}
        for factor in self.factors:
            kinds.setdefault(factor.block, set()).update(factor.columns.tolist())
        alike: dict[frozenset, list[int]] = {}
        for block in range(self.blocks):
            alike.setdefault(frozenset(kinds.get(block, ())), []).append(block)
        parts: list[list[int]] = [[] for _ in range(min(count, self.blocks))]
        for number, own in enumerate(alike.values()):
            for k, part in enumerate(np.array_split(own, len(parts))):
                parts[(k + number) % len(parts)] += part.tolist()
        return [np.array(part, dtype=int) for part in parts if part]

    def squares(self, x) -> np.ndarray:
        """(joints,) sum of squared residuals [N^2 m^2]."""
        return np.array([np.sum(factor.misfit(x) ** 2) for factor in self.by_joint])

    def scores(self, x, weights=None) -> np.ndarray:
        """(blocks, size) gradient of each block's share of the sum of squares at x."""
        out = np.zeros((self.blocks, self.size))
        for factor in self.factors:
            scale = 2.0 if weights is None else 2.0 * weights[factor.joint] ** 2
            out[factor.block, factor.columns] += scale * factor.triangle[:, :-1].T @ factor.misfit(x)
        return out

    def first(self, size: int) -> "Compressed":
        """The same data with the first `size` parameters alone."""
        return self.only(range(size))

    def only(self, parameters: Sequence[int]) -> "Compressed":
        """The same data with some parameters alone, in this order: the columns of a triangle are a
        smaller problem's."""
        place, factors = {k: number for number, k in enumerate(parameters)}, []
        for factor in self.factors:
            kept = [at for at, k in enumerate(factor.columns.tolist()) if k in place]
            columns = np.array([place[factor.columns[at]] for at in kept], dtype=int)
            rows = triangle(np.asfortranarray(factor.triangle[:, [*kept, factor.triangle.shape[1] - 1]]))
            factors.append(Factor(factor.joint, factor.block, columns, rows, factor.rows))
        return Compressed(len(place), self.joints, tuple(factors), self.samples)

    def without(self, blocks) -> "Compressed":
        """The same data with some blocks left out."""
        leave = set(blocks)
        kept = tuple(factor for factor in self.factors if factor.block not in leave)
        return Compressed(self.size, self.joints, kept, self.samples)

    def gathered(self, parts: Sequence[Sequence[int]]) -> "Compressed":
        """The same data in fewer blocks: each of the parts, lists of blocks, becomes one."""
        place = {int(block): number for number, part in enumerate(parts) for block in part}
        heaps: dict[tuple[int, int], list[Factor]] = {}
        for factor in self.factors:
            heaps.setdefault((place[factor.block], factor.joint), []).append(factor)
        kept = tuple(replace(_merged(heap, joint), block=block) for (block, joint), heap in heaps.items())
        return Compressed(self.size, self.joints, kept, self.samples)


def _merged(factors: Sequence[Factor], joint: int) -> Factor:
    own = [factor for factor in factors if factor.joint == joint]
    alike: dict[bytes, list[Factor]] = {}
    for factor in own:
        alike.setdefault(factor.columns.tobytes(), []).append(factor)
    parts = [(heap[0].columns, triangle(np.concatenate([factor.triangle for factor in heap]))) for heap in alike.values()]
    if len(parts) == 1:
        ((columns, merged),) = parts
    else:  # each is reduced to its own small triangle before they meet: the whole is an arrow
        columns = np.unique(np.concatenate([own_columns for own_columns, _ in parts]))
        rows = [np.zeros((len(part), len(columns) + 1)) for _, part in parts]
        for (own_columns, part), wide in zip(parts, rows):
            wide[:, np.append(np.searchsorted(columns, own_columns), len(columns))] = part
        merged = triangle(np.concatenate(rows))
    return Factor(joint, 0, columns, merged, sum(factor.rows for factor in own))


def merge(parts: Sequence[Compressed]) -> Compressed:
    """Several compressed logs of one model as one; their blocks stay apart."""
    factors, first = [], 0
    for part in parts:
        factors += [Factor(f.joint, f.block + first, f.columns, f.triangle, f.rows) for f in part.factors]
        first += part.blocks
    return Compressed(parts[0].size, parts[0].joints, tuple(factors), sum(part.samples for part in parts))


def _edges(motion: Motion, kinds: Sequence[bytes]) -> list[np.ndarray]:
    """Of each piece, the rows at which its blocks begin, and its end.

    Args:
        kinds: of each piece, which parameters it tells: pieces of one kind are divided together, as what only they tell is known
            by their blocks alone.
    """
    pieces, counts, several = motion.outlines, np.zeros(len(motion.outlines), dtype=int), len(set(kinds)) > 1
    for kind in dict.fromkeys(kinds):
        own = [k for k, other in enumerate(kinds) if other == kind]
        counts[own] = divided([pieces[k].samples for k in own], shortest=_SHORTEST_BLOCK, fewest=FEWEST if several else 1)
    return [p.core.start + np.arange(n + 1) * p.samples // n for p, n in zip(pieces, counts)]


def _stretches(edges: np.ndarray, most: int) -> Iterator[list[tuple[int, int, int]]]:
    """The rows between edges in stretches of at most so many: (block, start, stop) of each part, where a stretch holds several
    blocks, or a part of one."""
    parts: list[tuple[int, int, int]] = []
    for block, (start, stop) in enumerate(zip(edges.tolist(), edges[1:].tolist())):
        if parts and stop - parts[0][1] > most:
            yield parts
            parts = []
        if stop - start > most:
            yield from ([(block, at, min(at + most, stop))] for at in range(start, stop, most))
        else:
            parts.append((block, start, stop))
    if parts:
        yield parts


def compress(model: Model | Linearised, motion: Motion, *, thin: int = 1, progress: Callable[[float], None] | None = None) -> Compressed:
    """Reduce a motion under a model to triangles.

    Args:
        thin: use every `thin`-th row of each block only (for quick comparisons).
        progress: called with the share done, from 0 to 1.
    """
    joints = range(model.robot.dof)
    supported = [[model.support(joint, piece) for joint in joints] for piece in motion.outlines]
    kinds = [b"|".join(support.tobytes() for support in supports) for supports in supported]
    divisions, factors, first = _edges(motion, kinds), [], 0
    done = _Counted(progress, motion.samples)
    here = done if motion.mapped is None else None  # no other process can tell this one row by row
    tasks = ((model, supports, edges, thin, here) for supports, edges in zip(supported, divisions))
    for edges, found in zip(divisions, motion.each(_of_piece, tasks)):
        factors += [replace(factor, block=first + factor.block) for factor in found]
        first += len(edges) - 1
        if here is None:
            done(int(edges[-1] - edges[0]))
    return Compressed(model.size, model.robot.dof, tuple(factors), motion.samples)


class _Counted:
    """Told how many rows more are done, it tells the share of them all."""

    def __init__(self, progress: Callable[[float], None] | None, rows: int):
        self._progress, self._rows, self._done = progress, rows, 0

    def __call__(self, rows: int) -> None:
        self._done += rows
        if self._progress:
            self._progress(self._done / self._rows)


def _of_piece(piece: Piece, model: Model | Linearised, supports: Sequence[np.ndarray], edges: np.ndarray, thin: int, done: _Counted | None) -> list[Factor]:
    """The triangles of one piece.

    Args:
        supports: of each joint, the parameters that can enter its torque here. edges: rows at which blocks begin, and the end.
        thin: as of `compress`. done: is told how many rows more are done.
    """
    joints, factors = range(model.robot.dof), []
    remembered, filtered = model.remembered(piece), piece.smoother is not None
    # of the rows that a low-pass makes alike, one stands for `every`
    every = piece.smoother.every if filtered and thin == 1 else 1
    # rows that are not wanted need no columns, unless a filter or an effect looks at them
    sparse = thin > 1 and not filtered and not model.reach
    begun: list[Reduction] = []
    for parts in _stretches(edges, _FILTERED_STRETCH if filtered else thin * _STRETCH):
        kept = [_kept(start, stop, edges[0] if every > 1 else edges[block], every * thin) for block, start, stop in parts]
        from_, at = kept[0].start, 0
        wanted = np.concatenate([np.arange(piece.core.stop)[rows] for rows in kept]) if sparse else slice(from_, parts[-1][2], every)
        columns = model.columns(piece, wanted, remembered)
        for (block, _, stop), rows in zip(parts, kept):
            count = len(range(rows.start, rows.stop, rows.step))
            own = slice(at, at + count) if sparse else slice((rows.start - from_) // every, (rows.stop - 1 - from_) // every + 1, thin)
            at, begun = at + count, begun or [Reduction() for _ in joints]
            for joint, values in enumerate(columns):
                begun[joint].add(_counted(values, own, piece.tau[rows, joint], None if piece.use is None else piece.use[rows, joint]))
            if stop == edges[block + 1]:
                factors += [Factor(j, block, supports[j], np.sqrt(every) * one.triangle(), every * one.rows) for j, one in enumerate(begun)]
                begun = []
        if done:
            done(parts[-1][2] - parts[0][1])
    return factors


def _counted(values: np.ndarray, own: slice, tau: np.ndarray, use: np.ndarray | None) -> np.ndarray:
    """Columns (k + 1, m) of torque after columns (k, n) at the rows `own`, those that count."""
    if use is None or use.all():
        return np.concatenate([values[:, own], tau[None]])
    kept = np.flatnonzero(use)
    out = np.empty((len(values) + 1, len(kept)))
    np.take(values, own.start + (own.step or 1) * kept, axis=1, out=out[:-1], mode="clip")
    out[-1] = tau[kept]
    return out


def _kept(start: int, stop: int, origin: int, every: int) -> slice:
    """Of the rows from start up to stop every so many, counted from origin."""
    return slice(int(origin - (origin - start) // every * every), stop, every)
