"""The low-pass of a diagnosis: a zero-phase Gaussian over both sides, standstill and events left out with its reach."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid import regressor
from sysid.events import Event
from sysid.log import Log, Segment
from sysid.lowpass import Gaussian, lowpassed, narrowed, stride_of, widest
from sysid.standstill import standstill_speed

STEP = 1e-3


@pytest.mark.parametrize("cutoff", (8.0, 15.0, 40.0))
def test_gaussian_is_one_at_rest_and_half_the_power_at_its_cutoff(cutoff):
    low_pass = Gaussian(cutoff, STEP)
    assert low_pass.weights.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(low_pass.weights, low_pass.weights[::-1], rtol=0, atol=1e-17)  # zero phase
    shifts = np.arange(-low_pass.reach, low_pass.reach + 1)
    for f in (0.3, 1.0, 1.5):  # of the cutoff; a Gaussian's spectrum is a Gaussian
        gain = np.sum(low_pass.weights * np.cos(2.0 * np.pi * f * cutoff * STEP * shifts))
        assert gain == pytest.approx(2.0 ** (-0.5 * f**2), abs=2e-4)
    # a sine keeps its phase
    t = np.arange(3000) * STEP
    wave = np.sin(2.0 * np.pi * cutoff * t)
    inside = slice(low_pass.reach, -low_pass.reach)
    np.testing.assert_allclose(low_pass(wave)[inside], wave[inside] / np.sqrt(2.0), atol=2e-4)


def test_gaussian_s_memory_is_its_reach():
    low_pass = Gaussian(15.0, STEP)
    impulse = np.zeros(4 * low_pass.reach + 1)
    middle = 2 * low_pass.reach
    impulse[middle] = 1.0
    seen = np.flatnonzero(low_pass(impulse))
    assert (seen[0], seen[-1]) == (middle - low_pass.reach, middle + low_pass.reach)
    assert low_pass.reach * STEP < 0.6 / 15.0  # s: a fraction of a cycle of the cutoff


@pytest.mark.parametrize("rows", [slice(0, 500, 1), slice(0, 500, 7), slice(60, 440, 7), slice(61, 439, 3), slice(100, 101, 5), slice(499, 500, 1), slice(30, 30, 2)])
def test_at_some_rows_is_the_filter_at_those_rows(rows):
    values = np.random.default_rng(0).normal(size=(2, 3, 500))
    low_pass = Gaussian(15.0, STEP)
    full = low_pass(values)
    slow = np.stack([
        np.sum(low_pass.weights * values[..., np.clip(np.arange(i - low_pass.reach, i + low_pass.reach + 1), 0, 499)], axis=-1) for i in range(500)
    ], axis=-1)  # fmt: skip
    np.testing.assert_allclose(full, slow, rtol=0, atol=1e-13)
    np.testing.assert_allclose(low_pass.at(values, rows), full[..., rows], rtol=0, atol=1e-14)
    np.testing.assert_allclose(low_pass(np.moveaxis(values, -1, 0), axis=0), np.moveaxis(full, -1, 0), rtol=0, atol=0)


# ---- the domain


def smooth(t, seed: int = 0, fastest: float = 1.5):
    """q, qd, qdd (n, 2): sines."""
    rng = np.random.default_rng(seed)
    w = 2.0 * np.pi * rng.uniform(0.2, fastest, (4, 1, 2))
    a, p = rng.uniform(0.1, 0.35, (4, 1, 2)), rng.uniform(0, 2 * np.pi, (4, 1, 2))
    phase = w * t[None, :, None] + p
    return (a * np.sin(phase)).sum(0), (a * w * np.cos(phase)).sum(0), -(a * w**2 * np.sin(phase)).sum(0)


def a_log(t, q, tau) -> Log:
    return Log("made", Path("made"), "", (Segment(t, float(t[1] - t[0]), q, tau, None, None, {}),))


def test_thinned_domain_is_the_domain_of_all_samples(planar):
    """Laws are evaluated at every few samples and low-passed there; on smooth motion nothing is lost by that."""
    arm = planar
    t = np.arange(8000) * STEP
    q, qd, qdd = smooth(t)
    tau = regressor.torque(arm, arm.prior, q, qd, qdd)
    (thin,) = lowpassed([a_log(t, q, tau)], arm.joints, 15.0).pieces
    every = round(thin.step / STEP)
    assert every == 4  # 16 samples a cycle of the cutoff
    both, angles = Gaussian(15.0, STEP), Gaussian(60.0, STEP)
    rows = np.round(thin.t / STEP).astype(int)
    seen = angles(np.apply_along_axis(np.convolve, 0, tau, np.array([1.0, 10.0, 1.0]) / 12.0, "same"), axis=0)  # as a difference sees
    np.testing.assert_allclose(thin.tau[thin.core], both(seen, axis=0)[rows][thin.core], rtol=0, atol=1e-12)
    np.testing.assert_allclose(thin.q, angles(q, axis=0)[rows], rtol=0, atol=1e-12)
    # the model's torque at every few samples, low-passed there, against all samples low-passed
    model = regressor.torque(arm, arm.prior, thin.q, thin.qd, thin.qdd)
    ours = thin.smoother(model, axis=0)[thin.core]
    theirs = thin.tau[thin.core]
    assert np.sqrt(np.mean((ours - theirs) ** 2)) < 1e-4 * np.sqrt(np.mean(theirs**2))
    dense = angles(q, axis=0)
    speed, bend = np.gradient(dense, STEP, axis=0), np.zeros_like(dense)
    bend[1:-1] = np.diff(dense, 2, axis=0) / STEP**2
    same = both(regressor.torque(arm, arm.prior, dense, speed, bend), axis=0)[rows][thin.core]
    np.testing.assert_allclose(ours, same, rtol=0, atol=2e-5 * np.abs(theirs).max())
    # friction jumps between two kept samples: what that costs is small beside the jump
    jump = thin.smoother(np.sign(thin.qd), axis=0)[thin.core] - both(np.sign(speed), axis=0)[rows][thin.core]
    assert np.abs(jump).max() < 0.19  # half a kept step at the kernel's peak; the jump is 2


def test_a_slow_logger_does_not_make_the_inertia_look_soft(planar):
    """At 100 Hz a second difference takes a tenth of what is fast: of the torque as much is taken."""
    t = np.arange(2000) * 0.01
    q, qd, qdd = smooth(t, fastest=8.0)
    (piece,) = lowpassed([a_log(t, q, regressor.torque(planar, planar.prior, q, qd, qdd))], planar.joints, 15.0).pieces
    model = piece.smoother(regressor.torque(planar, planar.prior, piece.q, piece.qd, piece.qdd), axis=0)[piece.core]
    left = np.sqrt(np.mean((piece.tau[piece.core] - model) ** 2, axis=0))
    assert (left < 0.01 * np.std(model, axis=0)).all()


def test_rows_at_standstill_are_left_out_with_what_the_filters_see_of_them(planar):
    t = np.arange(8000) * STEP
    q, _, _ = smooth(t)
    q[3000:5000, 1] = q[3000, 1]
    motion = lowpassed([a_log(t, q, np.zeros_like(q))], planar.joints, 15.0)
    (piece,) = motion.pieces
    still = np.abs(piece.qd) < standstill_speed([replace(piece, use=None)])
    reach = piece.smoother.reach + -(-(Gaussian(60.0, STEP).reach + 1) // 4)  # both, one after the other
    wide = np.array([[still[max(0, i - reach) : i + reach + 1, j].any() for j in range(2)] for i in range(len(still))])
    assert not (piece.use & wide).any()
    turns = np.abs(np.diff(np.sign(piece.qd), axis=0, prepend=np.sign(piece.qd[:1]))) > 0
    near = np.array([[turns[max(0, i - reach - 2) : i + reach + 3, j].any() for j in range(2)] for i in range(len(still))])
    assert piece.use[~wide & ~near].all()  # and nothing else is
    pause = (piece.t >= 3.0) & (piece.t < 5.0)
    assert not piece.use[pause, 1].any() and piece.use[pause, 0].mean() > 0.6
    assert 0.4 < piece.use[:, 0].mean() < 1.0


def test_logs_too_short_for_the_low_pass_give_no_domain(planar):
    t = np.arange(120) * STEP
    q, qd, qdd = smooth(t)
    assert lowpassed([a_log(t, q, q)], planar.joints, 8.0) is None
    t = np.arange(4000) * STEP
    motion = lowpassed([a_log(t, *smooth(t)[:2])], planar.joints, 15.0)
    assert stride_of(motion, 15.0) * motion.pieces[0].step == pytest.approx(0.01, rel=0.3)  # about 100 rows a second


# ---- events


@pytest.mark.parametrize(("kind", "joints", "signal", "masked"), [
    ("knock", ("shoulder", "elbow"), "both", (0, 1)), ("brake", ("elbow",), "torque", (1,)), ("frozen", ("elbow",), "torque", (1,)),
    ("frozen", ("elbow",), "position", (0, 1)), ("saturation", ("elbow",), "torque", ()),
])  # fmt: skip
def test_events_are_left_out_with_the_filters_reach(planar, kind, joints, signal, masked):
    """Every row that saw a disturbed sample, and no other: what stands in those samples changes no row that counts."""
    t = np.arange(8000) * STEP
    q, qd, qdd = smooth(t)
    tau = regressor.torque(planar, planar.prior, q, qd, qdd)
    event = Event(kind, "made", 4.0, 4.05, joints, signal)
    wild = (t >= 4.0) & (t <= 4.05)
    seen = []
    for extra in (0.0, 1.0):
        own = [planar.joints.index(joint) for joint in joints]
        angle, torque = q.copy(), tau.copy()
        if signal in ("position", "both"):
            angle[np.ix_(wild, own)] += 0.01 * extra
        if signal in ("torque", "both"):
            torque[np.ix_(wild, own)] += 20.0 * extra
        seen.append(lowpassed([replace(a_log(t, angle, torque), events=(event,))], planar.joints, 15.0))
    calm, stirred = (motion.pieces[0] for motion in seen)
    assert seen[0].events == (event,)
    bare = lowpassed([a_log(t, q, tau)], planar.joints, 15.0).pieces[0]
    gone = bare.use & ~calm.use
    assert sorted({int(j) for j in np.flatnonzero(gone.any(axis=0))}) == list(masked)
    if not masked:
        assert seen[0].disturbed == 0.0
        return
    assert seen[0].disturbed > 0
    for name in ("q", "qd", "qdd", "tau"):
        one, other = getattr(calm, name), getattr(stirred, name)
        for j in masked if signal != "torque" else own:
            # a joint's equation needs every joint's angles and its own torque
            columns = [j] if name == "tau" else range(2)
            for k in columns:
                np.testing.assert_allclose(one[calm.use[:, j], k], other[calm.use[:, j], k], rtol=0, atol=1e-9)
    # and no more than the filters see: both, one after the other
    widest = (calm.smoother.reach + 1) * calm.step + (Gaussian(60.0, STEP).reach + 1) * STEP
    for j in masked:
        times = calm.t[gone[:, j]]
        assert 4.0 - widest - calm.step <= times.min() and times.max() <= 4.05 + widest + calm.step


def test_a_spike_is_mended_before_it_is_spread(planar):
    """A straight line in its place: the rows about it count, and are what they were."""
    t = np.arange(8000) * STEP
    q, qd, qdd = smooth(t)
    tau = regressor.torque(planar, planar.prior, q, qd, qdd)
    spiked = tau.copy()
    spiked[4000:4002, 0] += 500.0
    event = Event("spike", "made", t[4000], t[4001], ("shoulder",))
    plain = lowpassed([a_log(t, q, tau)], planar.joints, 15.0).pieces[0]
    mended = lowpassed([replace(a_log(t, q, spiked), events=(event,))], planar.joints, 15.0).pieces[0]
    np.testing.assert_allclose(mended.tau, plain.tau, rtol=0, atol=1e-3 * np.abs(tau).max())
    assert (plain.use & ~mended.use).sum() <= 1
    raw = lowpassed([a_log(t, q, spiked)], planar.joints, 15.0).pieces[0]
    assert np.abs(raw.tau - plain.tau).max() > 0.1 * np.abs(tau).max()


# ---- how wide a band


@pytest.mark.parametrize(("fastest", "told"), [(1.5, 15.0), (10.0, 40.0)])
def test_the_band_is_as_wide_as_the_motion_asks(fastest, told):
    """A slow arm's band is the least; at ten hertz it is four times that."""
    t = np.arange(20_000) * STEP
    q = 0.3 * np.sin(2.0 * np.pi * fastest * t)[:, None] * [1.0, 0.5]
    assert widest([a_log(t, q, q)]) == pytest.approx(told, rel=0.02)
    assert widest([]) == 15.0 == widest([a_log(t, 0.0 * q, q)])


