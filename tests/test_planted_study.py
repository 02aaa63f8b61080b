"""The study of effects planted in real logs: what it plants, and what it counts."""

import numpy as np
import pytest

from scripts import planted_study
from sysid import log

JOINTS = {"arm": ["a", "b"], "slide": ["x"]}


def test_cases_are_drawn_by_their_seed_and_a_lone_joint_has_no_other():
    drawn = planted_study.cases(5, 200, JOINTS)
    assert drawn == planted_study.cases(5, 200, JOINTS) != planted_study.cases(6, 200, JOINTS)
    assert {c["robot"] for c in drawn} == set(JOINTS) and {c["effect"] for c in drawn} == set(planted_study.EFFECTS)
    assert not [c for c in drawn if c["robot"] == "slide" and c["effect"] == "joint_coupling"]
    assert all(planted_study.SIZES[0] <= c["times"] <= planted_study.SIZES[1] for c in drawn)


@pytest.mark.parametrize("effect", planted_study.EFFECTS)
def test_a_log_that_is_read_meanwhile_has_the_effect_and_no_other_joint_does(effect):
    t = np.arange(0.0, 4.0, 0.01)
    part = {"q": np.stack([np.sin(t), np.cos(2 * t)], axis=1), "tau": np.stack([np.cos(t), np.sin(t)], axis=1)}
    before = part["tau"].copy()
    about = {"middle": np.zeros(2), "travel": np.full(2, 2.0), "speed": np.array([0.7, 1.4]), "turns": 5.0, "other": 0}
    with planted_study.planted(effect, 1, about, 0.3):
        found = log.segment(t, 0.01, part)
    plain = log.segment(t, 0.01, part)
    np.testing.assert_array_equal(part["tau"], before)  # what was read is as it was
    np.testing.assert_array_equal(plain.tau, before)
    np.testing.assert_allclose(found.tau[:, 1] - before[:, 1], 0.3 * planted_study.law(effect, plain, 1, about), atol=1e-12)
    np.testing.assert_array_equal(found.tau[:, 0], before[:, 0])
    wanted = {
        "spring": np.cos(2 * t), "quadratic_drag": -4 * np.sin(2 * t) * np.abs(np.sin(2 * t)), "joint_coupling": -np.sin(t), "torque_gain": np.sin(t),
        "asymmetric_viscous": 2 * np.abs(np.sin(2 * t)), "cogging": np.sin(2 * np.pi * 5 * np.cos(2 * t) / 2),
    }  # fmt: skip
    if effect in wanted:
        inside = slice(20, -20)
        np.testing.assert_allclose((found.tau[:, 1] - before[:, 1])[inside], 0.3 * wanted[effect][inside], atol=0.01)


def test_the_table_counts_what_is_visible_and_was_not_there_before():
    plain = {
        "robot": "arm",
        "said": {"a": {"status": "missing", "claimed": ["cable"], "sets": ["cable"]}, "b": {"status": "complete", "claimed": [], "sets": []}},
    }

    def case(effect, claimed, sets=(), true=1.0, elsewhere=()):
        said = {"a": {"status": "missing", "claimed": claimed, "sets": [*claimed, *sets]}, "b": {"status": "missing", "claimed": list(elsewhere), "sets": []}}
        return {"robot": "arm", "name": "a", "effect": effect, "times": 1.0, "errors": {"before": 1.0, "planted": 2.0, "true": true}, "said": said}

    records = [
        plain, case("spring", ["spring"]), case("cogging", ["cable", "cogging"], elsewhere=["delay"]), case("stribeck", ["cable"], ["stribeck"]),
        case("spring", []), case("spring", [], true=1.9), case("cable", ["cable"]),
    ]  # fmt: skip
    said = planted_study.told(records)
    assert {k: said[k] for k in ("cases", "visible", "claimed", "first", "in a set", "there before", "elsewhere, more")} == {
        "cases": 6, "visible": 4, "claimed": 2, "first": 1, "in a set": 3, "there before": 1, "elsewhere, more": 1,
    }  # fmt: skip
    assert [m["case"] for m in said["missed"]] == ["arm, a, stribeck x 1", "arm, a, spring x 1"]
    text = planted_study.page(said, records, "python a study")
    assert "| of these claimed | 2 of 4 |" in text and text.count("| arm, a |") == 6 and text.count("**yes**") == 3
