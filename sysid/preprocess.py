"""Log -> Motion: position, velocity, acceleration and torque, in contiguous pieces.

Savitzky-Golay takes q, qd and qdd from one and the same fitted polynomial and leaves torque alone, as the paper
does. A zero-phase Butterworth filters the angle once and takes central differences of it. With `torque: same`
the filter that the angles saw also goes over torque and over every column that is not a smooth function of
the filtered motion, so that both sides of the equation of motion see one filter.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .config import PreprocessSpec
from .errors import ConfigError, LogError, SysidWarning
from .events import Event, mended, usable
from .jumps import jumps
from .log import Log, Segment

# `standstill: mask` leaves a joint's rows out below this share of its own rms speed, at most 0.03 rad/s or m/s:
# there friction is whatever balances the rest.
_STANDSTILL_SHARE, _STANDSTILL_MOST = 0.05, 0.03
# A joint never moves where its filtered angle travels less than its own noise would make it, or than this [rad or m].
_NEVER_MOVES, _NOISE_TRAVEL = 1e-6, 6.0
_ROUNDING = 1e-9  # share of a joint's top speed that is none
# `standstill: auto` goes so far from a reversal that this share is left of the squared error which the angles' filter makes of
# a jump in acceleration: 3 % of its RMS.
_LEFT_OF_A_JUMP = 1e-3


def savitzky_golay(length: int, order: int, derivative: int, step: float) -> np.ndarray:
    """Weights (length,) that give the middle value, or a derivative there, of the polynomial fitted to a window.

    The same numbers as scipy.signal's, which works in powers of sample numbers, keeps nine digits of order 4 over 101
    samples and none of order 9 over 401, and whose import alone would take a quarter of a fit.

    Source: Savitzky & Golay 1964.
    """
    half = length // 2
    u = np.arange(-half, half + 1) / half  # on [-1, 1], where powers stay apart
    rows = np.linalg.pinv(np.vander(u, order + 1, increasing=True))
    return rows[derivative] * math.factorial(derivative) / (half * step) ** derivative


def differences(q, step: float) -> tuple[np.ndarray, np.ndarray]:
    """qd, qdd (n, dof) of angles (n, dof) `step` seconds apart, by central differences; not to be used in the first and last row."""
    qdd = np.zeros_like(q)
    qdd[1:-1] = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / step**2
    return np.gradient(q, step, axis=0), qdd


def _convolved(values, weights) -> np.ndarray:
    """Values (n, ...) weighted by a window about each; the first and last half window are not to be used."""
    flat = values.reshape(len(values), -1)
    out = np.empty(flat.shape)
    for k in range(flat.shape[1]):
        out[:, k] = np.convolve(flat[:, k], weights[::-1], mode="same")
    return out.reshape(values.shape)


class Smoother:
    """A linear, zero-phase filter over samples, with the reach [samples] of its memory."""

    def __init__(self, spec: PreprocessSpec, step: float):
        self.kind, self.order, self.step = spec.filter, spec.order, step
        if self.kind == "savitzky-golay":
            self.length = 2 * round(spec.window / (2.0 * step)) + 1
            if self.length <= self.order:
                raise ConfigError(
                    f"preprocess.window of {spec.window:g} s is {self.length} samples at {1 / step:.4g} Hz",
                    allowed=f"more than order = {self.order} samples, {(self.order + 1) * step:.3g} s", do="widen the window",
                )  # fmt: skip
            self.reach = self.length // 2
        elif self.kind == "butterworth":
            if spec.cutoff >= 0.5 / step:
                raise ConfigError(f"preprocess.cutoff of {spec.cutoff:g} Hz at {1 / step:.4g} Hz sampling", allowed=f"below {0.5 / step:.4g} Hz")
            from scipy.signal import butter

            self.sections = butter(self.order, spec.cutoff, fs=1.0 / step, output="sos")
            # five time constants of the slowest pole: what is left of an edge is below one per cent
            slowest = 2.0 * math.pi * spec.cutoff * math.sin(math.pi / (2 * self.order))
            self.reach = max(1, math.ceil(5.0 / (slowest * step)))
        else:
            self.reach = 0

    def smear(self, both: bool) -> tuple[int, float]:
        """What the filter makes of a joint's reversal: how far it carries it [samples], and the speed of a stop [s].

        Friction changes sign with the speed and torque does not, so the acceleration jumps where qd = 0, which the filter
        spreads. By M(q) dqdd = e_j jump it is joint j's own torque alone that this bends. Of an angle whose speed falls
        to zero and rises again, qd = a |t|, the filter makes a speed that is never below a times the second number.

        Args:
            both: whether the filter also goes over torque and over what is predicted.
        """
        if not self.reach:
            return 0, 0.0
        t = self.step * np.arange(-6 * self.reach, 6 * self.reach + 1)[:, None]
        middle = slice(3 * self.reach, -3 * self.reach)
        _, qd, qdd = self.differentiate(0.5 * np.maximum(t, 0.0) ** 2)
        error = qdd - np.heaviside(t, 0.5)
        square = (self(error) if both else error)[middle, 0] ** 2
        half = len(square) // 2
        # by distance from the jump
        beyond = np.cumsum(np.append(square[half], square[half + 1 :] + square[half - 1 :: -1])[::-1])[::-1]
        most = _LEFT_OF_A_JUMP * np.sum(error[middle] ** 2)
        return int(np.count_nonzero(beyond > most)), 2.0 * abs(float(qd[len(t) // 2, 0]))

    def differentiate(self, q) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """q, qd, qdd (n, dof) of measured angles (n, dof); the first and last `reach` rows are not to be used."""
        if self.kind == "savitzky-golay":
            q0, q1, q2 = (_convolved(q, savitzky_golay(self.length, self.order, d, self.step)) for d in range(3))
            return q0, q1, q2
        smooth = self(q)
        return smooth, *differences(smooth, self.step)

    def smoothed(self, values) -> np.ndarray:
        """Values (n,) filtered to their very ends, beyond which they go on as they came."""
        reach = min(self.reach, len(values) - 1)
        if reach < 1:
            return np.array(values)
        return self(np.pad(values, reach, mode="reflect", reflect_type="odd"))[reach:-reach]

    def __call__(self, values, axis: int = 0) -> np.ndarray:
        """The filtered values, same shape; samples along `axis`."""
        if self.kind == "savitzky-golay":
            weights = savitzky_golay(self.length, self.order, 0, self.step)
            return np.moveaxis(_convolved(np.moveaxis(values, axis, 0), weights), 0, axis)
        if self.kind == "butterworth":
            from scipy.signal import sosfiltfilt

            return sosfiltfilt(self.sections, values, axis=axis)
        return values

    def at(self, values, rows: slice) -> np.ndarray:
        """The filtered values (..., n) at some rows of the last axis."""
        return self(values, axis=-1)[..., rows]


@dataclass(frozen=True)
class Piece:
    """A contiguous stretch of motion, every row usable.

    log, source: number and name of the log. t (n,) [s]; q, qd, qdd (n, dof); tau (n, dof) as the fit sees it, `measured` as logged; signals {name: (n,)}; `use` (n, dof) bool, None where every row counts.
    `smoother` filters columns where torque was filtered, else None; then `margin` extra rows stand before and
    after `core`, whose filtered values the filter needs but which are not used. `rest` (dof,) [rad/s or m/s] is the
    speed that rounding makes of a constant angle; `noise` (dof,) [rad or m] what the filter took off the angles, RMS, or an
    estimate of their noise from that. `sight` is the filter that the angles were seen through, where it matters: torque was not.

    What a model adds: `load` (n, dof) the torque that its bodies alone need; `gravity` (3,) or None for the robot's own;
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
    sight: Smoother | None = None
    load: np.ndarray | None = None
    gravity: np.ndarray | None = None
    deflection: np.ndarray | None = None

    def direction(self, joint: int) -> np.ndarray:
        """sign(qd) (n,) of a joint, zero where the filter of a constant angle leaves nothing but rounding."""
        qd = self.qd[:, joint]
        return np.where(np.abs(qd) > self.rest[joint], np.sign(qd), 0.0)

    def part(self, rows: slice) -> "Piece":
        """The rows `rows`, without margins."""
        return replace(
            self, t=self.t[rows], q=self.q[rows], qd=self.qd[rows], qdd=self.qdd[rows], tau=self.tau[rows],
            measured=self.measured[rows], signals={name: values[rows] for name, values in self.signals.items()},
            use=None if self.use is None else self.use[rows], core=slice(0, len(self.t[rows])),
            load=None if self.load is None else self.load[rows],
            deflection=None if self.deflection is None else self.deflection[:, rows],
        )  # fmt: skip

    @property
    def samples(self) -> int:
        """Number of usable rows."""
        return self.core.stop - self.core.start


