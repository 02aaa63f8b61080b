"""What is told to be typed next can be done, and leads on."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sysid import urdf
from sysid.addition import designs, one_in_motion, told_by_motion
from sysid.statement import where
from sysid.statement.words import all_of, either, named
from sysid.terminal.designed import show_design
from sysid.terminal.diagnosis import _after_diagnosis
from sysid.terminal.next_steps import mended_first
from sysid.vocabulary import find

from .conftest import JOINTS, RATE, URDF


@pytest.mark.parametrize("limit", ['<limit effort="39" velocity="1.4"/>', '<limit lower="0" upper="0" effort="39" velocity="1.4"/>', ""])
def test_a_joint_that_moves_and_whose_limits_are_nothing_has_none(tmp_path, limit):
    """As exporters write a joint that turns without end: a motion could keep within no such range."""
    said = re.sub(r"<limit [^>]*/>", limit, URDF, count=1)
    assert said != URDF
    file = tmp_path / "robot.urdf"
    file.write_text(said)
    own = [urdf.read(file).joints[joint].limits for joint in JOINTS]
    assert own == [(-np.inf, np.inf), (-3.0, 3.0)]


def design(probability):
    return {
        "duration": 20.0, "criterion": {"log_det": 3.0, "random_best": None}, "margins": {"collision": None}, "expected_std": {},
        "separates": [{"a": "torque_bias:elbow", "b": "asymmetric_coulomb:elbow", "probability": probability, "if_a": probability, "if_b": probability}], "notices": [], "run": "next",
    }  # fmt: skip


def test_a_motion_that_answers_nothing_is_not_to_be_played(capsys):
    experiment = SimpleNamespace(path=Path("arm/config.yaml"))
    show_design(design(0.0), experiment)
    said = capsys.readouterr().out
    assert "trajectory.csv" not in said and said.splitlines()[-1] == "next: sysid effects torque_bias"
    show_design(design(0.9), experiment)
    said = capsys.readouterr().out
    assert "trajectory.csv" in said and said.splitlines()[-1].startswith("next: sysid diagnose arm")


def test_logs_are_checked_before_an_effect_mends_what_wrong_columns_bent(capsys, tmp_path):
    file = tmp_path / "config.yaml"
    file.write_text("robot: {}\n")
    experiment = SimpleNamespace(path=file, name="arm")
    masses = {"command": "sysid add arm payload", "prior_weight": None}
    worse = {
        "notices": ["implausible: the model is worse than none on the test logs of elbow (R2 -2); are its columns, signs and units right? `sysid check` says"],
        "run": str(tmp_path),
    }
    heavy = {"notices": ["implausible masses, the URDF's in brackets: fore 0.765 kg (2.5 kg)"], "run": str(tmp_path)}
    assert mended_first(worse, experiment, SimpleNamespace(masses=masses, filters={}))
    assert "next: sysid check" in capsys.readouterr().out
    assert mended_first(heavy, experiment, SimpleNamespace(masses=masses, filters={}))
    assert "next: sysid add arm payload" in capsys.readouterr().out
    assert not mended_first(heavy, experiment, SimpleNamespace(masses=masses, filters={}), diagnosed=False)  # bodies hide some effects, a diagnosis asks all
    assert capsys.readouterr().out == ""
    (tmp_path / "check.json").write_text(json.dumps({"ok": True, "faults": []}))
    assert mended_first(worse, experiment, SimpleNamespace(masses=masses, filters={}))  # it has been checked
    assert "next: sysid add arm payload" in capsys.readouterr().out


def test_a_joint_that_is_not_used_needs_no_other_log():
    verdict = [{"joint": joint, "status": "unresolved"} for joint in ("hip", "knee")]
    assert where.blind({"verdict": verdict}) == ["hip", "knee"]
    assert where.blind({"verdict": verdict, "unused": ["knee"]}) == ["hip"]


def test_a_check_refuses_what_a_fit_would(experiment, cli):
    folder = experiment(config={"model.effects": ["viscous", "coulomb", "viscous"]})
    for command in ("check", "fit"):
        cli(command, folder).complains("viscous stands twice")


def test_a_motion_is_not_written_among_the_files_of_an_experiment(experiment, cli):
    folder = experiment()
    said = cli("design", folder, out=folder)
    assert said.status == 2 and "an experiment stands in this folder" in said.err and len(said.err.splitlines()) == 1
    assert not list(folder.glob("trajectory*"))


def test_a_low_pass_is_chosen_in_numbers_that_a_file_can_hold(experiment, cli):
    """Of a slow log the window is as many of its own steps as a polynomial needs."""
    folder = experiment(config={"preprocess.torque": "low-pass"}, train=slower, test=slower)
    said = cli("add", folder, "torque_bias", "--joint", "elbow", "--force")
    assert said.status == 0, said.err
    fit = json.loads((folder.parent / "run" / "fit.json").read_text())
    assert fit["filter"]["torque"] == "low-pass" and fit["filter"]["window"] == pytest.approx(4.0 * 4.0 / RATE)


def slower(columns):
    """Every fourth sample."""
    return {name: values[::4] for name, values in columns.items()}


def without_torque(*joints):
    """Columns whose torque of some joints never changes."""
    return lambda columns: {name: 1.5 + 0.0 * values if name in [f"tau_{joint}" for joint in joints] else values for name, values in columns.items()}


def test_a_torque_that_was_not_logged_bends_no_other_joint(experiment, cli):
    """It is told, and the joint is as one that the experiment says is not used: no motion is asked for on its account."""
    lacks = without_torque("elbow")
    bare = experiment(train=lacks, test=lacks, name="bare")
    named = experiment(config={"data.unused": ["elbow"]}, name="named")
    fits = {}
    for folder in (bare, named):
        said = cli("fit", folder, out=folder / "run")
        assert said.status == 0, said.err
        fits[folder.name] = json.loads((folder / "run" / "fit.json").read_text())
        if folder is bare:
            assert "of elbow no torque was logged" in said.out and "log it, or name the joint in data.unused" in " ".join(said.out.split())
    first, second = (fits[name]["rms"]["test"] for name in ("bare", "named"))
    assert first["shoulder"] == pytest.approx(second["shoulder"], rel=1e-6)
    assert first["elbow"] is None and second["elbow"] is None
    said = cli("diagnose", bare, "--json", out=bare / "run")
    found = json.loads(said.out)
    assert found["unused"] == ["elbow"] and where.blind(found) == [joint for joint in where.blind(found) if joint != "elbow"]
    assert (found["next_log"] is not None) is bool(where.blind(found))


def test_logs_of_which_no_row_counts_are_refused(experiment, cli):
    lacks = without_torque("shoulder", "elbow")
    cli("fit", experiment(train=lacks, test=lacks)).complains("no row of the training logs counts", "2 missing torques", "their torque is measured")
    masked = experiment(config={"preprocess.mask": [{"log": "train.csv", "start": 0.0, "stop": 1e3}]}, name="masked")
    cli("fit", masked).complains("no row of the training logs counts", "masked")


def test_a_joint_that_is_locked_and_moves_is_told(experiment, cli):
    folder = experiment(config={"robot.joints": ["shoulder"]})
    said = " ".join(cli("fit", folder).out.split())
    assert "locked joints that move, or stand elsewhere: elbow at 0 rad, which train.csv has from -" in said and "name them in robot.joints" in said
    # whoever says where it stands knows; and a column that goes by no name is not the elbow's
    for number, config in enumerate(({"robot.lock": {"elbow": 0.3}}, {"data.columns.position": ["q_shoulder"]}, {"data.columns.position": "q_shoulder"})):
        said = cli("fit", experiment(config={"robot.joints": ["shoulder"], **config}, name=f"other{number}"))
        assert said.status == 0 and "locked joints" not in said.out, said.err


@pytest.mark.parametrize(
    ("kind", "angle", "told"), [("revolute", 0.0, False), ("revolute", 0.3, True), ("revolute", 2.0 * np.pi, True), ("continuous", 2.0 * np.pi, False)]
)
def test_a_joint_that_is_locked_where_it_stands_is_not(experiment, cli, kind, angle, told):
    turned = lambda text: text.replace('name="elbow" type="revolute"', f'name="elbow" type="{kind}"')  # noqa: E731
    assert kind == "revolute" or turned(URDF) != URDF
    standing = lambda columns: columns | {"q_elbow": angle + 0.0 * columns["q_elbow"]}  # noqa: E731
    folder = experiment(config={"robot.joints": ["shoulder"]}, urdf=turned, train=standing, test=standing)
    assert ("locked joints" in cli("fit", folder).out) is told
    bare = experiment(config={"robot.joints": ["shoulder"]}, train=lambda c: {k: v for k, v in c.items() if k != "q_elbow"}, name="bare")
    assert "locked joints" not in cli("fit", bare).out


@pytest.mark.parametrize(
    ("head", "others", "said"),
    [
        (0.9, [("stribeck", "hip", 0.1)], "spring"),
        (0.52, [("stribeck", "hip", 0.48)], "spring"),
        (0.5, [("stribeck", "hip", 0.5)], "spring or stribeck"),
        (0.3, [("stribeck", "hip", 0.4), ("spring", "hip", 0.3)], "spring"),  # with other options
        (0.4, [("stribeck", "hip", 0.25), ("cable", "knee", 0.35)], "spring or cable on knee"),
        (0.2, [("stribeck", "hip", 0.15), ("cable", "hip", 0.15), ("delay", "hip", 0.1)], "spring, stribeck, cable or delay"),
    ],
)
def test_a_name_that_is_no_likelier_right_than_wrong_does_not_stand_alone(head, others, said):
    told = [{"effect": e, "joint": j} for e, j in named(("spring", "hip"), [("spring", "hip", head), *others])]
    spring = {"effect": "spring", "joint": "hip"}
    document = {
        "findings": [{"command": "first"}, {"command": "second"}, {"command": "third"}],
        "claims": [
            {"findings": [0], "named": [{"effect": "delay", "joint": "knee"}]},
            {"findings": [1], "named": told},
            {"findings": [2], "named": [spring]},  # the same with other options, later
        ],
    }
    assert either(spring, document, "hip") == said
    assert either({**spring, "command": "second"}, document, "hip") == said
    assert either({**spring, "command": "third"}, document, "hip") == "spring"
    assert either(spring, {**document, "claims": document["claims"][:1]}) == "spring on hip"


def test_alternatives_do_not_run_into_what_holds_with_them():
    pair = [{"effect": effect, "joint": "hip"} for effect in ("torque_bias", "asymmetric_coulomb")]
    found = either(pair[0], {"findings": [{}], "claims": [{"findings": [0], "named": pair}]})
    assert found == "torque_bias or asymmetric_coulomb on hip"
    assert all_of([found]) == found
    assert all_of(["load_friction on knee", found]) == "load_friction on knee and (torque_bias or asymmetric_coulomb on hip)"


def test_of_two_of_which_one_can_do_all_that_the_other_does_only_one_is_told(capsys):
    """A turn of a leg's base about its first axis is that joint's offset: no motion tells where it is that."""
    document = design(0.5)
    document["separates"][0] |= {"a": "encoder_offset:hip", "b": "gravity_tilt:*", "if_a": 0.0, "if_b": 0.98}
    show_design(document, SimpleNamespace(path=Path("leg/config.yaml")))
    said = capsys.readouterr().out
    assert "told apart with probability 0.50: 0.98 if it is gravity_tilt:*, hardly ever if it is encoder_offset:hip" in said
    show_design(design(0.9), SimpleNamespace(path=Path("leg/config.yaml")))
    assert "0.90\n" in capsys.readouterr().out


def test_where_another_log_is_needed_its_design_is_typed_next(capsys):
    """And no page to look at."""
    found = SimpleNamespace(fit=SimpleNamespace(masses={}, filters={}, joints=("a",)))
    document = {
        "verdict": [{"joint": "a", "status": "unresolved", "says": ""}],
        "findings": [],
        "notices": [],
        "run": "runs/arm",
        "next_log": "sysid design arm --out next",
    }
    _after_diagnosis(found, document, SimpleNamespace(path=Path("arm/config.yaml"), name="arm"))
    assert capsys.readouterr().out.splitlines()[-1] == "next: sysid design arm --out next"
    _after_diagnosis(found, {**document, "next_log": None}, SimpleNamespace(path=Path("arm/config.yaml"), name="arm"))
    assert capsys.readouterr().out.splitlines()[-1] == "next: sysid report arm --open"


def test_a_push_is_left_out_before_what_it_bends_is_asked(capsys):
    """Of two seconds on one joint, beside which another one's rest looks like an effect, and a third one's like nothing that is known."""
    found = SimpleNamespace(fit=SimpleNamespace(masses={}, filters={}, joints=("a", "b", "c")))
    verdict = [{"joint": joint, "status": "unresolved", "says": ""} for joint in "abc"]
    verdict[1]["may_be"] = {"command": "sysid add arm torque_gain --joint b"}
    stretch = {"joint": "a", "stretches": [{"log": "train.csv", "start": 10.6, "stop": 13.4}], "regions": []}
    document = {"verdict": verdict, "findings": [], "notices": [], "run": "runs/arm"}
    assert where.blind(document) == ["a", "c"] and where.blind({**document, "fails_where": [stretch]}) == []
    for fails, last in (([], "next: sysid add arm torque_gain --joint b"), ([stretch], "next: sysid diagnose arm")):
        _after_diagnosis(found, {**document, "fails_where": fails}, SimpleNamespace(path=Path("arm/config.yaml"), name="arm"))
        assert capsys.readouterr().out.splitlines()[-1] == last


@pytest.mark.parametrize("steps", [(1, 2), (2, 1)])
def test_what_is_promised_one_after_another_is_printed_in_that_order(steps, capsys):
    """A verdict stands by joint; the order is printed where the second joint's effect came first."""
    found, experiment = (
        SimpleNamespace(fit=SimpleNamespace(masses={}, filters={}, joints=("a", "b"))),
        SimpleNamespace(path=Path("arm/config.yaml"), name="arm"),
    )
    on = {"a": "sysid add arm spring --joint a", "b": "sysid add arm spring --joint b"}
    verdict = [{"joint": joint, "status": "missing", "commands": [command]} for joint, command in on.items()]
    findings = [{"command": command, "joins_as_step": step} for command, step in zip(on.values(), steps)]
    _after_diagnosis(found, {"verdict": verdict, "findings": findings, "notices": [], "run": "runs/arm"}, experiment)
    *said, last = capsys.readouterr().out.splitlines()
    if steps == (1, 2):
        assert not said and last == f"next: {on['a']}"
    else:
        assert "add them in this order" in " ".join(" ".join(said).split()) and said[-2:] == [on["b"], on["a"]] and last == f"next: {on['b']}"


