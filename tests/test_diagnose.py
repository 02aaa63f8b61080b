"""The diagnosis: its low-pass, its least squares, its evidence against chance, and what it says of robots with something hidden.

The robots are simulated: a planar arm of two joints, logs of 12 to 20 s, sizes and seeds fixed. What is hidden is compared
with the simulator's truth.json, which the diagnosis does not read.
"""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from ruamel.yaml import YAML
from scipy.optimize import lsq_linear
from scipy.signal import lfilter

from scripts.blind_benchmark import PLANAR
from sysid import config, loop, pipeline, regressor, results, robot, simulate
from sysid.diagnose import changed, search
from sysid.diagnose.changed import document as changes_document
from sysid.diagnose.diagnosis import _around_standstill, _verdict, diagnose
from sysid.diagnose.document import document
from sysid.diagnose.domain import CUTOFFS, Gaussian, questioned, stride_of
from sysid.diagnose.ground import Ground, standard, summed
from sysid.diagnose.noise import NoiseFloor
from sysid.diagnose.structure import TONE, Structure, structures
from sysid.errors import ConfigError, LogError, SysidError
from sysid.log import Log, Segment
from sysid.preprocess import prepare, standstill_speed
from sysid.shape import Projection
from tests.conftest import csv

# ---- the low-pass


STEP = 1e-3


@pytest.mark.parametrize("cutoff", CUTOFFS)
def test_gaussian_is_one_at_rest_and_half_the_power_at_its_cutoff(cutoff):
    low_pass = Gaussian(cutoff, STEP)
    assert low_pass.weights.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(low_pass.weights, low_pass.weights[::-1], rtol=0, atol=1e-17)  # zero phase
    shifts = np.arange(-low_pass.reach, low_pass.reach + 1)
    for f in (0.3, 1.0, 1.5):  # of the cutoff; a Gaussian's spectrum is a Gaussian
        gain = np.sum(low_pass.weights * np.cos(2.0 * np.pi * f * cutoff * STEP * shifts))
        assert gain == pytest.approx(2.0 ** (-0.5 * f**2), abs=2e-4)
    # a sine keeps its phase
    t = np.arange(3000) * STEP
    wave = np.sin(2.0 * np.pi * cutoff * t)
    inside = slice(low_pass.reach, -low_pass.reach)
    np.testing.assert_allclose(low_pass(wave)[inside], wave[inside] / np.sqrt(2.0), atol=2e-4)


def test_gaussian_s_memory_is_its_reach():
    low_pass = Gaussian(15.0, STEP)
    impulse = np.zeros(4 * low_pass.reach + 1)
    middle = 2 * low_pass.reach
    impulse[middle] = 1.0
    seen = np.flatnonzero(low_pass(impulse))
    assert (seen[0], seen[-1]) == (middle - low_pass.reach, middle + low_pass.reach)
    assert low_pass.reach * STEP < 0.6 / 15.0  # s: a fraction of a cycle of the cutoff


@pytest.mark.parametrize("rows", [slice(0, 500, 1), slice(0, 500, 7), slice(60, 440, 7), slice(61, 439, 3), slice(100, 101, 5), slice(499, 500, 1), slice(30, 30, 2)])
def test_at_some_rows_is_the_filter_at_those_rows(rows):
    values = np.random.default_rng(0).normal(size=(2, 3, 500))
    low_pass = Gaussian(15.0, STEP)
    full = low_pass(values)
    slow = np.stack([
        np.sum(low_pass.weights * values[..., np.clip(np.arange(i - low_pass.reach, i + low_pass.reach + 1), 0, 499)], axis=-1) for i in range(500)
    ], axis=-1)  # fmt: skip
    np.testing.assert_allclose(full, slow, rtol=0, atol=1e-13)
    np.testing.assert_allclose(low_pass.at(values, rows), full[..., rows], rtol=0, atol=1e-14)
    np.testing.assert_allclose(low_pass(np.moveaxis(values, -1, 0), axis=0), np.moveaxis(full, -1, 0), rtol=0, atol=0)


# ---- the domain


@cache
def planar() -> robot.Robot:
    import tempfile
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_text(PLANAR)
        return robot.load(config.RobotSpec(urdf=str(file)))


def smooth(t, seed: int = 0, fastest: float = 1.5):
    """q, qd, qdd (n, 2): sines."""
    rng = np.random.default_rng(seed)
    w = 2.0 * np.pi * rng.uniform(0.2, fastest, (4, 1, 2))
    a, p = rng.uniform(0.1, 0.35, (4, 1, 2)), rng.uniform(0, 2 * np.pi, (4, 1, 2))
    phase = w * t[None, :, None] + p
    return (a * np.sin(phase)).sum(0), (a * w * np.cos(phase)).sum(0), -(a * w**2 * np.sin(phase)).sum(0)


def a_log(t, q, tau) -> Log:
    return Log("made", Path("made"), "", (Segment(t, float(t[1] - t[0]), q, tau, None, None, {}),))


def test_thinned_domain_is_the_domain_of_all_samples():
    """Laws are evaluated at every few samples and low-passed there; on smooth motion nothing is lost by that."""
    arm = planar()
    t = np.arange(8000) * STEP
    q, qd, qdd = smooth(t)
    tau = regressor.torque(arm, arm.prior, q, qd, qdd)
    (thin,) = questioned([a_log(t, q, tau)], arm.joints, 15.0).pieces
    every = round(thin.step / STEP)
    assert every == 4  # 16 samples a cycle of the cutoff
    both, angles = Gaussian(15.0, STEP), Gaussian(60.0, STEP)
    rows = np.round(thin.t / STEP).astype(int)
    np.testing.assert_allclose(thin.tau, both(tau, axis=0)[rows], rtol=0, atol=1e-12)
    np.testing.assert_allclose(thin.q, angles(q, axis=0)[rows], rtol=0, atol=1e-12)
    # the model's torque at every few samples, low-passed there, against all samples low-passed
    model = regressor.torque(arm, arm.prior, thin.q, thin.qd, thin.qdd)
    ours = thin.smoother(model, axis=0)[thin.core]
    theirs = thin.tau[thin.core]
    assert np.sqrt(np.mean((ours - theirs) ** 2)) < 3e-3 * np.sqrt(np.mean(theirs**2))  # the angles' own low-pass takes that
    dense = angles(q, axis=0)
    speed, bend = np.gradient(dense, STEP, axis=0), np.zeros_like(dense)
    bend[1:-1] = np.diff(dense, 2, axis=0) / STEP**2
    same = both(regressor.torque(arm, arm.prior, dense, speed, bend), axis=0)[rows][thin.core]
    np.testing.assert_allclose(ours, same, rtol=0, atol=2e-5 * np.abs(theirs).max())
    # friction jumps between two kept samples: what that costs is small beside the jump
    jump = thin.smoother(np.sign(thin.qd), axis=0)[thin.core] - both(np.sign(speed), axis=0)[rows][thin.core]
    assert np.abs(jump).max() < 0.19  # half a kept step at the kernel's peak; the jump is 2


