"""Peak memory and processor time of a fit as its log grows."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from .arm import PANDA, write_arm_log
from .processes import CONFIG, LOG, ROOT, run

TIMES = 50
LOOP = """
import os, sys, time
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as sysid: threads cost more than they give
import numpy as np
import pinocchio as pin
import polars
import scipy.signal

joints = [f"panda_joint{k}" for k in range(1, 8)]
full = pin.buildModelFromUrdf(sys.argv[1])
others = [k for k in range(1, full.njoints) if full.names[k] not in joints]
model = pin.buildReducedModel(full, others, pin.neutral(full))
table = polars.read_parquet(sys.argv[2])
columns = lambda kind: np.column_stack([table[f"{kind}_{j}"].to_numpy() for j in joints])
q, tau = columns("q"), columns("tau")
del table
q, qd, qdd = (scipy.signal.savgol_filter(q, 101, 4, deriv=d, delta=1e-3, axis=0) for d in range(3))
data, calls, triangle = model.createData(), 0.0, np.zeros((0, 85))
for start in range(0, len(q), 4096):
    part = range(start, min(start + 4096, len(q)))
    rows = np.zeros((len(part), 7, 85))
    begun = time.process_time()
    for n, k in enumerate(part):
        rows[n, :, :70] = pin.computeJointTorqueRegressor(model, data, q[k], qd[k], qdd[k])
    calls += time.process_time() - begun
    for j in range(7):
        rows[:, j, 70 + j], rows[:, j, 77 + j], rows[:, j, 84] = qd[part, j], np.sign(qd[part, j]), tau[part, j]
    triangle = np.linalg.qr(np.concatenate([triangle, rows.reshape(-1, 85)]), mode="r")
sys.stderr.write(str(calls))
"""


def memory() -> dict:
    """Peak memory of a fit on the log once and on its copies end to end, each run backwards after the other."""
    import polars as pl

    table = pl.read_parquet(LOG)
    peaks, samples = [], []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        text = CONFIG.read_text().replace("../data/cheetah3/", f"{ROOT}/data/cheetah3/")
        for times in (1, TIMES):
            # a mirrored copy joins on smoothly in position, so that the long log is one segment
            parts = [table if k % 2 == 0 else table.reverse() for k in range(times)]
            long = pl.concat(parts).with_columns(pl.int_range(pl.len()).mul(1e-3).alias("t"))
            long.write_parquet(path / "train.parquet")
            (path / "long.yaml").write_text(
                text.replace(f"{ROOT}/data/cheetah3/train.parquet", "train.parquet")
            )
            samples.append(long.height)
            peaks.append(
                run(
                    [
                        sys.executable,
                        "-m",
                        "sysid",
                        "fit",
                        str(path / "long.yaml"),
                        "--quiet",
                        "--out",
                        str(path / "run"),
                    ]
                )[1]
            )
    growth = (peaks[1] - peaks[0]) / (3 * (samples[1] - samples[0]))
    return {
        "bytes_per_joint_sample": growth,
        "samples": samples,
        "megabytes": [peak / 1e6 for peak in peaks],
    }


def long(samples: int) -> dict:
    """`sysid fit` and the plain loop on the longer log, once each, and `sysid fit` on 0.7 million samples."""
    from sysid import urdf_files

    counts, joints = [700_000, samples], ", ".join(f"panda_joint{k}" for k in range(1, 8))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        write_arm_log(path / "test.parquet", 20_000, 1)
        runs = []
        for count in counts:
            write_arm_log(path / f"{count}.parquet", count, 0)
            (path / f"{count}.yaml").write_text(
                f"robot: {{urdf: '{PANDA}', joints: [{joints}]}}\n"
                f"data: {{train: [{count}.parquet], test: [test.parquet], columns: {{time: t, position: 'q_{{joint}}', torque: 'tau_{{joint}}'}}}}\n"
                "model: {effects: [viscous, coulomb]}\n"
            )
            runs.append(
                run(
                    [
                        sys.executable,
                        "-m",
                        "sysid",
                        "fit",
                        str(path / f"{count}.yaml"),
                        "--quiet",
                        "--out",
                        str(path / "run"),
                    ]
                )
            )
        said: list[str] = []
        loop = run(
            [
                sys.executable,
                "-c",
                LOOP,
                str(urdf_files.locate(PANDA, path)),
                str(path / f"{samples}.parquet"),
            ],
            said,
        )
    peaks = [1e-6 * run[1] for run in runs]
    return {
        "ratio": runs[1][2] / loop[2], "fit_microseconds": 1e6 * runs[1][2] / samples, "loop_microseconds": 1e6 * loop[2] / samples,
        "calls_microseconds": 1e6 * float(said[0]) / samples, "samples": counts, "megabytes": peaks, "growth": peaks[1] / peaks[0],
    }  # fmt: skip
