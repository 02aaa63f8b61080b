"""Sentences that stopped a reader stay mended, and complaints speak of what was typed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sysid import vocabulary
from sysid.statement import text

ROOT = Path(__file__).resolve().parent.parent
#: what readers did not understand, or what is not so
GONE = (
    "each alone added to the model", "foretell", "all that these logs can tell", "structure is left beside it", "whatever balances the rest", "pale dots are said",
    "what a study had finished", "a wrist's motor, or",
)  # fmt: skip


@pytest.mark.parametrize("words", GONE)
def test_a_sentence_that_was_mended_is_gone(words):
    for path in [*(ROOT / "sysid").rglob("*"), *(ROOT / "docs").glob("*.md"), ROOT / "README.md"]:
        if path.suffix in (".py", ".md", ".html", ".js"):
            lines = path.read_text().splitlines()
            told = " ".join(line for line in lines if not line.lstrip().startswith("#"))
            assert words not in " ".join(told.lower().split()), path


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["stribek"], "sysid: there is no effect 'stribek'; allowed: stribeck"),
        (["stribeck", "--joint", "elbo"], "sysid: stribeck names the joint 'elbo'; allowed: shoulder, elbow"),
        (["stribeck", "--option", "foo=1"], "sysid: unknown option 'foo'; allowed: vs, joints"),
        (["formula", "--option", "formula=a*sin(3*z)"], "sysid: sin(3 * z) in the formula holds nothing"),
        (["viscous"], "sysid: viscous is in the model already"),
    ],
)
def test_what_was_typed_wrongly_is_said_without_a_line_of_a_file(experiment, cli, words, said):
    answer = cli("add", experiment(), *words)
    answer.complains()
    assert answer.err.startswith(said) and "model.effects" not in answer.err and "line" not in answer.err, answer.err


def test_a_number_without_unit_has_none():
    assert text.valued("mu", {"value": 0.09757, "std": 0.0019, "unit": "1"}) == "mu = 0.09757 +- 0.0019"
    assert text.valued("b", {"value": 2.0, "std": None, "unit": "N m"}) == "b = 2 N m (held)"


def test_effects_speak_of_any_joint():
    assert "joint's motor" in vocabulary.describe(vocabulary.find("joint_coupling"))["summary"]


def test_ctrl_c_while_a_library_begins_is_an_interrupt(monkeypatch, cli, experiment):
    """It says that it cannot begin; of any other reason that is an error."""
    from sysid import pipeline

    def begins(reason):
        def load(*_, **__):
            try:
                raise reason
            except BaseException as error:
                raise ImportError("initialization failed") from error

        return load

    folder = experiment()
    monkeypatch.setattr(pipeline, "load", begins(KeyboardInterrupt()))
    said = cli("fit", folder)
    assert (said.status, said.err.splitlines()[-1]) == (130, "sysid: interrupted; nothing was written")
    monkeypatch.setattr(pipeline, "load", begins(ValueError("no")))
    said = cli("fit", folder)
    assert said.status == 1 and "internal error, ImportError" in said.err


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(("command", "kept"), [("discover", "the steps that were shown are kept"), ("diagnose", "nothing was written")])
def test_ctrl_c_says_what_is_kept(experiment, tmp_path, command, kept):
    folder = experiment()
    work = subprocess.Popen(
        [sys.executable, "-m", "sysid", command, str(folder), "--out", str(tmp_path / "run")], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    end = time.monotonic() + 20
    while not (tmp_path / "run").is_dir() and time.monotonic() < end:  # made before any work
        time.sleep(0.01)
    time.sleep(0.3)
    os.kill(work.pid, signal.SIGINT)
    _, said = work.communicate(timeout=30)
    # Python ends itself by the signal, 130 to a shell, where it came while an import ran a string as code
    assert work.returncode in (130, -signal.SIGINT) and said.splitlines()[-1] == f"sysid: interrupted; {kept}", said
