"""The study of knocks: what it counts."""

import pytest

from scripts import knock_study


def test_arms_are_pushed_by_halves_in_every_motion():
    cases = [knock_study.case(3, number) for number in range(90)]
    assert cases == [knock_study.case(3, number) for number in range(90)]
    assert sum(c["pushed"] for c in cases) == 45 and 20 < sum(c["effect"] is None for c in cases) < 70
    assert {(c["robot"], c["motion"], c["pushed"]) for c in cases} == {
        (robot, motion, pushed) for robot in knock_study.ROBOTS for motion in knock_study.MOTIONS for pushed in (False, True)
    }


@pytest.mark.long
def test_a_push_and_a_log_without_one():
    told = knock_study.trial({**knock_study.case(3, 9), "robot": "planar", "motion": "exciting", "effect": None, "pushed": True})
    assert told["logs"] == 2 and told["pushes"] == 6 and told["found"] >= 3 and told["false"] == 0
    calm = knock_study.trial({**knock_study.case(3, 0), "robot": "planar", "motion": "exciting", "effect": None})
    assert calm["pushes"] == 0 == calm["found"] and calm["false"] == 0


def test_the_table_counts_arms_and_pushes():
    one = {"motion": "moves", "effect": None, "logs": 2, "pushes": 6, "found": 4, "false": 3}
    said = knock_study.table([one, {**one, "effect": "backlash", "false": 0}, {**one, "motion": "sines", "logs": 0}])
    assert "8/12" in said[0] and "none 1/1" in said[0] and "loose ones 0/1" in said[0] and "0/0" in said[1]
