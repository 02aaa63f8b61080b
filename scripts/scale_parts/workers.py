"""Many long logs of a seven-joint arm, fitted by one process, by two workers, and by two of which one
is killed half-way."""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from scripts import benchmark

TOP = 4.0  # s: no worker that works was less long at it


def experiment(folder: Path, files: int, samples: int) -> Path:
    """Writes logs of so many samples each, and an experiment of them."""
    joints = ", ".join(f"panda_joint{k}" for k in range(1, 8))
    names = [f"{k:03}.parquet" for k in range(files)]
    for k, name in enumerate(names):
        benchmark.write_arm_log(folder / name, samples, k)
    benchmark.write_arm_log(folder / "test.parquet", 20_000, files)
    path = folder / "config.yaml"
    path.write_text(
        f"robot: {{urdf: '{benchmark.PANDA}', joints: [{joints}]}}\n"
        f"data: {{train: [{', '.join(names)}], test: [test.parquet], "
        "columns: {time: t, position: 'q_{joint}', torque: 'tau_{joint}'}}\n"
        "model: {effects: [viscous, coulomb]}\n"
    )
    return path


def parameters(run: Path) -> np.ndarray:
    """Of a run folder."""
    found = json.loads((run / "fit.json").read_text())["parameters"]
    return np.array([one["value"] for one in found])


def fitted(config: Path, run: Path, workers: int, kill: float | None = None) -> float:
    """Wall time [s] of a fit by so many workers; one of them is killed after so many seconds."""
    command = [sys.executable, "-m", "sysid", "fit", str(config), "--quiet", "--out", str(run)]
    begun = time.perf_counter()
    process = subprocess.Popen(
        [*command, "--workers", str(workers)], env=benchmark.environment(), stderr=subprocess.PIPE
    )
    if kill is not None:
        _killed(process.pid, begun + kill)
    said = process.communicate()[1].decode()
    if process.returncode:
        sys.exit(f"{command} failed: {said[-500:]}")
    return time.perf_counter() - begun


def _killed(parent: int, at: float) -> None:
    """Waits until then, and ends the descendant that has worked most."""
    import psutil

    time.sleep(max(at - time.perf_counter(), 0.0))
    spent = lambda p: sum(p.cpu_times()[:2])  # noqa: E731
    worker = max(psutil.Process(parent).children(recursive=True), key=spent)
    if spent(worker) < TOP:
        sys.exit("no worker was at work when one was to be killed")
    worker.kill()


def measured(files: int, samples: int, repeats: int) -> dict:
    """Medians of fits by one process and by two workers in turns; then one with a worker killed
    half-way."""
    folder = Path(tempfile.mkdtemp())
    load = []
    try:
        config = experiment(folder, files, samples)
        times: dict[int, list[float]] = {1: [], 2: []}
        for _ in range(repeats):
            for workers, spent in times.items():
                load.append(os.getloadavg()[0])
                spent.append(fitted(config, folder / f"run{workers}", workers))
        one, two = (statistics.median(spent) for spent in times.values())
        killed = fitted(config, folder / "killed", 2, kill=0.5 * two)
        x = {name: parameters(folder / name) for name in ("run1", "run2", "killed")}
    finally:
        shutil.rmtree(folder)
    apart = lambda name: float(np.max(np.abs(x[name] / x["run1"] - 1.0)))  # noqa: E731
    return {
        "samples": files * samples, "files": files, "one_seconds": one, "two_seconds": two,
        "ratio": one / two, "apart": apart("run2"), "killed_seconds": killed,
        "killed_apart": apart("killed"), "loads": load,
    }  # fmt: skip


def told(entry: dict) -> str:
    """The figures in words."""
    loads = ", ".join(f"{load:.1f}" for load in entry["loads"])
    return (
        f"{entry['samples']} samples of seven joints in {entry['files']} files: "
        f"one process {entry['one_seconds']:.0f} s / two workers {entry['two_seconds']:.0f} s = "
        f"{entry['ratio']:.2f}; parameters apart by {entry['apart']:.0e}; one of two killed "
        f"half-way {entry['killed_seconds']:.0f} s, apart by {entry['killed_apart']:.0e}; "
        f"load of the machine before each: {loads}"
    )
