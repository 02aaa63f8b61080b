"""What each effect does, against closed forms, Pinocchio and a fine integration of the same law."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from sysid import effect, pipeline, regressor, robot, robot_spec, specs, vocabulary
from sysid.addition import grown
from sysid.candidates import candidates
from sysid.errors import ConfigError
from sysid.inertia import pseudo
from sysid.model import Model
from sysid.model_parameters import ROBOT
from sysid.motion import Piece
from sysid.per_level import at_level
from sysid.simulate import hidden, load, simulate, write
from sysid.warned import noticed
from tests.problems import UR5, fourier_motion

SLIDE = """<robot name="slide"><link name="base"/>
<link name="cart"><inertial><origin xyz="0 0 0.1"/><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<link name="arm"><inertial><origin xyz="0.2 0 0.1"/><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="0 0.6 0.8"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
<joint name="hinge" type="revolute"><parent link="cart"/><child link="arm"/><origin xyz="0 0.1 0.2"/><axis xyz="0 1 0"/>
<limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>"""


def piece_of(machine, t, q, qd, qdd, **more) -> Piece:
    """A motion as effects see it, with the load of the robot's prior bodies."""
    load = regressor.torque(machine, machine.prior, q, qd, qdd)
    return Piece(
        log=0, step=float(t[1] - t[0]), t=t, q=q, qd=qd, qdd=qdd, tau=load, measured=load, signals={}, use=None, smoother=None,
        core=slice(0, len(t)), rest=np.zeros(q.shape[1]), noise=np.zeros(q.shape[1]), load=load, **more,
    )  # fmt: skip


