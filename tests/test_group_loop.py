"""What is added to an experiment with groups of logs, and what is asked of it."""

import json

import polars as pl
import pytest

import sysid
from scripts.blind_parts.robots import PLANAR
from sysid import config
from sysid.differences import parameters_per_group
from sysid.report.parameters import parameters
from sysid.statement.document import document as statement
from tests.conftest import dump
from tests.grouped import JOINTS, PER_PAYLOAD, experiment, tree
from tests.test_changed import LOAD, written


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return experiment(tmp_path_factory.mktemp("groups"))


@pytest.mark.long
def test_an_effect_that_joins_per_group_takes_the_place_of_the_shared_one(folder, cli, tmp_path):
    file = folder / "shared.yaml"
    file.write_text("# kept\n" + dump(tree(["viscous", "coulomb", PER_PAYLOAD[2]])))
    cli("add", file, "viscous", "--per", "day").complains("there is no group 'day'")
    said = cli("add", file, "viscous", "--per", "robot", "--out", tmp_path / "run", "--json")
    assert said.status == 0, said.err
    document = json.loads(said.out)
    names = [p["name"] for p in document["parameters"]]
    assert names == [f"viscous.{joint}.Fv[{level}]" for level in ("r1", "r2") for joint in JOINTS]
    assert all(d["delta_rms"] < -5.0 * d["se"] for d in document["differences"])
    assert file.read_text().startswith("# kept\n")
    effects = sysid.load(file).model.effects
    assert sorted((e.name, e.per) for e in effects) == [
        ("coulomb", None),
        ("payload", "payload"),
        ("viscous", "robot"),
    ]


@pytest.mark.long
def test_a_diagnosis_holds_the_model_at_each_log_s_levels(tmp_path, planar):
    """An arm with a payload in one log and without in the other, and a spring on its elbow in both:
    the payload is known, the spring is what is missing."""
    (tmp_path / "robot.urdf").write_text(PLANAR)
    for k, (name, load) in enumerate({"empty": None, "loaded": LOAD}.items()):
        for n, part in enumerate(("train", "test")):
            file = tmp_path / f"{name}_{part}.csv"
            written(planar, file, 2 * k + n, load=load)
            log = pl.read_csv(file)
            spring = pl.col("tau_elbow") + 1.5 * pl.col("q_elbow")
            log.with_columns(spring.alias("tau_elbow")).write_csv(file)
    given = {
        "robot": {"urdf": "robot.urdf"},
        "data": {
            "train": ["*_train.csv"],
            "test": ["*_test.csv"],
            "groups": {"payload": {"none": ["empty_*"], "held": ["loaded_*"]}},
        },
        "model": {"effects": ["viscous", "coulomb", PER_PAYLOAD[2]]},
    }
    (tmp_path / "config.yaml").write_text(dump(given))
    found = sysid.diagnose(sysid.load(tmp_path))
    verdict = {v["joint"]: v for v in statement(found, "run")["verdict"]}
    assert verdict["elbow"]["status"] == "missing" and verdict["elbow"]["effect"] == "spring"
    assert "missing" != verdict["shoulder"]["status"] != "unknown"
    mass = found.fit.x[found.fit.model.names.index("payload.*.m[held]")]
    assert abs(mass - LOAD[0]) < 0.1 * LOAD[0]


@pytest.mark.long
def test_a_known_payload_is_no_fault_of_the_logs(folder, cli):
    """Check's own equations have what the experiment says differs: without it the heavy payload
    looks like a torque that was never there."""
    limited = folder / "limited.urdf"
    limited.write_text((folder / "robot.urdf").read_text().replace('effort="50"', 'effort="12"'))
    for per, status in ((True, 0), (False, 1)):
        effects = PER_PAYLOAD if per else ["viscous", "coulomb"]
        (folder / "checked.yaml").write_text(dump(tree(effects, robot={"urdf": "limited.urdf"})))
        said = cli("check", folder / "checked.yaml", "--json")
        faults = {fault["fault"] for fault in json.loads(said.out)["faults"]}
        assert (said.status, "commanded_torque" in faults) == (status, not per), faults


@pytest.mark.long
def test_a_motion_is_designed_for_one_level(folder, cli, tmp_path):
    """What the level's own parameters gain is more than what others do, which learn of the bodies
    alone."""
    cli("design", folder, "--out", tmp_path / "next", "--level", "payload=four").complains("four")
    how = ("--duration", "2", "--processes", "1", "--level", "payload=three", "--json")
    document = json.loads(cli("design", folder, "--out", tmp_path / "next", *how).out)
    (told,) = [notice for notice in document["notices"] if "is designed for" in notice]
    assert told.startswith("the motion is designed for robot r1; --level robot=LEVEL (r2)")
    stds = document["expected_std"].items()
    left = {name: own["after"] / own["now"] for name, own in stds if own["now"]}
    for joint in JOINTS:
        assert left[f"viscous.{joint}.Fv[r1]"] < left[f"viscous.{joint}.Fv[r2]"] <= 1.0
    assert left["payload.*.m[three]"] < left["payload.*.m[one]"] <= 1.0


def test_the_report_says_what_differs(folder, tmp_path):
    """The table of levels, and a chart whose rows are joints and levels."""
    fit = sysid.fit(sysid.load(folder))
    made = parameters(fit)
    body = made.html()
    assert "<summary>per robot</summary>" in body and "from r1" in body
    assert "elbow [r2]" in str(made.charts[0])


def test_what_is_no_column_may_differ_too(folder, tmp_path):
    """An encoder that was mounted 20 mrad off on one of two robots: a value that the torque is not
    linear in, at each level, and their difference with its deviation."""
    (tmp_path / "robot.urdf").write_text((folder / "robot.urdf").read_text())
    (tmp_path / "r1.csv").write_text((folder / "none_train.csv").read_text())
    moved = pl.read_csv(folder / "none_test.csv").with_columns(pl.col("q_elbow") + 0.02)
    moved.write_csv(tmp_path / "r2.csv")
    offset = {"encoder_offset": {"joints": ["elbow"], "per": "robot", "except": ["r1"]}}
    given = tree(["viscous", "coulomb", offset])
    groups = {"robot": {"r1": ["r1.csv"], "r2": ["r2.csv"]}}
    given["data"] = {"train": ["r1.csv", "r2.csv"], "test": ["r1.csv"], "groups": groups}
    found = sysid.fit(config.experiment(given, tmp_path / "config.yaml"))
    (name,) = (value.name for value in found.model.shape_values)
    assert name.startswith("encoder_offset.elbow.") and name.endswith("[r2]")
    assert abs(abs(found.model.shapes[0]) - 0.02) < 4.0 * found.shape_std[0] < 0.004
    (own,) = parameters_per_group(found)
    assert own.levels == ("r2",) and own.std[0] == found.shape_std[0]