@dataclass(frozen=True)
class Motion:
    """What identification works on: pieces of motion of the same joints.

    still: joints that never move, or never clear of a standstill. standing (dof,): share of the rows that count in which
    a joint stands still. left_out (dof,): rows that do not count.
    events: what disturbed the logs; `disturbed` the share of all joints' rows that is left out for it.
    band: [Hz] below which the joints' speeds stay, where it was asked for, else zero.
    """

    joints: tuple[str, ...]
    pieces: tuple[Piece, ...]
    still: tuple[str, ...]
    standing: np.ndarray
    left_out: np.ndarray
    events: tuple[Event, ...] = ()
    disturbed: float = 0.0
    band: float = 0.0

    @property
    def samples(self) -> int:
        """Number of usable rows over all pieces."""
        return sum(piece.samples for piece in self.pieces)

    @property
    def duration(self) -> float:
        """Seconds of motion over all pieces."""
        return sum(piece.samples * piece.step for piece in self.pieces)


def prepare(logs: Sequence[Log], spec: PreprocessSpec, joints: tuple[str, ...]) -> Motion:
    """Filter logs into a Motion. `spec.window` and `spec.cutoff` must be numbers here, not `auto`.

    Raises:
        LogError: a log is shorter than its filter. ConfigError: the filter cannot be.
    """
    pieces = []
    for number, log in enumerate(logs):
        before = len(pieces)
        for segment in log.segments:
            clean = replace(segment, tau=mended(segment, log.events, joints)) if log.events else segment
            if (piece := _piece(number, clean, spec)) is not None:
                own = replace(piece, source=log.name)
                pieces.append(without_events(own, log.events, joints, *_reaches(spec, segment.step)) if log.events else own)
        if len(pieces) == before:
            shortest = _needs(spec, log.segments[0].step) if log.segments else 2
            raise LogError(f"{log.samples} samples are fewer than the filter's window of {shortest}", where=str(log.path), do="give a longer log or narrow preprocess.window")
        if dropped := len(log.segments) - (len(pieces) - before):
            warnings.warn(SysidWarning(f"{log.path}: {dropped} segment(s) shorter than the filter's window were left out"), stacklevel=2)
    disturbed, stuck = share_left_out(pieces), False
    if spec.standstill == "auto":
        pieces, stuck = _with_rows(clear_of_reversals(pieces, spec), pieces)
    elif spec.standstill != "keep":
        threshold = standstill_speed(pieces) if spec.standstill == "mask" else spec.standstill
        pieces = [without_standstill(piece, threshold, 0 if piece.smoother is None else piece.smoother.reach) for piece in pieces]
    return replace(assembled(joints, pieces, stuck), events=tuple(event for log in logs for event in log.events), disturbed=disturbed)


