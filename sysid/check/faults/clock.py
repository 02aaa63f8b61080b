"""What stamps show by themselves."""

from __future__ import annotations

from collections.abc import Iterator

from ...lowpass import band
from ..fault import ERROR, WARNING, Fault
from ..look import Logged, Look
from ..tally import JITTER

AFTER, SENSELESS = 0, ()
_STEPS = (2e-5, 0.5)  # s from sample to sample: no logger of a robot is faster or slower
# Samples in a cycle of the fastest motion, and a second: accelerations need some, and what friction
# does at a reversal none more than that
_CYCLE, _FAST = 20.0, 120.0
_EVEN = 1e-3  # of a step: stamps that are off by less are even


def find(look: Look) -> Iterator[Fault]:
    """wrong_unit of time; clock_gap, clock_jitter, slow_logger."""
    for log in look.logs:
        if not _STEPS[0] <= log.step <= _STEPS[1]:
            yield _unit(log, look)
            continue
        gaps, jitter = log.tally.gaps, log.tally.jitter
        if gaps.count:
            yield Fault(
                "clock_gap",
                WARNING,
                (
                    f"{gaps.count} gap{'s' * (gaps.count > 1)} in {log.log.name}, the longest "
                    f"{gaps.most:.3g} s at {gaps.at:.4g} s"
                ),
                "the log is split there; log without gaps",
                log=log.log.name,
                times=gaps.times,
                rows=gaps.count,
            )
        if jitter > JITTER * log.step:
            yield Fault(
                "clock_jitter",
                WARNING,
                (
                    f"the stamps of {log.log.name} are {1e3 * jitter:.2g} ms (RMS) off a "
                    f"steady step of {1e3 * log.step:.3g} ms"
                ),
                (
                    "log with the time at which the values were taken; they are resampled, "
                    "and what the angles show of their time is corrected"
                ),
                log=log.log.name,
                times=(log.tally.worst.at,),
                rows=log.tally.late.count,
            )
        elif jitter < _EVEN * log.step and (off := _off(log)):
            yield Fault(
                "clock_jitter",
                WARNING,
                (
                    f"the stamps of {log.log.name} are even and its samples were not: its joints' "
                    f"angles agree that they were taken about {1e3 * off:.2g} ms off their stamps"
                ),
                (
                    "log with the time at which the values were taken; what the angles show of "
                    "their time is corrected"
                ),
                log=log.log.name,
                rows=log.samples,
            )
        fastest = band([log.log])
        if fastest * log.step * _CYCLE > 1.0 and log.step * _FAST > 1.0:
            yield Fault(
                "slow_logger",
                WARNING,
                (
                    f"{log.log.name} has {1.0 / log.step:.3g} samples a second for motion "
                    f"of up to {fastest:.2g} Hz: {1.0 / (fastest * log.step):.2g} a cycle"
                ),
                f"log at {min(_CYCLE * fastest, _FAST):.0f} Hz or more, or move slower",
                log=log.log.name,
                rows=log.samples,
            )


def _off(log: Logged) -> float:
    """Deviation [s] of a stamp's error, zero where none was corrected."""
    return max((s.clock.deviation for s in log.log.segments if s.clock is not None), default=0.0)


def _unit(log: Logged, look: Look) -> Fault:
    alike = all(not _STEPS[0] <= one.step <= _STEPS[1] for one in look.logs)
    return Fault(
        "wrong_unit",
        ERROR,
        (
            f"{log.log.name} has {log.step:.3g} s from sample to sample, "
            f"{log.tally.end - log.tally.begin:.4g} s in all"
        ),
        "set data.units.time (s, ms, us, ns)"
        if alike
        else "its stamps are in another unit than the other logs': give them in the same",
        log=log.log.name,
        rows=log.samples,
    )
