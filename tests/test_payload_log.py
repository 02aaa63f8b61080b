"""A load that one of several training logs carries is named with that log, and `add` takes the command as it is printed."""

import json
import shlex
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from scripts.blind_parts.robots import PLANAR
from sysid import carriers, experiment_file, loads, loop, pipeline, regressor, results, robot
from sysid.candidates import Candidate, made, together
from sysid.changes import changed
from sysid.diagnose.diagnosis import diagnose
from sysid.effects.payload import Payload
from sysid.inertia.pseudo import rotational_inertia, sphere
from sysid.robot_spec import RobotSpec
from sysid.statement.changes import document as changes_document
from sysid.statement.changes import named
from sysid.statement.document import document
from sysid.view import allowed, first_view
from sysid.vocabulary import find
from tests.conftest import csv
from tests.problems import arm
from tests.test_lowpass import smooth


@pytest.fixture(scope="module")
def loaded(simulated):
    """Logs of an arm that holds a load."""
    return simulated("holds a load", "payload:*", seed=6, duration=10.0)


@pytest.fixture(scope="module")
def folder(simulated, loaded, tmp_path_factory):
    """Two training logs of one arm, in the second of which it holds a load."""
    plain = simulated("holds none", seed=6, duration=10.0)
    out = tmp_path_factory.mktemp("carried") / "case"
    shutil.copytree(plain, out)
    shutil.copy(loaded / "train.csv", out / "loaded.csv")
    text = (out / "config.yaml").read_text()
    assert "train: [train.csv]" in text
    (out / "config.yaml").write_text(text.replace("train: [train.csv]", "train: [train.csv, loaded.csv]"))
    return out


@pytest.mark.long
def test_a_load_in_one_log_is_named_with_it(folder, loaded):
    found = document(diagnose(pipeline.load(folder)))
    heads = [f for f in found["findings"] if f["joins_as_step"] is not None]
    assert [(f["effect"], f["joint"], f["options"]) for f in heads] == [("payload", "*", {"logs": ("loaded.csv",)})]
    assert {v["status"] for v in found["verdict"]} == {"missing"} and {v["effect"] for v in found["verdict"]} == {"payload"}
    words = shlex.split(heads[0]["command"])
    assert words[-2:] == ["--option", 'logs=["loaded.csv"]']
    added = loop.add(folder, "payload", None, {"logs": ["loaded.csv"]}, out=folder / "runs")
    assert not added.refused and "loaded.csv" in experiment_file.read(folder / "config.yaml").decode()
    (before,) = (p["value"] for name, p in heads[0]["parameters"].items() if name.endswith(".m"))
    (mass,) = (value for name, value in added.after.parameters_of("payload", -1).items() if name.endswith(".m"))
    assert abs(mass[0] - before) < 2.0 * mass[1]
    truth = json.loads((loaded / "truth.json").read_text())["hidden"][0]["values"]["m"]
    assert abs(mass[0] - truth) < 3.0 * mass[1]


@pytest.mark.long
def test_a_load_that_a_test_log_carries_too_is_named_with_both(simulated, loaded, tmp_path):
    """Two of three training logs with it, and the test log: without that its error would rise, and the load be refused. The shorter log is
    of an arm with a tenth less friction on the elbow, as friction is drawn by how it moves, which may be told as well."""
    out = tmp_path / "case"
    shutil.copytree(simulated("holds none", seed=6, duration=10.0), out)
    for k, seed in enumerate((7, 8)):
        shutil.copy(simulated(f"holds a load {seed}", "payload:*", seed=6, duration=10.0 - k) / "train.csv", out / f"loaded_{k}.csv")
    shutil.copy(loaded / "test.csv", out / "test.csv")
    text = (out / "config.yaml").read_text()
    (out / "config.yaml").write_text(text.replace("train: [train.csv]", "train: [loaded_0.csv, train.csv, loaded_1.csv]"))
    found = document(diagnose(pipeline.load(out)))
    heads = [f for f in found["findings"] if f["joins_as_step"] is not None]
    logs = ["loaded_0.csv", "loaded_1.csv", "test.csv"]
    assert (heads[0]["effect"], sorted(heads[0]["options"]["logs"])) == ("payload", logs)
    assert {(f["effect"], f["joint"], *f["options"]["logs"]) for f in heads[1:]} <= {("friction_change", "elbow", "loaded_1.csv")}
    assert shlex.split(heads[0]["command"])[-1] == f"logs={json.dumps(logs)}"
    for joint in found["joints"].values():
        assert joint["status"] == "missing" and joint["rms"]["test"] > 1.2 * joint["noise_floor"]
    added = loop.add(out, "payload", None, {"logs": logs}, out=out / "runs")
    assert not added.refused
    for joint, own in found["joints"].items():
        assert added.after.rms("test")[joint] < 1.1 * own["noise_floor"] + 2.0 * own["noise_floor_se"]


