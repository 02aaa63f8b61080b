"""How late torque is read, under the noise of the angles."""

import json

import numpy as np
import pytest

from sysid import late, pipeline
from sysid.config import load
from sysid.experiment_logs import read_all
from sysid.uncertainty import Uncertainty

from .test_select import edited

EFFECTS = ["viscous", "coulomb", "armature"]


@pytest.mark.parametrize("effect, word, size", [("delay", "d", 0.006), ("current_lag", "T", 0.008)])
def test_of_coarse_angles_it_is_told_within_its_deviation(simulated, monkeypatch, effect, word, size):
    """Encoders of 14 bits, whose noise the controller answers at once and inertia turns into torque: by all frequencies alike least squares is many deviations off."""
    folder = simulated(f"late {effect}", f"{effect}:elbow:{word}={size}", seed=5, duration=15.0, encoder=14)
    file = edited(folder, "with", model={"effects": [*EFFECTS, {effect: {"joints": ["elbow"]}}]})
    (truth,) = json.loads((folder / "truth.json").read_text())["hidden"]
    at = lambda fit: fit.parameters_of(effect, 1)[f"{effect}.elbow.{word}"]  # noqa: E731
    found, std, _ = at(pipeline.fit(load(file)))
    assert abs(found - truth["values"][word]) < 2.0 * std < 0.1 * size
    monkeypatch.setattr(late, "slow_view", lambda *given: None)
    found, std, _ = at(pipeline.fit(load(file)))
    assert abs(found - truth["values"][word]) > 4.0 * std


def test_a_second_view_is_for_what_is_late_alone(simulated):
    folder = simulated("late delay", "delay:elbow:d=0.006", seed=5, duration=15.0, encoder=14)
    file = edited(folder, "beside", model={"effects": [*EFFECTS, {"torque_gain": {"joints": ["elbow"]}}, {"delay": {"joints": ["shoulder"], "d": 0.001}}]})
    experiment = load(file)
    _, model, prior = pipeline.build(experiment)
    assert len(model.shape_values) == 2 and not late.late(model)  # a gain behind any filter, and what the user holds
    logs = read_all(experiment).train
    assert late.slow_view(experiment, experiment.preprocess, model, logs, prior) is None
    experiment = load(edited(folder, "free", model={"effects": [*EFFECTS, {"delay": {"joints": ["elbow"]}}]}))
    _, model, prior = pipeline.build(experiment)
    spec = experiment.preprocess
    assert late.late(model) == [0]
    slow = late.slow_view(experiment, spec, model, logs, prior)
    assert slow is not None and all(piece.smoother.cutoff < 5.0 for piece in slow.pieces)
    other = spec.model_copy(update={"torque": "low-pass"})
    assert late.slow_view(experiment, other, model, logs, prior) is None


def test_what_other_rows_tell_takes_its_own_covariance_and_the_rest_follows():
    """Of y = G x + e, x as sure as it is said to be, in closed form; two that hardly differ here, and do there."""
    rng = np.random.default_rng(3)
    gain, root = rng.normal(size=(4, 2)), rng.normal(size=(4, 4))

    def joint(square) -> np.ndarray:
        return np.block([[gain @ square @ gain.T + root @ root.T, gain @ square], [square @ gain.T, square]])

    here, there = np.array([[1.0, 0.999], [0.999, 1.0]]), np.array([[1.0, -2.0], [-2.0, 25.0]])
    before = joint(here)
    found = Uncertainty(before, np.sqrt(np.diagonal(before)), np.ones(6)).told_elsewhere([4, 5], there)
    np.testing.assert_allclose(found.covariance, joint(there), atol=1e-9)
    np.testing.assert_allclose(found.std, np.sqrt(np.diagonal(joint(there))))
    lacking = np.where(np.arange(6) == 0, np.nan, np.sqrt(np.diagonal(before)))
    unknown = Uncertainty(before, lacking, np.ones(6)).told_elsewhere([4, 5], there)
    assert np.isnan(unknown.std[0])
    np.testing.assert_allclose(unknown.std[1:], found.std[1:])
    assert Uncertainty(before, lacking, np.ones(6)).told_elsewhere([], np.zeros((0, 0))).covariance is before


def test_of_fine_angles_and_a_short_log_all_frequencies_tell(simulated):
    """What the slow ones tell much worse, and not otherwise, is left where it is, no surer than they differ."""
    folder = simulated("late and short", "delay:elbow:d=0.006", seed=14, duration=3.0, encoder=0)
    fit = pipeline.fit(load(edited(folder, "with", model={"effects": [*EFFECTS, {"delay": {"joints": ["elbow"]}}]})))
    found, std, _ = fit.parameters_of("delay", 1)["delay.elbow.d"]
    assert abs(found - 0.006) < 2.0 * std and std < 2.0e-4
