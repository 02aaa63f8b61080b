"""The study of servos without torque: it counts what it says, on an arm of one joint."""

import json

import pytest

from scripts import servo_study


@pytest.mark.long
def test_the_study_of_one_arm(capsys):
    options = ["--arms", "1", "--seed", "3", "--seconds", "5", "--cases", "link,nothing", "--json"]
    assert servo_study.main(options) == 0
    (arm,) = json.loads(capsys.readouterr().out)["arms"]
    link, nothing = arm["cases"]["link"], arm["cases"]["nothing"]
    assert {row["kind"] for row in link["values"]} == set(servo_study.KINDS)
    assert all(row["right"] for row in link["values"] if row["told"])
    assert not link["common_factor_said"] and nothing["common_factor_said"]
    assert "link     kp" in servo_study.table([arm], ("link", "nothing"))


@pytest.mark.long
def test_a_servo_that_lags_is_no_late_one(tmp_path):
    """One joint that follows its command by 50 ms, all of it damping: at such a delay next to no torque is left, and the
    columns explain none of that."""
    options = servo_study.parsed(["--seconds", "8"])
    true = servo_study.drawn(tmp_path, 60419, 6, options)
    assert true.kd[0] / true.kp[0] > 0.05
    found, _ = servo_study.fitted(tmp_path, "link", true, options.rate)
    told = {row["kind"]: row for row in servo_study.scored(found, true, "link", options.rate)}
    assert abs(told["delay"]["value"] - told["delay"]["true"]) < 2e-4
    assert all(row["right"] for row in told.values() if row["told"])
