"""Shape values found from many places: the landscape against solved problems, searches against what
they must find.
"""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from sysid import config, multistart, pipeline, rows, shape, shape_refinement, vocabulary
from sysid.compress import compress
from sysid.estimate import identify
from sysid.landscape import Landscape, at_zero, landscape
from sysid.linearised import Linearised
from sysid.listed_effects import build
from sysid.preprocess import prepare
from tests.problems import UR5, arm_log


@cache
def bumped(text="h*exp(-((q-c)/w)**2)", values=(("c", -0.4), ("w", 0.15)), coulomb=1.0):
    """A UR5 whose third joint has a formula's torque: experiment, model, motion, prior, and the
    number of the joint.
    """
    effects = ["viscous", "coulomb", {"formula": text, "joints": ["elbow_joint"]}]
    experiment = config.experiment({"robot": {"urdf": UR5}, "model": {"effects": effects}})
    machine, structure, prior = pipeline.build(experiment)
    log = arm_log(machine, np.random.default_rng(3), seconds=6.0, noise=0.1, coulomb=coulomb)
    (segment,) = log.segments
    joint = machine.joints.index("elbow_joint")
    piece = prepare([log], experiment.preprocess, machine.joints).pieces[0]
    effect = structure.terms[-1][0]
    whole = SimpleNamespace(**{**vars(piece), "q": segment.q, "qd": 0 * segment.q, "qdd": 0 * segment.q, "t": segment.t})
    segment.tau[:, joint] += 2.0 * effect.columns(whole, joint, **dict(values))[0]
    motion = prepare([log], experiment.preprocess, machine.joints)
    return (
        experiment,
        build(machine, experiment.model.effects).measured_by(motion),
        motion,
        prior,
        joint,
    )


@pytest.mark.parametrize("weights", [None, (1.0, 0.5, 2.0, 1.0, 1.0, 3.0)])
def test_a_landscape_is_what_solving_gives(weights):
    """Far from the bounds, and with a prior that is hardly curved, what it says the objective falls
    by is what the solver finds.
    """
    experiment, model, motion, prior, joint = bumped()
    settled = lambda at: shape.settle(experiment, model.with_shapes(at), motion, prior, weights=weights, hold=True)  # noqa: E731
    found = settled((0.1, 0.3))
    seen = landscape(found, motion, 2, joint, weights)
    places = np.array([[0.1, 0.3], [-0.4, 0.15], [-0.3, 0.4], [0.5, 0.05], [-0.6, 1.0]])
    fallen = [found.objective - settled(tuple(at)).objective for at in places]
    np.testing.assert_allclose(seen.gains(places), fallen, rtol=2e-3, atol=1e-3 * max(fallen))
    assert abs(seen.gains(places[:1])[0]) < 1e-8 * found.objective
    system, right = seen.slopes(places[2])
    step = 1e-5
    slope = [(seen.gains((places[2] + d)[None]) - seen.gains((places[2] - d)[None]))[0] / (2 * step) for d in step * np.eye(2)]
    np.testing.assert_allclose(right, slope, rtol=1e-3)


def test_a_coefficient_at_zero_answers_as_the_bound_has_it():
    """Friction that would have to be negative stays at zero where it is pinned, and is free where
    it is not.
    """
    experiment, model, motion, prior, joint = bumped(coulomb=-0.5)
    found = shape.settle(experiment, model, motion, prior, hold=True)
    assert pinned(found, motion, joint, True) < pinned(found, motion, joint, False)


def pinned(found, motion, joint, how) -> float:
    return float(landscape(found, motion, 2, joint, None, pinned=how).gains(np.array([[-0.4, 0.15]]))[0])


def test_the_best_of_many_hollows_is_found():
    experiment, model, motion, prior, joint = bumped()
    found = shape.settle(experiment, model, motion, prior, profile=True)
    np.testing.assert_allclose(found.model.shapes, [-0.4, 0.15], atol=0.01)
    assert [(s.name, s.lower) for s in found.searched] == [
        ("formula.elbow_joint.c", False),
        ("formula.elbow_joint.w", False),
    ]
    assert all(s.starts > 300 and s.profile > 10 for s in found.searched)


