"""The side of the motor: sums of signals, free factors, joints without usable torque, and servos whose torque nobody logged."""

import json

import numpy as np
import pytest

from sysid import config, drives, experiment_logs, pipeline, results, robot, rollout
from sysid.diagnose.diagnosis import diagnose
from sysid.errors import ConfigError, LogError
from sysid.filters import settled
from sysid.preprocess import prepare
from sysid.statement.document import document
from sysid.statement.text import told, verdict
from tests import servos
from tests.conftest import CONFIG, csv, logged

MOTOR = {"a": 45.0, "b": 32.0}  # torque of motor a acts on the shoulder, of motor b on both


def folder_with(folder, planar_folder, columns, **sections):
    """An experiment of the planar arm with logs of its own columns."""
    folder.mkdir()
    (folder / "robot.urdf").write_text((planar_folder / "robot.urdf").read_text())
    for part, own in zip(("train", "test"), columns):
        (folder / f"{part}.csv").write_text(csv(own))
    spec = {**CONFIG, **sections}
    spec["data"] = {**CONFIG["data"], **sections.get("data", {})}
    return config.experiment(spec, folder / "config.yaml")


@pytest.fixture(scope="module")
def planar_folder(tmp_path_factory):
    from tests.conftest import URDF

    folder = tmp_path_factory.mktemp("planar")
    (folder / "robot.urdf").write_text(URDF)
    return folder


@pytest.fixture(scope="module")
def columns(planar_folder):
    machine = robot.load(config.experiment({"robot": CONFIG["robot"]}).robot, planar_folder)
    return [logged(machine, seed) for seed in (0, 1)]


def motor_side(columns: dict) -> dict:
    """What a drive logs whose motor b turns both joints: its own angle and both motors' torques."""
    b = columns["tau_elbow"] / MOTOR["b"]
    return {
        "t": columns["t"], "q_shoulder": columns["q_shoulder"], "m_b": (columns["q_elbow"] + columns["q_shoulder"]) / 0.03125,
        "i_a": (columns["tau_shoulder"] - MOTOR["b"] * b) / MOTOR["a"], "i_b": b,
    }  # fmt: skip


SUMS = {
    "torque": {"shoulder": {"i_a": MOTOR["a"], "i_b": MOTOR["b"]}, "elbow": {"i_b": MOTOR["b"]}},
    "position": {"elbow": {"m_b": 0.03125, "shoulder": -1}},
}  # fmt: skip


def test_a_motor_on_two_joints_is_the_joint_side_s_fit(tmp_path, planar_folder, columns):
    plain = pipeline.fit(folder_with(tmp_path / "plain", planar_folder, columns))
    experiment = folder_with(tmp_path / "motor", planar_folder, [motor_side(own) for own in columns], data=SUMS)
    found = pipeline.fit(experiment)
    np.testing.assert_allclose(found.x, plain.x, rtol=1e-9, atol=1e-12)
    assert found.rms("test") == pytest.approx(plain.rms("test"), rel=1e-9)
    # and its run folder says the same of itself
    out = results.write(found, tmp_path / "run")
    again = pipeline.fit(pipeline.load(tmp_path / "run" / "experiment.yaml"))
    assert out["drives"] == [] and again.rms("test") == pytest.approx(found.rms("test"), rel=1e-12)


