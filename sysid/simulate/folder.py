"""A simulation as a folder: config.yaml, robot.urdf, train.csv (or train_1.csv, train_2.csv, ...), test.csv, truth.json.

config.yaml is what one would write who knows nothing of what is hidden. Everything is written under another name and
renamed when it is whole.
"""

import hashlib
import io
import json
import os
import re
import shutil
from pathlib import Path

import numpy as np

from .. import bounded, config
from ..errors import SysidError
from ..robot import Robot
from ..robot import load as robot_of
from ..spec_values import AUTO
from ..specs import Experiment, PreprocessSpec
from ..unfinished import beside
from ..warned import noticed
from .simulated import SimulatedLog, Simulation

_LOG = re.compile(r"(train|train_[0-9]+|test)\.csv")


def load(path: str | Path) -> tuple[Experiment, Robot, tuple[str, ...]]:
    """An experiment, its robot, and what was decided for the user on the way. Its logs need not be there. Raises SysidError."""
    experiment = config.load(path)
    with noticed() as notices:
        machine = robot_of(experiment.robot, experiment.folder)
    return experiment, machine, tuple(notices)


def prepare(out: str | Path, *, force: bool = False) -> Path:
    """Make sure that a simulation can be written to a folder, before any work is done.

    Args:
        force: also over a simulation whose files were changed since.

    Raises:
        SysidError: it is a file, cannot be written, holds something that is no simulation, or one that was worked in.
    """
    path = Path(out)
    if path.exists() and not path.is_dir():
        raise SysidError("there is a file of that name", where=str(path), allowed="a new folder", do="give another with --out")
    if path.is_dir() and any(path.iterdir()) and not _is_simulation(path):
        raise SysidError("the folder holds something that is no simulation", where=str(path), allowed="a new or empty folder, or one that sysid simulate wrote", do="give another with --out")
    if not force and path.is_dir() and (changed := _worked_in(path)):
        raise SysidError(
            f"{' and '.join(changed)} of this simulation changed since it was written, and would be lost", where=str(path),
            allowed="a new or empty folder", do="give another with --out, or --force to write over them",
        )  # fmt: skip
    try:
        path.absolute().parent.mkdir(parents=True, exist_ok=True)
        probe = beside(path.absolute())
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise SysidError(f"the folder cannot be written ({error.strerror})", where=str(path), do="give another with --out") from None
    return path


def _is_simulation(path: Path) -> bool:
    try:
        return json.loads(bounded.read_text(path / "truth.json"))["simulated_by"] == "sysid simulate"
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _worked_in(path: Path) -> list[str]:
    """Names of a simulation's files that are not as they were written; where that is not known, of the one that people edit."""
    try:
        wrote = json.loads(bounded.read_text(path / "truth.json")).get("files", {"config.yaml": None})
    except (OSError, ValueError):
        return []  # no simulation was there
    there = [name for name in wrote if (path / name).is_file()]
    return [name for name in there if _sha256((path / name).read_bytes()) != wrote[name]]


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def write(simulation: Simulation, experiment: Experiment, out: str | Path, *, force: bool = False) -> dict:
    """Write the folder of a simulation of an experiment's robot; returns what its truth.json says.

    Args:
        force: as of `prepare`.

    Raises:
        SysidError: see `prepare`; or the disk refuses.
    """
    path = prepare(out, force=force)
    robot = simulation.robot
    logs = {f"{name}.csv": log for name, log in simulation.logs.items()}
    texts = {
        "config.yaml": _config(experiment, robot, list(logs)), "robot.urdf": "<?xml version=\"1.0\"?>\n" + robot.source.text + "\n",
        **{name: _csv(log, robot) for name, log in logs.items()},
    }  # fmt: skip
    truth = {**simulation.truth, "files": {name: _sha256(text.encode("utf-8")) for name, text in texts.items()}}
    texts["truth.json"] = json.dumps(truth, indent=1, allow_nan=False) + "\n"
    temporary = beside(path.absolute())
    try:
        temporary.mkdir()
        for name, text in texts.items():
            (temporary / name).write_bytes(text.encode("utf-8"))
        if path.is_dir() and any(path.iterdir()):
            for name in texts:
                os.replace(temporary / name, path / name)
            for old in path.iterdir():  # logs of the simulation that was there before
                if _LOG.fullmatch(old.name) and old.name not in texts:
                    old.unlink()
        else:
            if path.is_dir():
                path.rmdir()
            os.replace(temporary, path)
    except OSError as error:
        raise SysidError(f"cannot be written ({error.strerror})", where=str(path), do="free the disk or give another --out") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return truth


def _csv(log: SimulatedLog, robot: Robot) -> str:
    import polars as pl

    columns = {"t": log.t, **{f"q_{joint}": np.round(log.q[:, j], 12) for j, joint in enumerate(robot.joints)}}
    columns |= {f"tau_{joint}": np.round(log.tau[:, j], 12) for j, joint in enumerate(robot.joints)}
    return pl.DataFrame(columns).write_csv()


def _config(experiment: Experiment, robot: Robot, logs: list[str]) -> str:
    """The experiment as one would write it who knows nothing of what is hidden."""
    from ruamel.yaml import YAML

    rotors = [rotor.joint for rotor in experiment.robot.rotors]
    bare = [joint for joint in robot.joints if joint not in rotors]
    effects: list = ["viscous", "coulomb"]
    if bare:
        effects.append({"armature": {"joints": bare}} if rotors else "armature")
    spec = experiment.robot.model_dump(exclude_none=True, exclude_defaults=True)
    preprocess = experiment.preprocess if experiment.preprocess.filter != "none" else PreprocessSpec()
    # what a source keeps for the sake of what it reproduces: a simulation reproduces nothing
    usual = {"standstill": "auto", "events": "mask"}
    preprocess = preprocess.model_copy(update={k: v for k, v in usual.items() if getattr(preprocess, k) == "keep"})
    tree = {
        "robot": {**spec, "urdf": "robot.urdf", "joints": list(robot.joints), "gravity": list(experiment.robot.gravity)},
        "data": {"train": [name for name in logs if name != "test.csv"], "test": ["test.csv"]},
        # a window that is the usual one is not said: where angles are noisy for it, a fit chooses
        "preprocess": preprocess.model_dump(exclude_none=True, exclude={"window"} if preprocess.window == PreprocessSpec().window else None),
        "model": {"inertia": experiment.model.inertia, "effects": effects},
        "prior": {**experiment.prior.model_dump(exclude_none=True), "weight": AUTO, "source": "urdf"},
        "solver": experiment.solver.model_dump(exclude_none=True, exclude={"weighting"}),
    }
    stream = io.StringIO()
    writer = YAML()
    writer.width = 200
    writer.default_flow_style = None
    writer.dump(tree, stream)
    return stream.getvalue()
