"""Designed motions: at rest at both ends, within every limit, and telling more than chance does."""

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from scripts.design_parts.limits import along, summed
from sysid import config, listed_effects, pipeline, robot
from sysid.design import basis, design, document, folder, limits, links, problem, promise, search, solve
from sysid.design import designed as designing
from sysid.design.collision import corners
from sysid.design.columns import columns, of_the_instant
from sysid.design.fourier import Fourier
from sysid.design.information import Known, evidence, information, log_det, own_size
from sysid.design.limits import LimitsSpec
from sysid.errors import SysidWarning
from sysid.robot_spec import RobotSpec
from sysid.simulate import load, read_trajectory, simulate
from sysid.specs import EffectSpec
from sysid.vocabulary import find
from tests.conftest import URDF

UR5 = "example-robot-data://ur_description/urdf/ur5_robot.urdf"


def test_harmonics_begin_and_end_at_rest_and_are_derivatives_of_each_other():
    rng = np.random.default_rng(0)
    family = Fourier(10.0, 5, 2, 3)
    z = rng.normal(size=(3, family.size))
    q, qd, qdd, jerk = family.motion(z, np.array([0.0, 10.0]))
    np.testing.assert_allclose(qd, 0.0, atol=1e-12)
    np.testing.assert_allclose(qdd, 0.0, atol=1e-11)
    np.testing.assert_allclose(q[0], q[1], atol=1e-12)
    t, h = rng.uniform(0.5, 9.5, 20), 1e-5
    here, before, after = (family.motion(z, t + s) for s in (0.0, -h, h))
    for k in range(3):
        np.testing.assert_allclose((after[k] - before[k]) / (2.0 * h), here[k + 1], rtol=1e-6, atol=1e-6)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A planar arm with friction in the model, and what is known of it before any log."""
    file = tmp_path_factory.mktemp("design") / "robot.urdf"
    file.write_text(URDF)
    machine = robot.load(RobotSpec(urdf=str(file)))
    model = listed_effects.build(machine, [EffectSpec(name="viscous"), EffectSpec(name="coulomb")])
    x = np.concatenate([machine.prior.ravel(), [0.3, 0.1, 0.2, 0.15]])
    torque = np.array([10.0, 3.0])
    return Known(model, x, np.array([0.05, 0.02]), own_size(model, machine.prior, x, torque))


def _posed(known, machine):
    bounds = limits.limits(machine, None, None)
    return problem.Problem(known, bounds, links.geometry(machine).about(np.zeros(2)), Fourier(8.0, 4, 2, 2), 250.0)


SUSPECTS = {
    "none": [], "instant": [("stribeck", "shoulder"), ("spring", "shoulder")], "load": [("load_friction", "elbow"), ("torque_bias", "elbow")],
    "motion": [("encoder_offset", "elbow"), ("gravity_tilt", "*")], "one": [("torque_gain", "elbow")],
    "history": [("presliding", "elbow"), ("coulomb", "elbow")], "late": [("delay", "elbow"), ("current_lag", "elbow")],
    "soft": [("elasticity", "elbow"), ("warmup", "elbow")],
}  # fmt: skip


@pytest.mark.parametrize("name", SUSPECTS)
def test_what_a_motion_is_worth_and_its_slope(arm, tmp_path, name):
    """Against differences of the criterion itself, in coordinates of a motion."""
    (tmp_path / "robot.urdf").write_text(URDF)
    with pytest.warns(SysidWarning, match="no log yet"):
        known = basis.basis(config.loads("robot: {urdf: robot.urdf}\nmodel: {effects: [viscous]}\n", tmp_path / "c.yaml"), SUSPECTS[name], None).known
    posed = _posed(known, arm.model.robot)
    rng = np.random.default_rng(1)
    z = 0.4 * rng.normal(size=(2, posed.family.size))
    grid = solve._grid(posed, np.zeros(0))
    at = solve._look(posed, z, grid)
    assert (at.worth, log_det(information(known, at.columns, np.full(grid.nodes, 2000.0 / grid.nodes)))) == pytest.approx(problem.value(posed, z))
    slope = solve.climbs(posed, at, grid)
    for _ in range(3):
        way = rng.normal(size=z.shape)
        if any(one.looks_back for one in known.suspects):
            way[0] = 0.0  # of what looks back, the slope is that of its own joint's motion
        h = 1e-6 if name == "history" else 1e-5  # presliding has corners; differences forward err by 1e-5 over 0.03 rad/s
        numeric = (problem.value(posed, z + h * way)[0] - problem.value(posed, z - h * way)[0]) / (2.0 * h)
        assert float(np.sum(slope * way)) == pytest.approx(numeric, rel=2e-3 if name in ("none", "instant", "load") else 3e-2, abs=max(0.05, 1e-3 * np.linalg.norm(slope)))


def test_evidence_is_what_a_rival_and_the_model_leave_of_a_suspect(arm, tmp_path):
    """Against least squares on the rows themselves."""
    (tmp_path / "robot.urdf").write_text(URDF)
    with pytest.warns(SysidWarning, match="no log yet"):
        known = basis.basis(config.loads("robot: {urdf: robot.urdf}\nmodel: {effects: [viscous]}\n", tmp_path / "c.yaml"), SUSPECTS["history"], None).known
    posed = _posed(known, arm.model.robot)
    z = 0.4 * np.random.default_rng(2).normal(size=(2, posed.family.size))
    found, weight = problem.told(posed, z), 2000.0 / len(posed.nodes)
    rows = np.sqrt(weight) * np.moveaxis(found, 1, 2).reshape(-1, found.shape[1])
    stacked = np.concatenate([rows, np.linalg.cholesky(known.before).T])  # the prior as rows
    a, b = known.places
    for (one, _), own, rival, size in zip(evidence(known, information(known, found, weight)), (a, b), (b, a), (s.size for s in known.suspects)):
        rest = stacked[:, np.concatenate([np.arange(known.model.size), rival])]
        target = stacked[:, own] @ size
        left = target - rest @ np.linalg.lstsq(rest, target, rcond=1e-12)[0]
        assert one == pytest.approx(float(left @ left), rel=1e-4)


def test_columns_of_a_design_are_the_fit_s(arm):
    rng = np.random.default_rng(2)
    q, qd, qdd = rng.normal(size=(3, 5, 2))
    found = np.einsum("jpn,p->nj", columns(arm.model, q, qd, qdd), arm.x)
    machine = arm.model.robot
    data = machine.model.createData()
    truth = np.array([pin.rnea(machine.model, data, *row) for row in zip(q, qd, qdd)])
    truth += qd * [0.3, 0.1] + np.sign(qd) * [0.2, 0.15]
    np.testing.assert_allclose(found, truth, rtol=1e-9, atol=1e-9)
    delayed = arm.model.with_effect(find("delay"), (0,))
    assert of_the_instant(delayed).names == arm.model.names


def test_hulls_are_as_near_as_a_quadratic_program_says():
    """coal's own convex representation of a mesh is not: that is why hulls are made anew."""
    import cvxpy

    machine = robot.load(RobotSpec(urdf=UR5))
    shapes = links.geometry(machine)
    rng = np.random.default_rng(3)
    checked = 0
    data, found = shapes.model.createData(), shapes.shapes.createData()
    for pose in rng.uniform(-2.5, 2.5, (40, 6)):
        distances = shapes.at(pose[None])[0]
        pin.updateGeometryPlacements(shapes.model, data, shapes.shapes, found, pose)
        k = int(np.argmin(distances))
        pair = shapes.shapes.collisionPairs[k]
        ends = []
        for which in (pair.first, pair.second):
            shape, placed = shapes.shapes.geometryObjects[which].geometry, found.oMg[which]
            ends.append(corners(shape) @ placed.rotation.T + placed.translation)
        a, b = (cvxpy.Variable(len(end), nonneg=True) for end in ends)
        gap = cvxpy.norm(ends[0].T @ a - ends[1].T @ b)
        truth = cvxpy.Problem(cvxpy.Minimize(gap), [cvxpy.sum(a) == 1, cvxpy.sum(b) == 1]).solve(solver="CLARABEL")
        assert max(distances[k], 0.0) == pytest.approx(truth, abs=1e-5)
        checked += 1
    assert checked == 40