def test_rows_at_standstill_are_left_out_with_what_the_filters_see_of_them():
    t = np.arange(8000) * STEP
    q, _, _ = smooth(t)
    q[3000:5000, 1] = q[3000, 1]
    motion = questioned([a_log(t, q, np.zeros_like(q))], planar().joints, 15.0)
    (piece,) = motion.pieces
    still = np.abs(piece.qd) < standstill_speed([replace(piece, use=None)])
    reach = round(1.25 * piece.smoother.reach)
    wide = np.array([[still[max(0, i - reach) : i + reach + 1, j].any() for j in range(2)] for i in range(len(still))])
    assert not (piece.use & wide).any()
    turns = np.abs(np.diff(np.sign(piece.qd), axis=0, prepend=np.sign(piece.qd[:1]))) > 0
    near = np.array([[turns[max(0, i - reach - 2) : i + reach + 3, j].any() for j in range(2)] for i in range(len(still))])
    assert piece.use[~wide & ~near].all()  # and nothing else is
    pause = (piece.t >= 3.0) & (piece.t < 5.0)
    assert not piece.use[pause, 1].any() and piece.use[pause, 0].mean() > 0.6
    assert 0.4 < piece.use[:, 0].mean() < 1.0


def test_logs_too_short_for_the_low_pass_give_no_domain():
    t = np.arange(120) * STEP
    q, qd, qdd = smooth(t)
    assert questioned([a_log(t, q, q)], planar().joints, 8.0) is None
    t = np.arange(4000) * STEP
    motion = questioned([a_log(t, *smooth(t)[:2])], planar().joints, 15.0)
    assert stride_of(motion, 15.0) * motion.pieces[0].step == pytest.approx(0.01, rel=0.3)  # about 100 rows a second


# ---- least squares with one more effect


