"""A robot that is mounted otherwise than its file says, an axis that points the other way, joints that the file does not move, and other
readings of the columns that the equations tell; and robots of which nothing of that is said."""

import shutil

import numpy as np
import polars as pl
import pytest

from scripts.blind_parts.robots import experiment_of
from sysid import beyond, check, pipeline
from sysid.simulate import simulate, write


@pytest.fixture(scope="module")
def mounted(tmp_path_factory):
    """Writes logs of a planar arm under a gravity; its experiment file says that it stands upright."""
    made = {}

    def make(gravity):
        if gravity not in made:
            folder = tmp_path_factory.mktemp("mounted")
            experiment, _ = experiment_of("planar", folder)
            spec = experiment.robot.model_copy(update={"gravity": list(gravity)})
            machine, *_ = pipeline.build(experiment.model_copy(update={"robot": spec}))
            write(simulate(machine, seed=3, duration=12.0, rate=250.0), experiment, folder / "logs")
            config = folder / "logs" / "config.yaml"
            assert "gravity: [0.0, 0.0, -9.81]" in config.read_text()
            made[gravity] = folder / "logs"
        return made[gravity]

    return make


@pytest.mark.parametrize("gravity", [(9.81, 0.0, 0.0), (-6.94, 0.0, -6.94)])
def test_gravity_that_points_elsewhere_is_told(gravity, mounted):
    (found,) = check.check(pipeline.load(mounted(gravity)))
    assert found.severity == "error" and "gravity looks like" in found.says and "robot.gravity: [" in found.do
    told = np.array([float(one) for one in found.do.partition("[")[2].partition("]")[0].split(",")])
    assert told @ gravity > np.cos(np.radians(10.0)) * 9.81**2


def test_torque_without_gravity_is_told(mounted, tmp_path):
    """As arms log it that take it off themselves; and it is no fault where the experiment says so."""
    logs = shutil.copytree(mounted((0.0, 0.0, 0.0)), tmp_path / "logs")
    (found,) = check.check(pipeline.load(logs))
    assert (found.fault, found.severity) == ("mass_implausible", "error") and "nothing of gravity" in found.says and "robot.gravity: [0, 0, 0]" in found.do
    config = logs / "config.yaml"
    config.write_text(config.read_text().replace("gravity: [0.0, 0.0, -9.81]", "gravity: [0, 0, 0]"))
    assert check.check(pipeline.load(logs)) == []


def test_gravity_that_the_file_says_there_is_none_of_is_told(mounted, tmp_path):
    """As where an experiment file was copied from that of a planar robot."""
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    config = logs / "config.yaml"
    config.write_text(config.read_text().replace("gravity: [0.0, 0.0, -9.81]", "gravity: [0, 0, 0]"))
    (found,) = check.check(pipeline.load(logs))
    assert found.severity == "error" and "the experiment says none" in found.says and "robot.gravity: [0, 0, -9.81]" in found.do


@pytest.mark.parametrize(("times", "stated", "unit"), [(0.5 / np.pi, "rad", "turns"), (1.0, "deg", "rad")])
def test_angles_in_another_unit_than_the_file_says_are_told(mounted, tmp_path, times, stated, unit):
    """Turns that were taken for rad; and rad that were taken for degrees, in which no joint moves enough to tell of anything else."""
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        table.with_columns(pl.col("q_shoulder", "q_elbow") * times).write_csv(logs / name)
    config = logs / "config.yaml"
    config.write_text(config.read_text().replace("data:\n", f"data:\n  units: {{position: {stated}}}\n"))
    assert pipeline.load(logs).data.units.position == stated
    (found,) = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert (found.fault, found.do) == ("wrong_unit", f"set data.units.position: {unit}")
    config.write_text(config.read_text().replace(f"position: {stated}", f"position: {unit}"))
    assert not [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]


@pytest.mark.parametrize(
    ("of", "word", "times"),
    [("elbow", "a speed, its own", 1.0), ("shoulder", "a speed, that of shoulder", 180.0 / np.pi), ("elbow", "an angle, its own", None)],
)
def test_a_torque_that_is_an_angle_or_a_speed_is_told(mounted, tmp_path, of, word, times):
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        angle = table[f"q_{of}"].to_numpy()
        noise = np.random.default_rng(1).normal(0.0, 0.01, len(angle))
        own = angle if times is None else times * (np.gradient(angle, table["t"].to_numpy()) + noise)
        table.with_columns(tau_elbow=pl.Series(own)).write_csv(logs / name)
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert [(f.fault, f.joint) for f in found] == [("joint_order", "elbow")] and word in found[0].says


