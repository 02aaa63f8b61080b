"""Logs that are checked span by span: what is found of them is what is found of the log as one."""

import shutil

import numpy as np
import polars as pl
import pytest

from scripts.blind_parts.robots import experiment_of
from sysid import check, pipeline, robot, spans, thinning
from sysid.check.look import looked
from sysid.check.samples import Samples
from sysid.check.tally import tallied
from sysid.readers.parquet import ParquetTable
from sysid.simulate import simulate, write

RATE, SECONDS, SPAN = 500.0, 30.0, 4000
MIDDLE = 8123  # a row, of 15 001
EDGE = 7500  # the first of the third span


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The planar arm's logs as Parquet."""
    folder = tmp_path_factory.mktemp("logs")
    experiment, machine = experiment_of("planar", folder)
    write(simulate(machine, seed=5, duration=SECONDS, rate=RATE), experiment, folder / "logs")
    for part in ("train", "test"):
        pl.read_csv(folder / "logs" / f"{part}.csv").write_parquet(
            folder / "logs" / f"{part}.parquet", row_group_size=1000
        )
    config = folder / "logs" / "config.yaml"
    config.write_text(config.read_text().replace(".csv", ".parquet"))
    return folder / "logs"


def spoiled(made, tmp_path, change):
    """A copy of the logs whose training log is changed: change({column: values})."""
    logs = shutil.copytree(made, tmp_path / "logs")
    columns = {name: values.to_numpy().copy() for name, values in columns_of(logs).items()}
    change(columns)
    pl.DataFrame(columns).write_parquet(logs / "train.parquet", row_group_size=1000)
    return logs


def columns_of(logs):
    return pl.read_parquet(logs / "train.parquet").to_dict()


def wrapped(row):
    def change(columns):
        columns["q_elbow"][row:] += 2.0 * np.pi

    return change


def spiked(row):
    def change(columns):
        columns["tau_elbow"][row] += 40.0 * np.std(columns["tau_elbow"])

    return change


def gap(row):
    def change(columns):
        columns["t"][row:] += 0.5

    return change


def held(row):
    def change(columns):
        columns["q_elbow"][row : row + 25] = columns["q_elbow"][row]

    return change


def beyond(row):
    def change(columns):
        columns["q_elbow"][row : row + 3] = -3.5

    return change


def fast(row):
    def change(columns):
        columns["q_shoulder"][:] = 3.0 * np.sin(15.0 * columns["t"])

    return change


def twice(row):
    def change(columns):
        columns["tau_elbow"][:] = columns["tau_shoulder"]

    return change


def again(row):
    def change(columns):
        for name in columns.keys() - {"t"}:
            columns[name][1::2] = columns[name][:-1:2]

    return change


def dead(row):
    def change(columns):
        columns["tau_elbow"][:] = 0.0

    return change


PLANTED = {
    "angle_wrap": wrapped, "spikes": spiked, "clock_gap": gap, "values_held": held,
    "limit_exceeded": beyond, "limit_exceeded ": fast, "joint_order": twice,
    "values_held ": again, "effort_missing": dead,
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("row", [MIDDLE, EDGE])
@pytest.mark.parametrize("fault", PLANTED)
def test_what_is_wrong_in_a_long_log_is_found_with_its_time(
    fault, row, made, tmp_path, monkeypatch
):
    logs = spoiled(made, tmp_path, PLANTED[fault](row))
    whole = [f for f in check.check(pipeline.load(logs)) if f.fault == fault.strip()]
    monkeypatch.setattr(spans, "SPAN", SPAN)
    found = [f for f in check.check(pipeline.load(logs)) if f.fault == fault.strip()]
    assert whole and [(f.joint, f.log, f.severity) for f in found] == [
        (f.joint, f.log, f.severity) for f in whole
    ]
    for one, other in zip(whole, found):
        assert other.rows == one.rows and other.times == pytest.approx(one.times, abs=1e-9)
    t = columns_of(logs)["t"].to_numpy()
    if fault in ("angle_wrap", "spikes", "limit_exceeded"):
        assert found[0].times[0] == pytest.approx(t[row], abs=1e-6)
    if fault in ("clock_gap",):
        assert found[0].times[0] == pytest.approx(t[row - 1], abs=1e-6)


def test_a_clean_long_log_has_no_fault_of_which_stretches_tell(made, monkeypatch):
    monkeypatch.setattr(spans, "SPAN", SPAN)
    monkeypatch.setattr(thinning, "MOST", 8000)
    assert check.check(pipeline.load(made)) == []


@pytest.mark.parametrize("fault", ["joint_order", "sign_flipped"])
def test_stretches_tell_what_holds_of_the_whole_log(fault, made, tmp_path, monkeypatch):
    def change(columns):
        if fault == "sign_flipped":
            columns["tau_elbow"] *= -1.0
        else:
            own = columns["tau_elbow"].copy()
            columns["tau_elbow"][:], columns["tau_shoulder"][:] = columns["tau_shoulder"], own

    monkeypatch.setattr(spans, "SPAN", SPAN)
    monkeypatch.setattr(thinning, "MOST", 8000)
    found = check.check(pipeline.load(spoiled(made, tmp_path, change)))
    assert fault in {f.fault for f in found}


def test_no_long_log_stands_in_memory(made, monkeypatch):
    """No more rows than a span with its neighbours are read at once, and stretches of them kept."""
    asked = []
    values = ParquetTable._values

    def counted(self, name):
        asked.append(self.rows if self._part is None else self._part[1])
        return values(self, name)

    monkeypatch.setattr(ParquetTable, "_values", counted)
    monkeypatch.setattr(spans, "SPAN", SPAN)
    monkeypatch.setattr(thinning, "MOST", 8000)
    look = looked(pipeline.load(made))
    (train,) = look.part("train")
    assert train.samples == 15_001 and max(asked) == SPAN + 2048
    assert sum(len(own.t) for own in train.shown) < 8000 + SPAN
    assert sum(len(s.t) for s in train.log.segments) < 8000 + SPAN


@pytest.mark.parametrize("cuts", [[500], [3, 5, 900], [1, 2, 998, 999]])
def test_a_log_in_parts_tells_what_it_tells_as_one(cuts, made):
    """To the last bit, wherever it is cut, what stands about a cut included."""
    machine = robot.load(pipeline.load(made).robot, made)
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.choice([0.002, 0.0022, 0.1], 1000, p=[0.97, 0.02, 0.01]))
    q, tau = np.cumsum(rng.normal(size=(1000, 2)), axis=0) * 0.3, rng.normal(size=(1000, 2))
    for row in (2, 499, 500, 501, 899, 900):
        q[row:, 0] += 2.0 * np.pi
        q[row], tau[row] = q[row - 1], tau[row - 1]
    whole = tallied([Samples(t, q, tau)], 0.002, machine)
    parts = [Samples(*each) for each in zip(*(np.split(own, cuts) for own in (t, q, tau)))]
    found = tallied(parts, 0.002, machine)
    assert found.off == pytest.approx(whole.off, rel=1e-12)
    for name in (
        "samples", "begin", "end", "joints", "gaps", "late", "regular", "worst", "again",
    ):  # fmt: skip
        assert getattr(found, name) == getattr(whole, name), name
    for name in ("low", "high", "first", "equal"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    assert whole.gaps.count and whole.late.count and whole.again.count
    assert whole.joints[0].wraps.count and whole.joints[0].far.count and whole.joints[0].fast.count
