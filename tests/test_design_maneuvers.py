"""Maneuvers after the harmonics: at rest at both ends, derivatives of each other, in the search and in the files."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid import config, robot
from sysid.design import basis, document, problem, search, solve
from sysid.design.designed import posed
from sysid.design.fourier import Fourier
from sysid.design.information import Known
from sysid.design.maneuvers import KINDS, Maneuver
from sysid.errors import SysidWarning
from sysid.robot_spec import RobotSpec
from sysid.vocabulary import find, vocabulary
from tests.conftest import URDF


@pytest.mark.parametrize("kind", KINDS)
def test_a_maneuver_begins_and_ends_at_rest_where_it_began(kind):
    own = Maneuver(kind, 2.0, 5.0, (), 2.5)
    t, h = np.linspace(0.0, 9.0, 4001), 1e-5
    q, qd, qdd, jerk = own.motion(t)
    assert np.abs(q).max() == pytest.approx(1.0, rel=1e-3)
    np.testing.assert_allclose(own.motion(np.array([0.0, 2.0, 7.0, 9.0]))[:3], 0.0, atol=1e-9)
    inside = t[(t > 2.01) & (t < 6.99)]
    here, before, after = (own.motion(inside + s) for s in (0.0, -h, h))
    for k in range(3):
        scale = np.abs(here[k + 1]).max()
        # a spline's third derivative is that of each of its pieces
        far = np.abs((after[k] - before[k]) / (2.0 * h) - here[k + 1]) / scale
        assert np.quantile(far, 0.99 if k == 2 else 1.0) < 1e-3


def test_what_each_kind_is():
    t = np.linspace(0.0, 8.0, 8001)
    motion = {kind: Maneuver(kind, 0.0, 8.0, (), 2.0).motion(t) for kind in KINDS}
    speed = np.abs(motion["ladder"][1])
    level = np.histogram(speed[(speed > 0.02 * speed.max()) & (np.abs(motion["ladder"][2]) < 0.02 * np.abs(motion["ladder"][2]).max())], bins=200)
    rungs = level[1][:-1][level[0] > 0.03 * level[0].sum()]
    assert np.log2(rungs.max() / rungs.min()) == pytest.approx(3.0, abs=0.35)  # four speeds, each half as fast
    for first, last in ((0, 2000), (6000, 8000)):  # a chirp's rounds, by its speed's changes of sign
        turns = np.count_nonzero(np.diff(np.sign(motion["chirp"][1][first:last])))
        assert turns <= 3 if first == 0 else turns >= 4
    loops = [np.ptp(part) for part in np.array_split(motion["reversals"][0][:-1], 4)]
    np.testing.assert_allclose(np.array(loops[1:]) / loops[:-1], 0.5, rtol=0.1)
    standing = np.mean(np.abs(motion["poses"][1]) < 1e-3 * np.abs(motion["poses"][1]).max())
    assert standing < 0.1  # at rest a row does not count


def test_effects_name_maneuvers_that_there_are():
    told = {name: find(name).maneuvers for name in vocabulary()}
    assert all(kind in KINDS for kinds in told.values() for kind in kinds)
    assert {kind for kinds in told.values() for kind in kinds} == set(KINDS)
    assert told["stribeck"] == ("ladder",) and told["presliding"] == ("reversals",) and told["delay"] == ("chirp",)


def test_a_motion_goes_on_from_where_its_harmonics_end():
    family = Fourier(10.0, 4, 2, 2).followed_by(("ladder", "chirp"), (1,), 0.4, 2.0)
    assert (family.time, family.size, family.waves) == (6.0, 9, 7) and family.fastest == 2.0
    rng = np.random.default_rng(0)
    z = rng.normal(size=(2, family.size))
    t = np.array([0.0, 5.999999, 6.0, 8.0, 10.0])
    q, qd, qdd, _ = family.motion(z, t)
    np.testing.assert_allclose(q - q[0], 0.0, atol=1e-5)
    np.testing.assert_allclose([qd[[0, 2, 3, 4]], qdd[[0, 2, 3, 4]]], 0.0, atol=1e-9)
    alone = Fourier(6.0, 4, 2, 2).motion(z[:, :7], np.linspace(0.0, 5.99, 50))
    np.testing.assert_allclose(family.motion(z, np.linspace(0.0, 5.99, 50)), alone, atol=1e-9)


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("maneuvers")
    (folder / "robot.urdf").write_text(URDF)
    experiment = config.loads("robot: {urdf: robot.urdf}\nmodel: {effects: [viscous, coulomb]}\n", folder / "c.yaml")
    with pytest.warns(SysidWarning, match="no log yet"):
        base = basis.basis(experiment, [("stribeck", "elbow"), ("presliding", "elbow")], None)
    return base, posed(base, 8.0)[0]


def test_a_search_tries_them_within_the_limits(asked, monkeypatch):
    base, own = asked
    assert base.known.maneuvers == ("ladder", "reversals") and base.known.joints == (1,)
    monkeypatch.setattr(search, "DRAWN", 1)
    monkeypatch.setattr(search, "_ROUNDS", (1,))
    ends, real = [], solve.ended
    monkeypatch.setattr(solve, "ended", lambda *asked: ends.append(real(*asked)) or ends[-1])
    best, _ = search.searched(own, base.pose, base.fastest, 0, processes=1)
    (tried,) = [found for found in ends if found.family.maneuvers]
    assert best.value >= max(found.value for found in ends) - search._CLEAR
    full = own.of(tried.family)
    motion = full.basis @ tried.z.T
    assert problem.shares(full, motion, problem.torque(full, *motion[:3])).max() <= 1.0
    assert tried.value > search.start(full, base.pose, (0, 1, 0)).value
    told = document(_shown(own, tried))
    assert [m["kind"] for m in told["maneuvers"]] == ["ladder", "reversals"] and told["maneuvers"][1]["start"] == pytest.approx(6.4)
    assert told["coefficients"]["duration"] == pytest.approx(4.8)


def _shown(own, found):
    """What a design's document looks at."""
    family = found.family
    return SimpleNamespace(
        family=family, log_det=1.0, random_best=0.0, margins={}, deviations={}, pairs=(), coefficients=family.coefficients(found.z),
        amounts=found.z[:, family.waves :], joints=own.known.model.robot.joints, said=(),
    )  # fmt: skip


