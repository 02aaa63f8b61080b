"""The document of `sysid diagnose` keeps the shape that is promised, whatever is found."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sysid.candidates import candidates
from sysid.failures import regions
from sysid.lowpass import LEAST
from sysid.report.sections import sections
from sysid.statement import text
from sysid.statement.claims import confidence_set, ties
from sysid.statement.document import document
from tests.test_select import BIAS, PRODUCT, TWO

NUMBER, OR_NONE = (int, float), (int, float, type(None))
DIAGNOSE = {
    "joints": {str: {"rms": {"train": NUMBER, "test": NUMBER}, "noise_floor": OR_NONE, "floor_method": str, "status": str}},
    "findings": [{
        "effect": str, "joint": str, "q_value": NUMBER, "rms_test_before": NUMBER, "rms_test_after": NUMBER, "misfit_removed": NUMBER,
        "misfit_removed_se": NUMBER, "parameters": {str: {"value": NUMBER, "unit": str}}, "tied_with": [str], "separate_by": str,
        "probability": NUMBER, "command": str,
    }],
    "verdict": [{"joint": str, "status": str}],
    "detectable": [{"effect": str, "joint": str, "parameter": str, "size": NUMBER, "unit": str, "power": NUMBER, "at": {str: NUMBER}}],
    "events": [{"kind": str, "log": str, "start": NUMBER, "stop": NUMBER, "joints": [str]}],
    "absorbed": [{"effect": str, "joint": str, "separate_by": str}],
    "fails_where": [{"joint": str, "share_of_error": NUMBER, "words": [str], "regions": list, "map": dict, "time": dict, "frequency": dict}],
    "not_claimed": [{"effect": str, "joint": str, "why": str}], "notices": [str], "run": str,
}  # fmt: skip
NAMED = {"effect": str, "set": [{"effect": str, "probability": NUMBER}], "command": str, "explained": NUMBER, "tied_with": [str], "also": [str]}
STATUS = ("complete", "missing", "unknown", "unresolved", "explained")
MORE = {
    "missing": NAMED, "unknown": {"depends_on": [{"variable": str, "share": NUMBER}], "share_left": NUMBER, "also": [str]},
    "explained": {"by": [{"effect": str, "joint": str}]}, "unresolved": {"says": str}, "complete": {},
}  # fmt: skip


def keeps(said, shape, at: str = "$") -> None:
    """A document has the keys and kinds of a shape: {str: shape} is a map, [shape] a list."""
    if isinstance(shape, dict):
        assert isinstance(said, dict), at
        if set(shape) == {str}:
            for key, value in said.items():
                keeps(value, shape[str], f"{at}.{key}")
            return
        for key, own in shape.items():
            assert key in said, f"{at} lacks {key}"
            keeps(said[key], own, f"{at}.{key}")
    elif isinstance(shape, list):
        assert isinstance(said, list), at
        for i, value in enumerate(said):
            keeps(value, shape[0], f"{at}[{i}]")
    else:
        assert isinstance(said, shape) and not isinstance(said, bool), f"{at} is {said!r}"


CASES = {"control": ("control",), "bias": BIAS, "two": TWO, "product": PRODUCT}


@pytest.fixture(params=CASES)
def found(request, diagnosed):
    more = {"seed": 2, "duration": 14.0} if request.param == "product" else {}
    return diagnosed(*CASES[request.param], **more)


@pytest.mark.long
def test_the_document_keeps_its_shape(found):
    said = document(found, "runs/x")
    assert json.loads(json.dumps(said, allow_nan=False)) == said and said["run"] == "runs/x"
    keeps(said, DIAGNOSE)
    joints = list(found.fit.joints)
    assert list(said["joints"]) == joints == [v["joint"] for v in said["verdict"]]  # every joint once
    for v in said["verdict"]:
        assert v["status"] in STATUS and v["status"] == said["joints"][v["joint"]]["status"]
        keeps(v, MORE[v["status"]], f"verdict of {v['joint']}")
        if v["status"] == "missing":
            assert sum(e["probability"] for e in v["set"]) == pytest.approx(1.0)
            assert v["effect"] in [e["effect"] for e in v["set"]] and v["commands"][0] == v["command"]
            assert any((f["effect"], f["command"]) == (v["effect"], v["command"]) for f in said["findings"])
    for joint, entry in said["joints"].items():
        assert entry["rms"] == {part: found.fit.rms(part)[joint] for part in ("train", "test")}


def test_findings_stand_in_their_order(found):
    said = document(found)
    steps = [f["joins_as_step"] for f in said["findings"]]
    assert [s for s in steps if s] == list(range(1, len(found.claims) + 1)) and steps[:1] in ([], [1])
    for f in said["findings"]:
        assert 0 < f["q_value"] <= 1 and 0 <= f["probability"] <= 1 and f["command"].startswith("sysid add ")
        assert f["parameters"] and all(set(entry) == {"value", "std", "unit"} for entry in f["parameters"].values())
        assert f["joint"] in (*found.fit.joints, "*") and f["misfit_removed"] <= 1.0


def test_every_effect_is_detectable_or_absorbed_and_not_both(found):
    said = document(found)
    seen, absorbed = ([(e["effect"], e["joint"]) for e in said[key]] for key in ("detectable", "absorbed"))
    assert not set(seen) & set(absorbed) and len(set(seen)) == len(seen) and ("payload", "*") in absorbed
    assert all(e["size"] > 0 and e["power"] == 0.9 for e in said["detectable"])


def test_where_it_fails_is_all_of_the_error(found):
    said = document(found)["fails_where"]
    assert sorted(f["joint"] for f in said) == sorted(found.fit.joints)
    assert sum(f["share_of_error"] for f in said) == pytest.approx(1.0)
    for f in said:
        assert sum(f["frequency"]["share"]) == pytest.approx(1.0, abs=1e-6)
        assert len(f["frequency"]["edges"]) == len(f["frequency"]["share"]) + 1
        assert len(f["map"]["mean"]) == len(f["map"]["q"]) - 1
        for r in f["regions"]:
            assert 0 < r["share_of_rows"] < 1 and r["low"] < r["high"] and r["share_of_error"] > r["share_of_rows"]


def test_the_low_pass_is_said(found):
    said = document(found)["low_pass"]
    assert 0 < said["cutoff_hz"] <= 4 * LEAST
    # what is claimed takes error away under the low-pass too, on logs that nothing was fitted on
    joints = {c.head.joint for c in found.claims}
    assert joints or said["rms_test_after"] == said["rms_test_before"]
    for joint in joints:
        assert said["rms_test_after"][joint] < said["rms_test_before"][joint]


def test_a_region_in_words():
    words = regions.Region("qd", "rad/s", -0.1, 0.05, 0.62, 0.11).words()
    assert words == "62 % of the squared error lies in the 11 % of the rows with speed -0.1 to 0.05 rad/s"
    words = regions.Region("q", "rad", 0.9, 1.0, 0.62, 0.11, new=0.9).words()
    assert words.endswith("with angle 0.9 to 1 rad, where the training logs were not")


def test_what_of_a_region_s_error_lies_where_no_training_log_was():
    values, square = np.array([0.0, 0.5, 0.9, 1.0, 1.1]), np.array([1.0, 1.0, 1.0, 4.0, 5.0])
    region = regions.Region("q", "rad", 0.9, 1.1, 0.8, 0.6)
    new = lambda *trained: regions._beyond(region, values, square, [np.array(own) for own in trained]).new  # noqa: E731
    assert new([-1.0, 0.0], [0.5, 0.95]) == pytest.approx(0.9)
    # as far, or nearly: of a stop most error is where it is pressed most
    assert new([-1.0, 1.2]) == 0.0 == new([-1.0, 1.08])
    assert new([-1.0, 0.0]) == pytest.approx(1.0)


def test_no_number_is_left_out_where_it_is_not_known(diagnosed):
    """NaN is null, and a floor that nobody knows is null too."""
    from dataclasses import replace

    from sysid.noise import NoiseFloor

    made = diagnosed("control")
    said = document(replace(made, floors={j: NoiseFloor(None, None, "spectral", "too short") for j in made.fit.joints}))
    assert {entry["noise_floor"] for entry in said["joints"].values()} == {None} == {e["noise_floor_se"] for e in said["joints"].values()}
    json.dumps(said, allow_nan=False)
    assert np.isfinite(made.fit.rms("test")["elbow"])


def test_what_is_unresolved_needs_another_log(found):
    """The command that designs it is told where a joint is unresolved, and only there; in words, on a line of its own, whole."""
    target = found.fit.experiment.path.parent
    for status, command in (("unresolved", f"sysid design {target} --out next"), ("complete", None)):
        verdict = tuple(replace(v, status=status, claims=(), says="why", left=None, may=None, even=False, reason=None) for v in found.verdict)
        other = replace(found, verdict=verdict)
        said = document(other, "runs/x")
        assert said["next_log"] == command
        lines = [line for _, own in text.verdict(text.told(other, said), 60) for line in own]
        assert [line for line in lines if "sysid design" in line] == ([command] if command else [])
        card = sections(found.fit, said, [])["verdict"]["html"]
        assert ("shoulder and elbow need another log" in card) is ("sysid design" in card) is (command is not None)


def test_what_may_be_it_is_to_be_tried_and_what_weights_leave_needs_no_log(found):
    """Of two unresolved joints, one with an effect that may be it and one whose error is how joints are weighed: neither needs another log,
    the first one's command stands on a line of its own and on the page."""
    model, joints = found.fit.model, found.fit.joints
    may = next(c for c in candidates(model) if c.name == "elasticity" and c.joint == 0)
    plain = {"status": "unresolved", "claims": (), "says": "why", "left": None}
    one, other = (replace(v, **plain, **more) for v, more in zip(found.verdict, ({"may": may}, {"even": True})))
    made = replace(found, verdict=(one, other))
    said = document(made, "runs/x")
    command = f"sysid add {found.fit.experiment.path.parent} elasticity --joint {joints[0]}"
    own = said["verdict"][0]["may_be"]
    assert said["next_log"] is None and own["command"].startswith(command) and own["joint"] == joints[0]
    assert own["options"] == dict(may.options) and said["verdict"][1]["weighting"] == "noise"
    lines = [line for _, some in text.verdict(text.told(made, said), 60) for line in some]
    assert own["command"] in lines and not any("design" in line for line in lines)
    card = sections(found.fit, said, [])["verdict"]["html"]
    assert command in card and "another log" not in card and "blind" not in card


@pytest.mark.parametrize(
    ("chances", "inside"),
    [((1.0,), 1), ((0.5, 0.5), 2), ((0.92, 0.08), 1), ((0.89, 0.08, 0.03), 2), ((0.26, 0.74), 2), ((0.4, 0.3, 0.25, 0.05), 3)],
)
def test_a_set_holds_the_truth_nine_times_in_ten_and_no_more(chances, inside):
    """The head is in it, however likely; what is left out is not ruled out, and stands in the claim's own set."""
    members = tuple((effect, "hip", p) for effect, p in zip(("cable", "spring", "cogging", "stribeck"), chances))
    claim = SimpleNamespace(set=members)
    assert confidence_set(claim) == members[:inside]
    others = [effect for effect, *_ in members[1:inside]]
    assert ties(claim, SimpleNamespace(effect="cable", joint="hip")) == others
    assert ties(claim, SimpleNamespace(effect="cable", joint="knee")) == [f"{effect} on hip" for effect in ("cable", *others)]
