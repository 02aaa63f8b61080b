"""The loop: an effect goes into the file, the fit is repeated, the history tells; discover never keeps what held-out data refuse."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from sysid import config, effect_entry, loop, pipeline
from sysid.addition import grown, spelled
from sysid.candidates import candidates
from sysid.comparison import Difference
from sysid.effect_entry import with_effect
from sysid.errors import ConfigError, LogError
from sysid.statement import kept
from sysid.vocabulary import find

FILE = """\
# the leg of a robot
robot:
  urdf: robot.urdf   # from CAD
prior: {weight: 0.02}   # before the model, on purpose

model:
  # what turns
  inertia: log-cholesky
  effects: [viscous, coulomb]   # the usual two
data:
    train:
    - "train.csv"
    test: ['test.csv']
# the end
"""
BLOCK = """\
model:
  effects:
    - viscous
    # friction of the gear
    - coulomb
    - {stribeck: {joints: [hip]}}   # seen in March
    - load_friction:
        joints:
          - knee
  inertia: exponential
"""


def effects_of(text: str) -> list[tuple]:
    return [(e.name, e.joints, e.options) for e in config.loads(text, Path("experiment.yaml")).model.effects]


# ---- the file


@pytest.mark.parametrize(("effect", "joints", "options", "entry"), [
    ("armature", None, {}, "armature"),
    ("stribeck", ["hip"], {}, "{stribeck: {joints: [hip]}}"),
    ("stribeck", ["hip", "knee"], {"vs": 0.1}, "{stribeck: {joints: [hip, knee], vs: 0.1}}"),
    ("joint_coupling", ["hip"], {"other": "knee"}, "{joint_coupling: {joints: [hip], other: knee}}"),
    ("payload", None, {}, "payload"),
    ("my_effects.py:Squeak", ["hip"], {}, "{my_effects.py:Squeak: {joints: [hip]}}"),
    ("formula", ["knee"], {"formula": "a*sin(3*q)"}, "{joints: [knee], formula: a*sin(3*q)}"),
])  # fmt: skip
def test_one_line_of_the_file_changes(effect, joints, options, entry):
    text = with_effect(FILE, effect, joints, options)
    before, after = FILE.splitlines(), text.splitlines()
    (changed,) = [k for k, (a, b) in enumerate(zip(before, after)) if a != b and "effects:" in a]
    # the list in flow style may be written without its braces, which YAML allows
    assert after[changed].split("#")[1] == before[changed].split("#")[1]
    assert (
        after[changed]
        .split("]   #")[0]
        .replace("{", "")
        .replace("}", "")
        .startswith("  effects: [viscous, coulomb, " + entry.replace("{", "").replace("}", "").split("]")[0])
    )
    bare = lambda line: line.strip().replace('"', "").replace("'", "")  # noqa: E731
    assert [bare(line) for k, line in enumerate(after) if k != changed] == [bare(line) for k, line in enumerate(before) if k != changed]
    assert effects_of(text) == [("viscous", None, {}), ("coulomb", None, {}), (effect, joints, options)]
    # twice the same edit of the rest: nothing else moves
    again = with_effect(text, "warmup", ["hip"], {})
    assert [line for line in again.splitlines() if "effects:" not in line] == [line for line in after if "effects:" not in line]


def test_the_other_lines_keep_their_quotes():
    text = with_effect(FILE, "armature", None, {})
    assert '- "train.csv"' in text and "['test.csv']" in text


def test_the_other_lines_keep_their_indentation():
    text = with_effect(BLOCK, "armature", None, {})
    assert "    - viscous\n" in text


def test_comments_of_a_file_without_keys_are_kept():
    assert "# nothing yet" in with_effect("# nothing yet\n", "stribeck", ["hip"], {})


def test_block_style_stays_with_its_comments():
    text = with_effect(BLOCK, "warmup", ["knee"], {})
    for comment in ("# friction of the gear", "# seen in March"):
        assert comment in text
    assert text.index("# friction of the gear") < text.index("coulomb") < text.index("# seen in March") < text.index("load_friction") < text.index("inertia")
    assert "- viscous\n" in text and "{warmup: {joints: [knee]}}" in text
    assert effects_of(text)[-1] == ("warmup", ["knee"], {}) and len(effects_of(text)) == 5


def test_a_joint_joins_the_entry_that_is_there():
    text = with_effect(BLOCK, "stribeck", ["knee"], {})
    assert [line.split() for line in text.replace("[hip, knee]", "[hip]").splitlines()] == [line.split() for line in BLOCK.splitlines()]
    text = with_effect(BLOCK, "load_friction", ["abad", "hip"], {})
    assert effects_of(text)[-1] == ("load_friction", ["knee", "abad", "hip"], {})


def test_other_options_make_another_entry():
    text = with_effect(BLOCK, "stribeck", ["knee"], {"vs": 0.2})
    assert [e for e in effects_of(text) if e[0] == "stribeck"] == [("stribeck", ["hip"], {}), ("stribeck", ["knee"], {"vs": 0.2})]


@pytest.mark.parametrize(("effect", "joints", "words"), [
    ("viscous", None, "viscous is in the model already"), ("viscous", ["hip"], "viscous is in the model already"), ("stribeck", ["hip"], "already on hip"),
    ("stribeck", ["knee", "hip"], "already on hip"), ("stribeck", None, "stribeck is in the model already"), ("load_friction", ["knee"], "already on knee"),
])  # fmt: skip
def test_what_is_there_already_is_refused(effect, joints, words):
    with pytest.raises(ConfigError, match=words):
        with_effect(BLOCK, effect, joints, {})


def test_other_options_take_the_place_of_what_is_there():
    """As the file would say it, and as the experiment is."""
    from sysid.addition import grown

    every = ["abad", "hip", "knee"]
    for before, added, after in (
        ("{stribeck: {joints: [hip, knee]}}", ["hip"], [("stribeck", ["knee"], {}), ("stribeck", ["hip"], {"vs": 0.2})]),
        ("stribeck", ["hip"], [("stribeck", ["abad", "knee"], {}), ("stribeck", ["hip"], {"vs": 0.2})]),
        ("{stribeck: {joints: [hip], vs: 0.1}}", ["hip"], [("stribeck", ["hip"], {"vs": 0.2})]),
    ):
        text = f"model:\n  effects: [viscous, {before}]  # kept\n"
        made = with_effect(text, "stribeck", added, {"vs": 0.2}, every=every)
        assert effects_of(made) == [("viscous", None, {}), *after] and "# kept" in made
        model = grown(config.loads(text, Path("e.yaml")), "stribeck", added, {"vs": 0.2}, every=every).model
        assert [(e.name, e.joints, e.options) for e in model.effects] == effects_of(made)
    with pytest.raises(ConfigError, match="already on hip"):
        with_effect("model: {effects: [{stribeck: {joints: [hip], vs: 0.2}}]}", "stribeck", ["hip"], {"vs": 0.2}, every=every)


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "model: {}\n", "model: {inertia: linear}\n", "robot: {urdf: r.urdf}\n", "model:\n  effects:\n"])
def test_what_the_file_does_not_say_is_written_out(text):
    """The effects that hold by default would be gone if the list began with the new one."""
    grown = with_effect(text, "stribeck", ["hip"], {})
    assert effects_of(grown) == [("viscous", None, {}), ("coulomb", None, {}), ("stribeck", ["hip"], {})]
    assert config.loads(grown, Path("e.yaml")).model.inertia == (("linear" in text and "linear") or "log-cholesky")


def test_an_empty_list_stays_the_user_s():
    assert effects_of(with_effect("model: {effects: []}\n", "viscous", None, {})) == [("viscous", None, {})]


def test_formulas_stand_side_by_side():
    text = with_effect(FILE, "formula", ["knee"], {"formula": "a*sin(3*q)", "name": "ripple"})
    text = with_effect(text, "formula", ["knee"], {"formula": "b*qd**3", "name": "drag"})
    assert [e[2].get("name") for e in effects_of(text)] == [None, None, "ripple", "drag"]


# ---- options


def test_options_are_yaml():
    assert effect_entry.options(["other=hip", "harmonics=3", " vs = 0.2", "logs=[a, b]", "formula=a*sin(3*q)", "x=", "y=1=2"]) == {
        "other": "hip", "harmonics": 3, "vs": 0.2, "logs": ["a", "b"], "formula": "a*sin(3*q)", "x": None, "y": "1=2",
    }  # fmt: skip
    for text in ("other", "=3", " = 3"):
        with pytest.raises(ConfigError, match="NAME=VALUE"):
            effect_entry.options([text])


def test_a_candidate_is_spelled_as_the_file_would(arm_model):
    coupling = next(c for c in candidates(arm_model) if c.name == "joint_coupling" and c.joint == 1)
    assert spelled(coupling, "elbow") == ("joint_coupling", ["elbow"], {"other": "shoulder"})
    tilt = next(c for c in candidates(arm_model) if c.name == "gravity_tilt")
    assert spelled(tilt, "*") == ("gravity_tilt", None, {})
    for candidate in candidates(arm_model):  # each of them is an entry that loads
        joint = "*" if candidate.joint < 0 else arm_model.robot.joints[candidate.joint]
        name, joints, options = spelled(candidate, joint)
        assert effects_of(with_effect("", name, joints, options))[-1] == (name, joints, options) and name == find(name).name


@pytest.fixture
def arm_model(experiment):
    return pipeline.build(pipeline.load(experiment()))[1]


# ---- add


def test_add_writes_refits_and_tells(experiment, cli):
    folder = experiment(config=FILE.replace("joints: ", "").replace("# the leg of a robot", "# mine"))
    said = cli("add", folder, "asymmetric_coulomb", "--joint", "elbow", "--json")
    assert said.status == 0 and said.err == ""
    document = json.loads(said.out)
    assert document["added"] == "asymmetric_coulomb" and document["converged"] is True and set(document["rms_test_before"]) == {"shoulder", "elbow"}
    assert [p["name"] for p in document["parameters"]] == ["asymmetric_coulomb.elbow.dF"]
    assert [d["joint"] for d in document["differences"]] == ["shoulder", "elbow"]
    for d in document["differences"]:
        assert d["delta_rms"] == pytest.approx(document["rms_test_after"][d["joint"]] - document["rms_test_before"][d["joint"]], abs=1e-12) and d["se"] >= 0
    text = (folder / "config.yaml").read_text()
    assert "# mine" in text and "# the usual two" in text and effects_of(text)[-1] == ("asymmetric_coulomb", ["elbow"], {})
    # a second effect, and the history of both
    assert cli("add", folder, "torque_bias", "--quiet").out == ""
    history = json.loads(cli("history", folder, "--json").out)["steps"]
    assert [(s["added"], s["joint"]) for s in history] == [(None, None), ("asymmetric_coulomb", "elbow"), ("torque_bias", "*")]
    assert history[0]["rms_test"] == document["rms_test_before"] and history[1]["rms_test"] == document["rms_test_after"]
    assert [s["folder"] for s in history] == ["steps/00-start", "steps/01-asymmetric_coulomb-elbow", "steps/02-torque_bias"]
    # every step can be reproduced
    for step in history:
        again = json.loads(cli("fit", said.run / step["folder"] / "experiment.yaml", "--json", out=said.run.parent / "again").out)
        assert again["rms"]["test"] == pytest.approx(step["rms_test"], rel=1e-9)
    # and the run folder holds the last
    assert json.loads((said.run / "fit.json").read_text())["rms"]["test"] == history[-1]["rms_test"]
    shown = cli("history", folder).out
    assert "0 start" in shown and "2 + torque_bias on *" in shown and "##########" in shown
    # a refit that is no continuation begins a history of its own
    (folder / "config.yaml").write_text(text.replace("weight: 0.02", "weight: 0.5"))
    cli("add", folder, "torque_bias", "--joint", "elbow", "--quiet")
    assert [s["added"] for s in loop.read_history(said.run)] == [None, "torque_bias"]


def test_what_joins_an_entry_of_the_file_is_told_by_its_name(experiment, cli):
    """The entry is not the last one."""
    there = ["viscous", "coulomb", {"torque_bias": {"joints": ["elbow"]}}, {"asymmetric_coulomb": {"joints": ["elbow"]}}]
    folder = experiment(config={"model.effects": there})
    said = json.loads(cli("add", folder, "torque_bias", "--joint", "shoulder", "--force", "--json").out)
    assert said["added"] == "torque_bias" and [p["name"] for p in said["parameters"]] == ["torque_bias.shoulder.b"]


CHEETAH = Path(__file__).resolve().parent.parent / "configs" / "cheetah3.yaml"


def test_the_readme_s_example_reaches_its_floor(cli, tmp_path):
    """The command that the diagnosis prints takes the error to the noise, and the friction that was hidden comes out as it is."""
    folder = tmp_path / "hidden"
    assert cli("simulate", CHEETAH, "--hide", "stribeck:hip", "--quiet", out=folder).status == 0
    truth = json.loads((folder / "truth.json").read_text())
    said = cli("add", folder, "stribeck", "--joint", "hip", "--json")
    document = json.loads(said.out)
    noise = truth["logs"]["test"]["noise_rms"]
    assert document["rms_test_after"]["hip"] < 1.1 * noise["hip"] < document["rms_test_before"]["hip"]
    for parameter in document["parameters"]:
        true = truth["hidden"][0]["values"][parameter["name"].rpartition(".")[2]]
        assert abs(parameter["value"] - true) < parameter["std"] < 0.05 * true
    # and what is left out is said
    counted = json.loads((said.run / "fit.json").read_text())
    assert set(counted["left_out"]) == {"train", "test"} and all(0 < n < 0.3 * 20001 for n in counted["left_out"]["train"].values())
    (notice,) = counted["notices"]
    assert all(f"{joint} {100 * n / counted['samples']['train']:.0f} %" in notice for joint, n in counted["left_out"]["train"].items())


def test_add_shows_before_and_after(experiment, cli):
    said = cli("add", experiment(), "torque_bias", "--joint", "elbow")
    assert said.status == 0
    for words in ("held-out RMS without and with torque_bias", "before", "standard error", "torque_bias.elbow.b = ", "written into "):
        assert words in said.out


def test_add_takes_options_and_formulas(experiment, cli):
    folder = experiment()
    said = cli("add", folder, "formula", "--joint", "elbow", "--option", "formula=a*sin(3*q)", "--option", "name=ripple", "--json", "--force")
    assert said.status == 0, said.err
    assert [p["name"] for p in json.loads(said.out)["parameters"]] == ["ripple.elbow.a"]
    said = cli("add", folder, "joint_coupling", "--joint", "shoulder", "--option", "other=elbow", "--json", "--force")
    assert said.status == 0, said.err
    assert effects_of((folder / "config.yaml").read_text())[2:] == [
        ("formula", ["elbow"], {"formula": "a*sin(3*q)", "name": "ripple"}), ("joint_coupling", ["shoulder"], {"other": "elbow"}),
    ]  # fmt: skip


def reading(by: float):
    """A log whose elbow reads another torque than it has."""
    return lambda columns: {**columns, "tau_elbow": columns["tau_elbow"] + by}


@pytest.mark.parametrize(("joints", "where"), [(("--joint", "elbow"), "on elbow by "), ((), "over all joints by ")])
def test_what_makes_the_held_out_error_rise_is_not_added(experiment, cli, joints, where):
    """The training log has a bias that the test log does not have: what it teaches makes the error worse."""
    folder = experiment(train=reading(0.5))
    before = (folder / "config.yaml").read_bytes()
    refused = cli("add", folder, "torque_bias", *joints, "--json")
    document = json.loads(refused.out)
    assert refused.status == 1 and refused.err == "" and document["refused"] is True
    assert (folder / "config.yaml").read_bytes() == before and not any(refused.run.iterdir())
    assert document["says"].startswith("not added: it makes the held-out error rise " + where) and "--force" in document["says"]
    (elbow,) = [d for d in document["differences"] if d["joint"] == "elbow"]
    assert elbow["delta_rms"] > 3 * elbow["se"] > 0
    assert document["rms_test_after"]["elbow"] == pytest.approx(document["rms_test_before"]["elbow"] + elbow["delta_rms"])
    # one line, also where nothing else is said
    quiet = cli("add", folder, "torque_bias", *joints, "--quiet")
    assert quiet.status == 1 and quiet.out == "" and quiet.err == f"sysid: {document['says']}\n"
    told = cli("add", folder, "torque_bias", *joints)
    assert told.status == 1 and document["says"] in told.out and "written into" not in told.out
    # and it is done where the user means it
    forced = cli("add", folder, "torque_bias", *joints, "--json", "--force")
    document = json.loads(forced.out)
    assert forced.status == 0 and document["refused"] is False and document["says"].startswith("added all the same")
    assert effects_of((folder / "config.yaml").read_text())[-1][0] == "torque_bias" and len(loop.read_history(forced.run)) == 2


def test_another_joint_s_error_does_not_refuse(experiment, cli):
    """A bias that both logs have is added to its joint, whatever the other joint does meanwhile."""
    said = cli("add", experiment(train=reading(0.5), test=reading(0.5)), "torque_bias", "--joint", "elbow", "--json")
    document = json.loads(said.out)
    assert said.status == 0 and document["refused"] is False and document["says"] == ""
    (elbow,) = [d for d in document["differences"] if d["joint"] == "elbow"]
    assert elbow["delta_rms"] < -3 * elbow["se"] and document["untold"] == ""


def test_what_is_written_is_what_may_not_make_the_error_rise(experiment, cli, monkeypatch):
    """Under the prior of the fit before it falls, and under its own, which the user will see, it rises."""
    folder, refit = experiment(train=reading(0.5), test=reading(0.5)), pipeline.refit

    def worse(*given, **how):
        after, alike, _ = refit(*given, **how)
        test = after.predictions["test"]
        seen = replace(after, predictions={**after.predictions, "test": replace(test, predicted=test.predicted + 2.0)})
        return seen, alike, lambda: given[1]

    monkeypatch.setattr(pipeline, "refit", worse)
    said = cli("add", folder, "torque_bias", "--joint", "elbow", "--json")
    assert said.status == 1 and json.loads(said.out)["says"].startswith("not added: it makes the held-out error rise on elbow by ")


def test_a_fall_that_is_the_prior_s_is_said_to_be():
    """Of two fits the one that is shown has less error, by another weight of the prior, and the one under the same has more."""
    fell, rose = (Difference("before", "after", "elbow", by, 0.01) for by in (-0.05, 0.3))
    said = loop.Added(None, None, None, (fell,), (rose,), refused=True).says
    assert (
        said.startswith("not added: under the prior as it was")
        and "rise on elbow by 0.3 (standard error 0.01); what falls above falls by another weight" in said
    )
    assert "prior" not in loop.Added(None, None, None, (rose,), (rose,), refused=True).says


def test_an_effect_that_no_log_speaks_for_is_written_and_said_to_be_so(experiment, cli):
    """It is the user's to know better; its size, nothing beside its deviation, is not left without a word."""
    folder = experiment()
    said = cli("add", folder, "torque_bias", "--joint", "elbow", "--force")
    assert said.status == 0 and effects_of((folder / "config.yaml").read_text())[-1][0] == "torque_bias"
    words = " ".join(said.out.split())
    assert "nothing in these logs speaks for torque_bias: its size is nothing beside its standard deviation" in words
    assert f"take it out of model.effects in {folder / 'config.yaml'} unless you know that it is there" in words


