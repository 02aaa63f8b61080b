"""Effects that were looked at and are not claimed, and why, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .candidates import Candidate
from .estimate import Fit
from .failures import taken
from .mean_by_log import MOST
from .model_parameters import ROBOT

LOW_PASS = "`torque: low-pass` under `preprocess:` in the experiment file"
PART = "it takes less than half of the error above the noise, and the rest stays"


@dataclass(frozen=True)
class Refused:
    """An effect that was looked at and is not claimed, and why, in words.

    candidate, p, shares: of one that the training logs told: what joined, its family-wise p-value,
    and of each joint's squared residual on the test logs, under the low-pass, what it takes (dof,).
    raw: whether the fit's torque is as logged.
    """

    effect: str
    joint: str
    why: str
    candidate: Candidate | None = None
    p: float = 1.0
    shares: Sequence[float] = ()
    raw: bool = False

    @property
    def told(self) -> str:
        """In words."""
        said = not_claimed(self.effect, self.why)
        if self.candidate is None or self.candidate.joint == ROBOT:
            return said
        share = self.shares[self.candidate.joint]  # another joint's may be all that falls
        taken = f"{100 * share:.0f} % of that error's square"
        low = f"; under the low-pass of a diagnosis it takes {taken}"
        low += f"; with {LOW_PASS} a fit may bear it out" * self.raw
        return said + low * bool(share >= MOST)


def no_claim(step, why: str, fit: Fit, test) -> Refused:
    """Why a diagnosis' step, of an experiment's fit, is no claim. test: logs, low-passed."""
    shares = taken(step.before.settled, step.after.settled, test)
    told = step.candidate, step.p, shares, raw(fit)
    return Refused(*step.candidate.named(fit.joints), why, *told)


def not_claimed(effect: str, why: str) -> str:
    """Of an effect that was looked at, in words."""
    return f"{effect} was looked at and is not claimed: {why}"


def in_vain(refused: Sequence[Refused], joints, j: int, least: float):
    """The Candidate on joint j, with its p-value, that takes at least such a share of its squared
    residual on the test logs, under the low-pass, and which no fit bore out; None where there is
    none."""
    own = [
        r for r in refused if r.candidate and r.joint in (joints[j], "*") and r.shares[j] >= least
    ]
    best = max(own, key=lambda r: r.shares[j], default=None)
    return best and (best.candidate, best.p)


def raw(fit: Fit) -> bool:
    """Whether a fit's torque is as logged: a low-pass goes with a filter."""
    spec = fit.experiment.preprocess
    return spec.torque == "raw" and spec.filter != "none"