def test_distances_and_their_slopes():
    machine = robot.load(RobotSpec(urdf=UR5))
    shapes = links.geometry(machine).about(np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0]))
    rng = np.random.default_rng(4)
    off = []
    for pose in rng.uniform(-2.5, 2.5, (30, 6)):
        near = shapes.near(pose[None], 0.05)
        for distance, slope in zip(near.distance, near.slope):
            way = rng.normal(size=6)
            ends = [shapes.near((pose + s * 1e-4 * way)[None], 0.2).distance for s in (1.0, -1.0)]
            pairs = [min(end, key=lambda d: abs(d - distance)) for end in ends]
            off.append(abs((pairs[0] - pairs[1]) / 2e-4 - slope @ way) / max(np.linalg.norm(slope), 1e-3))
    assert len(off) > 10 and np.median(off) < 1e-3


@pytest.fixture(scope="module")
def poor(tmp_path_factory):
    """A folder with a poor first log of a planar arm, and the arm."""
    from sysid import simulate as simulation

    folder = tmp_path_factory.mktemp("poor")
    (folder / "robot.urdf").write_text(URDF)
    (folder / "plain.yaml").write_text("robot: {urdf: robot.urdf}\n")
    spec, machine, _ = load(folder / "plain.yaml")
    found = simulate(machine, seed=3, duration=6.0, rate=250.0, motion="sines")
    simulation.write(found, spec, folder / "log")
    return folder / "log", machine