def test_a_fit_that_fails_leaves_the_file_alone(experiment, cli, monkeypatch):
    folder = experiment()
    before = (folder / "config.yaml").read_bytes()
    fit, seen = pipeline.fit, []

    def second_fails(spec, **more):
        seen.append(len(spec.model.effects))
        if len(seen) == 2:
            raise LogError("the disk of the second fit is gone", where="here")
        return fit(spec, **more)

    monkeypatch.setattr(pipeline, "fit", second_fails)
    said = cli("add", folder, "torque_bias")
    assert said.status == 2 and said.err.splitlines() == ["sysid: here: the disk of the second fit is gone"] and seen == [2, 3]
    assert (folder / "config.yaml").read_bytes() == before
    assert loop.read_history(said.run) == []


@pytest.mark.parametrize(("words", "complaint"), [
    (("stribek", "--joint", "elbow"), "stribeck"),  # the nearest word
    (("stribeck", "--joint", "wrist"), "wrist"),
    (("torque_bias", "--option", "nonsense"), "NAME=VALUE"),
    (("torque_bias", "--option", "size=3"), "size"),
    (("viscous",), "already"),
    (("formula", "--option", "formula=__import__('os')"), "formula"),
    (("formula",), "formula"),
    (("no_file.py:Mine",), "no_file.py"),
    (("joint_coupling", "--joint", "elbow", "--option", "other=wrist"), "wrist"),
    (("payload", "--joint", "elbow"), "payload"),
])  # fmt: skip
def test_what_cannot_be_added(experiment, cli, words, complaint):
    folder = experiment()
    before = (folder / "config.yaml").read_bytes()
    cli("add", folder, *words).complains(complaint)
    assert (folder / "config.yaml").read_bytes() == before


