"""Events put into logs at known places are found there; logs without any give none."""

import json
import os
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid import config, experiment_logs, pipeline
from sysid.clock import Left
from sysid.events import Event, again, find, mended, told, usable, with_clock
from sysid.log import Log, Segment
from sysid.lowpass import lowpassed
from sysid.outliers import quantum
from sysid.preprocess import prepare
from sysid.repeats import held_angle, held_torque
from sysid.specs import PreprocessSpec
from sysid.statement import where
from sysid.unwritten import extent, unlogged

STEP = 1e-3
JOINTS = ("a", "b", "c")


def motion(seconds=12.0, step=STEP, bits=None):
    """Three joints on sums of sines with speeds to 3 rad/s, and reversals; angles as an encoder tells them."""
    t = step * np.arange(round(seconds / step))
    phase = np.array([0.0, 1.0, 2.0])
    q, qd, qdd = (np.zeros((len(t), 3)) for _ in range(3))
    for k, size in ((1, 1.0), (2, 0.4), (5, 0.15)):
        w = 2 * np.pi * 0.23 * k * np.array([1.0, 1.2, 0.9])
        q += size * np.sin(w * t[:, None] + k * phase)
        qd += size * w * np.cos(w * t[:, None] + k * phase)
        qdd -= size * w**2 * np.sin(w * t[:, None] + k * phase)
    if bits is not None:
        grain = 2 * np.pi / 2**bits
        q = grain * np.round(q / grain)
    return t, q, qd, qdd


def segment(*, seed=0, noise=0.1, colour=0.0, step=STEP, bits=None, grain=0.0, seconds=12.0) -> Segment:
    """Inertia, gravity, and friction that jumps at reversals, with white or coloured torque noise."""
    t, q, qd, qdd = motion(seconds, step, bits)
    tau = 0.5 * qdd + 4.0 * np.sin(q) + 0.3 * qd + 1.5 * np.sign(qd)
    white = np.random.default_rng(seed).normal(size=tau.shape)
    if colour:
        pole = np.exp(-step / colour)
        white = lfilter([np.sqrt(1 - pole**2)], [1, -pole], white, axis=0)
    tau = tau + noise * white
    return Segment(t, step, q, grain * np.round(tau / grain) if grain else tau, None, None, {})


def with_knock(made: Segment, at: float, size=2.5, bits=None) -> Segment:
    """All joints ring at 30 Hz for some 80 ms, in torque and, by a milliradian, in their angles."""
    since = made.t - at
    ring = np.where(since >= 0, np.exp(-since.clip(0) / 0.04) * np.sin(2 * np.pi * 30 * since), 0.0)[:, None]
    q = made.q + 1e-3 * ring
    if bits is not None:
        q = 2 * np.pi / 2**bits * np.round(q / (2 * np.pi / 2**bits))
    return replace(made, tau=made.tau + size * ring * [1, -1, 0.7], q=q)


def changed(made: Segment, **signals) -> Segment:
    """A copy in which `signals` (tau or q) = (rows, joint, values) are set."""
    out = {name: getattr(made, name).copy() for name in signals}
    for name, (rows, joint, values) in signals.items():
        out[name][rows, joint] = values
    return replace(made, **out)


@pytest.mark.parametrize(
    "conditions",
    [{}, {"seed": 1, "colour": 0.02}, {"colour": 0.3}, {"bits": 10}, {"bits": 17, "grain": 0.2}, {"noise": 0.0},
     {"step": 0.01, "seconds": 30.0}, {"noise": 0.0, "grain": 0.2, "bits": 14}],
)  # fmt: skip
def test_reversals_noise_and_coarse_values_are_no_events(conditions):
    assert find(segment(**conditions), JOINTS) == ()


