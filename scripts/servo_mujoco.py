"""The same servo logs identified with mujoco.sysid (pip install 'mujoco[sysid]'), and both models let go in one simulator.

mujoco.sysid fits rollouts: every joint's kp, kd (with the friction that is one with it), armature, frictionloss and delay, and
of every link but the last, which is known, mass (its inertia in proportion) and centre of mass. Its settings here: its
own optimizer with x_scale='jac', the log's period as time step, `implicitfast`, friction as stiff as that step allows,
rollouts of two seconds from states of the smoothed log (one of the whole log is lost in the wrong valley from these
starts), the command interpolated `delay` earlier by a custom rollout. It starts where a user would: kp 30, kd 0.5,
armature 0.01, friction 0.05, 10 ms, the URDF's bodies.
"""

from __future__ import annotations

import contextlib
import io
import time
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout, sysid

from sysid.inertia.pseudo import to_central
from sysid.smoother import Smoother
from sysid.specs import PreprocessSpec
from tests import servos

WINDOW = 2.0  # s of a rollout
STARTS = {"kp": (30.0, 1.0, 300.0), "kd": (0.5, 0.0, 5.0), "armature": (0.01, 1e-4, 0.1), "friction": (0.05, 0.0, 1.0), "delay": (0.01, 0.0, 0.05)}  # fmt: skip
SAME = 5e-5  # s: the steps in which both models are let go side by side


@dataclass(frozen=True)
class Found:
    """An arm as found, in MuJoCo's words: each (dof,); mass (dof,), com (dof, 3), inertia (dof, 6) about it, MuJoCo's order."""

    kp: np.ndarray
    kd: np.ndarray
    armature: np.ndarray
    friction: np.ndarray
    delay: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray


