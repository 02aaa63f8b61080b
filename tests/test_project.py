"""The house itself: imports point upwards, effects keep their contract, the README's examples run."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid import effect
from tests.problems import arm

ROOT = Path(__file__).resolve().parent.parent

# The order of the method: a module imports only from modules above it.
ORDER = [
    "errors", "units", "inertia", "urdf", "readers", "datasets", "config", "prior", "robot", "regressor", "log", "preprocess",
    "effect", "effects", "model", "compress", "objective", "interior", "certificate", "solve", "uncertainty", "estimate",
    "filters", "results", "urdf_export", "pipeline", "comparison", "report", "studies", "terminal", "cli", "__main__",
]  # fmt: skip
# Late imports that close a loop on purpose: a path that names a data set, a prior that is a previous run, and the
# effects that an effect's contract finds.
LATE = {("config", "effect"), ("urdf", "datasets"), ("pipeline", "results"), ("results", "urdf_export"), ("effect", "effects")}


def modules():
    for path in sorted((ROOT / "sysid").rglob("*.py")):
        parts = path.relative_to(ROOT / "sysid").with_suffix("").parts
        if parts != ("__init__",):
            yield parts, ast.parse(path.read_text())


def test_imports_point_upwards():
    for parts, tree in modules():
        own = parts[0]
        assert own in ORDER, f"{own} has no place in the order"
        for node in ast.walk(tree):
            if not isinstance(node, ast.ImportFrom) or node.level == 0:
                continue
            # within a package level 1 is the package itself, one more is the project
            base = node.level - (len(parts) - 1)
            if base < 1:
                continue
            names = [node.module.split(".")[0]] if node.module else [alias.name for alias in node.names]
            for name in names:
                if name not in ORDER or name == own or (own, name) in LATE:
                    continue
                assert ORDER.index(name) < ORDER.index(own), f"{'.'.join(parts)} imports {name}"


def test_no_module_is_a_drawer():
    for parts, _ in modules():
        assert not {"utils", "helpers", "core", "base", "misc", "common"} & set(parts)


def test_only_the_command_line_prints():
    for parts, tree in modules():
        if parts[0] in ("cli", "terminal"):
            continue
        calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") in ("print", "eval", "exec")]
        assert not calls, parts


def test_public_things_have_docstrings():
    for parts, tree in modules():
        assert ast.get_docstring(tree), parts
        for node in tree.body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
                assert ast.get_docstring(node), f"{'.'.join(parts)}.{node.name}"


@pytest.mark.parametrize("name", effect.vocabulary())
def test_every_effect_keeps_its_contract(name):
    found = effect.find(name)
    assert found.name == name
    said = effect.describe(found)
    assert all(said[key] for key in ("summary", "equation", "looks_like", "separate_by", "source", "parameters"))
    _, structure, motion, _, _ = arm()
    (piece,) = motion.pieces
    part = piece.part(slice(0, 300))
    before = part.q.copy(), part.qd.copy(), part.qdd.copy()
    for joint in range(structure.robot.dof):
        columns = found.columns(part, joint)
        assert columns.shape == (len(found.coefficients()), 300) and np.isfinite(columns).all()
        np.testing.assert_array_equal(columns, found.columns(part, joint))
    for a, b in zip(before, (part.q, part.qd, part.qdd)):
        np.testing.assert_array_equal(a, b)
    for coefficient in found.coefficients():
        assert coefficient.lower in (0, None) and coefficient.says and coefficient.unit


@pytest.mark.parametrize("name", effect.vocabulary())
def test_every_effect_is_recovered_where_excited_and_not_where_not(name, tmp_path):
    """Added to a simulated joint with a known coefficient, an effect comes back; on another joint it does not appear."""
    from dataclasses import replace

    from sysid.compress import compress
    from sysid.estimate import identify
    from sysid.model import Model
    from sysid.preprocess import prepare
    from tests.problems import arm_log

    experiment, structure, _, _, prior = arm()
    found, joint, value = effect.find(name), 2, 1.7
    model = Model(structure.robot, tuple(t for t in structure.terms if t[0].name != name) + ((found, (joint, 4)),))
    log = arm_log(structure.robot, np.random.default_rng(9), viscous=0.0, coulomb=0.0, noise=0.05)
    clean = prepare([log], experiment.preprocess, structure.robot.joints)
    (piece,) = clean.pieces
    tau = piece.tau.copy()
    tau[:, joint] += value * found.columns(piece, joint)[0]
    motion = replace(clean, pieces=(replace(piece, tau=tau),))
    fit = identify(experiment, model, motion, compress(model, motion), prior)
    names = [c.name for c in model.coefficients]
    (coefficient,) = found.coefficients()
    got = dict(zip(names, fit.coefficients))
    std = dict(zip(names, fit.uncertainty.std[-len(names):]))
    hit, miss = (f"{name}.{structure.robot.joints[j]}.{coefficient.name}" for j in (joint, 4))
    assert abs(got[hit] - value) < 0.05 + 5 * std[hit]
    assert abs(got[miss]) < 0.05 + (5 * std[miss] if np.isfinite(std[miss]) else 0)


def test_readme_s_python_runs():
    code = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[1].replace("runs/mine", "{out}")
    import tempfile

    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run([sys.executable, "-W", "error", "-c", code.replace("{out}", out)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0].endswith("True")


def test_readme_s_table_of_keys_is_complete():
    """Every key of the experiment file stands in the README's listing."""
    from pydantic import BaseModel

    from sysid import config

    listing = (ROOT / "README.md").read_text()
    listing = listing[listing.index("## The experiment file") : listing.index("## Commands")]
    seen = set()

    def walk(model):
        for name, field in model.model_fields.items():
            if name == "path" or (model is config.EffectSpec and name in ("name", "options")):
                continue
            assert re.search(rf"\b{name}\b", listing), f"{model.__name__}.{name}"
            inner = config._inner_model(field.annotation)
            if inner is not None and issubclass(inner, BaseModel) and inner not in seen:
                seen.add(inner)
                walk(inner)

    walk(config.Experiment)


def test_import_costs_nothing():
    code = "import sys, sysid; sys.exit(any(m in sys.modules for m in ('numpy', 'pinocchio', 'scipy', 'polars')))"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0


def test_public_names_resolve():
    for name in sysid.__all__:
        assert getattr(sysid, name) is not None
    with pytest.raises(AttributeError):
        sysid.nothing  # noqa: B018


def test_project_speaks_of_itself_alone():
    """No path of a machine, no registry's host, no lock file."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    patterns = ["/" + "work/", "/" + "root/", "files.python" + "hosted", "py" + "pi.org", "/" + "opt/"]
    for name in listed.stdout.split():
        assert not name.endswith(".lock")
        path = ROOT / name
        if path.suffix in (".parquet", ".png") or not path.is_file():
            continue
        text = path.read_text(errors="replace")
        for pattern in patterns:
            assert pattern not in text, f"{name} holds {pattern}"
