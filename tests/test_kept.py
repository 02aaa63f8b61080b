"""What a user wrote is never lost: two at once, edits meanwhile, links, modes, line ends; steps and simulations."""

import gc
import json
import os
import stat
import warnings

import pytest

from sysid import effect_entry, experiment_file, loop, pipeline, simulate, state, whole_files
from sysid.errors import SysidError
from tests.conftest import URDF

TEXT = "robot: {urdf: robot.urdf}\n# mine\nmodel:\n  effects: [viscous, coulomb]\n"


def meanwhile(monkeypatch, act):
    """Lets something happen while `add` fits."""
    fit = pipeline.fit

    def slow(*given, **how):
        act()
        return fit(*given, **how)

    monkeypatch.setattr(pipeline, "fit", slow)


def test_an_edit_made_while_add_runs_is_kept(experiment, cli, monkeypatch):
    folder = experiment(config=TEXT)
    file = folder / "config.yaml"
    edited = TEXT.replace("# mine", "# thought of something")
    meanwhile(monkeypatch, lambda: file.write_text(edited))
    said = cli("add", folder, "torque_bias", "--force")
    said.complains("changed while", str(file), "run the command again")
    assert file.read_text() == edited


@pytest.mark.long
def test_of_two_additions_at_once_none_is_lost(experiment, cli, monkeypatch, tmp_path):
    folder = experiment(config=TEXT)
    fit, busy = pipeline.fit, []

    def other(*given, **how):
        if not busy:
            busy.append(True)
            loop.add(folder, "cogging", ["elbow"], {}, force=True, out=tmp_path / "run")
        return fit(*given, **how)

    monkeypatch.setattr(pipeline, "fit", other)
    said = cli("add", folder, "torque_bias", "--force")
    assert said.status == 2 and "changed while" in said.err
    names = [e.name for e in pipeline.load(folder).model.effects]
    assert names == ["viscous", "coulomb", "cogging"]
    assert [s["added"] for s in loop.read_history(tmp_path / "run")] == [None, "cogging"]
    assert cli("add", folder, "torque_bias", "--force", "--quiet").status == 0
    assert [s["added"] for s in loop.read_history(tmp_path / "run")] == [None, "cogging", "torque_bias"]


def test_link_mode_mark_and_line_ends_stay(experiment, cli, tmp_path):
    folder = experiment(config=TEXT)
    real = tmp_path / "elsewhere" / "real.yaml"
    real.parent.mkdir()
    real.write_bytes(b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode())
    real.chmod(0o640)
    (folder / "config.yaml").unlink()
    (folder / "config.yaml").symlink_to(real)
    assert cli("add", folder, "torque_bias", "--force", "--quiet").status == 0
    assert (folder / "config.yaml").is_symlink()
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    wanted = TEXT.replace("coulomb]", "coulomb, torque_bias]").replace("\n", "\r\n")
    assert real.read_bytes() == b"\xef\xbb\xbf" + wanted.encode()
    assert [path.name for path in real.parent.iterdir()] == ["real.yaml"]


@pytest.mark.parametrize(
    ("before", "after", "wanted"),
    [
        (b"a\r\nb\nc\r\n", "a\nb\nc\nd\n", b"a\r\nb\nc\r\nd\r\n"),  # each line keeps its own end
        (b"a\nb", "a\nb\nc\n", b"a\nb\nc\n"),
        (b"\xef\xbb\xbfa\n", "b\n", b"\xef\xbb\xbfb\n"),
        (b"", "a\n", b"a\n"),
        ("a: ä\r\n".encode(), "a: ä\n", "a: ä\r\n".encode()),
    ],
)
def test_what_is_not_the_change_stays(before, after, wanted):
    assert experiment_file.edited(before, after) == wanted