def test_signs_and_aliases_of_signals(tmp_path, planar_folder, columns):
    turned = [{("current" if k == "tau_elbow" else k): (-v if k == "tau_shoulder" else v) for k, v in own.items()} for own in columns]
    data = {"torque": {"shoulder": {"shoulder": -1}, "elbow": {"drive": 1}}, "signals": {"drive": "current"}}
    found = pipeline.fit(folder_with(tmp_path / "turned", planar_folder, turned, data=data))
    plain = pipeline.fit(folder_with(tmp_path / "plain", planar_folder, columns))
    np.testing.assert_allclose(found.x, plain.x, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("factor", ["free", {"start": 0.4, "within": [0.1, 2.0]}])
def test_a_free_factor_is_found(tmp_path, planar_folder, columns, factor):
    """One joint's torque is known in N m: it tells the other's factor."""
    amps = [{**own, "tau_elbow": own["tau_elbow"] / 0.6} for own in columns]
    experiment = folder_with(tmp_path / "free", planar_folder, amps, data={"torque": {"elbow": {"elbow": factor}}})
    found = pipeline.fit(experiment)
    (told,) = found.drives
    assert (told.joint, told.name) == ("elbow", "elbow") and 0.0 < told.std < 0.3
    assert abs(told.value - 0.6) < 3.0 * told.std
    assert not any("known in N m" in text for text in found.notices)


def test_a_motor_that_shares_a_joint_is_told_against_the_leading_one(tmp_path, planar_folder, columns):
    """The shoulder has two motors: the second one's factor is a coefficient, exact where nothing else is like it."""
    rng = np.random.default_rng(5)
    two = []
    for own in columns:
        second = 3.0 * np.sin(2.0 * np.pi * 0.37 * own["t"]) + rng.normal(0.0, 0.5, len(own["t"]))
        two.append({**own, "tau_shoulder": own["tau_shoulder"] - 1.7 * second, "second": second})
    data = {"torque": {"shoulder": {"shoulder": 1, "second": "free"}}}
    (told,) = pipeline.fit(folder_with(tmp_path / "two", planar_folder, two, data=data)).drives
    assert told.name == "second" and told.value == pytest.approx(1.7, abs=max(3.0 * told.std, 1e-3)) and told.std < 0.05


def test_a_joint_without_usable_torque_moves_with_the_rest(tmp_path, planar_folder, columns):
    """Its motion is part of the other's equation; its own is not looked at, and its column need not be there."""
    without = [{k: v for k, v in own.items() if k != "tau_elbow"} for own in columns]
    experiment = folder_with(tmp_path / "unused", planar_folder, without, data={"unused": ["elbow"]})
    found = pipeline.fit(experiment)
    document = results.write(found, tmp_path / "run")
    assert document["rms"]["test"]["elbow"] is None and document["rms"]["test"]["shoulder"] < 0.3
    assert not any("viscous.elbow" in text or "elbow" in text and "never" in text for text in found.notices)
    held = {p["name"]: p for p in document["parameters"]}
    assert held["viscous.elbow.Fv"]["std"] is None
    json.dumps(document, allow_nan=False)


SERVOS = """
model: {{effects: [viscous, coulomb, armature]}}
prior: {{known: [link_{dof}]}}
actuator: {{{entries}}}
"""


def entries(dof: int, **keys) -> str:
    """The actuator section of an arm's joints."""
    said = ", ".join(f"{key}: {value}" for key, value in keys.items())
    return ", ".join(f"joint_{j + 1}: {{command: cmd_joint_{j + 1}, {said}}}" for j in range(dof))


@pytest.fixture(scope="module")
def servo_arm(tmp_path_factory):
    """Two servos in MuJoCo, their gains and delay to be found, the last link known."""
    folder = tmp_path_factory.mktemp("servos")
    text = SERVOS.format(dof=2, entries=entries(2, kp="free", kd="free", delay="free"))
    return folder, servos.write(folder, 11, 2, text, seconds=8.0)


@pytest.fixture(scope="module")
def servo_fit(servo_arm):
    return pipeline.fit(pipeline.load(servo_arm[0]))


def test_servos_are_found_without_torque(servo_arm, servo_fit):
    truth = servo_arm[1]
    told = {(d.joint, d.name): d for d in servo_fit.drives}
    delay = (truth.delay + 0.5) / 500.0  # a command that is held acts half a period late
    names = servo_fit.model.names
    for j in range(2):
        joint = f"joint_{j + 1}"
        assert told[joint, "kp"].value == pytest.approx(truth.kp[j], rel=0.05)
        assert told[joint, "kd + Fv"].value == pytest.approx(truth.kd[j] + truth.viscous[j], rel=0.05)
        assert told[joint, "delay"].value == pytest.approx(delay, rel=0.05)
        assert servo_fit.x[names.index(f"armature.{joint}.Ia")] == pytest.approx(truth.armature[j], rel=0.1)
        assert servo_fit.x[names.index(f"coulomb.{joint}.Fc")] == pytest.approx(truth.coulomb[j], rel=0.1)


def test_the_known_link_stays_what_it_is(servo_fit):
    body = [b.name for b in servo_fit.model.robot.bodies].index("link_2")
    np.testing.assert_allclose(servo_fit.pi[body], servo_fit.prior[body], rtol=1e-6, atol=1e-9)
    assert not np.isfinite(servo_fit.uncertainty.std[10 * body : 10 * body + 10]).any()
    assert servo_fit.certificate.globally_optimal


def test_the_closed_loop_let_go_follows_the_log(servo_fit):
    """Against angles of which it was told only where they begin; a wrong gain misses them by far."""
    assert all(value < 5e-4 for value in servo_fit.rollout.values())  # rad, of motions of a third of a radian
    machine, model = servo_fit.model.robot, servo_fit.model
    read = experiment_logs.read(servo_fit.experiment, machine, servo_fit.experiment.data.test)
    held_out = prepare(read, settled(servo_fit.experiment.preprocess, servo_fit.filters), machine.joints)
    weak = np.array(servo_fit.x)
    weak[model.names.index("viscous.joint_1.Fv")] *= 3.0
    wrong = rollout.rms(servo_fit.experiment, model, weak, held_out)
    assert wrong["joint_1"] > 10.0 * servo_fit.rollout["joint_1"]


@pytest.mark.long
def test_a_missing_spring_is_named_without_any_torque(tmp_path):
    """Put in by MuJoCo, on one of two servos of which nothing but commands and angles is logged."""
    text = SERVOS.format(dof=2, entries=entries(2, kp="free", kd="free", delay="free"))
    servos.write(tmp_path, 12, 2, text, seconds=8.0, springs=[(1, 1.5)])
    found = diagnose(pipeline.load(tmp_path))
    said = {v.joint: v for v in found.verdict}
    (claim,) = said["joint_2"].claims
    assert ("spring", "joint_2") in [(name, joint) for name, joint, _ in claim.set]
    assert claim.head.effect == "spring" and claim.head.rms_after < 0.5 * claim.head.rms_before
    assert said["joint_1"].status in ("complete", "explained")


def test_a_joint_without_torque_is_no_obstacle_to_a_diagnosis(tmp_path, planar_folder, columns):
    without = [{k: v for k, v in own.items() if k != "tau_elbow"} for own in columns]
    experiment = folder_with(tmp_path / "unused", planar_folder, without, data={"unused": ["elbow"]})
    found = diagnose(experiment)
    status = {v.joint: v.status for v in found.verdict}
    assert status["elbow"] == "unresolved" and status["shoulder"] in ("complete", "unresolved")
    json.dumps(document(found), allow_nan=False)
    assert "shoulder" in "\n".join(line for _, lines in verdict(told(found, document(found)), 80) for line in lines)


def test_a_scale_that_no_log_tells_is_said(servo_arm, tmp_path):
    """With no body known, masses and gains have one common factor; the ratios stay right."""
    folder, truth = servo_arm
    text = (folder / "config.yaml").read_text().replace("known: [link_2]", "known: []")
    found = pipeline.fit(config.loads(text, folder / "config.yaml"))
    assert any("one common factor" in text for text in found.notices)
    kp = [d.value for d in found.drives if d.name == "kp"]
    assert kp[0] / kp[1] == pytest.approx(truth.kp[0] / truth.kp[1], rel=0.05)
    assert all(d.std > 0.02 * d.value for d in found.drives if d.name == "kp")  # it does not claim to know


def test_given_gains_are_used_as_given(servo_arm):
    folder, truth = servo_arm
    own = ", ".join(
        f"joint_{j + 1}: {{command: cmd_joint_{j + 1}, kp: {truth.kp[j]}, kd: {truth.kd[j]}, delay: {(truth.delay + 0.5) / 500.0}}}" for j in range(2)
    )
    found = pipeline.fit(config.loads(f"model: {{effects: [viscous, coulomb, armature]}}\nactuator: {{{own}}}\n", folder / "config.yaml"))
    names = found.model.names
    assert found.drives == ()
    for j in range(2):
        assert found.x[names.index(f"drive_damping.joint_{j + 1}.kd")] == pytest.approx(truth.kd[j], rel=1e-12)
        std = found.uncertainty.std[names.index(f"viscous.joint_{j + 1}.Fv")]
        assert found.x[names.index(f"viscous.joint_{j + 1}.Fv")] == pytest.approx(truth.viscous[j], abs=max(4.0 * std, 0.1 * truth.viscous[j]))


def test_a_voltage_is_a_motor_s_torque(servo_arm, tmp_path):
    """The servo's own equation written as a DC motor's: voltage = command - q, k/R = kp, k^2/R = kd."""
    import polars

    folder, truth = servo_arm
    k = truth.kd / truth.kp
    for part in ("train", "test"):
        table = polars.read_csv(folder / f"{part}.csv")
        shift = truth.delay
        made = {"t": table["t"]}
        for j in ("1", "2"):
            q, asked = table[f"q_joint_{j}"].to_numpy(), table[f"cmd_joint_{j}"].to_numpy()
            late = np.interp(np.arange(len(q)) - shift - 0.5, np.arange(len(q)), asked)
            made |= {f"q_joint_{j}": q, f"u_{j}": late - q}
        (tmp_path / f"{part}.csv").write_text(csv({key: np.asarray(v) for key, v in made.items()}))
    (tmp_path / "robot.urdf").write_text((folder / "robot.urdf").read_text())
    own = ", ".join(f"joint_{j + 1}: {{voltage: u_{j + 1}, k: {k[j]}, R: {k[j] / truth.kp[j]}}}" for j in range(2))
    found = pipeline.fit(config.loads(f"model: {{effects: [viscous, coulomb, armature]}}\nactuator: {{{own}}}\n", tmp_path / "config.yaml"))
    names = found.model.names
    for j in range(2):
        assert found.x[names.index(f"drive_damping.joint_{j + 1}.kd")] == pytest.approx(truth.kd[j], rel=1e-9)
        assert found.x[names.index(f"armature.joint_{j + 1}.Ia")] == pytest.approx(truth.armature[j], rel=0.1)


WRONG = {
    "data: {unused: [wrist]}": "data.unused names the joint 'wrist'",
    "data: {unused: [shoulder, elbow]}": "every joint",
    "data: {torque: {elbow: {nowhere: 2}}}": "'nowhere'",
    "data: {torque: {elbow: {}}}": "data.torque.elbow",
    "data: {torque: {elbow: {i: 0}}}": "data.torque.elbow",
    "data: {position: {elbow: {shoulder: 1}, shoulder: {elbow: 1}}}": "need each other",
    "data: {torque: {elbow: {tau_elbow: 2}}, unused: [elbow]}": "data.torque and by data.unused",
    "data: {torque: {elbow: {tau_elbow: {start: 5, within: [1, 2]}}}}": "within",
    "actuator: {elbow: {kp: 3}}": "command",
    "actuator: {elbow: {command: tau_elbow, k: 3}}": "voltage",
    "actuator: {elbow: {command: nowhere}}": "'nowhere'",
    "actuator: {elbow: {command: tau_elbow, delay: -1}}": "delay",
    "prior: {known: [nobody]}": "'nobody'",
    "data: {torque: {elbow: {tau_elbow: free}}}\nmodel: {effects: [torque_gain]}": "they are the same",
}


@pytest.mark.parametrize("text", WRONG, ids=list(WRONG))
def test_what_cannot_be_is_said_in_one_line(tmp_path, planar_folder, columns, text):
    experiment = folder_with(tmp_path / "e", planar_folder, columns)
    with pytest.raises((ConfigError, LogError)) as error:
        pipeline.fit(config.loads(text, experiment.path))
    assert WRONG[text] in str(error.value) and "\n" not in str(error.value)


def test_the_scale_is_told_by_one_known_torque():
    spec = {"actuator": {"a": {"command": "c", "kp": "free"}, "b": {"command": "c", "kp": 3.0}}}
    experiment = config.experiment(spec)
    assert drives.scale_is_told(experiment, ("a", "b")) and not drives.scale_is_told(experiment, ("a",))


def test_a_delay_starts_where_all_joints_leave_least():
    """A joint whose own is shallow goes with the others; one that is clearly elsewhere does not."""
    from sysid.gains import delays

    deep = lambda at: lambda d: 0.01 + abs(d - at)  # noqa: E731
    shallow = lambda d: 1.0 + 0.5 * abs(d - 0.08)  # noqa: E731
    np.testing.assert_allclose(delays([deep(0.017), shallow, None]), 0.017, atol=1e-4)
    np.testing.assert_allclose(delays([deep(0.017), deep(0.019), deep(0.06)])[2], 0.06, atol=1e-4)
    assert delays([None]) == [0.0]
