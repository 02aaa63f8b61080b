"""Knocks that only the robot's own equations show, held against what truth.json says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid import experiment_logs, pipeline
from sysid import rows as rows_of
from sysid.bumps import _outweighing, apart, bumps
from sysid.events import Event
from sysid.listed_effects import build
from sysid.lowpass import lowpassed
from sysid.simulate import hidden, load, simulate, write
from sysid.specs import EffectSpec
from sysid.warned import noticed

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def leg():
    return load(ROOT / "configs" / "cheetah3.yaml")


@pytest.fixture(scope="module")
def pushed(leg, tmp_path_factory):
    """The leg's logs, pushed three times in each; and what was done to it."""
    experiment, machine, *_ = leg
    made = simulate(machine, seed=3, duration=12.0, rate=500.0, knocks=3)
    folder = tmp_path_factory.mktemp("pushed")
    write(made, experiment, folder)
    return pipeline.load(folder), {name: [e for e in log.events if e["kind"] == "knock"] for name, log in made.logs.items()}


def read(experiment):
    machine, *_ = pipeline.build(experiment)
    with noticed():
        return machine, experiment_logs.read(experiment, machine, [*experiment.data.train, *experiment.data.test])


def test_pushes_that_no_signal_shows_are_found_and_left_out(pushed):
    experiment, truth = pushed
    machine, logs = read(experiment)
    found = {log.path.stem: [e for e in log.events if e.kind == "knock"] for log in logs}
    hit = total = 0
    for name, done in truth.items():
        for event in found[name]:
            assert any(event.start < one["stop"] + 0.1 and one["start"] < event.stop + 0.1 for one in done)
            assert len(event.joints) >= 2 and event.stop - event.start < 0.25
        hit += sum(any(e.start < one["stop"] + 0.05 and one["start"] < e.stop + 0.05 for e in found[name]) for one in done)
        total += len(done)
    # one in a few comes while two of three joints turn round, where no row counts anyway
    assert total == 6 and hit >= 4
    plain = experiment.model_copy(update={"preprocess": experiment.preprocess.model_copy(update={"events": "keep", "window": 0.1})})
    errors = [pipeline.fit(one).rms("test").values() for one in (experiment, plain)]
    assert sum(errors[0]) < 0.8 * sum(errors[1])
    assert all(not log.events for log in read(plain)[1])


@pytest.mark.long
@pytest.mark.parametrize("hide", [(), ("backlash:hip:b=0.02",), ("torque_saturation:knee:limit=2.0",), ("stribeck:abad",)])
def test_what_a_joint_does_by_itself_is_no_push(leg, tmp_path, hide):
    experiment, machine, *_ = leg
    made = simulate(machine, hide=[hidden(h) for h in hide], seed=4, duration=12.0, rate=500.0)
    write(made, experiment, tmp_path / "logs")
    _, logs = read(pipeline.load(tmp_path / "logs"))
    assert not [e for log in logs for e in log.events if e.kind == "knock"]


def test_a_log_too_short_is_asked_nothing(pushed):
    machine, logs = read(pushed[0])
    (segment,) = logs[0].segments
    short = replace(segment, **{name: getattr(segment, name)[:20] for name in ("t", "q", "tau")})
    assert bumps(machine, [replace(logs[0], events=(), segments=(short,))]) == []


def test_bursts_that_keep_coming_are_how_the_machine_moves(leg, tmp_path):
    """Ten pushes in ten seconds: somebody works with this arm, and every log of it looks like this."""
    experiment, machine, *_ = leg
    write(simulate(machine, seed=5, duration=10.0, rate=500.0, knocks=12), experiment, tmp_path / "logs")
    found = pipeline.load(tmp_path / "logs")
    machine, logs = read(found)
    assert bumps(machine, [log for log in logs if log.path.stem == "train"]) == []


