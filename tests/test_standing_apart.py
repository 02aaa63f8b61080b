"""Slopes of the torque in how far a link stands apart from its motor, against inverse dynamics of the whole tree done twice."""

import numpy as np
import pytest

from sysid import regressor
from sysid.standing_apart import standing_apart

from . import robots

NUDGES = (1e-4, 1e-3, 1e-1)


@pytest.mark.parametrize("bent", [False, True], ids=["as-measured", "beside-a-bent-one"])
@pytest.mark.parametrize("seed", range(3))
def test_against_the_whole_tree_done_twice(tmp_path, seed, bent):
    rng = np.random.default_rng(40 + seed)
    text = robots.urdf(rng)
    joints = robots.load(tmp_path, text).joints
    rotor = {"joint": joints[1], "ratio": 7.0, "on": "link0", "xyz": [0.1, 0, 0], "axis": [0, 0.6, 0.8], "inertia": robots.random_body(rng)}
    robot = robots.load(tmp_path, text, rotors=[rotor], transmission={joints[1]: {joints[1]: 7, joints[seed]: -3}} if seed != 1 else {})
    n, dof = regressor.CHUNK + 3, robot.dof  # over an edge between two chunks
    motion, gravity = rng.normal(size=(3, n, dof)), rng.normal(size=3)
    behind = 0.01 * rng.normal(size=(3, n, dof)) if bent else None
    pi = robot.prior * rng.uniform(0.5, 1.5, size=(len(robot.bodies), 1))
    pi[2] = 0.0  # a body that nobody knows
    found = standing_apart(robot, pi, *motion, range(dof), NUDGES, gravity=gravity, deflection=behind)
    for joint, (base, slopes) in found.items():
        carried = np.where(robot.carried(joint)[:, None], pi, 0.0)

        def torque(deflection, bodies=carried):
            return regressor.torque(robot, bodies, *motion, gravity=gravity, deflection=deflection)

        plain = torque(behind)
        np.testing.assert_allclose(base, plain.T, atol=1e-11 * np.abs(plain).max())
        for order, nudge in enumerate(NUDGES):
            more = np.zeros((3, n, dof)) if behind is None else behind.copy()
            more[order, :, joint] += nudge
            expected = (torque(more) - plain).T / nudge
            scale = max(np.abs(expected).max(), np.abs(plain).max())
            np.testing.assert_allclose(slopes[order], expected, atol=1e-9 * scale)
