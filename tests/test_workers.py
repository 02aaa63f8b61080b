"""Work shared by processes: the same results, in order; a worker that dies is replaced; what is missing is named."""

import os
import sys
import time

import numpy as np
import pytest

import sysid
from sysid.errors import SysidError
from sysid.workers import crew
from tests.test_fleet import robots


def squared(k: int, folder: str) -> tuple[int, float]:
    """Work that ends its first worker half-way."""
    mark = os.path.join(folder, "died")
    if k == 3 and not os.path.exists(mark):
        open(mark, "w").close()
        os._exit(1)
    return k, float(np.sqrt(k))


@pytest.fixture(scope="module")
def two():
    """Two workers of this machine: what maps, what was told, the scheduler's address."""
    distributed, told = pytest.importorskip("distributed"), []
    with crew(2, tell=told.append) as mapped:
        yield mapped, told, distributed.default_client().scheduler.address


@pytest.mark.long
def test_a_worker_that_dies_is_replaced_and_changes_nothing(two, tmp_path):
    mapped, told, _ = two
    found = list(mapped(squared, [(k, str(tmp_path)) for k in range(8)]))
    assert (tmp_path / "died").exists() and found == [(k, float(np.sqrt(k))) for k in range(8)]
    assert told[0].startswith("dashboard: http")


def marked(path: str) -> None:
    """Work that leaves a trace."""
    open(path, "w").close()


def test_other_processes_begin_before_the_first_result_is_asked_for(two, tmp_path):
    found = two[0](marked, [(str(tmp_path / "begun"),)])
    until = time.monotonic() + 30.0
    while not (tmp_path / "begun").exists() and time.monotonic() < until:
        time.sleep(0.02)
    assert (tmp_path / "begun").exists() and list(found) == [None]


def test_workers_are_told_how_often_to_look_after_themselves(two):
    """At Dask's own intervals a process that waits is busy with it."""
    config = pytest.importorskip("dask.config")
    for key in ("distributed.admin.tick.interval", "distributed.worker.memory.monitor-interval"):
        assert list(two[0](config.get, [(key,)])) == ["1s"]


@pytest.mark.long
def test_a_fleet_does_not_depend_on_who_fits(two, planar, tmp_path):
    folder = robots(planar, tmp_path, 4)
    (folder / "r3" / "train.csv").write_text("nothing")
    one, other = (sysid.fleet([folder], scheduler=address) for address in (None, two[2]))
    assert [m.name for m in one.members] == [m.name for m in other.members] == ["r0", "r1", "r2"]
    assert one.failed == other.failed and "r3" in one.failed[0][0]
    np.testing.assert_allclose(one.values, other.values, rtol=1e-10)
    np.testing.assert_allclose(one.judged.p, other.judged.p, rtol=1e-8)


def test_one_process_needs_no_dask_and_more_say_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with crew() as mapped:
        assert list(mapped(max, [(1, 2), (3, 0)])) == [2, 3]
    with pytest.raises(SysidError, match=r"sysid\[dask\]"), crew(2):
        pass
    with pytest.raises(SysidError, match="1 or more"), crew(0):
        pass


def test_a_scheduler_that_is_not_there_is_named(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("sysid.workers._PATIENCE", 1)
    with pytest.raises(SysidError, match="tcp://127.0.0.1:9"), crew(scheduler="tcp://127.0.0.1:9"):
        pass
