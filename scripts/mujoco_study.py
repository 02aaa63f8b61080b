"""Is what another simulator hides named? Arms in MuJoCo, with MuJoCo's own friction, springs, soft and loose gears.

    python scripts/mujoco_study.py --number 40 --seed 1 --jobs 2 --out runs/mujoco
    python scripts/mujoco_study.py --manner labs --number 40 --seed 1 --jobs 2
    python scripts/mujoco_study.py --seed 1 --out runs/mujoco --table      # of what is done, and nothing more

Nothing of `sysid simulate` is in these logs. An arm of two, three or five joints, whose bodies are a fifth and a centimetre off
its URDF, follows sums of sines under computed torque and a stiff controller; logs of 20 s at 500 Hz begin in the middle of the
motion. Joints have damping, dry friction and armature; one of the first four has an effect that the experiment's model lacks, or
none has. Angles are read by 18 bits, torque with noise of a hundredth of its RMS.

With --manner labs every arm has its own: sines or moves with stops between them, 100 to 1000 Hz, a third with jitter, 14 to 20
bits, noise of 0.5 to 3 %, and by thirds coarse torque, spikes and three knocks in a log. With --manner slow every joint makes one
slow sine, as a first log often has it.

`named`: the effect heads a claim of its joint; `in the set`: it is among what the log cannot tell from a head; `not there`:
claims of which neither holds. An effect is visible where the held-out RMS of its joint falls by a tenth with it in the model.

Resumes: finished cases stand in a journal in --out, named after the seed and the state of the package's source.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])


def main(arguments: list[str] | None = None) -> None:
    """Run the study, print its table."""
    from scripts.journaled import results
    from scripts.mujoco_parts.plant import MANNERS
    from scripts.mujoco_parts.trial import case, table, trial
    from sysid import fit_document

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=40)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/mujoco"))
    parser.add_argument("--manner", choices=tuple(MANNERS), default="clean", help="how arms move and are logged")
    parser.add_argument("--table", action="store_true", help="of what is done, and nothing more")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    settings = {"seed": options.seed, "source": fit_document.program()[:8]}
    path = options.out / f"{options.manner}_{options.seed}_{settings['source']}.jsonl"
    tasks = [(str(n), (case(options.seed, n, options.manner),)) for n in range(options.number)]
    how = {"jobs": options.jobs, "more": not options.table}
    done = results(path, settings, tasks, trial, **how)
    print("\n".join(table(done)))


if __name__ == "__main__":
    main()
