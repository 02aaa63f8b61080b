"""A diagnosis that was made and written, used again as long as it is of what stands there now.

    runs/<experiment>/diagnosis.json

says what it was made of. It is read again where all of that is as it was: the experiment, with
every key that it leaves out; the bytes of the URDF, of a previous run that is its prior and of
Python files that it names; the SHA-256 of every log, as the fit read them; the versions of
packages, and the program itself. And it is whole: a file that was edited or cut is none.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from .. import bounded, fit_document, pipeline, results, urdf_files, whole_files
from ..diagnose.diagnosis import Diagnosis, diagnose
from ..errors import SysidError
from ..estimate import Fit
from ..specs import Experiment, is_own
from .document import document

FILE = "diagnosis.json"
_SAME = 1e-6  # of an error: what two machines' fits of one model are apart, and more


def diagnosed(
    experiment: Experiment, run: Path, *, progress: pipeline.Progress | None = None
) -> tuple[Fit, dict]:
    """The fit of an experiment and the document of its diagnosis, both in its run folder: the one
    that stands there where it is of this experiment, else a new one.

    Raises:
        SysidError: bad input.
    """
    if (said := standing(experiment, run)) is not None:
        fit = pipeline.fit(experiment, progress=progress)
        if _of(said, fit):
            results.write(fit, run)
            whole_files.write_json(run / FILE, said)
            return fit, {**said, "run": str(run)}
        made = diagnose(experiment, fit=fit, progress=progress)  # of other logs
    else:
        made = diagnose(experiment, progress=progress)
    return made.fit, written(experiment, made, run)


def standing(experiment: Experiment, run: Path) -> dict | None:
    """The diagnosis in a run folder, or in one of its steps, that is of an experiment as it is; of
    which logs is not asked."""
    # that of the experiment as it is may be the start of a discovery
    there = (_read(experiment, folder) for folder in (run, *sorted(run.glob("steps/*"))))
    return next((one for one in there if one is not None), None)


def found(experiment: Experiment, fit: Fit, run: Path) -> dict | None:
    """The diagnosis in a run folder, where it is of an experiment and of the logs of its fit."""
    said = _read(experiment, run)
    return {**said, "run": str(run)} if said is not None and _of(said, fit) else None


def _of(said: dict, fit: Fit) -> bool:
    """Whether it is of a fit: of its logs, and of its errors, which a filter that was chosen anew
    may have made others."""
    pairs = zip(fit.joints, fit.predictions["test"].told())
    errors = [(said["joints"][joint]["rms"]["test"], now) for joint, now in pairs]
    same = all(
        was == now if None in (was, now) else math.isclose(was, now, rel_tol=_SAME)
        for was, now in errors
    )
    return same and said["logs"] == json.loads(json.dumps(list(fit.logs)))


def written(experiment: Experiment, made: Diagnosis, run: Path) -> dict:
    """Write a fit and its diagnosis into a run folder; returns the diagnosis's document, which
    says what it is of and when it was made."""
    results.write(made.fit, run)
    said = sealed(experiment, made, run)
    whole_files.write_json(run / FILE, said)
    return said


def sealed(experiment: Experiment, made: Diagnosis, run: Path) -> dict:
    """A diagnosis's document, with what it is of and when it was made."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    # as it will be read again
    said = json.loads(json.dumps(document(made, run), allow_nan=False))
    said |= {"made": now, "of": of(experiment)}
    said["seal"] = _seal(said)
    return said


def _read(experiment: Experiment, run: Path) -> dict | None:
    try:
        said = json.loads(bounded.read_text(run / FILE))
        whole = said["seal"] == _seal(said)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return said if whole and said.get("of") == of(experiment) else None


def _seal(said: dict) -> str:
    rest = {key: value for key, value in said.items() if key != "seal"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


def of(experiment: Experiment) -> str:
    """SHA-256 of all that a diagnosis depends on but its logs."""
    keys = experiment.model_dump(mode="json", by_alias=True)
    state = hashlib.sha256(json.dumps(keys, sort_keys=True, default=str).encode())
    for path in files(experiment):
        try:
            state.update(hashlib.sha256(bounded.read_bytes(path)).digest())
        except OSError:
            state.update(b"not there")
    state.update(json.dumps(fit_document.versions(), sort_keys=True).encode())
    state.update(fit_document.program().encode())
    return state.hexdigest()


def files(experiment: Experiment) -> Iterator[Path]:
    """What an experiment names beside logs: the URDF, the run that is its prior, own effects."""
    try:
        yield urdf_files.locate(experiment.robot.urdf, experiment.folder)
    except SysidError:
        pass  # who reads it says so
    if experiment.prior.source != "urdf":
        source = experiment.folder / experiment.prior.source
        yield source / "fit.json" if source.is_dir() else source
    names = [spec.name for spec in (*experiment.model.effects, *experiment.model.candidates)]
    yield from (experiment.folder / n.rpartition(":")[0] for n in names if is_own(n))
