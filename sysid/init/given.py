"""What was typed after `sysid init`: which of it is the robot, which are logs, where it goes."""

from __future__ import annotations

import shlex
from pathlib import Path

from ..errors import LogError, SysidError, meant
from ..readers import is_log_folder, listed

_ROBOTS = (".urdf", ".xacro", ".mjcf", ".xml")


def sorted_out(first: str, rest: list[str], out: Path | None) -> tuple[str, list[str], Path]:
    """The robot, its logs and the experiment's folder.

    A folder alone that holds one robot and its logs is all three; a robot that is named behind a
    log is found there.

    Raises:
        SysidError: no robot or more than one, no log, a file that is not there.
    """
    words = [first, *rest]
    if len(words) == 1 and Path(first).is_dir():
        robot = _robot_in(Path(first))
        _there([first])
        return robot, [first], out or Path(first)
    robots = [word for word in words if _is_robot(word)]
    if not _is_robot(first) and len(robots) == 1:
        words = [robots[0], *(word for word in words if word != robots[0])]
    elif not robots and Path(first).is_dir():
        words = [_robot_in(Path(first)), *words[1:]]
    robot, *logs = words
    if not robots and Path(robot).is_file():
        raise SysidError(
            "a log, and no robot",
            where=robot,
            do=f"name its URDF before the logs: `sysid init robot.urdf {shlex.join(words)}`",
        )
    if not logs and not Path(robot).exists() and "://" not in robot:
        raise SysidError("there is no such file", where=robot, do=_meant(Path(robot)))
    if not logs:
        folder = shlex.quote(str(Path(robot).parent))
        raise SysidError(
            "no logs are named",
            do=f"`sysid init {shlex.quote(robot)} LOG...`, or `sysid init {folder}` where the "
            "robot and its logs stand together",
        )
    _there(logs)
    return robot, logs, out or Path(Path(robot).stem)


def _there(logs: list[str]) -> None:
    for log in logs:
        path = Path(log)
        if path.parent.is_dir() and not path.exists() and path.suffix and not set(log) & set("*?["):
            raise LogError("there is no such log", where=log, do=_meant(path))
        if path.is_dir() and not is_log_folder(path) and listed(str(path), Path()) == [str(path)]:
            raise LogError(
                "a folder without a log",
                where=log,
                do="name the logs: files, or a pattern such as runs/*.csv",
            )


def _meant(path: Path) -> str:
    """What to do about a file that is not there."""
    return meant(path.name, [one.name for one in path.parent.glob("*")], "check its name")


def _is_robot(word: str) -> bool:
    return Path(word).suffix.lower() in _ROBOTS


def _robot_in(folder: Path) -> str:
    found = sorted(one for one in folder.iterdir() if _is_robot(one.name))
    if len(found) == 1:
        return str(found[0])
    names = ", ".join(one.name for one in found)
    several = f"{len(found)} robot files in one folder ({names})"
    raise SysidError(
        several if found else "a folder without a robot",
        where=str(folder),
        allowed="one " + ", ".join(_ROBOTS),
        do="`sysid init URDF LOG...` names the robot and the logs",
    )
