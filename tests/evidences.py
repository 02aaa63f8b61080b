"""Groups of columns without a robot, for tests: a linear model with a prior, blocks of rows, and columns that could join it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from sysid.diagnose.projected import made
from sysid.projection import told
from sysid.view import Design, by_block, summed
from sysid.view.stationary import spectra


def posed(rng: np.random.Generator, *, n: int = 240, dof: int = 2, size: int = 5, blocks: int = 20, prior: float = 0.3):
    """A model's columns (dof, n, size), weights, prior |root (x - target)|^2 and torque (n, dof), all random."""
    a, weights = rng.normal(size=(dof, n, size)), rng.uniform(0.5, 2.0, dof)
    root, target = prior * rng.normal(size=(size, size)), rng.normal(size=size)
    tau = np.einsum("jnk,k->nj", a, rng.normal(size=size)) + rng.normal(size=(n, dof))
    return SimpleNamespace(a=a, weights=weights, root=root, target=target, tau=tau, number=np.arange(n) * blocks // n)


def viewed(p):
    """What evidence sees of it: a view whose motion is slower than a hertz, its noise of the angles none."""
    m, y = stacked(p, np.zeros((*p.a.shape[:2], 0)))
    x = np.linalg.lstsq(m, y, rcond=None)[0]
    residual = (p.tau - np.einsum("jnk,k->nj", p.a, x)) * p.weights
    columns = p.a * p.weights[:, None, None]
    turn = told(sum(a.T @ a for a in columns), m.T @ m)
    columns = columns @ turn
    design = Design(columns, residual, np.zeros(len(x)), turn, 0.0 * columns, 0.0 * residual)
    noise = spectra(residual, columns, np.ones(residual.shape, bool), 0.01, 0.01)
    rows, motion = SimpleNamespace(use=np.ones(residual.shape, bool), piece=np.zeros(len(residual))), SimpleNamespace(band=1.0)
    return SimpleNamespace(rows=rows, motion=motion, step=0.02, design=design, sums=summed(design, by_block(p.number)), blocks=p.number, weights=p.weights, x=x, spectra=noise)


def stacked(p, own, joints=(0, 1), keep=None):
    """Rows and right-hand side of the whole problem with columns `own` (joints, n, k) in it, the prior's rows last."""
    dof, n, size = p.a.shape
    keep = np.ones(n, bool) if keep is None else keep
    k, rows = own.shape[2], []
    for j in range(dof):
        more = own[joints.index(j)] if j in joints else np.zeros((n, k))
        rows.append(p.weights[j] * np.hstack([p.a[j], more])[keep])
    m = np.vstack([*rows, np.hstack([p.root, np.zeros((len(p.root), k))])])
    return m, np.concatenate([*(p.weights[j] * p.tau[keep, j] for j in range(dof)), p.root @ p.target])


def roughened(p, rng: np.random.Generator, noise: float):
    """The view of a problem whose columns and torque have noise of the angles, such a share of them, drawn once more."""
    view = viewed(p)
    drawn = lambda values: noise * np.std(values) * rng.normal(size=values.shape)  # noqa: E731
    design = replace(view.design, rough_columns=drawn(view.design.columns), rough_residual=drawn(view.design.residual))
    return SimpleNamespace(**{**vars(view), "design": design, "sums": summed(design, by_block(p.number))})


def grouped(view, sets, joints=(0, 1), blows=False, rough=None):
    """The groups of sets of columns (sets, joints, n, k); rough: the same with the angles' noise once more."""
    candidate = SimpleNamespace(name="made", effect=None, joint=-1 if len(joints) > 1 else joints[0], blows=blows, late=None)
    return made(view, [(candidate, {"at": float(s)}) for s in range(len(sets))], list(joints), sets, sets if rough is None else rough)
