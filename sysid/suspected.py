"""What a view of an experiment makes suspect beside the catalogue: the user's own effects, stops, and loads for a while."""

from __future__ import annotations

from .effect import Effect
from .end_stops import asked_too
from .picks import picked
from .specs import Experiment


def suspected(experiment: Experiment, view) -> list[Effect]:
    """The effects that are asked beside those of the catalogue as they stand there.

    Args:
        view: of the model, a `view.View`.
    """
    return [*asked_too(experiment, view), *picked(view)]