@pytest.fixture(scope="module")
def designed(poor):
    return design(pipeline.load(poor[0]), duration=8.0, separate=[("stribeck", "shoulder"), ("spring", "shoulder")], processes=1)


@pytest.mark.long
def test_a_design_keeps_to_every_limit_as_an_independent_check_sees_it(poor, designed):
    """Positions, speeds, torque by Pinocchio and friction by hand, at a kilohertz."""
    machine = poor[1]
    t = np.arange(0.0, 8.0, 1e-3)
    q, qd, qdd = along(designed, t)
    own = [machine.source.joints[j] for j in machine.joints]
    assert (np.abs(q) <= [0.95 * j.limits[1] + 1e-9 for j in own]).all()
    assert (np.abs(qd) <= [0.95 * j.velocity + 1e-9 for j in own]).all()
    assert (designed.limits.velocity < [j.velocity for j in own]).all()  # it has never been so fast
    asked = limits.limits(machine, LimitsSpec(velocity={"elbow": 9.0}), None)
    assert asked.velocity[1] == 9.0 and asked.velocity[0] < 9.0
    fit = pipeline.fit(pipeline.load(poor[0]))
    model = machine.with_inertias(fit.pi)
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *row) for row in zip(q[::5], qd[::5], qdd[::5])])
    found = dict(zip([c.name for c in fit.model.coefficients], fit.coefficients))
    of = lambda word: np.array([found.get(f"{word.split('.')[0]}.{j}.{word.split('.')[1]}", 0.0) for j in machine.joints])  # noqa: E731
    torque += qd[::5] * of("viscous.Fv") + np.sign(qd[::5]) * of("coulomb.Fc") + qdd[::5] * of("armature.Ia")
    assert (np.abs(torque) <= [0.95 * j.effort * (1.0 + 1e-6) for j in own]).all()
    for kind, value in (("velocity", 1.0 - np.max(np.abs(qd) / designed.limits.velocity)), ("torque", 1.0 - np.max(np.abs(torque) / [j.effort for j in own]))):
        assert designed.margins[kind] == pytest.approx(value, abs=2e-3)


def test_a_design_tells_more_than_random_motions(designed):
    assert designed.log_det > designed.random_best + 5.0
    assert all(0.0 <= s["after"] <= s["now"] * (1.0 + 1e-6) for s in designed.deviations.values())


