"""What a fit says of its own numbers: a joint that stands in the test logs, an error that is another in each log."""

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from sysid import pipeline, plausible
from sysid.brief import brief
from sysid.noise import NoiseFloor
from sysid.plausible import implausible, outdated
from sysid.prediction import Prediction, States
from sysid.pressed import pressed
from sysid.unexplained import otherwise


@pytest.fixture
def folder(simulated, tmp_path):
    return shutil.copytree(simulated("three logs", seed=12, duration=8.0, logs=3), tmp_path / "case")


def changed(folder, file: str, **columns):
    table = pl.read_csv(folder / file)
    table.with_columns(**{name: make(table[name]) for name, make in columns.items()}).write_csv(folder / file)


def said(folder) -> list[str]:
    return [text for text in pipeline.fit(pipeline.load(folder)).notices if "another in some logs" in text or "in motion" in text or "implausible" in text]


@pytest.mark.long
def test_logs_that_differ_in_nothing_are_not_said_to(folder):
    assert said(folder) == []


def test_an_offset_that_one_log_has_is_said_with_its_log(folder):
    changed(folder, "train_2.csv", tau_elbow=lambda tau: tau + 0.5)
    (text,) = said(folder)
    assert "elbow is another" in text and "N m in train_2.csv" in text and "shoulder" not in text


