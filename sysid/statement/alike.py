"""What many joints have alike is one cause, and not one on each: torques that are read late by much
the same, friction that is another in the same logs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .words import listed

_MANY = 3  # joints: two may be a cause each
# of the middle one: a lag and a delay of one size tell times that differ by less
_NEAR = 0.3
_LATE = {"delay": ("d", 1.0), "current_lag": ("T", -1.0)}  # what lags is behind what was logged


def read_alike(findings: Sequence) -> Iterator[str]:
    """What is said of claims' heads of which many are a time by which torque is read late.

    Args:
        findings: of each claim the head: effect, joint, parameters {name: (value, ...)}.
    """
    late: dict[str, float] = {}
    for one in findings:
        word, sign = _LATE.get(one.effect, ("", 0.0))
        for name, (value, *_) in one.parameters.items():
            if word and name.rpartition(".")[2] == word:
                late[one.joint] = sign * value
    late = {joint: time for joint, time in late.items() if np.isfinite(time)}
    middle = float(np.median([*late.values()])) if late else 0.0
    late = {j: time for j, time in late.items() if abs(time - middle) <= _NEAR * abs(middle)}
    if len(late) < _MANY:
        return
    low, high = np.sort(1e3 * np.abs([*late.values()]))[[0, -1]]
    how = "late" if middle > 0.0 else "early"
    yield (
        f"the torques of {listed([*late], 'and')} are {how} by much the same, {low:.2g} to "
        f"{high:.2g} ms: one cause is likelier than one on each joint, as torque and angles of "
        "different clocks or cycles, a filter of the drives, or a command that was logged in the "
        "place of the torque; without --joint `sysid add` gives every joint one"
    )


def changed_alike(findings: Sequence) -> Iterator[str]:
    """What is said of claims' heads of which many are friction that is another in the same logs.

    Args:
        findings: of each claim the head: effect, joint, candidate.
    """
    by_logs: dict[frozenset, list[str]] = {}
    for one in findings:
        if one.effect == "friction_change":
            logs = dict(one.candidate.options).get("logs", ())
            by_logs.setdefault(frozenset(logs), []).append(one.joint)
    for logs, joints in by_logs.items():
        if len(joints) >= _MANY:
            yield (
                f"the friction of {listed(joints, 'and')} is another in the same logs "
                f"({', '.join(sorted(logs))}): one cause is likelier than one on each joint, as "
                "the temperature, lubricant, or another robot of the kind"
            )
