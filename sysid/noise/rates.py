"""Stretches of several sampling rates: the same noise of a sample has another density at each, so
that each rate is asked by itself."""

import math
from collections.abc import Callable, Sequence

ALIKE = 0.05  # of a step: stamps of one logger scatter less


def by_rate(step: Sequence[float]) -> list[list[int]]:
    """The numbers of stretches of one sampling rate, for each; step: [s] of each."""
    out: list[list[int]] = []
    for k in sorted(range(len(step)), key=lambda k: step[k]):
        if out and step[k] <= (1.0 + ALIKE) * step[out[-1][0]]:
            out[-1].append(k)
        else:
            out.append([k])
    return out


def of_each(
    groups: list[list[int]],
    estimate: Callable,
    given: tuple,
    joint: int,
    use,
    memory: dict,
    angles,
    of: str,
):
    """What `floor.estimate` makes of each group of stretches, together.

    Args:
        groups: numbers of stretches. of: in words, what is apart.
        given: residual, measured, q and step of each stretch. use, memory, angles: as there.
    """
    found = []
    for own in groups:
        parts = ([x[n] for n in own] for x in given)
        drawn, counts = angles and angles.of(own), [use[n] for n in own]
        how = {"use": counts, "memory": memory.setdefault(tuple(own), {}), "angles": drawn}
        found.append(estimate(*parts, joint, **how))
    return _together(found, [int(sum(use[n].sum() for n in own)) for own in groups], of)


def _together(found: Sequence, rows: Sequence[int], of: str):
    """The `Estimate` of all rows, of that of each group and how many rows it has."""
    share = [own / max(sum(rows), 1) for own in rows]
    both = list(zip(share, found))
    mean = lambda name: math.sqrt(sum(w * getattr(one, name) ** 2 for w, one in both))  # noqa: E731
    rms, errors = mean("rms"), [w * one.rms * one.std for w, one in zip(share, found)]
    most, worst = (max(range(len(found)), key=sizes.__getitem__) for sizes in (share, errors))
    std = math.sqrt(sum(own**2 for own in errors)) / rms if rms > 0.0 else 0.0
    told = next((one for one in (found[most], *found) if one.method != "none"), found[most])
    detail = f"{told.detail}; {of}" if told.detail else ""
    return type(found[0])(
        rms, std, told.method, detail, found[worst].doubt, mean("own"), mean("least")
    )
