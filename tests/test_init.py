"""`sysid init`: a robot and logs as they come, and `sysid fit` of what it writes; no YAML by
hand."""

import json
import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from sysid import pipeline
from sysid.init import text, units, words
from tests.conftest import JOINTS, URDF, csv
from tests.log_formats import write_aloha, write_bag1, write_droid, write_lerobot
from tests.test_readers import turned, with_bag


def speeds(columns):
    """Angles' slopes, which a log has beside them."""
    return {f"qd_{joint}": np.gradient(columns[f"q_{joint}"], columns["t"]) for joint in JOINTS}


FORMATS = {
    "csv": ("{}.csv", lambda p, c: p.write_text(csv(c))),
    "mcap": ("{}.mcap", lambda p, c: with_bag(p, c, "mcap")),
    "db3": ("{}.db3", lambda p, c: with_bag(p, c, "sqlite3")),
    "ROS 1 bag": ("{}.bag", lambda p, c: write_bag1(p, c, order=turned)),
    "LeRobot": ("{}", lambda p, c: write_lerobot(p, [c], names=[f"{j}.pos" for j in JOINTS])),
    "ALOHA": ("{}.hdf5", lambda p, c: write_aloha(p, c | speeds(c))),
    "DROID": ("{}.h5", write_droid),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory, arm_logs):
    """Folders with robot.urdf and the two logs in a format."""
    made = {}

    def write(kind):
        if kind not in made:
            folder = tmp_path_factory.mktemp("logs")
            (folder / "robot.urdf").write_text(URDF)
            name, writer = FORMATS[kind]
            for part, columns in zip(("train", "test"), arm_logs):
                writer(folder / name.format(part), columns)
            made[kind] = folder, [folder / name.format(part) for part in ("train", "test")]
        return made[kind]

    return write


def begun(cli, folder, logs, *more, out="mine"):
    """What init says of them, and the experiment that it wrote."""
    out = folder / out
    said = cli("init", folder / "robot.urdf", *logs, "--json", *more, out=out)
    assert said.status == 0, said.err
    return json.loads(said.out), pipeline.load(out)


@pytest.mark.parametrize("text", ["arm cold, first run", "day one, arm cold\nafter lunch, warm, and with the old gripper\n", ""])
def test_notes_beside_the_logs_of_a_folder_are_passed_over(cli, tmp_path, arm_logs, text):
    """And it is said; of a file that was named by itself what is wrong with it is said, as of one of a folder without a log."""
    logs = tmp_path / "logs"
    logs.mkdir()
    (tmp_path / "robot.urdf").write_text(URDF)
    (logs / "notes.txt").write_text(text)
    said = cli("init", tmp_path / "robot.urdf", logs, out=tmp_path / "none")
    assert said.status == 2 and "notes.txt" in said.err and "Traceback" not in said.err
    for part, columns in zip(("train", "test"), arm_logs):
        (logs / f"{part}.csv").write_text(csv(columns))
    found, experiment = begun(cli, tmp_path, [logs])
    assert len(experiment.data.train) + len(experiment.data.test) == 2
    assert [note for note in found["look"] if "notes.txt" in note and "passed over" in note], found["look"]
    said = cli("init", tmp_path / "robot.urdf", logs / "train.csv", logs / "notes.txt", out=tmp_path / "other")
    assert said.status == 2 and "notes.txt" in said.err


@pytest.fixture(scope="module")
def from_csv():
    """The fit of the CSV logs, made once."""
    return {}


@pytest.mark.long
@pytest.mark.parametrize("kind", FORMATS)
def test_no_yaml_by_hand(written, cli, kind, from_csv):
    folder, logs = written(kind)
    found, experiment = begun(cli, folder, logs)
    assert found["look"] == [] and found["experiment"].endswith("mine/config.yaml")
    assert [log.file for log in experiment.data.train] == [f"../{logs[0].name}"]
    assert experiment.robot.joints == list(JOINTS) and experiment.data.units.position == "rad"
    fit = pipeline.fit(experiment)
    first = from_csv.setdefault("fit", fit)
    scale = np.maximum(np.abs(first.x), np.nan_to_num(first.uncertainty.std, posinf=0.0))
    assert np.abs((fit.x - first.x) / np.maximum(scale, 1e-12)).max() < 1e-6


# ---- columns


def words_of(name):
    said = words.meaning(words.words(name))
    return said.signal, said.unit


