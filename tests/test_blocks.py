"""Blocks of time: equal within a piece and never across two, and standard errors, signs and sets in closed form."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import expit
from scipy.stats import binom, norm
from scipy.stats import t as student

from sysid import blocks

# ---- which rows stand together


@pytest.mark.parametrize("seconds", [(30.0,), (7.0, 11.0), (2.0, 60.0, 0.4), (100.0,)])
@pytest.mark.parametrize("memory", [0.0, 0.4])
def test_blocks_are_equal_within_a_piece_and_none_crosses_two(seconds, memory):
    step = 0.01
    t = np.concatenate([100.0 * k + np.arange(0.0, span, step) for k, span in enumerate(seconds)])
    piece = np.concatenate([np.full(len(np.arange(0.0, s, step)), 3 * k) for k, s in enumerate(seconds)])
    number = blocks.numbered(t, piece, memory=memory)
    assert (np.diff(number) >= 0).all() and set(np.diff(number)) <= {0, 1} and number[0] == 0
    spans = []
    for b in range(number.max() + 1):
        own = number == b
        assert len(set(piece[own])) == 1
        spans.append((piece[own][0], own.sum()))
    for p in set(piece):
        sizes = [n for where, n in spans if where == p]
        assert max(sizes) - min(sizes) <= 2  # rows: one at either end
    assert len(spans) >= blocks.FEWEST
    # as many as the longest of: a sixtieth of the log, half a second, four memories; one more a piece by rounding
    length = max(sum(seconds) / blocks.MOST, blocks.SHORTEST, 4.0 * memory)
    assert len(spans) == pytest.approx(sum(seconds) / length, abs=len(seconds))


def test_a_short_log_has_enough_blocks_all_the_same():
    t = np.arange(300) / 100.0
    assert blocks.numbered(t, np.zeros(300, int), memory=2.0).max() + 1 == blocks.FEWEST
    assert blocks.numbered(t, np.zeros(300, int), shortest=np.inf, fewest=5).max() + 1 == 5


def test_a_pause_between_samples_counts_as_time():
    """Rows that stand near each other in number but not in time do not share a block."""
    t = np.concatenate([np.arange(500) / 100.0, 20.0 + np.arange(500) / 100.0])
    number = blocks.numbered(t, np.zeros(1000, int))
    assert not set(number[:500]) & set(number[500:])


# ---- how long a noise remembers


def coloured(rng, n: int, slow: float, step: float, k: int = 1):
    """(n, k) first-order noise of unit variance and correlation time `slow` [s]."""
    keep = np.exp(-step / slow)
    out = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.normal(size=(n + 2000, k)), axis=0)
    return out[2000:]


@pytest.mark.parametrize("slow", [0.03, 0.1, 0.3])
def test_memory_is_the_correlation_time(slow):
    step, n = 0.01, 200_000
    x = coloured(np.random.default_rng(0), n, slow, step)
    keep = np.exp(-step / slow)
    powers = keep ** np.arange(1, 2000)
    told = step * (0.5 + powers[powers >= 0.1].sum())  # what the autocorrelation sums to until it has gone
    every = np.ones((n, 1), bool)
    assert blocks.memory(x, every, np.zeros(n, int), step) == pytest.approx(told, rel=0.05)
    assert told == pytest.approx(0.9 * slow, rel=0.1)


def test_white_noise_remembers_nothing():
    x = np.random.default_rng(1).normal(size=(50_000, 2))
    assert blocks.memory(x, np.ones(x.shape, bool), np.zeros(len(x), int), 0.01) == pytest.approx(0.005)


def test_the_longest_memory_counts():
    rng = np.random.default_rng(2)
    x = np.hstack([coloured(rng, 50_000, slow, 0.01) for slow in (0.02, 0.2)])
    use, piece = np.ones(x.shape, bool), np.zeros(len(x), int)
    whole = blocks.memory(x, use, piece, 0.01)
    assert whole == blocks.memory(x[:, 1:], use[:, 1:], piece, 0.01) > 3 * blocks.memory(x[:, :1], use[:, :1], piece, 0.01)


def test_rows_left_out_do_not_matter():
    rng = np.random.default_rng(3)
    x = coloured(rng, 100_000, 0.1, 0.01)
    use = (np.arange(len(x)) // 70 % 3 > 0)[:, None]
    piece = np.zeros(len(x), int)
    spoilt = np.where(use, x, 1e6)
    found = blocks.memory(spoilt, use, piece, 0.01)
    assert found == blocks.memory(np.where(use, x, 0.0), use, piece, 0.01)
    assert found == pytest.approx(blocks.memory(x, np.ones_like(use), piece, 0.01), rel=0.1)
    assert blocks.memory(x, np.zeros_like(use), piece, 0.01) == 0.0


def test_nothing_is_remembered_from_one_piece_to_the_next():
    """Pieces that begin anew: alike within, and whatever stands behind each other in the table does not count."""
    rng = np.random.default_rng(4)
    rows = np.repeat(rng.normal(size=(2000, 1)), 5, axis=0)  # five equal rows a piece
    piece = np.repeat(np.arange(2000), 5)
    found = blocks.memory(rows, np.ones(rows.shape, bool), piece, 0.01)
    assert found == pytest.approx(0.01 * (0.5 + 4.0), rel=1e-6)  # equal to the end of the piece, and no further


# ---- sums and their deviations


def test_sums_by_block_are_sums_by_block():
    rng = np.random.default_rng(0)
    number, values = rng.integers(0, 6, 100), rng.normal(size=(100, 2, 3))
    found = blocks.summed(number, values, 8)
    for b in range(8):
        np.testing.assert_allclose(found[b], values[number == b].sum(0), atol=1e-12)
    assert blocks.summed(number, np.zeros((100, 0))).shape == (number.max() + 1, 0)


def test_folds_are_neighbours():
    np.testing.assert_array_equal(blocks.folds(7), np.arange(7))
    found = blocks.folds(43)
    assert set(found) == set(range(10)) and (np.diff(found) >= 0).all() and set(np.bincount(found)) == {4, 5}


def test_standard_errors_in_closed_form():
    x = np.array([3.0, -1.0, 4.0, 1.0, -5.0])
    assert blocks.standard_error(x) == pytest.approx(np.sqrt(5) * np.std(x, ddof=1))
    assert np.isnan(blocks.standard_error([1.0]))
    # the jackknife of a mean is its standard error
    without = (x.sum() - x) / 4
    assert blocks.jackknife(without) == pytest.approx(np.std(x, ddof=1) / np.sqrt(5))
    both = blocks.jackknife(np.stack([without, 2.0 * without], axis=1))
    np.testing.assert_allclose(both, [blocks.jackknife(without), 2.0 * blocks.jackknife(without)])


def test_how_far_a_sum_stands_away():
    assert blocks.z_score([1.0, 2.0]) == 0.0 and blocks.z_score(np.zeros(20)) == 0.0
    few = np.array([1.0, 1.1, 0.9, 1.0, 1.05])
    assert blocks.z_score(few) == pytest.approx(5.05 / np.sqrt(5 * np.var(few, ddof=1)))
    # neighbours are counted together: what alternates cancels, and a repeated block is not two
    many = np.random.default_rng(0).normal(1.0, 1.0, 12)
    pairs = many.reshape(-1, 2).sum(1)
    assert blocks.z_score(many) == pytest.approx(pairs.sum() / np.sqrt(6 * np.var(pairs, ddof=1)))
    assert blocks.z_score(np.repeat(many, 2)) == pytest.approx(many.sum() / np.sqrt(12 * np.var(many, ddof=1)))


def test_sums_of_nothing_seldom_stand_away():
    rng = np.random.default_rng(5)
    x = coloured(rng, 3000, 0.1, 0.01, k=1500)
    number = blocks.numbered(np.arange(3000) * 0.01, np.zeros(3000, int), memory=0.1)
    sums = blocks.summed(number, x)
    far = np.array([blocks.z_score(own) for own in sums.T])
    for level in (1.645, 2.33):
        low, high = binom.ppf([1e-3, 1 - 1e-3], 1500, student.sf(level, number.max() // 2)) / 1500
        assert low <= np.mean(far > level) <= high
    assert abs(np.median(far)) < 0.1


# ---- the confidence set


def test_the_best_is_always_inside_and_a_worse_one_is_not():
    for seed in range(30):
        rng = np.random.default_rng(seed)
        losses = rng.normal(size=(24, 5)) + rng.normal(size=(24, 1)) * 10.0  # what all lose alike says nothing
        losses[:, 3] += 5.0
        p = blocks.confidence_set(losses, np.random.default_rng(0))
        assert p[np.argmin(losses.sum(0))] == 1.0 and p[3] < 0.01
        assert ((p >= 0) & (p <= 1)).all()


@pytest.mark.parametrize("far", [0.5, 1.3, 2.0, 3.0])
def test_of_two_models_p_is_that_of_a_two_sided_test(far):
    """By hand: with two models the range statistic is |mean of the difference| / its deviation."""
    rng = np.random.default_rng(1)
    n = 60
    d = rng.normal(size=n)
    d = (d - d.mean()) / d.std() + far / np.sqrt(n)  # stands `far` standard errors from zero
    common = rng.normal(size=n) * 5.0
    p = blocks.confidence_set(np.stack([common, common + d], axis=1), np.random.default_rng(2), draws=20_000)
    assert p[0] == 1.0
    assert p[1] == pytest.approx(2.0 * norm.sf(far), abs=0.015)


def test_p_values_grow_towards_the_best():
    """A model that goes later has no smaller p than one that went before it."""
    rng = np.random.default_rng(3)
    losses = rng.normal(size=(30, 6)) + 0.4 * np.arange(6)
    p = blocks.confidence_set(losses, np.random.default_rng(0))
    assert (np.diff(p) <= 1e-12).all() or np.argsort(p)[-1] == np.argmin(losses.sum(0))
    assert p[0] == 1.0 and p[5] < 0.05


def test_what_differs_by_rounding_is_the_same():
    """A bias and friction of another size each way are one column: refitted, they differ by rounding, always on the same side."""
    rng = np.random.default_rng(5)
    first = rng.gamma(2.0, size=24)
    losses = np.stack([first, first * (1.0 + 1e-13), first + 0.5 + rng.normal(size=24) * 0.1, first * (1.0 + 1e-13)], axis=1)
    p = blocks.confidence_set(losses, np.random.default_rng(0))
    np.testing.assert_array_equal(p[[0, 1, 3]], 1.0)
    assert p[2] < 0.01
    # a difference that is small but no rounding counts
    assert blocks.confidence_set(losses[:, [0, 2]] * [1.0, 1.0] + [1e3, 1e3], np.random.default_rng(0))[1] < 0.01
    np.testing.assert_allclose(blocks.chances(losses, rng, 0.1), [1 / 3, 1 / 3, 0.0, 1 / 3], atol=1e-9)


def test_the_set_holds_the_truth_nine_times_in_ten():
    """Two models that are equally good, one of them the truth, and one that is worse."""
    held, worse, draws = 0, 0, 200
    for seed in range(draws):
        rng = np.random.default_rng(1000 + seed)
        losses = rng.gamma(2.0, size=(30, 1)) * 3.0 + rng.normal(size=(30, 3)) * rng.gamma(1.5, size=(30, 1))
        losses[:, 2] += 4.0
        p = blocks.confidence_set(losses, rng, draws=400)
        held, worse = held + (p[0] >= 0.10), worse + (p[2] >= 0.10)
    assert held >= binom.ppf(1e-3, draws, 0.90), held
    assert held < draws  # it is a test that says no
    assert worse <= 0.02 * draws


def test_coefficients_that_one_block_holds_move_without_bound():
    """Where a block left out leaves nothing, whatever it says is nothing beside how far it moves that."""
    rng = np.random.default_rng(3)
    squares = np.zeros((6, 2, 2))
    squares[2, 0, 0] = 1.0  # of the first direction
    squares[:, 1, 1] = rng.dirichlet(np.full(6, 5.0))
    scores = rng.normal(size=(6, 2)) * np.sqrt(np.einsum("bkk->bk", squares))
    c = scores.sum(0)
    noisy = scores + rng.normal(size=scores.shape) * 1e-3
    found = blocks.moves(c, noisy, squares, squares)
    assert np.isfinite(found).all() and np.abs(found[2, 0]) > 1e3 * np.abs(c[0])
    for b in range(6):  # the other direction as ever
        assert found[b, 1] == pytest.approx((noisy[b, 1] - squares[b, 1, 1] * c[1]) / (1.0 - squares[b, 1, 1]), rel=1e-6)


def test_chances_are_shares_of_one():
    rng = np.random.default_rng(0)
    losses = rng.normal(size=(25, 4))
    found = blocks.chances(losses, rng, 0.5)
    assert found.shape == (4,) and found.sum() == pytest.approx(1.0) and (found >= 0).all()
    losses[:, 2] -= 50.0
    np.testing.assert_allclose(blocks.chances(losses, rng, 0.5), [0.0, 0.0, 1.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("unit", [1e-6, 2.0, 30.0])
@pytest.mark.parametrize("far", [0.0, 0.7, 1.5])
def test_chances_of_two_in_closed_form(far, unit):
    """The sum under random weights is normal about the sum, and the odds are those of normal noise. Where all blocks say the same, and
    little, neither of two is sure."""
    rng = np.random.default_rng(4)
    n = 60
    d = rng.normal(size=n)
    d = (d - d.mean()) / d.std() + far / np.sqrt(n + 1)
    found = blocks.chances(np.stack([np.zeros(n), d], axis=1), rng, unit, draws=20_000)
    told = n / np.sqrt(n + 1) * (far + np.linspace(-6.0, 6.0, 4001))
    density = norm.pdf(np.linspace(-6.0, 6.0, 4001)) * 12.0 / 4000
    assert found[0] == pytest.approx(density @ expit(told / (2.0 * unit)), abs=0.015)
    assert found[0] == pytest.approx(norm.cdf(far), abs=0.015) or unit > 1e-6
    alike = blocks.chances(np.stack([np.zeros(n), np.full(n, 2.0 / n)], axis=1), rng, 1.0)
    np.testing.assert_allclose(alike[1] / alike[0], np.exp(-1.0))


def test_slopes_of_noise_are_as_likely_as_they_are_told():
    """Something told beforehand, uneven over the blocks, against noise of some colour; and a slope that is there."""
    rng = np.random.default_rng(6)
    n, draws = 3000, 1000
    t = np.arange(n) * 0.01
    told = np.sin(2.0 * np.pi * 0.37 * t) * (1.0 + (np.sin(0.9 * t) > 0.3))
    noise = coloured(rng, n, 0.05, 0.01, k=draws)
    number = blocks.numbered(t, np.zeros(n, int), memory=0.05)
    p = np.array([blocks.slope_chance(told, own, number) for own in noise.T])
    for share in (0.01, 0.05, 0.25, 0.75):
        low, high = binom.ppf([1e-3, 1.0 - 1e-3], draws, share) / draws
        assert low <= np.mean(p <= share) <= high, (share, np.mean(p <= share))
    assert blocks.slope_chance(told, noise[:, 0] + told, number) < 1e-6 < 0.999 < blocks.slope_chance(told, noise[:, 0] - told, number)
    assert blocks.slope_chance(0.0 * told, noise[:, 0], number) == 1.0


def test_blocks_that_tell_each_other_are_half_as_sure():
    """Noise, each fold predicted from all others by a function that fits anything: what two folds share counts in both."""
    rng = np.random.default_rng(8)
    folds, long, draws = 20, 40, 1000
    number = np.repeat(np.arange(folds), long)
    x = rng.normal(size=(folds * long, 60))
    surer, p = np.zeros(draws), np.zeros(draws)
    for k in range(draws):
        y = rng.normal(size=len(x))
        told = np.concatenate([x[number == f] @ (x[number != f].T @ y[number != f]) for f in range(folds)])
        surer[k] = blocks.slope_chance(told, y, number)
        p[k] = blocks.slope_chance(told, y, number, mutual=True)
    for share in (0.01, 0.05, 0.25):
        most = binom.ppf(0.999, draws, share) / draws
        assert 0.2 * share < np.mean(p <= share) <= most
    assert np.mean(surer <= 0.01) > 0.02  # as if they were told beforehand


# ---- spreads that are foreseen


def told(rng, sums: int, own, d0: float, scale: float = 1.7):
    """Sums of variance scale f d0 / chi2(d0), and what blocks with `own` degrees of freedom tell of them."""
    foreseen = np.exp(rng.uniform(-3.0, 3.0, sums))
    true = scale * foreseen * (d0 / rng.chisquare(d0, sums) if np.isfinite(d0) else 1.0)
    return true * rng.chisquare(own, sums) / own, foreseen, np.full(sums, float(own)), true


@pytest.mark.parametrize("d0", [3.0, 10.0, 40.0])
def test_how_far_what_is_foreseen_is_right_is_read_off_all_sums(d0):
    rng = np.random.default_rng(3)
    seen, foreseen, own, _ = told(rng, 20_000, 8, d0)
    belief = blocks.believed(seen, foreseen, own)
    assert belief.scale == pytest.approx(1.7, rel=0.05) and belief.freedom == pytest.approx(d0, rel=0.25)


def test_noise_of_one_size_is_believed_as_far_as_anything():
    belief = blocks.believed(*told(np.random.default_rng(4), 20_000, 8, np.inf)[:3])
    assert belief.freedom > 50.0
    assert blocks.believed(np.ones(5), np.ones(5), np.ones(5)) == blocks.Belief()  # five say nothing


@pytest.mark.parametrize("own", [3, 6])
def test_few_blocks_with_what_is_foreseen_hold_the_level_and_see_more(own):
    """Of sums with nothing in them one in a hundred passes Student's t at 1 %, and of sums of four deviations more than blocks alone see."""
    rng = np.random.default_rng(5)
    seen, foreseen, own, true = told(rng, 40_000, own, 12.0)
    belief = blocks.believed(seen, foreseen, own)
    spread, freedom = belief.moderated(seen, foreseen, own)
    passed = lambda c, v, d: np.mean(2.0 * student.sf(np.abs(c) / np.sqrt(v), d) < 0.01)  # noqa: E731
    nothing = rng.normal(size=len(true)) * np.sqrt(true)
    # a little less, as what blocks tell to be loud is believed
    assert 0.004 < passed(nothing, spread, freedom) < 0.012
    there = nothing + 4.0 * np.sqrt(true)
    assert passed(there, spread, freedom) > passed(there, seen, own) + 0.1


