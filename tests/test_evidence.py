"""One statistic for every candidate: its sums are exact least squares with the prior, and refits without blocks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import f as fisher
from scipy.stats import norm
from scipy.stats import t as student

from sysid import blocks, candidate_columns, config, listed_effects, regressor, vocabulary
from sysid.candidate_columns import columns_of
from sysid.candidates import Candidate, candidates
from sysid.diagnose import null, projected
from sysid.log import Log, Segment
from sysid.lowpass import lowpassed, on_same_rows, stride_of
from sysid.projection import told
from sysid.view import looked_at
from tests.evidences import grouped, posed, stacked, viewed
from tests.problems import fourier_motion


def gain(group) -> np.ndarray:
    """(folds,) what a group takes of each that it was not fitted on."""
    return blocks.gains(group.c, group.scores, group.squares)


def made(seed: int, k: int = 2, joints=(0, 1)):
    """A problem, its view, columns that are partly the model's own, and their group."""
    rng = np.random.default_rng(seed)
    p = posed(rng)
    own = rng.normal(size=(len(joints), p.a.shape[1], k)) + p.a[list(joints)][:, :, :k]
    view = viewed(p)
    (group,) = grouped(view, own[None], joints)
    return p, view, own, group


def directions(p, view, own, joints, back) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal columns by hand: weighted rows of all joints, the prior's last; and the block of each, -1 of the prior's."""
    k = own.shape[2]
    m, _ = stacked(p, own, joints)
    base, more = m[:, :-k], m[:, -k:]
    q = (more - base @ np.linalg.lstsq(base, more, rcond=None)[0]) @ back
    return q, np.concatenate([np.tile(p.number, p.a.shape[0]), np.full(len(p.root), -1)])


@pytest.mark.parametrize("joints", [(0, 1), (0,), (1,)])
@pytest.mark.parametrize("seed", range(3))
def test_coefficients_are_least_squares_with_the_prior(seed, joints):
    p, view, own, group = made(seed, joints=joints)
    m, y = stacked(p, own, joints)
    best = np.linalg.lstsq(m, y, rcond=None)[0]
    np.testing.assert_allclose(group.coefficients, best[-2:], rtol=1e-8, atol=1e-10)
    before, after = (np.sum((m @ x - y) ** 2) for x in (np.append(view.x, [0, 0]), best))
    assert group.c @ group.c == pytest.approx(before - after, rel=1e-8)
    # what the model leaves of each own column
    base = m[:, :-2]
    for i in range(2):
        column = m[:, -2 + i]
        rest = column - base @ np.linalg.lstsq(base, column, rcond=None)[0]
        assert group.sizes[i] == pytest.approx(np.linalg.norm(rest), rel=1e-8)


@pytest.mark.parametrize("joints", [(0, 1), (1,)])
def test_groups_are_orthonormal(joints):
    p, view, own, group = made(3, joints=joints)
    q, number = directions(p, view, own, joints, group.back)
    np.testing.assert_allclose(q.T @ q, np.eye(2), atol=1e-10)
    for b in range(p.number.max() + 1):
        np.testing.assert_allclose(group.squares[b], q[number == b].T @ q[number == b], atol=1e-10)
    prior = q[number == -1].T @ q[number == -1]
    assert 1e-4 < np.trace(prior) < 1.0  # the prior is a block of its own
    np.testing.assert_allclose(group.squares[-1], prior, atol=1e-10)
    np.testing.assert_allclose(group.squares.sum(0), np.eye(2), atol=1e-10)


def left_out_refits(p, view, own, joints, group, number_of):
    """Coefficients of the orthonormal columns fitted without each number, what the model had absorbed being theirs."""
    q, number = directions(p, view, own, joints, group.back)
    m, y = stacked(p, own, joints)
    rest = y - m[:, :-2] @ view.x
    own_number = np.where(number >= 0, number_of[np.maximum(number, 0)], -1)
    out = []
    for b in range(number_of.max() + 1):
        keep = own_number != b
        out.append((np.linalg.lstsq(q[keep], rest[keep], rcond=None)[0], q[~keep], rest[~keep]))
    return out


@pytest.mark.parametrize("joints", [(0, 1), (0,)])
def test_moves_are_refits_without_a_block_of_noise_as_loud_as_it_was(joints):
    """Refits of the candidate without a block, whose rows are first rid of what the model's own fit took of their noise."""
    p, view, own, group = made(4, joints=joints)
    q, number = directions(p, view, own, joints, group.back)
    m, y = stacked(p, own, joints)
    base = m[:, :-2]
    left = y - base @ view.x - q @ group.c
    for b, move in enumerate(group.moves):
        rows = number == (b if b < len(group.moves) - 1 else -1)
        taken = base[rows] @ np.linalg.inv(base.T @ base) @ base[rows].T
        values, vectors = np.linalg.eigh(np.eye(len(taken)) - taken)
        loud = (vectors / np.sqrt(values)) @ vectors.T @ left[rows]
        expected = np.linalg.solve(np.eye(2) - q[rows].T @ q[rows], q[rows].T @ loud)
        np.testing.assert_allclose(move, expected, rtol=1e-6, atol=1e-9)


