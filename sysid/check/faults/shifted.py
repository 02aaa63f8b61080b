"""Whether torques and angles are two recordings that did not begin together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ... import blocks
from ..equations import FEWEST, Reading, fitted
from ..fault import ERROR, WARNING, Fault
from ..look import Look

AFTER = 2.5
SENSELESS = ("wrong_unit", "angle_wrap", "joint_order", "sign_flipped", "mass_implausible")
# s to either side, a sixth of a log at most, and between two that are tried; what is nearer is a
# delay, or an effect that looks like one (`late`)
_FAR, _SPACING, _NEAR = 2.0, 0.01, 0.09
_POOR = 0.01  # of a torque's squares, that are left of it as it is: less, and it is in time
# of these squares: in time bodies and friction leave no more (where the model lacks a law a wrong
# lag leaves a fifth and more); what is as good
_LEAST, _LITTLE = 0.1, 1e-3
# of the logarithm of a joint's squares; and half of the blocks of time, times that: of 400 lags
# one is as good by chance in seven thousand logs
_BETTER, _CLEAR = 1.0, 15.0
_SAME, _ALIKE = 0.05, 0.05  # of the squares: a period more is as good; s: joints of one recording


def find(look: Look) -> Iterator[Fault]:
    """delayed_signal, of each log: who starts two loggers by hand does so anew each time."""
    if look.equations is None:
        return
    rows, found = look.seen.rows, dict[str, tuple[float, list[str]]]()
    columns = look.equations.columns(Reading.plain(look.robot.dof))
    logs = look.part("train")
    for number, log in enumerate(logs):
        lags = _of_log(look, columns, rows.log == number)
        if told := _one(lags):
            found[log.log.name] = told
    if not found:
        return
    shifts = np.array([lag for lag, _ in found.values()])
    alike = len(found) == len(logs) and np.ptp(shifts) <= _ALIKE
    for name, (lag, names) in [*found.items()][: 1 if alike else None]:
        word, other = ("later", "earlier") if lag > 0 else ("earlier", "later")
        where = ("in every log" if len(logs) > 1 else f"in {name}") if alike else f"in {name}"
        few = len(names) < 2
        what = (
            f"the torque of {names[0]} looks" if few else f"the torques of {', '.join(names)} look"
        )
        yield Fault(
            "delayed_signal",
            WARNING if few else ERROR,
            f"{where} {what} {abs(lag):.2g} s {word} than the motion: two recordings that did not "
            "begin together look like that",
            f"shift the torques' rows {abs(lag):.2g} s {other} against the angles', or log both "
            "from one clock",
            names[0] if few else "",
            "" if alike else name,
        )


def _one(lags: dict[str, float | None]) -> tuple[float, list[str]] | None:
    """The lag [s] that most joints agree on, and these; None where they do not.

    Args:
        lags: of each joint that tells; None: it is in time, or no lag explains it.
    """
    known = {joint: lag for joint, lag in lags.items() if lag is not None}
    if 2 * len(known) <= len(lags):
        return None
    middle = float(np.median([*known.values()]))
    near = [joint for joint, lag in known.items() if abs(lag - middle) <= _ALIKE]
    return (middle, near) if 2 * len(near) > len(lags) else None


def _of_log(look: Look, columns, own) -> dict[str, float | None]:
    """{joint: lag [s]} of each joint that tells in the rows `own` (n,) bool of a log.

    Args:
        columns: (5, dof, n) as of `Equations.columns`.
    """
    seen, out = look.seen, dict[str, float | None]()
    rows, tau = seen.rows, look.equations.tau
    if own.sum() < FEWEST:
        return out
    far = min(_FAR, np.ptp(rows.t[own]) / 6.0)
    lags = np.arange(-np.floor(far / _SPACING), np.floor(far / _SPACING) + 1) * _SPACING
    for j, joint in enumerate(look.robot.joints):
        if not look.excited[j].enough:
            continue
        use = rows.use[:, j] & own & _inside(rows, far)
        if use.sum() < FEWEST or not np.ptp(tau[use, j]) > 0.0:
            continue
        left = np.array([_left(columns[:, j, use], _read(seen, j, use, lag)) for lag in lags])
        none = len(lags) // 2
        whole = float(np.sum((tau[use, j] - tau[use, j].mean()) ** 2))
        out[joint] = None
        if left[none] < _POOR * whole:
            continue
        # by a whole period of the motion more it is the same
        around, most = np.pad(left, 1, constant_values=np.inf), left.min() * (1.0 + _SAME)
        lowest = (left <= around[:-2]) & (left <= around[2:]) & (left <= most + _LITTLE * whole)
        best = min(np.flatnonzero(lowest), key=lambda k: abs(lags[k]))
        gain = float(np.log(left[none] / left[best]))
        count = len(np.unique(blocks.numbered(rows.t[use], rows.piece[use], shortest=0.1)))
        clear = gain > _BETTER and 0.5 * count * gain > _CLEAR and left[best] < _LEAST * whole
        if clear and abs(lags[best]) > _NEAR:
            out[joint] = float(lags[best])
    return out


def _inside(rows, far: float) -> np.ndarray:
    """(n,) bool: rows so far [s] from either end of their piece that every lag is read of it."""
    out = np.zeros(len(rows.t), dtype=bool)
    for number in np.unique(rows.piece):
        own = rows.piece == number
        t = rows.t[own]
        out[own] = (t >= t.min() + far) & (t <= t.max() - far)
    return out


def _read(seen, j: int, use, lag: float) -> np.ndarray:
    """Torque of joint j on rows `use` (n,), read a while later."""
    pieces = seen.motion.pieces
    late = [np.interp(p.t[p.core][:: seen.stride] + lag, p.t, p.tau[:, j]) for p in pieces]
    return np.concatenate(late)[use]


def _left(columns, tau) -> float:
    """Squares that bodies as the URDF has them, times any factor, an inertia and friction leave of
    a torque, none of them negative: half a period away all would be."""
    return fitted(columns, tau, True)[0]
