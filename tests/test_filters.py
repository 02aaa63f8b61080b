"""A filter that is too narrow for how noisy angles are: chosen where none is said, told where one is."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from sysid import too_narrow
from sysid.filter_errors import held_out
from sysid.log import Log
from sysid.specs import PreprocessSpec
from sysid.statement import where
from sysid.unexplained import otherwise

from .conftest import JOINTS
from .problems import arm, arm_log


def noisy(size):
    """Angles of a log with white noise of a size [rad]."""

    def change(columns):
        rng = np.random.default_rng(5)
        angles = {f"q_{joint}": columns[f"q_{joint}"] + size * rng.standard_normal(len(columns["t"])) for joint in JOINTS}
        return columns | angles

    return change


@pytest.mark.parametrize("size", [2e-5, 3e-3])
def test_a_window_that_is_not_said_is_chosen_where_angles_are_noisy_for_it(experiment, cli, size):
    """Of 3 mrad a window of 0.1 s at 200 Hz leaves 2 rad/s^2 in the accelerations; of 0.02 mrad nothing."""
    file = experiment(train=noisy(size), test=noisy(size))
    said = cli("fit", file)
    found = json.loads((said.run / "fit.json").read_text())["filter"]
    assert "too_narrow" not in found
    if size < 1e-4:
        assert found["window"] == 0.1 and found["chosen"] == "usual" and "angles are noisy" not in said.out
    else:
        assert found["window"] > 0.1 and found["chosen"] == "held-out error" and len(found["held_out"]) > 3
        assert "as none is given, it is chosen by that" in " ".join(said.out.split())


def test_a_window_that_is_said_stays_and_is_told(experiment, cli):
    file = experiment(config={"preprocess.window": 0.1}, train=noisy(3e-3), test=noisy(3e-3))
    said = cli("fit", file)
    found = json.loads((said.run / "fit.json").read_text())["filter"]
    assert found["window"] == 0.1 and found["chosen"] == "given"
    narrow = found["too_narrow"]
    assert narrow["key"] == "window" and narrow["given"] == 0.1 and narrow["value"] == 0.2
    assert all(less < rms for rms, less in narrow["rms"].values()) and any(less < 0.9 * rms for rms, less in narrow["rms"].values())
    lines = said.out.split("next:")
    assert "write `window: auto` under `preprocess:`" in " ".join(lines[0].split()) and lines[1].startswith(" sysid fit ")


def test_an_effect_that_is_added_chooses_no_other_filter(experiment, cli):
    """What is promised of an effect is behind one filter, and so is what comes of it."""
    file = experiment(config={"preprocess.window": "auto"}, train=noisy(3e-3), test=noisy(3e-3))
    known = [json.loads((cli("fit", file).run / "fit.json").read_text())["filter"]]
    config = file / "config.yaml"
    text = yaml.safe_load(config.read_text())
    text["model"] = {"effects": ["viscous", "coulomb", {"stribeck": {"joints": [JOINTS[1]]}}, "torque_bias"]}
    config.write_text(yaml.safe_dump(text))
    known.append(json.loads((cli("fit", file).run / "fit.json").read_text())["filter"])
    assert known[0] == known[1] and known[0]["chosen"] == "held-out error"


def entry(window, error, rms, scatter=0.01):
    folds = 2.0 * np.log(error) + scatter * np.array([-1.0, 1.0, -1.0, 1.0])
    return {"window": window, "relative_error": error, "rms": dict(zip(JOINTS, rms)), "folds": folds.tolist()}


def test_only_what_smooths_more_and_leaves_clearly_less_is_told():
    given = entry(0.1, 0.2, (1.0, 1.0))
    wider = too_narrow.wider([entry(0.05, 0.3, (2.0, 2.0)), given, entry(0.2, 0.15, (0.8, 1.1))], "window", 0.1)
    assert wider == {"key": "window", "given": 0.1, "value": 0.2, "rms": {JOINTS[0]: [1.0, 0.8]}}
    # of one that smears reversals less the rows about them are left out in any case
    assert not too_narrow.wider([entry(0.05, 0.1, (0.5, 0.5)), given, entry(0.2, 0.3, (2.0, 2.0))], "window", 0.1)
    # less by chance; or by less than a noise floor is in doubt
    blurred = given | {"folds": (np.array(given["folds"]) + np.array([1.0, -1.0, 1.0, -1.0])).tolist()}
    assert not too_narrow.wider([blurred, entry(0.2, 0.19, (0.8, 0.8))], "window", 0.1)
    assert not too_narrow.wider([given, entry(0.2, 0.19, (0.95, 0.95))], "window", 0.1)
    assert list(too_narrow.wider([given, entry(0.2, 0.15, (0.8, 0.99))], "window", 0.1)["rms"]) == [JOINTS[0]]
    # a lower cutoff smooths more
    cut = [{**one, "cutoff": 1.0 / one.pop("window")} for one in (entry(0.1, 0.2, (1.0, 1.0)), entry(0.2, 0.15, (0.8, 0.8)))]
    assert too_narrow.wider(cut, "cutoff", 10.0)["value"] == 5.0


def test_a_filter_that_leaves_less_by_other_than_noise_of_the_angles_is_not_better():
    """What the angles' noise makes, once more, is less than half of what goes."""
    given, wide = entry(0.1, 0.2, (1.0, 1.0)), entry(0.2, 0.15, (0.8, 1.1))
    asked = []

    def by(square):
        return too_narrow.by_noise([given, wide], "window", 0.1, lambda value: asked.append(value) or square and dict(zip(JOINTS, (square, 0.0))))

    # of 0.36 in squares that go
    assert by(0.36) == {"key": "window", "given": 0.1, "value": 0.2, "rms": {JOINTS[0]: [1.0, 0.8]}} and by(0.2)
    assert by(0.1) == {}
    assert by(None)["value"] == 0.2 and asked == [0.2] * 4  # where it cannot be asked
    assert too_narrow.by_noise([given], "window", 0.1, by) == {}


