"""Do blocks of time agree on what a residual follows?

Each family F of functions of the motion is projected off the model. Over blocks of time b

    s_b = F_b' e_b - F'A (A'A + P)^-1 Z_b' e_b        e: the residual, as loud as before the fit
    M_bc = s_b' (F'F + ridge)^-1 s_c                  how much block c tells of block b
    z = sum of M_bc over blocks that are no neighbours, over its deviation under random signs

The columns Z are the model's own, A, without the noise of the angles, which would else stand in
columns and residual alike. The greatest z of all families and ridges is held against its
distribution when each block has a random sign: the same blocks, the same families, nothing there.
What neighbouring blocks share beyond what far ones do is the noise's memory, which widens that
distribution: with a correlation r between neighbours the deviation of a sum of products of pairs
grows by 1 + 2 r.

Ridge regression on folds (`ridge`) asks one function to hold everywhere it was not fitted; here a
hundred small families are asked at once, each with few degrees of freedom.

Source: Westfall & Young 1993 (the greatest statistic); Leucht & Neumann 2013 (signs for degenerate
U-statistics); Young 2011 (instruments).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import blocks
from .functions import of_unit_size

_RIDGES = (1e-4, 3e-3, 3e-2)  # of the rows' number, for columns of unit size: stiff and loose
_DRAWS = 2000
_APART = 2  # blocks: neighbours share what the noise remembers


@dataclass(frozen=True)
class Projection:
    """What takes a model's own parameters off functions of the motion on one joint.

    columns: (n, size) the joint's own, weighted. inverse: (size, size) of the whole model's system.
    scores: (blocks, size) of the instruments of all joints. residual: (n,) the joint's own, as loud
    as before the fit. number: (n,) the block of each row.
    """

    columns: np.ndarray
    inverse: np.ndarray
    scores: np.ndarray
    residual: np.ndarray
    number: np.ndarray


@dataclass(frozen=True)
class Agreement:
    """chance: the probability of blocks that agree as well on any family, were nothing there;
    variables: of the family on which they agree best; gain: of the squared residual, what it
    predicts of blocks that are no neighbours."""

    chance: float
    variables: str
    gain: float


def agreement(
    families: dict[str, np.ndarray], use, model: Projection, rng: np.random.Generator
) -> Agreement:
    """Whether blocks agree on any family of functions.

    Args:
        families: {name: (n, k)}. use: (n,) bool, the joint's rows that count.
    """
    count = int(model.number.max()) + 1
    distance = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    apart = distance >= _APART
    signs = np.concatenate([np.ones((1, count)), blocks.signs(count, _DRAWS, rng)])
    names, gains, statistics, memory = [], [], [], []
    for name, values in families.items():
        for products in _products(values, use, model, count):
            pairs = products * apart
            deviation = np.sqrt(2.0 * np.sum(pairs**2))
            if not deviation > 0.0:
                continue
            size = np.sqrt(np.maximum(np.diag(products), 1e-300))
            alike = products / np.outer(size, size)
            memory.append(alike[distance == 1].mean() - alike[apart].mean())
            statistics.append(np.einsum("db,db->d", signs @ pairs, signs) / deviation)
            names.append(name)
            gains.append(pairs.sum())
    if not names:
        return Agreement(1.0, "", 0.0)
    found = np.array(statistics)  # (families and ridges, 1 + draws)
    best = int(np.argmax(found[:, 0]))
    wider = 1.0 + 2.0 * max(float(np.mean(memory)), 0.0)
    above = int(np.sum(found[:, 1:].max(0) >= found[best, 0] / wider))
    variables = names[best].partition(",")[0]
    return Agreement((1.0 + above) / (1.0 + _DRAWS), variables, max(float(gains[best]), 0.0))


def _products(values, use, model: Projection, count: int):
    """(blocks, blocks) what each block tells of each other by one family, for each ridge."""
    kept = of_unit_size(values, use)
    if not kept.shape[1]:
        return
    across = kept.T @ model.columns
    absorbed = across @ model.inverse
    scores = blocks.summed(model.number, kept * model.residual[:, None], count)
    scores = scores - model.scores @ absorbed.T
    sizes, turn = np.linalg.eigh(kept.T @ kept - absorbed @ across.T)
    turned = scores @ turn
    for ridge in _RIDGES:
        yield (turned / (np.clip(sizes, 0.0, None) + ridge * len(use))) @ turned.T
