"""What labs' logs have in them, held against what truth.json says, and against closed forms."""

import json
from pathlib import Path

import numpy as np
import pytest

from sysid import pipeline, regressor, robot, robot_spec
from sysid.errors import SysidError
from sysid.simulate import hidden, load, motion, motions, simulate
from tests.conftest import URDF

ROOT = Path(__file__).resolve().parent.parent
RATE = 500.0


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    file = tmp_path_factory.mktemp("planar") / "robot.urdf"
    file.write_text(URDF)
    return robot.load(robot_spec.RobotSpec(urdf=str(file)))


@pytest.fixture(scope="module")
def leg():
    return load(ROOT / "configs" / "cheetah3.yaml")[1]


@pytest.fixture(scope="module")
def shop(arm):
    """Moves with everything in them."""
    return simulate(
        arm, seed=5, duration=15.0, rate=RATE, motion="moves", knocks=3, spikes=0.5, brakes=True,
        encoder=0,
    )  # fmt: skip


def events(log, kind):
    return [event for event in log.events if event["kind"] == kind]


def rows_of(log, event):
    return (log.t > event["start"] - 1e-9) & (log.t < event["stop"] + 1e-9)


def unexplained(machine, simulation, log):
    """Torque (n, dof) that acted beyond what bodies, motors and friction need in the true states."""
    truth, clean = simulation.truth, log.clean
    pi = np.array(list(truth["inertias"].values()))
    friction = [truth["friction"][joint] for joint in machine.joints]
    viscous, coulomb = (np.array([own[key] for own in friction]) for key in ("Fv", "Fc"))
    armature = np.array([truth["armature"].get(joint, 0.0) for joint in machine.joints])
    qdd = np.gradient(clean.qd, log.t[1] - log.t[0], axis=0)
    needed = regressor.torque(machine, pi, clean.q, clean.qd, qdd) + armature * qdd
    return clean.tau - needed - viscous * clean.qd - coulomb * np.sign(clean.qd)


def test_without_nuisances_nothing_has_changed(leg):
    """The numbers are those of the commit before there were any."""
    found = simulate(leg, hide=[hidden("stribeck:hip")], seed=11, duration=2.0)
    assert list(found.logs) == ["train", "test"] and found.train.events == found.test.events == ()
    np.testing.assert_allclose(
        found.train.tau[[0, 500, 1999], 1], [-1.028, -0.377, 0.292], atol=1e-12
    )
    known = [0.68862052485219, 0.1713504567380745, -0.6402677260639238]
    np.testing.assert_allclose(found.test.q[[0, 500, 1999], 2], known, rtol=1e-9)
    noise = {"abad": 0.03846581855428368, "hip": 0.02955105318966864, "knee": 0.01442308065441256}
    assert found.truth["logs"]["test"]["noise_rms"] == pytest.approx(noise, rel=1e-9)


@pytest.mark.parametrize("kind", motions.KINDS)
def test_motions_are_smooth_and_keep_within_the_room(leg, kind):
    """qd and qdd are the derivatives of q, but at corners; no joint leaves its range or is too fast."""
    t = np.arange(-1000, 20001) * 1e-3
    reference = motions.draw(kind, leg, t, np.random.default_rng(3))
    middle, half = motion.room(leg)
    assert (np.abs(reference.q - middle) <= half + 1e-9).all() and not reference.qd[0].any()
    assert (np.abs(reference.qd) <= 1.16 * motion.top_speeds(leg)).all()
    slope = np.gradient(reference.q, t, axis=0)
    np.testing.assert_allclose(slope[1:-1], reference.qd[1:-1], atol=2e-2)
    bend = np.gradient(reference.qd, t, axis=0)[1:-1]
    assert np.mean(np.abs(bend - reference.qdd[1:-1]) > 0.02 * np.abs(reference.qdd).max()) < 0.02


