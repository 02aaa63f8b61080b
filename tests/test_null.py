"""One null for all candidates: noise is accused as often as the level says, and what is there is seen."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from sysid import blocks
from sysid.diagnose import null
from sysid.diagnose.detectable import _size
from tests.evidences import grouped, posed, viewed

N, BLOCKS, DRAWS, LEVEL = 400, 40, 200, 0.05


def white(rng, number):
    return rng.normal(size=(N, 2))


def uneven(rng, number):
    """Blocks of very different noise: the loudest ten times the quietest."""
    return rng.normal(size=(N, 2)) * np.exp(rng.uniform(-1.15, 1.15, (number.max() + 1, 2)))[number]


def alike_in_blocks(rng, number):
    """What a block has, all its rows have."""
    return rng.normal(size=(number.max() + 1, 2))[number] + 0.3 * rng.normal(size=(N, 2))


def coloured(rng, number):
    """First-order noise that remembers a quarter of a block."""
    keep = np.exp(-4.0 * BLOCKS / N)
    return lfilter([1.0], [1.0, -keep], rng.normal(size=(N + 50, 2)), axis=0)[50:]


def problem(seed: int = 0):
    """A model, and columns that could join it: six of one direction, two of them much alike; three of two directions; slow waves
    and quick noise."""
    rng = np.random.default_rng(seed)
    p = posed(rng, n=N, blocks=BLOCKS, prior=0.1)
    t = np.arange(N) / N
    one = np.sin(2.0 * np.pi * rng.uniform(3.0, 60.0, (6, 2, 1, 1)) * t[:, None] + rng.uniform(0, 6, (6, 2, 1, 1)))
    one[1] = one[0] + 0.2 * rng.normal(size=(2, N, 1))
    return p, one, rng.normal(size=(3, 2, N, 2))


def asked(p, tau, one, two):
    p.tau = tau
    view = viewed(p)
    return grouped(view, one) + grouped(view, two)


@pytest.mark.long
@pytest.mark.parametrize("noise", [white, uneven, alike_in_blocks, coloured])
def test_noise_is_accused_as_often_as_the_level_says(noise):
    """Family-wise: whether the greatest statistic of nine groups stands above the null's quantile."""
    p, one, two = problem()
    accused, p_values = 0, []
    for seed in range(DRAWS):
        rng = np.random.default_rng(1000 + seed)
        groups = asked(p, noise(rng, p.number), one, two)
        found = null.statistics(groups)
        drawn = null.maxima(groups, rng, draws=199)
        p_values.append((1 + np.sum(drawn >= found.max())) / 200)
    accused = np.mean(np.array(p_values) <= LEVEL)
    low, high = binom.ppf([1e-3, 1.0 - 1e-3], DRAWS, LEVEL) / DRAWS
    assert low <= accused <= high, accused
    # and the whole distribution is even, but for its lower end where some blocks are far louder: there all groups are loud together
    for share in (0.25, 0.5) if noise is uneven else (0.25, 0.5, 0.75):
        low, high = binom.ppf([1e-3, 1.0 - 1e-3], DRAWS, share) / DRAWS
        assert low <= np.mean(np.array(p_values) <= share) <= high, share


@pytest.mark.parametrize("noise", [white, uneven])
def test_what_is_there_is_seen(noise):
    """An effect of five of its deviations is above the null, and the group that holds it has the greatest statistic."""
    p, one, two = problem()
    seen = best = 0
    for seed in range(40):
        rng = np.random.default_rng(2000 + seed)
        rest = noise(rng, p.number)
        own = two[1] * p.weights[:, None, None]
        size = 5.0 * np.sqrt(np.mean((rest * p.weights) ** 2) / np.sum(own**2, axis=(0, 1)).mean())
        groups = asked(p, rest + size * two[1].sum(2).T, one, two)
        found = null.statistics(groups)
        seen += found[7] > np.quantile(null.maxima(groups, rng, draws=200), 0.95)
        best += np.argmax(found) == 7
    assert seen >= 38 and best >= 38, (seen, best)