def test_stops_and_starts_of_all_joints_at_once_are_no_events():
    """Point to point in trapezoids of speed: torque and acceleration jump on every joint at the same instants."""
    t = STEP * np.arange(12000)
    phase = np.mod(t, 2.0)
    qdd = 8.0 * (np.where((phase > 0.2) & (phase < 0.4), 1, 0) - np.where((phase > 1.0) & (phase < 1.2), 1, 0))
    qd = np.cumsum(qdd) * STEP
    qd = np.where(np.abs(qd) < 1e-9, 0.0, qd)
    q = np.cumsum(qd) * STEP
    sides = np.array([1.0, 0.7, -1.2])
    rng = np.random.default_rng(3)
    tau = (2.0 * qdd + np.tanh(qd / 0.2))[:, None] * sides + 3.0 + 0.1 * rng.normal(size=(len(t), 3))
    angles = q[:, None] * sides + 1e-5 * rng.normal(size=(len(t), 3))
    assert find(Segment(t, STEP, angles, tau, None, None, {}), JOINTS) == ()


@pytest.mark.parametrize("conditions", [{}, {"colour": 0.02, "seed": 5}, {"bits": 12}, {"step": 0.004}])
def test_knocks_are_found_where_they_are(conditions):
    bits = conditions.get("bits")
    size = 2.5 if bits is None else 5.0  # a coarse encoder leaves it to the torque to show it
    made = segment(**conditions)
    for at in (3.3, 8.71):
        made = with_knock(made, at, size, bits)
    first, second = find(made, JOINTS)
    for event, at in ((first, 3.3), (second, 8.71)):
        assert event.kind == "knock" and event.joints == JOINTS
        assert at - 0.1 < event.start <= at + 0.02 and at + 0.02 < event.stop < at + 0.3


def test_a_knock_that_most_joints_show_a_little_is_one():
    """Seven joints: what is too little on any two is a knock where most show it in angle and torque."""
    parts = [segment(seed=seed) for seed in range(3)]
    q, tau = (np.concatenate([getattr(p, n) for p in parts], axis=1)[:, :7] for n in ("q", "tau"))
    made, names = replace(parts[0], q=q, tau=tau), tuple("abcdefg")
    rung = with_knock(segment(), 5.0, 1.0)
    torque, angle = (x[:, :1] for x in (rung.tau - parts[0].tau, rung.q - parts[0].q))
    assert find(made, names) == ()
    for count, found in ((6, 1), (3, 0)):
        own = np.arange(7) < count
        shaken = replace(made, tau=tau + torque * own, q=q + 0.05 * angle * own)
        events = find(shaken, names)
        assert [event.kind for event in events] == ["knock"] * found
        assert not found or set(events[0].joints) <= set(names[:6])


def test_a_wrong_stamp_that_all_angles_show_a_little_is_no_knock():
    """All angles are late at once, and no torque is."""
    made, wide = segment(noise=0.3), lambda x: np.concatenate([x, x, x], axis=1)[:, :7]
    late = np.zeros(len(made.t))
    late[5000:5016] = 4e-4 * np.hanning(16)
    q = wide(made.q + late[:, None] * np.gradient(made.q, made.t, axis=0))
    q = q + 1e-5 * np.random.default_rng(0).normal(size=q.shape)
    assert find(replace(made, q=q, tau=wide(made.tau)), tuple("abcdefg")) == ()


def test_spikes_of_most_joints_at_once_are_a_knock():
    """Of one joint alone they are spikes."""
    parts = [segment(seed=seed) for seed in range(3)]
    q, tau = (np.concatenate([getattr(p, n) for p in parts], axis=1)[:, :7] for n in ("q", "tau"))
    rung = with_knock(segment(), 5.0, 1.0)
    for count, knocks in ((5, 1), (1, 0)):
        own = np.arange(7) < count
        angles = q + 0.1 * (rung.q - parts[0].q)[:, :1] * own
        hit = tau.copy()
        hit[[5010, 5030, 5050]] += 8.0 * own
        events = find(replace(parts[0], q=angles, tau=hit), tuple("abcdefg"))
        assert sum(e.kind == "knock" for e in events) == knocks
        assert {e.joints[0] for e in events if e.kind == "spike"} == set("abcdefg"[:count])


