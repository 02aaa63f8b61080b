"""What trains and what tests must be two recordings, and every torque a measurement."""

from __future__ import annotations

from collections.abc import Iterator

from ...log import overlapping
from ...same_samples import Same, same, sampled, told
from ..fault import ERROR, WARNING, Fault
from ..look import Look

AFTER, SENSELESS = 0, ()
_ANOTHER = "give data.test another recording, or another piece of this one"


def find(look: Look) -> Iterator[Fault]:
    """test_is_train: a test log that is a training log or holds samples of one, whatever its name.
    commanded_torque: a torque that is another log's, sample by sample, under another motion."""
    tests = {id(log.spec): log for log in look.part("test")}.values()  # an entry may have parts
    known = set()
    for test in tests:
        for train in look.part("train"):
            hashes = test.log.hashes.values(), train.log.hashes.values()
            if overlapping(test.spec, hashes[0], train.spec, hashes[1]):
                known.add(test.log.name)
                yield Fault(
                    "test_is_train",
                    ERROR,
                    (
                        f"{test.log.name} holds the same samples as the training log "
                        f"{train.log.name}: "
                        "an error on it is not held out"
                    ),
                    _ANOTHER,
                    log=test.log.name,
                    times=(max(test.spec.start or 0.0, train.spec.start or 0.0),),
                    rows=test.samples,
                )
                break
    # of a long log stretches alone stand in memory: those of two need not meet
    short = [log for log in look.logs if sum(len(own.t) for own in log.shown) == log.samples]
    samples = [sampled(log.log.name, log.part, log.shown) for log in short]
    for found in same(samples) if len(short) > 1 else ():
        if not known.issuperset(one.name for one in found.others):
            yield _fault(found)


def _fault(found: Same) -> Fault:
    first, other = found.first, found.others[0]
    at = {"log": other.name, "times": (found.since,), "rows": found.rows}
    if found.moved:
        do = "log what the drive measured, and leave out of the experiment what was not"
        return Fault("commanded_torque", WARNING, told(found), do, **at)
    if (first.part, other.part) == ("train", "test"):
        return Fault("test_is_train", ERROR, told(found), _ANOTHER, **at)
    do = f"leave one of them out of data.{other.part}"
    return Fault("test_is_train", WARNING, told(found), do, **at)
