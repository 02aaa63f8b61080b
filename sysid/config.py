"""YAML -> Experiment: every mistake named with its line.

YAML is loaded without tags: a file that carries one, or aliases that multiply, is refused. The file on disk
stays the truth; nothing here writes it.
"""

from __future__ import annotations

import difflib
import shlex
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from . import bounded, datasets, effect_options, groups
from .config_errors import keys_of, named, own_keys, refused, unknown_key
from .errors import ConfigError
from .formula import parse
from .log_spec import LogSpec
from .mistyped import FEW, standing
from .readers import is_log_folder, listed
from .specs import ENTRY, EffectSpec, Experiment, is_own
from .vocabulary import of_logs, vocabulary
from .yaml_text import parse_yaml, plain

_LARGEST_FILE = 1_000_000  # bytes


def file_of(path: str | Path) -> Path:
    """The experiment file that a path means: itself, or the config.yaml of a folder."""
    path = Path(path)
    return path / "config.yaml" if path.is_dir() else path


_LOGS = (".csv", ".parquet", ".npz", ".mat", ".h5", ".hdf5", ".mcap", ".db3", ".bag", ".gz", ".bz2", ".xz")
_ROBOTS = (".urdf", ".xacro", ".xml", ".mjcf", ".sdf")


def load(path: str | Path) -> Experiment:
    """Read an experiment file, or the config.yaml of a folder.

    Raises:
        ConfigError: with the line, the key, and what is allowed there.
    """
    given, path = Path(path), file_of(path)
    word = "a log" if path.suffix.lower() in _LOGS else "a robot" if path.suffix.lower() in _ROBOTS else ""
    if given.is_dir() and not path.is_file():
        word = "a log" if is_log_folder(given) else "a folder without config.yaml"
    if (given / "experiment.yaml").is_file() and (given / "fit.json").is_file() and word:
        raise ConfigError(
            "a run folder, not an experiment", where=str(given), allowed="a YAML file, or a folder with config.yaml",
            do=f"give the experiment that it is of, or {given / 'experiment.yaml'}, which gives the same fit",
        )  # fmt: skip
    if word:
        raise ConfigError(
            f"{word}, not an experiment", where=str(given), allowed="a YAML file, or a folder with config.yaml",
            do=f"`sysid init {_begins(given)}` writes one from a robot and its logs" + _standing(),
        )  # fmt: skip
    try:
        data = bounded.read_bytes(path)
    except OSError as error:
        do = f"check its name{_standing()}"
        raise ConfigError(f"the experiment file cannot be read ({error.strerror})", where=str(path), do=do) from None
    if len(data) > _LARGEST_FILE:
        raise ConfigError(f"an experiment file of {len(data)} bytes", where=str(path), allowed=f"at most {_LARGEST_FILE}")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigError("not UTF-8 text", where=str(path), do="give an experiment in YAML") from None
    return loads(text, path)


def _begins(given: Path) -> str:
    """What `sysid init` is given in the place of what is no experiment: a folder that holds a robot, else both."""
    holds = given.is_dir() and any(one.suffix.lower() in _ROBOTS for one in given.iterdir())
    return shlex.quote(str(given)) if holds else "URDF LOG..."


def _standing() -> str:
    """The experiments of the folder that we are in, as an error ends."""
    there = standing()
    more = ", ..." if len(there) > FEW else ""
    return f"; experiments here: {', '.join(there[:FEW])}{more}" if there else ""


def loads(text: str, path: Path) -> Experiment:
    """The experiment that a text is, as if it stood in the file `path`. Raises ConfigError, as `load`."""
    tree = parse_yaml(text, where=str(path))
    if tree is None:
        tree = {}
    if not isinstance(tree, dict):
        raise ConfigError("the file holds no mapping", where=str(path), allowed=", ".join(keys_of(Experiment)))
    told = plain(tree)
    if "path" in told:
        raise unknown_key(tree, ("path",), path)
    return experiment(told, path, tree)


def experiment(given: dict, path: Path = Path("experiment.yaml"), tree=None) -> Experiment:
    """The experiment that nested mappings and lists are, with effects in the file's short forms.

    Args:
        tree: the same with line numbers, where a file was read.

    Raises:
        ConfigError: as `load`.
    """
    lines = tree if tree is not None else given
    if isinstance(model := given.get("model"), dict):
        model = dict(model)
        for key in ("effects", "candidates"):
            if isinstance(entries := model.get(key), list):
                model[key] = [_effect(entry, ("model", key, k), lines, path) for k, entry in enumerate(entries)]
        given = {**given, "model": model}
    try:
        return _listed(Experiment.model_validate({**given, "path": path}), lines)
    except ValidationError as error:
        raise named(error, lines, path) from None


