"""An arm in MuJoCo whose joints have what its experiment's model has, and one thing more."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

STEP, SECONDS = 0.0005, 20.0  # s of the simulation, and of a log
_HARMONICS = np.array([1, 2, 3, 5, 8, 12, 17, 23])
_SWING = 1.2  # rad to either side
_CONTROLLER, _DAMPED = 8.0, 0.8  # Hz
_SLOW = 0.005  # rad/s below which friction that is applied as a torque is less than all of it
_KNOCK = 0.05  # s that a knock lasts

#: What may be hidden, under the name that the catalogue has for it.
TORQUES = (
    "torque_bias", "asymmetric_coulomb", "asymmetric_viscous", "quadratic_drag", "stribeck",
    "position_friction", "presliding", "warmup", "cogging",
)  # fmt: skip
SENSORS = ("torque_gain", "delay", "current_lag", "encoder_offset")
NATIVE = ("spring", "elasticity", "backlash", "gravity_tilt")  # MuJoCo's own
HIDDEN = (*TORQUES, *SENSORS, *NATIVE)


@dataclass(frozen=True)
class Manner:
    """How an arm moves and what its logs are like: sines, moves from point to point with stops between
    them, or one slow sine a joint; Hz, and how much of a period a sample may be early or late; bits a turn of
    angles; noise of torque, over its RMS; steps of torque, over its greatest; share of torque samples that
    are spikes; knocks in a log."""

    motion: str = "sines"
    rate: float = 500.0
    jitter: float = 0.0
    bits: int = 18
    noise: float = 0.01
    steps: float = 0.0
    spikes: float = 0.0
    knocks: int = 0


def of_a_lab(rng: np.random.Generator) -> Manner:
    """A manner as labs have it."""
    pick = lambda *those: those[int(rng.integers(len(those)))]  # noqa: E731
    return Manner(
        pick("sines", "moves"), pick(100.0, 200.0, 500.0, 1000.0), pick(0.0, 0.0, 0.2), pick(14, 16, 18, 20),
        pick(0.005, 0.01, 0.03), pick(0.0, 0.0, 0.004), pick(0.0, 0.0, 0.002), pick(0, 0, 3),
    )  # fmt: skip


#: how logs may be: of {name: what draws a manner}
MANNERS = {"clean": lambda rng: Manner(), "labs": of_a_lab, "slow": lambda rng: Manner("slow")}


@dataclass(frozen=True)
class Arm:
    """names (dof,); torque (dof,) [N m] and inertia (dof,) [kg m^2] that say how large its joints'
    are; damping, friction, armature (dof,)."""

    urdf: str
    names: list[str]
    torque: np.ndarray
    inertia: np.ndarray
    damping: np.ndarray
    friction: np.ndarray
    armature: np.ndarray


def arm_of(urdf: str, rng: np.random.Generator) -> Arm:
    """Joints drawn for the links of a URDF."""
    model = mujoco.MjSpec.from_string(urdf).compile()
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    gravity, inertia = np.zeros((50, model.nv)), np.zeros(model.nv)
    for pose in gravity:
        data.qpos[:] = rng.uniform(-1.5, 1.5, model.nq)
        mujoco.mj_forward(model, data)
        pose[:] = data.qfrc_bias
        mujoco.mj_fullM(model, data, full)
        inertia += np.diag(full) / len(gravity)
    held = np.sqrt((gravity**2).mean(0))
    torque = np.maximum(held, 0.3 * np.median(held)) + 2.0 * inertia
    share = lambda low, high: rng.uniform(low, high, model.nv)  # noqa: E731
    names = [model.joint(j).name for j in range(model.njnt)]
    friction = torque * share(0.03, 0.1), torque * share(0.03, 0.12), inertia * share(0.05, 0.3)
    return Arm(urdf, names, torque, inertia, *friction)


def built(arm: Arm, effect: str | None, k: int, rng: np.random.Generator) -> mujoco.MjModel:
    """The arm with its bodies off the URDF's, and what MuJoCo itself makes of an effect on joint k."""
    spec = mujoco.MjSpec.from_string(arm.urdf)
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for body in (b for b in spec.bodies[1:] if b.mass > 0):
        scale = rng.uniform(0.8, 1.2)
        body.mass *= scale
        body.inertia[:] = body.inertia * scale
        body.fullinertia[:] = body.fullinertia * scale
        body.ipos[:] = body.ipos + rng.uniform(-0.01, 0.01, 3)
    for j, name in enumerate(arm.names):
        joint = spec.joint(name)
        joint.damping[0], joint.frictionloss = arm.damping[j], arm.friction[j]
        joint.armature, joint.limited = arm.armature[j], 0
        joint.solref_friction[:] = [2.0 * STEP, 1.0]
    own, inertia = spec.joint(arm.names[k]), arm.inertia[k]
    if effect in ("elasticity", "backlash"):
        (body,) = [b for b in spec.bodies if any(j.name == arm.names[k] for j in b.joints)]
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        link = body.add_joint(name="link", type=hinge, axis=np.array(own.axis), pos=np.array(own.pos))
        own.armature = arm.armature[k] + 0.3 * inertia
        if effect == "elasticity":
            stiffness = inertia * (2.0 * np.pi * rng.uniform(6.0, 10.0)) ** 2
            damping = rng.uniform(0.02, 0.1) * 2.0 * np.sqrt(stiffness * inertia)
            link.stiffness[0], link.damping[0], link.limited = stiffness, damping, 0
        else:
            half = rng.uniform(0.003, 0.01)
            link.limited, link.range[:] = 1, [-half, half]
            link.solref_limit[:] = [4.0 * STEP, 1.0]
            link.damping[0], link.armature = 0.002 * arm.torque[k], 1e-4 * inertia
    if effect == "spring":
        own.stiffness[0], own.springref = 0.15 * arm.torque[k], rng.uniform(-0.5, 0.5)
    if effect == "gravity_tilt":
        east, north = rng.uniform(0.02, 0.06, 2) * rng.choice([-1.0, 1.0], 2)
        spec.option.gravity[:] = 9.81 * np.array([east, north, -np.sqrt(1.0 - east**2 - north**2)])
    return spec.compile()


