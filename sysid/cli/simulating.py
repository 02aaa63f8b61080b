"""Logs with known truth: simulate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from .command_line import ExperimentPath, Json, Quiet, app, progress_of


@app.command()
def simulate(
    experiment: ExperimentPath,
    out: Annotated[Path, typer.Option("--out", help="The folder to write: config.yaml, robot.urdf, train.csv, test.csv, truth.json.")],
    hide: Annotated[Optional[list[str]], typer.Option("--hide", metavar="EFFECT:JOINT[:name=value,...]", help="An effect that config.yaml does not list; may be given again. Values left out are drawn; size=2 doubles them. torque_saturation takes reports=command: the log holds what was asked for, the limit acts.")] = None,  # noqa: UP045
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")] = 0,
    duration: Annotated[float, typer.Option("--duration", help="Seconds of each log.")] = 20.0,
    rate: Annotated[float, typer.Option("--rate", help="Samples a second.")] = 1000.0,
    noise: Annotated[Optional[float], typer.Option("--noise", help="Standard deviation of the torque noise [N m] (default 1 to 2 % of each joint's torque).")] = None,  # noqa: UP045
    colour: Annotated[Optional[float], typer.Option("--colour", help="Time constant [s] of half of the noise's variance (default white).")] = None,  # noqa: UP045
    encoder: Annotated[Optional[int], typer.Option("--encoder", help="Bits a turn of the motor, of the joint where it has no rotor; 0: exact (default 14 on the motor).")] = None,  # noqa: UP045
    speed: Annotated[Optional[float], typer.Option("--speed", help="Top speed [rad/s] (default by the robot's size).")] = None,  # noqa: UP045
    motion: Annotated[str, typer.Option("--motion", help="exciting, moves (from point to point, with stops), or sines (one slow sine a joint).")] = "exciting",
    logs: Annotated[int, typer.Option("--logs", help="Training logs: train_1.csv, train_2.csv, ..., each of --duration.")] = 1,
    knocks: Annotated[int, typer.Option("--knocks", help="Knocks on the arm in each log.")] = 0,
    spikes: Annotated[float, typer.Option("--spikes", help="Wrong samples in the torque, a second and joint.")] = 0.0,
    brakes: Annotated[bool, typer.Option("--brakes", help="A joint that rests is braked: its torque reads 0, its angle is frozen (with --motion moves).")] = False,
    jitter: Annotated[float, typer.Option("--jitter", help="Milliseconds (standard deviation) that samples come early or late; a slow logger: --rate 100 --jitter 2.")] = 0.0,
    trajectory: Annotated[Optional[Path], typer.Option("--trajectory", help="A motion for the training log to play, trajectory.csv of `sysid design`; the same --seed, --duration, --motion, --logs, --rate and --speed make the same robot.")] = None,  # noqa: UP045
    current: Annotated[Optional[str], typer.Option("--current", metavar="STEP", help="Step of the logged torque [N m], or a share of each joint's peak, as in 2%.")] = None,  # noqa: UP045
    force: Annotated[bool, typer.Option("--force", help="Write over a simulation whose files were changed since.")] = False,
    as_json: Json = False, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Simulate an experiment's robot in closed loop, with hidden effects, and write logs to identify."""
    from .. import simulate as simulation

    hidden = [simulation.hidden(text) for text in hide or []]
    folder = simulation.prepare(out, force=force)
    spec, robot, notices = simulation.load(experiment)
    with progress_of(quiet or as_json, logs + 1) as progress:
        found = simulation.simulate(
            robot, hide=hidden, seed=seed, duration=duration, rate=rate, noise=noise, colour=colour, encoder=encoder, speed=speed, progress=progress,
            motion=motion, logs=logs, knocks=knocks, spikes=spikes, brakes=brakes, jitter=jitter, current=current,
            trajectory=None if trajectory is None else simulation.read_trajectory(trajectory, robot.joints),
        )  # fmt: skip
    truth = simulation.write(found, spec, folder, force=force)
    if as_json:
        print(json.dumps(truth, allow_nan=False))
    elif not quiet:
        for part, log in found.truth["logs"].items():
            print(f"{part}: {log['samples']} samples; noise " + ", ".join(f"{joint} {rms:.3g}" for joint, rms in log["noise_rms"].items()))
            kinds = [event["kind"] for event in log["events"]]
            if kinds:
                print("  " + ", ".join(f"{kinds.count(kind)} {kind}{'s' if kinds.count(kind) > 1 else ''}" for kind in dict.fromkeys(kinds)))
        for entry in found.truth["hidden"]:
            print(f"hidden: {entry['effect']} on {entry['joint']}, " + ", ".join(f"{n}={v:.4g}" if isinstance(v, float) else f"{n}={v}" for n, v in entry["values"].items()))
        for notice in notices:
            print(f"note {notice}")
        print(f"folder: {folder}")
        from ..terminal.next_steps import next_step

        next_step("diagnose", folder)