@cache
def moving() -> tuple:
    """A slide with a hinged arm, and a motion of it that begins at rest."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "slide.urdf"
        file.write_text(SLIDE)
        machine = robot.load(robot_spec.RobotSpec(urdf=str(file)))
    t, q, qd, qdd = fourier_motion(np.random.default_rng(1), 2.0, 200.0, machine.dof)
    still = t < 0.25
    q[still], qd[still], qdd[still] = q[~still][0], 0.0, 0.0
    return machine, piece_of(machine, t, q, qd, qdd)


@cache
def arm_moving() -> tuple:
    """A six-joint arm and a motion of it."""
    machine = robot.load(robot_spec.RobotSpec(urdf=UR5))
    return machine, piece_of(machine, *fourier_motion(np.random.default_rng(2), 3.0, 200.0, machine.dof))


def middle(found, machine, piece, joint) -> dict[str, float]:
    """A value for each shape: midway between its bounds on this motion."""
    of = {
        "": lambda k: 1.0, "speed": lambda k: np.abs(piece.qd[:, k]).max(), "torque": lambda k: np.abs(piece.tau[:, k]).max(),
        "angle": lambda k: np.ptp(piece.q[:, k]), "softness": lambda k: np.ptp(piece.q[:, k]) / np.abs(piece.tau[:, k]).max(), "duration": lambda k: np.ptp(piece.t),
    }  # fmt: skip
    out = {}
    for shape in found.shapes():
        scale = of[shape.of](joint)
        values = shape.values(shape.low * scale, shape.high * scale)
        out[shape.name] = float(values[len(values) // 2])
    return out


def applied(found, machine, piece, joint, shapes) -> list[np.ndarray]:
    """What an effect makes of a motion: its columns, or q, qd, qdd, or the torque that its sensor reads."""
    if isinstance(found, effect.TorqueEffect):
        return [found.columns(piece, joint, **shapes)]
    if isinstance(found, effect.WrenchEffect):
        return [found.columns(piece, machine, **shapes)]
    if isinstance(found, effect.SensorEffect):
        return [found.sensed(piece.tau.T, piece.step, **shapes).T]
    moved = found.moved(piece, joint, **shapes)
    more = [x for x in (moved.gravity, moved.deflection) if x is not None]
    return [moved.q, moved.qd, moved.qdd, *more]


MOVERS = [name for name in vocabulary.vocabulary() if isinstance(vocabulary.find(name), effect.MotionEffect)]
SENSORS = [name for name in vocabulary.vocabulary() if isinstance(vocabulary.find(name), effect.SensorEffect)]


def torque_of(machine, piece) -> np.ndarray:
    """What the prior bodies need on a motion, as the model asks for it."""
    return regressor.torque(machine, machine.prior, piece.q, piece.qd, piece.qdd, gravity=piece.gravity, deflection=piece.deflection)


def rnea(machine, piece, *, model=None) -> np.ndarray:
    """The same by Pinocchio, on q, qd and qdd alone."""
    model = machine.model if model is None else model
    data, turn = model.createData(), machine.transmission
    return np.array([turn.T @ pin.rnea(model, data, turn @ q, turn @ qd, turn @ qdd) for q, qd, qdd in zip(piece.q, piece.qd, piece.qdd)])


def test_grid_of_cogging_misses_no_line():
    """Two neighbouring k turn against each other by less than a quarter turn over the whole travel."""
    k = vocabulary.find("cogging").k
    for angle in (0.05, 1.0, 6.0):
        values = k.values(k.low, k.high, angle)
        assert values[0] == k.low and values[-1] == k.high and np.diff(values).max() * angle <= np.pi / 2
    assert len(k.values(k.low, k.high)) == k.grid and np.diff(k.values(k.low, k.high)).max() < 0.25


def test_a_screw_s_ripple_is_looked_for_down_to_its_pitch():
    """On a joint that slides k counts per metre: up to a pitch of 1 mm, or 120 periods over the travel."""
    cogging, piece = vocabulary.find("cogging"), small_piece()
    sliding = cogging.bound(SimpleNamespace(prismatic=np.array([True, True, False])), 1)
    for travel in (20.0, 2.0, 0.02):  # of joint 1, in m
        seen = replace(piece, q=0.5 * travel * piece.q)
        (k,) = sliding.sized(seen, len(piece.t), 1)
        assert k.name == "k" and k.low == pytest.approx(4.0 * np.pi / travel)
        assert k.high == pytest.approx(min(2000.0 * np.pi, max(120.0, k.low + 240.0 * np.pi / travel)))
        assert len(k.values(k.low, k.high, travel)) <= (k.grid + 2) * max(1.0, travel / 6.0)
    # of one that stands, one that turns, and one of which nobody knows how it moves: as before
    assert sliding.sized(piece, 4, 0) is None and sliding.sized(piece, 4, 2) is None and cogging.sized(piece, 4, 1) is None


@pytest.mark.parametrize("lines", [1, 2])
@pytest.mark.parametrize(
    "tried", [[7.0], [1.0, 5.0, 7.0], [3.0, 2.0, 9.0, 120.0, 1.0], [9.0, 7.0, 5.0, 3.0], *(list(np.linspace(1.0, 120.0, n)) for n in (2, 4, 5, 480))]
)
def test_ripples_of_many_pitches_at_once_are_those_of_each(lines, tried):
    piece, ripple = small_piece(), vocabulary.find("cogging").given(lines=lines)
    found = ripple.columns_at(piece, 1, [{"k": k} for k in tried])
    np.testing.assert_allclose(found, [ripple.columns(piece, 1, k=k) for k in tried], atol=1e-12)


def test_a_ripple_at_one_level_is_nothing_elsewhere_at_many_pitches_either():
    there = at_level(vocabulary.find("cogging"), "robot", "r2", ("r1", "r2"))
    tried = [{"k": k} for k in np.linspace(1.0, 9.0, 9)]
    one, other = (there.columns_at(replace(small_piece(), levels={"robot": level}), 1, tried) for level in ("r1", "r2"))
    assert not np.any(one) and np.all(np.any(other, axis=(1, 2)))


def test_a_ripple_that_is_there_may_have_more_lines():
    found = vocabulary.find("cogging").richer(k=14.0)
    for lines, k in ((4, 14.0), (4, 7.0), (2, 7.0)):
        assert ({"lines": lines}, {"k": k}) in found
    # the line that is there stays, and does not come alone
    assert min(options["lines"] * at["k"] for options, at in found) == 14.0 and all(options["lines"] > 1 for options, _ in found)
    assert all(at["k"] >= 1.0 for _, at in vocabulary.find("cogging").richer(k=2.5))
    assert not vocabulary.find("cogging").given(lines=8).richer(k=14.0) and not vocabulary.find("spring").richer(q0=0.0)


def test_sums_of_few_terms_and_of_many_are_one_kind_of_candidate():
    machine, _ = arm_moving()
    own = [c for c in candidates(SimpleNamespace(robot=machine, terms=())) if c.joint == 0]
    kinds = {name: [c.kind for c in own if c.name == name] for name in ("position_friction", "cable", "elasticity")}
    assert [len(set(kinds[name])) for name in kinds] == [2, 1, 2] and [len(kinds[name]) for name in kinds] == [6, 2, 2]
    assert all(any(c.by_name for c in own if c.name == name) for name in kinds)
    few = vocabulary.find("position_friction").given(times="speed", harmonics=1)
    assert [options for options, _ in few.richer()] == [{"times": "speed", "harmonics": count} for count in (2, 3)]
    assert vocabulary.find("cable").given(order=3).richer() == [({"order": 5}, {})]
    assert vocabulary.find("cable").richer() == [] == vocabulary.find("position_friction").richer()


@pytest.mark.parametrize("name", MOVERS + SENSORS)
@pytest.mark.parametrize("make", [moving, arm_moving])
def test_start_changes_nothing(name, make):
    machine, piece = make()
    for joint in [-1] if vocabulary.find(name).scope == "robot" else range(machine.dof):
        for options in vocabulary.find(name).variants(machine, joint):
            found = vocabulary.find(name).given(**options).bound(machine, joint)
            shapes = middle(found, machine, piece, joint) | {s.name: s.start for s in found.shapes() if s.start is not None}
            if name in SENSORS:
                np.testing.assert_array_equal(found.sensed(piece.tau.T, piece.step, **shapes), piece.tau.T)
            else:
                np.testing.assert_array_equal(torque_of(machine, found.moved(piece, joint, **shapes)), piece.load)


@pytest.mark.parametrize("name", [*MOVERS, *SENSORS, "presliding", "warmup", "joint_coupling"])
@pytest.mark.parametrize("filtered", ["raw", "same"])
def test_columns_of_a_stretch_are_those_of_the_whole(name, filtered):
    from sysid.model import Model, chunks
    from sysid.model_parameters import ROBOT
    from sysid.preprocess import prepare
    from sysid.terms import initial
    from tests.problems import arm_log

    machine, _ = arm_moving()
    spec = specs.PreprocessSpec(torque=filtered)
    motion = prepare([arm_log(machine, np.random.default_rng(0), seconds=4.0)], spec, machine.joints)
    (piece,) = motion.pieces
    joint = ROBOT if vocabulary.find(name).scope == "robot" else 1
    found = vocabulary.find(name).bound(machine, joint)
    model = Model(machine, ((found, (joint,)),)).measured_by(motion)
    shapes = [0.3 * value.high if value.shape.start == 0 else at for value, at in zip(model.shape_values, initial(model))]
    model = model.with_shapes(shapes)
    whole = model.columns(piece, piece.core)
    remembered = model.remembered(piece)
    parts = [model.columns(piece, rows, remembered) for rows in chunks(piece, 150)]
    for joint, columns in enumerate(whole):
        np.testing.assert_allclose(np.concatenate([part[joint] for part in parts], axis=1), columns, atol=1e-9 * np.abs(columns).max())


# ---- sensors


@pytest.mark.parametrize("d", [0.0037, -0.0037, 0.005, -0.0125, 0.03, -0.03])
def test_delay_shifts_a_sine(d):
    step = 0.001
    t = np.arange(2000) * step
    delay = vocabulary.find("delay")
    wave = lambda t: np.stack([np.sin(2 * np.pi * 5 * t), np.cos(2 * np.pi * 12 * t + 1)])  # noqa: E731
    inner = slice(delay.reach, -delay.reach)
    np.testing.assert_allclose(delay.sensed(wave(t), step, d)[:, inner], wave(t - d)[:, inner], atol=1e-6)
    assert delay.sensed(wave(t), step, d).shape == (2, 2000)


def test_delay_by_whole_samples_is_exact_and_holds_the_edges():
    torque = np.random.default_rng(0).normal(size=(3, 200))
    delay = vocabulary.find("delay")
    np.testing.assert_array_equal(delay.sensed(torque, 0.5, 2.0)[:, 4:], torque[:, :-4])
    np.testing.assert_array_equal(delay.sensed(torque, 0.5, 2.0)[:, :4], np.repeat(torque[:, :1], 4, 1))
    np.testing.assert_array_equal(delay.sensed(torque, 0.5, -1.0)[:, -2:], np.repeat(torque[:, -1:], 2, 1))
    assert np.isfinite(delay.sensed(torque, 1e-5, 0.03)).all()


def test_lag_is_undone_by_its_low_pass():
    """What a first-order low-pass of time constant T makes of the reading is the torque."""
    from scipy.signal import lsim, lti

    t = np.arange(4000) * 0.001
    torque, T = np.sin(2 * np.pi * 3 * t) * (1 - np.exp(-10 * t)), 0.02
    read = vocabulary.find("current_lag").sensed(torque[None], 0.001, T)[0]
    np.testing.assert_allclose(lsim(lti([1.0], [T, 1.0]), read, t)[1], torque, atol=5e-4)
    assert vocabulary.find("current_lag").sensed(torque[None, :1], 0.001, T).shape == (1, 1)
    turns = 2.0 * np.pi * 10.0 * np.arange(100) * 0.01  # of a slow logger, what is fast
    made = vocabulary.find("current_lag").sensed(np.sin(turns)[None], 0.01, T)[0] - np.sin(turns)
    np.testing.assert_allclose(made[2:-2], T * 2.0 * np.pi * 10.0 * np.cos(turns)[2:-2], atol=0.006 * T * 2.0 * np.pi * 10.0)


def test_noise_of_the_predicted_torque_does_not_shorten_a_lag():
    """Least squares of what a lag makes of a torque on the rate of a noisy one: differences of neighbours find little more than half of it."""
    t, T, lag = np.arange(20000) * 0.001, 0.01, vocabulary.find("current_lag")
    torque, turns = np.sin(2.0 * np.pi * t) + 0.5 * np.cos(14.0 * t), np.cos(2.0 * np.pi * t) * 2.0 * np.pi - 7.0 * np.sin(14.0 * t)
    noisy = torque + np.random.default_rng(4).normal(scale=0.01, size=t.shape)
    late = torque + T * turns - noisy
    found = lambda rate: np.sum(late * rate) / np.sum(rate**2)  # noqa: E731
    assert found((lag.sensed(noisy[None], 0.001, T)[0] - noisy) / T) == pytest.approx(T, rel=0.02)
    assert found(np.gradient(noisy, 0.001)) < 0.6 * T


def test_what_a_lag_makes_does_not_jump_with_its_time_constant():
    """The window grows with it, by parts of a sample: a sum of a mean and what a sample more adds to it."""
    lag, torque = vocabulary.find("current_lag"), np.random.default_rng(3).normal(size=(1, 300))
    steps = np.linspace(0.0, 0.09, 4000)
    made = np.stack([lag.sensed(torque, 0.001, T)[0] for T in steps])
    assert np.abs(np.diff(made, axis=0)).max() < 0.02 * np.abs(made - torque).max()


def test_gain_multiplies():
    np.testing.assert_allclose(vocabulary.find("torque_gain").sensed(np.array([[1.0, -2.0]]), 0.01, 0.3), [[1.3, -2.6]])


# ---- motion


@pytest.mark.parametrize("make", [moving, arm_moving])
def test_tilt_turns_gravity(make):
    machine, piece = make()
    tilt = vocabulary.find("gravity_tilt").bound(machine, -1)
    model = machine.model.copy()
    model.gravity.linear = pin.rpy.rpyToMatrix(0.2, -0.3, 0.0).T @ machine.gravity
    moved = tilt.moved(piece, -1, roll=0.2, pitch=-0.3)
    np.testing.assert_allclose(torque_of(machine, moved), rnea(machine, piece, model=model), atol=1e-9)


def test_offset_is_another_pose():
    machine, piece = arm_moving()
    moved = vocabulary.find("encoder_offset").moved(piece, 2, d=0.1)
    shifted = replace(piece, q=piece.q + 0.1 * (np.arange(6) == 2))
    np.testing.assert_allclose(torque_of(machine, moved), rnea(machine, shifted), atol=1e-9)


def test_eccentricity_follows_the_chain_rule():
    machine, _ = arm_moving()
    t = np.arange(2000) * 1e-4
    q, qd, qdd = (np.repeat(x[:, None], 6, 1) for x in (np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)))
    piece = piece_of(machine, t, q, qd, qdd)
    moved = vocabulary.find("encoder_eccentricity").moved(piece, 1, s=0.06, c=0.08)
    np.testing.assert_allclose(moved.q[:, 1], q[:, 1] + 0.1 * np.sin(q[:, 1] + np.arctan2(0.08, 0.06)), atol=1e-12)
    np.testing.assert_allclose(moved.qd[1:-1, 1], np.gradient(moved.q[:, 1], 1e-4)[1:-1], atol=1e-6)
    np.testing.assert_allclose(moved.qdd[1:-1, 1], np.gradient(moved.qd[:, 1], 1e-4)[1:-1], atol=1e-5)
    np.testing.assert_array_equal(moved.q[:, 0], q[:, 0])


PENDULUM = """<robot name="pendulum"><link name="base"/>
<link name="bob"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/>
<limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize("encoder", ["motor", "joint"])
@pytest.mark.parametrize("name", ["elasticity", "backlash"])
def test_a_soft_joint_parts_link_and_motor(tmp_path, encoder, name):
    """A pendulum with a rotor: the link's inertia and weight feel the link's angle, the rotor's inertia the motor's."""
    file = tmp_path / "pendulum.urdf"
    file.write_text(PENDULUM)
    rotor = {"joint": "hinge", "ratio": 10.0, "on": "base", "axis": [0, 1, 0], "inertia": {"parameters": [1, 0, 0, 0, 0.006, 0.005, 0.006, 0, 0, 0]}}
    machine = robot.load(robot_spec.RobotSpec(urdf=str(file), rotors=[robot_spec.RotorSpec.model_validate(rotor)]))
    t = np.arange(2000) * 5e-4
    q, qd, qdd = (x[:, None] for x in (0.6 * np.sin(4 * t), 2.4 * np.cos(4 * t), -9.6 * np.sin(4 * t)))
    piece = piece_of(machine, t, q, qd, qdd)
    load = (5 * np.sin(7 * t), 35 * np.cos(7 * t), -245 * np.sin(7 * t))
    piece = replace(piece, load=load[0][:, None])
    found = vocabulary.find(name).given(encoder=encoder)
    if name == "elasticity":
        moved = found.moved(piece, 0, compliance=0.01, damping=0.1)
        behind = [0.01 * x for x in load]
    else:
        motor = encoder == "motor"
        moved = found.moved(piece, 0, b=0.04, **({"teeth": 40.0} if motor else {"soft": 10.0}))
        u = [x / 10.0 for x in load]
        level = np.tanh(u[0])
        behind = [0.02 * level, 0.02 * (1 - level**2) * u[1], 0.02 * (1 - level**2) * (u[2] - 2 * level * u[1] ** 2)]
        if motor:  # away from where the load changes sign
            behind = [0.02 * np.sign(load[0]), 0.0 * t, 0.0 * t]
    measured = (q[:, 0], qd[:, 0], qdd[:, 0])
    link, motor = ([m - b for m, b in zip(measured, behind)], measured) if encoder == "motor" else (measured, [m + b for m, b in zip(measured, behind)])
    wanted = (0.1 + 2 * 0.25) * link[2] + 2 * 9.81 * 0.5 * np.sin(link[0]) + 0.005 * 100 * motor[2]
    inner = np.flatnonzero(np.abs(load[0]) > 0.1)[2:-2]
    np.testing.assert_allclose(torque_of(machine, moved)[inner, 0], wanted[inner], atol=1e-4)