@pytest.mark.long
def test_test_logs_that_are_parts_of_training_logs_are_no_others(folder, tmp_path):
    """No other log can be said to carry it; where the load is, is known."""
    out = shutil.copytree(folder, tmp_path / "case")
    text = (folder.parent / "case" / "config.yaml").read_text()
    train = "train: [train.csv, {file: loaded.csv, start: 0, stop: 6}]"
    text = text[: text.index("  train:")] + f"  {train}\n" + text[text.index("  test:") :]
    (out / "config.yaml").write_text(text.replace("test: [test.csv]", "test: [{file: loaded.csv, start: 6}]").replace("  - payload", "  # - payload"))
    experiment = pipeline.load(out)
    if any(effect.name == "payload" for effect in experiment.model.effects):
        loop_free = [effect for effect in experiment.model.effects if effect.name != "payload"]
        experiment = experiment.model_copy(update={"model": experiment.model.model_copy(update={"effects": loop_free})})
    heads = [f for f in document(diagnose(experiment))["findings"] if f["joins_as_step"] is not None]
    assert [(f["effect"], f["options"]) for f in heads] == [("payload", {"logs": ("loaded.csv",)})]


def test_which_logs_are_tried():
    effect = Payload()
    assert effect.among(["a"]) == [] and effect.among([str(k) for k in range(9)]) == []
    assert effect.among(["a", "b"]) == [{"logs": ["a"]}, {"logs": ["b"]}]
    assert effect.among(["a", "b", "c"])[3:] == [{"logs": ["a", "b"]}, {"logs": ["a", "c"]}, {"logs": ["b", "c"]}]
    assert len(effect.among(list("abcd"))) == 14 and {"logs": ["b", "d"]} in effect.among(list("abcd"))
    assert [one["logs"] for one in effect.among(list("abcde"))] == [[log] for log in "abcde"]


@pytest.mark.parametrize(("mass", "may"), [(0.7, True), (-0.7, False), (-0.01, True)])
def test_the_logs_without_a_load_do_not_carry_its_negative(mass, may):
    """Some logs with a load and all others without it make the same columns, as bodies are free; noise alone may make a mass negative."""
    rng = np.random.default_rng(2)
    coefficients = [SimpleNamespace(effect="payload", joint=-1, positive=False, of_body=True) for _ in range(10)]
    model = SimpleNamespace(bodies=0, coefficients=coefficients, shape_values=(), shapes=(), terms=())
    sums = SimpleNamespace(scores=0.02 * rng.normal(size=(20, 10)))
    x = np.append(mass, rng.normal(size=9))
    view = SimpleNamespace(model=model, x=x, sums=sums, design=SimpleNamespace(turn=np.eye(10)))
    assert allowed(view, Candidate(Payload(), -1, ())) is may


