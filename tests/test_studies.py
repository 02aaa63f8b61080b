"""The paper's studies: their equations against Pinocchio, their bookkeeping against a killed process."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from sysid.config import load
from sysid.datasets import DATASETS
from sysid.inertia import is_consistent, pseudo
from sysid.studies import bodies, body_motions, commands
from sysid.studies.journal import Journal

ROOT = Path(__file__).resolve().parent.parent
LEG = ROOT / "configs" / "cheetah3.yaml"


def quiet(stage, share):
    """Progress that nobody watches."""


def without_timings(value):
    """A document without what a clock put into it."""
    if isinstance(value, dict):
        return {k: without_timings(v) for k, v in value.items() if "seconds" not in k}
    return [without_timings(v) for v in value] if isinstance(value, list) else value


def test_residual_wrench_is_the_paper_s_equation_12():
    rng = np.random.default_rng(0)
    for _ in range(20):
        pi = body_motions.draw(rng, "com")
        inertia = pin.Inertia.FromDynamicParameters(pseudo.to_pinocchio(pi))
        velocity, acceleration = rng.normal(size=(2, 6))
        v = pin.Motion(velocity[3:], velocity[:3])
        expected = inertia * pin.Motion(acceleration[3:], acceleration[:3]) + v.cross(inertia * v)
        got = np.einsum("rkn,k->rn", body_motions.columns(velocity[:, None], acceleration[:, None]), pi)[:, 0]
        np.testing.assert_allclose(got, np.concatenate([expected.angular, expected.linear]), rtol=1e-11, atol=1e-12)


def test_simulated_body_obeys_the_discretized_equation():
    """Without noise the midpoint residual of the truth is the discretization's, and small against the wrench."""

    class Silent:
        def uniform(self, low, high, shape):
            return np.zeros(shape)

    rng = np.random.default_rng(1)
    for kind in ("moment and force", "force only"):
        pi = body_motions.draw(rng, "com")
        rows, target = body_motions.measured(pi, Silent(), kind)
        assert rows.shape == (6 * 62, 10)
        assert np.linalg.norm(rows @ pi - target) < 0.02 * np.linalg.norm(target)


@pytest.mark.parametrize("about", ["com", "origin"])
def test_bodies_are_those_of_table_one(about):
    rng = np.random.default_rng(2)
    drawn = np.array([body_motions.draw(rng, about) for _ in range(300)])
    assert is_consistent(drawn).all()
    mass, com, central = pseudo.to_central(drawn)
    assert 0.01 <= mass.min() and mass.max() <= 1.0 and np.abs(com).max() <= 0.5
    second = central if about == "com" else pseudo.rotational_inertia(drawn)
    moments = np.linalg.eigvalsh(0.5 * np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second)
    assert 0.01 - 1e-9 <= moments.min() and moments.max() <= 1.0 + 1e-9
    if about == "com":
        assert abs(mass.mean() - 0.505) < 0.06 and abs(moments.mean() - 0.505) < 0.04


def test_every_start_is_the_identity():
    from sysid.inertia import PARAMETERIZATIONS

    for name in bodies.NONLINEAR:
        np.testing.assert_allclose(PARAMETERIZATIONS[name]().parameters(bodies.start(name)), body_motions.IDENTITY, atol=1e-14)


@pytest.mark.long
def test_study_of_bodies_is_what_the_paper_compares(tmp_path):
    found = commands.study_bodies(tmp_path, count=40, seed=5, jobs=1, reading=bodies.Reading(), progress=quiet)
    assert found["bodies"] == 40 and set(found["parameterizations"]) == set(bodies.NONLINEAR)
    assert 0 < found["linear"]["nonphysical"] < 0.5 and found["linear"]["negative_mass"] == 0
    # about the centre of mass the theorem and J > 0 are one: each impossible body violates a triangle inequality
    assert found["linear"]["triangle_violated"] == found["linear"]["nonphysical_count"]
    entries = found["parameterizations"]
    assert entries["eigenvalue"]["median_iterations"] > entries["log-cholesky"]["median_iterations"]
    for entry in entries.values():
        assert len(entry["iterations"]) == 40 and max(entry["iterations"]) <= 50 and entry["stopped_elsewhere"] <= 2
    conditions = [entry["condition"]["eigenvalue"] for entry in found["sweep"]]
    assert conditions[-1] is None and conditions[-2] > 1e5  # singular at symmetry, and on the way there
    assert all(entry["condition"]["log-cholesky"] < 1e3 for entry in found["sweep"])
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"journal.jsonl", "study.json", "bodies.parquet", "figure1_iterations.png", "figure1_iterations.svg", "symmetric_bodies.png", "symmetric_bodies.svg"}


