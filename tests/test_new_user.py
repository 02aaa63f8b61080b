"""What stopped a reader on the way from a log to an added effect stays mended."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import yaml

import sysid
from sysid import check, config, pipeline
from sysid import cli as commands
from sysid.check.faults import masses
from sysid.check.look import looked
from sysid.cli import command_line
from sysid.errors import meant
from sysid.statement import faults, sizes
from sysid.terminal import fitted, steps
from tests.conftest import JOINTS, csv

BOTH = ("shoulder", "elbow")




@pytest.mark.parametrize("kind", [str, Path])
@pytest.mark.parametrize("name", ["fit", "diagnose", "check", "design", "predict", "write", "compare"])
def test_a_path_in_the_place_of_an_experiment_says_what_to_hand_over(tmp_path, kind, name):
    path = kind(tmp_path / "config.yaml")
    others = {"predict": ["log.csv"], "write": [tmp_path / "run"], "compare": [path]}.get(name, [])
    with pytest.raises(sysid.SysidError) as said:
        getattr(sysid, name)(path, *others)
    made = f"sysid.load({str(path)!r})"
    made = made if name in ("fit", "diagnose", "check", "design") else f"sysid.fit({made})"
    assert f"sysid.{name} is handed a path" in str(said.value)
    assert str(said.value).endswith(f"hand it {made}") and not list(tmp_path.iterdir())


def test_a_path_by_keyword_and_as_the_fit_of_a_diagnosis():
    for call in (lambda: sysid.fit(experiment="a.yaml"), lambda: sysid.diagnose(None, fit="runs/a")):
        with pytest.raises(sysid.SysidError, match="is handed a path"):
            call()


def test_a_folder_alone_becomes_the_experiment(experiment, cli):
    """`sysid init FOLDER`: config.yaml stands beside the robot and its logs, with paths from there."""
    folder = experiment(config=None)
    said = cli("init", folder, out=folder)
    assert said.status == 0, said.err
    made = pipeline.load(folder)
    assert made.robot.urdf == "robot.urdf"
    assert [log.file for log in (*made.data.train, *made.data.test)] == ["train.csv", "test.csv"]
    assert said.out.splitlines()[-1] == f"next: sysid check {folder}"
    assert pipeline.fit(made).solution.converged


def test_the_robot_may_stand_behind_its_logs(experiment, cli):
    folder = experiment(config=None)
    said = cli("init", folder / "train.csv", folder / "robot.urdf", out=folder / "mine")
    assert said.status == 0 and pipeline.load(folder / "mine").robot.urdf == "../robot.urdf"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["robot.urdf"], ["no logs are named", "`sysid init", "LOG..."]),
        (["rboot.urdf"], ["there is no such file", "did you mean robot.urdf?"]),
        (["train.csv"], ["a log, and no robot", "`sysid init robot.urdf "]),
        (["robot.urdf", "trian.csv"], ["there is no such log", "did you mean train.csv?"]),
        (["train.csv", "test.csv"], ["no robot", "`sysid init robot.urdf"]),
    ],
)
def test_init_says_what_to_type(experiment, cli, words, told):
    folder = experiment(config=None)
    cli("init", *(folder / word for word in words), out=folder / "mine").complains(*told)


def test_a_folder_with_two_robots_names_them(experiment, cli):
    folder = experiment(config=None)
    (folder / "old.urdf").write_text("<robot/>")
    cli("init", folder, out=folder / "mine").complains("2 robot files in one folder", "old.urdf", "robot.urdf")


def with_units(columns, position):
    header, *rows = csv(columns).splitlines()
    units = ["s" if name == "t" else position if name.startswith("q_") else "Nm" for name in header.split(",")]
    return "\n".join([header, ",".join(units), *rows]) + "\n"


def test_a_row_of_units_is_read(experiment, cli):
    plain = pipeline.fit(pipeline.load(experiment(name="plain")))
    folder = experiment(train=lambda c: with_units(c, "rad"), test=lambda c: with_units(c, "rad"))
    assert pipeline.fit(pipeline.load(folder)).x == pytest.approx(plain.x, rel=1e-12)
    (folder / "config.yaml").unlink()
    turned = lambda c: with_units({k: np.rad2deg(v) if k.startswith("q_") else v for k, v in c.items()}, "[deg]")
    own = experiment(config=None, train=turned, test=turned, name="degrees")
    assert cli("init", own, out=own).status == 0
    assert pipeline.load(own).data.units.position == "deg"


def test_units_that_disagree_are_refused(experiment, cli):
    given = {"data.units": {"position": "rad"}}
    folder = experiment(train=lambda c: with_units(c, "deg"), test=lambda c: with_units(c, "deg"))
    cli("fit", folder).complains("says deg", "data.units.position")
    told = experiment(config=given, train=lambda c: with_units(c, "deg"), name="told")
    assert any("says deg" in notice for notice in pipeline.fit(pipeline.load(told)).notices)


def test_a_row_of_text_is_no_row_of_units(experiment, cli):
    rows = lambda c: csv(c).replace("\n", "\nfirst,second,third,fourth,fifth\n", 1)
    cli("fit", experiment(train=rows)).complains("line 2", "'first' is no number")


def test_the_cure_of_a_sign_can_be_typed(experiment):
    """What `check` writes for a turned torque, in the experiment, and nothing is found any more."""
    turned = lambda c: c | {"tau_elbow": -c["tau_elbow"]}
    found = check.check(pipeline.load(experiment(train=turned, test=turned)))
    (fault,) = [f for f in found if f.fault == "sign_flipped"]
    cure = "write data.torque: {elbow: {tau_elbow: -1}}"
    assert fault.do.startswith(cure)
    mended = {"data.torque": {"elbow": {"tau_elbow": -1}}}
    found = check.check(pipeline.load(experiment(config=mended, train=turned, test=turned, name="mended")))
    assert not [f for f in found if f.severity == "error"]


def test_the_cure_of_two_signs_holds_both(experiment):
    """An entry in a file replaces the one before it: whichever line is typed says all."""
    turned = lambda c: c | {name: -c[name] for name in ("tau_shoulder", "tau_elbow")}
    found = check.check(pipeline.load(experiment(train=turned, test=turned)))
    both = {"shoulder": {"tau_shoulder": -1}, "elbow": {"tau_elbow": -1}}
    for fault in (own := [f for f in found if f.fault == "sign_flipped"]):
        written = re.fullmatch(r"write data\.torque: (\{.*\}); or take it as it is.*", fault.do)[1]
        assert yaml.safe_load(written) == both
    assert {f.joint for f in own} == set(BOTH)
    mended = experiment(config={"data.torque": both}, train=turned, test=turned, name="mended")
    assert not [f for f in check.check(pipeline.load(mended)) if f.severity == "error"]


def test_exchanged_columns_are_told_once_with_the_list_to_write(experiment):
    swapped = lambda c: c | {"tau_elbow": c["tau_shoulder"], "tau_shoulder": c["tau_elbow"]}
    found = check.check(pipeline.load(experiment(train=swapped, test=swapped)))
    own = [f for f in found if f.fault == "joint_order"]
    assert len({f.says for f in own}) == 1 and {f.joint for f in own} == set(BOTH)
    assert own[0].do.startswith("write data.columns.torque: [tau_elbow, tau_shoulder]")


def fault(joint, log, rows=1, **more):
    told = {"fault": "spikes", "severity": "warning", "joint": joint, "log": log, "times": [], "rows": rows}
    return told | {"says": f"{joint} in {log}: {rows}", "do": "nothing"} | more


def test_many_places_of_one_fault_are_counted():
    document = {"ok": True, "faults": [fault(f"j{j}", f"{log}.csv", 10 * j + log) for j in range(3) for log in range(4)]}
    lines = faults.lines(document, 80)
    assert lines[1] == "  j2 in 3.csv: 23"
    assert lines[2] == "  12 such in all: j0 in 4 logs, j1 in 4 logs, j2 in 4 logs"
    assert lines[-1] == "1 kind of warning, no error: these logs can be fitted" and len(lines) == 5
    few = {"ok": True, "faults": document["faults"][:2]}
    assert [line.strip() for line in faults.lines(few, 80)[1:3]] == ["j0 in 0.csv: 0", "j0 in 1.csv: 1"]


@pytest.mark.parametrize(
    ("word", "known", "told"),
    [
        ("elbow", ["elbow_joint", "wrist_joint"], "did you mean elbow_joint?"),
        ("Stribeck", ["stribeck", "spring"], "did you mean stribeck?"),
        ("wrist", ["wrist_1_joint", "wrist_2_joint"], "otherwise"),  # two hold it: which?
        ("xyz", ["stribeck"], "otherwise"),
    ],
)
def test_what_was_meant(word, known, told):
    assert meant(word, known, "otherwise") == told


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("data:\n\ttrain: [a.csv]\n", "put spaces in the place of the tab"),
        ("data:\n  train: [a.csv]\n test: [b.csv]\n", "bring the line to the column of its neighbours"),
        ("model:\n  effects: [viscous, coulomb\n", "close the bracket"),
    ],
)
def test_what_is_no_yaml_has_a_cure(text, told, tmp_path):
    with pytest.raises(config.ConfigError, match=told):
        config.loads(text, tmp_path / "config.yaml")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["fit"], ["which experiment?", "as in `sysid fit experiment`"]),
        (["add", "experiment", "stribeck", "elbow"], ["a joint is named with --joint"]),
        (["add", "mine", "--joint", "elbow"], ["which effect?", "`sysid add mine EFFECT --joint"]),
        (["fit", "experiment", "--joint", "elbow"], ["No such option: --joint", "`sysid fit --help`"]),
        (["init", "robot.urdf", "a.csv", "--rate", "250hz"], ["'--rate': a number is needed"]),
        (["fit", "nothere"], ["check its name; experiments here: experiment"]),
        (["add", "experiment", "formula", "--joint", "elbow"], ["which formula?", "--option 'formula=a*sin(3*q)'", "`sysid effects formula`"]),
        (["simulate", "experiment", "--hide", "stribeck:elbo"], ["allowed: shoulder, elbow", "did you mean elbow?"]),
        (["fit", "."], ["`sysid init URDF LOG...` writes one", "experiments here: experiment"]),
    ],
)
def test_a_command_line_that_lacks_something_says_what_to_type(experiment, cli, words, told):
    experiment()
    cli(*words).complains(*told)


# ---- the last line


def last(cli, *words, out=None):
    said = cli(*words, out=out)
    assert said.status in (0, 1), said.err
    return said.out.splitlines()[-1]


def test_every_command_ends_with_the_next_one(experiment, cli, tmp_path):
    folder, run = experiment(), tmp_path / "run"
    out = f" --out {run}"  # which a run folder of one's own needs every time
    assert last(cli, "check", folder) == f"next: sysid fit {folder}{out}"
    assert last(cli, "fit", folder) == f"next: sysid diagnose {folder}{out}"
    assert last(cli, "add", folder, "torque_bias:elbow", "--force") == f"next: sysid diagnose {folder}{out}"
    assert "torque_bias: {joints: [elbow]}" in (folder / "config.yaml").read_text()
    assert last(cli, "history", folder) == f"next: sysid diagnose {folder}{out}"
    assert last(cli, "compare", folder, run / "steps/00-start", out=tmp_path / "two") == f"next: sysid diagnose {folder}"
    assert last(cli, "simulate", folder, "--duration", "4", "--rate", "250", out=tmp_path / "sim") == f"next: sysid diagnose {tmp_path / 'sim'}"
    assert last(cli, "effects") == "next: sysid effects NAME"


def test_a_law_of_one_s_own_has_a_page(cli):
    """Where the catalogue has no word for what is left."""
    said = cli("effects", "formula")
    words = " ".join(said.out.split())
    assert said.status == 0 and "sysid add EXPERIMENT formula --joint JOINT --option" in words and "qdd (angle, speed, acceleration)" in words
    from sysid.formula import FUNCTIONS, parse

    assert all(name in words for name in FUNCTIONS) and parse("a*sin(3*q) + b*qd**3")
    (described,) = json.loads(cli("effects", "formula", "--json").out)["effects"]
    (other,) = json.loads(cli("effects", "stribeck", "--json").out)["effects"]
    assert set(described) == set(other)


def test_a_run_folder_stands_for_its_experiment_in_a_comparison(experiment, cli, tmp_path):
    folder = experiment()
    cli("add", folder, "torque_bias", "--joint", "elbow", "--force")
    said = cli("compare", tmp_path / "run/steps/00-start", folder, out=tmp_path / "two")
    assert said.status == 0 and "00-start -> experiment" in said.out
    cli("fit", tmp_path / "run", out=tmp_path / "other").complains("a run folder, not an experiment", "experiment.yaml")


def test_logs_that_cannot_be_meant_are_checked_next_and_that_only_once(experiment, cli):
    """A check that finds the logs in order is not asked for again."""
    folder = experiment(test=lambda c: c | {f"tau_{j}": -c[f"tau_{j}"] for j in JOINTS})
    run = folder.parent / "run"
    assert last(cli, "fit", folder) == f"next: sysid check {folder} --out {run}"
    assert last(cli, "check", folder) in [f"next: sysid {word} {folder} --out {run}" for word in ("fit", "check")]
    # who goes on all the same has read what the check says
    for ok in ("true", "false"):
        (run / "check.json").write_text(f'{{"ok": {ok}, "faults": []}}')
        assert last(cli, "fit", folder) == f"next: sysid diagnose {folder} --out {run}"


def test_what_is_held_at_zero_is_a_line_an_effect(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    fitted._show_held({f"viscous.j{k}.Fv": 1.0 for k in range(7)} | {"armature.arm.left.Ia": 2.0})
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 and lines[0].endswith("on j0, j1, j2, j3, j4, j5, j6") and lines[1].endswith("on arm.left")


def test_what_an_addition_holds_is_told_apart_from_what_it_cannot_tell_alone(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "200")
    parameters = [{"name": f"law.j.{name}", "value": value, "std": None, "unit": "SI"} for name, value in (("a", -1152.0), ("b", 0.0))]
    parameters.append({"name": "law.j.c", "value": 3.0, "std": None, "unit": "SI", "held": True})
    document = {"rms_test_before": {}, "rms_test_after": {}, "differences": [], "added": "law", "parameters": parameters, "says": "", "refused": True}
    steps.show_added(document | {"untold": "", "notices": [], "experiment": str(tmp_path)}, tmp_path, tmp_path)
    said = capsys.readouterr().out
    assert "held at zero or at the prior: law.j.b, law.j.c\n" in said and "only together with other parameters: law.j.a = -1152\n" in said


def test_a_wide_table_of_sizes_is_named_and_not_printed():
    said = {"detectable": [], "absorbed": [], "findings": []}
    for joint in (own := [f"a_joint_with_a_name_{k}" for k in range(6)]):
        said["detectable"].append({"effect": "spring", "joint": joint, "parameter": "k", "unit": "N m/rad", "size": 1.0, "at": {}})
    assert "1 effects on 6 joints: a table of the report" in " ".join(" ".join(sizes.fitting(said, own, 80)).split())
    assert sizes.fitting(said, own, 300) == sizes.shown(said, own, 300)


def test_an_effect_that_is_named_is_not_said_to_be_at_no_size_on_any_joint():
    said = {
        "detectable": [{"effect": "spring", "joint": "a", "parameter": "k", "unit": "", "size": 1.0, "at": {}}],
        "absorbed": [{"effect": effect, "joint": "a"} for effect in ("delay", "payload")],
        "findings": [{"effect": "delay", "joint": "b", "joins_as_step": 1}],
    }
    lines = sizes.shown(said, ["a", "b"], 100)
    assert "  at no size on any joint: payload" in lines and "  at no size on another joint than named: delay" in lines


def test_no_help_is_cut(cli, capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.argv", ["sysid", "--help"])
    with pytest.raises(SystemExit):
        commands.main()
    said = capfd.readouterr().out
    assert "..." not in said.partition("Commands:")[2] and max(map(len, said.splitlines())) <= 80 and "sysid init FOLDER" in said
    assert said.index("  init ") < said.index("  check ") < said.index("  fit ") < said.index("  diagnose ") < said.index("  add ")
    assert set(command_line._SHORT) == {c.name or c.callback.__name__ for c in command_line.app.registered_commands} | {"study"}


# ---- masses that the log cannot show

UPRIGHT = """<robot name="column">
  <link name="base"/>
  <link name="post"><inertial><origin xyz="0 1e-6 0.3"/><mass value="2"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.3 0 0"/><mass value="3"/>
    <inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="post"/>
    <axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="900" velocity="90"/></joint>
  <joint name="elbow" type="revolute"><parent link="post"/><child link="arm"/>
    <origin xyz="0 0 0.6"/><axis xyz="0 1 0"/><limit lower="-9" upper="9" effort="900" velocity="90"/></joint>