def test_the_noise_of_coarse_angles_does_not_widen_the_band():
    """Rounding fills the spectrum of the speed up to the last frequency: that is no motion."""
    t = np.arange(20_000) * STEP
    q = 0.3 * np.sin(2.0 * np.pi * 0.6 * t)[:, None] * [1.0, 0.5]
    for grain in (2e-4, 1e-3):
        coarse = grain * np.round(q / grain)
        assert widest([a_log(t, coarse, q)]) == 15.0
    fast = 0.1 * np.sin(2.0 * np.pi * 10.0 * t)[:, None] * [1.0, 0.5]
    assert widest([a_log(t, 1e-3 * np.round(fast / 1e-3), q)]) == pytest.approx(40.0, rel=0.05)


def test_lumps_of_noise_far_above_the_motion_do_not_widen_the_band():
    """As much as a thirtieth of the speed's power, between 150 and 200 Hz: rounding of slow motion makes such."""
    t, rng = np.arange(20_000) * STEP, np.random.default_rng(1)
    q = 0.3 * np.sin(2.0 * np.pi * 0.6 * t)[:, None] * [1.0, 0.5]
    lump = np.fft.rfft(rng.normal(size=q.shape), axis=0)
    f = np.fft.rfftfreq(len(t), STEP)
    lump[(f < 150.0) | (f > 200.0)] = 0.0
    lump = np.fft.irfft(lump, len(t), axis=0)
    noise = 0.18 * np.diff(q, axis=0).std(axis=0) / np.diff(lump, axis=0).std(axis=0)
    assert widest([a_log(t, q + noise * lump + 1e-6 * rng.normal(size=q.shape), q)]) == 15.0


