"""Files as loggers leave them: two recordings in one, torque that was not written, angles that stand alone."""

import warnings

import numpy as np
import polars as pl
import pytest
from scipy.interpolate import make_interp_spline

from sysid import check, experiment_logs, log, log_spec, pipeline
from sysid.anew import angle_starts
from sysid.errors import LogError, SysidWarning
from sysid.events import usable
from sysid.glitches import without_glitches
from sysid.repeats import rests
from sysid.warned import noticed
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
    assert told == [("unwritten", ("elbow",)), ("empty", ("shoulder",))]
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


@pytest.mark.parametrize("seed", range(4))
def test_an_angle_that_sets_off_is_no_glitch(seed):
    """Moves with stops, 100 samples a second whose stamps jitter: read evenly, a step of the encoder ripples where a joint stands."""
    rng, t = np.random.default_rng(seed), 0.01 * np.arange(420)
    stamps = np.sort(t + 1.7e-3 * rng.normal(size=420))
    places = np.cumsum(rng.uniform(-0.5, 0.5, size=(7, 3)) * (rng.random((7, 3)) < 0.5), axis=0)
    share = np.clip((stamps[:, None] - 0.6 * np.arange(7)) / 0.35, 0.0, 1.0)
    moved = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    q = np.diff(np.concatenate([np.zeros((1, 3)), places]), axis=0)
    angle = 2.0 * np.pi / 2**18 * np.round(moved @ q * 2**18 / (2.0 * np.pi))
    evenly = make_interp_spline(stamps, angle, k=3)(np.linspace(stamps[0], stamps[-1], 420))
    assert without_glitches(evenly)[1] == [[], [], []]


def test_who_goes_and_comes_back_does_not_rest():
    t = np.arange(8000) * 1e-3
    q = 0.5 * np.sin(2.0 * np.pi * 0.25 * t)  # turns at 1 s, 3 s, ...
    usual = float(np.sqrt(np.mean(np.diff(q) ** 2)))
    assert abs(q[1300] - q[700]) < 1e-3 and not rests(q, 700, 1300, usual)
    still = np.full(1000, 0.3) + 1e-4 * np.random.default_rng(0).normal(size=1000)
    assert rests(np.concatenate([q[:4000], still]), 4000, 4999, usual)


def arrivals(rng, n, step, size=0.4, stalls=10):
    """Stamps of even samples that arrive late, and in packets after a stall."""
    t = step * np.arange(n)
    late = t + step * size * np.abs(rng.normal(size=n))
    for k in rng.integers(100, n - 100, stalls):
        late[k : k + 5] = np.maximum(late[k : k + 5], t[k] + 5.0 * step)
    return np.round(np.maximum.accumulate(late), 6)


@pytest.mark.parametrize("step, size", [(1e-3, 0.4), (2e-3, 0.3), (0.01, 0.3)])
def test_samples_that_arrive_late_were_taken_evenly(step, size, tmp_path):
    """Also those that come in one packet, with one stamp."""
    made, file = columns(20.0, step), tmp_path / "a.csv"
    made["t"] = arrivals(np.random.default_rng(1), len(made["t"]), step, size)
    assert np.any(np.diff(made["t"]) == 0.0)
    file.write_text(csv(made))
    with pytest.warns(SysidWarning, match="samples were taken evenly"):
        (found,) = read(file).segments
    assert found.step == pytest.approx(step, rel=1e-4) and np.array_equal(found.q[:, 0], made["q_shoulder"])


@pytest.mark.filterwarnings("ignore")
def test_what_was_taken_unevenly_or_is_missing_keeps_its_stamps(tmp_path):
    """Samples at the times that their stamps say, and even ones of which some are missing."""
    rng, step, file = np.random.default_rng(2), 0.01, tmp_path / "a.csv"
    t = np.cumsum(step * (1.0 + 0.3 * rng.uniform(-1.0, 1.0, size=3000)))
    q = np.stack([np.sin(2.0 * t), np.cos(1.7 * t)], axis=1)
    for kept in (np.ones(3000, dtype=bool), rng.uniform(size=3000) > 0.03):
        clock = t if kept.all() else step * np.arange(3000)
        angle = q if kept.all() else np.stack([np.sin(2.0 * clock), np.cos(1.7 * clock)], axis=1)
        names = [f"{kind}_{joint}" for kind in ("q", "tau") for joint in JOINTS]
        made = dict(zip(names, np.hstack([angle, angle])[kept].T))
        file.write_text(csv({"t": clock[kept]} | made))
        for found in read(file).segments:
            at = np.sin(2.0 * found.t)
            assert np.abs(found.q[5:-5, 0] - at[5:-5]).max() < 1e-3


