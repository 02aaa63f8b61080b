"""torque(q, qd, qdd) against Pinocchio and against the model's own way over logs, effect by effect."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import sysid
from sysid import config, inverse_dynamics, own_effects, robot, vocabulary
from sysid.errors import SysidError
from sysid.listed_effects import build as build_model
from sysid.model import Model
from sysid.model_parameters import ROBOT
from sysid.motion import Piece
from sysid.per_level import at_level
from sysid.robot_spec import RobotSpec
from sysid.trusted import trust
from tests import robots
from tests.problems import UR5, fourier_motion
from tests.test_effects import middle, moving, piece_of

GIVEN = {"external_force": {"during": [[0.2, 1.5]]}, "cogging": {"lines": 3}, "cable": {"order": 3}}
PAST = {"presliding", "backlash", "elasticity", "delay", "current_lag", "external_force", "warmup"}


OWN = """
import numpy as np
from sysid.effect import Linear, TorqueEffect

class Cubic(TorqueEffect):
    c = Linear("N m")
    def columns(self, motion, joint):
        return motion.qd[None, :, joint] ** 3

class Past(TorqueEffect):
    c = Linear("N m")
    def columns(self, motion, joint):
        return np.cumsum(motion.qd[None, :, joint], axis=1)

class Warm(TorqueEffect):
    c = Linear("N m")
    def columns(self, motion, joint):
        return motion.signals["oil"][None]
