"""Effects whose terms cancel each other where they were logged: none of their numbers is the joint's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .candidate_columns import columns_of

_TIMES = 10.0  # as much as their sum: a number with one digit left


def cancelling(claims: Sequence) -> list[str]:
    """What to know of claims whose terms are together, on the logs, ten times as large as what comes
    of them: beyond these angles and speeds that may be anything."""
    out = []
    for claim in claims:
        head, view = claim.head, claim.step.after
        numbers = [value for value, *_ in claim.after.parameters_of(*head.candidate.key).values()]
        if head.candidate.nonlinear or len(numbers) < 2:
            continue
        columns = columns_of(view.source, head.candidate, [claim.step.choice.head.shapes])[0]
        if columns.shape[2] != len(numbers):  # shape values stand among them
            continue
        terms = columns * np.array(numbers)
        size = lambda values: float(np.sqrt(np.mean(values**2)))  # noqa: E731
        times = np.sqrt(sum(size(one) ** 2 for one in np.moveaxis(terms, 2, 0)))
        times /= max(size(terms.sum(axis=2)), 1e-300)
        if times > _TIMES:
            out.append(
                f"the {len(numbers)} terms of {head.effect} on {head.joint} cancel each other: on "
                f"these logs they are {times:.0f} times as large as their sum. None of these numbers "
                "is the joint's own, and where no log was it may say anything"
            )
    return out