def test_a_disturbance_of_one_joint_alone_is_no_knock():
    """A motor's own ripple or a gear's impact is what a model may have to explain."""
    made = segment()
    tau = with_knock(made, 5.0).tau
    tau[:, :2] = made.tau[:, :2]
    assert find(replace(made, tau=tau), JOINTS) == ()


@pytest.mark.parametrize("conditions", [{}, {"colour": 0.02, "seed": 5}, {"grain": 0.05}, {"step": 0.004, "noise": 0.3}])
def test_spikes_are_found_sample_by_sample(conditions):
    made = segment(**conditions)
    n, tau = len(made.t), made.tau.copy()
    size = 30 * max(0.1, conditions.get("noise", 0.0))
    where = [(j, round(n * share) + 31 * j, width) for share in (0.2, 0.4, 0.6, 0.8) for j, width in enumerate((1, 2, 3))]
    for j, row, width in where:
        tau[row : row + width, j] += size * (-1) ** row
    found = find(replace(made, tau=tau), JOINTS, log="x")
    assert [event.kind for event in found] == ["spike"] * 12 and {event.log for event in found} == {"x"}
    expected = {(JOINTS[j], round(made.t[row], 6), round(made.t[row + width - 1], 6)) for j, row, width in where}
    assert {(event.joints[0], round(event.start, 6), round(event.stop, 6)) for event in found} == expected
    np.testing.assert_allclose(mended(replace(made, tau=tau), found, JOINTS), made.tau, atol=size / 3)


def test_what_is_found_does_not_depend_on_units_or_offsets():
    made = with_knock(segment(), 4.0)
    made = changed(made, tau=(slice(7000, 7001), 1, 9.0))
    made = changed(made, tau=(slice(9000, 9200), 2, made.tau[9000, 2]))
    told_of = find(made, JOINTS)
    assert {event.kind for event in told_of} == {"knock", "spike", "frozen"}
    for scale, offset in ((1e3, 0.0), (1e-3, 0.0), (-4.0, 0.0), (1.0, 64.0)):
        assert find(replace(made, tau=scale * made.tau + offset), JOINTS) == told_of
    assert find(replace(made, q=2.0 * made.q + 8.0), JOINTS) == told_of


def resting(stop=6.0) -> Segment:
    """Joint b moves until `stop`, rests from there on with its brake closed, and holds no torque."""
    made = segment()
    row = round(stop / STEP)
    return changed(made, q=(slice(row, None), 1, made.q[row, 1]), tau=(slice(row, None), 1, 0.0))


def test_a_closed_brake_is_found_and_a_joint_that_holds_itself_is_not():
    (brake,) = find(resting(), JOINTS)
    assert (brake.kind, brake.joints) == ("brake", ("b",))
    np.testing.assert_allclose([brake.start, brake.stop], [6.0, 12.0 - STEP], atol=2 * STEP)
    made = resting()
    holding = np.random.default_rng(2).normal(scale=0.1, size=len(made.t))
    assert find(changed(made, tau=(slice(6000, None), 1, 3.0 + holding[6000:])), JOINTS) == ()
    never = changed(segment(), q=(slice(None), 2, 0.4), tau=(slice(None), 2, 0.0))
    (whole,) = find(never, JOINTS)
    assert (whole.kind, whole.joints, whole.start, whole.stop) == (
        "brake",
        ("c",),
        0.0,
        never.t[-1],
    )


