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
        the same experiment, in turns. At most 10 is the aim.
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
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CONFIG = ROOT / "configs" / "cheetah3.yaml"
LOG = ROOT / "data" / "cheetah3" / "train.parquet"
TIMES = 50
PARTS = ["time", "memory", "long", "workers", "robots", "peaks", "diagnose", "torque", "cpu", "solve"]
PANDA = "example-robot-data://panda_description/urdf/panda.urdf"

FLOOR = '''
import sys
import numpy as np
import pinocchio as pin
import scipy.signal

def read(path):
    import polars
    table = polars.read_parquet(path)
    columns = lambda kind: np.column_stack([table[f"{kind}_{j}"].to_numpy() for j in ("abad", "hip", "knee")])
    return columns("q"), columns("tau")

ratio = 10.604
model = pin.buildModelFromUrdf(sys.argv[1])
poses = {"abad": (0, pin.SE3(np.eye(3), np.array([0, -0.128, 0])), np.array([1.0, 0, 0])),
         "hip": (1, pin.SE3(pin.utils.rotate("z", np.pi), np.array([0, 0.045, 0])), np.array([0, 1.0, 0])),
         "knee": (2, pin.SE3.Identity(), np.array([0, 1.0, 0]))}
for name, (carrier, pose, axis) in poses.items():
    joint = model.addJoint(carrier, pin.JointModelRevoluteUnaligned(axis), pose, name + "_rotor")
    model.appendBodyToJoint(joint, pin.Inertia.FromBox(0.5, 0.09, 0.09, 0.09), pin.SE3.Identity())
drive = np.vstack([np.eye(3), ratio * np.eye(3)])
q, tau = read(sys.argv[2])
q, qd, qdd = (scipy.signal.savgol_filter(q, 101, 4, deriv=d, delta=1e-3, axis=0) @ drive.T for d in range(3))
data = model.createData()
rows = np.zeros((len(q), 3, 67))
for k in range(len(q)):
    rows[k, :, :60] = drive.T @ pin.computeJointTorqueRegressor(model, data, q[k], qd[k], qdd[k])
for j in range(3):
    rows[:, j, 60 + j], rows[:, j, 63 + j] = qd[:, j], np.sign(qd[:, j])
rows[:, :, 66] = tau
print(np.linalg.qr(rows.reshape(-1, 67), mode="r").shape)
'''

LOOP = '''
import os, sys, time
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as sysid: threads cost more than they give
import numpy as np
import pinocchio as pin
import polars
import scipy.signal

joints = [f"panda_joint{k}" for k in range(1, 8)]
full = pin.buildModelFromUrdf(sys.argv[1])
others = [k for k in range(1, full.njoints) if full.names[k] not in joints]
model = pin.buildReducedModel(full, others, pin.neutral(full))
table = polars.read_parquet(sys.argv[2])
columns = lambda kind: np.column_stack([table[f"{kind}_{j}"].to_numpy() for j in joints])
q, tau = columns("q"), columns("tau")
del table
q, qd, qdd = (scipy.signal.savgol_filter(q, 101, 4, deriv=d, delta=1e-3, axis=0) for d in range(3))
data, calls, triangle = model.createData(), 0.0, np.zeros((0, 85))
for start in range(0, len(q), 4096):
    part = range(start, min(start + 4096, len(q)))
    rows = np.zeros((len(part), 7, 85))
    begun = time.process_time()
    for n, k in enumerate(part):
        rows[n, :, :70] = pin.computeJointTorqueRegressor(model, data, q[k], qd[k], qdd[k])
    calls += time.process_time() - begun
    for j in range(7):
        rows[:, j, 70 + j], rows[:, j, 77 + j], rows[:, j, 84] = qd[part, j], np.sign(qd[part, j]), tau[part, j]
    triangle = np.linalg.qr(np.concatenate([triangle, rows.reshape(-1, 85)]), mode="r")
sys.stderr.write(str(calls))
'''


