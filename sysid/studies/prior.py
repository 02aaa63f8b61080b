"""How strong should the prior be? The weight gamma by cross-validation, as the paper chose its 1e-2.

The whole curve of what `prior.weight: auto` chooses from, on the same stretches of the training logs.
"""

import numpy as np

from ..blocks import within_one_error
from ..held_apart import held_apart, joint_weights, judged
from ..model import Model
from ..prior_weight import number, with_weight
from ..specs import Experiment
from ..triangles import Compressed

WEIGHTS = tuple(10.0 ** np.arange(-6, 7).astype(float))


def one(experiment: Experiment, model: Model, data: Compressed, prior, moving, weight: float) -> dict:
    """Held-out squared error of every fold and joint at one weight: {"squares": [[...], ...], "rows": [[...], ...]}."""
    weights = joint_weights(with_weight(experiment, number(experiment)), model, data, moving, prior)
    apart = held_apart(experiment, model, data, moving, prior, weights)
    squares = apart.squares(weight, tolerance=experiment.solver.tolerance)
    return {"squares": squares.tolist(), "rows": apart.rows.tolist()}


def summary(results: list[dict], weights: list[float], current: float) -> dict:
    """The JSON document of `sysid study prior`.

    `chosen` has the least held-out error, each joint's in units of its own; `largest_within_one_se` is the strongest prior
    whose error differs from it by less than one standard error over folds: what `prior.weight: auto` takes.
    """
    squares, rows = (np.array([result[key] for result in results], dtype=float) for key in ("squares", "rows"))
    errors, best = judged(squares, rows[0])
    mean = squares.sum(2) / rows.sum(2)  # mean square of each fold
    total = squares.sum((1, 2)) / rows.sum((1, 2))
    within = np.flatnonzero(within_one_error(errors, best))
    return {
        "weights": weights, "rms_held_out": np.sqrt(total).tolist(), "relative_rms": np.sqrt(errors.mean(1)).tolist(),
        "rms_folds": np.sqrt(mean).tolist(), "folds": mean.shape[1],
        "chosen": weights[best], "largest_within_one_se": max(weights[k] for k in within), "experiment_weight": current,
    }  # fmt: skip
