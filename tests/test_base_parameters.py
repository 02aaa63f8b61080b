"""Combinations of parameters that a log determines, against what its torque knows."""

import json

import numpy as np
import pytest

from sysid import base_parameters, pipeline, regressor, results
from tests.test_report import written


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = written(tmp_path_factory.mktemp("base") / "arm", 0.0)
    return pipeline.fit(pipeline.load(folder))


def torques(robot, seed):
    """(rows, 10 bodies) torque of every parameter by itself at random states."""
    q, qd, qdd = np.random.default_rng(seed).normal(0.0, 1.0, (3, 300, robot.dof))
    each = np.eye(10 * len(robot.bodies)).reshape(-1, len(robot.bodies), 10)
    return np.array([regressor.torque(robot, pi, q, qd, qdd).ravel() for pi in each]).T


def test_there_are_as_many_as_the_regressor_has_rank(arm):
    """The rank at random states, by singular values, whatever the log."""
    values = np.linalg.svd(torques(arm.model.robot, 0), compute_uv=False)
    rank = int((values > 1e-9 * values[0]).sum())
    assert len(base_parameters.combinations(arm)) == rank < 10 * arm.model.bodies


def test_what_changes_no_torque_changes_no_combination(arm):
    """Any two sets of bodies with the same torque have the same combinations."""
    _, values, turn = np.linalg.svd(torques(arm.model.robot, 1))
    nothing = turn[int((values > 1e-9 * values[0]).sum()) :]
    found = base_parameters.combinations(arm)
    names = {name: k for k, name in enumerate(arm.model.names)}
    factors = np.zeros((len(found), len(arm.model.names)))
    for row, one in zip(factors, found):
        for name, factor in one.terms:
            row[names[name]] = factor
    size = np.abs(factors).max(1, keepdims=True)
    assert np.abs((factors / size)[:, : nothing.shape[1]] @ nothing.T).max() < 1e-5
    np.testing.assert_allclose([one.value for one in found], factors @ arm.x, atol=1e-9)


def test_their_deviations_hold_the_truth(arm):
    """The log was made with 1.2 times the prior's bodies; single masses are not told, sums are."""
    truth = np.append(1.2 * arm.prior.ravel(), arm.coefficients)
    names = {name: k for k, name in enumerate(arm.model.names)}
    found = base_parameters.combinations(arm)
    off = [
        (one.value - sum(f * truth[names[n]] for n, f in one.terms)) / one.std
        for one in found
        if np.isfinite(one.std) and all(names[n] < 10 * arm.model.bodies for n, _ in one.terms)
    ]
    assert len(off) >= 5 and np.abs(off).max() < 5.0
    clear = [one for one in found if one.clear]
    assert clear and max(one.std / abs(one.value) for one in clear) < 0.5
    alone = arm.uncertainty.std[: 10 * arm.model.bodies : 10] / arm.pi[:, 0]
    assert np.nanmax(alone) > 5 * np.median([one.std / abs(one.value) for one in clear])


def test_words_and_the_document(arm, tmp_path):
    one = base_parameters.Combination((("a.m", 1.0), ("b.hx", -0.5), ("c.m", 1.0)), 1.0, 0.1, "kg")
    assert one.words == "a.m − 0.5 b.hx + c.m" and one.clear
    assert not base_parameters.Combination((("a.m", 1.0),), 1.0, float("nan"), "kg").clear
    said = results.write(arm, tmp_path / "run")["base_parameters"]
    assert json.loads((tmp_path / "run" / "fit.json").read_text())["base_parameters"] == said
    assert [entry["name"] for entry in said] == [c.words for c in base_parameters.combinations(arm)]


def test_correlations_are_of_what_the_data_tell(arm):
    names, found = base_parameters.correlations(arm, most=6)
    assert len(names) <= 6 and found.shape == (len(names),) * 2
    np.testing.assert_allclose(found, found.T, atol=1e-9)
    np.testing.assert_allclose(np.diagonal(found), 1.0)
    pairs = base_parameters.strongest(names, found, 3)
    assert [abs(p.value) for p in pairs] == sorted((abs(p.value) for p in pairs), reverse=True)
    told = dict(zip(arm.model.names, arm.uncertainty.from_data))
    assert all(told[name] > 0.5 for name in names)