def main() -> None:
    """Run the benchmarks and print them; with --json as one document."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=7, help="runs of each process; the median counts")
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--samples", type=int, default=2_800_000, help="of the longer log of `long` and `peaks`")
    parser.add_argument("--files", type=int, default=20, help="of `workers`")
    parser.add_argument("--each", type=int, default=500_000, help="samples of each file of `workers`")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    sys.path.insert(0, str(ROOT))
    found = {}
    wanted = [options.only] if options.only else PARTS
    if "time" in wanted:
        found["fit_over_floor"] = fit_over_floor(options.repeats)
    if "memory" in wanted:
        found["memory"] = memory()
    if "long" in wanted:
        found["long"] = long(options.samples)
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
        found["diagnose_over_fit"] = diagnose_over_fit(min(options.repeats, 3))
    if "torque" in wanted:
        found["torque"] = torque(options.repeats)
    if "cpu" in wanted:
        found["cpu"] = cpu(options.repeats)
    if "solve" in wanted:
        found["solve"] = solve(options.repeats)
    if options.json:
        print(json.dumps(found))
        return
    if "fit_over_floor" in found:
        entry = found["fit_over_floor"]
        print(f"sysid fit {entry['fit_seconds']:.2f} s / floor {entry['floor_seconds']:.2f} s = {entry['ratio']:.2f} (medians of {options.repeats})")
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
        print(f"sysid diagnose {entry['diagnose_seconds']:.1f} s / sysid fit {entry['fit_seconds']:.2f} s = {entry['ratio']:.1f} (medians of {entry['runs']})")
    if "torque" in found:
        entry = found["torque"]
        print(
            f"torque {entry['microseconds']:.1f} us a call, bare pin.rnea {entry['rnea_microseconds']:.1f} us; "
            f"{entry['samples']} samples at once {entry['microseconds_a_sample']:.2f} us each (medians of {options.repeats})"
        )
    if "cpu" in found:
        entry = found["cpu"]
        print(f"processor time of sysid.fit in Python {entry['python_seconds']:.2f} s / of the command {entry['command_seconds']:.2f} s = {entry['ratio']:.2f}")
    if "solve" in found:
        entry = found["solve"]
        print(
            f"one solve {1e3 * entry['solve_seconds']:.1f} ms; 20 random starts take {entry['restarts_over_solve']:.0f} times as long, "
            f"cvxpy + clarabel {entry['cvxpy_over_solve']:.1f} times (clarabel alone {entry['clarabel_over_solve']:.1f} times), "
            f"objectives equal to {entry['objective_difference']:.0e}"
        )


def run(command: list[str], told: list[str] | None = None) -> tuple[float, int, float]:
    """Wall time [s], peak memory [bytes] and processor time [s] of a process; what it said on standard error is appended to `told`."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment())
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


def fit_over_floor(repeats: int) -> dict:
    """Medians of alternating runs, after one warm-up of each."""
    with tempfile.TemporaryDirectory() as out:
        fit = [sys.executable, "-m", "sysid", "fit", str(CONFIG), "--quiet", "--out", out]
        floor = [sys.executable, "-c", FLOOR, str(ROOT / "data" / "cheetah3" / "leg.urdf"), str(LOG)]
        times: dict[str, list[float]] = {"fit": [], "floor": []}
        for _ in range(repeats + 1):
            times["floor"].append(run(floor)[0])
            times["fit"].append(run(fit)[0])
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    return {"ratio": medians["fit"] / medians["floor"], "fit_seconds": medians["fit"], "floor_seconds": medians["floor"]}


def diagnose_over_fit(runs: int) -> dict:
    """Medians of alternating runs, after one warm-up of each."""
    with tempfile.TemporaryDirectory() as out:
        command = lambda word: [sys.executable, "-m", "sysid", word, str(CONFIG), "--quiet", "--out", out]  # noqa: E731
        times: dict[str, list[float]] = {"fit": [], "diagnose": []}
        for _ in range(runs + 1):
            for word, spent in times.items():
                spent.append(run(command(word))[0])
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    return {"ratio": medians["diagnose"] / medians["fit"], "diagnose_seconds": medians["diagnose"], "fit_seconds": medians["fit"], "runs": runs}


def torque(repeats: int) -> dict:
    """One sample a call, ours and Pinocchio's in turns, and a million samples at once; processor time, medians, after a warm-up."""
    sys.path.insert(0, str(ROOT))
    import numpy as np
    import pinocchio as pin

    from sysid import inverse_dynamics, listed_effects, robot
    from sysid.robot_spec import RobotSpec
    from sysid.specs import EffectSpec

    machine = robot.load(RobotSpec(urdf=PANDA, joints=[f"panda_joint{k}" for k in range(1, 8)]))
    structure = listed_effects.build(machine, [EffectSpec(name="viscous"), EffectSpec(name="coulomb")])
    ours = inverse_dynamics.inverse_dynamics(structure, np.concatenate([machine.prior.ravel(), np.ones(14)]))
    samples = np.random.default_rng(0).normal(size=(3, 1_000_000, machine.dof))
    one, data, calls = [np.array(x[0]) for x in samples], machine.model.createData(), 2000
    spent: dict[str, list[float]] = {"ours": [], "bare": [], "many": []}
    for _ in range(repeats + 1):
        start = time.process_time()
        for _ in range(calls):
            pin.rnea(machine.model, data, *one)
        middle = time.process_time()
        for _ in range(calls):
            ours(*one)
        end = time.process_time()
        ours(*samples)
        for name, seconds, count in (("bare", middle - start, calls), ("ours", end - middle, calls), ("many", time.process_time() - end, samples.shape[1])):
            spent[name].append(1e6 * seconds / count)
    bare, own, many = (statistics.median(spent[name][1:]) for name in ("bare", "ours", "many"))
    return {"microseconds": own, "rnea_microseconds": bare, "samples": samples.shape[1], "microseconds_a_sample": many}


