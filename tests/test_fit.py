"""From a URDF and a log to a run folder: the leg, and what is written about it."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import polars as pl
import pytest
import yourdfpy

import sysid
from sysid import config, regressor, results, robot, vocabulary
from sysid.inertia import PARAMETERS, pseudo

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def leg():
    return sysid.fit(sysid.load(ROOT / "configs" / "cheetah3.yaml"))


@pytest.fixture(scope="module")
def run(leg, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "cheetah3"
    return out, sysid.write(leg, out)


def test_leg_reaches_its_noise(leg, run):
    truth = json.loads((ROOT / "data" / "cheetah3" / "truth.json").read_text())
    _, document = run
    noise = truth["torque_noise_std"]
    for joint, rms in document["rms"]["test"].items():
        assert abs(rms / noise - 1) < 0.02, joint
    assert document["physically_consistent"] and document["converged"]
    assert document["certificate"]["globally_optimal"]
    assert len(document["parameters"]) == 66
    assert document["samples"] == {"train": 27901, "test": 27901}
    assert [entry["name"] for entry in document["parameters"][:3]] == ["abad.m", "abad.hx", "abad.hy"]
    assert document["parameters"][-1]["name"] == "coulomb.knee.Fc"


def test_objective_is_equation_14(leg, run):
    _, document = run
    prediction = leg.predictions["train"]
    prior = leg.model.robot.prior
    divergence = 0.0
    for pi, reference in zip(leg.pi, prior):
        j, j0 = pseudo.to_pseudo(pi), pseudo.to_pseudo(reference)
        divergence += -math.log(np.linalg.det(j) / np.linalg.det(j0)) + np.trace(np.linalg.solve(j0, j)) - 4
    expected = np.sum((prediction.measured - prediction.predicted) ** 2) + 1e-2 * divergence
    np.testing.assert_allclose(document["objective"], expected, rtol=1e-10)


def test_run_folder_is_complete_and_readable(leg, run):
    out, document = run
    assert sorted(p.name for p in out.iterdir()) == ["experiment.yaml", "fit.json", "identified.urdf", "identified.yaml", "predictions.parquet"]
    assert json.loads((out / "fit.json").read_text()) == json.loads(json.dumps(document))
    table = pl.read_parquet(out / "predictions.parquet")
    test = table.filter(pl.col("part") == "test")
    rms = float(np.sqrt(np.mean((test["measured_hip"] - test["predicted_hip"]).to_numpy() ** 2)))
    np.testing.assert_allclose(rms, document["rms"]["test"]["hip"], rtol=1e-12)
    again = sysid.fit(sysid.load(out / "experiment.yaml"))
    np.testing.assert_allclose(again.x, leg.x, rtol=1e-12)
    for log in document["logs"]:
        assert len(log["sha256"]) == 64
    assert document["versions"]["pin"] == pin.__version__


def test_identified_urdf_gives_the_fit_s_torque(leg, run):
    out, document = run
    spec = config.load(out / "identified.yaml")
    machine = robot.load(spec.robot, spec.folder)
    prediction = leg.predictions["test"]
    motion = _test_motion(leg)
    torque = regressor.torque(machine, machine.prior, motion.q, motion.qd, motion.qdd)
    torque += machine.damping * motion.qd + machine.friction * np.sign(motion.qd)
    np.testing.assert_allclose(torque, prediction.predicted, atol=1e-9)
    # and with Pinocchio alone, on the links; the rotors come from the fit
    model = pin.buildModelFromUrdf(str(out / "identified.urdf"))
    assert [model.names[1:][k] for k in range(3)] == ["abad", "hip", "knee"]
    values = {entry["name"]: entry["value"] for entry in document["parameters"]}
    pi = leg.pi.copy()
    read = {link.name: link.inertial for link in yourdfpy.URDF.load(out / "identified.urdf", load_meshes=False, build_scene_graph=False).robot.links}
    for b, body in enumerate(leg.model.robot.bodies[:3]):
        mass, com, central = pseudo.to_central(leg.pi[b])
        np.testing.assert_allclose(read[body.name].mass, mass, rtol=1e-12)
        np.testing.assert_allclose(read[body.name].origin[:3, 3], com, rtol=1e-12)
        np.testing.assert_allclose(read[body.name].inertia, central, rtol=1e-9, atol=1e-15)
        theirs = pseudo.from_pinocchio(model.inertias[b + 1].toDynamicParameters())
        np.testing.assert_allclose(theirs, [values[f"{body.name}.{p}"] for p in PARAMETERS], rtol=1e-10, atol=1e-14)
        pi[b] = theirs
    rotors_only = np.concatenate([np.zeros((3, 10)), pi[3:]])
    data = model.createData()
    links = np.array([pin.rnea(model, data, *row) for row in zip(motion.q, motion.qd, motion.qdd)])
    total = links + regressor.torque(leg.model.robot, rotors_only, motion.q, motion.qd, motion.qdd)
    total += model.damping * motion.qd + model.lowerDryFrictionLimit * 0 + machine.friction * np.sign(motion.qd)
    np.testing.assert_allclose(total, prediction.predicted, atol=1e-9)


def test_identified_urdf_says_what_it_cannot_say_and_keeps_mesh_names(leg, tmp_path):
    """In a comment; package:// stays, a mesh beside the source is named from where the file will stand."""
    from dataclasses import replace

    from sysid.urdf_export import identified_urdf, text

    said = identified_urdf(leg).decode()
    comment = said[said.index("<!--") : said.index("-->")]
    assert "hip_rotor: 0.5" in comment and "kg m^2 about hip" in comment and "coulomb" not in comment
    source = leg.model.robot.source
    meshes = "".join(f'<visual><geometry><mesh filename="{name}"/></geometry></visual>' for name in ("package://leg/meshes/a.stl", "meshes/b.stl"))
    shaped = replace(source, text=source.text.replace('<link name="abad">', f'<link name="abad">{meshes}', 1))
    machine = replace(leg.model.robot, source=shaped)
    model = replace(leg.model, robot=machine, terms=(*leg.model.terms, (vocabulary.find("armature"), (1,)), (vocabulary.find("stribeck"), (0,))), shapes=(0.2,))
    found = replace(leg, model=model, x=np.append(leg.x, [0.05, 1.5]))
    said = identified_urdf(found, tmp_path).decode()
    assert "armature.hip: Ia = 0.05 kg m^2" in said and "stribeck.abad: dF = 1.5 N m, vs = 0.2 rad/s" in said
    assert 'filename="package://leg/meshes/a.stl"' in said
    (near,) = [word for word in said.split('"') if word.endswith("b.stl")]
    assert (tmp_path / near).resolve() == (source.path.parent / "meshes" / "b.stl").resolve()
    from lxml import etree

    odd = etree.ElementTree(etree.Element("robot"))
    assert etree.fromstring(text(odd, "a--b---")).tag == "robot"


