"""What a command line lacks or has too much of, with what to type.

Click says what is wrong, not what to do.
"""

from __future__ import annotations

import shlex
from pathlib import Path

#: {argument: what it is, what stands for it where nothing does}
_ARGUMENTS = {
    "EXPERIMENT": ("which experiment? A folder with config.yaml or a YAML file", "EXPERIMENT"),
    "URDF": ("which robot, and which logs", "robot.urdf logs/*.csv"),
    "EFFECT": ("which effect? `sysid effects` lists all", "EXPERIMENT EFFECT --joint JOINT"),
    "RUN": ("which run? A run folder of `sysid fit`", "runs/robot --to mjcf"),
}
FEW = 6  # experiments that are named


def said(error) -> str:
    """One line on a mistake of the command line, and what to do about it.

    Args:
        error: what click or typer raised.
    """
    words = error.format_message()
    path = getattr(getattr(error, "ctx", None), "command_path", "") or "sysid"
    kind = type(error).__name__
    if kind == "MissingParameter":
        return _missing(words, path, (getattr(error, "ctx", None) and error.ctx.params) or {})
    if "valid number" in words or "valid integer" in words:
        return f"{words.partition(':')[0].removeprefix('Invalid value for ')}: a number is needed; `{path} --help` says of what"
    if kind == "BadParameter" and "valid" in words:
        return f"{words.rstrip('.')}; `{path} --help` says what it takes"
    if kind in ("NoSuchOption", "UsageError", "NoSuchCommand", "BadParameter"):
        if "extra argument" in words and path.endswith(" add"):
            return f"{words}; a joint is named with --joint, an option with --option NAME=VALUE"
        return f"{words.rstrip('.')}; `{path} --help` lists what there is"
    return words


def _missing(words: str, path: str, there: dict) -> str:
    name = words.split("'")[1] if "'" in words else ""
    if name.startswith("-"):
        return f"{words.rstrip('.')}; as in `{path} ... {name} FOLDER`; `{path} --help` says more"
    what, stands = _ARGUMENTS.get(name.rstrip(".").upper(), (words.rstrip("."), name))
    if there.get("experiment"):  # the one that was typed, and no other
        typed = stands.replace("EXPERIMENT", shlex.quote(str(there["experiment"])))
        return f"{what}, as in `{path} {typed}`"
    here = standing() if stands.startswith("EXPERIMENT") else []
    if here:
        typed = stands.replace("EXPERIMENT", shlex.quote(here[0]))
        more = f"; here: {', '.join(here[:FEW])}{', ...' if len(here) > FEW else ''}"
        return f"{what}{more}; as in `{path} {typed}`"
    begin = "" if path.endswith("init") else "; `sysid init URDF LOG...` begins one"
    return f"{what}, as in `{path} {stands}`{begin if stands.startswith('EXPERIMENT') else ''}"


def standing() -> list[str]:
    """The experiments in the folder that we are in: folders with config.yaml, and itself."""
    there = [file.parent.name for file in sorted(Path().glob("*/config.yaml"))]
    return (["."] if Path("config.yaml").is_file() else []) + there
