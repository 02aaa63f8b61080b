"""What is not known of the load: against fits of the same logs under other bodies."""

from dataclasses import replace

import numpy as np
import pytest

from sysid import config, load_doubt, pipeline
from sysid.shape import settle
from sysid.view import as_fitted, first_view


@pytest.fixture(scope="module")
def soft(simulated):
    """A planar arm with a soft shoulder in moves with stops, whose logs tell the sum of the link's inertia and the rotor's."""
    path = simulated("load-doubt", "elasticity:shoulder:K=11264,D=12.9", seed=3, duration=20.0, rate=1000.0, motion="moves") / "config.yaml"
    return path, path.read_text().replace("effects: [", "effects: [{elasticity: {joints: [shoulder]}}, ")


def fitted(soft, *, doubted=True, factor=1.0, weight=10.0):
    """The fit with its prior's link scaled, with or without what is not known of the load."""
    path, text = soft
    experiment = config.loads(text, path)
    experiment = experiment.model_copy(update={"prior": experiment.prior.model_copy(update={"weight": weight})})
    own = pipeline._prior

    def scaled(*given):
        prior = own(*given).copy()
        prior[0] *= factor
        return prior

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "_prior", scaled)
        if not doubted:
            patch.setattr(load_doubt, "with_doubt", lambda fit, motion: fit)
        return pipeline.fit(experiment)


def compliance(fit):
    (k,) = [k for k, value in enumerate(fit.model.shape_values) if value.shape.name == "compliance"]
    return fit.model.shapes[k], fit.shape_std[k]


@pytest.mark.long
def test_a_soft_gear_is_as_doubtful_as_the_link_behind_it(soft):
    """A prior with a heavier link makes it stiffer by more than noise says; the deviation says as much, and the truth is within two."""
    plain, doubted = fitted(soft, doubted=False), fitted(soft)
    (value, before), (same, after) = map(compliance, (plain, doubted))
    assert same == value and after > before
    far = [compliance(fitted(soft, doubted=False, factor=factor))[0] for factor in (0.5, 2.0)]
    assert far[0] > value > far[1]  # the square of the inertia times the compliance is what is told
    assert np.ptp(far) > 4.0 * before  # which noise does not know
    assert after > 0.5 * np.ptp(far)
    assert abs(value - 1.0 / 11264.0) < 2.0 * after < 0.3 / 11264.0


@pytest.mark.long
def test_the_answer_to_another_load_is_that_of_another_fit(soft, monkeypatch):
    """To first order: bodies that differ a little, and what the gear comes out as under their prior."""
    here, there = fitted(soft, doubted=False), fitted(soft, doubted=False, factor=1.3)
    count = 10 * here.model.bodies
    moved, known = there.x[:count] - here.x[:count], []
    monkeypatch.setattr(load_doubt, "_directions", lambda *_: moved[None])
    own = load_doubt._with
    monkeypatch.setattr(load_doubt, "_with", lambda covariance, at, change: known.append(change) or own(covariance, at, change))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(load_doubt, "with_doubt", lambda fit, motion: known.append(motion) or fit)
        fitted_again = fitted(soft)
    motion = known.pop()
    load_doubt.with_doubt(replace(fitted_again), motion)
    (change,) = [own[0] for own in known if len(own) and own.shape[1] == 1][-1]
    assert change == pytest.approx(compliance(there)[0] - compliance(here)[0], rel=0.4)


def test_what_does_not_look_at_the_load_is_as_sure_as_before(simulated):
    path = simulated("load-doubt-plain", "spring:elbow:size=2") / "config.yaml"
    fit = pipeline.fit(pipeline.load(path))
    assert load_doubt.with_doubt(fit, None) is fit


def test_friction_that_goes_with_two_loads_is_as_doubtful_as_each(simulated):
    """Of a linear coefficient: with the load's covariance given, the answer is the regression of its change on the slopes."""
    path = simulated("load-doubt-two", "load_friction:shoulder:mu=0.1", duration=6.0) / "config.yaml"
    text = path.read_text().replace("effects: [", "effects: [load_friction, ")
    with pytest.MonkeyPatch.context() as patch:
        motions = []
        patch.setattr(load_doubt, "with_doubt", lambda fit, motion: motions.append(motion) or fit)
        fit = pipeline.fit(config.loads(text, path))
    own = [k for k, c in enumerate(fit.model.coefficients) if c.effect == "load_friction"]
    at = [10 * fit.model.bodies + k for k in own]
    # a load that is a tenth larger wherever it comes from makes the coefficient a tenth smaller
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(load_doubt, "_directions", lambda *_: 0.1 * fit.x[None, : 10 * fit.model.bodies])
        moved = load_doubt._answers(fit, motions[0], {0, 1})
    told = [k for k in at if np.isfinite(fit.uncertainty.std[k])]  # one of them is held at zero
    assert told
    np.testing.assert_allclose(moved[told, 0], -0.1 * fit.x[told], rtol=0.02, atol=2e-4)
    after = load_doubt.with_doubt(fit, motions[0])
    assert np.all(after.uncertainty.std[told] >= fit.uncertainty.std[told]) and np.isfinite(after.uncertainty.std[told]).all()
    rest = np.setdiff1d(np.arange(fit.model.size), told)
    np.testing.assert_array_equal(after.uncertainty.std[rest], fit.uncertainty.std[rest])


def test_what_is_held_in_a_hollow_is_settled_from_where_a_fit_has_it(soft):
    """Ten times as soft, under the load of bodies that have nothing of it: from there no step leads on."""
    fit = fitted(soft)
    view = first_view(fit.experiment, fit)
    far = view.model.with_shapes([10.0 * fit.model.shapes[0], *fit.model.shapes[1:]])
    held = replace(view, settled=settle(view.experiment, far, view.motion, view.prior, weights=view.weights, stride=view.stride, hold=True))
    found = as_fitted(held, fit)
    assert found.settled.objective < 0.5 * held.settled.objective
    assert found.model.shapes[0] == pytest.approx(fit.model.shapes[0], rel=0.1)
    assert as_fitted(found, fit) is found  # no lower
    rigid = first_view(*(lambda plain: (plain.experiment, plain))(pipeline.fit(pipeline.load(soft[0]))))
    assert as_fitted(rigid, fit) is rigid
