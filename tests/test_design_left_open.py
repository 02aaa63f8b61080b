"""What the last diagnosis could not tell apart: the suspects of a design that is given none, and odds that count in its promise."""

import json

import numpy as np
import pytest

from sysid import pipeline
from sysid.design import basis, design, promise
from sysid.design.left_open import LeftOpen
from sysid.statement import kept
from tests.conftest import URDF

LOGS = [{"part": "train", "log": "a", "sha256": "1", "samples": 3}, {"part": "test", "log": "b", "sha256": "2"}]
ALONE = [("cogging", "elbow", 1.0)]
TIE = [("stribeck", "elbow", 0.6), ("spring", "elbow", 0.395), ("cable", "elbow", 0.005)]
OTHER = [("delay", "shoulder", 0.5), ("current_lag", "shoulder", 0.5)]


def told(*sets, logs=LOGS):
    return {"claims": [{"set": [dict(zip(("effect", "joint", "probability"), m)) for m in one]} for one in sets], "logs": logs}


def test_the_first_tie_is_what_a_design_separates():
    found = LeftOpen.of(told(ALONE, TIE, OTHER), None)
    assert found.suspects == (("stribeck", "elbow"), ("spring", "elbow"))  # of the third little is left to ask
    assert found.chances == {"stribeck:elbow": 0.6, "spring:elbow": 0.395}
    assert found.logs == (("train", "1"), ("test", "2"))
    assert LeftOpen.of(told(ALONE), None).suspects == () == LeftOpen.of(told(), None).suspects
    assert LeftOpen.of(told(TIE), ()).suspects == ()


def test_suspects_that_are_given_have_the_odds_of_the_set_that_holds_them_all():
    apart = [("delay", "shoulder"), ("current_lag", "shoulder")]
    assert LeftOpen.of(told(TIE, OTHER), apart).chances == {"delay:shoulder": 0.5, "current_lag:shoulder": 0.5}
    mixed = LeftOpen.of(told(TIE, OTHER), [("stribeck", "elbow"), ("delay", "shoulder")])
    assert mixed.chances == {} and mixed.suspects == (("stribeck", "elbow"), ("delay", "shoulder"))


@pytest.mark.parametrize("left, odds", [(0.3, 1.0), (6.0, 1.0), (3.0, 5.0), (3.0, 0.2), (40.0, 0.02)])
def test_odds_and_the_new_logs_likelihood_ratio_are_added(left, odds):
    """Against draws: y is a signature and noise of variance one; its rival makes nothing of it."""
    rng = np.random.default_rng(0)
    signature = rng.normal(size=20)
    signature *= np.sqrt(left / np.sum(signature**2))
    y = signature + rng.normal(size=(40000, 20))
    ratio = 0.5 * (np.sum(y**2, axis=1) - np.sum((y - signature) ** 2, axis=1))
    came = np.mean(odds * np.exp(ratio) / (1.0 + odds * np.exp(ratio)) > 0.9)
    assert promise._apart(left, odds) == pytest.approx(came, abs=0.01)


def test_a_log_that_tells_nothing_leaves_the_odds_as_they_are():
    assert promise._apart(0.0, 9.5) == 1.0 and promise._apart(0.0, 8.5) == 0.0


@pytest.fixture(scope="module")
def poor(tmp_path_factory):
    """A poor log of a planar arm with a bias."""
    from sysid import simulate as simulation

    folder = tmp_path_factory.mktemp("left")
    (folder / "robot.urdf").write_text(URDF)
    (folder / "plain.yaml").write_text("robot: {urdf: robot.urdf}\n")
    spec, machine, _ = simulation.load(folder / "plain.yaml")
    found = simulation.simulate(machine, seed=3, duration=6.0, rate=250.0, motion="sines", hide=[simulation.hidden("torque_bias:elbow:size=2")])
    simulation.write(found, spec, folder / "log")
    return folder / "log"


@pytest.fixture(scope="module")
def fitted(poor):
    return pipeline.fit(pipeline.load(poor))


@pytest.mark.long
def test_likelier_suspects_count_for_more(poor, fitted):
    """Twins that no motion tells apart: nothing is promised of them, unless the old logs have told."""
    experiment, twins = pipeline.load(poor), [("torque_bias", "elbow", 0.5), ("asymmetric_coulomb", "elbow", 0.5)]
    asked, how = [m[:2] for m in twins], {"duration": 3.0, "processes": 1}
    (even,) = design(experiment, separate=asked, **how).pairs
    (same,) = design(experiment, separate=asked, diagnosis=told(twins, logs=fitted.logs), **how).pairs
    assert same == even and even.probability < 0.1
    sure = [(*asked[0], 0.95), (*asked[1], 0.05)]
    (after,) = design(experiment, separate=asked, diagnosis=told(sure, logs=fitted.logs), **how).pairs
    assert after.probability == pytest.approx(0.95, abs=0.06)
    (foreign,) = design(experiment, separate=asked, diagnosis=told(sure), **how).pairs
    assert foreign == even  # of other logs


def test_the_tie_of_a_diagnosis_is_asked_by_itself(poor, fitted, monkeypatch):
    seen = []
    true = basis.suspected
    monkeypatch.setattr(basis, "suspected", lambda rows, fit, wide, one: seen.append(one.name) or true(rows, fit, wide, one))
    base = lambda separate, said: basis.basis(pipeline.load(poor), separate, lambda *_: None, diagnosis=said)  # noqa: E731
    with pytest.warns(match="stribeck:elbow and spring:elbow apart, which the last diagnosis could not; --separate none"):
        found = base(None, told(TIE, logs=fitted.logs))
    assert seen == ["stribeck", "spring"] and found.chances == {"stribeck:elbow": 0.6, "spring:elbow": 0.395}
    assert base((), told(TIE, logs=fitted.logs)).known.suspects == ()
    assert base(None, told(TIE)).known.suspects == ()  # of other logs
    assert base(None, None).known.suspects == ()


@pytest.mark.long
def test_the_command_takes_the_tie_of_its_run_folder(poor, fitted, tmp_path, cli):
    """Where the experiment is as it was; `none` is the motion that tells most."""
    experiment = pipeline.load(poor)
    said = {**told(TIE, logs=json.loads(json.dumps(list(fitted.logs)))), "of": kept.of(experiment)}
    folder = tmp_path / "runs" / experiment.name
    folder.mkdir(parents=True)

    def designed(*options):
        ended = cli("design", poor, "--duration", "3", "--processes", "1", "--json", *options)
        assert ended.status == 0, ended.err
        return [{pair["a"], pair["b"]} for pair in json.loads(ended.out)["separates"]]

    def written(document):
        (folder / "diagnosis.json").write_text(json.dumps({**document, "seal": kept._seal(document)}))

    assert designed() == []
    written(said)
    assert designed() == [{"stribeck:elbow", "spring:elbow"}]
    assert designed("--separate", "none") == []
    written({**said, "of": "another experiment"})
    assert designed() == []