def test_where_noise_is_louder_blocks_speak_for_themselves():
    rng = np.random.default_rng(6)
    seen, foreseen, own, _ = told(rng, 2000, 8, 30.0)
    seen[:100] *= 100.0
    belief = blocks.believed(seen, foreseen, own)
    spread, freedom = belief.moderated(seen, foreseen, own)
    np.testing.assert_allclose(spread[:100], seen[:100], rtol=0.02)
    np.testing.assert_allclose(freedom[:100], own[:100], rtol=0.02)
    drawn = rng.chisquare(8, (50, 2000))  # draws keep what they weigh
    again, same = belief.moderated(seen, foreseen, own, drawn)
    np.testing.assert_allclose(same, freedom)
    np.testing.assert_allclose(again[:, 0], drawn[:, 0], rtol=0.02)
    assert blocks.Belief().moderated(seen, foreseen, own)[0] is seen


@pytest.mark.parametrize("freedom", [0.7, 8.0, 90.0])
def test_many_draws_are_moderated_as_each_alone_is(freedom):
    """By a table of the F distribution, as near as makes no difference to a deviation."""
    rng = np.random.default_rng(7)
    own, foreseen = rng.uniform(1.0, 30.0, 40), rng.uniform(0.5, 2.0, 40)
    seen = foreseen * rng.f(own, 6.0, (300, 40)) * np.geomspace(0.01, 100.0, 300)[:, None]
    belief = blocks.Belief(1.2, freedom)
    spread, told = belief.moderated(seen, foreseen, own)
    each = [belief.moderated(row, foreseen, own) for row in seen]
    np.testing.assert_allclose(told, [d for _, d in each], atol=0.03 * freedom)
    np.testing.assert_allclose(spread, [v for v, _ in each], rtol=0.1)
