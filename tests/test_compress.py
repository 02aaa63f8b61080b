"""Triangles hold what the samples hold, in any order and grouping."""

from dataclasses import replace

import numpy as np
import pytest

from sysid import prediction, vocabulary
from sysid.compress import compress
from sysid.model import chunks
from sysid.triangles import merge
from tests.problems import arm, leg


def dense(structure, motion):
    """Rows (joint, n, size) and torque of a motion, nothing compressed."""
    size = 10 * structure.bodies + len(structure.coefficients)
    rows, torque = [], []
    for piece in motion.pieces:
        for part in chunks(piece, 5000):
            columns = structure.columns(piece, part)
            full = np.zeros((structure.robot.dof, columns[0].shape[1], size))
            for joint, values in enumerate(columns):
                full[joint][:, structure.support(joint)] = values.T
            rows.append(full)
            torque.append(piece.tau[part].T)
    return np.concatenate(rows, 1), np.concatenate(torque, 1)


def test_residuals_of_any_parameters():
    _, structure, motion, data, _ = arm()
    rows, torque = dense(structure, motion)
    rng = np.random.default_rng(0)
    for _ in range(3):
        x = rng.normal(size=rows.shape[2])
        residual = rows @ x - torque
        use = np.concatenate([piece.use for piece in motion.pieces]).T
        assert 0 < np.count_nonzero(use) < use.size
        residual = np.where(use, residual, 0.0)
        np.testing.assert_allclose(data.squares(x), np.sum(residual**2, 1), rtol=1e-10)
        total = data.total()
        np.testing.assert_allclose(np.sum((total @ np.append(x, -1)) ** 2), np.sum(residual**2), rtol=1e-10)
        weights = rng.uniform(0.5, 2, len(torque))
        np.testing.assert_allclose(np.sum((data.total(weights) @ np.append(x, -1)) ** 2), weights**2 @ np.sum(residual**2, 1), rtol=1e-10)
        scores = data.scores(x)
        gradient = 2 * np.einsum("jnk,jn->k", rows, residual)
        np.testing.assert_allclose(scores.sum(0), gradient, rtol=1e-9, atol=1e-9 * np.abs(gradient).max())


def test_a_load_is_that_of_the_bodies_and_rows_that_are_asked():
    """That of the last bodies stays with a piece: not for others, nor for rows by their numbers."""
    _, structure, motion, *_ = arm()
    (piece,) = motion.pieces
    friction = vocabulary.find("load_friction").given().bound(structure.robot, 0)
    light = structure.with_effect(friction, (0,))
    heavy = light.with_reference(2.0 * structure.robot.prior)
    rows = slice(10, 50, 3)
    for model in (light, heavy, light):
        fresh = model.columns(replace(piece), rows)
        for kept in (model.columns(piece, rows), model.columns(piece, np.arange(50)[rows])):
            for own, expected in zip(kept, fresh):
                np.testing.assert_allclose(own, expected, rtol=1e-12)
    own, twice = (model.columns(piece, rows)[0][-1] for model in (light, heavy))
    np.testing.assert_allclose(twice, 2.0 * own, rtol=1e-12)


def test_parts_merge_to_the_whole_and_blocks_leave_out():
    _, structure, motion, data, _ = arm()
    (piece,) = motion.pieces
    half = piece.samples // 2
    parts = [replace(motion, pieces=(piece.part(rows),)) for rows in (slice(0, half), slice(half, piece.samples))]
    merged = merge([compress(structure, part) for part in parts])
    assert merged.samples == data.samples
    x = np.random.default_rng(1).normal(size=data.size)
    np.testing.assert_allclose(merged.squares(x), data.squares(x), rtol=1e-10)
    left = data.without([0, 3]).squares(x)
    only = data.without(set(range(data.blocks)) - {0, 3}).squares(x)
    np.testing.assert_allclose(left + only, data.squares(x), rtol=1e-10)


def test_blocks_are_equal_within_a_piece_and_hold_every_row_once():
    _, structure, motion, _, _ = arm()
    (piece,) = motion.pieces
    motion = replace(motion, pieces=tuple(replace(piece, use=None).part(slice(0, n)) for n in (150, 431, 1999)))
    data = compress(structure, motion)
    rows = [[factor.rows for factor in data.factors if factor.joint == joint] for joint in range(structure.robot.dof)]
    assert all(own == rows[0] for own in rows)
    assert rows[0][0] == 150 and sum(rows[0][1:3]) == 431 and sum(rows[0][3:]) == 1999
    assert np.ptp(rows[0][1:3]) <= 1 and np.ptp(rows[0][3:]) <= 1 and min(rows[0][3:]) >= 199


def test_size_does_not_grow_with_the_log():
    _, structure, motion, data, _ = leg()
    assert data.total().shape == (67, 67)
    assert data.blocks <= 61
    assert sum(factor.triangle.nbytes for factor in data.factors) < 10e6


def test_prediction_is_the_columns_times_the_parameters():
    _, structure, motion, data, prior = arm()
    rows, torque = dense(structure, motion)
    x = np.append(prior.ravel(), np.random.default_rng(2).normal(size=len(structure.coefficients)))
    predicted = prediction.predict(structure, x, motion)
    np.testing.assert_allclose(predicted.predicted, (rows @ x).T, atol=1e-10 * np.abs(predicted.predicted).max())
    np.testing.assert_allclose(predicted.errors()["rms"], np.sqrt(data.squares(x) / data.rows), rtol=1e-9)


@pytest.mark.parametrize("filter", [{"filter": "savitzky-golay", "window": 0.1}, {"filter": "butterworth", "cutoff": 8.0}], ids=lambda f: f["filter"])
def test_the_same_filter_on_both_sides_chunk_by_chunk(filter):
    """Columns filtered in chunks with margins are those filtered whole, and explain a filtered torque exactly."""
    from sysid.preprocess import prepare
    from tests.problems import arm_log

    experiment, structure, _, _, _ = arm()
    spec = experiment.preprocess.model_copy(update={**filter, "torque": "same"})
    log = arm_log(structure.robot, np.random.default_rng(3), seconds=30)
    motion = prepare([log], spec, structure.robot.joints)
    (piece,) = motion.pieces
    whole = structure.columns(piece, piece.core)
    start = piece.core.start + 1000
    part = structure.columns(piece, slice(start, start + 200))
    for a, b in zip(whole, part):
        expected = a[:, 1000:1200]
        np.testing.assert_allclose(b, expected, atol=1e-9 * np.abs(a).max())
