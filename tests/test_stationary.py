"""What noise of one spectrum makes of columns' scores: against dense covariances, and against noise that is drawn."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from sysid.view.stationary import covariance, drawn, spectra


def coloured(rng, shape, keep: float):
    """First-order noise of unit variance along the first axis."""
    start = 200
    out = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.normal(size=(shape[0] + start, *shape[1:])), axis=0)
    return out[start:]


def nothing(values):
    """Of a fit of no columns."""
    return np.zeros((values.shape[1], len(values), 0))


def test_spectrum_is_that_of_the_correlation():
    rng = np.random.default_rng(0)
    n, keep, step = 20_000, 0.8, 0.01
    values = coloured(rng, (n, 2), keep) * np.array([1.0, 3.0])
    use = rng.random((n, 2)) < 0.8
    found = spectra(values, nothing(values), use, 0.5 * step / (1.0 - keep), step)
    alike = np.fft.irfft(found, axis=1)[:, :10]
    lags = 8 / (1.0 - keep)
    wanted = keep ** np.arange(10) * (1.0 - np.arange(10) / (lags + 1.0))  # Bartlett's window
    np.testing.assert_allclose(alike[0], wanted, atol=0.06)
    np.testing.assert_allclose(alike[1], 9.0 * wanted, atol=0.5)
    assert (found >= 0.0).all()


@pytest.mark.parametrize("scale", [1.0, 1e30])
def test_covariance_is_the_dense_one(scale):
    rng = np.random.default_rng(1)
    n, lags = 300, 40
    values = coloured(rng, (n, 1), 0.7)
    (spectrum,) = spectra(values, nothing(values), np.ones((n, 1), bool), 0.025, 0.01)
    correlation = np.fft.irfft(spectrum)
    assert np.abs(correlation[lags + 1 : -lags]).max() < 1e-2 * correlation[0]
    columns = rng.normal(size=(n, 4, 2)).cumsum(axis=0)
    columns[50:90] = 0.0  # rows that do not count
    found = covariance(scale * np.moveaxis(columns, 0, -1), spectrum)
    dense = toeplitz(correlation[:n])
    wanted = np.einsum("nsk,nm,msl->skl", columns, dense, columns)
    np.testing.assert_allclose(found / scale**2, wanted, rtol=1e-4, atol=1e-4 * np.abs(wanted).max())


def test_covariance_is_that_of_scores_of_noise_that_is_drawn():
    rng = np.random.default_rng(2)
    n = 1000
    t = np.arange(n) / 100.0
    columns = np.stack([np.sin(t), np.sign(np.sin(3.0 * t)), (t < 1.0) * 1.0], axis=1)[:, None]
    drawn = coloured(rng, (n, 4000), 0.9)
    scores = columns[:, 0].T @ drawn
    size = 2 * n
    lag = np.minimum(np.arange(size), size - np.arange(size))
    spectrum = np.fft.rfft(0.9**lag).real
    np.testing.assert_allclose(np.diag(covariance(columns.transpose(1, 2, 0), spectrum)[0]), np.mean(scores**2, axis=1), rtol=0.08)
    # as read off another stretch of the noise: Bartlett's window over sixteen memories takes a sixteenth of the slowest
    values = coloured(rng, (60 * n, 1), 0.9)
    (read,) = spectra(values, nothing(values), np.ones((60 * n, 1), bool), 0.1, 0.01)
    alike = np.fft.irfft(read)
    long = np.zeros(size)
    long[: n // 2], long[-n // 2 :] = alike[: n // 2], alike[-n // 2 :]
    found = covariance(columns.transpose(1, 2, 0), np.clip(np.fft.rfft(long).real, 0.0, None))
    np.testing.assert_allclose(np.diag(found[0]), np.mean(scores**2, axis=1), rtol=0.2)


def test_noise_is_drawn_that_has_the_spectrum():
    rng = np.random.default_rng(4)
    keep, n = 0.9, 400
    spectrum = 4.0 * np.fft.rfft(keep ** np.minimum(np.arange(1000), 1000 - np.arange(1000))).real
    found = drawn(spectrum, n, 3000, rng)
    assert found.shape == (n, 3000)
    for lag in (0, 1, 10, 40):  # the last stands about nothing as the first does
        alike = np.mean(found[: n - lag] * found[lag:])
        assert alike == pytest.approx(4.0 * keep**lag, abs=0.1)
    np.testing.assert_allclose(np.std(found, axis=1), 2.0, rtol=0.08)


def test_a_spectrum_is_that_of_the_noise_before_a_fit():
    """Slow columns take of slow noise: what they leave tells what it was, white or not."""
    rng = np.random.default_rng(3)
    n, step = 2000, 0.01
    t = step * np.arange(n)
    waves = np.concatenate([[f(2.0 * np.pi * k * t / 20.0) for k in range(1, 13)] for f in (np.sin, np.cos)]).T
    columns = np.linalg.qr(waves)[0]
    score = np.sin(2.0 * np.pi * 0.4 * t)[:, None, None]  # as slow as they are, and not among them
    score[:, 0, 0] *= np.sign(np.sin(0.3 * t))
    for keep in (0.0, 0.9):
        own, plain, column = [], [], score[:, 0, 0]
        wanted = column @ toeplitz(keep ** np.arange(n)) @ column
        for _ in range(60):
            noise = coloured(rng, (n, 1), keep)
            left = noise - columns @ (columns.T @ noise)
            memory = step / (1.0 - keep)
            own.append(covariance(score.T, spectra(left, columns[None], np.ones((n, 1), bool), memory, step)[0]))
            plain.append(covariance(score.T, spectra(left, nothing(left), np.ones((n, 1), bool), memory, step)[0]))
        assert np.mean(own) == pytest.approx(wanted, rel=0.3), keep  # Bartlett's window takes a part of slow noise too
        assert abs(np.mean(own) - wanted) < 0.7 * abs(np.mean(plain) - wanted), keep
