"""Logs whose columns are not read as they were written: nothing that a model lacks mends them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from . import check
from .estimate import Fit
from .plausible import BEGINS, WRONG

_LEFT = 0.1  # of a torque's square about its mean: a fit that leaves more may read another column


def misread(fit: Fit) -> list[str]:
    """What a check says of the columns of logs that a fit explains badly: a notice for each cure,
    none where the columns are read rightly."""
    errors = [prediction.errors()["r2"] for prediction in fit.predictions.values()]
    badly = any(np.any(r2[np.isfinite(r2)] < 1.0 - _LEFT) for r2 in errors)
    if not (badly or any(notice.startswith(BEGINS) for notice in fit.notices)):
        return []
    # bodies take much of another zero upon themselves: it is told where they cannot be meant
    meant = not any(notice.startswith(BEGINS) for notice in fit.notices)
    found = check.misread(fit.experiment)
    groups: dict[tuple[str, str], list[check.Fault]] = {}
    for fault in found:
        if fault.severity == check.ERROR or not meant:
            groups.setdefault((fault.fault, fault.do), []).append(fault)
    return [f"{BEGINS}: {WRONG}: {_said(own)}; {do}" for (_, do), own in groups.items()]


def _said(faults: Sequence[check.Fault]) -> str:
    """Of faults that one thing cures what the first says, and where it is."""
    joints = list(dict.fromkeys(fault.joint for fault in faults if fault.joint))
    logs = list(dict.fromkeys(fault.log for fault in faults if fault.log))
    where = [", ".join(names) for names in (joints, logs) if len(names) > 1]
    more = f"; {len(faults)} such in all: {' in '.join(where)}" if where else ""
    return f"{faults[0].says}{more}"


def unasked(verdicts: Sequence) -> list:
    """Verdicts on logs that are not read as they were written: where something is left, nobody knows
    what."""
    why = "the columns of these logs look wrong, and what is left may be no more than that"
    return [
        replace(one, status="unresolved", says=why, left=None, may=None, even=False, reason=None)
        if one.status in ("unknown", "unresolved")
        else one
        for one in verdicts
    ]