def test_a_change_of_another_text_is_refused(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_bytes(b"theirs")
    with pytest.raises(experiment_file.Changed):
        experiment_file.replace(file, b"mine", b"new")
    assert file.read_bytes() == b"theirs"


def test_a_lock_keeps_others_out_and_its_holder_in(tmp_path, monkeypatch):
    import subprocess
    import sys

    monkeypatch.setattr(state, "_WAIT", 0.2)
    code = "import sys; from sysid import state; state._WAIT = 0.2\nwith state.locked(sys.argv[1]): pass"
    with state.locked(tmp_path / "x"), state.locked(tmp_path / "x"):
        other = subprocess.run([sys.executable, "-c", code, tmp_path / "x"], capture_output=True, text=True)
    assert other.returncode == 1 and "another sysid is writing it" in other.stderr
    assert subprocess.run([sys.executable, "-c", code, tmp_path / "x"]).returncode == 0


@pytest.mark.parametrize("home", ["/nonexistent", ""])
def test_without_a_home_locks_are_kept_elsewhere(tmp_path, monkeypatch, home):
    monkeypatch.setenv("XDG_STATE_HOME", home)
    monkeypatch.setenv("HOME", home)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write anywhere
    assert state.folder("locks") is None
    with state.locked(tmp_path / "x"):
        pass


def test_where_no_lock_can_be_had_work_goes_on(tmp_path, monkeypatch):
    import filelock

    def refuse(*given, **how):
        raise OSError(37, "No locks available")

    monkeypatch.setattr(filelock.FileLock, "acquire", refuse)
    with state.locked(tmp_path / "x"):
        pass


# ---- the studio


def test_the_studio_keeps_what_is_not_its_change(experiment, tmp_path):
    from sysid.studio.history import History, hashed

    folder = experiment(config=TEXT)
    real = tmp_path / "real.yaml"
    before = b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode()
    real.write_bytes(before)
    real.chmod(0o640)
    (folder / "config.yaml").unlink()
    (folder / "config.yaml").symlink_to(real)
    history = History(folder, tmp_path / "run")
    seen = history.sync()
    now = history.change(seen, lambda text: effect_entry.with_effect(text, "cogging", ["elbow"], {}), "cogging", "elbow")
    assert (folder / "config.yaml").is_symlink() and stat.S_IMODE(real.stat().st_mode) == 0o640
    lines = real.read_bytes().splitlines(keepends=True)
    assert lines[0].startswith(b"\xef\xbb\xbf") and all(line.endswith(b"\r\n") for line in lines) and len(lines) >= 4
    assert now == hashed(history.text())
    history.undo(now)
    assert real.read_bytes() == before
    # what another wrote meanwhile stays
    real.write_bytes(before + b"# theirs\r\n")
    with pytest.raises(experiment_file.Changed):
        history.change(seen, lambda text: text + "# ours\n", "x", None)
    assert real.read_bytes().endswith(b"# theirs\r\n")


@pytest.mark.parametrize("effect", ["cogging", "gravity_tilt"])
def test_a_star_in_the_studio_is_every_joint_or_the_whole_robot(experiment, tmp_path, monkeypatch, effect):
    from sysid.studio.session import Session

    folder = experiment(config=TEXT)
    monkeypatch.setattr(Session, "_ensure", lambda self, sha: None)
    session = Session(folder, tmp_path / "run")
    session.add(session.history.sync(), {"effect": effect, "joint": "*"})
    _, model, _ = pipeline.build(pipeline.load(folder))
    assert model.terms[-1][0].name == effect and (folder / "config.yaml").read_text() == TEXT.replace("coulomb]", f"coulomb, {effect}]")


# ---- a run folder


def test_files_that_belong_together_come_together_or_not_at_all(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_text("old")

    def full(path):
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(SysidError, match="No space left"):
        whole_files.write_together({one: lambda p: p.write_text("new"), two: full})
    assert one.read_text() == "old" and [p.name for p in tmp_path.iterdir()] == ["one"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device here")
def test_a_full_disk_under_parquet_is_said_in_one_line(tmp_path):
    import polars

    write = whole_files.parquet(polars.DataFrame({"a": list(range(5000))}))
    with pytest.raises(OSError, match="No space left"):
        write("/dev/full")


# ---- steps


def test_a_discovery_that_fails_leaves_the_steps(experiment, cli, monkeypatch):
    folder = experiment(config=TEXT)
    made = cli("add", folder, "torque_bias", "--force", "--quiet")
    before = {p.relative_to(made.run): p.read_bytes() for p in made.run.rglob("*") if p.is_file()}

    def broken(*given, **how):
        raise SysidError("no")

    monkeypatch.setattr(loop, "diagnose", broken)
    assert cli("discover", folder).status == 2
    assert {p.relative_to(made.run): p.read_bytes() for p in made.run.rglob("*") if p.is_file()} == before


@pytest.mark.long
def test_a_discovery_goes_on_from_what_was_added(experiment, cli):
    folder = experiment(config=TEXT)
    cli("add", folder, "torque_bias", "--joint", "*", "--force", "--quiet")
    said = json.loads(cli("discover", folder, "--max-steps", "0", "--json").out)
    assert [s["added"] for s in said["steps"]] == [None, "torque_bias"]
    run = folder.parent / "run"
    assert [s["added"] for s in loop.read_history(run)] == [None, "torque_bias"]
    assert all((run / s["folder"] / "fit.json").is_file() for s in said["steps"])


@pytest.mark.parametrize("effect", ["cogging", "gravity_tilt"])
def test_a_star_is_every_joint_or_the_whole_robot(experiment, cli, effect):
    folder = experiment(config=TEXT)
    said = cli("add", folder, effect, "--joint", "*", "--force", "--json")
    assert said.status == 0, said.err
    assert (folder / "config.yaml").read_text() == TEXT.replace("coulomb]", f"coulomb, {effect}]")


def test_a_star_in_the_file_is_no_joint(experiment, cli):
    folder = experiment(config={"model.effects": ["viscous", {"cable": {"joints": ["*"]}}]})
    cli("fit", folder).complains("cable names the joint '*'", "shoulder, elbow")


# ---- simulations


def test_a_simulation_that_was_worked_in_is_left_alone(cli, tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    bench, out = tmp_path / "arm.yaml", tmp_path / "log"
    bench.write_text("robot: {urdf: arm.urdf}\n")
    again = ("simulate", bench, "--duration", "1", "--quiet")
    assert cli(*again, out=out).status == 0
    assert cli(*again, out=out).status == 0  # nothing was done in it
    config = out / "config.yaml"
    config.write_text(config.read_text() + "# what I found\n")
    refused = cli(*again, out=out)
    assert refused.status == 2 and "config.yaml" in refused.err and "--force" in refused.err
    assert "# what I found" in config.read_text()
    # of one whose files nobody knows any more, the config may be anybody's work
    truth = json.loads((out / "truth.json").read_text())
    (out / "truth.json").write_text(json.dumps({k: v for k, v in truth.items() if k != "files"}))
    assert cli(*again, out=out).status == 2
    assert cli(*again, "--force", out=out).status == 0 and "# what I found" not in config.read_text()
    assert simulate.prepare(out) == out


# ---- fetching


@pytest.fixture
def published(tmp_path, monkeypatch):
    """A data set on this machine, and the folder that it comes to."""
    import hashlib
    import threading
    from functools import partial
    from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

    from sysid import datasets

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *given):
            pass

    served = tmp_path / "served"
    served.mkdir()
    (served / "log.csv").write_bytes(b"t,q\n" * 1000)
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=served))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    sha = hashlib.sha256((served / "log.csv").read_bytes()).hexdigest()
    source = f"http://127.0.0.1:{server.server_port}"
    own = datasets.Dataset("mine", "", "", "", source, {"log.csv": ("log.csv", sha)}, {}, None)
    monkeypatch.setitem(datasets.DATASETS, "mine", own)
    yield served
    server.shutdown()
    server.server_close()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # of an answer that requests left unread
        gc.collect()


def test_fetch_shows_its_progress_without_another_package(published, cli, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "tqdm", None)
    told = []
    from sysid.datasets import DATASETS

    monkeypatch.setenv("SYSID_DATA_DIR", str(tmp_path / "data"))
    (file,) = DATASETS["mine"].fetch(progress=lambda stage, share: told.append((stage, share)))
    assert file.read_bytes() == (published / "log.csv").read_bytes()
    assert told[-1] == ("fetch log.csv", 1.0)


def test_fetch_says_what_is_wrong(published, cli, tmp_path):
    (published / "log.csv").write_bytes(b"another")
    said = cli("fetch", "mine", out=tmp_path / "data")
    assert said.status == 2 and "network" not in said.err and "run it again" in said.err
    (published / "log.csv").unlink()
    said = cli("fetch", "mine", out=tmp_path / "data")
    assert said.status == 2 and "network" in said.err


# ---- the lines of a file that the change does not touch


STYLES = {
    "deep lists": "robot:\n    urdf: robot.urdf\ndata:\n    train:\n        - train.csv      # the long one\n    test:\n        -   test.csv\nmodel:\n    effects:\n        - viscous\n\n        # after March\n        - coulomb\nprior: {weight:   1.0e-2}\n",
    "flat lists": "model:\n  effects:\n  - viscous\n  - coulomb\nrobot:   {urdf: 'robot.urdf'}\n",
    "flow": "robot:   {urdf: robot.urdf}   # mine\nmodel: {effects: [viscous,   coulomb]}\n",
    "nested": "model:\n   effects:\n      - viscous\n      - stribeck:\n            joints: [elbow]\n   inertia: log-cholesky\n",
    "last": "robot:\n    urdf: robot.urdf\nmodel:\n    effects:\n        - viscous",
}


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(("effect", "joints"), [("torque_bias", None), ("cogging", ["elbow"]), ("stribeck", ["shoulder"])])
def test_lines_that_do_not_change_stay_as_they_were(style, effect, joints):
    from sysid import yaml_text

    text = STYLES[style]
    changed = effect_entry.with_effect(text, effect, joints, {})
    before, after = (yaml_text.plain(yaml_text.parse_yaml(t, where="")) for t in (text, changed))
    assert {k: v for k, v in after.items() if k != "model"} == {k: v for k, v in before.items() if k != "model"}
    entries = [e if isinstance(e, str) else next(iter(e)) for e in after["model"]["effects"]]
    assert effect in entries and "viscous" in entries
    lines = changed.splitlines()
    touched = [line for line in text.splitlines() if line not in lines]
    assert len(touched) <= 1 and all("effects" in line or "joints" in line for line in touched), changed
