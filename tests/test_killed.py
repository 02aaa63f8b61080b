"""Killed at any moment, two at once, no room, no right to write, no home: nothing half-written, nothing lost, and the next run works."""

import gzip
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from sysid import loop, pipeline, results
from sysid.errors import SysidError
from tests.conftest import CONFIG, dump, put

ROOT = Path(__file__).resolve().parent.parent
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

TEXT = "# what I know of this arm\n" + dump(put(CONFIG, {})) + "# and what I do not\n"
COMMANDS = {
    "fit": ["fit", "{0}"],
    "add": ["add", "{0}", "torque_bias", "--force"],
    "discover": ["discover", "{0}", "--max-steps", "1"],
    "diagnose": ["diagnose", "{0}"],
    "bodies": ["study", "bodies", "--bodies", "40", "--jobs", "1"],
    "restarts": ["study", "restarts", "{0}", "--restarts", "3"],
    "simulate": ["simulate", "{0}", "--duration", "2", "--force"],
    "studio": ["studio", "{0}", "--no-browser", "--port", "0"],
}


def begun(words, folder: Path, out: Path, **more) -> subprocess.Popen:
    command = [sys.executable, "-m", "sysid", *(word.format(folder) for word in words), "--quiet", "--out", str(out)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **more.pop("environment", {})}
    return subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True, **more)


def ended(work: subprocess.Popen) -> str:
    _, said = work.communicate(timeout=120)
    return said.decode(errors="replace")


def killed(words, folder: Path, out: Path, after: float) -> None:
    """Run a command and kill it, with all that it began, after some seconds or when it is done."""
    work = begun(words, folder, out)
    try:
        work.wait(after)
    except subprocess.TimeoutExpired:
        os.killpg(work.pid, signal.SIGKILL)
    work.communicate(timeout=60)


def sound(folder: Path, out: Path) -> None:
    """The experiment is one, with the user's words; every file of the run folder is whole."""
    text = (folder / "config.yaml").read_text()
    assert text.startswith("# what I know of this arm\n") and "# and what I do not" in text
    names = [e.name for e in pipeline.load(folder).model.effects]
    assert names[:2] == ["viscous", "coulomb"] and len(set(names)) == len(names)
    assert {p.name for p in folder.iterdir() if not p.name.startswith(".")} <= {"config.yaml", "robot.urdf", "train.csv", "test.csv", "runs"}
    for file in out.rglob("*") if out.is_dir() else ():
        if file.name.startswith(".") or not file.is_file():
            continue  # under another name until it is whole
        if file.suffix == ".json":
            json.loads(file.read_text())
        if file.suffix == ".yaml" and file.name != "trajectory.yaml":
            pipeline.load(file)
        if file.suffix == ".parquet":
            import polars

            polars.read_parquet(file)
    for step in loop.read_history(out):
        assert (out / step["folder"] / "fit.json").is_file()


def survived(name: str, folder: Path, tmp_path: Path, moments) -> None:
    for after in moments:
        out = tmp_path / f"run_{name}" if name != "simulate" else tmp_path / "simulated"
        killed(COMMANDS[name], folder, out, after)
        sound(folder, out)
        # what was added by one that had its time is taken back, so that each has work to do
        (folder / "config.yaml").write_text(TEXT)
    if name == "studio":
        return
    last = begun(COMMANDS[name], folder, out)
    said = ended(last)
    assert last.returncode in (0, 1) and "internal error" not in said, said
    sound(folder, out)


def length(name: str, folder: Path, out: Path) -> float:
    """How long a command takes [s]."""
    begin = time.monotonic()
    work = begun(COMMANDS[name], folder, out)
    ended(work)
    return time.monotonic() - begin


@pytest.mark.long
@pytest.mark.parametrize("name", ["add"])
def test_killed_at_some_moments(experiment, tmp_path, name):
    """A few moments, spread over a run; the study below takes a hundred of every command."""
    folder = experiment(config=TEXT)
    whole = length(name, folder, tmp_path / "first")
    (folder / "config.yaml").write_text(TEXT)
    survived(name, folder, tmp_path, [share * whole for share in (0.8, 0.97)])


@pytest.mark.study
@pytest.mark.parametrize("name", COMMANDS)
def test_killed_at_a_hundred_moments(experiment, tmp_path, name):
    folder = experiment(config=TEXT)
    whole = 6.0 if name == "studio" else length(name, folder, tmp_path / "first")
    (folder / "config.yaml").write_text(TEXT)
    rng = random.Random(name)
    # half of them where files are written, at the end
    survived(name, folder, tmp_path, [whole * (rng.uniform(0.0, 1.05) if k % 2 else rng.uniform(0.8, 1.05)) for k in range(100)])


