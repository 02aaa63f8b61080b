"""Standard deviations against the scatter of repeated experiments, and what `from_data` says."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from sysid import estimate, posed_problem, uncertainty
from sysid.blocks import parameters
from sysid.compress import compress
from sysid.inertia import LogCholesky
from sysid.listed_effects import build
from sysid.log import Log, Segment
from sysid.preprocess import prepare
from sysid.reduction import triangle
from sysid.regressor import torque
from sysid.specs import Experiment, PriorSpec, SolverSpec
from sysid.triangles import Compressed, Factor
from sysid.vocabulary import find
from tests.problems import arm, fourier_motion, leg
from tests.robots import load, urdf


@pytest.mark.long
def test_std_is_the_scatter_of_repeated_experiments_with_coloured_noise(tmp_path):
    """Torque noise with a memory of 50 samples: a plain formula would be several times too sure."""
    rng = np.random.default_rng(0)
    machine = load(tmp_path, urdf(rng, links=2).replace('"prismatic"', '"revolute"'))
    experiment = Experiment.model_validate({"prior": {"weight": 1e-2}})
    structure = build(machine, experiment.model.effects)
    t, q, qd, qdd = fourier_motion(rng, 30, 200, 2)
    truth = LogCholesky(machine.prior).parameters(rng.normal(scale=0.1, size=(2, 10)))
    clean = torque(machine, truth, q, qd, qdd) + 1.0 * qd + 2.0 * np.sign(qd)
    found, covariances, total = [], [], None
    for _ in range(60):
        white = rng.normal(size=(len(t) + 500, 2))
        coloured = lfilter([1.0], [1.0, -0.98], white, axis=0)[500:] * 0.2
        log = Log("made", tmp_path, "", (Segment(t, 1 / 200, q, clean + coloured, None, None, {}),))
        motion = prepare([log], experiment.preprocess, machine.joints)
        data = compress(structure, motion)
        total = data.total() if total is None else total
        fit = estimate.identify(experiment, structure, motion, data, np.array(machine.prior))
        found.append(fit.x)
        covariances.append(fit.uncertainty.covariance)
    found = np.array(found)
    # combinations that the data determine: what a log shows of a body is combinations, hardly any number alone
    _, singular, directions = np.linalg.svd(total[:, :-1])
    determined = directions[singular > 1e-3 * singular[0]]
    assert len(determined) >= 8
    stds = np.median(np.sqrt(np.einsum("ki,nij,kj->nk", determined, np.array(covariances), determined)), 0)
    ratio = stds / (found @ determined.T).std(0)
    # 60 repeats know a scatter to 9 %; the block estimate itself has about 20 %
    assert (ratio > 0.6).all() and (ratio < 1.7).all(), ratio
    # and each true value lies within what is claimed: the filter's bias on smooth motion is far below the noise
    x = np.append(truth.ravel(), [1.0, 1.0, 2.0, 2.0])
    score = np.abs((found.mean(0) - x) @ determined.T) / stds
    assert (score < 2.0).all(), score


def test_from_data_is_zero_where_only_the_prior_speaks_and_one_where_only_the_data_do():
    experiment, structure, motion, data, prior = leg()
    fit = estimate.identify(experiment, structure, motion, data, prior)
    share = dict(zip(structure.names, fit.uncertainty.from_data))
    std = dict(zip(structure.names, fit.uncertainty.std))
    assert all(0.0 <= value <= 1.0 for value in share.values())
    # the first body turns about one axis: only one of its moments enters, and its mass does not
    for name in ("abad.hx", "abad.Iyy", "abad.Izz", "abad.Ixy", "abad_rotor.m", "abad_rotor.Iyy"):
        assert share[name] < 1e-3, name
    for joint in ("abad", "hip", "knee"):
        assert share[f"viscous.{joint}.Fv"] > 0.9 and share[f"coulomb.{joint}.Fc"] > 0.9
        assert 0 < std[f"coulomb.{joint}.Fc"] < 0.1
    # a parameter that no data touch keeps the prior's value
    np.testing.assert_allclose(fit.x[structure.names.index("abad.Iyy")] > 0, True)


def test_an_effect_tied_to_a_body_is_not_claimed_by_the_data():
    """Armature of a first joint and the first link's moment about it are one number; the prior splits them."""
    from dataclasses import replace

    experiment, structure, motion, _, prior = arm()
    from sysid.vocabulary import find

    model = structure.with_effect(find("armature"), (0,))
    fit = estimate.identify(experiment, model, motion, compress(model, motion), prior)
    share = dict(zip(model.names, fit.uncertainty.from_data))
    assert share["armature.shoulder_pan_joint.Ia"] < 0.2
    assert replace(model) == model


def test_noise_weighting_gives_quiet_joints_their_say():
    experiment, structure, motion, data, prior = arm()
    weights = posed_problem.noise_weights(data, estimate.identify(experiment, structure, motion, data, prior).x)
    np.testing.assert_allclose(np.prod(weights), 1.0)
    weighted = experiment.model_copy(update={"solver": experiment.solver.model_copy(update={"weighting": "noise"})})
    fit = estimate.identify(weighted, structure, motion, data, prior)
    assert fit.weights is not None and fit.solution.converged and fit.certificate.globally_optimal


@pytest.mark.parametrize(
    "prior, said, weighting",
    [
        ({}, {}, "noise"),
        ({"weight": 1e-2}, {}, "none"),
        ({"weight": 1e-2}, {"weighting": "noise"}, "noise"),
        ({"weight": "auto"}, {"weighting": "none"}, "none"),
    ],
)
def test_joints_count_by_their_noise_where_nobody_weighs_the_prior(prior, said, weighting):
    """The paper's sum of squares has a weight beside it; a simulation writes none into its file."""
    experiment = Experiment(prior=PriorSpec(**prior), solver=SolverSpec(**said))
    assert experiment.solver.weighting == weighting


