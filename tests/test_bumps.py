"""Knocks that only the robot's own equations show, held against what truth.json says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid import experiment_logs, pipeline
from sysid import rows as rows_of
from sysid.bumps import apart, bumps
from sysid.events import Event
from sysid.listed_effects import build
from sysid.lowpass import lowpassed
from sysid.notices import noticed
from sysid.simulate import hidden, load, simulate, write
from sysid.specs import EffectSpec

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
    plain = experiment.model_copy(update={"preprocess": experiment.preprocess.model_copy(update={"events": "keep"})})
    errors = [pipeline.fit(one).rms("test").values() for one in (experiment, plain)]
    assert sum(errors[0]) < 0.8 * sum(errors[1])
    assert all(not log.events for log in read(plain)[1])


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


def test_times_are_the_logs_own(pushed):
    _, logs = read(pushed[0])
    assert all(isinstance(e, Event) and isinstance(e.start, float) and np.isfinite(e.stop) for log in logs for e in log.events)


@pytest.mark.parametrize(("apart", "found"), [(0.02, 1), (0.2, 0)])
def test_a_push_stands_on_two_joints_within_a_burst(pushed, monkeypatch, apart, found):
    """Each joint's rows may count at other moments of it, as one of them turns round."""
    from sysid import bumps as module

    machine, logs = read(pushed[0])
    joints = iter((500, 500, 500))
    shift = iter((0.0, apart, np.inf))

    def surprise(size, use, piece, step):
        out, at, late = np.full(len(size), -1.0), next(joints), next(shift)
        if np.isfinite(late):
            out[at + round(late / step)] = 100.0
        return out

    monkeypatch.setattr(module, "_surprise", surprise)
    assert len(bumps(machine, [replace(log, events=()) for log in logs])) == found


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