@pytest.mark.parametrize(
    ("name", "said"),
    {
        "q_A1": ("position", ""),
        "JointPosition[2]": ("position", ""),
        "theta_dot_2": ("velocity", ""),
        "dq1": ("velocity", ""),
        "target_qdd_3": ("acceleration", ""),
        "elbow.effort": ("torque", ""),
        "current_position_1": ("position", ""),
        "motor_current_3": ("current", "A"),
        "q1_deg": ("position", "deg"),
        "encoder_3": ("position", "counts"),
        "temp1": ("", ""),
        "tool_force_z": ("", ""),
        "voltage_2": ("", ""),
    }.items(),
)
def test_what_names_say(name, said):
    assert words_of(name) == said


def renamed(columns, names):
    """The little arm's columns under other names: {new: old or values}."""
    return {new: columns[old] if isinstance(old, str) else old for new, old in names.items()}


def four(q, tau, joints=JOINTS):
    """{q name: column, tau name: column} of the two joints."""
    out = {q.format(j, k): f"q_{joint}" for k, (j, joint) in enumerate(zip(joints, JOINTS))}
    return out | {
        tau.format(j, k): f"tau_{joint}" for k, (j, joint) in enumerate(zip(joints, JOINTS))
    }


STYLES = {
    "names in front": (
        {"time": "t"} | four("{}.pos", "{}.torque"),
        "{joint}.pos",
        "{joint}.torque",
    ),
    "in groups": (
        {"stamp": "t"} | four("joints/{}/angle", "joints/{}/effort"),
        "joints/{joint}/angle",
        "joints/{joint}/effort",
    ),
    "in capitals": (
        {"Time": "t"} | four("Q_{}", "Tau_{}", ("SHOULDER", "ELBOW")),
        ["Q_SHOULDER", "Q_ELBOW"],
        ["Tau_SHOULDER", "Tau_ELBOW"],
    ),
    "numbers from 0": (
        {"t": "t"} | four("actual_q_{1}", "actual_torque_{1}"),
        ["actual_q_0", "actual_q_1"],
        ["actual_torque_0", "actual_torque_1"],
    ),
    "no column of time first": (
        four("pos{1}", "trq{1}") | {"timestamp": "t"},
        ["pos0", "pos1"],
        ["trq0", "trq1"],
    ),
}


@pytest.mark.parametrize(("names", "position", "torque"), STYLES.values(), ids=STYLES)
def test_columns_by_their_names(experiment, cli, names, position, torque):
    folder = experiment(train=lambda c: renamed(c, names), test=lambda c: renamed(c, names))
    found, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.data.columns.position == position and made.data.columns.torque == torque
    assert made.data.columns.time == next(new for new, old in names.items() if old == "t")
    assert found["look"] == [] and pipeline.fit(made).rms("test")["elbow"] < 0.06


def test_the_measured_rather_than_the_commanded(experiment, cli):
    """And what else was logged is named."""

    def more(columns):
        asked = {
            f"{kind}_target_{joint}": columns[f"{kind}_{joint}"] + 0.1
            for kind in ("q", "tau")
            for joint in JOINTS
        }
        return {"temp_elbow": 0 * columns["t"], **asked, **columns}

    folder = experiment(train=more, test=more)
    found, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.data.columns.position == "q_{joint}" and made.data.columns.torque == "tau_{joint}"
    assert found["unused_columns"][0] == "temp_elbow" and len(found["unused_columns"]) == 5
    only = lambda c: {n: v for n, v in more(c).items() if n not in ("tau_elbow", "tau_shoulder")}
    folder = experiment(train=only, test=only, name="asked")
    found, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.data.columns.torque == "tau_target_{joint}"
    assert any("asked for" in (guess["doubt"] or "") for guess in found["guesses"])


def test_any_text_in_names_stays_what_it_is(experiment, cli):
    """Names that would be YAML, or end a comment, in a file that is read again."""
    bad = "on: {x}\u2028# y"
    turned = lambda c: (
        {name.replace("elbow", bad): values for name, values in c.items()}
        | {"temp\x0bmodel: {}": c["t"]}
    )
    folder = experiment(urdf=lambda u: u.replace('"elbow"', f'"{bad}"'), train=turned, test=turned)
    found, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.robot.joints == ["shoulder", bad] and pipeline.fit(made).solution.converged
    assert text.flow({"on": "off", "1": "a b", "n": -1.5}) == '{"on": "off", "1": a b, "n": -1.5}'