def test_moves_add_up_to_the_variance_of_the_coefficients():
    """White noise alone: the mean of their squares is one, however much of the noise the model's own columns take."""
    p = posed(np.random.default_rng(8), prior=0.0)
    own, told = np.random.default_rng(9).normal(size=(2, 240, 1)), []
    for seed in range(400):
        p.tau = np.random.default_rng(seed).normal(size=p.tau.shape) / p.weights
        (group,) = grouped(viewed(p), own[None])
        told.append([group.c @ group.c, np.sum(group.moves**2)])
    size, moves = np.mean(told, axis=0)
    assert size == pytest.approx(1.0, abs=0.25)
    # a block held apart from the candidate's own direction is a little louder than it was
    assert moves == pytest.approx(1.0, abs=0.1)


def test_gain_is_what_refits_take_of_the_fold_they_did_not_see():
    p, view, own, group = made(5)
    refits = left_out_refits(p, view, own, (0, 1), group, blocks.folds(20))
    told = [np.sum(r**2) - np.sum((r - q @ c) ** 2) for c, q, r in refits]
    np.testing.assert_allclose(gain(group), told, rtol=1e-7, atol=1e-8)


def test_what_the_model_has_already_makes_no_group():
    rng = np.random.default_rng(6)
    p = posed(rng, prior=0.0)
    view = viewed(p)
    mix = p.a @ rng.normal(size=(5, 2))
    assert grouped(view, mix[None]) == []
    assert grouped(view, np.zeros((1, 2, 240, 2))) == []
    # one new direction beside one that is there: one direction, whose coefficient is found all the same
    new = rng.normal(size=(2, 240, 1))
    (group,) = grouped(view, np.concatenate([mix[:, :, :1], new], axis=2)[None])
    assert group.squares.shape[1:] == (1, 1)
    m, y = stacked(p, new)
    # of the two own columns the new one alone is determined, up to what the old one shares with the model
    assert group.c @ group.c == pytest.approx(
        np.sum((m[:, :-1] @ view.x - y) ** 2) - np.sum((m @ np.linalg.lstsq(m, y, rcond=None)[0] - y) ** 2)
    )


def test_what_only_the_prior_tells_makes_no_group():
    """Columns that the model could absorb but for the prior, which holds it: the data do not tell of them."""
    rng = np.random.default_rng(7)
    p = posed(rng)
    p.root = 1e4 * np.eye(5)
    view = viewed(p)
    assert len(grouped(view, p.a[None, :, :, :1] + 0.1 * rng.normal(size=(1, 2, 240, 1)))) == 1
    p.root = 3.0 * np.eye(5)  # little beside 480 rows: what is left of a column is the prior's
    assert grouped(viewed(p), p.a[None, :, :, :1] + 0.02 * rng.normal(size=(1, 2, 240, 1))) == []


def test_columns_that_are_mostly_noise_make_no_group():
    rng = np.random.default_rng(8)
    p = posed(rng)
    view = viewed(p)
    own = rng.normal(size=(1, 2, 240, 1))
    candidate = Candidate(vocabulary.find("delay"), -1, ())  # what is read late
    group = lambda share, own=own: projected.made(view, [(candidate, {})], [0, 1], own, own + share * rng.normal(size=own.shape))  # noqa: E731
    assert len(group(0.3)) == 1 and group(0.8) == []
    # what is as slow as the motion is asked, where noise is a small part of that
    slow = np.sin(2.0 * np.pi * 0.7 * 0.02 * np.arange(240) + np.array([0.0, 1.0])[:, None])[None, :, :, None]
    (plain,), (told,) = group(0.1, slow), group(0.8, slow)
    assert told.slow and not plain.slow
    assert told.coefficients == pytest.approx(plain.coefficients, abs=0.5 * np.sqrt(plain.variance) * np.linalg.norm(plain.back))


