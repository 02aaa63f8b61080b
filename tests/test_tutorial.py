"""The tutorial's commands run, in order, and what it shows is what comes out.

After a change that moves the numbers, `python -m tests.test_tutorial` runs the commands again and puts the new ones into the page;
lines that no longer come out at all are named, for a person to look at.
"""

import contextlib
import io
import os
import re
import shlex
import sys
from decimal import Decimal
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "tutorial.md"
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
LEFT_OUT = "…"


def blocks(page: str) -> list[tuple[str, list[str]]]:
    """Commands and the lines shown after them."""
    out = []
    for text in re.findall(r"```console\n(.*?)```", page, re.DOTALL):
        command, *lines = text.splitlines()
        assert command.startswith("$ sysid "), command
        out.append((command[2:], lines))
    return out


def bare(line: str) -> str:
    """A line without the lines of tables, the bars of a history, and the width of spaces."""
    return " ".join(re.sub(r"[│┃#]", " ", line).split())


def words(line: str) -> str:
    """What of a line is no number."""
    return NUMBER.sub("0", bare(line))


def close(shown: str, found: str) -> bool:
    """Whether a number came out as it is shown: to 3 %, or to two units of its last digit."""
    a, b = Decimal(shown), Decimal(found)
    if 0 < a < Decimal("1e-4"):
        return b != 0 and abs(a.log10() - b.log10()) <= 2  # a probability: its size matters
    last = Decimal(1).scaleb(a.as_tuple().exponent)
    return abs(a - b) <= max(Decimal("0.03") * abs(a), 2 * last)


def same(shown: str, found: str) -> bool:
    """Whether a line came out as it is shown."""
    if words(shown) != words(found):
        return False
    return all(close(a, b) for a, b in zip(NUMBER.findall(bare(shown)), NUMBER.findall(bare(found))))


def run(command: str) -> tuple[int, str]:
    """A command in this process: its status and what it prints."""
    from sysid import cli

    out, given = io.StringIO(), sys.argv
    sys.argv = shlex.split(command)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out), pytest.raises(SystemExit) as stop:
            cli.main()
    finally:
        sys.argv = given
    return int(stop.value.code or 0), out.getvalue()


def prepare(folder: Path) -> None:
    """The project's folder, as far as the commands look at it."""
    for name in ("configs", "data"):
        (folder / name).symlink_to(ROOT / name)


@pytest.mark.long
def test_the_tutorial_s_commands_give_what_it_shows(tmp_path, monkeypatch):
    prepare(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    told = blocks(PAGE.read_text(encoding="utf-8"))
    assert [command.split()[1] for command, _ in told] == ["simulate", "fit", "diagnose", "effects", "add", "history", "discover", "add", "report"]
    for command, lines in told:
        status, said = run(command)
        assert status == 0, (command, said)
        at, came = 0, said.splitlines()
        for line in lines:  # in the order of the page
            if line.strip() == LEFT_OUT:
                continue
            found = next((k for k in range(at, len(came)) if same(line, came[k])), None)
            nearest = [c for c in came if words(c) == words(line)] or came
            assert found is not None, f"`{command}` no longer says:\n  {line}\nbut:\n  " + "\n  ".join(nearest)
            at = found + 1
    truth = (tmp_path / "leg" / "truth.json").read_text()
    assert '"load_friction"' in truth and '"torque_bias"' in truth
    written = (tmp_path / "leg" / "config.yaml").read_text()
    assert "load_friction: {joints: [knee]}" in written and "torque_bias: {joints: [hip]}" in written
    for name in ("report.html", "history.json", "steps"):
        assert (tmp_path / "runs" / "leg" / name).exists()


def test_what_is_shown_can_be_wrong():
    """The comparison sees what it should."""
    assert same("│ hip   │ 0.04122 ### │", "┃ hip  ┃ 0.0415 ##########  ┃") and not same("hip 0.04122", "hip 0.0435")
    assert not same("hip: missing: torque_bias", "hip: missing: spring") and not same("hip 0.1", "hip 0.1 0.2")
    assert same("q 3e-11", "q 8e-12") and not same("q 3e-11", "q 3e-05") and not same("b = -0.0675 +- 0.002", "b = 0.0675 +- 0.002")
    assert same("misfit 85 +- 33 %", "misfit 84 +- 34 %") and not same("misfit 85 +- 33 %", "misfit 62 +- 33 %")


def test_effects_and_files_of_the_text_exist():
    from sysid.vocabulary import vocabulary

    text = PAGE.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert (PAGE.parent / target).exists(), target
    for effect in re.findall(r"sysid add leg (\w+)", text):
        assert effect in (*vocabulary(), "formula")


def renew() -> None:
    """Write the page again with what the commands say now."""
    import tempfile

    page = PAGE.read_text(encoding="utf-8")
    os.environ["COLUMNS"] = "120"
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        os.chdir(folder)
        for command, lines in blocks(page):
            came, shown = run(command)[1].splitlines(), []
            for line in lines:
                now = next((c for c in came if words(c) == words(line)), None)
                if now is None and line.strip() != LEFT_OUT:
                    print(f"`{command}` says no more: {line}")
                shown.append(line if now is None else now.rstrip())
            page = page.replace("\n".join([f"$ {command}", *lines]), "\n".join([f"$ {command}", *shown]))
        os.chdir(ROOT)
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    renew()