def test_history_before_any_step(experiment, cli):
    folder = experiment()
    cli("history", folder).complains("no step was made yet", "sysid add", "sysid discover")
    cli("history", folder.parent / "absent").complains("absent")


@pytest.mark.parametrize("content", ["", "{", "[]", '{"steps": 3}', '{"other": []}'])
def test_a_broken_history_is_none(tmp_path, content):
    (tmp_path / "history.json").write_text(content)
    assert loop.read_history(tmp_path) == []


# ---- diagnose and discover


@pytest.fixture(scope="module")
def biased(simulated):
    """A planar arm with a bias in its elbow."""
    return simulated("bias", "torque_bias:elbow:b=0.4")


def test_diagnose_from_the_command_line(biased, cli):
    said = cli("diagnose", biased, "--json")
    assert said.status == 0 and said.err == ""
    document = json.loads(said.out)
    assert {"joints", "findings", "detectable", "events", "verdict"} <= set(document)
    assert document["verdict"][1]["status"] == "missing" and document["verdict"][0]["status"] in ("complete", "explained")
    assert json.loads((said.run / "diagnosis.json").read_text()) == document
    assert (said.run / "fit.json").exists()
    for words, complaint in ((("--model", biased), "--log"), (("--log", "x.csv"), "--model")):
        refused = cli("diagnose", biased, *words, out=said.run.parent / "none")
        refused.complains("belong together", complaint)
    refused = cli("diagnose", biased, "--model", biased, "--log", biased / "test.csv", out=said.run.parent / "none")
    assert refused.status == 2 and len(refused.err.splitlines()) == 1 and "run folder" in refused.err
    changed = cli("diagnose", biased, "--model", said.run, "--log", biased / "test.csv", "--json", out=said.run.parent / "changed")
    assert changed.status == 0 and {"joints", "findings", "not_visible", "verdict"} <= set(json.loads(changed.out))


