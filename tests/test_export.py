"""Exported robots, loaded again by MuJoCo and Drake, against our own torque; what they leave out
and what that costs."""

import json
from dataclasses import replace
from importlib import import_module
from xml.etree import ElementTree

import numpy as np
import pytest

import sysid
from sysid import experiment_logs, inverse_dynamics, regressor, vocabulary
from sysid.errors import SysidError
from sysid.export import FORMATS, Check, document, isaaclab, mjcf
from sysid.export.cost import costs
from sysid.export.motors import Motor
from sysid.export.stated import stated
from sysid.inertia import pseudo
from sysid.inertia.consistency import is_consistent
from sysid.model import Model
from sysid.model_parameters import ROBOT
from sysid.robot_spec import RobotSpec
from sysid.run import Run
from sysid.specs import Experiment
from sysid.warned import noticed
from tests import robots, servos
from tests.test_inertia import random_bodies

pytest.importorskip("mujoco")
pytest.importorskip("pydrake")

EVERYWHERE = ["viscous", "encoder_offset"]
KNOWN = {
    "mjcf": ["coulomb", "armature", "spring", "quadratic_drag", "gravity_tilt", "payload"],
    "sdf": ["coulomb", "spring", "payload"],
    "drake": ["armature", "payload"],
    "isaaclab": ["coulomb", "armature", "payload"],
}


def built(machine, names, seed=0) -> tuple[Model, np.ndarray]:
    """A model of a robot with effects on every joint, and its parameters."""
    rng = np.random.default_rng(seed)
    terms, shapes, c = [], [], []
    for name in names:
        found = vocabulary.find(name)
        joints = (ROBOT,) if found.scope == "robot" else tuple(range(machine.dof))
        for joint in joints:
            found = found.bound(machine, joint)
            shapes += rng.uniform(0.1, 0.4, len(found.shapes())).tolist()
            body = 0.3 * random_bodies(1, seed=4)[0]
            c += (
                body if name == "payload" else rng.uniform(0.2, 2.0, len(found.coefficients()))
            ).tolist()
        terms.append((found, joints))
    pi = np.array(machine.prior)
    return Model(machine, tuple(terms), tuple(shapes)), np.concatenate([pi.ravel(), c])


def run_of(tmp_path, model: Model, x) -> Run:
    """A run folder's content, without the folder: its logs are nowhere."""
    tree = {
        "robot": {"urdf": "robot.urdf"},
        "data": {"train": [{"file": "no.csv"}], "test": [{"file": "no.csv"}]},
    }
    experiment = Experiment.model_validate({**tree, "path": tmp_path / "config.yaml"})
    return Run(tmp_path, experiment, model, x, {"rms": {"test": {}}, "parameters": []})


def of_simulator(to, found, model) -> np.ndarray:
    """Torque of the written files on 30 drawn samples."""
    form = import_module(f"sysid.export.{to}")
    said = stated(model[0], model[1], form.KNOWS, form.SHOWS)
    torque, _ = form.loaded({path.name: path for path in found.files}, said)
    return torque(*samples(model[0].robot))


def samples(machine):
    return np.random.default_rng(9).normal(size=(3, 30, machine.dof))