def posed(seed: int, n: int = 60, dof: int = 2, size: int = 7, k: int = 2, joint: int | None = 1):
    """Random columns, weights and prior, the residual at their optimum, and an effect's columns; with what is behind them."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(dof, n, size))
    root = np.diag(rng.uniform(0.1, 3.0, size)) @ rng.normal(size=(size, size))
    weights, target = rng.uniform(0.5, 2.0, dof), rng.normal(size=size)
    own = rng.normal(size=(n, k)) + a[joint or 0, :, :k]
    tau = np.einsum("jnk,k->nj", a, rng.normal(size=size)) + 0.3 * rng.normal(size=(n, dof))
    columns = own if joint is not None else np.stack([own, rng.normal(size=(n, k))])
    if joint is None:
        tau += np.einsum("jnk,k->nj", columns, rng.normal(size=k))
    else:
        tau[:, joint] += own @ rng.normal(size=k)
    return SimpleNamespace(a=a, root=root, weights=weights, target=target, tau=tau, columns=columns, joint=-1 if joint is None else joint)


def stacked(p, with_effect: bool):
    """Rows and right-hand side of the whole problem: sum of weighted squares plus |root (x - target)|^2."""
    dof, n, size = p.a.shape
    k = p.columns.shape[-1]
    rows = []
    for j in range(dof):
        own = p.columns[j] if p.columns.ndim == 3 else p.columns * (j == p.joint)
        rows.append(p.weights[j] * (np.hstack([p.a[j], own]) if with_effect else p.a[j]))
    prior = np.hstack([p.root, np.zeros((len(p.root), k))]) if with_effect else p.root
    return np.vstack([*rows, prior]), np.concatenate([*(p.weights[:, None] * p.tau.T), p.root @ p.target])


def base_of(p, lower=None):
    m, y = stacked(p, False)
    if lower is None:
        return np.linalg.lstsq(m, y, rcond=None)[0]
    return lsq_linear(m, y, (lower, np.full(len(lower), np.inf)), tol=1e-14, lsq_solver="exact", method="bvls").x


def projection(p, x, positive=()) -> Projection:
    residual = p.tau - np.einsum("jnk,k->nj", p.a, x)
    return Projection(p.a, residual, 2.0 * p.root.T @ p.root, p.weights, {k: float(x[k]) for k in positive})


@pytest.mark.parametrize("joint", [0, 1, None])
@pytest.mark.parametrize("seed", range(4))
def test_step_is_least_squares_with_the_prior(seed, joint):
    p = posed(seed, joint=joint)
    x = base_of(p)
    c, change, absorbed, gain, visible = projection(p, x).step(p.columns, p.joint)
    m, y = stacked(p, True)
    best = np.linalg.lstsq(m, y, rcond=None)[0]
    np.testing.assert_allclose(np.append(x + change, c), best, rtol=1e-8, atol=1e-10)
    before, after = (np.sum((m @ z - y) ** 2) for z in (np.append(x, 0 * c), best))
    assert gain == pytest.approx(before - after, rel=1e-8)
    # what nothing else can absorb of each column, and what is absorbed
    base = stacked(p, False)[0]
    for k, share in enumerate(visible):
        column = m[:, len(x) + k]
        taken = np.linalg.lstsq(base, column, rcond=None)[0]
        np.testing.assert_allclose(absorbed[:, k], taken, rtol=1e-8, atol=1e-10)
        assert share == pytest.approx(np.sum((column - base @ taken) ** 2) / np.sum(column**2), rel=1e-8)


def test_step_of_what_the_model_has_already_is_nothing():
    p = posed(3)
    p.root = p.root * 0.0
    p.columns = p.a[1][:, :2] * [2.0, -1.0]
    c, change, _, gain, visible = projection(p, base_of(p)).step(p.columns, 1)
    # the other joint has these parameters too, and there the effect is not: so a little is seen
    assert visible.max() < 1.0
    p.a[0][:, :2] = 0.0
    c, change, _, gain, visible = projection(p, base_of(p)).step(p.columns, 1)
    assert visible.max() < 1e-9 and abs(gain) < 1e-9


def test_step_keeps_friction_positive():
    """A parameter that an effect would turn negative goes to zero: bounded least squares."""
    positive, asked, bounded = [2, 5], 0, 0
    for seed in range(16):
        p = posed(seed)
        # columns that take over what two parameters do, so that these would end below zero
        p.columns = p.columns + 2.0 * p.a[1][:, positive]
        p.root[:, positive] = 0.0  # of friction nothing is believed beforehand
        p.tau += np.einsum("jnk,k->nj", p.a[:, :, positive], np.clip(np.random.default_rng(100 + seed).uniform(0.02, 0.3, 2) - base_of(p)[positive], 0, None))
        x = base_of(p)
        if (x[positive] <= 0).any():
            continue  # the model itself is at the bound
        m, y = stacked(p, True)
        lower = np.full(m.shape[1], -np.inf)
        lower[positive] = 0.0
        free = np.linalg.lstsq(m, y, rcond=None)[0]
        best = lsq_linear(m, y, (lower, np.full(len(lower), np.inf)), tol=1e-14, lsq_solver="exact", method="bvls").x
        c, change, _, gain, _ = projection(p, x, positive).step(p.columns, p.joint)
        np.testing.assert_allclose(np.append(x + change, c), best, rtol=1e-6, atol=1e-8)
        before, after = (np.sum((m @ z - y) ** 2) for z in (np.append(x, 0 * c), best))
        assert gain == pytest.approx(before - after, rel=1e-7)
        asked, bounded = asked + 1, bounded + bool((free[positive] < 0).any())
    assert asked >= 8 and bounded >= 4, (asked, bounded)


def test_step_releases_what_the_model_holds_at_zero():
    """Friction that a model without the effect can only hold at zero comes back when the effect is there."""
    rng = np.random.default_rng(0)
    n = 400
    speed = rng.uniform(-3.0, 3.0, n)
    a = np.stack([np.sign(speed), speed], axis=1)[None]
    stribeck = (np.sign(speed) * np.exp(-((speed / 0.8) ** 2)))[:, None]
    tau = (a[0] @ [0.3, 0.05] + 1.0 * stribeck[:, 0] + 0.01 * rng.normal(size=n))[:, None]
    p = SimpleNamespace(a=a, root=np.zeros((2, 2)), weights=np.ones(1), target=np.zeros(2), tau=tau, columns=stribeck, joint=0)
    x = base_of(p, lower=np.zeros(2))
    assert x[1] == pytest.approx(0.0, abs=1e-9) and base_of(p)[1] < 0  # viscous friction is held at zero
    c, change, _, gain, _ = projection(p, np.maximum(x, 1e-9), (0, 1)).step(stribeck, 0)
    assert c[0] == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(x + change, [0.3, 0.05], atol=0.01)


# ---- evidence against chance


def coloured(rng, n: int, draws: int, step: float = 0.01, slow: float = 0.1, share: float = 0.5, cutoff: float = 15.0):
    """Residuals (n, draws) of white and coloured noise, through the low-pass."""
    margin = 60
    white = rng.normal(size=(n + 2 * margin, draws))
    keep = np.exp(-step / slow)
    slow_part = lfilter([np.sqrt(1 - keep**2)], [1.0, -keep], rng.normal(size=(n + 2 * margin, draws)), axis=0)
    return Gaussian(cutoff, step)(np.sqrt(1 - share) * white + np.sqrt(share) * slow_part, axis=0)[margin:-margin]


def chances(seed: int, draws: int, k: int, acts: float = 1.0) -> np.ndarray:
    """p-values of an effect of k columns that is not there; it acts in a share of the log."""
    rng = np.random.default_rng(seed)
    n, blocks = 2000, 48
    t = np.arange(n) / 100.0
    waves = np.stack([np.sin(2 * np.pi * f * t + phase) for f, phase in zip(rng.uniform(0.1, 1.5, 6 + k), rng.uniform(0, 6, 6 + k))], axis=1)
    base, own = waves[None, :, :6], waves[:, 6:] * (np.sin(2 * np.pi * 0.17 * t) > 1.0 - 2.0 * acts)[:, None]
    block = np.arange(n) * blocks // n
    noise = coloured(rng, n, draws)
    out = []
    for r in noise.T:
        r = r - base[0] @ np.linalg.lstsq(base[0], r, rcond=None)[0]
        project = Projection(base, r[:, None], np.zeros((6, 6)), np.ones(1))
        c, change, absorbed, _, _ = project.step(own, 0)
        fitted = (own @ c + base[0] @ change)[:, None]
        ground = SimpleNamespace(weights=np.ones(1), blocks=(block, block), projection=project, residual=r[:, None])
        out.append(Ground._chance(ground, own, 0, c, absorbed, fitted))
    return np.array(out)


@pytest.mark.parametrize(("k", "acts"), [(1, 1.0), (4, 1.0), (1, 0.3)])
def test_noise_of_any_colour_seldom_looks_like_an_effect(k, acts):
    p = chances(7 + k, 400, k, acts)
    assert ((p >= 0) & (p <= 1)).all()
    # over 1200 draws it was 7 to 10 % at 5 %, 1.6 to 3.2 % at 1 %, 0.1 to 0.4 % at 0.1 %: a little too sure of itself
    for level, most in ((0.05, 0.14), (0.01, 0.05), (0.001, 0.0101)):
        assert np.mean(p < level) <= most, (level, np.mean(p < level))
    assert np.mean(p < 0.5) > 0.25  # and it is not deaf


def test_what_is_there_is_seen():
    rng = np.random.default_rng(0)
    n = 2000
    t = np.arange(n) / 100.0
    own, block = np.sin(2 * np.pi * 0.7 * t)[:, None], np.arange(n) * 48 // n
    base = np.stack([np.ones(n), np.cos(2 * np.pi * 0.3 * t)], axis=1)[None]
    r = coloured(rng, n, 1)[:, 0] + 1.5 * own[:, 0]
    r -= base[0] @ np.linalg.lstsq(base[0], r, rcond=None)[0]
    project = Projection(base, r[:, None], np.zeros((2, 2)), np.ones(1))
    c, change, absorbed, _, _ = project.step(own, 0)
    ground = SimpleNamespace(weights=np.ones(1), blocks=(block, block), projection=project, residual=r[:, None])
    assert Ground._chance(ground, own, 0, c, absorbed, (own @ c + base[0] @ change)[:, None]) < 1e-8


def test_standard_errors_of_blocks_are_standard():
    """Sums over blocks of correlated noise, in standard errors, are at most as often large as a normal variable's."""
    rng = np.random.default_rng(1)
    n, blocks, draws = 1200, 30, 1500
    block, noise = np.arange(n) * blocks // n, coloured(rng, n, draws)
    told = np.sin(2 * np.pi * 0.4 * np.arange(n) / 100.0)
    slope = (noise * told[:, None]).sum(0) / np.sum(told**2)
    size = summed(block, (told**2)[:, None])[:, 0]
    scores = np.stack([summed(block, (told * (r - s * told))[:, None])[:, 0] for r, s in zip(noise.T, slope)])
    z = np.array([standard(s * size.sum(), own, size) for s, own in zip(slope, scores)])
    far = np.array([search.away(summed(block, (told * r)[:, None])[:, 0]) for r in noise.T])
    for values in (z, far):
        for level, share in ((1.645, 0.05), (2.33, 0.01), (3.0, 0.00135)):
            assert np.mean(values > level) <= 1.6 * share + 3.0 * np.sqrt(share / draws), (level, np.mean(values > level))
        assert abs(np.median(values)) < 0.15
    assert standard(5.0, np.zeros(10), np.ones(10)) == 0.0  # nothing to judge by
    assert standard(5.0, np.ones(10), np.eye(10)[0]) == 0.0  # it acts in one block alone
    assert search.away([1.0, 2.0]) == 0.0 and search.away(np.zeros(20)) == 0.0
    assert search.away([1.0, 1.1, 0.9, 1.0, 1.05]) == pytest.approx(5.05 / np.sqrt(5 * np.var([1.0, 1.1, 0.9, 1.0, 1.05], ddof=1)))


