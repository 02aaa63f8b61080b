"""Processes that are measured: wall time, processor time and peak memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
CONFIG = ROOT / "configs" / "cheetah3.yaml"
LOG = ROOT / "data" / "cheetah3" / "train.parquet"


# A process takes over the peak memory of the one that starts it (Linux: what a page table had before
# `exec` counts), so a small one starts what is measured, and tells of its children.
LAUNCH = """
import resource, subprocess, sys, time
start = time.perf_counter()
code = subprocess.run(sys.argv[2:], stdout=subprocess.DEVNULL).returncode
wall, used = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
scale = 1 if sys.platform == "darwin" else 1024
with open(sys.argv[1], "w") as told:
    print(wall, used.ru_maxrss * scale, used.ru_utime + used.ru_stime, file=told)
sys.exit(code)
"""


def run(command: list[str], told: list[str] | None = None) -> tuple[float, int, float]:
    """Wall time [s], peak memory [bytes] and processor time [s] of a process; what it said on standard error is appended to `told`."""
    with tempfile.TemporaryDirectory() as folder:
        figures = Path(folder) / "figures"
        launch = [sys.executable, "-S", "-c", LAUNCH, str(figures), *command]
        done = subprocess.run(launch, stderr=subprocess.PIPE, env=environment(), check=False)
        said = done.stderr.decode()
        if told is not None:
            told.append(said)
        if done.returncode:
            sys.exit(f"{command} failed: {said[-500:]}")
        wall, peak, spent = figures.read_text().split()
    return float(wall), int(peak), float(spent)


def environment() -> dict[str, str]:
    said = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    return {**said, "PYTHONPATH": str(ROOT)}