def test_two_soft_effects_add_up():
    machine, piece = arm_moving()
    soft = vocabulary.find("elasticity")
    once = soft.moved(soft.moved(piece, 1, compliance=0.002, damping=0.1), 1, compliance=0.003, damping=0.1)
    np.testing.assert_allclose(once.deflection, soft.moved(piece, 1, compliance=0.005, damping=0.1).deflection, atol=1e-12)
    assert not np.any(once.deflection[:, :, [0, 2, 3, 4, 5]])


# ---- torque


def test_presliding_against_a_fine_integration():
    from scipy.integrate import solve_ivp

    machine, _ = arm_moving()
    t = np.arange(0.0, 4.0, 0.002)
    angle, speed = (lambda t: 0.05 * np.sin(2 * t) + 0.01 * np.sin(9 * t)), (lambda t: 0.1 * np.cos(2 * t) + 0.09 * np.cos(9 * t))
    still = np.zeros((len(t), 6))
    q = still.copy()
    q[:, 3] = angle(t)
    piece = piece_of(machine, t, q, still, still)
    for x0 in (0.002, 0.02):
        truth = solve_ivp(lambda t, z, x0=x0: (speed(t) - abs(speed(t)) * z) / x0, (0, t[-1]), [0.0], t_eval=t, rtol=1e-9, atol=1e-10, max_step=0.005).y[0]
        np.testing.assert_allclose(vocabulary.find("presliding").columns(piece, 3, x0=x0)[0], truth, atol=2e-3)
    assert not np.any(vocabulary.find("presliding").columns(piece, 0, x0=0.01))  # a joint that never moves


