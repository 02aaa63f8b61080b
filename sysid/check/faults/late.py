"""Whether torque and angles were measured at the same time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ... import blocks
from ..equations import FEWEST
from ..fault import WARNING, Fault
from ..look import Look, Seen

AFTER, SENSELESS = 3, ("wrong_unit", "angle_wrap", "joint_order", "sign_flipped")
_MOST, _LAGS = 0.1, 81  # s to either side, and how many of them are tried
_LEAST = (0.004, 1.5)  # s, samples: less a drive's current loop has, or no step of the log shows
_BETTER = 0.1  # of the logarithm of the joint's squares
# Half of the blocks of time, each one value, times that logarithm: a likelihood ratio of one in
# three thousand, as the best of many lags is taken on each of some joints
_CLEAR = 8.0


def find(look: Look) -> Iterator[Fault]:
    """delayed_signal."""
    if look.seen is None:
        return
    rows = look.seen.rows
    step = max(log.step for log in look.part("train"))
    lags = np.linspace(-_MOST, _MOST, _LAGS)
    for j, joint in enumerate(look.robot.joints):
        use = rows.use[:, j]
        told = use.sum() >= FEWEST and np.ptp(rows.tau[use, j]) > 0.0
        if not told or not look.excited[j].enough:
            continue
        left = _left(look.seen, j, lags)
        squares = np.sum(left**2, axis=1)
        best, none = int(np.argmin(squares)), len(lags) // 2
        lag, pause = float(lags[best]), max(_LEAST[0], _LEAST[1] * step)
        gain = float(np.log(squares[none] / squares[best]))
        if abs(lag) <= pause or best in (0, len(lags) - 1) or gain <= _BETTER:
            continue
        t, piece = rows.t[use], rows.piece[use]
        memory = blocks.memory(
            left[best][:, None], np.ones((len(t), 1), bool), piece, look.seen.step
        )
        count = int(blocks.numbered(t, piece, memory=memory).max()) + 1
        if 0.5 * count * gain > _CLEAR:
            word = "later" if lag > 0 else "earlier"
            yield Fault(
                "delayed_signal",
                WARNING,
                (
                    f"the torque of {joint} looks {1e3 * abs(lag):.2g} ms {word} than its motion: "
                    "a delay, or an effect that looks like one"
                ),
                "`sysid diagnose` says which; log both from the same cycle where it is a delay",
                joint,
            )


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