def test_a_scale_of_the_columns_changes_coefficients_alone():
    p, view, own, group = made(9)
    (other,) = grouped(view, 1e5 * own[None])
    np.testing.assert_allclose(other.coefficients, 1e-5 * group.coefficients, rtol=1e-6)
    np.testing.assert_allclose(gain(other), gain(group), rtol=1e-6)
    np.testing.assert_allclose(null.statistics([other]), null.statistics([group]), rtol=1e-6)


def test_what_rests_on_few_blocks_is_told_by_the_others():
    """Noise in two blocks is no evidence, however large."""
    rng = np.random.default_rng(10)
    p = posed(rng)
    for count, seen in ((2, False), (15, True)):
        own = rng.normal(size=(1, 2, 240, 1)) * (p.number < count)[None, None, :, None]
        (group,) = grouped(viewed(p), own)
        assert group.testable is seen and blocks.resting(group.squares) == pytest.approx(count, rel=0.15)
        assert null.statistics([group])[0] < 3.0
        share = np.einsum("bkk->b", group.tested.squares)
        assert share.max() <= 0.2 * share.sum() and (group.tested is group) is seen


# ---- the scale of a normal variable


@pytest.mark.parametrize("d1", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("d2", [8.0, 20.0, 60.0])
def test_normal_scores_are_normal_quantiles_of_f_ratios(d1, d2):
    for p in (0.2, 0.05, 0.01, 1e-3, 1e-4):
        ratio = fisher.isf(p, d1, d2)
        assert blocks.normal_scores(ratio, d1, d2) == pytest.approx(norm.isf(p), rel=0.05), p
    grid = blocks.normal_scores(np.linspace(0.0, 50.0, 500), d1, d2)
    assert (np.diff(grid) > 0).all()


@pytest.mark.parametrize("d1", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("d2", [3.0, 8.0, 60.0])
def test_a_ratio_is_found_at_its_normal_score(d1, d2):
    for score in (0.0, 0.7, 2.0, 2.6):
        assert blocks.normal_scores(blocks.ratio_at(score, d1, d2), d1, d2) == pytest.approx(score, abs=1e-6)
    most = blocks.normal_scores(1e15, d1, d2)
    assert blocks.ratio_at(1.01 * most, d1, d2) == np.inf
    assert blocks.ratio_at(-3.0, d1, d2) == blocks.ratio_at(0.0, d1, d2)
    assert blocks.ratio_at(np.inf, d1, d2) == np.inf


# ---- the noise of the angles


SECONDS, RATE, ANGLE, NOISE = 12.0, 250.0, 2e-4, 0.15  # rad, N m: the angles' noise makes most of the residual


def view_of(planar, effects: list[str], seed: int, *, noise=None, seconds: float = SECONDS):
    """A view of a control whose angles are measured with noise, drawn once more for the rough motion; its torque is the model's
    own and white noise."""
    t, q, qd, qdd = fourier_motion(np.random.default_rng(0), seconds, RATE, 2)
    rng = np.random.default_rng(seed)
    tau = regressor.torque(planar, planar.prior, q, qd, qdd) + 0.3 * qd
    tau += NOISE * rng.normal(size=q.shape) if noise is None else noise(rng, len(t))
    experiment = config.experiment({"robot": {"urdf": "planar.urdf"}, "model": {"effects": effects}})
    structure = listed_effects.build(planar, experiment.model.effects)
    seen = q + ANGLE * rng.normal(size=q.shape)
    again = seen + ANGLE * rng.normal(size=q.shape)
    plain, rough = (
        lowpassed([Log("made", Path("made"), "", (Segment(t, 1.0 / RATE, q, tau, None, None, {}),))], planar.joints, 15.0) for q in (seen, again)
    )  # fmt: skip
    view = looked_at(experiment, structure, *on_same_rows(plain, rough), np.array(planar.prior), stride=stride_of(plain, 15.0))
    return in_blocks(view)


def in_blocks(view):
    """The view with blocks of half a second: how long its noise remembers is not what is asked here, and takes long."""
    vars(view)["blocks"] = blocks.numbered(view.rows.t, view.rows.piece)
    return view


def test_what_does_not_depend_on_the_motion_has_no_noise(planar):
    """The second draw would leave out other rows near a reversal; that is no noise, and a constant column has none."""
    view = view_of(planar, ["viscous", "torque_bias"], 0)
    bias = [10 * view.model.bodies + k for k, c in enumerate(view.model.coefficients) if c.effect == "torque_bias"]
    # the parameters of directions, a row each, and what noise makes of them: the bias alone has none
    turn, noise = view.design.turn, view.design.rough_columns
    assert len(bias) == 2 and np.abs(turn[bias]).max() > 0 and np.abs(noise @ np.linalg.pinv(turn)[:, bias]).max() < 1e-6 * np.abs(noise).max()


@pytest.fixture(scope="module")
def views(planar):
    """Twelve draws."""
    return [view_of(planar, ["viscous"], seed) for seed in range(12)]


@pytest.mark.long
def test_the_noise_of_the_angles_is_taken_off(views):
    """Nothing is hidden; the angles' noise stands in columns and residual alike, and parameters that take it up bend
    others. With the noise drawn once more and taken off, the mean of every coefficient is nothing within its error."""
    # what the second draw makes is as large as what the first one did
    share = [np.sum(v.design.rough_residual**2, axis=0) / np.sum(v.design.residual**2, axis=0) for v in views]
    assert 0.8 < np.mean(share) < 1.0
    away = {}
    for name, joint in (("encoder_offset", 0), ("torque_bias", 0), ("torque_bias", 1), ("spring", 1), ("armature", 1), ("coulomb", 0)):
        plain, corrected = [], []
        for view in views:
            (candidate,) = [c for c in candidates(view.model) if (c.name, c.joint) == (name, joint)]
            for out, own in ((plain, in_blocks(replace(view, rough=view.motion))), (corrected, view)):
                (group,) = projected.groups(own, [candidate])
                out.append(group.coefficients[0])
        away[name, joint] = [np.sqrt(len(own)) * np.mean(own) / np.std(own, ddof=1) for own in (plain, corrected)]
    # Student's, eleven degrees of freedom, six questions: one in a thousand in all
    assert max(abs(corrected) for _, corrected in away.values()) < student.isf(0.5e-3 / 6, 11), away
    assert min(abs(plain) for plain, _ in away.values()) > 2.0 and abs(away["encoder_offset", 0][0]) > 8.0, away


def test_effects_are_asked_under_the_load_of_the_bodies_found(planar, views):
    """Not of the URDF's, whatever these are: their load may be twice as much, or of another shape."""
    view, columns = views[0], []
    for heavier in (1.0, 3.0):
        robot = replace(planar, prior=heavier * np.array(planar.prior))
        source = replace(view.source, model=replace(view.model, robot=robot, reference=None))
        (candidate,) = [c for c in candidates(source.model) if (c.name, c.joint) == ("load_friction", 1)]
        columns.append(columns_of(source, candidate, [{}])[0])
    np.testing.assert_array_equal(*columns)
    bodies = view.settled.x[: 10 * view.model.bodies].reshape(-1, 10)
    source = replace(source, model=source.model.with_reference(bodies))
    np.testing.assert_allclose(columns[0], columns_of(source, candidate, [{}])[0], rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "options"),
    [("encoder_offset", ()), ("encoder_eccentricity", ()), ("elasticity", (("encoder", "joint"),)), ("elasticity", (("encoder", "motor"),))],
)  # fmt: skip
def test_what_moves_one_joint_has_the_slopes_of_the_whole_model(views, name, options):
    """By slopes that are made once for all effects, and by a difference of the model's torque with the effect in it."""
    source = views[0].source
    for one in (c for c in candidates(source.model) if (c.name, c.options) == (name, options)):
        (at, *_) = candidate_columns.tried(source, one)
        found, wanted = columns_of(source, one, [at])[0], candidate_columns._slopes(source, one, at)
        assert found.shape == wanted.shape
        np.testing.assert_allclose(found, wanted, atol=2e-3 * np.abs(wanted).max())


def test_what_moves_one_joint_is_seen_by_the_sensors_once(views):
    """Of a model with a gain and a lag of the measured torque, each as large as they come."""
    source = views[0].source
    for name, value in (("torque_gain", 0.5), ("current_lag", 0.05)):
        model = source.model.with_effect(vocabulary.find(name), (0, 1))
        seen = replace(source, model=model.with_shapes([*source.model.shapes, value, value]))
        for word, options in (("encoder_offset", ()), ("elasticity", (("encoder", "joint"),))):
            for one in (c for c in candidates(seen.model) if (c.name, c.options) == (word, options)):
                (at, *_) = candidate_columns.tried(seen, one)
                found, wanted = columns_of(seen, one, [at])[0], candidate_columns._slopes(seen, one, at)
                np.testing.assert_allclose(found, wanted, atol=2e-3 * np.abs(wanted).max())


def test_links_that_fly_are_integrated_for_both_motions_at_once(views):
    """With the same flights as each would have by itself, whoever is asked first."""
    (play,) = [c for c in candidates(views[0].model) if (c.name, c.joint, c.options) == ("backlash", 0, (("encoder", "motor"),))]
    asked = candidate_columns.tried(views[0], play)
    together = [columns_of(s, play, asked) for s in (views[0].rough_source, views[0].source)]
    alone = [columns_of(replace(s, beside=None), play, asked) for s in (views[0].rough_source, views[0].source)]
    for one, other in zip(together, alone):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=64 * np.finfo(float).eps * np.abs(other).max())