def test_a_knock_does_not_widen_the_band():
    """What an arm is pushed to for 40 ms is no motion of its own."""
    t = np.arange(20_000) * STEP
    q = 0.3 * np.sin(2.0 * np.pi * 0.6 * t)[:, None] * [1.0, 0.5]
    struck = q + 0.05 * np.exp(-(((t - 7.0) / 0.01) ** 2))[:, None]
    knock = Event("knock", "log", 6.98, 7.02, ("a", "b"), "both")
    assert widest([a_log(t, struck, q)]) > 40.0
    assert widest([replace(a_log(t, struck, q), events=(knock,))]) == 15.0


def test_the_band_narrows_with_the_angles_noise():
    """To where it makes a quarter: the power of what acceleration makes of white noise grows with the fourth power, as is said."""
    assert narrowed(15.0, 0.1) == narrowed(15.0, 0.25) == narrowed(15.0, 0.0) == 15.0
    assert narrowed(15.0, 4.0) == pytest.approx(7.5)


def test_the_angles_noise_is_read_off_the_log(planar):
    t = np.arange(8000) * STEP
    q, _, _ = smooth(t)
    rng = np.random.default_rng(0)
    noisy = q + rng.normal(size=q.shape) * [1e-4, 5e-4]
    (piece,) = lowpassed([a_log(t, noisy, noisy)], planar.joints, 15.0).pieces
    np.testing.assert_allclose(piece.noise, [1e-4, 5e-4], rtol=0.05)


