"""Single columns, asked all at once: each as a group of its own is, and the greatest of many as often as its chance says."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from sysid import blocks
from sysid.view import greatest
from sysid.view.singles import _Asker, _draws, _share, beyond
from tests.evidences import grouped, posed, roughened, viewed

N, BLOCKS = 400, 20


def problem(seed: int = 0):
    rng = np.random.default_rng(seed)
    p = posed(rng, n=N, blocks=BLOCKS)
    columns = rng.normal(size=(N, 6))
    columns[p.number >= 12, 4] = 0.0  # rests on twelve blocks
    columns[p.number >= 3, 5] = 0.0  # on three, and on what the model makes of it elsewhere
    return p, columns


def twice(*columns) -> np.ndarray:
    """Columns (n, k) of each log as they are asked: behind them the same with the angles' noise once more, which adds nothing."""
    return np.concatenate([own for one in columns for own in (one, one)])


def test_single_columns_are_told_as_groups_are():
    p, columns = problem()
    view = viewed(p)
    told = _Asker(view, 1, np.random.default_rng(0), 200).told_by(view.weights[1] * columns, 0.0 * columns)
    groups = [g.tested for g in grouped(view, columns.T[:, None, :, None], joints=(1,))]
    assert told.kept.tolist() == list(range(6)) and all(g.testable for g in groups)
    for k, group in enumerate(groups):
        assert told.c[0, k] ** 2 == pytest.approx(group.c @ group.c, rel=1e-9)
        assert told.seen[0, k] == pytest.approx(np.sum(group.moves**2), rel=1e-9)
        assert told.own[k] == pytest.approx(group.freedom[1] - 1.0, rel=1e-9)


def test_what_a_column_takes_is_counted_on_its_joints_own_rows():
    """With it the bodies are others, by which other joints win or lose as well: of a bending of joint 0 alone joint 1 gains nothing."""
    p, columns = problem(3)
    column = p.a[1] @ np.ones(p.a.shape[2]) + 0.2 * columns[:, 0]
    p.tau[:, 1] += 0.3 * column
    view = viewed(p)
    score, squares, *own = _Asker(view, 1, np.random.default_rng(0), 200).apart(view.weights[1] * column[:, None], 0.0 * column[:, None])
    # fold by fold: the coefficient of the other blocks, and what it takes of the joint's rows in these
    unit, turn = squares.sum(), view.design.columns[1]
    off = view.weights[1] * column - turn @ (turn.T @ (view.weights[1] * column))
    expected, fold = 0.0, blocks.folds(BLOCKS)
    for f in np.unique(fold):
        inside = np.flatnonzero(fold == f)
        size = (score.sum() - score[inside].sum()) / (unit - squares[inside].sum())
        rows = np.isin(p.number, inside)
        r = view.design.residual[rows, 1]
        expected += np.sum(r**2) - np.sum((r - size * off[rows]) ** 2)
    assert _share([(score, squares, *own)]) == pytest.approx(expected, rel=1e-6) and expected > 1.0
    assert _share([(score, squares, score, squares)]) > expected + 1e-3 * abs(expected)


def test_the_noise_of_the_angles_is_taken_off_as_of_groups():
    p, columns = problem()
    columns = columns[:, :3] + 0.3 * p.a[1][:, :3]
    p.tau[:, 1] += 0.5 * columns[:, 1]
    rng = np.random.default_rng(4)
    view, more = roughened(p, rng, 0.2), 0.2 * rng.normal(size=columns.shape)
    asker = _Asker(view, 1, np.random.default_rng(0), 200)
    told = asker.told_by(view.weights[1] * columns, view.weights[1] * more)
    sets = lambda values: values.T[:, None, :, None]  # noqa: E731
    groups = [g.tested for g in grouped(view, sets(columns), joints=(1,), rough=sets(columns + more))]
    assert told.kept.tolist() == [0, 1, 2]
    for k, group in enumerate(groups):
        assert told.c[0, k] ** 2 == pytest.approx(group.c @ group.c, rel=1e-9)
        assert told.seen[0, k] == pytest.approx(np.sum(group.moves**2), rel=1e-9)
        score, squares, *_ = asker.apart(view.weights[1] * columns[:, [k]], view.weights[1] * more[:, [k]])
        assert _share([(score, squares, score, squares)]) == pytest.approx(max(group.taken, 0.0), rel=1e-9)
    assert groups[1].taken > 5.0
    # with more of it they are not asked at all, neither as groups
    loud = asker.told_by(view.weights[1] * columns, view.weights[1] * 4.0 * more)
    assert not len(loud.kept) and not grouped(view, sets(columns), joints=(1,), rough=sets(columns + 4.0 * more))


