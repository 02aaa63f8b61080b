"""Log -> Motion: position, velocity, acceleration and torque, in contiguous pieces.

Savitzky-Golay takes q, qd and qdd from one and the same fitted polynomial and leaves torque alone, as the paper
does. A zero-phase Butterworth filters the angle once and takes central differences of it. With `torque: same`
the filter that the angles saw also goes over torque and over every column that is not a smooth function of
the filtered motion, so that both sides of the equation of motion see one filter. With `torque: low-pass` that is a low-pass of
its own, at `cutoff`: the noise of derivatives grows with frequency, and far beyond the motion's band there is nothing else.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .errors import ConfigError, LogError
from .events import Event, mended, usable, with_clock
from .gaussian import HIGHEST, Gaussian
from .log import Log
from .motion import Motion, Piece, never_move
from .segment import Segment
from .smoother import Smoother
from .specs import PreprocessSpec
from .standstill import clear_of_reversals, standstill_speed, turns, without_standstill
from .warned import warn

_MOST = 0.5  # of the weight that a low-pass has
_KEPT_A_CYCLE = 8.0  # rows a cycle of a low-pass: what it lets through at half as many is 0.4 %
ROUNDING = 1e-9  # share of a joint's top speed that is none


def prepare(logs: Sequence[Log], spec: PreprocessSpec, joints: tuple[str, ...]) -> Motion:
    """Filter logs into a Motion. `spec.window` and `spec.cutoff` must be numbers here, not `auto`.

    Raises:
        LogError: a log is shorter than its filter. ConfigError: the filter cannot be.
    """
    pieces = []
    for number, log in enumerate(logs):
        before = len(pieces)
        for segment in log.segments:
            if (piece := piece_of(number, log, segment, spec, joints)) is not None:
                pieces.append(piece)
        if len(pieces) == before:
            shortest = needs(spec, log.segments[0].step) if log.segments else 2
            raise LogError(f"{log.samples} samples are fewer than the filter's window of {shortest}", where=str(log.path), do="give a longer log or narrow preprocess.window")
        if dropped := len(log.segments) - (len(pieces) - before):
            warn(f"{log.path}: {dropped} segment(s) shorter than the filter's window were left out")
    disturbed, stuck = share_left_out(pieces), False
    if spec.standstill == "auto":
        pieces, stuck = _with_rows(clear_of_reversals(pieces, spec), pieces)
    elif spec.standstill != "keep":
        threshold = standstill_speed(pieces) if spec.standstill == "mask" else spec.standstill
        pieces = [without_standstill(piece, threshold, 0 if piece.smoother is None else piece.smoother.reach) for piece in pieces]
    if spec.torque == "low-pass" and spec.filter != "none":
        pieces = [under_lowpass(piece, spec) for piece in pieces]
    events = tuple(event for log in logs for event in log.events)
    return replace(assembled(joints, pieces, stuck, unused_of(logs)), events=events, disturbed=disturbed)


def piece_of(number: int, log: Log, segment: Segment, spec: PreprocessSpec, joints: tuple[str, ...]) -> Piece | None:
    """A segment of a log filtered, without the rows that the log's events reach; None where it is shorter than the filter."""
    clean = replace(segment, tau=mended(segment, log.events, joints)) if log.events else segment
    if (piece := _piece(number, clean, spec)) is None:
        return None
    own = replace(piece, source=log.name, levels=log.levels)
    return without_events(own, with_clock(log.events, segment), joints, *_reaches(spec, segment.step)) if log.events else own


def without_still_rows(piece: Piece, spec: PreprocessSpec, threshold) -> Piece:
    """The piece without the rows that `standstill` leaves out.

    Args:
        threshold: (dof,) or a number, of a standstill [rad/s or m/s], where it is one of the whole motion.
    """
    if spec.standstill == "keep":
        return piece
    if spec.standstill != "auto":
        return without_standstill(piece, threshold, 0 if piece.smoother is None else piece.smoother.reach)
    if spec.filter == "none":
        return without_standstill(piece, np.where(turns(piece.qd), np.inf, threshold), 0)
    return clear_of_reversals([piece], spec)[0]


