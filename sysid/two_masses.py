"""A drive's two masses: where the link of a joint stands when its motor's motion is known.

Of one soft joint among joints whose motion is measured, the link's equation has a single unknown, how far the link
stands behind its motor, and what drives it is the torque that the link would need did it follow the motor:

    M(q) d'' + torque of the drive (d, d') = load(q, qd, qdd of the motors)

Far below the resonance d'' does not matter, and the drive carries the load itself.
"""

from __future__ import annotations

import math

import numpy as np

from . import regressor
from .motion import Piece
from .robot import Robot

_FORGOTTEN = 4.0  # times of decay: two per cent are left
_UNTOLD = 1e-3  # of what a first swing rings: by so much it is held where it is, and wholly where no sample tells it
_TURN = 0.5  # rad of the swing on the teeth in a step, at most


def link_side(robot: Robot, pi, motion: Piece, joint: int) -> tuple[np.ndarray, np.ndarray]:
    """Torque and inertia (n,) that a joint's link has for its drive, its own rotor not among them.

    Args:
        pi: (bodies, 10). motion: q, qd, qdd (n, dof).
    """
    alone = np.zeros_like(motion.q)
    alone[:, joint] = 1.0
    carried, still = _carried(robot, pi, joint), 0.0 * motion.q
    inertia = regressor.torque(robot, carried, motion.q, still, alone, gravity=np.zeros(3))[:, joint]
    return link_load(robot, pi, motion, joint), inertia


def link_load(robot: Robot, pi, motion: Piece, joint: int) -> np.ndarray:
    """The first of `link_side`."""
    return regressor.torque(robot, _carried(robot, pi, joint), motion.q, motion.qd, motion.qdd)[:, joint]


def _carried(robot: Robot, pi, joint: int) -> np.ndarray:
    """Bodies (bodies, 10) that a joint's drive carries: what hangs on its link, without what its own motor turns."""
    return np.where((robot.carried(joint) & ~robot.turned(joint))[:, None], np.asarray(pi, dtype=float), 0.0)


def sprung(load, inertia, step: float, *, compliance: float, damping: float) -> np.ndarray:
    """How far (n,) a link stands behind its motor through a damped spring.

        compliance inertia d'' + 2 damping sqrt(compliance inertia) d' + d = compliance load

    The recursion has the equation's own poles and answers a load that is quadratic in time exactly, whatever the step; where
    a step holds no sixth of a cycle, the resonance is beyond what the samples show and only that answer is left. Nobody knows
    how the link swung when the log began: so that it rings least until that is forgotten.

    Args:
        load: (n,) [N m]. inertia: (n,) [kg m²] of the link. step: seconds. compliance: [rad/(N m)]. damping: share of the
            critical one.
    """
    # seconds in steps: the period of the resonance over two pi, and the lag
    still = np.sqrt(np.maximum(compliance * np.asarray(inertia), 0.0)) / step
    if compliance <= 0.0 or len(load) < 3 or not still.any():
        return compliance * np.asarray(load)
    still = np.broadcast_to(still, len(load))
    found, slow = _answered(compliance * np.asarray(load), still, damping), float(np.median(still))
    early = max(5.0, _FORGOTTEN * slow / max(damping, 1e-3))
    # a filter bends a log's ends, and the link's first turn with them: what rings after it is asked, where that is not forgotten yet
    bent = min(2.0 * math.pi * slow, 0.25 * early) * min(max(slow - 1.0, 0.0), 1.0)
    # samples count more and less by and by as the spring softens: else what it does would jump with it
    sample = np.arange(1, min(math.ceil(early), len(load)) - 1)
    counts = _rising(sample / max(bent, 1.0) - 0.5) * _rising((early - 1.0 - sample) / (0.25 * early))
    rings = np.diff(found[: len(sample) + 2], 2, axis=0)
    # what no sample tells stays as it is
    kept = _UNTOLD * np.diag(np.linalg.norm(rings[:, 1:], axis=0))
    rings = np.vstack([counts[:, None] * rings, np.column_stack([np.zeros(2), kept])])
    return found[:, 0] - found[:, 1:] @ np.linalg.lstsq(rings[:, 1:], rings[:, 0], rcond=1e-9)[0]