def test_joint_states_as_rostopic_prints_them(experiment, cli):
    """The first row names the joint of each number, which need not be the URDF's order."""

    def printed(columns):
        rows = [
            "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1,"
            "field.effort0,field.effort1"
        ]
        values = [columns[name] for name in ("q_elbow", "q_shoulder", "tau_elbow", "tau_shoulder")]
        for t, *row in zip(columns["t"], *values):
            stamp = 1_700_000_000_000_000_000 + round(1e9 * t)
            rows.append(",".join(map(str, [stamp, stamp, "elbow", "shoulder", *row])))
        return "\n".join(rows) + "\n"

    folder = experiment(train=printed, test=printed)
    _, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.data.columns.position == ["field.position1", "field.position0"]
    assert (made.data.columns.time, made.data.units.time) == ("%time", "ns")
    assert pipeline.fit(made).rms("test")["elbow"] < 0.06


# ---- units


def degrees(columns):
    return {n: np.degrees(v) if n.startswith("q_") else v for n, v in columns.items()}


def test_units(experiment, cli):
    """Degrees by the size of angles; ms, us, ns by the step; a current by its name, its factor by
    the URDF."""

    def logged(columns):
        out = {
            n.replace("tau_", "current_"): v / 7.0 if n.startswith("tau_") else v
            for n, v in degrees(columns).items()
        }
        return out | {"t": 1000 * columns["t"] + 12345}

    folder = experiment(train=logged, test=logged)
    _, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    said = made.data.units
    assert (said.time, said.position, said.torque) == ("ms", "deg", "A")
    assert all(0.4 < said.torque_constant[joint] / (7.0 / 1.2) < 2.0 for joint in JOINTS)


@pytest.mark.parametrize(("unit", "per"), units._PER_SECOND.items())
@pytest.mark.parametrize("rate", [5.1, 30.0, 1000.0, 4999.0])
@pytest.mark.parametrize("start", [0.0, 3.0, 1.7e9])
def test_every_unit_of_time(unit, per, rate, start):
    t = (start + np.arange(50) / rate) * per
    logged = np.round(t).astype(np.int64) if unit == "ns" else t
    assert units.time_unit(logged, "t").value == unit


def test_small_angles_in_degrees(experiment, cli):
    """Which no size tells: only in degrees do they go with the torques. Rad as small stay rad."""
    from sysid import regressor, robot
    from sysid.robot_spec import RobotSpec
    from tests.conftest import motion

    folder = experiment()
    machine = robot.load(RobotSpec(urdf=str(folder / "robot.urdf")))
    t = np.arange(1000) / 200
    q, qd, qdd = (0.15 * part for part in motion(t))
    tau = regressor.torque(machine, 1.2 * machine.prior, q, qd, qdd) + 0.3 * qd
    for name, unit, scale in (("a.csv", "deg", 180.0 / np.pi), ("b.csv", "rad", 1.0)):
        angles = {f"q_{joint}": scale * q[:, k] for k, joint in enumerate(JOINTS)}
        torques = {f"tau_{joint}": tau[:, k] for k, joint in enumerate(JOINTS)}
        (folder / name).write_text(csv({"t": t} | angles | torques))
        assert max(np.abs(values).max() for values in angles.values()) < 4 * np.pi
        _, made = begun(cli, folder, [folder / name], out=unit)
        assert made.data.units.position == unit


def test_one_joint_in_degrees_is_read_so_alone(experiment, cli):
    """Its size says that it may be, the torques that it is; where all are, all are read so."""

    def one(columns, joints=JOINTS[1:2]):
        angles = {f"q_{joint}" for joint in joints}
        return {n: v * 180.0 / np.pi if n in angles else v for n, v in columns.items()}

    folder = experiment(train=one, test=one)
    _, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    column = f"q_{JOINTS[1]}"
    assert made.data.units.position == "rad"
    assert made.data.position == {JOINTS[1]: {column: 0.01745329}}
    every = lambda columns: one(columns, JOINTS)
    folder = experiment(train=every, test=every, name="every")
    _, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.data.units.position == "deg" and not made.data.position


def test_logs_in_different_units_are_to_be_looked_at(experiment, cli):
    folder = experiment(test=degrees)
    said, _ = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert "if these are in rad, bring all logs to one unit" in json.dumps(said)


