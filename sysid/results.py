"""The run folder: everything a fit found, and everything needed to find it again.

    fit.json               the document that `sysid fit --json` prints
    predictions.parquet    part, log, t, and measured_ and predicted_ torque of each joint
    experiment.yaml        the experiment with every default filled in
    identified.urdf        the links' inertias, viscous and Coulomb friction
    identified.yaml        the experiment on that URDF, with the identified rotors

Each file is written under a temporary name and renamed, so that a run folder never holds half a file.
"""

import hashlib
import io
import json
import math
import os
import platform
import stat
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from . import base_parameters, bounded, prior_weight, state
from .differences import per_group, told
from .errors import ConfigError, SysidError
from .estimate import Fit
from .filters import settled, torque_band
from .given_shapes import at_edge
from .inertia import PARAMETERS
from .inertia.consistency import is_consistent
from .model import Model
from .specs import Experiment, is_own
from .unfinished import beside

_PACKAGES = ("sysid", "pin", "numpy", "scipy", "yourdfpy", "lxml", "polars")
_SOURCES = Path(__file__).resolve().parent


def document(fit: Fit, run: str | Path = "") -> dict:
    """The JSON document of a fit, as the contract has it and more. NaN is None."""
    errors = {part: prediction.errors() for part, prediction in fit.predictions.items()}
    # a joint whose torque never changes has no relative error and no R2
    by_joint = lambda part, key: {j: number(v) for j, v in zip(fit.joints, errors[part][key].tolist())}  # noqa: E731
    names, coefficients = fit.model.names, fit.model.coefficients
    certificate = fit.certificate
    held = np.append(np.zeros(10 * fit.model.bodies, dtype=bool), fit.held)
    parameters = [
        {"name": name, "value": value, "unit": unit, "std": number(std), "from_data": share, **({"held": True} if fixed else {})}
        for name, value, unit, std, share, fixed in zip(
            names, fit.x.tolist(), fit.model.units, fit.uncertainty.std.tolist(), fit.uncertainty.from_data.tolist(), held
        )
    ]
    parameters += [
        {"name": value.name, "value": at, "unit": value.unit, "std": number(std), "from_data": float(math.isfinite(std)), **({"held": True} if value.held else {})}
        for value, at, std in zip(fit.model.shape_values, fit.model.shapes, fit.shape_std.tolist())
    ]
    own_groups = {"groups": groups} if (groups := per_group(fit)) else {}
    return {
        "rms": {part: dict(zip(fit.joints, fit.predictions[part].told())) for part in errors},
        "band": torque_band(settled(fit.experiment.preprocess, fit.filters)),
        "relative_error": {part: {**by_joint(part, "relative_error"), "*": number(errors[part]["total"][1])} for part in errors},
        "r2": {part: by_joint(part, "r2") for part in errors},
        "objective": fit.objective,
        "iterations": fit.solution.iterations,
        "newton_iterations": fit.solution.newton_iterations,
        "converged": fit.solution.converged,
        "physically_consistent": fit.physically_consistent,
        "certificate": {
            "globally_optimal": certificate.globally_optimal, "stationarity": number(certificate.stationarity),
            "gap": number(certificate.gap), "at_zero": {coefficients[k].name: slope for k, slope in certificate.at_zero.items()},
            "given": _given(fit),
        },
        "samples": fit.samples,
        "left_out": fit.left_out,
        "parameters": parameters,
        **own_groups,
        # sums of parameters that the logs tell where they cannot tell each
        "base_parameters": [
            {"name": one.words, "value": one.value, "std": number(one.std), "unit": one.unit, "terms": dict(one.terms)} for one in base_parameters.combinations(fit)
        ],
        # what the effects that look at the load took for the bodies; the last step towards `parameters` is not taken again
        "load_bodies": _by_body(fit.model),
        "drives": [{"joint": d.joint, "name": d.name, "value": d.value, "std": number(d.std), "unit": d.unit} for d in fit.drives],
        "rollout": fit.rollout,
        "weights": None if fit.weights is None else dict(zip(fit.joints, fit.weights.tolist())),
        "filter": fit.filters,
        "prior": prior_weight.document(fit.strength),
        "implausible_masses": fit.masses or None,
        "robot": {"joints": list(fit.joints), "locked": fit.model.robot.locked},
        "notices": list(fit.notices),
        "logs": list(fit.logs),
        "events": list(fit.events),
        "versions": versions(),
        "seeds": {},  # nothing in a fit is random
        "seconds": fit.seconds,
        "run": str(run),
    }  # fmt: skip


def _by_body(model: Model) -> dict[str, list[float]] | None:
    if model.reference is None:
        return None
    return {body.name: pi.tolist() for body, pi in zip(model.robot.bodies, model.reference)}


def _given(fit: Fit) -> list[dict]:
    """The shape values at which a certificate proves the rest, with what was done about each."""
    done = {one.name: one for one in fit.searched}
    return [
        {
            "name": value.name, "range": [value.low, value.high], "held": value.held, "at_edge": at_edge(value, at),
            "starts": done[value.name].starts if value.name in done else 0, "profile": done[value.name].profile if value.name in done else 0,
            "lower_on_profile": value.name in done and done[value.name].lower,
        }
        for value, at in zip(fit.model.shape_values, fit.model.shapes)
    ]  # fmt: skip


