"""One joint from all sides: what the server answers to the workspace's questions."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from sysid import pipeline
from sysid.errors import SysidError
from sysid.studio.workspace import MOST, Workspace
from tests.test_report import EVIL, written


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = written(tmp_path_factory.mktemp("workspace") / "arm", 0.0)
    return pipeline.fit(pipeline.load(folder))


@pytest.fixture(scope="module")
def long(arm):
    """The same fit with a hundred times the rows, one of them a peak."""
    found = arm.predictions["test"]
    times = 100 * MOST // len(found.t)
    t = found.t[0] + np.arange(times * len(found.t)) * float(np.diff(found.t[:2])[0])
    wide = lambda values: np.tile(values, (times, 1))  # noqa: E731
    measured = wide(found.measured)
    measured[len(t) // 3, 0] += 50.0
    made = replace(
        found, t=t, log=np.zeros(len(t), np.int16), measured=measured, predicted=wide(found.predicted),
        use=None if found.use is None else wide(found.use), states=None,
    )  # fmt: skip
    return replace(arm, predictions={**arm.predictions, "test": made})


def trace(chart, name):
    return next(one for one in chart["figure"]["data"] if one.get("name") == name)


def test_a_window_is_drawn_with_every_sample_where_there_are_few(long):
    workspace, found = Workspace(long), long.predictions["test"]
    whole = workspace.window("test", 0)
    assert whole["samples"] == len(found.t) and whole["drawn"] <= MOST
    shifted = replace(found, predicted=found.predicted + 0.1)
    other = Workspace(replace(long, predictions={**long.predictions, "test": shifted}))
    beside = workspace.window("test", 0, beside=other)
    assert beside["laid"] and beside["drawn"] <= MOST  # however many lines there are
    peak = len(found.t) // 3
    drawn = [y for y in trace(whole["chart"], "measured")["y"] if y is not None]
    assert max(drawn) == pytest.approx(found.measured[peak, 0], rel=1e-4)  # no peak is lost
    low, high = (float(workspace.line("test")["t"][peak + k]) for k in (-500, 500))
    near = workspace.window("test", 0, low, high)
    assert near["samples"] == 1001 == near["drawn"] - 2  # one beyond either edge
    inside = slice(peak - 501, peak + 502)
    got = trace(near["chart"], "measured")
    assert got["y"] == pytest.approx(found.measured[inside, 0], rel=1e-4)
    assert near["chart"]["figure"]["layout"]["xaxis"]["range"] == [low, high]


def test_the_error_of_a_window_is_that_of_its_rows(arm):
    workspace, found = Workspace(arm), arm.predictions["test"]
    told = workspace.window("test", 1)
    assert told["rms"] == pytest.approx(arm.rms("test")[arm.joints[1]], rel=1e-12)
    assert told["here"] == told["rms"] and told["beside"] is None
    t = workspace.line("test")["t"]
    part = workspace.window("test", 1, 1.0, 2.0)
    inside = (t >= 1.0) & (t <= 2.0)
    left = (found.measured - found.predicted)[inside, 1]
    use = slice(None) if found.use is None else found.use[inside, 1]
    assert part["here"] == pytest.approx(np.sqrt(np.mean(left[use] ** 2)), rel=1e-12)
    assert part["left_out"] == (0 if found.use is None else (~found.use[inside, 1]).sum())
    assert "residual" in trace(part["chart"], "predicted")["hovertemplate"]


def test_before_and_after_stand_in_the_same_chart(arm):
    found = arm.predictions["test"]
    worse = replace(found, predicted=found.predicted + 0.1)
    before = Workspace(replace(arm, predictions={**arm.predictions, "test": worse}))
    told = Workspace(arm).window("test", 0, beside=before)
    assert told["beside"] > told["rms"] and told["laid"]
    assert trace(told["chart"], "predicted beside") and trace(told["chart"], "residual beside")
    assert trace(told["chart"], "difference")["y"][50] == pytest.approx(-0.1, rel=1e-3)
    # another filter leaves other edges: the rows of both are laid over each other
    part = {k: getattr(found, k)[7:-9] for k in ("t", "log", "measured", "predicted")}
    part["use"] = None if found.use is None else found.use[7:-9]
    other = Workspace(replace(arm, predictions={**arm.predictions, "test": replace(found, **part)}))
    told = Workspace(arm).window("test", 0, beside=other)
    assert told["laid"] and told["beside"] == other.window("test", 0)["rms"]
    assert trace(told["chart"], "predicted beside")["y"][0] is None
    # another log is not
    apart = replace(found, t=found.t + 1e-3)
    apart = Workspace(replace(arm, predictions={**arm.predictions, "test": apart}))
    told = Workspace(arm).window("test", 0, beside=apart)
    assert not told["laid"] and told["beside"] == told["rms"]


def test_every_row_of_a_window_as_csv(arm):
    workspace, found = Workspace(arm), arm.predictions["test"]
    head, *rows = csv.reader(io.StringIO(workspace.csv("test", 0, 0.5, 1.5)))
    assert head == ["log", "t [s]", "measured [N m]", "predicted [N m]", "residual [N m]"]
    t = workspace.line("test")["t"]
    inside = np.flatnonzero((t >= 0.5) & (t <= 1.5))
    assert len(rows) == len(inside)
    assert [float(row[2]) for row in rows] == found.measured[inside, 0].tolist()


def test_dots_say_where_the_joint_was(arm):
    told = Workspace(arm).cloud("test", 0)
    states = arm.predictions["test"].states
    data = told["position"]["figure"]["data"][0]
    assert len(data["x"]) == len(data["y"]) == len(told["t"]) and len(told["t"]) > 100
    at = Workspace(arm).line("test")["t"][states.index]
    k = int(np.argmin(np.abs(at - told["t"][50])))
    assert data["x"][50] == pytest.approx(states.q[k, 0], rel=1e-4)
    speed = told["speed"]["figure"]["data"][0]
    forward = [c for c, v in zip(speed["marker"]["color"], speed["x"]) if v > 0.1]
    assert len(set(forward)) == 1
    rows = sum(map(sum, told["map"]["figure"]["data"][0]["customdata"]))
    assert rows == np.isfinite(arm.predictions["test"].of_joint(0)[2][states.index]).sum()


def test_the_robot_moves_as_the_log_says(arm):
    film = Workspace(arm).film("train")
    assert len(film["t"]) == len(film["links"]) == len(film["joints"]) <= 600
    assert film["names"] == list(arm.joints) and film["t"] == sorted(film["t"])
    assert EVIL not in film["chart"]["figure"]["data"][1]["text"]  # as markup
    assert film["links"][0] != film["links"][len(film["links"]) // 2]


def test_names_of_a_file_are_text(arm):
    told = Workspace(arm).window("test", 0)
    assert told["joint"] == EVIL
    for one in told["chart"]["figure"]["data"]:
        assert "<img" not in one["name"] and "<img" not in one["hovertemplate"]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (("test", 9), "no such joint"),
        (("both", 0), "no part 'both'"),
        (("test", 0, 2.0, 1.0), "two numbers"),
        (("test", 0, float("nan"), 1.0), "two numbers"),
    ],
)
def test_what_cannot_be_is_said(arm, asked, said):
    with pytest.raises(SysidError, match=said):
        Workspace(arm).window(*asked)
