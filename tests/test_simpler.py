"""A law of which a number is nothing beside its deviation may be a simpler one."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import comparison, simpler, vocabulary
from sysid.candidates import Candidate
from sysid.comparison import Difference
from sysid.diagnose.ties import Choice
from sysid.simpler import with_simpler

SPRING = {"k": (0.014, 0.011, "N m/rad"), "c": (0.45, 0.005, "N m")}
STIFF = SPRING | {"k": (0.14, 0.011, "N m/rad")}
HELD = ("torque_bias", "asymmetric_coulomb")  # what a spring's columns hold


def member(name: str, lost: float) -> SimpleNamespace:
    return SimpleNamespace(candidate=Candidate(vocabulary.find(name), 0, ()), losses=np.full((4, 1), lost / 4))


def fit(name: str, **parameters) -> SimpleNamespace:
    return SimpleNamespace(name=name, parameters_of=lambda *_: parameters)


def choice_of(*beaten, members=()) -> Choice:
    """A spring that takes 80 of 100 units of loss, alone or beside others."""
    head = member("spring", 20.0)
    alone = 1.0 - sum(p for _, p in members)
    return Choice(head, ((head, alone), *members), np.full(4, 20.0), tuple(beaten), np.array([0.8]))


def asked(monkeypatch, choice, parameters=SPRING, risen=0.0, doubted=(), may=lambda one: True):
    """The choice with what is simpler, and which effects were fitted; risen: by how many standard errors the test error of a simpler fit is
    above that of the spring's; doubted: which effects no fit bears out."""
    size = {"spring": 1.0, **dict.fromkeys(HELD, 1.0 + 0.01 * risen)}
    monkeypatch.setattr(comparison, "together", lambda a, b: Difference("a", "b", "*", size[b.name] - size[a.name], 0.01))
    monkeypatch.setattr(simpler, "holds", lambda view, general, special: special.candidate.name in HELD)
    fitted = []

    def borne_out(near, last, with_):
        (one,) = near
        fitted.append(one.candidate.name)
        told = {id(one): fit(one.candidate.name, b=(0.45, 0.005, "N m"))}
        return (None if one.candidate.name in doubted else one), told, {}

    monkeypatch.setattr(simpler, "first_borne_out", borne_out)
    fits = {id(choice.head): fit("spring", **parameters)}
    found = with_simpler(choice, None, fit("before"), fits, None, may)
    assert id(found.head) in fits and sum(p for _, p in found.members) == pytest.approx(1.0)
    assert any(one is found.head for one, _ in found.members)
    return found, fitted


def test_an_offset_is_no_spring_of_no_stiffness(monkeypatch):
    choice = choice_of(member("torque_bias", 20.3), member("asymmetric_coulomb", 20.3), member("cable", 20.0))
    found, fitted = asked(monkeypatch, choice)
    assert fitted == ["torque_bias", "asymmetric_coulomb"]
    assert found.head.candidate.name == "torque_bias"
    assert [(m.candidate.name, p) for m, p in found.members] == [(name, pytest.approx(1 / 3)) for name in ("torque_bias", "asymmetric_coulomb", "spring")]
    assert [m.candidate.name for m in found.beaten] == ["cable"]
    assert found.gain.sum() == pytest.approx(79.7)  # what its head takes


@pytest.mark.parametrize(
    ("how", "fitted"),
    [
        ({"parameters": STIFF}, []),  # its numbers are told
        ({"risen": 1.5}, ["torque_bias"]),  # the simpler one leaves more of the test logs
        ({"doubted": ("torque_bias",)}, ["torque_bias"]),
        ({"may": lambda one: one.candidate.name != "torque_bias"}, []),  # refused before, or in the model already
    ],
)
def test_else_the_claim_stands(monkeypatch, how, fitted):
    choice = choice_of(member("torque_bias", 20.3))
    found, told = asked(monkeypatch, choice, **how)
    assert found is choice and told == fitted


def test_what_took_much_less_is_not_asked(monkeypatch):
    choice = choice_of(member("torque_bias", 40.0))
    found, fitted = asked(monkeypatch, choice)
    assert found is choice and fitted == []


def test_a_number_without_a_deviation_is_no_idle_one(monkeypatch):
    found, fitted = asked(monkeypatch, choice_of(member("torque_bias", 20.3)), {"k": (0.0, float("nan"), ""), "c": (0.45, 0.005, "")})
    assert found.head.candidate.name == "spring" and fitted == []


def test_a_member_of_the_set_keeps_its_probability_where_that_is_more(monkeypatch):
    tied = member("torque_bias", 20.1)
    found, _ = asked(monkeypatch, choice_of(members=[(tied, 0.7)]))
    assert found.head is tied
    assert [(m.candidate.name, pytest.approx(p)) for m, p in found.members] == [("torque_bias", 0.7), ("spring", 0.3)]
