"""Units that the URDF's robot tells: its limits, and the torques that its masses need."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import check, pipeline, regressor, robot, units
from sysid.robot_spec import RobotSpec
from sysid.vocabulary import find
from tests.conftest import JOINTS, URDF, csv, motion

SLIDES = URDF.replace('name="shoulder" type="revolute"', 'name="shoulder" type="prismatic"').replace(
    'lower="-3" upper="3" effort="50"', 'lower="-0.9" upper="0.9" effort="50"', 1
)
BOTH_SLIDE = SLIDES.replace('name="elbow" type="revolute"', 'name="elbow" type="prismatic"').replace('lower="-3" upper="3"', 'lower="-0.9" upper="0.9"')
ENDLESS = URDF.replace('type="revolute"', 'type="continuous"').replace('lower="-3" upper="3" ', "")


def logged(folder, urdf, *, turn=0.0, shown=None, torque=1.0, seed=0):
    """Logs of a robot with friction and another mass: its motion grows by `turn` rad in each joint, and is shown in other units."""
    machine = robot.load(RobotSpec(urdf=str(folder / "robot.urdf")))
    t = np.arange(1600) / 200
    q, qd, qdd = (0.6 * part for part in motion(t))
    q, qd = q + turn * t[:, None] / t[-1], qd + turn / t[-1]
    tau = regressor.torque(machine, 1.2 * machine.prior, q, qd, qdd) + 0.3 * qd + 0.1 * np.sign(qd)
    tau += np.random.default_rng(seed).normal(0.0, 0.01, tau.shape)
    angles = {f"q_{j}": (shown or {}).get(j, 1.0) * q[:, k] for k, j in enumerate(JOINTS)}
    return csv({"t": t} | angles | {f"tau_{j}": torque * tau[:, k] for k, j in enumerate(JOINTS)})


def begun(cli, folder):
    said = cli("init", folder / "robot.urdf", folder / "a.csv", out=folder / "mine")
    assert said.status == 0, said.err
    return said.out, pipeline.load(folder / "mine")


def folder_of(tmp_path, urdf, **how):
    (tmp_path / "robot.urdf").write_text(urdf)
    (tmp_path / "a.csv").write_text(logged(tmp_path, urdf, **how))
    return tmp_path


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "N m"), (1e3, "mN m"), (1e-3, "kN m")])
def test_torques_a_thousand_times_off_are_in_another_unit(cli, tmp_path, factor, unit):
    """Of a robot whose masses are a fifth off; not its angles in degrees, nor its torques currents."""
    said, made = begun(cli, folder_of(tmp_path, URDF, torque=factor))
    assert (made.data.units.torque, made.data.units.position) == (unit, "rad")
    assert ("LOOK data.units.torque" in said) == (factor != 1.0)
    assert not [f for f in check.check(made) if f.severity == "error"]


@pytest.mark.parametrize(("joint", "shown", "factor"), [("elbow", 100.0, 100.0), ("elbow", 180.0 / np.pi, 180.0 / np.pi), ("shoulder", 100.0, 100.0)])
def test_one_angle_of_a_motor_s_shaft_is_behind_a_gear(cli, tmp_path, joint, shown, factor):
    """Its ratio is what goes with the torques, to a tenth; degrees stay degrees."""
    said, made = begun(cli, folder_of(tmp_path, URDF, shown={joint: shown}))
    (column,) = made.data.position[joint].items()
    assert column[0] == f"q_{joint}" and 1.0 / column[1] == pytest.approx(factor, rel=0.1 if factor == 100.0 else 1e-3)
    assert ("a motor's shaft, behind a gear of about" in " ".join(said.split())) == (factor == 100.0)


def test_a_slide_in_millimetres_beside_a_hinge(cli, tmp_path):
    """Its limits tell it; the hinge keeps its own unit, degrees too."""
    for name, hinge, unit in (("rad", 1.0, "rad"), ("deg", 180.0 / np.pi, "deg")):
        folder = tmp_path / name
        folder.mkdir()
        said, made = begun(cli, folder_of(folder, SLIDES, shown={"shoulder": 1e3, "elbow": hinge}))
        assert made.data.units.position == unit and made.data.position == {"shoulder": {"q_shoulder": 1e-3}}
        assert "as mm" in said and not [f for f in check.check(made) if f.severity == "error"]
    metres = tmp_path / "m"
    metres.mkdir()
    assert not begun(cli, folder_of(metres, SLIDES))[1].data.position


def test_check_says_what_to_write_of_a_slide_in_millimetres(cli, tmp_path):
    _, made = begun(cli, folder_of(tmp_path, SLIDES, shown={"shoulder": 1e3}))
    config = tmp_path / "mine" / "config.yaml"
    text = config.read_text()
    start = text.index("  position:\n    shoulder:") if "  position:\n    shoulder:" in text else text.index("  position: {shoulder")
    end = text.index("\n", text.index("0.001", start)) + 1
    config.write_text(text[:start] + text[end:])
    (fault, *_) = [f for f in check.check(pipeline.load(tmp_path / "mine")) if f.fault == "wrong_unit"]
    assert fault.severity == "error" and fault.joint == "shoulder" and "mm" in fault.do
    config.write_text((text[:start] + text[end:]).replace("position: rad", "position: mm"))
    assert not [f for f in check.check(pipeline.load(tmp_path / "mine")) if f.fault == "wrong_unit"]


@pytest.mark.parametrize(("shown", "unit"), [(1.0, "rad"), (180.0 / np.pi, "deg")])
def test_a_joint_without_limits_may_turn_many_times(cli, tmp_path, shown, unit):
    """Fifteen rad of a continuous joint are no degrees by their size; torques tell, either way."""
    _, made = begun(cli, folder_of(tmp_path, ENDLESS, turn=15.0, shown=dict.fromkeys(JOINTS, shown)))
    assert made.data.units.position == unit
    assert not [f for f in check.check(made) if f.severity == "error"]


@pytest.mark.parametrize("unit", ["N m", "mN m", "N cm", "kN m", "N", "mN", "kN"])
def test_a_unit_of_torque_is_that_of_the_joints_that_it_can_be_of(unit):
    own = {"mN m": 1e-3, "N cm": 1e-2, "kN m": 1e3, "mN": 1e-3, "kN": 1e3}.get(unit, 1.0)
    turns = unit.endswith(" m") or unit == "N cm"
    expected = [own, 1.0] if turns else [1.0, own]
    np.testing.assert_array_equal(units.scales(unit, [False, True]), expected)
    assert units.agree(unit, unit) and not units.agree("A", unit)


@pytest.mark.parametrize(
    ("slides", "units_of"),
    [
        ((False, False), ("kg m^2", "N m s/rad", "N m", "N m")),
        ((True, True), ("kg", "N s/m", "N", "N")),
        ((False, True), ("kg m", "N m s/m", "N m", "N m")),
        ((True, False), ("kg m", "N s/rad", "N", "N")),
    ],
)
def test_units_of_a_coupling_are_those_of_both_joints(slides, units_of):
    """The first joint's torque or force, by the acceleration and speed of the second, which turns or slides."""
    robot_ = SimpleNamespace(joints=("own", "other"), prismatic=np.array(slides))
    effect = find("joint_coupling").bound(robot_, 0)
    assert tuple(effect.unit_on(one.unit, robot_, 0) for one in effect.coefficients()) == units_of


