"""Whether torque and angles were measured at the same time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ... import blocks
from ..equations import FEWEST
from ..fault import WARNING, Fault
from ..look import Look, Seen

AFTER = 3
SENSELESS = ("wrong_unit", "angle_wrap", "joint_order", "sign_flipped", "delayed_signal")
_MOST, _LAGS = 0.1, 81  # s to either side, and how many of them are tried
_LEAST = (0.004, 1.5)  # s, samples: less a drive's current loop has, or no step of the log shows
_BETTER = 0.1  # of the logarithm of the joint's squares
# Half of the blocks of time, each one value, times that logarithm: a likelihood ratio of one in
# three thousand, as the best of many lags is taken on each of some joints
_CLEAR = 8.0
# Two clocks: joints whose lag changes, at least, and by how much the changes may differ
_MANY, _ALIKE = 2, 0.5


def find(look: Look) -> Iterator[Fault]:
    """delayed_signal."""
    if (seen := look.in_band) is None:
        return
    rows = seen.rows
    step = max(log.step for log in look.part("train"))
    lags, apart, asked = np.linspace(-_MOST, _MOST, _LAGS), dict[str, tuple[float, ...]](), 0
    found: list[Fault] = []
    for j, joint in enumerate(look.robot.joints):
        use = rows.use[:, j]
        told = use.sum() >= FEWEST and np.ptp(rows.tau[use, j]) > 0.0
        if not told or not look.excited[j].enough:
            continue
        left = _left(seen, j, lags)
        squares = np.sum(left**2, axis=1)
        best, none = int(np.argmin(squares)), len(lags) // 2
        lag, pause = float(lags[best]), max(_LEAST[0], _LEAST[1] * step)
        gain = float(np.log(squares[none] / squares[best]))
        t, piece = rows.t[use], rows.piece[use]
        memory = blocks.memory(left[best][:, None], np.ones((len(t), 1), bool), piece, seen.step)
        count = int(blocks.numbered(t, piece, memory=memory).max()) + 1
        asked += 1
        ends = _at_ends(left, lags, rows.log[use], t, count)
        if ends and abs(ends[1] - ends[0]) > pause and ends[2] > 1.0:
            apart[joint] = ends
        if abs(lag) <= pause or best in (0, len(lags) - 1) or gain <= _BETTER:
            continue
        if 0.5 * count * gain > _CLEAR:
            word = "later" if lag > 0 else "earlier"
            says = (
                f"the torque of {joint} looks {1e3 * abs(lag):.2g} ms {word} than its motion: "
                "a delay, or an effect that looks like one"
            )
            do = "`sysid diagnose` says which; log both from the same cycle where it is a delay"
            found.append(Fault("delayed_signal", WARNING, says, do, joint))
    clocks = [*_clocks(apart, asked)]
    yield from clocks
    yield from (fault for fault in found if not clocks or fault.joint not in apart)


def _clocks(apart: dict[str, tuple[float, ...]], asked: int) -> Iterator[Fault]:
    """Lags that change over the logs: on one joint friction that warms looks like it, and on most
    joints alike two clocks do.

    Args:
        apart: {joint: as of `_at_ends`}. asked: of how many joints.
    """
    change = np.array([last - first for first, last, _ in apart.values()])
    if len(change) < _MANY or 2 * len(change) <= asked:
        return
    alike = np.ptp(change) <= _ALIKE * abs(np.median(change))
    if not alike or sum(gain for *_, gain in apart.values()) <= _CLEAR:
        return
    first, last = (_when(np.median([one[k] for one in apart.values()])) for k in (0, 1))
    *names, name = apart
    says = (
        f"the torques of {', '.join(names)} and {name} are {first} in the first third of each log "
        f"and {last} in the last: clocks that run apart look like that, or friction that changes on "
        "all of them"
    )
    do = "put torque and angles on one clock, as by a start and a stop that both show"
    yield Fault("delayed_signal", WARNING, says, do)


def _when(lag: float) -> str:
    """A lag [s] in words."""
    if abs(lag) < _LEAST[0]:
        return "in time"
    return f"{1e3 * abs(lag):.2g} ms {'late' if lag > 0 else 'early'}"


def _at_ends(left, lags, log, t, count: int) -> tuple[float, float, float] | None:
    """The lags [s] that leave least in the first third of each log and in the last, and the logarithm
    of how much likelier they are than one for both, of so many independent blocks; None at an end of
    what is tried."""
    early, late = np.zeros(len(t), bool), np.zeros(len(t), bool)
    for one in np.unique(log):
        own = log == one
        low, high = np.quantile(t[own], (1.0 / 3.0, 2.0 / 3.0))
        early |= own & (t <= low)
        late |= own & (t >= high)
    first, last = (np.sum(left[:, part] ** 2, axis=1) for part in (early, late))
    both, ends = int(np.argmin(first + last)), [int(np.argmin(part)) for part in (first, last)]
    if {0, len(lags) - 1} & {*ends}:
        return None
    gain = sum(float(np.log(part[both] / part.min())) for part in (first, last))
    return float(lags[ends[0]]), float(lags[ends[1]]), 0.5 * count / 3.0 * gain


def _left(seen: Seen, j: int, lags) -> np.ndarray:
    """What least squares by this joint's own columns leave (lags, n) of its torque, read a while
    later."""
    use = seen.rows.use[:, j]
    basis, sizes, _ = np.linalg.svd(seen.columns(j)[use], full_matrices=False)
    basis = basis[:, sizes > 1e-4 * sizes[0]]
    out = []
    for lag in lags:
        late = [
            np.interp(p.t[p.core][:: seen.stride] + lag, p.t, p.tau[:, j])
            for p in seen.motion.pieces
        ]
        tau = np.concatenate(late)[use]
        out.append(tau - basis @ (basis.T @ tau))
    return np.array(out)
