"""What can go wrong, said in one line: what, where, what is allowed, what to do."""


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
