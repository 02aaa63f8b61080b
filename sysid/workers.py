"""Work on many things: one after another in this process, in processes of this machine, or on a Dask cluster.

What comes back does not depend on where it was done: every piece of work is by itself, and results come in the order of what was
given. A worker that dies is replaced and its work is done again.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from .errors import SysidError

_DEATHS = 3  # of workers at one piece of work, after which it is given up
_PATIENCE = 10  # s to find a scheduler

Mapped = Callable[[Callable, Iterable[tuple]], Iterator]


class Died(SysidError):
    """A piece of work whose workers died."""


@contextmanager
def crew(
    workers: int = 1, scheduler: str | None = None, tell: Callable[[str], None] | None = None
) -> Iterator[Mapped]:
    """Gives `mapped(work, arguments)`, an iterator over `work(*each)` for each of the arguments, in their order.

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
    dask.config.set({"distributed.scheduler.allowed-failures": _DEATHS})
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

    futures = [client.submit(work, *each, pure=False) for each in arguments]
    for number in range(len(futures)):
        try:
            result = futures[number].result()
        except KilledWorker:
            raise Died(
                f"{_DEATHS} workers died at piece {number + 1} of {len(futures)}",
                do="give workers more memory",
            ) from None
        futures[number] = None  # what was taken need not be kept
        yield result
