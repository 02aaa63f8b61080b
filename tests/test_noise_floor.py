import re
import shutil
import time
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from sysid import experiment_logs, pipeline
from sysid.diagnose.diagnosis import diagnose
from sysid.gaussian import Gaussian
from sysid.noise import NoiseFloor, as_of_test, floor, floors, outliers, repeats
from sysid.noise.of_fit import _of_each, floors_of_fit
from sysid.noise.of_pieces import filtered
from sysid.noise.pursuit import _pursuit


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
    if noise is coloured and missing is not nothing and result.rms is None:
        # all of the noise has its corner where misfit may be: not being sure is right, being wrong is not
        assert "cannot be told from misfit" in result.detail and result.low < e.std() < result.high
        return
    assert result.method == "spectral"
    assert result.rms == pytest.approx(e.std(), rel=0.1)
    assert abs(result.rms - e.std()) < 3.0 * result.std
    assert result.low < e.std() < result.high * (1.0 + 1e-9)


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


@pytest.mark.parametrize("times", [1.0, 1.5])
def test_a_log_that_repeats_says_nothing_of_others_where_noise_is_not_the_same(times):
    """A fast multisine, whose noise is louder than that of the moves beside it: its repeats were above all that is left, and no floor was known."""
    rng, step = np.random.default_rng(8), 0.008
    angles = [periodic(30.0, step, 0.1, rng), wandering(30.0, step, rng)]
    noise = [size * white(len(q), step, rng) for size, q in zip((times, 1.0), angles)]
    left = [np.outer(e, [0.0, 1.0, 0.0]) for e in noise]
    logged = [torque(q, step) + own for q, own in zip(angles, left)]
    result = floor(left, logged, angles, [step, step], 1)
    assert result.rms == pytest.approx(np.concatenate(noise).std(), rel=0.07)
    assert ("logs that repeat, and the others, each by themselves" in result.detail) is (times > 1.0)


def test_repeats_are_found_across_rows_that_do_not_count():
    """Standstill parts the log into pieces shorter than a period."""
    rng, step = np.random.default_rng(16), 0.008
    q = periodic(30.0, step, 0.2137, rng)
    e, speed = 0.3 * coloured(len(q), step, rng), np.abs(np.gradient(q[:, 1], step))
    use = (speed > 0.15 * speed.std()) & holes(len(q), rng)
    residual = np.zeros_like(q)
    residual[:, 1] = e + 0.6 * load_friction(q, step) / load_friction(q, step).std() + np.where(use, 0.0, 1e3)
    q[~use] = 77.0
    result = floor([residual], [torque(q, step)], [q], [step], 1, use=[use])
    assert result.method == "repeats" and "period of 4.679 s found, 6 repeats" in result.detail
    assert result.rms == pytest.approx(e[use].std(), rel=0.1)


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
def test_it_is_sure_of_nothing_that_cannot_be_known(seed):
    """Noise with its corner in the motion's band, and misfit that is no function of the motion, of the noise's size."""
    rng, step = np.random.default_rng(seed), 0.004
    q = wandering(30.0, step, rng, cutoff=2.0)
    e = coloured(len(q), step, rng, 0.05)
    unknown = np.cos(3.0 * q[:, 0] * q[:, 2]) * np.gradient(q[:, 0], step) * np.sign(np.gradient(q[:, 2], step))
    result = found(q, step, e, unknown + 0.7 * load_friction(q, step) / load_friction(q, step).std(), size=1.5)
    if result.rms is None:
        assert result.low < e.std() < result.high and "not determined" in result.detail
    else:
        assert result.std > 0.05 * result.rms and abs(result.rms - e.std()) < 3.0 * result.std


def test_quantised_torque():
    rng, step = np.random.default_rng(6), 0.004
    q = wandering(30.0, step, rng)
    predicted, residual = torque(q, step), np.zeros_like(q)
    logged = predicted.copy()
    logged[:, 1] = np.round((predicted[:, 1] + 0.2 * white(len(q), step, rng)) / 0.5) * 0.5
    residual[:, 1] = logged[:, 1] - predicted[:, 1]
    assert floor([residual], [logged], [q], [step], 1).rms == pytest.approx(np.hypot(0.2, 0.5 / np.sqrt(12.0)), rel=0.07)


