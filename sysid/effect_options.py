"""Options of effects that cannot be are refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import inf, nan

from .errors import ConfigError


def whole(effect, option: str, most: int) -> None:
    """Refuse an option that is no whole number from 1 to `most`."""
    value = getattr(effect, option)
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed=f"a whole number, 1 to {most}")


def one_of(effect, option: str, allowed, do: str | None = None) -> None:
    """Refuse an option that is not one of the allowed words."""
    value = getattr(effect, option)
    if value not in allowed:
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed=", ".join(allowed), do=do)


def texts(effect, option: str) -> None:
    """Refuse an option that is neither left out nor a list of texts."""
    value = getattr(effect, option)
    if value is not None and not (isinstance(value, list) and value and all(isinstance(item, str) for item in value)):
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed="a list of names")


def stretches(effect, option: str) -> list[tuple[str, float, float]]:
    """Stretches of logs (log, start, stop) that an option gives as texts "LOG START STOP", none where it is left out. Raises ConfigError."""
    texts(effect, option)
    out = []
    for text in getattr(effect, option) or ():
        try:
            log, start, stop = text.rsplit(None, 2)
            out.append((log, float(start), float(stop)))
        except ValueError:
            out.append((text, nan, nan))
        if not -inf < out[-1][1] < out[-1][2] < inf:
            allowed = "LOG START STOP: a log's name under `data`, and two times [s] of its clock, the second one later"
            raise ConfigError(f"{effect.name}.{option} has {text!r}", where="model.effects", allowed=allowed, do="correct it, as in 'pick.csv 3.2 7.9'")
    return out


_MOST, _EVERY = 8, 4  # logs that are tried: of more, each is a small part; and of which any may have it together


def subsets(logs: Sequence[str], *, half: bool = False) -> list[dict]:
    """Options of an effect that may be in any of few logs, but not in all; of more in each alone: where it is then follows from how
    much of it each has.

    Args:
        half: of logs and all others only the fewer, where the effect may have either sign beside what all logs share.
    """
    if not 1 < len(logs) <= _MOST:
        return []
    counts = range(1, len(logs) // 2 + 1 if half else len(logs)) if len(logs) <= _EVERY else (1,)
    sets = [own for count in counts for own in combinations(logs, count)]
    # of two halves the one without the last log: what came later is what changed
    return [{"logs": list(own)} for own in sets if not (half and 2 * len(own) == len(logs) and logs[-1] not in own)]


def logs_of(options: dict) -> list[str]:
    """The names of logs among the options of an effect that is in some logs, or in stretches of some; what is none of either is left
    to the effect."""
    lists = (options.get(name) if isinstance(options.get(name), list) else [] for name in ("logs", "stretches"))
    own, parts = ([text for text in one if isinstance(text, str)] for one in lists)
    return own + [text.rsplit(None, 2)[0] for text in parts if len(text.split()) > 2]


def renamed(options: dict, named: Mapping[str, str]) -> dict:
    """Options whose logs have other names, {name: the new one}."""
    out, known = dict(options), lambda name: named.get(name, name)
    if isinstance(own := options.get("logs"), list):
        out["logs"] = [known(name) for name in own]
    if isinstance(own := options.get("stretches"), list):
        out["stretches"] = [" ".join([known(name), *times]) for name, *times in (text.rsplit(None, 2) for text in own)]
    return out