def test_a_joint_that_stands_in_the_test_log_is_not_called_wrong(folder):
    """Its torque is what friction at rest holds: any number up to the greatest."""
    table = pl.read_csv(folder / "test.csv")
    rest = 0.8 * (1.0 - 2.0 * (pl.Series(range(len(table))) // 500 % 2))
    changed(folder, "test.csv", q_elbow=lambda q: 0.0 * q + 0.3, tau_elbow=lambda tau: 0.0 * tau + rest)
    texts = said(folder)
    assert any(text.startswith("the test logs do not show elbow in motion") for text in texts)
    assert not any("worse than none" in text and "elbow" in text for text in texts)
    found = pipeline.fit(pipeline.load(folder))
    assert {part: told.still for part, told in found.predictions.items()} == {"train": (), "test": ("elbow",)}
    floors = [NoiseFloor(1.0, 0.01, "spectral", "")] * 2
    assert otherwise(found, floors)["elbow"].settles  # whatever a low-pass makes of how it creeps


@pytest.mark.parametrize(("missing", "noise", "held"), [(5.0, 0.05, True), (0.5, 0.05, False), (0.0, 1.0, False), (0.0, 0.05, False)])
def test_a_joint_that_presses_on_a_stop_as_it_stands_is_held_by_it(missing, noise, held):
    """By more than its friction of 0.3; friction at rest, which is less than twice that of motion, and noise alone hold nothing."""
    t = np.arange(4000) * 0.005
    q = np.minimum(1.5 * np.sin(2.0 * t), 1.2)[:, None]  # it goes no farther
    qd = np.gradient(q, 0.005, axis=0)
    measured = np.where(q >= 1.2, missing, 0.0) + noise * np.random.default_rng(1).normal(size=q.shape)
    use = np.ones(q.shape, bool)
    whole = Prediction(np.zeros(len(t)), t, measured, np.zeros(q.shape), use, ("elbow",), ("N m",), States(np.arange(len(t)), q, qd))
    quiet = replace(whole, measured=0.0 * measured + 0.01)
    fit = SimpleNamespace(joints=("elbow",), predictions={"train": whole, "test": quiet}, parameters_of=lambda *_: {"Fc": (0.3, 0.01, "N m")})
    found = pressed(fit)
    assert bool(found) is held
    if held:
        assert found["elbow"].settles and "on the training logs" in found["elbow"].says and "about 1.2 rad: 5 N m is missing there" in found["elbow"].says


@pytest.mark.parametrize(
    ("at", "told"),
    [((24.8,), "test.csv, 24.75 to 25.00 s"), ((3.3, 12.05), "test.csv, 3.25 to 3.50 s and test.csv, 12.00 to 12.25 s"), ((3.0, 9.0, 15.0), ""), ((), "")],
)
def test_what_comes_once_is_no_law(at, told):
    """A joint that is at its noise but for the end of a log, or two moments of it; of three something may do it time and again."""
    t = np.arange(5000) * 0.005
    left = np.random.default_rng(1).normal(size=(5000, 1))
    quiet = Prediction(np.zeros(len(t)), t, left, np.zeros(left.shape), None, ("elbow",), ("N m",))
    loud = left + 20.0 * sum(((t >= own) & (t < own + 0.1) for own in at), np.zeros(len(t)) > 1.0)[:, None]
    rms = {part: {"elbow": float(np.sqrt(np.mean(values**2)))} for part, values in (("train", left), ("test", loud))}
    logs = [{"part": part, "log": f"{part}.csv"} for part in ("train", "test")]
    fit = SimpleNamespace(joints=("elbow",), predictions={"train": quiet, "test": replace(quiet, measured=loud)}, rms=rms.get, logs=logs)
    found = brief(fit, [NoiseFloor(1.0, 0.02, "spectral", "")])
    assert ([told] if told else []) == [one.says.partition(" but for ")[2].partition(": what comes once")[0] for one in found.values()]
    assert brief(fit, [NoiseFloor(None, None, "none", "")]) == {}


@pytest.mark.parametrize(("train", "r2", "test", "said"), [(0.17, 0.9, 0.175, False), (0.17, 0.9, 0.3, True), (0.17, -0.1, 0.17, True)])
def test_torque_that_hardly_varies_in_the_test_logs_is_no_fault_of_the_model(train, r2, test, said):
    """Noise alone is left there, as in the training logs, and it is more than the torque varies by."""
    part = lambda rms, r2: SimpleNamespace(errors=lambda: {"rms": np.array([rms]), "r2": np.array([r2])}, greatest=lambda fewest: np.zeros((fewest, 1)))  # noqa: E731
    source = SimpleNamespace(joints={"yaw": SimpleNamespace(effort=np.inf)})
    fit = SimpleNamespace(
        joints=("yaw",),
        predictions={"train": part(train, r2), "test": part(test, -0.26)},
        model=SimpleNamespace(robot=SimpleNamespace(source=source), coefficients=()),
        held=(),
    )
    assert any("worse than none" in text for text in implausible(fit)) == said


def test_a_mean_by_log_that_a_claim_takes_is_no_longer_told(monkeypatch):
    """A load in some logs is another mean there, until it is in the model."""
    means = {"fit": {"a": (0.5,), "b": (0.4,)}, "last": {"a": (0.02,), "b": (0.4,)}}
    monkeypatch.setattr(plausible, "other_means", lambda one, logs: means[one.name])
    said = [f"what is left of {joint} is another in some logs, in the mean +1 N m in a.csv" for joint in "ab"]
    fit, last = (SimpleNamespace(name=name, logs=(), notices=["rows are left out", *said], masses={}) for name in means)
    assert outdated(fit, last) == said[:1] and outdated(fit, fit) == []


def test_masses_that_a_claim_brings_back_are_no_longer_told(monkeypatch):
    """What else would have brought them back is beside what was named."""
    monkeypatch.setattr(plausible, "other_means", lambda one, logs: {})
    says = "implausible masses, the URDF's in brackets: fore 9 kg (2 kg); the effect spring brings them back"
    fit, last = (SimpleNamespace(logs=(), notices=[says], masses=own) for own in ({"says": says}, {}))
    assert outdated(fit, last) == [says] and outdated(fit, fit) == []


def test_a_torque_s_zero_that_was_set_anew_is_told_and_no_log_is_designed(experiment, cli):
    """In the test log the elbow's torque has another zero: no effect that is there, and another log would have its own again."""
    size = 0.3

    def noisy(seed, zero):
        def change(columns):
            rng = np.random.default_rng(seed)
            tau = {name: columns[name] + 0.02 * rng.standard_normal(len(columns["t"])) for name in columns if name.startswith("tau_")}
            return columns | tau | {"tau_elbow": tau["tau_elbow"] + zero}

        return change

    said = cli("diagnose", experiment(train=noisy(1, 0.0), test=noisy(2, size)))
    found = json.loads((said.run / "diagnosis.json").read_text())
    elbow = next(v for v in found["verdict"] if v["joint"] == "elbow")
    assert elbow["status"] == "unresolved" and plausible.IN_EACH_LOG in elbow["says"] and not found["findings"]
    assert found["next_log"] is None and "sysid design" not in said.out