@pytest.mark.parametrize("to", FORMATS)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_tree_of_every_joint_comes_back(tmp_path, to, seed):
    """Revolute, continuous, prismatic and welded links, in another order, one locked; rotors of
    the base are exact."""
    rng = np.random.default_rng(seed)
    rotors = []
    if to != "sdf":  # which has no armature
        body = pseudo.cylinder(0.4, [0, 0, 0.01], 0.05, 0.03).tolist()
        rotors = [
            {
                "joint": "joint2",
                "ratio": -9.0,
                "on": "base",
                "xyz": [0.1, 0, 0],
                "axis": [0, 0, 1],
                "inertia": {"parameters": body},
            }
        ]
    order = ["joint3", "joint0", "joint2", "joint1"]
    machine = robots.load(
        tmp_path, robots.urdf(rng, links=5), joints=order, lock={"joint4": 0.3}, rotors=rotors
    )
    model = built(machine, [*EVERYWHERE, *KNOWN[to]], seed)
    found = sysid.export(run_of(tmp_path, *model), to, tmp_path / "out")
    assert [cost.what for cost in found.left_out] == ["rotors"] * bool(
        rotors
    ) and "no.csv" in found.notes[0]
    assert (
        found.check.agrees
        and found.check.samples == 500
        and max(found.check.difference.values()) < 1e-9
    )
    ours = inverse_dynamics.inverse_dynamics(*model)(*samples(machine))
    theirs = of_simulator(to, found, model)
    np.testing.assert_allclose(
        theirs / np.abs(ours).max(0), ours / np.abs(ours).max(0), rtol=0, atol=1e-9
    )


HEAVY = """<robot name="heavy"><link name="base"/>{links}
<joint name="first" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="second" type="revolute"><parent link="upper"/><child link="lower"/>
<origin xyz="0 0.1 0.5" rpy="1.2 0 0.3"/><axis xyz="0.6 0 0.8"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>"""
LINK = """<link name="{name}"><inertial><origin xyz="0.1 0 0.2"/><mass value="9"/>
<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def geared(
    tmp_path, *, moment: float, on: str, ratio: float, against: bool = False, transmission=()
):
    """Two links of a moment of inertia, and a balanced rotor of the second joint about that
    joint's axis."""
    text = HEAVY.format(
        links="".join(LINK.format(name=name, i=moment) for name in ("upper", "lower"))
    )
    turn = (
        {"xyz": [0, 0.1, 0.5], "rpy": [1.2, 0, 0.3]}
        if on == "upper"
        else {"xyz": [0.1, 0, 0], "rpy": [0, 0, 0]}
    )
    rotor = {
        "joint": "second",
        "ratio": ratio,
        "on": on,
        "axis": [-0.6, 0, -0.8] if against else [0.6, 0, 0.8],
        **turn,
    }
    axis = np.array(rotor["axis"])
    inertia = 2e-3 * np.eye(3) + 1e-3 * np.outer(axis, axis)
    rotor["inertia"] = {"parameters": pseudo.from_central(0.5, 0.02 * axis, inertia).tolist()}
    return robots.load(tmp_path, text, rotors=[rotor], transmission=dict(transmission))


@pytest.mark.parametrize("on", ["upper", "lower"])
@pytest.mark.parametrize(("ratio", "against"), [(30.0, False), (-30.0, False), (30.0, True)])
def test_a_rotor_along_its_joint_is_said_to_the_last_digit(tmp_path, on, ratio, against):
    machine = geared(tmp_path, moment=2.0, on=on, ratio=ratio, against=against)
    model = built(machine, [])
    said = stated(*model, frozenset({"armature", "inertia"}))
    expected = regressor.torque(machine, machine.prior, *samples(machine))
    np.testing.assert_allclose(
        said.torque(*samples(machine)), expected, atol=1e-12 * np.abs(expected).max()
    )
    found = sysid.export(run_of(tmp_path, *model), "mjcf", tmp_path / "out")
    assert is_consistent(said.links).all() and found.check.agrees


def test_a_rotor_of_light_links_is_an_armature(tmp_path):
    machine = geared(tmp_path, moment=0.01, on="upper", ratio=30.0)
    said = stated(*built(machine, []), frozenset({"armature", "inertia"}))
    assert is_consistent(said.links).all() and said.terms["armature"][1] == pytest.approx(
        900 * 3e-3
    )
    q, qd, qdd = samples(machine)
    expected = regressor.torque(machine, machine.prior, q, qd, qdd)
    qdd[:, 0], qd[:, 0] = 0.0, 0.0  # the carrier does not turn: nothing is lost
    assert np.abs(said.torque(*samples(machine)) - expected).max() > 0.01
    expected = regressor.torque(machine, machine.prior, q, qd, qdd)[:, 1]
    np.testing.assert_allclose(
        said.torque(q, qd, qdd)[:, 1], expected, atol=1e-12 * np.abs(expected).max()
    )