def logged(
    arm: Arm, model: mujoco.MjModel, effect: str | None, k: int, rng: np.random.Generator, manner: Manner
) -> np.ndarray:
    """A log (n, 1 + 2 dof): t, angles, torques."""
    known = mujoco.MjSpec.from_string(arm.urdf).compile()
    needed, data, dof = mujoco.MjData(known), mujoco.MjData(model), len(arm.names)
    at = np.array([model.joint(name).qposadr[0] for name in arm.names])
    by = np.array([model.joint(name).dofadr[0] for name in arm.names])
    stiffness = arm.inertia * (2.0 * np.pi * _CONTROLLER) ** 2
    damping = 2.0 * _DAMPED * arm.inertia * 2.0 * np.pi * _CONTROLLER
    t, q, qd, qdd = {"sines": wanted, "moves": moves, "slow": slow}[manner.motion](rng, dof)
    blows = knocked(rng, manner.knocks, arm.torque, t)
    data.qpos[at], data.qvel[by] = q[0], qd[0]
    law, told, when = Law(effect, arm, k), [], samples(rng, manner, len(t))
    for i, now in enumerate(t):
        angle, speed = data.qpos[at], data.qvel[by]
        needed.qpos[:], needed.qvel[:], needed.qacc[:] = angle, speed, qdd[i]
        mujoco.mj_inverse(known, needed)
        torque = needed.qfrc_inverse + arm.armature * qdd[i]
        torque = torque + stiffness * (q[i] - angle) + damping * (qd[i] - speed)
        data.qfrc_applied[by] = law.acts(torque) + blows[i]
        data.qfrc_applied[by[k]] += law.torque(angle[k], speed[k], now)
        seen = law.seen(torque)
        if i in when:
            told.append(np.concatenate([[now], law.read(angle), seen]))
        mujoco.mj_step(model, data)
    return read(np.array(told), rng, manner)


def samples(rng: np.random.Generator, manner: Manner, steps: int) -> set[int]:
    """Steps of the simulation that are logged."""
    every = round(1.0 / (manner.rate * STEP))
    kept = np.arange(0, steps, every)
    late = int(manner.jitter * every)
    if late:
        kept = np.clip(kept + rng.integers(-late, late + 1, len(kept)), 0, steps - 1)
    return set(kept.tolist())


def read(log: np.ndarray, rng: np.random.Generator, manner: Manner) -> np.ndarray:
    """A log (n, 1 + 2 dof) as sensors read it."""
    dof = (log.shape[1] - 1) // 2
    torques, angles = log[:, 1 + dof :], log[:, 1 : 1 + dof]
    size = np.sqrt((torques**2).mean(0))
    torques += rng.normal(size=torques.shape) * manner.noise * size
    if manner.spikes:
        torques += 5.0 * size * (rng.random(torques.shape) < manner.spikes) * rng.choice([-1.0, 1.0], torques.shape)
    if manner.steps:
        step = manner.steps * np.abs(torques).max(0)
        torques[:] = np.round(torques / step) * step
    step = 2.0 * np.pi / 2**manner.bits
    angles[:] = np.round(angles / step) * step
    return log


