"""One case: simulated, discovered by who knows nothing, and the true model fitted."""

from __future__ import annotations

import json
import signal
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from contextlib import contextmanager, nullcontext
from pathlib import Path
from unittest import mock

import numpy as np

from sysid import addition, loop, pipeline
from sysid.errors import SysidError

from . import conditions
from .cases import Case, conditions_of, logged
from .hidden import ABSORBED, OUTSIDE
from .robots import experiment_of

MOST_STEPS = 4
_LIMIT = 1200  # s a case may take


def one(case: dict, keep: str | None = None) -> dict:
    """Simulate a case, discover, and fit the true model; what was found, as JSON can hold it.

    Args:
        keep: a folder to leave the case's experiment and its run in.
    """
    case = Case(**{**case, "hidden": tuple(case["hidden"])})
    found: dict = {
        "key": case.key,
        "robot": case.robot,
        "kind": case.kind,
        "hidden": [dict(h) for h in case.hidden],
        "conditions": conditions_of(case),
    }
    found |= {"rms": {}, "error": None, "seconds": {}}
    stage = ["simulate"]
    clock = time.perf_counter()
    try:
        with (
            warnings.catch_warnings(),
            _limited(_LIMIT),
            nullcontext(keep) if keep else tempfile.TemporaryDirectory() as folder,
        ):
            warnings.simplefilter("ignore")
            _one(case, Path(folder), found, stage)
    except Exception as error:  # noqa: BLE001 - a crash is a failure of the benchmark, not its end
        found["error"] = {
            "stage": stage[0],
            "message": f"{type(error).__name__}: {error}"[:500],
            "trace": traceback.format_exc()[-1500:],
        }
    found["seconds"]["all"] = time.perf_counter() - clock
    return found