def assembled(joints: tuple[str, ...], pieces: Sequence[Piece], stuck=False) -> Motion:
    """Pieces as one motion, which knows the speed that rounding makes of a constant angle and the joints that never move.

    Args:
        stuck: (dof,) bool, joints that are known not to.
    """
    rest = _ROUNDING * np.max([np.abs(piece.qd).max(axis=0) for piece in pieces], axis=0)
    travel = np.ptp(np.concatenate([[p.q[p.core].min(0), p.q[p.core].max(0)] for p in pieces]), axis=0)
    noise = np.max([piece.noise for piece in pieces], axis=0)
    never = (travel < np.maximum(_NEVER_MOVES, _NOISE_TRAVEL * noise)) | stuck
    still = tuple(joint for joint, stays in zip(joints, never) if stays)
    if any(piece.use is not None for piece in pieces):
        pieces = [replace(p, use=np.ones(p.q.shape, dtype=bool)) if p.use is None else p for p in pieces]
    left_out = sum(_left_out(piece) for piece in pieces)
    return Motion(joints, tuple(replace(piece, rest=rest) for piece in pieces), still, standing(pieces), left_out)


def _left_out(piece: Piece) -> np.ndarray:
    return np.zeros(piece.q.shape[1], dtype=int) if piece.use is None else np.sum(~piece.use[piece.core], axis=0)


def _with_rows(pieces: Sequence[Piece], before: Sequence[Piece]) -> tuple[list[Piece], np.ndarray]:
    """The pieces, a joint of which no row is left with the rows again that it had before, and which (dof,) those joints are.

    Such a joint says nothing of its friction, which is then held; its torque is all that its rows can show.
    """
    stuck = sum(piece.use[piece.core].sum(axis=0) for piece in pieces) == 0
    had = [True if piece.use is None else piece.use for piece in before]
    return [replace(piece, use=piece.use | (stuck & own)) for piece, own in zip(pieces, had)], stuck


def _needs(spec: PreprocessSpec, step: float) -> int:
    smoother = Smoother(spec, step)
    return (4 if spec.torque == "same" else 2) * smoother.reach + 1


