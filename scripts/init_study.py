"""`sysid init` and `sysid fit` alone, on simulated robots whose logs are written as labs write
them.

    python scripts/init_study.py [--robots ur5,panda] [--duration 8]

Each robot of example-robot-data is simulated once (`sysid simulate`), and its logs are written in
six styles: as they are; numbered columns in degrees and ms with speeds and commands beside them;
one recording with ns since 1970; joints by name in another order; motor currents with drawn
factors; degrees that no name tells. Prints, for each, the joints that are identified, the guesses
of units, and the held-out relative error of the fit beside that of the experiment that the
simulation wrote.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import polars as pl

ROBOTS = {
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "panda": "panda_description/urdf/panda.urdf",
    "so101": "so_arm_description/urdf/so101.urdf",
    "z1": "z1_description/urdf/z1.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "talos arm": "talos_data/robots/talos_left_arm.urdf",
    "kinova": "kinova_description/robots/kinova.urdf",
}
START = 1_700_000_000_000_000_000  # ns


def styles(
    log: pl.DataFrame, slides: set[str], rng: np.random.Generator
) -> dict[str, pl.DataFrame]:
    """{style: the log in it}; a factor of currents is drawn for each joint."""
    joints = [name.removeprefix("q_") for name in log.columns if name.startswith("q_")]
    t = log["t"].to_numpy()
    q, tau = ({j: log[f"{kind}_{j}"].to_numpy() for j in joints} for kind in ("q", "tau"))
    deg = {j: q[j] if j in slides else np.degrees(q[j]) for j in joints}
    numbered = list(enumerate(joints))
    factors, order = rng.uniform(2.0, 12.0, len(joints)), rng.permutation(len(joints))
    return {
        "as simulated": log,
        "numbers, deg, ms": pl.DataFrame(
            {"Time (ms)": 1e3 * t + 5.0}
            | {f"q{k + 1}": deg[j] for k, j in numbered}
            | {f"dq{k + 1}": np.gradient(deg[j], t) for k, j in numbered}
            | {f"tau{k + 1}": tau[j] for k, j in numbered}
            | {f"tau_des{k + 1}": 0.0 * t for k, _ in numbered}
        ),
        "one file, ns": pl.DataFrame(
            {"stamp": START + np.round(1e9 * t).astype(np.int64)}
            | {f"position_{k}": q[j] for k, j in numbered}
            | {f"effort_{k}": tau[j] for k, j in numbered}
        ),
        "names, other order": pl.DataFrame(
            {"time": t}
            | {f"{joints[k]}.torque": tau[joints[k]] for k in order}
            | {f"{joints[k]}.pos": q[joints[k]] for k in order[::-1]}
            | {f"{joints[k]}.goal_pos": q[joints[k]] + 1.0 for k in order}
        ),
        "currents": pl.DataFrame(
            {"t": t}
            | {f"actual_q_{k}": q[j] for k, j in numbered}
            | {f"target_q_{k}": q[j] for k, j in numbered}
            | {f"actual_current_{k}": tau[j] / factors[k] for k, j in numbered}
        ),
        "deg, untold": pl.DataFrame(
            {"t": t} | {f"q_{j}": deg[j] for j in joints} | {f"tau_{j}": tau[j] for j in joints}
        ),
    }


def sysid(*words) -> dict | str:
    """The document of a command, or the line in which it ended."""
    done = subprocess.run(
        [sys.executable, "-m", "sysid", *map(str, words), "--json"], capture_output=True, text=True
    )
    return json.loads(done.stdout) if done.stdout else done.stderr.strip()


def error(folder: Path, out: Path) -> str:
    """The held-out relative error of a fit."""
    found = sysid("fit", folder, "--out", out)
    return (
        found if isinstance(found, str) else f"{100 * found['relative_error']['test']['*']:.2f} %"
    )


def study(name: str, duration: float, work: Path) -> None:
    """All styles of one robot."""
    given, sim = work / f"{name}.yaml", work / f"{name} sim"
    given.write_text(f'robot: {{urdf: "example-robot-data://{ROBOTS[name]}"}}\n')
    said = sysid("simulate", given, "--out", sim, "--duration", duration, "--rate", 250)
    if isinstance(said, str):
        print(f"{name}: {said}")
        return
    print(f"{name}: as its own experiment {error(sim, work / 'run')}")
    urdf = (sim / "robot.urdf").read_text()
    logs = {part: pl.read_csv(sim / f"{part}.csv") for part in ("train", "test")}
    slides = {
        j.split('"')[1]
        for j in urdf.split("<joint name=")[1:]
        if 'type="prismatic"' in j.split(">")[0]
    }
    made = {part: styles(log, slides, np.random.default_rng(0)) for part, log in logs.items()}
    for style in made["train"]:
        folder = work / f"{name} {style}"
        folder.mkdir()
        parts = ("train",) if style == "one file, ns" else ("train", "test")
        for part in parts:
            made[part][style].write_csv(folder / f"{part}.csv")
        found = sysid(
            "init",
            sim / "robot.urdf",
            *(folder / f"{part}.csv" for part in parts),
            "--out",
            folder / "mine",
        )
        if isinstance(found, str):
            print(f"  {style:20} {found}")
            continue
        said = {guess["key"]: guess["value"] for guess in found["guesses"]}
        units = " ".join(
            str(said.get(f"data.units.{key}", "-")) for key in ("time", "position", "torque")
        )
        held = ", ".join(said.get("robot.lock", {})) or "none"
        left, look = error(folder / "mine", work / "run"), f"{len(found['look'])} to look at"
        print(
            f"  {style:20} {len(said['robot.joints'])} joints, locked {held}; {units}; {left}; {look}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", default=",".join(ROBOTS))
    parser.add_argument("--duration", type=float, default=8.0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        for name in given.robots.split(","):
            study(name, given.duration, Path(work))


if __name__ == "__main__":
    main()