@pytest.mark.parametrize("column", [f"q_{JOINTS[0]}", "t"])
def test_what_is_no_number_is_said_with_its_row(column, experiment, cli):
    def gap(columns):
        return {n: np.where((np.arange(len(v)) == 7) & (n == column), np.nan, v) for n, v in columns.items()}

    folder = experiment(train=gap)
    logs = [folder / "train.csv", folder / "test.csv"]
    said = cli("init", folder / "robot.urdf", *logs, out=folder / "mine")
    said.complains(f"{column} is nan", "row 7", "leave the row out")
    assert not (folder / "mine").exists()


def test_a_clock_that_counts_samples_is_to_be_looked_at():
    counted, timed = (units.time_unit(np.arange(50) * step, "t") for step in (1.0, 0.001))
    assert "samples' numbers" in counted.doubt and timed.doubt == ""


def test_the_rate_of_logs_without_a_clock(experiment, cli, arm_logs):
    bare = lambda c: {n: v for n, v in c.items() if n != "t"}
    folder = experiment(train=bare, test=bare)
    logs = [folder / "train.csv", folder / "test.csv"]
    cli("init", folder / "robot.urdf", *logs, out=folder / "mine").complains(
        "no column is a clock", "--rate HZ"
    )
    _, made = begun(cli, folder, logs, "--rate", "200")
    assert made.data.rate == 200.0
    folder = experiment(
        train=lambda c: bare(c | speeds(c)), test=lambda c: bare(c | speeds(c)), name="speeds"
    )
    _, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.data.rate == 200.0
    path = write_aloha(folder / "a.hdf5", arm_logs[0])  # speeds are zero
    assert begun(cli, folder, [path], out="aloha")[1].data.rate == 50.0
    with h5py.File(path, "r+") as file:
        file.attrs["dt"] = 0.005
    assert begun(cli, folder, [path], out="attribute")[1].data.rate == 200.0
    for log in (path, folder / "test.csv", write_bag1(folder / "a.bag", arm_logs[0])):
        _, made = begun(cli, folder, [log], "--rate", "199", out=f"stated {log.suffix}")
        assert made.data.rate == 199.0


# ---- joints


HAND = """
  <link name="palm"/>
  <joint name="wrist" type="fixed"><parent link="lower"/><child link="palm"/></joint>
  <link name="f1"/><joint name="finger_left" type="prismatic"><parent link="palm"/>
    <child link="f1"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="5" velocity="1"/>
    </joint><link name="f2"/><joint name="finger_right" type="prismatic"><parent link="palm"/>
    <child link="f2"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="5" velocity="1"/>
    <mimic joint="finger_left"/></joint>
</robot>"""


def test_grippers_are_locked_at_their_mean(experiment, cli):
    """By name and by number, with and without a torque; joints that mimic others, too."""
    width = lambda c: 0.02 + 0.01 * np.sin(c["t"])
    named = lambda c: c | {"q_finger_left": width(c), "tau_finger_left": 0 * c["t"]}
    counted = lambda c: renamed(
        c | {"w": width(c)}, {"t": "t"} | four("q{1}", "tau{1}") | {"q2": "w"}
    )
    for name, columns in (("named", named), ("counted", counted)):
        folder = experiment(
            urdf=lambda u: u.replace("</robot>", HAND), train=columns, test=columns, name=name
        )
        found, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
        assert made.robot.joints == list(JOINTS)
        assert made.robot.lock["finger_left"] == pytest.approx(
            0.02 + 0.01 * np.mean(np.sin(np.arange(600) / 200)), rel=1e-4
        )
        (why,) = [guess["why"] for guess in found["guesses"] if guess["key"] == "robot.lock"]
        assert "moves a gripper" in why and "finger_right, by <mimic>" in why
        assert pipeline.fit(made).rms("test")["elbow"] < 0.06


def test_a_joint_that_stands_is_locked_where_it_stands(experiment, cli):
    still = lambda c: c | {"q_elbow": np.full(600, 0.3)}
    folder = experiment(train=still, test=still)
    _, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert made.robot.joints == ["shoulder"] and made.robot.lock == {"elbow": 0.3}


