"""What the study of designs counts: a motion beyond its limits is seen, and ties are what holds 90 %."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scripts.design_parts import capsules, limits, precision, promise, robots, solvers, ties
from sysid import design
from sysid.datasets import DATASETS


@pytest.fixture(scope="module")
def planar(tmp_path_factory):
    experiment = robots.unlogged_experiment("planar", tmp_path_factory.mktemp("planar"))
    return experiment, design(experiment, duration=5.0, processes=1)


def test_a_motion_beyond_its_limits_is_seen(planar):
    experiment, found = planar
    case = {"margin": 0.05, "clearance": 0.01, "robot": "planar"}
    kept = limits.checked(experiment, found, case)
    assert max(kept["shares"][k] for k in ("position", "velocity", "torque")) <= 1.0 and kept["shares"]["rest"] < 1e-9
    wide = found.coefficients.copy()
    wide[:, 1:] *= 1.5 / max(kept["shares"].values())  # the largest share: three halves
    beyond = limits.checked(experiment, replace(found, coefficients=wide), case)
    assert max(beyond["shares"].values()) > 1.0
    results = [{"robot": "planar", **one} for one in (kept, beyond)]
    assert limits.table(results)[-1].endswith("beyond any limit: 1")


@pytest.mark.filterwarnings("ignore::sysid.errors.SysidWarning")  # no log, no shapes
@pytest.mark.parametrize("name", ["leg", "ur10e"])
def test_rods_by_hand_are_as_far_apart_as_coal_says(name):
    """Of robots whose URDF has no shapes."""
    if name in DATASETS and DATASETS[name].missing():
        pytest.skip(f"{name} is not in the data folder; `sysid fetch {name}` brings it, or SYSID_DATA_DIR names where it is")
    problem, pose, _ = robots.unlogged(name)
    rng = np.random.default_rng(0)
    poses = pose + rng.uniform(-1.5, 1.5, (40, len(pose)))
    looked = problem.geometry.at(pose[None])[0] > 0.0
    told = capsules.least(problem.known.model.robot, poses, pose, 0.0)
    assert told == pytest.approx(problem.geometry.at(poses)[:, looked].min(), abs=1e-6)


def test_segments_are_as_far_apart_as_a_search_along_both_says():
    rng = np.random.default_rng(0)
    ends = rng.normal(size=(4, 30, 3))
    share = np.linspace(0.0, 1.0, 201)[:, None, None]
    one, two = (a + share * (b - a) for a, b in (ends[:2], ends[2:]))
    searched = np.linalg.norm(one[:, None] - two[None], axis=3).min(axis=(0, 1))
    found = capsules.segments(*ends)
    assert np.all(found <= searched + 1e-9) and np.all(found > searched - 0.02)


def test_a_tie_is_what_holds_90_per_cent():
    members = [("a", "j", 0.85), ("c", "j", 0.04), ("b", "j", 0.11)]
    found = SimpleNamespace(claims=[SimpleNamespace(set=members), SimpleNamespace(set=[("a", "j", 0.95), ("b", "j", 0.05)])])
    assert [[e for e, *_ in own] for own in ties._sets(found)] == [["a", "b"], ["a"]]


def test_tables():
    one = {"robot": "leg", "tie": [["a", "j", 0.6], ["b", "j", 0.4]], "arms": {arm: {"alone": arm == "designed", "promised": 0.99 if arm == "designed" else None} for arm in ties.ARMS}}
    said = "\n".join(ties.table([one, {"robot": "leg", "tie": None, "arms": {}}]))
    assert "2 robots, 1 with a tie" in said and "alone 1/1 = 100%" in said and "alone 0/1" in said
    row = {"robot": "leg", **{kind: {"designed": 10.0, "random": 8.0} for kind in ("log_det", "error", "kappa")}}
    assert "10.0, error 10.000 (10)" in (said := precision.table([row]))[1] and said[1].endswith("-")
    rows = [{"name": n, "promised": p, "stated": 2.0, "few": 1.0, "all": 1.0} for n, p in (("a", 1.0), ("b", 1.1), ("c", 2.0))]
    assert "median 1.10, within a quarter 67%" in "\n".join(promise.table([{"robot": "leg", "seed": 7, "parameters": rows}]))
    assert promise.right(20) == pytest.approx(0.83, abs=0.01)
    assert "+1.5 in 2.0 s" in "\n".join(solvers.table([{"robot": "leg", "start": 1.0, "solvers": {"linear programs": {"worth": 2.5, "cpu": 2.0}}}]))
    for part in (limits, precision, promise, solvers, ties):
        assert part.case(3, 5) == part.case(3, 5) and part.case(3, 5)["robot"] in part.ROBOTS
