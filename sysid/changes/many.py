"""Many new logs, each asked what is different on it, while one model is held: what does not depend
on a log is read once."""

from __future__ import annotations

import glob
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from .. import datasets
from ..errors import LogError, SysidError
from .held import Held, held
from .new_log import RATE, Changed, asked

_TOGETHER = 8  # logs that a process takes at once


def many(
    run: Path,
    logs: Iterable[str],
    levels: Mapping[str, str] | None = None,
    *,
    rate: float = RATE,
    jobs: int = 1,
    progress: Callable[[float], None] | None = None,
) -> tuple[dict[str, Changed], dict[str, str]]:
    """What is different on each of many logs, {log: changes}, in the order given; and {log: why} of
    those that cannot be read.

    Args:
        run: a run folder of `sysid fit`, which also says how logs are read.
        logs: files, patterns, names of public logs.
        levels: {group: level} of the logs, of every group that effects of the run are per.
        rate: of false alarms, the probability that any of these logs is called changed by chance.
        jobs: processes.

    Raises:
        SysidError: no such run or level, or no log.
    """
    paths = listed(logs)
    share = rate, len(paths)
    if jobs == 1 or len(paths) <= _TOGETHER:
        model = held(run, None, levels)
        parts = (_asked(model, [path], share) for path in paths)
    else:
        from joblib import Parallel, delayed

        held(run, None, levels)  # what is wrong with it is told here, once
        heaps = [paths[k : k + _TOGETHER] for k in range(0, len(paths), _TOGETHER)]
        work = (delayed(_asked_of)(run, levels, heap, share) for heap in heaps)
        parts = Parallel(n_jobs=jobs, return_as="generator")(work)
    found: dict[str, Changed] = {}
    failed: dict[str, str] = {}
    for own, wrong in parts:
        found |= own
        failed |= wrong
        if progress:
            progress((len(found) + len(failed)) / len(paths))
    return found, failed


def _asked_of(
    run: Path, levels, logs: list[str], share
) -> tuple[dict[str, Changed], dict[str, str]]:
    """`_asked` in a process of its own, which keeps the model from heap to heap."""
    key = (str(run), tuple(sorted((levels or {}).items())), os.stat(run / "fit.json").st_mtime_ns)
    if key not in _KEPT:
        _KEPT.clear()
        _KEPT[key] = held(run, None, levels)
    return _asked(_KEPT[key], logs, share)


_KEPT: dict[tuple, Held] = {}


def _asked(
    model: Held, logs: list[str], share: tuple[float, int]
) -> tuple[dict[str, Changed], dict[str, str]]:
    found, failed = {}, {}
    for log in logs:
        try:
            found[log] = asked(model, [log], rate=share[0], among=share[1])
        except SysidError as error:
            failed[log] = str(error)
    return found, failed


def listed(logs: Iterable[str]) -> list[str]:
    """Every log that is meant, once. Raises LogError: nothing is there."""
    out: dict[str, None] = {}
    for one in map(str, logs):
        if datasets.reference(one) is not None or Path(one).exists():
            here = [one]
        else:
            here = sorted(glob.glob(one))
        if not here:
            raise LogError("no log is there", where=one, allowed="a log, or a pattern")
        out |= dict.fromkeys(here)
    return list(out)