def _listed(experiment: Experiment, lines) -> Experiment:
    """The experiment with every pattern and folder of logs spelled out, file by file; a level of a group lists the logs of
    data.train and data.test that are at it."""
    parts = {part: [one for log in getattr(experiment.data, part) for one in _each(log, experiment.folder)] for part in ("train", "test")}
    data = experiment.data.model_copy(update=parts)
    if wrong := groups.mistake(data, experiment.model):
        location, said = wrong
        raise refused(location, said, (), lines, experiment.path)
    names = [log.name for log in (*data.train, *data.test)]
    asked = [(("preprocess", "mask", k, "log"), mask.log) for k, mask in enumerate(experiment.preprocess.mask)]
    for k, spec in ((k, spec) for k, spec in enumerate(experiment.model.effects) if of_logs(spec.name)):
        asked += [(("model", "effects", k), log) for log in effect_options.logs_of(spec.options)]
    for location, log in asked:
        if log not in names:
            near = difflib.get_close_matches(log, names, 3, 0.3) or names[:3]
            raise refused(location, f"no such log in data.train or data.test; near: {', '.join(near)}", log, lines, experiment.path)
    data = groups.resolved(data)
    return experiment.model_copy(update={"data": data})


def _each(log: LogSpec, folder: Path) -> list[LogSpec]:
    if log.files is not None:
        return [log.model_copy(update={"files": [name for entry in log.files for name in _found(entry, folder)]})]
    return [log.model_copy(update={"file": name}) for name in _found(log.file, folder)]


def _found(name: str, folder: Path) -> list[str]:
    return [name] if datasets.reference(name) is not None else listed(name, folder)


def _effect(entry: Any, location: tuple, tree, path: Path) -> Any:
    """An effect's entry with the keys of an `EffectSpec`: what is its own stands among its options."""
    try:
        return entry if isinstance(entry, EffectSpec) else _spelled_out(entry)
    except (ValueError, ConfigError) as error:
        said = str(error).removeprefix("model.effects: ")
        raise refused(location, said, entry, tree, path) from None


def _spelled_out(entry: Any) -> dict:
    if entry == "formula" or (isinstance(entry, dict) and "formula" in entry):
        return _formula(entry)
    if isinstance(entry, str):
        return {"name": _known(entry)}
    if isinstance(entry, dict) and len(entry) == 1:
        ((name, options),) = entry.items()
        if isinstance(name, str) and isinstance(options, dict) and not {"name", "options"} & set(options):
            own = {key: options[key] for key in _own_keys(_known(name), options) if key in options}
            return {"name": name, **{key: given for key, given in options.items() if key not in own}, **({"options": own} if own else {})}
    raise ValueError("must be an effect's name, or {name: {joints: [...]}}; see `sysid effects`")


def _known(name: str) -> str:
    if is_own(name) or name == "formula":
        return name
    if ".py" in name:
        raise ValueError(f"{name!r} names no class; write {name.partition('.py')[0]}.py:Name")
    names = vocabulary()
    if name not in names:
        close = difflib.get_close_matches(name.lower(), names, n=3, cutoff=0.4) or names
        raise ValueError(f"there is no effect {name!r}; allowed: {', '.join(close)}; `sysid effects` lists all")
    return name


def _own_keys(name: str, given) -> list[str]:
    """The keys that an effect has beside those of every entry."""
    # of one's own only the file can tell; it is not run here
    return [key for key in given if key not in ENTRY] if is_own(name) else own_keys(name)


def _formula(value: Any) -> dict:
    """The entry {formula: text, joints: [...], name: ..., and where values inside are held or searched}."""
    text = value.get("formula") if isinstance(value, dict) else None
    if not isinstance(text, str) or "options" in value:
        raise ValueError('must be {formula: "a*sin(3*q)", joints: [...]}')
    parsed = parse(text)
    keys = ["formula", "name", *parsed.inner]
    for key in value:
        if key in parsed.linear:
            raise ValueError(f"{key} is a coefficient of the formula: it is solved for and takes no value; allowed: {', '.join([*keys, *ENTRY])}")
        if key not in (*keys, *ENTRY):
            close = difflib.get_close_matches(str(key), [*keys, *ENTRY], n=3, cutoff=0.4) or [*keys, *ENTRY]
            raise ValueError(f"unknown key {key!r}: the formula has no such value inside; allowed: {', '.join(close)}")
    own = {key: given for key, given in value.items() if key in keys}
    return {**{key: given for key, given in value.items() if key not in own}, "name": "formula", "options": own}
