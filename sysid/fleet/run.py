"""Experiments' files -> the fleet: what cannot be used is named, and the rest goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from .. import pipeline
from ..errors import SysidError
from ..specs import Experiment
from . import listing
from .analysis import FEWEST, RATE, Fleet, analysed
from .members import Kind, Member, first, member


def fleet(
    experiments: Iterable[str | Path],
    *,
    rate: float = RATE,
    seed: int = 0,
    progress: Callable[[str, float], None] | None = None,
) -> Fleet:
    """What experiments of one type of robot share, what differs, which one is odd and in what.

        sysid.fleet(["robots/*"]).odd

    Every experiment is fitted by itself; filters are chosen on the first, for all. One that cannot
    be used is in `failed`, with the reason, and the rest goes on.

    Args:
        experiments: YAML files, folders with config.yaml, folders of such folders, patterns.
        rate: of false alarms, the probability of any in the whole table. seed: of what is drawn.

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
    members: list[Member] = []
    kind: Kind | None = None
    for number, (spec, name) in enumerate(zip(specs, named)):
        tell(f"fitting, {name}", number / len(specs))
        try:
            kind = first(spec) if kind is None else kind
            members.append(member(spec, name, kind))
        except SysidError as error:
            failed.append((str(spec.path), str(error)))
    if kind is None or len(members) < FEWEST:
        why = f"; the first that cannot be: {failed[0][1]}" if failed else ""
        raise SysidError(
            f"{len(members)} of {len(paths)} experiments can be used{why}", where="fleet",
            allowed=f"{FEWEST} or more of one type of robot",
        )  # fmt: skip
    tell("comparing", 0.0)
    return analysed(kind, members, failed, rate=rate, seed=seed)


def _loaded(paths: list[Path], failed: list[tuple[str, str]]) -> list[Experiment]:
    out = []
    for path in paths:
        try:
            out.append(pipeline.load(path))
        except SysidError as error:
            failed.append((str(path), str(error)))
    return out