def test_q_values_are_benjamini_and_hochberg_s(monkeypatch):
    p = [0.2, 1e-6, 0.04, 1e-6, 0.9, 3e-4, 1.0]
    answers = [SimpleNamespace(candidate=f"c{i}", p=value) for i, value in enumerate(p)]
    ground = SimpleNamespace(squares=np.zeros((40, 2)))
    monkeypatch.setattr(search, "support", lambda ground, answer: search.Support(0.0, 0.0))  # held-out data say nothing
    found = search.q_values(ground, answers)
    # Fisher's product of p and 1: chi-square with 4 degrees of freedom in closed form
    combined = [v * (1.0 - np.log(v)) for v in p]
    for i, value in enumerate(combined):
        worse = [other * len(p) / sum(v <= other for v in combined) for other in combined if other >= value]
        assert found[f"c{i}"] == pytest.approx(min(1.0, *worse), rel=1e-9)
    monkeypatch.setattr(search, "support", lambda ground, answer: search.Support(0.0, -2.0))  # they say a little against all
    assert all(search.q_values(ground, answers)[c] >= found[c] for c in found)
    monkeypatch.setattr(search, "support", lambda ground, answer: search.Support(0.0, 6.0 if answer.candidate == "c2" else 0.0))
    assert search.q_values(ground, answers)["c2"] < 1e-3 < 0.1 < found["c2"]


# ---- from a folder to a verdict


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Writes a folder with something hidden in the planar arm, once; returns it."""
    made = {}

    def make(name: str, *hide, seed: int = 1, duration: float = 12.0, **more):
        if name not in made:
            found = simulate.simulate(planar(), hide=[simulate.hidden(h) if isinstance(h, str) else h for h in hide], seed=seed, duration=duration, rate=500.0, **more)
            folder = tmp_path_factory.mktemp("simulated") / name
            source = tmp_path_factory.getbasetemp() / "planar.urdf"
            source.write_text(PLANAR)
            simulate.write(found, config.Experiment(robot=config.RobotSpec(urdf=str(source))), folder)
            made[name] = folder
        return made[name]

    return make


def truth(folder, effect: str) -> dict:
    return next(h["values"] for h in json.loads((folder / "truth.json").read_text())["hidden"] if h["effect"] == effect)


def edited(folder, name: str, **sections):
    """Another experiment file beside the folder's own, with sections changed."""
    yaml = YAML(typ="safe", pure=True)
    tree = yaml.load((folder / "config.yaml").read_text())
    for section, values in sections.items():
        tree[section] = {**tree.get(section, {}), **values}
    file = folder / f"{name}.yaml"
    with file.open("w") as stream:
        yaml.dump(tree, stream)
    return file


def said_of(path) -> dict:
    return told(diagnose(pipeline.load(path)))


def told(found) -> dict:
    said = document(found)
    json.dumps(said, allow_nan=False)
    in_order(said, found.fit.joints)
    return said


def verdict(said: dict, joint: str) -> dict:
    (own,) = [v for v in said["verdict"] if v["joint"] == joint]
    return own


KINDS = {"visible": float, "q_value": float, "rms_test_before": float, "rms_test_after": float, "misfit_removed": float, "tied_with": list, "separate_by": str, "parameters": dict}