def test_a_rotor_of_two_joints_is_a_tendon_in_mujoco(tmp_path):
    """On the base, so that nothing is lost; Drake's URDF has no word for it."""
    text = HEAVY.format(links="".join(LINK.format(name=name, i=0.1) for name in ("upper", "lower")))
    body = pseudo.cylinder(0.4, [0, 0, 0], 0.05, 0.03).tolist()
    rotor = {
        "joint": "second",
        "ratio": 1.0,
        "on": "base",
        "axis": [0, 0, 1],
        "inertia": {"parameters": body},
    }
    machine = robots.load(
        tmp_path, text, rotors=[rotor], transmission={"second": {"first": 20.0, "second": -30.0}}
    )
    model = built(machine, ["viscous"])
    found = sysid.export(run_of(tmp_path, *model), "mjcf", tmp_path / "out")
    ours = inverse_dynamics.inverse_dynamics(*model)(*samples(machine))
    np.testing.assert_allclose(
        of_simulator("mjcf", found, model), ours, atol=1e-9 * np.abs(ours).max()
    )
    assert [cost.what for cost in found.left_out] == ["rotors"]
    assert sysid.export(run_of(tmp_path, *model), "drake", tmp_path / "out").check.agrees


def test_drake_keeps_the_rotor_of_a_joint_without_effort(tmp_path):
    text = HEAVY.format(links="".join(LINK.format(name=name, i=0.1) for name in ("upper", "lower")))
    machine = robots.load(tmp_path, text.replace('effort="9"', 'effort="0"'))
    model = built(machine, ["armature"])
    assert sysid.export(run_of(tmp_path, *model), "drake", tmp_path / "out").check.agrees


@pytest.fixture(scope="module")
def leg_run(tmp_path_factory):
    """The leg with a Stribeck bump that is not in its logs, and the run folder of its fit."""
    from tests.problems import ROOT

    experiment = sysid.load(ROOT / "configs" / "cheetah3.yaml")
    out = tmp_path_factory.mktemp("leg") / "run"
    return sysid.write(sysid.fit(experiment), out), out


@pytest.mark.parametrize("to", ["mjcf", "drake"])
def test_the_leg_on_its_test_log(leg_run, tmp_path, to):
    """The simulator's inverse dynamics and what is left out make up our torque on the test log."""
    _, run = leg_run
    found = sysid.export(run, to, tmp_path)
    assert (
        found.check.agrees
        and max(found.check.difference.values()) < 1e-9
        and found.check.samples == 5000
    )
    left = {(cost.what, cost.joint): cost.torque for cost in found.left_out}
    if to == "drake":
        values = {
            p["name"]: p["value"] for p in json.loads((run / "fit.json").read_text())["parameters"]
        }
        assert left["coulomb", "hip"]["hip"] == pytest.approx(values["coulomb.hip.Fc"], rel=1e-3)
        assert left["coulomb", "hip"]["abad"] == 0.0
    # a rotor of the base and its coupling cost least; whatever is left is less than what the
    # armature says
    assert 0.0 < left["rotors", "*"]["abad"] < 0.1 < left["rotors", "*"]["hip"] < 1.0
    assert all(
        found.together[joint] >= 0.9 * left["rotors", "*"][joint] for joint in found.together
    )
    text = found.files[0].read_text()
    assert "rotors: abad 0.01" in text and text.count("<!--") == 1


