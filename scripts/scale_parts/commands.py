"""Whole commands in turns with what they are held against."""

from __future__ import annotations

import statistics
import sys
import tempfile

from .processes import CONFIG, LOG, ROOT, run

FLOOR = """
import sys
import numpy as np
import pinocchio as pin
import scipy.signal

def read(path):
    import polars
    table = polars.read_parquet(path)
    columns = lambda kind: np.column_stack([table[f"{kind}_{j}"].to_numpy() for j in ("abad", "hip", "knee")])
    return columns("q"), columns("tau")

ratio = 10.604
model = pin.buildModelFromUrdf(sys.argv[1])
poses = {"abad": (0, pin.SE3(np.eye(3), np.array([0, -0.128, 0])), np.array([1.0, 0, 0])),
         "hip": (1, pin.SE3(pin.utils.rotate("z", np.pi), np.array([0, 0.045, 0])), np.array([0, 1.0, 0])),
         "knee": (2, pin.SE3.Identity(), np.array([0, 1.0, 0]))}
for name, (carrier, pose, axis) in poses.items():
    joint = model.addJoint(carrier, pin.JointModelRevoluteUnaligned(axis), pose, name + "_rotor")
    model.appendBodyToJoint(joint, pin.Inertia.FromBox(0.5, 0.09, 0.09, 0.09), pin.SE3.Identity())
drive = np.vstack([np.eye(3), ratio * np.eye(3)])
q, tau = read(sys.argv[2])
q, qd, qdd = (scipy.signal.savgol_filter(q, 101, 4, deriv=d, delta=1e-3, axis=0) @ drive.T for d in range(3))
data = model.createData()
rows = np.zeros((len(q), 3, 67))
for k in range(len(q)):
    rows[k, :, :60] = drive.T @ pin.computeJointTorqueRegressor(model, data, q[k], qd[k], qdd[k])
for j in range(3):
    rows[:, j, 60 + j], rows[:, j, 63 + j] = qd[:, j], np.sign(qd[:, j])
rows[:, :, 66] = tau
print(np.linalg.qr(rows.reshape(-1, 67), mode="r").shape)
"""


def fit_over_floor(repeats: int) -> dict:
    """Medians of alternating runs, after one warm-up of each."""
    with tempfile.TemporaryDirectory() as out:
        fit = [sys.executable, "-m", "sysid", "fit", str(CONFIG), "--quiet", "--out", out]
        floor = [
            sys.executable,
            "-c",
            FLOOR,
            str(ROOT / "data" / "cheetah3" / "leg.urdf"),
            str(LOG),
        ]
        times: dict[str, list[float]] = {"fit": [], "floor": []}
        for _ in range(repeats + 1):
            times["floor"].append(run(floor)[0])
            times["fit"].append(run(fit)[0])
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    return {
        "ratio": medians["fit"] / medians["floor"],
        "fit_seconds": medians["fit"],
        "floor_seconds": medians["floor"],
    }


def diagnose_over_fit(runs: int) -> dict:
    """Medians of alternating runs, after one warm-up of each."""
    with tempfile.TemporaryDirectory() as out:
        command = lambda word: [
            sys.executable,
            "-m",
            "sysid",
            word,
            str(CONFIG),
            "--quiet",
            "--out",
            out,
        ]  # noqa: E731
        times: dict[str, list[float]] = {"fit": [], "diagnose": []}
        for _ in range(runs + 1):
            for word, spent in times.items():
                spent.append(run(command(word))[0])
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    return {
        "ratio": medians["diagnose"] / medians["fit"],
        "diagnose_seconds": medians["diagnose"],
        "fit_seconds": medians["fit"],
        "runs": runs,
    }


def cpu(repeats: int) -> dict:
    """Medians of alternating runs, after one warm-up of each."""
    said = "import sys, sysid; sysid.write(sysid.fit(sysid.load(sys.argv[1])), sys.argv[2])"
    with tempfile.TemporaryDirectory() as out:
        commands = {
            "command": [sys.executable, "-m", "sysid", "fit", str(CONFIG), "--quiet", "--out", out],
            "python": [sys.executable, "-c", said, str(CONFIG), out],
        }  # fmt: skip
        times: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(repeats + 1):
            for name, command in commands.items():
                times[name].append(run(command)[2])
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    return {
        "ratio": medians["python"] / medians["command"],
        "python_seconds": medians["python"],
        "command_seconds": medians["command"],
    }