"""


def arm() -> tuple:
    machine = robot.load(RobotSpec(urdf=UR5))
    return machine, piece_of(
        machine, *fourier_motion(np.random.default_rng(2), 2.0, 100.0, machine.dof)
    )


def grown(machine, piece, names) -> tuple[Model, np.ndarray]:
    """A model with effects on every second joint at least, no two joints with
    the same values, and its parameters."""
    rng = np.random.default_rng(7)
    terms, values = [], []
    for name in names:
        found = vocabulary.find(name).given(**GIVEN.get(name, {}))
        joints = (
            (ROBOT,)
            if found.scope == "robot"
            else tuple(range(0, machine.dof, 2 if name == "cogging" else 1))
        )
        for joint in joints:
            found = found.bound(machine, joint)
        terms.append((found, joints))
        for joint in joints:
            at = middle(found, machine, piece, max(joint, 0))
            values += [at[shape.name] * rng.uniform(0.7, 0.9) for shape in found.shapes()]
    pi = np.array(machine.prior) * rng.uniform(0.8, 1.2)
    model = Model(machine, tuple(terms)).with_shapes(values)
    x = np.concatenate([pi.ravel(), rng.uniform(0.5, 2.0, len(model.coefficients))])
    return model.referring_to(0.9 * x), x


def slowly(model: Model, piece: Piece, x) -> np.ndarray:
    """The same by what predicts logs, without what looks back."""
    kept = replace(model, _links={})
    c, k = [], 10 * model.bodies
    for found, joints in model.terms:
        size = len(found.coefficients()) * len(joints)
        if found.name in PAST:
            for joint in joints:
                kept = kept.without(found.name, joint)
        else:
            c.append(x[k : k + size])
        k += size
    return kept.torque(piece, x[: 10 * model.bodies].reshape(-1, 10), np.concatenate([*c, []]))


def agree(found, expected):
    size = np.abs(expected).max(0)
    np.testing.assert_allclose(found / size, expected / size, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", vocabulary.vocabulary())
def test_every_effect_as_over_a_log(name):
    for machine, piece in (moving(), arm()):
        model, x = grown(machine, piece, [name])
        torque = inverse_dynamics.inverse_dynamics(model, x)
        expected = slowly(model, piece, x)
        agree(torque(piece.q, piece.qd, piece.qdd), expected)
        one_by_one = np.array([torque(*at) for at in zip(piece.q, piece.qd, piece.qdd)])
        agree(one_by_one, expected)
        (found, joints), *_ = model.terms
        named = tuple(f"{name}.{'*' if j == ROBOT else machine.joints[j]}" for j in joints)
        assert torque.omitted == (named if name in PAST else ())


@pytest.mark.parametrize("name", vocabulary.vocabulary())
def test_what_is_said_to_look_at_one_instant_does(name):
    machine, piece = arm()
    found = vocabulary.find(name).given(**GIVEN.get(name, {})).bound(machine, 1)
    joint = ROBOT if found.scope == "robot" else 1
    assert (
        own_effects.instantaneous(found, machine, joint, middle(found, machine, piece, 1))
        == found.instantaneous
    )


def test_all_effects_at_once():
    machine, piece = arm()
    model, x = grown(machine, piece, vocabulary.vocabulary())
    torque = inverse_dynamics.inverse_dynamics(model, x)
    agree(torque(piece.q, piece.qd, piece.qdd), slowly(model, piece, x))
    assert {name.partition(".")[0] for name in torque.omitted} == PAST


def test_what_is_needed_at_a_level_has_the_friction_of_that_level():
    machine, piece = arm()
    levels = ("cold", "warm")
    terms = [at_level(vocabulary.find("coulomb"), "oil", one, levels) for one in levels]
    terms.append(vocabulary.find("torque_saturation").given())
    model = Model(machine, tuple((effect, (1,)) for effect in terms)).with_shapes([40.0])
    x = np.concatenate([np.ravel(machine.prior), [5.0, 25.0, -1.0]])
    model = model.referring_to(x)
    for one in levels:
        own = replace(piece, levels={"oil": one})
        expected = model.torque(own, machine.prior, x[-3:])
        assert np.abs(expected[:, 1]).max() < 40.0 + 1e-9
        torque = inverse_dynamics.inverse_dynamics(model, x, {"oil": one})
        agree(torque(piece.q, piece.qd, piece.qdd), expected)


def test_rotors_and_other_orders_against_pinocchio(tmp_path):
    rng = np.random.default_rng(3)
    rotors = [
        {"joint": f"joint{k}", "ratio": 9.0 - k, "on": f"link{k - 1}" if k else "base",
         "xyz": [0.1, 0, 0.2], "axis": [0, 0.6, 0.8],
         "inertia": robots.random_body(rng)} for k in range(3)
    ]  # fmt: skip
    spec = {
        "joints": ["joint3", "joint0", "joint2", "joint1"],
        "rotors": rotors,
        "transmission": {"joint2": {"joint1": 3.0, "joint2": -7.0}},
    }
    machine = robots.load(tmp_path, robots.urdf(rng, links=4), **spec)
    model = build_model(machine, [])
    x = 1.1 * machine.prior.ravel()
    full, drive = machine.with_inertias(x.reshape(-1, 10)), machine.transmission
    data = full.createData()
    samples = rng.normal(size=(3, 40, 4))
    expected = np.array(
        [
            drive.T @ pin.rnea(full, data, *(drive @ x for x in row))
            for row in samples.swapaxes(0, 1)
        ]
    )
    torque = inverse_dynamics.inverse_dynamics(model, x)
    agree(torque(*samples), expected)
    agree(torque(*samples[:, 5]), expected[5])
    many = np.tile(samples, (1, 120, 1))  # more than one chunk
    agree(torque(*many), np.tile(expected, (120, 1)))


def test_effects_of_one_s_own(tmp_path):
    (tmp_path / "mine.py").write_text(OWN)
    trust(tmp_path / "mine.py")
    tree = (
        "robot: {urdf: '" + UR5 + "'}\ndata: {train: [a.csv], test: [b.csv]}\nmodel:\n  effects:\n"
        "    - mine.py:Cubic\n    - mine.py:Past\n    - mine.py:Warm\n"
        "    - {formula: 'a*sin(3*q)', joints: [elbow_joint], name: wave}\n"
        "    - {formula: 'b*qd*t', joints: [elbow_joint], name: ageing}\n"
    )
    experiment = config.loads(tree, tmp_path / "config.yaml")
    machine = robot.load(experiment.robot)
    model = build_model(machine, experiment.model.effects, tmp_path)
    x = np.concatenate([machine.prior.ravel(), np.ones(len(model.coefficients))])
    torque = inverse_dynamics.inverse_dynamics(model, x)
    assert torque.omitted == (
        *(f"past.{j}" for j in machine.joints),
        *(f"warm.{j}" for j in machine.joints),
        "ageing.elbow_joint",
    )
    plain = inverse_dynamics.inverse_dynamics(
        replace(model, terms=(), shapes=()), machine.prior.ravel()
    )
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 20, 6))
    expected = plain(q, qd, qdd) + qd**3
    expected[:, 2] += np.sin(3 * q[:, 2])
    agree(torque(q, qd, qdd), expected)


def test_a_run_folder_is_all_it_needs(tmp_path, experiment):
    folder = experiment(
        config={
            "model.effects": [
                "viscous",
                "coulomb",
                "load_friction",
                {"cogging": {"joints": ["elbow"]}},
                "delay",
            ]
        }
    )
    fit = sysid.fit(sysid.load(folder))
    sysid.write(fit, tmp_path / "run")
    before = sysid.predict(fit, str(folder / "test.csv")).predicted
    for name in ("robot.urdf", "train.csv", "test.csv", "config.yaml"):
        (folder / name).unlink()
    (tmp_path / "run").rename(tmp_path / "moved")
    run = sysid.read_run(tmp_path / "moved")
    assert len(repr(run)) < 400 and "delay.elbow" in repr(run) and len(repr(fit)) < 400
    q, qd, qdd = np.random.default_rng(1).normal(size=(3, 30, 2))
    agree(run.torque(q, qd, qdd), fit.torque(q, qd, qdd))
    assert run.torque(q[0], qd[0], qdd[0]).shape == (2,)
    assert (
        run.omitted == fit.omitted == ("delay.shoulder", "delay.elbow")
        and "presliding" in run.torque.__doc__
    )
    assert run.rms("test") == fit.rms("test") and run.to_dataframe().equals(fit.to_dataframe())
    np.testing.assert_array_equal(run.prediction("test").predicted, before)
    assert len(run.plot().axes) == 2


@pytest.mark.parametrize(
    ("q", "qd", "qdd"),
    [(3, 3, 3), ((5, 2), 2, 2), ((2, 5), (2, 5), (2, 5)), ((1, 2, 2),) * 3, ((), (), ())],
)
def test_other_shapes_are_refused_in_a_line(experiment, tmp_path, q, qd, qdd):
    machine = robot.load(RobotSpec(urdf=str(experiment() / "robot.urdf")))
    torque = inverse_dynamics.inverse_dynamics(build_model(machine, []), machine.prior.ravel())
    with pytest.raises(SysidError, match="allowed: all \\(2,\\) or all \\(samples, 2\\)") as error:
        torque(np.zeros(q), np.zeros(qd), np.zeros(qdd))
    assert "\n" not in str(error.value)
    assert torque(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2))).shape == (0, 2)


@pytest.mark.parametrize("lost", ["fit.json", "identified.yaml", "identified.urdf"])
def test_a_folder_that_holds_no_fit(experiment, tmp_path, lost):
    sysid.write(sysid.fit(sysid.load(experiment())), tmp_path / "run")
    (tmp_path / "run" / lost).unlink()
    with pytest.raises(SysidError) as error:
        sysid.read_run(tmp_path / "run")
    assert "\n" not in str(error.value) and "run" in str(error.value)
