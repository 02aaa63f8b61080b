"""A law that nobody thought of is to hold on the test logs as well: the same model, settled on these, is asked too."""

import numpy as np
import pytest

from sysid import experiment_logs, pipeline
from sysid.view import elsewhere, first_view, law


def settling_contact(size: float):
    """The elbow's friction rises again after each reversal, within half a second."""

    def torque(q, qd, qdd, t, load, memory):
        if np.sign(qd[1]) != memory.get("way"):
            memory.update(way=np.sign(qd[1]), since=t)
        return np.array([0.0, size * (1.0 - np.exp(-(t - memory["since"]) / 0.5)) * np.tanh(qd[1] / 0.02)])

    return torque


def both_views(folder):
    """The first view of an experiment, and the same model on its test logs."""
    experiment = pipeline.load(folder)
    view = first_view(experiment, pipeline.fit(experiment))
    return view, elsewhere(view, experiment_logs.read(experiment, view.model.robot, experiment.data.test))


@pytest.fixture(scope="module")
def quiet(simulated):
    return both_views(simulated("laws-control", seed=4))


def test_the_model_is_settled_anew(quiet):
    view, more = quiet
    assert more.step == view.step and more.cutoff == view.cutoff
    assert more.model.size == view.model.size and not np.allclose(more.settled.x, view.settled.x, rtol=1e-6)
    np.testing.assert_allclose(more.rms(), view.rms(), rtol=0.25)
    np.testing.assert_array_equal(more.weights, view.weights)


def test_logs_that_are_too_short_are_none(quiet):
    view, _ = quiet
    assert elsewhere(view, []) is None


def test_nothing_stands_out_on_both_where_nothing_is(quiet):
    view, more = quiet
    assert min(law(view, j, more).chance for j in range(2)) > 0.01


def test_a_law_with_a_past_stands_out_more_where_it_holds_on_test_logs_as_well(simulated):
    view, more = both_views(simulated("laws-contact", settling_contact(0.09), seed=4))
    alone, both = law(view, 1), law(view, 1, more)
    assert both.chance < 0.1 * alone.chance and both.chance < 1e-3 and "qd_elbow" in both.variables
    assert 0.0 < both.share < 1.0