def test_doubled_rows_and_packets_that_are_not_even_are_refused(tmp_path):
    file, t = tmp_path / "a.csv", np.cumsum(0.01 * (1.0 + 0.3 * np.random.default_rng(2).uniform(-1.0, 1.0, size=ROWS)))
    q = np.stack([np.sin(2.0 * t), np.cos(1.7 * t)], axis=1)
    names = [f"{kind}_{joint}" for kind in ("q", "tau") for joint in JOINTS]
    uneven = {"t": t} | dict(zip(names, np.hstack([q, q]).T))
    uneven["t"][7] = uneven["t"][6]
    file.write_text(csv(uneven))
    with pytest.raises(LogError, match="time stands still"):
        read(file)
    made = columns()
    for name in made:
        made[name][7] = made[name][6]
    file.write_text(csv(made))
    with pytest.raises(LogError, match="time stands still"):
        read(file)


@pytest.mark.parametrize("wrapped", [True, False])
def test_an_angle_is_not_unwrapped_across_a_gap(wrapped, tmp_path):
    """Within a stretch it is."""
    t = 0.01 * np.arange(2000)
    q = 1.2 * t
    kept = (t < 6.0) | (t > 11.2)
    angle = (q + np.pi) % (2.0 * np.pi) - np.pi if wrapped else q
    file = tmp_path / "a.csv"
    file.write_text(csv({"t": t[kept], "q_shoulder": angle[kept], "q_elbow": np.sin(t[kept]), "tau_shoulder": t[kept], "tau_elbow": np.sin(t[kept])}))
    with pytest.warns(SysidWarning):
        first, last = read(file).segments
    for own in (first, last):
        turns = (own.q[:, 0] - 1.2 * own.t) / (2.0 * np.pi)
        assert np.ptp(turns) < 1e-6 and abs(turns[0] - round(turns[0])) < 1e-6
    assert wrapped or np.allclose(last.q[:, 0], 1.2 * last.t)


def test_rows_in_which_nothing_came_are_left_out(tmp_path):
    """What a robot at rest repeats stays."""
    made, file = columns(20.0, 0.005), tmp_path / "a.csv"
    n = len(made["t"])
    held = {name: values.copy() for name, values in made.items()}
    for name in list(made)[1:]:
        for first, count in ((400, 30), (1500, 8)):
            held[name][first : first + count] = held[name][first - 1]
    file.write_text(csv(held))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = read(file)
    assert "38 rows, 2 times, only repeat the row before while the robot moves, the first at 2 s" in str(told[0].message)
    assert [len(s.t) for s in found.segments] == [400, n - 430]  # a short one is interpolated
    assert np.abs(found.segments[1].q[:, 0] - made["q_shoulder"][430:]).max() < 1e-3
    # two that are three rows apart, of which one sees the other
    near = {name: values.copy() for name, values in made.items()}
    for name in list(made)[1:]:
        for first, count in ((900, 8), (911, 6)):
            near[name][first : first + count] = near[name][first - 1]
    file.write_text(csv(near))
    with noticed() as told:
        (segment,) = read(file).segments
    assert "14 rows, 2 times, only repeat" in told[0]
    assert np.abs(segment.q[:, 0] - made["q_shoulder"]).max() < 1e-3
    resting = {name: values.copy() for name, values in made.items()}
    for name in list(made)[1:]:
        resting[name][400:] = resting[name][400]
    for other in (resting, made):
        file.write_text(csv(other))
        assert sum(len(s.t) for s in read(file).segments) == n