def test_joints_that_the_user_names(experiment, cli):
    names = {"t": "t"} | four("q{1}", "tau{1}", ("elbow", "shoulder"))
    swapped = {
        new: {
            "q_shoulder": "q_elbow",
            "q_elbow": "q_shoulder",
            "tau_shoulder": "tau_elbow",
            "tau_elbow": "tau_shoulder",
        }.get(old, old)
        for new, old in names.items()
    }
    folder = experiment(train=lambda c: renamed(c, swapped), test=lambda c: renamed(c, swapped))
    logs = [folder / "train.csv", folder / "test.csv"]
    _, made = begun(cli, folder, logs, "--joints", "elbow,shoulder")
    assert made.robot.joints == ["elbow", "shoulder"] and made.data.columns.position == ["q0", "q1"]
    assert pipeline.fit(made).rms("test")["elbow"] < 0.06
    found, _ = begun(
        cli, folder, logs, out="guessed"
    )  # in the URDF's order, which it is not: the check sees it
    assert any("exchanged" in note for note in found["look"])
    cli("init", folder / "robot.urdf", *logs, "--joints", "hand", out=folder / "x").complains(
        "--joints", "'hand'", "shoulder, elbow"
    )


def test_a_joint_whose_torque_was_not_logged_still_moves(experiment, cli):
    """Without a column, and with one that never changes."""
    lost = lambda c: {name: values for name, values in c.items() if name != "tau_shoulder"}
    for name, columns in (("lost", lost), ("dead", lambda c: c | {"tau_shoulder": 0 * c["t"]})):
        folder = experiment(train=columns, test=columns, name=name)
        found, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
        assert made.robot.joints == list(JOINTS) and made.data.unused == ["shoulder"]
        assert pipeline.fit(made).rms("test")["elbow"] < 0.06


def test_commanded_positions_in_place_of_torques(experiment, cli):
    """Servos: tau = kp (command - q) - kd qd, of which command and q were logged."""
    kp, kd = 80.0, 2.0

    def asked(columns):
        out = {"t": columns["t"]}
        for joint in JOINTS:
            q, tau = columns[f"q_{joint}"], columns[f"tau_{joint}"]
            out[f"{joint}.pos"] = q
            out[f"{joint}.goal_pos"] = q + (tau + kd * np.gradient(q, columns["t"])) / kp
        return out

    folder = experiment(train=asked, test=asked)
    found, made = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    assert {j: spec.command for j, spec in made.actuator.items()} == {
        j: f"{j}.goal_pos" for j in JOINTS
    }
    (why,) = [guess["why"] for guess in found["guesses"] if guess["key"] == "actuator"]
    assert "no torque was logged" in why
    fit = pipeline.fit(made)
    assert fit.solution.converged and fit.predictions["test"].errors()["total"][1] < 0.1


# ---- splits


def test_one_recording_is_split_in_time(experiment, cli):
    folder = experiment()
    _, made = begun(cli, folder, [folder / "train.csv"])
    (train,), (test,) = made.data.train, made.data.test
    assert (train.start, train.stop, test.start, test.stop) == (0.0, 2.396, 2.396, None)
    assert pipeline.fit(made).samples["test"] > 80


@pytest.mark.parametrize(
    ("names", "test"),
    [
        (["a.csv", "b.csv", "c.csv"], ["c.csv"]),
        (["run_test.csv", "z.csv"], ["run_test.csv"]),
        ([f"{k}.csv" for k in range(1, 11)], ["9.csv", "10.csv"]),
    ],
)
def test_files_are_split_whole(experiment, cli, names, test):
    folder = experiment()
    (folder / "runs").mkdir()
    for name in names:
        (folder / "runs" / name).write_text((folder / "train.csv").read_text())
    _, made = begun(cli, folder, [folder / "runs"])
    assert [log.file.rpartition("/")[2] for log in made.data.test] == test
    assert len(made.data.train) == len(names) - len(test)


def test_episodes_are_split(experiment, cli, arm_logs):
    folder = experiment()
    path = write_lerobot(
        folder / "set", [arm_logs[0], arm_logs[1], arm_logs[0]], names=list(JOINTS)
    )
    _, made = begun(cli, folder, [path])
    assert (made.data.train[0].episode, made.data.test[0].episode) == ([0, 1], [2])
    assert pipeline.fit(made).samples["train"] > 1000


# ---- robots

