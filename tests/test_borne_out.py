"""Whether fits bear out an effect: what the other joints pay for it, and which of its numbers say how large it is."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import blocks, borne_out, cancelling, comparison, vocabulary
from sysid.blocks import parameters
from sysid.borne_out import at_zero, doubted, first_borne_out, in_doubt, size_told
from sysid.candidates import Candidate
from sysid.comparison import Difference
from sysid.effect import NotFinite


class Told(SimpleNamespace):
    """A fit as far as `in_doubt` looks at it: the error of its joint."""

    joints, weights = ("shoulder", "elbow"), None
    model = SimpleNamespace(terms=(), coefficients=())
    certificate = SimpleNamespace(at_zero={})

    def rms(self, part):
        return {"shoulder": 1.0, "elbow": self.error}


def judged(monkeypatch, paid: tuple[float, float], own: float = -0.1, by_own: float = 0.01) -> str:
    """What is in doubt of an effect by which the error of its joint falls; paid: what all joints together lose under the prior before,
    and as `sysid add` gives it, as the fit weighs them; own: by how much the joint's own error then changes; by_own: what all lose, each
    by its own."""
    before, after, told = (Told(error=error) for error in (1.0, 0.8, 0.8))
    change = {id(after): paid[0], id(told): paid[1]}
    fall = {id(after): -0.1, id(told): own}
    monkeypatch.setattr(borne_out, "size_told", lambda *_: True)
    monkeypatch.setattr(comparison, "compare", lambda _, one: (Difference("a", "b", "elbow", fall[id(one)], 0.02),))
    monkeypatch.setattr(comparison, "together", lambda _, one, weighed=False: Difference("a", "b", "*", change[id(one)] if weighed else by_own, 0.002))
    return in_doubt(before, after, told, Candidate(vocabulary.find("cogging"), 1, ())) or ""


@pytest.mark.parametrize(("paid", "refused"), [((0.01, 0.01), True), ((0.01, -0.05), False), ((-0.05, 0.01), False), ((0.001, 0.001), False)])
def test_an_effect_is_refused_where_the_others_pay_for_it_under_either_prior(monkeypatch, paid, refused):
    assert ("of all joints together rises" in judged(monkeypatch, paid)) is refused


@pytest.mark.parametrize(("by_own", "refused"), [(0.01, True), (-0.05, False), (0.001, False)])
def test_an_effect_is_refused_where_the_others_pay_for_it_however_they_count(monkeypatch, by_own, refused):
    """As the fit weighs them the loud joints' rise outweighs all of a quiet one's error; each by its own it may be nothing beside its fall."""
    assert ("of all joints together rises" in judged(monkeypatch, (0.01, 0.01), by_own=by_own)) is refused


@pytest.mark.parametrize(
    ("others", "fall", "refused"),
    [((0.3, 0.3), -0.1, True), ((0.3, -0.01), -0.1, False), ((0.03, 0.03), -0.1, False), ((0.3, 0.3), -0.4, False), ((0.05, 0.05), -0.02, False)],
)
def test_an_effect_is_refused_that_spoils_another_joint(monkeypatch, others, fall, refused):
    """By more than it is worth anywhere, clearly, and as either fit has it."""
    before, after, told = (Told(error=error) for error in (1.0, 0.8, 0.8))
    rises = {id(after): others[0], id(told): others[1]}
    both = lambda _, one, *names: (Difference("a", "b", "shoulder", rises[id(one)], 0.03), Difference("a", "b", "elbow", fall, 0.01))  # noqa: E731
    monkeypatch.setattr(borne_out, "size_told", lambda *_: True)
    monkeypatch.setattr(comparison, "compare", both)
    monkeypatch.setattr(comparison, "together", lambda *_, **__: Difference("a", "b", "*", -0.01, 0.002))
    said = in_doubt(before, after, told, Candidate(vocabulary.find("cogging"), 1, ())) or ""
    assert ("test error of shoulder rises (+30 %) by more than any joint's falls" in said) is refused
    assert bool(comparison.spoiled(before, (after, told), ["elbow"])) is refused and not comparison.spoiled(before, (after, told), None)


@pytest.mark.parametrize(("own", "refused"), [(-0.001, False), (0.001, True)])
def test_an_effect_is_refused_where_its_joints_error_rises_as_add_fits_it(monkeypatch, own, refused):
    """Under the prior of the fit before it the error falls, which nobody sees who adds it."""
    assert ("as `sysid add` fits it" in judged(monkeypatch, (-0.05, -0.05), own)) is refused


@pytest.mark.parametrize(("told", "together", "refused"), [(True, -0.02, False), (False, -0.02, True), (True, -0.004, True)])
def test_what_a_joints_bodies_made_up_for_may_show_in_the_torque_of_those_that_carry_it(monkeypatch, told, together, refused):
    """A gain of the elbow's torque whose own error falls by 0.3 % only, and that of all joints together by more: where its size is told."""
    before, after = Told(error=1.0), Told(error=0.99)
    monkeypatch.setattr(borne_out, "size_told", lambda *_: told)
    monkeypatch.setattr(comparison, "compare", lambda *_: (Difference("a", "b", "elbow", -0.003, 0.0005),))
    monkeypatch.setattr(comparison, "together", lambda *_, **__: Difference("a", "b", "*", together, 0.002))
    said = in_doubt(before, after, after, Candidate(vocabulary.find("torque_gain"), 1, ()))
    assert bool(said) is refused