@pytest.mark.parametrize("digit", [1.0, 3.0])
def test_a_torque_much_coarser_than_its_noise_has_the_noise_of_its_rounding(digit):
    """Its jumps are no spikes."""
    rng, step = np.random.default_rng(17), 0.002
    q = wandering(20.0, step, rng)
    predicted = torque(q, step)
    exact = predicted + 0.1 * rng.normal(size=q.shape)
    logged = np.round(exact / digit) * digit
    for j, result in enumerate(floors([logged - predicted], [logged], [q], [step])):
        assert result.rms == pytest.approx((logged - predicted)[:, j].std(), rel=0.1)


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
    assert result.high == pytest.approx(own, rel=1e-12)
    if n < 40:
        assert (result.rms, result.std, result.low, result.method) == (None, None, None, "none")
        assert f"{n} samples" in result.detail and "too few" in result.detail
    elif result.rms is not None:
        assert result.rms <= own * (1 + 1e-12) and result.rms == pytest.approx(own, abs=3.0 * result.std)
    else:
        assert result.low <= own and "not determined" in result.detail
        assert 0.0 < result.about <= own  # the estimate all the same


def test_no_samples():
    for result in (floor([np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros((0, 2))], [0.01], 0), floor([], [], [], [], 0)):
        assert result.rms is None and result.method == "none" and result.detail == "no sample counts"
    assert floors([], [], [], []) == ()


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
    result, own = floor([residual], [torque(q, step)], [q], [step], 1), np.sqrt(np.mean(residual[:, 1] ** 2)) * (1 + 1e-12)
    assert result.high <= own
    assert result.rms is None or (0.0 <= result.low <= result.rms <= own and result.std >= 0.0)


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


def case(seconds: float = 20.0, step: float = 0.002, seed: int = 11):
    """Three joints' residual, torque, positions and step; noise with an RMS of one and a little misfit."""
    rng = np.random.default_rng(seed)
    q = wandering(seconds, step, rng)
    e = rng.normal(size=q.shape)
    e[:, 2] = both(len(q), step, rng)
    residual = e + 0.8 * np.stack([stribeck(q, step)] * 3, axis=1)
    return residual, torque(q, step) + residual, q, step, e


def holes(n: int, rng, lengths=(1, 400)) -> np.ndarray:
    """Rows (n,) that count: all but some gaps, short and long."""
    use = np.ones(n, dtype=bool)
    for start in rng.integers(0, n - lengths[1], 12):
        use[start : start + int(np.exp(rng.uniform(*np.log(lengths))))] = False
    return use


@pytest.mark.parametrize("each", [False, True])
def test_rows_that_do_not_count_change_nothing(each):
    residual, measured, q, step, _ = case()
    rng = np.random.default_rng(12)
    use = np.stack([holes(len(q), rng) for _ in range(3)], axis=1) if each else holes(len(q), rng)
    clean = floors([residual], [measured], [q], [step], use=[use])
    spoilt, unused = [x.copy() for x in (residual, measured)], ~use if each else np.repeat(~use[:, None], 3, axis=1)
    for x in spoilt:
        x[unused] = rng.normal(size=int(unused.sum())) * 1e6
        x[unused & (rng.random(unused.shape) < 0.1)] = np.nan
    moved = np.where(unused.all(axis=1)[:, None], rng.normal(size=q.shape) * 50.0, q)  # where no joint counts, nor do the positions
    for j, (one, other) in enumerate(zip(clean, floors([spoilt[0]], [spoilt[1]], [moved], [step], use=[use]))):
        assert one.rms == pytest.approx(1.0, rel=0.1)
        assert other.rms == pytest.approx(one.rms, rel=1e-12) and other.std == pytest.approx(one.std, rel=1e-12)
        assert floor([spoilt[0]], [spoilt[1]], [moved], [step], j, use=[use]) == other


def test_a_mask_that_counts_every_row_is_no_mask():
    residual, measured, q, step, _ = case()
    assert floors([residual], [measured], [q], [step], use=[np.ones(len(q), dtype=bool)]) == floors([residual], [measured], [q], [step])


def test_a_mask_that_counts_none():
    residual, measured, q, step, _ = case()
    result = floor([residual], [measured], [q], [step], 0, use=[np.zeros(len(q), dtype=bool)])
    assert result.rms is None and result.detail == "no sample counts"


