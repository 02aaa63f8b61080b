"""Simulated logs, held against inverse dynamics written here once more, from the states that no sensor saw."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from sysid import config, regressor, robot, robot_spec
from sysid.errors import SysidError
from sysid.inertia import pseudo
from sysid.simulate import Hidden, Scales, defaults, hidden, simulate
from sysid.simulate.hidden import settled
from sysid.simulate.plant import Plant, Truth
from sysid.simulate.usual_sizes import CATALOGUE
from tests.conftest import URDF

UR5 = "example-robot-data://ur_description/urdf/ur5_robot.urdf"
ROOT = Path(__file__).resolve().parent.parent
SECONDS, SLOW = 4.0, 0.03  # s; rad/s below which friction is not looked at


@pytest.fixture(scope="module")
def machines(tmp_path_factory):
    """The planar arm without rotors, the leg with them, and an arm of six joints."""
    file = tmp_path_factory.mktemp("planar") / "robot.urdf"
    file.write_text(URDF)
    leg = config.load(ROOT / "configs/cheetah3.yaml")
    return {
        "arm": robot.load(robot_spec.RobotSpec(urdf=str(file))), "leg": robot.load(leg.robot, leg.folder),
        "ur5": robot.load(robot_spec.RobotSpec(urdf=UR5)),
    }  # fmt: skip


def values_of(simulation, effect):
    (entry,) = [entry for entry in simulation.truth["hidden"] if entry["effect"] == effect]
    return entry


def second_difference(x, step):
    out = np.zeros_like(x)
    out[1:-1] = (x[2:] - 2.0 * x[1:-1] + x[:-2]) / step**2
    return out


def predicted(machine, simulation, part):
    """What the torque sensor must have seen (n, dof) without noise, by everything that truth.json says; and the load."""
    log, truth = getattr(simulation, part), simulation.truth
    step, clean = truth["run"]["control_period"], log.clean
    q, qd, qdd = clean.q, clean.qd, second_difference(clean.q, step)
    pi = np.array(list(truth["inertias"].values()))
    per_joint = lambda key: np.array([truth["friction"][joint][key] for joint in machine.joints])  # noqa: E731
    Fv, Fc = per_joint("Fv"), np.tile(per_joint("Fc"), (len(q), 1))
    Ia = np.array([truth["armature"].get(joint, 0.0) for joint in machine.joints])
    found = {(entry["effect"], entry["joint"]): entry for entry in truth["hidden"]}
    gravity = machine.gravity
    for (effect, _), entry in found.items():
        if effect == "gravity_tilt":
            roll, pitch = (entry["values"][key] for key in ("roll", "pitch"))
            R = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
            R = R @ np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
            gravity = R.T @ gravity
            np.testing.assert_allclose(truth["gravity"], gravity)
        if effect == "payload":
            v, body = entry["values"], [b.name for b in machine.bodies].index(entry["body"])
            squares = np.array([v["lx"], v["ly"], v["lz"]]) ** 2
            assert body == len([b for b in machine.bodies if b.kind == "link"]) - 1
            pi[body] += pseudo.from_central(v["m"], [v["x"], v["y"], v["z"]], v["m"] / 12.0 * np.diag(squares.sum() - squares))
    behind = np.stack([clean.q - clean.link_q, clean.qd - clean.link_qd, second_difference(clean.q - clean.link_q, step)])
    load = regressor.torque(machine, pi, q, qd, qdd, gravity=gravity, deflection=behind)
    tau = load + Ia * qdd + Fv * qd
    plus, minus, extra = Fc.copy(), Fc.copy(), np.zeros_like(q)
    for (effect, joint), entry in found.items():
        v = entry.get("values", {})
        j = machine.joints.index(joint) if joint != "*" else None
        speed, angle = (qd[:, j], q[:, j]) if j is not None else (None, None)
        if effect == "viscous":
            extra[:, j] += v["Fv"] * speed
        elif effect == "coulomb":
            plus[:, j] += v["Fc"]
            minus[:, j] += v["Fc"]
        elif effect == "asymmetric_coulomb":
            plus[:, j] += v["dF"] / 2
            minus[:, j] -= v["dF"] / 2
        elif effect == "asymmetric_viscous":
            extra[:, j] += v["dFv"] / 2 * np.abs(speed)
        elif effect in ("stribeck", "load_friction", "sublinear_viscous", "position_friction"):
            if effect == "stribeck":
                more = v["dF"] * np.exp(-((speed / v["vs"]) ** 2))
            elif effect == "load_friction":
                more = v["mu"] * np.abs(load[:, j])
            elif effect == "sublinear_viscous":
                more = v["Fa"] * np.abs(speed) ** v["a"]
            else:
                more = sum(v[f"a{k}"] * np.cos(k * angle) + v[f"b{k}"] * np.sin(k * angle) for k in (1, 2))
            plus[:, j], minus[:, j] = np.maximum(plus[:, j] + more, 0), np.maximum(minus[:, j] + more, 0)
        elif effect == "quadratic_drag":
            extra[:, j] += v["c"] * np.abs(speed) * speed
        elif effect == "directional_efficiency":
            extra[:, j] += v["e"] * np.where(load[:, j] * speed > 0, load[:, j], 0.0)
        elif effect == "warmup":
            hot = v["a"] * np.exp(-log.t / v["T"])
            extra[:, j] += hot * Fv[j] * speed
            plus[:, j] *= 1 + hot
            minus[:, j] *= 1 + hot
        elif effect == "presliding":
            z, state = np.zeros(len(q)), 0.0
            for k in range(1, len(q)):
                way = angle[k] - angle[k - 1]
                s = np.sign(way)
                state = s + (state - s) * math.exp(-abs(way) / v["x0"])
                z[k] = state
            extra[:, j] += v["F"] * z
        elif effect == "armature":
            extra[:, j] += v["Ia"] * qdd[:, j]
        elif effect == "joint_coupling":
            i = machine.joints.index(v["other"])
            extra[:, j] += v["Ia"] * qdd[:, i] + v["Fv"] * qd[:, i]
            extra[:, j] += v["Fs"] * np.tanh((qd[:, i] + speed) / 0.01) + v["Fd"] * np.tanh((qd[:, i] - speed) / 0.01)
        elif effect == "cogging":
            extra[:, j] += v["a1"] * np.sin(v["k"] * angle) + v["b1"] * np.cos(v["k"] * angle)
        elif effect == "spring":
            extra[:, j] += v["k"] * angle + v["c"]
        elif effect == "cable":
            extra[:, j] += sum(v[f"c{k}"] * (angle / math.pi) ** k for k in range(1, 6))
        elif effect == "external_force":
            row = [b.name for b in machine.bodies].index(entry["body"])
            for burst in entry["bursts"][part]:
                edge = min(0.05, 0.25 * (burst["stop"] - burst["start"]))
                share = np.clip(np.minimum(log.t - burst["start"], burst["stop"] - log.t) / edge, 0.0, 1.0)
                window = 0.5 - 0.5 * np.cos(np.pi * share)
                extra += window[:, None] * (origin_jacobian(machine, q, row) @ np.array(burst["force"]))
    tau = tau + extra + np.where(qd > 0, plus, -minus)
    for (effect, joint), entry in found.items():
        v = entry.get("values", {})
        if joint == "*":
            continue
        j = machine.joints.index(joint)
        if effect == "torque_gain":
            tau[:, j] *= 1 + v["e"]
        elif effect == "torque_saturation":
            tau[:, j] = np.clip(tau[:, j], -v["limit"], v["limit"])
        elif effect == "torque_bias":
            tau[:, j] += v["b"]
        elif effect == "delay":
            tau[:, j] = np.interp(log.t - v["d"], log.t, tau[:, j])
        elif effect == "current_lag":
            tau[:, j] += v["T"] * np.gradient(tau[:, j], step)
    return tau, load


def origin_jacobian(machine, q, body):
    """d(place of a body's frame)/dq transposed (n, dof, 3): the torques that hold a unit mass there against unit gravities."""
    pi = np.zeros((len(machine.bodies), 10))
    pi[body, 0] = 1.0
    still = np.zeros_like(q)
    return np.stack([regressor.torque(machine, pi, q, still, still, gravity=-axis) for axis in np.eye(3)], axis=-1)


def misfit(machine, simulation, part, effect=None):
    """Residual after a 15 Hz low-pass on both sides, as a share of the noise, RMS over moving rows (dof,)."""
    log, step = getattr(simulation, part), simulation.truth["run"]["control_period"]
    tau, _ = predicted(machine, simulation, part)
    sections = butter(4, 15.0, fs=1.0 / step, output="sos")
    rest = (log.clean.sensed - tau)[1:-1]
    reach = round(0.1 / step)
    out = []
    for j in range(machine.dof):
        use = np.convolve(np.abs(log.clean.qd[1:-1, j]) < SLOW, np.ones(2 * reach + 1), "same") < 0.5
        use[: 5 * reach] = use[-3 * reach :] = False
        if effect == "joint_coupling":  # the other contact's sticking is not followed
            i = machine.joints.index(values_of(simulation, effect)["values"]["other"])
            use &= np.convolve(np.abs(log.clean.qd[1:-1, i] + log.clean.qd[1:-1, j]) < SLOW, np.ones(2 * reach + 1), "same") < 0.5
        smooth = sosfiltfilt(sections, rest[:, j])
        assert use.mean() > 0.1
        out.append(np.sqrt(np.mean(smooth[use] ** 2)) / log.noise[j])
    return np.array(out)


@pytest.mark.parametrize("name", ["arm", "leg", "ur5"])
def test_a_control_is_clean(machines, name):
    machine = machines[name]
    simulation = simulate(machine, seed=3, duration=6.0)
    assert simulation.truth["hidden"] == []
    for part in ("train", "test"):
        assert (misfit(machine, simulation, part) < 0.03).all()
    exact = simulate(machine, seed=3, duration=SECONDS, encoder=0)
    assert (misfit(machine, exact, "train") < 0.005).all()


@pytest.fixture(scope="module")
def controls(machines):
    """What the same seed gives with nothing hidden."""
    return {name: simulate(machine, seed=7, duration=SECONDS) for name, machine in machines.items()}


@pytest.mark.parametrize("effect", CATALOGUE)
def test_each_effect_is_truly_there(machines, controls, effect):
    """The torque is what an independent inverse dynamics with the effect in it says; and it is not the control's."""
    name = "ur5" if effect == "external_force" else "leg" if effect in ("directional_efficiency", "joint_coupling") else "arm"
    machine, control = machines[name], controls[name]
    joint = "*" if CATALOGUE[effect].robot else machine.joints[1]
    simulation = simulate(machine, hide=[Hidden(effect, joint)], seed=7, duration=SECONDS)
    assert (misfit(machine, simulation, "train", effect) < 0.03).all()
    for key in ("inertias", "armature", "torque_noise_std", "encoder_step"):
        assert simulation.truth[key] == control.truth[key]
    if effect != "position_friction":  # which may need more of it
        assert simulation.truth["friction"] == control.truth["friction"]
    assert np.abs(simulation.train.clean.sensed - control.train.clean.sensed).max() > 0.5 * simulation.train.noise.min()


def test_friction_that_varies_by_more_than_itself_is_friction_at_every_angle(machines):
    """The truth has as much Coulomb friction as the waves need: what is simulated is their sum, and nothing of it is cut off."""
    machine = machines["arm"]
    control = simulate(machine, seed=7, duration=SECONDS)
    usual = control.truth["friction"]["elbow"]["Fc"]
    waves = {"a1": 1.1 * usual, "b1": 0.0, "a2": 0.0, "b2": -0.9 * usual}
    simulation = simulate(machine, hide=[Hidden("position_friction", "elbow", waves)], seed=7, duration=SECONDS)
    level, q = simulation.truth["friction"]["elbow"]["Fc"], np.linspace(-np.pi, np.pi, 100_000)
    varied = level + waves["a1"] * np.cos(q) + waves["b2"] * np.sin(2.0 * q)
    assert usual < level and abs(varied.min()) < 1e-6 * usual
    assert simulation.truth["friction"]["shoulder"] == control.truth["friction"]["shoulder"]
    assert (misfit(machine, simulation, "train", "position_friction") < 0.03).all()


def test_an_elastic_drive_is_a_spring(machines):
    machine = machines["arm"]
    log = simulate(machine, hide=[hidden("elasticity:elbow:K=200,D=1")], seed=2, duration=3.0, encoder=0)
    clean, step = log.train.clean, log.truth["run"]["control_period"]
    pi = np.array(list(log.truth["inertias"].values()))
    qdd = second_difference(clean.link_q, step)
    needed = regressor.torque(machine, pi, clean.link_q, clean.link_qd, qdd)[:, 1]
    given = 200.0 * (clean.q - clean.link_q)[:, 1] + 1.0 * (clean.qd - clean.link_qd)[:, 1]
    assert np.sqrt(np.mean((needed - given)[1:-1] ** 2)) < 2e-3 * np.sqrt(np.mean(needed**2))
    assert np.array_equal(clean.q[:, 0], clean.link_q[:, 0])


def test_play_lies_where_the_load_presses(machines):
    machine = machines["arm"]
    log = simulate(machine, hide=[hidden("backlash:elbow:b=0.02")], seed=2, duration=3.0)
    apart = (log.train.clean.q - log.train.clean.link_q)[:, 1]
    _, load = predicted(machine, log, "train")
    assert np.abs(apart).max() < 0.02
    pressed = np.abs(load[:, 1]) > 0.5 * np.abs(load[:, 1]).max()
    assert np.all(np.sign(apart[pressed]) == np.sign(load[pressed, 1])) and np.all(np.abs(apart[pressed]) > 0.0098)


def resting(machine, **changes):
    truth = Truth(machine.prior, np.array(machine.gravity), np.zeros(2), np.array([0.5, 0.3]), np.full(2, 0.01))
    return Plant(machine, replace(truth, **changes), [], np.zeros(2))


def test_a_joint_sticks_until_it_is_pushed(machines):
    """The arm hangs; torque below its friction moves it by nothing at all, torque above it does."""
    plant = resting(machines["arm"])
    for k in range(100):
        plant.freeze(1e-3 * k, 5e-4)
        plant.advance(np.array([0.49, -0.29]), 5e-4)
    assert not plant.v.any() and not plant.x.any() and plant.sign == [0, 0]
    np.testing.assert_allclose(plant.held, [0.49, -0.29])
    for k in range(100):
        plant.freeze(1e-3 * k, 5e-4)
        plant.advance(np.array([0.55, -0.29]), 5e-4)
    assert plant.x[0] > 1e-4 and plant.sign[0] == 1


def test_energy_is_kept_without_friction_and_lost_with_it(machines):
    import pinocchio as pin

    def energies(coulomb):
        plant = resting(machines["arm"], coulomb=np.full(2, coulomb), armature=np.zeros(2))
        plant.x[:] = [1.0, -0.7]
        out = []
        for k in range(1500):
            plant.freeze(1e-3 * k, 5e-4)
            plant.advance(np.zeros(2), 5e-4)
            plant.advance(np.zeros(2), 5e-4)
            if k % 10 == 0:
                data = plant.model.createData()
                out.append(pin.computeKineticEnergy(plant.model, data, plant.x, plant.v) + pin.computePotentialEnergy(plant.model, data, plant.x))
        return np.array(out)

    kept, lost = energies(0.0), energies(0.2)
    assert np.ptp(kept) < 2e-4 * np.ptp(lost)
    assert np.all(np.diff(lost) < 1e-6) and lost[-1] < lost[0] - 1.0


def test_the_seed_says_everything(machines):
    machine = machines["arm"]
    kwargs = {"duration": 2.0, "hide": [Hidden("stribeck", "elbow")]}
    one, same, other = (simulate(machine, seed=seed, **kwargs) for seed in (4, 4, 5))
    assert one.truth == same.truth and one.truth != other.truth
    for part in ("train", "test"):
        np.testing.assert_array_equal(getattr(one, part).tau, getattr(same, part).tau)
        np.testing.assert_array_equal(getattr(one, part).q, getattr(same, part).q)
    assert np.abs(one.train.q - one.test.q).max() > 0.1
    assert np.abs(np.corrcoef((one.train.tau - one.train.clean.sensed)[:, 0], (one.test.tau - one.test.clean.sensed)[:, 0])[0, 1]) < 0.1
    assert np.abs(one.train.clean.qd[0]).max() > 0.05  # the log starts while the robot moves


def test_sensors_are_what_was_asked_for(machines):
    machine = machines["leg"]
    simulation = simulate(machine, seed=1, duration=5.0, rate=250.0, noise=0.2, colour=0.05, share=0.8)
    log = simulation.train
    assert len(log.t) == 1251 and log.t[0] == 0.0
    np.testing.assert_allclose(np.diff(log.t), 0.004, atol=1e-12)
    added = log.tau - log.clean.sensed
    assert simulation.truth["logs"]["train"]["noise_rms"]["hip"] == pytest.approx(np.sqrt(np.mean(added[:, 1] ** 2)))
    np.testing.assert_allclose(added.std(0), 0.2, rtol=0.35)
    alike = np.mean(added[1:] * added[:-1]) / np.mean(added**2)
    assert 0.55 < alike < 0.85  # 0.8 exp(-0.004/0.05) = 0.74
    step = 2.0 * np.pi / 2**14 / 10.604
    assert list(simulation.truth["encoder_step"].values()) == pytest.approx([step] * 3)
    np.testing.assert_allclose(log.q / step, np.round(log.q / step), atol=1e-6)
    fast = simulate(machine, seed=1, duration=2.0, rate=2000.0, speed=2.0, encoder=0)
    assert len(fast.train.t) == 4001 and fast.truth["run"]["control_period"] == 0.0005
    np.testing.assert_array_equal(fast.train.q, fast.train.clean.q)
    assert 1.0 < np.abs(fast.train.clean.qd).max() < 2.6


def test_an_effect_outside_the_catalogue_can_be_hidden(machines):
    machine = machines["arm"]

    def strange(q, qd, qdd, t, load, memory):
        memory["calls"] = memory.get("calls", 0) + 1
        return np.array([0.0, 0.8 * np.sin(3.0 * q[0]) * np.sin(q[1])])

    simulation = simulate(machine, hide=[strange, Hidden("torque_bias", "shoulder", {"b": 0.5})], seed=3, duration=SECONDS, encoder=0)
    assert [entry["effect"] for entry in simulation.truth["hidden"]] == ["torque_bias", "custom"]
    clean = simulation.train.clean
    known = predicted(machine, simulation, "train")[0][:, 1] + 0.8 * np.sin(3.0 * clean.q[:, 0]) * np.sin(clean.q[:, 1])
    moving = (np.abs(clean.qd[:, 1]) > 0.1)[1:-1]
    assert np.sqrt(np.mean((clean.sensed[:, 1] - known)[1:-1][moving] ** 2)) < 0.1 * simulation.train.noise[1]


@pytest.mark.parametrize("effect", CATALOGUE)
def test_what_is_drawn_can_be_hidden(machines, effect):
    """Values drawn for any joint of any robot are in range, grow with `size`, and are read back from the command line."""
    for machine in machines.values():
        scales = scales_of(machine)
        for joint in ["*"] if CATALOGUE[effect].robot else machine.joints:
            values = defaults(effect, joint, scales, np.random.default_rng(1))
            large = defaults(effect, joint, scales, np.random.default_rng(1), size=2.0)
            text = ",".join(f"{name}={value}" for name, value in values.items())
            found = settled(hidden(f"{effect}:{joint}:{text}"), machine, scales, np.random.default_rng(2))
            for name, value in values.items():
                assert found.values[name] == (value if isinstance(value, str) else pytest.approx(value))
            assert values != large


def scales_of(machine):
    n = machine.dof
    ones = np.ones(n)
    return Scales(machine.joints, 10.0 * ones, 20.0 * ones, ones, 2.0 * ones, ones, 0.0 * ones, 0.5 * ones, 0.3 * ones, 2.0, 1.0, 5.0, 20.0)


@pytest.fixture
def bench(tmp_path):
    """An experiment file beside a URDF, without logs."""
    (tmp_path / "arm.urdf").write_text(URDF)
    file = tmp_path / "arm.yaml"
    file.write_text("robot: {urdf: arm.urdf}\npreprocess: {filter: butterworth, cutoff: 15, torque: same, standstill: mask}\nsolver: {weighting: noise}\n")
    return file


@pytest.mark.long
def test_the_folder_of_a_control_is_fitted_to_its_noise(cli, bench, tmp_path):
    said = cli("simulate", bench, "--seed", "2", "--duration", "12", "--json", out=tmp_path / "log")
    assert said.status == 0, said.err
    truth = json.loads(said.out)
    assert sorted(path.name for path in (tmp_path / "log").iterdir()) == ["config.yaml", "robot.urdf", "test.csv", "train.csv", "truth.json"]
    assert json.loads((tmp_path / "log/truth.json").read_text()) == truth
    spec = config.load(tmp_path / "log")
    assert [effect.name for effect in spec.model.effects] == ["viscous", "coulomb", "armature"] and spec.preprocess.cutoff == 15
    fitted = cli("fit", tmp_path / "log", "--json")
    assert fitted.status == 0, fitted.err
    found = json.loads(fitted.out)
    assert found["converged"]
    simulation = simulate(robot.load(spec.robot, spec.folder), seed=2, duration=12.0)
    assert simulation.truth == {key: value for key, value in truth.items() if key != "files"}
    sections = butter(4, 15.0, fs=1000.0, output="sos")
    for part in ("train", "test"):
        log = getattr(simulation, part)
        noise = np.sqrt(np.mean(sosfiltfilt(sections, log.tau - log.clean.sensed, axis=0) ** 2, axis=0))
        np.testing.assert_allclose(list(found["rms"][part].values()), noise, rtol=0.07)


def test_the_folder_does_not_tell_what_is_hidden(cli, tmp_path):
    hide = ["--hide", "stribeck:hip:dF=0.4,vs=0.1", "--hide", "gravity_tilt:*"]
    said = cli("simulate", ROOT / "configs/cheetah3.yaml", *hide, "--duration", "1", "--noise", "0.1", out=tmp_path / "log")
    assert said.status == 0 and "stribeck on hip, dF=0.4, vs=0.1" in said.out
    text = (tmp_path / "log/config.yaml").read_text()
    assert "stribeck" not in text and "tilt" not in text
    spec, original = config.load(tmp_path / "log"), config.load(ROOT / "configs/cheetah3.yaml")
    assert spec.robot.rotors == original.robot.rotors and spec.robot.joints == original.robot.joints
    assert [effect.name for effect in spec.model.effects] == ["viscous", "coulomb"]
    # the paper's weight is kept for what it reproduces: a simulation reproduces nothing
    assert spec.prior.weight == "auto" and spec.prior.model_copy(update={"weight": 1e-2}) == original.prior
    truth = json.loads((tmp_path / "log/truth.json").read_text())
    assert truth["hidden"][0] == {"effect": "stribeck", "joint": "hip", "values": {"dF": 0.4, "vs": 0.1}}
    assert truth["gravity"] != [0.0, 0.0, -9.81]
    machine = robot.load(spec.robot, spec.folder)
    assert machine.joints == ("abad", "hip", "knee")
    assert cli("simulate", ROOT / "configs/cheetah3.yaml", "--duration", "1", "--quiet", out=tmp_path / "log").out == ""  # a simulation may be replaced
    assert json.loads((tmp_path / "log/truth.json").read_text())["hidden"] == []


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--hide", "stribek:elbow"], ["stribek", "allowed: stribeck"]),
        (["--hide", "stribeck:elbo"], ["elbo", "allowed: shoulder, elbow; did you mean elbow?"]),
        (["--hide", "stribeck:elbow:df=2"], ["'df'", "dF, vs"]),
        (["--hide", "stribeck:elbow:dF=much"], ["much", "a number"]),
        (["--hide", "stribeck:elbow:vs=-1"], ["vs=-1", "a positive number"]),
        (["--hide", "stribeck:elbow:dF=nan"], ["a finite number"]),
        (["--hide", "stribeck:elbow:dF=1,dF=2"], ["twice"]),
        (["--hide", "stribeck"], ["EFFECT:JOINT"]),
        (["--hide", "stribeck:*"], ["'*'", "shoulder, elbow"]),
        (["--hide", "payload:elbow"], ["payload:*"]),
        (["--hide", "stribeck:elbow", "--hide", "stribeck:elbow"], ["hidden twice"]),
        (["--hide", "elasticity:elbow", "--hide", "backlash:elbow"], ["one of them"]),
        (["--hide", "joint_coupling:elbow:other=elbow"], ["other=elbow", "shoulder"]),
        (["--hide", "asymmetric_coulomb:elbow:dF=1000"], ["at most"]),
        (["--hide", "directional_efficiency:elbow:eta=1.2"], ["between 0 and 1"]),
        (["--hide", "spring:elbow:k=1e6", "--duration", "2"], ["from its reference", "hide less"]),
        (["--duration", "0"], ["--duration", "1 to 3600 s"]),
        (["--rate", "nan"], ["--rate"]),
        (["--noise", "-1"], ["--noise"]),
        (["--encoder", "99"], ["0 to 40 bits"]),
    ],
)
def test_what_cannot_be_simulated_is_said_in_one_line(cli, bench, words, complaint):
    cli("simulate", bench, *words).complains(*complaint)


def test_other_people_s_folders_are_left_alone(cli, bench, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.txt").write_text("all of it")
    said = cli("simulate", bench, "--duration", "1", out=mine)
    assert said.status == 2 and "no simulation" in said.err and len(said.err.splitlines()) == 1
    assert [path.name for path in mine.iterdir()] == ["thesis.txt"]
    (mine / "truth.json").write_text("[]")
    assert cli("simulate", bench, "--duration", "1", out=mine).status == 2
    assert cli("simulate", bench, "--duration", "1", out=mine / "thesis.txt").status == 2
    assert cli("simulate", tmp_path / "nothing.yaml", out=tmp_path / "new").status == 2 and not (tmp_path / "new").exists()


def test_arguments_are_checked(machines):
    for wrong in ({"share": 2.0}, {"band": (2.0, 1.0)}, {"hide": ["stribeck:elbow"]}, {"hide": [Hidden("stribeck", "wrist")]}):
        with pytest.raises(SysidError):
            simulate(machines["arm"], duration=1.0, **wrong)
