"""What trains and what tests must be two recordings."""

from __future__ import annotations

from collections.abc import Iterator

from ...log import overlapping
from ..fault import ERROR, Fault
from ..look import Look

AFTER, SENSELESS = 0, ()


def find(look: Look) -> Iterator[Fault]:
    """test_is_train: a test log that is a training log, whatever its name."""
    tests = {id(log.spec): log for log in look.part("test")}.values()  # an entry may have parts
    for test in tests:
        for train in look.part("train"):
            hashes = test.log.hashes.values(), train.log.hashes.values()
            if overlapping(test.spec, hashes[0], train.spec, hashes[1]):
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
                    rows=test.samples,
                )
                break