@pytest.mark.parametrize(("se", "refused"), [(0.02, False), (0.06, True)])
def test_a_quiet_joints_own_error_may_rise_where_that_on_the_test_logs_clearly_falls(monkeypatch, se, refused):
    """A fit that weighs all joints alike trades what a quiet one loses on the training logs for what a loud one gains."""
    before, after = Told(error=1.0), Told(error=1.0)
    monkeypatch.setattr(comparison, "compare", lambda *_: (Difference("a", "b", "elbow", -0.1, se),))
    monkeypatch.setattr(comparison, "together", lambda *_, **__: Difference("a", "b", "*", -0.01, 0.002))
    said = in_doubt(before, after, after, Candidate(vocabulary.find("cogging"), 1, ()))
    assert (said == "the fit's own error does not fall with it") is refused and (said is None) is not refused


@pytest.mark.parametrize(
    ("effect", "se", "refused"), [("current_lag", 0.06, False), ("delay", 0.06, False), ("current_lag", 0.2, True), ("torque_gain", 0.06, True)]
)
def test_what_reads_torque_late_makes_torque_of_the_angles_noise(monkeypatch, effect, se, refused):
    """In the fit's own error, which rises with it, as well: one standard error of the test error bears it out."""
    before, after = Told(error=1.0), Told(error=1.1)
    monkeypatch.setattr(borne_out, "size_told", lambda *_: True)
    monkeypatch.setattr(comparison, "compare", lambda *_: (Difference("a", "b", "elbow", -0.1, se),))
    monkeypatch.setattr(comparison, "together", lambda *_, **__: Difference("a", "b", "*", -0.01, 0.002))
    assert (in_doubt(before, after, after, Candidate(vocabulary.find(effect), 1, ())) is not None) is refused


@pytest.mark.parametrize(
    ("before", "own", "shown", "refused"),
    [
        (0.01, -0.1, -0.05, False),  # held back under the prior of the fit before, and clear under its own
        (-0.1, 0.01, -0.05, False),
        (0.01, 0.01, -0.05, True),  # only a weaker prior lowers the error, with it or without it
        (0.01, -0.1, 0.05, True),  # clear, and yet `sysid add` shows an error that rises
    ],
)
def test_an_effect_is_borne_out_under_either_prior(monkeypatch, before, own, shown, refused):
    """By how much the error changes under the prior of the fit before, under that of the fit with it, and from the one to the other."""
    first, after, without, told = (Told(error=error) for error in (1.0, 0.8, 1.0, 0.8))
    change = {(id(first), id(after)): before, (id(without), id(told)): own, (id(first), id(told)): shown}
    monkeypatch.setattr(borne_out, "size_told", lambda *_: True)
    monkeypatch.setattr(comparison, "compare", lambda a, b, *_: (Difference("a", "b", "elbow", change[id(a), id(b)], 0.02),))
    monkeypatch.setattr(comparison, "together", lambda *_, **__: Difference("a", "b", "*", -0.01, 0.002))
    candidate = Candidate(vocabulary.find("cogging"), 1, ())
    assert bool(doubted(first, after, lambda: without, told, candidate)) is refused
    assert bool(doubted(first, after, None, after, candidate)) is (before > 0.0)  # under one prior there is one comparison