def test_its_files(poor, designed, tmp_path):
    from ruamel.yaml import YAML

    from sysid.design import write

    told = write(designed, tmp_path / "next")
    assert told == document(designed, tmp_path / "next")
    json.dumps(told, allow_nan=False)
    played = read_trajectory(tmp_path / "next" / "trajectory.csv", poor[1].joints)
    assert played.duration == pytest.approx(8.0) and len(played.t) == 2001  # at the log's rate
    np.testing.assert_allclose(played.q, designed.q, atol=1e-10)
    ros = YAML(typ="safe").load((tmp_path / "next" / "trajectory.yaml").read_text())
    assert ros["joint_names"] == list(poor[1].joints)
    assert ros["points"][0]["velocities"] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert ros["points"][-1]["time_from_start"] == {"sec": 8, "nanosec": 0}


def test_ros_reads_small_numbers_as_numbers():
    from ruamel.yaml import YAML

    reader = YAML(typ="safe", pure=True)
    reader.version = (1, 1)  # what ROS's reader speaks: a number with an exponent has a point
    values = np.array([1e-5, -2e-17, 1e22, 0.1, -1.0, 0.0])
    assert reader.load(folder._numbers(values)) == values.tolist()


@pytest.mark.long
def test_the_same_seed_is_the_same_motion_in_any_number_of_processes(poor, designed, monkeypatch):
    monkeypatch.setattr(search, "_WORTH", 0.0)
    again = design(pipeline.load(poor[0]), duration=8.0, separate=[("stribeck", "shoulder"), ("spring", "shoulder")], processes=2)
    np.testing.assert_array_equal(again.coefficients, designed.coefficients)


def test_what_is_stopped_keeps_the_best_motion_so_far(poor, monkeypatch):
    whole, slices = search.solve.climbed, []

    def interrupted(*asked):
        slices.append(asked)
        if len(slices) > 12:  # every start has had a slice, and some another
            raise KeyboardInterrupt
        return whole(*asked)

    monkeypatch.setattr(search.solve, "climbed", interrupted)
    found = design(pipeline.load(poor[0]), duration=8.0, processes=1)
    assert any("stopped before" in text for text in found.said)
    assert found.log_det > found.random_best and min(found.margins.values()) > 0.0


def test_what_shrinks_keeps_to_its_limits_and_touches_one(arm):
    machine = arm.model.robot
    bounds = limits.limits(machine, LimitsSpec(torque={"shoulder": 4.0, "elbow": 2.0}), None)
    posed = problem.Problem(arm, bounds, links.geometry(machine).about(np.zeros(2)), Fourier(8.0, 5, 4, 2), 250.0)
    rng = np.random.default_rng(7)
    touched = counted = 0
    for _ in range(20):
        z = problem.drawn(posed, np.zeros(2), rng)
        z[:, 1:] *= 3.0
        kept = problem.shrunk(posed, z)
        if kept is None:  # gravity alone is too much
            continue
        motion = posed.basis @ kept.T
        most = problem.shares(posed, motion, problem.torque(posed, *motion[:3])).max()
        assert most <= 1.0
        share = np.linalg.norm(kept[:, 1:]) / np.linalg.norm(z[:, 1:])
        touched += bool(most > 0.99 or share == pytest.approx(1.0))
        counted += 1
    assert counted > 8 and touched >= 0.9 * counted