def unused_of(logs: Sequence[Log]) -> tuple[str, ...]:
    """The joints of which the torque is not used."""
    return tuple(dict.fromkeys(joint for log in logs for joint in log.unused))


def assembled(joints: tuple[str, ...], pieces: Sequence[Piece], stuck=False, unused: tuple[str, ...] = ()) -> Motion:
    """Pieces as one motion, which knows the speed that rounding makes of a constant angle and the joints that never move.

    Args:
        stuck: (dof,) bool, joints that are known not to. unused: joints no row of which counts.
    """
    if unused:
        counts = np.array([joint not in unused for joint in joints])
        pieces = [replace(p, use=counts & (np.ones(p.q.shape, dtype=bool) if p.use is None else p.use)) for p in pieces]
    rest = ROUNDING * np.max([np.abs(piece.qd).max(axis=0) for piece in pieces], axis=0)
    never = never_move(pieces) | stuck
    still = tuple(joint for joint, stays in zip(joints, never) if stays)
    if any(piece.use is not None for piece in pieces):
        pieces = [replace(p, use=np.ones(p.q.shape, dtype=bool)) if p.use is None else p for p in pieces]
    left_out = sum(_left_out(piece) for piece in pieces)
    return Motion(joints, tuple(replace(piece, rest=rest) for piece in pieces), still, standing(pieces), left_out, unused=unused)


def _left_out(piece: Piece) -> np.ndarray:
    return np.zeros(piece.q.shape[1], dtype=int) if piece.use is None else np.sum(~piece.use[piece.core], axis=0)


def _with_rows(pieces: Sequence[Piece], before: Sequence[Piece]) -> tuple[list[Piece], np.ndarray]:
    """The pieces, a joint of which no row is left with the rows again that it had before, and which (dof,) those joints are.

    Such a joint says nothing of its friction, which is then held; its torque is all that its rows can show.
    """
    stuck = sum(piece.use[piece.core].sum(axis=0) for piece in pieces) == 0
    had = [True if piece.use is None else piece.use for piece in before]
    return [replace(piece, use=piece.use | (stuck & own)) for piece, own in zip(pieces, had)], stuck


def on_both_sides(spec: PreprocessSpec, step: float) -> Smoother | Gaussian | None:
    """The filter that goes over torque and over what is predicted, None where torque is as logged."""
    if spec.filter == "none" or spec.torque == "raw":
        return None
    if spec.torque == "same":
        return Smoother(spec, step)
    cutoff = min(spec.cutoff, HIGHEST / step)
    return Gaussian(cutoff, step, every=max(1, int(1.0 / (_KEPT_A_CYCLE * cutoff * step))))


def needs(spec: PreprocessSpec, step: float) -> int:
    """How many rows a log must have for the filter's window."""
    sides = on_both_sides(spec, step)
    return 2 * Smoother(spec, step).reach + (0 if sides is None else 2 * sides.reach) + 1


def _piece(number: int, segment: Segment, spec: PreprocessSpec) -> Piece | None:
    smoother = Smoother(spec, segment.step)
    if len(segment.t) < needs(spec, segment.step):
        return None
    if spec.filter == "none":
        q, qd, qdd = unfiltered(segment)
    else:
        q, qd, qdd = smoother.differentiate(segment.q)
    edge = smoother.reach
    rows = slice(edge, len(segment.t) - edge)
    sides = smoother if spec.torque == "same" and spec.filter != "none" else None  # a low-pass comes last
    tau = segment.tau if sides is None else sides(segment.tau)
    n = rows.stop - rows.start
    margin = 0 if sides is None else sides.reach
    core = slice(margin, n - margin)
    if segment.core is not None:  # of a span, what is its own
        core = slice(max(core.start, segment.core.start - edge), min(core.stop, segment.core.stop - edge))
    return Piece(
        log=number, step=segment.step, t=segment.t[rows], q=q[rows], qd=qd[rows], qdd=qdd[rows], tau=tau[rows],
        measured=segment.tau[rows], signals={name: values[rows] for name, values in segment.signals.items()}, use=None,
        smoother=sides, core=core, rest=np.zeros(q.shape[1]),
        noise=np.sqrt(np.mean((segment.q[rows] - q[rows]) ** 2, axis=0)), sight=None if sides is not None or spec.filter == "none" else smoother, clock=segment.spread,
    )  # fmt: skip


