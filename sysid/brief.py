"""Joints that are at their noise but for a moment: no law of theirs, and no place that is new."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .estimate import Fit
from .noise import NoiseFloor, as_of_test
from .plausible import ROWS, Reason

_WINDOW, _FEW, _MOST = 0.25, 0.02, 2  # s; of a part's rows; stretches


def brief(fit: Fit, floors: Sequence[NoiseFloor]) -> dict[str, Reason]:
    """{joint: why} of joints whose error, on the training logs or on the test logs, would be at its
    noise floor without one moment, or two, of less than a fiftieth of the rows: a stop that is
    abrupt, a push, the end of a log. What a law does it does time and again."""
    out = {}
    trained = as_of_test(fit.rms("train"), floors)
    for j, joint in enumerate(fit.joints):
        both = {"train": trained[joint], "test": fit.rms("test")[joint]}
        loud = [part for part, error in both.items() if not floors[j].reached(error)]
        if floors[j].rms is None or not loud:
            continue
        said = [_moments(fit, j, floors[j], part) for part in loud]
        if all(said):
            out[joint] = Reason(
                f"it is at its noise but for {' and '.join(said)}: what comes once is no law; if it "
                "is a stop, a push or the end of a log, leave it out (`mask` under `preprocess:`)",
                settles=True,
            )
    return out


def _moments(fit: Fit, j: int, floor: NoiseFloor, part: str) -> str:
    """The moments of a part without which joint j is at its floor, in words; empty where more."""
    told, times = fit.predictions[part].thinned(ROWS), 1.0
    if part == "train" and floor.train:
        times = floor.rms / floor.train
    use = np.ones(len(told.t), bool) if told.use is None else told.use[:, j]
    square, window = (times * told.residual[use, j]) ** 2, np.floor(told.t[use] / _WINDOW)
    names, at = np.unique(np.stack([told.log[use], window]), axis=1, return_inverse=True)
    squares, rows = np.bincount(at.ravel(), square), np.bincount(at.ravel())
    order = np.argsort(-squares)
    left = np.sqrt(
        np.maximum(square.sum() - np.cumsum(squares[order]), 0.0)
        / np.maximum(len(square) - np.cumsum(rows[order]), 1)
    )
    few = np.flatnonzero(np.cumsum(rows[order]) <= _FEW * len(square))
    done = next((k for k in few if floor.reached(left[k])), None)
    if done is None:
        return ""
    taken = sorted(map(tuple, names[:, order[: done + 1]].T))
    spans: list[list[float]] = []
    for log, number in taken:
        if spans and spans[-1][0] == log and spans[-1][2] == number:
            spans[-1][2] = number + 1
        else:
            spans.append([log, number, number + 1])
    if len(spans) > _MOST:
        return ""
    logs = [own["log"] for own in fit.logs if own["part"] == part]
    words = [f"{logs[int(k)]}, {a * _WINDOW:.2f} to {b * _WINDOW:.2f} s" for k, a, b in spans]
    return " and ".join(words)