def test_links_that_fly_are_those_of_the_joints_that_are_asked(views):
    """Together or one joint after the other, the robot as a whole among them: of each the same flights."""
    plays = [c for c in candidates(views[0].model) if (c.name, c.options) == ("backlash", (("encoder", "motor"),))]
    assert len(plays) == 2
    told = []
    for among in ((), (-1, 0, 1)):
        source = replace(views[0].source, beside=None)
        told.append([])
        for play in plays:
            told[-1].append(columns_of(source, play, candidate_columns.tried(source, play), among))
            ((*followed,),) = source._flights.values()
            assert followed == ([0, 1][: play.joint + 1] if not among else [0, 1])  # nobody else's
    for one, other in zip(*told):
        # an integration in another order rounds at the size of its greatest torque, not of what is left near zero
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=64 * np.finfo(float).eps * np.abs(other).max())


def test_what_a_joint_was_asked_of_a_residual_stands_while_it_is_the_same(views):
    """Of joints whose residual an effect did not change, in the units of the new weights; of others it is asked anew."""
    view = views[0]
    view.unknown  # noqa: B018 - asked
    weights = view.weights * [2.0, 0.5]
    grown = replace(view, asked=view.answers, weights=weights)
    for j, (one, other) in enumerate(zip(grown.unknown, view.unknown)):
        unit = weights[j] / view.weights[j]
        # other weights bend the model a little
        np.testing.assert_allclose(one.told, unit * other.told, atol=1e-2 * unit * np.abs(other.told).max())
        assert one.chance == other.chance and one.predicted == pytest.approx(other.predicted, rel=1e-2)
    with_other = replace(view, asked=views[1].unknown)
    assert [one.chance for one in with_other.unknown] == [one.chance for one in view.unknown]


