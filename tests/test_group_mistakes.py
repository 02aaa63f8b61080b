"""What cannot be meant by groups of logs, each in one line with its place; and an effect at a
level: itself there, nothing elsewhere."""

import copy
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from sysid import config, pipeline
from sysid.errors import ConfigError, SysidError
from sysid.groups import names
from sysid.listed_effects import build
from sysid.log_spec import LogSpec
from sysid.per_level import at_level
from sysid.vocabulary import find, vocabulary
from sysid.warned import noticed
from tests.conftest import dump, put
from tests.grouped import MASS, experiment, tree
from tests.test_effects import middle, moving


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return experiment(tmp_path_factory.mktemp("groups"))


# ---- what cannot be meant


R1, R2, PAYLOAD = "data.groups.robot.r1", "data.groups.robot.r2", "model.effects.2.payload"
NONE, TWO = [["none_*.csv"], ["two_*.csv"]]
MISTAKES = [
    (
        {R1: [*NONE, *TWO, "other.csv"]},
        f"{R1}[2]: other.csv is in neither data.train nor data.test",
    ),
    ({R2: ["one_*.csv", "three_*.csv", "two_train.csv"]}, "two_train.csv is at r1 too"),
    ({R1: TWO}, "none_train.csv is at no level of data.groups.robot; list it under one"),
    (
        {"model.effects.0.viscous.per": "robt"},
        "there is no group 'robt'; data.groups has: payload, robot",
    ),
    ({"data.groups": ...}, "data.groups has: nothing: list logs there"),
    (
        {f"{PAYLOAD}.except": ["empty"]},
        "payload has no level 'empty'; allowed: none, one, two, three",
    ),
    ({f"{PAYLOAD}.except": [*MASS]}, "no level of payload is left"),
    ({f"{PAYLOAD}.per": ...}, "except names levels of a group; give per, too"),
    (
        {"data.train": [f"{level}_train.csv" for level in MASS if level != "two"]},
        "no training log is at level two of data.groups.payload",
    ),
    ({"data.groups.robot": {"r.3": ["one_*.csv"]}}, "letters, digits"),
    ({"data.groups.robot.r3": []}, "at least 1 entry"),
    (
        {"model.candidates": [{"spring": {"per": "robot"}}]},
        "a candidate is asked of all logs together",
    ),
    (
        {"model.effects.0.viscous.par": "robot"},
        "unknown key 'par' in model.effects[0]; allowed: per",
    ),
]


@pytest.mark.parametrize(("changes", "words"), MISTAKES)
def test_a_mistake_is_one_line_with_its_place(folder, cli, tmp_path, changes, words):
    (folder / "wrong.yaml").write_text(dump(put(tree(), changes)))
    cli("fit", folder / "wrong.yaml", "--out", tmp_path / "run").complains(words, "wrong.yaml line")


def test_what_only_the_model_knows_is_one_line_too(folder):
    given = tree([{"payload": {"per": "payload", "logs": ["one_train.csv"]}}])
    with pytest.raises(ConfigError, match="both logs and per"):
        pipeline.build(config.experiment(given, folder / "config.yaml"))
    given = tree([{"payload": {"per": "payload"}}])
    with noticed() as notices:
        pipeline.build(config.experiment(given, folder / "config.yaml"))
    assert any("except: [LEVEL]" in notice for notice in notices)
    given = tree([{"viscous": {"per": "robot"}}, "viscous"])
    with pytest.raises(ConfigError, match="viscous stands twice"):
        pipeline.build(config.experiment(given, folder / "config.yaml"))


def test_pieces_of_one_file_and_several_files_are_told_apart(folder):
    given = tree([{"viscous": {"per": "half"}}])
    first, second = (
        {"file": "one_train.csv", "start": a, "stop": b} for a, b in ((0.0, 4.0), (4.0, 8.0))
    )
    both = {"files": ["none_test.csv", "one_test.csv"]}
    given["data"] = {
        "train": [first, second],
        "test": [both],
        "groups": {"half": {"a": [first, both], "b": ["./one_train.csv"]}},
    }
    with pytest.raises(ConfigError, match="one_train.csv is at a too"):
        config.experiment(given, folder / "config.yaml")
    given["data"]["groups"]["half"]["b"] = [second]
    found = config.experiment(given, folder / "config.yaml").data.groups["half"]
    assert [(log.name, log.stop) for log in found["a"]] == [
        ("one_train.csv", 4.0),
        ("none_test.csv + one_test.csv", None),
    ]
    assert [(log.name, log.stop) for log in found["b"]] == [("one_train.csv", 8.0)]