def test_presliding_is_the_recurrence_of_its_samples():
    machine, _ = arm_moving()
    rng = np.random.default_rng(3)
    q = np.cumsum(rng.normal(size=(500, 6)) * (rng.random((500, 6)) < 0.7), axis=0) * 0.01
    piece = piece_of(machine, np.arange(500) * 0.01, q, 0 * q, 0 * q)
    z, out = 0.0, [0.0]
    for move in np.diff(q[:, 2]):
        z = np.sign(move) + (z - np.sign(move)) * np.exp(-abs(move) / 0.02)
        out.append(z)
    np.testing.assert_allclose(vocabulary.find("presliding").columns(piece, 2, x0=0.02)[0], out, atol=1e-12)


def test_a_log_that_begins_in_motion_begins_with_contacts_that_have_slid():
    """Of logs cut out of a motion, friction is that of the motion as far as their first sample tells: they
    are off by a fraction of what they would be, did each begin with contacts at rest."""
    machine = robot.load(robot_spec.RobotSpec(urdf=UR5))
    t, q, qd, qdd = fourier_motion(np.random.default_rng(5), 30.0, 100.0, machine.dof)
    found, x0 = vocabulary.find("presliding"), 0.02
    off, at_rest = [], []
    for start in np.random.default_rng(1).integers(300, 2800, 40):
        for joint in range(machine.dof):
            whole = found.columns(piece_of(machine, t[: start + 100], q[: start + 100], qd[: start + 100], qdd[: start + 100]), joint, x0=x0)[0][start:]
            cut = slice(start, start + 100)
            own = piece_of(machine, t[cut], q[cut], qd[cut], qdd[cut])
            off.append(found.columns(own, joint, x0=x0)[0] - whole)
            at_rest.append(found.columns(replace(own, qd=0.0 * own.qd), joint, x0=x0)[0] - whole)
    assert np.sqrt(np.mean(np.square(off))) < 0.35 * np.sqrt(np.mean(np.square(at_rest)))


