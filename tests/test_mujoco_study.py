"""The study of arms in MuJoCo: what it hides, and how it counts."""


import mujoco
import numpy as np
import pytest

from scripts.mujoco_parts import plant, trial
from tests.servos import arm_urdf


@pytest.fixture(scope="module")
def arm():
    return plant.arm_of(arm_urdf(np.random.default_rng(3), 3), np.random.default_rng(3))


def test_every_effect_is_hidden_and_one_arm_in_five_has_nothing():
    cases = [trial.case(7, number) for number in range(100)]
    assert cases == [trial.case(7, number) for number in range(100)]
    assert {c["effect"] for c in cases} == {None, *plant.HIDDEN} and sum(c["effect"] is None for c in cases) == 20
    assert {c["arm"] for c in cases} == set(trial.ARMS)


def test_sensors_read_and_motors_act_as_they_are_said_to(arm):
    """A gain, 8 ms of delay, and 63 % of a step after the time constant of a lag; all other joints as they are."""
    after = {}
    for effect in plant.SENSORS:
        law = plant.Law(effect, arm, 1)
        told = law.acts if effect == "current_lag" else law.seen
        told(np.array([5.0, 0.0, 5.0]))
        after[effect] = [told(np.array([5.0, 1.0, 5.0])) for _ in range(round(0.01 / plant.STEP))]
        assert all((seen[[0, 2]] == 5.0).all() for seen in after[effect])
    assert after["torque_gain"][-1][1] == pytest.approx(1.15)
    assert [seen[1] for seen in after["delay"]].index(1.0) == round(0.008 / plant.STEP)
    assert after["current_lag"][-1][1] == pytest.approx(1.0 - np.exp(-1.0), abs=0.02)
    np.testing.assert_allclose(plant.Law("encoder_offset", arm, 1).read(np.zeros(3)), [0.0, 0.06, 0.0])


@pytest.mark.parametrize("effect", plant.TORQUES)
def test_friction_takes_and_the_rest_does_not_depend_on_speed(arm, effect):
    """What acts beside the motor at 0.5 rad/s one way and the other, of a log that has lasted."""
    there, back = (plant.Law(effect, arm, 1) for _ in range(2))
    ahead, behind = ([law.torque(0.3, speed, 20.0) for _ in range(400)][-1] for law, speed in ((there, 0.5), (back, -0.5)))
    assert np.isfinite([ahead, behind]).all() and abs(ahead) + abs(behind) > 0.0
    if effect in ("torque_bias", "cogging"):
        assert ahead == behind
    elif effect == "warmup":  # friction that fell, and is not all gone
        assert 0.0 < ahead == -behind < arm.friction[1]
    else:
        assert ahead <= 0.0 and (effect.startswith("asymmetric") or behind >= 0.0)


def test_a_soft_and_a_loose_joint_are_measured_at_the_motor(arm):
    """The link hangs on a hinge of its own, which no log reads."""
    for effect in ("elasticity", "backlash"):
        model = plant.built(arm, effect, 1, np.random.default_rng(0))
        link, own = model.joint("link"), model.joint(arm.names[1])
        assert model.nv == 4 and link.dofadr[0] == own.dofadr[0] + 1 and link.bodyid == own.bodyid
        assert (model.jnt_stiffness[link.id] > 0.0) == (effect == "elasticity") == (not model.jnt_limited[link.id])
    assert mujoco.MjSpec.from_string(arm.urdf).compile().nv == 3


def test_labs_have_manners_of_their_own():
    drawn = [plant.Manner(**trial.case(7, number, "labs")["manner"]) for number in range(100)]
    assert {m.motion for m in drawn} == {"sines", "moves"} and {m.rate for m in drawn} == {100.0, 200.0, 500.0, 1000.0}
    for name in ("jitter", "steps", "spikes", "knocks"):
        assert 20 < sum(bool(getattr(m, name)) for m in drawn) < 50
    assert plant.Manner(**trial.case(7, 0)["manner"]) == plant.Manner()


def test_moves_go_from_rest_to_rest_and_are_derivatives_of_each_other():
    t, q, qd, qdd = plant.moves(np.random.default_rng(1), 2)
    assert np.abs(qd[0]).max() == np.abs(qdd[0]).max() == 0.0 and np.abs(q).max() <= 1.2
    np.testing.assert_allclose(np.gradient(q, plant.STEP, axis=0)[1:-1], qd[1:-1], atol=2e-3)
    np.testing.assert_allclose(np.gradient(qd, plant.STEP, axis=0)[1:-1], qdd[1:-1], atol=0.1)
    rests = np.all(qd == 0.0, axis=1)
    assert 0.1 < rests.mean() < 0.7 and 6 < np.count_nonzero(np.diff(rests.astype(int)) == 1) < 30


def test_a_slow_motion_is_one_sine_a_joint():
    t, q, qd, qdd = plant.slow(np.random.default_rng(1), 3)
    np.testing.assert_allclose(np.gradient(q, plant.STEP, axis=0)[1:-1], qd[1:-1], atol=1e-4)
    square = -(qdd / q)[np.abs(q).min(axis=1) > 0.01]
    np.testing.assert_allclose(square, np.broadcast_to(square[0], square.shape), rtol=1e-6)
    assert np.abs(q).max() <= 1.0 and (square[0] < (2.0 * np.pi * 0.3) ** 2).all()


def test_logs_are_read_as_their_manner_says(arm):
    rng, n = np.random.default_rng(2), 4000
    steps = sorted(plant.samples(rng, plant.Manner(rate=100.0, jitter=0.2), n))
    assert steps[0] >= 0 and steps[-1] < n and len(steps) == n // 20
    assert np.ptp(np.array(steps) - 20 * np.arange(len(steps))) == 8  # 4 steps early to 4 late
    plain = np.column_stack([plant.STEP * np.arange(n), rng.normal(size=(n, 6))])
    coarse = plant.read(plain.copy(), rng, plant.Manner(noise=0.0, steps=0.01, bits=10, spikes=0.01))
    np.testing.assert_allclose(coarse[:, 1:4] / (2.0 * np.pi / 1024), np.round(coarse[:, 1:4] / (2.0 * np.pi / 1024)), atol=1e-9)
    assert np.abs(coarse[:, 1:4] - plain[:, 1:4]).max() <= 1.0001 * np.pi / 1024
    spiked = np.abs(coarse[:, 4:] - plain[:, 4:]) > 4.0
    assert 0.005 < spiked.mean() < 0.015 and len(np.unique(coarse[:, 4])) < 250
    blows = plant.knocked(rng, 3, arm.torque, plant.STEP * np.arange(40000))
    struck = np.any(blows != 0.0, axis=1)
    assert np.count_nonzero(np.diff(struck.astype(int)) == 1) == 3 and struck.sum() == pytest.approx(3 * 0.05 / plant.STEP, rel=0.05)


def test_a_claim_is_there_where_its_set_holds_what_is_hidden():
    one = {"effect": "spring", "joint": "a", "visible": True, "status": {"a": "missing"}}
    results = [
        {**one, "heads": [("spring", "a")], "sets": [[("spring", "a")]]},
        {**one, "heads": [("cable", "a")], "sets": [[("cable", "a"), ("spring", "a")]]},
        {**one, "heads": [("cable", "a")], "sets": [[("cable", "a")]]},
        {**one, "effect": None, "visible": False, "heads": [], "sets": [], "status": {"a": "unknown"}},
    ]
    said = trial.table(results)
    assert "named 1/3, in the set 2/3" in said[1] and "by sets 1/3: cable for spring" in said[2] and "0/1" in said[3]