def test_columns_whose_units_stand_in_their_names(cli, tmp_path):
    """A slide in mm and a hinge in degrees are both read, each in its own; what nothing was made of is said where its joint is locked."""
    (tmp_path / "robot.urdf").write_text(SLIDES)
    named = {"q_shoulder": "shoulder_pos [mm]", "q_elbow": "elbow_pos [deg]", "tau_shoulder": "shoulder_force [N]", "tau_elbow": "elbow_torque [Nm]"}
    text = logged(tmp_path, SLIDES, shown={"shoulder": 1e3, "elbow": 180.0 / np.pi})
    for plain, name in named.items():
        text = text.replace(plain, name, 1)
    (tmp_path / "a.csv").write_text(text)
    _, made = begun(cli, tmp_path)
    assert set(made.robot.joints) == set(JOINTS) and made.data.units.position == "deg"
    assert made.data.position == {"shoulder": {"shoulder_pos [mm]": 1e-3}}
    assert not [f for f in check.check(made) if f.severity == "error"]
    (tmp_path / "a.csv").write_text(text.replace("elbow_torque [Nm]", "elbow_strain", 1))
    (tmp_path / "mine" / "config.yaml").unlink()
    said = cli("init", tmp_path / "robot.urdf", tmp_path / "a.csv", out=tmp_path / "other")
    assert said.status == 0 and "elbow_strain" in said.out


