"""Whether one signal was logged under two joints' names."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from ..fault import WARNING, Fault
from ..look import Look

AFTER, SENSELESS = 1, ()


def find(look: Look) -> Iterator[Fault]:
    """joint_order, of two joints whose columns are one signal.

    Noise alone keeps two measurements from being equal in every sample; a warning, as joints that
    a mechanism couples may share one encoder.
    """
    for log in look.logs:
        tally = log.tally
        for k, (word, spread) in enumerate((("angle", tally.travel), ("torque", tally.swing))):
            for i, j in combinations(range(look.robot.dof), 2):
                # two that stand still, or whose torque is not used, are equal and tell nothing
                if tally.equal[k, i, j] and spread[i] > 0.0:
                    one, other = look.robot.joints[i], look.robot.joints[j]
                    yield Fault(
                        "joint_order", WARNING,
                        f"the {word} of {one} and of {other} are equal in every sample of "
                        f"{log.log.name}",
                        "is one of them logged under the other's name? correct the logger or "
                        "data.columns",
                        other, log.log.name, rows=log.samples,
                    )  # fmt: skip