def _test_motion(fit):
    from sysid import experiment_logs, filters
    from sysid.preprocess import prepare

    experiment, machine = fit.experiment, fit.model.robot
    logs = experiment_logs.read(experiment, machine, experiment.data.test)
    (piece,) = prepare(logs, filters.settled(experiment.preprocess, fit.filters), machine.joints).pieces
    return piece


def test_locked_joints_and_welded_links_are_exported_as_one_body(tmp_path):
    """A Panda with fingers locked open: its URDF must give the torque of the composite bodies."""
    from dataclasses import replace

    from sysid.urdf_export import identified_urdf
    from tests.problems import arm_log, compress, prepare
    from tests.test_inertia import random_bodies

    names = [f"panda_joint{k}" for k in range(1, 8)]
    spec = config.experiment({
        "robot": {"urdf": "example-robot-data://panda_description/urdf/panda.urdf", "joints": names, "lock": {"panda_finger_joint1": 0.03}},
    })  # fmt: skip
    from sysid.estimate import identify
    from sysid.listed_effects import build

    machine = robot.load(spec.robot)
    structure = build(machine, spec.model.effects)
    motion = prepare([arm_log(machine, np.random.default_rng(0), seconds=5)], spec.preprocess, machine.joints)
    fit = identify(spec, structure, motion, compress(structure, motion), np.array(machine.prior))
    x = np.append(random_bodies(7, seed=5).ravel(), np.arange(1.0, 15.0))
    fit = replace(fit, x=x)
    path = tmp_path / "identified.urdf"
    path.write_bytes(identified_urdf(fit))
    model = pin.buildModelFromUrdf(str(path))
    assert list(model.names[1:]) == names
    q, qd, qdd = np.random.default_rng(1).normal(size=(3, 20, 7))
    data = model.createData()
    expected = np.array([pin.rnea(model, data, *row) for row in zip(q, qd, qdd)])
    np.testing.assert_allclose(regressor.torque(machine, fit.pi, q, qd, qdd), expected, atol=1e-9)
    np.testing.assert_allclose(model.damping, np.arange(1.0, 8.0))


