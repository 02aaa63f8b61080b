"""A low-pass over torque and over what is predicted: the equation of motion holds behind it, and nothing is seen of what
does not count."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid import listed_effects, regressor, robot
from sysid.compress import compress
from sysid.config import experiment
from sysid.filters import lowpassed
from sysid.gaussian import Gaussian
from sysid.log import Log, Segment
from sysid.preprocess import on_both_sides, prepare, under_lowpass
from sysid.specs import EffectSpec, PreprocessSpec
from tests.conftest import CONFIG, URDF

STEP = 0.002
SPEC = PreprocessSpec(torque="low-pass", cutoff=5.0, window=0.03)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    (folder / "robot.urdf").write_text(URDF)
    return robot.load(experiment({"robot": CONFIG["robot"]}).robot, folder)


@pytest.fixture(scope="module")
def log(machine) -> Log:
    """Angles without noise, and the torque that the URDF's bodies and friction need of them."""
    t = STEP * np.arange(6000)
    w = 2.0 * np.pi * np.array([0.4, 0.9])
    q, qd, qdd = np.sin(w * t[:, None]), w * np.cos(w * t[:, None]), -(w**2) * np.sin(w * t[:, None])
    tau = regressor.torque(machine, machine.prior, q, qd, qdd) + 0.3 * np.sign(qd)
    return Log("made", Path("made"), "", (Segment(t, STEP, q, tau, None, None, {}),))


def structure(machine):
    return listed_effects.build(machine, [EffectSpec(name="coulomb")])


def true(machine) -> np.ndarray:
    return np.concatenate([machine.prior.ravel(), [0.3, 0.3]])


def test_the_equation_of_motion_holds_behind_it(machine, log):
    (piece,) = prepare([log], SPEC, machine.joints).pieces
    assert isinstance(piece.smoother, Gaussian) and piece.use.mean() > 0.8
    predicted = structure(machine).torque(piece, machine.prior, [0.3, 0.3])
    off = np.where(piece.use[piece.core], piece.tau[piece.core] - predicted, 0.0)
    assert np.abs(off).max() < 1e-3 * np.abs(piece.tau).max()


def test_rows_that_do_not_count_are_not_seen(machine, log):
    """Torque in rows about a reversal may be anything."""
    raw = prepare([log], SPEC.model_copy(update={"torque": "raw"}), machine.joints)
    (piece,) = raw.pieces
    broken = replace(piece, tau=np.where(piece.use, piece.tau, 1e6))
    assert (broken.tau == 1e6).any()
    np.testing.assert_array_equal(under_lowpass(broken, SPEC).tau, under_lowpass(piece, SPEC).tau)


def test_one_row_stands_for_those_that_it_makes_alike(machine, log):
    """Sums over kept rows are those over all, as nothing is left between them."""
    motion = prepare([log], SPEC, machine.joints)
    every = on_both_sides(SPEC, STEP).every
    whole = [replace(p, smoother=Gaussian(5.0, STEP)) for p in motion.pieces]
    few = compress(structure(machine), motion)
    all_ = compress(structure(machine), replace(motion, pieces=tuple(whole)))
    assert every == 12
    assert np.max([len(f.triangle) for f in few.factors]) > 0
    x = 1.3 * true(machine)
    np.testing.assert_allclose(few.squares(x), all_.squares(x), rtol=0.02)
    np.testing.assert_allclose(few.rows, all_.rows, rtol=0.02)


def test_a_whole_torque_has_the_columns_filter(machine, log):
    motion = prepare([log], SPEC, machine.joints)
    data, x = compress(structure(machine), motion), true(machine)
    # what the parameters that made the log leave of it, as a share of its torque
    sizes = [np.sum(f.triangle[:, -1] ** 2) for f in data.by_joint]
    assert np.sqrt(data.squares(x) / sizes).max() < 1e-3


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ({}, True),
        ({"preprocess": {"window": 0.1}}, False),
        ({"preprocess": {"torque": "raw"}}, False),
        ({"preprocess": {"torque": "low-pass", "cutoff": 4.0}}, True),
        ({"preprocess": {"standstill": "keep"}}, True),
    ],
)
def test_servos_are_low_passed_where_nothing_is_said_of_filters(said, expected):
    servo = {"actuator": {"a": {"command": "c", "kp": 3.0}}}
    assert lowpassed(experiment(servo | said)) is expected
    assert not lowpassed(experiment({}))