def cpu(repeats: int) -> dict:
    """Medians of alternating runs, after one warm-up of each."""
    said = "import sys, sysid; sysid.write(sysid.fit(sysid.load(sys.argv[1])), sys.argv[2])"
    with tempfile.TemporaryDirectory() as out:
        commands = {
            "command": [sys.executable, "-m", "sysid", "fit", str(CONFIG), "--quiet", "--out", out],
            "python": [sys.executable, "-c", said, str(CONFIG), out],
        }  # fmt: skip
        times: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(repeats + 1):
            for name, command in commands.items():
                times[name].append(run(command)[2])
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    return {"ratio": medians["python"] / medians["command"], "python_seconds": medians["python"], "command_seconds": medians["command"]}


def memory() -> dict:
    """Peak memory of a fit on the log once and on its copies end to end, each run backwards after the other."""
    import polars as pl

    table = pl.read_parquet(LOG)
    peaks, samples = [], []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        text = CONFIG.read_text().replace("../data/cheetah3/", f"{ROOT}/data/cheetah3/")
        for times in (1, TIMES):
            # a mirrored copy joins on smoothly in position, so that the long log is one segment
            parts = [table if k % 2 == 0 else table.reverse() for k in range(times)]
            long = pl.concat(parts).with_columns(pl.int_range(pl.len()).mul(1e-3).alias("t"))
            long.write_parquet(path / "train.parquet")
            (path / "long.yaml").write_text(text.replace(f"{ROOT}/data/cheetah3/train.parquet", "train.parquet"))
            samples.append(long.height)
            peaks.append(run([sys.executable, "-m", "sysid", "fit", str(path / "long.yaml"), "--quiet", "--out", str(path / "run")])[1])
    growth = (peaks[1] - peaks[0]) / (3 * (samples[1] - samples[0]))
    return {"bytes_per_joint_sample": growth, "samples": samples, "megabytes": [peak / 1e6 for peak in peaks]}


def write_arm_log(path: Path, samples: int, seed: int) -> None:
    """A log of the seven-joint arm with viscous and Coulomb friction and noise, a row group every 100 000 samples; the motion of
    sines repeats in no time that a log lasts."""
    import numpy as np
    import polars as pl

    from sysid import regressor, robot
    from sysid.robot_spec import RobotSpec

    joints = [f"panda_joint{k}" for k in range(1, 8)]
    machine = robot.load(RobotSpec(urdf=PANDA, joints=joints))
    rng = np.random.default_rng(0)
    rate, size, phase = 2.0 * np.pi * rng.uniform(0.05, 1.0, (7, 6)), 0.3 * rng.normal(size=(7, 6)), rng.uniform(0.0, 2.0 * np.pi, (7, 6))
    viscous, coulomb = rng.uniform(0.5, 2.0, 7), rng.uniform(0.3, 1.5, 7)
    middle = np.array([0.0, -0.5, 0.0, -1.8, 0.0, 1.5, 0.7])
    parts, every = [], 100_000
    for start in range(0, samples, every):
        t = 1e-3 * np.arange(start, min(start + every, samples))
        turn = rate * (t[:, None, None] + 1e3 * seed) + phase
        q = middle + (size * np.sin(turn)).sum(-1)
        qd, qdd = (size * rate * np.cos(turn)).sum(-1), (-size * rate**2 * np.sin(turn)).sum(-1)
        noise = np.random.default_rng([seed, start])
        tau = regressor.torque(machine, machine.prior * 1.05, q, qd, qdd) + viscous * qd + coulomb * np.sign(qd) + 0.3 * noise.normal(size=q.shape)
        q = q + 1e-5 * noise.normal(size=q.shape)
        columns = {f"{kind}_{joint}": values[:, k] for kind, values in (("q", q), ("tau", tau)) for k, joint in enumerate(joints)}
        part = path.with_name(f"{path.stem}.{start}.part")
        pl.DataFrame({"t": t, **columns}).write_parquet(part)
        parts.append(part)
    pl.scan_parquet(parts).sink_parquet(path, row_group_size=every)
    for part in parts:
        part.unlink()


