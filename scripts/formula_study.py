"""Are formulas' inner values found? Formulas with drawn terms and drawn true values, against 200
random starts each.

    python scripts/formula_study.py --formulas 50 --seed 1 --starts 200 --out formula_study.json

Each formula is one term or two, on one joint of a planar arm that moves on a Fourier series; the
experiment gives neither `start` nor `within`. The fit's objective is held against the best of
random starts: values drawn evenly over the same ranges (half of them by ratios where a range leaves
zero out), each refined by SciPy's bounded least squares on the residual that the linear parameters
leave, and the best of these solved as a fit solves them.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts.formula_parts.terms import formula  # noqa: E402
from sysid import experiment_logs, pipeline, regressor, robot, robot_spec, rows  # noqa: E402
from sysid.compress import compress  # noqa: E402
from sysid.effect import NotFinite  # noqa: E402
from sysid.model import moving_coefficients  # noqa: E402
from sysid.posed_problem import pose  # noqa: E402
from sysid.threads import single_threaded  # noqa: E402

URDF = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="1.5"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.021" iyz="0" izz="0.003"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0 -0.15"/><mass value="0.8"/>
    <inertia ixx="0.007" ixy="0" ixz="0" iyy="0.0072" iyz="0" izz="0.001"/></inertial></link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-9" upper="9" effort="90" velocity="90"/></joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-9" upper="9" effort="90" velocity="90"/></joint>
</robot>
"""
JOINTS = ("shoulder", "elbow")
NOISE, RATE, SECONDS = 0.02, 200.0, 8.0
COLUMNS = {"time": "t", "velocity": "qd_{joint}", "acceleration": "qdd_{joint}"}


def moved(rng: np.random.Generator) -> tuple:
    """t (n,) and q, qd, qdd (n, 2) of a sum of four sines about a drawn angle."""
    t = np.arange(int(SECONDS * RATE)) / RATE
    w = 2 * np.pi * rng.uniform(0.1, 1.0, (4, 1, 2))
    a, p = rng.uniform(0.15, 0.6, (4, 1, 2)), rng.uniform(0, 2 * np.pi, (4, 1, 2))
    angle = w * t[None, :, None] + p
    q = rng.uniform(-0.5, 0.5, 2) + (a * np.sin(angle)).sum(0)
    return t, q, (a * w * np.cos(angle)).sum(0), -(a * w**2 * np.sin(angle)).sum(0)


def written(folder: Path, text: str, values: dict, motions: dict, rng, size: float) -> Path:
    """An experiment whose shoulder has a formula's torque."""
    from sysid.formula import Formula
    from sysid.motion import Piece

    (folder / "robot.urdf").write_text(URDF)
    machine = robot.load(robot_spec.RobotSpec(urdf=str(folder / "robot.urdf")))
    for name, (t, q, qd, qdd) in motions.items():
        tau = (
            regressor.torque(machine, 1.2 * machine.prior, q, qd, qdd)
            + 0.3 * qd
            + 0.2 * np.sign(qd)
        )
        zero = np.zeros(2)
        piece = Piece(
            0, 1 / RATE, t, q, qd, qdd, tau, tau, {}, None, None, slice(0, len(t)), zero, zero
        )
        columns = Formula(text).columns(piece, 0, **values)
        tau[:, 0] += sum(size * c / max(np.sqrt(np.mean(c**2)), 1e-9) for c in columns)
        tau += NOISE * rng.normal(size=tau.shape)
        named = {
            "t": t,
            **{
                f"{word}_{j}": x[:, k]
                for word, x in (("q", q), ("qd", qd), ("qdd", qdd), ("tau", tau))
                for k, j in enumerate(JOINTS)
            },
        }
        np.savetxt(
            folder / f"{name}.csv",
            np.column_stack(list(named.values())),
            delimiter=",",
            header=",".join(named),
            comments="",
            fmt="%.17g",
        )
    config = {
        "data": {"columns": COLUMNS},
        "preprocess": {"filter": "none", "events": "keep", "standstill": "keep"},
        "model": {"effects": ["viscous", "coulomb", {"formula": text, "joints": ["shoulder"]}]},
        "prior": {"weight": 1e-2},
    }  # fmt: skip
    with (folder / "config.yaml").open("w") as stream:
        YAML().dump(config, stream)
    return folder


def case(rng: np.random.Generator, folder: Path) -> tuple[Path, str, dict]:
    """A drawn experiment, its formula and the true values."""
    while True:
        motions = {name: moved(rng) for name in ("train", "test")}
        t, q, qd, _ = motions["train"]
        text, values = formula(rng, {"q": q[:, 0], "qd": qd[:, 0], "t": t})
        try:
            return (
                written(
                    folder,
                    text,
                    values,
                    motions,
                    rng,
                    float(np.exp(rng.uniform(np.log(0.1), np.log(2.0)))),
                ),
                text,
                values,
            )
        except NotFinite:
            continue