@pytest.mark.parametrize("share", [0.001, 0.005])
def test_spikes_that_nobody_masked_do_not_raise_it(share):
    residual, measured, q, step, e = case()
    rng = np.random.default_rng(13)
    spikes = 20.0 * rng.choice([-1.0, 1.0], e.shape) * (rng.random(e.shape) < share)
    assert np.sqrt(np.mean((e + spikes) ** 2)) > 1.15
    for j, result in enumerate(floors([residual + spikes], [measured + spikes], [q], [step])):
        assert result.rms == pytest.approx(e[:, j].std(), rel=0.06)


@pytest.mark.parametrize("k", [16.0, 40.0])
def test_a_ripple_that_grows_with_the_speed_is_no_noise(k):
    """One that is always the same is in the model: nothing is left of the mean at any position."""
    rng, step = np.random.default_rng(1), 0.004
    q = wandering(30.0, step, rng)
    speed = np.abs(np.gradient(q[:, 1], step))
    e = rng.normal(size=len(q))
    result = found(q, step, e, (speed / speed.mean() - 1.0) * np.sin(k * q[:, 1]))
    assert result.rms == pytest.approx(e.std(), rel=0.1)


@pytest.mark.parametrize("missing", [nothing, load_friction])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_noise_that_grows_with_the_speed_is_noise(seed, missing):
    """As ripple of a drive does: 0.4 at rest and four times as much at the usual speed. What is loud stands in many rows together."""
    rng, step = np.random.default_rng(seed), 0.004
    q = wandering(30.0, step, rng)
    speed = np.abs(np.gradient(q[:, 1], step))
    e = (0.4 + 1.2 * speed / speed.std()) * rng.normal(size=len(q))
    assert found(q, step, e, missing(q, step)).rms == pytest.approx(e.std(), rel=0.12)


def test_knocks_that_nobody_masked_hardly_raise_it():
    """What rings on below the noise stays; without the treatment it is half as much again."""
    residual, measured, q, step, e = case()
    t, knocks = np.arange(len(q)) * step, np.zeros(len(q))
    for start in (3.0, 9.1, 14.7):
        after = np.clip(t - start, 0.0, None)
        knocks += np.where(after > 0.0, 25.0 * np.exp(-after / 0.05) * np.cos(2.0 * np.pi * 15.0 * after), 0.0)
    assert np.sqrt(np.mean((e[:, 0] + knocks) ** 2)) > 1.4
    for j, result in enumerate(floors([residual + knocks[:, None]], [measured + knocks[:, None]], [q], [step])):
        assert result.rms == pytest.approx(e[:, j].std(), rel=0.12)


def test_many_short_logs():
    step, parts = 0.002, [case(3.0, seed=seed) for seed in range(25)]
    residual, measured, q, _, e = (list(x) for x in zip(*parts))
    for j, result in enumerate(floors(residual, measured, q, [step] * 25)):
        assert result.rms == pytest.approx(np.concatenate(e)[:, j].std(), rel=0.1)


def test_a_joint_that_moves_half_a_second_at_a_time():
    residual, measured, q, step, e = case(40.0)
    use = (np.arange(len(q)) * step) % 1.2 < 0.5
    residual[~use] += 30.0
    measured[~use] += 30.0
    for j, result in enumerate(floors([residual], [measured], [q], [step], use=[use])):
        assert result.rms == pytest.approx(e[use, j].std(), rel=0.1)


def test_misfit_a_hundred_times_the_noise_is_not_called_noise():
    rng, step = np.random.default_rng(14), 0.01
    q = wandering(10.0, step, rng)
    e = 0.01 * coloured(len(q), step, rng, 0.1)
    residual = torque(q, step) * np.cos(7.0 * q[:, [2, 0, 1]] * q[:, [1, 2, 0]])
    result = floor([residual + e[:, None]], [residual + torque(q, step)], [q], [step], 1)
    assert result.rms is None and result.std is None and result.method == "none"
    assert result.detail.startswith("not determined: ") and result.high == pytest.approx(np.sqrt(np.mean((residual[:, 1] + e) ** 2)), rel=1e-9)