def fitted(effect: str, sizes: dict[str, tuple[float, float]], shapes: dict[str, tuple[float, float]], together: float = 0.0):
    """A fit as far as `size_told` looks at it, of an effect on joint 1: {word: (value, deviation)} of coefficients, which are correlated
    by `together`, and of shape values."""
    own = vocabulary.find(effect)
    values = [SimpleNamespace(term=0, joint=1, shape=shape) for shape in own.shapes() if shape.name in shapes]
    kinds = [SimpleNamespace(effect=effect, joint=joint) for joint in (0, 1) for _ in sizes]
    model = SimpleNamespace(bodies=1, coefficients=kinds, shape_values=values, terms=[(own, None)], shapes=[shapes[v.shape.name][0] for v in values])
    spread = np.array([std for _, std in sizes.values()])
    alike = np.full((len(sizes),) * 2, together) + (1.0 - together) * np.eye(len(sizes))
    covariance = np.eye(10 + 2 * len(sizes))
    covariance[10 + len(sizes) :, 10 + len(sizes) :] = alike * np.nan_to_num(np.outer(spread, spread))
    std = np.concatenate([np.ones(10 + len(sizes)), spread])
    return SimpleNamespace(
        model=model, coefficients=np.array([100.0] * len(sizes) + [value for value, _ in sizes.values()]), compressed=SimpleNamespace(blocks=60),
        uncertainty=SimpleNamespace(covariance=covariance, std=std), shape_std=np.array([shapes[v.shape.name][1] for v in values]), shape_covariance=np.diag([shapes[v.shape.name][1] ** 2 for v in values]),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("effect", "sizes", "shapes", "told"),
    [
        # of a saturation its share, not the limit beyond which it acts; of a delay the delay; of warm friction what falls, not how fast
        ("torque_saturation", {"e": (0.3, 0.1)}, {"limit": (8.0, 1.0)}, True),
        ("torque_saturation", {"e": (0.1, 0.3)}, {"limit": (8.0, 1.0)}, False),
        ("torque_saturation", {"e": (0.3, float("nan"))}, {"limit": (8.0, 1.0)}, False),
        ("delay", {}, {"d": (0.003, 0.001)}, True),
        ("delay", {}, {"d": (0.001, 0.001)}, False),
        ("warmup", {"dFv": (0.1, 0.1), "dFc": (0.1, 0.1)}, {"T": (8.0, 1.0)}, False),
        ("elasticity", {}, {"compliance": (1e-4, 1e-5), "damping": (0.3, 1.0)}, True),
        ("elasticity", {}, {"compliance": (1e-5, 1e-5), "damping": (0.3, 0.01)}, False),
        # what several say together: three of 2.1 deviations are no chance, one of three that is 2.2 may be, and none that is 4
        ("joint_coupling", {"Ia": (2.1, 1.0), "Fv": (2.1, 1.0), "Fs": (2.1, 1.0)}, {}, True),
        ("joint_coupling", {"Ia": (2.2, 1.0), "Fv": (0.1, 1.0), "Fs": (0.1, 1.0)}, {}, False),
        ("joint_coupling", {"Ia": (4.0, 1.0), "Fv": (0.1, 1.0), "Fs": (0.1, 1.0)}, {}, True),
        # one that nothing determines takes no part, whatever a solver left in its covariance
        ("joint_coupling", {"Ia": (4.0, float("nan")), "Fv": (0.1, 1.0), "Fs": (0.1, 1.0)}, {}, False),
    ],
)
def test_a_size_that_is_told_is_what_vanishes_with_the_effect(effect, sizes, shapes, told):
    """As everywhere that says whether a size is told: the diagnosis, `sysid add`, what the weights of joints hide."""
    assert size_told(fitted(effect, sizes, shapes), effect, 1) is told


