"""A diagnosis that exists is used again, and never one of something else."""

import json
import re
import shutil
import sys
from dataclasses import replace

import pytest

from sysid import pipeline, urdf_files
from sysid.cli import main
from sysid.diagnose.diagnosis import diagnose
from sysid.statement import kept
from tests.test_report import LOG, written


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An experiment and its diagnosis."""
    folder = written(tmp_path_factory.mktemp("reused") / "arm", 0.0)
    return folder, diagnose(pipeline.load(folder))


@pytest.fixture
def asked(arm, tmp_path, monkeypatch):
    """The experiment in a folder of its own; how often it was questioned from then on."""
    folder, count = shutil.copytree(arm[0], tmp_path / "arm"), []

    def counted(experiment, *, fit=None, progress=None):
        count.append(experiment.name)
        return replace(arm[1], fit=fit or pipeline.fit(experiment))

    monkeypatch.setattr(kept, "diagnose", counted)
    monkeypatch.chdir(tmp_path)
    return folder, count


def typed(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["sysid", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code in (0, None)
    return capsys.readouterr().out


@pytest.mark.long
def test_a_report_after_a_diagnosis_questions_nothing(asked, tmp_path, monkeypatch, capsys):
    _, count = asked
    said = json.loads(typed(monkeypatch, capsys, "report", "arm", "--json"))
    first = (tmp_path / "runs" / "arm" / "report.html").read_text()
    assert count == ["arm"] and f"Diagnosis of {said['diagnosed']}" in first
    again = json.loads(typed(monkeypatch, capsys, "report", "arm", "--json"))
    assert count == ["arm"] and again == said
    assert (tmp_path / "runs" / "arm" / "report.html").read_text() == first


def test_what_diagnose_wrote_is_what_the_report_shows(arm, asked, tmp_path, monkeypatch, capsys):
    from sysid.diagnose import diagnosis

    _, count = asked
    monkeypatch.setattr(
        diagnosis, "diagnose", lambda spec, progress=None: replace(arm[1], fit=pipeline.fit(spec))
    )
    said = json.loads(typed(monkeypatch, capsys, "diagnose", "arm", "--json"))
    report = json.loads(typed(monkeypatch, capsys, "report", "arm", "--json"))
    assert not count and report["diagnosed"] == said["made"]
    assert report["verdict"] == said["verdict"]


CHANGES = {
    "a key": lambda folder: swapped(folder / "config.yaml", "weight: 0.01", "weight: 0.02"),
    "a sample of a log": lambda folder: swapped(folder / LOG, r"\n0\.005,(-?[\d.]+)", "\n0.005,0.1"),
    "a test log": lambda folder: swapped(folder / "test.csv", r"\n0\.005,(-?[\d.]+)", "\n0.005,0.1"),
    "the URDF": lambda folder: swapped(folder / "robot.urdf", "</robot>", "<!-- --></robot>"),
}  # fmt: skip


def swapped(path, old, new):
    text = path.read_text()
    changed = re.sub(old, new, text, count=1)
    assert changed != text
    path.write_text(changed)


@pytest.mark.long
@pytest.mark.parametrize("what", CHANGES)
def test_what_changed_is_questioned_anew(asked, tmp_path, what):
    folder, count = asked
    kept.diagnosed(pipeline.load(folder), tmp_path / "run")
    CHANGES[what](folder)
    kept.diagnosed(pipeline.load(folder), tmp_path / "run")
    assert len(count) == 2


def test_a_comment_or_a_newer_date_changes_nothing(asked, tmp_path):
    folder, count = asked
    kept.diagnosed(pipeline.load(folder), tmp_path / "run")
    with (folder / "config.yaml").open("a") as file:
        file.write("# a thought\n")
    (folder / "test.csv").touch()
    kept.diagnosed(pipeline.load(folder), tmp_path / "run")
    assert len(count) == 1


@pytest.mark.long
@pytest.mark.parametrize("edit", [
    lambda text: text.replace('"complete"', '"missing"'), lambda text: text[: len(text) // 2],
    lambda text: "{}", lambda text: "[]", lambda text: "[" * 100_000,
])  # fmt: skip
def test_a_file_that_was_edited_or_cut_is_none(asked, tmp_path, edit):
    folder, count = asked
    path = tmp_path / "run" / kept.FILE
    kept.diagnosed(pipeline.load(folder), tmp_path / "run")
    path.write_text(edit(path.read_text()))
    kept.diagnosed(pipeline.load(folder), tmp_path / "run")
    assert len(count) == 2


def test_a_diagnosis_of_another_filter_is_questioned_anew(asked, tmp_path, monkeypatch, capsys):
    """A discovery holds the filter that its first fit chose; the file's own fit may choose another."""
    _, count = asked
    typed(monkeypatch, capsys, "report", "arm", "--json")
    path = tmp_path / "runs" / "arm" / kept.FILE
    said = json.loads(path.read_text())
    del said["seal"]
    joint = next(iter(said["joints"]))
    said["joints"][joint]["rms"]["test"] *= 1.001
    path.write_text(json.dumps({**said, "seal": kept._seal(said)}))
    typed(monkeypatch, capsys, "report", "arm", "--json")
    assert count == ["arm", "arm"]


def test_another_version_or_program_questions_anew(arm, tmp_path, monkeypatch):
    experiment = pipeline.load(arm[0])
    state = kept.of(experiment)
    assert kept.of(experiment) == state
    with monkeypatch.context() as patch:
        patch.setattr(kept.fit_document, "versions", lambda: {"sysid": "another"})
        assert kept.of(experiment) != state
    with monkeypatch.context() as patch:
        patch.setattr(kept.fit_document, "program", lambda: "another")
        assert kept.of(experiment) != state
    assert kept.of(experiment) == state


def test_files_beside_the_logs_count(arm, tmp_path):
    """A previous run that is the prior, a Python file of own effects."""
    folder = shutil.copytree(arm[0], tmp_path / "arm")
    (folder / "own.py").write_text("# nothing yet\n")
    (folder / "before").mkdir()
    (folder / "before" / "fit.json").write_text("{}")
    text = (folder / "config.yaml").read_text()
    found = pipeline.load(folder)
    model = found.model.model_copy(
        update={"candidates": [found.model.effects[0].model_copy(update={"name": "own.py:Own"})]}
    )
    prior = found.prior.model_copy(update={"source": "before"})
    experiment = found.model_copy(update={"model": model, "prior": prior})
    assert text and {p.name for p in kept.files(experiment)} == {"robot.urdf", "own.py", "fit.json"}
    assert urdf_files.locate("robot.urdf", folder) in kept.files(experiment)
    states = {kept.of(experiment)}
    for name in ("own.py", "before/fit.json"):
        (folder / name).write_text("# other\n")
        states.add(kept.of(experiment))
    assert len(states) == 3
