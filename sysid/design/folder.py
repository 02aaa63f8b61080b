"""The files of a design: trajectory.csv, trajectory.yaml (a ROS JointTrajectory), design.json."""

from __future__ import annotations

import io
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..fit_document import number, versions
from ..whole_files import folder, write_atomically, write_json
from .result import Design

_POINTS = 20.0  # Hz of the ROS trajectory's points, between which a controller interpolates


def document(found: Design, run: str | Path = "") -> dict:
    """The document of `sysid design`."""
    return {
        "duration": found.family.duration,
        "criterion": {"log_det": found.log_det, "random_best": number(found.random_best)},
        "margins": found.margins,
        "expected_std": found.deviations,
        "separates": [asdict(pair) for pair in found.pairs],
        "coefficients": {
            "rounds": found.family.rounds,
            "harmonics": found.family.harmonics,
            "duration": found.family.time,
            "joints": dict(zip(found.joints, found.coefficients.tolist())),
        },
        "maneuvers": [
            {
                "kind": own.kind,
                "start": own.start,
                "duration": own.duration,
                "joints": dict(zip(found.joints, found.amounts[:, k].tolist())),
            }
            for k, own in enumerate(found.family.maneuvers)
        ],
        "notices": list(found.said),
        "versions": versions(),
        "run": str(run),
    }


def write(found: Design, out: str | Path) -> dict:
    """Write a design's folder; returns the document of design.json. Raises SysidError."""
    path = folder(out)
    told = document(found, path)
    for name, text in (("trajectory.csv", _csv(found)), ("trajectory.yaml", _ros(found))):
        write_atomically(path / name, lambda p, text=text: p.write_text(text, encoding="utf-8"))
    write_json(path / "design.json", told)
    return told


def _csv(found: Design) -> str:
    names = ["t", *(f"{kind}_{j}" for kind in ("q", "qd", "qdd") for j in found.joints)]
    stream = io.StringIO()
    table = np.column_stack([found.t, found.q, found.qd, found.qdd])
    np.savetxt(stream, table, fmt="%.12g", delimiter=",", header=",".join(names), comments="")
    return stream.getvalue()


def _ros(found: Design) -> str:
    """The YAML of a JointTrajectory, written as it is: a YAML library takes seconds for long motions."""
    every = max(1, int(round((found.t[1] - found.t[0]) ** -1 / _POINTS)))
    rows = np.unique(np.append(np.arange(0, len(found.t), every), len(found.t) - 1))
    lines = [f"joint_names: {json.dumps(list(found.joints), ensure_ascii=False)}", "points:"]
    for k in rows:
        second, nanosecond = divmod(int(round(1e9 * found.t[k])), 1_000_000_000)
        lines += [
            f"- positions: {_numbers(found.q[k])}",
            f"  velocities: {_numbers(found.qd[k])}",
            f"  accelerations: {_numbers(found.qdd[k])}",
            f"  time_from_start: {{sec: {second}, nanosec: {nanosecond}}}",
        ]
    return "\n".join(lines) + "\n"


def _numbers(values: np.ndarray) -> str:
    """A list of numbers (n,) that YAML 1.1, which ROS reads, takes for numbers, too: a point before an
    exponent."""
    told = (repr(value) for value in values.tolist())
    return f"[{', '.join(n if '.' in n else n.replace('e', '.0e') for n in told)}]"