def long(samples: int) -> dict:
    """`sysid fit` and the plain loop on the longer log, once each, and `sysid fit` on 0.7 million samples."""
    sys.path.insert(0, str(ROOT))
    from sysid import urdf_files

    counts, joints = [700_000, samples], ", ".join(f"panda_joint{k}" for k in range(1, 8))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        write_arm_log(path / "test.parquet", 20_000, 1)
        runs = []
        for count in counts:
            write_arm_log(path / f"{count}.parquet", count, 0)
            (path / f"{count}.yaml").write_text(
                f"robot: {{urdf: '{PANDA}', joints: [{joints}]}}\n"
                f"data: {{train: [{count}.parquet], test: [test.parquet], columns: {{time: t, position: 'q_{{joint}}', torque: 'tau_{{joint}}'}}}}\n"
                "model: {effects: [viscous, coulomb]}\n"
            )
            runs.append(run([sys.executable, "-m", "sysid", "fit", str(path / f"{count}.yaml"), "--quiet", "--out", str(path / "run")]))
        said: list[str] = []
        loop = run([sys.executable, "-c", LOOP, str(urdf_files.locate(PANDA, path)), str(path / f"{samples}.parquet")], said)
    peaks = [1e-6 * run[1] for run in runs]
    return {
        "ratio": runs[1][2] / loop[2], "fit_microseconds": 1e6 * runs[1][2] / samples, "loop_microseconds": 1e6 * loop[2] / samples,
        "calls_microseconds": 1e6 * float(said[0]) / samples, "samples": counts, "megabytes": peaks, "growth": peaks[1] / peaks[0],
    }  # fmt: skip


def solve(repeats: int) -> dict:
    """Our solver, 20 starts of it, and a general convex solver, on one compressed problem in one process."""
    import warnings

    import numpy as np

    warnings.simplefilter("ignore")
    import cvxpy as cp

    sys.path.insert(0, str(ROOT))
    from sysid import config
    from sysid.inertia.pseudo import PSEUDO_BASIS, to_pseudo
    from sysid.studies import restarts

    shared = restarts.share(config.load(CONFIG))
    problem, experiment = shared.problem, shared.experiment

    starts = [restarts.random_start(len(problem.start), 0, k) for k in range(20)]
    objective, positive = problem.objective, problem.coordinates.positive
    prior, count = objective.divergence.prior, 10 * objective.bodies
    size = np.append(np.repeat(np.linalg.norm(prior, axis=1), 10), np.ones(len(positive)))

    def general():
        x = cp.Variable(len(size))
        physical = cp.multiply(size, x)
        terms = []
        for b in range(objective.bodies):
            own = to_pseudo(prior[b])
            scale = np.diag(1.0 / np.sqrt(np.diagonal(own)))
            pseudo = scale @ sum(physical[10 * b + k] * PSEUDO_BASIS[k] for k in range(10)) @ scale
            reference = scale @ own @ scale
            terms.append(-cp.log_det(pseudo) + np.linalg.slogdet(reference)[1] + cp.trace(np.linalg.inv(reference) @ pseudo) - 4)
        rows = objective.triangle[:-1]
        cost = cp.sum_squares(rows[:, :-1] @ physical - rows[:, -1]) + objective.weight * sum(terms)
        task = cp.Problem(cp.Minimize(cost), [physical[count + int(k)] >= 0 for k in np.flatnonzero(positive)])
        task.solve(solver=cp.CLARABEL)
        return float(task.value) + objective.triangle[-1, -1] ** 2, task.solver_stats.solve_time

    def timed(work):
        start = time.perf_counter()
        result = work()
        return time.perf_counter() - start, result

    # the three take turns, so that a busy machine is busy for all; each counts with its median, after a warm-up
    own, many, theirs, alone = [], [], [], []
    for _ in range(repeats + 1):
        seconds, solution = timed(lambda: problem.solve(experiment))
        own.append(seconds)
        seconds, ends = timed(lambda: [problem.solve(experiment, start=start) for start in starts])
        many.append(seconds)
        seconds, (value, clarabel) = timed(general)
        theirs.append(seconds)
        alone.append(clarabel)
    own, many, theirs, alone = (statistics.median(values[1:]) for values in (own, many, theirs, alone))
    return {
        "solve_seconds": own, "restarts_over_solve": many / own, "cvxpy_over_solve": theirs / own, "clarabel_over_solve": alone / own,
        "objective_difference": abs(value / solution.objective - 1), "restarts_spread": max(e.objective for e in ends) / min(e.objective for e in ends) - 1,
    }  # fmt: skip


if __name__ == "__main__":
    main()