def test_seven_joints_of_twenty_seconds_at_a_kilohertz_take_a_second():
    rng, step = np.random.default_rng(15), 0.001
    q = np.concatenate([wandering(20.0, step, rng) for _ in range(3)], axis=1)[:, :7]
    e = rng.normal(size=q.shape)
    start = time.process_time()
    assert all(f.rms == pytest.approx(1.0, rel=0.05) for f in floors([e], [e + torque(q, step)], [q], [step]))
    assert time.process_time() - start < 2.0  # measured 0.6 s; a machine may be slower


def clock(q, step, rng, late: float):
    """What a stamp that is wrong by `late` [s] RMS adds to the angles, and, through differences
    over 0.1 s and an inertia of 2, to the torque that a model predicts."""
    from scipy.signal import savgol_filter

    wrong = late * rng.normal(size=q.shape) * np.gradient(q, step, axis=0)
    smooth = lambda d: savgol_filter(wrong, 11, 4, deriv=d, delta=step, axis=0)  # noqa: E731
    return smooth(0), 2.0 * smooth(2)


@pytest.mark.parametrize("seed", range(4))
def test_what_the_angles_noise_makes_is_noise_and_no_function_of_the_motion_takes_it(seed):
    from sysid.noise import OfAngles

    rng, step = np.random.default_rng(seed), 0.01
    q = wandering(40.0, step, rng)
    angle, made = clock(q, step, rng, 4e-4)
    # drawn again with two thirds of the size: nobody knows it better
    _, again = clock(q, step, rng, 2.7e-4)
    residual = -made + 0.1 * made.std(axis=0) * rng.normal(size=q.shape)
    truth = residual[:, 1].std()
    residual = residual + 0.8 * truth * stribeck(q, step)[:, None] / stribeck(q, step).std()
    seen = q + angle
    args = [residual], [torque(seen, step) + residual], [seen], [step], 1
    found_with = floor(*args, angles=OfAngles([again[None]], 1.5))
    assert found_with.rms == pytest.approx(truth, rel=0.2)
    assert abs(found_with.rms - truth) < 3.0 * found_with.std
    blind = floor(*args)
    assert blind.rms is None or abs(blind.rms / truth - 1.0) > 0.2


@pytest.mark.parametrize("seed", range(4))
def test_noise_that_stands_at_the_ends_of_short_logs_is_noise(seed):
    """A clock is least known at the ends of a log, which the window of a spectrum weighs least: most of the noise stands in a
    seventh of the rows."""
    from sysid.noise import OfAngles

    rng, step, n = np.random.default_rng(seed), 0.01, 400
    q = [wandering(n * step, step, rng) for _ in range(12)]
    from_end = np.minimum(np.arange(n), np.arange(n)[::-1]) * step
    envelope = (1.0 + 3.0 * np.exp(-from_end / 0.15))[:, None]
    made = lambda x: clock(x, step, rng, 4e-4)[1] * envelope  # noqa: E731
    white = 0.3 * np.median([np.abs(made(x)[100:-100]).mean() for x in q])
    residual = [made(x) + white * rng.normal(size=x.shape) for x in q]
    drawn = [np.stack([made(x) for _ in range(8)]) for x in q]
    measured = [torque(x, step) + r for x, r in zip(q, residual)]
    found = floor(residual, measured, q, [step] * 12, 1, angles=OfAngles(drawn, 1.5))
    truth = np.sqrt(np.mean(np.concatenate(residual)[:, 1] ** 2))
    told = found.rms or found.about
    assert told == pytest.approx(truth, rel=0.25), found


@pytest.mark.parametrize("shape", ["pulse", "ringing"])
def test_bursts_of_a_knock_that_no_event_told_do_not_raise_it(shape):
    rng, step = np.random.default_rng(5), 0.001
    q = wandering(20.0, step, rng)
    e = 0.2 * both(len(q), step, rng)
    knocked = e.copy()
    for place in (3000, 9000, 16000):
        t = np.arange(90) * step
        wave = np.sin(np.pi * t / 0.09) if shape == "pulse" else np.exp(-t / 0.03) * np.cos(2 * np.pi * 45.0 * t)
        knocked[place : place + 90] += 10.0 * wave
    assert knocked.std() > 1.5 * e.std()
    residual = np.zeros_like(q)
    residual[:, 1] = knocked
    assert floor([residual], [torque(q, step) + residual], [q], [step], 1).rms == pytest.approx(e.std(), rel=0.1)


