"""Motion: position, velocity, acceleration and torque in contiguous pieces. What identification works on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import starmap
from typing import NamedTuple

import numpy as np

from .events import Event
from .smoother import Smoother
from .workers import Mapped

NO_WEIGHT = 1e-9
# A joint never moves where its filtered angle travels less than its own noise would make it, or than this [rad or m].
_NEVER_MOVES, NOISE_TRAVEL = 1e-6, 6.0


class Blur(NamedTuple):
    """What a filter makes of a joint's reversal, as of `Smoother.smear`: it carries it `reach` samples far, a stop becomes a speed of
    `stop` [s] times the acceleration about it, and it looks at `look` samples to either side."""

    reach: int
    stop: float
    look: int


@dataclass(frozen=True)
class Piece:
    """A contiguous stretch of motion, every row usable.

    log, source: number and name of the log; levels {group: level} at which the experiment says it is. t (n,) [s]; q, qd, qdd (n, dof); tau (n, dof) as the fit sees it, `measured` as logged; signals {name: (n,)}; `use` (n, dof) bool, None where every row counts.
    `smoother` filters columns where torque was filtered, else None; then `margin` extra rows stand before and
    after `core`, whose filtered values the filter needs but which are not used. `rest` (dof,) [rad/s or m/s] is the
    speed that rounding makes of a constant angle; `noise` (dof,) [rad or m] what the filter took off the angles, RMS, or an
    estimate of their noise from that. `sight` is the filter that the angles were seen through, where it matters: torque was not.

    `weight` (n, dof) is what each row counts in the filter of both sides, None where all count alike: an average over what counts.

    `blur` is what the filter makes of reversals, where rows about them are left out for it. `clock` [s] is how far to either side the
    correction of its stamps may have spread what all joints did at once; zero where stamps were right.

    `kept` is for what is made of these rows once for all who ask; it goes with the piece.

    What a model adds: `load` (n, dof) the torque that its bodies alone need, `needed` that of its effects as well, where known; `gravity` (3,) or None for the robot's own;
    `deflection` (3, n, dof), how far each link is behind its motor in q, qd and qdd, or None.
    """

    log: int
    step: float
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tau: np.ndarray
    measured: np.ndarray
    signals: dict[str, np.ndarray]
    use: np.ndarray | None
    smoother: Smoother | None
    core: slice
    rest: np.ndarray
    noise: np.ndarray
    source: str = ""
    levels: Mapping[str, str] = field(default_factory=dict)
    sight: Smoother | None = None
    load: np.ndarray | None = None
    needed: np.ndarray | None = None
    gravity: np.ndarray | None = None
    deflection: np.ndarray | None = None
    weight: np.ndarray | None = None
    blur: Blur | None = None
    clock: float = 0.0
    kept: dict = field(init=False, default_factory=dict, repr=False, compare=False)

    def __getstate__(self) -> dict:
        """What is kept stays where it was made: another process has no use for it."""
        return {**vars(self), "kept": {}}

    def direction(self, joint: int) -> np.ndarray:
        """sign(qd) (n,) of a joint, zero where the filter of a constant angle leaves nothing but rounding."""
        qd = self.qd[:, joint]
        return np.where(np.abs(qd) > self.rest[joint], np.sign(qd), 0.0)

    def settled(self, values, rows: slice, joint: int, first: int = 0) -> np.ndarray:
        """Values (..., n) that stand for a joint's torque on the rows from `first` on, at some of these, as both sides of the
        equation see them."""
        if self.smoother is None:
            return values[..., rows]
        if self.weight is None:
            return self.smoother.at(values, rows)
        own = self.weight[first : first + values.shape[-1], joint]
        return self.smoother.at(values * own, rows) / np.maximum(self.smoother.at(own, rows), NO_WEIGHT)

    def part(self, rows: slice) -> Piece:
        """The rows `rows`, without margins."""
        return replace(
            self, t=self.t[rows], q=self.q[rows], qd=self.qd[rows], qdd=self.qdd[rows], tau=self.tau[rows],
            measured=self.measured[rows], signals={name: values[rows] for name, values in self.signals.items()},
            use=None if self.use is None else self.use[rows], core=slice(0, len(self.t[rows])),
            load=None if self.load is None else self.load[rows], needed=None if self.needed is None else self.needed[rows], weight=None if self.weight is None else self.weight[rows],
            deflection=None if self.deflection is None else self.deflection[:, rows],
        )  # fmt: skip

    def outline(self) -> Piece:
        """The piece without its rows: where it is from, how many there are, and the filter of both sides."""
        none = np.zeros((0, self.q.shape[1]))
        return replace(
            self, t=none[:, 0], q=none, qd=none, qdd=none, tau=none, measured=none, signals={}, use=None, load=None, needed=None, deflection=None, weight=None,
        )  # fmt: skip

    @property
    def samples(self) -> int:
        """Number of usable rows."""
        return self.core.stop - self.core.start


class Pieces(Sequence):
    """Pieces of long logs, each made whenever it is asked for.

    Args:
        makers: what makes each, in whichever process. outlines: of each, its `outline()`. extent: how large they are together,
            an `Extent`. masked: whether a row of some does not count.
    """

    def __init__(self, makers: Sequence[Callable[[], Piece]], outlines: tuple[Piece, ...], extent=None, masked=True) -> None:
        self.makers, self.outlines, self.extent, self.masked = makers, outlines, extent, masked

    def __len__(self) -> int:
        return len(self.outlines)

    def __getitem__(self, number):
        if isinstance(number, slice):
            raise TypeError("pieces of a long log are asked for one by one")
        return self.makers[number]()


@dataclass(frozen=True)
class Motion:
    """What identification works on: pieces of motion of the same joints.

    still: joints that never move, or never clear of a standstill. standing (dof,): share of the rows that count in which
    a joint stands still. left_out (dof,): rows that do not count.
    events: what disturbed the logs; `disturbed` the share of all joints' rows that is left out for it.
    band: [Hz] below which the joints' speeds stay, where it was asked for, else zero. unused: joints whose torque is not used.
    mapped: where there are several processes, what shares work among them, as of `workers.crew`.
    """

    joints: tuple[str, ...]
    pieces: Sequence[Piece]
    still: tuple[str, ...]
    standing: np.ndarray
    left_out: np.ndarray
    events: tuple[Event, ...] = ()
    disturbed: float = 0.0
    band: float = 0.0
    unused: tuple[str, ...] = ()
    mapped: Mapped | None = None

    def each(self, work: Callable, arguments: Iterable[tuple]) -> Iterator:
        """`work(piece, *own)` of every piece with its own arguments, in order; in other processes, where there are any. What it
        gives does not depend on that."""
        makers = self.pieces.makers if isinstance(self.pieces, Pieces) else [_There(piece) for piece in self.pieces]
        tasks = ((maker, work, own) for maker, own in zip(makers, arguments))
        # nothing here holds a piece while the next is made
        return starmap(_made, tasks) if self.mapped is None else self.mapped(_made, tasks)

    @property
    def samples(self) -> int:
        """Number of usable rows over all pieces."""
        return sum(piece.samples for piece in self.outlines)

    @property
    def duration(self) -> float:
        """Seconds of motion over all pieces."""
        return sum(piece.samples * piece.step for piece in self.outlines)

    @property
    def extent(self):
        """How large the motion is, where that has been found: an `Extent`."""
        return self.pieces.extent if isinstance(self.pieces, Pieces) else None

    @property
    def outlines(self) -> tuple[Piece, ...]:
        """The pieces, for what needs none of their rows."""
        return self.pieces.outlines if isinstance(self.pieces, Pieces) else self.pieces


@dataclass(frozen=True)
class _There:
    """Makes a piece that is in memory."""

    piece: Piece

    def __call__(self) -> Piece:
        return self.piece


def _made(maker: Callable[[], Piece], work: Callable, own: tuple):
    return work(maker(), *own)


def never_move(pieces: Sequence[Piece]) -> np.ndarray:
    """(dof,) bool: the joints that none of the pieces shows in motion."""
    low, high = (np.array([end(p.q[p.core], axis=0) for p in pieces]) for end in (np.min, np.max))
    return never_moved(low.min(0), high.max(0), np.max([piece.noise for piece in pieces], axis=0))


def never_moved(low, high, noise) -> np.ndarray:
    """(dof,) bool: the joints whose angle, of such noise, stays between such ends."""
    return high - low < np.maximum(_NEVER_MOVES, NOISE_TRAVEL * noise)