def in_order(said: dict, joints) -> None:
    """The document keeps the contract."""
    assert list(said["joints"]) == list(joints)
    for entry in said["joints"].values():
        assert set(entry["rms"]) == {"train", "test"} and all(isinstance(v, float) for v in entry["rms"].values())
        assert 0 < entry["noise_floor"] <= entry["rms"]["test"] and isinstance(entry["floor_method"], str)
        assert entry["status"] in ("complete", "missing", "unknown")
    assert [v["joint"] for v in said["verdict"]] == list(joints)  # every joint once
    for v in said["verdict"]:
        assert v["status"] == said["joints"][v["joint"]]["status"]
        if v["status"] == "missing":
            assert isinstance(v["effect"], str) and isinstance(v["tied_with"], list)
            assert any(f["effect"] == v["effect"] and f["joint"] in (v["joint"], "*") for f in said["findings"])
        if v["status"] == "unknown":
            assert v["depends_on"] and all(isinstance(d["variable"], str) and isinstance(d["share"], float) for d in v["depends_on"])
    for f in said["findings"]:
        assert isinstance(f["effect"], str) and (f["joint"] in joints or f["joint"] == "*")
        for key, kind in KINDS.items():
            assert isinstance(f[key], kind), key
        assert 0 <= f["visible"] <= 1 and 0 <= f["q_value"] <= 1 and isinstance(f["misfit_removed_se"], (float, type(None)))
        for name, entry in f["parameters"].items():
            assert name.split(".")[:2] == [f["effect"], f["joint"]] and set(entry) == {"value", "std", "unit"}
    steps = [f["joins_as_step"] for f in said["findings"]]
    joined = [s for s in steps if s]
    assert joined == sorted(joined) and (not steps or steps[0] == 1)  # the head of the first step stands first
    assert all(set(entry) == {"effect", "joint", "visible", "separate_by"} and 0 <= entry["visible"] < 0.05 for entry in said["not_visible"])


def head(said: dict, effect: str, joint: str) -> dict:
    return next(f for f in said["findings"] if (f["effect"], f["joint"]) == (effect, joint) and f["joins_as_step"])


def near(finding: dict, folder, name: str, truly: float | None = None, share: float = 0.1) -> None:
    effect, joint = finding["effect"], finding["joint"]
    entry = finding["parameters"][f"{effect}.{joint}.{name}"]
    truly = truth(folder, effect)[name] if truly is None else truly
    assert entry["value"] == pytest.approx(truly, rel=share), (name, entry)
    assert entry["std"] is None or abs(entry["value"] - truly) < 6.0 * entry["std"], (name, entry, truly)


@pytest.fixture(scope="module")
def control(simulated):
    """The diagnosis of a robot in which nothing is hidden."""
    return diagnose(pipeline.load(simulated("control")))


def test_nothing_hidden_nothing_found(control):
    said = told(control)
    assert {v["status"] for v in said["verdict"]} == {"complete"}
    assert said["findings"] == [] and all("depends_on" not in v for v in said["verdict"])
    # the last link's own inertia is a payload
    assert ("payload", "*") in {(entry["effect"], entry["joint"]) for entry in said["not_visible"]}


def test_stribeck_friction_is_named_on_its_joint(simulated):
    folder = simulated("stribeck", "stribeck:shoulder:dF=1.5,vs=0.4", speed=1.5)
    said = said_of(edited(folder, "masked", preprocess={"standstill": "mask", "torque": "same"}))
    assert verdict(said, "shoulder")["effect"] == "stribeck" and verdict(said, "shoulder")["tied_with"] == []
    assert verdict(said, "elbow")["status"] == "complete"
    found = said["findings"][0]
    assert (found["effect"], found["joint"]) == ("stribeck", "shoulder")
    near(found, folder, "dF")
    near(found, folder, "vs")
    assert found["misfit_removed"] > 0.7 and found["misfit_removed_se"] < 0.4
    assert found["rms_test_after"] < 0.5 * found["rms_test_before"] == pytest.approx(0.5 * said["joints"]["shoulder"]["rms"]["test"], rel=0.02)
    assert found["visible"] > 0.1 and found["q_value"] < 1e-6
    assert {name: p["unit"] for name, p in found["parameters"].items()} == {"stribeck.shoulder.dF": "N m", "stribeck.shoulder.vs": "rad/s"}


def test_strong_stribeck_friction_is_named_too(simulated):
    folder = simulated("strong", "stribeck:elbow:dF=1,vs=0.4")
    said = said_of(folder)
    assert verdict(said, "elbow").get("effect") == "stribeck"
    near(head(said, "stribeck", "elbow"), folder, "dF")


def test_a_bias_and_asymmetric_friction_are_one_family(simulated):
    folder = simulated("bias", "torque_bias:elbow:b=0.4")
    said = said_of(folder)
    own = verdict(said, "elbow")
    assert (own["effect"], own["tied_with"]) == ("torque_bias", ["asymmetric_coulomb"])
    assert verdict(said, "shoulder")["status"] == "complete"
    near(head(said, "torque_bias", "elbow"), folder, "b")
    (other,) = [f for f in said["findings"] if f["effect"] == "asymmetric_coulomb"]
    assert other["tied_with"] == ["torque_bias"] and other["separate_by"] and other["joins_as_step"] is None


def test_two_effects_on_two_joints_are_both_named(simulated):
    folder = simulated("two", "cogging:elbow:k=13,a=0.35,phase=0.6", "load_friction:shoulder:mu=0.1")
    said = said_of(folder)
    assert [verdict(said, joint)["effect"] for joint in ("shoulder", "elbow")] == ["load_friction", "cogging"]
    near(head(said, "load_friction", "shoulder"), folder, "mu")
    ripple = head(said, "cogging", "elbow")
    near(ripple, folder, "k", 13.0)
    a, b = (ripple["parameters"][f"cogging.elbow.{n}"]["value"] for n in ("a1", "b1"))
    assert np.hypot(a, b) == pytest.approx(0.35, rel=0.1) and np.arctan2(b, a) == pytest.approx(0.6, abs=0.1)
    assert {f["joins_as_step"] for f in said["findings"]} >= {1, 2}


# ---- what the catalogue does not have


def by_other_angle(q, qd, qdd, t, load, memory):
    return np.array([0.0, 1.5 * np.sin(2.0 * q[0])])


def product(q, qd, qdd, t, load, memory):
    return np.array([0.0, 3.0 * q[0] * q[1]])