def test_what_is_played_is_looked_at_between_two_looks(poor, arm, monkeypatch):
    """Links that come nearest between two instants at which a search looks at distances, by less than a millimetre."""
    posed = _posed(arm, arm.model.robot)
    z = problem.shrunk(posed, problem.drawn(posed, np.zeros(2), np.random.default_rng(1)))
    at, clearance = int(np.argmax(np.abs(posed.basis[1] @ z.T)[:, 0])), posed.limits.clearance
    at += 5 - at % problem.CLOSE  # where it is fast, in the middle between two looks
    where = (posed.basis[0, at] @ z.T)[0]

    class Narrow:
        """The links touch at one angle of the shoulder, which the robot does not stand at."""

        looks = True

        def least(self, q, most=np.inf):
            return np.where(np.abs(np.asarray(q)[:, 0] - where) < 1e-4, clearance - 1e-4, clearance + 1.0)

        def nearest(self, q):
            return float(self.least(q).min())

    narrow = replace(posed, geometry=Narrow())
    np.testing.assert_array_equal(problem.shrunk(narrow, z), z)
    closely = problem.shrunk(narrow, z, 1)
    assert closely is None or narrow.geometry.nearest(posed.basis[0] @ closely.T) > clearance
    looked = []
    whole = problem.shrunk
    monkeypatch.setattr(search.solve, "shrunk", lambda posed, z, close=problem.CLOSE: looked.append(close) or whole(posed, z, close))
    design(pipeline.load(poor[0]), duration=3.0, processes=1)
    assert looked[-1] == 1 and set(looked[:-1]) == {problem.CLOSE}


@pytest.mark.long
def test_pairs_are_told_apart_or_said_not_to_be(poor, designed):
    (pair,) = designed.pairs
    assert {pair.a, pair.b} == {"stribeck:shoulder", "spring:shoulder"} and pair.probability > 0.9
    twins = design(pipeline.load(poor[0]), duration=4.0, separate=[("torque_bias", "elbow"), ("asymmetric_coulomb", "elbow")], processes=1)
    assert twins.pairs[0].probability < 0.1  # beside Coulomb friction they are one column


def test_the_promised_deviations_are_achieved(poor, designed):
    """A simulated robot plays the motion; its log with the first one is fitted."""
    folder, _ = poor
    spec, machine, _ = load(folder.parent / "plain.yaml")
    from sysid import simulate as simulation

    played = simulation.Played(designed.t, designed.q)
    found = simulate(machine, seed=3, duration=6.0, rate=250.0, motion="sines", trajectory=played)
    assert found.truth["inertias"] == json.loads((folder / "truth.json").read_text())["inertias"]
    simulation.write(found, spec, folder.parent / "next")
    tree = (folder / "config.yaml").read_text().replace("train: [train.csv]", f"train: [train.csv, {folder.parent / 'next' / 'train.csv'}]")
    assert "next" in tree
    both = pipeline.fit(config.loads(tree, folder / "config.yaml"))
    std = dict(zip(both.model.names, both.uncertainty.std))
    now = {name: s for name, s in designed.deviations.items() if s["after"] < 0.5 * s["now"] and np.isfinite(std[name])}
    ratio = np.array([std[name] / s["after"] for name, s in now.items()])
    assert len(ratio) and 0.4 < np.median(ratio) < 2.5


def test_what_a_poor_log_held_at_a_bound_the_next_fit_sets_free(poor, designed):
    """A bound by itself changes nothing of what is promised after the next log, nor of the noise that is heard."""
    base = basis.basis(pipeline.load(poor[0]), [], lambda stage, share: None)
    new = designing._fitted(base, designing._log(base, designed.t, designed.q, designed.torque))
    whole = promise.deviations(base.fit, base.motion, new, designing._heard(base))
    held = base.fit.model.names.index("viscous.shoulder.Fv")
    sure = base.fit.uncertainty
    std = np.where(np.arange(len(sure.std)) == held, np.nan, sure.std)
    bound = replace(base.fit, uncertainty=replace(sure, std=std))
    told = promise.deviations(bound, base.motion, new, designing._heard(base))
    assert set(whole) - set(told) == {"viscous.shoulder.Fv"}
    for name, own in told.items():
        assert own["after"] == pytest.approx(whole[name]["after"], rel=1e-6)
    assert told["coulomb.shoulder.Fc"]["now"] < 0.9 * whole["coulomb.shoulder.Fc"]["now"]


