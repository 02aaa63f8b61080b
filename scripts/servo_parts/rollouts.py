"""An arm as mujoco.sysid takes it: what is free, where it starts, and a log as rollouts."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco import rollout, sysid

from sysid.smoother import Smoother
from sysid.specs import PreprocessSpec

WINDOW = 2.0  # s of a rollout
STARTS = {"kp": (30.0, 1.0, 300.0), "kd": (0.5, 0.0, 5.0), "armature": (0.01, 1e-4, 0.1), "friction": (0.05, 0.0, 1.0), "delay": (0.01, 0.0, 0.05)}  # fmt: skip


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
                modifier=body(link.name, full_inertia(link.iquat, link.inertia)),
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


def full_inertia(quaternion, inertia) -> np.ndarray:
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    turn = turn.reshape(3, 3)
    whole = turn @ np.diag(inertia) @ turn.T
    return whole[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