def test_friction_of_a_joint_that_stands_at_one_level_is_held_there_and_told(folder, tmp_path):
    for name in ("two_train", "none_train"):
        log = pl.read_csv(folder / f"{name}.csv")
        log.with_columns(pl.lit(0.3).alias("q_elbow")).write_csv(tmp_path / f"{name}.csv")
    for name in ("one_train", "three_train", "one_test"):
        (tmp_path / f"{name}.csv").write_text((folder / f"{name}.csv").read_text())
    (tmp_path / "robot.urdf").write_text((folder / "robot.urdf").read_text())
    given = tree([{"viscous": {"per": "robot"}}])
    train = ["none_train.csv", "two_train.csv", "one_train.csv", "three_train.csv"]
    groups = {"robot": {"r1": train[:2], "r2": [*train[2:], "one_test.csv"]}}
    given["data"] = {"train": train, "test": ["one_test.csv"], "groups": groups}
    found = pipeline.fit(config.experiment(given, tmp_path / "config.yaml"))
    held = [c.name for c, own in zip(found.model.coefficients, found.held) if own]
    assert held == ["viscous.elbow.Fv[r1]"]
    assert any("cannot tell viscous.elbow.Fv[r1] from the rest" in n for n in found.notices)


@pytest.mark.parametrize(
    ("entry", "log", "same"),
    [
        ("a.csv", "a.csv", True),
        ("./a.csv", "a.csv", True),
        ("r1", "r1/day_2/a.csv", True),
        ("r1", "r10/a.csv", False),
        ("r1/*.csv", "r1/a.csv", True),
        ("r1/*.csv", "r1/day_2/a.csv", False),
        ("**/a.csv", "r1/day_2/a.csv", True),
        ("set[1].csv", "set[1].csv", True),
        ("a.csv", {"file": "a.csv", "episode": 3}, True),
        ({"file": "a.csv", "episode": 3}, {"file": "a.csv", "episode": 3}, True),
        ({"file": "a.csv", "episode": 3}, {"file": "a.csv", "episode": 4}, False),
        ({"file": "a.csv", "start": 1.0}, "a.csv", False),
        ("r1", {"files": ["r1/a.csv", "r1/b.csv"]}, True),
        ("r1/a.csv", {"files": ["r1/a.csv", "r1/b.csv"]}, False),
        ({"files": ["a.csv", "b.csv"]}, "a.csv", False),
    ],
)
def test_which_logs_an_entry_names(entry, log, same):
    entry, log = (
        LogSpec.model_validate({"file": spec} if isinstance(spec, str) else spec)
        for spec in (entry, log)
    )
    assert names(entry, log) is same


# ---- an effect at a level


@pytest.mark.parametrize("name", vocabulary())
def test_every_effect_is_itself_at_its_level_and_nothing_elsewhere(name):
    """On logs at its level a model with it predicts what it predicts without groups; on others what
    it predicts without it."""
    machine, piece = moving()
    joint = -1 if find(name).scope == "robot" else 0
    plain = find(name).bound(machine, joint)
    there = at_level(plain, "robot", "r2", ("r1", "r2"))
    base = build(machine, [])
    rng, out, c = np.random.default_rng(0), {}, None
    shapes = middle(plain, machine, piece, joint)
    for key, effect in (("plain", plain), ("there", there)):
        model = base.with_effect(effect, (joint,))
        model = model.with_shapes([shapes[v.shape.name] for v in model.shape_values])
        c = rng.uniform(0.5, 1.0, len(model.coefficients)) if key == "plain" else c
        x = np.append(machine.prior.ravel(), c)
        for level in ("r1", "r2"):
            own = replace(piece, levels={"robot": level})
            out[key, level] = model.torque(own, machine.prior, c)
            parts = enumerate(model.columns(own, slice(0, len(piece.t))))
            made = np.stack([x[model.support(j, own)] @ columns for j, columns in parts], axis=1)
            np.testing.assert_allclose(made, out[key, level], rtol=1e-9, atol=1e-9)
    without = base.torque(replace(piece, levels={}), machine.prior, np.zeros(0))
    np.testing.assert_allclose(out["there", "r2"], out["plain", "r2"], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(out["there", "r1"], without, rtol=1e-12, atol=1e-12)
    with pytest.raises(SysidError, match="no level of it"):
        model.torque(piece, machine.prior, c)
    taken, kept = model.at({"robot": "r2"}, x)
    assert taken.terms[0][0].level is None and np.array_equal(kept, x)
    assert taken.names == base.with_effect(plain, (joint,)).names
    assert model.at({"robot": "r1"}, x)[0].names == base.names
    assert copy.copy(there).level == "r2" and type(there.plain) is type(plain)