def test_discover_finds_and_its_steps_reproduce(biased, cli, tmp_path, monkeypatch):
    before = (biased / "config.yaml").read_bytes()
    said = cli("discover", biased, "--json")
    assert said.status == 0 and said.err == ""
    document = json.loads(said.out)
    steps = document["steps"]
    assert [(s["added"], s["joint"]) for s in steps] == [(None, None), ("torque_bias", "elbow")]
    assert steps[1]["rms_test"]["elbow"] < 0.6 * steps[0]["rms_test"]["elbow"]
    assert {v["status"] for v in document["verdict"]} == {"complete"} and document["refused"] == []
    assert (biased / "config.yaml").read_bytes() == before  # the experiment stays the user's
    assert json.loads(cli("history", biased, "--json").out)["steps"] == steps
    for step in steps:
        again = cli("fit", said.run / step["folder"] / "experiment.yaml", "--json", out=tmp_path / "again")
        assert json.loads(again.out)["rms"]["test"] == pytest.approx(step["rms_test"], rel=1e-9)
    # they are not in the file: what writes them is told, and a page of the experiment as it is needs no second diagnosis
    assert steps[1]["command"] == f"sysid add {biased} torque_bias --joint elbow"
    told = cli("history", biased).out.splitlines()
    assert f"  {steps[1]['command']}" in told and told[-1] == f"next: {steps[1]['command']} --out {said.run}"
    with monkeypatch.context() as patched:
        patched.setattr(kept, "diagnose", lambda *given, **named: pytest.fail("asked again"))
        page = json.loads(cli("report", biased, "--json").out)
        assert page["verdict"][1]["status"] == "missing" and "it stayed as it was" in Path(page["report"]).read_text()
    # steps that are not asked for are not made
    none = json.loads(cli("discover", biased, "--max-steps", "0", "--json").out)
    assert [s["added"] for s in none["steps"]] == [None] and none["verdict"][1]["status"] == "missing"
    assert sorted(p.name for p in (said.run / "steps").iterdir()) == ["00-start"]


