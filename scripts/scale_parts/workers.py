"""Many long logs of a seven-joint arm, fitted by one process, by two workers, and by two of which one
is killed half-way."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from scripts.scale_parts.arm import PANDA, write_arm_log
from scripts.scale_parts.processes import environment

BUSY = 4.0  # s: no worker that works was less long at it


def experiment(folder: Path, files: int, samples: int) -> Path:
    """Writes logs of so many samples each, and an experiment of them."""
    joints = ", ".join(f"panda_joint{k}" for k in range(1, 8))
    names = [f"{k:03}.parquet" for k in range(files)]
    for k, name in enumerate(names):
        write_arm_log(folder / name, samples, k)
    write_arm_log(folder / "test.parquet", 20_000, files)
    path = folder / "config.yaml"
    path.write_text(
        f"robot: {{urdf: '{PANDA}', joints: [{joints}]}}\n"
        f"data: {{train: [{', '.join(names)}], test: [test.parquet], "
        "columns: {time: t, position: 'q_{joint}', torque: 'tau_{joint}'}}\n"
        "model: {effects: [viscous, coulomb]}\n"
    )
    return path


def parameters(run: Path) -> np.ndarray:
    """Of a run folder."""
    found = json.loads((run / "fit.json").read_text())["parameters"]
    return np.array([one["value"] for one in found])


def fitted(config: Path, run: Path, workers: int, kill: float | None = None) -> tuple[float, float]:
    """Of a fit by so many workers, one of which is killed after so many seconds: wall time [s], and
    processor time [s] of the command and of the worker that had most to do, one after the other."""
    command = [sys.executable, "-m", "sysid", "fit", str(config), "--quiet", "--out", str(run)]
    begun = time.perf_counter()
    process = subprocess.Popen(
        [*command, "--workers", str(workers)], env=environment(), stderr=subprocess.PIPE
    )
    main, spent = psutil.Process(process.pid), {}
    while process.poll() is None:
        with suppress(psutil.Error):
            for one in (main, *main.children(recursive=True)):
                spent[one.pid] = sum(one.cpu_times()[:2])
        if kill is not None and time.perf_counter() - begun > kill:
            worker = max(set(spent) - {main.pid}, key=spent.get)
            if spent[worker] < BUSY:
                sys.exit("no worker was at work when one was to be killed")
            psutil.Process(worker).kill()
            kill = None
        time.sleep(0.2)
    if process.returncode:
        sys.exit(f"{command} failed: {process.stderr.read().decode()[-500:]}")
    own = spent.pop(main.pid)
    return time.perf_counter() - begun, own + max(spent.values(), default=0.0)


def measured(files: int, samples: int, repeats: int) -> dict:
    """Medians of fits by one process and by two workers in turns; then one with a worker killed
    half-way."""
    folder, load = Path(tempfile.mkdtemp()), []
    try:
        config = experiment(folder, files, samples)
        times: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
        for _ in range(repeats):
            for workers, spent in times.items():
                load.append(os.getloadavg()[0])
                spent.append(fitted(config, folder / f"run{workers}", workers))
        one, two = (np.median(spent, axis=0).tolist() for spent in times.values())
        killed = fitted(config, folder / "killed", 2, kill=0.5 * two[0])
        x = {name: parameters(folder / name) for name in ("run1", "run2", "killed")}
    finally:
        shutil.rmtree(folder)
    apart = lambda name: float(np.max(np.abs(x[name] / x["run1"] - 1.0)))  # noqa: E731
    return {
        "samples": files * samples, "files": files, "one_seconds": one[0], "two_seconds": two[0],
        "ratio": one[0] / two[0], "one_processor": one[1], "two_processor": two[1],
        "processor_ratio": one[1] / two[1], "apart": apart("run2"), "killed_seconds": killed[0],
        "killed_apart": apart("killed"), "loads": load,
    }  # fmt: skip


def told(entry: dict) -> str:
    """The figures in words."""
    loads = ", ".join(f"{load:.1f}" for load in entry["loads"])
    return (
        f"{entry['samples']} samples of seven joints in {entry['files']} files: "
        f"one process {entry['one_seconds']:.0f} s / two workers {entry['two_seconds']:.0f} s = "
        f"{entry['ratio']:.2f}; processor time {entry['one_processor']:.0f} s / of the command and "
        f"the busier worker {entry['two_processor']:.0f} s = {entry['processor_ratio']:.2f}; "
        f"parameters apart by {entry['apart']:.0e}; one of two killed "
        f"half-way {entry['killed_seconds']:.0f} s, apart by {entry['killed_apart']:.0e}; "
        f"load of the machine before each: {loads}"
    )
