"""Where a robot's URDF is: a file, a package, an example, a data set."""

import os
from pathlib import Path

from .errors import RobotError

_EXAMPLES, _PACKAGE = "example-robot-data://", "package://"


def locate(reference: str, folder: Path) -> Path:
    """The file that `robot.urdf` names: a path relative to `folder`, package://, example-robot-data://, or a dataset's file.

    A package is looked for where ROS does (ROS_PACKAGE_PATH, AMENT_PREFIX_PATH) and in example-robot-data.
    """
    from . import datasets

    if reference.startswith(_EXAMPLES):
        return example_root() / reference.removeprefix(_EXAMPLES)
    if reference.startswith(_PACKAGE):
        return _in_package(reference.removeprefix(_PACKAGE))
    if (dataset := datasets.reference(reference)) is not None:
        return dataset.locate()
    return (folder / reference).resolve()


def package_folders() -> list[Path]:
    """The folders that packages are looked for in: where ROS does, and example-robot-data's. Raises RobotError."""
    return [*_listed("ROS_PACKAGE_PATH"), *(folder / "share" for folder in _listed("AMENT_PREFIX_PATH")), example_root()]


def _listed(variable: str) -> list[Path]:
    return [Path(folder) for folder in os.environ.get(variable, "").split(os.pathsep) if folder]


def _in_package(reference: str) -> Path:
    package, _, inner = reference.partition("/")
    places, ros = package_folders(), _listed("ROS_PACKAGE_PATH")
    candidates = [folder / reference for folder in places] + [folder / inner for folder in ros if folder.name == package]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise RobotError(
        f"{_PACKAGE}{reference} is in no package folder", where="robot.urdf", allowed=", ".join(map(str, places)),
        do="set ROS_PACKAGE_PATH or AMENT_PREFIX_PATH, or give the path of the file",
    )  # fmt: skip


def example_root() -> Path:
    """The folder of example-robot-data's robots. Raises RobotError: it is not installed."""
    # the package installs its models beside Pinocchio's, under the same cmeel prefix
    from importlib.metadata import PackageNotFoundError, files

    try:
        listed = files("example_robot_data") or []
    except PackageNotFoundError:
        raise RobotError("example-robot-data is not installed", do="pip install example-robot-data") from None
    for file in listed:
        parts = file.parts
        if "robots" in parts and file.suffix == ".urdf":
            return Path(str(file.locate())).parents[len(parts) - parts.index("robots") - 2]
    raise RobotError("example-robot-data holds no robots", do="reinstall example-robot-data")
