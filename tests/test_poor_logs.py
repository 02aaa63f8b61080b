"""Logs of a second or two, of moves and closed brakes: they tell next to nothing, and a diagnosis says so."""

import json
import warnings

import numpy as np
import pytest

from scripts import fuzz_logs
from scripts.blind_parts.robots import experiment_of
from sysid import diagnose, pipeline
from sysid.blocks import evening
from sysid.errors import SysidWarning
from sysid.projection import directions, directions_of
from sysid.simulate import simulate, write
from sysid.triangles import Compressed, Factor


@pytest.mark.long
@pytest.mark.parametrize(
    ("seed", "duration", "rate", "encoder"),
    # of each there is a joint without a row, a part of the log without one, a column in one block alone, or an error of nought
    [(0, 1.0, 100.0, None), (2, 2.0, 100.0, None), (1, 3.0, 250.0, None), (0, 3.0, 250.0, 8), (9, 1.0, 100.0, None), (11, 2.0, 100.0, None)],
)
def test_a_diagnosis_of_stops_and_brakes_accuses_nothing(seed, duration, rate, encoder, tmp_path):
    experiment, machine = experiment_of("planar", tmp_path)
    write(simulate(machine, duration=duration, rate=rate, motion="moves", brakes=True, seed=seed, encoder=encoder), experiment, tmp_path / "case")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SysidWarning)
        found = diagnose(pipeline.load(tmp_path / "case"))
    assert not found.claims and not {v.status for v in found.verdict} & {"missing", "unknown"}
    assert all(one.size is None or 0.0 < one.size < np.inf for one in found.detectable)


def test_evening_takes_what_rounding_leaves_below_nought_as_nought():
    share = np.array([-1e-19, 1.0, 1e-18, 0.0])
    assert ((evening(share) >= 0.0) & (evening(share) <= 1.0)).all()


def test_columns_that_are_next_to_nought_make_no_direction():
    square = np.array([[[2e-316]], [[1.0]]])
    rough = np.array([[[1e-4]], [[1e-4]]])
    none, one = directions_of(square, square, square, rough)
    assert none is None and directions(*square[:1], *square[:1], *square[:1], rough[0]) is None
    np.testing.assert_allclose(one[0] ** 2, 1.0)


def test_a_joint_without_rows_has_an_empty_triangle():
    rng = np.random.default_rng(0)
    own = Factor(1, 0, np.array([0, 2]), np.triu(rng.normal(size=(3, 3))), 40)
    data = Compressed(3, 2, (own,), 40)
    x = rng.normal(size=3)
    assert data.squares(x)[0] == 0.0 and data.squares(x)[1] == pytest.approx(np.sum(own.misfit(x) ** 2))
    total = data.total(np.array([5.0, 1.0]))
    assert np.sum((total @ np.append(x, -1.0)) ** 2) == pytest.approx(data.squares(x)[1])


@pytest.mark.long
def test_poor_logs_are_drawn_again_and_end_in_a_document_or_a_line(capsys):
    assert fuzz_logs.drawn(1, 7) == fuzz_logs.drawn(1, 7) != fuzz_logs.drawn(1, 8)
    assert fuzz_logs.main(["--number", "4", "--seed", "1"]) == 0
    told = dict(part.split() for part in capsys.readouterr().out.replace("not made", "unmade").strip().split(", "))
    assert sum(map(int, told.values())) == 4 and int(told["told"]) > 0


def test_what_is_wrong_with_a_case_is_told(tmp_path, monkeypatch):
    (tmp_path / "config.yaml").write_text("robot: 3\n")
    assert fuzz_logs.diagnosed(tmp_path) == "refused"
    monkeypatch.setattr("sysid.cli.main", lambda: 1 / 0)
    assert fuzz_logs.diagnosed(tmp_path).startswith("ZeroDivisionError: division by zero")
    monkeypatch.setattr("sysid.cli.main", lambda: print(json.dumps({"rms": np.nan})))
    assert fuzz_logs.diagnosed(tmp_path) == "NaN in the document"