def test_noise_of_angles_is_no_law_and_asks_for_no_log():
    class Found:
        filters = {"too_narrow": {"key": "window", "given": 0.1, "value": 0.2, "rms": {"elbow": [1.0, 0.8]}}}
        predictions = {"test": SimpleNamespace(still=(), thinned=lambda most: SimpleNamespace(states=None))}
        joints = JOINTS
        logs = ()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sysid.mean_by_log.other_means", lambda *_: {})
        said = otherwise(Found(), ())
    assert list(said) == ["elbow"] and "`window: auto` under `preprocess:`" in said["elbow"].says and not said["elbow"].settles
    verdict = [{"joint": joint, "status": "unresolved"} for joint in JOINTS]
    assert where.blind({"verdict": verdict, "too_narrow": Found.filters["too_narrow"]}) == ["shoulder"]


def test_what_the_angles_noise_makes_of_an_error_is_what_it_made():
    """Of exact angles nothing; of noisy ones as much as these errors have more than with exact ones, and of twice the noise four times that."""
    experiment, model, _, _, prior = arm()
    machine, made, errors = model.robot, [], []
    for size in (0.0, 2e-3, 4e-3):
        (segment,) = arm_log(machine, np.random.default_rng(3), noise=0.05).segments
        noisy = segment.q + size * np.random.default_rng(4).standard_normal(segment.q.shape)
        logs = [Log("made", Path("made"), "", (replace(segment, q=noisy),))]
        narrow, wide = PreprocessSpec(window=0.1), PreprocessSpec(window=0.2)
        squares = too_narrow.noise_makes(experiment, narrow, wide, model, logs, prior, 0.1)
        made.append(np.array(list(squares.values())))
        rms = held_out(experiment, narrow, model, logs, prior, 0.1)["rms"]
        errors.append(np.array(list(rms.values())) ** 2)
    heavy = errors[1] - errors[0] > 5.0 * errors[0]  # joints whose error is the angles' noise
    assert heavy.sum() >= 2 and np.all(made[0] < 0.1 * errors[0])
    ratio = made[1][heavy] / (errors[1] - errors[0])[heavy]
    # but for the last one, whose body is bent by the noise of all others, which its own noise does not make
    assert np.sum((ratio > 0.7) & (ratio < 1.4)) >= heavy.sum() - 1
    # nor does friction's sign where it nearly stands, which noise turns but once
    assert np.sum(np.abs(np.log((made[2] / made[1])[heavy] / 4.0)) < 0.2) >= heavy.sum() - 1