def variables_of(own: dict) -> set[str]:
    """What an unknown verdict says that the residual follows."""
    return {word for d in own["depends_on"] for word in d["variable"].split(" and ")} | set(own["follows"])


def test_an_effect_outside_the_catalogue_is_called_unknown(simulated):
    said = said_of(simulated("other_angle", by_other_angle, duration=20.0))
    own = verdict(said, "elbow")
    assert own["status"] == "unknown"
    first = own["depends_on"][0]
    assert first["variable"] == "q_shoulder" and first["share"] > 0.7 and first["unit"] == "rad"
    curve = np.array([first["curve"]["at"], first["curve"]["mean"]])
    assert np.corrcoef(np.sin(2.0 * curve[0]), curve[1])[0, 1] > 0.8


def test_a_product_of_two_angles_is_called_unknown(simulated):
    said = said_of(simulated("product", product, seed=2, duration=20.0))
    own = verdict(said, "elbow")
    assert own["status"] == "unknown" and {"q_shoulder", "q_elbow"} <= variables_of(own)
    assert verdict(said, "shoulder")["status"] == "complete"


# ---- effects of the user's own


OWN = '''import numpy as np

from sysid.effect import Linear, TorqueEffect


class Crosstalk(TorqueEffect):
    """The first joint's angle pulls."""

    c = Linear("N m", says="size")

    def columns(self, motion, joint):
        return np.sin(2.0 * motion.q[None, :, 0])
'''


def test_an_effect_from_a_file_takes_part(simulated):
    folder = simulated("other_angle", by_other_angle, duration=20.0)
    (folder / "my_effects.py").write_text(OWN)
    said = said_of(edited(folder, "own", model={"candidates": ["my_effects.py:Crosstalk"]}))
    assert verdict(said, "elbow")["effect"] == "crosstalk"
    found = head(said, "crosstalk", "elbow")
    near(found, folder, "c", 1.5)
    assert found["misfit_removed"] > 0.8 and found["separate_by"] == "not stated"


def test_a_formula_takes_part_and_survives_its_discovery(simulated, tmp_path):
    folder = simulated("product", product, seed=2, duration=20.0)
    file = edited(folder, "formula", model={"candidates": [{"formula": "a*q*q_shoulder", "name": "product"}]})
    found = loop.discover(pipeline.load(file), tmp_path, most=1)
    assert [step["added"] for step in found.steps] == [None, "formula"] and found.steps[1]["joint"] == "elbow"
    assert found.steps[1]["rms_test"]["elbow"] < 0.7 * found.steps[0]["rms_test"]["elbow"]
    step = pipeline.load(tmp_path / found.steps[1]["folder"] / "experiment.yaml")
    assert step.model.effects[-1].options == {"formula": "a*q*q_shoulder", "name": "product"} and step.model.effects[-1].joints == ["elbow"]
    again = pipeline.fit(step)
    assert again.rms("test") == pytest.approx(found.steps[1]["rms_test"], rel=1e-9)
    value = next(p for p in results.document(again)["parameters"] if p["name"] == "product.elbow.a")
    assert value["value"] == pytest.approx(3.0, rel=0.1)


def test_an_option_survives_its_discovery(simulated, tmp_path):
    """Friction that follows the angle in proportion to speed is `position_friction` with an option."""
    folder = simulated("ripple", lambda q, qd, qdd, t, load, memory: np.array([0.0, 0.3 * qd[1] * (1.0 + np.sin(3.0 * q[1]))]), seed=2, duration=14.0)
    experiment = pipeline.load(folder)
    found = diagnose(experiment)
    # what discover does of a step, without another diagnosis after it
    grown = loop.grown(experiment, *loop.spelled(found.steps[0].head.candidate, "elbow"))
    fit = pipeline.fit(grown)
    results.write(fit, tmp_path / "step")
    again = pipeline.load(tmp_path / "step" / "experiment.yaml")
    assert (again.model.effects[-1].name, again.model.effects[-1].joints, again.model.effects[-1].options) == ("position_friction", ["elbow"], {"times": "speed"})
    assert pipeline.fit(again).rms("test") == pytest.approx(fit.rms("test"), rel=1e-9) and fit.rms("test")["elbow"] < found.fit.rms("test")["elbow"]


# ---- is structure left?


@pytest.fixture(scope="module")
def ground(control):
    """The control's ground."""
    return control.first


def with_residuals(ground, train, test):
    """The ground as if it had left these residuals on the elbow."""
    copy = object.__new__(Ground)
    vars(copy).update({k: v for k, v in vars(ground).items() if k not in ("residual", "residual_test", "squares")})
    for name, own, rows in (("residual", train, ground.rows), ("residual_test", test, ground.held_out)):
        values = np.array(getattr(ground, name))
        values[:, 1] = np.where(rows.use[:, 1], own, 0.0)
        vars(copy)[name] = values
    return copy


def noise_like(ground, seed: int):
    rng = np.random.default_rng(seed)
    return tuple(0.02 * coloured(rng, len(rows.t), 1)[:, 0] for rows in (ground.rows, ground.held_out))


def test_no_structure_in_noise(ground):
    for seed in range(3):
        own = structures(with_residuals(ground, *noise_like(ground, seed)))[1]
        assert not own.there and not own.bursts, (seed, own.share, own.away)


def test_a_tone_is_structure(ground):
    parts = []
    for noise, rows, phase in zip(noise_like(ground, 1), (ground.rows, ground.held_out), (0.0, 1.0)):
        parts.append(noise + 0.03 * np.sin(2 * np.pi * 6.3 * rows.t + phase))
    own = structures(with_residuals(ground, *parts))[1]
    assert own.there and own.together == ("time, in a tone",) and own.share > 0.4


def test_bursts_are_structure(ground):
    parts = []
    for noise, rows, at in zip(noise_like(ground, 2), (ground.rows, ground.held_out), (4.0, 7.5)):
        parts.append(noise + 0.5 * np.exp(-(((rows.t - at) / 0.15) ** 2)))
    own = structures(with_residuals(ground, *parts))[1]
    assert own.there and own.bursts