@pytest.mark.parametrize("slow", [0.05, 0.3])
def test_blocks_are_long_against_what_noise_remembers(planar, slow):
    """Four memories of a noise that no motion predicts, where half a second is less."""
    keep = np.exp(-1.0 / (RATE * slow))

    def coloured(rng, n):
        return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.normal(size=(n, 2)), axis=0)

    view = view_of(planar, ["viscous"], 3, noise=coloured, seconds=30.0)
    del vars(view)["blocks"]
    length = np.ptp(view.rows.t) / (view.blocks.max() + 1)
    assert length == pytest.approx(max(0.5, 4.0 * 0.9 * slow), rel=0.4)


# ---- blows


def struck(seed: int, size: float, blows: bool = True):
    """A group whose column is twenty times as large in one block of twenty as in the others, `size` of it in the torque."""
    rng = np.random.default_rng(seed)
    p = posed(rng)
    own = rng.normal(size=(2, p.a.shape[1], 1)) * np.where(p.number == 7, 20.0, 1.0)[None, :, None]
    p.tau += size * own[:, :, 0].T
    (group,) = grouped(viewed(p), own[None], blows=blows)
    return group


def chance(group) -> float:
    (statistic,) = null.statistics([group])
    return float(np.mean(null.maxima([group], np.random.default_rng(0), draws=400) >= statistic))


