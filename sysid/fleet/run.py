"""Experiments' files -> the fleet: what cannot be used is named, and the rest goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from .. import pipeline
from ..errors import SysidError
from ..specs import Experiment
from ..workers import crew
from . import listing
from .analysis import FEWEST, RATE, Fleet, analysed
from .members import Kind, Member, first, member


def fleet(
    experiments: Iterable[str | Path],
    *,
    rate: float = RATE,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Fleet:
    """What experiments of one type of robot share, what differs, which one is odd and in what.

        sysid.fleet(["robots/*"]).odd

    Every experiment is fitted by itself; filters are chosen on the first, for all. One that cannot
    be used is in `failed`, with the reason, and the rest goes on.

    Args:
        experiments: YAML files, folders with config.yaml, folders of such folders, patterns.
        rate: of false alarms, the probability of any in the whole table. seed: of what is drawn.
        workers, scheduler: as of `workers.crew`; what is found does not depend on them.

    Raises:
        SysidError: fewer than three experiments can be used.
    """
    if not 0.0 < rate < 1.0:
        raise SysidError(f"a rate of false alarms of {rate:g}", allowed="above 0, below 1")
    tell = progress or (lambda stage, share: None)
    paths = listing.listed(experiments)
    failed: list[tuple[str, str]] = []
    specs = _loaded(paths, failed)
    named = listing.names(specs)
    kind, rest = _kind(specs, failed)
    members: list[Member] = []
    tasks = [(spec, name, kind) for spec, name in zip(specs[rest:], named[rest:])]
    with crew(workers, scheduler, lambda text: tell(text, 0.0)) as mapped:
        for number, found in enumerate(mapped(_member, tasks)):
            if isinstance(found, str):
                failed.append((str(tasks[number][0].path), found))
            else:
                members.append(found)
            tell("fitting the robots", (number + 1) / len(tasks))
    if kind is None or len(members) < FEWEST:
        why = f"; the first that cannot be: {failed[0][1]}" if failed else ""
        raise SysidError(
            f"{len(members)} of {len(paths)} experiments can be used{why}", where="fleet",
            allowed=f"{FEWEST} or more of one type of robot",
        )  # fmt: skip
    tell("comparing", 0.0)
    return analysed(kind, members, failed, rate=rate, seed=seed)


def _kind(specs: list[Experiment], failed: list[tuple[str, str]]) -> tuple[Kind | None, int]:
    """The kind of robot that the first usable experiment is of, and which one that is."""
    for number, spec in enumerate(specs):
        try:
            return first(spec), number
        except SysidError as error:
            failed.append((str(spec.path), str(error)))
    return None, len(specs)


def _member(spec: Experiment, name: str, kind: Kind) -> Member | str:
    """What an experiment says, or why it cannot."""
    try:
        return member(spec, name, kind)
    except SysidError as error:
        return str(error)


def _loaded(paths: list[Path], failed: list[tuple[str, str]]) -> list[Experiment]:
    out = []
    for path in paths:
        try:
            out.append(pipeline.load(path))
        except SysidError as error:
            failed.append((str(path), str(error)))
    return out
