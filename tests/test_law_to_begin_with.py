"""A law of one's own to begin with, where no effect of the catalogue explains what is left."""

import shlex

import pytest

from sysid.formula import Formula
from sysid.formula.text import parse
from sysid.statement.laws import of_bodies, to_begin_with


def entry(*follows, left: float = 0.6) -> dict:
    """A joint that is `unknown`, as a diagnosis has it."""
    return {"joint": "wrist", "share_left": left, "depends_on": [dict(zip(("variable", "share", "with"), one)) for one in follows]}


@pytest.mark.parametrize(
    ("follows", "linear", "has"),
    [
        (("q_elbow", 0.6), 3, "c*q_elbow**3"),
        (("q_wrist", 0.6), 3, "a*q + b*q**2"),
        (("time", 0.5), 3, "c*t**3"),
        (("load_wrist", 0.6, "direction"), 4, "a*s*load"),
        (("qd_wrist", 0.6), 3, "a*qd*abs(qd)"),
        (("qd_wrist", 0.6, "direction"), 3, "a*s*qd**2"),
        (("qd_wrist", 0.6, "time"), 5, "a*s*t"),
        (("q_elbow", 0.6, "qd_wrist"), 5, "a*s*q_elbow + b*s*q_elbow**2 + c*qd*q_elbow"),
        (("q_wrist", 0.6, "time"), 5, "a*q*t"),
    ],
)
def test_a_formula_in_what_a_residual_follows(follows, linear, has):
    found = to_begin_with(entry(follows), "arm/config.yaml", ())
    assert has in found["options"]["formula"] and len(parse(found["options"]["formula"]).linear) == linear
    words = shlex.split(found["command"])
    assert words[:4] == ["sysid", "add", "arm", "formula"] and f"formula={found['options']['formula']}" in words and words[4:6] == ["--joint", "wrist"]


def test_one_variable_that_says_nearly_as_much_comes_before_two():
    found = to_begin_with(entry(("qd_wrist", 0.6, "time"), ("time", 0.55)), "arm", ())
    assert found["options"]["formula"] == "a*t + b*t**2 + c*t**3"
    # not where it leaves twelve times as much
    assert "load*t" in to_begin_with(entry(("load_wrist", 0.99, "time"), ("time", 0.88)), "arm", ())["options"]["formula"]
    assert "qd" in to_begin_with(entry(("qd_wrist", 0.6, "time"), ("time", 0.3)), "arm", ())["options"]["formula"]


@pytest.mark.parametrize(
    "follows",
    [("a steady tone", 0.6), ("several variables together", 0.6), ("load_elbow", 0.6), ("qd_wrist", 0.6, "its past"), ("q_wrist", 0.2), ("q_a b", 0.6)],
)
def test_none_where_no_formula_can_hold_it_or_it_says_little(follows):
    assert to_begin_with(entry(follows), "arm", ()) is None


def test_the_name_is_one_that_a_formula_may_have():
    found = to_begin_with(entry(("q_J2", 0.6)), "arm", ())
    name = shlex.split(found["command"])[-1].partition("=")[2]
    assert Formula(found["options"]["formula"], name).name == name == "law_of_q_j2"


def test_none_that_is_in_the_model_already():
    there = {("viscous", "wrist"), ("law_of_q_elbow", "wrist"), ("law_of_q", "elbow"), ("law_of_qd", "wrist")}
    assert to_begin_with(entry(("q_elbow", 0.6)), "arm", there) is None
    assert to_begin_with(entry(("q_wrist", 0.6)), "arm", there) and to_begin_with(entry(("qd_wrist", 0.6, "time")), "arm", there)
    assert to_begin_with({"joint": "wrist", "share_left": 0.5, "depends_on": []}, "arm", ()) is None


def test_of_laws_the_first_that_a_fit_bears_out():
    """One that lets the test error rise is refused by `sysid add`, and is not offered."""
    asked = []

    def only(what):
        return lambda joint, options: asked.append((joint, options["name"])) or options["name"] == what

    several = entry(("q_elbow", 0.6), ("q_wrist", 0.55), ("time", 0.5))
    found = to_begin_with(several, "arm", (), only("law_of_q"))
    assert found["options"]["name"] == "law_of_q" and asked == [("wrist", "law_of_q_elbow"), ("wrist", "law_of_q")]
    assert to_begin_with(several, "arm", (), only("law_of_t")) is None  # each is a fit: two are made


def test_what_follows_another_joints_acceleration_is_the_bodies():
    for own in (("q_wrist", 0.6, "qdd_elbow"), ("qdd_elbow", 0.6), ("qd_wrist", 0.6, "qdd_elbow and direction")):
        assert of_bodies(entry(own)) and to_begin_with(entry(own), "arm", ()) is None
    for own in (("qdd_wrist", 0.6), ("q_wrist", 0.6, "qdd_wrist"), ("qd_elbow", 0.6), ("time", 0.6)):
        assert not of_bodies(entry(own))
    assert not of_bodies({"joint": "wrist"})
