"""Servos without torque: is what a fit says of them true, and what does the joint do when let go?

    python scripts/servo_study.py --arms 20 --seed 1                      # gains given; a link known; nothing known
    python scripts/servo_study.py --arms 20 --seed 1 --against mujoco     # beside mujoco.sysid (pip install 'mujoco[sysid]')
    python scripts/servo_study.py --rate 50 --period 0.02 --jerk 0.1 --bits 12    # a policy's commands, a slow coarse logger

Arms of 1 to 6 joints in MuJoCo. What is fitted starts from a URDF whose masses and centres of mass are off
(--urdf-error), but for the last link where that is known. Each arm is fitted

    given      kp, kd and delay given, the bodies free
    link       kp, kd and delay free, the last link known
    nothing    kp, kd and delay free, nothing known: masses, friction and gains have one common factor

`right` is the share of values within 5 % of the truth among those that the fit itself says to know better than that
(std below 5 % of the value), `covered` that of all values with the truth within two standard deviations. A command that
is held for a period acts half of that late: the true delay is that of the drive and half a sample of the log.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402

from scripts.servo_parts.arms import configured, drawn, truth  # noqa: E402
from sysid import pipeline  # noqa: E402
from tests import servos  # noqa: E402

CASES = ("given", "link", "nothing")
KINDS = ("kp", "kd + Fv", "armature", "Fc", "delay")
KNOWN = 0.05  # a value is told where its std is below this share of it, and right within as much


def fitted(folder: Path, case: str, true: servos.Servos, rate: float):
    """The fit of a case and the CPU seconds it took."""
    path = folder / f"{case}.yaml"
    path.write_text(configured(true, case, rate))
    start = time.process_time()
    found = pipeline.fit(pipeline.load(path))
    return found, time.process_time() - start


def values(found) -> dict:
    """{(kind, joint): (value, std)} of a fit; std NaN where it says that the log does not tell it."""
    out, joints = {}, list(found.model.robot.joints)
    for told in found.drives:
        out[told.name, joints.index(told.joint)] = told.value, told.std
    words = {"armature": "armature.{}.Ia", "Fc": "coulomb.{}.Fc", "kd + Fv": "viscous.{}.Fv"}
    names, std = found.model.names, found.uncertainty.std
    for kind, word in words.items():
        for j, joint in enumerate(joints):
            k = names.index(word.format(joint))
            out.setdefault((kind, j), (float(found.x[k]), float(std[k])))
    return out


def scored(found, true: servos.Servos, case: str, rate: float) -> list[dict]:
    """One row a value: what it is, what was found, and whether it was said to be known."""
    rows, right = [], truth(true, rate, case)
    for (kind, j), (value, std) in sorted(values(found).items()):
        actual = right[kind, j]
        told = bool(np.isfinite(std) and std < KNOWN * abs(value))
        rows.append({
            "kind": kind, "joint": j + 1, "true": actual, "value": value, "std": std if np.isfinite(std) else None,
            "told": told, "right": abs(value - actual) < KNOWN * actual,
            "covered": bool(abs(value - actual) < 2.0 * std) if np.isfinite(std) else None,
        })  # fmt: skip
    return rows


def ratios(rows: list[dict]) -> float:
    """Share of kp within 5 % of the truth once the one common factor is taken out (geometric mean)."""
    kp = np.array([(row["value"], row["true"]) for row in rows if row["kind"] == "kp"]).reshape(
        -1, 2
    )
    off = np.log(kp[:, 0] / kp[:, 1])
    return float(np.mean(np.abs(off - off.mean()) < KNOWN)) if len(kp) else 1.0


def studied(number: int, options) -> dict:
    """Everything of one arm."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        true = drawn(folder, options.seed, number, options)
        out = {"arm": number, "joints": len(true.kp), "cases": {}}
        for case in options.cases:
            found, seconds = fitted(folder, case, true, options.rate)
            rows = scored(found, true, case, options.rate)
            out["cases"][case] = {
                "values": rows, "seconds": seconds, "rollout": None if found.rollout is None else list(found.rollout.values()),
                "common_factor_said": any("one common factor" in text for text in found.notices),
                "undetermined": [text for text in found.notices if "cannot tell" in text],
                "kp_ratios": ratios(rows), "converged": found.solution.converged, "proven": found.certificate.globally_optimal,
            }  # fmt: skip
            if case == "link" and options.against:
                from scripts.servo_parts.beside import beside

                out["mujoco"] = beside(folder, found, seconds, options)
    return out