def test_costs_are_the_torque_of_each_effect(leg_run):
    from sysid.preprocess import prepare

    _, folder = leg_run
    run = sysid.read_run(folder)
    model = run.model.with_effect(vocabulary.find("stribeck"), (1,)).with_effect(
        vocabulary.find("delay"), (2,)
    )
    model = model.with_shapes([0.5, 0.004])
    x = np.append(run.x, 2.0)
    said = stated(model, x, frozenset({"damping", "friction", "armature", "inertia"}))
    assert said.unsaid == (("stribeck", 1), ("delay", 2))
    spec = run.experiment
    motion = prepare(experiment_logs.read(spec, model.robot, spec.data.test), spec.preprocess, run.joints)
    found, together = costs(model, x, said, motion)
    own = {cost.what: cost.torque for cost in found}
    qd = np.concatenate([piece.qd[piece.core] for piece in motion.pieces])[:, 1]
    bump = 2.0 * np.exp(-((qd / 0.5) ** 2)) * np.sign(qd)
    assert own["stribeck"] == pytest.approx(
        {"abad": 0.0, "hip": np.sqrt(np.mean(bump**2)), "knee": 0.0}
    )
    assert own["delay"]["knee"] > 0.01 and own["delay"]["hip"] == 0.0
    assert together["hip"] == pytest.approx(
        np.hypot(own["stribeck"]["hip"], own["rotors"]["hip"]), rel=0.2
    )
    # in Isaac Lab the bump is what starts the joint
    begin = stated(model, x, isaaclab.KNOWS, isaaclab.SHOWS)
    assert begin.terms["breakaway"][1] == 2.0 and ("stribeck", 1) in begin.unsaid


def test_impossible_bodies_are_named(leg_run, tmp_path):
    run = sysid.read_run(leg_run[1])
    x = np.array(run.x)
    x[14] = 10.0  # thigh.Ixx: the triangle of its moments does not close
    for to in FORMATS:
        found = sysid.export(replace(run, x=x), to, tmp_path)
        assert found.check.agrees is False and "thigh" in found.notes[0]


def test_isaac_lab_s_file_is_python_of_its_classes(leg_run, tmp_path):
    found = sysid.export(leg_run[1], "isaaclab", tmp_path)
    source = (tmp_path / "actuators.py").read_text()

    class ImplicitActuatorCfg(dict):
        pass

    known = {"ImplicitActuatorCfg": ImplicitActuatorCfg}
    exec(source.replace("from isaaclab.actuators import ImplicitActuatorCfg", ""), known)
    group = known["ACTUATORS"]["identified"]
    assert (
        group == isaaclab.read(source) and group["stiffness"] is None and group["damping"] is None
    )
    assert (
        group["friction"] == group["dynamic_friction"] and group["effort_limit_sim"]["hip"] == 230.0
    )
    assert found.check.agrees and "Isaac Lab itself was not asked" in found.check.by
    assert "yourdfpy" in found.check.by


def test_a_second_reader_has_to_find_the_same_bodies(leg_run, tmp_path):
    sysid.export(leg_run[1], "isaaclab", tmp_path)
    run = sysid.read_run(leg_run[1])
    said = stated(run.model, run.x, isaaclab.KNOWS, isaaclab.SHOWS)
    written = {name: tmp_path / name for name in ("robot.urdf", "actuators.py")}
    isaaclab.loaded(written, said)
    other = said.links.copy()
    other[1, 0] *= 1.001
    with pytest.raises(RuntimeError, match="yourdfpy reads another body of thigh"):
        isaaclab.loaded(written, replace(said, links=other))


@pytest.fixture(scope="module")
def servo_run(tmp_path_factory):
    """Two servos, one damped by its drive; nothing but commands and angles is logged."""
    folder = tmp_path_factory.mktemp("servos")
    text = """
model: {effects: [viscous, coulomb, armature]}
actuator:
  joint_1: {command: cmd_joint_1, kp: 26.0, kd: 0.3, delay: free}
  joint_2: {command: cmd_joint_2, kp: free}
"""
    servos.write(folder, 11, 2, text, seconds=4.0)
    sysid.write(sysid.fit(sysid.load(folder)), folder / "run")
    return folder / "run"


