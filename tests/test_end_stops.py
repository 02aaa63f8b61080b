"""A stop at one end of a joint's motion is named, where it is and how stiff; nothing of the kind is asked elsewhere."""

from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from scripts.blind_parts.robots import experiment_of
from sysid import pipeline
from sysid.diagnose.diagnosis import diagnose
from sysid.end_stops import LAWS, asked_too
from sysid.simulate import simulate, write
from sysid.statement.document import document
from tests.conftest import JOINTS


def seen(q, left):
    rows = SimpleNamespace(of=lambda *_: q, residual=lambda _: left, use=np.ones(q.shape, dtype=bool))
    return SimpleNamespace(rows=rows, motion=None, settled=SimpleNamespace(x=None), model=SimpleNamespace(terms=[]))


def test_a_stop_is_asked_only_where_half_of_what_is_left_lies_at_an_end(experiment):
    rng = np.random.default_rng(0)
    loaded = pipeline.load(experiment())
    q = np.sin(np.linspace(0.0, 40.0, 4000))[:, None] * [1.0, 0.5]
    noise = 0.1 * rng.normal(size=q.shape)
    names = lambda left: [effect.name for effect in asked_too(loaded, seen(q, left))]  # noqa: E731
    at = lambda left: {effect.name: effect.at for effect in asked_too(loaded, seen(q, left))}  # noqa: E731
    assert names(noise) == [] and names(np.zeros_like(q)) == []
    assert names(noise + q**3) == []  # at both ends
    assert names(noise + [2.0, 0.0] * np.maximum(q - 0.97, 0.0) * 20.0) == ["upper_stop"]
    assert names(noise + [0.0, 2.0] * np.minimum(q + 0.485, 0.0) * 40.0) == ["lower_stop"]
    both = noise + [2.0, 0.0] * np.maximum(q - 0.97, 0.0) * 20.0 + [0.0, 2.0] * np.minimum(q + 0.485, 0.0) * 40.0
    assert at(both) == {"upper_stop": (0,), "lower_stop": (1,)}
    parked = np.concatenate([np.linspace(0.0, 1.0, 1000), np.ones(3000)])[:, None]
    assert asked_too(loaded, seen(parked, 0.1 * rng.normal(size=parked.shape))) == []


@pytest.mark.parametrize("side", ["upper_stop", pytest.param("lower_stop", marks=pytest.mark.long)])
def test_a_stop_is_named_with_its_place_and_its_stiffness(side, tmp_path):
    machine_of, machine = experiment_of("planar", tmp_path)
    write(simulate(machine, seed=5, duration=15.0, rate=200.0), machine_of, tmp_path / "logs")
    tables = {name: pl.read_csv(tmp_path / "logs" / name) for name in ("train.csv", "test.csv")}
    at = float(tables["train.csv"]["q_elbow"].quantile(0.94 if side == "upper_stop" else 0.06))
    for name, table in tables.items():
        beyond = table["q_elbow"].to_numpy() - at
        pressed = 60.0 * (np.maximum(beyond, 0.0) if side == "upper_stop" else np.minimum(beyond, 0.0))
        table.with_columns((pl.col("tau_elbow") + pressed).alias("tau_elbow")).write_csv(tmp_path / "logs" / name)
    config = tmp_path / "logs" / "config.yaml"
    config.write_text(config.read_text().replace("events: mask", "events: keep"))
    told = document(diagnose(pipeline.load(tmp_path / "logs")))
    (found,) = [f for f in told["findings"] if f["joins_as_step"] is not None]
    assert (found["effect"], found["joint"]) == (side, JOINTS[1])
    numbers = {name.rpartition(".")[2]: p for name, p in found["parameters"].items()}
    assert abs(numbers["k"]["value"] - 60.0) < 3.0 * numbers["k"]["std"] + 0.6
    assert abs(numbers["q0"]["value"] - at) < 3.0 * numbers["q0"]["std"] + 1e-3
    assert f"formula={LAWS[side]}" in found["command"] and f"name={side}" in found["command"]