@pytest.mark.long
def test_pushes_of_an_arm_with_play_are_found(leg, tmp_path):
    """Play jars its joint more often than anybody knocks: the other joints say what else there was."""
    experiment, machine, *_ = leg
    made = simulate(machine, hide=[hidden("backlash:abad:b=0.0063")], seed=154, duration=3.5, rate=1000.0, logs=6, knocks=1)
    write(made, experiment, tmp_path / "logs")
    machine, logs = read(pipeline.load(tmp_path / "logs"))
    hit = 0
    for log in logs:
        done = [e for e in made.logs[log.path.stem].events if e["kind"] == "knock"]
        for event in (e for e in log.events if e.kind == "knock"):
            assert any(event.start < one["stop"] + 0.1 and one["start"] < event.stop + 0.1 for one in done)
            hit += 1
    assert hit >= 3
    # what its own signals show of the joint that jars is nothing that the others could belie
    shown = Event("knock", logs[0].name, 0.9, 0.93, ("abad",), "torque")
    told = bumps(machine, [replace(log, events=(shown,) if log is logs[0] else ()) for log in logs[:-1]])
    assert any("abad" in event.joints and event.start <= 0.93 and event.stop >= 0.9 for event in told)


def test_times_are_the_logs_own(pushed):
    _, logs = read(pushed[0])
    assert all(isinstance(e, Event) and isinstance(e.start, float) and np.isfinite(e.stop) for log in logs for e in log.events)


@pytest.mark.parametrize(("apart", "found"), [(0.02, 1), (0.2, 0)])
def test_a_push_stands_on_two_joints_within_a_burst(pushed, monkeypatch, apart, found):
    """Each joint's rows may count at other moments of it, as one of them turns round."""
    from sysid import bumps as module

    machine, logs = read(pushed[0])
    shift = iter((0.0, apart))

    def surprise(size, use, piece, step):
        out, late = np.full(len(size), -1.0), next(shift, np.inf)
        if np.isfinite(late):
            out[500 + round(late / step)] = 100.0
        return out

    monkeypatch.setattr(module, "_surprise", surprise)
    monkeypatch.setattr(module, "_SHARE", -1.0)  # however far torque goes
    assert len(bumps(machine, [replace(log, events=()) for log in logs])) == found


def pulsed(log, at: float, joint: int, size: float):
    """A log with 60 ms of what drives one joint alone."""
    (segment,) = log.segments
    share = np.clip((segment.t - at) / 0.06, 0.0, 1.0)
    tau = segment.tau.copy()
    tau[:, joint] += size * np.std(tau[:, joint]) * np.sin(np.pi * share)
    return replace(log, events=(), segments=(replace(segment, tau=tau),))


def test_what_outweighs_all_the_rest_on_one_joint_is_a_push(leg, tmp_path):
    """It says nothing of how the joint moves otherwise; a tenth of it may."""
    experiment, machine, *_ = leg
    write(simulate(machine, seed=4, duration=12.0, rate=500.0), experiment, tmp_path / "logs")
    log = next(log for log in read(pipeline.load(tmp_path / "logs"))[1] if log.path.stem == "train")
    (event,) = bumps(machine, [pulsed(log, 5.0, 1, 3.0)])
    assert event.joints == (machine.joints[1],) and 4.9 < event.start < 5.06 < event.stop + 0.06 < 5.3
    assert bumps(machine, [pulsed(log, 5.0, 1, 0.1)]) == []


@pytest.mark.parametrize("seconds", [6.0, 20.0, 200.0])
def test_a_longer_log_hides_no_push(seconds):
    """One burst, of the square that is usual in seven seconds or in five; and in many bursts, one of them as great, where all counts."""
    step, level = 0.01, 12.0
    n = round(seconds / step)
    for as_much, found in ((7.0, True), (5.0, False)):
        size, surprises, use = np.ones((n, 1)), np.zeros((n, 1)), np.ones((n, 1), dtype=bool)
        size[300], surprises[300] = np.sqrt(as_much / step), 2.0 * level
        assert bool(_outweighing(surprises, size, use, np.arange(n), step, level)) is found
        size[150::200], surprises[150::200] = 5.0, 2.0 * level
        assert bool(_outweighing(surprises, size, use, np.arange(n), step, level)) is (found and seconds < 7.0)