def test_deviations_are_right_under_white_noise():
    """Linear least squares on two joints of unequal noise, blocks of unequal weight: the covariance is known in closed form.

    Neighbouring blocks' scores are against each other, as the fit has taken its share out; uncorrected, that bends them.
    """
    rng = np.random.default_rng(0)
    blocks, rows, size, noise = 40, 8, 6, (1.0, 0.2)
    slow = np.cumsum(rng.normal(size=(2, blocks * rows, size)), axis=1)
    slow *= np.repeat(np.linspace(0.2, 3.0, blocks), rows)[:, None]
    normal = sum(x.T @ x for x in slow)
    inverse = np.linalg.inv(normal)
    direction, along = np.linalg.eigh(inverse)[1][:, 0], np.zeros(200)  # what is known best, a combination of all
    covariance = inverse @ sum(s**2 * x.T @ x for s, x in zip(noise, slow)) @ inverse
    known = np.diagonal(covariance)
    plain, corrected = np.zeros((2, 200, size))
    for k in range(200):
        factors = []
        y = [x @ np.ones(size) + s * rng.normal(size=len(x)) for s, x in zip(noise, slow)]
        for b in range(blocks):
            own = slice(b * rows, (b + 1) * rows)
            for j in range(2):
                r = triangle(np.asfortranarray(np.column_stack([slow[j][own], y[j][own]])))
                factors.append(Factor(j, b, np.arange(size), r, rows))
        data = Compressed(size, 2, tuple(factors), blocks * rows)
        x = inverse @ sum(a.T @ b for a, b in zip(slow, y))
        basis = uncertainty.whitening(2.0 * normal)
        moves, _ = parameters.left_out(*uncertainty.by_block(data, x, None, basis, np.arange(size)))
        plain[k] = np.diagonal(basis @ parameters.neighbours(moves) @ basis.T)
        found = uncertainty._noise(data, x, None, 2.0 * normal, 0.0, np.arange(size)) / parameters.widening(blocks) ** 2
        corrected[k], along[k] = np.diagonal(found), direction @ found @ direction
    # 200 repeats know the mean to 5 %
    np.testing.assert_allclose(corrected.mean(axis=0) / known, 1.0, atol=0.15)
    np.testing.assert_allclose(along.mean() / (direction @ covariance @ direction), 1.0, atol=0.15)
    assert np.abs(np.log(plain.mean(axis=0) / known)).max() > 0.2


def test_what_takes_the_place_of_friction_at_zero_is_no_surer_for_it(tmp_path):
    """Over half a turn friction of the angle is nearly friction: where that goes to zero, its terms are what it and they are together."""
    rng = np.random.default_rng(3)
    machine = load(tmp_path, urdf(rng, links=1).replace('"prismatic"', '"revolute"'))
    experiment = Experiment.model_validate({"prior": {"weight": 1e-2}})
    model = build(machine, experiment.model.effects).with_effect(find("position_friction").given(harmonics=2), (0,))
    t, q, qd, qdd = fourier_motion(rng, 20, 200, 1)
    q, qd, qdd = (0.5 * values / np.abs(q).max() for values in (q, qd, qdd))
    true = 0.3 * qd + np.sign(qd) * (0.3 + 0.1 * np.cos(q) + 0.1 * np.sin(q))
    clean, own = torque(machine, machine.prior, q, qd, qdd) + true, [model.names.index(f"position_friction.{machine.joints[0]}.{k}") for k in ("a1", "b1")]
    zero, off = 0, []
    for _ in range(40):
        log = Log("made", tmp_path, "", (Segment(t, 1 / 200, q, clean + 0.2 * rng.normal(size=clean.shape), None, None, {}),))
        motion = prepare([log], experiment.preprocess, machine.joints)
        fit = estimate.identify(experiment, model, motion, compress(model, motion), np.array(machine.prior))
        bound = [10 * model.bodies + k for k in fit.certificate.at_zero]
        zero += bool(bound)
        assert np.isnan(fit.uncertainty.std[bound]).all() and np.isnan(fit.uncertainty.covariance[bound]).all()
        off.append((fit.x[own] - 0.1) / fit.uncertainty.std[own])
    assert 8 <= zero <= 36  # else nothing is asked here
    assert (np.abs(off) < 2.0).mean(axis=0).min() > 0.85


def test_what_stands_at_a_bound_of_its_own_or_hardly_follows_holds_nothing_back():
    follow = np.array([[-0.5, 0.2], [1e-9, 0.0], [0.3, -0.1]])
    down, up = np.array([1.0, 0.0, 2.0]), np.array([np.inf, 3.0, 0.6])
    np.testing.assert_allclose(uncertainty._before_bounds(follow, down, up), [2.0, 20.0])
    assert uncertainty._root_mean_square(0.0, np.inf, 2.0) == pytest.approx(1.0, rel=0.01)  # a half normal law
    assert uncertainty._root_mean_square(0.0, 0.02, 2.0) == pytest.approx(0.01 / np.sqrt(3.0), rel=0.01)  # an even one
    z = 2.0
    assert uncertainty._root_mean_square(4.0, np.inf, 2.0) == pytest.approx(np.sqrt(1.0 + z**2 - z * norm.pdf(z) / norm.sf(z)), rel=0.01)


def test_nothing_is_white_already():
    """Of no columns there is no basis, and nothing breaks: a joint of which no row is left."""
    assert uncertainty.whitening(np.zeros((0, 0))).shape == (0, 0)
