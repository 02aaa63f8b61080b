"""What the studies of priors and restarts work on: an experiment's logs as triangles, filtered once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import filters as filtering
from ..compress import compress
from ..experiment_logs import read
from ..held_apart import prior_strength
from ..long_motion import prepare
from ..model import Model, moving_coefficients
from ..motion import Motion
from ..notices import refuse_no_row, refuse_no_torque, tell_still
from ..pipeline import build, started
from ..prior_weight import with_weight
from ..shape_refinement import refined
from ..specs import Experiment
from ..triangles import Compressed
from ..warned import noticed


@dataclass(frozen=True)
class Prepared:
    """What studies work on: an experiment, the weight of its prior a number, its logs as triangles, with the model, the
    prior (bodies, 10), and which coefficients (coefficients,) belong to joints that move."""

    experiment: Experiment
    model: Model
    motion: Motion
    train: Compressed
    test: Compressed
    prior: np.ndarray
    moving: np.ndarray
    notices: tuple[str, ...]


def prepared(experiment: Experiment) -> Prepared:
    """Read, filter and compress the training and the test logs of an experiment. Raises SysidError."""
    with noticed() as notices:
        experiment = started(experiment)
        machine, structure, prior = build(experiment)
        train = read(experiment, machine, experiment.data.train)
        refuse_no_torque(train)
        preprocess = experiment.preprocess
        if not filtering.is_given(experiment):
            preprocess = filtering.settled(preprocess, filtering.compare(experiment, structure, train, prior))
        motion = prepare(train, preprocess, machine.joints)
        refuse_no_row(motion)
        tell_still(motion, experiment.preprocess)
        structure, _, _, strength = refined(experiment, structure, motion, prior)
        held_out = prepare(read(experiment, machine, experiment.data.test), preprocess, machine.joints)
        train_data, test_data = compress(structure, motion), compress(structure, held_out)
        strength = strength or prior_strength(experiment, structure, motion, train_data, prior)
    return Prepared(with_weight(experiment, strength.value), structure, motion, train_data, test_data, prior, moving_coefficients(structure, motion), tuple(notices))