def test_no_model_s_floor_is_above_what_another_leaves(simulated):
    """Noise is in what every model leaves: where the one that is looked at leaves more of a joint than the fit, the fit's tells it."""
    experiment = pipeline.load(simulated("clean"))
    fit = pipeline.fit(experiment)
    logs = [experiment_logs.read(experiment, fit.model.robot, part) for part in (experiment.data.train, experiment.data.test)]
    plain, left = floors_of_fit(experiment, fit, fit.model, fit.x, logs)
    assert left == pytest.approx({joint: max(fit.rms("train")[joint], fit.rms("test")[joint]) for joint in fit.joints}, rel=1e-6)
    bent = fit.x.copy()
    bent[fit.model.names.index("viscous.elbow.Fv")] += 2.0  # N m s/rad
    found, left = floors_of_fit(experiment, fit, fit.model, bent, logs)
    assert left["elbow"] > 2.0 * fit.rms("test")["elbow"] and left["shoulder"] == pytest.approx(max(fit.rms("train")["shoulder"], fit.rms("test")["shoulder"]))
    assert (found[1].rms, found[1].std) == (plain[1].rms, plain[1].std)
    assert found[0].rms == pytest.approx(plain[0].rms)


def test_a_floor_that_one_log_s_error_denies_is_not_given(simulated):
    """Noise that the test logs do not have is louder in the training logs, or misfit: nobody can say which."""
    experiment = pipeline.load(simulated("clean"))
    fit = pipeline.fit(experiment)
    logs = [experiment_logs.read(experiment, fit.model.robot, part) for part in (experiment.data.train, experiment.data.test)]
    test = fit.predictions["test"]
    shrunk = {}
    for share in (1.0, 0.9, 0.5):
        shown = replace(test, measured=test.predicted + share * (test.measured - test.predicted))
        shrunk[share] = floors_of_fit(experiment, replace(fit, predictions={**fit.predictions, "test": shown}), fit.model, fit.x, logs)[0]
    assert all(one.rms is not None for share in (1.0, 0.9) for one in shrunk[share])
    for one, known in zip(shrunk[0.5], shrunk[1.0]):
        assert one.rms is None and "the error on the test logs" in one.detail
        assert one.about == pytest.approx(0.5 * known.rms, rel=0.15)


@pytest.mark.parametrize("comes_again", [True, False])
def test_noise_of_angles_that_the_motion_repeats_is_noise_all_the_same(comes_again):
    """A periodic motion meets an encoder's grain at the same places: between repeats it is not seen, and a fit is left with it."""
    rng, period, count = np.random.default_rng(5), 500, 4
    motion = np.sin(2 * np.pi * np.arange(period * count) / period)
    grain = np.tile(rng.standard_normal(period), count) if comes_again else rng.standard_normal(period * count)
    torque, left = 3.0 * motion + rng.standard_normal(len(motion)), None
    left = torque - (3.0 * motion + 2.0 * grain)
    ask = lambda angles: repeats.scatter([[left]], [torque], [np.ones(len(torque), dtype=bool)], [float(period)], angles)  # noqa: E731
    rms, std = ask(4.0)
    assert rms == pytest.approx(np.sqrt(5.0), rel=0.03) and 0.05 < std / rms < 0.12  # how large that noise is is known to a tenth
    alone, _ = ask(0.0)  # nothing known of the angles: the torque's
    assert alone == pytest.approx(1.0, abs=0.06)


def test_a_motion_that_is_not_quite_the_same_hides_no_grain():
    """What differs from repeat to repeat in the torque that is predicted is motion, where the residual does not."""
    rng, period, count = np.random.default_rng(6), 500, 4
    grain, strays = 2.0 * np.tile(rng.standard_normal(period), count), 2.0 * rng.standard_normal(period * count)
    torque = strays + 0.1 * rng.standard_normal(period * count)
    left = torque - (strays + grain)
    rms, _ = repeats.scatter([[left]], [torque], [np.ones(len(torque), dtype=bool)], [float(period)], 4.0)
    assert rms == pytest.approx(2.0, rel=0.03)


