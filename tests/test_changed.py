"""A fitted model, held, and a new log: what changed on it, and nothing where nothing did."""

import json

import numpy as np
import polars as pl
import pytest

from scripts.blind_parts.robots import PLANAR
from sysid import pipeline, regressor, results
from sysid.changes import changed, many
from sysid.changes.fitted import possible
from sysid.errors import ConfigError, LogError, SysidError
from sysid.inertia.pseudo import box, displaced
from sysid.statement.changes import document as changes_document
from tests.conftest import csv
from tests.test_lowpass import smooth

CHANGED_CONFIG = "robot: {urdf: robot.urdf}\ndata: {train: [train.csv], test: [test.csv]}\nmodel: {effects: [viscous, coulomb]}\n"
LOAD = np.array([0.8, 0.8 * 0.32, 0.0, 0.8 * 0.02, 0.002, 0.8 * 0.32**2 + 0.003, 0.8 * 0.32**2 + 0.003, 0.0, 0.0, 0.0])  # of the fore link's frame


def written(arm, path, seed: int, *, load=None, coulomb=(0.5, 0.3), bias=0.0, seconds: float = 12.0, pitch: float = 0.0):
    """A log of the planar arm, with a body on its last link, other friction, or a base that is turned about y."""
    t = np.arange(int(seconds * 250)) / 250.0
    q, qd, qdd = smooth(t, seed, 1.2)
    pi = np.array(arm.prior) * 1.1
    if load is not None:
        pi[-1] += load
    gravity = 9.81 * np.array([np.sin(pitch), 0.0, -np.cos(pitch)])
    tau = regressor.torque(arm, pi, q, qd, qdd, gravity=gravity) + 0.3 * qd + np.array(coulomb) * np.sign(qd) + [0.0, bias]
    tau += np.random.default_rng(seed).normal(0.0, 0.1, q.shape)
    columns = {"t": t} | {f"q_{joint}": q[:, j] for j, joint in enumerate(arm.joints)} | {f"tau_{joint}": tau[:, j] for j, joint in enumerate(arm.joints)}
    path.write_text(csv(columns))


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, planar):
    """An experiment, its run folder, and new logs of the robot: the same, with a payload, with more friction."""
    folder = tmp_path_factory.mktemp("changed")
    (folder / "config.yaml").write_text(CHANGED_CONFIG)
    (folder / "robot.urdf").write_text(PLANAR)
    written(planar, folder / "train.csv", 1)
    written(planar, folder / "test.csv", 2)
    written(planar, folder / "same.csv", 3)
    written(planar, folder / "loaded.csv", 4, load=LOAD)
    written(planar, folder / "rough.csv", 5, coulomb=(0.5, 0.9))
    written(planar, folder / "short.csv", 6, seconds=2.0)
    run = folder / "run"
    results.write(pipeline.fit(pipeline.load(folder)), run)
    return folder


def test_what_is_left_as_logged_is_what_the_fit_says(fitted):
    """Its own test log through its own filter: under another, the noise of the angles makes another error."""
    run = json.loads((fitted / "run" / "fit.json").read_text())["rms"]["test"]
    found = changed(pipeline.load(fitted), fitted / "run", [str(fitted / "test.csv")])
    assert found.changes == () and dict(zip(found.joints, found.left)) == pytest.approx(run, rel=1e-3)


def what_changed(folder, log: str) -> dict:
    said = changes_document(changed(pipeline.load(folder), folder / "run", [str(folder / log)]))
    json.dumps(said, allow_nan=False)
    assert [v["joint"] for v in said["verdict"]] == ["shoulder", "elbow"] == list(said["joints"])
    return said


def verdict(said: dict, joint: str) -> dict:
    (own,) = [v for v in said["verdict"] if v["joint"] == joint]
    return own


