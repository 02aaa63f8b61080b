"""The same servo logs identified with mujoco.sysid (pip install 'mujoco[sysid]'), and both models let go in one simulator.

mujoco.sysid fits rollouts: every joint's kp, kd (with the friction that is one with it), armature, frictionloss and delay, and
of every link but the last, which is known, mass (its inertia in proportion) and centre of mass. Its settings here: its
own optimizer with x_scale='jac', the log's period as time step, `implicitfast`, friction as stiff as that step allows,
rollouts of two seconds from states of the smoothed log (one of the whole log is lost in the wrong valley from these
starts), the command interpolated `delay` earlier by a custom rollout. It starts where a user would: kp 30, kd 0.5,
armature 0.01, friction 0.05, 10 ms, the URDF's bodies.
"""

from __future__ import annotations

import contextlib
import io
import time
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from mujoco import sysid

from sysid.inertia.pseudo import to_central
from tests import servos

from .rollouts import delayed, full_inertia, parameters, spec_of, windows

SAME = 5e-5  # s: the steps in which both models are let go side by side


@dataclass(frozen=True)
class Found:
    """An arm as found, in MuJoCo's words: each (dof,); mass (dof,), com (dof, 3), inertia (dof, 6) about it, MuJoCo's order."""

    kp: np.ndarray
    kd: np.ndarray
    armature: np.ndarray
    friction: np.ndarray
    delay: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray


def identified(folder: Path, free: bool, max_iters: int = 100) -> tuple[Found, float]:
    """What mujoco.sysid finds of an arm, and the CPU seconds it took."""
    start = time.process_time()
    t, q, asked = _log(folder / "train.csv")
    spec = spec_of((folder / "known.urdf").read_text(), float(np.median(np.diff(t))))
    params = parameters(spec, free)
    residual = sysid.build_residual_fn(
        models_sequences=[windows(spec, t, asked, q)], custom_rollout=delayed, n_threads=1
    )
    with contextlib.redirect_stdout(io.StringIO()):  # it prints every iteration
        best, _ = sysid.optimize(
            params, residual, optimizer="mujoco", verbose=False, max_iters=max_iters, x_scale="jac"
        )
    model = sysid.apply_param_modifiers(best, spec)
    take = lambda kind: np.array([best[f"joint_{j + 1}.{kind}"].value[0] for j in range(model.nv)])  # noqa: E731
    links = slice(1, model.nbody)
    inertia = np.array(
        [full_inertia(model.body_iquat[b], model.body_inertia[b]) for b in range(1, model.nbody)]
    )
    found = Found(
        take("kp"),
        take("kd"),
        take("armature"),
        take("friction"),
        take("delay"),
        model.body_mass[links].copy(),
        model.body_ipos[links].copy(),
        inertia,
    )
    return found, time.process_time() - start


def ours(fit) -> Found:
    """A fit of ours in MuJoCo's words."""
    told = {(d.joint, d.name): d.value for d in fit.drives}
    joints, names = fit.model.robot.joints, fit.model.names
    linear = lambda word: np.array([fit.x[names.index(word.format(j))] for j in joints])  # noqa: E731
    drive = lambda name: np.array([told[j, name] for j in joints])  # noqa: E731
    mass, com, inertia = to_central(fit.pi)
    six = inertia[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return Found(
        drive("kp"),
        drive("kd + Fv"),
        linear("armature.{}.Ia"),
        linear("coulomb.{}.Fc"),
        drive("delay"),
        mass,
        com,
        six,
    )


def missed(found: Found, folder: Path, step: float) -> np.ndarray:
    """RMS (dof,) by which an arm as found, let go in MuJoCo in steps [s] under the test log's commands, misses its angles."""
    t, q, asked = _log(folder / "test.csv")
    spec = mujoco.MjSpec.from_string((folder / "known.urdf").read_text())
    for b, link in enumerate(body for body in spec.bodies if body.name.startswith("link_")):
        link.explicitinertial, link.mass, link.ipos = True, found.mass[b], found.com[b]
        link.fullinertia = found.inertia[b]
    spec.compiler.balanceinertia = True
    drives = servos.Servos(
        found.kp, found.kd, found.armature, np.zeros_like(found.kd), found.friction, 0
    )
    model = servos.compiled(spec, drives, step)
    fine = round((t[1] - t[0]) / step)
    steps = np.arange(len(t) * fine) * step
    acting = np.stack(
        [np.interp(steps - late, t, asked[:, j]) for j, late in enumerate(found.delay)], axis=1
    )
    return np.sqrt(np.mean((servos.let_go(model, found.kp, acting, fine) - q) ** 2, axis=0))


def _log(path: Path):
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    dof = (table.shape[1] - 1) // 2
    return table[:, 0], table[:, 1 : 1 + dof], table[:, 1 + dof :]


def beside(folder: Path, fit, seconds: float, options) -> dict:
    """Both on one arm: RMS [rad] of the held-out rollout, each in its own simulator and both in one, and CPU seconds."""
    theirs, took = identified(folder, options.bodies == "free")
    t, _, _ = _log(folder / "train.csv")
    own = missed(theirs, folder, float(np.median(np.diff(t))))
    mine = ours(fit)
    return {
        "seconds": {"ours": seconds, "mujoco": took},
        "own": {"ours": list(fit.rollout.values()) if fit.rollout else None, "mujoco": own.tolist()},
        "same": {"ours": missed(mine, folder, SAME).tolist(), "mujoco": missed(theirs, folder, SAME).tolist()},
        "found": {key: {k: np.asarray(v).tolist() for k, v in vars(value).items()} for key, value in (("ours", mine), ("mujoco", theirs))},
    }  # fmt: skip


def table(arms: list[dict]) -> str:
    """Both in words, over all arms."""
    lines = []
    for kind, word in (("own", "each let go in its own simulator"), ("same", "both in MuJoCo")):
        pairs = [
            (a, b)
            for arm in arms
            if arm[kind]["ours"] and arm[kind]["mujoco"]
            for a, b in zip(arm[kind]["ours"], arm[kind]["mujoco"])
        ]
        ours_, theirs = np.array(pairs).T
        lines.append(
            f"{word}: median {np.median(ours_):.2g} rad against {np.median(theirs):.2g}, "
            f"worst {ours_.max():.2g} against {theirs.max():.2g}; "
            f"no worse on {np.sum(ours_ <= theirs)} of {len(pairs)} joints"
        )
    took = np.array([[arm["seconds"]["ours"], arm["seconds"]["mujoco"]] for arm in arms])
    ratio = took[:, 1] / took[:, 0]
    lines.append(
        f"CPU seconds: {took[:, 0].sum():.1f} against {took[:, 1].sum():.1f}, "
        f"{took[:, 1].sum() / took[:, 0].sum():.0f} times; by arm {ratio.min():.0f} to {ratio.max():.0f}, median {np.median(ratio):.0f}"
    )
    return "\n".join(lines)
