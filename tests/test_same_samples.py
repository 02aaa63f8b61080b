"""Logs that hold what other logs do: pieces of them, a torque that was played again; and logs that do not."""

import numpy as np
import polars as pl
import pytest

import sysid
from scripts.blind_parts.robots import experiment_of
from sysid import pipeline
from sysid.check.samples import Samples
from sysid.same_samples import same, sampled, told
from sysid.simulate import simulate, write


def measured(seed: int, rows: int = 600, joints: int = 3, *, grain: float = 0.0):
    rng = np.random.default_rng(seed)
    q, tau = np.cumsum(rng.normal(size=(2, rows, joints)), axis=1)
    return np.arange(rows) * 0.01, q, np.round(tau / grain) * grain if grain else tau


def of(name, part, log, rows=slice(None)):
    t, q, tau = (values[rows] for values in log)
    return sampled(name, part, [Samples(t, q, tau)])


def test_logs_of_their_own_share_nothing():
    assert not list(same([of("a", "train", measured(0)), of("b", "train", measured(1)), of("c", "test", measured(2))]))


@pytest.mark.parametrize("joints", [1, 3])
def test_coarse_torques_share_nothing_either(joints):
    """One joint in 30 to 200 steps: values come again and again, but not in a row."""
    logs = [of(str(k), "train", measured(k, 5000, joints, grain=1.0)) for k in range(4)]
    assert not list(same(logs))


@pytest.mark.parametrize("grain", [0.0, 0.5])
def test_a_piece_of_a_training_log_is_found_wherever_it_begins(grain):
    log = measured(3, grain=grain)
    (found,) = same([of("a", "train", measured(4)), of("b", "train", log), of("c", "test", log, slice(200, 500))])
    assert (found.first.name, [o.name for o in found.others], found.moved) == ("b", ["c"], False)
    assert found.rows > 200 and found.since == pytest.approx(2.0, abs=0.2)
    assert told(found).startswith("c holds samples of the training log b, ") and "not held out" in told(found)


def test_a_log_that_begins_in_one_and_goes_on_is_found():
    one, other = measured(5), measured(6)
    late = tuple(np.concatenate([a[300:], b]) for a, b in zip(one, other))
    (found,) = same([of("a", "train", one), of("b", "train", late)])
    assert not found.moved and found.rows > 250 and "count twice" in told(found)


def test_a_torque_that_is_played_again_is_told_once_for_all():
    t, q, tau = measured(7)
    again = [(t, q + np.random.default_rng(k).normal(size=q.shape), tau) for k in (8, 9)]
    found = list(same([of("a", "train", (t, q, tau)), of("b", "train", again[0]), of("c", "test", again[1])]))
    assert [(f.first.name, [o.name for o in f.others], f.moved) for f in found] == [("a", ["b"], True), ("a", ["c"], True)]
    assert "not held out" not in told(found[0]) and "not held out" in told(found[1])


def test_a_standstill_is_no_sample_of_another():
    """The same number in every row is in both logs, at every row."""
    held = [np.full((400, 2), 0.0) for _ in range(2)]
    assert not list(same([of("a", "train", (np.arange(400.0), *held)), of("b", "test", (np.arange(400.0), *held))]))


@pytest.mark.long
def test_check_and_fit_say_so(tmp_path):
    experiment, machine = experiment_of("planar", tmp_path)
    folder = tmp_path / "logs"
    write(simulate(machine, seed=5, duration=10.0, rate=250.0), experiment, folder)
    train, test = (pl.read_csv(folder / f"{part}.csv") for part in ("train", "test"))
    assert not {"test_is_train", "commanded_torque"} & {f.fault for f in sysid.check(pipeline.load(folder))}
    train[len(train) // 3 : len(train) // 2].write_csv(folder / "test.csv")
    (fault,) = [f for f in sysid.check(pipeline.load(folder)) if f.fault == "test_is_train"]
    assert fault.severity == "error" and fault.log == "test.csv" and "samples of the training log" in fault.says
    assert any("test.csv holds samples of the training log train.csv" in notice for notice in pipeline.fit(pipeline.load(folder)).notices)
    torques = [c for c in train.columns if c.startswith("tau_")]
    rows = min(len(train), len(test))
    test[:rows].with_columns(train[:rows][c] for c in torques).write_csv(folder / "test.csv")
    (fault,) = [f for f in sysid.check(pipeline.load(folder)) if f.fault == "commanded_torque"]
    assert fault.severity == "warning" and "while the angles differ" in fault.says
    notices = pipeline.fit(pipeline.load(folder)).notices
    assert sum("sample by sample, while the angles differ" in notice for notice in notices) == 1