@contextmanager
def _limited(seconds: int):
    """Give up after so many seconds."""

    def stop(number, frame):
        raise TimeoutError(f"not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _one(case: Case, folder: Path, found: dict, stage: list[str]) -> None:
    from sysid.simulate import motion, write
    from sysid.statement.document import document

    def timed(name: str, work: Callable):
        stage[0] = name
        start = time.perf_counter()
        out = work()
        found["seconds"][name] = round(
            found["seconds"].get(name, 0.0) + time.perf_counter() - start, 3
        )
        return out

    def rms(fit) -> dict:
        return fit.rms("test")

    folder.mkdir(parents=True, exist_ok=True)
    experiment, machine = timed("simulate", lambda: experiment_of(case.robot, folder))
    options = logged(case)
    options["speed"] = (
        None if case.pace is None else case.pace * float(motion.top_speeds(machine).max())
    )
    options |= case.nuisances or {}
    plain = None
    if case.kind in ("one", "outside"):  # the same logs without it
        plain = timed("simulate", lambda: simulated(machine, [], options)[0])
    simulation, softer = timed("simulate", lambda: simulated(machine, case.hidden, options, plain))
    for entry, told in zip(found["hidden"], simulation.truth["hidden"]):
        entry["size"] = round(entry["size"] * softer, 4)
        entry["values"] = told.get("values", {})
    found["noise"] = simulation.truth["logs"]["test"]["noise_rms"]
    found["softened"] = softer < 1.0
    timed("write", lambda: write(simulation, experiment, folder / "case"))
    blind = pipeline.load(folder / "case")

    # the true model
    if plain is not None:
        timed("write", lambda: write(plain, experiment, folder / "plain"))
        found["rms"]["plain"] = rms(
            timed("true", lambda: pipeline.fit(pipeline.load(folder / "plain")))
        )
    if case.kind == "outside" or any(h["effect"] in ABSORBED for h in case.hidden):
        found["rms"]["true"] = found["rms"]["plain"]
    elif case.hidden:
        told = _grown(blind, found["hidden"])
        found["rms"]["true"] = rms(timed("true", lambda: pipeline.fit(told)))
    if case.kind == "two":
        # without each of them in turn: which of the two does the log show?
        lacking = [
            _grown(blind, [h for h in found["hidden"] if h is not entry])
            for entry in found["hidden"]
        ]
        found["rms"]["without"] = [rms(timed("true", lambda e=e: pipeline.fit(e))) for e in lacking]

    said = []

    def remembered(*arguments, **named):
        said.append(loop_diagnose(*arguments, **named))
        return said[-1]

    loop_diagnose = loop.diagnose
    with mock.patch.object(loop, "diagnose", remembered):
        discovery = timed("discover", lambda: loop.discover(blind, folder / "run", most=MOST_STEPS))
    first = json.loads(json.dumps(document(said[0])))
    found["rms"]["before"], found["rms"]["after"] = rms(discovery.fits[0]), rms(discovery.fits[-1])
    found["floors"] = {joint: entry.get("noise_floor") for joint, entry in first["joints"].items()}
    found["noise_seen"] = timed(
        "noise", lambda: conditions.noise_seen(simulation, discovery.fits[0], folder)
    )
    found["events"] = {name: len(log["events"]) for name, log in simulation.truth["logs"].items()}
    found["verdict"] = [
        {k: v for k, v in entry.items() if k != "depends_on"}
        | {"depends_on": [d["variable"] for d in entry.get("depends_on", [])][:3]}
        for entry in first["verdict"]
    ]
    named = {c["findings"][0]: {"named": c["named"]} for c in first.get("claims", ()) if "named" in c}
    found["findings"] = [
        {"effect": f["effect"], "joint": f["joint"], "tied_with": f.get("tied_with", []), "step": f.get("joins_as_step"), "removed": f.get("misfit_removed"),
         "visible": f.get("visible"), "probability": f.get("probability"), "parameters": {name: p["value"] for name, p in f.get("parameters", {}).items()},
         "deviations": {name: p["std"] for name, p in f.get("parameters", {}).items()}, **named.get(k, {})}
        for k, f in enumerate(first["findings"])
    ]  # fmt: skip
    unseen = {(entry["effect"], entry["joint"]) for entry in first.get("absorbed", [])}
    found["said_not_visible"] = [(h["effect"], h["joint"]) in unseen for h in found["hidden"]]
    found["added"] = [[step["added"], step["joint"]] for step in discovery.steps[1:]]
    found["refused"] = [[entry["effect"], entry["joint"]] for entry in discovery.refused]
    found["last"] = [{"joint": v.joint, "status": v.status} for v in discovery.diagnosis.verdict]


def simulated(machine, hidden, options: dict, plain=None):
    """The simulation, and what its sizes had to be multiplied by until the robot followed its reference.

    Where nothing is hidden its speed is lowered in `options`, for what comes after it as well.
    """
    from sysid.simulate import Hidden, motion, simulate

    for attempt in range(6):
        softer = 0.7**attempt
        hide = []
        for entry in hidden:
            size = softer * entry["size"]
            if entry["effect"] in OUTSIDE:
                hide.append(_custom(machine, entry, size, plain))
            else:
                hide.append(Hidden(entry["effect"], entry["joint"], {"size": size}))
        try:
            return simulate(machine, hide=hide, **options), softer if hide else 1.0
        except SysidError:
            if attempt == 5:
                raise
            if not hide:
                usual = options["speed"] or float(motion.top_speeds(machine).max())
                options["speed"] = 0.8 * usual


def _custom(machine, entry: dict, size: float, plain) -> Callable:
    """The torque (dof,) of an effect that the catalogue does not have; `plain` the simulation without it."""
    truth = plain.truth
    j, i = machine.joints.index(entry["joint"]), machine.joints.index(entry["other"])
    scales = {
        name: truth["scales"][name][entry["joint"]] for name in ("torque", "inertia", "speed")
    } | {"coulomb": truth["friction"][entry["joint"]]["Fc"]}
    angles = plain.train.clean.link_q[:, j]
    scales |= {"low": float(angles.min()), "high": float(angles.max())}
    own, dof = OUTSIDE[entry["effect"]][1](size, j, i, scales), machine.dof

    def torque(*state):
        out = np.zeros(dof)
        out[j] = own(*state)
        return out

    return torque


def _grown(experiment, hidden: list[dict]):
    """The experiment with the hidden effects in its model."""
    for entry in hidden:
        options = {"other": entry["values"]["other"]} if entry["effect"] == "joint_coupling" else {}
        experiment = addition.grown(
            experiment,
            entry["effect"],
            None if entry["joint"] == "*" else [entry["joint"]],
            options,
        )
    return experiment