@pytest.mark.parametrize("pitch", [0.02, 0.2, -0.3])
def test_a_base_that_tilts_far_is_a_tilt_and_nothing_else(fitted, planar, pitch):
    """Its cosine is no bias of the torques; how far it is rolled, which no torque of an arm in a plane shows, is not told."""
    written(planar, fitted / "tilted.csv", 7, pitch=pitch)
    (found,) = what_changed(fitted, "tilted.csv")["findings"]
    assert (found["effect"], found["joint"]) == ("gravity_tilt", "*")
    values = found["parameters"]
    assert values["gravity_tilt.*.pitch"]["value"] == pytest.approx(pitch, abs=3.0 * values["gravity_tilt.*.pitch"]["std"] + 1e-3)
    assert values["gravity_tilt.*.pitch"]["std"] < 5e-3 and values["gravity_tilt.*.roll"]["std"] is None


def test_a_tilt_says_whose_encoder_may_be_it(fitted, planar):
    """An arm in a plane: a base that is turned about y, and a first encoder whose zero is off, are one."""
    written(planar, fitted / "tilted.csv", 7, pitch=0.05)
    said = what_changed(fitted, "tilted.csv")
    assert any("offset of the encoder of shoulder is the same as a tilt" in note for note in said["notices"])


def test_what_is_left_beside_a_change_and_what_may_be_it_are_said(fitted, planar):
    """A load, and an elbow's torque that has another sine of time: the load is told, and what is left; its link may be turned as well."""
    written(planar, fitted / "both.csv", 9, load=LOAD)
    table = pl.read_csv(fitted / "both.csv")
    table.with_columns(pl.col("tau_elbow") + 1.5 * (2.2 * pl.col("t")).sin()).write_csv(fitted / "both.csv")
    said = what_changed(fitted, "both.csv")
    assert [f["effect"] for f in said["findings"]] == ["payload"]
    own = verdict(said, "elbow")
    assert own["status"] == "missing" and own["times_noise"] > 2.0 and "something else did too" in own["says"]
    assert any("an offset of the encoder of elbow is the same as a load on its link" in note for note in said["notices"])
    assert "says" not in verdict(what_changed(fitted, "loaded.csv"), "elbow")


@pytest.mark.parametrize("offset", [0.03, -0.25, 0.8, -1.2])
def test_an_encoder_s_zero_that_was_set_anew_is_told_with_its_size(fitted, planar, offset):
    """However far: what it does bends with it."""
    written(planar, fitted / "zero.csv", 8)
    table = pl.read_csv(fitted / "zero.csv")
    table.with_columns(pl.col("q_elbow") - offset).write_csv(fitted / "zero.csv")
    (found,) = what_changed(fitted, "zero.csv")["findings"]
    assert (found["effect"], found["joint"]) == ("encoder_offset", "elbow")
    value = found["parameters"]["encoder_offset.elbow.d"]
    assert value["value"] == pytest.approx(offset, abs=3.0 * value["std"] + 1e-4) and value["std"] < 5e-3