def test_a_load_is_looked_for_as_a_body_that_can_be():
    """Its mass and where it is, where moments of inertia are none of a body; else as it is."""
    ball = sphere(0.8, [0.0, 0.02, 0.1], 0.05)
    np.testing.assert_array_equal(carriers._possible(ball), ball)
    wrong = ball - np.array([0.0] * 4 + [0.5, 0.5, 0.5, 0.0, 0.0, 0.0])
    found = carriers._possible(wrong)
    np.testing.assert_allclose(found[:4], ball[:4])
    np.testing.assert_allclose(rotational_inertia(found), 0.8 * np.array([[0.0104, 0.0, 0.0], [0.0, 0.01, -0.002], [0.0, -0.002, 0.0004]]), atol=1e-12)


def test_logs_that_have_most_of_it_are_asked_together():
    """Of five logs each is asked alone; then the two with most of it, three, and four."""
    robot, masses = arm()[1].robot, {"a": 0.1, "b": 0.7, "c": -0.2, "d": 0.8, "e": 0.6}
    group = lambda logs, mass: SimpleNamespace(candidate=made(Payload(), -1, {"logs": list(logs)}, robot), coefficients=[mass, 9.0], sizes=[1.0, 1.0])  # noqa: E731
    asked = [group(log, mass) for log, mass in masses.items()]
    other = SimpleNamespace(candidate=made(find("gravity_tilt"), -1, {}, robot), coefficients=[5.0], sizes=[1.0])
    assert [dict(one.options)["logs"] for one in together([*asked, other], robot)] == [("b", "d"), ("b", "d", "e"), ("a", "b", "d", "e")]
    # of few all were asked already
    assert together([group("a", 1.0), group("b", 2.0), group("c", 2.0), group("ab", 2.0)], robot) == [] == together([other], robot)


LEFT = np.array([0.8, 0.8 * 0.3, 0.0, 0.0, 0.002, 0.8 * 0.3**2 + 0.003, 0.8 * 0.3**2 + 0.003, 0.0, 0.0, 0.0])  # of the fore link's frame


def two_armed_log(planar, path, seed: int, load, ends: tuple[float, float]) -> None:
    """12 s of two planar arms, of which the left one holds a load between two times."""
    t, columns = np.arange(3000) / 250.0, {}
    for number, side in enumerate("lr"):
        q, qd, qdd = smooth(t, 10 * seed + number, 1.2)
        held = ((t >= ends[0]) & (t < ends[1]) & (side == "l"))[:, None]
        bodies = [np.array(planar.prior), np.array(planar.prior)]
        bodies[1][-1] += load
        empty, full = (regressor.torque(planar, pi, q, qd, qdd) for pi in bodies)
        tau = np.where(held, full, empty) + 0.3 * qd + 0.4 * np.sign(qd) + np.random.default_rng(seed).normal(0.0, 0.1, q.shape)
        for j, joint in enumerate(("shoulder", "elbow")):
            columns |= {f"q_{side}_{joint}": q[:, j], f"tau_{side}_{joint}": tau[:, j]}
    path.write_text(csv({"t": t} | columns))


@pytest.fixture(scope="module")
def two_arms(tmp_path_factory, planar):
    """Three logs of two planar arms on one base; in the second and the third the left one, which is not last in the URDF, holds a
    load."""
    folder = tmp_path_factory.mktemp("two_arms")
    both, joints = PLANAR.replace("</robot>", ""), []
    for side in ("l", "r"):
        own = PLANAR[PLANAR.index(' <link name="upper"') : PLANAR.index("</robot>")]
        for name in ("upper", "fore", "shoulder", "elbow"):
            own = own.replace(f'"{name}"', f'"{side}_{name}"')
        both = both[: both.index(' <link name="upper"')] + own if side == "l" else both + own
        joints += [f"{side}_shoulder", f"{side}_elbow"]
    (folder / "robot.urdf").write_text(both + "</robot>\n")
    (folder / "config.yaml").write_text(
        "robot: {urdf: robot.urdf}\ndata: {train: [one.csv, two.csv], test: [three.csv]}\nmodel: {effects: [viscous, coulomb]}\n"
    )
    for seed, (log, ends) in enumerate({"one": (0.0, 0.0), "two": (0.0, 99.0), "three": (0.0, 99.0)}.items()):
        two_armed_log(planar, folder / f"{log}.csv", seed, LEFT, ends)
    return folder