def random_starts(found, rng: np.random.Generator, starts: int) -> tuple[float, list[float]]:
    """The best objective of random starts, and its shape values."""
    experiment, motion, prior = found.experiment, found_motion(found), found.prior
    model = found.model
    values = [v for v in model.shape_values if not v.held]
    low, high = (np.array([getattr(v, end) for v in values]) for end in ("low", "high"))
    effect, joint = model.terms[values[0].term][0], values[0].joint
    stacked = rows.stack(model, motion, 1)
    own = [
        10 * model.bodies + k for k, c in enumerate(model.coefficients) if c.effect == effect.name
    ]
    rest = np.setdiff1d(np.arange(model.size), own)
    # the prior about the fit's bodies as rows of its own
    hessian = np.zeros((model.size, model.size))
    objective = pose(
        experiment, model, compress(model, motion), moving_coefficients(model, motion), prior
    ).objective
    for b, block in enumerate(objective.prior_hessian(found.x)):
        hessian[10 * b : 10 * b + 10, 10 * b : 10 * b + 10] = block
    sizes, axes = np.linalg.eigh(0.5 * hessian[np.ix_(rest, rest)])
    root = (axes * np.sqrt(np.clip(sizes, 0.0, None))).T
    matrix = np.concatenate([*(a[:, rest] for a in stacked.columns), root])
    target = np.concatenate([*stacked.tau.T, root @ found.x[rest]])
    scale = np.linalg.norm(matrix, axis=0)
    basis, sizes, _ = np.linalg.svd(matrix / np.where(scale > 0, scale, 1.0), full_matrices=False)
    basis = basis[:, sizes > 1e-12 * sizes[0]]
    left = target - basis @ (basis.T @ target)
    (piece,) = motion.pieces
    n = len(piece.t)
    where = slice(joint * n, (joint + 1) * n)

    def residual(at):
        try:
            made = effect.columns(
                piece, joint, **{v.shape.name: float(x) for v, x in zip(values, at)}
            ).T
        except NotFinite:
            return 1e3 * left
        norm = np.linalg.norm(made, axis=0)
        if not np.all(np.isfinite(norm)) or np.any(norm == 0.0):
            return left
        full = np.zeros((len(left), made.shape[1]))
        full[where] = made / norm
        full -= basis @ (basis.T @ full)
        c = np.linalg.lstsq(full, left, rcond=1e-10)[0]
        return left - full @ c

    ended = []
    for k in range(starts):
        u = rng.uniform(size=len(values))
        by_ratio = (low > 0) & (k % 2 == 1)
        at = np.where(
            by_ratio,
            np.exp(
                np.log(np.maximum(low, 1e-300)) * (1 - u) + np.log(np.maximum(high, 1e-300)) * u
            ),
            low + u * (high - low),
        )
        got = least_squares(
            residual,
            at,
            bounds=(low, high),
            x_scale=np.maximum(np.abs(at), 1e-3 * (high - low)),
            max_nfev=100,
        )
        ended.append((2.0 * got.cost, got.x))
    ended.sort(key=lambda pair: pair[0])
    best = (np.inf, [])
    for _, at in ended[:3]:
        own_values = iter(at)
        tried = model.with_shapes(
            [s if v.held else next(own_values) for v, s in zip(model.shape_values, model.shapes)]
        )
        problem = pose(
            experiment, tried, compress(tried, motion), moving_coefficients(tried, motion), prior
        )
        best = min(best, (problem.solve(experiment).objective, at.tolist()))
    return best


def found_motion(found):
    """The training motion of a fit, read again."""
    machine = found.model.robot
    return pipeline.prepare(
        experiment_logs.read(found.experiment, machine, found.experiment.data.train),
        found.experiment.preprocess,
        machine.joints,
    )


@single_threaded
def main() -> None:
    """Run the study and print a line a formula."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--formulas", type=int, default=50)
    parser.add_argument("--starts", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="the number of one formula")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    told = []
    for number in range(given.formulas) if given.only is None else [given.only]:
        rng = np.random.default_rng([given.seed, number])
        with tempfile.TemporaryDirectory() as folder:
            path, text, values = case(rng, Path(folder))
            start = time.perf_counter()
            found = pipeline.fit(pipeline.load(path))
            seconds = time.perf_counter() - start
            best, at = random_starts(found, rng, given.starts)
        names = [v.shape.name for v in found.model.shape_values]
        excess = found.objective / best - 1.0
        told.append({
            "formula": text, "truth": values, "found": dict(zip(names, found.model.shapes)),
            "random": dict(zip(names, at)), "objective": found.objective, "best_of_random": best,
            "excess": excess, "seconds": seconds, "proven": found.certificate.globally_optimal,
        })  # fmt: skip
        mark = "ok  " if excess < 1e-6 else "ABOVE"
        print(f"{number:3d} {mark} {excess:+.1e} {seconds:5.1f} s  {text}", flush=True)
    good = sum(one["excess"] < 1e-6 for one in told)
    print(f"{good} of {len(told)} within 1e-6 of the best of {given.starts} random starts")
    if given.out:
        given.out.write_text(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
