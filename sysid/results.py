"""The run folder: everything a fit found, and everything needed to find it again.

    fit.json               the document that `sysid fit --json` prints
    predictions.parquet    part, log, t, and measured_ and predicted_ torque of each joint
    experiment.yaml        the experiment with every default filled in
    identified.urdf        the links' inertias, viscous and Coulomb friction
    identified.yaml        the experiment on that URDF, with the identified rotors

Each file is written under a temporary name and renamed, so that a run folder never holds half a file.
"""

import io
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path

from . import bounded, state
from .differences import told
from .effect_options import renamed
from .estimate import Fit
from .filters import settled
from .fit_document import document
from .specs import Experiment, is_own
from .vocabulary import of_logs
from .whole_files import folder, sunk, write_together


def write(fit: Fit, out: str | Path) -> dict:
    """Write the run folder; returns the document of fit.json."""
    from .urdf_export import identified_urdf

    path = folder(out)
    # everything that can fail comes before the first file
    found = document(fit, path)
    resolved = fit.experiment.model_copy(update={"preprocess": settled(fit.experiment.preprocess, fit.filters)})
    texts = {
        "experiment.yaml": _yaml(_relocated(resolved, path)).encode(), "identified.urdf": identified_urdf(fit, path),
        "identified.yaml": (_comments(found) + _yaml(_identified(fit, _relocated(resolved, path)))).encode(),
    }  # fmt: skip
    table = _predictions(fit)
    texts["fit.json"] = (json.dumps(found, indent=1, allow_nan=False) + "\n").encode()
    files = {path / "predictions.parquet": sunk(table)}
    with state.locked(path):
        # a diagnosis of another model than the one that will stand here
        untrue = (path / "diagnosis.json",) if _another(path, texts["fit.json"]) else ()
        write_together(files | {path / name: lambda p, c=content: p.write_bytes(c) for name, content in texts.items()}, without=untrue)
    return found


def notices(path: Path) -> list[str]:
    """What the fit in a run folder told; nothing where there is none."""
    try:
        return [str(one) for one in json.loads(bounded.read_text(path / "fit.json"))["notices"]]
    except (OSError, ValueError, KeyError, TypeError):
        return []


def _another(path: Path, text: bytes) -> bool:
    """Whether a run folder holds another fit than the one whose fit.json is about to be written, or none."""
    try:
        old = json.loads((path / "fit.json").read_bytes())
        new = json.loads(text)
        return any(old[key] != new[key] for key in ("parameters", "logs"))
    except (OSError, ValueError, KeyError, TypeError):
        return True


def _predictions(fit: Fit):
    """What makes the table of predictions, part by part; of one in files a part is in memory at a time."""
    import polars as pl

    told = {part: set(prediction.lazy().collect_schema().names()) for part, prediction in fit.predictions.items()}
    masked = any(f"used_{joint}" in names for names in told.values() for joint in fit.joints)

    def tables():
        for part, prediction in fit.predictions.items():
            columns = [pl.lit(part).alias("part"), pl.col("log"), pl.col("t")]
            for joint in fit.joints:
                columns += [pl.col(f"measured_{joint}"), pl.col(f"predicted_{joint}")]
                used = f"used_{joint}"
                columns += [] if not masked else [pl.col(used) if used in told[part] else pl.lit(True).alias(used)]
            for table in prediction.tables():
                yield table.select(columns)

    return tables


def _relocated(experiment: Experiment, run: Path) -> dict:
    """The experiment as plain values, its paths relative to the run folder."""
    from . import datasets

    tree = experiment.model_dump(exclude_none=True)

    def moved(path: str) -> str:
        if "://" in path or datasets.reference(path) is not None:
            return path
        return Path(os.path.relpath((experiment.folder / path).resolve(), run.resolve())).as_posix()

    tree["robot"]["urdf"] = moved(tree["robot"]["urdf"])
    named = {log.name: " + ".join(moved(name) for name in log.names) for log in (*experiment.data.train, *experiment.data.test)}
    for mask in tree["preprocess"]["mask"]:
        mask["log"] = named[mask["log"]]
    levels = [level for group in tree["data"]["groups"].values() for level in group.values()]
    for listed in (tree["data"]["train"], tree["data"]["test"], *levels):
        for log in listed:
            if "file" in log:
                log["file"] = moved(log["file"])
            else:
                log["files"] = [moved(name) for name in log["files"]]
    if tree["prior"]["source"] != "urdf":
        tree["prior"]["source"] = moved(tree["prior"]["source"])
    tree["actuator"] = {joint: spec.model_dump(exclude_unset=True, exclude_none=True) for joint, spec in experiment.actuator.items()}
    if experiment.robot.joints is None:
        tree["robot"].pop("joints", None)
    for key in ("effects", "candidates"):
        tree["model"][key] = [_entry(effect, moved, named) for effect in tree["model"][key]]
    return tree


def _entry(effect: dict, moved: Callable[[str], str], named: Mapping[str, str]) -> dict | str:
    """An entry of `model.effects` as an experiment file writes it, its paths moved, its logs as they are named then."""
    given = {"joints": effect.get("joints"), "per": effect.get("per"), "except": effect.get("spared")}
    own = {**{key: value for key, value in given.items() if value}, **effect["options"]}
    if "formula" in effect["options"]:
        return own
    if of_logs(effect["name"]):
        own = renamed(own, named)
    name = effect["name"]
    if is_own(name):
        file, _, kind = name.rpartition(":")
        name = f"{moved(file)}:{kind}"
    return {name: own} if own else name


def _identified(fit: Fit, tree: dict) -> dict:
    tree["robot"]["urdf"] = "identified.urdf"
    tree["robot"].pop("lock", None)  # locked joints are fixed in the identified URDF
    tree["robot"]["joints"] = list(fit.joints)
    tree["prior"]["source"] = "urdf"
    bodies = {body.joint: pi for body, pi in zip(fit.model.robot.bodies, fit.pi) if body.kind == "rotor"}
    for rotor in tree["robot"]["rotors"]:
        rotor["inertia"] = {"parameters": bodies[rotor["joint"]].tolist()}
    return tree


def _comments(found: dict) -> str:
    """What differs from level to level of groups of logs, as comments of a YAML file."""
    return "".join(f"# {' '.join(line.split())}\n" for line in told(found.get("groups", {})))


def _yaml(tree: dict) -> str:
    from ruamel.yaml import YAML

    stream = io.StringIO()
    writer = YAML()
    writer.width = 200
    writer.dump(tree, stream)
    return stream.getvalue()
