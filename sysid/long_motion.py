"""Long logs -> Motion, span by span: memory does not grow with them.

A first pass finds what no span says by itself (a joint's top speed, whether it moves at all, how
much of it stands still), and which rows count; after it a piece is filtered again whenever it is
asked for. Each is what it would be of the log as one, as a span is read with as many rows of its
neighbours as all filters see.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import preprocess, standstill
from .errors import LogError
from .extent import Extent, Reach, reach_of
from .free_memory import released
from .log import Log
from .motion import Motion, Piece, Pieces, never_moved
from .preprocess import ROUNDING, needs, on_both_sides, piece_of, under_lowpass
from .spans import Spans, around, carried
from .specs import PreprocessSpec
from .warned import warn
from .workers import Mapped

_SLOW = np.concatenate(
    [[0.0], np.geomspace(1e-9, standstill.STANDSTILL_MOST, 4096)]
)  # rad/s or m/s, edges of bins
_NONE = np.zeros(0)


def prepare(
    logs: Sequence[Log], spec: PreprocessSpec, joints: tuple[str, ...], mapped: Mapped | None = None
) -> Motion:
    """As `preprocess.prepare`; of long logs the pieces are made whenever they are asked for.

    How much of a joint stands still is counted in 4096 classes of speed.

    Args:
        mapped: what shares work among processes, as of `workers.crew`; None: there is this one.

    Raises:
        LogError: a log is shorter than its filter. ConfigError: the filter cannot be.
    """
    if not any(isinstance(log.segments, Spans) for log in logs):
        return replace(preprocess.prepare(logs, spec, joints), mapped=mapped)
    share = mapped or (lambda work, arguments: (work(*each) for each in arguments))
    places = [
        _place(log, number, k, spec, joints)
        for number, log in enumerate(logs)
        for k in range(len(log.segments))
    ]
    threshold = _standstill(spec, places, share)
    stuck, passed = np.zeros(len(joints), dtype=bool), None
    while passed is None:
        passed = _passed(places, share, threshold, stuck, logs, joints)
        if spec.standstill == "auto" and (none := passed.counted == 0).any() and not stuck.any():
            stuck, passed = none, None  # no row of these is left: they have again what they had
    rest = ROUNDING * passed.fastest
    never = never_moved(passed.low, passed.high, passed.noise) | stuck
    still = tuple(joint for joint, stays in zip(joints, never) if stays)
    masked = any(one.mask is not None for one in passed.seen)
    makers = [
        _Made(place, one.before, one.mask, masked, rest)
        for place, one in zip(passed.places, passed.seen)
    ]
    outlines = tuple(replace(one.outline, rest=rest) for one in passed.seen)
    pieces = Pieces(makers, outlines, passed.extent, masked)
    events = tuple(event for log in logs for event in log.events)
    left_out = passed.left_out if masked else np.zeros(len(joints), dtype=int)
    unused = preprocess.unused_of(logs)
    return Motion(
        joints, pieces, still, passed.standing(), left_out, events, passed.disturbed,
        unused=unused, mapped=mapped,
    )  # fmt: skip


def margin(spec: PreprocessSpec, step: float) -> int:
    """How many rows beyond a span decide about what is in it: of the filters, of a recursive one
    until nothing is left, and of what leaves rows out about reversals."""
    sides = on_both_sides(spec, step)
    return 8 * needs(spec, step) + (0 if sides is None else 2 * sides.reach) + 64


@dataclass(frozen=True)
class _Place:
    """A span of a log, or a segment of a short one, and how it becomes a piece, in whichever
    process: `k` is its number among the segments of `log`, which may be a part of that of this
    number."""

    log: Log
    number: int
    k: int
    spec: PreprocessSpec
    joints: tuple[str, ...]

    def filtered(self) -> Piece | None:
        """A piece whose rows all count but for those that events reach; None where it is too
        short."""
        released()
        segments = self.log.segments
        step = segments.step(self.k) if isinstance(segments, Spans) else segments[self.k].step
        own = around(segments, self.k, margin(self.spec, step))
        piece = piece_of(self.number, self.log, own, self.spec, self.joints)
        released()
        return piece


def _place(log: Log, number: int, k: int, spec: PreprocessSpec, joints) -> _Place:
    step = log.segments.step(k) if isinstance(log.segments, Spans) else log.segments[k].step
    segments, own = carried(log.segments, k, margin(spec, step))
    return _Place(replace(log, segments=segments), number, own, spec, joints)


@dataclass(frozen=True)
class _Made:
    """Makes the piece of a place: which rows count, and did before those were left out that both
    sides of the equation would see, is known by then."""

    place: _Place
    before: bytes | None
    mask: bytes | None
    masked: bool
    rest: np.ndarray

    def __call__(self) -> Piece:
        own, spec = self.place.filtered(), self.place.spec
        if spec.torque == "low-pass" and spec.filter != "none":
            own = under_lowpass(replace(own, use=_unpacked(self.before, own.q.shape)), spec)
        use = None
        if self.masked:
            use = _unpacked(self.mask, own.q.shape)
            use = np.ones(own.q.shape, dtype=bool) if use is None else use
        return replace(own, use=use, rest=self.rest)


def _standstill(spec: PreprocessSpec, places, share: Mapped) -> np.ndarray | float | None:
    """The speed (dof,) below which rows are left out, where the experiment asks for one of the
    whole motion."""
    if spec.standstill == "keep" or (spec.standstill == "auto" and spec.filter != "none"):
        return None
    if not isinstance(spec.standstill, str):
        return spec.standstill
    squares, rows = 0.0, 0
    for own in share(_speeds, ((place,) for place in places)):
        if own is not None:
            squares, rows = squares + own[0], rows + own[1]
    return standstill.slow(squares / max(rows, 1))


def _speeds(place: _Place) -> tuple[np.ndarray, int] | None:
    """Sum (dof,) of squared speeds, and how many rows there are."""
    if (piece := place.filtered()) is None:
        return None
    return np.sum(piece.qd[piece.core] ** 2, axis=0), piece.samples


@dataclass(frozen=True)
class _Seen:
    """What the first pass sees of one place: see `_passed`."""

    outline: Piece
    mask: bytes | None
    before: bytes | None
    reach: Reach
    fastest: np.ndarray
    low: np.ndarray
    high: np.ndarray
    noise: np.ndarray
    squares: np.ndarray
    slow: np.ndarray
    counted: np.ndarray
    left_out: np.ndarray
    lost: int
    rows: int


def _seen(
    place: _Place, threshold, stuck: np.ndarray, counts: np.ndarray, stride: int
) -> _Seen | None:
    if (piece := place.filtered()) is None:
        return None
    spec, rows = place.spec, piece.samples
    lost = 0 if piece.use is None else int(np.sum(~piece.use[piece.core]))
    had = True if piece.use is None else piece.use
    piece = preprocess.without_still_rows(piece, spec, threshold)
    if stuck.any():
        piece = replace(piece, use=(True if piece.use is None else piece.use) | (stuck & had))
    before, squares = _packed(piece.use), np.sum(piece.qd[piece.core] ** 2, axis=0)
    if spec.torque == "low-pass" and spec.filter != "none":
        piece = under_lowpass(piece, spec)
    if not counts.all():
        use = np.ones(piece.q.shape, dtype=bool) if piece.use is None else piece.use
        piece = replace(piece, use=counts & use)
    core, use, dof = piece.core, piece.use, len(counts)
    slow = np.zeros((dof, len(_SLOW) - 1), dtype=int)
    for j, own in enumerate(np.abs(piece.qd[core]).T):
        own = own if use is None else own[use[core, j]]
        slow[j] = np.histogram(own[own < _SLOW[-1]], _SLOW)[0]
    counted = np.full(dof, piece.samples) if use is None else np.sum(use[core], axis=0)
    left_out = np.zeros(dof, dtype=int) if use is None else np.sum(~use[core], axis=0)
    q = piece.q[core]
    return _Seen(
        piece.outline(), _packed(use), before, reach_of(piece, stride),
        np.abs(piece.qd).max(axis=0), q.min(0), q.max(0), piece.noise, squares, slow, counted,
        left_out, lost, rows,
    )  # fmt: skip


@dataclass
class _Passed:
    """What one pass over the places tells: those that are no shorter than a filter, and sums over
    them."""

    places: list[_Place]
    seen: list[_Seen]
    extent: Extent
    slow: np.ndarray

    def __post_init__(self) -> None:
        every = lambda name: [getattr(one, name) for one in self.seen]  # noqa: E731
        self.low, self.high = np.min(every("low"), axis=0), np.max(every("high"), axis=0)
        self.fastest, self.noise = (np.max(every(name), axis=0) for name in ("fastest", "noise"))
        self.counted, self.left_out = (sum(every(name)) for name in ("counted", "left_out"))
        self.disturbed = sum(every("lost")) / max(sum(every("rows")) * len(self.low), 1)

    def standing(self) -> np.ndarray:
        """Share (dof,) of the rows that count in which each joint stands still."""
        samples = sum(one.outline.samples for one in self.seen)
        speed = standstill.slow(sum(one.squares for one in self.seen) / max(samples, 1))
        slow = [
            np.interp(s, _SLOW, np.concatenate([[0], np.cumsum(own)]))
            for s, own in zip(speed, self.slow)
        ]
        return np.array(slow) / np.maximum(self.counted, 1)


def _passed(places, share: Mapped, threshold, stuck, logs, joints) -> _Passed:
    extent, unused = Extent(sum(log.samples for log in logs)), preprocess.unused_of(logs)
    counts = np.array([joint not in unused for joint in joints])
    many, kept, seen, slow = np.zeros(len(logs), dtype=int), [], [], 0
    work = ((place, threshold, stuck, counts, extent.stride) for place in places)
    for place, one in zip(places, share(_seen, work)):
        if one is None:
            continue
        many[place.number] += 1
        extent.take(one.reach, goes_on=bool(kept) and kept[-1].number == place.number)
        kept.append(place)
        slow = slow + one.slow
        seen.append(replace(one, slow=_NONE))  # large beside what else is kept of a place
    for log, count in zip(logs, many):
        if not count:
            window = needs(places[0].spec, log.segments[0].step)
            raise LogError(
                f"{log.samples} samples are fewer than the filter's window of {window}",
                where=str(log.path), do="give a longer log or narrow preprocess.window",
            )  # fmt: skip
        if dropped := len(log.segments) - count:
            said = f"{dropped} segment(s) shorter than the filter's window were left out"
            warn(f"{log.path}: {said}")
    return _Passed(kept, seen, extent, slow)


def _packed(use) -> bytes | None:
    """Which rows count, in a hundredth of their size: they do and do not in long runs."""
    return None if use is None else zlib.compress(np.packbits(use.T).tobytes(), 1)


def _unpacked(packed: bytes | None, shape: tuple[int, int]) -> np.ndarray | None:
    if packed is None:
        return None
    bits = np.unpackbits(
        np.frombuffer(zlib.decompress(packed), dtype=np.uint8), count=shape[0] * shape[1]
    )
    return bits.reshape(shape[::-1]).T.astype(bool)
