"""Peak memory of the commands on two logs of a seven-joint arm, a short and a long one."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from scripts.scale_parts.processes import run
from scripts.scale_parts.workers import experiment

COMMANDS = ("fit", "compare", "diagnose", "check")


def measured(lengths: tuple[int, int], commands: tuple[str, ...] = COMMANDS) -> dict:
    """Of each command, peak memory [MB] and processor time [s] on a log of each length."""
    found: dict[str, list[dict]] = {word: [] for word in commands}
    with tempfile.TemporaryDirectory() as place:
        for samples in lengths:
            folder = Path(place) / str(samples)
            folder.mkdir()
            path = experiment(folder, 1, samples)
            less = folder / "less.yaml"
            less.write_text(path.read_text().replace("[viscous, coulomb]", "[viscous]"))
            for word in commands:
                given = [str(path), *([str(less)] if word == "compare" else [])]
                how = ["--quiet", "--out", str(folder / "run")]
                spent = run([sys.executable, "-m", "sysid", word, *given, *how])
                found[word].append({"megabytes": 1e-6 * spent[1], "seconds": spent[2]})
    return {"samples": lengths, "commands": found}


def told(entry: dict) -> str:
    """The figures in words."""
    short, long = entry["samples"]
    return "\n".join(
        f"sysid {word}: peak memory {one['megabytes']:.0f} MB on {short} samples of seven joints, "
        f"{two['megabytes']:.0f} MB on {long} ({two['megabytes'] / one['megabytes']:.2f} times); "
        f"processor time {one['seconds']:.0f} and {two['seconds']:.0f} s"
        for word, (one, two) in entry["commands"].items()
    )