def test_sizes_that_trade_with_each_other_are_told_together():
    """Of two that are as likely both less as both more, half a deviation each is nothing; one more and one less is much."""
    for b, told in ((0.5, False), (-0.5, True)):
        found = fitted("joint_coupling", {"Fv": (0.5, 1.0), "Fs": (b, 1.0)}, {}, together=0.98)
        assert size_told(found, "joint_coupling", 1) is told


@pytest.mark.parametrize("k", [1, 2, 5])
@pytest.mark.parametrize("count", [12, 60])
def test_values_that_are_noise_are_clear_as_seldom_as_one_is(k, count):
    """One in twenty-two at most, of a covariance as well known as that of so many blocks and their neighbours; half as often at least."""
    rng, hits, draws, freedom = np.random.default_rng(k), 0, 4000, round(parameters._freedom(count))
    for _ in range(draws):
        mixed = rng.normal(size=(k, k))
        rows = rng.normal(size=(freedom, k)) @ mixed
        known = rows.T @ rows / freedom * blocks.widening(count) ** 2
        hits += blocks.clear(rng.normal(size=k) @ mixed, known, count)
    assert 0.0455 / 2.0 - 0.01 < hits / draws < 0.0455 + 4.0 * np.sqrt(0.0455 / draws) + 0.01


@pytest.mark.parametrize("count", [1, 2, 3, 5, 10, 100])
@pytest.mark.parametrize("k", [1, 2, 3, 8, 12])
def test_values_of_many_deviations_are_clear_however_few_the_blocks(k, count):
    """Of a covariance that few blocks tell, of which some say nothing, and of values that say one thing."""
    one = np.zeros(k)
    one[0] = 20.0
    assert blocks.clear(one, np.eye(k), count) and blocks.clear(np.full(k, 20.0), np.eye(k), count)
    assert not blocks.clear(np.full(k, 0.5), np.eye(k), count)
    assert blocks.clear(np.full(k, 2.1), np.ones((k, k)), count) and not blocks.clear(np.full(k, 1.9), np.ones((k, k)), count)
    assert not blocks.clear(one, np.diag([np.nan, *np.ones(k - 1)]), count)


@pytest.mark.parametrize(("fall", "told", "refused"), [(-0.012, False, True), (-0.012, True, False), (-0.03, False, False)])
def test_of_an_untold_size_a_fall_that_is_not_worth_having_says_nothing(monkeypatch, fall, told, refused):
    """The test error falls by six standard errors, and by less than 1.5 %; a drift of 3 % in friction was called a coupling for as much."""
    before, after = Told(error=1.0), Told(error=1.0 + fall)
    monkeypatch.setattr(borne_out, "size_told", lambda *_: told)
    monkeypatch.setattr(comparison, "compare", lambda *_: (Difference("a", "b", "elbow", fall, 0.002),))
    monkeypatch.setattr(comparison, "together", lambda *_, weighed=False: Difference("a", "b", "*", fall, 0.002))
    why = in_doubt(before, after, after, Candidate(vocabulary.find("cogging"), 1, ())) or ""
    assert ("falls by less than 1.5 %" in why) is refused and (refused or not why)


@pytest.mark.parametrize(("fall", "told", "refused"), [(-0.03, False, True), (-0.03, True, False), (-0.2, False, False)])
def test_where_joints_count_by_their_noise_a_size_is_told_or_the_effect_is_plain(monkeypatch, fall, told, refused):
    """A bump of friction left a rest of which elasticity of 4.3e-5 +- 2.5e-5 took 2 % of the error."""
    before, after = Told(error=1.0), Told(error=1.0 + fall, weights=np.ones(2))
    monkeypatch.setattr(borne_out, "size_told", lambda *_: told)
    monkeypatch.setattr(comparison, "compare", lambda *_: (Difference("a", "b", "elbow", fall, 0.002),))
    monkeypatch.setattr(comparison, "together", lambda *_, weighed=False: Difference("a", "b", "*", fall, 0.002))
    why = in_doubt(before, after, after, Candidate(vocabulary.find("cogging"), 1, ())) or ""
    assert ("falls by less than 10 %" in why) is refused and (refused or not why)