@pytest.mark.parametrize("every", [2, 6])
def test_rows_between_new_values_are_left_out(every, tmp_path):
    """A log that was written faster than its values came: each comes with its own time, now and then a row early or late. Coarse
    values that are alike by chance come after any number of rows."""
    made, file = columns(20.0, 0.005), tmp_path / "a.csv"
    n, rng = len(made["t"]), np.random.default_rng(0)
    fresh = np.unique(np.append(0, every * np.arange(1, n // every) + (rng.random(n // every - 1) < 0.04)))
    last = np.searchsorted(fresh, np.arange(n), side="right") - 1
    file.write_text(csv({name: values if name == "t" else values[fresh[last]] for name, values in made.items()}))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = read(file)
    assert any(f"new values come every {every} rows" in str(w.message) for w in told)
    assert sum(len(s.t) for s in found.segments) == pytest.approx(n / every, rel=0.03)
    assert np.abs(found.segments[0].q[5:-5, 0] - np.interp(found.segments[0].t[5:-5], made["t"], made["q_shoulder"])).max() < 5e-3
    rests = {name: values.copy() for name, values in made.items()}
    for name in list(made)[1:]:
        rests[name] = rests[name][fresh[last]]
        rests[name][1200:2400] = rests[name][1200]
    file.write_text(csv(rests))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SysidWarning)
        found = read(file)
    assert len(found.segments) == 1 and found.samples == pytest.approx(n / every, rel=0.03)  # what a robot at rest repeats stays
    coarse = {name: values if name == "t" else np.round(values / (0.02 * np.ptp(values))) * 0.02 * np.ptp(values) for name, values in made.items()}
    file.write_text(csv(coarse))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        read(file)
    assert not [w for w in told if "new values come" in str(w.message)]


@pytest.mark.parametrize("every", [2, 4, 9])
def test_torque_that_came_more_seldom_than_angles_is_not_read_late(every, tmp_path):
    """Held, it is half a hold late; as its drive may have held it so, the user can say so. Its noise stays what it was."""
    made, file = columns(40.0, 0.005), tmp_path / "a.csv"
    n, rng, slopes = len(made["t"]), np.random.default_rng(0), np.gradient(made["tau_elbow"], 0.005)
    fresh = np.unique(np.append(0, every * np.arange(1, n // every) + (rng.random(n // every - 1) < 0.04)))
    last = np.searchsorted(fresh, np.arange(n), side="right") - 1
    noise = 0.05 * rng.standard_normal(n)
    held = (made["tau_elbow"] + noise)[fresh[last]]
    file.write_text(csv(made | {"tau_elbow": held}))
    with pytest.warns(SysidWarning, match=f"the torque of elbow is new every {every} rows only and held between"):
        (segment,) = read(file).segments
    delay = lambda tau: -np.sum((tau - made["tau_elbow"]) * slopes) / np.sum(slopes**2)  # noqa: E731
    late = 0.5 * (every - 1) * 0.005
    assert delay(held) == pytest.approx(late, abs=0.002) and abs(delay(segment.tau[:, 1])) < 0.15 * late + 5e-4
    assert np.std(segment.tau[:, 1] - made["tau_elbow"]) == pytest.approx(0.05, rel=0.25)
    np.testing.assert_allclose(segment.tau[:, 0], made["tau_shoulder"], atol=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (segment,) = read(file, resampling="held").segments
        np.testing.assert_allclose(segment.tau[:, 1], held, atol=1e-12)
        for grain in (0.01, 0.1):  # coarse torque repeats as it comes
            coarse = np.round(made["tau_elbow"] / grain) * grain
            file.write_text(csv(made | {"tau_elbow": coarse}))
            np.testing.assert_allclose(read(file).segments[0].tau[:, 1], coarse, atol=1e-12)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("size", [2, 3])
def test_packets_whose_samples_all_have_one_stamp_are_even(size, tmp_path):
    """Also where the clock starts anew in another file of the recording."""
    made = columns(20.0, 0.005)
    n = len(made["t"])
    made["t"] = (
        np.repeat(made["t"][size - 1 :: size], size)[:n]
        if n % size == 0
        else np.append(np.repeat(made["t"][size - 1 :: size], size), [made["t"][-1]] * (n % size))
    )
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(csv(made))
    (segment,) = read(tmp_path / "a.csv").segments
    assert segment.step == pytest.approx(0.005, rel=2e-3) and len(segment.t) == n
    spec = log_spec.LogSpec(files=[str(tmp_path / "a.csv"), str(tmp_path / "b.csv")])
    both = log.read(spec, log_spec.DataSpec(), JOINTS, (False, False)).segments
    assert [len(one.t) for one in both] == [n, n]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("bits, rate", [(14, 50.0), (12, 30.0), (12, 100.0)])
def test_a_robot_that_rests_between_moves_lost_no_message(bits, rate, tmp_path):
    """However coarse its angles and torques are, and at the end of a recording."""
    t = np.arange(round(60.0 * rate)) / rate
    at = np.interp(t % 4.0, [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.8, 0.8, 0.0, 0.0])
    grain = 2.0 * np.pi / 2**bits
    q = grain * np.round(np.stack([at, -0.5 * at], axis=1) / grain)
    tau = 0.1 * np.round(np.stack([3.0 * np.sin(at), np.cos(at)], axis=1) / 0.1)
    names = [f"{kind}_{joint}" for kind in ("q", "tau") for joint in JOINTS]
    for name, offset in (("a.csv", 0.0), ("b.csv", 1.0)):
        (tmp_path / name).write_text(csv({"t": t} | dict(zip(names, np.hstack([q + offset, tau]).T))))
    assert sum(len(s.t) for s in read(tmp_path / "a.csv").segments) == len(t)
    spec = log_spec.LogSpec(files=[str(tmp_path / "a.csv"), str(tmp_path / "b.csv")])
    assert sum(len(s.t) for s in log.read(spec, log_spec.DataSpec(), JOINTS, (False, False)).segments) == 2 * len(t)


def test_a_few_rows_are_no_recording(tmp_path):
    """A first message of nothing but zeros; samples that are missing while all joints move."""
    t, q, *_ = motion(20.0, 0.002)
    turns = np.ones(3, dtype=bool)
    for row in (0, 3000):
        wrong = q.copy()
        wrong[row] = q[row] + 3.0
        assert not len(angle_starts(t, wrong, [], turns))
    kept = np.ones(len(t), dtype=bool)
    kept[2000:2007] = False
    assert not len(angle_starts(t[kept], q[kept], [], turns))


def test_logged_speeds_of_a_sample_that_stands_alone_are_not_used(experiment):
    """What a logger differentiates of it stands to its sides."""

    def spoiled(made):
        t = made["t"]
        made["q_elbow"][300] += 0.3
        return made | {
            f"{kind}_{joint}": value
            for joint in JOINTS
            for kind, value in (("qd", np.gradient(made[f"q_{joint}"], t)), ("qdd", np.gradient(np.gradient(made[f"q_{joint}"], t), t)))
        }

    config = {"preprocess.filter": "none", "data.columns.velocity": "qd_{joint}", "data.columns.acceleration": "qdd_{joint}"}
    folder = experiment(train=spoiled, test=spoiled, config=config)
    loaded = pipeline.load(folder)
    machine, *_ = pipeline.build(loaded)
    (found,) = experiment_logs.read(loaded, machine, loaded.data.train)
    (own,) = found.segments
    assert [e.kind for e in found.events if e.joints == ("elbow",)] == ["glitch"]
    for values in (own.q, own.qd, own.qdd):
        around = np.abs(np.diff(values[250:350, 1]))
        assert around[45:56].max() < 3.0 * np.delete(around, slice(40, 60)).max()


def test_a_zero_stands_in_radians_whatever_the_unit_is(tmp_path):
    made, file = columns(), tmp_path / "a.csv"
    shown = made | {f"q_{joint}": np.degrees(made[f"q_{joint}"]) for joint in JOINTS}
    file.write_text(csv(shown))
    (own,) = read(file, units={"position": "deg"}, zero={"elbow": -0.5}).segments
    np.testing.assert_allclose(own.q[:, 1], made["q_elbow"] - 0.5, atol=1e-9)
    np.testing.assert_allclose(own.q[:, 0], made["q_shoulder"], atol=1e-9)
    with pytest.raises(ValueError, match="finite"):
        log_spec.DataSpec.model_validate({"zero": {"elbow": float("nan")}})