def test_a_previous_run_is_a_prior(leg, run, tmp_path):
    out, _ = run
    text = (ROOT / "configs" / "cheetah3.yaml").read_text().replace("../data/", f"{ROOT}/data/").replace("source: urdf", f"source: {out}")
    (tmp_path / "again.yaml").write_text(text)
    from sysid import pipeline

    _, _, prior = pipeline.build(sysid.load(tmp_path / "again.yaml"))
    np.testing.assert_allclose(prior, leg.pi, rtol=1e-14)


def test_compare_says_what_a_richer_model_gains(leg, tmp_path):
    text = (ROOT / "configs" / "cheetah3.yaml").read_text().replace("../data/", f"{ROOT}/data/")
    assert "effects: [viscous, coulomb]" in text
    (tmp_path / "frictionless.yaml").write_text(text.replace("effects: [viscous, coulomb]", "effects: []"))
    poor = sysid.fit(sysid.load(tmp_path / "frictionless.yaml"))
    for difference in sysid.compare(poor, leg):
        assert difference.from_ == "frictionless" and difference.to == "cheetah3"
        assert difference.delta_rms < -5 * difference.se < 0
    assert all(d.delta_rms == 0 and d.se == 0 for d in sysid.compare(leg, leg))


def test_standard_error_of_a_difference_is_its_scatter():
    """Two models whose residuals differ by known noise: the jackknife against the scatter over repeats."""
    from sysid.comparison import _block_sums, _jackknife
    from sysid.prediction import Prediction

    rng = np.random.default_rng(0)
    deltas, errors = [], []
    t = np.arange(4000) * 0.01
    for _ in range(200):
        shared, extra = rng.normal(size=(2, 4000, 1))
        both = [Prediction(np.zeros(4000, np.int16), t, residual, np.zeros_like(residual), None) for residual in (shared, shared + 0.3 * extra)]
        delta, se = _jackknife(*((s[:, 0], n[:, 0]) for s, n in _block_sums(both, [[0], [0]])))
        deltas.append(delta)
        errors.append(se)
    np.testing.assert_allclose(np.median(errors), np.std(deltas), rtol=0.15)


def test_blocks_stand_where_they_are_whatever_a_filter_leaves_out():
    """The same residual, cut at the ends as by a wider filter: block by block the same squares."""
    from sysid.comparison import _block_sums
    from sysid.prediction import Prediction

    t, residual = np.arange(1000) * 0.01, np.random.default_rng(1).normal(size=(1000, 1))
    kept = (slice(0, 1000), slice(130, 1000))
    both = [Prediction(np.zeros(1000, np.int16)[k], t[k], residual[k], np.zeros_like(residual[k]), None) for k in kept]
    (whole, _), (cut, counts) = _block_sums(both, [[0], [0]])
    inside = np.flatnonzero(counts[:, 0] == counts.max())
    assert len(whole) == 20 and cut[0] == cut[1] == 0 and list(inside) == list(range(3, 20))
    np.testing.assert_allclose(cut[inside], whole[inside])


def test_predict_on_any_log(leg):
    prediction = sysid.predict(leg, "../data/cheetah3/test.parquet")
    np.testing.assert_allclose(prediction.predicted, leg.predictions["test"].predicted, rtol=1e-12)