def test_a_body_that_is_known_stays_so(poor, designed, monkeypatch):
    """It has no deviation to lose, and what else is fitted is as sure as with its columns left out."""
    plain = pipeline.load(poor[0])
    known = plain.model_copy(update={"prior": plain.prior.model_copy(update={"known": ["lower"]})})
    base, free = (basis.basis(one, [], lambda stage, share: None) for one in (known, plain))
    new, heard = designing._fitted(base, designing._log(base, designed.t, designed.q, designed.torque)), designing._heard(base)
    noises = []
    hear = promise._noises  # the same noise: a body that is known wrongly leaves more
    monkeypatch.setattr(promise, "_noises", lambda *how: (noises or noises.append(hear(*how)), noises[0])[1])
    told = promise.deviations(base.fit, base.motion, new, heard)
    own = {name for name in told if name.startswith("lower.")}
    assert all(told[name]["after"] < 1e-3 * designed.deviations[name]["after"] for name in own & set(designed.deviations))
    std = np.array([np.nan if name.startswith("lower.") else s for name, s in zip(base.fit.model.names, base.fit.uncertainty.std)])
    without = replace(base.fit, known=None, uncertainty=replace(base.fit.uncertainty, std=std))
    others = promise.deviations(without, base.motion, new, heard)
    assert set(others) == set(told) - own and len(others) > 5
    for name, s in others.items():
        assert s["after"] == pytest.approx(told[name]["after"], rel=0.02), name
    # nor does a motion that shows it count for more
    first = base.fit.model.names.index("lower.m")
    assert base.known.alone[first, first] == pytest.approx(1e8 * free.known.alone[first, first])


def test_noise_is_heard_in_the_test_logs_too(poor):
    base = basis.basis(pipeline.load(poor[0]), [], lambda stage, share: None)
    heard, train = designing._heard(base), base.fit.predictions["train"]
    assert len(heard.left) == len(train.t) + len(base.fit.predictions["test"].t) == len(heard.made)
    np.testing.assert_allclose(heard.left[: len(train.t)], train.residual, atol=1e-9)
    np.testing.assert_allclose(heard.left[len(train.t) :], base.fit.predictions["test"].residual, atol=1e-9)


