"""Long logs in spans: what is found of them is what is found of the log as one."""

import warnings
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

import sysid
from sysid import (
    cli,
    config,
    events,
    experiment_logs,
    free_memory,
    long_log,
    long_motion,
    long_prediction,
    outliers,
    pipeline,
    preprocess,
    results,
    spans,
    thinning,
)  # fmt: skip
from sysid import log as logs
from sysid.events import Event
from sysid.fleet import members
from sysid.motion import Pieces
from sysid.segment import Segment

LEG = Path(__file__).resolve().parent.parent / "configs" / "cheetah3.yaml"


@pytest.fixture
def short_spans(monkeypatch):
    monkeypatch.setattr(spans, "SPAN", 1100)


def experiment(path=None, *, preprocess=None, train=None, **data):
    found = config.load(LEG)
    own = found.data.model_copy(update=data)
    if path is not None:
        entry = {"file": str(path), **(train or {})}
        own = own.model_copy(update={"train": [type(found.data.train[0])(**entry)]})
    how = found.preprocess if preprocess is None else type(found.preprocess)(**preprocess)
    return found.model_copy(update={"data": own, "preprocess": how})


def leg_table():
    return pl.read_parquet(LEG.parent.parent / "data" / "cheetah3" / "train.parquet")


EVERY_ROW = {"standstill": "keep", "events": "keep"}
FILTERS = [
    {}, {"torque": "same"}, {"filter": "butterworth", "cutoff": 20.0},
    {"torque": "low-pass", "window": 0.03, "cutoff": 150.0},
]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("filter_", FILTERS, ids=str)
def test_a_log_in_spans_is_fitted_as_the_log_as_one(filter_, monkeypatch):
    spec = experiment(preprocess={**EVERY_ROW, **filter_})
    whole = sysid.fit(spec, filters={})
    monkeypatch.setattr(spans, "SPAN", 1100)
    found = sysid.fit(spec, filters={})
    scale = np.maximum(np.abs(whole.x), 1e-3)
    assert np.max(np.abs(found.x - whole.x) / scale) < 1e-9
    assert found.samples == whole.samples and found.left_out == whole.left_out
    assert found.notices == whole.notices and found.logs == whole.logs
    for part in ("train", "test"):
        one, other = whole.predictions[part], found.predictions[part]
        for name in ("log", "t", "measured", "predicted"):
            np.testing.assert_allclose(
                getattr(other, name), getattr(one, name), rtol=1e-9, atol=1e-9
            )
        for key, value in one.errors().items():
            np.testing.assert_allclose(other.errors()[key], value, rtol=1e-9)
        assert other.told() == pytest.approx(one.told(), rel=1e-9)
        np.testing.assert_array_equal(other.greatest(3), one.greatest(3))
        for joint in range(len(one.joints)):  # which is read alone
            for there, here in zip(other.of_joint(joint), one.of_joint(joint)):
                np.testing.assert_allclose(there, here, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(other.states.index, one.states.index)
        np.testing.assert_allclose(other.states.q, one.states.q, atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("standstill", ["auto", "mask", 0.05])
def test_rows_are_left_out_as_of_the_log_as_one(standstill, short_spans):
    """All but jumps, which are judged by what is usual in a span: here the torque has none."""
    spec = experiment(preprocess={"standstill": standstill, "events": "keep"})
    machine, _, _ = pipeline.build(spec)
    read = [
        long_log.read(one, spec.data, machine.joints, machine.prismatic, spec.folder)
        for one in spec.data.train
    ]
    assert isinstance(read[0].segments, spans.Spans)
    whole = [
        logs.read(one, spec.data, machine.joints, machine.prismatic, spec.folder)
        for one in spec.data.train
    ]
    one, found = (
        preprocess.prepare(whole, spec.preprocess, machine.joints),
        long_motion.prepare(read, spec.preprocess, machine.joints),
    )
    assert isinstance(found.pieces, Pieces) and one.samples == found.samples

    def joined(motion, name):
        return np.concatenate([getattr(p, name)[p.core] for p in motion.pieces])

    np.testing.assert_allclose(joined(found, "qdd"), joined(one, "qdd"), rtol=1e-9, atol=1e-9)
    different = np.mean(joined(found, "use") != joined(one, "use"))
    assert different < (
        0.02 if standstill == "auto" else 1e-12
    )  # a span's own noise says how slow is still
    np.testing.assert_allclose(found.standing, one.standing, atol=2e-3 + different)
    assert found.still == one.still and found.left_out == pytest.approx(
        one.left_out, abs=0.02 * one.samples
    )
    np.testing.assert_allclose(found.pieces[0].rest, one.pieces[0].rest, rtol=1e-9)


@pytest.mark.long
def test_a_file_is_read_in_parts_as_in_memory(short_spans, tmp_path):
    """Whatever its row groups, with a gap, a piece of it, and a clock in ns since 1970."""
    table = leg_table()
    t = np.arange(len(table)) * 1_000_000 + 1_700_000_000_000_000_000
    t[3000:] += 40_000_000
    table = table.with_columns(pl.Series("t", t))
    data = {"units": experiment().data.units.model_copy(update={"time": "ns"})}
    found = []
    for groups in (300, 100_000):
        path = tmp_path / f"{groups}.parquet"
        table.write_parquet(path, row_group_size=groups)
        spec = experiment(path, train={"start": 0.2, "stop": 4.5}, **data)
        rest = type(spec.data.train[0])(file=str(path), start=4.5)
        spec = spec.model_copy(update={"data": spec.data.model_copy(update={"test": [rest]})})
        machine, _, _ = pipeline.build(spec)
        (entry,) = spec.data.train
        with pytest.warns(sysid.SysidWarning, match=r"1 gap\(s\), the longest 0.041 s"):
            read = long_log.read(entry, spec.data, machine.joints, machine.prismatic, spec.folder)
        with pytest.warns(sysid.SysidWarning, match=r"1 gap\(s\), the longest 0.041 s"):
            whole = logs.read(entry, spec.data, machine.joints, machine.prismatic, spec.folder)
        assert (
            len(whole.segments) == read.stretches == 2
            and read.samples == whole.samples
            and read.sha256 == whole.sha256
        )
        for name in ("t", "q", "tau"):
            joined = np.concatenate([getattr(s, name) for s in read.segments])
            np.testing.assert_array_equal(
                joined, np.concatenate([getattr(s, name) for s in whole.segments])
            )
        found.append(sysid.fit(spec).x)
    np.testing.assert_allclose(*found, rtol=1e-12)


@pytest.mark.filterwarnings("ignore::sysid.SysidWarning")
def test_bad_values_are_told_with_their_row(short_spans, tmp_path):
    for column, value, said in (
        ("tau_hip", np.nan, "row 2500"),
        ("q_hip", None, "row 2500"),
        ("t", 0.0, "row 2500"),
    ):
        values = leg_table()[column].to_list()
        values[2500] = value
        path = tmp_path / f"{column}.parquet"
        leg_table().with_columns(pl.Series(column, values)).write_parquet(path)
        with pytest.raises(sysid.SysidError, match=said):
            sysid.fit(experiment(path))


@pytest.mark.long
def test_the_run_folder_is_the_same(short_spans, tmp_path, monkeypatch):
    spec = experiment()
    found = sysid.fit(spec)
    assert found.predictions["train"].files
    document = results.write(found, tmp_path / "spans")
    folder = found.predictions["train"].files[0].parent
    read = sysid.read_run(tmp_path / "spans")
    monkeypatch.setattr(spans, "SPAN", 2**18)
    whole = results.write(sysid.fit(spec), tmp_path / "whole")
    a, b = (pl.read_parquet(tmp_path / name / "predictions.parquet") for name in ("spans", "whole"))
    assert a.schema == b.schema and a.height == b.height
    np.testing.assert_allclose(
        a.drop("part").to_numpy(), b.drop("part").to_numpy(), rtol=1e-9, atol=1e-9
    )
    assert document["rms"]["test"] == pytest.approx(whole["rms"]["test"], rel=1e-9)
    assert folder.is_dir() and read.joints == found.joints
    del found
    assert not folder.exists()


def test_models_that_look_back_have_the_log_whole(short_spans):
    spec = experiment()
    effects = [*spec.model.effects, type(spec.model.effects[0])(name="presliding")]
    _, local, _ = pipeline.build(spec)
    machine, structure, _ = pipeline.build(
        spec.model_copy(update={"model": spec.model.model_copy(update={"effects": effects})})
    )
    assert local.local and not structure.local
    (read,) = experiment_logs.read(spec, machine, spec.data.train, structure=structure)
    assert len(read.segments) == 1 and isinstance(read.segments, tuple)


@pytest.mark.long
def test_a_mask_is_one_event_however_many_spans_it_goes_through(short_spans, monkeypatch):
    name = experiment().data.train[0].name
    mask = {"log": name, "start": 0.5, "stop": 3.0}
    spec = experiment(preprocess={"mask": [mask], "standstill": "keep"})
    found = sysid.fit(spec)
    monkeypatch.setattr(spans, "SPAN", 2**18)
    assert found.events == sysid.fit(spec).events and len(found.events) == 1
    one = found.predictions["train"]  # in files; a joint of it is read alone
    measured, predicted, use = one.measured, one.predicted, one.use
    for joint in range(len(one.joints)):
        left = np.where(use[:, joint], measured[:, joint] - predicted[:, joint], np.nan)
        np.testing.assert_array_equal(one.of_joint(joint)[2], left)
    assert one.files and not use.all()


def test_events_go_on_from_span_to_span():
    one = lambda start, stop, **how: Event(
        **{"kind": "frozen", "log": "a", "start": start, "stop": stop, "joints": ("hip",), **how}
    )  # noqa: E731
    parts = [
        one(1.0, 1.999),
        one(2.0, 2.5),
        one(2.0, 2.2, joints=("knee",)),
        one(2.7, 2.8),
        one(1.999, 1.999, kind="spike"),
        one(2.0, 2.0, kind="spike"),
    ]
    found = events.joined(parts, 1e-3)
    assert one(1.0, 2.5) in found and len(found) == 5
    assert events.clipped([one(1.0, 3.0), one(0.0, 0.5)], 1.5, 2.0) == [one(1.5, 2.0)]


def test_a_false_event_is_as_seldom_in_all_spans_as_in_one_log():
    rng = np.random.default_rng(0)
    tau = rng.normal(size=(20_000, 3))
    size, found = np.linspace(8.0, 30.0, 45), []
    for among in (1, 1000):
        hit = []
        for height in size:
            struck = tau.copy()
            struck[9000, 1] += height
            hit.append(any(outliers.spikes(struck, among=among)))
        found.append(size[np.argmax(hit)])
    assert size[0] < found[0] < found[1] < size[-1]


@pytest.mark.long
def test_models_are_compared_on_logs_in_spans_as_on_logs_as_one(monkeypatch):
    """And no prediction is read into memory whole."""
    spec = experiment(preprocess=EVERY_ROW)
    less = spec.model.model_copy(update={"effects": spec.model.effects[:1]})
    specs = spec.model_copy(update={"model": less}), spec
    whole = sysid.compare(*(sysid.fit(one, filters={}) for one in specs), ("less", "more"))
    monkeypatch.setattr(spans, "SPAN", 1100)
    found = [sysid.fit(one, filters={}) for one in specs]
    assert len(found[0].predictions["test"].files) > 2
    monkeypatch.delattr(long_prediction.LongPrediction, "__getattr__")
    for one, other in zip(whole, sysid.compare(*found, ("less", "more")), strict=True):
        assert other.delta_rms == pytest.approx(one.delta_rms, rel=1e-9) and one.se > 0.0
        assert other.se == pytest.approx(one.se, rel=1e-9)


@pytest.mark.parametrize("n", [1, 999, 1000, 1001, 2000, 2001, 2999, 7350, 50_000])
def test_spans_are_whole_and_none_is_short(n):
    """So that what a span takes of memory is the same of every long log."""
    sizes = np.diff(spans.edges(n, 1000))
    assert sizes.sum() == n and sizes.max() <= 1000
    assert (sizes[:-2] == 1000).all() and np.ptp(sizes[-2:]) <= 1
    assert n <= 1000 or sizes.min() >= 500
    assert len(sizes) == -(-n // 1000)


@pytest.mark.long
def test_predictions_in_files_are_told_in_few_rows(short_spans, monkeypatch):
    monkeypatch.setattr(long_prediction, "ROWS", 300)
    fit = pipeline.fit(experiment())
    prediction = fit.predictions["train"]
    tables = list(prediction.tables())
    assert max(table.height for table in tables) == 300
    assert pl.concat(tables).equals(prediction.lazy().collect())


def test_what_the_c_library_keeps_is_said_once(monkeypatch):
    """Workers say it before a long log does, and otherwise."""
    said = []

    class Library:
        def mallopt(self, *own):
            said.append(own)

    monkeypatch.setattr(free_memory, "_said", [])
    monkeypatch.setattr(free_memory, "CDLL", lambda name: Library())
    free_memory.kept(5, 6)
    free_memory.kept(7, 8)
    assert said == [(-1, 5), (-3, 6)]  # glibc's malloc.h: M_TRIM_THRESHOLD, M_MMAP_THRESHOLD


def test_where_the_c_library_cannot_be_told_nothing_happens(monkeypatch):
    monkeypatch.setattr(free_memory, "_said", [])
    monkeypatch.setattr(free_memory, "CDLL", lambda name: object())
    free_memory.kept(5, 6)


def test_of_long_logs_stretches_spread_over_them_are_kept(monkeypatch):
    rows = np.arange(5000.0)[:, None]
    segment = Segment(1e-3 * np.arange(5000), 1e-3, rows, rows, None, None, {})
    monkeypatch.setattr(spans, "SPAN", 1000)
    log = spans.Spans([spans.of_segment(segment)])
    (whole,) = log.spread(5000)
    np.testing.assert_array_equal(whole.q, rows)
    few = log.spread(1000)
    assert len(few) == 8 and sum(len(one.t) for one in few) == 1000
    assert few[0].t[0] == 0.0 and few[-1].t[-1] == segment.t[-1]
    apart = np.diff([one.t[0] for one in few])
    assert apart.max() < 1.3 * apart.min() and apart.min() > 0.5


@pytest.mark.parametrize("many", [1, 3, 7, 25])
def test_of_many_long_logs_no_more_rows_are_kept_than_of_one(many, monkeypatch):
    """Of each its beginning and its end, and what is between as far as there is room."""
    rows = np.arange(5000.0)[:, None]
    segment = Segment(1e-3 * np.arange(5000), 1e-3, rows, rows, None, None, {})
    monkeypatch.setattr(spans, "SPAN", 1000)
    monkeypatch.setattr(thinning, "MOST", 1000)
    each = [
        logs.Log(str(k), Path(str(k)), "", spans.Spans([spans.of_segment(segment)]))
        for k in range(many)
    ]
    found = thinning.thinned(each)
    assert 500 <= sum(log.samples for log in found) <= 1050
    for log in found:
        assert log.segments[0].t[0] == 0.0 and log.segments[-1].t[-1] == segment.t[-1]


@pytest.mark.long
def test_a_diagnosis_of_a_part_of_the_logs_finds_what_is_missing(tmp_path, monkeypatch):
    """A long log of which a half is looked at; its claim is fitted on all of it."""
    hidden = ["--hide", "stribeck:knee:size=2", "--duration", "40", "--out", str(tmp_path)]
    ran = CliRunner().invoke(cli.app, ["simulate", str(LEG), *hidden])
    assert ran.exit_code == 0, ran.output
    for part in ("train", "test"):
        pl.read_csv(tmp_path / f"{part}.csv").write_parquet(tmp_path / f"{part}.parquet")
    text = (tmp_path / "config.yaml").read_text()
    (tmp_path / "config.yaml").write_text(text.replace(".csv", ".parquet"))
    monkeypatch.setattr(spans, "SPAN", 16_000)
    monkeypatch.setattr(thinning, "MOST", 20_000)
    found = sysid.diagnose(sysid.load(tmp_path))
    assert [(claim.head.effect, claim.head.joint) for claim in found.claims] == [
        ("stribeck", "knee")
    ]
    assert found.claims[0].after.samples == found.fit.samples
    assert "was asked of" in found.notices[0]


@pytest.mark.long
def test_a_robot_of_a_fleet_says_the_same_of_logs_in_spans(monkeypatch):
    spec = experiment(preprocess=EVERY_ROW)
    kind = members.first(spec)
    whole = members.member(spec, "r", kind)
    monkeypatch.setattr(spans, "SPAN", 1100)
    found = members.member(spec, "r", kind)
    for one, other in ((whole.train, found.train), (whole.test, found.test)):
        told = np.isfinite(one.values)
        std = np.sqrt(one.variance[told])
        assert told.any() and np.array_equal(told, np.isfinite(other.values))
        assert np.max(np.abs(other.values - one.values)[told] / std) < 1e-6
        np.testing.assert_allclose(other.variance[told], one.variance[told], rtol=1e-6)


@pytest.mark.parametrize("every", [1, 5])
def test_a_long_log_whose_torque_comes_seldom_is_read_as_a_short_one(
    every, tmp_path, short_spans, monkeypatch
):
    """Span by span nobody would know what comes next; where values come as often as rows nothing is
    read whole."""
    frame = leg_table()
    names = [name for name in frame.columns if name.startswith("tau")]
    rows = (np.arange(frame.height) // every) * every
    rng = np.random.default_rng(0)
    noisy = {n: frame[n].to_numpy() + 0.05 * rng.standard_normal(frame.height) for n in names}
    held = frame.with_columns([pl.Series(n, own[rows]) for n, own in noisy.items()])
    held.write_parquet(tmp_path / "held.parquet")
    spec = experiment(tmp_path / "held.parquet")
    machine, _, _ = pipeline.build(spec)
    how = (spec.data.train[0], spec.data, machine.joints, machine.prismatic, spec.folder)
    assert (long_log.in_spans(*how, logs.NO_ACTUATORS) is None) is (every > 1)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found, whole = long_log.read(*how), logs.read(*how)
    assert any(f"new every {every} rows" in str(one.message) for one in told) is (every > 1)
    read = np.concatenate([segment.tau for segment in found.segments])
    assert isinstance(found.segments, spans.Spans)
    np.testing.assert_allclose(read, np.concatenate([s.tau for s in whole.segments]), atol=1e-12)