@pytest.mark.long
def test_what_a_search_found_before_the_model_grew_starts_there_alone():
    """What is new starts from many places, and where what was found is no longer best a profile
    says so."""
    experiment, model, motion, prior, joint = bumped()
    grown = model.with_effect(vocabulary.find("stribeck").given(), (joint,))
    new = grown.shape_values[-1].name
    anew, before = (shape_refinement.refined(experiment, grown, motion, prior, None, one) for one in (None, model.with_shapes((-0.4, 0.15))))
    np.testing.assert_allclose(before[0].shapes[:2], anew[0].shapes[:2], rtol=1e-4)
    assert {s.name: s.starts > 1 for s in before[2]} == {v.name: v.name == new for v in grown.shape_values}
    assert all(s.starts > 1 for s in anew[2])
    # what is another formula, or begins elsewhere by now, is new
    same, text = {"joints": ["elbow_joint"]}, "h*exp(-((q-c)/w)**2)"
    for entry, kept in (({"formula": text}, True), ({"formula": text, "c": {"start": 0.3}}, False), ({"formula": "h*exp(-((q-c)/(2*w))**2)"}, False)):
        other = build(model.robot, config.experiment({"robot": {"urdf": UR5}, "model": {"effects": ["viscous", "coulomb", {**entry, **same}]}}).model.effects)
        start, found = shape_refinement._begun(other.measured_by(motion), model.with_shapes((-0.4, 0.15)))
        assert bool(found) == kept and (start.shapes[0] == -0.4) == kept
    astray = shape_refinement.refined(experiment, grown, motion, prior, None, model.with_shapes((1.0, 0.1)))
    np.testing.assert_allclose(astray[0].shapes[:2], [-0.4, 0.15], atol=0.01)


def test_where_a_profile_is_lower_the_search_goes_on():
    """Begun in the wrong hollow and started from nowhere else, the profile leads to the right one,
    and it is said.
    """
    experiment, model, motion, prior, joint = bumped()
    wrong = shape.settle(experiment, model.with_shapes((1.0, 0.1)), motion, prior, grid=False)
    right = shape.settle(experiment, wrong.model, motion, prior, grid=False, profile=True)
    assert abs(wrong.model.shapes[0] + 0.4) > 0.3 and right.objective < 0.9 * wrong.objective
    np.testing.assert_allclose(right.model.shapes, [-0.4, 0.15], atol=0.01)
    assert any(s.lower for s in right.searched)


def made(function, low, high) -> Landscape:
    """A landscape of one coefficient in which nothing else answers: gain = (c'y)^2 / (2 c'c) of
    columns function(x, values).
    """
    x = np.linspace(-1.0, 1.0, 400)
    target = function(x, np.array([0.31, 0.2])[: len(low)])
    each = lambda at: function(x, at)[:, None]  # noqa: E731
    columns = lambda values: np.stack([each(at) for at in values], axis=1)  # noqa: E731
    low, high = np.array(low), np.array(high)
    return Landscape(
        tuple("ab"[: len(low)]), low, high, 1e-3 * (high - low), 0.5 * (low + high),
        columns, np.zeros(1, dtype=bool),
        np.zeros((400, 0)), target, 0.0, 0.5 * float(target @ target),
    )  # fmt: skip


HOLLOWS = {
    "bump": (2, lambda x, a: np.exp(-(((x - a[0]) / a[1]) ** 2))),
    "corner": (1, lambda x, a: np.maximum(x - a[0], 0.0)),
    "jump": (1, lambda x, a: np.sign(x - a[0])),
    "waves": (2, lambda x, a: np.sin(40.0 * a[0] * x + 20.0 * a[1])),
}  # fmt: skip


@pytest.mark.parametrize("name", HOLLOWS)
def test_hollows_corners_jumps_and_waves(name):
    count, function = HOLLOWS[name]
    seen = made(function, [-1.0, 0.01][:count], [1.0, 1.0][:count])
    tried = [np.linspace(low, high, 25) for low, high in zip(seen.low, seen.high)]
    found, sets = multistart.places(seen, seen, tried, [seen.here])
    assert found[0].gain == pytest.approx(seen.objective, rel=1e-4) and sets == 25**count + 1