def _piece(number: int, segment: Segment, spec: PreprocessSpec) -> Piece | None:
    smoother = Smoother(spec, segment.step)
    if len(segment.t) < _needs(spec, segment.step):
        return None
    if spec.filter == "none":
        if segment.qd is None or segment.qdd is None:
            raise ConfigError("preprocess.filter is none and velocity or acceleration was not logged", allowed="savitzky-golay, butterworth, or data.columns.velocity and .acceleration", do="choose a filter")
        q, qd, qdd = segment.q, segment.qd, segment.qdd
    else:
        q, qd, qdd = smoother.differentiate(segment.q)
    edge = smoother.reach
    rows = slice(edge, len(segment.t) - edge)
    both = spec.torque == "same" and spec.filter != "none"
    tau = smoother(segment.tau) if both else segment.tau
    n = rows.stop - rows.start
    margin = edge if both else 0
    return Piece(
        log=number, step=segment.step, t=segment.t[rows], q=q[rows], qd=qd[rows], qdd=qdd[rows], tau=tau[rows],
        measured=segment.tau[rows], signals={name: values[rows] for name, values in segment.signals.items()}, use=None,
        smoother=smoother if both else None, core=slice(margin, n - margin), rest=np.zeros(q.shape[1]),
        noise=np.sqrt(np.mean((segment.q[rows] - q[rows]) ** 2, axis=0)), sight=None if both or spec.filter == "none" else smoother,
    )  # fmt: skip


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


def without_standstill(piece: Piece, threshold, reach: int) -> Piece:
    """The piece without the rows where a joint is slower than its threshold (dof,) or (n, dof) [rad/s or m/s], or within `reach` rows of one.

    A filter that sees so far carries standstill into them.
    """
    still = np.abs(piece.qd) < threshold
    count = np.cumsum(np.concatenate([np.zeros((1, still.shape[1])), still]), axis=0)
    rows = np.arange(len(still))
    low, high = np.maximum(rows - reach, 0), np.minimum(rows + reach + 1, len(still))
    use = count[high] == count[low]
    return replace(piece, use=use if piece.use is None else use & piece.use)


def clear_of_reversals(pieces, spec: PreprocessSpec) -> list[Piece]:
    """The pieces without each joint's rows that the filter has bent about its reversals and jumps of its torque, or in which it
    may stand still.

    A joint may stand where its speed changes sign; where it is less than the filter makes of a stop amid accelerations as
    large as those about it; and where the angle travels less, while the filter sees it, than its own noise would make it.
    Where velocity was logged nobody knows how well: there it is as with `mask`.
    """
    if spec.filter == "none":
        threshold = standstill_speed(pieces)
        return [without_standstill(piece, np.where(turns(piece.qd), np.inf, threshold), 0) for piece in pieces]
    out = []
    for piece in pieces:
        smoother = Smoother(spec, piece.step)
        reach, stop = smoother.smear(piece.smoother is not None)
        seen = (2 * smoother.reach + 1) * piece.step
        threshold = np.maximum(stop * _largest_about(piece.qdd, smoother.reach), _NOISE_TRAVEL * piece.noise / seen)
        bent = turns(piece.qd) | jumps(piece.measured, smoother.reach)
        out.append(without_standstill(piece, np.where(bent, np.inf, threshold), reach))
    return out


def turns(qd) -> np.ndarray:
    """(n, dof) bool: the speed has another sign in the row before or after."""
    change = np.sign(qd[1:]) != np.sign(qd[:-1])
    out = np.zeros(qd.shape, dtype=bool)
    out[1:], out[:-1] = change, out[:-1] | change
    return out


def _largest_about(values, reach: int) -> np.ndarray:
    """The largest size (n, dof) of the values within `reach` rows of each."""
    n, width, span = len(values), 2 * reach + 1, 1
    largest = np.pad(np.abs(values), ((reach, reach), (0, 0)))
    while 2 * span <= width:  # of windows twice as long, time after time
        largest[:-span] = np.maximum(largest[:-span], largest[span:])
        span *= 2
    return np.maximum(largest[:n], largest[width - span : width - span + n])


def standstill_speed(pieces) -> np.ndarray:
    """Speed (dof,) below which a joint counts as standing, from its own rms speed."""
    square = sum(np.sum(p.qd[p.core] ** 2, axis=0) for p in pieces) / sum(p.samples for p in pieces)
    return np.minimum(_STANDSTILL_SHARE * np.sqrt(square), _STANDSTILL_MOST)


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