@pytest.mark.parametrize("size", [1.0, 1.2])
@pytest.mark.parametrize(("share", "sure"), [(0.1, True), (0.8, False)])
def test_under_a_low_pass_a_torque_hidden_by_the_angles_noise_is_not_known(size, share, sure):
    """Of a power of 1.0 the angles' noise, drawn right or a fifth too large, makes little, or so much that what is left for the torque is hardly known."""
    low = Gaussian(10.0, 1e-3)
    found = NoiseFloor(1.0, 0.003, "spectral", "white", 0.994, 1.006)
    (told,) = filtered([found], low, np.array([share * size]), np.array([0.002 * size]))
    gain = float(np.sum(low.weights**2))
    truth = np.sqrt((1.0 - share) * gain + 0.002)
    assert (told.rms is not None) is sure
    assert told.low <= truth <= told.high


def test_what_is_drawn_counts_where_rows_do():
    drawn, kept = [np.array([[1.0, 3.0], [1.0, 5.0]])], [np.array([True, False])]
    assert repeats.mean_square(drawn, kept) == 1.0 and repeats.mean_square(None, kept) == 0.0


def test_noise_that_is_louder_in_the_training_logs_has_two_floors(simulated, tmp_path):
    """Three times as loud there: each part's error is at its own, and nothing is missing."""
    folder = shutil.copytree(simulated("quiet test", seed=21, duration=16.0), tmp_path / "louder")
    table, rng = pl.read_csv(folder / "train.csv"), np.random.default_rng(3)
    experiment = pipeline.load(folder)
    quiet = pipeline.fit(experiment).rms("test")
    louder = [pl.col(f"tau_{joint}") + np.sqrt(8.0) * quiet[joint] * rng.normal(size=table.height) for joint in quiet]
    table.with_columns(louder).write_csv(folder / "train.csv")
    experiment = pipeline.load(folder)
    fit = pipeline.fit(experiment)
    floors_, _ = floors_of_fit(experiment, fit, fit.model, fit.x, experiment_logs.read_all(experiment).parts)
    for joint, one in zip(fit.joints, floors_):
        assert one.rms == pytest.approx(quiet[joint], rel=0.1) and one.train == pytest.approx(3.0 * quiet[joint], rel=0.1)
        assert "on the training logs" in one.detail
    assert all(one.reached(error) for one, error in zip(floors_, as_of_test(fit.rms("train"), floors_).values()))
    assert {v.status for v in diagnose(experiment, fit=fit).verdict} == {"complete"}


@pytest.mark.parametrize(
    ("train", "test", "two"), [(1.0, 1.3, True), (1.3, 1.0, True), (1.0, 1.05, False), (0.0, 1.0, False), (None, 1.0, False), (0.0, 0.0, False)]
)
def test_floors_are_two_where_they_clearly_differ(train, test, two):
    both = NoiseFloor(1.1, 0.01, "spectral", "", halved=(0.05, 2.0, 1.0))
    floor_of = lambda rms: NoiseFloor(rms, None if rms is None else 0.01, "spectral", "here")  # noqa: E731
    seen = _of_each(both, floor_of(train), floor_of(test))
    assert (seen.rms, seen.train) == ((test, train) if two else (1.1, None))
    assert seen.halved == ((0.05, 2.0 * test / train, 1.0) if two else both.halved)


def test_errors_of_training_logs_are_seen_against_their_own_noise():
    both, louder = NoiseFloor(1.0, 0.02, "spectral", ""), NoiseFloor(1.0, 0.02, "spectral", "", train=4.0)
    assert as_of_test({"a": 1.5, "b": 6.0}, [both, louder]) == {"a": 1.5, "b": 1.5}


def test_noise_that_is_louder_in_the_middle_of_a_log_is_not_more_than_there_is():
    """A window weighs the middle three times as much as the rest; and what is loud there is no burst where it goes with the speed."""
    rng, step = np.random.default_rng(5), 0.004
    q = wandering(30.0, step, rng) * np.hanning(7500)[:, None]
    e = (0.3 + 2.0 * np.abs(np.gradient(q[:, 1], step)) / np.abs(np.gradient(q[:, 1], step)).max()) * rng.normal(size=len(q))
    result = found(q, step, e, nothing(q, step))
    assert result.rms == pytest.approx(e.std(), rel=0.08) and result.std < 0.06 * result.rms