@pytest.mark.parametrize(("rest", "refused"), [(0.5, True), (0.9, False)])
def test_what_is_in_some_logs_is_refused_where_a_zero_of_each_leaves_less(monkeypatch, rest, refused):
    """A control whose torque's zero was set anew had a payload of 0.12 +- 0.025 kg in two logs; with a true one no zero does."""
    before, after, zero = Told(error=1.0), Told(error=0.7), Told(error=rest)
    monkeypatch.setattr(borne_out, "centred", lambda fit: zero)
    monkeypatch.setattr(borne_out, "size_told", lambda *_: True)
    change = lambda a, b: b.error - a.error  # noqa: E731
    monkeypatch.setattr(comparison, "compare", lambda a, b: (Difference("a", "b", "elbow", change(a, b), 0.02),))
    monkeypatch.setattr(comparison, "together", lambda a, b, weighed=False: Difference("a", "b", "*", change(a, b), 0.02))
    for word, joint in (("payload", -1), ("friction_change", 1)):
        some = Candidate(vocabulary.find(word), joint, (("logs", ("a.csv",)),))
        why = in_doubt(before, after, after, some) or ""
        assert ("another zero of each log" in why) is refused and (refused or not why)
    assert not in_doubt(before, after, after, Candidate(vocabulary.find("cogging"), 1, ()))


def test_the_share_of_a_misfit_that_a_fit_takes(monkeypatch):
    """Of an error of 2 above a floor of 1, to 1.5; nothing where the effect is no finite number."""
    made, known = [], {"filters": None}

    def how(spec, last, **given):
        made.append((spec, given))
        if len(made) > 1:
            raise NotFinite("no number", where="here")
        return Told(error=1.5)

    monkeypatch.setattr(borne_out.pipeline, "fit_grown", how)
    monkeypatch.setattr(borne_out, "grown", lambda experiment, name, joints, options, every: (name, joints, options))
    last = Told(error=2.0, experiment=None)
    candidate = Candidate(vocabulary.find("cogging"), 1, (("k", 3.0),))
    taken = lambda: borne_out.misfit_taken(last, 1, SimpleNamespace(rms=1.0), known, candidate)  # noqa: E731
    assert taken() == pytest.approx((4.0 - 2.25) / 3.0)
    assert made == [(("cogging", ["elbow"], {"k": 3.0}), known)]
    assert taken() == 0.0


@pytest.mark.parametrize(
    ("fall", "se", "beside", "refused"),
    [(-0.008, 0.01, False, False), (-0.008, 0.01, True, True), (-0.008, 0.004, True, False), (-0.03, 0.04, True, False)],
)
def test_beside_a_claim_the_test_error_falls_by_its_standard_error(monkeypatch, fall, se, beside, refused):
    """Of an effect that is alone less does: what the training logs say of it is no rest that another one's law left. Where the fall is
    worth having, it need not be beyond doubt."""
    terms = [(vocabulary.find(name), (0, 1)) for name in ("viscous", "coulomb", "torque_bias", "armature", "cogging")]
    terms.append((vocabulary.find("stribeck"), (1,) if beside else (0,)))
    before, after = Told(error=1.0, model=SimpleNamespace(terms=terms)), Told(error=0.9)
    monkeypatch.setattr(borne_out, "size_told", lambda *_: True)
    monkeypatch.setattr(comparison, "compare", lambda *_: (Difference("a", "b", "elbow", fall, se),))
    monkeypatch.setattr(comparison, "together", lambda *_, **__: Difference("a", "b", "*", -0.01, 0.002))
    cogging = Candidate(vocabulary.find("cogging"), 1, ())
    assert borne_out.beside(before, cogging) is beside
    said = in_doubt(before, after, after, cogging) or ""
    assert said == doubted(before, after, lambda: before, after, cogging) or not refused
    assert ("less than its standard error, beside what is on that joint already" in said) is refused


