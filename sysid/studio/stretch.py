"""What is missed in a stretch of time, and what would take it: on the same rows, in the same band
as the fit's own errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import SysidError
from ..report.words import units
from .previews import Preview
from .rows import rms, same_rows
from .workspace import Workspace

_LEAST = 0.01  # of the squared residual: less is not worth a line


def stretch(
    seen: Workspace, part: str, low: float, high: float, previews: Sequence[Preview] = ()
) -> dict:
    """Each joint's error between two times against that of the whole, and the share of it that
    changes which were previewed would take.

    Args:
        low, high: on the axis of the logs end to end [s].

    Returns:
        {"from", "to", "rows", "joints": [{joint, unit, here, whole}],
        "previews": [{sha, words, joint, share}]}, the largest share first.
    """
    if not (np.isfinite(low) and np.isfinite(high)):
        raise SysidError("a stretch of time needs two numbers")
    low, high = min(low, high), max(low, high)
    t, fit = seen.line(part)["t"], seen.fit
    inside, found, unit = (t >= low) & (t <= high), seen.prediction(part), units(fit)
    joints, taken = [], []
    for j, joint in enumerate(fit.joints):
        left = found.of_joint(j)[2]
        whole = seen.told(part)[j]
        here = whole if inside.all() else rms(left[inside])
        joints.append({"joint": joint, "unit": unit[joint][0], "here": here, "whole": whole})
        for preview in previews:
            after = same_rows(preview.workspace, seen, part, j)
            if after is None or not here:
                continue
            share = 1.0 - (rms(after[1][inside]) or 0.0) ** 2 / here**2
            if share > _LEAST:
                one = {"sha": preview.sha, "words": preview.words, "joint": joint, "share": share}
                taken.append(one)
    taken.sort(key=lambda one: -one["share"])
    return {
        "from": low, "to": high, "rows": int(inside.sum()), "joints": joints,
        "previews": taken[:4],
    }  # fmt: skip


def compared(steps: list[dict], one: int, other: int) -> dict:
    """The held-out errors of two steps and their difference. Raises SysidError."""
    if not (0 <= one < len(steps) and 0 <= other < len(steps)):
        raise SysidError("there is no such step", do="reload")
    first, second = steps[one]["rms_test"], steps[other]["rms_test"]
    joints = [
        {"joint": j, "from": first[j], "to": second[j], "delta": second[j] - first[j]}
        for j in first
        if j in second
    ]
    return {"from": one, "to": other, "joints": joints}
