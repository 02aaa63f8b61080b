"""A fleet: base parameters, random effects against closed forms, one false-alarm rate, odd robots found and named."""

import json

import numpy as np
import pytest

import sysid
from scripts.blind_parts.robots import PLANAR
from sysid import config, fleet, regressor
from sysid.errors import SysidError
from sysid.fleet import calibration, listing
from sysid.fleet.calibration import Table
from sysid.fleet.coordinates import Coordinates, coordinates
from sysid.fleet.dates import dated
from sysid.fleet.drift import drift
from sysid.fleet.oddity import causes
from sysid.fleet.spread import inflation, judged, spread
from sysid.linearised import Linearised
from sysid.report.fleet import write
from tests.conftest import csv
from tests.problems import arm
from tests.test_lowpass import smooth

LOAD = np.array([0.6, 0.6 * 0.3, 0.0, 0.0, 0.001, 0.6 * 0.09 + 0.001, 0.6 * 0.09 + 0.001, 0.0, 0.0, 0.0])  # a ball on the fore link


# --- base parameters


def test_base_parameters_hold_all_that_torque_depends_on():
    _, structure, motion, _, _ = arm()
    found = coordinates(Linearised(structure, np.zeros(structure.size)), motion)
    rng, robot = np.random.default_rng(1), structure.robot
    q, qd, qdd = rng.normal(size=(3, 400, robot.dof))
    columns = regressor.regressor(robot, q, qd, qdd).reshape(-1, 10 * structure.bodies)
    bodies = found.chosen < 10 * structure.bodies
    assert bodies.sum() == np.linalg.matrix_rank(columns)  # 36 of 60 for a UR5
    base = columns[:, found.chosen[bodies]]
    np.testing.assert_allclose(base @ found.groups[bodies, : columns.shape[1]], columns, atol=1e-9)
    np.testing.assert_array_equal(found.groups[:, found.chosen], np.eye(found.size))
    assert [found.names[k] for k in found.of_effects] == list(structure.names[10 * structure.bodies :])


# --- random effects


def test_equal_deviations_give_the_closed_form():
    rng = np.random.default_rng(0)
    values, variance = rng.normal(3.0, 1.0, (30, 4)), 0.2
    variances = np.full(values.shape, variance)
    found = spread(values, variances)
    assert found.typical.all()
    np.testing.assert_allclose(found.mean, values.mean(0))
    np.testing.assert_allclose(found.between**2, np.var(values, axis=0, ddof=1) - variance)
    np.testing.assert_allclose(found.variance, np.var(values, axis=0, ddof=1) / 30)


def test_each_robot_is_judged_by_the_others_alone():
    rng = np.random.default_rng(1)
    values = rng.normal(0.0, 1.0, (12, 1))
    variances = np.full(values.shape, 0.3)
    found, typical = judged(values, variances), spread(values, variances).typical[:, 0]
    assert typical.sum() >= 11
    for i in range(12):
        rest = values[typical & (np.arange(12) != i), 0]
        assert found.deviation[i, 0] == pytest.approx(values[i, 0] - rest.mean())
        s2 = max(np.var(rest, ddof=1), 0.3)
        assert found.std[i, 0] == pytest.approx(np.sqrt(s2 * (1.0 + 1.0 / len(rest))))


def test_a_few_odd_robots_do_not_hide_one_another():
    rng = np.random.default_rng(2)
    values = rng.normal(0.0, 1.0, (30, 1))
    values[:4] += 15.0
    found = judged(values, np.full(values.shape, 0.1))
    assert (np.abs(found.z[:4]) > 8.0).all() and (np.abs(found.z[4:]) < 4.0).all()


def test_what_nobody_s_logs_tell_is_told_by_nobody():
    values = np.random.default_rng(3).normal(size=(6, 3))
    values[:, 1], values[0, 2] = np.nan, np.nan
    found = judged(values, np.where(np.isfinite(values), 0.1, np.nan))
    assert np.isnan(found.p[:, 1]).all() and np.isnan(found.p[0, 2]) and np.isfinite(found.p[:, 0]).all()


def test_stated_deviations_that_are_too_small_are_widened():
    rng = np.random.default_rng(4)
    stated = np.full((40, 6), 1.0)
    honest = inflation(rng.normal(0.0, 1.0, stated.shape), stated)
    assert (honest < 1.6).all() and (honest >= 1.0).all()
    wide = inflation(rng.normal(0.0, 3.0, stated.shape), stated)
    assert (np.abs(wide / 9.0 - 1.0) < 0.5).all()
    one = rng.normal(0.0, 1.0, stated.shape)
    one[:, 2] *= 6.0
    assert inflation(one, stated)[2] > 15.0 > 2.5 > inflation(one, stated)[0]