def number(value: float) -> float | None:
    """A number as JSON can hold it: None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that the numbers depend on."""
    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


@cache
def program() -> str:
    """SHA-256 of this package's own modules: a version number stays while a program is changed."""
    state = hashlib.sha256()
    for path in sorted(_SOURCES.rglob("*.py")):
        state.update(path.relative_to(_SOURCES).as_posix().encode() + path.read_bytes())
    return state.hexdigest()


def folder(out: str | Path) -> Path:
    """Create a run folder, and make sure that it can be written before any work is done.

    Raises:
        SysidError: it cannot.
    """
    path = Path(out)
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = beside(path / "probe")
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise SysidError(f"the run folder cannot be written ({error.strerror})", where=str(path), do="give another with --out") from None
    return path


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it. Raises SysidError where the disk refuses."""
    write_together({path: write})


def write_together(files: dict[Path, Callable[[Path], object]], *, without: tuple[Path, ...] = ()) -> None:
    """Write several files or none: each is filled beside its place, and only when all are whole and on the disk they are
    renamed, in this order. A file keeps the mode of the one in whose place it comes. Files of `without`, which the new ones make
    untrue, are removed before: whoever is killed in between leaves none of them beside new ones.

    Raises:
        SysidError: the disk refuses; everything is as it was.
    """
    temporary = {path: beside(path) for path in files}
    path = None
    try:
        for path, write in files.items():
            write(temporary[path])
            _settle(temporary[path], path)
        for path in without:
            path.unlink(missing_ok=True)
        for path, filled in temporary.items():
            os.replace(filled, path)
    except OSError as error:
        said = error.strerror or str(error).splitlines()[0]
        raise SysidError(f"cannot be written ({said})", where=str(path), do="free the disk or give another --out") from None
    finally:
        for filled in temporary.values():
            with suppress(OSError):
                filled.unlink(missing_ok=True)


def parquet(table) -> Callable[[Path], None]:
    """What writes a table of Polars to a file, for `write_atomically`."""
    import polars as pl

    def write(path: Path) -> None:
        try:
            table.write_parquet(path)
        except pl.exceptions.PolarsError as error:  # a full disk comes as an error of computation
            raise OSError(str(error)) from None

    return write


def sunk(table) -> Callable[[Path], None]:
    """As `parquet`, of a lazy table: one that is in files does not come into memory whole."""
    import polars as pl

    def write(path: Path) -> None:
        try:
            table.sink_parquet(path, compression_level=1)  # of zstd: noise is no smaller at a higher one
        except pl.exceptions.PolarsError as error:
            raise OSError(str(error)) from None

    return write


def _settle(filled: Path, place: Path) -> None:
    """Bring a file to the disk, with the mode and the owner of the one that it replaces."""
    with filled.open("r+b") as file:
        os.fsync(file.fileno())
    try:
        before = place.stat()
    except OSError:
        return
    filled.chmod(stat.S_IMODE(before.st_mode))
    if hasattr(os, "chown") and (before.st_uid, before.st_gid) != (os.getuid(), os.getgid()):
        with suppress(OSError):  # only root may give a file away
            os.chown(filled, before.st_uid, before.st_gid)


def write_json(path: Path, value) -> None:
    """Write a JSON document, strictly (no NaN)."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    write_atomically(path, lambda p: p.write_text(text, encoding="utf-8"))


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


def _another(path: Path, text: bytes) -> bool:
    """Whether a run folder holds another fit than the one whose fit.json is about to be written, or none."""
    try:
        old = json.loads((path / "fit.json").read_bytes())
        new = json.loads(text)
        return any(old[key] != new[key] for key in ("parameters", "logs"))
    except (OSError, ValueError, KeyError, TypeError):
        return True


def _predictions(fit: Fit):
    import polars as pl

    kept = {part: prediction.lazy() for part, prediction in fit.predictions.items()}
    told = {part: set(table.collect_schema().names()) for part, table in kept.items()}
    masked = any(f"used_{joint}" in names for names in told.values() for joint in fit.joints)
    frames = []
    for part, table in kept.items():
        columns = [pl.lit(part).alias("part"), pl.col("log"), pl.col("t")]
        for joint in fit.joints:
            columns += [pl.col(f"measured_{joint}"), pl.col(f"predicted_{joint}")]
            used = f"used_{joint}"
            columns += [] if not masked else [pl.col(used) if used in told[part] else pl.lit(True).alias(used)]
        frames.append(table.select(columns))
    return pl.concat(frames)


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
        tree["model"][key] = [_entry(effect, moved) for effect in tree["model"][key]]
    return tree


def _entry(effect: dict, moved: Callable[[str], str]) -> dict | str:
    """An entry of `model.effects` as an experiment file writes it, its paths moved."""
    given = {"joints": effect.get("joints"), "per": effect.get("per"), "except": effect.get("spared")}
    own = {**{key: value for key, value in given.items() if value}, **effect["options"]}
    if "formula" in effect["options"]:
        return own
    if isinstance(own.get("logs"), list):
        own["logs"] = [moved(name) if isinstance(name, str) else name for name in own["logs"]]
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