def test_frozen_torque_frozen_angles_and_flat_tops():
    made = segment()
    (torque,) = find(changed(made, tau=(slice(5000, 5300), 0, made.tau[5000, 0])), JOINTS)
    assert (torque.kind, torque.joints, torque.signal) == ("frozen", ("a",), "torque")
    np.testing.assert_allclose([torque.start, torque.stop], [5.0, 5.299], atol=1e-9)
    assert held_angle(made.q[:, 0]) == []
    row = 2000 + int(np.argmax(np.abs(np.diff(made.q[2000:9000, 0]))))
    held = changed(made, q=(slice(row, row + 40), 0, made.q[row, 0]))
    (angle,) = [event for event in find(held, JOINTS) if event.signal == "position"]
    assert (angle.kind, angle.joints) == ("frozen", ("a",))
    np.testing.assert_allclose([angle.start, angle.stop], made.t[[row, row + 39]], atol=1e-9)
    top = np.quantile(made.tau[:, 0], 0.9)
    flat = find(
        replace(made, tau=np.column_stack([np.minimum(made.tau[:, 0], top), made.tau[:, 1:]])),
        JOINTS,
    )
    assert flat and {event.kind for event in flat} == {"saturation"}
    assert usable(made.t, JOINTS, flat).all()  # told, not left out
    notice = told(flat, 0.0, "test", 3)
    assert len(notice) == 1 and "not left out" in notice[0]


@pytest.mark.parametrize("shape", [[-0.4, -1.9, -3.2, -2.6, -1.4, -0.9, -0.8], [-0.3, -1.2, -1.35, -1.2, -0.95, -0.9], [1.5, 2.4, 3.1, 1.7, 0.6, 0.2]])
def test_how_a_torque_breaks_a_joint_away_is_no_spike(shape):
    """It rises in several samples of a slow logger and goes beyond where it stays, or falls in several."""
    made = segment(step=0.01, seconds=20.0, noise=0.02)
    tau = made.tau.copy()
    for row in (300, 777, 1200):
        tau[row : row + len(shape), 1] += 8.0 * np.array(shape)
        tau[row + len(shape) :, 1] += 8.0 * shape[-1]
    assert find(replace(made, tau=tau), JOINTS) == ()


def test_a_coarse_torque_on_a_clock_that_was_made_even_has_no_spikes_of_a_grain():
    """Linear interpolation puts others between the levels, which the grain is not."""
    made, rng = segment(seed=3, noise=0.03, step=0.01, seconds=20.0), np.random.default_rng(3)
    stamps = made.t + 5e-4 * rng.normal(size=len(made.t))
    coarse = 0.1 * np.round((made.tau - 0.5 * made.tau) / 0.1)  # slow: the grain is three times the noise
    even = np.stack([np.interp(made.t, stamps, own) for own in coarse.T], axis=1)
    assert [quantum(own) for own in even.T] == pytest.approx([0.1] * 3, rel=1e-3)
    assert find(replace(made, tau=even), JOINTS) == ()


def test_values_that_are_held_are_no_grain():
    """A log that is braked at its start and parked at its end holds two values, and is told as finely as ever."""
    made = segment(step=0.01, seconds=60.0, noise=0.02)
    tau = made.tau.copy()
    tau[:400] = 0.0
    tau[-400:] = tau[-401] + 3.0
    assert max(quantum(own) for own in tau.T) < 1e-3
    rows = (1500, 2200, 3100, 4000)
    tau[list(rows), 2] += 5.0
    found = [event for event in find(replace(made, tau=tau), JOINTS) if event.kind == "spike"]
    assert [round(event.start / 0.01) for event in found if event.joints == ("c",)] == list(rows)


def test_slow_loggers_and_coarse_signals_repeat_by_their_nature():
    made = segment(noise=0.0, grain=0.5)
    assert held_torque(made.tau[:, 0], STEP) == []
    every = np.repeat(segment().tau[::8, 0], 8)  # torque that comes at an eighth of the rate
    assert held_torque(every, STEP) == []
    assert held_angle(np.repeat(made.q[::8, 0], 8)) == []


def log(*segments, events=()) -> Log:
    return Log("made.csv", Path("made.csv"), "", segments, tuple(events))