@pytest.mark.parametrize(
    ("urdf", "names", "unit", "factors"),
    [
        (URDF, ("tau_shoulder [mNm]", "tau_elbow [mNm]"), "mN m", {}),
        (SLIDES, ("shoulder_force [kN]", "elbow_torque [Nm]"), "kN", {}),
        (URDF, ("tau_shoulder [kNm]", "tau_elbow [Nm]"), "N m", {"shoulder": {"tau_shoulder [kNm]": 1000.0}}),
    ],
)
def test_units_of_torque_that_headers_state(cli, tmp_path, urdf, names, unit, factors):
    """Of all joints of a kind, or of one joint alone."""
    (tmp_path / "robot.urdf").write_text(urdf)
    text = logged(tmp_path, urdf)
    header, *rows = text.split("\n")
    plain = header.split(",")
    scale = [{"mNm": 1e3, "kN": 1e-3, "kNm": 1e-3}.get(name.split("[")[1].rstrip("]"), 1.0) for name in names]
    columns = [plain.index(f"tau_{joint}") for joint in JOINTS]
    for k, row in enumerate(rows):
        cells = row.split(",")
        for at, own in zip(columns, scale) if row else ():
            cells[at] = repr(float(cells[at]) * own)
        rows[k] = ",".join(cells)
    for at, name in zip(columns, names):
        plain[at] = name
    (tmp_path / "a.csv").write_text("\n".join([",".join(plain), *rows]))
    _, made = begun(cli, tmp_path)
    assert made.data.units.torque == unit and made.data.torque == factors
    assert not [f for f in check.check(made) if f.severity == "error"]


@pytest.mark.parametrize("velocity", ['velocity="10"', ""])
def test_a_shaft_that_turns_many_times_is_no_error(tmp_path, velocity):
    """With a drive's greatest speed it is nothing to speak of; without one it is worth a word."""
    made = folder_of(tmp_path, ENDLESS.replace('velocity="10"', velocity), turn=15.0)
    (made / "config.yaml").write_text("robot: {urdf: robot.urdf}\ndata: {train: [a.csv], test: [a.csv]}\n")
    found = {f.severity for f in check.check(pipeline.load(made)) if f.fault == "wrong_unit"}
    assert found == (set() if velocity else {"warning"})


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "mN m"), (1e-3, "kN m")])
def test_check_says_the_unit_of_torques_a_thousand_times_off(tmp_path, factor, unit):
    """Of an arm whose torque is mostly friction, too; where another unit is stated it does not know better."""
    made = folder_of(tmp_path, URDF, torque=factor)
    told = f"data.units.torque: {unit}"
    for stated in ("N m", "N cm"):
        (made / "config.yaml").write_text(f"robot: {{urdf: robot.urdf}}\ndata: {{train: [a.csv], test: [a.csv], units: {{torque: {stated}}}}}\n")
        errors = [f for f in check.check(pipeline.load(made)) if f.severity == "error" and f.fault in ("wrong_unit", "torque_in_amperes")]
        assert errors
        if stated == "N m":
            assert all(told in f.do for f in errors)
        else:
            assert not any("data.units.torque: mN" in f.do or "data.units.torque: kN" in f.do for f in errors)


def test_one_slide_of_two_in_millimetres(cli, tmp_path):
    _, made = begun(cli, folder_of(tmp_path, BOTH_SLIDE, shown={"shoulder": 1e3}))
    assert made.data.units.position == "m" and made.data.position == {"shoulder": {"q_shoulder": 1e-3}}


def test_mega_is_no_milli():
    assert units.in_header("F [MN]", "torque") not in units.TORQUE and units.in_header("F [mN]", "torque") == "mN"
