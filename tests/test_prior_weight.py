"""`prior.weight: auto`: the strongest prior within one standard error of the best on stretches held apart."""

import json
from pathlib import Path

import numpy as np
import pytest

from sysid import blocks, config, held_apart, pipeline, prior_weight, regressor, shape, shape_refinement
from sysid.compress import compress
from sysid.estimate import identify
from sysid.inertia import LogCholesky
from sysid.linearised import Linearised
from sysid.listed_effects import build
from sysid.log import Log
from sysid.model import moving_coefficients
from sysid.preprocess import prepare
from sysid.segment import Segment
from tests.problems import ROOT, arm, fourier_motion, leg


def auto(experiment, **solver):
    """The experiment with its prior's weight to be chosen."""
    prior = experiment.prior.model_copy(update={"weight": "auto"})
    own = experiment.solver.model_copy(update=solver)
    return experiment.model_copy(update={"prior": prior, "solver": own})


def chosen(case, **solver):
    experiment, model, motion, data, prior = case
    moving = moving_coefficients(model, motion)
    return held_apart.chosen(auto(experiment, **solver), model, data, moving, prior)


def fitted(case, weight=None):
    """The fit of a case at a weight, by default the chosen one."""
    experiment, model, motion, data, prior = case
    weight = chosen(case).value if weight is None else weight
    return identify(prior_weight.with_weight(experiment, weight), model, motion, data, prior)


def within(errors, best, other) -> bool:
    """By the textbook: mean of the differences against their standard deviation over the root of their number."""
    d = errors[other] - errors[best]
    return d.mean() <= d.std(ddof=1) / np.sqrt(len(d))


@pytest.mark.parametrize("case", [leg, arm])
def test_the_strongest_within_one_standard_error_of_the_best(case):
    found = chosen(case())
    best, own = int(np.argmin(found.errors.mean(1))), found.tried.index(found.value)
    assert found.auto and found.errors.shape == (len(found.tried), 8)
    assert within(found.errors, best, own)
    stronger = range(own + 1, len(found.tried))
    assert stronger and not any(within(found.errors, best, k) for k in stronger)
    # the next is next: weights are 1, 3, 10, 30, ...
    assert 2.9 < found.tried[own + 1] / found.value < 3.4
    because = "(auto: the strongest within one standard error of the best on 8 blocks held apart)"
    assert found.says == f"prior weight {found.value:g} {because}"


def test_a_loud_joint_does_not_drown_a_quiet_one():
    """Two joints, three stretches: what the second weight gains on the loud one it costs, many times over, on the quiet."""
    rows = np.full((3, 2), 100)
    squares = np.array([[[1e4, 1.0]] * 3, [[0.99e4, 4.0]] * 3])
    errors, best = held_apart.judged(squares, rows)
    assert (
        best == 0
        and errors[0] == pytest.approx(np.ones(3))
        and errors[1] == pytest.approx(np.full(3, (0.99 + 4.0) / 2))
    )


def test_a_joint_without_rows_says_nothing():
    rows = np.array([[100, 0]] * 3)
    errors, best = held_apart.judged(np.array([[[2.0, 0.0]] * 3, [[1.0, 0.0]] * 3]), rows)
    assert best == 1 and errors == pytest.approx(np.array([[2.0] * 3, [1.0] * 3]))


def test_each_stretch_is_predicted_by_fits_that_never_saw_it():
    """Squares of a stretch by hand: the others' fit, over its own rows."""
    experiment, model, motion, data, prior = leg()
    moving = moving_coefficients(model, motion)
    apart = held_apart.held_apart(auto(experiment), model, data, moving, prior)
    parts = np.array_split(np.arange(data.blocks), 8)
    others = [k for k in range(data.blocks) if k not in set(parts[3].tolist())]
    fit = identify(
        prior_weight.with_weight(experiment, 1.0), model, motion, data.without(parts[3]), prior
    )
    assert apart.squares(1.0)[3] == pytest.approx(data.without(others).squares(fit.x), rel=1e-6)
    assert apart.rows.sum(0) == pytest.approx(data.rows)