def test_slopes_know_of_maneuvers_and_of_rows_that_do_not_count(asked):
    _, own = asked
    full = own.of(own.family.followed_by(("ladder", "chirp"), (), 0.5, 2.0))
    rng = np.random.default_rng(1)
    z = 0.3 * rng.normal(size=(2, full.family.size))
    grid = solve._grid(full, np.zeros(0))
    slope = solve.climbs(full, solve._look(full, z, grid), grid)
    for _ in range(3):
        way, h = rng.normal(size=z.shape) * np.array([[0.0], [1.0]]), 1e-6  # of what looks back, its own joint's
        numeric = (problem.value(full, z + h * way)[0] - problem.value(full, z - h * way)[0]) / (2.0 * h)
        assert float(np.sum(slope * way)) == pytest.approx(numeric, rel=5e-2, abs=0.1)


def test_rows_about_reversals_and_creep_do_not_count(tmp_path):
    (tmp_path / "robot.urdf").write_text(URDF)
    machine = robot.load(RobotSpec(urdf=str(tmp_path / "robot.urdf")))
    known = Known(SimpleNamespace(robot=machine), np.zeros(0), np.array([0.5, 0.1]), np.zeros((0, 0)), reach=0.05, slowest=np.array([0.03, 0.03]))
    qd = np.array([[1.0, 0.001], [0.01, 1.0], [0.05, 0.2]])
    qdd = np.array([[0.0, 0.0], [0.0, 100.0], [4.0, 0.0]])
    found = known.counted(qd, qdd) * known.noise[:, None]
    np.testing.assert_allclose(found, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], atol=1e-12)
