"""What all the data say, as small triangles by joint and block of time.

Triangles stack: over time, logs, machines, joints (with a weight), and leaving one out is leaving it
out of the stack. Every solve, restart, fold, score and certificate works on them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .reduction import triangle


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
    if not own:  # a joint that no row tells of
        return Factor(joint, 0, np.zeros(0, dtype=int), np.zeros((0, 1)), 0)
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
