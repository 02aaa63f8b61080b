"""Products of two functions of the motion: what most laws are that nobody thought of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, islice

import numpy as np

from .functions import DIRECTION, of_unit_size
from .pasts import pasts

_OWN, _OTHER = 6, 2  # half waves over an angle's travel: of the joint's own, and of another's
_SLOW = 0.3  # of the root mean square of a speed
_PART = 64  # functions that stand in memory together, and as many times the direction of motion

Factor = tuple[str, np.ndarray]  # the variables that it is of; (n,)


def products(
    known: dict[str, np.ndarray], joint: str, use, piece, step: float, ripples: Sequence[float] = ()
) -> Iterator[tuple[list[str], np.ndarray]]:
    """Functions (n, k) of the motion with a mean square of one on a joint's rows that count, and
    the variables that each is of, in words; some at a time, as all of a long log fill the memory.

    Each is the product of two: waves, sizes, signs and squares of the joint's own angle, speed,
    acceleration and load; the same of another joint; time; or one. All stand there once more times
    the direction of motion, as friction does, and with them what the speed was a while ago, and
    ripples that are stronger where something else is.

    Args:
        known, piece, step: as of `functions.groups`. use: (n,) bool. ripples: periods of the
            joint's own angle in 2 pi rad or m that a model has [1/rad or 1/m].
    """
    direction = np.sign(known[f"qd_{joint}"])[:, None]
    found = chain(_all(known, joint, piece, step), _modulated(known, joint, ripples))
    while part := list(islice(found, _PART)):
        words, values = zip(*part)
        own = np.stack(values).T  # each function's rows side by side in memory
        both = [w if f"qd_{joint}" in w.split(" and ") else f"{w} and {DIRECTION}" for w in words]
        for some, told in ((own, words), (direction * own, both)):
            kept, which = of_unit_size(some, use)
            yield [told[k] for k in which], kept


def _all(known, joint: str, piece, step: float) -> Iterator[Factor]:
    own = list(_factors(known, joint, _OWN))
    few = list(_factors(known, joint, _OTHER))
    yield from own
    for k, first in enumerate(own):
        yield from (_product(first, second) for second in own[k:])
    yield f"qd_{joint}", np.ones(len(known["time"]))  # times the direction of motion
    yield "time", known["time"]
    yield from (_product(one, ("time", known["time"])) for one in few)
    for other in (name[2:] for name in known if name.startswith("q_") and name[2:] != joint):
        for second in _factors(known, other, _OTHER):
            if second[0].startswith("load_"):
                continue
            yield second
            yield from (_product(first, second) for first in few)
    yield from pasts(known, joint, piece, step)


def _modulated(known, joint: str, ripples) -> Iterator[Factor]:
    angle, few = f"q_{joint}", [*_factors(known, joint, _OTHER), ("time", known["time"])]
    waves = [(angle, turn(k * known[angle])) for k in ripples for turn in (np.sin, np.cos)]
    yield from (_product(wave, strength) for wave in waves for strength in few)


def _product(first: Factor, second: Factor) -> Factor:
    variables = dict.fromkeys((first[0], second[0]))
    return " and ".join(variables), first[1] * second[1]


def _factors(known, joint: str, waves: int) -> Iterator[Factor]:
    """Functions of one joint's motion, each of about unit size."""
    angle, speed, push, load = (_sized(known[f"{k}_{joint}"]) for k in ("q", "qd", "qdd", "load"))
    low, high = np.min(known[f"q_{joint}"]), np.max(known[f"q_{joint}"])
    phase = 0.5 * np.pi * (2.0 * known[f"q_{joint}"] - low - high) / max(high - low, 1e-12)
    angles = [angle, *(turn(m * phase) for m in range(1, waves + 1) for turn in (np.sin, np.cos))]
    size, sign = np.abs(speed), np.sign(speed)
    speeds = [speed, size, sign, speed * size]
    if waves == _OWN:
        speeds += [sign * np.exp(-size / _SLOW), sign * np.maximum(size - 1.0, 0.0)]
    yield from ((f"q_{joint}", one) for one in angles)
    yield from ((f"qd_{joint}", one) for one in speeds)
    yield from ((f"qdd_{joint}", one) for one in (push, np.sign(push)))
    yield from ((f"load_{joint}", one) for one in (load, np.abs(load)))


def _sized(values: np.ndarray) -> np.ndarray:
    return values / max(np.sqrt(np.mean(values**2)), 1e-12)