def test_what_is_no_number_is_passed_by():
    seen = made(lambda x, a: np.sqrt(np.where(x + a[0] >= 0, x + a[0], np.nan)), [-3.0], [3.0])
    seen = Landscape(**{**vars(seen), "target": np.sqrt(np.linspace(-1, 1, 400) + 1.5), "objective": 300.0})
    found, _ = multistart.places(seen, seen, [np.linspace(-3.0, 3.0, 13)], [seen.here])
    assert found[0].values[0] == pytest.approx(1.5, abs=1e-4)


@cache
def too_little_friction():
    """A UR5 whose elbow's Coulomb friction would have to be negative: experiment, model, motion,
    prior. Its friction grows with a power of the speed.
    """
    effects = ["viscous", "coulomb", {"sublinear_viscous": {"joints": ["elbow_joint"]}}]
    experiment = config.experiment({"robot": {"urdf": UR5}, "model": {"effects": effects}, "solver": {"weighting": "none"}})
    machine, _, prior = pipeline.build(experiment)
    friction = {"viscous": -0.3, "coulomb": -1.0}
    log = arm_log(machine, np.random.default_rng(3), seconds=6.0, noise=0.1, **friction)
    (segment,) = log.segments
    joint = machine.joints.index("elbow_joint")
    qd = np.gradient(segment.q[:, joint], segment.t)
    segment.tau[:, joint] += 8.0 * np.abs(qd) ** 0.6 * np.sign(qd)
    motion = prepare([log], experiment.preprocess, machine.joints)
    return experiment, build(machine, experiment.model.effects).measured_by(motion), motion, prior


def test_a_step_of_the_shape_values_leaves_aside_what_a_bound_holds():
    """With the coefficient held at zero a step arrives where no other is to be made, and takes what
    it promises. Were it free to answer, it would take most of what the exponent does, and the step
    would be far too long.
    """
    experiment, model, motion, prior = too_little_friction()
    held = lambda at: shape.settle(experiment, model.with_shapes([at]), motion, prior, hold=True)  # noqa: E731

    def asked(found):
        names = [model.coefficients[k].name for k in at_zero(found)]
        system, right = shape._normal(found, motion, [0], np.ones(model.robot.dof))
        return names, right[0] / system[0, 0], 0.5 * right[0] ** 2 / system[0, 0]

    away = held(0.48)
    names, step, promised = asked(away)
    there = held(0.48 + step)
    assert "coulomb.elbow_joint.Fc" in names and 0.02 < step < 0.4
    assert away.objective - there.objective == pytest.approx(promised, rel=0.3)
    assert abs(asked(there)[1]) < 0.3 * step


