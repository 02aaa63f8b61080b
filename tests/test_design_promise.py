"""What noise will make of a fit of the logs that are still to come."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from sysid import config
from sysid.design import basis, likely_prior, promise, spectrum, suspects
from sysid.design.columns import columns
from sysid.design.spectrum import Noise, Stretch, noise_left, scatter, white
from sysid.errors import SysidWarning
from sysid.reduction import triangle
from tests.conftest import URDF


def coloured(rng, n, step, levels):
    """Noise (n,) whose spectrum is that of a `Noise`."""
    f = np.fft.rfftfreq(n, step)
    return np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) * np.sqrt(levels.density(f)), n)


SLOW = Noise(np.array([0.5, 2.0, 8.0, 60.0]), np.log(np.array([9.0, 4.0, 1.0, 1.0])))


def part_of(columns, step=0.004, use=None):
    count = columns.shape[1] if use is None else int(use.sum())
    return Stretch(0, np.arange(len(columns)), columns, step, count, slice(0, columns.shape[1]))


@pytest.mark.parametrize("true", [white(2.0), SLOW], ids=["white", "slow"])
def test_the_spectrum_of_noise_is_found_in_what_a_fit_leaves(true):
    """Twelve slow columns take most of what is below 2 Hz of an 8 s log: what a fit leaves there says nothing, and its leverage says so."""
    rng, n, step = np.random.default_rng(0), 2000, 0.004
    t = step * np.arange(n)
    columns = np.stack([w(2 * np.pi * k * t / 8.3) for k in range(1, 7) for w in (np.sin, np.cos)])
    part, hat = part_of(columns), np.linalg.pinv(columns)
    inverse = np.linalg.inv(columns @ columns.T)
    takes = lambda part, seen: np.einsum("am,am->m", seen.conj(), inverse @ seen).real  # noqa: E731
    ask = np.array([0.3, 3.0, 20.0, 100.0])
    found, naive = [], []
    for _ in range(25):
        noise = coloured(rng, n, step, true)
        change = noise @ hat
        (own,) = noise_left([part], noise[:, None], change, np.zeros((n, 1, 1)), takes)
        (other,) = noise_left([part], noise[:, None], change, np.zeros((n, 1, 1)), lambda part, seen: 0.0 * seen[0].real)
        found.append(np.log(own.density(ask)))
        naive.append(np.log(other.density(ask)))
    off = np.mean(found, axis=0) - np.log(true.density(ask))
    np.testing.assert_allclose(off[1:], 0.0, atol=0.15)
    # below 0.7 Hz little but its neighbourhood tells it
    missed = np.mean(naive, axis=0)[0] - np.log(true.density(ask))[0]
    assert missed < -0.8 and abs(off[0]) < 0.5 * abs(missed)


def test_what_noise_of_a_spectrum_makes_of_columns():
    """Against draws of it; rows that do not count are zero."""
    rng, n = np.random.default_rng(1), 1500
    t = 0.004 * np.arange(n)
    columns = np.stack([np.sin(3 * t), np.cos(7 * t), np.sign(np.sin(2 * t))])
    use = np.abs(np.sin(2 * t)) > 0.1
    part = part_of(columns * use, use=use)
    drawn = np.array([part.columns @ coloured(rng, n, 0.004, SLOW) for _ in range(4000)])
    said = scatter(part, SLOW)
    scale = np.sqrt(np.diagonal(said))
    np.testing.assert_allclose(np.cov(drawn.T) / np.outer(scale, scale), said / np.outer(scale, scale), atol=0.07)
    np.testing.assert_allclose(scatter(part, white(4.0)), 4.0 * part.columns @ part.columns.T, rtol=1e-9, atol=1e-9)


def test_what_angles_make_is_told_from_torque_s_own_noise():
    """Their shape is known: white noise beside a hump is white where the hump is not."""
    rng, n, step = np.random.default_rng(2), 4000, 0.004
    hump = Noise(np.array([2.0, 8.0, 15.0, 30.0, 60.0]), np.log(np.array([1e-3, 1.0, 4.0, 1.0, 1e-3])))
    left = rng.standard_normal(n) + coloured(rng, n, step, hump)
    made = coloured(rng, n, step, hump)
    (found,) = noise_left([part_of(np.zeros((1, n)))], left[:, None], np.zeros(1), made[:, None, None], lambda part, seen: 0.0 * seen[0].real)
    np.testing.assert_allclose(found.density(np.array([0.1, 1.0, 100.0])), 1.0, rtol=0.15)
    assert found.density(np.array([15.0]))[0] == pytest.approx(5.0, rel=0.3)


def test_what_is_left_of_a_suspect_and_whether_it_is_named():
    """Against least squares on rows; the smallest of many candidates must stand above the best of noise."""
    rng = np.random.default_rng(4)
    base, rival, signature = rng.normal(size=(60, 4)), rng.normal(size=(60, 2)), rng.normal(size=60)
    prior = np.diag([1.0, 2.0, 0.0, 3.0])
    stacked = np.vstack([np.hstack([base, rival]), np.hstack([np.sqrt(prior), np.zeros((4, 2))])])
    target = np.append(signature, np.zeros(4))
    left = target - stacked @ np.linalg.lstsq(stacked, target, rcond=None)[0]
    assert promise._left(base, prior, signature, rival) == pytest.approx(float(left @ left))
    assert promise._named(3.6**2, 65) == pytest.approx(0.5, abs=0.02) and promise._named(36.0, 65) > 0.98
    assert promise._apart(0.0, 1.0) == 0.0 and promise._apart(20.0, 1.0) > 0.9


def test_a_likely_size_is_what_logs_and_usual_sizes_suggest():
    """A signature that the model nearly makes itself says little: what is left of it in a residual is no size."""
    rng, n = np.random.default_rng(5), 400
    base = rng.normal(size=(n, 3))
    near = base[:, 0] + 0.01 * rng.normal(size=n)  # of another column all but a hundredth
    columns = np.stack([near, rng.normal(size=n)], axis=1)
    size = suspects.usual(columns[None], np.array([2.0]))
    np.testing.assert_allclose(size * np.abs(columns).max(axis=0), 0.2)
    for k, true in ((0, 0.05), (1, 0.3)):
        left = true * columns[:, k] + 0.1 * rng.normal(size=n)
        left = left - base @ np.linalg.lstsq(base, left, rcond=None)[0]  # as a fit leaves it
        rows = SimpleNamespace(columns=base[None], tau=2.0 * np.ones((n, 1)), residual=lambda x, left=left: left[:, None])
        seen = SimpleNamespace(rows=rows, weights=np.array([10.0]), source=SimpleNamespace(model=None))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(suspects, "tried", lambda source, candidate: [{}])
            patch.setattr(suspects, "on_every_joint", lambda source, candidate, at, k=k: columns[None, :, k : k + 1])
            found = suspects.suspected(seen, SimpleNamespace(x=None), np.zeros((3, 3)), SimpleNamespace(effect=None))
        assert 0.7 * (true if k else size[0]) < abs(found.size[0]) < 1.3 * max(true, size[0] if k == 0 else 0.0)


def test_a_small_delay_and_a_small_lag_are_told_apart_by_what_is_beyond_their_slopes(tmp_path):
    """Against the effects themselves on the predicted torque."""
    (tmp_path / "robot.urdf").write_text(URDF)
    text = "robot: {urdf: robot.urdf}\nmodel: {effects: [viscous]}\n"
    with pytest.warns(SysidWarning, match="no log yet"):
        known = basis.basis(config.loads(text, tmp_path / "c.yaml"), [("delay", "elbow"), ("current_lag", "elbow")], None).known
    t = 0.002 * np.arange(2000)
    q, qd, qdd = (np.stack([f(3 * t), f(5 * t)], axis=1) * s for f, s in ((np.sin, 1.0), (np.cos, [3.0, 5.0]), (np.sin, [-9.0, -25.0])))
    both = suspects.along(known.suspects, known.model, known.x, q, qd, qdd, 0.002)[1][:, 300:-300]
    torque = np.einsum("pn,p->n", columns(known.model, q, qd, qdd)[1], known.x)
    for own, one in zip(both, known.suspects):
        (value,) = one.shapes.values()
        assert value != 0.0 and one.size == pytest.approx([value])
        exact = one.candidate.effect.sensed(torque[None], 0.002, **one.shapes)[0] - torque
        np.testing.assert_allclose(own * one.size[0], exact[300:-300], atol=1e-6 * np.abs(torque).max())
    a, b = both
    left = a - b * (a @ b) / (b @ b)
    assert 1e-4 < np.linalg.norm(left) / np.linalg.norm(a) < 0.5


def test_nothing_left_is_no_noise():
    n = 500
    (found,) = noise_left([part_of(np.ones((1, n)))], np.zeros((n, 1)), np.zeros(1), np.zeros((n, 1, 1)), lambda part, seen: 0.0 * seen[0].real)
    assert found.density(np.array([1.0]))[0] < 1e-200


def test_columns_come_in_stretches_of_rows_that_count(monkeypatch):
    """Of two pieces, one longer than a stretch: every row once, those that do not count zero."""
    monkeypatch.setattr(spectrum, "_STRETCH", 400)
    rng = np.random.default_rng(3)
    model = SimpleNamespace(remembered=lambda piece: None, support=lambda joint, piece: np.array([joint]), columns=lambda piece, rows, _: [piece.q[rows, j][None] for j in range(2)])
    piece = SimpleNamespace(samples=1000, core=slice(10, 1010), q=rng.normal(size=(1020, 2)), use=rng.random((1020, 2)) > 0.2, step=0.01)
    short = SimpleNamespace(**{**vars(piece), "samples": 300, "core": slice(0, 300), "use": None})
    found = list(spectrum.stretches(model, SimpleNamespace(pieces=(piece, short))))
    assert [p.rows for p in found if p.joint == 0] == [slice(0, 500), slice(500, 1000), slice(1000, 1300)] and found[0].count < 500
    first = np.concatenate([p.columns[0] for p in found if p.joint == 1][:2])
    np.testing.assert_array_equal(first, np.where(piece.use[10:1010, 1], piece.q[10:1010, 1], 0.0))
    assert replace(found[0], count=1).frequency[1] == pytest.approx(1.0 / 5.0)


@pytest.mark.parametrize("known", [[], [1]])
def test_the_likelihood_of_how_near_bodies_are_is_that_of_all_rows(known):
    """Of 120 rows under a dense covariance in which coefficients are as good as unknown; one has no column."""
    rng = np.random.default_rng(3)
    n, k = 120, 3
    bodies, own = rng.standard_normal((n, 20)) * np.geomspace(0.1, 10.0, 20), rng.standard_normal((n, k))
    own[:, 1] = 0.0
    half = rng.standard_normal((2, 10, 10))
    metric = half @ np.swapaxes(half, 1, 2) + 0.1 * np.eye(10)
    prior = rng.standard_normal(20)
    torque = bodies @ (prior + 0.3 * rng.standard_normal(20)) + own @ [5.0, 0.0, -2.0] + rng.standard_normal(n)
    rows = np.column_stack([bodies, own, torque])
    asked = np.array([0.1, 3.0, 100.0])
    told = likely_prior.log_likelihood(*likely_prior.seen_of_bodies(triangle(rows), prior, metric, known), asked)
    wide = block_diag(*(np.zeros((10, 10)) if b in known else np.linalg.inv(own) for b, own in enumerate(metric)))
    dense = [
        multivariate_normal(bodies @ prior, np.eye(n) + bodies @ wide @ bodies.T / one + 1e6 * own @ own.T).logpdf(torque) for one in asked
    ]
    np.testing.assert_allclose(told - told[0], np.array(dense) - dense[0], rtol=1e-4)
    assert np.ptp(told) > 10.0
