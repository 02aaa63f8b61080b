"""Long logs -> Motion, span by span: memory does not grow with them.

A first pass finds what no span says by itself (a joint's top speed, whether it moves at all, how
much of it stands still), and which rows count; after it a piece is filtered again whenever it is
asked for. Each is what it would be of the log as one, as a span is read with as many rows of its
neighbours as all filters see.
"""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import preprocess
from .errors import LogError, SysidWarning
from .extent import Extent
from .log import Log
from .motion import Motion, Piece, Pieces, never_moved
from .preprocess import ROUNDING, needs, on_both_sides, piece_of, under_lowpass
from .spans import Spans, around, released
from .specs import PreprocessSpec

_SLOW = np.concatenate(
    [[0.0], np.geomspace(1e-9, preprocess.STANDSTILL_MOST, 4096)]
)  # rad/s or m/s, edges of bins


def prepare(logs: Sequence[Log], spec: PreprocessSpec, joints: tuple[str, ...]) -> Motion:
    """As `preprocess.prepare`; of long logs the pieces are made whenever they are asked for.

    How much of a joint stands still is counted in 4096 classes of speed.

    Raises:
        LogError: a log is shorter than its filter. ConfigError: the filter cannot be.
    """
    if not any(isinstance(log.segments, Spans) for log in logs):
        return preprocess.prepare(logs, spec, joints)
    places = [(number, k) for number, log in enumerate(logs) for k in range(len(log.segments))]
    made = lambda number, k: _filtered(logs[number], number, k, spec, joints)  # noqa: E731
    threshold = _standstill(spec, places, made)
    stuck, passed = np.zeros(len(joints), dtype=bool), None
    while passed is None:
        passed = _passed(places, made, spec, threshold, stuck, logs, joints)
        if spec.standstill == "auto" and (none := passed.counted == 0).any() and not stuck.any():
            stuck, passed = none, None  # no row of these is left: they have again what they had
    unused = preprocess.unused_of(logs)
    rest = ROUNDING * passed.fastest
    never = never_moved(passed.low, passed.high, passed.noise) | stuck
    still = tuple(joint for joint, stays in zip(joints, never) if stays)
    masked = any(mask is not None for mask in passed.masks)

    def piece(number: int) -> Piece:
        released()
        own, mask = made(*passed.places[number]), passed.masks[number]
        if spec.torque == "low-pass" and spec.filter != "none":
            own = under_lowpass(
                replace(own, use=_unpacked(passed.before[number], own.q.shape)), spec
            )
        use = (
            None
            if not masked
            else np.ones(own.q.shape, dtype=bool)
            if mask is None
            else _unpacked(mask, own.q.shape)
        )
        return replace(own, use=use, rest=rest)

    pieces = Pieces(
        piece,
        tuple(replace(outline, rest=rest) for outline in passed.outlines),
        passed.extent,
        masked,
    )
    events = tuple(event for log in logs for event in log.events)
    left_out = passed.left_out if masked else np.zeros(len(joints), dtype=int)
    return Motion(
        joints, pieces, still, passed.standing(), left_out, events, passed.disturbed, unused=unused
    )


def margin(spec: PreprocessSpec, step: float) -> int:
    """How many rows beyond a span decide about what is in it: of the filters, of a recursive one
    until nothing is left, and of what leaves rows out about reversals."""
    sides = on_both_sides(spec, step)
    return 8 * needs(spec, step) + (0 if sides is None else 2 * sides.reach) + 64


def _filtered(log: Log, number: int, k: int, spec: PreprocessSpec, joints) -> Piece | None:
    """A span as a piece whose rows all count but for those that events reach; None where it is too
    short."""
    step = log.segments.step(k) if isinstance(log.segments, Spans) else log.segments[k].step
    return piece_of(number, log, around(log.segments, k, margin(spec, step)), spec, joints)


def _standstill(spec: PreprocessSpec, places, made: Callable) -> np.ndarray | float | None:
    """The speed (dof,) below which rows are left out, where the experiment asks for one of the
    whole motion."""
    if spec.standstill == "keep" or (spec.standstill == "auto" and spec.filter != "none"):
        return None
    if not isinstance(spec.standstill, str):
        return spec.standstill
    squares, rows = 0.0, 0
    for place in places:
        if (piece := made(*place)) is not None:
            squares, rows = (
                squares + np.sum(piece.qd[piece.core] ** 2, axis=0),
                rows + piece.samples,
            )
    return preprocess.slow(squares / max(rows, 1))