def clipped(log, joint: int, share: float):
    """A log whose reading of a joint's torque goes no further than a share of the greatest."""
    (segment,) = log.segments
    tau, top = segment.tau.copy(), np.abs(segment.tau[:, joint]).max()
    noise = 0.002 * top * np.random.default_rng(0).normal(size=len(tau))
    tau[:, joint] = np.clip(tau[:, joint], -share * top, share * top) + noise
    return replace(log, events=(), segments=(replace(segment, tau=tau),))


@pytest.mark.long
@pytest.mark.parametrize(("seed", "joint", "share"), [(6, 0, 0.8), (6, 2, 0.6), (7, 1, 0.7), (11, 2, 0.7)])
def test_torque_at_its_limit_is_no_push(leg, tmp_path, seed, joint, share):
    """It should have gone further, and is as great as anywhere; beside it a push is one."""
    experiment, machine, *_ = leg
    write(simulate(machine, seed=seed, duration=12.0, rate=500.0), experiment, tmp_path / "logs")
    log = next(log for log in read(pipeline.load(tmp_path / "logs"))[1] if log.path.stem == "train")
    assert bumps(machine, [clipped(log, joint, share)]) == []
    (event,) = bumps(machine, [clipped(pulsed(log, 5.0, (joint + 1) % 3, 6.0), joint, share)])
    assert machine.joints[(joint + 1) % 3] in event.joints and 4.9 < event.start < 5.06


def test_pushes_behind_a_greater_one_are_found(leg, tmp_path):
    """Which bends the fit until it is left out."""
    experiment, machine, *_ = leg
    write(simulate(machine, seed=4, duration=12.0, rate=500.0), experiment, tmp_path / "logs")
    log = next(log for log in read(pipeline.load(tmp_path / "logs"))[1] if log.path.stem == "train")
    both = pulsed(pulsed(log, 5.0, 1, 30.0), 8.0, 1, 1.5)
    assert [round(event.start) for event in sorted(bumps(machine, [both]), key=lambda e: e.start)] == [5, 8]


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 4, 9])
def test_a_quick_move_among_slow_ones_is_no_knock(planar, tmp_path, seed, monkeypatch):
    """The signals show one; the robot's equations follow it."""
    (tmp_path / "plain.yaml").write_text(f"robot: {{urdf: {planar.path}}}\n")
    experiment, machine, *_ = load(tmp_path / "plain.yaml")
    write(simulate(machine, seed=seed, duration=12.0, rate=500.0, motion="moves"), experiment, tmp_path / "logs")
    shown, whole = [], experiment_logs.bumps
    monkeypatch.setattr(
        experiment_logs, "bumps",
        lambda robot, logs, **how: shown.extend(e for log in logs for e in log.events if e.kind == "knock") or whole(robot, logs, **how),
    )  # fmt: skip
    _, logs = read(pipeline.load(tmp_path / "logs"))
    assert shown and not [e for log in logs for e in log.events if e.kind == "knock"]


def test_columns_apart_are_those_of_the_rows(pushed):
    """In less memory: without the parameters that cannot enter a joint's torque; and pieces hold no sample that is none of theirs."""
    experiment, _ = pushed
    machine, logs = read(experiment)
    motion = lowpassed(logs, machine.joints, 8.0)
    assert all(getattr(piece, name).base is None for piece in motion.pieces for name in ("q", "qd", "qdd"))
    model = build(machine, [EffectSpec(name=name) for name in ("viscous", "coulomb", "torque_bias")])
    whole, (rows, parts) = rows_of.stack(model, motion, 3), apart(model, motion, 3)
    np.testing.assert_array_equal(rows.tau, whole.tau)
    for joint, (support, own) in enumerate(parts):
        np.testing.assert_array_equal(support, model.support(joint))
        np.testing.assert_allclose(own.T, whole.columns[joint][:, model.support(joint)], rtol=1e-12, atol=1e-14)
        assert np.count_nonzero(whole.columns[joint]) == np.count_nonzero(own)