def test_blocks_gathered_hold_the_same():
    _, model, _, data, _ = arm()
    gathered = data.gathered(np.array_split(np.arange(data.blocks), 5))
    x = np.linspace(-1.0, 1.0, model.size)
    assert gathered.blocks == 5 and gathered.squares(x) == pytest.approx(data.squares(x), rel=1e-9)
    assert np.array_equal(gathered.rows, data.rows)


@pytest.mark.parametrize(
    ("errors", "kept"),
    [
        # differences 1, 1, 1 are sure; 2, -1, 1 have mean 2/3 and standard error 0.88
        ([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [3.0, 1.0, 4.0]], [True, False, True]),
        ([[1.0], [1.5]], [True, False]),  # of one block nothing can be told
    ],
)
def test_within_one_standard_error(errors, kept):
    assert blocks.within_one_error(errors).tolist() == kept


def made(robot, seed: int, *, noise: float):
    """A case like `leg` for the planar arm, whose bodies are others than its URDF's, and the truth."""
    experiment = config.experiment({"model": {"effects": ["viscous", "coulomb"]}})
    structure, rng = build(robot, experiment.model.effects), np.random.default_rng(seed)
    pi = LogCholesky(robot.prior).parameters(
        np.random.default_rng(7).normal(scale=0.2, size=(2, 10))
    )
    t, q, qd, qdd = fourier_motion(np.random.default_rng(3), 20.0, 200.0, 2)
    tau = (
        regressor.torque(robot, pi, q, qd, qdd)
        + 2.0 * qd
        + np.sign(qd)
        + noise * rng.normal(size=q.shape)
    )
    return compressed(experiment, structure, t, q, tau), np.append(pi.ravel(), [2.0, 2.0, 1.0, 1.0])


def compressed(experiment, structure, t, q, tau):
    """A case like `leg` of what was logged."""
    log = Log("made", Path("made"), "", (Segment(t, t[1] - t[0], q, tau, None, None, {}),))
    motion = prepare([log], experiment.preprocess, structure.robot.joints)
    return (
        experiment,
        structure,
        motion,
        compress(structure, motion),
        np.array(structure.robot.prior),
    )


def test_what_a_log_determines_is_not_bent_by_more_than_its_deviation(planar):
    """Of one robot under ten draws of the noise: what the chosen prior changes of each parameter that the data determine,
    in the standard deviations that are stated; and these hold their errors as well as the weak prior's do."""
    shifts, errors = [], []
    for seed in range(10):
        case, truth = made(planar, seed, noise=0.3)
        weak, strong = fitted(case, 1e-2), fitted(case)
        told = (weak.uncertainty.from_data > 0.9) & (strong.uncertainty.from_data > 0.9)
        shifts.append(np.where(told, (strong.x - weak.x) / strong.uncertainty.std, 0.0))
        errors += ((strong.x - truth) / strong.uncertainty.std)[told].tolist()
    assert np.abs(np.mean(shifts, axis=0)).max() < 1.0
    assert np.mean(np.abs(errors) < 2.0) >= 0.9 and len(errors) >= 60


def test_what_the_motion_does_not_excite_stays_at_its_prior():
    """A UR5 as its URDF says, whose wrists hardly move, under much noise: weakly held, masses wander off to fit the noise;
    with the chosen weight they do not."""
    experiment, structure, *_, prior = arm()
    machine, rng = structure.robot, np.random.default_rng(1)
    sizes = np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02])
    t, q, qd, qdd = (
        x if x.ndim == 1 else x * sizes
        for x in fourier_motion(np.random.default_rng(3), 20.0, 200.0, 6)
    )
    tau = (
        regressor.torque(machine, prior, q, qd, qdd)
        + 2.0 * qd
        + np.sign(qd)
        + rng.normal(size=q.shape)
    )
    case = compressed(experiment, structure, t, q, tau)
    away = lambda fit: np.abs(np.log(fit.pi[:, 0] / prior[:, 0])).max()  # noqa: E731
    assert away(fitted(case, 1e-2)) > 0.3 and away(fitted(case)) < 0.02