@pytest.mark.parametrize("shift", [0.15, -0.6])
def test_recordings_that_did_not_begin_together_are_told(mounted, tmp_path, shift):
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        t = table["t"].to_numpy()
        table.with_columns(pl.Series(one, np.interp(t - shift, t, table[one].to_numpy())) for one in ("tau_shoulder", "tau_elbow")).write_csv(logs / name)
    (found,) = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    word, other = ("later", "earlier") if shift > 0.0 else ("earlier", "later")
    assert found.fault == "delayed_signal" and f"look {abs(shift):.2g} s {word} than the motion" in found.says and f"{abs(shift):.2g} s {other}" in found.do


def test_a_joint_that_is_locked_and_moves_is_told(mounted, tmp_path):
    """An error where it carries a joint that is asked, else worth knowing, whether or not somebody said where it stands."""
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    config, text = logs / "config.yaml", (logs / "config.yaml").read_text()
    for joints, more, severity in (("elbow", "", "error"), ("shoulder", "", "warning"), ("shoulder", ", lock: {elbow: 0.3}", "warning")):
        config.write_text("robot: {urdf: robot.urdf, joints: [" + joints + "]" + more + "}\n" + text[text.index("data:") :])
        found = [f for f in check.check(pipeline.load(logs)) if f.fault == "joint_order"]
        assert [f.severity for f in found] == [severity] and "locked joints that move" in found[0].says


def test_gravity_as_the_file_says_is_no_fault(mounted):
    assert check.check(pipeline.load(mounted((0.0, 0.0, -9.81)))) == []


def test_an_axis_that_points_the_other_way_is_told_though_friction_hides_masses(mounted, tmp_path):
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        speed = np.gradient(table["q_elbow"].to_numpy(), table["t"].to_numpy())
        dry = table["tau_elbow"] + pl.Series(3.0 * np.sign(speed))
        table.with_columns(q_elbow=-table["q_elbow"], tau_elbow=-dry).write_csv(logs / name)
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert [(f.fault, f.joint) for f in found] == [("sign_flipped", "elbow")]
    assert "angle and the torque of elbow" in found[0].says and "q_elbow: -1" in found[0].do and "tau_elbow: -1" in found[0].do


def test_a_joint_that_the_robots_file_does_not_move_is_told(mounted, tmp_path):
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        wave = np.sin(table["t"].to_numpy())
        table.with_columns(q_wrist=pl.Series(wave), tau_wrist=pl.Series(0.1 * wave)).write_csv(logs / name)
    (found,) = check.check(pipeline.load(logs))
    assert (found.fault, found.severity) == ("joint_order", "warning") and "q_wrist moves" in found.says and "no joint wrist" in found.says
    urdf = logs / "robot.urdf"
    fixed = '<link name="hand"/><joint name="wrist" type="fixed"><parent link="{}"/><child link="hand"/></joint></robot>'
    last = pipeline.build(pipeline.load(logs))[0].source.joints["elbow"].child
    urdf.write_text(urdf.read_text().replace("</robot>", fixed.format(last)))
    (found,) = check.check(pipeline.load(logs))
    assert (found.fault, found.severity) == ("joint_order", "warning") and "fixed joint" in found.says  # at the end, as a gripper's
    moved = pipeline.build(pipeline.load(logs))[0].source.joints
    assert beyond.carries(moved, "shoulder", ["elbow"]) and not beyond.carries(moved, "wrist", ["elbow", "shoulder"])
    assert not beyond.carries(moved, "nobody", ["elbow"])


