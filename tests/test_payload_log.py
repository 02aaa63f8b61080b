"""A load that one of several training logs carries is named with that log, and `add` takes the command as it is printed."""

import json
import shlex
import shutil

import pytest

from sysid import experiment_file, loop, pipeline
from sysid.diagnose.diagnosis import diagnose
from sysid.effects.payload import Payload
from sysid.statement.document import document


@pytest.fixture(scope="module")
def loaded(simulated):
    """Logs of an arm that holds a load."""
    return simulated("holds a load", "payload:*", seed=6, duration=10.0)


@pytest.fixture(scope="module")
def folder(simulated, loaded, tmp_path_factory):
    """Two training logs of one arm, in the second of which it holds a load."""
    plain = simulated("holds none", seed=6, duration=10.0)
    out = tmp_path_factory.mktemp("carried") / "case"
    shutil.copytree(plain, out)
    shutil.copy(loaded / "train.csv", out / "loaded.csv")
    text = (out / "config.yaml").read_text()
    assert "train: [train.csv]" in text
    (out / "config.yaml").write_text(text.replace("train: [train.csv]", "train: [train.csv, loaded.csv]"))
    return out


def test_a_load_in_one_log_is_named_with_it(folder, loaded):
    found = document(diagnose(pipeline.load(folder)))
    heads = [f for f in found["findings"] if f["joins_as_step"] is not None]
    assert [(f["effect"], f["joint"], f["options"]) for f in heads] == [("payload", "*", {"logs": ("loaded.csv",)})]
    assert {v["status"] for v in found["verdict"]} == {"missing"} and {v["effect"] for v in found["verdict"]} == {"payload"}
    words = shlex.split(heads[0]["command"])
    assert words[-2:] == ["--option", 'logs=["loaded.csv"]']
    added = loop.add(folder, "payload", None, {"logs": ["loaded.csv"]}, out=folder / "runs")
    assert not added.refused and "loaded.csv" in experiment_file.read(folder / "config.yaml").decode()
    (before,) = (p["value"] for name, p in heads[0]["parameters"].items() if name.endswith(".m"))
    (mass,) = (value for name, value in added.after.parameters_of("payload", -1).items() if name.endswith(".m"))
    assert abs(mass[0] - before) < 2.0 * mass[1]
    truth = json.loads((loaded / "truth.json").read_text())["hidden"][0]["values"]["m"]
    assert abs(mass[0] - truth) < 3.0 * mass[1]


def test_which_logs_are_tried():
    effect = Payload()
    assert effect.among(["a"]) == [] and effect.among([str(k) for k in range(9)]) == []
    assert effect.among(["a", "b"]) == [{"logs": ["a"]}, {"logs": ["b"]}]
    assert effect.among(["a", "b", "c"])[3:] == [{"logs": ["b", "c"]}, {"logs": ["a", "c"]}, {"logs": ["a", "b"]}]