def unfiltered(segment: Segment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle, speed and acceleration (n, dof) as logged. Raises ConfigError where these are not."""
    if segment.qd is None or segment.qdd is None:
        raise ConfigError("preprocess.filter is none and velocity or acceleration was not logged", allowed="savitzky-golay, butterworth, or data.columns.velocity and .acceleration", do="choose a filter")
    return segment.q, segment.qd, segment.qdd


def _reaches(spec: PreprocessSpec, step: float) -> tuple[float, float]:
    """Seconds to either side that a row sees of the angles and of the torque; a filtered column sees filtered angles."""
    reach = Smoother(spec, step).reach * step
    both = spec.torque == "same" and spec.filter != "none"
    return (2.0 * reach, reach) if both else (reach, 0.0)


def without_events(piece: Piece, events: Sequence[Event], joints: Sequence[str], angles: float, torque: float) -> Piece:
    """The piece without the rows that its log's events reach, whose angles and torque were seen over so many seconds to either side."""
    use = usable(piece.t, joints, events, angles=angles, torque=torque)
    if piece.use is not None:
        use &= piece.use
    return piece if use.all() else replace(piece, use=use)


def share_left_out(pieces: Sequence[Piece]) -> float:
    """The share of all joints' rows that does not count."""
    lost = sum(0 if p.use is None else np.sum(~p.use[p.core]) for p in pieces)
    return float(lost / sum(p.samples * p.q.shape[1] for p in pieces))


def under_lowpass(piece: Piece, spec: PreprocessSpec) -> Piece:
    """The piece with a low-pass on both sides. Rows that do not count are seen by no other: what the low-pass averages are the rows
    that do, and its weight rises from nothing beside the others within the angles' own window, as an edge would let their noise in.
    A row counts where most of what is seen about it does.

    Source: weights that vanish at the ends, Shinbrot 1957 (modulating functions).
    """
    sides, n = on_both_sides(spec, piece.step), len(piece.t)
    weight = None
    if piece.use is not None and not piece.use.all():
        weight = np.sin(0.5 * np.pi * np.minimum(_apart(piece.use) * piece.step / spec.window, 1.0)) ** 2
    out = replace(piece, smoother=sides, weight=weight, core=slice(max(piece.core.start, sides.reach), min(piece.core.stop, n - sides.reach)), sight=None)
    whole = slice(0, n)
    tau = np.stack([out.settled(own, whole, j) for j, own in enumerate(piece.tau.T)], axis=1)
    use = None if weight is None else sides(weight, axis=0) > _MOST
    return replace(out, tau=tau, use=use)


def _apart(use) -> np.ndarray:
    """How many rows (n, dof) each is from one that does not count."""
    number = np.arange(len(use), dtype=float)[:, None]
    before = np.maximum.accumulate(np.where(use, -np.inf, number), axis=0)
    after = np.minimum.accumulate(np.where(use, np.inf, number)[::-1], axis=0)[::-1]
    return np.minimum(number - before, after - number)


def standing(pieces) -> np.ndarray:
    """Share (dof,) of the rows that count in which each joint stands still."""
    speed = standstill_speed(pieces)
    counted = rows = np.zeros(len(speed))
    for piece in pieces:
        use = True if piece.use is None else piece.use[piece.core]
        slow = np.abs(piece.qd[piece.core]) < speed
        counted = counted + np.sum(slow & use, axis=0)
        rows = rows + (piece.samples if piece.use is None else np.sum(use, axis=0))
    return counted / np.maximum(rows, 1)
