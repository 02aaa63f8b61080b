"""The blind benchmark on logs as labs have them: its cases, and what counts as a false claim."""

import json
import math
from collections import Counter
from dataclasses import asdict, replace

import numpy as np
import pytest

from scripts import blind_benchmark
from scripts.blind_parts import cases, claims, conditions, hidden, page, robots, scoring, summary, trial
from tests.test_blind_benchmark import finding, record, verdict

KNEE = ("stribeck", "knee")


def new(joint, status="missing", effect=None, members=()):
    """A verdict of the new diagnosis; members: (effect, joint, probability)."""
    out = {"joint": joint, "status": status, "depends_on": []}
    if effect is None:
        return out
    keys = ("effect", "joint", "probability")
    return out | {"effect": effect, "set": [dict(zip(keys, member)) for member in members]}


def test_claims_of_both_kinds_of_documents():

    def made(name="false claims", **said):
        return claims.counts([record(KNEE, **said)])[name]

    def both(**said):
        return made("false claims, families too", **said)

    steps = [finding("stribeck", "knee", 1), finding("spring", "knee", 2)]
    old = {"knee": verdict("knee", "stribeck", also=["spring"]), "findings": steps}
    assert made(**old) == (1, 2)
    head = new(
        "knee", effect="stribeck", members=[("stribeck", "knee", 0.7), ("cable", "knee", 0.2)]
    )
    assert made(knee=head) == (0, 1)
    other = new("knee", effect="cable", members=[("cable", "knee", 0.7), ("stribeck", "knee", 0.2)])
    assert made(knee=other) == (1, 1) and both(knee=other) == (0, 1)
    elsewhere = new(
        "knee", effect="cable", members=[("cable", "knee", 0.7), ("stribeck", "hip", 0.2)]
    )
    assert both(knee=elsewhere) == (1, 1)
    for status in ("complete", "unknown", "unresolved", "explained"):
        assert made(knee=new("knee", status)) == (0, 0)


def test_an_effect_of_the_robot_is_one_claim():
    said = {joint: new(joint, effect="gravity_tilt") for joint in ("hip", "knee")}
    steps = [finding("gravity_tilt", "*", 1)]
    true = claims.claims(record(("gravity_tilt", "*"), findings=steps, **said))
    assert [(c["effect"], c["joint"], c["true"]) for c in true] == [("gravity_tilt", "*", True)]
    assert not claims.claims(record(KNEE, findings=steps, **said))[0]["true"]


def test_a_name_beside_an_outside_law_is_a_claim_on_other_joints_only():
    own = record(("creep", "knee"), kind="outside", knee=verdict("knee", "presliding"))
    other = record(("creep", "knee"), kind="outside", hip=verdict("hip", "presliding"))
    assert claims.claims(own) == [] and not claims.claims(other)[0]["true"]
    assert (
        claims.claims(record(KNEE, error={"stage": "fit", "message": "", "trace": ""})) == []
    )


def test_floors_count_within_a_quarter_or_null():
    made = record(KNEE) | {
        "floors": {"hip": 1.25, "knee": None},
        "noise_seen": {"all": {"hip": 1.0, "knee": 1.0}},
    }
    found = claims.counts([made, made | {"floors": {"hip": 0.7, "knee": 1.3}}])
    assert found["floors"] == (2, 4) and found["floors null"] == (1, 4)
    assert found["ratios"] == pytest.approx([0.7, 1.25, 1.3])


def test_new_statuses_are_scored():
    category = lambda knee: scoring.score(record(KNEE, knee=knee))[0]["category"]  # noqa: E731
    assert (
        category(new("knee", "unresolved")) == "unresolved"
        and category(new("knee", "explained")) == "missed"
    )
    pair = [("stribeck", "knee", 0.6), ("cable", "knee", 0.3)]
    assert category(new("knee", effect="stribeck", members=pair)) == "head of family"
    assert category(new("knee", effect="cable", members=pair)) == "in family, not head"
    assert category(new("knee", effect="stribeck", members=pair[:1])) == "alone"
    outside = record(("heat", "knee"), kind="outside", knee=new("knee", "unresolved"))
    assert scoring.score(outside)[0]["category"] == "unresolved"


def test_summary_and_page_under_each_of_the_conditions():
    control = record(kind="control", key="leg/control/n0", knee=new("knee", "unresolved"))
    accused = record(kind="control", key="leg/control/n1", knee=new("knee", effect="cable"))
    accused["conditions"]["nuisances"] = {"knocks": 3}
    named = record(
        KNEE, knee=verdict("knee", "stribeck"), findings=[finding("stribeck", "knee", 1)]
    )
    records = [control, accused, named | {"floors": {"hip": 1.0, "knee": None}}]
    for under in conditions.CONDITIONS:
        found = summary.summary(records, under)
        bars = {bar["name"]: bar["reached"] for bar in found["bars"]}
        assert (bars["cases"], bars["floors"]["count"], bars["sets"]["count"]) == (3, 2, 1)
        assert ("controls at peace" in bars) == (under != "sines")
        if under != "sines":
            assert (bars["controls at peace"]["count"], bars["controls at peace"]["of"]) == (1, 2)
            assert (bars["false claims"]["count"], bars["false claims"]["of"]) == (1, 2)
        settings = {
            "cases": "full",
            "seed": 7,
            "only": [],
            "limit": 0,
            "source": "x",
            "versions": {},
        }
        text = page.page(found, records, settings | {"conditions": under})
        assert ("--conditions" in text) == (under != "clean") and "unresolved" in text
        assert "knocks 3" in text
        json.dumps(blind_benchmark._plain(found), allow_nan=False)


