"""Files as loggers leave them: two recordings in one, torque that was not written, angles that stand alone."""

import numpy as np
import polars as pl
import pytest

from sysid import check, experiment_logs, log, log_spec, pipeline
from sysid.anew import angle_starts
from sysid.errors import LogError, SysidWarning
from sysid.events import usable
from sysid.glitches import without_glitches
from sysid.repeats import rests
from tests.conftest import JOINTS, csv
from tests.test_events import motion

ROWS = 600


def columns(seconds=6.0, step=0.01):
    """A log of two joints by the names that an experiment expects."""
    t, q, qd, _ = motion(seconds, step)
    tau = 3.0 * np.sin(q) + 0.5 * qd
    return {"t": t} | {f"{kind}_{joint}": values[:, j] for kind, values in (("q", q), ("tau", tau)) for j, joint in enumerate(JOINTS)}


def read(file, **data) -> log.Log:
    spec = log_spec.DataSpec.model_validate(data)
    return log.read(log_spec.LogSpec(file=str(file)), spec, JOINTS, (False, False))


def test_a_clock_that_starts_anew_begins_another_recording(tmp_path):
    made, file = columns(), tmp_path / "a.csv"
    made["t"] = np.where(made["t"] < 2.0, made["t"], made["t"] - 2.0)
    file.write_text(csv(made))
    with pytest.warns(SysidWarning, match="the clock starts anew at row 200 counted from 0"):
        found = read(file)
    assert [len(s.t) for s in found.segments] == [200, 400]
    assert found.segments[1].t[0] == pytest.approx(2.0)
    made["t"][[300, 301]] = made["t"][[301, 300]]  # in a wrong order
    file.write_text(csv(made))
    with pytest.raises(LogError, match="time runs backwards"):
        read(file)


@pytest.mark.parametrize("gone", [0.5, 1.3])
def test_angles_that_all_jump_begin_another_recording(gone, tmp_path):
    made, file = columns(), tmp_path / "a.csv"
    kept = (made["t"] < 2.0) | (made["t"] >= 2.0 + gone)
    made = {name: values[kept] for name, values in made.items()}
    made["t"] = 0.01 * np.arange(kept.sum())
    file.write_text(csv(made))
    with pytest.warns(SysidWarning, match="the angles of most joints jump at once at 2 s"):
        found = read(file)
    assert [len(s.t) for s in found.segments] == [200, kept.sum() - 200]


def test_what_moves_in_one_go_is_one_recording():
    """However coarse its angles, with one joint that steps, joints that are wrapped at one sample, or a logger that stood still."""
    turns = np.ones(3, dtype=bool)
    for step, bits in ((1e-3, None), (1e-3, 10), (0.01, 12), (0.1, None)):
        t, q, *_ = motion(20.0, step, bits)
        assert not len(angle_starts(t, q, [], turns))
        one, wrapped, still = q.copy(), q.copy(), q.copy()
        one[100:, 0] += 2.0
        wrapped[100:] -= 2.0 * np.pi
        still[95:101] = still[95]
        for other in (one, wrapped, still):
            assert not len(angle_starts(t, other, [], turns)), (step, bits)
        both = q.copy()
        both[100:] += [2.0, -2.0, 3.0]
        assert angle_starts(t, both, [], turns).tolist() == [100]
        assert not len(angle_starts(t, both, [100], turns))


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_torque_that_was_not_written_counts_for_nothing(kind, experiment, cli):
    """A stretch with what the filter sees of it, and a single sample alone; in a fit and before any."""

    def holes(made):
        made["tau_elbow"][200:300] = np.nan
        made["tau_shoulder"][450] = np.nan
        return made

    folder = experiment(train=holes)
    text = (folder / "train.csv").read_text().replace("nan", "")
    (folder / "train.csv").write_text(text)
    if kind == "parquet":
        pl.read_csv(folder / "train.csv").write_parquet(folder / "train.parquet")
        (folder / "config.yaml").write_text((folder / "config.yaml").read_text().replace("train.csv", "train.parquet"))
    loaded = pipeline.load(folder)
    machine, structure, _ = pipeline.build(loaded)
    (found,) = experiment_logs.read(loaded, machine, loaded.data.train)
    told = [(e.kind, e.joints) for e in found.events]
    assert told == [("missing", ("elbow",)), ("empty", ("shoulder",))]
    use = usable(found.segments[0].t, JOINTS, found.events, torque=0.05)
    assert not use[200:300, 1].any() and np.flatnonzero(~use[:, 0]).tolist() == [450]
    said = cli("fit", folder, "--json")
    assert said.status == 0
    faults = {(f.fault, f.joint) for f in check.check(loaded)}
    assert {("effort_missing", "elbow"), ("effort_missing", "shoulder")} <= faults


def test_torque_of_another_rate_and_an_empty_angle_are_refused(experiment, cli):
    def slower(made):
        made["tau_elbow"][np.arange(len(made["t"])) % 3 > 0] = np.nan
        return made

    def empty(made):
        made["q_elbow"][7] = np.nan
        return made

    for k, (change, words) in enumerate(((slower, "the torque of joint 'elbow' is written in 33 % of the rows"), (empty, "q_elbow"))):
        folder = experiment(train=change, name=f"e{k}")
        (folder / "train.csv").write_text((folder / "train.csv").read_text().replace("nan", ""))
        cli("fit", folder).complains(words)


@pytest.mark.parametrize("step, bits, noise", [(1e-3, None, 0.0), (1e-3, 14, 0.0), (0.004, 17, 0.0), (0.004, None, 1e-4), (0.01, None, 0.0)])
def test_an_angle_that_stands_alone_is_taken_out(step, bits, noise):
    """What is put in its place is where the joint was; where none stands alone nothing is."""
    t, q, *_ = motion(20.0, step, bits)
    q = q + noise * np.random.default_rng(1).normal(size=q.shape)
    assert without_glitches(q)[0] is q
    hit, places = q.copy(), [(0, 300, 300, 0.1), (1, 700, 701, -0.2), (2, 1500, 1500, 0.3), (2, 1506, 1506, -0.3)]
    for j, first, last, size in places:
        hit[first : last + 1, j] += size
    mended, found = without_glitches(hit)
    assert [[(a, b) for jj, a, b, _ in places if jj == j] for j in range(3)] == found
    assert np.abs(mended - q).max() < 3.0 * noise + (2.0 * np.pi / 2**bits if bits else 0.0) + 50.0 * step**3


def test_who_goes_and_comes_back_does_not_rest():
    t = np.arange(8000) * 1e-3
    q = 0.5 * np.sin(2.0 * np.pi * 0.25 * t)  # turns at 1 s, 3 s, ...
    usual = float(np.sqrt(np.mean(np.diff(q) ** 2)))
    assert abs(q[1300] - q[700]) < 1e-3 and not rests(q, 700, 1300, usual)
    still = np.full(1000, 0.3) + 1e-4 * np.random.default_rng(0).normal(size=1000)
    assert rests(np.concatenate([q[:4000], still]), 4000, 4999, usual)