def test_noise_drawn_again_is_as_loud_as_the_noise_is_there():
    """White noise whose size follows the speed, as jittered stamps make it: the second draw has the same size in each stretch."""
    from types import SimpleNamespace

    from sysid.lowpass.angles import rougher

    rng = np.random.default_rng(3)
    t = np.arange(0.0, 20.0, 0.01)
    size = 1e-3 * (0.2 + np.abs(np.sin(0.5 * t)))[:, None]
    q = np.sin(0.5 * t)[:, None] + size * rng.normal(size=(len(t), 1))
    drawn = rougher(SimpleNamespace(q=q, step=0.01), np.median(size, axis=0), 15.0, rng) - q
    for part in np.array_split(np.arange(len(t)), 10):
        assert np.sqrt(np.mean(drawn[part] ** 2)) == pytest.approx(np.sqrt(np.mean(size[part] ** 2)), rel=0.35)


@pytest.mark.parametrize("resting", [0.0, 1e-16])
def test_noise_drawn_again_is_no_louder_where_a_log_stands_through_its_middle(resting):
    """A brake holds the joint for two thirds of the log, and what a file keeps of its angle there is rounding or nothing."""
    from types import SimpleNamespace

    from sysid.lowpass.angles import rougher

    rng = np.random.default_rng(3)
    t = np.arange(0.0, 9.0, 0.01)
    moves = (t > 3.0) & (t < 6.0)
    size = np.where(moves, 1e-4, resting)[:, None]
    q = np.where(moves, np.sin(t - 3.0), 0.0)[:, None] + size * rng.normal(size=(len(t), 1))
    drawn = rougher(SimpleNamespace(q=q, step=0.01), np.array([1e-4]), 15.0, rng) - q
    assert np.std(drawn[350:550]) == pytest.approx(1e-4, rel=0.3)
    assert np.abs(drawn[:250]).max() < 1e-15 and np.abs(drawn).max() < 0.05


