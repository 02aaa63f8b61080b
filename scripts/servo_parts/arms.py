"""Arms drawn in MuJoCo with a URDF that is off, their experiments, and what is true of them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from tests import servos

FINE = 20000.0  # Hz


def drawn(folder: Path, seed: int, number: int, options) -> servos.Servos:
    """An arm in a folder: train.csv, test.csv, true.urdf, robot.urdf as a user has it (known.urdf: the last link right)."""
    rng = np.random.default_rng([seed, number])
    dof = 1 + number % 6
    urdf, true = servos.arm_urdf(rng, dof), servos.draw(rng, dof)
    wrong = np.random.default_rng([seed, number, 1])
    for name, off in (("true", 0), ("robot", dof), ("known", dof - 1)):
        (folder / f"{name}.urdf").write_text(mistaken(urdf, off, options.urdf_error, wrong))
    kept = {
        "rate": options.rate,
        "noise": options.noise,
        "bits": options.bits,
        "period": options.period,
    }
    for part in ("train", "test"):
        log = servos.run(
            urdf,
            true,
            rng,
            options.seconds,
            fine=steps_of(options.rate),
            jerk=options.jerk,
            limit=options.limit,
            **kept,
        )
        servos.record(folder / f"{part}.csv", *log)
    return true


def mistaken(urdf: str, count: int, share: float, rng) -> str:
    """A URDF with its first `count` links' masses (inertias with them) and centres of mass off by a share."""
    robot = ElementTree.fromstring(urdf)  # our own text
    for k in range(1, count + 1):
        scale, along = np.exp(share * rng.normal(size=2))
        inertial = robot.find(f"link[@name='link_{k}']/inertial")
        keys = [("mass", "value"), *(("inertia", key) for key in ("ixx", "iyy", "izz"))]
        for tag, key in keys:
            inertial.find(tag).set(key, str(float(inertial.find(tag).get(key)) * scale))
        x, y, z = inertial.find("origin").get("xyz").split()
        inertial.find("origin").set("xyz", f"{x} {y} {float(z) * along}")
    return ElementTree.tostring(robot, encoding="unicode")


def steps_of(rate: float) -> int:
    """MuJoCo's steps in a sample of the log: 0.05 ms or less."""
    return max(10, round(FINE / rate))


def truth(true: servos.Servos, rate: float, case: str) -> dict:
    """{(kind, joint): value}.

    MuJoCo's step puts a force into the speed at its end, which moves the angle: a command acts half a step early, and damping
    of the speed at the step's end is, to first order, an inertia of half a step's damping.
    """
    half, out = 0.5 / rate / steps_of(rate), {}
    for j in range(len(true.kp)):
        out["kp", j], out["kd + Fv", j] = true.kp[j], true.kd[j] + true.viscous[j]
        if case == "given":
            out["kd + Fv", j] = true.viscous[j]
        out["armature", j] = true.armature[j] + half * (true.kd[j] + true.viscous[j])
        out["Fc", j] = true.coulomb[j]
        out["delay", j] = true.delay * servos.TICK + 0.5 / rate - half
    return {key: float(value) for key, value in out.items()}


def configured(true: servos.Servos, case: str, rate: float) -> str:
    """The experiment file of a case."""
    entries, dof = [], len(true.kp)
    for j in range(dof):
        said = f"command: cmd_joint_{j + 1}, "
        if case == "given":
            said += (
                f"kp: {true.kp[j]}, kd: {true.kd[j]}, delay: {truth(true, rate, case)['delay', j]}"
            )
        else:
            said += "kp: free, kd: free, delay: free"
        entries.append(f"joint_{j + 1}: {{{said}}}")
    known = f"prior: {{known: [link_{dof}]}}\n" if case == "link" else ""
    urdf = "known.urdf" if case == "link" else "robot.urdf"
    return (
        f"robot: {{urdf: {urdf}}}\nmodel: {{effects: [viscous, coulomb, armature]}}\n{known}"
        f"actuator: {{{', '.join(entries)}}}\n"
    )
