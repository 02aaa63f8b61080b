"""How strong a fit's prior is, and how that came to be. Chosen in `held_apart`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .spec_values import AUTO
from .specs import Experiment

#: Rucker & Wensing 2022, section VII: where nothing can be held apart, and to compare filters by
USUAL = 1e-2

#: Times the mass that a URDF states, or parts of it, that a link may have. Simulated arms whose
#: bodies are drawn about their URDF's are given 0.4 to 2.1 times, under a weak prior too, real
#: ones whose model lacks nothing great 0.5 to 2.7.
PLAUSIBLE = 3.0


@dataclass(frozen=True)
class PriorWeight:
    """The weight of a fit's prior and how it came to be.

    value: of the objective's unit. auto: whether it was chosen. tried: the weights that were, least
    first; errors: (tried, stretches) mean squared error on each stretch held apart, [N^2 m^2].
    """

    value: float
    auto: bool = False
    tried: tuple[float, ...] = ()
    errors: np.ndarray | None = None
    bounded: bool = False

    @property
    def stretches(self) -> int:
        """How many were held apart."""
        return 0 if self.errors is None else self.errors.shape[1]

    @property
    def says(self) -> str:
        """The weight and why, in one line."""
        if not self.auto:
            return f"prior weight {self.value:g} (given)"
        if self.errors is None:
            return (
                f"prior weight {self.value:g} (auto: the logs are too short to hold a part apart)"
            )
        if self.bounded:
            return (
                f"prior weight {self.value:g} (auto: the weakest by which bodies are within a "
                f"factor of {PLAUSIBLE:g} of the URDF's; weaker ones are better on "
                f"{self.stretches} blocks held apart)"
            )
        return (
            f"prior weight {self.value:g} (auto: the strongest within one standard error of the "
            f"best on {self.stretches} blocks held apart)"
        )


def with_weight(experiment: Experiment, weight: float | str) -> Experiment:
    """The experiment with another weight of its prior."""
    prior = experiment.prior.model_copy(update={"weight": weight})
    return experiment.model_copy(update={"prior": prior})


def weakest(variance: float) -> float:
    """The weight of a prior that says no more of a body than that it is within a factor PLAUSIBLE
    of the URDF's, as one standard deviation.

    Under noise of variance s^2 the objective is 2 s^2 times the negative logarithm of a
    probability. The divergence of a body of which one second moment is changed by a factor exp(d)
    is about d^2 / 2, so that the deviation of d is sqrt(2 s^2 / gamma).

    Args:
        variance: of the residual, in the objective's unit.
    """
    return 2.0 * variance / np.log(PLAUSIBLE) ** 2


def number(experiment: Experiment) -> float:
    """The weight of an experiment's prior: the usual one where it is yet to be chosen."""
    return USUAL if is_auto(experiment) else float(experiment.prior.weight)


def is_auto(experiment: Experiment) -> bool:
    """Whether the weight is to be chosen."""
    return experiment.prior.weight == AUTO


def document(weight: PriorWeight) -> dict:
    """The weight as `fit.json` has it; `held_out` lists what was tried, with its RMS error on the
    stretches held apart, over joints in units of the best one's."""
    rms = [] if weight.errors is None else np.sqrt(weight.errors.mean(1)).tolist()
    return {
        "weight": weight.value,
        "auto": weight.auto,
        "says": weight.says,
        "blocks": weight.stretches,
        "held_out": [{"weight": w, "relative_rms": e} for w, e in zip(weight.tried, rms)],
    }