@pytest.mark.parametrize("weight", [1e-2, 1.0, 1e3, 1e6])
def test_a_strong_prior_beside_friction_that_is_nought_is_solved(weight):
    """A UR5 without friction: half of the coefficients go to zero while the prior holds the bodies
    however firmly; the optimum is found and proven."""
    experiment, structure, *_, prior = arm()
    t, q, qd, qdd = fourier_motion(np.random.default_rng(3), 10.0, 200.0, 6)
    pi = LogCholesky(prior).parameters(np.random.default_rng(8).normal(scale=0.2, size=(6, 10)))
    tau = regressor.torque(structure.robot, pi, q, qd, qdd)
    tau += 0.3 * np.random.default_rng(1).normal(size=q.shape)
    fit = fitted(compressed(experiment, structure, t, q, tau), weight)
    assert fit.solution.converged and fit.certificate.globally_optimal
    assert len(fit.certificate.at_zero) >= 3 and fit.solution.iterations < 40


def test_where_nothing_can_be_held_apart_the_paper_s_weight_stands():
    experiment, model, motion, data, prior = arm()
    short = data.without(range(2, data.blocks))
    found = chosen((experiment, model, motion, short, prior))
    assert found.value == 1e-2 and found.auto and "too short" in found.says and found.stretches == 0


def test_joints_weighted_by_their_noise_are_weighted_here_too():
    plain, weighted = chosen(arm(), weighting="none"), chosen(arm(), weighting="noise")
    assert (
        weighted.auto
        and weighted.tried
        and not np.array_equal(plain.errors[:3], weighted.errors[:3])
    )


def test_a_fit_says_its_weight_and_is_reproduced_by_it(experiment, cli):
    folder = experiment(config={"prior.weight": "auto"})
    said = cli("fit", folder, "--json")
    document = json.loads(said.out)["prior"]
    assert said.status == 0 and document["auto"] and document["blocks"] == 3
    assert document["weight"] in [entry["weight"] for entry in document["held_out"]]
    again = pipeline.load(said.run / "experiment.yaml")
    assert again.prior.weight == document["weight"]
    first, second = json.loads((said.run / "fit.json").read_text()), pipeline.fit(again)
    assert dict(zip(second.model.names, second.x)) == pytest.approx(
        {p["name"]: p["value"] for p in first["parameters"]}, rel=1e-6
    )
    assert not second.strength.auto and second.strength.says.endswith("(given)")
    told = cli("fit", folder)
    assert f"prior weight {document['weight']:g} (auto: " in told.out


def test_a_model_with_shape_values_is_weighed_with_them():
    spec = config.load(ROOT / "configs" / "cheetah3.yaml")
    effects = [
        *spec.model.effects,
        spec.model.effects[0].model_copy(update={"name": "stribeck", "joints": ["hip"]}),
    ]
    fit = pipeline.fit(
        auto(spec.model_copy(update={"model": spec.model.model_copy(update={"effects": effects})}))
    )
    assert (
        fit.strength.auto
        and fit.experiment.prior.weight == fit.strength.value
        and fit.solution.converged
    )


def test_a_wrong_gain_does_not_speak_for_a_strong_prior(planar):
    """What a gain is and what the bodies weigh is one product. At a gain that a strong prior chose no weaker one predicts
    better; found anew with the bodies it lets them have the weight that they have at the right gain."""
    entry = {"torque_gain": {"joints": ["elbow"]}}
    experiment = auto(config.experiment({"model": {"effects": ["viscous", "coulomb", entry]}}))
    structure = build(planar, experiment.model.effects)
    (_, _, motion, *_), _ = made(planar, 0, noise=0.3)
    prior = np.array(structure.robot.prior)
    right = held_apart.prior_strength(experiment, structure, motion, compress(structure, motion), prior)
    stuck = shape.settle(
        prior_weight.with_weight(experiment, 100.0 * right.value), structure, motion, prior
    )
    assert abs(stuck.model.shapes[0]) > 0.05  # the truth is 0
    weight = lambda source: held_apart.prior_strength(  # noqa: E731
        experiment, stuck.model, motion, compress(source, motion), prior
    ).value
    assert weight(stuck.model) > weight(Linearised(stuck.model, stuck.x)) == right.value
    # and the whole search ends there
    settled, _, _, found = shape_refinement.refined(experiment, structure, motion, prior)
    assert found.value == right.value and settled.shapes == pytest.approx([0.0], abs=0.01)