def test_the_threshold_keeps_the_rate_of_the_whole_table():
    rng, n, m = np.random.default_rng(5), 12, 5
    roots = np.array([0.3 * np.eye(m)] * n)
    mix = np.linalg.cholesky(0.5 * np.eye(m) + 0.5)  # parameters alike from robot to robot
    alarms, tables = 0, 120
    for k in range(tables):
        own = rng.normal(size=(n, m)) @ mix.T
        first, again = (own + rng.normal(0.0, 0.3, own.shape) for _ in range(2))
        table = Table(first, np.full((n, m), 0.09), again, np.full((n, m), 0.09), roots)
        factor = table.inflated()
        variances = table.variances * factor
        if k == 0:
            least = calibration.threshold(table, spread(first, variances), factor, 0.1, rng)
        alarms += np.nanmin(judged(first, variances).p) < least
    assert 3 <= alarms <= 23  # 12 are due; 99.8 % of binomial draws


def test_a_drift_over_dates_is_told_and_none_where_there_is_none():
    rng = np.random.default_rng(6)
    days = 20000.0 + np.arange(30) * 30.0
    values = rng.normal(0.0, 1.0, (30, 2))
    values[:, 0] += 2.0 * (days - days[0]) / 365.25
    variances = np.full(values.shape, 0.1)
    found = drift(days, values, variances, spread(values, variances))
    assert found.p[0] < 1e-3 and abs(found.slope[0] - 2.0) < 3.0 * found.std[0] and found.p[1] > 0.01
    assert drift(np.full(30, 20000.0), values, variances, spread(values, variances)) is None


def test_the_cause_is_a_coefficient_or_a_body():
    rng = np.random.default_rng(7)
    groups = np.zeros((16, 22))
    groups[:14, :20], groups[14:, 20:] = rng.normal(size=(14, 20)), np.eye(2)
    names = (*(f"b.{k}" for k in range(14)), "viscous.j.Fv", "coulomb.j.Fc")
    own = Coordinates(names, ("1",) * 16, np.array([*range(14), 20, 21]), groups, ("first", "second"))
    covariance, std = 0.01 * np.eye(16), np.full(16, 0.1)
    p_of = lambda z: np.exp(-0.5 * z**2)  # noqa: E731
    away = np.zeros(16)
    away[15] = 2.0
    (found,) = causes(own, away, covariance, std, p_of, 1e-5)
    assert (found.name, found.body) == ("coulomb.j.Fc", "") and found.size == pytest.approx(2.0) and found.std == pytest.approx(0.1)
    truth = rng.normal(size=10)
    away[:14] += groups[:14, 10:20] @ truth
    found = {c.body: c for c in causes(own, away, covariance, std, p_of, 1e-5)}
    assert set(found) == {"second", ""} and not found["second"].tied
    assert found["second"].values["second.hy"][0] == pytest.approx(truth[2])
    assert causes(own, np.zeros(16), covariance, std, p_of, 1e-5) == []


# --- dates and names


def test_dates_come_from_the_file_the_clock_or_the_name(tmp_path):
    def of(data="{}", log="train.csv", t=0.0):
        (tmp_path / log).write_text(csv({"t": t + np.arange(3.0), "q_a": np.zeros(3)}))
        (tmp_path / "one.yaml").write_text(f"data: {data}\n")
        return dated(config.load(tmp_path / "one.yaml"))

    assert of() is None
    said = of("{date: 2025-03-31}")
    assert (said.text, said.field) == ("2025-03-31", "data.date")
    assert of("{date: '2025-03-31'}").text == "2025-03-31"
    clock = of(t=1.75e9)
    assert clock.text == "2025-06-15" and "train.csv" in clock.field and "(t)" in clock.field
    named = of("{train: [log_2024-02-29.csv]}", log="log_2024-02-29.csv")
    assert named.text == "2024-02-29" and "name" in named.field
    with pytest.raises(SysidError, match="2026-03-31"):
        of("{date: yesterday}")


def test_experiments_are_listed_once_and_named_apart(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "config.yaml").write_text("data: {}\n")
        (tmp_path / name / "same.yaml").write_text("data: {}\n")
    paths = listing.listed([tmp_path, tmp_path / "a", str(tmp_path / "*" / "same.yaml")])
    assert [p.name for p in paths] == ["a", "b", "same.yaml", "same.yaml"]
    assert listing.names([config.load(p) for p in paths]) == ["a", "b", "a/same", "b/same"]
    with pytest.raises(SysidError, match="no experiment"):
        listing.listed([tmp_path / "nothing*"])


# --- all of it


