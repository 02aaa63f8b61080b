"""What a diagnosis of the logs that there are could not tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..addition import LIKELY, moved


@dataclass(frozen=True)
class LeftOpen:
    """suspects: (effect, joint) each, the likeliest first; chances: how likely a diagnosis found each,
    by `effect:joint`; logs: what it is of, (part, SHA-256) each."""

    suspects: tuple[tuple[str, str], ...] = ()
    chances: Mapping[str, float] = field(default_factory=dict)
    logs: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, diagnosis: Mapping | None, separate: Sequence[tuple[str, str]] | None) -> LeftOpen:
        """What the document of a diagnosis leaves open of the suspects to `separate`; where these are
        None, its first tie. Without a diagnosis the suspects alone.
        """
        if diagnosis is None:
            return cls(tuple(separate or ()))
        ties = [_members(claim["set"]) for claim in diagnosis["claims"]]
        if separate is None:
            asked = next((told for told in map(_likely, ties) if len(told) > 1), ())
        else:
            asked = tuple((effect, joint) for effect, joint in separate)
        found = next((tie for tie in ties if set(asked) <= tie.keys()), {})
        chances = {f"{e}:{j}": found[e, j] for e, j in asked if (e, j) in found}
        return cls(asked, chances, read(diagnosis["logs"]))


def read(logs) -> tuple[tuple[str, str], ...]:
    """Which logs a fit or a diagnosis is of."""
    return tuple((one["part"], one["sha256"]) for one in logs)


def _members(among) -> dict[tuple[str, str], float]:
    """{(effect, joint): probability} of a claim's set, the head first."""
    return {(m["effect"], m["joint"]): m["probability"] for m in among if m["probability"] > 0.0}


def _likely(tie: dict[tuple[str, str], float]) -> tuple[tuple[str, str], ...]:
    """Those of a set that are worth a motion, and that one can show."""
    head, others = list(tie)[:1], list(tie)[1:]
    return tuple(one for one in (*head, *others) if (one in head or tie[one] >= LIKELY) and moved(one[0]))
