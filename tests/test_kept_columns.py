"""Columns that are kept are those that would be made anew, whatever changed since they were."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from sysid import regressor
from sysid.kept_columns import kept_columns
from sysid.model import Model
from sysid.motion import Motion
from sysid.rows import predicted
from sysid.smoother import Smoother
from sysid.specs import PreprocessSpec
from sysid.tangents import tangents
from tests.test_inverse_dynamics import arm, grown

MANY = [
    "coulomb",
    "stribeck",
    "load_friction",
    "presliding",
    "elasticity",
    "encoder_eccentricity",
    "gravity_tilt",
    "delay",
    "current_lag",
    "torque_gain",
    "torque_saturation",
    "payload",
]
STILL = ["coulomb", "load_friction", "delay"]  # nothing moves otherwise


def pieces():
    machine, piece = arm()
    filtered = replace(piece, smoother=Smoother(PreprocessSpec(filter="savitzky-golay", window=0.1), piece.step), core=slice(10, len(piece.t) - 10))
    return machine, {"plain": piece, "filtered": filtered}


def anew(model: Model, piece, rows):
    """The same with nothing kept."""
    fresh = replace(replace(model, _links={}))
    piece = replace(piece)
    return fresh.columns(piece, rows)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["plain", "filtered"])
@pytest.mark.parametrize("names", [MANY, STILL], ids=["many", "still"])
@pytest.mark.parametrize("stride", [1, 3])
def test_whatever_changes_columns_are_those_made_anew(kind, names, stride):
    machine, found = pieces()
    piece = found[kind]
    rows = slice(piece.core.start, piece.core.stop, stride)
    model, x = grown(machine, piece, names)
    rng = np.random.default_rng(stride)
    for turn in range(12):
        if turn == 6:  # an effect less: what is needed is less
            model = model.without("coulomb", 1)
        elif turn % 4 == 3:  # other bodies behind the load
            own = x[: model.size]
            model = model.referring_to(own * rng.uniform(0.8, 1.2, len(own)))
        else:  # one or two values, and back again
            which = rng.choice(len(model.shapes), 2)
            model = model.with_some_shapes({int(k): model.shapes[k] * rng.uniform(0.97, 1.03) for k in which})
        got = kept_columns(model, piece, rows, model.remembered(piece))
        for own, expected in zip(got, anew(model, piece, rows), strict=True):
            np.testing.assert_allclose(own, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


def test_what_is_kept_stays_in_its_process():
    machine, found = pieces()
    piece = found["plain"]
    model, _ = grown(machine, piece, ["stribeck"])
    before = len(pickle.dumps(piece))
    kept_columns(model, piece, slice(0, len(piece.t)), {})
    assert piece.kept and len(pickle.dumps(piece)) == before
    assert pickle.loads(pickle.dumps(piece)).kept == {}


def test_of_one_value_that_changes_only_its_columns_are_made_again(monkeypatch):
    machine, found = pieces()
    piece = found["plain"]
    model, _ = grown(machine, piece, ["stribeck", "delay", "current_lag"])
    rows = slice(0, len(piece.t))
    kept_columns(model, piece, rows, {})

    def refused(*args, **how):
        raise AssertionError("bodies' columns are made again")

    monkeypatch.setattr(regressor, "by_joint", refused)
    for k in range(len(model.shapes)):
        changed = model.with_some_shapes({k: 1.01 * model.shapes[k]})
        kept_columns(changed, piece, rows, {})


@pytest.mark.parametrize("name", ["delay", "current_lag"])
def test_slopes_of_a_sensor_are_differences_of_the_torque(name):
    machine, found = pieces()
    for piece in found.values():
        model, x = grown(machine, piece, ["coulomb", name])
        motion = Motion(tuple(machine.joints), [piece], (), np.zeros(machine.dof), np.zeros(machine.dof))
        use = np.ones((len(range(*piece.core.indices(len(piece.t)))[::2]), machine.dof), dtype=bool)
        slopes = tangents(model, motion, x, 2, use)
        for k, at in enumerate(model.shapes):
            step = 1e-5 * max(abs(at), 1e-3)
            there, here = (predicted(model.with_some_shapes({k: at + h}), motion, x, 2) for h in (step, -step))
            expected = (there - here).T / (2.0 * step)
            np.testing.assert_allclose(slopes[:, :, k], expected, rtol=0, atol=2e-3 * np.abs(expected).max())