def knocked(rng: np.random.Generator, knocks: int, size: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(n, dof) what knocks do to joints whose torques are so large (dof,)."""
    out = np.zeros((len(t), len(size)))
    for start in rng.uniform(1.0, t[-1] - 1.0, knocks):
        share = (t - start) / _KNOCK
        inside = (share > 0.0) & (share < 1.0)
        out[inside] += np.sin(np.pi * share[inside, None]) * 1.5 * size * rng.normal(size=len(size))
    return out


def moves(rng: np.random.Generator, dof: int):
    """t (n,), and a motion q, qd, qdd (n, dof) from pose to pose, with stops between them."""
    t = np.arange(0.0, SECONDS, STEP)
    q, qd, qdd = np.zeros((3, len(t), dof))
    here, now = rng.uniform(-_SWING, _SWING, dof), 0.0
    while now < SECONDS:
        there, lasts, rests = rng.uniform(-_SWING, _SWING, dof), rng.uniform(0.6, 1.8), rng.uniform(0.2, 1.0)
        later = t >= now
        s = np.clip((t[later, None] - now) / lasts, 0.0, 1.0)
        far = there - here
        q[later] = here + far * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
        qd[later] = far * (30.0 * s**2 - 60.0 * s**3 + 30.0 * s**4) / lasts
        qdd[later] = far * (60.0 * s - 180.0 * s**2 + 120.0 * s**3) / lasts**2
        here, now = there, now + lasts + rests
    return t, q, qd, qdd


def slow(rng: np.random.Generator, dof: int):
    """t (n,), and one slow sine a joint q, qd, qdd (n, dof), as a first log often is."""
    t = np.arange(0.0, SECONDS, STEP)
    omega = 2.0 * np.pi * rng.uniform(0.05, 0.3, dof)
    size, angle = rng.uniform(0.4, 1.0, dof), omega * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, dof)
    return t, size * np.sin(angle), size * omega * np.cos(angle), -size * omega**2 * np.sin(angle)


def wanted(rng: np.random.Generator, dof: int):
    """t (n,), and a motion q, qd, qdd (n, dof) in which the log begins as in its middle."""
    t = np.arange(0.0, SECONDS, STEP)
    omega = 2.0 * np.pi * _HARMONICS / SECONDS
    angle = omega[:, None] * t
    sine, cosine = rng.normal(size=(2, dof, len(omega))) / _HARMONICS**0.7
    q = (sine @ np.sin(angle) + cosine @ np.cos(angle)).T
    qd = ((sine * omega) @ np.cos(angle) - (cosine * omega) @ np.sin(angle)).T
    qdd = -((sine * omega**2) @ np.sin(angle) + (cosine * omega**2) @ np.cos(angle)).T
    scale = _SWING / np.abs(q).max(0)
    return t, q * scale, qd * scale, qdd * scale


class Law:
    """What an effect that MuJoCo does not have does on joint k: a torque, or what is read."""

    def __init__(self, effect: str | None, arm: Arm, k: int):
        self.effect, self.k, self.size = effect, k, arm.torque[k]
        self.dry, self.bristle, self.past, self.lagged = arm.friction[k], 0.0, [], None

    def torque(self, q: float, qd: float, t: float) -> float:
        """What acts beside the motor [N m]."""
        along = np.tanh(qd / _SLOW)
        if self.effect == "presliding":
            self.bristle += STEP * (qd - abs(qd) * self.bristle / 0.01)
            return -0.15 * self.size * self.bristle / 0.01
        share = {
            "torque_bias": 0.15,
            "asymmetric_coulomb": -0.1 * (qd > 0.0) * along,
            "asymmetric_viscous": -0.06 * abs(qd),
            "quadratic_drag": -0.1 * qd * abs(qd),
            "stribeck": -0.15 * np.exp(-((qd / 0.15) ** 2)) * along,
            "position_friction": -0.1 * (1.0 + np.sin(2.0 * q)) * along,
            "cogging": 0.08 * np.sin(14.0 * q + 0.7),
            "warmup": 0.7 * self.dry / self.size * along * (1.0 - np.exp(-t / 6.0)),
        }.get(self.effect, 0.0)
        return self.size * float(share)

    def acts(self, torque: np.ndarray) -> np.ndarray:
        """What acts of the torque (dof,) that motors are asked for: a current loop follows late."""
        if self.effect != "current_lag":
            return torque
        own, out = torque[self.k], torque.copy()
        before = own if self.lagged is None else self.lagged
        self.lagged = before + STEP / 0.01 * (own - before)
        out[self.k] = self.lagged
        return out

    def seen(self, torque: np.ndarray) -> np.ndarray:
        """What is logged of the motors' torque (dof,)."""
        own, out = torque[self.k], torque.copy()
        if self.effect == "torque_gain":
            out[self.k] *= 1.15
        if self.effect == "delay":
            self.past = [*self.past, own][-round(0.008 / STEP) - 1 :]
            out[self.k] = self.past[0]
        return out

    def read(self, angles: np.ndarray) -> np.ndarray:
        """What is logged of the angles (dof,)."""
        return angles + 0.06 * (self.effect == "encoder_offset") * (np.arange(len(angles)) == self.k)
