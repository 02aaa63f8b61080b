"""Long logs of a seven-joint arm."""

from __future__ import annotations

from pathlib import Path

PANDA = "example-robot-data://panda_description/urdf/panda.urdf"


def write_arm_log(path: Path, samples: int, seed: int) -> None:
    """A log of the seven-joint arm with viscous and Coulomb friction and noise, a row group every 100 000 samples; the motion of
    sines repeats in no time that a log lasts."""
    import numpy as np
    import polars as pl

    from sysid import regressor, robot
    from sysid.robot_spec import RobotSpec

    joints = [f"panda_joint{k}" for k in range(1, 8)]
    machine = robot.load(RobotSpec(urdf=PANDA, joints=joints))
    rng = np.random.default_rng(0)
    rate, size, phase = (
        2.0 * np.pi * rng.uniform(0.05, 1.0, (7, 6)),
        0.3 * rng.normal(size=(7, 6)),
        rng.uniform(0.0, 2.0 * np.pi, (7, 6)),
    )
    viscous, coulomb = rng.uniform(0.5, 2.0, 7), rng.uniform(0.3, 1.5, 7)
    middle = np.array([0.0, -0.5, 0.0, -1.8, 0.0, 1.5, 0.7])
    parts, every = [], 100_000
    for start in range(0, samples, every):
        t = 1e-3 * np.arange(start, min(start + every, samples))
        turn = rate * (t[:, None, None] + 1e3 * seed) + phase
        q = middle + (size * np.sin(turn)).sum(-1)
        qd, qdd = (size * rate * np.cos(turn)).sum(-1), (-size * rate**2 * np.sin(turn)).sum(-1)
        noise = np.random.default_rng([seed, start])
        tau = (
            regressor.torque(machine, machine.prior * 1.05, q, qd, qdd)
            + viscous * qd
            + coulomb * np.sign(qd)
            + 0.3 * noise.normal(size=q.shape)
        )
        q = q + 1e-5 * noise.normal(size=q.shape)
        columns = {
            f"{kind}_{joint}": values[:, k]
            for kind, values in (("q", q), ("tau", tau))
            for k, joint in enumerate(joints)
        }
        part = path.with_name(f"{path.stem}.{start}.part")
        pl.DataFrame({"t": t, **columns}).write_parquet(part)
        parts.append(part)
    pl.scan_parquet(parts).sink_parquet(path, row_group_size=every)
    for part in parts:
        part.unlink()
