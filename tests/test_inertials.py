"""What a robot's file says of its bodies that cannot be meant: no torque is held against it."""

import re
import warnings

import numpy as np
import pytest

from sysid import check, inertials, pipeline, robot, robot_spec
from tests.conftest import URDF


def loaded(text, folder):
    file = folder / "robot.urdf"
    file.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return robot.load(robot_spec.RobotSpec(urdf=str(file)))


def scaled(text, mass: float, inertia: float):
    """The URDF with masses and moments of inertia times numbers."""
    text = re.sub(r'mass value="([\d.]+)"', lambda m: f'mass value="{mass * float(m[1])!r}"', text)
    return re.sub(r'(i[xyz]{2})="([\d.]+)"', lambda m: f'{m[1]}="{inertia * float(m[2])!r}"', text)


TWO = URDF.replace('effort="50"', 'effort="40"', 1)  # limits of its own for each joint


def test_a_robot_as_it_is_may_be_meant(tmp_path):
    machine = loaded(TWO, tmp_path)
    assert inertials.unmeant(machine) == "" and 0.0 < inertials.overweight(machine) < 1.0
    # by hand: both links stretched out sideways, over what the drives may give, in the middle
    upper = (1.5 * 0.2 + 0.8 * (0.4 + 0.15)) * 9.81 / 40.0
    lower = 0.8 * 0.15 * 9.81 / 50.0
    assert inertials.overweight(machine) == pytest.approx(0.5 * (upper + lower), rel=0.05)
    assert inertials.overweight(loaded(URDF, tmp_path)) == 0.0  # one limit for all is none


@pytest.mark.parametrize(("mass", "says"), [(1000.0, "as g"), (1e-6, "weighs a gram")])
def test_masses_of_another_unit_and_placeholders_are_told(mass, says, tmp_path):
    machine = loaded(scaled(TWO, mass, mass), tmp_path)
    assert says in inertials.unmeant(machine)
    if mass < 1.0:  # as if nothing were stated
        assert machine.prior[:, 0] == pytest.approx([1000 * 0.06 * 0.06 * 0.4, 1.0])  # its shape, at 1000 kg/m^3; a ball


def test_one_inertia_for_all_is_a_placeholder(tmp_path):
    box = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    machine = loaded(re.sub(r"<inertial>.*</inertial>", box, TWO), tmp_path)
    assert "one and the same inertia" in inertials.unmeant(machine)
    # rods that are alike hang on their joints
    rod = box.replace("<mass", '<origin xyz="0 0 -0.2"/><mass')
    assert inertials.unmeant(loaded(re.sub(r"<inertial>.*</inertial>", rod, TWO), tmp_path)) == ""


def test_moments_of_another_unit_are_not_believed(tmp_path):
    plain, wide = (loaded(scaled(TWO, 1.0, own), tmp_path) for own in (1.0, 1e6))  # kg mm^2
    np.testing.assert_allclose(wide.prior[:, :4], plain.prior[:, :4])
    assert np.all(np.abs(wide.prior[:, 4:]).max(axis=1) < 10.0 * np.abs(plain.prior[:, 4:]).max(axis=1))


@pytest.mark.parametrize("mass", [1000.0, 1e-6])
def test_no_unit_of_a_log_is_held_against_such_a_robot(mass, experiment, cli):
    folder = experiment(urdf=lambda text: scaled(text.replace('effort="50"', 'effort="40"', 1), mass, mass))
    found = check.check(pipeline.load(folder))
    assert not {f.fault for f in found} & {"torque_in_amperes", "wrong_unit", "commanded_torque"}
    assert any(f.fault == "mass_implausible" and f.severity == "warning" and not f.joint for f in found)
    made = cli("init", folder / "robot.urdf", folder / "train.csv", folder / "test.csv", out=folder / "made")
    config = (folder / "made" / "config.yaml").read_text()
    assert made.status == 0 and "LOOK" in made.out
    assert "torque_constant" not in config and "position: deg" not in config and "torque: A" not in config
