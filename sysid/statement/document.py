"""A diagnosis as the JSON document that the contract has, and more."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..addition import another_log, command, spelled
from ..diagnose.diagnosis import Diagnosis
from ..diagnose.verdict import Verdict
from ..filters import settled, torque_band
from ..fit_document import number, versions
from ..flexible import HUM, TOLD, Unknown
from ..model_parameters import ROBOT
from ..plausible import outdated
from ..units import of_joint
from . import where
from .alike import changed_alike, read_alike
from .claims import chances, claims, confidence_set, finding, ties
from .laws import BODIES, TOGETHER, of_bodies, to_begin_with


def document(found: Diagnosis, run="", *, laws: bool = True) -> dict:
    """The document of `sysid diagnose`. NaN is None.

    laws: whether laws to begin with are fitted, and told where they are borne out.

    next_log: the command that designs the log to take next, where these do not say why an error
    stands, and neither an effect that may be it nor how the fit weighs its joints does.
    """
    out = _document(found, run, laws)
    blind = where.blind(out)
    return {**out, "next_log": another_log(found.fit.experiment.path) if blind else None}


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
            _with_law(_verdict(v, fit.experiment.path, joints), found, laws) for v in found.verdict
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


def _verdict(v: Verdict, path="config.yaml", joints=()) -> dict:
    out: dict = {"joint": v.joint, "status": v.status}
    # where all error may be noise, what falls is all that is more
    share = number(min(v.explained, 1.0)) if np.isfinite(v.explained) else None
    share = 1.0 if v.status in ("missing", "explained") and share is None else share
    if v.status in ("missing", "unknown") and v.claims:
        first = v.claims[0]
        named = {
            "effect": first.head.effect,
            "tied_with": ties(first, first.head),
            "command": first.head.command,
            "set": chances(confidence_set(first)),
            "explained": share,
        }
        also = [c.head.effect for c in v.claims[1:]]
        part = {"also": [first.head.effect, *also], "explained": named["explained"]}
        out |= {**named, "also": also} if v.status == "missing" else part
        out["commands"] = [c.head.command for c in v.claims]
    elif v.status == "unknown":
        out["also"] = []
    if v.status == "explained":
        by = [{"effect": c.head.effect, "joint": c.head.joint} for c in v.claims]
        out |= {"by": by, "explained": share}
    if v.says or v.carries:
        out["says"] = "; ".join(words for words in (v.says, v.carries) if words)
    if v.may is not None:
        where = v.may.where(joints) if joints else v.joint
        name, own, options = spelled(v.may, where)
        adds = command(Path(path), name, own, options)
        told = {"effect": name, "joint": where, "options": options}
        out["may_be"] = {**told, "command": adds}
    if v.even:
        out["weighting"] = "noise"
    if v.reason is not None:
        out["needs_no_log"] = True
    if v.left is not None:
        out |= {"depends_on": dependences(v.left), "share_left": v.left.share}
    elif v.status == "unknown":
        out["depends_on"] = []
    return out


def dependences(found: Unknown) -> list[dict]:
    """What a residual follows: variables with the share of its square that functions of each alone
    predict, largest first; where none does, all of them together."""
    alone = sorted((share, name) for name, share in found.shares.items() if share > TOLD)[::-1]
    out = [
        {"variable": name, **({"with": other} if other else {}), "share": float(share)}
        | ({"hertz": found.hertz} if name == HUM else {})
        for share, words in alone[:4]
        for name, _, other in [words.partition(" and ")]
    ]
    return out or [{"variable": TOGETHER, "share": found.share}]
