"""Whether fits bear out an effect: what the other joints pay, and whether its size is anything beside its deviation."""

from types import SimpleNamespace

import pytest

from sysid import borne_out, comparison, pipeline, vocabulary
from sysid.borne_out import in_doubt, sizes
from sysid.candidates import Candidate
from sysid.comparison import Difference

FALLS = Difference("a", "b", "elbow", -0.1, 0.01)


class Told(SimpleNamespace):
    """A fit as far as `in_doubt` looks at it: the error of its joint, its parameters {name: (value, std, unit)}, its weights."""

    joints = ("shoulder", "elbow")
    weights = None
    numbers = {"cogging.elbow.a1": (5.0, 1.0, "N m")}

    def rms(self, part):
        return {"shoulder": 1.0, "elbow": self.error}

    def parameters_of(self, effect, joint):
        return self.numbers


def judged(monkeypatch, paid=(-0.01, -0.01), alone=None, weighed=None) -> tuple[str | None, list]:
    """What is in doubt of an effect by which the error of its joint falls.

    Args:
        paid: what all joints together lose under the prior before and as `sysid add` gives it. alone: its parameters; weighed: with
            each joint weighed by its noise.
    """
    before, after, told = Told(error=1.0), Told(error=0.8), Told(error=0.8)
    if alone:
        told.numbers = alone
    asked, change = [], {id(after): paid[0], id(told): paid[1]}
    monkeypatch.setattr(comparison, "compare", lambda *given: (FALLS,))
    monkeypatch.setattr(comparison, "together", lambda _, one, weighed=False: Difference("a", "b", "*", change[id(one)], 0.002))
    again = lambda: asked.append(1) or Told(error=0.8, weights=[1.0, 2.0], numbers=weighed)  # noqa: E731
    return in_doubt(before, after, told, again, Candidate(vocabulary.find("cogging"), 1, ())), asked


@pytest.mark.parametrize(("paid", "refused"), [((0.01, 0.01), True), ((0.01, -0.05), False), ((-0.05, 0.01), False), ((0.001, 0.001), False)])
def test_an_effect_is_refused_where_the_others_pay_for_it_under_either_prior(monkeypatch, paid, refused):
    why, _ = judged(monkeypatch, paid)
    assert (why is not None) is refused and (why or "as the fit weighs them").count("as the fit weighs them") == 1


def test_a_size_that_is_nothing_beside_its_deviation_is_asked_with_joints_weighed(monkeypatch):
    small, clear = {"cogging.elbow.a1": (0.5, 1.0, "N m")}, {"cogging.elbow.a1": (1.5, 1.0, "N m")}
    assert judged(monkeypatch) == (None, [])  # no other fit is made of what is clear
    why, asked = judged(monkeypatch, alone=small, weighed=small)
    assert "less than its standard deviation" in why and asked == [1]
    assert judged(monkeypatch, alone=small, weighed=clear) == (None, [1])


def test_how_large_an_effect_is_says_what_vanishes_with_it():
    """Of a saturation its share, not the limit beyond which it acts; of a delay the delay; of warm friction what falls, not how fast."""
    numbers = {"torque_saturation": ("e", "limit"), "delay": ("d",), "warmup": ("dFv", "dFc", "T"), "elasticity": ("compliance", "damping")}
    said = {"torque_saturation": {"e"}, "delay": {"d"}, "warmup": {"dFv", "dFc"}, "elasticity": {"compliance"}}
    for name, words in numbers.items():
        fit = SimpleNamespace(parameters_of=lambda effect, joint, words=words: {f"{effect}.hip.{word}": (2.0, 0.5, "") for word in words})
        found = sizes(Candidate(vocabulary.find(name), 0, ()), fit)
        assert {key.rpartition(".")[2] for key in found} == said[name] and set(found.values()) == {(2.0, 0.5, "")}


def test_a_fit_weighed_by_noise_is_of_the_same_model(simulated):
    fit = pipeline.fit(pipeline.load(simulated("control")))
    found = pipeline.fit_weighed(fit.experiment, fit, filters=fit.filters)
    assert fit.weights is None and len(found.weights) == 2 and found.model.names == fit.model.names
    assert borne_out.nought(sizes(Candidate(vocabulary.find("torque_bias"), 1, ()), found))  # what it does not have has no size