def robots(arm_, folder, count: int, *, loaded=(), worn=()):
    """Experiments of planar arms, some with a load on the hand, some with a rough elbow."""
    for k in range(count):
        own, rng = folder / f"r{k}", np.random.default_rng([8, k])
        own.mkdir(parents=True)
        friction = np.array([[0.5, 0.3], [0.4, 0.2]]) * (1.0 + 0.08 * rng.normal(size=(2, 2)))
        friction[:, 1] *= 2.5 if k in worn else 1.0
        pi = np.array(arm_.prior) * (1.0 + 0.02 * rng.normal(size=(2, 1)))
        pi[-1] += LOAD if k in loaded else 0.0
        for part, seconds in (("train", 10), ("test", 6)):
            t = np.arange(seconds * 200) / 200.0
            q, qd, qdd = smooth(t, int(rng.integers(10**6)), 1.2)
            tau = regressor.torque(arm_, pi, q, qd, qdd) + friction[0] * qd + friction[1] * np.sign(qd)
            tau += rng.normal(0.0, 0.05, q.shape)
            columns = {"t": t} | {f"q_{j}": q[:, n] for n, j in enumerate(arm_.joints)} | {f"tau_{j}": tau[:, n] for n, j in enumerate(arm_.joints)}
            (own / f"{part}.csv").write_text(csv(columns))
        (own / "robot.urdf").write_text(PLANAR)
        (own / "config.yaml").write_text(f"data: {{date: 2026-01-{k + 1:02d}}}\n")
    return folder


@pytest.fixture(scope="module")
def mixed(tmp_path_factory, planar):
    """Twelve arms, one loaded, one worn; and one whose log is missing."""
    folder = robots(planar, tmp_path_factory.mktemp("fleet"), 12, loaded=(4,), worn=(9,))
    (folder / "gone").mkdir()
    (folder / "gone" / "config.yaml").write_text("robot: {urdf: ../r0/robot.urdf}\n")
    return folder


@pytest.fixture(scope="module")
def said(mixed, tmp_path_factory):
    document = fleet.document(sysid.fleet([mixed]))
    json.dumps(document, allow_nan=False)
    page = write(document, tmp_path_factory.mktemp("out") / "fleet.html")
    return document, page.read_text()


@pytest.mark.long
def test_odd_robots_are_found_named_and_sized(said):
    document, _ = said
    assert {e["robot"] for e in document["odd"]} == {"r4", "r9"}
    by_name = {e["parameter"]: e for e in document["odd"]}
    fore = next(e for e in document["odd"] if e["robot"] == "r4")
    assert fore["body"] == "fore" and fore["parameter"].startswith("fore.")
    moment = fore["parameters"]["fore.hx"]
    assert abs(moment["size"] - LOAD[1]) < 3.0 * moment["std"] < 0.2
    worn = by_name["coulomb.elbow.Fc"]
    assert worn["robot"] == "r9" and abs(worn["size"] - 1.5 * 0.2) < 3.0 * worn["std"] and worn["relative"] > 1.0
    differs = {d["parameter"]: d for d in document["differs"]}
    assert differs["coulomb.elbow.Fc"]["odd"] == ["r9"] and differs[fore["parameter"]]["odd"] == ["r4"]
    for d in document["differs"]:
        assert d["within"] > 0 and set(d) >= {"parameter", "between", "within", "odd"}
    assert 0.1 * 0.4 < differs["viscous.shoulder.Fv"]["between"] / 0.5 * 5.0 < 1.6  # 8 % were drawn


def test_what_every_robot_says(said):
    document, _ = said
    assert list(document["robots"]) == sorted((f"r{k}" for k in range(12)), key=lambda r: document["robots"][r]["experiment"])
    one = document["robots"]["r3"]
    assert one["date"] == "2026-01-04" and one["date_from"] == "data.date" and not one["odd"]
    for joint in ("shoulder", "elbow"):
        assert 0.04 < one["rms_test"][joint] < 0.08 and one["rms_test_of_mean"][joint] > one["rms_test"][joint]
    assert document["robots"]["r4"]["rms_test_of_mean"]["shoulder"] > 5.0 * one["rms_test_of_mean"]["shoulder"]
    assert [f["experiment"].endswith("gone/config.yaml") for f in document["failed"]] == [True]
    assert document["drift"] == [] and document["false_alarm_rate"] == 0.05


def test_the_page_says_it_and_escapes(said):
    _, page = said
    for text in ("2 of 12 robots", "coulomb.", "fore.", "What all share", "Content-Security-Policy", "2026-01-01"):
        assert text in page
    assert "http://" not in page.split('<script type="text/plain"')[0].replace("http://www.w3.org", "")


@pytest.mark.long
def test_the_command_line_leaves_another_robot_out_by_name(planar, tmp_path, cli):
    folder = robots(planar, tmp_path / "robots", 5)
    (folder / "r2" / "config.yaml").write_text("model: {effects: [viscous]}\n")
    done = cli("fleet", folder, "--json")
    assert done.status == 0 and not done.err
    document = json.loads(done.out)
    assert json.loads((done.run / "fleet.json").read_text()) == document and (done.run / "fleet.html").exists()
    assert document["odd"] == [] and list(document["robots"]) == ["r0", "r1", "r3", "r4"]
    (entry,) = document["failed"]
    assert entry["experiment"].endswith("r2/config.yaml") and "coulomb" in entry["says"]
    done = cli("fleet", folder / "r0", folder / "r1")
    assert done.status == 2 and "2 of 2 experiments can be used" in done.err and "Traceback" not in done.err
    assert cli("fleet", folder, "--rate", "2").status == 2