def spec_of(urdf: str, step: float) -> mujoco.MjSpec:
    """An arm with position servos and joint sensors."""
    spec = mujoco.MjSpec.from_string(urdf)
    spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= (
        mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    )
    for joint in list(spec.joints):
        joint.solref_friction[0] = 2.0 * step
        made = spec.add_actuator(
            name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        made.set_to_position(kp=STARTS["kp"][0], kv=STARTS["kd"][0])
        spec.add_sensor(
            name=f"{joint.name}_pos",
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=joint.name,
        )
    return spec


def parameters(spec: mujoco.MjSpec, free: bool) -> sysid.ParameterDict:
    """Everything to be found, with its start, bounds and place in the model."""
    model, out = spec.compile(), sysid.ParameterDict()

    def servo(name):
        def put(s, p):
            made = s.actuator(name)
            made.gainprm[0], made.biasprm[1] = p.value[0], -p.value[0]

        return put

    def damper(name):
        return lambda s, p: s.actuator(name).biasprm.__setitem__(2, -p.value[0])

    def of_joint(name, key):
        return lambda s, p: setattr(s.joint(name), key, p.value[0])

    def body(name, inertia):
        def put(s, p):
            link = s.body(name)
            link.mass, link.ipos = p.value[0], p.value[1:4]
            link.fullinertia = inertia * p.value[0] / model.body(name).mass[0]

        return put

    for joint in (model.joint(j).name for j in range(model.njnt)):
        places = {"kp": servo(joint), "kd": damper(joint), "armature": of_joint(joint, "armature"), "friction": of_joint(joint, "frictionloss"), "delay": None}  # fmt: skip
        for kind, place in places.items():
            start, low, high = STARTS[kind]
            out.add(sysid.Parameter(f"{joint}.{kind}", start, low, high, modifier=place))
    for b in range(1, model.nbody - 1) if free else ():
        link = model.body(b)
        start = np.concatenate([link.mass, link.ipos])
        low, high = (
            np.append(0.2 * link.mass, link.ipos - 0.1),
            np.append(5.0 * link.mass, link.ipos + 0.1),
        )
        out.add(
            sysid.Parameter(
                f"{link.name}.body",
                start,
                low,
                high,
                modifier=body(link.name, _full(link.iquat, link.inertia)),
            )
        )
    return out


def delayed(
    models,
    datas,
    control_signal,
    initial_states,
    param_dicts,
    rollout_signal_mapping,
    rollout_state_mapping,
    ctrl_mapping,
):
    """mujoco.sysid's rollout with every joint's command some time late."""
    from mujoco.sysid._src.trajectory import arrays2traj, sequence2array, timeseries2array

    control, times = timeseries2array(control_signal)
    control, each = control.copy(), len(control) // len(param_dicts)
    for k in range(len(control)):
        for j in range(control.shape[2]):
            late = param_dicts[k // each][f"joint_{j + 1}.delay"].value[0]
            control[k, :, j] = np.interp(times[k] - late, times[k], control[k, :, j])
    starts = sequence2array(initial_states)
    state, sensors = rollout.rollout(models, datas, starts, control)
    return arrays2traj(
        models,
        starts,
        control,
        times,
        state,
        sensors,
        rollout_signal_mapping,
        rollout_state_mapping,
        ctrl_mapping,
    )


def windows(spec: mujoco.MjSpec, t, asked, q) -> sysid.ModelSequences:
    """A training log as rollouts of some seconds, from states of the log smoothed as ours is."""
    model, step = spec.compile(), float(np.median(np.diff(t)))
    smoother = Smoother(PreprocessSpec(), step)
    smooth, speed, _ = smoother.differentiate(q)
    size, edge = round(WINDOW / step), smoother.reach
    # a sensor of MuJoCo's rollout shows the beginning of a step and is stamped with its end; the state is right
    seen = [(f"{model.joint(j).name}_qpos", sysid.SignalType.MjStateQPos) for j in range(model.nq)]
    starts, controls, sensors = [], [], []
    for a in range(edge, len(t) - edge - size, size):
        rows = slice(a, a + size)
        starts.append(sysid.create_initial_state(model, smooth[a], speed[a]))
        controls.append(sysid.TimeSeries(t[rows] - t[a], asked[rows]))
        sensors.append(sysid.TimeSeries.from_names(t[rows] - t[a], q[rows], model, seen))
    return sysid.ModelSequences(
        "arm", spec, [f"w{k}" for k in range(len(starts))], starts, controls, sensors
    )


def identified(folder: Path, free: bool, max_iters: int = 100) -> tuple[Found, float]:
    """What mujoco.sysid finds of an arm, and the CPU seconds it took."""
    start = time.process_time()
    t, q, asked = _log(folder / "train.csv")
    spec = spec_of((folder / "known.urdf").read_text(), float(np.median(np.diff(t))))
    params = parameters(spec, free)
    residual = sysid.build_residual_fn(
        models_sequences=[windows(spec, t, asked, q)], custom_rollout=delayed, n_threads=1
    )
    with contextlib.redirect_stdout(io.StringIO()):  # it prints every iteration
        best, _ = sysid.optimize(
            params, residual, optimizer="mujoco", verbose=False, max_iters=max_iters, x_scale="jac"
        )
    model = sysid.apply_param_modifiers(best, spec)
    take = lambda kind: np.array([best[f"joint_{j + 1}.{kind}"].value[0] for j in range(model.nv)])  # noqa: E731
    links = slice(1, model.nbody)
    inertia = np.array(
        [_full(model.body_iquat[b], model.body_inertia[b]) for b in range(1, model.nbody)]
    )
    found = Found(
        take("kp"),
        take("kd"),
        take("armature"),
        take("friction"),
        take("delay"),
        model.body_mass[links].copy(),
        model.body_ipos[links].copy(),
        inertia,
    )
    return found, time.process_time() - start


def _full(quaternion, inertia) -> np.ndarray:
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    turn = turn.reshape(3, 3)
    whole = turn @ np.diag(inertia) @ turn.T
    return whole[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def ours(fit) -> Found:
    """A fit of ours in MuJoCo's words."""
    told = {(d.joint, d.name): d.value for d in fit.drives}
    joints, names = fit.model.robot.joints, fit.model.names
    linear = lambda word: np.array([fit.x[names.index(word.format(j))] for j in joints])  # noqa: E731
    drive = lambda name: np.array([told[j, name] for j in joints])  # noqa: E731
    mass, com, inertia = to_central(fit.pi)
    six = inertia[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return Found(
        drive("kp"),
        drive("kd + Fv"),
        linear("armature.{}.Ia"),
        linear("coulomb.{}.Fc"),
        drive("delay"),
        mass,
        com,
        six,
    )


def missed(found: Found, folder: Path, step: float) -> np.ndarray:
    """RMS (dof,) by which an arm as found, let go in MuJoCo in steps [s] under the test log's commands, misses its angles."""
    t, q, asked = _log(folder / "test.csv")
    spec = mujoco.MjSpec.from_string((folder / "known.urdf").read_text())
    for b, link in enumerate(body for body in spec.bodies if body.name.startswith("link_")):
        link.explicitinertial, link.mass, link.ipos = True, found.mass[b], found.com[b]
        link.fullinertia = found.inertia[b]
    spec.compiler.balanceinertia = True
    drives = servos.Servos(
        found.kp, found.kd, found.armature, np.zeros_like(found.kd), found.friction, 0
    )
    model = servos.compiled(spec, drives, step)
    fine = round((t[1] - t[0]) / step)
    steps = np.arange(len(t) * fine) * step
    acting = np.stack(
        [np.interp(steps - late, t, asked[:, j]) for j, late in enumerate(found.delay)], axis=1
    )
    return np.sqrt(np.mean((servos.let_go(model, found.kp, acting, fine) - q) ** 2, axis=0))


def _log(path: Path):
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    dof = (table.shape[1] - 1) // 2
    return table[:, 0], table[:, 1 : 1 + dof], table[:, 1 + dof :]


def beside(folder: Path, fit, seconds: float, options) -> dict:
    """Both on one arm: RMS [rad] of the held-out rollout, each in its own simulator and both in one, and CPU seconds."""
    theirs, took = identified(folder, options.bodies == "free")
    t, _, _ = _log(folder / "train.csv")
    own = missed(theirs, folder, float(np.median(np.diff(t))))
    mine = ours(fit)
    return {
        "seconds": {"ours": seconds, "mujoco": took},
        "own": {"ours": list(fit.rollout.values()) if fit.rollout else None, "mujoco": own.tolist()},
        "same": {"ours": missed(mine, folder, SAME).tolist(), "mujoco": missed(theirs, folder, SAME).tolist()},
        "found": {key: {k: np.asarray(v).tolist() for k, v in vars(value).items()} for key, value in (("ours", mine), ("mujoco", theirs))},
    }  # fmt: skip


def table(arms: list[dict]) -> str:
    """Both in words, over all arms."""
    lines = []
    for kind, word in (("own", "each let go in its own simulator"), ("same", "both in MuJoCo")):
        pairs = [
            (a, b)
            for arm in arms
            if arm[kind]["ours"] and arm[kind]["mujoco"]
            for a, b in zip(arm[kind]["ours"], arm[kind]["mujoco"])
        ]
        ours_, theirs = np.array(pairs).T
        lines.append(
            f"{word}: median {np.median(ours_):.2g} rad against {np.median(theirs):.2g}, "
            f"worst {ours_.max():.2g} against {theirs.max():.2g}; "
            f"no worse on {np.sum(ours_ <= theirs)} of {len(pairs)} joints"
        )
    took = np.array([[arm["seconds"]["ours"], arm["seconds"]["mujoco"]] for arm in arms])
    ratio = took[:, 1] / took[:, 0]
    lines.append(
        f"CPU seconds: {took[:, 0].sum():.1f} against {took[:, 1].sum():.1f}, "
        f"{took[:, 1].sum() / took[:, 0].sum():.0f} times; by arm {ratio.min():.0f} to {ratio.max():.0f}, median {np.median(ratio):.0f}"
    )
    return "\n".join(lines)