@pytest.mark.parametrize("grain", [2e-4, 1e-3])
def test_rounding_is_drawn_again_as_rounding(grain):
    """Where an arm moves slowly, rounding makes slow errors, not white ones: those drawn have their size in each band."""
    from types import SimpleNamespace

    from sysid.lowpass.angles import grains, rougher

    t = np.arange(0.0, 40.0, 1e-3)
    truly = 250.0 * grain * np.sin(0.7 * t)[:, None] + 100.0 * grain * np.sin(2.1 * t + 1.0)[:, None]
    q = grain * np.round(truly / grain)
    assert grains(q) == pytest.approx([grain]) and grains(truly) == [0.0]
    noise = np.array([grain / np.sqrt(12.0)])
    band = lambda e, low, high: np.sqrt(np.sum(np.abs(np.fft.rfft(e)[int(low * 40) : int(high * 40)]) ** 2))  # noqa: E731
    made = (q - truly)[:, 0]
    for low, high in ((2.0, 10.0), (10.0, 50.0), (50.0, 400.0)):
        drawn = [
            band((rougher(SimpleNamespace(q=q, step=1e-3), noise, 15.0, np.random.default_rng(k)) - q)[:, 0], low, high)
            for k in range(8)
        ]
        assert np.sqrt(np.mean(np.square(drawn))) == pytest.approx(band(made, low, high), rel=0.4)