def test_moves_stop_and_sines_are_sines(leg):
    t = np.arange(-1000, 20001) * 1e-3
    moves = motions.draw("moves", leg, t, np.random.default_rng(4))
    rests = (moves.qd == 0.0) & (moves.qdd == 0.0)
    assert (rests.mean(0) > 0.1).all() and (rests.mean(0) < 0.9).all()
    assert np.any(rests.any(1) & ~rests.all(1)), "some rest while others move"
    edges = np.flatnonzero(np.diff(rests.all(1).astype(int)))
    assert (np.diff(t[edges]) >= 0.19).all() and len(edges) > 10
    sines = motions.draw("sines", leg, t, np.random.default_rng(4))
    for j in range(leg.dof):
        use = t > 0.0
        q, qdd = sines.q[use, j], sines.qdd[use, j]
        slope, offset = np.polyfit(q, qdd, 1)  # qdd = -w^2 (q - middle)
        np.testing.assert_allclose(qdd, slope * q + offset, atol=1e-8)
        assert 0.04 < np.sqrt(-slope) / (2.0 * np.pi) / motion.quickness(leg) < 0.16


@pytest.mark.long
def test_a_braked_joint_repeats_itself_and_reads_nothing(shop):
    for log in shop.logs.values():
        found = events(log, "brake")
        assert len(found) > 3 and {joint for event in found for joint in event["joints"]} == {
            "shoulder",
            "elbow",
        }
        braked = np.zeros(log.tau.shape, dtype=bool)
        for event in found:
            (joint,) = event["joints"]
            j, rows = shop.robot.joints.index(joint), rows_of(log, event)
            assert list(np.flatnonzero(rows)[[0, -1]] + [0, 1]) == event["rows"]
            assert (
                not log.tau[rows, j].any()
                and len(set(log.q[rows, j])) == 1
                and not log.clean.qd[rows, j].any()
            )
            braked[rows, j] = True
        assert (braked.mean(0) > 0.05).all() and (np.mean(log.tau[~braked] == 0.0) < 0.02)


@pytest.mark.long
def test_a_brake_holds_what_its_motor_cannot(arm):
    """Its joint is still though others swing, and no integral has run away when it opens."""
    found = simulate(arm, seed=6, duration=15.0, rate=RATE, motion="moves", brakes=True, encoder=0)
    free = simulate(arm, seed=6, duration=15.0, rate=RATE, motion="moves", encoder=0)
    wander = lambda log: np.abs(log.clean.q - found.train.clean.q).max()  # noqa: E731
    assert (
        wander(free.train) < 0.05
        and np.abs(found.train.clean.tau).max() < 1.2 * np.abs(free.train.clean.tau).max()
    )


@pytest.mark.long
def test_spikes_are_where_they_are_said_to_be(arm):
    """With and without them, the log differs there and nowhere else."""
    clean, spiked = (
        simulate(arm, seed=2, duration=10.0, rate=RATE, spikes=spikes) for spikes in (0.0, 2.0)
    )
    for name, log in spiked.logs.items():
        plain = clean.logs[name]
        np.testing.assert_array_equal(log.q, plain.q)
        np.testing.assert_array_equal(log.noise, plain.noise)
        expected = np.zeros(log.tau.shape, dtype=bool)
        for event in events(log, "spike"):
            first, last = event["rows"]
            assert (
                1 <= last - first <= 3
                and event["start"] == log.t[first]
                and event["stop"] == log.t[last - 1]
            )
            j = arm.joints.index(event["joints"][0])
            expected[first:last, j] = True
            assert np.abs(log.tau - plain.tau)[first:last, j].max() > 2.9 * log.noise[j]
        np.testing.assert_array_equal(log.tau != plain.tau, expected)
        assert 20 <= len(events(log, "spike")) <= 60  # 2 a second and joint over 10 s: 40


