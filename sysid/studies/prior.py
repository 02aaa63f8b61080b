"""How strong should the prior be? The weight gamma by cross-validation, as the paper chose its 1e-2.

The training logs are cut into stretches; each is predicted by a fit that never saw it. Folds are made of triangles, so
a fold costs a solve, not a pass over the samples. Test logs are not touched.
"""

import numpy as np

from ..blocks import standard_error
from ..compress import Compressed
from ..estimate import pose
from ..interior import minimise
from ..model import Model
from ..specs import Experiment

WEIGHTS = tuple(10.0 ** np.arange(-6, 7).astype(float))
_FOLDS = 8


def one(experiment: Experiment, model: Model, data: Compressed, prior, moving, weight: float) -> dict:
    """Held-out squared error of every fold at one weight: {"squares": [...], "rows": [...]}, and the bodies' divergence."""
    spec = experiment.model_copy(update={"prior": experiment.prior.model_copy(update={"weight": weight})})
    squares, rows = [], []
    folds = np.array_split(np.arange(data.blocks), min(_FOLDS, data.blocks))
    for fold in folds:
        problem = pose(spec, model, data.without(fold), moving, prior)
        coordinates = problem.coordinates
        iterates, _, _ = minimise(problem.objective, coordinates.positive, coordinates.held, coordinates.physical(problem.start), tolerance=spec.solver.tolerance)
        held = data.without(set(range(data.blocks)) - set(fold.tolist()))
        squares.append(float(held.squares(iterates[-1]).sum()))
        rows.append(int(held.rows.sum()))
    return {"squares": squares, "rows": rows}


def summary(results: list[dict], weights: list[float], current: float) -> dict:
    """The JSON document of `sysid study prior`.

    `chosen` has the least held-out error; `largest_within_one_se` is the strongest prior whose error differs from it by
    less than one standard error over folds, the usual choice where the curve is flat.
    """
    squares, rows = (np.array([result[key] for result in results], dtype=float) for key in ("squares", "rows"))
    mean = squares / rows  # mean square of each fold
    total = squares.sum(1) / rows.sum(1)
    best = int(np.argmin(total))
    folds = mean.shape[1]
    difference = mean - mean[best]
    se = standard_error(difference.T) / folds if folds > 1 else np.full(len(weights), np.inf)
    within = [k for k in range(len(weights)) if difference[k].mean() <= se[k]]
    return {
        "weights": weights, "rms_held_out": np.sqrt(total).tolist(),
        "rms_folds": np.sqrt(mean).tolist(), "folds": folds,
        "chosen": weights[best], "largest_within_one_se": weights[max(within, key=lambda k: weights[k])], "experiment_weight": current,
    }  # fmt: skip