@pytest.mark.parametrize(("seed", "digits"), [(0, 6), (1, 7)])
def test_a_grain_is_told_at_any_speed_though_files_round_it_again(seed, digits):
    """Of 17 bits at 250 Hz and many grains a sample, to six digits of a radian."""
    from sysid.lowpass.angles import grains

    grain, t = 2.0 * np.pi / 2**17, np.arange(0.0, 20.0, 0.004)
    truly = 0.8 * np.sin(1.1 * t + seed)[:, None] + 0.3 * np.sin(2.7 * t)[:, None]
    q = np.round(grain * np.round(truly / grain), digits)
    assert grains(q) == pytest.approx([grain], rel=1e-4)


def test_a_steady_turn_is_not_taken_for_an_encoder():
    """All of its steps are nearly alike, whatever rounds them."""
    from sysid.lowpass.angles import grains

    q = np.cumsum(1e-3 * (1.0 + 0.02 * np.random.default_rng(0).normal(size=8000)))[:, None]
    assert grains(q) == [0.0]


@pytest.mark.parametrize("band", [0.0, 0.001])
def test_noise_is_drawn_again_of_a_joint_that_hardly_moves(band):
    from types import SimpleNamespace

    from sysid.lowpass import hardly_moving
    from sysid.lowpass.angles import rougher

    rng = np.random.default_rng(0)
    q = 2e-4 * np.round(0.6 * rng.normal(size=(2000, 1)))
    drawn = rougher(SimpleNamespace(q=q, step=1e-3), np.array([1e-4]), hardly_moving(15.0, band), rng)
    assert np.isfinite(drawn).all() and hardly_moving(15.0, 4.0) == 8.0 and hardly_moving(15.0, 9.0) == 15.0


def test_windows_that_overlap_are_summed_as_each_alone():
    """Every window by hand, whatever its size, stride and the number of values."""
    from sysid.gaussian import _weighed

    rng = np.random.default_rng(0)
    for _ in range(200):
        size, stride = 2 * int(rng.integers(1, 60)) + 1, int(rng.integers(1, 12))
        values, weights = rng.normal(size=(3, size + int(rng.integers(0, 300)))), rng.random(size)
        starts = range(0, values.shape[1] - size + 1, stride)
        wanted = np.array([values[:, k : k + size] @ weights for k in starts]).T
        np.testing.assert_allclose(_weighed(values, weights, stride), wanted, atol=1e-12)


def test_a_closed_brake_says_nothing_of_the_noise_in_motion():
    """An angle that is held for most of the log, to the last digit or to what a spline leaves of it, is as noisy as it is where it moves."""
    from types import SimpleNamespace

    from sysid.lowpass.angles import angle_noise, rougher

    rng = np.random.default_rng(2)
    t = 0.01 * np.arange(3000)
    q = np.sin(t)[:, None] * np.ones(2)
    noisy = q + 1e-4 * rng.normal(size=q.shape)
    moves = t > 20.0
    held = np.where(moves[:, None], noisy, noisy[~moves][-1])
    for braked in (held, held + 1e-13 * rng.normal(size=q.shape)):
        segment = SimpleNamespace(q=braked, step=0.01)
        noise = angle_noise(segment, 3.0)
        np.testing.assert_allclose(noise, 1e-4, rtol=0.3)
        more = rougher(segment, noise, 3.0, np.random.default_rng(3)) - braked
        np.testing.assert_allclose(more[t > 20.5].std(axis=0), 1e-4, rtol=0.3)
        assert np.abs(more[t < 19.5]).max() < 1e-9
    assert not angle_noise(SimpleNamespace(q=np.ones((3000, 2)), step=0.01), 3.0).any()
