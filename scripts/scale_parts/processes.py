"""Processes that are measured: wall time, processor time and peak memory."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
CONFIG = ROOT / "configs" / "cheetah3.yaml"
LOG = ROOT / "data" / "cheetah3" / "train.parquet"


def run(command: list[str], told: list[str] | None = None) -> tuple[float, int, float]:
    """Wall time [s], peak memory [bytes] and processor time [s] of a process; what it said on standard error is appended to `told`."""
    start = time.perf_counter()
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment()
    )
    said = process.stderr.read()
    if told is not None:
        told.append(said.decode())
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{command} failed: {said.decode()[-500:]}")
    scale = 1 if sys.platform == "darwin" else 1024
    return time.perf_counter() - start, usage.ru_maxrss * scale, usage.ru_utime + usage.ru_stime


def environment() -> dict[str, str]:
    said = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    return {**said, "PYTHONPATH": str(ROOT)}