</robot>"""


def moved(seed, more=lambda q: 0.0, arm=1.0):
    """A log of the column: the arm's own torque by hand (m c^2 + I, m g c cos q), friction, noise."""
    t, rng = np.arange(0.0, 8.0, 0.004), np.random.default_rng(seed)
    q = np.stack([0.8 * np.sin((1.1 + 0.3 * k) * t + k + seed) + 0.3 * np.sin(3.1 * t + k) for k in range(2)])
    qd, qdd = (np.gradient(a, t, axis=1) for a in (q, np.gradient(q, t, axis=1)))
    tau = np.stack([0.4 * qdd[0] + more(q[0]), arm * (0.32 * qdd[1] - 3 * 9.81 * 0.3 * np.cos(q[1]))])
    tau += 0.5 * qd + 0.4 * np.sign(qd) + 0.05 * rng.standard_normal(q.shape)
    return {"t": t, **{f"q_{j}": q[k] for k, j in enumerate(JOINTS)}, **{f"tau_{j}": tau[k] for k, j in enumerate(JOINTS)}}


def column(experiment, name="column", **more):
    """A link under an upright axis, its centre a millionth of a metre beside it, and an arm on it."""
    given = {"robot": {"urdf": "robot.urdf"}, "model.effects": ["viscous", "coulomb"]}
    return experiment(config=given, urdf=UPRIGHT, train=lambda c: moved(0, **more), test=lambda c: moved(1, **more), name=name)


