"""What is wrong with a log, as a user is told it."""

from __future__ import annotations

from dataclasses import dataclass

ERROR, WARNING = "error", "warning"


@dataclass(frozen=True)
class Fault:
    """A fault of one log, or of all where `log` is empty; of one joint, or of all where `joint` is.

    severity: "error" where a fit of what was logged would be wrong, "warning" where it is worth
    knowing. times:
    [s] on the log's own clock; rows: how many samples. says: what, with its figure; do: the cure.
    """

    fault: str
    severity: str
    says: str
    do: str
    joint: str = ""
    log: str = ""
    times: tuple[float, ...] = ()
    rows: int = 0