def percent(flags) -> str:
    """The share of flags that are set."""
    return f"{100 * np.mean(flags):.0f}%" if len(flags) else "-"


def table(arms: list[dict], cases) -> str:
    """The study in words."""
    heads = ("case", "value", "all", "told", "right", "covered", "right of all")
    lines = ["{:8s} {:9s} {:>4s} {:>5s} {:>6s} {:>8s} {:>13s}".format(*heads)]
    for case in cases:
        rows = [row for arm in arms for row in arm["cases"][case]["values"]]
        for kind in (*KINDS, "all"):
            own = [row for row in rows if kind in (row["kind"], "all")]
            if not own:
                continue
            told = [row["right"] for row in own if row["told"]]
            covered = [row["covered"] for row in own if row["covered"] is not None]
            shares = percent(told), percent(covered), percent([row["right"] for row in own])
            counts = f"{len(own):4d} {len(told):5d}"
            lines.append("{:8s} {:9s} {} {:>6s} {:>8s} {:>13s}".format(case, kind, counts, *shares))
        each = [arm["cases"][case] for arm in arms]
        rolled = [rms for own in each for rms in own["rollout"] or ()]
        if rolled:
            lines.append(
                f"{case:8s} rollout of {len(rolled)} joints: median {np.median(rolled):.2g} rad, "
                f"worst {np.max(rolled):.2g}"
            )
        lines.append(
            f"{case:8s} {np.mean([own['seconds'] for own in each]):.2f} s of CPU a fit; of {len(each)} "
            f"common factor said by {sum(own['common_factor_said'] for own in each)}, "
            f"proven {sum(own['proven'] for own in each)}, "
            f"without rollout {sum(own['rollout'] is None for own in each)}; "
            f"kp to one factor right {percent([own['kp_ratios'] for own in each])}"
        )
    return "\n".join(lines)


def parsed(argv=None):
    """What was asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--arms", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=12.0, help="of each log")
    parser.add_argument("--rate", type=float, default=500.0, help="of the log [Hz]")
    parser.add_argument(
        "--period", type=float, help="for which a command is held [s]; by default a sample"
    )
    parser.add_argument(
        "--jerk", type=float, default=0.0, help="random steps on every command, deviation [rad]"
    )
    parser.add_argument("--noise", type=float, default=1e-4, help="of the angles [rad]")
    parser.add_argument("--bits", type=int, help="of the encoders")
    parser.add_argument("--limit", type=float, default=np.inf, help="most that a servo gives [N m]")
    parser.add_argument(
        "--urdf-error", type=float, default=0.15, help="of the URDF's masses and centres of mass"
    )
    parser.add_argument("--cases", default=",".join(CASES))
    parser.add_argument("--against", choices=["mujoco"])
    parser.add_argument(
        "--bodies", choices=["free", "urdf"], default="free", help="of mujoco.sysid"
    )
    parser.add_argument("--json", action="store_true", help="one JSON document")
    options = parser.parse_args(argv)
    options.cases = tuple(options.cases.split(","))
    if wrong := sorted(set(options.cases) - set(CASES)):
        parser.error(f"there is no case {wrong[0]}; allowed: {', '.join(CASES)}")
    if options.against and "link" not in options.cases:
        parser.error("--against is beside the case link")
    return options


def main(argv=None) -> int:
    """The command."""
    options = parsed(argv)
    arms = []
    for number in range(options.arms):
        arms.append(studied(number, options))
        print(f"arm {number + 1} of {options.arms}", file=sys.stderr, flush=True)
    if options.json:
        print(json.dumps({"seed": options.seed, "arms": arms}))
        return 0
    print(table(arms, options.cases))
    if options.against:
        from scripts.servo_parts.beside import table as against

        print(against([arm["mujoco"] for arm in arms]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