def test_contacts_of_a_log_that_begins_at_rest_are_not_bent_by_the_noise_of_its_first_sample():
    machine = robot.load(robot_spec.RobotSpec(urdf=UR5))
    t, still, rng = np.arange(0.0, 2.0, 0.005), np.zeros((400, machine.dof)), np.random.default_rng(0)
    for _ in range(20):
        q, qd, qdd = 2e-5 * rng.normal(size=still.shape), 1e-3 * rng.normal(size=still.shape), 0.1 * rng.normal(size=still.shape)
        piece = replace(piece_of(machine, t, q, qd, qdd), noise=np.full(machine.dof, 2e-5))
        assert abs(vocabulary.find("presliding").columns(piece, 1, x0=0.02)[0, 0]) < 1e-12


def small_piece():
    """Three joints, four samples, by hand: joint 1 forwards, backwards, at rest, forwards."""
    q, qd, qdd, load = (np.zeros((4, 3)) for _ in range(4))
    q[:, 1], qd[:, 1], load[:, 1] = [0.0, 0.5, 1.0, 2.0], [2.0, -1.0, 0.0, 0.5], [3.0, 4.0, -5.0, -8.0]
    qd[:, 0], qdd[:, 0] = [-1.0, -1.0, 0.0, 1.0], [7.0, 8.0, 9.0, 10.0]
    return Piece(
        log=0, step=0.1, t=np.array([0.0, 1.0, 2.0, 3.0]), q=q, qd=qd, qdd=qdd, tau=load, measured=load, signals={"heat": np.array([20.0, 40.0, 60.0, 0.0])},
        use=None, smoother=None, core=slice(0, 4), rest=np.zeros(3), noise=np.zeros(3), load=load,
    )  # fmt: skip