def test_rows_that_events_reach_are_left_out():
    made = segment()
    events = [
        Event("knock", "made.csv", 3.0, 3.2, ("a",), "both"), Event("spike", "made.csv", 5.0, 5.001, ("b",)),
        Event("brake", "made.csv", 7.0, 8.0, ("c",)), Event("frozen", "made.csv", 9.0, 9.1, ("a",), "position"),
    ]  # fmt: skip

    def lost(spec, joint):
        (piece,) = prepare([log(made, events=events)], spec, JOINTS).pieces
        return piece.t[~piece.use[:, JOINTS.index(joint)]], piece

    t, piece = lost(PreprocessSpec(window=0.1, standstill="keep"), "c")  # 50 ms to either side: the knock, whichever joint shows it, the brake, the angle
    np.testing.assert_allclose([t[0], t[t < 5][-1]], [2.95, 3.25], atol=1e-9)
    np.testing.assert_allclose([t[(t > 5) & (t < 8.5)][0], t[t < 8.5][-1]], [7.0, 8.0], atol=1e-9)
    np.testing.assert_allclose([t[t > 8.5][0], t[-1]], [8.95, 9.15], atol=1e-9)
    t, _ = lost(PreprocessSpec(window=0.1, standstill="keep"), "b")
    np.testing.assert_allclose(t[(t > 4) & (t < 6)], [5.0, 5.001], atol=1e-9)
    t, _ = lost(PreprocessSpec(window=0.1, torque="same", standstill="keep"), "c")  # columns see filtered angles, torque its own filter
    np.testing.assert_allclose([t[0], t[t < 5][-1]], [2.9, 3.3], atol=1e-9)
    np.testing.assert_allclose([t[(t > 5) & (t < 8.5)][0], t[t < 8.5][-1]], [6.95, 8.05], atol=1e-9)
    both = PreprocessSpec(window=0.1, standstill=0.5)
    t, piece = lost(both, "b")
    assert not piece.use[np.abs(piece.qd) < 0.5].any() and np.isin(np.round([3.1, 5.0], 6), np.round(t, 6)).all()


def test_spikes_do_not_spread_through_a_filter():
    made = segment(noise=0.02)
    spiked = changed(made, tau=(slice(5000, 5001), 1, made.tau[5000, 1] + 30.0))
    (spike,) = find(spiked, JOINTS, log="made.csv")
    spec = PreprocessSpec(window=0.1, torque="same", standstill="keep")
    clean, seen = (prepare([log(s, events=e)], spec, JOINTS).pieces[0] for s, e in ((made, ()), (spiked, (spike,))))
    np.testing.assert_allclose(seen.tau, clean.tau, atol=0.02)
    assert np.sum(~seen.use) == 1
    clean, seen = (lowpassed([log(s, events=e)], JOINTS, 15.0) for s, e in ((made, ()), (spiked, (spike,))))
    np.testing.assert_allclose(seen.pieces[0].tau, clean.pieces[0].tau, atol=0.02)


def test_the_view_of_the_diagnosis_leaves_events_out():
    made = segment()
    knock = Event("knock", "made.csv", 3.0, 3.2, JOINTS, "both")
    plain, motion_ = (lowpassed([log(made, events=e)], JOINTS, 15.0) for e in ((), (knock,)))
    (before,), (piece,) = plain.pieces, motion_.pieces
    near = (piece.t > 2.99) & (piece.t < 3.21)
    assert not piece.use[near].any() and motion_.events == (knock,) and motion_.disturbed > 0
    far = (piece.t < 2.7) | (piece.t > 3.5)
    np.testing.assert_array_equal(piece.use[far], before.use[far])


def test_a_log_without_events_keeps_every_row_and_one_with_them_does_not_disturb_the_others():
    assert prepare([log(segment())], PreprocessSpec(standstill="keep"), JOINTS).pieces[0].use is None
    spike = Event("spike", "made.csv", 5.0, 5.0, ("b",))
    one, two = prepare([log(segment(), events=[spike]), log(segment())], PreprocessSpec(standstill="keep"), JOINTS).pieces
    assert np.sum(~one.use) == 1 and two.use.all()


