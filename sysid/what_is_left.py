"""What a diagnosis' claims leave of joints, and what may be asked of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from .borne_out import misfit_taken
from .brief import brief
from .candidates import Candidate
from .estimate import Fit
from .failures import HeldOut
from .flexible import Law
from .noise import NoiseFloor, as_of_test
from .plausible import Reason
from .unexplained import of_few_blocks
from .view import View, elsewhere, law, strength


@dataclass(frozen=True)
class Left:
    """The view and the fit with all claims, what they leave of the low-passed test logs, and each
    joint's floor.

    answers: of all candidates under the last model that was searched, which has what was refused
    since, and under the first. logs: those of both parts, as read. refitted: everything settled anew
    with a group's candidate in a view. known: as of `pipeline.fit_grown`.
    """

    view: View
    fit: Fit
    held_out: HeldOut
    floors: Sequence[NoiseFloor]
    answers: Sequence
    logs: object
    refitted: Callable
    known: dict

    @cached_property
    def elsewhere(self) -> View | None:
        """The same model settled on the test logs."""
        return elsewhere(self.view, self.logs.test, self.logs.train)

    @cached_property
    def moments(self) -> dict[str, Reason]:
        """Joints that are at their noise but for a moment, and why."""
        return brief(self.fit, self.floors)

    def law(self, j: int) -> Law:
        """The function of the motion that stands out most of what is left of joint j."""
        return law(self.view, j, self.elsewhere)

    def strength(self, j: int) -> Law | None:
        """The one that its strength follows; None where its training logs are at the floor."""
        return None if self._trained(j) else strength(self.view, j, self.elsewhere)

    def beyond(self, j: int, candidate: Candidate) -> Law | None:
        """The law of joint j with a candidate in the model; None where nobody can tell."""
        group = next(filter(None, (asked.of(candidate) for asked in self.answers)), None)
        with_it = group and self.elsewhere and self.refitted(self.view, group)
        return with_it and law(with_it.view, j, elsewhere(with_it.view, self.logs.test))

    def few(self, j: int, least: float, soft: bool):
        """As of `of_few_blocks`: (Candidate, p) or None. Training logs would show a soft gear."""
        soft = soft and not self._trained(j)
        own, fits = self.answers[0].by_joint.get(j, [()])[0], partial(self.fitted, j)
        return of_few_blocks(
            own, partial(self.refitted, self.view), self.held_out, j, least, fits, soft=soft
        )

    def _trained(self, j: int) -> bool:
        """Whether joint j's training logs are at its floor."""
        trained = as_of_test(self.fit.rms("train"), self.floors)[self.fit.joints[j]]
        return self.floors[j].reached(trained)

    def fitted(self, j: int, candidate: Candidate) -> float:
        """The share of joint j's misfit on the test logs that goes where it is in a fit."""
        return misfit_taken(self.fit, j, self.floors[j], self.known, candidate)