R2 = np.sqrt(2.0)
BY_HAND = {
    "asymmetric_coulomb": ({}, {}, [[0.5, 0.5, 0, 0.5]]),
    "asymmetric_viscous": ({}, {}, [[1, 0.5, 0, 0.25]]),
    "stribeck": ({}, {"vs": 1.0}, [[np.exp(-4), -np.exp(-1), 0, np.exp(-0.25)]]),
    "quadratic_drag": ({}, {}, [[4, -1, 0, 0.25]]),
    "sublinear_viscous": ({}, {"a": 0.5}, [[R2, -1, 0, 1 / R2]]),
    "load_friction": ({}, {}, [[3, -4, 0, 8]]),
    "directional_efficiency": ({}, {}, [[3, 0, 0, 0]]),
    "position_friction": ({"harmonics": 1}, {}, [[1, -np.cos(0.5), 0, np.cos(2)], [0, -np.sin(0.5), 0, np.sin(2)]]),
    "warmup": ({"signal": "heat"}, {}, [[0, -1, 0, -0.5], [0, -1, 0, -1]]),
    "joint_coupling": ({}, {}, [[7, 8, 9, 10], [-1, -1, 0, 1], [1, -1, 0, 1], [-1, 0, 0, 1]]),
    "cogging": ({"lines": 2}, {"k": 3.0}, [f(j * 3 * np.array([0, 0.5, 1, 2])) for j in (1, 2) for f in (np.sin, np.cos)]),
    "torque_saturation": ({}, {"limit": 4.5}, [[0, 0, -0.5, -3.5]]),
    "spring": ({}, {}, [[0, 0.5, 1, 2], [1, 1, 1, 1]]),
    "cable": ({"order": 2}, {}, [np.array([0, 0.5, 1, 2]) / np.pi, (np.array([0, 0.5, 1, 2]) / np.pi) ** 2]),
}


@pytest.mark.parametrize("name", BY_HAND)
def test_columns_by_hand(name):
    options, shapes, wanted = BY_HAND[name]
    found = vocabulary.find(name).given(**options)
    np.testing.assert_allclose(found.columns(small_piece(), 1, **shapes), wanted, atol=1e-12)