def test_what_is_one_in_motion_is_not_sent_to_a_motion():
    """A bias and asymmetric Coulomb friction of one joint; of others a motion tells one of them."""
    bias, friction = ("torque_bias", "hip"), ("asymmetric_coulomb", "hip")
    assert told_by_motion([bias, friction]) == told_by_motion([bias]) == []
    assert told_by_motion([friction, bias, ("spring", "hip")]) == ["asymmetric_coulomb:hip", "spring:hip"]
    assert told_by_motion([bias, ("asymmetric_coulomb", "knee")]) == ["torque_bias:hip", "asymmetric_coulomb:knee"]
    assert designs("sysid add leg torque_bias --joint hip", bias, [(*friction, 0.5)]) == ""


def test_what_is_in_the_model_may_be_what_is_the_same_in_motion():
    fit = lambda *terms: SimpleNamespace(joints=("hip", "knee"), model=SimpleNamespace(terms=[(find(name), (j,)) for name, j in terms]))  # noqa: E731
    (said,) = one_in_motion(fit(("torque_bias", 1), ("coulomb", 1)))
    assert said.startswith("torque_bias on knee, which is in the model, may be asymmetric_coulomb as well") and "torque at rest" in said
    assert one_in_motion(fit(("torque_bias", 1), ("asymmetric_coulomb", 1))) == []