@pytest.mark.parametrize(
    ("members", "head", "refused"),
    [  # (name, refused, size told, test error)
        ([("a", False, True, 1.0), ("b", False, True, 0.5)], "a", ""),
        ([("a", True, True, 1.0), ("b", False, True, 0.5)], "b", "a"),
        ([("a", False, False, 1.0), ("b", False, True, 0.5)], "b", "a"),
        ([("a", False, False, 1.0), ("b", False, True, 1.5)], "a", ""),
        ([("a", False, False, 1.0), ("b", False, False, 0.5), ("c", False, True, 0.7)], "c", "a"),
        ([("a", False, False, 1.0), ("b", True, True, 0.5)], "a", "b"),
        ([("a", True, False, 1.0), ("b", True, True, 0.5)], None, "ab"),
    ],
)
def test_one_whose_size_is_told_comes_before_one_whose_is_not(members, head, refused, monkeypatch):
    by_name = {name: own for name, *own in members}
    made = [SimpleNamespace(candidate=SimpleNamespace(name=name, key=(name, 0))) for name in by_name]
    monkeypatch.setattr(borne_out, "doubted", lambda last, after, candidate: "no" if by_name[candidate.name][0] else None)
    monkeypatch.setattr(borne_out, "size_told", lambda fit, name, joint: by_name[name][1])
    monkeypatch.setattr(borne_out.comparison, "together", lambda one, other: SimpleNamespace(delta_rms=by_name[other][2] - by_name[one][2]))
    found, fits, whys = first_borne_out(made, None, lambda how, member: (member.candidate.name,))
    assert (found and found.candidate.name) == head
    assert "".join(one.candidate.name for one in made if id(one) in whys) == refused
    assert found is None or fits[id(found)] == head


@pytest.mark.parametrize(("held", "said"), [({1: 3.0}, "k"), ({}, ""), ({0: 3.0, 2: 1.0}, "")])
def test_a_spring_without_stiffness_is_none(held, said):
    """Its torque at angle zero alone is left, a bias."""
    named = lambda effect, name, positive: SimpleNamespace(effect=effect, joint=1, name=f"{effect}.elbow.{name}", positive=positive)  # noqa: E731
    own = (named("coulomb", "Fc", True), named("spring", "k", True), named("spring", "c", False))
    fit = SimpleNamespace(model=SimpleNamespace(coefficients=own), certificate=SimpleNamespace(at_zero=held))
    assert at_zero(fit, "spring", 1) == said and at_zero(fit, "cogging", 1) == ""


@pytest.mark.parametrize(("numbers", "says"), [((-201.0, 171.0, -47.0), True), ((1.0, 0.5, -0.3), False), ((3.0,), False)])
def test_terms_that_cancel_are_told(monkeypatch, numbers, says):
    """Three harmonics over a part of a turn, 100 times what they sum to; and three that are a law's own numbers."""
    q = np.linspace(-0.66, 0.66, 200)
    columns = np.stack([np.sin(k * q) for k in range(1, len(numbers) + 1)], axis=1)
    monkeypatch.setattr(cancelling, "columns_of", lambda source, candidate, shapes: columns[None, None])
    candidate = SimpleNamespace(nonlinear=False, key=("position_friction", 1))
    after = SimpleNamespace(parameters_of=lambda *_: {str(k): (at, 0.1, "N m") for k, at in enumerate(numbers)})
    step = SimpleNamespace(after=SimpleNamespace(source=None), choice=SimpleNamespace(head=SimpleNamespace(shapes={})))
    claim = SimpleNamespace(head=SimpleNamespace(effect="position_friction", joint="elbow", candidate=candidate), step=step, after=after)
    said = cancelling.cancelling([claim])
    assert bool(said) is says and all("terms of position_friction on elbow cancel each other" in one for one in said)
