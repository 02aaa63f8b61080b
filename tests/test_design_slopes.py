"""Sums of the bodies' columns and their slopes, against differences of the columns themselves."""

from pathlib import Path

import numpy as np
import pytest

from sysid import pipeline, regressor, robot
from sysid.design import bodies, spheres
from sysid.robot_spec import RobotSpec
from tests.conftest import URDF

ROOT = Path(__file__).resolve().parent.parent

_LINK = '<link name="{}"><inertial><origin xyz="0.1 0.02 -0.05"/><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0.01" ixz="0" iyz="-0.02"/></inertial></link>'
_JOINT = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="0.1 -0.2 0.3" rpy="0.3 0.5 -0.2"/>'
    '<axis xyz="{4}"/><limit lower="-2" upper="2" effort="50" velocity="5"/></joint>'
)
#: a slide on the base, a turn, a slide on that, a turn, and a branch
TREE = [("a", "prismatic", "base", "l1", "0 0 1"), ("b", "revolute", "l1", "l2", "0 1 0"), ("c", "prismatic", "l2", "l3", "1 0 0"),
        ("d", "revolute", "l3", "l4", "0.6 0 0.8"), ("e", "revolute", "l2", "l5", "0 0 1")]  # fmt: skip


def _tree():
    parts = ['<link name="base"/>', *(_LINK.format(f"l{k}") for k in range(1, 6)), *(_JOINT.format(*one) for one in TREE)]
    return f'<robot name="tree">{"".join(parts)}</robot>'


@pytest.mark.parametrize("kind", ["planar", "rotors", "tree"])
def test_slopes_of_what_bodies_columns_add_up_to(tmp_path, kind):
    (tmp_path / "robot.urdf").write_text(_tree() if kind == "tree" else URDF)
    machine = robot.load(RobotSpec(urdf=str(tmp_path / "robot.urdf")))
    if kind == "rotors":  # and a knee that is driven past the hip
        own = pipeline.load(ROOT / "configs" / "cheetah3.yaml")
        machine = robot.load(own.robot, own.folder)
    rng, dof, n = np.random.default_rng(0), machine.dof, 7
    motion = rng.normal(size=(3, n, dof))
    weights = rng.normal(size=(dof, 10 * len(machine.bodies), n))
    of = lambda motion: np.einsum("jpn,jpn->jn", weights, regressor.columns(machine, *motion))  # noqa: E731
    s, slopes = bodies.summed(machine, weights, *motion)
    np.testing.assert_allclose(s, of(motion), rtol=1e-10, atol=1e-10)
    for rate in range(3):
        for joint in range(dof):
            ends = [motion.copy(), motion.copy()]
            for end, sign in zip(ends, (1.0, -1.0)):
                end[rate, :, joint] += sign * 1e-5
            numeric = (of(ends[0]) - of(ends[1])).sum(axis=0) / 2e-5
            np.testing.assert_allclose(slopes[rate, joint], numeric, rtol=1e-6, atol=1e-6 * np.abs(numeric).max() + 1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_spheres_about_slabs_hold_the_hull(seed):
    """Any point of a hull, a random share of its corners, is in one of them; and they are no looser than the hull is thick."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(60, 3)) * [4.0, 1.0, 0.5] + rng.normal(size=3)
    held = spheres.cover(corners, 4)
    inside = rng.dirichlet(0.1 * np.ones(60), 5000) @ corners
    away = np.linalg.norm(inside[:, None] - held[:, :3], axis=2) - held[:, 3]
    assert away.min(axis=1).max() <= 1e-9
    assert held[:, 3].max() < 0.6 * spheres.cover(corners, 1)[0, 3]
    flat = spheres.cover(corners * [1.0, 1.0, 0.0], 2)
    assert np.all(np.linalg.norm(corners * [1.0, 1.0, 0.0] - flat[0, :3], axis=1) <= flat[0, 3])
