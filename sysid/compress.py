"""Any number of samples -> small triangles that hold all the data say.

The rows of one joint over one stretch of time, [A | tau], are reduced by QR to a triangle R with
||A x - tau|| = ||R [x; -1]|| for every x.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from .blocks import FEWEST, divided
from .linearised import Linearised
from .model import Model
from .motion import Motion, Piece
from .reduction import Reduction
from .slides import counted
from .triangles import Compressed, Factor

# samples: with fewer rows than columns a triangle would be no smaller than they are
_SHORTEST_BLOCK = 200
# samples whose columns stand in memory at once: a filter needs margins on each stretch
_STRETCH, _FILTERED_STRETCH = 8192, 16384


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
    remembered, filtered, use = model.remembered(piece), piece.smoother is not None, counted(model, piece)
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
                begun[joint].add(_counted(values, own, piece.tau[rows, joint], None if use is None else use[rows, joint]))
            if stop == edges[block + 1]:
                factors += [Factor(j, block, supports[j], np.sqrt(every) * one.triangle(), every * one.rows) for j, one in enumerate(begun)]
                begun = []
        del columns, values  # or they stand beside the next ones
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