def test_what_few_blocks_outweigh_is_told_as_the_group_is_tested():
    p, _ = problem()
    own = np.random.default_rng(3).normal(size=N) * np.where(p.number == 7, 30.0, 1.0)
    view = viewed(p)
    told = _Asker(view, 0, np.random.default_rng(0), 200).told_by(view.weights[0] * own[:, None], np.zeros((N, 1)))
    (group,) = grouped(view, own[None, None, :, None], joints=(0,))
    assert not group.testable and group.tested.testable
    assert told.seen[0, 0] == pytest.approx(np.sum(group.tested.moves**2), rel=1e-9)
    assert told.c[0, 0] ** 2 == pytest.approx(group.tested.c @ group.tested.c, rel=1e-9)


def test_draws_are_fitted_by_the_model_as_the_residual_is():
    """The model's own columns are nothing to any of them, but for what the prior holds."""
    p, _ = problem()
    p.root = 0.0 * p.root
    view = viewed(p)
    asker = _Asker(view, 1, np.random.default_rng(0), 200)
    told = asker.told_of_drawn
    assert np.abs(told[-1]).max() < 1e-3 * np.abs(told[0]).max()
    assert asker.drawn.shape == (N, 200) and np.std(asker.loss[1:]) < 0.3 * np.mean(asker.loss[1:])


def test_the_greatest_stands_out_as_often_as_its_chance_says():
    p, columns = problem()
    view, chances = viewed(p), []
    for seed in range(60):
        rng = np.random.default_rng(100 + seed)
        p.tau = rng.normal(size=(N, 2))
        view = viewed(p)
        many = rng.normal(size=(N, 80))
        found = greatest([view], 1, lambda: [([str(k) for k in range(80)], twice(many))], rng)  # noqa: B023
        chances.append(found.chance)
    # one in a thousand, each
    assert np.sum(np.array(chances) < 0.05) <= 10 and 0.25 < np.median(chances) < 0.75


def test_the_greatest_of_two_logs_stands_out_as_often_as_its_chance_says():
    chances = []
    for seed in range(60):
        rng, views = np.random.default_rng(300 + seed), []
        for first in (0, 1):
            p, _ = problem(first)
            p.tau = rng.normal(size=(N, 2))
            views.append(viewed(p))
        many = rng.normal(size=(2, N, 80))
        many[1, :, :20] = 0.0  # on the first log alone
        many[0, :, 60:] = 0.0
        found = greatest(views, 1, lambda: [([str(k) for k in range(80)], twice(*many))], rng)  # noqa: B023
        assert int(found.words) < 60  # what only the second has is not asked
        chances.append(found.chance)
    assert np.sum(np.array(chances) < 0.05) <= 10 and 0.25 < np.median(chances) < 0.75


def two_logs(first: float, second: float, visible: float = 1.0):
    """Chances of one column among 80 that acts so much on each of two logs: of the first alone, and of both. visible: the size of the
    column on the second one."""
    rng, views = np.random.default_rng(5), []
    many = rng.normal(size=(2, N, 80))
    many[1, :, 7] *= visible
    for k, size in enumerate((first, second)):
        p, _ = problem(k)
        p.tau[:, 1] += size * many[k, :, 7]
        views.append(viewed(p))
    asked = lambda *values: lambda: [([str(k) for k in range(80)], twice(*values))]  # noqa: E731
    alone = greatest(views[:1], 1, asked(many[0]), np.random.default_rng(0))
    return alone, greatest(views, 1, asked(*many), np.random.default_rng(0))