def implausible(folder):
    return [f.joint for f in masses.find(looked(pipeline.load(folder)))]


def test_a_link_under_an_upright_axis_has_no_weight_to_be_wrong(experiment):
    """A cable's torque looks like the weight of a link ten thousands of times as heavy, whose lever is nothing."""
    folder = column(experiment, more=lambda q: 0.8 * np.sin(q))
    found = masses.weighed(looked(pipeline.load(folder)).seen)
    assert found.plausible[1, 0] > 1e4  # for all that its lever can show
    assert implausible(folder) == []


@pytest.mark.parametrize("arm", [1.0, 8.0])
def test_a_weight_that_a_joint_carries_is_told(experiment, arm):
    """The same arm eight times as heavy as its URDF says."""
    assert implausible(column(experiment, arm=arm)) == (["elbow"] if arm > 1.0 else [])


@pytest.mark.parametrize("apart", [True, False])
def test_two_clocks_that_run_apart_are_told(simulated, tmp_path, apart):
    """And no delay, which would be another at each end of the log."""
    folder = shutil.copytree(simulated("clocks", duration=24.0), tmp_path / "logs")
    for file in (folder / "train.csv", folder / "test.csv"):
        table = pl.read_csv(file)
        t = table["t"].to_numpy()
        late = 0.0015 * (t - t[0]) if apart else 0.018
        table.with_columns(pl.Series(name, np.interp(t - late, t, table[name])) for name in table.columns if name.startswith("tau_")).write_csv(file)
    found = [f for f in check.check(pipeline.load(folder)) if f.fault == "delayed_signal"]
    if apart:
        assert len(found) == 1 and "clocks that run apart" in found[0].says and not found[0].joint
    else:
        assert {f.joint for f in found} == set(BOTH) and all("18 ms later" in f.says for f in found)
