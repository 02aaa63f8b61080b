"""A push that lasts a second or two is no law: its seconds are named, on training and test logs, and without them the rest is told."""

import numpy as np
import polars as pl
import pytest

from scripts.blind_parts.robots import experiment_of
from sysid import pipeline
from sysid.diagnose.diagnosis import diagnose
from sysid.simulate import simulate, write
from sysid.statement import where
from sysid.statement.document import document


@pytest.fixture(scope="module")
def pushed(tmp_path_factory):
    """The planar arm pushed for a while in either log; nothing hidden."""
    folder = tmp_path_factory.mktemp("pushed")
    experiment, machine = experiment_of("planar", folder)
    write(simulate(machine, seed=5, duration=20.0, rate=200.0), experiment, folder / "logs")
    for name, start, stop in (("train.csv", 6.1, 7.9), ("test.csv", 3.2, 4.3)):
        table = pl.read_csv(folder / "logs" / name)
        t = table["t"].to_numpy() - table["t"][0]
        inside = (t > start) & (t < stop)
        push = np.where(inside, np.sin(np.pi * (t - start) / (stop - start)) ** 2, 0.0)
        changed = [(pl.col(f"tau_{joint}") + size * push).alias(f"tau_{joint}") for joint, size in (("shoulder", 9.0), ("elbow", 6.0))]
        table.with_columns(changed).write_csv(folder / "logs" / name)
    return folder / "logs"


@pytest.fixture(scope="module")
def told(pushed):
    return document(diagnose(pipeline.load(pushed)))


def test_the_seconds_of_a_push_are_named(told):
    assert set(where.touched(told)) == {"shoulder", "elbow"} and told["next_log"] is None
    for own in told["fails_where"]:
        found = {part["log"]: (part["start"], part["stop"]) for part in own["stretches"]}
        assert found.keys() == {"train.csv", "test.csv"}
        assert abs(found["train.csv"][0] - 6.1) < 0.6 and abs(found["train.csv"][1] - 7.9) < 0.6
        assert abs(found["test.csv"][0] - 3.2) < 0.6 and abs(found["test.csv"][1] - 4.3) < 0.6
        assert "of the squared error of all logs lies in" in own["words"][0]


@pytest.mark.long
def test_without_these_seconds_nothing_is_missing(pushed, told):
    masks = where.masks(told, ["shoulder", "elbow"])
    text = (pushed / "config.yaml").read_text()
    assert "  mask: []\n" in text
    (pushed / "config.yaml").write_text(text.replace("  mask: []\n", "".join(f"  {line}\n" for line in masks)))
    after = document(diagnose(pipeline.load(pushed)))
    assert {v["joint"]: v["status"] for v in after["verdict"]} == {"shoulder": "complete", "elbow": "complete"}
    assert not any(own["stretches"] for own in after["fails_where"])


def test_half_of_an_error_at_one_end_of_a_motion_may_be_a_stop():
    def own(variable, low, high, rows):
        region = {"variable": variable, "low": low, "high": high, "unit": "rad", "share_of_error": 0.55, "share_of_rows": rows}
        return {"joint": "elbow", "regions": [region], "map": {"q": [-1.0, 0.0, 1.0]}}

    assert (
        "at the upper end of its motion, 0.9 to 1 rad" in (said := where.at_end(own("q", 0.9, 1.0, 0.05)))
        and "k*max(q - q0, 0)" in said
        and "name=upper_stop" in said
    )
    assert where.at_end(own("q", 0.9, 1.0, 0.05), {("upper_stop", "elbow")}) == ""
    assert "k*min(q - q0, 0)" in where.at_end(own("q", -1.0, -0.9, 0.05))
    # where no training log was nothing is known of a stop
    beyond = own("q", 0.9, 1.0, 0.05)
    beyond["regions"][0]["not_in_training"] = True
    for asked in (set(), {("upper_stop", "elbow")}):
        assert "which no training log reaches" in (said := where.at_end(beyond, asked)) and "stop" not in said
    assert [where.at_end(own(*one)) for one in (("q", 0.2, 0.4, 0.05), ("q", 0.5, 1.0, 0.3), ("qd", 0.9, 1.0, 0.05))] == ["", "", ""]
