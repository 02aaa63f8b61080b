"""What trains and what tests must be two recordings."""

from __future__ import annotations

from collections.abc import Iterator

from ..fault import ERROR, Fault
from ..look import Look

AFTER, SENSELESS = 0, ()


def find(look: Look) -> Iterator[Fault]:
    """test_is_train: a test log that is a training log, whatever its name."""
    for test in look.part("test"):
        for train in look.part("train"):
            if test.log.sha256 == train.log.sha256 and test.spec.overlaps(train.spec):
                yield Fault(
                    "test_is_train",
                    ERROR,
                    (
                        f"{test.log.name} holds the same samples as the training log "
                        f"{train.log.name}: "
                        "an error on it is not held out"
                    ),
                    "give data.test another recording, or another piece of this one",
                    log=test.log.name,
                    times=(max(test.spec.start or 0.0, train.spec.start or 0.0),),
                    rows=len(test.t),
                )
                break