def _rising(share: np.ndarray) -> np.ndarray:
    """(n,) from zero where a share (n,) is zero or less to one where it is one or more, without a kink."""
    share = np.clip(share, 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def _answered(asked, still, damping: float) -> np.ndarray:
    """(n, 3) [rad]: the recursion's answer to a deflection (n,) that is asked for, begun where it is asked; and how a link swings
    by itself from a first sample of one, and from a second.

    Args:
        still: (n,) period of the resonance over two pi, in steps.
    """
    from scipy.linalg.lapack import dtbtrs

    turn = 1.0 / np.maximum(still, 1e-3)
    share = np.minimum(np.maximum(damping, turn - 1.0), 0.999)
    kept = np.exp(-share * turn)
    one, two = 2.0 * kept * np.cos(np.sqrt(1.0 - share**2) * turn), -(kept**2)
    lag = 2.0 * damping * still
    curved = 2.0 * (lag**2 - still**2)
    zeroth = 1.0 - one - two
    first = 1.0 - lag + one * lag + two * (1.0 + lag)
    second = 1.0 - 2.0 * lag + curved - one * curved - two * (1.0 + 2.0 * lag + curved)
    right = np.array(asked)
    right[2:] = (
        0.5 * (first + second)[1:-1] * asked[2:] + (zeroth - second)[1:-1] * asked[1:-1] + 0.5 * (second - first)[1:-1] * asked[:-2]
    )  # fmt: skip
    band = np.zeros((3, len(asked)))
    band[0] = 1.0
    band[1, 1:-1], band[2, :-2] = -one[1:-1], -two[1:-1]
    begun = np.stack([right, np.zeros(len(asked)), np.zeros(len(asked))], axis=1)
    begun[0, 1] = begun[1, 2] = 1.0
    return dtbtrs(band, begun, uplo="L")[0]


def played(load, inertia, step: float, *, b: float, teeth: float) -> np.ndarray:
    """How far (n,) a link stands behind its motor through teeth with play.

        d'' + omega² (d -+ b/2) + omega d' = load / inertia where the teeth touch, |d| > b/2, and never pull
        d'' = load / inertia between

    Without inertia the link lies at the teeth that the load presses. On them it swings `teeth` times a second, omega / 2 pi,
    and loses most of a blow: of teeth only how long a blow takes is seen at lower frequencies.

    Args:
        load: (n,) [N m]. inertia: (n,) [kg m²] of the link. step: seconds. b: [rad]. teeth: [Hz].

    Source: Nordin & Gutman 2002.
    """
    load, half = np.asarray(load, dtype=float), 0.5 * b
    if half <= 0.0 or not np.all(inertia):
        return half * np.sign(load)
    driven, omega = load / inertia, 2.0 * math.pi * teeth
    fine = max(1, math.ceil(step * omega / _TURN))
    h = step / fine
    spring, damper = h * omega**2, h * omega
    d, v = half * math.copysign(1.0, driven[0]) + driven[0] / omega**2, 0.0
    out = [d]
    for push, more in zip((h * driven[:-1]).tolist(), (h / fine * np.diff(driven)).tolist()):
        for _ in range(fine):
            if d > half:
                held = spring * (d - half) + damper * v
                v += push - held if held > 0.0 else push
            elif d < -half:
                held = spring * (d + half) + damper * v
                v += push - held if held < 0.0 else push
            else:
                v += push
            d += h * v
            push += more
        out.append(d)
    return np.array(out)


def flown(load, inertia, step: float, *, b, teeth) -> np.ndarray:
    """`played` of many links at once, (links, n): a step of all takes little longer than a step of one.

    Args:
        load, inertia: (links, n). b, teeth: (links,).
    """
    load, inertia, b, teeth = (np.asarray(x, dtype=float) for x in (load, inertia, b, teeth))
    half, out = 0.5 * b[:, None], np.sign(load) * 0.5 * b[:, None]
    own = np.flatnonzero((b > 0.0) & np.all(inertia > 0.0, axis=1))
    if not len(own):
        return out
    driven, half, omega = (load[own] / inertia[own]).T, half[own, 0], 2.0 * math.pi * teeth[own]
    fine = max(1, math.ceil(step * omega.max() / _TURN))
    h = step / fine
    both = np.stack([(h * omega) ** 2, h * omega])  # of the teeth, of their damping
    d = half * np.where(driven[0] < 0.0, -1.0, 1.0) + driven[0] / omega**2
    least, state, held = -half, np.zeros((2, len(own))), np.empty((2, len(own)))
    into, v = state  # how far into the teeth, zero between; how far a step goes
    found = np.empty_like(driven)
    found[0] = d
    driven *= h**2
    part = np.arange(fine)[:, None] / fine
    between = (first + part * more for first, more in zip(driven[:-1], np.diff(driven, axis=0)))
    force, drag = held
    for k, pushes in enumerate(between if fine > 1 else driven[:-1, None], 1):
        for push in pushes:
            np.maximum(d, least, out=into)
            np.minimum(into, half, out=into)
            np.subtract(d, into, out=into)
            np.multiply(state, both, out=held)
            force += drag
            force *= force * into > 0.0  # teeth never pull
            v += push
            v -= force
            d += v
        found[k] = d
    out[own] = found.T
    return out
