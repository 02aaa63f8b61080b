"""The study of servos without torque: it counts what it says, on an arm of one joint."""

import json

from scripts import servo_study


def test_the_study_of_one_arm(capsys):
    options = ["--arms", "1", "--seed", "3", "--seconds", "5", "--cases", "link,nothing", "--json"]
    assert servo_study.main(options) == 0
    (arm,) = json.loads(capsys.readouterr().out)["arms"]
    link, nothing = arm["cases"]["link"], arm["cases"]["nothing"]
    assert {row["kind"] for row in link["values"]} == set(servo_study.KINDS)
    assert all(row["right"] for row in link["values"] if row["told"])
    assert not link["common_factor_said"] and nothing["common_factor_said"]
    assert "link     kp" in servo_study.table([arm], ("link", "nothing"))
