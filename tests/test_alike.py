"""Torques that are read late on many joints, by much the same."""

from types import SimpleNamespace

import pytest

from sysid.statement.alike import changed_alike, read_alike


def heads(**times) -> list:
    """A claim's head on each joint: (effect, its time [s])."""
    word = {"delay": "d", "current_lag": "T", "cogging": "a1"}
    return [SimpleNamespace(effect=e, joint=j, parameters={f"{e}.{j}.{word[e]}": (at, 1e-4, "s")}) for j, (e, at) in times.items()]


def test_one_cause_is_told_once():
    (said,) = read_alike(heads(a=("delay", -0.0101), b=("current_lag", 0.0121), c=("delay", -0.0115), d=("cogging", 0.01)))
    assert said.startswith("the torques of a, b and c are early by much the same, 10 to 12 ms")
    (said,) = read_alike(heads(a=("delay", 0.006), b=("delay", 0.0055), c=("delay", 0.0062)))
    assert "late by much the same, 5.5 to 6.2 ms" in said


def test_who_is_late_by_another_time_or_by_none_that_is_known_is_not_among_them():
    own = {joint: ("delay", 0.006) for joint in "abcd"}
    (said,) = read_alike(heads(**own, e=("delay", 0.02), f=("delay", float("nan"))))
    assert said.startswith("the torques of a, b, c and d are late")


@pytest.mark.parametrize(
    "times",
    [
        {"a": ("delay", 0.006), "b": ("delay", 0.006)},
        {"a": ("delay", 0.006), "b": ("delay", 0.006), "c": ("delay", 0.012)},
        {"a": ("delay", 0.006), "b": ("delay", 0.006), "c": ("current_lag", 0.006)},
        {"a": ("cogging", 0.006), "b": ("cogging", 0.006), "c": ("cogging", 0.006)},
    ],
)
def test_two_or_other_times_are_a_cause_each(times):
    assert not [*read_alike(heads(**times))]


def test_friction_that_changed_in_the_same_logs_is_one_cause():
    def changed(joint, *logs):
        return SimpleNamespace(effect="friction_change", joint=joint, candidate=SimpleNamespace(options=(("logs", logs),)))

    (said,) = changed_alike([changed("a", "x", "y"), changed("b", "y", "x"), changed("c", "x", "y"), changed("d", "z")])
    assert said.startswith("the friction of a, b and c is another in the same logs (x, y): one cause is likelier")
    assert not [*changed_alike([changed("a", "x"), changed("b", "x"), changed("c", "y")])]
