"""Whether fits bear out an effect: what the other joints pay for it, and which of its numbers say how large it is."""

from types import SimpleNamespace

import pytest

from sysid import comparison, vocabulary
from sysid.borne_out import in_doubt, size_told, sizes
from sysid.candidates import Candidate
from sysid.comparison import Difference


class Told(SimpleNamespace):
    """A fit as far as `in_doubt` looks at it: the error of its joint, and its parameters {name: (value, std, unit)}."""

    joints = ("shoulder", "elbow")

    def rms(self, part):
        return {"shoulder": 1.0, "elbow": self.error}

    def parameters_of(self, effect, joint):
        return {"cogging.elbow.a1": (5.0, 1.0, "N m"), "cogging.elbow.k": (30.0, 0.1, "1/rad")}


def judged(monkeypatch, paid: tuple[float, float], own: float = -0.1, by_own: float = 0.01) -> str:
    """What is in doubt of an effect by which the error of its joint falls; paid: what all joints together lose under the prior before,
    and as `sysid add` gives it, as the fit weighs them; own: by how much the joint's own error then changes; by_own: what all lose, each
    by its own."""
    before, after, told = (Told(error=error) for error in (1.0, 0.8, 0.8))
    change = {id(after): paid[0], id(told): paid[1]}
    fall = {id(after): -0.1, id(told): own}
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


@pytest.mark.parametrize(("own", "refused"), [(-0.001, False), (0.001, True)])
def test_an_effect_is_refused_where_its_joints_error_rises_as_add_fits_it(monkeypatch, own, refused):
    """Under the prior of the fit before it the error falls, which nobody sees who adds it."""
    assert ("as `sysid add` fits it" in judged(monkeypatch, (-0.05, -0.05), own)) is refused


@pytest.mark.parametrize(("se", "refused"), [(0.02, False), (0.06, True)])
def test_a_quiet_joints_own_error_may_rise_where_that_on_the_test_logs_clearly_falls(monkeypatch, se, refused):
    """A fit that weighs all joints alike trades what a quiet one loses on the training logs for what a loud one gains."""
    before, after = Told(error=1.0), Told(error=1.0)
    monkeypatch.setattr(comparison, "compare", lambda *_: (Difference("a", "b", "elbow", -0.1, se),))
    monkeypatch.setattr(comparison, "together", lambda *_, **__: Difference("a", "b", "*", -0.01, 0.002))
    said = in_doubt(before, after, after, Candidate(vocabulary.find("cogging"), 1, ()))
    assert (said == "the fit's own error does not fall with it") is refused and (said is None) is not refused


def test_how_large_an_effect_is_says_what_vanishes_with_it():
    """Of a saturation its share, not the limit beyond which it acts; of a delay the delay; of warm friction what falls, not how fast."""
    numbers = {"torque_saturation": ("e", "limit"), "delay": ("d",), "warmup": ("dFv", "dFc", "T"), "elasticity": ("compliance", "damping")}
    said = {"torque_saturation": {"e"}, "delay": {"d"}, "warmup": {"dFv", "dFc"}, "elasticity": {"compliance"}}
    for name, words in numbers.items():
        found = sizes(vocabulary.find(name), {f"{name}.hip.{word}": (2.0, 0.5, "") for word in words})
        assert {key.rpartition(".")[2] for key in found} == said[name] and set(found.values()) == {(2.0, 0.5, "")}


@pytest.mark.parametrize(("share", "told"), [((0.3, 0.1), True), ((0.1, 0.3), False), ((0.3, float("nan")), False)])
def test_a_limit_that_is_told_is_no_size_that_is(share, told):
    """As everywhere that says whether a size is told: the diagnosis, `sysid add`, what the weights of joints hide."""
    numbers = {"torque_saturation.hip.e": (*share, "1"), "torque_saturation.hip.limit": (8.0, 1.0, "N m")}
    assert size_told(vocabulary.find("torque_saturation"), numbers) is told