def discoveries(monkeypatch, arm_model, claims=(("joint_coupling", "torque_bias"),), refused=()):
    """`discover` with diagnoses that claim these words on the elbow, one tuple each time it is asked; fits are made up."""
    words = {c.name: c for c in candidates(arm_model) if c.joint == 1}
    asked, rounds = [], [*claims]

    def fake_fit(spec):
        return SimpleNamespace(joints=arm_model.robot.joints, experiment=spec, rms=lambda part: {"shoulder": 1.0, "elbow": 0.8 ** len(spec.model.effects)})

    def fake_diagnose(spec, *, fit=None, progress=None):
        asked.append([e.name for e in spec.model.effects])
        found, last = [], fit or fake_fit(spec)
        for word in rounds.pop(0) if rounds else ():
            last = fake_fit(grown(last.experiment, *spelled(words[word], "elbow")))
            found.append(SimpleNamespace(head=SimpleNamespace(candidate=words[word], joint="elbow", command=f"sysid add arm {word} --joint elbow"), after=last))
        return SimpleNamespace(fit=fit or fake_fit(spec), claims=tuple(found), refused=tuple(refused))

    monkeypatch.setattr(loop, "diagnose", fake_diagnose)
    monkeypatch.setattr(loop.results, "write", lambda fit, folder: None)
    monkeypatch.setattr(loop.whole_files, "write_json", lambda *given: None)
    monkeypatch.setattr(loop.kept, "sealed", lambda spec, found, run: {"verdict": []})
    return asked