def test_a_fit_says_what_it_left_out(experiment, cli):
    def spiked(columns):
        columns["tau_shoulder"][[150, 400]] += 12.0
        return columns

    folder = experiment(train=spiked)
    said = cli("fit", folder, "--json")
    assert said.status == 0, said.err
    document = json.loads(said.out)
    found = [event for event in document["events"] if event["part"] == "train"]
    assert [(e["kind"], e["log"], e["joints"], e["start"], e["stop"]) for e in found] == [
        ("spike", "train.csv", ["shoulder"], 0.75, 0.75), ("spike", "train.csv", ["shoulder"], 2.0, 2.0)
    ]  # fmt: skip
    (notice,) = [text for text in document["notices"] if "preprocess.events: keep" in text]
    for words in (
        "0.2 % of the training rows",
        "2 torque spikes",
        "train.csv at 0.75, 2 s on shoulder",
    ):
        assert words in notice
    kept = json.loads(
        cli(
            "fit",
            experiment(train=spiked, config={"preprocess.events": "keep"}, name="kept"),
            "--json",
        ).out
    )
    clean = json.loads(cli("fit", experiment(name="clean"), "--json").out)
    assert kept["events"] == clean["events"] == []
    assert kept["rms"]["train"]["shoulder"] > 5 * clean["rms"]["train"]["shoulder"]
    np.testing.assert_allclose(document["rms"]["train"]["shoulder"], clean["rms"]["train"]["shoulder"], rtol=0.02)


def test_the_paper_s_experiments_keep_every_row():
    folder = Path(__file__).resolve().parent.parent / "configs"
    assert config.load(folder / "cheetah3.yaml").preprocess.events == "keep"
    assert config.load(folder / "cheetah3_mit.yaml").preprocess.events == "keep"
    assert PreprocessSpec().events == "mask"


def test_events_are_masked_or_kept(experiment, cli):
    said = cli("fit", experiment(config={"preprocess.events": "drop"}))
    said.complains("preprocess.events", "line", "'mask' or 'keep'")


REAL = os.environ.get("SYSID_DATA_DIR")


