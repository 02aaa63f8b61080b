"""The house itself: imports point upwards, effects keep their contract, the README's examples run."""

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid import effect, vocabulary
from tests.problems import arm

ROOT = Path(__file__).resolve().parent.parent

# The order of the method: a module imports only from modules above it.
ORDER = [
    "errors", "warned", "mistyped", "bounded", "nonnegative", "eigen", "unfinished", "whole_files", "yaml_text", "state", "trusted", "progress", "units", "picture", "threads", "free_memory", "silence", "callable_module", "workers", "inertia", "urdf_checks", "urdf_files", "urdf", "readers", "datasets", "spec_values", "robot_spec", "drive_spec", "log_spec", "specs", "groups", "prior", "link_priors", "rotors", "robot", "tree", "regressor", "standing_apart", "running", "outliers", "glitches", "knocks", "repeats",
    "frequencies", "clock", "segment", "spans", "events", "motor_side", "recorded_columns", "stamps", "recording", "finite", "full_turns", "anew", "unwritten", "rounded_stamps", "resampling", "arrivals", "held_rows", "gaussian", "smoother", "slips", "log", "even_clock", "long_log", "masks", "same_samples",
    "motion", "both_sides", "clock_jumps", "jump_response", "jumps", "extent", "standstill", "preprocess", "long_motion", "blocks", "two_masses", "lowpass", "flexible", "effect_parameters", "effect_options", "effect", "in_logs", "deflection",
    "vocabulary", "formula", "effects", "own_effects",
    "per_level", "config_errors", "config", "addition", "model_parameters", "slides", "scales", "terms", "needed", "kept_columns", "model", "listed_effects", "plain_model", "drives", "instants", "inverse_dynamics", "with_torque", "stretches", "rows", "tangents", "objective", "projection", "landscape", "multistart", "source",
    "reduction", "triangles", "linearised", "compress", "symmetric_matrices", "central_path", "interior", "nearby", "certificate", "trust_region", "solve", "prior_weight", "uncertainty", "differences", "prediction", "carried", "posed_problem", "given_shapes", "estimate",
    "long_prediction", "base_parameters", "held_apart", "masses", "plausible", "blows", "settled", "deflection_starts", "shape_search", "shape", "bumps", "filter_errors", "too_narrow", "filters", "fit_document", "results", "earlier_fit", "shape_refinement", "notices", "experiment_logs", "locked_joints", "thinning",
    "experiment_file", "yaml_edit", "effect_entry", "urdf_export", "gains", "late", "load_doubt", "simulate", "rollout", "pipeline", "run", "export", "inertials", "beyond", "check", "init", "comparison",
    "transfer", "noise", "candidates", "candidate_columns", "for_a_while", "picks", "loads", "carriers", "end_stops", "suspected", "design", "view", "failures", "pressed", "brief", "cancelling", "mean_by_log", "one_clock", "refused", "unexplained", "left_open", "misread", "borne_out", "held_bodies", "what_is_left", "simpler", "tried_formula", "shown", "diagnose", "changes", "online", "fleet", "statement", "loop", "report",
    "studies", "studio", "terminal", "cli", "__main__",
]  # fmt: skip
# Late imports that close a loop on purpose: a path that names a data set, a prior that is a previous run, the effects
# that an effect's contract finds.
LATE = {("urdf_files", "datasets"), ("results", "urdf_export"), ("vocabulary", "effects"), ("estimate", "fit_document"), ("shown", "statement")}


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


