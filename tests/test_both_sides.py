"""A low-pass over torque and over what is predicted: the equation of motion holds behind it, and nothing is seen of what
does not count."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid import listed_effects, regressor, robot
from sysid.both_sides import settled
from sysid.compress import compress
from sysid.config import experiment
from sysid.filters import lowpassed
from sysid.gaussian import Gaussian
from sysid.log import Log, Segment
from sysid.motion import Piece
from sysid.preprocess import on_both_sides, prepare, under_lowpass
from sysid.rows import bent
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


@pytest.mark.parametrize("stride", [1, 3, 7])
@pytest.mark.parametrize("cutoff", [3.0, 40.0])
def test_many_pieces_at_once_are_seen_as_each_alone(stride, cutoff):
    """Also such as are shorter than the filter, of which some rows count for nothing, and of which no row is asked."""
    rng, none, low = np.random.default_rng(7), np.zeros(2), Gaussian(cutoff, 0.004)
    pieces, values, rows = [], [], []
    for n, weighed in ((1, True), (2, False), (5, True), (300, True), (40, False), (3, True)):
        zero, weight = np.zeros((n, 2)), rng.random((n, 2)).round() if weighed else None
        shared = (zero,) * 5
        pieces.append(Piece(0, 0.004, zero[:, 0], *shared, {}, None, low, slice(0, n), none, none, weight=weight))
        values.append(rng.normal(size=(4, 2, n)))
        rows.append(slice(n // 3, n - n // 4 if n != 40 else n // 3, stride))
    alone = [np.stack([p.settled(v[:, j], own, j) for j in (0, 1)], axis=1) for p, v, own in zip(pieces, values, rows)]
    np.testing.assert_allclose(settled(pieces, values, rows, (0, 1)), np.concatenate(alone, axis=-1), atol=1e-12)


def test_what_a_joint_that_gives_changes_is_the_same_of_pieces_at_once(machine, log):
    """Pieces under one gravity are one to rigid bodies; one that is tilted is not."""
    motion = prepare([log], SPEC, machine.joints)
    (piece,) = motion.pieces
    cut = [
        piece.part(slice(0, 700)),
        replace(piece.part(slice(700, 900)), gravity=np.array([1.0, 0.0, -9.0])),
        piece.part(slice(900, 2000)),
        piece.part(slice(2000, 2200)),
    ]
    model = structure(machine)
    known = bent(model, replace(motion, pieces=tuple(cut)), true(machine), [1])[1]
    for one, own in zip(known, cut):
        (alone,) = bent(model, replace(motion, pieces=(own,)), true(machine), [1])[1]
        assert len(one.seen.t) == len(own.t)
        for name in ("slopes", "load", "inertia"):
            np.testing.assert_allclose(getattr(one, name), getattr(alone, name), atol=1e-9)
