"""The regressor against Pinocchio's own dynamics, and rotors against the same robot written out as a larger model."""

import numpy as np
import pinocchio as pin
import pytest

from sysid import regressor
from sysid.errors import RobotError
from sysid.inertia import pseudo
from sysid.robot_spec import RobotSpec
from tests import robots
from tests.test_inertia import random_bodies


def rnea(model, q, qd, qdd) -> np.ndarray:
    data = model.createData()
    return np.array([pin.rnea(model, data, *row) for row in zip(q, qd, qdd)])


def plain_model(text: str) -> pin.Model:
    """Pinocchio's reading of a URDF in which an unlimited joint is an ordinary angle."""
    limited = text.replace('type="continuous"', 'type="revolute"')
    return pin.buildModelFromXML(limited)


@pytest.mark.parametrize("seed", range(8))
def test_random_trees_against_rnea(tmp_path, seed):
    rng = np.random.default_rng(seed)
    text = robots.urdf(rng, links=6).replace('type="continuous"', 'type="revolute"')
    robot = robots.load(tmp_path, text, gravity=rng.normal(size=3).tolist())
    model = pin.buildModelFromXML(text)
    model.gravity.linear = robot.gravity
    order = [model.getJointId(j) - 1 for j in robot.joints]
    q, qd, qdd = rng.normal(size=(3, 40, robot.dof))
    full = [np.zeros_like(x) for x in (q, qd, qdd)]
    for target, x in zip(full, (q, qd, qdd)):
        target[:, order] = x
    expected = rnea(model, *full)[:, order]
    scale = np.abs(expected).max()
    y = regressor.regressor(robot, q, qd, qdd)
    assert y.shape == (40, robot.dof, 10 * len(robot.bodies))
    np.testing.assert_allclose(y @ robot.prior.ravel(), expected, atol=1e-12 * scale)
    np.testing.assert_allclose(regressor.torque(robot, robot.prior, q, qd, qdd), expected, atol=1e-12 * scale)
    # Pinocchio's own regressor, column by column
    data = model.createData()
    for k in (0, 7):
        theirs = pin.computeJointTorqueRegressor(model, data, *(x[k] for x in full))[order]
        ours = y[k].reshape(robot.dof, -1, 10)
        for b, body in enumerate(robot.bodies):
            columns = theirs[:, 10 * body.row : 10 * body.row + 10]
            np.testing.assert_allclose(pseudo.to_pinocchio(ours[:, b]), columns, atol=1e-12 * np.abs(columns).max())


