"""What is left of a joint, slower than its motion: noise is as strong whatever the joint does, a law with a memory is not."""

import shutil

import numpy as np
import polars as pl
import pytest
from scipy.signal import lfilter

from sysid import pipeline, thinning
from sysid.diagnose.diagnosis import diagnose
from sysid.view import elsewhere
from sysid.view.strength import _quiet, strength


def slow(n: int, step: float, memory: float, seed: int) -> np.ndarray:
    """Noise (n,) of first order, of unit variance."""
    keep = np.exp(-step / memory)
    return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], np.random.default_rng(seed).normal(size=n))


@pytest.fixture(scope="module")
def with_torque(simulated, tmp_path_factory):
    """The folder of a plain arm to whose elbow's torque was added what `law(t, q, qd, noise)` says, noise of 0.4 s."""

    def make(name: str, law, **more):
        folder = shutil.copytree(simulated(f"plain, for {name}", seed=5, duration=20.0, **more), tmp_path_factory.mktemp(name) / "case")
        for seed, part in enumerate(("train", "test")):
            file = folder / f"{part}.csv"
            log = pl.read_csv(file)
            names = {kind: next(c for c in log.columns if c.startswith(kind) and "elbow" in c) for kind in ("q_", "tau_")}
            t, q = log[log.columns[0]].to_numpy(), log[names["q_"]].to_numpy()
            own = law(t, q, np.gradient(q, t), slow(len(t), t[1] - t[0], 0.4, seed))
            log.with_columns(pl.Series(names["tau_"], log[names["tau_"]].to_numpy() + own)).write_csv(file)
        return folder

    return make


LAWS = {
    "the same all the time": lambda t, q, qd, noise: 0.3 * noise,
    "louder for a while": lambda t, q, qd, noise: 0.3 * noise * np.exp(slow(len(t), t[1] - t[0], 1.0, 7)),
    "stronger in quick motion": lambda t, q, qd, noise: 0.45 * noise * (np.abs(qd) > np.median(np.abs(qd))),
    "at some angles": lambda t, q, qd, noise: 0.45 * noise * (q > np.median(q)),
    "a roller that creeps": lambda t, q, qd, noise: 0.4 * np.sin(8.0 * q + 6.0 * np.cumsum(np.abs(qd)) * (t[1] - t[0]) + noise),
}


@pytest.mark.parametrize("law", LAWS)
def test_the_strength_of_a_law_follows_the_motion_and_that_of_noise_nothing(with_torque, law):
    found = diagnose(pipeline.load(with_torque(law, LAWS[law])))
    elbow = found.verdict[1]
    read, _ = thinning.read(found.fit.experiment)
    laws = [strength(found.view, j, elsewhere(found.view, read.test, read.train)) for j in range(2)]
    assert laws[0].chance > 1e-3  # of the other joint
    if law in ("the same all the time", "louder for a while"):
        assert laws[1].chance > 1e-3 and elbow.follows is None
        return
    assert laws[1].chance < 1e-5 and laws[1].variables in ("qd_elbow", "q_elbow")
    assert elbow.status in ("unresolved", "unknown")
    if law == "a roller that creeps":  # of which nothing else is said
        assert elbow.status == "unresolved" and elbow.follows.variables == "qd_elbow"


def test_noise_of_coarse_angles_is_as_loud_as_the_inertia_that_it_moves(simulated):
    """It does follow the motion: beside more of it, drawn where it is, nothing stands out."""
    found = diagnose(pipeline.load(simulated("coarse, for strength", seed=6, duration=20.0, encoder=16)))
    chances = [strength(found.view, j).chance for j in range(2)]
    assert _quiet(found.view, 0) and min(chances) > 1e-3


def test_where_angles_make_most_of_the_rest_nothing_is_asked(simulated):
    """Of training logs; test logs that are quieter are no reason."""
    found = diagnose(pipeline.load(simulated("coarser, for strength", seed=6, duration=12.0, encoder=10)))
    read, _ = thinning.read(found.fit.experiment)
    more = elsewhere(found.view, read.test, read.train)
    assert [strength(found.view, j, more).chance for j in range(2)] == [1.0, 1.0]
