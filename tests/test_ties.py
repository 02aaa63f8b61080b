"""Which explanations logs cannot tell apart: losses are those of refits without each fold, and the set holds the truth."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from ruamel.yaml import YAML

from sysid import blocks, pipeline
from sysid.diagnose.ask import ask
from sysid.diagnose.refits import refitted, settled
from sysid.diagnose.ties import Choice, chosen, price_of
from sysid.view import alike, first_view, holds, losses, opened, slow_losses, weighed
from tests.evidences import posed, stacked, viewed


@pytest.mark.parametrize("seed", range(3))
def test_losses_are_the_predictive_densitys_of_the_fold_that_refits_did_not_see(seed):
    """Quadratic forms, with the covariance of what refits without the fold predict of it."""
    p = posed(np.random.default_rng(seed))
    found = losses(viewed(p), p.number)
    fold, none = blocks.folds(20), np.zeros((*p.a.shape[:2], 0))
    assert found.shape == (20, 2)
    for f in range(fold.max() + 1):
        m, y = stacked(p, none, keep=fold[p.number] != f)
        x = np.linalg.lstsq(m, y, rcond=None)[0]
        left = (p.tau - np.einsum("jnk,k->nj", p.a, x)) * p.weights
        own = fold[p.number] == f
        a = np.concatenate(p.a[:, own] * p.weights[:, None, None])
        covariance = np.eye(len(a)) + a @ np.linalg.inv(m.T @ m) @ a.T
        e = np.concatenate(left[own].T)
        size, turn = np.linalg.eigh(covariance)  # row by row, what is left in units of all that is not known
        told = ((turn / np.sqrt(size)) @ turn.T @ e).reshape(2, -1).T ** 2
        assert found[fold == f].sum() == pytest.approx(e @ np.linalg.solve(covariance, e))
        for b in np.flatnonzero(fold == f):
            np.testing.assert_allclose(found[b], told[p.number[own] == b].sum(0), rtol=1e-7)


def test_no_share_of_a_loss_is_beyond_what_it_was():
    """A joint, or a block, that one fold tells alone has no loss below nought, which would make any change of it a share beyond all."""
    for seed in range(10):
        p = posed(np.random.default_rng(seed))
        p.a[:] *= np.where(p.number < 2, 50.0, 1.0)[:, None]  # the first fold tells nearly all
        assert (losses(viewed(p), p.number) >= 0.0).all()


def test_losses_do_not_depend_on_units():
    """A parameter in units a million times smaller, or larger, is the same parameter."""
    p = posed(np.random.default_rng(5))
    units = 10.0 ** np.array([-6.0, -3.0, 0.0, 3.0, 6.0])
    other = SimpleNamespace(**(vars(p) | {"a": p.a * units, "root": p.root * units, "target": p.target / units}))
    np.testing.assert_allclose(losses(viewed(other), p.number), losses(viewed(p), p.number), rtol=1e-6)


def test_what_the_angles_noise_makes_is_taken_off_the_losses():
    p = posed(np.random.default_rng(4))
    view = viewed(p)
    plain = losses(view, p.number)
    view.design.rough_residual[:] = 0.3
    np.testing.assert_allclose(losses(view, p.number), plain - 12 * 0.09)  # twelve rows a block


@pytest.fixture(scope="module")
def biased(simulated):
    """The view of an arm with a bias in its elbow, and what is asked of it."""
    experiment = pipeline.load(simulated("bias", "torque_bias:elbow:b=0.4"))
    view = first_view(experiment, pipeline.fit(experiment))
    return view, ask(view).groups


def of(groups, name: str, joint: int):
    return next(g for g in groups if g.candidate.key == (name, joint))


def test_a_refit_has_the_effect_in_it_and_loses_less(biased):
    view, groups = biased
    member = refitted(view, of(groups, "torque_bias", 1))
    own = [10 * member.view.model.bodies + k for k, c in enumerate(member.view.model.coefficients) if c.effect == "torque_bias"]
    assert member.view.settled.x[own] == pytest.approx([0.4], rel=0.1)
    assert member.losses.sum() < 0.7 * losses(view, view.blocks).sum()
    assert member.losses.shape == (view.blocks.max() + 1, 2)


@pytest.mark.long
@pytest.mark.parametrize(
    ("hide", "key", "value"),
    [("torque_bias:elbow:b=0.4", ("torque_bias", 1), 0.4), ("delay:elbow:d=0.02", ("delay", 1), 0.02), ("torque_saturation:elbow:limit=1.5", ("torque_saturation", 1), -1.0)],
)  # fmt: skip
def test_about_where_it_settled_a_candidate_s_slopes_tell_its_size(simulated, hide, key, value):
    """What moves a joint does not grow as its slope at nothing says; what bends a torque takes all that stands above where it bends."""
    name = "bias" if key[0] == "torque_bias" else f"settled-{key[0]}"
    experiment = pipeline.load(simulated(name, hide))
    view = first_view(experiment, pipeline.fit(experiment))
    group = max((g for g in ask(view).groups if g.candidate.key == key), key=lambda g: g.taken)
    again = settled(view, group)
    assert again.coefficients[0] == pytest.approx(value, rel=0.05)
    assert again.spreads[1] < 3.0 * again.spreads[0]  # what it takes is no noise


def test_about_where_it_settled_bounds_and_prior_hold_what_they_held(simulated):
    """Beside a missing delay, and a prior that holds against what it does: coefficients about where they settled are those that
    settled, though an exponent stands at its bound, from which its slope points out."""
    yaml = YAML(typ="safe", pure=True)
    folder = simulated("settled-delay", "delay:elbow:d=0.02")
    tree = yaml.load((folder / "config.yaml").read_text()) | {"prior": {"weight": 10.0}}
    with (folder / "strong.yaml").open("w") as stream:
        yaml.dump(tree, stream)
    experiment = pipeline.load(folder / "strong.yaml")
    view = first_view(experiment, pipeline.fit(experiment))
    best, seen = {}, set()
    for group in ask(view).groups:
        if group.taken > best.get(group.candidate.key, group).taken - 1e-12:
            best[group.candidate.key] = group
    for name, joint in (("torque_bias", 0), ("torque_bias", 1), ("sublinear_viscous", 0), ("stribeck", 0), ("position_friction", 1)):
        again, member = settled(view, best[name, joint]), refitted(view, best[name, joint])
        if again is None or member is None:
            continue
        seen.add(name)
        after = weighed(member.view)
        own = after.settled.x[view.model.size :]
        np.testing.assert_allclose(again.coefficients, own, rtol=2e-2, atol=1e-3 * np.abs(own).max())
    assert {"torque_bias", "sublinear_viscous"} <= seen


def test_the_set_holds_the_truth_and_its_twin_and_not_the_rest(biased):
    view, groups = biased
    asked = [of(groups, *key) for key in (("asymmetric_coulomb", 1), ("torque_bias", 1), ("torque_bias", 0), ("quadratic_drag", 1))]
    found = chosen(view, asked, np.random.default_rng(0))
    assert found.head.candidate.name == "torque_bias"
    assert {m.candidate.key for m, _ in found.members} == {("torque_bias", 1), ("asymmetric_coulomb", 1)}
    assert [p for _, p in found.members] == pytest.approx([0.5, 0.5], abs=0.01)  # one column: nobody can tell
    base = losses(weighed(view, found.head.view.weights), view.blocks)
    assert found.gain.sum() == pytest.approx((base - found.head.losses).sum())


def test_other_options_that_do_as_well_are_told_of_the_head(biased):
    """One that is the same but for its options, and none that leaves more; of another head nobody has said it."""
    view, groups = biased
    bias, twin, drag = (of(groups, *key) for key in (("torque_bias", 1), ("asymmetric_coulomb", 1), ("quadratic_drag", 1)))
    disguised = replace(bias, candidate=replace(bias.candidate, options=(("other", "wrist"),)))
    lame = replace(drag, candidate=replace(bias.candidate, effect=drag.candidate.effect.given(), options=(("other", "thumb"),)))
    lame.candidate.effect.__dict__["name"] = "torque_bias"
    found = chosen(view, [bias, disguised, lame, twin], np.random.default_rng(0))
    assert found.head.candidate.name == "torque_bias"
    said = {bias.candidate.options, disguised.candidate.options} - {found.head.candidate.options}
    assert {one.options for one in found.forms} == said
    (other,) = [m for m, _ in found.members if m is not found.head]
    assert found.headed(other).forms == () and found.headed(found.head).forms == found.forms


@pytest.mark.parametrize(("likelier", "kept"), [(0.98, [2, 2]), (0.995, [1, 2])])
def test_who_is_hardly_ever_the_best_is_none_of_the_explanations(biased, monkeypatch, likelier, kept):
    """But for the head, the simplest of two that are the same: it stays whichever of them is said to be the likelier one."""
    view, groups = biased
    asked, found = [of(groups, *key) for key in (("torque_bias", 1), ("asymmetric_coulomb", 1))], []
    for chances in ([likelier, 1.0 - likelier], [1.0 - likelier, likelier]):
        monkeypatch.setattr(blocks, "chances", lambda losses, rng, unit: np.array(chances))  # noqa: B023
        found.append(chosen(view, asked, np.random.default_rng(0)))
    assert sorted(len(one.members) for one in found) == kept
    for one in found:
        assert one.head.candidate.name == "torque_bias"
        assert {m.candidate.name for m in one.close} == {"torque_bias", "asymmetric_coulomb"}


@pytest.mark.parametrize("likely, named", [(0.3, True), (0.05, False)])
def test_what_only_adds_freedom_is_named_within_the_ninety_per_cent(biased, monkeypatch, likely, named):
    """A spring holds a bias, and predicts what a bias makes as well: it is as likely as the price of its number says."""
    view, groups = biased
    asked = [of(groups, *key) for key in (("torque_bias", 1), ("spring", 1))]
    monkeypatch.setattr(type(asked[0]), "either", 1)
    twins = {"torque_bias": 1.0 - likely, "spring": likely}
    first = min(asked, key=lambda group: refitted(view, group).losses.sum()).candidate.name
    chances = np.array([twins[first], 1.0 - twins[first]])  # by rising loss
    monkeypatch.setattr(blocks, "chances", lambda losses, rng, unit: chances)
    found = chosen(view, asked, np.random.default_rng(0))
    told = {member.candidate.name: p for member, p in found.members}
    assert found.head.candidate.name == "torque_bias"
    assert told == pytest.approx(twins if named else {"torque_bias": 1.0})


def test_a_sign_that_was_free_to_choose_halves_the_odds_and_no_more(biased, monkeypatch):
    """Of two that leave the same, whatever their signs cost, the log says nothing: both are told."""
    view, groups = biased
    asked, found = [of(groups, *key) for key in (("torque_bias", 1), ("asymmetric_coulomb", 1))], {}
    for signs in ((1, 1), (2, 1), (1, 3)):
        either = dict(zip(("torque_bias", "asymmetric_coulomb"), signs))
        monkeypatch.setattr(type(asked[0]), "either", property(lambda own: either[own.candidate.name]))  # noqa: B023
        found[signs] = {m.candidate.name: p for m, p in chosen(view, asked, np.random.default_rng(0)).members}
    for (one, other), odds in found.items():
        assert odds["torque_bias"] / odds["asymmetric_coulomb"] == pytest.approx(2.0 ** (other - one), rel=0.05)
        assert max(odds, key=odds.get) == next(iter(odds))  # the head


def test_what_only_its_fewer_signs_made_the_head_is_none_where_another_is_likelier(biased, monkeypatch):
    """Another that loses less, and only costs more for a sign, heads the set by its odds; with more than these odds it does not."""
    view, groups = biased
    asked = [of(groups, *key) for key in (("torque_bias", 1), ("asymmetric_coulomb", 1))]
    monkeypatch.setattr(type(asked[0]), "either", property(lambda own: int(own.candidate.name == "asymmetric_coulomb")))
    plain, less = losses, 0.3 * np.sum(asked[0].moves ** 2)  # of the price of a sign, 1.39 of this

    def told(found, number):
        out = plain(found, number)
        mine = any(effect.name == "asymmetric_coulomb" for effect, _ in found.model.terms)
        swing = 1.0 + 4.0 * np.cos(np.pi * np.arange(len(out)))[:, None]  # what is the same in every block no draw would doubt
        return out - swing * less / np.sum(swing * np.ones_like(out)) if mine else out

    for where in ("refits", "ties"):
        monkeypatch.setattr(f"sysid.diagnose.{where}.losses", told)
    for likelier, head in ((0.9, "asymmetric_coulomb"), (0.6, "torque_bias")):
        monkeypatch.setattr(blocks, "chances", lambda losses, rng, unit: np.array([likelier, 1.0 - likelier]))  # noqa: B023
        found = chosen(view, asked, np.random.default_rng(0))
        assert found.head.candidate.name == head, likelier


def test_what_costs_less_heads_no_set_that_hardly_any_draw_leaves_it_in(biased, monkeypatch):
    """A bias costs a number less than a spring, and heads the set though it loses a little more; where every block says so, it does
    not. It is named all the same, as no likelihood rules it out: it loses half of what chance makes of one number."""
    view, groups = biased
    asked = [of(groups, *key) for key in (("torque_bias", 1), ("asymmetric_coulomb", 1), ("spring", 1))]
    plain, less = losses, 0.5 * np.sum(asked[0].moves ** 2)
    for scatter, heads in ((5.0, {"torque_bias"}), (0.1, {"spring"})):

        def told(found, number, scatter=scatter):
            swing = 1.0 + scatter * np.cos(np.pi * np.arange(number.max() + 1))
            mine = any(effect.name == "spring" for effect, _ in found.model.terms)
            out = np.zeros_like(plain(found, number)) + 1.0
            return out - (swing * less / swing.sum())[:, None] / out.shape[1] if mine else out

        for where in ("refits", "ties"):
            monkeypatch.setattr(f"sysid.diagnose.{where}.losses", told)
        found = chosen(view, asked, np.random.default_rng(0))
        assert {found.head.candidate.name} == heads, scatter
        assert {"torque_bias", "asymmetric_coulomb"} <= {member.candidate.name for member, _ in found.members}
    less *= 100.0
    found = chosen(view, asked, np.random.default_rng(0))
    assert [member.candidate.name for member, _ in found.members] == ["spring"]


def test_what_only_adds_freedom_is_told(biased):
    """A spring is a bias and a slope, and holds a bias; the other way round it does not, and of twins neither does."""
    view, groups = biased
    bias, spring, twin = (refitted(view, of(groups, name, 1)) for name in ("torque_bias", "spring", "asymmetric_coulomb"))
    assert holds(view, spring, bias) and not holds(view, bias, spring)
    assert not holds(view, bias, twin) and not holds(view, twin, bias)
    drag = refitted(view, of(groups, "position_friction", 1))
    assert not holds(view, drag, bias)  # more numbers, and another torque


def test_who_is_compared_stands_on_the_joint_or_takes_the_same_part(biased):
    """What a shoulder that gives moves of an elbow's torque is not the elbow's bias, though it changes that torque too."""
    view, groups = biased
    bias, twin = (of(groups, name, 1) for name in ("torque_bias", "asymmetric_coulomb"))
    assert alike(view, twin, bias)
    gives = [g for g in groups if g.candidate.key == ("elasticity", 0)]
    assert gives and not any(alike(view, g, bias) for g in gives)
    assert all(alike(view, g, gives[0]) for g in groups if g.candidate.joint == 0)


def test_a_number_costs_the_logarithm_of_the_values_and_of_its_signs(biased):
    """A delay may go either way, a lag is late: of two that leave the same, the half of a prior that is known to be wrong costs ln 2
    in likelihood, which is half of a loss."""
    view, groups = biased
    bias, delay, lag, cable = (of(groups, name, 1) for name in ("torque_bias", "delay", "current_lag", "cable"))
    price, variance = price_of(view, bias), np.sum(bias.moves**2)
    assert (delay.either, lag.either, cable.either) == (1, 0, len(cable.candidate.effect.coefficients()))
    assert price(delay) - price(lag) == pytest.approx(2.0 * np.log(2.0) * variance)
    values = 2.0 * view.cutoff * np.mean(view.rows.use.sum(0)) * view.step
    assert price(lag) == pytest.approx((np.log(values) - 1.0) * variance)


def test_a_size_that_may_not_be_negative_is_no_member(simulated):
    """A bias in a robot whose friction falls with speed: a drag of that sign there is not."""
    law = lambda q, qd, qdd, t, load, memory: np.array([0.0, -0.05 * qd[1] * abs(qd[1])])  # noqa: E731
    experiment = pipeline.load(simulated("less_drag", law))
    view = first_view(experiment, pipeline.fit(experiment))
    drag = of(ask(view).groups, "quadratic_drag", 1)
    assert drag.coefficients[0] == pytest.approx(-0.05, rel=0.2)
    assert refitted(view, drag) is None and chosen(view, [drag], np.random.default_rng(0)) is None


@pytest.mark.parametrize(("members", "told"), [
    ([(0, 0.4, 1.0), (0, 0.6, 2.0)], True), ([(0, 1.0, 1.0)], True), ([(0, 0.6, 1.0), (1, 0.4, 1.1)], True),
    ([(0, 0.4, 1.0), (1, 0.35, 1.1), (-1, 0.25, 1.2)], False), ([(0, 0.4, 1.0), (1, 0.35, 1.00005), (-1, 0.25, 1.2)], True),
])  # fmt: skip
def test_a_log_decides_where_it_says_which_joint(members, told):
    """All of one joint, or one likelier than all others together, with those that leave the very same."""
    made = tuple((SimpleNamespace(candidate=SimpleNamespace(joint=joint), losses=np.array([[lost]])), chance) for joint, chance, lost in members)
    assert Choice(made[0][0], made, np.zeros(3)).decided is told


def test_a_choice_without_what_is_in_the_model_anyway():
    """Probabilities are shared among what is left; the head stays, whatever another step brings."""
    from types import SimpleNamespace

    from sysid.diagnose.ties import Choice

    head, tied, there = (SimpleNamespace(candidate=SimpleNamespace(key=(word, 0))) for word in ("delay", "stribeck", "presliding"))
    choice = Choice(head, ((head, 0.5), (tied, 0.25), (there, 0.25)), np.zeros(3)).without({("presliding", 0), ("delay", 0)})
    assert [m.candidate.key[0] for m, _ in choice.members] == ["delay", "stribeck"]
    assert [p for _, p in choice.members] == pytest.approx([2 / 3, 1 / 3])


def test_rivals_are_judged_with_the_weights_that_the_best_of_them_leaves(biased):
    """A joint that lacks something is loud and counts little, and the prior much: with what is missing in the model, it is not."""
    view, groups = biased
    found = chosen(view, [of(groups, "torque_bias", 1), of(groups, "asymmetric_viscous", 1)], np.random.default_rng(1))
    left = found.head.view.rms()
    share = left / view.rms()
    assert share[1] < 0.6 < share[0]
    assert found.head.view.weights[1] / found.head.view.weights[0] == pytest.approx(left[0] / left[1], rel=0.02)
    for member, _ in found.members:
        np.testing.assert_array_equal(member.view.weights, found.head.view.weights)
    # shares are of what each joint loses, whatever it counts, less what the angles' noise makes
    assert 1.0 - share[1] ** 2 < found.shares[1] < 1.0 and abs(found.shares[0]) < 0.5


@pytest.fixture(scope="module")
def lagging(simulated):
    experiment = pipeline.load(simulated("lag under coarse angles", "current_lag:elbow:T=0.01", encoder=12, duration=12.0))
    return experiment, pipeline.fit(experiment)


def test_in_the_band_that_the_noise_of_coarse_angles_leaves_a_lag_is_told(lagging):
    """Narrowed until little of it is left: rounding of slow motion grows less with frequency than white noise."""
    view = first_view(*lagging)
    (lag,) = (refitted(view, g) for g in ask(view).groups if g.candidate.name == "current_lag" and g.candidate.joint == 1)
    assert lag.shapes["T"] == pytest.approx(0.01, rel=0.1)


def test_torques_that_are_read_late_are_told_apart_by_what_is_as_slow_as_the_motion(lagging, monkeypatch):
    """A lag makes the torque's rate, and of coarse angles that is loud: least squares make it too short, and a delay, which only turns
    the noise's phase, leaves less. What is slow, with parameters that this noise does not bend, says that it is a lag, or neither."""
    monkeypatch.setattr(opened, "_NARROWER", 2)  # in a band that holds much of it
    view = first_view(*lagging)
    groups = {g.candidate.name: g for g in ask(view).groups if g.candidate.joint == 1}
    lag, delay = (refitted(view, groups[name]) for name in ("current_lag", "delay"))
    assert lag.shapes["T"] < 0.007 and lag.losses.sum() > 1.2 * delay.losses.sum()
    slow = [slow_losses(member.view, view.blocks) for member in (lag, delay)]
    assert slow[0].shape == (view.blocks[-1] + 1,)
    assert slow[0].sum() < slow[1].sum() + groups["delay"].variance
    found = chosen(view, [groups["current_lag"], groups["delay"]], np.random.default_rng(1))
    assert {m.candidate.name for m, _ in found.members} == {"current_lag", "delay"} and found.head.candidate.name == "delay"  # bent least


@pytest.mark.long
def test_what_is_mostly_noise_is_asked_by_what_is_as_slow_as_the_motion(lagging, diagnosed, monkeypatch):
    """With twelve bits at the joint a torque's rate is mostly noise of the angles, under a low-pass of ten hertz. What of it is as slow
    as the motion tells that the torque is late, and not whether it is a lag or a delay."""
    how = {"encoder": 12, "duration": 12.0}
    with monkeypatch.context() as wide:
        wide.setattr(opened, "_NARROWER", 2)
        groups = {g.candidate.name: g for g in ask(first_view(*lagging)).groups if g.candidate.joint == 1}
    assert groups["delay"].slow and groups["current_lag"].slow and not groups["torque_bias"].slow
    assert groups["current_lag"].coefficients[0] == pytest.approx(0.01, rel=0.4)
    (claim,) = diagnosed("lag under coarse angles", "current_lag:elbow:T=0.01", **how).claims
    assert {effect for effect, *_ in claim.set} == {"delay", "current_lag"} and claim.head.rms_after < claim.head.rms_before
    assert diagnosed("nothing under coarse angles", **how).claims == ()
