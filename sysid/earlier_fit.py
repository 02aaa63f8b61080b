"""What an earlier fit left in its run folder, read to be a prior or a start."""

import json
from pathlib import Path

import numpy as np

from . import bounded
from .errors import ConfigError
from .inertia import PARAMETERS
from .inertia.consistency import is_consistent
from .model import Model


def read_fit(path: Path, asked: str, allowed: str = "a run folder of `sysid fit`") -> tuple[dict[str, float], tuple[list[str], dict[str, float]]]:
    """Every parameter's value by its name from a run's fit.json, and its robot: its joints, sorted, and the angles of the locked.

    Args:
        asked: the option or key that names the run. allowed: what it may be.

    Raises:
        ConfigError: there is no such run.
    """
    try:
        found = json.loads(bounded.read_text(path))
        values = {entry["name"]: float(entry["value"]) for entry in found["parameters"]}
        return values, (sorted(found["robot"]["joints"]), found["robot"]["locked"])
    except OSError as error:
        raise ConfigError(f"{asked} cannot be read ({error.strerror})", where=str(path), allowed=allowed) from None
    except (ValueError, KeyError, TypeError):
        raise ConfigError(f"{asked} is no run folder", where=str(path), allowed=allowed) from None


def read_inertias(source: Path, model: Model) -> np.ndarray:
    """Bodies (bodies, 10) of a previous run for a model; bodies that it lacks stay at the URDF's prior.

    Args:
        source: a run folder, or its fit.json.

    Raises:
        ConfigError: there is no such run, or none of its bodies is the model's, or one is impossible.
    """
    path = source / "fit.json" if source.is_dir() else source
    values, before = read_fit(path, "prior.source", "urdf, or a run folder of `sysid fit`")
    if before != (sorted(model.robot.joints), model.robot.locked):
        # a locked link is part of the body that carries it: the same name would be another body
        raise ConfigError(
            f"the previous run moved {', '.join(before[0])} and locked {before[1] or 'nothing'}; this experiment does not", where=str(path),
            allowed="the same robot.joints and robot.lock", do="make them equal, or use source: urdf",
        )  # fmt: skip
    out, known = np.array(model.robot.prior), 0
    for b, body in enumerate(model.robot.bodies):
        names = [f"{body.name}.{p}" for p in PARAMETERS]
        if all(name in values for name in names):
            out[b] = [values[name] for name in names]
            known += 1
            if not is_consistent(out[b]):
                raise ConfigError(f"body {body.name!r} of the previous run is impossible", where=str(path), do="fit it with a parameterization that keeps it possible")
    if not known:
        raise ConfigError("the previous run has none of this robot's bodies", where=str(path), do="check prior.source")
    return out