def test_discover_adds_what_is_claimed_and_asks_again(monkeypatch, tmp_path, experiment, arm_model):
    spec = pipeline.load(experiment(name="other"))
    why = SimpleNamespace(effect="backlash", joint="elbow", why="the error on the test logs rises")
    asked, told = discoveries(monkeypatch, arm_model, refused=[why]), []
    found = loop.discover(spec, tmp_path / "run", each=told.append)
    assert [s["added"] for s in found.steps] == [None, "joint_coupling", "torque_bias"] and told == found.steps
    assert asked == [["viscous", "coulomb"], ["viscous", "coulomb", "joint_coupling", "torque_bias"]]
    assert [e.name for e in found.experiment.model.effects[2:]] == ["joint_coupling", "torque_bias"]
    assert found.experiment.model.effects[2].options == {"other": "shoulder"}
    # what was looked at and is not claimed is told once, with why
    assert found.refused == [{"effect": "backlash", "joint": "elbow", "why": why.why}]


def test_discover_goes_on_while_anything_is_claimed(monkeypatch, tmp_path, experiment, arm_model):
    spec = pipeline.load(experiment(name="other"))
    asked = discoveries(monkeypatch, arm_model, (("joint_coupling",), ("torque_bias", "spring"), ("cogging",)))
    found = loop.discover(spec, tmp_path / "run")
    assert [s["added"] for s in found.steps] == [None, "joint_coupling", "torque_bias", "spring", "cogging"]
    assert [len(names) for names in asked] == [2, 3, 5, 6]


@pytest.mark.parametrize("most", [0, 1, 2, 3])
def test_discover_stops_where_it_is_told(monkeypatch, tmp_path, experiment, arm_model, most):
    spec = pipeline.load(experiment(name="other"))
    asked = discoveries(monkeypatch, arm_model, (("joint_coupling", "torque_bias"), ("spring", "cogging")))
    added = ["joint_coupling", "torque_bias", "spring"][:most]
    assert [s["added"] for s in loop.discover(spec, tmp_path / "run", most=most).steps] == [None, *added]
    assert asked[-1] == ["viscous", "coulomb", *added]  # what is left is said of the last model
