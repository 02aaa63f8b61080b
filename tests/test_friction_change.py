"""What is another in some logs: friction after a repair, an encoder's zero that was set anew; told with the logs that have it."""

import copy
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from scripts.blind_parts.robots import experiment_of
from sysid import pipeline, vocabulary
from sysid.candidates import Candidate, together
from sysid.diagnose.diagnosis import diagnose
from sysid.effect_options import subsets
from sysid.simulate import simulate, write
from sysid.statement.document import document


def campaign(folder, changed):
    """Three training logs and a test log of a planar arm, the last training log and the test log with columns changed."""
    experiment, machine = experiment_of("planar", folder)
    write(simulate(machine, seed=8, duration=10.0, rate=200.0, logs=3), experiment, folder / "logs")
    for name in ("train_3.csv", "test.csv"):
        table = pl.read_csv(folder / "logs" / name)
        speed = np.gradient(table["q_elbow"].to_numpy(), table["t"].to_numpy())
        changed(table, speed).write_csv(folder / "logs" / name)
    return pipeline.load(folder / "logs")


def found(experiment):
    told = document(diagnose(experiment))
    (only,) = [f for f in told["findings"] if f["joins_as_step"] is not None]
    return only, {name.rpartition(".")[2]: p for name, p in only["parameters"].items()}


def test_friction_that_changed_is_named_with_its_logs(tmp_path):
    only, numbers = found(campaign(tmp_path, lambda table, qd: table.with_columns(tau_elbow=table["tau_elbow"] + pl.Series(-0.1 * qd - 0.15 * np.sign(qd)))))
    assert (only["effect"], only["joint"]) == ("friction_change", "elbow")
    assert set(only["options"]["logs"]) == {"train_3.csv", "test.csv"}
    assert abs(numbers["dFv"]["value"] + 0.1) < 3.0 * numbers["dFv"]["std"]
    assert abs(numbers["dFc"]["value"] + 0.15) < 3.0 * numbers["dFc"]["std"]


def test_a_zero_that_was_set_anew_is_named_with_its_logs(tmp_path):
    only, numbers = found(campaign(tmp_path, lambda table, _: table.with_columns(q_elbow=table["q_elbow"] - 0.06)))
    assert (only["effect"], only["joint"]) == ("encoder_offset", "elbow")
    assert set(only["options"]["logs"]) == {"train_3.csv", "test.csv"}
    assert abs(numbers["d"]["value"] - 0.06) < 3.0 * numbers["d"]["std"]


def test_without_logs_it_is_refused(experiment, cli):
    folder = experiment(config={"model.effects": ["viscous", "coulomb", {"friction_change": {"joints": ["elbow"]}}]})
    cli("fit", folder).complains("friction_change needs logs")


@pytest.mark.parametrize(("count", "half", "sizes"), [
    (1, True, []), (2, True, [1]), (3, True, [1] * 3), (4, True, [1] * 4 + [2] * 3), (5, True, [1] * 5), (9, True, []),
    (2, False, [1] * 2), (3, False, [1] * 3 + [2] * 3), (4, False, [1] * 4 + [2] * 6 + [3] * 4), (8, False, [1] * 8),
])  # fmt: skip
def test_logs_that_may_have_it(count, half, sizes):
    sets = [set(own["logs"]) for own in subsets([f"{k}.csv" for k in range(count)], half=half)]
    assert [len(own) for own in sets] == sizes
    assert not half or not any(one | other == {f"{k}.csv" for k in range(count)} and not one & other for one in sets for other in sets if one is not other)


def test_of_many_logs_the_fewer_are_named():
    """By how much of it each has; a load has no such other side."""
    robot = SimpleNamespace(joints=("a", "b"), dof=2)

    def asked(name, amounts):
        effect = copy.copy(vocabulary.find(name))
        joint = 0 if effect.scope == "joint" else -1
        effect.bound = lambda *_: effect
        effect.given = lambda **_: effect
        return [SimpleNamespace(candidate=Candidate(effect, joint, (("logs", (f"{k}.csv",)),)), coefficients=np.array(own), sizes=np.array([1.0, 100.0])[: len(own)]) for k, own in enumerate(amounts)]

    logs = lambda name, own: [set(dict(one.options)["logs"]) for one in together(asked(name, own), robot)]  # noqa: E731
    # of dry friction alone, whatever the viscous one's noise is
    dry = [[0.3, 0.0], [-0.2, 0.3], [0.4, 0.01], [0.1, 0.2], [-0.5, 0.02]]
    assert {"1.csv", "3.csv"} in logs("friction_change", dry) and max(map(len, logs("friction_change", dry))) == 2
    assert logs("payload", [[0.0], [3.0], [0.1], [2.0], [0.2]]) == [{"1.csv", "3.csv"}, {"1.csv", "3.csv", "4.csv"}, {"1.csv", "2.csv", "3.csv", "4.csv"}]