def test_servos_come_out_as_servos(servo_run, tmp_path):
    """MuJoCo's force is kp (command - q) - kd qd, and Isaac Lab's gains are the same."""
    import mujoco

    found, run = sysid.export(servo_run, "mjcf", tmp_path), sysid.read_run(servo_run)
    assert found.check.agrees and found.left_out == () and run.omitted == ()
    text = (tmp_path / "robot.xml").read_text()
    assert "Servo of joint_1: its command acts 0.01" in text
    drives = {(d["joint"], d["name"]): d["value"] for d in run.document["drives"]}
    kp, kd = np.array([26.0, drives["joint_2", "kp"]]), np.array([0.3, 0.0])
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    asked, felt, at = [], [], []
    for k in range(40):  # a ramp, as the joints begin to move
        data.ctrl[:] = [0.3 + 0.01 * k, 0.1]
        asked.append(np.array(data.ctrl))
        at.append((np.array(data.qpos), np.array(data.qvel)))
        mujoco.mj_step(model, data)
        felt.append(np.array(data.actuator_force))
    late = drives["joint_1", "delay"] / model.opt.timestep
    before = asked[30][0] - 0.01 * late
    q, qd = at[30]
    expected = kp * (np.array([before, 0.1]) - q) - kd * qd
    np.testing.assert_allclose(felt[30], expected, rtol=1e-9)
    sysid.export(servo_run, "isaaclab", tmp_path)
    group = isaaclab.read((tmp_path / "actuators.py").read_text())
    assert group["stiffness"] == {"joint_1": 26.0, "joint_2": pytest.approx(kp[1])}
    assert group["damping"] == {"joint_1": 0.3, "joint_2": 0.0}
    # torque is what the joint needs, without its drive's damping
    q, qd, qdd = np.zeros((3, 2))
    qd[:] = 1.0
    values = {p["name"]: p["value"] for p in run.document["parameters"]}
    change = run.torque(q, qd, qdd) - run.torque(q, 0.5 * qd, qdd)
    bodies = regressor.torque(
        run.model.robot,
        run.x[:20].reshape(-1, 10),
        *(np.array([q] * 2), np.array([qd, 0.5 * qd]), np.zeros((2, 2))),
    )
    assert change[0] - (bodies[0] - bodies[1])[0] == pytest.approx(
        0.5 * values["viscous.joint_1.Fv"]
    )


def test_exported_servos_follow_the_test_log(servo_run, tmp_path):
    """Let go in MuJoCo with nothing but the logged commands; the log was written by MuJoCo too."""
    import mujoco

    sysid.export(servo_run, "mjcf", tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    log = np.genfromtxt(servo_run.parent / "test.csv", delimiter=",", names=True)
    q, asked = (
        np.column_stack([log[f"{kind}_joint_{k}"] for k in (1, 2)]) for kind in ("q", "cmd")
    )
    model.opt.timestep, model.opt.integrator = 5e-4, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.dof_solref[:, 0] = 2.0 * model.opt.timestep  # friction as stiff as the step allows
    data, found = mujoco.MjData(model), []
    data.qpos[:] = q[0]
    for command in asked:
        found.append(np.array(data.qpos))
        data.ctrl[:] = command
        mujoco.mj_step(model, data, 4)
    missed = np.sqrt(np.mean((np.array(found) - q) ** 2, axis=0))
    assert (missed < 0.01 * np.ptp(q, axis=0)).all()


def test_a_dc_motor_is_driven_by_its_voltage(leg_run, tmp_path):
    import mujoco

    run = sysid.read_run(leg_run[1])
    said = stated(run.model, run.x, mjcf.KNOWS)
    drive = {"hip": Motor("hip", False, gain=0.8, damping=0.3, delay=0.0)}
    (content,) = mjcf.files(replace(said, motors=drive), "", tmp_path).values()
    data = mujoco.MjData(model := mujoco.MjModel.from_xml_string(content.decode()))
    data.qvel[1], data.ctrl[:] = 2.0, [1.0, 5.0, 3.0]
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.actuator_force, [1.0, 0.8 * 5.0 - 0.3 * 2.0, 3.0])