MJCF = """<mujoco model="arm"><compiler angle="radian" autolimits="true"/>
<default><joint damping="0.3" armature="0.01" frictionloss="0.2"/></default><worldbody>
<body name="upper" pos="0.1 0 1" quat="0.9 0.1 0.2 0.3">
 <joint name="shoulder" axis="0 1 0" range="-3 3"/>
 <geom type="capsule" fromto="0 0 0 0 0.1 -0.4" size="0.03"/>
 <body name="lower" pos="0 0 -0.4"><joint name="elbow" axis="0.3 1 0" pos="0 0.02 0.01"/>
  <inertial pos="0.01 0 -0.15" mass="0.8" fullinertia="0.007 0.0072 0.001 0.0001 0 0.0002"/>
  <body name="slider" pos="0 0 -0.3"><joint name="slide" type="slide" axis="1 1 0" range="0 0.1"/>
   <inertial pos="0 0 0.1" quat="0.7 0.7 0.1 0" mass="0.1" diaginertia="1e-4 2e-4 2.5e-4"/></body>
  <body name="camera" pos="0 0.1 0">
   <inertial pos="0 0 0" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/></body>
 </body></body></worldbody></mujoco>"""
FREE = """<body name="free"><freejoint/><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/></body>
<body name="upper\""""


def test_mjcf(tmp_path, cli):
    """Its URDF has the inverse dynamics that Pinocchio gives the MJCF, and a fit runs on it."""
    import pinocchio as pin

    from sysid import regressor
    from sysid.robot import load
    from sysid.robot_spec import RobotSpec

    (tmp_path / "arm.xml").write_text(MJCF)
    truth = pin.buildModelFromMJCF(str(tmp_path / "arm.xml"))
    data, rng = truth.createData(), np.random.default_rng(0)
    t = np.arange(800) / 200
    q = np.stack(
        [np.sin(3 * t) + 0.3 * np.sin(7 * t), np.cos(2 * t), 0.05 + 0.04 * np.sin(4 * t + 1)],
        axis=1,
    )
    qd, qdd = np.gradient(q, t, axis=0), np.gradient(np.gradient(q, t, axis=0), t, axis=0)
    truth.armature[:] = 0.0
    tau = np.array([pin.rnea(truth, data, *row) for row in zip(q, qd, qdd)]) + rng.normal(
        0, 0.01, q.shape
    )
    names = ("shoulder", "elbow", "slide")
    columns = (
        {"t": t}
        | {f"q_{j}": q[:, k] for k, j in enumerate(names)}
        | {f"tau_{j}": tau[:, k] for k, j in enumerate(names)}
    )
    (tmp_path / "log.csv").write_text(csv(columns))
    said = cli("init", tmp_path / "arm.xml", tmp_path / "log.csv", "--json", out=tmp_path / "mine")
    assert said.status == 0 and said.err == "", said.err
    assert any("armature (shoulder 0.01" in note for note in json.loads(said.out)["look"])
    machine = load(RobotSpec(urdf=str(tmp_path / "mine/robot.urdf")))
    assert machine.joints == names and [body.name for body in machine.bodies] == [
        "upper",
        "lower",
        "slider",
    ]
    np.testing.assert_allclose(machine.damping, 0.3)
    np.testing.assert_allclose(machine.friction, 0.2)
    found = regressor.torque(machine, machine.prior, q, qd, qdd)
    expected = np.array([pin.rnea(truth, data, *row) for row in zip(q, qd, qdd)])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    assert pipeline.fit(pipeline.load(tmp_path / "mine")).solution.converged


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x: x.replace('<body name="upper"', FREE), ["FreeFlyer", "fixed to the world"]),
        (lambda x: x.replace('type="slide" axis="1 1 0" range="0 0.1"', 'type="ball"'), ["is a"]),
        (lambda x: x.replace("</mujoco>", ""), ["not XML"]),
        (lambda x: '<!DOCTYPE a [<!ENTITY b "c">]>' + x, ["document type or entities"]),
        (lambda x: "<sdf/>", ["root element is <sdf>"]),
    ],
)
def test_mjcf_that_has_no_urdf(tmp_path, cli, change, words):
    (tmp_path / "arm.xml").write_text(change(MJCF))
    (tmp_path / "log.csv").write_text("t,q_shoulder,tau_shoulder\n")
    cli("init", tmp_path / "arm.xml", tmp_path / "log.csv", out=tmp_path / "mine").complains(*words)


def test_xacro(experiment, cli):
    folder = experiment()
    body = URDF.replace('<?xml version="1.0"?>\n', "").replace(
        '<robot name="arm">',
        '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
        '<xacro:property name="m" value="${0.4 + 0.4}"/>',
    )
    (folder / "arm.urdf.xacro").write_text(
        body.replace('<mass value="0.8"/>', '<mass value="${m}"/>')
    )
    said = cli(
        "init",
        folder / "arm.urdf.xacro",
        folder / "train.csv",
        folder / "test.csv",
        "--json",
        out=folder / "mine",
    )
    assert said.status == 0, said.err
    assert '<mass value="0.8"/>' in (folder / "mine/robot.urdf").read_text()
    assert pipeline.fit(pipeline.load(folder / "mine")).rms("test")["elbow"] < 0.06
    (folder / "bad.xacro").write_text(body.replace('<mass value="0.8"/>', '<mass value="${n}"/>'))
    cli("init", folder / "bad.xacro", folder / "train.csv", out=folder / "x").complains(
        "bad.xacro", "xacro cannot expand it"
    )


