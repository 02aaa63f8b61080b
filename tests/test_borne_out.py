"""Whether fits bear out an effect: what the other joints pay, and whether it is anything beside its deviations."""

from types import SimpleNamespace

import pytest

from sysid import comparison, vocabulary
from sysid.borne_out import in_doubt, sizes
from sysid.candidates import Candidate
from sysid.comparison import Difference


class Told(SimpleNamespace):
    """A fit as far as `in_doubt` looks at it: the error of its joint, and its parameters {name: (value, std, unit)}."""

    joints = ("shoulder", "elbow")

    def rms(self, part):
        return {"shoulder": 1.0, "elbow": self.error}

    def parameters_of(self, effect, joint):
        return {"cogging.elbow.a1": (self.size, 1.0, "N m"), "cogging.elbow.k": (30.0, 0.1, "1/rad")}


def judged(monkeypatch, *, paid=(-0.01, -0.01), size=5.0, fall=5.0) -> str:
    """What is in doubt of an effect by which the error of its joint falls.

    Args:
        paid: what all joints together lose under the prior before, and as `sysid add` gives it. size, fall: of its parameter, and of the
            test error of its joint, in standard deviations.
    """
    before, after, told = (Told(error=error, size=size) for error in (1.0, 0.8, 0.8))
    change = {id(after): paid[0], id(told): paid[1]}
    monkeypatch.setattr(comparison, "compare", lambda *given: (Difference("a", "b", "elbow", -0.02 * fall, 0.02),))
    monkeypatch.setattr(comparison, "together", lambda _, one, weighed=False: Difference("a", "b", "*", change[id(one)], 0.002))
    return in_doubt(before, after, told, Candidate(vocabulary.find("cogging"), 1, ())) or ""


@pytest.mark.parametrize(("paid", "refused"), [((0.01, 0.01), True), ((0.01, -0.05), False), ((-0.05, 0.01), False), ((0.001, 0.001), False)])
def test_an_effect_is_refused_where_the_others_pay_for_it_under_either_prior(monkeypatch, paid, refused):
    assert ("as the fit weighs them, rises" in judged(monkeypatch, paid=paid)) is refused


@pytest.mark.parametrize(("size", "fall", "refused"), [(1.9, 1.9, True), (2.1, 1.9, False), (1.9, 2.1, False), (-1.9, 1.0, True), (-2.1, 1.0, False)])
def test_an_effect_is_refused_where_neither_its_size_nor_what_it_does_is_told(monkeypatch, size, fall, refused):
    assert ("nothing beside its deviation" in judged(monkeypatch, size=size, fall=fall)) is refused


def test_how_large_an_effect_is_says_what_vanishes_with_it():
    """Of a saturation its share, not the limit beyond which it acts; of a delay the delay; of warm friction what falls, not how fast."""
    numbers = {"torque_saturation": ("e", "limit"), "delay": ("d",), "warmup": ("dFv", "dFc", "T"), "elasticity": ("compliance", "damping")}
    said = {"torque_saturation": {"e"}, "delay": {"d"}, "warmup": {"dFv", "dFc"}, "elasticity": {"compliance"}}
    for name, words in numbers.items():
        fit = SimpleNamespace(parameters_of=lambda effect, joint, words=words: {f"{effect}.hip.{word}": (2.0, 0.5, "") for word in words})
        found = sizes(Candidate(vocabulary.find(name), 0, ()), fit)
        assert {key.rpartition(".")[2] for key in found} == said[name] and set(found.values()) == {(2.0, 0.5, "")}