@pytest.mark.parametrize("seed", range(4))
def test_continuous_and_prismatic_joints_and_locks(tmp_path, seed):
    rng = np.random.default_rng(100 + seed)
    text = robots.urdf(rng, links=5)
    chosen = ["joint4", "joint0", "joint2"]  # an order that is not the tree's
    lock = {"joint1": 0.7, "joint3": -0.4}
    robot = robots.load(tmp_path, text, joints=chosen, lock=lock)
    assert robot.joints == tuple(chosen)
    assert [b.name for b in robot.bodies] == ["link4", "link0", "link2"]
    model = plain_model(text)
    order = [model.getJointId(j) - 1 for j in chosen]
    q, qd, qdd = rng.normal(size=(3, 30, 3))
    full = np.zeros((3, 30, model.nv))
    for name, angle in lock.items():
        full[0][:, model.getJointId(name) - 1] = angle
    full[:, :, order] = np.stack([q, qd, qdd])
    expected = rnea(model, *full)[:, order]
    got = regressor.torque(robot, robot.prior, q, qd, qdd)
    np.testing.assert_allclose(got, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("coupled", [False, True])
def test_rotors_against_the_robot_written_out(tmp_path, coupled):
    """Each rotor as a link of its own on a revolute joint, in a URDF that Pinocchio reads by itself."""
    rng = np.random.default_rng(11)
    text = robots.urdf(rng, links=4)
    names = [f"joint{k}" for k in range(4)]
    carriers = ["base", "link0", "extra1", "link1"]  # extra1 is welded to link1 at a pose of its own
    rotors, written = [], text.removesuffix("</robot>")
    for joint, carrier in zip(names, carriers):
        xyz, rpy, axis = rng.normal(size=3), rng.uniform(-3, 3, 3), rng.normal(size=3)
        body = np.array(robots.random_body(rng)["parameters"])
        rotors.append({
            "joint": joint, "ratio": float(rng.uniform(-12, 12)), "on": carrier, "xyz": xyz.tolist(), "rpy": rpy.tolist(),
            "axis": axis.tolist(), "inertia": {"parameters": body.tolist()},
        })  # fmt: skip
        mass, com, central = pseudo.to_central(body)
        written += (
            f'<link name="rotor_{joint}"><inertial><origin xyz="{robots._numbers(com)}"/><mass value="{float(mass)!r}"/><inertia'
            + "".join(f' {key}="{value!r}"' for key, value in zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), central[np.triu_indices(3)].tolist()))
            + f'/></inertial></link><joint name="spin_{joint}" type="revolute"><parent link="{carrier}"/><child link="rotor_{joint}"/>'
            f'<origin xyz="{robots._numbers(xyz)}" rpy="{robots._numbers(rpy)}"/><axis xyz="{robots._numbers(axis)}"/>'
            '<limit lower="-1e9" upper="1e9" effort="1" velocity="1"/></joint>'
        )
    rows = {j: {j: r["ratio"]} for j, r in zip(names, rotors)}
    if coupled:
        rows["joint3"] = {"joint2": 4.0, "joint3": -7.5}
    robot = robots.load(tmp_path, text, rotors=rotors, transmission={"joint3": rows["joint3"]} if coupled else {})
    assert [b.name for b in robot.bodies[4:]] == [f"{j}_rotor" for j in names]
    model = plain_model(written + "</robot>")
    transmission = np.zeros((model.nv, 4))
    for k, joint in enumerate(names):
        transmission[model.getJointId(joint) - 1, k] = 1.0
        for driver, ratio in rows[joint].items():
            transmission[model.getJointId(f"spin_{joint}") - 1, names.index(driver)] = ratio
    q, qd, qdd = rng.normal(size=(3, 30, 4))
    expected = rnea(model, *(x @ transmission.T for x in (q, qd, qdd))) @ transmission
    y = regressor.regressor(robot, q, qd, qdd)
    assert y.shape == (30, 4, 80)
    # the tree that `Robot.model` holds must serve Pinocchio's mass-matrix algorithms too
    data, g = robot.model.createData(), robot.transmission
    for row in range(3):
        mass = pin.crba(robot.model, data, g @ q[row])
        mass = np.triu(mass) + np.triu(mass, 1).T
        unit = np.eye(4)
        zero, still = np.zeros((4, 4)), np.repeat(q[row][None], 4, 0)
        ours = regressor.torque(robot, robot.prior, still, zero, unit) - regressor.torque(robot, robot.prior, still, zero, zero)
        np.testing.assert_allclose(g.T @ mass @ g, ours, atol=1e-11 * np.abs(ours).max())
    np.testing.assert_allclose(y @ robot.prior.ravel(), expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(regressor.torque(robot, robot.prior, q, qd, qdd), expected, atol=1e-12 * np.abs(expected).max())


def test_regressor_is_exact_for_other_bodies_than_the_prior(tmp_path):
    rng = np.random.default_rng(5)
    robot = robots.load(tmp_path, robots.urdf(rng, links=4))
    pi = random_bodies(4, seed=3)
    q, qd, qdd = rng.normal(size=(3, 10, 4))
    expected = rnea(robot.with_inertias(pi), q[:, _order(robot)], qd[:, _order(robot)], qdd[:, _order(robot)])
    got = regressor.regressor(robot, q, qd, qdd) @ pi.ravel()
    np.testing.assert_allclose(got[:, _order(robot)], expected, atol=1e-11 * np.abs(expected).max())


def _order(robot) -> list[int]:
    """User's joint for each row of the tree."""
    return [robot.transmission[row].argmax() for row in range(robot.dof)]


def test_chunks_are_the_whole(tmp_path):
    rng = np.random.default_rng(6)
    robot = robots.load(tmp_path, robots.urdf(rng, links=3))
    motion = rng.normal(size=(3, 101, 3))
    whole = regressor.regressor(robot, *motion)
    parts = list(regressor.regressor_chunks(robot, *motion, chunk=25))
    assert [len(p) for p in parts] == [25, 25, 25, 25, 1]
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=1e-12, atol=1e-12)


def test_body_names_and_prior_of_welded_links(tmp_path):
    """A body is its link with all that is welded to it, as Pinocchio sums it."""
    robot = robots.load(tmp_path, robots.urdf(np.random.default_rng(7), links=6))
    model = plain_model((tmp_path / "robot.urdf").read_text())
    for body, prior in zip(robot.bodies, robot.prior):
        theirs = model.inertias[model.getJointId(body.joint)].toDynamicParameters()
        np.testing.assert_allclose(pseudo.to_pinocchio(prior), theirs, rtol=1e-10, atol=1e-10)


def test_rotor_mistakes_are_named(tmp_path):
    text = robots.urdf(np.random.default_rng(8), links=2)
    good = {"joint": "joint0", "ratio": 10.0, "on": "base", "inertia": {"mass": 0.5, "box": [0.1, 0.1, 0.1]}}
    robots.load(tmp_path, text, rotors=[good])
    for change, word in [({"joint": "nowhere"}, "nowhere"), ({"on": "nowhere"}, "nowhere")]:
        with pytest.raises(RobotError, match=word):
            robots.load(tmp_path, text, rotors=[{**good, **change}])
    with pytest.raises(RobotError, match="two rotors"):
        robots.load(tmp_path, text, rotors=[good, good])
    with pytest.raises(RobotError, match="has no rotor"):
        robots.load(tmp_path, text, rotors=[good], transmission={"joint1": {"joint0": 2.0}})
    with pytest.raises(ValueError, match="ratio of 0"):
        RobotSpec.model_validate({"rotors": [{**good, "ratio": 0.0}]})


def test_example_robot_data_and_package_paths():
    from sysid import robot, robot_spec

    panda = robot.load(robot_spec.RobotSpec(urdf="example-robot-data://panda_description/urdf/panda.urdf", lock={"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}))
    assert panda.dof == 7 and panda.bodies[6].name == "panda_link7"
    assert pseudo.to_pseudo(panda.prior).shape == (7, 4, 4)
    with pytest.raises(RobotError, match="package://"):
        robot.load(robot_spec.RobotSpec(urdf="package://nowhere/robot.urdf"))