def follows(ground, law, seed: int = 3):
    """What is found in noise on the elbow, and a law of the motion ten times as strong."""
    from sysid.diagnose.structure import variables

    parts = [noise + law({name: values for name, (_, values) in variables(ground, part).items()}) for noise, part in zip(noise_like(ground, seed), ("train", "test"))]
    return structures(with_residuals(ground, *parts))[1]


def test_what_follows_an_angle_is_structure(ground):
    own = follows(ground, lambda v: 0.2 * np.sin(2.0 * v["q_shoulder"]))
    assert own.there and own.together == ("q_shoulder",) and own.depends_on[0].variable == "q_shoulder" and own.share > 0.7


def test_what_follows_two_variables_is_structure(ground):
    own = follows(ground, lambda v: 0.2 * np.sign(v["qd_elbow"]) * (1.0 + np.sin(2.0 * v["q_shoulder"])))
    assert own.there and set(own.together) == {"q_shoulder", "qd_elbow"} and own.share > 0.7


@pytest.mark.parametrize(("law", "words"), [
    (lambda v: 0.2 * np.sin(2.0 * v["q_shoulder"]) * v["qd_elbow"], {"q_shoulder", "qd_elbow"}), (lambda v: 0.2 * np.abs(v["qd_shoulder"]), {"qd_shoulder"}),
    (lambda v: 0.15 * np.abs(v["qd_elbow"]) * v["qd_shoulder"], {"qd_shoulder", "qd_elbow"}),
])  # fmt: skip
def test_strong_simple_laws_are_structure(ground, law, words):
    own = follows(ground, law)
    assert own.there and own.share > 0.6 and words <= {*own.together, *(d.variable for d in own.depends_on)}


def test_what_remembers_is_structure(ground):
    def creep(v):  # a lag of 0.25 s, which is none of those that are tried
        keep = np.exp(-np.median(np.diff(v["time"])) / 0.25)
        return 0.3 * lfilter([1.0 - keep], [1.0, -keep], v["qd_elbow"])

    own = follows(ground, creep)
    assert own.there and own.share > 0.6 and any(name.startswith("qd_elbow of the last") for name in own.together)


def verdict_on(share: float, *, away: float = 9.0, together=("q_elbow",), taken: float | None = None, error: float = 1.0, angles: float = 0.0):
    """The verdict on a joint of which a share can be foretold of what is left, one per row; the noise floor is one."""
    left = Structure(0, share, away, (), together)
    count = 1000.0
    last = SimpleNamespace(raw_rms=lambda: np.array([error]), squares=np.full((10, 1), count / 10), counts=np.full((10, 1), count / 10))
    head = SimpleNamespace(candidate=SimpleNamespace(joint=0, name="viscous"))
    steps = [] if taken is None else [SimpleNamespace(head=head, family=(head,), before=np.array([count * (1.0 + taken)]))]
    (found,) = _verdict(SimpleNamespace(joints=("elbow",)), {"elbow": NoiseFloor(1.0, 0.05, "spectral", "")}, steps, last, [left], SimpleNamespace(from_angles=lambda _: np.array([angles])))
    return found


@pytest.mark.parametrize(("given", "status"), [
    ({"share": 0.3}, "unknown"), ({"share": 0.3, "away": 3.0}, "complete"), ({"share": 0.05}, "complete"),
    # what is foretold is less than half of what the angles' own noise makes; a tone is none of its making
    ({"share": 0.3, "angles": 0.9}, "complete"), ({"share": 0.3, "angles": 0.9, "together": (TONE,)}, "unknown"),
    # nothing foretells it, but the error is far above the floor; not where the angles' noise makes it
    ({"share": 0.0, "error": 2.0}, "unknown"), ({"share": 0.0, "error": 2.0, "angles": 1.0}, "complete"),
    # an effect was found: is it most of what is wrong?
    ({"share": 0.3, "taken": 1.0}, "unknown"), ({"share": 0.3, "taken": 4.0}, "missing"), ({"share": 0.0, "taken": 1.0}, "missing"),
    ({"share": 0.2, "taken": 4.0, "together": (TONE,)}, "unknown"), ({"share": 0.0, "taken": 1.0, "error": 1.4}, "unknown"), ({"share": 0.0, "taken": 6.0, "error": 1.4}, "missing"),
])  # fmt: skip
def test_a_verdict_weighs_what_was_found_against_what_is_left(given, status):
    found = verdict_on(**given)
    assert found.status == status and (found.also == ("viscous",)) == (status == "unknown" and "taken" in given)


def test_ties_on_another_joint_are_said_with_that_joint():
    """Of two torque sensors only the ratio of the gains is seen: either may be the wrong one, and both verdicts say so."""
    answer = lambda name, joint: SimpleNamespace(candidate=SimpleNamespace(name=name, joint=joint))  # noqa: E731
    family = (answer("torque_gain", 0), answer("torque_gain", 1), answer("torque_bias", 0))
    step = SimpleNamespace(head=family[0], family=family, before=np.array([2000.0, 2000.0]))
    quiet = SimpleNamespace(raw_rms=lambda: np.ones(2), squares=np.full((10, 2), 100.0), counts=np.full((10, 2), 100.0))
    left, level = [Structure(j, 0.0, 0.0, ()) for j in range(2)], NoiseFloor(1.0, 0.05, "spectral", "")
    joints = ("shoulder", "elbow")
    found = _verdict(SimpleNamespace(joints=joints), dict.fromkeys(joints, level), [step], quiet, left, SimpleNamespace(from_angles=lambda _: np.zeros(2)))
    assert [(v.status, v.effect, v.tied_with) for v in found] == [
        ("missing", "torque_gain", ("torque_gain on elbow", "torque_bias")), ("missing", "torque_gain", ("torque_gain on shoulder", "torque_bias on shoulder")),
    ]  # fmt: skip