def test_a_correction_on_all_rows_is_the_step_on_those_in_memory():
    """Where all rows are in memory; with a coefficient at its bound that does not answer."""
    experiment, model, motion, prior = too_little_friction()
    model = model.with_shapes([0.48])
    found = shape.settle(experiment, model, motion, prior, stride=1, hold=True)
    system, right = shape._normal(found, motion, [0], np.ones(model.robot.dof))
    data = compress(Linearised(model, found.x), motion)
    fit = identify(experiment, model, motion, data, prior)
    assert fit.certificate.at_zero
    np.testing.assert_allclose(shape.correction(fit, data), right / system[0], rtol=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("effects", [[], [{"load_friction": {"joints": ["shoulder_pan_joint"]}}]])
def test_a_correction_that_makes_it_worse_is_taken_back(effects, monkeypatch):
    """Whether the model looks at the load or not: a step on all rows may be far too long."""
    experiment, _, motion, prior = too_little_friction()
    own = ["viscous", "coulomb", {"sublinear_viscous": {"joints": ["elbow_joint"]}}]
    experiment = config.experiment({"robot": {"urdf": UR5}, "model": {"effects": [*own, *effects]}})
    structure = pipeline.build(experiment)[1].measured_by(motion)
    assert structure.uses_load == bool(effects)
    monkeypatch.setattr(shape, "correction", lambda fit, data: np.array([0.4]))
    model, slopes, _, _ = shape_refinement.refined(experiment, structure, motion, prior)
    assert model.shapes[0] == pytest.approx(0.6, abs=0.15)
    fit = identify(experiment, model, motion, compress(slopes, motion), prior, near=slopes.x)
    worse = model.with_shapes([model.shapes[0] + 0.2])
    assert fit.objective < identify(experiment, worse, motion, compress(Linearised(worse, fit.x), motion), prior).objective


def test_of_a_correction_that_leads_too_far_a_part_is_kept(monkeypatch):
    """The rows in memory put a value a little beside where all rows have it, and slopes there lead four times too far."""
    experiment, _, motion, prior = too_little_friction()
    structure = pipeline.build(experiment)[1].measured_by(motion)
    best, *_ = shape_refinement.refined(experiment, structure, motion, prior)
    beside = shape.settle(experiment, best.with_shapes([best.shapes[0] + 0.1]), motion, prior, hold=True)
    monkeypatch.setattr(shape, "settle", lambda *_, **__: beside)
    steps = iter([-0.4, 0.0])
    monkeypatch.setattr(shape, "correction", lambda fit, data: np.array([next(steps)]))
    model, *_ = shape_refinement.refined(experiment, structure, motion, prior)
    assert model.shapes[0] == pytest.approx(best.shapes[0], abs=1e-9)


def test_damped_steps_stay_within_their_bounds():
    """What a bound takes of one value the others answer: the least of the quadratic within them."""
    system, right = np.array([[2.0, 1.8], [1.8, 2.0]]), np.array([4.0, 0.0])
    low, high = np.array([-1.0, -9.0]), np.array([1.0, 9.0])
    step = shape._damped(system, right, 0.0, low=low, high=high)
    np.testing.assert_allclose(step, [1.0, -0.9], atol=1e-9)  # a clipped step would have -9
    small = shape._damped(system, right, 1e6, low=low, high=high)
    np.testing.assert_allclose(small, right / (1e6 * np.diagonal(system)), rtol=1e-4, atol=1e-9)


def test_nearly_what_failed_is_not_tried_again(monkeypatch):
    """A bound holds the step of the first value back, and damping far below one changes none of it: the next that is tried is clearly shorter."""
    system, right = np.diag([1.0, 1.0]), np.array([50.0, 0.0])
    values = [SimpleNamespace(held=False, low=-1.0, high=1.0)] * 2
    tried = []

    def model(shapes):
        return SimpleNamespace(robot=SimpleNamespace(dof=1), shape_values=values, shapes=shapes, uses_load=False, with_shapes=model)

    def solved(asked):
        tried.append(float(np.abs(asked.shapes).max()))
        return SimpleNamespace(model=asked, objective=1.0 + tried[-1] if tried[-1] > 0.1 else 0.5)

    monkeypatch.setattr(shape, "_moving", lambda *_: (np.array([0, 1]), system, right, 1.0))
    found = shape._descended(SimpleNamespace(model=model(np.zeros(2)), objective=1.0), None, solved, None, 0.6)
    assert found.objective == 0.5 and all(then < 0.7 * first for first, then in zip(tried, tried[1:])), tried


def test_of_rows_that_a_low_pass_makes_alike_one_is_searched():
    """A search of every row of a low-pass finds what it finds of those that are not alike, and the cost of each
    step goes with their number.
    """
    experiment, model, _, prior, joint = bumped()
    log = arm_log(model.robot, np.random.default_rng(3), seconds=6.0, noise=0.1, coulomb=1.0)
    (segment,) = log.segments
    q, c, w = segment.q[:, joint], -0.4, 0.15
    segment.tau[:, joint] += 2.0 * np.exp(-(((q - c) / w) ** 2))
    spec = experiment.preprocess.model_copy(update={"torque": "low-pass", "cutoff": 3.0})
    motion = prepare([log], spec, model.robot.joints)
    every = motion.pieces[0].smoother.every
    assert every > 5 and rows.stride_for(motion, 6000) == every
    assert rows.stride_for(motion, motion.samples // (4 * every)) >= 4 * every
    found = shape.settle(experiment, model, motion, prior)
    all_rows = shape.settle(experiment, model, motion, prior, stride=1)
    np.testing.assert_allclose(found.model.shapes, all_rows.model.shapes, rtol=0.02)
    np.testing.assert_allclose(found.model.shapes, [c, w], atol=0.05)