def real(name: str) -> dict[str, tuple[tuple[Event, ...], Log]]:
    folder = Path(REAL or "") / name
    if REAL is None or not (folder / "config.yaml").exists():
        pytest.skip(f"{name} is not in the data folder that SYSID_DATA_DIR names")
    experiment = pipeline.load(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        machine = pipeline.build(experiment)[0]
        logs = experiment_logs.read(experiment, machine, [*experiment.data.train, *experiment.data.test])
    return {one.name: one for one in logs}


def share(log: Log, kinds, joints, reach: float) -> float:
    events = [event for event in log.events if event.kind in kinds]
    return float(np.mean([~usable(s.t, joints, events, angles=reach) for s in log.segments]))


def test_rokae_was_knocked_three_times():
    logs = real("rokae")
    joints = tuple(f"j{k}" for k in range(1, 8))
    for name, times in (("train.csv", (4.1, 8.2)), ("test.csv", (16.5,))):
        knocks = [event for event in logs[name].events if event.kind == "knock"]
        assert len(knocks) == len(times)
        for event, at in zip(knocks, times):
            assert event.start - 0.1 < at < event.stop + 0.1 and len(event.joints) >= 5
        assert share(logs[name], ("spike", "brake", "frozen"), joints, 0.05) < 0.02


def test_kinova_s_currents_spike_on_the_first_joints():
    for one in real("kinova").values():
        spikes = [event for event in one.events if event.kind == "spike"]
        assert {"joint_1", "joint_2", "joint_3", "joint_4"} <= {event.joints[0] for event in spikes}
        # a sample or a few (three) every 0.3 s at 250 Hz
        assert share(one, ("spike",), tuple(f"joint_{k}" for k in range(1, 8)), 0.0) < 0.04


def test_schunk_s_brakes_close():
    logs = real("schunk")
    assert len(logs) == 15
    for one in logs.values():
        brakes = [event for event in one.events if event.kind == "brake"]
        assert {"j2", "j3", "j4", "j5"} <= {event.joints[0] for event in brakes}


@pytest.mark.parametrize("name", ["kr300", "odrive"])
def test_standing_ripple_and_gear_impacts_are_left_in(name):
    for one in real(name).values():
        lost = np.mean([~usable(s.t, joints(one), one.events, angles=0.05) for s in one.segments])
        assert lost < 0.01


def joints(one: Log) -> tuple[str, ...]:
    return ("axis0",) if one.segments[0].q.shape[1] == 1 else tuple(f"A{k}" for k in range(1, 7))


@pytest.mark.parametrize("value", [0.0, 2.5])
def test_a_torque_that_never_changes_though_the_joint_moves_was_not_logged(value):
    made = changed(segment(), tau=(slice(None), 1, value))
    still = changed(made, q=(slice(None), 1, 0.3))
    ends = lambda own: (own.t[0], own.t[-1], np.stack([extent(own)]))  # noqa: E731
    (found, rests) = unlogged([("a.csv", *ends(made)), ("b.csv", *ends(still))], JOINTS)
    (event,) = found
    assert (event.kind, event.joints, event.signal) == ("missing", ("b",), "torque")
    assert (event.start, event.stop) == (made.t[0], made.t[-1])
    use = usable(made.t, JOINTS, [event])
    assert not use[:, 1].any() and use[:, [0, 2]].all()
    # one that stands still may need the same torque throughout; what is none elsewhere is none there
    assert [event.log for event in rests] == ["b.csv"]
    assert unlogged([("b.csv", *ends(still))], JOINTS) == [[]]
    # a log in parts is one: it moves in one of them
    parts = np.stack([extent(made), extent(still)])
    assert len(unlogged([("a.csv", 0.0, 30.0, parts)], JOINTS)[0]) == 1
    other = np.stack([extent(made), extent(changed(made, tau=(slice(None), 1, value + 1.0)))])
    assert unlogged([("a.csv", 0.0, 30.0, other)], JOINTS) == [[]]


def test_an_actuator_s_torque_may_be_the_same_throughout(experiment):
    """What a constant command makes; and spans of a long log are one log."""
    lacks = lambda columns: columns | {"tau_elbow": 1.5 + 0.0 * columns["tau_elbow"]}  # noqa: E731
    spec = pipeline.load(experiment(train=lacks, test=lacks))
    machine, structure, _ = pipeline.build(spec)
    (log,) = experiment_logs.read(spec, machine, spec.data.train)
    assert [event.joints for event in log.events if event.kind == "missing"] == [("elbow",)]
    plain = replace(log, events=())
    (log,) = experiment_logs.with_events(machine, [plain], driven=["elbow"])
    assert not any(event.kind == "missing" for event in log.events)
    (whole,) = log.segments
    third = len(whole.t) // 3
    gone = replace(
        plain,
        segments=tuple(replace(whole, t=whole.t[rows], q=whole.q[rows], tau=whole.tau[rows]) for rows in (slice(0, third), slice(third, None))),
    )
    (log,) = experiment_logs.with_events(machine, [gone])
    (event,) = [event for event in log.events if event.kind == "missing"]
    assert (event.start, event.stop) == (whole.t[0], whole.t[-1])


@pytest.mark.parametrize(
    ("struck", "who"),
    [
        ("abcd" * 5, ""), ("b" * 3, ""), ("b" * 5, "5 knocks are on b:"), ("b" * 4 + "ac" * 3, "4 knocks are on b:"), ("abc" * 4, ""), ("bbbbccccad", "4 knocks are on b and c:"), ("a" * 7 + "b" * 7 + "c" * 6 + "d" * 4, ""), ("", ""),
    ],
)  # fmt: skip
def test_what_strikes_one_joint_again_and_again_may_be_its_own_play(struck, who):
    """On a robot of four joints; most of them are pushed by somebody. One joint alone may have play."""
    said = again(list(struck), 4)
    assert said.startswith(who) and bool(said) is bool(who)
    knocks_ = [Event("knock", "made.csv", float(k), k + 0.1, (joint,), "both") for k, joint in enumerate(struck)]
    notices = told(knocks_, 0.01, "training", 4)
    assert any(who and notice.startswith(who) and notice.endswith("(training logs)") for notice in notices) is bool(who)
    assert again(["a"] * 5, 1).startswith("5 knocks are on a:")
    document = {"joints": dict.fromkeys("abcd"), "events": [{"kind": "knock", "joints": list("ab"[: 1 + (k < 2)])} for k in range(6)]}
    first = {j: {s: where.struck({"joint": j, "status": s}, document) for s in ("unknown", "unresolved", "missing", "complete")} for j in "ab"}
    assert {(j, s) for j, by in first.items() for s, words in by.items() if words} == {("a", "unknown"), ("a", "unresolved")}
    assert first["a"]["unknown"].startswith("6 knocks on it are left out: where nobody pushed, ask with `events: keep`")


def test_a_knock_is_as_long_as_the_clock_is_not_told_about_it():
    """Where stamps jitter, the errors that stay beside a knock make of an acceleration several times what they do elsewhere."""
    t = 0.01 * np.arange(1000)
    below = np.full(1000, 4.0)
    below[470:560] = 16.0  # about the knock at 5 s
    below[800:830] = 16.0  # a fast move, far from any
    left = Left(1e-3, (25.0, 16.0, 4.0), below, np.zeros((3, 1000)), 0.01)
    zero = np.zeros((1000, 2))
    segment = Segment(t, 0.01, zero, zero, None, None, {}, clock=left)
    found = [Event("knock", "log", 5.0, 5.1, ("a", "b"), "both"), Event("spike", "log", 5.0, 5.0, ("a",)), Event("knock", "log", 2.0, 2.1, ("a", "b"), "both")]
    long, spike, other = with_clock(found, segment)
    # no longer than a period of the usual frequency to either side: beyond that it is the motion that is fast
    assert (long.start, long.stop) == pytest.approx((4.75, 5.35)) and (spike, other) == (found[1], found[2])
    short = replace(left, below=np.where(np.abs(t - 5.05) < 0.195, 16.0, 4.0))
    (near, *_) = with_clock(found, replace(segment, clock=short))
    assert (near.start, near.stop) == pytest.approx((4.86, 5.24))
    assert with_clock(found, replace(segment, clock=None)) == found


def test_coarse_values_that_were_resampled_are_not_held():
    """Between two equal ones everything resampled is equal: few repeats, of which many go on. Of 400 logs of six joints one may have some."""
    rng, t, told = np.random.default_rng(7), np.arange(2000) * 0.01, 0
    for _ in range(400):
        taken = t + rng.uniform(-0.0015, 0.0015, len(t))
        tau = np.round(rng.normal(0.0, rng.uniform(1.0, 3.0), len(t)) + 4.0 * np.sin(0.8 * taken))
        told += bool(held_torque(np.interp(t, taken, tau), 0.01, among=6))
    assert told <= 2


@pytest.mark.parametrize("freezes", [0, 20])
def test_a_freeze_is_found_beside_many_short_ones(freezes):
    """These say nothing of how coarse a torque is: what each holds comes once."""
    rng, found = np.random.default_rng(0), 0
    for _ in range(20):
        tau = rng.normal(0.0, 1.0, 2000) + 5.0 * np.sin(np.arange(2000) * 0.02)
        for first in range(20, 20 + 80 * freezes, 80):
            tau[first : first + 4] = tau[first]
        tau[1800:1820] = tau[1800] + 6.0  # entered and left by a jump
        found += any(a <= 1801 and b >= 1818 for a, b in held_torque(tau, 0.01, among=6))
    assert found == 20