@pytest.mark.long
def test_a_knock_shows_on_several_joints_and_moves_them(leg):
    plain, knocked = (
        simulate(leg, seed=3, duration=8.0, motion="moves", knocks=knocks) for knocks in (0, 2)
    )
    for name, log in knocked.logs.items():
        found = events(log, "knock")
        assert len(found) == 2
        gone = np.abs(unexplained(leg, knocked, log))
        inside = np.zeros(len(log.t), dtype=bool)
        for event in found:
            assert 0.02 <= event["stop"] - event["start"] <= 0.06 and len(event["joints"]) >= 2
            rows = rows_of(log, event)
            inside |= rows
            for joint in event["joints"]:
                j = leg.joints.index(joint)
                assert gone[rows, j].max() == pytest.approx(
                    event["torque"][j], rel=0.3, abs=3.0 * log.noise[j]
                )
                assert gone[rows, j].max() > 2.0 * log.noise[j]
        before = log.t < found[0]["start"]
        np.testing.assert_array_equal(
            log.clean.q[before][:-1], plain.logs[name].clean.q[before][:-1]
        )
        after = rows_of(log, {"start": found[0]["stop"], "stop": found[0]["stop"] + 0.1})
        assert np.abs(log.clean.q - plain.logs[name].clean.q)[after].max() > 1e-4


def test_a_slow_logger_s_steps_are_uneven_and_its_values_are_of_their_stamps(arm):
    found = simulate(arm, seed=1, duration=10.0, rate=100.0, jitter=2.0, encoder=0)
    steps = np.diff(found.train.t)
    assert len(steps) == 1000 and found.train.t[0] == 0.0 and (steps > 0.0).all()
    np.testing.assert_allclose(found.train.t, np.round(found.train.t, 3), atol=1e-12)
    assert steps.std() == pytest.approx(
        np.sqrt(2.0) * 2e-3, rel=0.15
    ) and steps.mean() == pytest.approx(0.01, rel=1e-3)
    steady = simulate(arm, seed=1, duration=10.0, rate=1000.0, encoder=0)
    truly = np.stack(
        [np.interp(found.train.t, steady.train.t, steady.train.q[:, j]) for j in range(2)], axis=1
    )
    late = np.abs(found.train.q - truly).max(0)
    assert (late <= 1.6e-3 * np.abs(steady.train.clean.qd).max(0)).all() and (late > 0.0).all()


@pytest.mark.parametrize("current", [0.05, "2%"])
def test_a_coarse_current_comes_in_steps(arm, current):
    found = simulate(arm, seed=1, duration=4.0, rate=RATE, current=current, spikes=1.0)
    plain = simulate(arm, seed=1, duration=4.0, rate=RATE)
    for j in range(2):
        values = np.unique(found.train.tau[:, j])
        step = np.diff(values).min()
        np.testing.assert_allclose(values / step, np.round(values / step), atol=1e-6)
        assert current == "2%" or step == pytest.approx(0.05)
    if current == "2%":
        known = np.abs(plain.train.clean.tau).max(0)
        steps = [np.diff(np.unique(found.train.tau[:, j])).min() for j in range(2)]
        assert (np.array(steps) < 0.04 * known).all() and (np.array(steps) > 0.005 * known).all()
    assert (found.train.noise > plain.train.noise).all()


