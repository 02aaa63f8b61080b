"""The studies from settings to files: tasks, journal, documents, figures."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from .. import fit_document, whole_files
from ..inertia import PARAMETERS as _NAMES
from ..report import figures
from ..specs import Experiment
from . import bodies, prior, restarts
from .journal import Journal, run
from .prepared import prepared

Tell = Callable[[str, float], None]
_BATCH = 10  # bodies a task: long against the cost of handing it to a process


def study_bodies(out: Path, *, count: int, seed: int, jobs: int, reading: bodies.Reading, progress: Tell) -> dict:
    """Section VI; writes study.json, bodies.parquet and the figures into `out`."""
    import polars as pl

    settings = {"study": "bodies", "seed": seed, "reading": asdict(reading), "versions": fit_document.versions()}
    journal = Journal(out / "journal.jsonl", settings)
    tasks = [(str(first), (seed, first, min(_BATCH, count - first), reading)) for first in range(0, count, _BATCH)]
    if count % _BATCH:  # a batch cut short must not be taken for a whole one by a longer study
        tasks[-1] = (f"{tasks[-1][0]}+{count % _BATCH}", tasks[-1][1])
    done = run(journal, tasks, _batch, jobs=jobs, progress=lambda share: progress("bodies", share))
    found = [result for key, _ in tasks for result in done[key]["bodies"]]
    document = {**bodies.summary(found, reading, seed), "sweep": bodies.sweep(seed)}
    rows = [
        {"body": k, **{f"true_{p}": v for p, v in zip(_NAMES, r["truth"])}, **{f"linear_{p}": v for p, v in zip(_NAMES, r["linear"])},
         **{f"{key}_{name}": r["runs"][name][key] for name in bodies.NONLINEAR for key in ("iterations", "converged", "cost")}}
        for k, r in enumerate(found)
    ]  # fmt: skip
    whole_files.write_atomically(out / "bodies.parquet", whole_files.parquet(pl.DataFrame(rows)))
    figures.bodies(document, out)
    figures.sweep(document["sweep"], out)
    whole_files.write_json(out / "study.json", document)
    return document


def _batch(seed: int, first: int, count: int, reading: bodies.Reading) -> dict:
    return {"bodies": [bodies.one(seed, index, reading) for index in range(first, first + count)]}


def study_restarts(experiment: Experiment, out: Path, *, count: int, seed: int, jobs: int, progress: Tell) -> dict:
    """Section VII; writes study.json, restarts.parquet (every iterate) and the figure into `out`."""
    import polars as pl

    shared = restarts.share(experiment)
    settings = {"study": "restarts", "seed": seed, "experiment": experiment.model_dump(mode="json"), "data": _fingerprint(shared), "versions": fit_document.versions()}
    journal = Journal(out / "journal.jsonl", settings)
    tasks = [(str(index), (shared, seed, index)) for index in range(count)]
    done = run(journal, tasks, restarts.one, jobs=jobs, progress=lambda share: progress("restarts", share))
    runs = [done[key] for key, _ in tasks]
    document = restarts.summary(runs, shared, seed)
    table = pl.concat([
        pl.DataFrame({"start": k, "iteration": range(len(r["objective"])), "objective": r["objective"], "rms_train": r["rms_train"], "rms_test": r["rms_test"]})
        for k, r in enumerate(runs)
    ])  # fmt: skip
    whole_files.write_atomically(out / "restarts.parquet", whole_files.parquet(table))
    figures.restarts(runs, out)
    whole_files.write_json(out / "study.json", document)
    return document


def study_prior(experiment: Experiment, out: Path, *, jobs: int, progress: Tell) -> dict:
    """The prior's weight by cross-validation; writes study.json and the curve into `out`."""
    found = prepared(experiment)
    experiment = found.experiment
    weights = sorted({*prior.WEIGHTS, *([experiment.prior.weight] if experiment.prior.weight > 0 else [])})
    settings = {"study": "prior", "errors": "by joint", "experiment": experiment.model_dump(mode="json"), "data": _triangle_hash(found.train), "versions": fit_document.versions()}
    journal = Journal(out / "journal.jsonl", settings)
    tasks = [(repr(weight), (experiment, found.model, found.train, found.prior, found.moving, weight)) for weight in weights]
    done = run(journal, tasks, prior.one, jobs=jobs, progress=lambda share: progress("weights", share))
    document = {**prior.summary([done[key] for key, _ in tasks], weights, experiment.prior.weight), "notices": list(found.notices)}
    figures.prior(document, out)
    whole_files.write_json(out / "study.json", document)
    return document





def _fingerprint(shared: restarts.Shared) -> list[str]:
    return [_triangle_hash(shared.train), _triangle_hash(shared.test)]


def _triangle_hash(data) -> str:
    """What the data say, as a hash: a changed log or filter makes another study."""
    import hashlib

    return hashlib.sha256(data.total().tobytes()).hexdigest()
