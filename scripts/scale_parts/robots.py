"""What a fleet costs whose robots have long logs: processor time a sample, memory, bytes that come
back of a robot, and the comparison of very many.

    python -m scripts.scale_parts.robots FOLDER      # of one robot, as JSON: what the parts run
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json
import pickle
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from scripts.scale_parts.processes import run
from scripts.scale_parts.workers import experiment
from sysid import pipeline
from sysid.fleet.analysis import analysed
from sysid.fleet.members import Member, first, member

HOUR, RATE = 3600.0, 1000.0  # s; Hz


def measured(lengths: tuple[int, int] = (300_000, 900_000), robots: int = 1000) -> dict:
    """Of a robot with a log of each length; and of the comparison of so many robots."""
    found = []
    with tempfile.TemporaryDirectory() as place:
        for samples in lengths:
            folder = Path(place) / str(samples)
            folder.mkdir()
            experiment(folder, 1, samples)
            command = [sys.executable, "-m", "scripts.scale_parts.robots", str(folder)]
            spent = run(command)
            found.append(json.loads((folder / "found.json").read_text()) | {"bytes": spent[1]})
        kind, one = pickle.loads((folder / "robot.pickle").read_bytes())
    members = [_another(one, k) for k in range(robots)]
    begun = time.process_time()
    analysed(kind, members)
    compared = time.process_time() - begun
    (short, long), more = found, lengths[1] - lengths[0]
    each = (long["seconds"] - short["seconds"]) / more
    return {
        "samples": lengths, "megabytes": [1e-6 * one["bytes"] for one in found],
        "microseconds": 1e6 * each, "constant_seconds": short["seconds"] - lengths[0] * each,
        "shipped_kilobytes": [1e-3 * one["shipped"] for one in found], "robots": robots,
        "comparison_seconds": compared,
        "hours": robots * (HOUR * RATE * each + short["seconds"] - lengths[0] * each) / HOUR,
    }  # fmt: skip


def _another(one: Member, number: int) -> Member:
    """A robot whose logs would have said the same, but for their noise."""
    rng, out = np.random.default_rng(number), {}
    for part in ("train", "test"):
        own = getattr(one, part)
        spread = np.sqrt(np.nan_to_num(own.variance * own.widened))
        out[part] = replace(own, values=own.values + spread * rng.normal(size=len(spread)))
    return replace(one, name=f"r{number}", **out)


def told(entry: dict) -> str:
    """The figures in words."""
    memory, shipped = (
        " and ".join(f"{value:.0f}" for value in entry[name])
        for name in ("megabytes", "shipped_kilobytes")
    )
    return (
        f"a robot of a fleet with {entry['samples'][0]} and {entry['samples'][1]} samples of seven "
        f"joints: {entry['microseconds']:.1f} us of processor time a sample and "
        f"{entry['constant_seconds']:.1f} s beside; peak memory {memory} MB; {shipped} kB come "
        f"back. {entry['robots']} robots are compared in {entry['comparison_seconds']:.0f} s; with "
        f"an hour at 1 kHz each they take {entry['hours']:.0f} hours of one core"
    )


def main(folder: Path) -> None:
    """One robot of a fleet, fitted and reduced as a worker does."""
    spec = pipeline.load(folder)
    kind = first(spec)
    begun = time.process_time()
    found = member(spec, "r", kind)
    seconds = time.process_time() - begun
    (folder / "robot.pickle").write_bytes(pickle.dumps((kind, found)))
    said = {"seconds": seconds, "shipped": len(pickle.dumps(found))}
    (folder / "found.json").write_text(json.dumps(said))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