@pytest.mark.study
def test_every_example_robot_comes_back(tmp_path):
    """All robots of example-robot-data that have at most 40 joints and a base that stands."""
    from sysid import robot, urdf_files

    root, count = urdf_files.example_root(), 0
    for path in sorted(root.rglob("*.urdf")):
        try:
            with noticed():
                machine = robot.load(
                    RobotSpec(urdf=f"example-robot-data://{path.relative_to(root)}")
                )
        except SysidError:
            continue
        if machine.dof <= 40:
            model = built(machine, ["viscous", "coulomb", "armature"])
            for to in FORMATS:
                found = sysid.export(run_of(tmp_path, *model), to, tmp_path / to)
                assert found.check.agrees, f"{path.name}: {found}"
            count += 1
    assert count > 50


def test_the_command(leg_run, tmp_path, cli):
    said = cli("export", leg_run[1], "--to", "mjcf", "--json", out=tmp_path)
    told = json.loads(said.out)
    assert (
        said.status == 0
        and told["checked"]["agrees"]
        and told["files"] == [str(tmp_path / "robot.xml")]
    )
    assert (
        set(told["left_out"][0]) == {"what", "joint", "torque_rms"}
        and told["left_out_torque_rms"]["hip"] > 0
    )
    said = cli("export", leg_run[1], "--to", "mjcf")
    assert said.status == 0 and "within" in said.out and "rotors: abad" in said.out
    for words in (
        ("export", leg_run[1], "--to", "usd"),
        ("export", tmp_path / "nothing", "--to", "sdf"),
    ):
        said = cli(*words)
        assert said.status == 2 and said.err.count("\n") == 1 and "allowed" in said.err


def test_a_simulator_that_is_missing_or_disagrees(leg_run, tmp_path, cli, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "mujoco", None)
    said = cli("export", leg_run[1], "--to", "mjcf", out=tmp_path)
    assert (
        said.status == 0 and "not checked: mujoco is not installed, pip install mujoco" in said.out
    )
    assert (tmp_path / "robot.xml").is_file()
    monkeypatch.undo()
    real = mjcf.files
    monkeypatch.setattr(
        mjcf,
        "files",
        lambda *a: {"robot.xml": real(*a)["robot.xml"].replace(b'mass="', b'mass="1')},
    )
    said = cli("export", leg_run[1], "--to", "mjcf", out=tmp_path)
    assert said.status == 1 and "NOT THE SAME" in said.out
    monkeypatch.setattr(mjcf, "files", lambda *a: {"robot.xml": b"<mujoco><worldbody><body/>"})
    said = cli("export", leg_run[1], "--to", "mjcf", out=tmp_path)
    assert said.status == 1 and "mujoco refuses it" in said.out
    assert not Check("x", 1, {"a": float("nan")}, None).agrees


def test_a_fit_is_exported_as_its_run_folder_is(experiment, tmp_path):
    folder = experiment(config={"robot.lock": {}, "preprocess.window": "auto"})
    fit = sysid.fit(sysid.load(folder))
    sysid.write(fit, tmp_path / "run")
    one, two = (sysid.export(what, "mjcf", tmp_path / "out") for what in (fit, tmp_path / "run"))
    assert one.check.agrees and two.check.agrees and one.check.samples == two.check.samples
    assert one.together == pytest.approx(two.together, rel=1e-6)


def test_document_is_strict_json(leg_run, tmp_path):
    found = sysid.export(leg_run[1], "sdf", tmp_path)
    json.dumps(document(found), allow_nan=False)
    assert len(repr(found)) < 300
    names = [
        joint.get("name")
        for joint in ElementTree.parse(tmp_path / "robot.sdf").getroot().iter("joint")
    ]
    assert "abad_joint" in names  # a link is called abad
