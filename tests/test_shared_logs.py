"""Long logs shared by processes: what is found does not depend on who did the work."""

import os

import numpy as np
import polars as pl
import pytest

import sysid
from sysid import experiment_logs, filters, long_prediction, pipeline, spans
from sysid.workers import crew
from tests.test_long_logs import LEG, experiment, leg_table

SHORT = 1100


def shortened() -> None:
    spans.SPAN = SHORT


def mortal() -> None:
    """Ends this worker as soon as it predicts."""
    long_prediction.predict = lambda *_: os._exit(1)


@pytest.fixture(scope="module")
def cluster():
    """Two workers of this machine: the client."""
    distributed = pytest.importorskip("distributed")
    with crew(2):
        yield distributed.default_client()


@pytest.fixture
def short_spans(cluster, monkeypatch):
    monkeypatch.setattr(spans, "SPAN", SHORT)
    cluster.run(shortened)


def address(cluster) -> str:
    return cluster.scheduler.address


def same(one, other) -> None:
    np.testing.assert_allclose(other.x, one.x, rtol=1e-10, atol=1e-12)
    assert one.logs == other.logs and one.notices == other.notices and one.events == other.events
    assert one.samples == other.samples and one.left_out == other.left_out
    assert one.filters == other.filters and one.filters  # to the last bit
    for part in ("train", "test"):
        ours, theirs = one.predictions[part], other.predictions[part]
        for name in ("t", "measured", "predicted"):
            np.testing.assert_allclose(getattr(theirs, name), getattr(ours, name), rtol=1e-10)
        assert theirs.told() == pytest.approx(ours.told(), rel=1e-10)
        np.testing.assert_array_equal(theirs.states.index, ours.states.index)


@pytest.mark.long
@pytest.mark.parametrize("how", [{}, {"torque": "low-pass", "window": 0.03, "cutoff": 150.0}])
def test_long_logs_are_fitted_alike_by_any_number_of_workers(how, short_spans, cluster):
    spec = experiment(preprocess=how)
    one, two = sysid.fit(spec), sysid.fit(spec, scheduler=address(cluster))
    assert len(two.predictions["train"].files) > 2
    same(one, two)


@pytest.mark.long
@pytest.mark.parametrize("how", [{"window": "auto"}, {"filter": "butterworth", "cutoff": 20.0}, {}])
def test_filters_are_compared_where_the_workers_are(how, short_spans, cluster, monkeypatch):
    """One that is chosen before the logs go through it, one that is given meanwhile."""
    spec = experiment(preprocess=how)
    one = sysid.fit(spec)
    monkeypatch.setattr(filters, "held_out", None)
    two = sysid.fit(spec, scheduler=address(cluster))
    assert len(two.filters["held_out"]) == len(one.filters["held_out"]) >= 3
    same(one, two)


@pytest.mark.long
def test_models_that_have_their_logs_whole_are_fitted_alike(cluster):
    spec = experiment()
    stribeck = type(spec.model.effects[0])(name="stribeck", joints=["knee"])
    effects = spec.model.model_copy(update={"effects": [*spec.model.effects, stribeck]})
    spec = spec.model_copy(update={"model": effects})
    same(sysid.fit(spec), sysid.fit(spec, scheduler=address(cluster)))


@pytest.mark.long
def test_a_worker_that_dies_changes_nothing(short_spans, cluster):
    one = sysid.fit(experiment())
    before = set(cluster.scheduler_info()["workers"])
    cluster.run(mortal, workers=[min(before)])
    same(one, sysid.fit(experiment(), scheduler=address(cluster)))
    assert min(before) not in cluster.scheduler_info()["workers"]


def test_a_log_that_cannot_be_read_is_named(short_spans, cluster, tmp_path):
    values = leg_table()["tau_hip"].to_list()
    values[2500] = np.nan
    leg_table().with_columns(pl.Series("tau_hip", values)).write_parquet(tmp_path / "bad.parquet")
    with pytest.raises(sysid.SysidError, match=r"bad.parquet row 2500.*finite"):
        sysid.fit(experiment(tmp_path / "bad.parquet"), scheduler=address(cluster))


@pytest.mark.long
def test_another_machine_sends_what_it_predicts(monkeypatch, tmp_path):
    """One that does not see the folder in which this process gathers predictions."""
    monkeypatch.setattr(spans, "SPAN", SHORT)
    spec = experiment()
    machine, structure, prior = pipeline.build(spec)
    (log,) = experiment_logs.read(spec, machine, spec.data.test, structure=structure)
    motion = pipeline.prepare([log], spec.preprocess, machine.joints)
    x = np.append(prior.ravel(), np.zeros(len(structure.coefficients)))
    here = long_prediction.predicted(structure, x, motion)
    path, rows = tmp_path / "nowhere" / "0.parquet", motion.samples
    part = long_prediction._part(motion.pieces[0], structure, x, motion, 0, rows, path)
    assert not path.parent.exists()
    (tmp_path / "sent.parquet").write_bytes(part.content)
    assert pl.read_parquet(tmp_path / "sent.parquet").equals(pl.read_parquet(here.files[0]))


@pytest.mark.long
def test_the_command_takes_workers(tmp_path):
    from typer.testing import CliRunner

    from sysid.cli.command_line import app

    pytest.importorskip("distributed")
    command = ["fit", str(LEG), "--workers", "2", "--out", str(tmp_path)]
    ran = CliRunner().invoke(app, command)
    assert ran.exit_code == 0, ran.output
    assert "dashboard: http" in ran.output + ran.stderr and (tmp_path / "fit.json").exists()
