"""Is structure left that nothing in the vocabulary explains, and what does it depend on?

A residual that is noise cannot be foretold. So what is left on the training rows is learned as a smooth function of the
motion and of its past, of one variable at a time and of several together, and the test rows say which share of their own
residual that foretells. A share that stands out from block to block is structure, whatever it is called.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from ..rows import summed
from .ground import Ground, foretells
from .search import away, stands_out

TONE = "time, in a tone"
LEAST, STANDS_OUT = 0.1, 4.0  # share of the held-out square foretold; standard errors
# Noise through a low-pass is Gaussian, whatever its colour: its tenth of largest rows holds 0.44 of its square.
_LARGEST, _CROWDED = 0.1, 0.65
_KNOTS, _BINS, _FEATURES, _TURNS, _WIDTHS, _RIDGES = 9, 25, 24, 5, (0.25, 0.6, 1.5), np.geomspace(1e-4, 1e2, 7)
_FOLDS = 5
_SMOOTH = np.sqrt(np.log(2.0)) / (2.0 * np.pi * 5.0)  # s: a low-pass of 5 Hz
_FEWER = (22, 94)  # features: the plain ones, and those with the random ones
_PAST = (0.1, 0.4, 1.6)  # s: how far back a joint may remember its speed
_LOWEST, _SCATTER = 0.5, 5.0  # Hz; a peak of twenty times its surroundings counts as four standard errors


@dataclass(frozen=True)
class Dependence:
    """Which share of a joint's held-out squared residual a variable foretells, and the curve: at (bins,) values of the
    variable the mean residual of training and test rows together (bins,), with its standard error."""

    variable: str
    unit: str
    share: float
    away: float
    at: np.ndarray
    mean: np.ndarray
    se: np.ndarray


@dataclass(frozen=True)
class Structure:
    """What of a joint's residual can be foretold: by the best of all together, and by each variable, best first; together:
    the variables that foretell most; crowded: the share of the held-out square that the largest tenth of the rows holds."""

    joint: int
    share: float
    away: float
    depends_on: tuple[Dependence, ...]
    together: tuple[str, ...] = ()
    crowded: float = 0.0

    @property
    def bursts(self) -> bool:
        """Whether the residual comes in bursts, as no noise through a low-pass does."""
        return self.crowded >= _CROWDED

    @property
    def tone(self) -> bool:
        """Whether one frequency foretells most."""
        return self.together == (TONE,)

    @property
    def there(self) -> bool:
        """Whether structure is left."""
        return self.bursts or (self.share >= LEAST and self.away >= STANDS_OUT)


def structures(ground: Ground) -> list[Structure]:
    """For each joint, what of its residual can be foretold."""
    train, test = variables(ground, "train"), variables(ground, "test")
    return [_structure(ground, joint, train, test) for joint in range(ground.model.robot.dof)]


def variables(ground: Ground, part: str) -> dict[str, tuple[str, np.ndarray]]:
    """{name: (unit, (n,) values)} on the rows of a part: q, qd, qdd of every joint, the predicted torque, what each joint's
    speed was lately, time."""
    which = part == "test"
    motion, rows = ((ground.train, ground.rows), (ground.test, ground.held_out))[which]
    robot = ground.model.robot
    own = [rows.index[rows.piece == k] for k in range(len(motion.pieces))]
    pick = lambda name: np.concatenate([getattr(piece, name)[i] for piece, i in zip(motion.pieces, own)])  # noqa: E731
    # the encoder's noise is in the residual too: what depends on acceleration must do so where the motion is, not the noise
    slow = lambda values, step: gaussian_filter1d(values, _SMOOTH / step, axis=0, mode="nearest")  # noqa: E731
    q, qd = pick("q"), pick("qd")
    qdd = np.concatenate([slow(piece.qdd, piece.step)[i] for piece, i in zip(motion.pieces, own)])
    predicted = np.concatenate([
        slow(ground.predicted[which][rows.piece == k], piece.step * ground.stride) for k, piece in enumerate(motion.pieces)
    ])  # fmt: skip
    lately = {
        past: np.concatenate([_lately(piece.qd, piece.step, past)[i] for piece, i in zip(motion.pieces, own)]) for past in _PAST
    }  # fmt: skip
    out = {}
    for j, (joint, slides) in enumerate(zip(robot.joints, robot.prismatic)):
        base, force = ("m", "N") if slides else ("rad", "N m")
        out[f"q_{joint}"] = (base, q[:, j])
        out[f"qd_{joint}"] = (f"{base}/s", qd[:, j])
        out[f"qdd_{joint}"] = (f"{base}/s^2", qdd[:, j])
        out[f"tau_{joint}"] = (force, predicted[:, j])
        out |= {_past(joint, past): (f"{base}/s", values[:, j]) for past, values in lately.items()}
    return out | {"time": ("s", rows.t)}


def _past(joint: str, seconds: float) -> str:
    return f"qd_{joint} of the last {seconds:g} s"


def _lately(values, step: float, seconds: float) -> np.ndarray:
    """Values (n, dof) through a lag of first order."""
    keep = np.exp(-step / seconds)
    return lfilter([1.0 - keep], [1.0, -keep], values, axis=0)


def _structure(ground: Ground, joint: int, train, test) -> Structure:
    use, use_test = ground.rows.use[:, joint], ground.held_out.use[:, joint]
    if use.sum() < 100 or use_test.sum() < 100:
        return Structure(joint, 0.0, 0.0, ())
    y, y_test = ground.residual[use, joint], ground.residual_test[use_test, joint]
    blocks, blocks_test = ground.blocks[0][use], ground.blocks[1][use_test]
    found, together, robot = [], [], ground.model.robot
    others_past = {_past(other, past) for other in robot.joints if other != robot.joints[joint] for past in _PAST}
    for name, (unit, values) in train.items():
        if name in others_past:
            continue
        a, b = values[use], test[name][1][use_test]
        if name == "time":
            share, far = _over_time(b, y_test, blocks_test)
        else:
            knots = np.quantile(a, np.linspace(0, 1, _KNOTS))
            share, far = _foretold(_splines(a, knots), y, blocks, _splines(b, knots), y_test, blocks_test)
        found.append(Dependence(name, unit, share, far, *_curve(np.concatenate([a, b]), np.concatenate([y, y_test]))))
    found.sort(key=lambda d: -d.share)
    own = robot.joints[joint]
    pairs = [(f"{a}_{own}", f"{b}_{own}") for a, b in combinations(("q", "qd", "qdd", "tau"), 2)]
    pairs += [(f"{a}_{own}", _past(own, past)) for a in ("q", "qd") for past in _PAST]
    for other in robot.joints:
        if other != own:
            pairs += [(f"{a}_{own}", f"{b}_{other}") for a, b in (("q", "q"), ("qd", "q"), ("qd", "qd"), ("tau", "qd"))]
    for names in pairs:
        made = _together([train[n][1][use] for n in names], [test[n][1][use_test] for n in names])
        share, far = _foretold(made[0], y, blocks, made[1], y_test, blocks_test)
        together.append((share, far, names))
    together.append((*_tone(ground, joint), (TONE,)))
    best = max([*((d.share, d.away, (d.variable,)) for d in found), *together], key=lambda t: t[0] if t[1] >= STANDS_OUT else -1.0)
    return Structure(
        joint, best[0], best[1], tuple(d for d in found if d.away >= 2.0 and d.share > 0.0), best[2] if best[1] >= STANDS_OUT else (), _crowded(y_test),
    )  # fmt: skip


def _tone(ground: Ground, joint: int) -> tuple[float, float]:
    """Share of the test rows' squares at the one frequency that stands out most of the training rows, and how far it stands
    out: a tone keeps its frequency from log to log, noise of any colour does not."""
    power = []
    for rows, residual in ((ground.rows, ground.residual), (ground.held_out, ground.residual_test)):
        longest = np.bincount(rows.piece).argmax()
        own = residual[rows.piece == longest, joint]
        step = float(np.median(np.diff(rows.t[rows.piece == longest])))
        power.append((np.fft.rfftfreq(4 * len(own), step), np.abs(np.fft.rfft(own * np.hanning(len(own)), 4 * len(own))) ** 2))
    (first, p), (second, other) = power
    width = 4.0 * max(first[1], second[1]) * 2.0  # the window's main lobe, on both sides
    smooth = np.convolve(p, np.ones(161) / 161, mode="same")
    peak = first[int(np.argmax(p / np.maximum(smooth, 1e-300) * (first > _LOWEST)))]
    near = np.abs(second - peak) <= width
    around = (np.abs(second - peak) <= 12.0 * width) & ~near
    if not near.any() or not around.any() or not other.sum() > 0:
        return 0.0, 0.0
    excess = other[near].sum() - near.sum() * other[around].mean()
    # of noise the power within one lobe scatters by about its own mean
    return float(max(excess, 0.0) / other.sum()), float(other[near].max() / max(other[around].mean(), 1e-300) / _SCATTER)


def _splines(x, knots) -> np.ndarray:
    """Linear splines (n, knots + 2) of a variable, and what it does across its sign."""
    knots = np.unique(knots)
    size = max(np.ptp(knots), 1e-12)
    hats = [np.interp(x, knots, row) for row in np.eye(len(knots))]
    return np.column_stack([*hats, np.sign(x), np.clip((x - knots[0]) / size, -1, 2)])


def _together(train, test) -> tuple[np.ndarray, np.ndarray]:
    """Plain functions of two variables and of their signs and sizes, then random cosines of both at several widths (Rahimi &
    Recht 2007), also times the sign of each."""
    rng = np.random.default_rng(0)
    a, b = np.stack(train, 1), np.stack(test, 1)
    signs = [np.sign(x) for x in (a, b)]
    middle, spread = a.mean(0), np.where(a.std(0) > 0, a.std(0), 1.0)
    sizes = [np.abs(x) / spread for x in (a, b)]
    a, b = (a - middle) / spread, (b - middle) / spread
    w = np.concatenate([rng.normal(size=(2, _FEATURES)) / width for width in _WIDTHS], axis=1)
    phase = rng.uniform(0, 2 * np.pi, w.shape[1])
    waves = [np.cos(x @ w + phase) for x in (a, b)]
    turns = np.arange(1, _TURNS + 1)
    # what is in proportion to the second variable and changes with the first, and the second's own size
    along = [np.concatenate([np.cos(x[:, :1] * turns), np.sin(x[:, :1] * turns)], axis=1) * x[:, 1:] for x in (a, b)]
    product = lambda x: x[:, :1] * x[:, 1:]  # noqa: E731
    plain = [
        np.column_stack([x, product(x), s, product(s), z, s * z[:, ::-1], s * z.prod(1, keepdims=True), w])
        for x, s, z, w in zip((a, b), signs, sizes, along)
    ]  # fmt: skip
    return tuple(np.concatenate([p, f, f * s[:, :1], f[:, :_FEATURES] * s[:, 1:]], axis=1) for p, f, s in zip(plain, waves, signs))


def _foretold(a, y, blocks, b, y_test, blocks_test) -> tuple[float, float]:
    """Share of the test rows' squares that ridge regression on the training rows foretells, and its standard errors from
    zero; the ridge, and how many of the features are used, are chosen over blocks of the training rows."""
    counts = _FEWER + (a.shape[1],) if a.shape[1] > _FEWER[-1] else (a.shape[1],)
    fold = blocks * _FOLDS // (blocks.max() + 1)
    error, told = min((_learned(a[:, :k], y, fold, b[:, :k]) for k in counts), key=lambda pair: pair[0])
    if error >= np.sum(y**2):
        return 0.0, 0.0
    before, after = summed(blocks_test, np.stack([y_test**2, (y_test - told) ** 2], 1)).T
    total = before.sum()
    if not total > 0:
        return 0.0, 0.0
    return float((total - after.sum()) / total), max(stands_out(before, after), foretells(told[:, None], y_test[:, None], blocks_test))


def _learned(a, y, fold, b) -> tuple[float, np.ndarray]:
    """Error over the folds at the best ridge, and what is foretold of the test rows with it: never beyond what was foretold of
    the training rows."""
    middle, scale, mean = a.mean(0), np.where(a.std(0) > 1e-9, a.std(0), 1.0), y.mean()
    a, b, y = (a - middle) / scale, (b - middle) / scale, y - mean
    grams = [(a[fold == k].T @ a[fold == k], a[fold == k].T @ y[fold == k]) for k in range(_FOLDS)]
    system, right = sum(g for g, _ in grams), sum(r for _, r in grams)
    errors, unit = np.zeros(len(_RIDGES)), len(y) / len(_RIDGES)
    for k, (g, r) in enumerate(grams):
        values, vectors = np.linalg.eigh(system - g)
        turned = vectors.T @ (right - r)
        for i, ridge in enumerate(_RIDGES):
            w = vectors @ (turned / (np.clip(values, 0, None) + ridge * unit))
            errors[i] += np.sum((y[fold == k] - a[fold == k] @ w) ** 2)
    w = np.linalg.solve(system + _RIDGES[int(np.argmin(errors))] * unit * np.eye(len(system)), right)
    inside = a @ w
    return float(errors.min()), np.clip(b @ w, inside.min(), inside.max()) + mean


def _over_time(t, y, blocks) -> tuple[float, float]:
    """Share of slow drift: a smooth curve over every other block of a log foretells the blocks between."""
    even = blocks % 2 == 0
    if even.all() or not even.any():
        return 0.0, 0.0
    knots = np.linspace(t.min(), t.max(), 7)
    features = _splines(t, knots)[:, :-2]
    fall = np.zeros(len(y))
    for own in (even, ~even):
        a = features[own]
        w = np.linalg.solve(a.T @ a + 1e-2 * len(a) * np.eye(a.shape[1]) / 7, a.T @ y[own])
        fall[~own] = y[~own] ** 2 - (y[~own] - features[~own] @ w) ** 2
    total = np.sum(y**2)
    return (float(fall.sum() / total), away(summed(blocks, fall[:, None])[:, 0])) if total > 0 else (0.0, 0.0)


def _crowded(y) -> float:
    """The share of the squares of y that its largest tenth holds."""
    square = np.sort(y**2)[::-1]
    return float(square[: max(1, round(_LARGEST * len(square)))].sum() / max(square.sum(), 1e-300))


def _curve(x, y) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of y over bins of x with equal numbers of rows."""
    order = np.argsort(x)
    parts = [p for p in np.array_split(order, _BINS) if len(p)]
    return tuple(np.array([f(p) for p in parts]) for f in (lambda p: x[p].mean(), lambda p: y[p].mean(), lambda p: y[p].std() / np.sqrt(len(p))))