def test_what_holds_on_other_logs_as_well_stands_out_more():
    alone, both = two_logs(0.2, 0.2)
    assert both.words == "7" and both.chance < 0.01 * alone.chance
    assert both.column.shape == (4 * N,) and 0.01 < both.share < 0.08  # 0.2^2 of 1.04, less what its own doubt costs


def test_a_log_counts_by_what_it_can_say():
    """A second log on which the column hardly acts takes nothing from what the first one says."""
    alone, both = two_logs(0.3, 0.0, visible=1e-3)
    assert both.words == "7" and both.chance < 10.0 * alone.chance < 1e-3


def test_what_has_the_other_sign_on_other_logs_is_no_law():
    alone, both = two_logs(0.3, -0.3)
    assert alone.words == "7" and alone.chance < 1e-3 and (both.words != "7" or both.chance > 0.2)


def test_what_is_there_is_the_greatest_and_comes_back_whole():
    p, columns = problem()
    p.tau[:, 1] += 2.0 * columns[:, 2]
    words = list("abcdef")
    parts = lambda: iter([(words[:2], twice(columns[:, :2])), (words[2:], twice(columns[:, 2:]))])  # noqa: E731
    found = greatest([viewed(p)], 1, parts, np.random.default_rng(0))
    assert found.words == "c" and found.chance < 1e-4
    np.testing.assert_array_equal(found.column, twice(columns[:, [2]])[:, 0])


def test_a_long_log_is_asked_beside_fewer_draws(monkeypatch):
    p, columns = problem()
    monkeypatch.setattr("sysid.view.singles._MOST", 60.0 * N)
    assert _Asker(viewed(p), 1, np.random.default_rng(0), _draws(viewed(p))).drawn.shape == (N, 60)
    p.tau[:, 1] += 2.0 * columns[:, 2]
    found = greatest([viewed(p)], 1, lambda: [(list("abcdef"), twice(columns))], np.random.default_rng(0))
    assert found.words == "c" and found.chance < 1e-4


def test_nothing_to_ask_is_nothing():
    p, _ = problem()
    nothing = SimpleNamespace(**{**vars(viewed(p))})
    assert greatest([nothing], 1, lambda: [], np.random.default_rng(0)) is None
    own = p.a[1][:, :1]  # the model has it
    assert greatest([nothing], 1, lambda: [(["own"], twice(0.0 * own))], np.random.default_rng(0)) is None


@pytest.mark.parametrize("count,size", [(1, 1.0), (30, 1.0), (1000, 1.4)])
def test_beyond_the_draws_it_is_the_law_of_the_greatest(count, size):
    """Of independent normal variables; far out, where no draw was, to a factor that quartiles leave open."""
    rng = np.random.default_rng(count)
    maxima = size * rng.normal(size=(4000, count)).max(axis=1)
    for share in (0.1, 0.01, 1e-4):
        at = size * norm.isf(-np.expm1(np.log1p(-share) / count))
        assert 0.3 < beyond(at, maxima) / share < 3.0, share


@pytest.mark.parametrize("value", [-1e3, -40.0, 0.0, 3.0, 40.0])
def test_how_far_out_a_value_stands_is_told_of_any(value):
    """One below all that noise makes stands out no less than noise does; one above stands out the more, the higher."""
    maxima = np.abs(np.random.default_rng(4).normal(size=(500, 50))).max(axis=1)
    seen = beyond(value, maxima)
    assert 0.0 <= seen <= 1.0
    assert seen == pytest.approx(np.mean(maxima > value), abs=0.05)
