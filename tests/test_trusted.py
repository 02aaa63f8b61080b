"""Python that an experiment names runs where it was allowed, and nowhere else."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import sysid
from sysid import pipeline, trusted
from tests.conftest import dump

OWN = """
from pathlib import Path
from sysid.effect import Linear, TorqueEffect

Path(__file__).with_name("ran").touch()

class Squeak(TorqueEffect):
    c = Linear("N m", says="size")

    def columns(self, motion, joint):
        return motion.qdd[None, :, joint] ** 3
"""
ENTRY = {"mine.py:Squeak": {"joints": ["elbow"]}}


@pytest.fixture(autouse=True)
def nobody(monkeypatch, tmp_path):
    """Nothing is remembered and nothing was allowed."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(trusted, "_ALLOWED", set())


@pytest.fixture
def stranger(experiment):
    """A stranger's folder: an experiment that names a Python file."""
    folder = experiment(config={"model.effects": ["viscous", "coulomb", ENTRY]})
    (folder / "mine.py").write_text(OWN)
    return folder


@pytest.mark.parametrize("command", ["fit", "check", "diagnose", "report", "discover", "compare", "studio"])
def test_nothing_runs_that_was_not_allowed(stranger, cli, command):
    said = cli(command, stranger)
    assert said.status == 2 and len(said.err.splitlines()) == 1 and said.out == "", said.err
    assert "mine.py" in said.err and "--trust" in said.err and not (stranger / "ran").exists()


def test_a_candidate_or_an_effect_to_add_is_no_exception(experiment, cli):
    folder = experiment(config={"model.candidates": ["mine.py:Squeak"]})
    (folder / "mine.py").write_text(OWN)
    assert cli("diagnose", folder).status == 2
    cli("add", folder, "mine.py:Squeak", "--joint", "elbow").complains("--trust")
    assert not (folder / "ran").exists()


def test_it_is_allowed_once_for_each_content(stranger, cli, tmp_path, monkeypatch):
    assert cli("fit", stranger, "--trust", "--quiet").status == 0 and (stranger / "ran").exists()
    monkeypatch.setattr(trusted, "_ALLOWED", set())  # another process
    assert cli("fit", stranger, "--quiet").status == 0
    # remembered with the user, not in the folder
    assert sorted(p.name for p in stranger.iterdir()) == ["config.yaml", "mine.py", "ran", "robot.urdf", "test.csv", "train.csv"]
    (stranger / "mine.py").write_text(OWN + "\n# more\n")
    (stranger / "ran").unlink()
    assert cli("fit", stranger).status == 2 and not (stranger / "ran").exists()


def test_from_python_too(stranger):
    with pytest.raises(trusted.Untrusted, match="sysid.trust"):
        sysid.fit(sysid.load(stranger))
    sysid.trust(stranger / "mine.py")
    assert sysid.fit(sysid.load(stranger)).solution.converged
    with pytest.raises(sysid.SysidError, match="cannot be read"):
        sysid.trust(stranger / "none.py")


def test_where_nothing_can_be_remembered_it_runs_this_once(stranger, cli, monkeypatch):
    monkeypatch.setattr("sysid.state.folder", lambda name: None)
    assert cli("fit", stranger, "--trust", "--quiet").status == 0


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="no terminal of this kind")
@pytest.mark.parametrize(("answer", "status"), [(b"y\n", 0), (b"\n", 2)])
def test_who_is_there_is_asked(stranger, tmp_path, answer, status):
    import pty

    master, terminal = pty.openpty()
    command = [sys.executable, "-m", "sysid", "fit", str(stranger), "--json", "--out", str(tmp_path / "run")]
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")}
    root = Path(sysid.__file__).parent.parent
    work = subprocess.Popen(command, stdin=terminal, stderr=terminal, stdout=subprocess.PIPE, env=environment, cwd=root)
    os.close(terminal)
    shown = b""
    while b"[y/N]" not in shown:
        shown += os.read(master, 1000)
    os.write(master, answer)
    out = work.stdout.read()
    assert work.wait() == status and b"mine.py" in shown
    os.close(master)
    work.stdout.close()
    assert (stranger / "ran").exists() == (status == 0)
    assert not out if status else json.loads(out)["converged"]


def test_the_studio_runs_a_neighbour_s_file_only_where_it_was_allowed(experiment, stranger, cli, monkeypatch):
    from sysid.studio import serve
    from sysid.studio.experiments import Experiments, beside

    (stranger / "config.yaml").rename(stranger / "theirs.yaml")
    own = stranger / "mine.yaml"
    own.write_text(dump({"robot": {"urdf": "robot.urdf"}}))
    monkeypatch.setattr(serve, "serve", lambda path, **how: None)
    assert cli("studio", own).status == 0 and not (stranger / "ran").exists()
    experiments = Experiments(beside(own), stranger.parent / "run")
    theirs = experiments.names.index("theirs")
    job = experiments.session(theirs).run()["job"]
    while (job := experiments.session(theirs).state()["job"])["state"] == "running":
        pass
    assert job["state"] == "failed" and "--trust" in job["error"] and not (stranger / "ran").exists()
    assert cli("studio", own, "--trust").status == 0
    pipeline.build(pipeline.load(stranger / "theirs.yaml"))
    assert (stranger / "ran").exists()