@pytest.mark.parametrize(("length", "most"), [(10, 1.1), (25, 1.25)])
def test_bursts_at_any_speed_are_left_out(length, most):
    """They are louder than what is usual at their speed."""
    rng, n = np.random.default_rng(6), 20_000
    v = rng.normal(size=n)
    v[np.arange(n) % 400 < length] *= 20.0
    (kept,), _ = outliers.without([v], [np.ones(n, dtype=bool)], [0.01], 1.0, speeds=[np.sin(0.03 * np.arange(n))])
    assert np.sqrt(np.mean(v[kept] ** 2)) < most and kept.mean() > 0.8


@pytest.mark.parametrize("speeds", [True, False])
def test_values_that_hardly_change_have_no_usual_step(speeds):
    """Of values that come three times each most steps are zero."""
    rng = np.random.default_rng(7)
    v = np.repeat(rng.normal(size=400), 3)
    (kept,), _ = outliers.without([v], [np.ones(len(v), dtype=bool)], [0.01], 1.0, speeds=[rng.normal(size=len(v))] if speeds else None)
    assert kept.shape == v.shape


def test_a_floor_under_a_low_pass_is_what_comes_through(simulated):
    """Angles that are hardly smoothed make torque's noise many times what a low-pass lets through of it, and none of that is white."""
    folder = simulated("noise under a low-pass", seed=8, duration=16.0, rate=1000.0, encoder=14)
    text = (folder / "config.yaml").read_text()
    (folder / "low.yaml").write_text(text.replace("  torque: raw\n", "  torque: low-pass\n  window: 0.1\n"))
    experiment = pipeline.load(folder / "low.yaml")
    fit = pipeline.fit(experiment)
    read = experiment_logs.read_all(experiment)
    found, _ = floors_of_fit(experiment, fit, fit.model, fit.x, read.parts)
    for floor_, joint in zip(found, fit.joints):
        error = max(fit.rms("train")[joint], fit.rms("test")[joint])
        assert floor_.method == "spectral" and "carried through" in floor_.detail
        assert floor_.rms == pytest.approx(error, rel=0.25), joint


@pytest.mark.parametrize(("size", "share"), [(0.0, None), (1.0, 1.0 / 3.0), (0.2, None)])
def test_a_steady_tone_in_the_noise_is_told(size, share):
    """What makes it may be switched off, or be filtered out."""
    rng = np.random.default_rng(3)
    q = wandering(30.0, 0.004, rng)
    hum = size * np.sin(2.0 * np.pi * 17.3 * 0.004 * np.arange(len(q)))
    said = found(q, 0.004, rng.normal(size=len(q)) + hum, nothing(q, 0.004) + 1e-9 * q[:, 1], size=0.0).detail
    told = re.search(r"(\d+) % of the noise's power a steady tone of 17.3 Hz", said)
    assert ("tone" not in said) if share is None else float(told[1]) / 100.0 == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("noise", [white, coloured])
def test_logs_of_several_rates_have_the_noise_of_each(noise):
    """White noise of one size has another density at each rate: of all together it looked slow, and no floor was known."""
    rng, parts = np.random.default_rng(4), []
    for step in (0.01, 0.004, 1.0 / 150.0):
        q = wandering(20.0, step, rng)
        e = noise(len(q), step, rng)
        residual = np.zeros_like(q)
        residual[:, 1] = e + 0.2 * stribeck(q, step)
        parts.append((residual, torque(q, step) + residual, q, step, e))
    residual, measured, angles, steps, e = zip(*parts)
    told = floor(residual, measured, angles, steps, 1)
    true = np.sqrt(np.mean(np.concatenate(e) ** 2))
    assert told.rms is not None and abs(told.rms - true) < 0.1 * true and "each sampling rate by itself" in told.detail
    alike = floor(residual[:1] * 2, measured[:1] * 2, angles[:1] * 2, (0.01, 0.0101), 1)
    assert "each sampling rate" not in alike.detail


def test_what_functions_explain_but_for_rounding_is_explained_once():
    """A torque of one value: what is left may come out below nothing, and no function takes any of it."""
    rng = np.random.default_rng(0)
    for seed in range(50):
        x = np.column_stack([np.ones(91), np.ones(91), np.zeros(91), *rng.normal(size=(2, 91))])
        target = x @ [0.7 + 0.01 * seed, 0.0, 0.0, 0.3, 0.0]
        chosen, weights = _pursuit(x, target, 5)
        np.testing.assert_allclose(x[:, chosen] @ weights, target, atol=1e-9)
        assert len(chosen) <= 4