def test_a_robot_that_needs_a_package(experiment, cli, monkeypatch):
    folder = experiment()
    (folder / "arm.xacro").write_text(URDF)
    monkeypatch.setitem(__import__("sys").modules, "xacrodoc", None)
    cli("init", folder / "arm.xacro", folder / "train.csv", out=folder / "x").complains(
        "pip install 'sysid[xacro]'"
    )


# ---- what cannot be guessed


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (
            lambda c: {n: v for n, v in c.items() if not n.startswith("tau")},
            ["no column looks like the torques, currents or commands"],
        ),
        (
            lambda c: {n: v for n, v in c.items() if not n.startswith("q")},
            ["no column looks like the angles"],
        ),
        (
            lambda c: {n: np.round(4096 * v) if n.startswith("q") else v for n, v in c.items()},
            ["'shoulder' is whole numbers", "counts of an encoder"],
        ),
        (
            lambda c: {n.replace("_shoulder", "1"): v for n, v in c.items() if "elbow" not in n},
            ["1 column of angles (q1)", "for 2 joints", "--joints"],
        ),
        (lambda c: csv(c, header=False), ["has no header"]),
        (
            lambda c: (
                {n: v for n, v in c.items() if n != "tau_elbow"} | {"q_shoulder": np.zeros(600)}
            ),
            ["no joint of the URDF moves"],
        ),
    ],
)
def test_what_cannot_be_guessed(experiment, cli, columns, words):
    folder = experiment(train=columns)
    cli("init", folder / "robot.urdf", folder / "train.csv", out=folder / "mine").complains(
        "train.csv" if "train.csv" in "".join(words) else "sysid: ", *words
    )
    assert not (folder / "mine").exists() and not list(folder.glob(".*"))


def test_nothing_is_overwritten(experiment, cli):
    folder = experiment(config="# mine\n")
    said = cli("init", folder / "robot.urdf", folder / "train.csv", out=folder)
    assert said.status == 2 and "there is an experiment already" in said.err
    assert (folder / "config.yaml").read_text() == "# mine\n"


def test_logs_of_two_kinds(experiment, cli, arm_logs):
    folder = experiment()
    write_bag1(folder / "a.bag", arm_logs[0])
    cli(
        "init", folder / "robot.urdf", folder / "train.csv", folder / "a.bag", out=folder / "mine"
    ).complains("a.bag", "has no column 'q_shoulder'")


def test_what_was_mended_in_reading_is_told(experiment, cli, arm_logs):
    folder = experiment()
    messages = [(row, JOINTS if row % 100 else JOINTS[:1]) for row in range(600)]
    path = write_bag1(folder / "a.bag", arm_logs[0], messages=messages)
    found, _ = begun(cli, folder, [path])
    assert any("6 of 600 messages lack some of the joints" in note for note in found["look"])


def test_wrapped_angles_are_told(experiment, cli):
    wrapped = lambda c: c | {"q_elbow": (c["q_elbow"] + np.pi + 2.9) % (2 * np.pi) - np.pi}
    folder = experiment(train=wrapped, test=wrapped)
    found, _ = begun(cli, folder, [folder / "train.csv", folder / "test.csv"])
    notes = [note for note in found["look"] if "the angle of elbow jumps by a turn" in note]
    assert len(notes) == 2 and all("first at" in note for note in notes)  # of each log once, and where
    text = (folder / "mine/config.yaml").read_text()
    assert "# LOOK: the angle of elbow" in text
    assert "deg" not in text.split("units:")[-1].split("\n\n")[0]  # a turn of 6.28 is rad, whatever torques such angles would go with