def test_one_blow_does_not_outweigh_all_others():
    """No block holds more than a tenth in what is tested, all together are one again, and what it takes is what it was."""
    group, plain = struck(0, 0.3), struck(0, 0.3, blows=False)
    assert not plain.testable
    np.testing.assert_allclose(plain.tested.squares, group.tested.squares)  # whoever comes in blows, and whatever rests on one
    told = group.tested
    share = np.einsum("bkk->b", told.squares)
    assert told.testable and share.sum() == pytest.approx(1.0) and share.max() <= 0.1 + 1e-9
    assert told.coefficients == pytest.approx(group.coefficients, abs=0.1) and group.coefficients == pytest.approx(0.3, abs=0.05)
    assert gain(group).sum() == pytest.approx(gain(plain).sum())


def test_blows_that_are_even_are_left_as_they_are():
    rng = np.random.default_rng(1)
    p = posed(rng)
    own = rng.normal(size=(2, p.a.shape[1], 2))
    (group,) = grouped(viewed(p), own[None], blows=True)
    assert group.testable and group.tested is group


def test_a_direction_that_one_block_holds_is_not_told():
    """Of two columns one is large in one block alone: the other is told, and found, and the noise of neither is."""
    for size, found in ((0.0, False), (0.3, True)):
        rng = np.random.default_rng(4)
        p = posed(rng)
        own = rng.normal(size=(2, p.a.shape[1], 2))
        own[:, :, 0] *= np.where(p.number == 7, 50.0, 1.0)
        p.tau += size * own.sum(axis=2).T
        (group,) = grouped(viewed(p), own[None])
        assert not group.testable and group.tested.testable and group.tested.scores.shape[1] == 1
        np.testing.assert_allclose(group.tested.squares.sum(0), np.eye(1), atol=1e-4)
        assert (chance(group) < 0.01) is found


@pytest.mark.parametrize("blows", [False, True])
@pytest.mark.parametrize("beside", [0.0, 1e-17])
def test_what_stands_in_one_block_alone_is_not_told_by_the_prior(beside, blows):
    """Evened over the blocks nothing is left of it but what the prior says, and that is no test."""
    rng = np.random.default_rng(2)
    group = struck(0, 0.0, blows)
    squares = np.full_like(group.squares, beside)
    squares[7], squares[-1] = 0.7, 0.3
    scores = rng.normal(size=group.scores.shape) * np.sqrt(squares[:, :, 0])
    group = replace(group, squares=squares, loud_squares=squares, scores=scores, loud=scores)
    assert group.tested is group and not group.testable
    assert np.isnan(null.statistics([group])).all() and np.isneginf(null.maxima([group], rng)).all()


def test_blows_told_evenly_keep_the_level():
    """Of noise alone one in twenty stands out at 5 %; of a column that is there all do."""
    p = np.array([chance(struck(seed, 0.0)) for seed in range(200)])
    assert 0.01 <= np.mean(p < 0.05) <= 0.10 and 0.38 < np.mean(p < 0.5) < 0.62
    assert all(chance(struck(seed, 0.3)) < 0.01 for seed in range(10))


def test_noise_is_foreseen_without_what_a_blow_takes():
    """A column in one block that makes nearly all of the residual raises the spectrum of the residual, not of the noise: what is
    foreseen of the noise is what it would be without the column's effect."""
    alone, beside = struck(3, 0.0).tested, struck(3, 0.7).tested
    assert np.trace(beside.foreseen) > 10.0 * np.trace(alone.foreseen)
    assert beside.spreads[1] == pytest.approx(alone.spreads[1], rel=0.5)
    assert chance(struck(3, 0.7)) < 0.01


def test_the_directions_that_data_tell_hold_all_that_a_fit_takes():
    """Columns of rank four in nine parameters of units far apart, beside a prior: what a fit takes of any torque stands in four directions."""
    rng = np.random.default_rng(3)
    a = rng.normal(size=(60, 4)) @ rng.normal(size=(4, 9)) * 10.0 ** rng.uniform(-4.0, 4.0, 9)
    root = 0.3 * np.diag(np.linalg.norm(a, axis=0)) @ rng.normal(size=(9, 9))
    system = a.T @ a + root @ root.T
    turn = told(a.T @ a, system)
    assert turn.shape == (9, 4)
    np.testing.assert_allclose(turn.T @ system @ turn, np.eye(4), atol=1e-9)
    np.testing.assert_allclose(a @ turn @ turn.T @ a.T, a @ np.linalg.solve(system, a.T), atol=1e-6)