def test_a_gripper_s_load_is_asked_on_its_palm_too(tmp_path):
    """Beside its fingers, which the palm carries; not on the links of the arm behind it."""
    link = '<link name="{0}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    joint = '<joint name="{1}_{2}" type="{0}"><parent link="{1}"/><child link="{2}"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    links = "".join(link.format(name) for name in ("base", "arm", "palm", "left", "right"))
    joints = [("revolute", "base", "arm"), ("revolute", "arm", "palm"), ("prismatic", "palm", "left"), ("prismatic", "palm", "right")]
    (tmp_path / "robot.urdf").write_text(f'<robot name="hand">{links}{"".join(joint.format(*own) for own in joints)}</robot>')
    places = find("payload").places(robot.load(RobotSpec(urdf=str(tmp_path / "robot.urdf"))))
    assert places[0] == {} and sorted(own["link"] for own in places[1:]) == ["left", "palm"]


def test_a_load_in_another_hand_than_the_last_is_named_with_its_link(two_arms):
    said = document(diagnose(pipeline.load(two_arms)))
    (found,) = [f for f in said["findings"] if f["joins_as_step"] is not None]
    assert (found["effect"], found["options"]["link"]) == ("payload", "l_fore") and "two.csv" in found["options"]["logs"]
    assert "--option link=l_fore" in found["command"]
    assert {v["joint"]: v["status"] for v in said["verdict"]} == {
        "l_shoulder": "missing",
        "l_elbow": "missing",
        "r_shoulder": "complete",
        "r_elbow": "complete",
    }


def test_a_load_that_came_into_another_hand_is_what_changed(two_arms, tmp_path):
    """Against the model of a log without it: with its link, and no bias that stood for it before it joined."""
    config = two_arms / "before.yaml"
    config.write_text((two_arms / "config.yaml").read_text().replace("one.csv, two.csv", "one.csv"))
    experiment = pipeline.load(config)
    results.write(pipeline.fit(experiment), tmp_path / "run")
    said = changes_document(changed(experiment, tmp_path / "run", [str(two_arms / "two.csv")]))
    (found,) = said["findings"]
    mass = found["parameters"]["payload.*.m"]
    assert (found["effect"], found["options"]) == ("payload", {"link": "l_fore"}) and abs(mass["value"] - 0.8) < 3.0 * mass["std"] + 0.01
    assert named(found) == "payload on *, link l_fore"
    untouched = [said["joints"][joint]["rms"] for joint in ("r_shoulder", "r_elbow")]
    assert all(rms["after"] == pytest.approx(rms["held"], rel=0.02) for rms in untouched)


def test_loads_of_another_hand_that_differ_from_log_to_log_name_its_link(two_arms, planar, tmp_path):
    """Nothing, 0.8 kg and 1.6 kg in the left hand: levels of a group, of a payload on that link."""
    for seed, (log, times) in enumerate((("first", 0.0), ("second", 1.0), ("third", 2.0))):
        two_armed_log(planar, tmp_path / f"{log}.csv", 20 + seed, times * LEFT, (0.0, 99.0))
    shutil.copy(two_arms / "robot.urdf", tmp_path)
    text = "robot: {urdf: robot.urdf}\ndata: {train: [first.csv, second.csv, third.csv], test: [first.csv]}\nmodel: {effects: [viscous, coulomb]}\n"
    (tmp_path / "config.yaml").write_text(text)
    experiment = pipeline.started(pipeline.load(tmp_path))
    view = first_view(experiment, pipeline.fit(experiment))
    found = loads.loads(view)
    assert found.options == {"link": "l_fore"} and found.masses == pytest.approx({"first.csv": 0.0, "second.csv": 0.8, "third.csv": 1.6}, abs=0.05)
    (said,) = loads.told(view)
    assert said.startswith("the load on l_fore is another from log to log") and '`{payload: {link: "l_fore", per: load, except: [load_0]}}`' in said