WRONG = {
    "separate": (dict(separate=[("stribeck", "wrist")]), "wrist"),
    "effect": (dict(separate=[("stribek", "elbow")]), "stribek:elbow"),
    "duration": (dict(duration=0.5), "--duration"),
    "joint": (dict(limits_spec=LimitsSpec(velocity={"wrist": 1.0})), "wrist"),
    "empty": (dict(limits_spec=LimitsSpec(position={"elbow": [4.0, 5.0]})), "holds nothing"),
    "torque": (dict(limits_spec=LimitsSpec(torque={"shoulder": 1e-4, "elbow": 1e-4}), duration=4.0), "no motion keeps to the limits"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_designed_is_said_in_one_line(poor, name):
    options, said = WRONG[name]
    with pytest.raises(config.ConfigError) as error:
        design(pipeline.load(poor[0]), **options)
    assert said in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["separate", "effect"])
def test_a_suspect_that_is_not_there_is_told_before_any_log_is_read(poor, name, monkeypatch):
    monkeypatch.setattr(basis.experiment_logs, "read_all", lambda _: pytest.fail("a log was read"))
    with pytest.raises(config.ConfigError, match=WRONG[name][1]):
        design(pipeline.load(poor[0]), **WRONG[name][0])


def test_a_joint_whose_torque_is_unused_tells_nothing(poor):
    """Neither is its noise taken for none, nor do its rows count in what is promised."""
    folder, machine = poor
    text = (folder / "config.yaml").read_text().replace("data:", "data:\n  unused: [elbow]", 1)
    experiment = config.loads(text, folder / "config.yaml")
    suspects = [("stribeck", "elbow"), ("spring", "elbow")]
    found = design(experiment, duration=4.0, separate=suspects, processes=1)
    known = basis.basis(experiment, [], lambda *_: None).known
    assert np.isinf(known.noise[1]) and known.noise[0] < 1.0
    # the information of the shoulder's rows alone, by hand
    t = (np.arange(500) + 0.5) * 4.0 / 500
    share = known.counted(*summed(found, t)[1:])
    moved = columns(known.model, *summed(found, t))[0] * share[0]
    assert not share[1].any() and 0.9 / known.noise[0] < share[0].max() <= 1.0 / known.noise[0]
    whole = known.before + 2.0 * moved @ moved.T
    told = information(known, known.all_columns(*summed(found, t)), np.full(500, 2.0))
    np.testing.assert_allclose(told, whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())
    assert found.log_det > found.random_best
    assert found.pairs[0].probability == 0.0 and "viscous.elbow.Fv" not in found.deviations
    assert any(s["after"] < 0.9 * s["now"] for s in found.deviations.values())
    assert np.isfinite(found.margins["torque"])


def test_without_any_log_the_urdf_is_what_is_known(poor, tmp_path):
    (tmp_path / "robot.urdf").write_text(URDF)
    found = design(config.loads("robot: {urdf: robot.urdf}\n", tmp_path / "config.yaml"), duration=4.0, processes=1)
    assert found.log_det > found.random_best and found.deviations == {} and any("no log yet" in text for text in found.said)


def test_a_limits_file(tmp_path):
    (tmp_path / "l.yaml").write_text("velocity: {elbow: 1.5}\nfloor: 0.1\nmargin: 0.1\n")
    assert limits.read(tmp_path / "l.yaml").velocity == {"elbow": 1.5}
    for text, said in (("velocity: {elbow: -1}", "velocity.elbow"), ("speed: {elbow: 1}", "speed"), ("margin: 2", "margin")):
        (tmp_path / "l.yaml").write_text(text)
        with pytest.raises(config.ConfigError, match=said):
            limits.read(tmp_path / "l.yaml")


def test_a_floor_is_kept_above(arm):
    machine = arm.model.robot
    shapes = links.geometry(machine, floor=0.25)
    low = shapes.least(np.array([[0.0, 0.0], [1.5, 0.0]]))
    assert low[0] < low[1]  # hanging down from a metre, the arm ends at a quarter of one or so


@pytest.mark.parametrize("floor", [None, 0.1])
def test_pairs_that_are_not_asked_again_are_not_near(floor):
    """Along a motion the least distance, looked at where links may be near alone, is that of all pairs."""
    shapes = links.geometry(robot.load(RobotSpec(urdf=UR5)), floor=floor)
    rng = np.random.default_rng(5)
    family = Fourier(10.0, 5, 2, 6)
    q = family.motion(0.7 * rng.normal(size=(6, family.size)), np.linspace(0.0, 10.0, 300))[0]
    data, found = shapes.model.createData(), shapes.shapes.createData()
    truth = []
    for pose in q:
        pin.computeDistances(shapes.model, data, shapes.shapes, found, pose)
        truth.append(min(result.min_distance for result in found.distanceResults))
        if floor is not None:
            for shape, placed in zip(shapes.shapes.geometryObjects, found.oMg):
                height = (corners(shape.geometry) @ placed.rotation.T + placed.translation)[:, 2].min() - floor
                truth[-1] = min(truth[-1], height if shape.parentJoint else np.inf)
    for most in (0.05, 0.5):
        np.testing.assert_allclose(shapes.least(q, most), np.minimum(truth, most), atol=1e-9)
    assert shapes.nearest(q) == pytest.approx(min(truth), abs=1e-9)
    near = shapes.near(q, 0.05)
    assert set(near.pose) == set(np.flatnonzero(np.array(truth) < 0.05)) and len(near.pose) > 10


def test_a_design_shows_itself(poor, designed, tmp_path):
    import sysid

    assert "design" in dir(sysid) and sysid.design.__doc__
    assert len(repr(designed)) < 200 and "stribeck" in repr(designed)
    table = designed.to_dataframe()
    assert table.columns[:3] == ["t", "q_shoulder", "q_elbow"] and len(table) == len(designed.t)
    designed.plot().savefig(tmp_path / "design.png")
    again = sysid.design(sysid.load(poor[0]), duration=4.0)
    assert again.family.duration == 4.0
