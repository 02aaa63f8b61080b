"""The optimum of a problem from that of one a little different, against the interior-point method's."""

from dataclasses import replace

import numpy as np
import pytest

from sysid import held_apart, interior
from sysid.interior import minimise
from sysid.model import moving_coefficients
from sysid.nearby import from_nearby
from tests.problems import arm, leg, posed

WEIGHTS = (1e-4, 1e-2, 1.0, 1e2)


def stretches(case):
    experiment, model, motion, data, prior = case
    moving = moving_coefficients(model, motion)
    return held_apart.held_apart(experiment, model, data, moving, prior).problems


def by_interior(problem, objective):
    c = problem.coordinates
    start = c.physical(problem.start)
    return minimise(objective, c.positive, c.held, start, tolerance=1e-6)[0][-1]


@pytest.mark.parametrize("case", [leg, arm])
def test_the_optimum_without_another_stretch(case):
    first, *others = stretches(case())
    near = 0
    for weight in WEIGHTS:
        start = by_interior(first, replace(first.objective, weight=weight))
        for problem in others:
            objective, c = replace(problem.objective, weight=weight), problem.coordinates
            found = from_nearby(objective, c.positive, c.held, start, tolerance=1e-6)
            if found is None:
                continue
            near += 1
            wanted = by_interior(problem, objective)
            assert objective.value(found) <= objective.value(wanted) * (1.0 + 1e-9)
            misfit = np.linalg.norm(objective.misfit(found) - objective.misfit(wanted))
            assert misfit <= 1e-5 * np.linalg.norm(objective.misfit(wanted))
    assert near > len(WEIGHTS) * len(others) // 2


def test_a_coefficient_is_let_go_from_zero_and_held_there():
    """What had been zero in one log may be more in another, and the other way round."""
    problem = stretches(leg())[0]
    c, count = problem.coordinates, 10 * problem.objective.bodies
    k = count + int(np.flatnonzero(c.positive & ~c.held)[0])
    with_friction = by_interior(problem, problem.objective)
    column = problem.objective.triangle[:, k]

    def pushed(by):
        """The same data with as much more friction."""
        triangle = problem.objective.triangle.copy()
        triangle[:, -1] += by * column
        return replace(problem.objective, triangle=triangle)

    without = pushed(-1.5 * with_friction[k])
    at_zero = by_interior(problem, without)
    assert at_zero[k] < 1e-6 * with_friction[k]
    for objective, start in ((without, with_friction), (problem.objective, at_zero)):
        found = from_nearby(objective, c.positive, c.held, start, tolerance=1e-6)
        wanted = by_interior(problem, objective)
        assert found is not None and np.all(found[count:][c.positive] >= 0.0)
        assert objective.value(found) == pytest.approx(objective.value(wanted), rel=1e-9)
    assert found[k] == pytest.approx(with_friction[k], rel=1e-5)


def test_what_is_not_near_is_another_methods():
    """A weak prior whose optimum is a thin body, from a fat one far away."""
    problem = stretches(arm())[0]
    c = problem.coordinates
    start = c.physical(problem.start)
    start[: 10 * problem.objective.bodies] *= 1e6
    objective = replace(problem.objective, weight=1e-9)
    assert from_nearby(objective, c.positive, c.held, start, tolerance=1e-6) is None


@pytest.mark.parametrize("call", [1, 6, 9])
def test_a_step_that_is_no_number_ends_the_search_where_it_was_best(call, monkeypatch):
    """A body so thin that its metric overflows leaves no direction: what was found till then stands."""
    made, real = [], interior.changed

    def changed(*args):
        made.append(real(*args))
        one = made[-1]
        return replace(one, step=np.nan * one.step, both=np.nan * one.both) if len(made) >= call else one

    monkeypatch.setattr(interior, "changed", changed)
    _, problem = posed(leg())
    x = problem.minimum(1e-8)
    assert len(made) >= call and np.isfinite(x).all() and np.isfinite(problem.objective.value(x))