def test_columns_of_other_joints():
    names = ["t", "q_a", "tau_a", "q_b", "tau_b", "q_c", "volts", "qd_b"]
    assert beyond.beyond(names, "q_{joint}", "tau_{joint}", ["a"]) == {"b": "q_b"}  # c has no torque
    assert beyond.beyond(names, "q_{joint}", "tau_{joint}", ["a", "b"]) == {}
    assert beyond.beyond(names, "{joint}", "tau_{joint}", ["a"]) == {} == beyond.beyond(names, None, "tau_{joint}", ["a"])
    assert beyond.moving({"b": "q_b", "c": "q_c"}, {"q_b": np.zeros(3), "q_c": np.array([0.0, np.nan, 2.0])}) == ["c"]
    assert beyond.moving({"b": "q_b"}, {"q_b": np.arange(3.0) * 0.1}, "deg") == [] != beyond.moving({"b": "q_b"}, {"q_b": np.arange(3.0) * 0.1})


TABLE = """<robot name="table"><link name="base"/><link name="plate"><inertial><mass value="{mass}"/><origin xyz="0.1 0 0"/>
<inertia ixx="{size}" iyy="{size}" izz="{size}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="plate"/><axis xyz="0 0 1"/></joint></robot>"""


@pytest.mark.parametrize(("size", "viscous", "mass"), [(10.0, 0.3, 1.0), (30.0, 0.3, 1.0), (1.0, 1.0, 0.001)])
def test_a_turntable_is_not_said_to_be_in_another_unit_or_a_speed(tmp_path, size, viscous, mass):
    """Nothing of it has weight: masses of the URDF that are too large are like angles that are too small; and friction of one N m s/rad on a
    light wheel is like its speed, which is worth knowing and no error."""
    (tmp_path / "robot.urdf").write_text(TABLE.format(mass=mass * size, size=0.05 * mass * size))
    t, rng = np.arange(4000) / 200.0, np.random.default_rng(4)
    for name, shift in (("train", 0.0), ("test", 1.0)):
        q = np.sin(1.3 * t + shift) + 0.6 * np.sin(3.1 * t + 2.0 * shift)
        qd = 1.3 * np.cos(1.3 * t + shift) + 1.86 * np.cos(3.1 * t + 2.0 * shift)
        qdd = -1.69 * np.sin(1.3 * t + shift) - 5.766 * np.sin(3.1 * t + 2.0 * shift)
        tau = 0.06 * mass * qdd + viscous * qd + 0.01 * rng.normal(size=len(t))
        pl.DataFrame({"t": t, "q_turn": q, "tau_turn": tau}).write_csv(tmp_path / f"{name}.csv")
    (tmp_path / "config.yaml").write_text("robot: {urdf: robot.urdf}\ndata: {train: [train.csv], test: [test.csv]}\nmodel: {effects: [viscous]}\n")
    found = check.check(pipeline.load(tmp_path))
    assert not [f for f in found if "look to be in" in f.says or f.fault in ("delayed_signal", "joint_order") and f.severity == "error"]
    assert any("is a speed, its own, or it has friction" in f.says for f in found) is (viscous == 1.0)


def test_each_log_has_a_shift_of_its_own(mounted, tmp_path):
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    table = pl.read_csv(logs / "train.csv")
    t = table["t"].to_numpy()
    for name, shift in (("train.csv", 0.3), ("late.csv", -0.5)):
        table.with_columns(pl.Series(one, np.interp(t - shift, t, table[one].to_numpy())) for one in ("tau_shoulder", "tau_elbow")).write_csv(logs / name)
    config = logs / "config.yaml"
    config.write_text(config.read_text().replace("train: [train.csv]", "train: [train.csv, late.csv]"))
    found = {f.log: f for f in check.check(pipeline.load(logs)) if f.fault == "delayed_signal"}
    assert "0.3 s later" in found["train.csv"].says and "0.5 s earlier" in found["late.csv"].says


def test_a_joint_that_stands_elsewhere_than_it_is_locked_is_worth_knowing(mounted, tmp_path):
    logs = shutil.copytree(mounted((0.0, 0.0, -9.81)), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        table.with_columns(q_shoulder=pl.Series(np.full(len(table), 0.7))).write_csv(logs / name)
    config, text = logs / "config.yaml", (logs / "config.yaml").read_text()
    config.write_text("robot: {urdf: robot.urdf, joints: [elbow]}\n" + text[text.index("data:") :])
    (found,) = [f for f in check.check(pipeline.load(logs)) if "locked joints" in f.says]
    assert found.severity == "warning" and found.do == "say in robot.lock where they stand"