def test_an_effect_in_few_blocks_is_seen():
    """A quarter of the blocks hold it: what stands in few blocks has a smaller statistic, not none."""
    p, one, two = problem()
    rng = np.random.default_rng(0)
    acting = (p.number % 4 == 0)[:, None]
    own = np.where(acting, rng.normal(size=(N, 1)), 0.0)[None, None] * np.ones((1, 2, 1, 1))
    tau = rng.normal(size=(N, 2)) + 1.5 * own[0, :, :, 0].T
    p.tau = tau
    groups = grouped(viewed(p), np.concatenate([one, own]))
    found = null.statistics(groups)
    assert np.argmax(found) == 6 and found[6] > null.maxima(groups, rng).max()


def test_a_statistic_does_not_know_the_unit_of_torque():
    p, one, two = problem()
    tau = np.random.default_rng(1).normal(size=(N, 2))
    p.root = 0.0 * p.root
    first = null.statistics(asked(p, tau, one, two))
    np.testing.assert_allclose(null.statistics(asked(p, 1e4 * tau, one, two)), first, rtol=1e-6)


def test_more_candidates_make_the_null_higher():
    p, one, two = problem()
    groups = asked(p, np.random.default_rng(1).normal(size=(N, 2)), one, two)
    few, many = (null.maxima(own, np.random.default_rng(0)) for own in (groups[:2], groups))
    assert (many >= few - 1e-12).all() and np.quantile(many, 0.95) > np.quantile(few, 0.95) + 0.2


def test_no_candidates_no_accusation():
    assert (null.maxima([], np.random.default_rng(0), draws=7) == -np.inf).all() and null.statistics([]).shape == (0,)


def test_draws_are_noise_as_loud_as_the_blocks():
    """Coefficients whose covariance is that of the moves; a spread of the same mean, as far from it as normal blocks scatter, whatever
    the coefficients are. The effect itself is not in it: a strong one makes the null no wider."""
    p, one, two = problem()
    p.number = np.sort(np.random.default_rng(5).integers(0, 30, N))
    greatest, tops, sizes = [], [], []
    for seed in range(60):
        p.tau = np.random.default_rng(seed).normal(size=(N, 2))
        groups = grouped(viewed(p), one[2:3])
        (group,) = groups
        top, spread = (x[:, 0] for x in blocks.redrawn(group.moves[None], np.random.default_rng(2).normal(size=(2, 4000, 31))))
        size = np.sum(group.moves**2)
        assert top.mean() == pytest.approx(size, rel=0.1) and spread.mean() == pytest.approx(size, rel=0.1)
        assert np.mean(top**2) == pytest.approx(3.0 * size**2, rel=0.2)  # normal
        assert abs(np.corrcoef(top, spread)[0, 1]) < 0.06
        tops.append(size), sizes.append(spread.var())
    # what one log's blocks tell scatters over logs as a draw's does
    assert np.mean(sizes) == pytest.approx(np.var(tops), rel=0.5)
    for strength in (0.0, 30.0):
        p.tau = np.random.default_rng(1).normal(size=(N, 2)) + strength * two[0].sum(2).T
        groups = grouped(viewed(p), two[:1])
        greatest.append(null.maxima(groups, np.random.default_rng(2)))
    assert null.statistics(groups)[0] > greatest[1].max()
    np.testing.assert_allclose(*np.quantile(greatest, [0.5, 0.9, 0.99], axis=1).T, rtol=0.3)


def test_the_size_told_is_seen_nine_times_in_ten():
    """Of one group alone, worth having whatever its size: planted at the size that is told, it stands above the null."""
    p, one, _ = problem()
    seen, draws = 0, 300
    for seed in range(draws):
        rng = np.random.default_rng(5000 + seed)
        p.tau = rng.normal(size=(N, 2))
        (group,) = grouped(viewed(p), one[2:3])
        threshold = np.quantile(null.maxima([group], rng, draws=400), 0.99)
        size = _size(group, threshold, np.zeros(2), blocks.Belief())
        p.tau = rng.normal(size=(N, 2)) + size * one[2, :, :, 0].T  # another log
        (group,) = grouped(viewed(p), one[2:3])
        seen += null.statistics([group])[0] > threshold
    low, high = binom.ppf([1e-3, 1.0 - 1e-3], draws, 0.9) / draws
    assert low <= seen / draws <= high, seen / draws
