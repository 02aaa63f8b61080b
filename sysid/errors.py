"""What can go wrong, said in one line: what, where, what is allowed, what to do."""

import difflib
from collections.abc import Iterable


class SysidError(Exception):
    """Bad input. Its text is the one line that the user reads; the command exits with status 2."""

    def __init__(self, what: str, *, where: str | None = None, allowed: str | None = None, do: str | None = None):
        parts = [what if where is None else f"{where}: {what}"]
        if allowed:
            parts.append(f"allowed: {allowed}")
        if do:
            parts.append(do)
        super().__init__("; ".join(" ".join(part.split()) for part in parts))


class ConfigError(SysidError):
    """The experiment file says something that cannot be meant."""


class LogError(SysidError):
    """A log cannot be read, or what it holds cannot be a measurement."""


class RobotError(SysidError):
    """The URDF, the joints or the rotors do not describe a robot."""


class SysidWarning(UserWarning):
    """Something was decided for the user that the user should know of."""


def meant(word: str, known: Iterable[str], otherwise: str) -> str:
    """What to do about a word that is none of those known: the nearest of them as a question, whatever the case of its
    letters, one that holds it as a part included; `otherwise` where none is near."""
    lowered = {one.lower(): one for one in known}
    near = difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=0.6)
    holding = [one for one in lowered if len(word) > 2 and word.lower() in one]
    near = near or (holding if len(holding) == 1 else [])
    return f"did you mean {lowered[near[0]]}?" if near else otherwise