@pytest.mark.parametrize(("standstill", "at_rest", "said"), [("keep", 1.0, True), ("keep", 0.1, False), ("mask", 1.0, False)])
def test_error_around_standstill_is_said_with_what_leaves_it_out(standstill, at_rest, said):
    """A joint that swings, whose residual is 0.1 in motion and `at_rest` where it turns."""
    t = np.arange(4000) * 1e-3
    q = np.sin(2.0 * t)[:, None]
    spec = config.PreprocessSpec(standstill=standstill)
    pieces = prepare([Log("swing", Path("swing"), "", (Segment(t, 1e-3, q, q, None, None, {}),))], spec, ("hip",)).pieces
    qd = np.concatenate([piece.qd[piece.core] for piece in pieces])
    residual = np.where(np.abs(qd) < 0.02, at_rest, 0.1)
    measured = np.concatenate([piece.measured[piece.core] for piece in pieces])
    fit = SimpleNamespace(joints=("hip",), filters={}, experiment=SimpleNamespace(preprocess=spec), predictions={"test": SimpleNamespace(predicted=measured - residual)})
    found = list(_around_standstill(SimpleNamespace(test=SimpleNamespace(pieces=pieces)), fit))
    assert len(found) == said and all("'hip'" in notice and "standstill: mask" in notice for notice in found)


# ---- what changed on another log


CHANGED_CONFIG = "robot: {urdf: robot.urdf}\ndata: {train: [train.csv], test: [test.csv]}\nmodel: {effects: [viscous, coulomb]}\n"
LOAD = np.array([0.8, 0.8 * 0.32, 0.0, 0.8 * 0.02, 0.002, 0.8 * 0.32**2 + 0.003, 0.8 * 0.32**2 + 0.003, 0.0, 0.0, 0.0])  # of the fore link's frame


def written(path, seed: int, *, load=None, coulomb=(0.5, 0.3), bias=0.0, seconds: float = 12.0):
    """A log of the planar arm, with a body on its last link or other friction."""
    arm = planar()
    t = np.arange(int(seconds * 250)) / 250.0
    q, qd, qdd = smooth(t, seed, 1.2)
    pi = np.array(arm.prior) * 1.1
    if load is not None:
        pi[-1] += load
    tau = regressor.torque(arm, pi, q, qd, qdd) + 0.3 * qd + np.array(coulomb) * np.sign(qd) + [0.0, bias]
    tau += np.random.default_rng(seed).normal(0.0, 0.1, q.shape)
    columns = {"t": t} | {f"q_{joint}": q[:, j] for j, joint in enumerate(arm.joints)} | {f"tau_{joint}": tau[:, j] for j, joint in enumerate(arm.joints)}
    path.write_text(csv(columns))


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """An experiment, its run folder, and new logs of the robot: the same, with a payload, with more friction."""
    folder = tmp_path_factory.mktemp("changed")
    (folder / "config.yaml").write_text(CHANGED_CONFIG)
    (folder / "robot.urdf").write_text(PLANAR)
    written(folder / "train.csv", 1)
    written(folder / "test.csv", 2)
    written(folder / "same.csv", 3)
    written(folder / "loaded.csv", 4, load=LOAD)
    written(folder / "rough.csv", 5, coulomb=(0.5, 0.9))
    written(folder / "short.csv", 6, seconds=2.0)
    run = folder / "run"
    results.write(pipeline.fit(pipeline.load(folder)), run)
    return folder


def what_changed(folder, log: str) -> dict:
    said = changes_document(changed.changed(pipeline.load(folder), folder / "run", [str(folder / log)]))
    json.dumps(said, allow_nan=False)
    assert [v["joint"] for v in said["verdict"]] == ["shoulder", "elbow"] == list(said["joints"])
    return said


def test_no_change_no_finding(fitted):
    said = what_changed(fitted, "same.csv")
    assert said["findings"] == [] and {v["status"] for v in said["verdict"]} == {"complete"}


def test_a_payload_is_found_with_its_mass(fitted):
    said = what_changed(fitted, "loaded.csv")
    assert [f["effect"] for f in said["findings"]] == ["payload"]
    values = said["findings"][0]["parameters"]
    mass = values["payload.*.m"]
    assert mass["unit"] == "kg" and mass["std"] < 0.1 and abs(mass["value"] - LOAD[0]) < 3.0 * mass["std"] + 0.005
    for axis, true in zip("xz", (0.32, 0.02)):
        entry = values[f"payload.*.com_{axis}"]
        assert abs(entry["value"] - true) < 4.0 * entry["std"] + 0.01
    assert any("torque sensors" in notice for notice in said["notices"])
    assert {v["effect"] for v in said["verdict"]} == {"payload"}
    for entry in said["joints"].values():
        assert entry["rms"]["after"] < 0.3 * entry["rms"]["held"]


def test_friction_that_grew_is_named_on_its_joint(fitted):
    said = what_changed(fitted, "rough.csv")
    assert [(f["effect"], f["joint"]) for f in said["findings"]] == [("coulomb", "elbow")]
    value = said["findings"][0]["parameters"]["coulomb.elbow.Fc"]
    assert abs(value["value"] - 0.6) < 4.0 * value["std"] + 0.02
    assert verdict(said, "shoulder")["status"] == "complete" and verdict(said, "elbow")["effect"] == "coulomb"


def test_questions_about_a_change_that_cannot_be_asked(fitted, tmp_path):
    experiment = pipeline.load(fitted)
    log = [str(fitted / "same.csv")]
    other = tmp_path / "other"
    other.mkdir()
    (other / "robot.urdf").write_text(PLANAR.replace('"elbow"', '"wrist"'))
    (other / "config.yaml").write_text(CHANGED_CONFIG)
    for name in ("train", "test"):
        (other / f"{name}.csv").write_text((fitted / f"{name}.csv").read_text().replace("_elbow", "_wrist"))
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "fit.json").write_text("[]")
    for kind, asked, words in (
        (ConfigError, (experiment, tmp_path / "nothing", log), "run folder"),
        (ConfigError, (experiment, tmp_path / "broken", log), "no run folder"),
        (ConfigError, (pipeline.load(other), fitted / "run", log), "the run moved shoulder, elbow"),
        (SysidError, (experiment, fitted / "run", [str(fitted / "absent.csv")]), "absent.csv"),
        (LogError, (experiment, fitted / "run", [str(fitted / "short.csv")]), "too short"),
    ):
        with pytest.raises(kind, match=words) as caught:
            changed.changed(*asked)
        assert "\n" not in str(caught.value)