def test_cases_with_nuisances_are_as_promised():
    full = cases.cases(5, under="nuisances")
    assert full == cases.cases(5, under="nuisances") and 190 <= len(full) <= 240
    clean = {case.key for case in cases.cases(5)}
    assert len({case.key for case in full} | clean) == len(full) + len(clean)
    kinds, own = Counter(c.kind for c in full), Counter(c.robot for c in full)
    assert (
        kinds["control"] >= 50
        and kinds["two"] >= 20
        and kinds["outside"] == 64
        and len(own) == 4
    )
    assert {h["effect"] for c in full if c.kind == "one" for h in c.hidden} == set(hidden.EFFECTS)
    options = Counter(option for case in full for option in case.nuisances)
    assert all(case.nuisances for case in full)
    for option in ("motion", "brakes", "knocks", "spikes", "logs", "jitter", "current"):
        assert 30 < options[option] < 140, option
    assert set(cases.cases(5, "small", "nuisances")[0].nuisances) <= set(options)
    assert sum(c in full for c in cases.cases(5, "small", "nuisances")) >= 30


def test_cases_of_sines_are_large():
    full = cases.cases(5, under="sines")
    assert len(full) == 60 and len({case.key for case in full}) == 60
    assert {h["effect"] for case in full for h in case.hidden} == set(hidden.EFFECTS)
    for case in full:
        (entry,) = case.hidden
        middle = math.sqrt(
            hidden.SIZES[0] * min(hidden.SIZES[1], hidden.LARGEST.get(entry["effect"], 9))
        )
        assert case.nuisances == {"motion": "sines"} and entry["size"] > 0.99 * middle


def test_nuisances_are_drawn_one_to_three_and_can_be_simulated(tmp_path):
    from sysid.simulate.nuisances import checked

    drawn = [conditions.drawn(np.random.default_rng(seed)) for seed in range(200)]
    assert Counter(len(kinds) for kinds, _ in drawn).keys() == {1, 2, 3}
    for kinds, options in drawn:
        usual = {"motion": "exciting", "logs": 1, "rate": 500.0, "knocks": 0, "spikes": 0.0}
        usual |= {"brakes": False, "jitter": 0.0, "current": None}
        checked(**(usual | {k: v for k, v in options.items() if k != "duration"}))
        assert ("short logs" in kinds) == ("duration" in options)
        assert ("brakes" in kinds) <= (options.get("motion") == "moves")


@pytest.mark.long
def test_a_case_with_nuisances_from_end_to_end():
    case = next(c for c in cases.cases(1) if c.key == "planar/control/0")
    options = {"logs": 2, "duration": 4.0, "rate": 100.0, "jitter": 1.0, "spikes": 0.5, "knocks": 1}
    case = replace(case, colour=None, encoder=None, pace=None, nuisances=options)
    found = json.loads(json.dumps(trial.one(asdict(case))))
    assert found["error"] is None, found["error"]
    assert found["conditions"]["nuisances"] == options and list(found["events"]) == [
        "train_1",
        "train_2",
        "test",
    ]
    assert min(found["events"].values()) >= 1
    for joint, noise in found["noise_seen"]["torque"].items():
        assert noise < found["noise_seen"]["all"][joint]
        # linear interpolation between uneven stamps takes a little off: 2/3 to all of its power
        assert 0.8 * found["noise"][joint] < noise < 1.1 * found["noise"][joint]
    assert set(found["floors"]) == set(robots.JOINTS["planar"])


@pytest.mark.long
def test_an_encoder_that_is_off_is_no_noise(tmp_path):
    from sysid import pipeline
    from sysid.simulate import Hidden, simulate, write

    experiment, machine = robots.experiment_of("planar", tmp_path)
    seen = {}
    for name, hide in (("plain", []), ("off", [Hidden("encoder_offset", "elbow", {"size": 1.0})])):
        simulation = simulate(machine, hide=hide, seed=3, duration=6.0, rate=500.0)
        write(simulation, experiment, tmp_path / name)
        fit = pipeline.fit(pipeline.load(tmp_path / name))
        seen[name] = conditions.noise_seen(simulation, fit, tmp_path)["all"]
    for joint, noise in seen["plain"].items():
        assert seen["off"][joint] == pytest.approx(noise, rel=0.05)
