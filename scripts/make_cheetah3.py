"""Simulate the Cheetah 3 leg experiment: data/cheetah3/{train,test}.parquet and truth.json.

The paper's log is not available here, so these logs stand in for it. They are simulated, not the robot's.

Truth. Links: the prior of configs/cheetah3.yaml moved in log-Cholesky coordinates about itself, so every body is
possible. Rotors: the same, but they stay solids of revolution about their spin axis, as a balanced rotor is; an
unbalanced one would shake the leg at 10.6 times its speed, far above what the Savitzky-Golay window passes.

Dynamics. M(q) qdd + h(q, qd) + Fv qd + f = tau on the full tree of links and rotors, M = G' M_full G and
h = G' rnea(Gq, G qd, 0). 8 steps a millisecond.

Friction. Moreau's time stepping: in each step M (v' - v) = dt (tau - h - Fv v' - f) is solved for v' and f together,
with f = Fc sign(v') where the joint slides and |f| <= Fc where v' = 0. Nothing is regularised: a joint truly sticks,
and does not chatter.

Control. Computed torque of the prior model along the reference, friction compensation that knows 80 % of Fc, and
a PD law on the encoder. The reference is a Fourier series for each joint, faded in from rest.

Timing. The command computed from the reading at t_k acts from t_k + T/2 to t_k + 3T/2: the encoder is read in the
middle of each hold, as drives that sample in step with their PWM do. Torque and angle logged at t_k then belong to
one instant, up to T^2; holding from t_k would set them half a sample apart, up to 0.05 N m RMS here.

Sensors. Encoder: 14 bits a turn of the motor, through the gear. Torque: what was applied, plus white noise.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import polars as pl
from scipy.signal import savgol_filter

from sysid import config, robot
from sysid.inertia import PARAMETERS, LogCholesky
from sysid.regressor import torque as inverse_dynamics

ROOT = Path(__file__).resolve().parents[1]
PERIOD, STEPS = 1e-3, 8  # s of control and logging; integration steps in it (even: a hold begins midway)
ENCODER = 2.0 * np.pi / 2**14 / 10.604  # rad at the joint
NOISE = 1.45  # N m, near the paper's RMS on test data
VISCOUS, COULOMB = np.array([0.12, 0.09, 0.06]), np.array([0.9, 0.7, 0.6])  # N m s/rad, N m
STIFFNESS, DAMPING = np.array([200.0, 200.0, 100.0]), np.array([5.0, 5.0, 2.5])  # N m/rad, N m s/rad
KNOWN_FRICTION, SOFT_SPEED = 0.8, 0.1  # share of Fc compensated; rad/s over which the compensation changes sign
REST, TOP_SPEED = np.array([0.0, 0.3, -0.6]), np.array([7.5, 10.0, 13.0])  # rad, rad/s
BAND, HARMONICS, FADE = (0.4, 3.5), 10, 1.0  # Hz, lines per joint, s
SEEDS = {"truth": 1, "train": {"motion": 2, "noise": 3}, "test": {"motion": 4, "noise": 5}}
# Sampling alone moves the RMS of 28 s of noise by 0.4 %, of 10 s by 0.7 %; both logs are as long as the paper's.
DURATION = {"train": 28.0, "test": 28.0}  # s
LEAD = 0.5  # s before logging starts: a log of a leg at rest has rows without a friction law


def true_inertias(machine, spec, random) -> np.ndarray:
    """Parameters (bodies, 10) that the identification is to find."""
    #                   alpha  d1    d2    d3    s12   s23   s13   t1    t2    t3 [m]
    spread = np.array([0.15, 0.15, 0.15, 0.15, 0.10, 0.10, 0.10, 0.01, 0.01, 0.01])
    theta = spread * random.standard_normal(machine.prior.shape)
    for row, rotor in enumerate(spec.rotors, start=machine.dof):
        across = np.flatnonzero(np.array(rotor.axis) == 0.0)
        theta[row, 1 + across] = theta[row, 1 + across[0]]
        theta[row, 4:7] = 0.0
        theta[row, 7 + across] = 0.0
    return LogCholesky(machine.prior).parameters(theta)


def reference(t, random):
    """q, qd, qdd (n, 3) of a Fourier series whose lines carry equal speed, faded in by a quintic."""
    base = 1.0 / (t[-1] - t[0])
    s = np.clip(t / FADE, 0.0, 1.0)[:, None]
    fade = (s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2 / FADE, 60 * s * (1 - s) * (1 - 2 * s) / FADE**2)
    edges = np.geomspace(BAND[0] / base, BAND[1] / base, HARMONICS + 1)
    lines = np.zeros((3, len(t), 3))
    for joint in range(3):
        # one line drawn from each part of the band; every joint draws its own
        omega = 2.0 * np.pi * base * np.round(random.uniform(edges[:-1], edges[1:]))
        phase = omega * t[:, None] + random.uniform(0.0, 2.0 * np.pi, HARMONICS)
        lines[:, :, joint] = (np.sin(phase) / omega).sum(1), np.cos(phase).sum(1), (-np.sin(phase) * omega).sum(1)
    lines *= TOP_SPEED / np.abs(lines[1]).max(0)
    q, qd, qdd = lines
    return (REST + fade[0] * q, fade[0] * qd + fade[1] * q, fade[0] * qdd + 2 * fade[1] * qd + fade[2] * q)


class Leg:
    """The true leg: state q, qd (3,), one `step` at a time."""

    def __init__(self, machine, pi, q):
        """At rest at q (3,), with bodies pi (bodies, 10)."""
        self.G, self.q, self.qd = machine.transmission, q.copy(), np.zeros(3)
        self.model = machine.with_inertias(pi)
        self.data, self.zero = self.model.createData(), np.zeros(self.model.nv)

    def step(self, tau, dt):
        """Semi-implicit Euler; sliding or sticking is decided together with the new speed."""
        G, q = self.G, self.G @ self.q
        M = pin.crba(self.model, self.data, q)  # the upper triangle
        M = G.T @ (np.triu(M) + np.triu(M, 1).T) @ G
        h = G.T @ pin.rnea(self.model, self.data, q, G @ self.qd, self.zero)
        response = np.linalg.inv(M + dt * np.diag(VISCOUS))
        free = response @ (M @ self.qd + dt * (tau - h))
        friction = COULOMB * np.sign(self.qd)
        for _ in range(100):  # projected Gauss-Seidel; done at once unless a joint reverses or sticks
            before = friction.copy()
            for j in range(3):
                speed = free[j] - dt * response[j] @ friction
                friction[j] = np.clip(friction[j] + speed / (dt * response[j, j]), -COULOMB[j], COULOMB[j])
            if np.abs(friction - before).max() < 1e-10:
                break
        self.qd = free - dt * response @ friction
        self.q = self.q + dt * self.qd


def simulate(machine, pi, t, motion_random, noise_random):
    """Logged q, the torque truly applied, and logged tau (n, 3) of one run."""
    ahead = np.append(t, t[-1] + PERIOD)
    q_ref, qd_ref, qdd_ref = reference(ahead, motion_random)
    model_torque = inverse_dynamics(machine, machine.prior, q_ref, qd_ref, qdd_ref)
    leg, dt = Leg(machine, pi, q_ref[0]), PERIOD / STEPS
    q, tau = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    command, speed, last = model_torque[0], np.zeros(3), ENCODER * np.round(leg.q / ENCODER)
    for k in range(len(t)):
        q[k], tau[k] = ENCODER * np.round(leg.q / ENCODER), command
        speed += 0.5 * ((q[k] - last) / PERIOD - speed)  # differences smoothed over two samples or so
        last = q[k]
        for _ in range(STEPS // 2):
            leg.step(command, dt)
        # the estimate is 1.5 samples old and the hold's middle is one ahead
        soon = speed + 2.5 * PERIOD * qdd_ref[k]
        known = KNOWN_FRICTION * COULOMB * np.tanh(soon / SOFT_SPEED)
        command = model_torque[k + 1] + known + STIFFNESS * (q_ref[k] - q[k]) + DAMPING * (qd_ref[k] - speed)
        for _ in range(STEPS // 2):
            leg.step(command, dt)
    return q, tau, np.round(tau + NOISE * noise_random.standard_normal(tau.shape), 3)


def check(machine, pi, q, tau) -> tuple[np.ndarray, np.ndarray]:
    """RMS per joint that the truth leaves on the filtered log [N m], and the greatest speeds [rad/s]."""
    rows = slice(50, -50)
    q, qd, qdd = (savgol_filter(q, 101, 4, deriv=d, delta=PERIOD, axis=0)[rows] for d in range(3))
    predicted = inverse_dynamics(machine, pi, q, qd, qdd) + VISCOUS * qd + COULOMB * np.sign(qd)
    return np.sqrt(np.mean((tau[rows] - predicted) ** 2, 0)), np.abs(qd).max(0)


def truth(machine, pi) -> dict:
    """What is hidden in the logs, as truth.json states it."""
    return {
        "simulated_by": "scripts/make_cheetah3.py",
        "parameters": list(PARAMETERS),
        "inertias": {body.name: list(values) for body, values in zip(machine.bodies, pi.tolist(), strict=True)},
        "friction": {joint: {"Fv": VISCOUS[j], "Fc": COULOMB[j]} for j, joint in enumerate(machine.joints)},
        "torque_noise_std": NOISE, "encoder_step": ENCODER, "seeds": SEEDS,
    }  # fmt: skip


def main():
    """Write both logs and the truth; fail where they disagree."""
    parser = argparse.ArgumentParser(description="Simulate the Cheetah 3 leg's logs.")
    parser.add_argument("--out", type=Path, default=ROOT / "data/cheetah3", help="folder for the logs and truth.json")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    experiment = config.load(ROOT / "configs/cheetah3.yaml")
    machine = robot.load(experiment.robot, experiment.folder)
    pi = true_inertias(machine, experiment.robot, np.random.default_rng(SEEDS["truth"]))
    wrong = []
    for name in ("train", "test"):
        lead = round(LEAD / PERIOD)
        t = PERIOD * np.arange(round(DURATION[name] / PERIOD) + 1 + lead)
        motion, noise = (np.random.default_rng(SEEDS[name][part]) for part in ("motion", "noise"))
        q, applied, tau = (signal[lead:] for signal in simulate(machine, pi, t, motion, noise))
        signals = {f"q_{joint}": q[:, j] for j, joint in enumerate(machine.joints)}
        signals |= {f"tau_{joint}": tau[:, j] for j, joint in enumerate(machine.joints)}
        log = pl.DataFrame({"t": np.round(t[: len(q)], 3), **signals})
        log.write_parquet(out / f"{name}.parquet", compression="zstd", compression_level=19)
        (rms, speeds), (smearing, _) = check(machine, pi, q, tau), check(machine, pi, q, applied)
        for j, joint in enumerate(machine.joints):
            print(
                f"{name:5} {joint:4} RMS that the truth leaves {rms[j]:.4f} N m, {rms[j] / NOISE:.4f} of the noise"
                f" (noise left out: {smearing[j]:.3f} N m); |qd| < {speeds[j]:.1f} rad/s,"
                f" q {q[:, j].min():.2f} to {q[:, j].max():.2f} rad, |tau| < {np.abs(applied[:, j]).max():.0f} N m"
            )
            if np.hypot(NOISE, smearing[j]) > 1.01 * NOISE:
                wrong.append(f"{name} {joint}")
    (out / "truth.json").write_text(json.dumps(truth(machine, pi), indent=1) + "\n")
    if wrong:
        raise SystemExit(f"the filter smears more than raises the noise by 1 %: {', '.join(wrong)}")


if __name__ == "__main__":
    main()