def test_what_a_person_sees(experiment, cli):
    folder = experiment()
    said = cli("init", folder / "robot.urdf", folder / "train.csv", out=folder / "mine")
    assert said.status == 0 and "data.units.position" in said.out and said.out.splitlines()[-1].startswith("next: sysid check ")
    (folder / "bag").mkdir()
    (folder / "bag/metadata.yaml").write_text("")
    (folder / "config.yaml").unlink()
    for given in (folder / "train.csv", folder / "robot.urdf", folder / "bag", folder):
        cli("fit", given).complains("not an experiment", f"`sysid init {folder}`" if given == folder else "`sysid init URDF LOG...`")


# ---- robots of other people


REAL = Path(os.environ.get("SYSID_DATA_DIR", "nowhere")).resolve()  # tests work elsewhere


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "unit", "torque"),
    [("kr300", "deg", "A"), ("rokae", "rad", "N m"), ("kinova", "rad", "N m")],
)
def test_logs_of_labs(tmp_path, cli, name, unit, torque):
    """Folders of a URDF and CSV files: what is guessed fits as well as what somebody knew."""
    source = REAL / name
    if not source.is_dir():
        pytest.skip(f"{name} is not where SYSID_DATA_DIR says")
    said = cli("init", source / "robot.urdf", source, "--json", out=tmp_path / name)
    assert said.status == 0, said.err
    made, known = pipeline.load(tmp_path / name), pipeline.load(source)
    assert (made.data.units.position, made.data.units.torque) == (unit, torque)
    if name == "kr300":  # gear ratios, by the masses of the URDF
        ratios = [
            made.data.units.torque_constant[j] / known.data.units.torque_constant[j]
            for j in made.robot.joints
        ]
        assert all(0.5 < ratio < 2.1 for ratio in ratios)
    assert made.solver.weighting == "noise"  # with which errors of loud joints are no longer the least
    made = made.model_copy(update={"solver": known.solver})
    left = [pipeline.fit(one).predictions["test"].errors()["total"][1] for one in (made, known)]
    assert left[0] < 1.05 * left[1]


@pytest.mark.long
@pytest.mark.parametrize(
    ("urdf", "count", "locked"),
    [
        pytest.param("ur_description/urdf/ur5_robot.urdf", 6, 0, marks=pytest.mark.study),
        ("panda_description/urdf/panda.urdf", 7, 1),
        pytest.param("so_arm_description/urdf/so101.urdf", 5, 1, marks=pytest.mark.study),
    ],
)
def test_simulated_robots(tmp_path, cli, urdf, count, locked):
    """Logs of `sysid simulate` under other names: numbered joints, degrees, ms, speeds and commands
    beside them."""
    import polars as pl

    reference = f"example-robot-data://{urdf}"
    (tmp_path / "given.yaml").write_text(f'robot: {{urdf: "{reference}"}}\n')
    said = cli(
        "simulate",
        tmp_path / "given.yaml",
        "--duration",
        "4",
        "--rate",
        "200",
        "--quiet",
        out=tmp_path / "sim",
    )
    assert said.status == 0, said.err
    for part in ("train", "test"):
        log = pl.read_csv(tmp_path / "sim" / f"{part}.csv")
        joints = [name.removeprefix("q_") for name in log.columns if name.startswith("q_")]
        slides = [joint for joint in joints if "finger" in joint]
        columns = {"time_ms": 1e3 * log["t"].to_numpy()}
        for k, joint in enumerate(joints, 1):
            q = log[f"q_{joint}"].to_numpy() * (1.0 if joint in slides else 180.0 / np.pi)
            columns |= {f"q{k}": q, f"q_cmd{k}": q + 1.0, f"tau{k}": log[f"tau_{joint}"].to_numpy()}
        (tmp_path / f"{part}.csv").write_text(csv(columns))
    said = cli(
        "init",
        reference,
        tmp_path / "train.csv",
        tmp_path / "test.csv",
        "--json",
        out=tmp_path / "mine",
    )
    assert said.status == 0 and json.loads(said.out)["look"] == [], said.err
    made, truth = pipeline.load(tmp_path / "mine"), pipeline.load(tmp_path / "sim")
    assert len(made.robot.joints) == count and len(made.robot.lock) == locked
    assert (made.data.units.time, made.data.units.position, made.data.columns.position[0]) == (
        "ms",
        "deg",
        "q1",
    )
    assert truth.robot.joints[:count] == made.robot.joints
    own = truth.robot.model_copy(update={"joints": made.robot.joints, "lock": made.robot.lock})
    truth = truth.model_copy(update={"robot": own})
    left = [pipeline.fit(one).predictions["test"].errors()["total"][1] for one in (made, truth)]
    assert left[0] < 1.05 * left[1]
