import time

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from sysid.diagnose.noise import NoiseFloor, floor


def periodic(seconds: float, step: float, frequency: float, rng) -> np.ndarray:
    t = np.arange(round(seconds / step)) * step
    waves = [(k, rng.normal(size=3) / k, rng.uniform(0.0, 6.0, 3)) for k in range(1, 8)]
    return sum(0.6 * size * np.cos(2 * np.pi * k * frequency * t[:, None] + phase) for k, size, phase in waves)


def wandering(seconds: float, step: float, rng, cutoff: float = 1.5) -> np.ndarray:
    n, margin = round(seconds / step), round(5.0 / step)
    q = sosfiltfilt(butter(3, cutoff, fs=1.0 / step, output="sos"), rng.normal(size=(n + 2 * margin, 3)), axis=0)[margin : margin + n]
    return 0.6 * q / q.std(0)


def white(n: int, step: float, rng) -> np.ndarray:
    return rng.normal(size=n)


def coloured(n: int, step: float, rng, time_constant: float = 0.02) -> np.ndarray:
    keep = np.exp(-step / time_constant)
    return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.normal(size=n + 2000))[2000:]


def both(n: int, step: float, rng) -> np.ndarray:
    return (white(n, step, rng) + coloured(n, step, rng)) / np.sqrt(2.0)


def torque(q, step) -> np.ndarray:
    v = np.gradient(q, step, axis=0)
    return 2.0 * np.gradient(v, step, axis=0) + 10.0 * np.sin(q) + 4.0 * np.sign(v) + 2.0 * v


def stribeck(q, step) -> np.ndarray:
    v = np.gradient(q[:, 1], step)
    return np.sign(v) * np.exp(-((v / (0.15 * v.std())) ** 2))


def load_friction(q, step) -> np.ndarray:
    return np.sign(np.gradient(q[:, 1], step)) * np.abs(torque(q, step)[:, 1])


def nothing(q, step) -> np.ndarray:
    return np.zeros(len(q))


def found(q, step, noise, missing, size: float = 1.5) -> NoiseFloor:
    """The floor of joint 1 where a model misses an effect of `size` times the noise's RMS."""
    effect = missing - missing.mean()
    effect *= size * noise.std() / max(effect.std(), 1e-9)
    predicted = torque(q, step)
    residual = np.zeros_like(q)
    residual[:, 1] = effect + noise
    return floor([residual], [predicted + residual], [q], [step], 1)


@pytest.mark.parametrize("missing", [nothing, stribeck, load_friction])
@pytest.mark.parametrize("noise", [white, coloured, both])
@pytest.mark.parametrize("step", [0.001, 0.008])
def test_spectral_is_right_whatever_the_colour_and_whatever_the_model_lacks(step, noise, missing):
    rng = np.random.default_rng(1)
    q = wandering(25.0, step, rng)
    e = 0.7 * noise(len(q), step, rng)
    result = found(q, step, e, missing(q, step))
    assert result.method == "spectral"
    assert result.rms == pytest.approx(e.std(), rel=0.1)
    assert abs(result.rms - e.std()) < 3.0 * result.std


@pytest.mark.parametrize("noise", [white, coloured])
@pytest.mark.parametrize("missing", [stribeck, load_friction])
@pytest.mark.parametrize("frequency", [0.2, 0.2137])  # 625 and 584.93 samples
def test_repeats_are_found_and_give_the_noise(frequency, missing, noise):
    rng, step = np.random.default_rng(2), 0.008
    q = periodic(30.0, step, frequency, rng)
    e = 0.3 * noise(len(q), step, rng)
    result = found(q, step, e, missing(q, step), size=2.0)
    assert result.method == "repeats"
    assert f"period of {1.0 / frequency:.3f} s" in result.detail and f"{int(30.0 * frequency)} repeats" in result.detail
    assert result.rms == pytest.approx(e.std(), rel=0.07)


def test_two_repeats_suffice_and_drift_with_time_is_no_noise():
    rng, step = np.random.default_rng(3), 0.004
    q = periodic(21.0, step, 0.1, rng)
    e = white(len(q), step, rng)
    assert found(q, step, e, nothing(q, step)).method == "repeats"
    q = periodic(40.0, step, 0.1, rng)
    e = white(len(q), step, rng)
    warm = stribeck(q, step) * (1.0 + np.linspace(0.0, 1.0, len(q)))
    result = found(q, step, e, warm, size=2.0)
    assert result.method == "repeats" and result.rms == pytest.approx(e.std(), rel=0.05)


def test_repeats_serve_a_model_that_is_nonsense():
    rng, step = np.random.default_rng(4), 0.004
    q = periodic(30.0, step, 0.2, rng)
    e = white(len(q), step, rng)
    logged = torque(q, step)
    logged[:, 1] += e
    nonsense = 50.0 * rng.normal(size=q.shape)
    result = floor([logged - nonsense], [logged], [q], [step], 1)
    assert result.method == "repeats" and result.rms == pytest.approx(e.std(), rel=0.05)


@pytest.mark.parametrize("seed", range(8))
def test_no_repeats_are_seen_in_what_does_not_repeat(seed):
    rng, step = np.random.default_rng(seed), 0.01
    t = np.arange(3000) * step
    incommensurate = sum(np.cos(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 3)) for f in rng.uniform(0.1, 2.0, 5))
    held = np.concatenate([wandering(5.0, step, rng), np.zeros((2000, 3))])
    once = periodic(15.0, step, 0.1, rng)
    for q in (incommensurate, held, once, wandering(30.0, step, rng)):
        assert found(q, step, white(len(q), step, rng), nothing(q, step)).method == "spectral"


