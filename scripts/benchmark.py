"""How fast, against what nobody can avoid; and how memory grows with the log. Ratios of one run, on this machine.

    python scripts/benchmark.py            # everything, about two minutes
    python scripts/benchmark.py --repeats 9 --only time

solve needs cvxpy and clarabel: pip install -e '.[test]'.

time    The whole `sysid fit configs/cheetah3.yaml` process over a floor: a process that only imports pinocchio, numpy
        and scipy.signal, reads the training log, differentiates it, builds the regressors of links and rotors in a plain
        Pinocchio loop and takes one QR. The floor reads no test log and solves nothing. The two take turns, and each
        counts with its median.
memory  Peak memory of `sysid fit` on the leg's log and on one 50 times as long, per joint and sample that it grew by.
        The regressor kept whole would take 1440 bytes.
long    A seven-joint arm with friction at 1 kHz, 0.7 million samples and four times as many (--samples): processor time a
        sample of the whole `sysid fit` process, from the file to the run folder with its predictions, over that of a plain
        Python process which reads the log, differentiates it, calls pin.computeJointTorqueRegressor in a loop and takes a
        QR of every 4096 samples' rows; and peak memory of the longer log over that of the shorter. At most 1 and 1.1 are
        the aims. Beside it the time of the loop's calls alone.
workers  10 million samples of that arm in 20 files (--files, --each): wall time of `sysid fit` in one process over that of
        `sysid fit --workers 2`, in turns (3 times); and of one of which a worker is killed half-way. At least 1.7 is the aim, equal
        to 1e-10. Needs the extra dask and 2 GB of disk; it says the load that the machine had.
robots  A robot of a fleet with a long log of that arm, 0.3 and 0.9 million samples: processor time a sample, peak memory, what
        comes back of it; and the comparison of a thousand robots. What docs/scale.md counts a large fleet's cost by.
peaks   Peak memory of `fit`, `compare`, `diagnose` and `check` on 0.7 million samples of that arm and on --samples.
diagnose  The whole `sysid diagnose configs/cheetah3.yaml` process, the whole catalogue on every joint, over `sysid fit` on
        the same experiment, in turns. At most 3 is the aim.
torque  `torque(q, qd, qdd)` of a seven-joint arm with viscous and Coulomb friction beside a bare `pin.rnea` of its bodies, one
        sample a call, in turns; and a million samples at once, per sample. Processor time of one thread.
cpu     Processor time of `sysid.fit` and `sysid.write` in a Python process over that of the command `sysid fit`, with nothing
        said of threads in the environment. At most 1.2 is the aim.
solve   On the leg's compressed problem: 20 random starts over one fit's solve (compression not counted), and cvxpy +
        clarabel over one fit's solve, at equal objective. cvxpy's time is that of `Problem.solve`, which writes the
        problem down for clarabel and runs it; clarabel's own time alone is printed beside it.
"""

import argparse
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts.scale_parts import calls, commands, long_logs  # noqa: E402

PARTS = [
    "time",
    "memory",
    "long",
    "workers",
    "robots",
    "peaks",
    "diagnose",
    "torque",
    "cpu",
    "solve",
]


def main() -> None:
    """Run the benchmarks and print them; with --json as one document."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--repeats", type=int, default=7, help="runs of each process; the median counts"
    )
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument(
        "--samples", type=int, default=2_800_000, help="of the longer log of `long` and `peaks`"
    )
    parser.add_argument("--files", type=int, default=20, help="of `workers`")
    parser.add_argument(
        "--each", type=int, default=500_000, help="samples of each file of `workers`"
    )
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found = {}
    wanted = [options.only] if options.only else PARTS
    if "time" in wanted:
        found["fit_over_floor"] = commands.fit_over_floor(options.repeats)
    if "memory" in wanted:
        found["memory"] = long_logs.memory()
    if "long" in wanted:
        found["long"] = long_logs.long(options.samples)
    if "workers" in wanted:
        from scripts.scale_parts import workers

        found["workers"] = workers.measured(options.files, options.each, min(options.repeats, 3))
    if "robots" in wanted:
        from scripts.scale_parts import robots

        found["robots"] = robots.measured()
    if "peaks" in wanted:
        from scripts.scale_parts import memory as peaks

        found["peaks"] = peaks.measured((700_000, options.samples))
    if "diagnose" in wanted:
        found["diagnose_over_fit"] = commands.diagnose_over_fit(min(options.repeats, 3))
    if "torque" in wanted:
        found["torque"] = calls.torque(options.repeats)
    if "cpu" in wanted:
        found["cpu"] = commands.cpu(options.repeats)
    if "solve" in wanted:
        found["solve"] = calls.solve(options.repeats)
    if options.json:
        print(json.dumps(found))
        return
    if "fit_over_floor" in found:
        entry = found["fit_over_floor"]
        print(
            f"sysid fit {entry['fit_seconds']:.2f} s / floor {entry['floor_seconds']:.2f} s = {entry['ratio']:.2f} (medians of {options.repeats})"
        )
    if "memory" in found:
        entry = found["memory"]
        print(
            f"peak memory {entry['megabytes'][0]:.0f} MB on {entry['samples'][0]} samples, {entry['megabytes'][1]:.0f} MB on {entry['samples'][1]}: "
            f"{entry['bytes_per_joint_sample']:.0f} bytes per joint and sample"
        )
    if "long" in found:
        entry = found["long"]
        print(
            f"{entry['samples'][1]} samples of seven joints: sysid fit {entry['fit_microseconds']:.1f} us a sample / plain loop {entry['loop_microseconds']:.1f} us "
            f"(its calls alone {entry['calls_microseconds']:.1f} us) = {entry['ratio']:.2f}; peak memory {entry['megabytes'][1]:.0f} MB, "
            f"{entry['megabytes'][0]:.0f} MB on {entry['samples'][0]} samples: {entry['growth']:.2f} times"
        )
    if "workers" in found:
        print(workers.told(found["workers"]))
    if "robots" in found:
        print(robots.told(found["robots"]))
    if "peaks" in found:
        print(peaks.told(found["peaks"]))
    if "diagnose_over_fit" in found:
        entry = found["diagnose_over_fit"]
        print(
            f"sysid diagnose {entry['diagnose_seconds']:.1f} s / sysid fit {entry['fit_seconds']:.2f} s = {entry['ratio']:.1f} (medians of {entry['runs']})"
        )
    if "torque" in found:
        entry = found["torque"]
        print(
            f"torque {entry['microseconds']:.1f} us a call, bare pin.rnea {entry['rnea_microseconds']:.1f} us; "
            f"{entry['samples']} samples at once {entry['microseconds_a_sample']:.2f} us each (medians of {options.repeats})"
        )
    if "cpu" in found:
        entry = found["cpu"]
        print(
            f"processor time of sysid.fit in Python {entry['python_seconds']:.2f} s / of the command {entry['command_seconds']:.2f} s = {entry['ratio']:.2f}"
        )
    if "solve" in found:
        entry = found["solve"]
        print(
            f"one solve {1e3 * entry['solve_seconds']:.1f} ms; 20 random starts take {entry['restarts_over_solve']:.0f} times as long, "
            f"cvxpy + clarabel {entry['cvxpy_over_solve']:.1f} times (clarabel alone {entry['clarabel_over_solve']:.1f} times), "
            f"objectives equal to {entry['objective_difference']:.0e}"
        )


if __name__ == "__main__":
    main()