@pytest.mark.long
def test_killed_and_resumed_is_byte_identical(tmp_path):
    command = [sys.executable, "-m", "sysid", "study", "restarts", str(LEG), "--restarts", "12", "--json", "--out"]
    whole = subprocess.run([*command, str(tmp_path / "whole")], cwd=ROOT, capture_output=True, text=True, check=True)
    journal = tmp_path / "cut" / "journal.jsonl"
    process = subprocess.Popen([*command, str(tmp_path / "cut")], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None and not (journal.exists() and journal.read_bytes().count(b"\n") >= 3):
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.wait()
    finished = journal.read_bytes().count(b"\n") - 1
    assert 2 <= finished < 12
    with journal.open("a") as file:
        file.write('{"key": "9", "resu')  # half a line, as a kill in the middle of a write leaves
    again = subprocess.run([*command, str(tmp_path / "cut")], cwd=ROOT, capture_output=True, text=True, check=True)
    strip = lambda text: json.dumps(without_timings(json.loads(text)))  # noqa: E731
    assert strip(again.stdout) == strip(whole.stdout)
    assert journal.read_bytes().count(b"\n") == 13


def test_interruption_is_one_line_and_keeps_what_was_done(tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-m", "sysid", "study", "bodies", "--bodies", "4000", "--jobs", "1", "--out", str(out)]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    journal, deadline = out / "journal.jsonl", time.monotonic() + 60
    while time.monotonic() < deadline and not (journal.exists() and journal.read_bytes().count(b"\n") >= 2):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    said, complaint = process.communicate(timeout=60)
    assert process.returncode == 130 and said == "" and complaint.count("sysid: interrupted") == 1
    # before it nothing but how far it is, which a slow machine is told every few seconds
    *progress, last = complaint.splitlines()
    assert last.startswith("sysid: interrupted") and all(line.startswith("sysid: bodies, ") for line in progress)
    assert journal.read_bytes().count(b"\n") >= 2


@pytest.mark.long
def test_number_of_processes_does_not_matter(tmp_path):
    found = [commands.study_bodies(tmp_path / str(jobs), count=12, seed=3, jobs=jobs, reading=bodies.Reading(), progress=quiet) for jobs in _made(tmp_path, (1, 2))]
    assert without_timings(found[0]) == without_timings(found[1])


def _made(folder, names):
    for name in names:
        (folder / str(name)).mkdir()
        yield name


def test_journal_with_other_settings_starts_anew(tmp_path):
    first = Journal(tmp_path / "j", {"seed": 1})
    first.add("a", {"x": 0.1})
    first.close()
    same = Journal(tmp_path / "j", {"seed": 1})
    assert same.done == {"a": {"x": 0.1}}
    same.close()
    other = Journal(tmp_path / "j", {"seed": 2})
    assert other.done == {}
    other.close()


@pytest.mark.long
@pytest.mark.parametrize("inertia", ["log-cholesky", "exponential", "eigenvalue"])
def test_restarts_end_in_one_certified_point(tmp_path, inertia):
    spec = load(LEG)
    spec = spec.model_copy(update={"model": spec.model.model_copy(update={"inertia": inertia})})
    found = commands.study_restarts(spec, tmp_path, count=20 if inertia == "log-cholesky" else 4, seed=0, jobs=1, progress=quiet)
    assert found["converged"] == found["globally_optimal"] == found["restarts"]
    assert found["relative_spread"] < 1e-9
    assert len({f"{rms:.3e}" for rms in found["rms_test"]}) == 1
    if inertia == "log-cholesky":
        assert min(found["initial_rms_train"]) > 1e3
    assert (tmp_path / "figure3_restarts.svg").exists() and (tmp_path / "restarts.parquet").exists()


@pytest.mark.long
def test_newton_alone_in_log_cholesky_coordinates_ends_there_too(tmp_path):
    """The paper's claim itself: without the interior-point method, every start still reaches the one optimum."""
    spec = load(LEG)
    solver = spec.solver.model_copy(update={"handover": 0.0, "max_iterations": 3000})
    stiff = spec.model_copy(update={"solver": solver, "prior": spec.prior.model_copy(update={"weight": 10.0})})
    found = commands.study_restarts(stiff, tmp_path, count=4, seed=1, jobs=1, progress=quiet)
    assert found["converged"] == found["globally_optimal"] == 4 and found["relative_spread"] < 1e-9
    assert found["newton_iterations"] == found["iterations"]


@pytest.mark.long
def test_restarts_on_a_real_robot(tmp_path):
    if DATASETS["ur10e"].missing():
        pytest.skip("ur10e is not in the data folder; `sysid fetch ur10e` brings it, or SYSID_DATA_DIR names where it is")
    found = commands.study_restarts(load(ROOT / "configs" / "ur10e.yaml"), tmp_path, count=20, seed=0, jobs=1, progress=quiet)
    assert found["converged"] == found["globally_optimal"] == 20 and found["relative_spread"] < 1e-9
    assert len({f"{rms:.3e}" for rms in found["rms_test"]}) == 1


def test_prior_weight_by_cross_validation(tmp_path):
    """Held-out error must rise for a prior that is far too strong, and each weight's folds must cover every row once."""
    found = commands.study_prior(load(LEG), tmp_path, jobs=1, progress=quiet)
    rms = dict(zip(found["weights"], found["rms_held_out"]))
    assert rms[found["chosen"]] == min(rms.values()) and rms[1e6] > 1.05 * min(rms.values())
    assert found["chosen"] <= found["largest_within_one_se"] and found["experiment_weight"] in rms
    assert abs(rms[1e-2] / 1.45 - 1) < 0.02
    assert (tmp_path / "prior_weight.png").exists()


@pytest.mark.long
def test_study_mistakes_are_one_line(tmp_path):
    for arguments in (["study", "bodies", "--about", "elsewhere"], ["study", "restarts", str(LEG), "--inertia", "magic"], ["study", "restarts", "nowhere.yaml"], ["study", "bodies", "--bodies", "0"]):
        done = subprocess.run([sys.executable, "-m", "sysid", *arguments, "--out", str(tmp_path / "out")], cwd=ROOT, capture_output=True, text=True, env=os.environ)
        assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1, done.stderr
        assert done.stderr.startswith("sysid: ")
