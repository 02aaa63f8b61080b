"""A diagnosis of logs whose columns are not read as they were written names nothing on joints that are not at their floor."""

import shutil
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from scripts.blind_parts.robots import experiment_of
from sysid import pipeline
from sysid.diagnose.diagnosis import diagnose
from sysid.misread import misread, unasked
from sysid.plausible import BEGINS, WRONG
from sysid.simulate import simulate, write
from sysid.statement.document import document


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """The planar arm whose elbow has its torque with the other sign."""
    folder = tmp_path_factory.mktemp("turned")
    experiment, machine = experiment_of("planar", folder)
    write(simulate(machine, seed=5, duration=15.0, rate=200.0), experiment, folder / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(folder / "logs" / name)
        table.with_columns(-pl.col("tau_elbow")).write_csv(folder / "logs" / name)
    return folder / "logs"


def test_what_is_wrong_with_the_columns_comes_first(turned):
    told = document(diagnose(pipeline.load(turned)))
    (first,) = [notice for notice in told["notices"] if WRONG in notice]
    assert first.startswith(f"{BEGINS}: {WRONG}: the torque of elbow has the sign against the URDF's") and "data.torque: {elbow: {tau_elbow: -1}}" in first
    assert told["findings"] == [] and told["next_log"] is None
    assert {v["status"] for v in told["verdict"]} <= {"unresolved", "complete"}
    (elbow,) = [v for v in told["verdict"] if v["joint"] == "elbow"]
    assert elbow["status"] == "unresolved" and "columns of these logs look wrong" in elbow["says"]


@pytest.mark.parametrize(
    "column, factor, said", [("tau_", 1e3, "the torques in test.csv are 1000 times what"), ("q_", 180.0 / np.pi, "2 such in all: shoulder, elbow")]
)
def test_a_test_log_in_another_unit_is_told_once_and_nothing_is_made_of_it(column, factor, said, turned, tmp_path):
    logs = shutil.copytree(turned, tmp_path / "logs")
    mended = pl.read_csv(logs / "train.csv").with_columns(-pl.col("tau_elbow"))
    mended.write_csv(logs / "train.csv")
    table = pl.read_csv(logs / "test.csv").with_columns(-pl.col("tau_elbow"))
    table.with_columns(pl.col(*(name for name in table.columns if name.startswith(column))) * factor).write_csv(logs / "test.csv")
    told = document(diagnose(pipeline.load(logs)))
    (first,) = [notice for notice in told["notices"] if WRONG in notice]
    assert said in first and told["next_log"] is None and told["findings"] == []


def test_a_fit_that_explains_its_torques_is_not_asked(monkeypatch):
    def asked(_):
        raise AssertionError("the logs were read again")

    monkeypatch.setattr("sysid.check.misread", asked)
    prediction = SimpleNamespace(errors=lambda: {"r2": np.array([0.99, np.nan])})
    assert misread(SimpleNamespace(predictions={"test": prediction}, notices=("a note",), experiment=None)) == []
    with pytest.raises(AssertionError):
        misread(SimpleNamespace(predictions={"test": prediction}, notices=(f"{BEGINS} masses",), experiment=None))


def test_joints_at_their_floor_stay_complete():
    from sysid.diagnose.verdict import Verdict

    each = [Verdict("a", "complete"), Verdict("b", "unknown", left=None, says="x"), Verdict("c", "unresolved", says="y", even=True)]
    assert [v.status for v in unasked(each)] == ["complete", "unresolved", "unresolved"]
    assert not any(v.even for v in unasked(each)) and unasked(each)[0].says == ""
