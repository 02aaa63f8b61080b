"""Whether a model carries over to the test logs: residuals of known size and memory, and what is said of them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.prediction import Prediction
from sysid.transfer import Transfer, _slow, quieter, transfers

STEP = 0.01


def part(rng: np.random.Generator, sizes, *, spans=(20.0,), memory=0.0, use=None) -> Prediction:
    """Residuals of RMS `sizes`, one a joint, with `memory` [s], in logs of `spans` seconds."""
    counts = [round(span / STEP) for span in spans]
    pole = np.exp(-STEP / memory) if memory else 0.0
    noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.normal(size=(sum(counts), len(sizes))), axis=0)
    log = np.repeat(np.arange(len(counts)), counts)
    t = np.concatenate([STEP * np.arange(n) for n in counts])
    return Prediction(log, t, noise * sizes, np.zeros_like(noise), use)


def of(train: Prediction, test: Prediction) -> list[Transfer]:
    joints = tuple(f"j{k}" for k in range(train.measured.shape[1]))
    return transfers(SimpleNamespace(joints=joints, predictions={"train": train, "test": test}))


def test_the_ratio_is_that_of_the_errors():
    rng = np.random.default_rng(0)
    same, half, more = of(part(rng, (1.0, 2.0, 1.0)), part(rng, (1.0, 1.0, 1.6)))
    for found, truly, fails in ((same, 1.0, False), (half, 0.5, False), (more, 1.6, True)):
        assert found.ratio == pytest.approx(truly, rel=0.06) and found.fails is fails and bool(found.says) is fails
    assert "(20 s)" in more.says and f"{more.ratio:.2f} +- {more.se:.2g} times" in more.says


@pytest.mark.parametrize("memory", [0.0, 0.1])
def test_the_standard_error_is_how_much_the_ratio_varies(memory):
    rng = np.random.default_rng(1)
    found = [of(part(rng, np.ones(8), memory=memory), part(rng, np.ones(8), memory=memory)) for _ in range(12)]
    ratios, stated = (np.array([[getattr(t, name) for t in one] for one in found]).ravel() for name in ("ratio", "se"))
    assert 0.7 < np.std(np.log(ratios)) / np.sqrt(np.mean(stated**2)) < 1.3
    assert not any(t.fails for one in found for t in one)


def test_short_logs_are_told_with_their_lengths():
    rng = np.random.default_rng(2)
    (found,) = of(part(rng, [1.0], spans=(2.0, 3.0, 4.0)), part(rng, [1.8], spans=(3.0, 3.0)))
    assert found.fails and "the training logs (3 of 2 to 4 s) do not carry the model" in found.says


def test_where_nothing_tells_nothing_is_said():
    rng = np.random.default_rng(3)
    few = part(rng, [1.0])
    use = np.zeros((2000, 1), dtype=bool)
    use[:10] = True
    (found,) = of(few, part(rng, [9.0], use=use))
    assert np.isnan(found.ratio) and not found.fails and found.says == ""


@pytest.mark.parametrize(("cutoff", "fails"), [(None, False), (4.0, True)])
def test_noise_that_is_louder_is_no_model_that_does_not_carry_over(cutoff, fails):
    """White noise beyond the band is the test logs' own; an error that is as slow as arms move is the model's."""
    rng = np.random.default_rng(4)
    train, test = part(rng, [1.0], spans=(30.0,)), part(rng, [1.0], spans=(30.0,))
    more = rng.normal(size=test.measured.shape)
    if cutoff is not None:
        pole = np.exp(-2.0 * np.pi * cutoff * STEP)
        more = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], more, axis=0)
    test = replace(test, measured=test.measured + more)
    (found,) = transfers(SimpleNamespace(joints=("j0",), predictions={"train": train, "test": test}), 12.0)
    assert found.more and found.fails is fails and found.noisier is not fails
    assert ("carries over" in found.says) is not fails
    left = quieter({"j0": 1.41}, [found])["j0"]
    assert left == (1.41 if fails else pytest.approx(1.0, abs=0.15))


@pytest.mark.parametrize("band", [15.0, 6.0, 2.0])
def test_what_stands_beside_gaps_is_not_taken_for_noise(band):
    """A constant misfit about reversals, beside rows that are left out; and rows so few that no band sees any of them."""
    rng, number = np.random.default_rng(6), np.arange(3000) % 150
    use = (number >= 15)[:, None]
    train, test = part(rng, [1.0], spans=(30.0,), use=use), part(rng, [1.0], spans=(30.0,), use=use)
    beside = ((number >= 15) & (number < 25)) | (number >= 145)
    test = replace(test, measured=test.measured + 3.0 * beside[:, None])
    own = lambda **parts: transfers(SimpleNamespace(joints=("j0",), predictions=parts), band)[0]  # noqa: E731
    assert own(train=train, test=test).louder == 0.0
    few = (np.arange(3000) % 30 >= 15)[:, None]
    drift = 3.0 * np.sin(2.0 * np.pi * 0.3 * STEP * np.arange(3000))[:, None]
    train, test = replace(train, use=few), replace(test, use=few, measured=drift)
    assert own(train=train, test=test).fails


def test_each_log_has_a_rate_of_its_own():
    """A misfit of 4 Hz in a log at 100 Hz beside one at 1 kHz."""
    rng = np.random.default_rng(7)

    def both(size: float) -> Prediction:
        counts, steps = (20_000, 12_000), (1e-3, 1e-2)
        t = np.concatenate([step * np.arange(n) for n, step in zip(counts, steps)])
        log = np.repeat([0, 1], counts)
        values = rng.normal(size=(len(t), 1)) + size * (np.sin(2.0 * np.pi * 4.0 * t) * (log == 1))[:, None]
        return Prediction(log, t, values, 0.0 * values, None)

    (found,) = transfers(SimpleNamespace(joints=("j0",), predictions={"train": both(0.0), "test": both(2.5)}), 15.0)
    assert found.fails and not found.noisier


def test_rows_that_do_not_count_are_in_no_band():
    """Beside a gap a low-pass sees too little to say what is slow."""
    rng, use = np.random.default_rng(5), np.ones((3000, 1), dtype=bool)
    use[:, 0] = np.arange(3000) % 300 > 100
    spoilt = part(rng, [1.0], spans=(30.0,), use=use)
    spoilt = replace(spoilt, measured=np.where(use, spoilt.measured, 50.0))
    slow = _slow(spoilt, spoilt.residual, 5.0)
    assert 0 < slow.use.sum() < use.sum() and not (slow.use & ~use).any()
    assert np.abs(slow.residual).max() < 1.5
