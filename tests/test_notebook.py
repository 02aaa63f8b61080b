"""The notebook's cells run, in order, and find what they say; without Jupyter."""

import ast
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOK = ROOT / "docs" / "notebook.ipynb"


def cells(kind: str) -> list[str]:
    """The text of the notebook's cells of a kind."""
    found = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in found if cell["cell_type"] == kind]


def run(cell: str, names: dict):
    """Run a cell as Jupyter does: what its last line is worth comes back."""
    tree = ast.parse(cell)
    last = ast.Expression(tree.body.pop().value) if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return None if last is None else eval(compile(last, "cell", "eval"), names)


@pytest.mark.long
def test_the_notebook_s_cells_run(tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    for name in ("configs", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "docs").mkdir()
    monkeypatch.chdir(tmp_path / "docs")
    names: dict = {}
    shown = [run(cell, names) for cell in cells("code")]
    assert all(len(repr(value)) < 3000 for value in shown)
    pictures = [value._repr_png_() for value in shown if hasattr(value, "_repr_png_")]
    assert len(pictures) == 4 and all(image.startswith(b"\x89PNG") for image in pictures)
    verdict = {row["joint"]: row for row in names["diagnosis"].to_dataframe().to_dicts()}
    assert verdict["hip"]["effect"] == "stribeck" and verdict["knee"]["status"] == "complete"
    hip = {d.joint: d for d in names["difference"]}["hip"]
    assert hip.delta_rms < -2 * hip.se
    results = ("experiment", "fit", "diagnosis", "difference", "prediction", "run", "exported")
    for name in results:
        assert len(repr(names[name])) < 400 and "\n" not in repr(names[name]), name
    for name in results[1:-1]:
        assert names[name].to_dataframe().height and names[name].plot().axes, name
    assert names["exported"].check.agrees
    assert [cost.what for cost in names["exported"].left_out] == ["stribeck", "rotors"]


def test_the_prompt_shows_what_there_is():
    import sysid

    shown = dir(sysid)
    for name in (
        "load",
        "fit",
        "diagnose",
        "compare",
        "predict",
        "write",
        "read_run",
        "export",
        "check",
    ):
        assert name in shown and callable(getattr(sysid, name)) and getattr(sysid, name).__doc__, (
            name
        )
    assert not {"np", "import_module", "pipeline", "TYPE_CHECKING"} & set(shown)


def test_the_notebook_is_small_and_holds_no_output():
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert len(text) < 20_000 and '"output_type"' not in text
    assert all("](" not in cell or "http" in cell or ".md)" in cell for cell in cells("markdown"))
