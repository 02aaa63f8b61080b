"""How far everything falls with a candidate: against the refit that a diagnosis makes of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import config, pipeline
from sysid.candidate_columns import at_start
from sysid.candidates import candidates
from sysid.diagnose.ask import ask
from sysid.view import falls, first_view, joined


@pytest.fixture(scope="module")
def view(simulated):
    experiment = pipeline.load(simulated("falls", "spring:elbow:size=2"))
    return first_view(experiment, pipeline.fit(experiment))


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


def test_a_softness_below_nought_is_none(view):
    """The slope of what a joint gives falls no further than its bound lets it: a joint that would be stiffer than stiff takes nothing."""
    groups = [g for g in ask(view).groups if g.candidate.name in ("elasticity", "current_lag") and at_start(g.candidate, g.shapes) and g.c[0] < 0.0]
    assert groups
    assert falls(view, groups) == pytest.approx(0.0, abs=1e-4 * view.settled.objective)


def test_no_candidate_makes_everything_rise(view):
    """What cannot help is nothing."""
    found = falls(view, [SimpleNamespace(candidate=c, shapes={}) for c in candidates(view.model) if not c.effect.shapes()])
    assert np.all(found >= -1e-4 * view.settled.objective)


def test_most_falls_with_what_is_missing(simulated):
    """In moves with stops bodies imitate a coupling: by its slopes it stands in no clear place, where all has settled anew it is first."""
    experiment = pipeline.load(simulated("falls-coupled", "joint_coupling:elbow:size=1", seed=4, duration=8.0, motion="moves"))
    asked = ask(first_view(experiment, pipeline.fit(experiment)))
    assert asked.groups[int(np.argmax(asked.falls))].candidate.key == ("joint_coupling", 1)
    assert np.isfinite(asked.falls).sum() == len({group.candidate.kind for group in asked.groups})
