"""What scripts/coverage.py counts, and that friction is where the fit says it is."""

import json

import numpy as np
import pytest
from scipy.stats import chi2

from scripts import coverage
from sysid import pipeline


def record(robot: str, **z) -> dict:
    return {"robot": robot, "rows": [{"kind": kind, "name": kind, "z": value} for kind, values in z.items() for value in values]}


def test_shares_are_counted_by_robot_and_kind():
    records = [record("leg", viscous=[0.1, -1.9], coulomb=[2.1]), record("leg", viscous=[-3.0], coulomb=[0.0], combination=[1.0]), record("ur5", inertial=[5.0])]
    found = {(e["robot"], e["kind"]): e for e in coverage.summary(records)}
    assert found["leg", "viscous"]["within"] == 2 / 3 and found["leg", "friction"]["within"] == 3 / 5 and found["leg", "friction"]["count"] == 5
    assert found["ur5", "inertial"]["within"] == 0.0 and found["all", "combination"]["within"] == 1.0
    assert found["leg", "viscous"]["rms_z"] == pytest.approx(np.sqrt((0.01 + 1.9**2 + 9.0) / 3))
    assert ("ur5", "viscous") not in found
    assert all(e["low"] <= e["within"] <= e["high"] for e in found.values())
    # over robots: (2 of 2, 0 of 1) leaves more in doubt than three draws would
    assert found["leg", "viscous"]["error"] == pytest.approx(np.sqrt(2 * ((2 - 4 / 3) ** 2 + (2 / 3) ** 2)) / 3)
    assert "outside 92 to 98 %" in coverage.table(list(found.values()))


def test_friction_is_within_what_is_stated_and_is_not_with_every_row(tmp_path, monkeypatch):
    """A leg with nothing hidden: the filter's smear at reversals put friction many deviations away."""
    monkeypatch.setitem(coverage.SECONDS, "leg", 10.0)
    place = tmp_path / "leg"
    assert coverage.one("leg", 11, None, str(place))["converged"]
    truth = json.loads((place / "truth.json").read_text())
    spec = pipeline.load(place)
    assert spec.preprocess.standstill == "auto"
    kept = spec.model_copy(update={"preprocess": spec.preprocess.model_copy(update={"standstill": "keep"})})
    friction = {}
    for name, experiment in (("auto", spec), ("keep", kept)):
        rows = coverage.rows(pipeline.fit(experiment), truth)
        friction[name] = np.array([row["z"] for row in rows if row["kind"] in ("viscous", "coulomb")])
        assert len(friction[name]) == 6 and {row["kind"] for row in rows} >= {"inertial", "combination"}
    # of six errors that are what is stated, the squares sum to less than this in 99 of 100 and in 9999 of 10000 legs
    assert np.sum(friction["auto"] ** 2) < chi2.ppf(0.99, 6) and np.sum(friction["keep"] ** 2) > chi2.ppf(0.9999, 6)