def test_results_are_never_half_written(leg, tmp_path, monkeypatch):
    out = tmp_path / "run"
    def full(path, content):
        with open(path, "wb") as file:
            file.write(content[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(sysid.SysidError, match="No space left"):
        results.write(leg, out)
    assert list(out.iterdir()) == []  # all of them or none, and nothing temporary


def test_the_command_prints_one_json_document(tmp_path):
    command = [sys.executable, "-m", "sysid", "fit", str(ROOT / "configs" / "cheetah3.yaml"), "--json", "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    document = json.loads(done.stdout)
    assert document["run"] == str(tmp_path / "run") and done.stderr == ""
    assert set(document) >= {"rms", "objective", "iterations", "converged", "physically_consistent", "certificate", "samples", "parameters", "seconds", "run"}
    assert set(document["seconds"]) >= {"read", "compress", "solve"}


def test_a_search_that_is_cut_short_ends_with_status_one(tmp_path):
    text = (ROOT / "configs" / "cheetah3.yaml").read_text().replace("../data/", f"{ROOT}/data/").replace("max_iterations: 200", "max_iterations: 2")
    (tmp_path / "short.yaml").write_text(text)
    command = [sys.executable, "-m", "sysid", "fit", str(tmp_path / "short.yaml"), "--json", "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 1
    document = json.loads(done.stdout)
    assert document["converged"] is False and document["certificate"]["globally_optimal"] is False


def test_a_previous_run_with_other_locks_is_refused(run, tmp_path):
    """A locked link is part of the body that carries it: under the same name it is another body."""
    from sysid import pipeline

    out, _ = run
    text = (ROOT / "configs" / "cheetah3.yaml").read_text().replace("../data/", f"{ROOT}/data/").replace("source: urdf", f"source: {out}")
    (tmp_path / "locked.yaml").write_text(text)
    spec = sysid.load(tmp_path / "locked.yaml")
    locked = spec.robot.model_copy(update={"joints": ["abad", "hip"], "rotors": spec.robot.rotors[:2]})
    with pytest.raises(sysid.SysidError, match="previous run moved"):
        pipeline.build(spec.model_copy(update={"robot": locked}))


def test_a_locked_joint_that_shares_its_link_s_name():
    spec = config.load(ROOT / "configs" / "cheetah3.yaml")
    leg = spec.robot.model_copy(update={"joints": ["hip", "knee"], "rotors": spec.robot.rotors[1:]})
    machine = robot.load(leg, spec.folder)
    assert [body.name for body in machine.bodies] == ["thigh", "shank", "hip_rotor", "knee_rotor"]


def test_without_a_prior_what_no_data_see_stays_where_it_was():
    spec = config.load(ROOT / "configs" / "cheetah3.yaml")
    linear = {"model": spec.model.model_copy(update={"inertia": "linear"}), "prior": spec.prior.model_copy(update={"weight": 0.0})}
    fit = sysid.fit(spec.model_copy(update=linear))
    x = dict(zip(fit.model.names, fit.x))
    assert abs(x["abad.m"] - 1.5) < 0.5 and np.abs(fit.x).max() < 100
    if not fit.physically_consistent:
        assert any("impossible bodies" in notice for notice in fit.notices)


def test_what_python_sees(leg):
    """Names appear, packages are called by their own name, and a result says what it is in a line."""
    assert {"load", "check", "fit", "diagnose", "compare", "predict", "write"} <= set(dir(sysid)) and all(hasattr(sysid, name) for name in sysid.__all__)
    assert all(getattr(sysid, name).__doc__ for name in sysid.__all__)
    assert repr(leg).startswith("<Fit of cheetah3: 66 parameters, converged, proven optimal; RMS on the test logs: abad ") and len(repr(leg)) < 200
    frame = leg.to_dataframe()
    assert frame.columns == ["name", "value", "unit", "std", "from_data"] and len(frame) == len(leg.x)
    assert frame["value"].to_list()[:10] == leg.x[:10].tolist()
    figure = leg.plot()
    assert len(figure.axes) == 3 and len(figure.axes[0].lines) == 2
    assert sysid.check(leg.experiment) == []


def test_threads_of_the_linear_algebra_are_tamed_unless_the_user_says_otherwise(monkeypatch):
    from threadpoolctl import threadpool_info

    from sysid.threads import single_threaded

    counted = single_threaded(lambda: {info["num_threads"] for info in threadpool_info() if info["user_api"] == "blas"})
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    assert counted() == {1}
    before = {info["num_threads"] for info in threadpool_info() if info["user_api"] == "blas"}
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert counted() == before


def test_a_certificate_says_what_it_takes_as_given(leg):
    """Of a model with shape values only the rest is convex: what is proven is said to be so given these."""
    from types import SimpleNamespace

    from sysid.given_shapes import at_edge, given_shapes, said_of_shapes
    from sysid.multistart import Searched

    assert given_shapes(leg) == "" and said_of_shapes(leg) == []
    value = lambda name, held=False, start=None: SimpleNamespace(name=name, held=held, low=0.1, high=2.0, unit="1", shape=SimpleNamespace(start=start))  # noqa: E731
    values = value("a.hip.x"), value("a.hip.y"), value("b.hip.z"), value("c.hip.w", held=True)
    done = Searched("a.hip.x", 30, 9, False), Searched("a.hip.y", 30, 12, False), Searched("b.hip.z", 1, 8, True)
    fit = SimpleNamespace(model=SimpleNamespace(shape_values=values, shapes=(0.5, 2.0, 1.0, 0.1)), searched=done)
    assert given_shapes(fit) == "given the shape values"
    assert said_of_shapes(fit) == [
        "a.hip.x, a.hip.y: started from 30 places; the profile over each was checked at 9 to 12 values, and none lay lower",
        "b.hip.z: started where the effect does nothing; its profile was checked at 8 values, which led to a lower place, and the search went on there",
        "c.hip.w: held as the experiment says", "a.hip.y = 2 is at the edge of its range, 0.1 to 2: what it is may lie beyond, or it is another effect",
    ]  # fmt: skip
    assert not at_edge(value("x", start=0.1), 0.1) and at_edge(value("x"), 0.1) and not at_edge(value("x"), 0.11)