def test_a_bucket_s_load_is_as_possible_as_a_finger_s():
    """What is believed of a load is as weak for a heavy one as for a light one: the same one in kilograms and tonnes comes out alike."""
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(400, 10)) * [1.0, 0.3, 0.3, 0.3, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
    body = displaced(box(1.0, np.zeros(3), (0.4, 0.5, 0.3)), np.eye(3), np.array([0.5, 0.1, -0.2]))
    noise, found = rng.normal(0.0, 0.05, 400), []
    for mass in (0.005, 1.0, 300.0):
        torque = columns @ (mass * body) + mass * noise
        rows = np.column_stack([columns, torque]) / (0.05 * mass)  # as loud as its noise
        found.append(possible(rows.T @ rows, list(range(10)), slice(0, 10))[0] / mass)
    np.testing.assert_allclose(found[0], found[1], atol=2e-3)
    np.testing.assert_allclose(found[2], found[1], atol=2e-3)


def test_no_change_no_finding(fitted):
    said = what_changed(fitted, "same.csv")
    assert said["findings"] == [] and {v["status"] for v in said["verdict"]} == {"complete"}


def test_a_payload_is_found_with_its_mass(fitted):
    said = what_changed(fitted, "loaded.csv")
    assert [f["effect"] for f in said["findings"]] == ["payload"]
    values = said["findings"][0]["parameters"]
    mass = values["payload.*.m"]
    assert mass["unit"] == "kg" and mass["std"] < 0.1 and abs(mass["value"] - LOAD[0]) < 3.0 * mass["std"] + 0.005
    for axis, true in zip("xz", (0.32, 0.02)):
        entry = values[f"payload.*.com_{axis}"]
        assert abs(entry["value"] - true) < 4.0 * entry["std"] + 0.01
    # across the plane no torque shows where it is: the prior's value, and no deviation of it
    untold = [name for name, entry in values.items() if entry["std"] is None]
    assert {f"payload.*.{name}" for name in ("hy", "com_y", "Ixy", "Iyz")} <= set(untold), untold
    assert not {f"payload.*.{name}" for name in ("m", "hx", "com_x", "com_z")} & set(untold)
    assert any("torque sensors" in notice for notice in said["notices"])
    assert {v["effect"] for v in said["verdict"]} == {"payload"}
    for entry in said["joints"].values():
        assert entry["rms"]["after"] < 0.3 * entry["rms"]["held"]


def test_friction_that_grew_is_named_on_its_joint(fitted):
    said = what_changed(fitted, "rough.csv")
    assert [(f["effect"], f["joint"]) for f in said["findings"]] == [("coulomb", "elbow")]
    value = said["findings"][0]["parameters"]["coulomb.elbow.Fc"]
    assert abs(value["value"] - 0.6) < 4.0 * value["std"] + 0.02
    assert verdict(said, "shoulder")["status"] == "complete" and verdict(said, "elbow")["effect"] == "coulomb"


def test_a_change_that_a_few_fast_moments_show_is_named(fitted, planar):
    """Three quarters of what more viscous friction takes lie in a tenth of the log: raw squares scatter, and every block says so."""
    experiment = pipeline.load(fitted)
    rate, rng = 250.0, np.random.default_rng(9)
    t = np.arange(int(24 * rate)) / rate
    slow = smooth(t, 9, 1.2)
    clock = np.cumsum(np.where((t % 12.0 > 5.0) & (t % 12.0 < 6.2), 3.0, 0.35)) / rate  # the same path, and now and then fast along it
    q = np.stack([np.interp(clock, t, own) for own in slow[0].T], axis=1)
    q = np.stack([np.convolve(np.pad(own, 40, mode="edge"), np.hanning(81) / np.hanning(81).sum(), "valid") for own in q.T], axis=1)
    qd, qdd = np.gradient(q, 1 / rate, axis=0), np.gradient(np.gradient(q, 1 / rate, axis=0), 1 / rate, axis=0)
    tau = regressor.torque(planar, np.array(planar.prior) * 1.1, q, qd, qdd) + np.array([0.3, 0.6]) * qd + np.array([0.5, 0.3]) * np.sign(qd)
    tau += rng.normal(0.0, 0.1, q.shape)
    columns = {"t": t} | {f"{key}_{joint}": own[:, j] for key, own in (("q", q), ("tau", tau)) for j, joint in enumerate(planar.joints)}
    (fitted / "fast.csv").write_text(csv(columns))
    found = changed(experiment, fitted / "run", [str(fitted / "fast.csv")])
    assert [(c.effect, c.joint) for c in found.changes] == [("viscous", "elbow")]


def test_a_change_within_the_log_is_said_to_be_left(fitted, planar):
    """Half a log has a bias, which neither half tells of the other: what is left is not called complete."""
    written(planar, fitted / "begins.csv", 8, bias=0.0, seconds=24.0)
    own = (fitted / "begins.csv").read_text().splitlines()
    at = own[0].split(",").index("tau_elbow")
    late = [line.split(",") for line in own[1:]]
    for row in late[len(late) // 2 :]:
        row[at] = str(float(row[at]) + 1.5)
    (fitted / "begins.csv").write_text("\n".join([own[0], *map(",".join, late)]) + "\n")
    said = what_changed(fitted, "begins.csv")
    assert said["findings"] == [] and verdict(said, "shoulder") == {"joint": "shoulder", "status": "complete"}
    assert verdict(said, "elbow")["status"] == "unresolved" and "times the noise" in verdict(said, "elbow")["says"]


def test_questions_about_a_change_that_cannot_be_asked(fitted, tmp_path):
    experiment = pipeline.load(fitted)
    log = [str(fitted / "same.csv")]
    other = tmp_path / "other"
    other.mkdir()
    (other / "robot.urdf").write_text(PLANAR.replace('"elbow"', '"wrist"'))
    (other / "config.yaml").write_text(CHANGED_CONFIG)
    for name in ("train", "test"):
        (other / f"{name}.csv").write_text((fitted / f"{name}.csv").read_text().replace("_elbow", "_wrist"))
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "fit.json").write_text("[]")
    for kind, asked, words in (
        (ConfigError, (experiment, tmp_path / "nothing", log), "run folder"),
        (ConfigError, (experiment, tmp_path / "broken", log), "no run folder"),
        (ConfigError, (pipeline.load(other), fitted / "run", log), "the run moved shoulder, elbow"),
        (SysidError, (experiment, fitted / "run", [str(fitted / "absent.csv")]), "absent.csv"),
        (LogError, (experiment, fitted / "run", [str(fitted / "short.csv")]), "too short"),
    ):
        with pytest.raises(kind, match=words) as caught:
            changed(*asked)
        assert "\n" not in str(caught.value)


def test_many_logs_are_asked_at_once(fitted, cli, tmp_path):
    logs = ["same.csv", "loaded.csv", "rough.csv", "short.csv"]
    done = cli("fleet", "--against", fitted / "run", *(fitted / log for log in logs), "--json")
    assert done.status == 0 and not done.err
    said = json.loads(done.out)
    assert json.loads((done.run / "against.json").read_text()) == said
    found = {log.rpartition("/")[2]: [(c["effect"], c["joint"]) for c in entry["changes"]] for log, entry in said["logs"].items()}
    assert found == {"same.csv": [], "loaded.csv": [("payload", "*")], "rough.csv": [("coulomb", "elbow")]}
    assert [f["log"].endswith("short.csv") for f in said["failed"]] == [True] and "too short" in said["failed"][0]["says"]
    one = what_changed(fitted, "loaded.csv")["findings"][0]["parameters"]
    (own,) = [entry for log, entry in said["logs"].items() if log.endswith("loaded.csv")]
    assert own["changes"][0]["parameters"]["payload.*.m"]["value"] == pytest.approx(one["payload.*.m"]["value"], rel=1e-9)
    assert cli("fleet", "--against", fitted / "run", fitted / "nothing*.csv").status == 2
    assert cli("fleet", fitted, "--level", "robot=r1").status == 2


@pytest.mark.long
def test_processes_change_nothing(fitted):
    logs = [str(fitted / log) for log in ("same.csv", "loaded.csv", "rough.csv", "test.csv", "train.csv")]
    logs += [
        f"{folder}/../{folder.split('/')[-1]}/{log}" for folder in [str(fitted)] for log in ("same.csv", "loaded.csv", "rough.csv", "test.csv", "train.csv")
    ]
    alone, together = (many(fitted / "run", logs, jobs=jobs)[0] for jobs in (1, 2))
    assert list(alone) == list(together) == logs
    for one, other in zip(alone.values(), together.values()):
        assert [c.effect for c in one.changes] == [c.effect for c in other.changes]
        np.testing.assert_allclose(one.rms_after, other.rms_after, rtol=1e-12)
