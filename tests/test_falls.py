"""How far everything falls with a candidate: against the refit that a diagnosis makes of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import config, pipeline
from sysid.candidate_columns import at_start
from sysid.candidates import candidates, own_effects
from sysid.diagnose.ask import Asked, ask
from sysid.trusted import trust
from sysid.view import falls, first_view, joined
from sysid.view.falls import _most as most


@pytest.fixture(scope="module")
def view(simulated):
    experiment = pipeline.load(simulated("falls", "spring:elbow:size=2"))
    return first_view(experiment, pipeline.fit(experiment))


@pytest.mark.long
@pytest.mark.parametrize("key", [("spring", 1), ("spring", 0), ("torque_bias", 0), ("joint_coupling", 1), ("quadratic_drag", 1), ("load_friction", 0)])
def test_everything_falls_as_far_as_in_the_refit(view, key):
    """The same least: of bodies that give way, of friction that stays at nought or leaves it."""
    candidate = next(c for c in candidates(view.model) if c.key == key)
    (fall,) = falls(view, [SimpleNamespace(candidate=candidate, shapes={})])
    left = view.settled.objective - joined(view, (candidate, {})).settled.objective
    assert fall == pytest.approx(left, abs=2e-4 * view.settled.objective)


@pytest.fixture(scope="module", params=["known", "payload"])
def bound(request, simulated):
    """The same with a body that is known, or one that an effect carries."""
    path = simulated("falls", "spring:elbow:size=2") / "config.yaml"
    text = path.read_text()
    if request.param == "known":
        text = text.replace("known: []", "known: [fore]")
    else:
        text = text.replace("effects: [", "effects: [{payload: {logs: [train.csv]}}, ")
    experiment = config.loads(text, path)
    assert experiment.prior.known or len(experiment.model.effects) == 4
    return first_view(experiment, pipeline.fit(experiment))


@pytest.mark.parametrize("key", [("spring", 1), ("torque_bias", 0), ("quadratic_drag", 1)])
def test_so_it_does_where_a_body_is_known_or_carried(bound, key):
    """What is known stays so, and what is carried stays possible."""
    candidate = next(c for c in candidates(bound.model) if c.key == key)
    (fall,) = falls(bound, [SimpleNamespace(candidate=candidate, shapes={})])
    left = bound.settled.objective - joined(bound, (candidate, {})).settled.objective
    assert fall == pytest.approx(left, abs=2e-4 * bound.settled.objective)
    if key == ("spring", 1):
        assert fall > 0.4 * bound.settled.objective


def test_a_problem_with_a_candidate_is_the_views_own(bound, monkeypatch):
    """The same weight of the prior, and of that of what an effect carries."""
    own, posed = bound.settled.problem, []
    nearby = type(own).from_nearby
    monkeypatch.setattr(type(own), "from_nearby", lambda problem, *how: posed.append(problem) or nearby(problem, *how))
    asked = [SimpleNamespace(candidate=c, shapes={}) for c in candidates(bound.model) if c.name in ("spring", "torque_bias", "cable")]
    assert np.all(falls(bound, asked) >= -1e-6 * bound.settled.objective)
    assert len(posed) == len(asked) and {one.objective.weight for one in posed} == {own.objective.weight}
    assert (own.carried is None) == bool(bound.experiment.prior.known)
    assert {one.carried and one.carried.weight for one in posed} == {own.carried and own.carried.weight}


SENSORS = """
from sysid.effect import SensorEffect, Shape

class Lagged(SensorEffect):
    name, unit, why = "lagged", "N m", "a sensor that follows itself"
    e = Shape("1", -0.5, 0.5, start=0.0, says="share")
    T = Shape("s", 0.001, 0.05, says="time constant")

    def sensed(self, torque, step, *, e, T):
        return (1.0 + e) * torque

class Below(SensorEffect):
    name, unit, why = "below", "N m", "a signal that can only be too small"
    e = Shape("1", -0.5, 0.0, start=0.0, says="share")

    def sensed(self, torque, step, *, e):
        return (1.0 + e) * torque
