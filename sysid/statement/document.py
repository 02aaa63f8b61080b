"""A diagnosis as the JSON document that the contract has, and more."""

from __future__ import annotations

import shlex

from ..addition import another_log, typed
from ..datasets import reference
from ..diagnose.diagnosis import Diagnosis
from ..filters import settled, torque_band
from ..fit_document import number, versions
from ..model_parameters import ROBOT
from ..plausible import outdated
from ..specs import Experiment
from ..units import of_joint
from . import where
from .alike import changed_alike, read_alike
from .claims import claims, finding
from .laws import BODIES, of_bodies, to_begin_with
from .verdicts import verdict


def document(found: Diagnosis, run="", *, laws: bool = True) -> dict:
    """The document of `sysid diagnose`. NaN is None.

    laws: whether laws to begin with are fitted, and told where they are borne out.

    next_log: the command that designs the log to take next, where these do not say why an error
    stands, and neither an effect that may be it nor how the fit weighs its joints does.
    asks_tests: the command that asks what is different in the test logs, where a joint's model does
    not carry over to them.
    """
    out, spec = _document(found, run, laws), found.fit.experiment
    next_log = another_log(spec.path) if where.blind(out) else None
    asks = _of_tests(spec, run) if run and where.apart(out) else None
    return {**out, "next_log": next_log, "asks_tests": asks}


def _of_tests(spec: Experiment, run) -> str | None:
    """What is typed to ask what is different in an experiment's test logs, with a run's model held;
    None where these are no plain files."""
    logs = spec.data.test
    plain = [log.model_fields_set <= {"file"} and not reference(log.file) for log in logs]
    if spec.data.groups or not all(plain):
        return None
    each = [word for log in logs for word in ("--log", str(spec.path.parent / log.file))]
    return shlex.join(["sysid", "diagnose", str(typed(spec.path)), "--model", str(run), *each])


def _document(found: Diagnosis, run, laws: bool) -> dict:
    fit, joints = found.fit, found.fit.joints
    rms = {part: dict(zip(joints, fit.predictions[part].told())) for part in ("train", "test")}
    gone = outdated(fit, found.claims[-1].after) if found.claims else ()
    return {
        "band": torque_band(settled(fit.experiment.preprocess, fit.filters)),
        "joints": {
            v.joint: {
                "rms": {part: rms[part][v.joint] for part in rms},
                **_floor(found.floors[v.joint]),
                "status": v.status,
            }
            for v in found.verdict
        },
        "findings": [finding(f, claim, found) for claim in found.claims for f in claim.findings],
        "claims": list(claims(found)),
        "verdict": [
            _with_law(verdict(v, fit.experiment.path, joints), found, laws) for v in found.verdict
        ],
        "detectable": [
            {
                "effect": d.candidate.name,
                "joint": d.candidate.where(joints),
                "parameter": d.parameter,
                "size": d.size,
                "unit": d.unit,
                "power": d.power,
                "at": dict(d.at),
                "at_units": _units(d, fit),
                "options": dict(d.candidate.options),
            }
            for d in found.detectable
            if d.size is not None
        ],
        "absorbed": [
            {
                "effect": d.candidate.name,
                "joint": d.candidate.where(joints),
                "separate_by": d.candidate.effect.separate_by,
            }
            for d in found.detectable
            if d.size is None
        ],
        "events": [
            {
                "kind": e.kind,
                "log": e.log,
                "start": float(e.start),
                "stop": float(e.stop),
                "joints": list(e.joints),
            }
            for e in found.events
        ],
        "fails_where": [where.entry(f) for f in found.failures],
        "low_pass": {
            "cutoff_hz": found.view.cutoff,
            "rms_test_before": dict(zip(joints, found.first.rms().tolist())),
            "rms_test_after": dict(zip(joints, found.last.rms().tolist())),
        },
        "next_log": None,
        "asks_tests": None,
        "too_narrow": fit.filters.get("too_narrow"),
        "unused": list(fit.unused),
        "not_claimed": [
            {"effect": r.effect, "joint": r.joint, "why": r.why} for r in found.refused
        ],
        "notices": [
            *(n for n in fit.notices if n not in gone),
            *found.notices,
            *read_alike(heads := [claim.head for claim in found.claims]),
            *changed_alike(heads),
        ],
        "logs": list(fit.logs),
        "versions": versions(),
        "run": str(run),
    }


def _units(d, fit) -> dict[str, str]:
    """Of the shape values at which an effect shows best."""
    slides = d.candidate.joint != ROBOT and bool(fit.model.robot.prismatic[d.candidate.joint])
    shapes = d.candidate.effect.shapes()
    return {s.name: of_joint(s.unit, prismatic=slides) for s in shapes if s.name in d.at}


def _floor(floor) -> dict:
    return {
        "noise_floor": floor.rms,
        "noise_floor_se": None if floor.rms is None else number(floor.std),
        "floor_method": floor.method,
        "floor_detail": floor.detail,
        "noise_floor_within": [floor.low, floor.high],
        **({} if floor.train is None else {"noise_floor_train": floor.train}),
    }


def _with_law(entry: dict, found: Diagnosis, laws: bool) -> dict:
    """What is `unknown` with a law of one's own to begin with, where one variable stands out; and
    that it is the bodies', where it is."""
    if entry["status"] == "unknown" and of_bodies(entry):
        return entry | {"says": "; ".join([*filter(None, [entry.get("says")]), BODIES])}
    if entry["status"] != "unknown" or not laws:
        return entry
    fit, joints = found.fit, found.fit.joints
    there = {(e.name, joints[j]) for e, own in fit.model.terms for j in own if j != ROBOT}
    known = to_begin_with(entry, fit.experiment.path, there, found.falls_with)
    return entry | ({"law": known} if known else {})