@dataclass
class _Passed:
    """What one pass over the pieces tells: see `_passed`."""

    places: list
    outlines: list
    masks: list
    before: list
    extent: Extent
    fastest: np.ndarray
    low: np.ndarray
    high: np.ndarray
    noise: np.ndarray
    squares: np.ndarray
    slow: np.ndarray
    counted: np.ndarray
    left_out: np.ndarray
    lost: int = 0
    samples: int = 0
    rows: int = 0

    @property
    def disturbed(self) -> float:
        return float(self.lost / max(self.rows * len(self.low), 1))

    def standing(self) -> np.ndarray:
        """Share (dof,) of the rows that count in which each joint stands still."""
        speed = preprocess.slow(self.squares / max(self.samples, 1))
        slow = [
            np.interp(s, _SLOW, np.concatenate([[0], np.cumsum(own)]))
            for s, own in zip(speed, self.slow)
        ]
        return np.array(slow) / np.maximum(self.counted, 1)


def _passed(
    places, made: Callable, spec: PreprocessSpec, threshold, stuck, logs, joints
) -> _Passed:
    dof = len(joints)
    zero = lambda kind=float: np.zeros(dof, dtype=kind)  # noqa: E731
    out = _Passed(
        [],
        [],
        [],
        [],
        Extent(sum(log.samples for log in logs)),
        zero(),
        np.full(dof, np.inf),
        np.full(dof, -np.inf),
        zero(),
        zero(),
        np.zeros((dof, len(_SLOW) - 1), dtype=int),
        zero(int),
        zero(int),
    )
    unused = preprocess.unused_of(logs)
    counts = np.array([joint not in unused for joint in joints])
    many = np.zeros(len(logs), dtype=int)
    for place in places:
        piece = None
        released()
        if (piece := made(*place)) is None:
            continue
        many[place[0]] += 1
        out.lost += 0 if piece.use is None else int(np.sum(~piece.use[piece.core]))
        out.rows += piece.samples
        had = True if piece.use is None else piece.use
        piece = preprocess.without_still_rows(piece, spec, threshold)
        if stuck.any():
            piece = replace(piece, use=(True if piece.use is None else piece.use) | (stuck & had))
        out.before.append(_packed(piece.use))
        out.squares += np.sum(piece.qd[piece.core] ** 2, axis=0)
        if spec.torque == "low-pass" and spec.filter != "none":
            piece = under_lowpass(piece, spec)
        if unused:
            piece = replace(
                piece,
                use=counts
                & (np.ones(piece.q.shape, dtype=bool) if piece.use is None else piece.use),
            )
        out.extent.add(piece, goes_on=bool(out.places) and out.places[-1][0] == place[0])
        core, use = piece.core, piece.use
        out.fastest = np.maximum(out.fastest, np.abs(piece.qd).max(axis=0))
        out.low, out.high = (
            np.minimum(out.low, piece.q[core].min(0)),
            np.maximum(out.high, piece.q[core].max(0)),
        )
        out.noise = np.maximum(out.noise, piece.noise)
        for j, own in enumerate(np.abs(piece.qd[core]).T):
            own = own if use is None else own[use[core, j]]
            out.slow[j] += np.histogram(own[own < _SLOW[-1]], _SLOW)[0]
        out.counted += piece.samples if use is None else np.sum(use[core], axis=0)
        out.left_out += 0 if use is None else np.sum(~use[core], axis=0)
        out.samples += piece.samples
        out.masks.append(_packed(use))
        out.places.append(place)
        out.outlines.append(piece.outline())
    for log, count in zip(logs, many):
        if not count:
            window = needs(spec, log.segments[0].step)
            raise LogError(
                f"{log.samples} samples are fewer than the filter's window of {window}",
                where=str(log.path), do="give a longer log or narrow preprocess.window",
            )  # fmt: skip
        if dropped := len(log.segments) - count:
            said = f"{dropped} segment(s) shorter than the filter's window were left out"
            warnings.warn(SysidWarning(f"{log.path}: {said}"), stacklevel=2)
    return out


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