def test_what_a_joint_needs_is_its_load_and_what_else_acts_on_it():
    """Whatever looks at it is no part of it; where nobody knows the coefficients the load is all there is."""
    machine, piece = moving()
    names = ("viscous", "coulomb", "armature", "presliding", "torque_saturation")
    model = Model(machine, tuple((vocabulary.find(name).given(), (1,)) for name in names)).with_shapes([0.1, 2.0])
    c = np.array([0.3, 0.7, 0.2, 0.4, -1.0])
    seen = model.with_reference(machine.prior, c).seen(piece)
    load = regressor.torque(machine, machine.prior, piece.q, piece.qd, piece.qdd)
    z = vocabulary.find("presliding").given().columns(piece, 1, 0.1)[0]
    np.testing.assert_allclose(seen.load, load, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(seen.needed[:, 0], load[:, 0], rtol=1e-12, atol=1e-12)
    wanted = load[:, 1] + 0.3 * piece.qd[:, 1] + 0.7 * piece.direction(1) + 0.2 * piece.qdd[:, 1] + 0.4 * z
    np.testing.assert_allclose(seen.needed[:, 1], wanted, rtol=1e-12, atol=1e-12)
    rows = slice(20, 60, 4)
    np.testing.assert_allclose(
        model.with_reference(machine.prior, c).columns(piece, rows)[1][-1], (np.sign(wanted) * np.maximum(np.abs(wanted) - 2.0, 0.0))[rows], atol=1e-12
    )
    assert model.with_reference(machine.prior).seen(piece).needed is None


def test_no_load_is_made_for_what_looks_at_none(monkeypatch):
    machine, piece = moving()
    piece = replace(piece, load=None)
    made = []
    monkeypatch.setattr(Model, "_load", lambda self, piece, rows, part: (made.append(part), np.zeros_like(part.q))[1])
    model = lambda *names: Model(machine, tuple((vocabulary.find(name).given(), (1,)) for name in names))  # noqa: E731
    plain = model("coulomb", "presliding").with_shapes([0.1])
    plain.columns(piece, slice(20, 60))
    assert plain.moved(piece).load is None and not made
    assert plain.seen(piece).load is not None and len(made) == 1  # whoever may ask
    assert model("load_friction").moved(piece).load is not None and len(made) == 2


def test_a_load_is_that_of_the_motion_that_the_links_make():
    """Not of what an encoder that is off says of it, nor under the gravity of a level base."""
    machine, piece = arm_moving()
    names = {"gravity_tilt": ROBOT, "encoder_offset": 2, "load_friction": 2}
    model = Model(machine, tuple((vocabulary.find(name).given().bound(machine, j), (j,)) for name, j in names.items()))
    at = {"gravity_tilt.*.roll": 0.2, "gravity_tilt.*.pitch": -0.1, "encoder_offset": 0.3}
    values = [next(size for name, size in at.items() if v.name.startswith(name)) for v in model.shape_values]
    model = model.with_shapes(values).with_reference(machine.prior)
    moved = model.moved(piece)
    assert not np.allclose(moved.q[:, 2], piece.q[:, 2]) and not np.allclose(moved.gravity, machine.gravity)
    load = regressor.torque(machine, machine.prior, moved.q, moved.qd, moved.qdd, gravity=moved.gravity)
    rows = slice(10, 90, 7)
    np.testing.assert_allclose(model.columns(piece, rows)[2][-1], (np.abs(load) * np.sign(piece.qd))[rows, 2], rtol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize(("seed", "limit"), [(3, 22.0), (8, 24.0)])
def test_a_reading_that_clips_has_one_limit_whatever_rubs(planar, tmp_path, seed, limit):
    """Friction and the motor's inertia are read as well: of the load alone the limit would be another at every speed."""
    (tmp_path / "plain.yaml").write_text(f"robot: {{urdf: {planar.path}}}\n")
    experiment, machine, *_ = load(tmp_path / "plain.yaml")
    made = simulate(machine, hide=[hidden(f"torque_saturation:shoulder:limit={limit}")], seed=seed, duration=12.0, rate=500.0)
    write(made, experiment, tmp_path / "logs")
    with noticed():
        found = pipeline.fit(grown(pipeline.load(tmp_path / "logs"), "torque_saturation", ["shoulder"], {}))
    noise = made.truth["logs"]["test"]["noise_rms"]["shoulder"]
    values = dict(zip((v.name for v in found.model.shape_values), zip(found.model.shapes, found.shape_std)))
    at, std = values["torque_saturation.shoulder.limit"]
    e = found.x[10 * found.model.bodies :][[c.name for c in found.model.coefficients].index("torque_saturation.shoulder.e")]
    assert abs(at - limit) < 3.0 * std < 0.02 * limit and abs(e + 1.0) < 0.05
    assert found.rms("test")["shoulder"] < 1.1 * noise


def test_more_columns_by_hand():
    piece = small_piece()
    speed = vocabulary.find("position_friction").given(times="speed", harmonics=2)
    np.testing.assert_allclose(speed.columns(piece, 1)[2], np.cos(2 * piece.q[:, 1]) * piece.qd[:, 1])
    assert [c.name for c in speed.coefficients()] == ["a1", "b1", "a2", "b2"] and speed.coefficients()[0].unit == "N m s/rad"
    cold = vocabulary.find("warmup").columns(piece, 1, T=2.0)
    np.testing.assert_allclose(cold, np.stack([piece.qd[:, 1], np.sign(piece.qd[:, 1])]) * np.exp(-piece.t / 2.0))
    machine, _ = arm_moving()
    other = vocabulary.find("joint_coupling").given(other=machine.joints[0]).bound(machine, 2)
    np.testing.assert_array_equal(other.columns(piece, 2)[0], piece.qdd[:, 0])
    assert len(other.variants(machine, 2)) == 5


def test_payload_is_an_added_inertia():
    machine, piece = arm_moving()
    held = pseudo.box(1.5, (0.02, -0.03, 0.1), (0.1, 0.2, 0.15))
    payload = vocabulary.find("payload").bound(machine, -1)
    for link in (None, machine.bodies[3].name):
        payload = vocabulary.find("payload").given(link=link).bound(machine, -1)
        row = 5 if link is None else 3
        heavier = np.array(machine.prior)
        heavier[row] += held
        added = rnea(machine, piece, model=machine.with_inertias(heavier)) - rnea(machine, piece)
        np.testing.assert_allclose(np.einsum("jkn,k->nj", payload.columns(piece, machine), held), added, atol=1e-8)
    logs = payload.given(logs=["with.csv"])
    assert not np.any(logs.columns(replace(piece, source="without.csv"), machine))
    np.testing.assert_array_equal(logs.columns(replace(piece, source="with.csv"), machine), payload.columns(piece, machine))


@pytest.mark.parametrize("make", [moving, arm_moving])
def test_external_force_is_the_jacobian_s(make):
    machine, piece = make()
    contact = vocabulary.find("external_force").given(during=[[0.5, 1.5], [1.6, 1.7]]).bound(machine, -1)
    assert [c.name for c in contact.coefficients()] == ["f1x", "f1y", "f1z", "f2x", "f2y", "f2z"]
    columns = contact.columns(piece, machine)
    data = machine.model.createData()
    inside = 200 if make is arm_moving else 150
    assert 0.55 < piece.t[inside] < 1.45
    for k, weight in ((inside, 1.0), (20, 0.0)):
        pin.computeJointJacobians(machine.model, data, machine.transmission @ piece.q[k])
        body = [b for b in machine.bodies if b.kind == "link"][-1]
        jacobian = pin.getJointJacobian(machine.model, data, body.row + 1, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[:3] @ machine.transmission
        np.testing.assert_allclose(columns[:, :3, k], weight * jacobian.T, atol=1e-12)
    assert columns.shape == (machine.dof, 6, len(piece.t)) and not np.any(columns[:, 3:, inside])
    edge = columns[:, 0, (piece.t > 0.5) & (piece.t < 0.55)]
    assert np.any(edge) and vocabulary.find("external_force").columns(piece, machine).shape == (machine.dof, 0, len(piece.t))


REFUSED = {
    "position_friction": [{"times": "angle"}, {"harmonics": 0}, {"harmonics": 2.5}, {"harmonics": True}],
    "cogging": [{"lines": "two"}, {"lines": 99}],
    "cable": [{"order": 0}],
    "elasticity": [{"encoder": "both"}],
    "backlash": [{"encoder": 1}],
    "warmup": [{"signal": 3}],
    "payload": [{"logs": "a.csv"}, {"logs": []}, {"link": "torso"}],
    "external_force": [{"during": [[2, 1]]}, {"during": 3}, {"during": [["a", "b"]]}, {"during": [1, 2]}, {"link": ["x"]}],
    "joint_coupling": [{"other": "wrist"}, {"other": "hinge"}, {"wrong": 1}],
}


@pytest.mark.parametrize("name, options", [(name, options) for name, all_ in REFUSED.items() for options in all_])
def test_options_that_cannot_be_are_refused(name, options):
    machine, _ = moving()
    with pytest.raises(ConfigError, match=name) as error:
        vocabulary.find(name).given(**options).bound(machine, -1 if vocabulary.find(name).scope == "robot" else 1)
    assert "allowed: " in str(error.value)


def test_signals_and_neighbours_that_are_not_there(tmp_path):
    with pytest.raises(ConfigError, match="'cold' is not logged; allowed: heat"):
        vocabulary.find("warmup").given(signal="cold").columns(small_piece(), 1)
    file = tmp_path / "pendulum.urdf"
    file.write_text(PENDULUM)
    machine = robot.load(robot_spec.RobotSpec(urdf=str(file)))
    with pytest.raises(ConfigError, match="second joint"):
        vocabulary.find("joint_coupling").bound(machine, 0)
    assert vocabulary.find("joint_coupling").variants(machine, 0) == []


def test_every_effect_is_shown(capsys):
    from sysid.terminal.effects import show_effects

    for name in vocabulary.vocabulary():
        show_effects([vocabulary.describe(vocabulary.find(name))])
    said = capsys.readouterr().out
    assert "  k            1/rad, 1 to 120: " in said and "  vs           rad/s, 0.003 to 0.7 times the joint's top speed: " in said
    assert "  Fc           N m, not negative: " in said and "  encoder:     motor where" in said
    assert "  kind         motion, of the whole robot" in said


def test_effects_through_the_experiment_file(experiment):
    """Every kind at once, with options and a value that is held, from YAML to a model's columns and back to YAML."""
    from sysid import pipeline
    from sysid.results import _relocated

    entries = [
        "viscous", {"stribeck": {"joints": ["elbow"], "vs": 0.1}}, {"joint_coupling": {"joints": ["elbow"], "other": "shoulder"}},
        {"cogging": {"joints": ["shoulder"], "lines": 2}}, {"elasticity": {"joints": ["elbow"], "encoder": "joint"}}, "gravity_tilt",
        {"payload": {"logs": ["train.csv"]}}, {"external_force": {"during": [[0.5, 1.0]]}}, {"delay": {"joints": ["elbow"], "d": 0.002}},
    ]  # fmt: skip
    folder = experiment(config={"model.effects": entries})
    spec = pipeline.load(folder)
    machine, model, _ = pipeline.build(spec)
    names = [c.name for c in model.coefficients]
    assert "cogging.shoulder.b2" in names and "payload.*.Ixx" in names and "external_force.*.f1z" in names and "joint_coupling.elbow.Fd" in names
    held = {value.name: at for value, at in zip(model.shape_values, model.shapes) if value.held}
    assert held == {"stribeck.elbow.vs": 0.1, "delay.elbow.d": 0.002}
    assert _relocated(spec, folder)["model"]["effects"] == entries
    moved = _relocated(spec, folder / "run")["model"]["effects"]
    assert moved[6] == {"payload": {"logs": ["../train.csv"]}}
