"""A law of which a number is nothing beside its deviation may be a simpler one."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import comparison, vocabulary
from sysid.candidates import Candidate
from sysid.comparison import Difference
from sysid.diagnose.ties import Choice
from sysid.simpler import with_simpler


def member(name: str, numbers: int, lost: float, joint: int = 0) -> SimpleNamespace:
    group = SimpleNamespace(numbers=numbers)
    return SimpleNamespace(candidate=Candidate(vocabulary.find(name), joint, ()), group=group, losses=np.full((4, 1), lost / 4))


def fit(**parameters) -> SimpleNamespace:
    return SimpleNamespace(parameters_of=lambda *_: parameters)


SPRING = {"k": (0.014, 0.011, "N m/rad"), "c": (0.45, 0.005, "N m")}


def choice_of(*beaten) -> Choice:
    """A spring that takes 80 of 100 units of loss, alone."""
    head = member("spring", 2, 20.0)
    return Choice(head, ((head, 1.0),), np.full(4, 20.0), tuple(beaten), np.array([0.8]))


def asked(monkeypatch, choice, parameters, risen=0.0):
    """The choice with what is simpler, and which effects were fitted; risen: test error of the simpler fits over the head's, in standard
    errors."""
    monkeypatch.setattr(comparison, "together", lambda *_: Difference("a", "b", "*", risen * 0.01, 0.01))
    fitted = []
    fit_with = lambda one: fitted.append(one.candidate.name) or fit()  # noqa: E731
    return with_simpler(choice, {id(choice.head): fit(**parameters)}, fit_with), fitted


def test_an_offset_is_no_spring_of_no_stiffness(monkeypatch):
    choice = choice_of(member("torque_bias", 1, 20.3), member("asymmetric_coulomb", 1, 20.3), member("cable", 5, 20.0))
    found, fitted = asked(monkeypatch, choice, SPRING)
    assert fitted == ["torque_bias", "asymmetric_coulomb"]
    assert found.head.candidate.name == "torque_bias"
    assert [(m.candidate.name, p) for m, p in found.members] == [(name, pytest.approx(1 / 3)) for name in ("torque_bias", "asymmetric_coulomb", "spring")]
    assert [m.candidate.name for m in found.beaten] == ["cable"]


@pytest.mark.parametrize("what", ["its numbers are told", "the others leave more of the test logs", "they took much less", "they are on another joint"])
def test_else_the_claim_stands(monkeypatch, what):
    stiff = SPRING | {"k": (0.14, 0.011, "N m/rad")} if what == "its numbers are told" else SPRING
    lost, joint = (40.0 if what == "they took much less" else 20.3), int(what == "they are on another joint")
    choice = choice_of(member("torque_bias", 1, lost, joint))
    found, fitted = asked(monkeypatch, choice, stiff, risen=1.5 if what == "the others leave more of the test logs" else 0.0)
    assert found is choice
    assert fitted == (["torque_bias"] if "test logs" in what else [])


def test_a_member_of_the_set_keeps_its_probability_where_that_is_more(monkeypatch):
    head, tied = member("spring", 2, 20.0), member("torque_bias", 1, 20.1)
    choice = Choice(head, ((head, 0.3), (tied, 0.7)), np.full(4, 20.0), (), np.array([0.8]))
    found, _ = asked(monkeypatch, choice, SPRING)
    assert found.head is tied
    assert [(m.candidate.name, p) for m, p in found.members] == [("torque_bias", 0.7), ("spring", 0.3)]
