"""Work on many things: one after another in this process, in processes of this machine, or on a Dask cluster.

What comes back does not depend on where it was done: every piece of work is by itself, and results come in the order of what was
given. A worker that dies is replaced and its work is done again.
"""

from __future__ import annotations

import logging
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice

from .errors import SysidError, SysidWarning
from .free_memory import kept
from .threads import single_threaded
from .warned import unheard, warn

_DEATHS = 3  # of workers at one piece of work, after which it is given up
_PATIENCE = 10  # s to find a scheduler
_AHEAD = 4  # pieces of work for each thread of the workers that wait: none of them is ever idle
# Bytes: where the C library's own adjustment ends (man mallopt). Dask bids its workers give what is
# free back at once, and to be given each array's pages again costs as much as what is done with
# them.
_FREE, _APART = 2**26, 2**25
# Of processes that this one starts: one thread each; memory from one heap, which grows and stays,
# where each thread's own would be given back and taken again; no sampling of where they are. And
# they look after themselves by the second: at Dask's own fiftieth of one the command and two
# workers that wait spend a tenth of a core on it.
_OURS = {
    "distributed.nanny.pre-spawn-environ": {
        **dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), 1),
        "MALLOC_ARENA_MAX": 1,
    },
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.admin.system-monitor.gil.enabled": False,
}
_UNKNOWN = 64  # pieces of work that wait where no worker is there yet

Mapped = Callable[[Callable, Iterable[tuple]], Iterator]


class Died(SysidError):
    """A piece of work whose workers died."""


@contextmanager
def crew(
    workers: int = 1, scheduler: str | None = None, tell: Callable[[str], None] | None = None
) -> Iterator[Mapped]:
    """Gives `mapped(work, arguments)`, an iterator over `work(*each)` for each of the arguments, in their order. Other processes
    begin before it is asked for the first.

    Args:
        workers: processes of this machine; one is this process itself. scheduler: address of a Dask scheduler in their place,
            tcp://host:8786; the workers see the files under the same paths, and have sysid. tell: is told where the dashboard is.

    Raises:
        SysidError: Dask is not installed, or no scheduler is there. Died: in `mapped`, where a piece of work ends each worker.
    """
    if workers < 1:
        raise SysidError(f"{workers} workers", allowed="1 or more")
    if workers == 1 and scheduler is None:
        yield lambda work, arguments: (work(*each) for each in arguments)
        return
    client, cluster = _joined(workers, scheduler)
    try:
        if tell:
            tell(f"dashboard: {client.dashboard_link}")
        yield lambda work, arguments: _gathered(client, work, arguments)
    finally:
        client.close()
        if cluster is not None:
            cluster.close()


def _joined(workers: int, scheduler: str | None):
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise SysidError(
            "more than one process needs Dask, which is not installed",
            do="pip install 'sysid[dask]'",
        ) from None
    dask.config.set({"distributed.scheduler.allowed-failures": _DEATHS, **_OURS})
    if scheduler is not None:
        try:
            return Client(scheduler, timeout=_PATIENCE), None
        except (OSError, ValueError) as error:
            said = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise SysidError(
                f"no Dask scheduler answers ({said})",
                where=scheduler,
                allowed="tcp://HOST:PORT of `dask scheduler`",
            ) from None
    cluster = LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,
    )
    return Client(cluster), cluster


def _gathered(client, work: Callable, arguments: Iterable[tuple]) -> Iterator:
    from distributed import KilledWorker

    def submitted(each: tuple):
        with unheard():  # Dask's, of arguments that are large
            return client.submit(_worked, work, each, pure=False)

    rest = iter(arguments)
    ahead = _AHEAD * sum(client.ncores().values()) or _UNKNOWN
    futures = deque(submitted(each) for each in islice(rest, ahead))

    def results() -> Iterator:
        number = 0
        while futures:
            number += 1
            try:
                result, said = futures.popleft().result()
            except KilledWorker:
                raise Died(
                    f"{_DEATHS} workers died at piece {number}", do="give workers more memory"
                ) from None
            futures.extend(submitted(each) for each in islice(rest, 1))
            for warning in said:
                if isinstance(warning, SysidWarning):
                    warn(str(warning))
                else:
                    warnings.warn(warning, stacklevel=2)
            yield result

    return results()


@single_threaded
def _worked(work: Callable, each: tuple) -> tuple:
    """What a piece of work gives, and the warnings that it gave."""
    kept(_FREE, _APART)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        result = work(*each)
    return result, [one.message for one in said]