@pytest.mark.long
def test_killed_between_any_two_writes(experiment, tmp_path):
    """`add` ends before each of its renames in turn: what stands then is whole, and the next run puts it right."""
    folder = experiment(config=TEXT)
    code = (
        "import os, sys\nfrom pathlib import Path\nfrom sysid import loop\nat, count, replace = int(sys.argv[1]), [0], os.replace\n"
        "def counted(*given, **how):\n    if count[0] == at: os._exit(9)\n    count[0] += 1\n    replace(*given, **how)\n"
        "os.replace = counted\nloop.add(Path(sys.argv[2]), 'torque_bias', ['elbow'], {}, force=True, out=Path(sys.argv[3]))\nprint(count[0])\n"
    )
    run = lambda at, out: subprocess.run([sys.executable, "-c", code, str(at), folder, out], cwd=ROOT, capture_output=True, text=True)  # noqa: E731
    writes = int(run(10**6, tmp_path / "counted").stdout)
    assert writes > 10
    for at in (6, writes - 1):
        (folder / "config.yaml").write_text(TEXT)
        out = tmp_path / f"run_{at}"
        assert run(at, out).returncode == 9
        sound(folder, out)
        assert (folder / "config.yaml").read_text() == TEXT  # it comes last
        loop.add(folder, "cogging", ["elbow"], {}, force=True, out=out)
        assert [s["added"] for s in loop.read_history(out)] == [None, "cogging"]
        assert not [p for p in folder.iterdir() if p.name.startswith(".config")]


def test_two_at_once(experiment, tmp_path):
    """Of two additions at once either both stand, or one says that the file changed."""
    folder = experiment(config=TEXT)
    words = [["add", "{0}", word, "--force"] for word in ("torque_bias", "cogging")]
    both = [begun(w, folder, tmp_path / "run") for w in words]
    said = [ended(work) for work in both]
    names = [e.name for e in pipeline.load(folder).model.effects][2:]
    kept = [word for (_, _, word, _), work in zip(words, both) if work.returncode == 0]
    assert sorted(names) == sorted(kept) and kept, said
    assert all(work.returncode == 0 or "changed while" in text for work, text in zip(both, said)), said
    sound(folder, tmp_path / "run")
    assert [s["added"] for s in loop.read_history(tmp_path / "run")][-1] == names[-1]


@pytest.mark.long
def test_a_full_disk(experiment, tmp_path):
    """Files may not grow beyond some kB: what stood stands, one line, and the next run with room works."""
    folder = experiment(config=TEXT)
    full = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))  # noqa: E731
    for words in (COMMANDS["fit"], COMMANDS["add"]):
        work = begun(words, folder, tmp_path / "run", preexec_fn=full)
        said = ended(work)
        assert work.returncode == 2 and said.count("\n") == 1 and "cannot be written (" in said and "internal" not in said, said
        assert (folder / "config.yaml").read_text() == TEXT
        assert not [p for p in (tmp_path / "run").rglob("*") if p.is_file()]
    assert ended(begun(COMMANDS["add"], folder, tmp_path / "run")) == ""
    sound(folder, tmp_path / "run")


def test_a_folder_that_may_only_be_read(experiment, cli, tmp_path):
    folder = experiment(config=TEXT)
    folder.chmod(0o555)
    try:
        if os.access(folder, os.W_OK):
            pytest.skip("this user may write anywhere")
        assert cli("fit", folder, "--quiet").status == 0  # the run folder is elsewhere
        said = cli("add", folder, "torque_bias", "--force")
        assert said.status == 2 and "cannot be written" in said.err
    finally:
        folder.chmod(0o755)
    assert (folder / "config.yaml").read_text() == TEXT


@pytest.mark.long
def test_a_file_that_cannot_be_replaced_leaves_the_history(experiment, cli, monkeypatch, tmp_path):
    """The same for root: the last write fails, and what was told of it before is taken back."""
    from sysid import experiment_file

    folder = experiment(config=TEXT)
    cli("add", folder, "cogging", "--force", "--quiet")
    text = (folder / "config.yaml").read_text()

    def refuse(path, before, after):
        raise SysidError("cannot be written (Read-only file system)", where=str(path))

    monkeypatch.setattr(experiment_file, "replace", refuse)
    said = cli("add", folder, "torque_bias", "--force")
    assert said.status == 2 and "Read-only" in said.err and (folder / "config.yaml").read_text() == text
    assert [s["added"] for s in loop.read_history(tmp_path / "run")] == [None, "cogging"]


