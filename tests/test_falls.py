"""How far everything falls with a candidate: against the refit that a diagnosis makes of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import pipeline
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