@pytest.mark.long
def test_several_logs_are_a_folder_that_fits(cli, tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    bench = tmp_path / "arm.yaml"
    bench.write_text(
        "robot: {urdf: arm.urdf}\npreprocess: {filter: butterworth, cutoff: 15, torque: same}\n"
    )
    words = ["--duration", "3", "--rate", "250", "--json"]
    said = cli("simulate", bench, "--logs", "3", "--knocks", "1", *words, out=tmp_path / "logs")
    assert said.status == 0, said.err
    truth = json.loads(said.out)
    names = ["train_1", "train_2", "train_3", "test"]
    assert list(truth["logs"]) == names and all(
        len(log["events"]) == 1 for log in truth["logs"].values()
    )
    spec = pipeline.load(tmp_path / "logs")
    assert [log.file for log in spec.data.train] == ["train_1.csv", "train_2.csv", "train_3.csv"]
    assert [log.file for log in spec.data.test] == ["test.csv"]
    assert len({(tmp_path / "logs" / f"{name}.csv").read_text() for name in names}) == 4
    assert pipeline.fit(spec).solution.converged
    assert cli("simulate", bench, *words, out=tmp_path / "logs").status == 0
    left = sorted(path.name for path in (tmp_path / "logs").iterdir())
    assert left == ["config.yaml", "robot.urdf", "test.csv", "train.csv", "truth.json"]


def test_a_drive_that_reports_its_command(arm):
    """Beyond its limit no more torque acts than the limit, and the log says what was asked for."""
    found = simulate(
        arm,
        hide=[hidden("torque_saturation:elbow:reports=command")],
        seed=1,
        duration=8.0,
        rate=1000.0,
        noise=0.0,
    )
    (entry,) = found.truth["hidden"]
    limit = entry["values"]["limit"]
    assert entry["values"]["reports"] == "command"
    for log in found.logs.values():
        asked = log.clean.tau[:, 1]
        np.testing.assert_array_equal(log.tau, log.clean.sensed)
        np.testing.assert_array_equal(log.clean.sensed, log.clean.tau)
        beyond = np.abs(asked) > 1.02 * limit
        deep = (np.convolve(beyond, np.ones(5), "same") == 5) & (np.abs(log.clean.qd[:, 1]) > 0.1)
        assert deep.sum() > 10
        acted = asked - unexplained(arm, found, log)[:, 1]  # what bodies and friction needed
        np.testing.assert_allclose(np.abs(acted[deep]), limit, rtol=0.01)
    read = simulate(
        arm,
        hide=[hidden("torque_saturation:elbow:reports=actual")],
        seed=1,
        duration=2.0,
        noise=0.0,
    )
    assert np.abs(read.train.tau[:, 1]).max() <= read.truth["hidden"][0]["values"]["limit"]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ({"motion": "dance"}, ["--motion dance", "exciting, moves, sines"]),
        ({"brakes": True}, ["--brakes", "--motion moves"]),
        ({"knocks": -1}, ["--knocks", "0 to 100"]),
        ({"logs": 0}, ["--logs", "1 to"]),
        ({"spikes": float("nan")}, ["--spikes"]),
        ({"jitter": 9.0}, ["--jitter", "half a step"]),
        ({"current": "much"}, ["--current much", "2%"]),
        ({"current": "80%"}, ["--current 80%"]),
        ({"current": -1.0}, ["--current"]),
    ],
)
def test_what_cannot_be_is_said_in_one_line(arm, words, complaint):
    with pytest.raises(SysidError) as caught:
        simulate(arm, duration=1.0, rate=RATE, **words)
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in complaint)


def test_words_of_a_hidden_effect_are_checked():
    assert hidden("torque_saturation:elbow:reports=command,limit=2").values == {
        "reports": "command",
        "limit": 2.0,
    }
    for wrong in ("torque_saturation:elbow:reports=loudly", "stribeck:elbow:reports=command"):
        with pytest.raises(SysidError):
            hidden(wrong)


@pytest.mark.long
def test_a_brake_that_never_opens_leaves_a_truth_that_json_can_hold(leg):
    """Short logs of moves, in some of which a joint never leaves its place: nothing of it is noisy."""
    silent = 0
    for seed in range(6):
        told = simulate(leg, seed=seed, duration=1.0, rate=200.0, motion="moves", brakes=True).truth
        json.dumps(told, allow_nan=False)
        silent += sum(0.0 in log["noise_rms"].values() for log in told["logs"].values())
    assert silent


def test_a_robot_of_one_joint_is_knocked_too(tmp_path):
    """And pushed: Pinocchio gives the Jacobian of its one joint without a second axis."""
    first, _, rest = URDF.partition('  <link name="lower">')
    (tmp_path / "one.urdf").write_text(first + rest[rest.index("  <joint") : rest.index("</joint>") + len("</joint>")] + "\n</robot>\n")
    one = robot.load(robot_spec.RobotSpec(urdf=str(tmp_path / "one.urdf")))
    assert one.dof == 1
    found = simulate(one, hide=[hidden("external_force:*")], seed=1, duration=4.0, rate=200.0, knocks=2)
    assert [event["kind"] for event in found.truth["logs"]["test"]["events"]].count("knock") == 2