def test_without_a_home(experiment, tmp_path):
    folder = experiment(config=TEXT)
    nobody = {"HOME": "/nonexistent", "XDG_STATE_HOME": "", "XDG_CACHE_HOME": "", "XDG_CONFIG_HOME": ""}
    for words in (COMMANDS["fit"], COMMANDS["add"]):
        work = begun(words, folder, tmp_path / "run", environment=nobody)
        assert ended(work) == "" and work.returncode == 0
    assert np.isfinite(json.loads((tmp_path / "run" / "fit.json").read_text())["objective"])
    sound(folder, tmp_path / "run")
    assert not (folder / "nonexistent").exists() and not Path("~").exists()


@pytest.mark.long
def test_nothing_is_left_in_the_temporary_folder(experiment, arm_logs, tmp_path):
    """A packed log, in spans: both are in temporary files, which a killed fit leaves and the next one removes; and no other's."""
    folder, tmp = experiment(config=TEXT), tmp_path / "temporary"
    tmp.mkdir()
    for part in ("train", "test"):
        (folder / f"{part}.csv.gz").write_bytes(gzip.compress((folder / f"{part}.csv").read_bytes(), 1))
        (folder / f"{part}.csv").unlink()
    (folder / "config.yaml").write_text(TEXT.replace(".csv", ".csv.gz"))
    code = (
        "import os, sys\nfrom sysid import pipeline, results, spans\nspans.SPAN = 300\nfit = pipeline.fit(pipeline.load(sys.argv[1]))\n"
        "if len(sys.argv) > 2: os.kill(os.getpid(), 9)\n"
    )
    run = lambda *more: subprocess.run([sys.executable, "-c", code, folder, *more], cwd=ROOT, env={**os.environ, "TMPDIR": str(tmp)}).returncode  # noqa: E731
    assert run("killed") == -signal.SIGKILL
    left = [p.name for p in tmp.iterdir() if p.name.startswith(".sysid.")]
    assert left and all(p.stat().st_mode & 0o77 == 0 for p in tmp.iterdir() if p.name in left)
    alive = tmp / left[0].replace(left[0].split("-")[1], str(os.getpid()))
    strange = tmp / left[0].replace(left[0].split("-")[0], ".sysid.0123abcd")  # of another machine or container
    alive.mkdir()
    strange.mkdir()
    assert run() == 0
    assert {p.name for p in tmp.iterdir() if p.name.startswith(".sysid.")} == {alive.name, strange.name}


def test_no_diagnosis_of_another_model_is_left_by_a_kill(experiment, monkeypatch, tmp_path):
    """After each rename of a fit in turn: where fit.json is the new one, the old diagnosis is gone. A refused write keeps it."""
    folder, out = experiment(config=TEXT), tmp_path / "run"
    fit = pipeline.fit(pipeline.load(folder))
    results.write(fit, out)
    old, replace = (out / "fit.json").read_text().replace('"value": ', '"value": 1'), os.replace
    for at in range(6):
        (out / "fit.json").write_text(old)
        (out / "diagnosis.json").write_text("{}")
        count = [0]

        def counted(*given, at=at, count=count):
            replace(*given)
            if count[0] == at:
                raise KeyboardInterrupt
            count[0] += 1

        monkeypatch.setattr(os, "replace", counted)
        with pytest.raises(KeyboardInterrupt) if at < 5 else nullcontext():
            results.write(fit, out)
        assert not (out / "diagnosis.json").exists() or (out / "fit.json").read_text() == old
    monkeypatch.undo()
    (out / "fit.json").write_text(old)
    (out / "diagnosis.json").write_text("{}")
    monkeypatch.setattr(os, "fsync", lambda file: os.strerror(os.close(10**6)))  # a disk that refuses
    with pytest.raises(SysidError, match="cannot be written"):
        results.write(fit, out)
    assert (out / "diagnosis.json").exists() and (out / "fit.json").read_text() == old


@pytest.mark.long
def test_a_killed_init_leaves_nothing(experiment, tmp_path):
    """What it worked in goes with the next run."""
    folder = experiment(config=TEXT)
    code = (
        "import os, sys\nfrom pathlib import Path\nfrom sysid import init\n"
        "def ended(*given): os._exit(9)\n"
        "if len(sys.argv) > 3: os.replace = ended\n"
        "init.init(sys.argv[1] + '/robot.urdf', [sys.argv[1] + '/train.csv', sys.argv[1] + '/test.csv'], Path(sys.argv[2]))\n"
    )
    out = tmp_path / "new"
    run = lambda *more: subprocess.run([sys.executable, "-c", code, folder, out, *more], cwd=ROOT).returncode  # noqa: E731
    assert run("killed") == 9 and not (out / "config.yaml").exists()
    assert run() == 0 and pipeline.load(out)
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]