def test_a_module_can_be_read():
    """No module over 300 lines, where a line of more than 100 columns counts as the lines that it would fill."""
    places = [path for room in ("sysid", "scripts") for path in (ROOT / room).rglob("*.py")]
    lines = {path: path.read_text().splitlines() for path in places}
    sizes = {str(path.relative_to(ROOT)): sum(max(1, -(-len(line) // 100)) for line in own) for path, own in lines.items()}
    assert len(sizes) > 350 and not {name: size for name, size in sizes.items() if size > 300}


def test_the_diagnosis_can_be_read():
    """No module of it over 200 lines or 100 columns, all together under 1500 lines."""
    texts = {path.name: path.read_text().splitlines() for path in sorted((ROOT / "sysid" / "diagnose").glob("*.py"))}
    long = {name: len(lines) for name, lines in texts.items() if len(lines) > 200}
    wide = {name: sum(len(line) > 100 for line in lines) for name, lines in texts.items() if max(map(len, lines), default=0) > 100}
    total = sum(map(len, texts.values()))
    assert not long and not wide and total < 1500, (long, wide, total)


BESIDE = ["blocks", "changes", "check", "failures", "flexible", "fleet", "init", "lowpass", "noise", "online", "report", "statement"]


@pytest.mark.parametrize("room", BESIDE)
def test_what_stands_beside_the_diagnosis_can_be_read(room):
    """No module of it over 200 lines or 100 columns."""
    texts = {p.name: p.read_text().splitlines() for p in (ROOT / "sysid" / room).glob("*.py")}
    wide = {name for name, lines in texts.items() if max(map(len, lines), default=0) > 100}
    assert texts and not wide and max(map(len, texts.values())) <= 200


@pytest.mark.parametrize("folder", ["report/static", "report/templates", "studio/static", "studio/templates"])
def test_pages_files_can_be_read(folder):
    """No template, style or script over 200 lines or 100 columns."""
    texts = {path.name: path.read_text().splitlines() for path in (ROOT / "sysid" / folder).iterdir()}
    wide = {name for name, lines in texts.items() if max(map(len, lines)) > 100}
    assert texts and not wide and max(map(len, texts.values())) <= 200


def test_only_the_command_line_prints():
    for parts, tree in modules():
        if parts[0] in ("cli", "terminal"):
            continue
        calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") in ("print", "eval", "exec")]
        assert not calls, parts


# what a page is made of, where it stands in a text: elements and entities, declarations of a style, statements of a script
_ELEMENTS = "a|article|b|body|br|button|code|details|div|em|figure|footer|form|h[1-6]|head|header|html|i|iframe|img|input|label|li|link|main|meta|nav|noscript|ol|option|p|path|pre|rect|script|section|select|small|span|strong|style|summary|svg|table|tbody|td|th|thead|title|tr|ul|wbr"
PAGE = {
    "HTML": re.compile(rf"</[a-z]|<!doctype|<(?:{_ELEMENTS})[\s>/]|&(?:[a-z]+|#\d+);", re.IGNORECASE),
    "CSS": re.compile(r"\{\s*[a-z-]+\s*:[^{}]*;|(?<![.\w-])(?:color|margin|padding|display|font|background|width|height|border)\s*:[^;{}]+[;}]"),
    "JavaScript": re.compile(r"\bfunction\s*\w*\([\w, ]*\)\s*\{|=>|\b(?:document|window)\.\w|\b(?:const|let|var) \w+ ?=|addEventListener"),
}  # fmt: skip
XML = ("export", "urdf", "urdf_checks", "urdf_export")  # write and read the XML of robots


def texts(tree):
    """The literals of a module that are no docstrings."""
    owners = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docs = {id(node.body[0].value) for node in ast.walk(tree) if isinstance(node, owners) and node.body and isinstance(node.body[0], ast.Expr)}
    return [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs]


def test_pages_are_files_not_strings():
    """HTML, CSS and JavaScript stand in templates/ and static/."""
    found = [
        f"{'.'.join(parts)} line {node.lineno}: {kind}"
        for parts, tree in modules()
        if parts[0] not in XML
        for node in texts(tree)
        for kind, pattern in PAGE.items()
        if pattern.search(node.value)
    ]
    assert not found, found


@pytest.mark.parametrize(("kind", "text"), [
    ("HTML", "<p class='x'>"), ("HTML", "a</script"), ("HTML", "<!DOCTYPE html>"), ("HTML", "&lt;"), ("HTML", "<br>"),
    ("CSS", "p { margin-top: 1em; }"), ("CSS", "a { color: red }"), ("CSS", "width:3px;"),
    ("JavaScript", "function f(a, b) { return a }"), ("JavaScript", "x => x + 1"), ("JavaScript", "document.title"), ("JavaScript", "const a = 1"),
])  # fmt: skip
def test_what_a_page_is_made_of_is_recognized(kind, text):
    assert PAGE[kind].search(text)


def test_pages_files_are_installed():
    """Every template and static file is package data, and every one is used."""
    import tomllib

    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["sysid"]
    installed = {path for pattern in patterns for path in (ROOT / "sysid").glob(pattern)}
    every = {path for path in (ROOT / "sysid").rglob("*") if path.suffix in (".html", ".js", ".css")}
    assert every and every <= installed
    texts = {path: path.read_text() for path in [*(ROOT / "sysid").rglob("*.py"), *every]}
    sections = set(re.findall(r'Section\(\s*"[^"]*",\s*"(\w+)"', "".join(text for path, text in texts.items() if path.suffix == ".py")))
    for path in every:
        used = path.stem in sections or any(f'"{path.name}"' in text or f'/{path.name}"' in text for other, text in texts.items() if other != path)
        assert used, f"{path.name} is used nowhere"


@pytest.mark.parametrize("path", sorted((ROOT / "sysid").rglob("static/*.js")), ids=lambda path: path.name)
def test_scripts_parse(path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    done = subprocess.run([node, "--check", path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("path", sorted((ROOT / "sysid").rglob("static/*.css")), ids=lambda path: path.name)
def test_styles_parse(path):
    """No error in the sheet, in its media or in any declaration; every variable that is used is given a value."""
    import tinycss2

    def check(rules):
        for rule in rules:
            if rule.type == "qualified-rule" or (rule.type == "at-rule" and rule.lower_at_keyword == "page"):
                for entry in tinycss2.parse_blocks_contents(rule.content, skip_comments=True, skip_whitespace=True):
                    assert entry.type == "declaration" and entry.value, f"{path.name} line {entry.source_line}: {getattr(entry, 'message', entry)}"
            elif rule.type == "at-rule" and rule.content is not None:
                check(tinycss2.parse_rule_list(rule.content, skip_comments=True, skip_whitespace=True))
            else:
                assert rule.type == "at-rule", f"{path.name} line {rule.source_line}: {rule}"

    check(tinycss2.parse_stylesheet(path.read_text(), skip_comments=True, skip_whitespace=True))
    every = "".join(p.read_text() for p in (ROOT / "sysid").rglob("*") if p.suffix in (".css", ".html", ".js"))
    for name in set(re.findall(r"var\((--[\w-]+)", path.read_text())):
        assert re.search(rf"{name}:", every), f"{path.name}: {name} has no value"


def test_public_things_have_docstrings():
    for parts, tree in modules():
        assert ast.get_docstring(tree), parts
        for node in tree.body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
                assert ast.get_docstring(node), f"{'.'.join(parts)}.{node.name}"


@pytest.mark.parametrize("name", vocabulary.vocabulary())
def test_every_effect_keeps_its_contract(name):
    from tests.test_effects import applied, middle, moving

    found = vocabulary.find(name)
    assert found.name == name and isinstance(found, effect.KINDS)
    said = vocabulary.describe(found)
    assert all(said[key] for key in ("summary", "equation", "looks_like", "separate_by", "source"))
    assert said["parameters"] or said["options"]
    for value in said["parameters"]:
        assert value["says"] and value["unit"] and ("upper" in value or value["lower"] in (0, None))
    for shape in found.shapes():
        assert shape.low < shape.high and shape.of in ("", "speed", "torque", "angle", "softness", "duration")
        assert shape.start is None or shape.low <= shape.start <= shape.high
    robot, piece = moving()
    before = {key: np.array(getattr(piece, key)) for key in ("t", "q", "qd", "qdd", "tau", "load")}
    for joint in [-1] if found.scope == "robot" else range(robot.dof):
        variants = found.variants(robot, joint)
        assert variants or found.among(["a.csv", "b.csv"])
        for options in variants:
            own = found.given(**options).bound(robot, joint)
            shapes = middle(own, robot, piece, joint)
            result = applied(own, robot, piece, joint, shapes)
            for one, other in zip(result, applied(own, robot, piece, joint, shapes)):
                assert np.isfinite(one).all()
                np.testing.assert_array_equal(one, other)
            count = len(own.coefficients())
            if isinstance(own, effect.TorqueEffect):
                assert result[0].shape == (count, len(piece.t))
            elif isinstance(own, effect.WrenchEffect):
                assert result[0].shape == (robot.dof, count, len(piece.t))
            else:
                assert not count and all(one.shape == values.shape for one, values in zip(result, (piece.q, piece.qd, piece.qdd)))
    for key, values in before.items():
        np.testing.assert_array_equal(values, getattr(piece, key))
    for coefficient in found.coefficients():
        assert coefficient.lower in (0, None) and coefficient.says and coefficient.unit and coefficient.name


TORQUE_EFFECTS = [name for name in vocabulary.vocabulary() if isinstance(vocabulary.find(name), effect.TorqueEffect)]


@pytest.mark.parametrize("name", TORQUE_EFFECTS)
def test_every_effect_is_recovered_where_excited_and_not_where_not(name):
    """Added to a simulated joint with known coefficients, an effect comes back; on another joint it does not appear."""
    from dataclasses import replace

    from sysid import regressor
    from sysid.compress import compress
    from sysid.estimate import identify
    from sysid.model import Model
    from sysid.preprocess import prepare
    from tests.problems import arm_log
    from tests.test_effects import middle

    experiment, structure, _, _, prior = arm()
    robot = structure.robot
    hidden, elsewhere = 2, 4
    found = vocabulary.find(name).bound(robot, hidden)
    # of a short travel friction that follows the angle is friction, and no number of it is told from that
    wide = 3.0 if name == "position_friction" else 1.0
    log = arm_log(robot, np.random.default_rng(9), viscous=0.0, coulomb=0.0, noise=0.05, wide=wide)
    clean = prepare([log], experiment.preprocess, robot.joints)
    (piece,) = clean.pieces
    seen = replace(piece, load=regressor.torque(robot, prior, piece.q, piece.qd, piece.qdd))
    values = np.array([0.4 if linear.unit == "1" else 1.7 for linear in found.coefficients()])
    tau, held = piece.tau.copy(), []
    for joint in (hidden, elsewhere):
        shapes = middle(found, robot, seen, joint)
        held += [((2, joint, word), value) for word, value in shapes.items()]
        if joint == hidden:
            columns = found.columns(seen, joint, **shapes)
            tau[:, joint] += values @ columns
    # what friction is more in some logs is that friction where there is one log
    beside = {"viscous", "coulomb"} - ({"viscous", "coulomb"} if name == "friction_change" else {name})
    others = tuple(term for term in structure.terms if term[0].name in beside)
    held = tuple(((len(others), *key[1:]), value) for key, value in held)
    model = Model(robot, (*others, (found, (hidden, elsewhere))), shapes=tuple(value for _, value in held), held=held)
    motion = replace(clean, pieces=(replace(piece, tau=tau),))
    fit = identify(experiment, model, motion, compress(model, motion), prior)
    std = fit.uncertainty.std[10 * model.bodies :]
    wanted = iter([*values, *np.zeros(len(values))])
    sizes = iter([*np.abs(columns).max(1), *np.zeros(len(values))])
    for k, coefficient in enumerate(model.coefficients):
        if coefficient.effect == name:
            spread = std[k] if np.isfinite(std[k]) else 0.0
            assert abs(fit.coefficients[k] - next(wanted)) < 0.03 + 5 * spread, coefficient.name
            assert spread * next(sizes) < 0.1, coefficient.name  # N m: told from everything else


def test_readme_s_python_runs():
    code = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[1].replace("runs/mine", "{out}")
    import tempfile

    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run([sys.executable, "-W", "error", "-c", code.replace("{out}", out)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    checked, fit, errors, *_ = done.stdout.splitlines()
    assert checked == "[]" and fit.startswith("<Fit of cheetah3") and errors.endswith("True")


def test_readme_s_table_of_keys_is_complete():
    """Every key of the experiment file stands in the README's listing."""
    from pydantic import BaseModel

    from sysid import config_errors, specs

    listing = (ROOT / "README.md").read_text()
    listing = listing[listing.index("## The experiment file") : listing.index("## Commands")]
    seen = set()

    def walk(model):
        for name, field in model.model_fields.items():
            if name == "path" or (model is specs.EffectSpec and name in ("name", "options")):
                continue
            assert re.search(rf"\b{field.alias or name}\b", listing), f"{model.__name__}.{name}"
            inner = config_errors.inner_model(field.annotation)
            if inner is not None and issubclass(inner, BaseModel) and inner not in seen:
                seen.add(inner)
                walk(inner)

    walk(specs.Experiment)


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


#: what a package is imported as, where that is not its name, and what comes with it
IMPORTED = {"pin": ("pinocchio", "coal"), "jinja2": ("jinja2", "markupsafe"), "distributed": ("distributed", "dask"), "ruamel.yaml": ("ruamel",)}
#: asked for by name where a user wants their formats, and told to install
WANTED = {"mujoco", "pydrake"}


def test_a_plain_installation_brings_all_that_is_imported():
    """The tests' tools bring more: what only they bring stops a user at the first command."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    asked = [*project["dependencies"], *(one for extra, own in extras.items() if extra != "test" for one in own)]
    words = [re.match(r"[A-Za-z0-9_.-]+", one)[0] for one in asked]
    there = {name for word in words for name in IMPORTED.get(word, (word.replace("-", "_"),))}
    found = set()
    for _, tree in modules():
        for node in ast.walk(tree):
            found |= {a.name.split(".")[0] for a in node.names} if isinstance(node, ast.Import) else set()
            found |= {node.module.split(".")[0]} if isinstance(node, ast.ImportFrom) and not node.level else set()
    assert found - set(sys.stdlib_module_names) - {"sysid"} <= there | WANTED
