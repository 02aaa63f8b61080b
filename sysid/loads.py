"""Loads that differ from log to log, as the link that holds them tells them: three and more are levels of a group, and no effect."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from .blocks import by_block
from .candidate_columns import columns_of
from .candidates import made
from .effects.payload import Payload
from .model_parameters import ROBOT
from .picks import MASS, TAKES
from .vocabulary import find

_APART = 0.1  # of the greatest difference: loads that differ by less are one level
_CLEAR = 5.0  # standard deviations of white noise, which is what these are told with


@dataclass(frozen=True)
class Loads:
    """{training log: mass [kg], more than in the log that has least}, of a payload with some options, and the share that these loads
    take of the weighted squared residual of all joints."""

    masses: dict[str, float]
    options: Mapping[str, str]
    takes: float


def loads(view) -> Loads | None:
    """The loads of whichever link they take most on, where they are others in three logs and more, and take a quarter of some joint's
    squared residual; None elsewhere.

    Args:
        view: of the model, a `view.View`.
    """
    payload = find(Payload.name)
    if len(np.unique(view.rows.log)) < 3 or any(effect.name == payload.name for effect, _ in view.model.terms):
        return None
    found = [own for options in payload.places(view.model.robot) if (own := _held(view, options))]
    return max(found, key=lambda own: own.takes, default=None)


def _held(view, options: Mapping[str, str]) -> Loads | None:
    """Loads on the link that a payload's options name."""
    parts = by_block(view.rows.log)
    (columns,) = columns_of(view.source, made(find(Payload.name), ROBOT, dict(options), view.model.robot), [{}])
    body, design = columns[:, :, MASS] * view.weights[:, None, None], view.design
    size = np.maximum(np.sqrt(np.einsum("jnk,jnk->k", body, body)), 1e-300)
    body, k = body / size, len(size)
    own = np.concatenate([sum(p[s].T @ p[s] for p in body)[None] for s in parts])
    shared = np.concatenate([sum(a[s].T @ p[s] for a, p in zip(design.columns, body)) for s in parts], axis=1)
    score = np.concatenate([sum(p[s].T @ design.residual[s, j] for j, p in enumerate(body)) for s in parts])
    left = -shared.T @ shared
    for number, square in enumerate(own):
        left[k * number : k * (number + 1), k * number : k * (number + 1)] += square
    inverse = np.linalg.pinv(left, rcond=1e-9, hermitian=True)
    found = inverse @ score
    torque = np.concatenate([body[:, s] @ one for s, one in zip(parts, found.reshape(-1, k))], axis=1)
    rest = design.residual - torque.T + (design.columns @ (shared @ found)).T
    square, after = (np.maximum(np.sum(one**2, axis=0), 1e-300) for one in (design.residual, rest))
    if not (1.0 - after / square).max() > TAKES:
        return None
    # what all logs have alike is the link's own, and told by none
    centred = np.eye(len(parts)) - 1.0 / len(parts)
    variance = np.diag(centred @ inverse[::k, ::k] @ centred) * after.sum() / max(view.rows.use.sum(), 1)
    mass = found[::k] / size[0]
    more = mass - mass.min()
    if len(levels(more)) < 3 or not more.max() > _CLEAR * np.sqrt(variance.max()) / size[0]:
        return None
    masses = {view.motion.pieces[view.rows.piece[s.start]].source: float(own) for s, own in zip(parts, more)}
    return Loads(masses, options, float(1.0 - after.sum() / square.sum()))


def levels(more: np.ndarray) -> list[list[int]]:
    """The numbers of masses (n,) that are one load, the lightest first."""
    out: list[list[int]] = []
    for number in np.argsort(more).tolist():
        if out and more[number] - more[out[-1]].min() <= _APART * np.ptp(more):
            out[-1].append(number)
        else:
            out.append([number])
    return [sorted(own) for own in out]


def told(view) -> Iterator[str]:
    """What is said of loads that differ from log to log, with what an experiment file says of them."""
    if (found := loads(view)) is None:
        return
    logs, masses = list(found.masses), np.array(list(found.masses.values()))
    groups = {f"load_{n}": [logs[k] for k in own] for n, own in enumerate(levels(masses))}
    each = ", ".join(f"{log} +{mass:.3g} kg" for log, mass in found.masses.items())
    link = found.options.get("link")
    held = f"link: {json.dumps(link)}, " if link else ""
    yield (
        f"the load on {link or 'the last link'} is another from log to log: {each}; levels of a group say so: "
        f"write `groups: {{load: {json.dumps(groups)}}}` under "
        f"`data:`, each test log at the level whose load it has, and `{{payload: {{{held}per: load, except: [load_0]}}}}` under `model.effects`"
    )