"""


def test_effects_of_the_users_own_that_read_torque(simulated):
    """One with a value that only says how; and one that may not rise: it falls no further than its bound lets it, either way."""
    path = simulated("falls", "spring:elbow:size=2") / "config.yaml"
    (path.parent / "reads.py").write_text(SENSORS)
    trust(path.parent / "reads.py")
    experiment = config.loads(path.read_text().replace("model:\n", "model:\n  candidates: ['reads.py:Lagged', 'reads.py:Below']\n"), path)
    seen = first_view(experiment, pipeline.fit(experiment))
    found = ask(seen, own_effects(experiment)).groups
    by_name = {name: [g for g in found if g.candidate.name == name] for name in ("lagged", "below", "torque_gain")}
    assert by_name["lagged"] and by_name["below"]
    gains = {g.candidate.joint: fall for g, fall in zip(by_name["torque_gain"], falls(seen, by_name["torque_gain"]))}
    tolerance = 1e-3 * seen.settled.objective
    for group, fall in zip(by_name["lagged"], falls(seen, by_name["lagged"])):
        assert fall == pytest.approx(gains[group.candidate.joint], abs=tolerance)
    for group, fall in zip(by_name["below"], falls(seen, by_name["below"])):
        assert fall == pytest.approx(gains[group.candidate.joint] if group.c[0] < 0.0 else 0.0, abs=tolerance)


def test_what_no_block_can_test_may_be_what_is_left(view):
    """The likeliest that a test leaves standing, else who takes most of what cannot be tested; what the tests rule out is none."""
    groups = [g for g in ask(view).groups if g.candidate.joint == 1 and g.signed][:2]

    def near(*statistics):
        n = len(statistics)
        asked = Asked({1: (groups[:n], np.array(statistics), np.array([2.0, 3.0])[:n], np.linspace(0.0, 4.0, 1000))}, None)
        return asked.near(1, 3.0, False)

    assert near(0.5) is None
    assert near(0.5, np.nan) == (groups[1].candidate, 1.0)
    assert near(np.nan) == (groups[0].candidate, 1.0)
    candidate, p = near(3.99, np.nan)
    assert candidate is groups[0].candidate and p < 0.01


def test_a_softness_below_nought_is_none(view):
    """The slope of what a joint gives falls no further than its bound lets it: a joint that would be stiffer than stiff takes nothing."""
    groups = [g for g in ask(view).groups if g.candidate.name in ("elasticity", "current_lag") and at_start(g.candidate, g.shapes) and g.c[0] < 0.0]
    assert groups
    assert falls(view, groups) == pytest.approx(0.0, abs=1e-4 * view.settled.objective)


def test_no_candidate_makes_everything_rise(view):
    """What cannot help is nothing."""
    found = falls(view, [SimpleNamespace(candidate=c, shapes={}) for c in candidates(view.model) if not c.effect.shapes()])
    assert np.all(found >= -1e-4 * view.settled.objective)


def test_who_cannot_fall_as_far_is_not_settled(bound, monkeypatch):
    """The tangent of a convex prior stands below it: nobody who falls so far is left out, not all others are settled."""
    asked = [SimpleNamespace(candidate=c, shapes={}) for c in candidates(bound.model) if not c.effect.shapes()]
    every = falls(bound, asked)
    share = 0.1 * every.max() / np.sum(bound.design.residual**2, axis=0).min()
    least = 0.1 * every.max()
    posed = []
    nearby = type(bound.settled.problem).from_nearby
    monkeypatch.setattr(type(bound.settled.problem), "from_nearby", lambda problem, *how: posed.append(problem) or nearby(problem, *how))
    found = falls(bound, asked, share)
    assert np.array_equal(found[every >= least], every[every >= least])
    assert np.sum(every >= least) <= len(posed) < len(asked)


def test_columns_that_the_models_own_hold_may_fall_as_far_as_the_prior_lets_them():
    """Rounding leaves of them a square of either sign: no bound is made of it."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        own = np.linalg.qr(rng.normal(size=(30, 4)))[0]
        column = own @ rng.normal(size=(4, 1))
        assert np.isinf(most(column.T @ column, own.T @ column, rng.normal(size=1)))
    free = rng.normal(size=(30, 2))
    rest = free - own @ (own.T @ free)
    score = rng.normal(size=2)
    assert most(free.T @ free, own.T @ free, score) == pytest.approx(score @ np.linalg.solve(rest.T @ rest, score))


@pytest.mark.long
def test_most_falls_with_what_is_missing(simulated):
    """In moves with stops bodies imitate a coupling: by its slopes it stands in no clear place, where all has settled anew it is first."""
    experiment = pipeline.load(simulated("falls-coupled", "joint_coupling:elbow:size=1", seed=4, duration=8.0, motion="moves"))
    asked = ask(first_view(experiment, pipeline.fit(experiment)))
    assert asked.groups[int(np.argmax(asked.falls))].candidate.key == ("joint_coupling", 1)
    told = [group.candidate.kind for group, fall in zip(asked.groups, asked.falls) if np.isfinite(fall)]
    assert len(told) == len(set(told)) > 10  # each at its best values; of the others none takes what anybody on trial must
    few = [g for g, fall in zip(asked.groups, asked.falls) if not np.isfinite(fall) and g.candidate.kind not in told]
    left = np.sum(asked.view.design.residual**2, axis=0).min()
    assert few and falls(asked.view, few[:5]).max() < 0.1 * left