def test_a_joint_that_does_not_come_back_spoils_the_repeats():
    rng, step = np.random.default_rng(5), 0.004
    q = periodic(30.0, step, 0.2, rng)
    q[:, 2] = wandering(30.0, step, rng)[:, 2]
    assert found(q, step, white(len(q), step, rng), nothing(q, step)).method == "spectral"


@pytest.mark.parametrize("seed", range(6))
def test_the_standard_error_covers_what_cannot_be_known(seed):
    """Noise with its corner in the motion's band, and misfit that is no function of the motion, of the noise's size."""
    rng, step = np.random.default_rng(seed), 0.004
    q = wandering(30.0, step, rng, cutoff=2.0)
    e = coloured(len(q), step, rng, 0.05)
    unknown = np.cos(3.0 * q[:, 0] * q[:, 2]) * np.gradient(q[:, 0], step) * np.sign(np.gradient(q[:, 2], step))
    result = found(q, step, e, unknown + 0.7 * load_friction(q, step) / load_friction(q, step).std(), size=1.5)
    assert result.std > 0.1 * result.rms
    assert abs(result.rms - e.std()) < 3.0 * result.std


def test_quantised_torque():
    rng, step = np.random.default_rng(6), 0.004
    q = wandering(30.0, step, rng)
    predicted, residual = torque(q, step), np.zeros_like(q)
    logged = predicted.copy()
    logged[:, 1] = np.round((predicted[:, 1] + 0.2 * white(len(q), step, rng)) / 0.5) * 0.5
    residual[:, 1] = logged[:, 1] - predicted[:, 1]
    assert floor([residual], [logged], [q], [step], 1).rms == pytest.approx(np.hypot(0.2, 0.5 / np.sqrt(12.0)), rel=0.07)


def test_stretches_are_pooled_and_short_ones_left_out():
    rng, step = np.random.default_rng(7), 0.005
    qs = [wandering(seconds, step, rng) for seconds in (12.0, 20.0, 0.1)]
    es = [rng.normal(size=q.shape) for q in qs]
    result = floor(es, [torque(q, step) + e for q, e in zip(qs, es)], qs, [step] * 3, 1)
    assert result.rms == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("n", [1, 5, 39, 40, 41, 60, 100, 199])
@pytest.mark.parametrize("step", [0.001, 0.1])
def test_tiny_logs(n, step):
    rng = np.random.default_rng(n)
    q = 0.6 * np.sin(np.arange(n)[:, None] * step * np.array([1.0, 2.0, 3.0]))
    e = rng.normal(size=q.shape)
    result = floor([e], [e + 5.0], [q], [step], 1)
    own = np.sqrt(np.mean(e[:, 1] ** 2))
    assert 0.0 < result.rms <= own * (1 + 1e-12) and np.isfinite(result.std)
    assert result.rms == pytest.approx(own, abs=3.0 * result.std)


def test_no_samples():
    result = floor([np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros((0, 2))], [0.01], 0)
    assert result.rms == 0.0
    assert floor([], [], [], [], 0).rms == 0.0


def test_nothing_left_a_constant_left_and_nothing_moving():
    rng, step = np.random.default_rng(8), 0.004
    q = wandering(10.0, step, rng)
    zero = np.zeros_like(q)
    assert floor([zero], [torque(q, step)], [q], [step], 1) == floor([zero], [zero], [q], [step], 1)
    assert floor([zero], [zero + 3.0], [q], [step], 1).rms == 0.0
    assert floor([zero + 3.0], [zero + 3.0], [q], [step], 1).rms == 0.0
    e = rng.normal(size=q.shape)
    for still in (zero, zero + 1.0):
        assert floor([e], [e], [still], [step], 1).rms == pytest.approx(e[:, 1].std(), rel=1e-3)


@pytest.mark.parametrize("seed", range(20))
def test_never_above_the_residual(seed):
    rng, step = np.random.default_rng(seed), 0.01
    q = (wandering if seed % 2 else lambda *a: periodic(*a[:2], 0.2, a[2]))(15.0, step, rng)
    residual = rng.normal(size=q.shape) * rng.uniform(0.0, 1.0) + rng.uniform(0.0, 1.0) * torque(q, step) * rng.integers(2)
    result = floor([residual], [torque(q, step)], [q], [step], 1)
    assert 0.0 <= result.rms <= np.sqrt(np.mean(residual[:, 1] ** 2)) * (1 + 1e-12)
    assert result.std >= 0.0


def test_units_scale_it():
    rng, step = np.random.default_rng(9), 0.005
    q = wandering(20.0, step, rng)
    e, u = 0.7 * rng.normal(size=q.shape), torque(q, step)
    one, thousand = (floor([k * e], [k * (u + e)], [q], [step], 1) for k in (1.0, 1000.0))
    assert thousand.rms == pytest.approx(1000.0 * one.rms, rel=1e-6) and thousand.detail == one.detail


def test_long_logs_take_bounded_time():
    rng = np.random.default_rng(10)
    t = np.arange(1_000_000) * 0.001
    q = np.stack([np.cos(2 * np.pi * 0.3 * t) + np.cos(2 * np.pi * 0.3 * 1.618 * t), np.sin(2 * np.pi * 0.2 * 1.414 * t)], axis=1)
    e = rng.normal(size=q.shape)
    start = time.process_time()
    assert floor([e], [e + 5.0 * q], [q], [0.001], 0).rms == pytest.approx(1.0, rel=0.05)
    assert time.process_time() - start < 5.0
