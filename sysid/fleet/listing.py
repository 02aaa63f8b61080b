"""Which experiments are meant: files, folders, folders of folders, patterns; and their names."""

from __future__ import annotations

import glob
from collections.abc import Iterable
from pathlib import Path

from ..errors import ConfigError
from ..specs import Experiment

_CONFIG = "config.yaml"


def listed(given: Iterable[str | Path]) -> list[Path]:
    """Every experiment that is meant, once, in the order given; of a pattern or a folder, by name.

    Raises:
        ConfigError: nothing is there.
    """
    out: dict[Path, Path] = {}
    for one in map(str, given):
        there = [Path(one)] if Path(one).exists() else [Path(p) for p in sorted(glob.glob(one))]
        found = [path for place in there for path in _inside(place)]
        if not found:
            raise ConfigError(
                "no experiment is there", where=one,
                allowed="a YAML file, a folder with config.yaml, a folder of these, or a pattern",
            )  # fmt: skip
        out |= {path.resolve(): path for path in found if path.resolve() not in out}
    return list(out.values())


def _inside(place: Path) -> list[Path]:
    if place.is_file():
        return [place]
    if (place / _CONFIG).is_file():
        return [place]
    return sorted(path.parent for path in place.glob(f"*/{_CONFIG}"))


def names(specs: list[Experiment]) -> list[str]:
    """Experiments' names, with their folder where two share one, and a number where that does not
    help."""
    own = [spec.name for spec in specs]
    own = [
        f"{spec.folder.resolve().name}/{name}" if own.count(name) > 1 else name
        for spec, name in zip(specs, own)
    ]
    return [
        f"{name} ({own[:k].count(name) + 1})" if own.count(name) > 1 else name
        for k, name in enumerate(own)
    ]
