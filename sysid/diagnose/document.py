"""A diagnosis as the JSON document that the contract has, and more."""

from __future__ import annotations

import numpy as np

from ..model import ROBOT
from ..results import number, versions
from .diagnosis import Diagnosis, Finding, Verdict
from .ground import Answer
from .structure import Structure


def document(found: Diagnosis, run="") -> dict:
    """The document of `sysid diagnose`. NaN is None."""
    fit = found.fit
    rms = {part: fit.rms(part) for part in ("train", "test")}
    joints = fit.joints
    return {
        "joints": {
            v.joint: {
                "rms": {part: rms[part][v.joint] for part in rms}, "noise_floor": found.floors[v.joint].rms,
                "noise_floor_se": number(found.floors[v.joint].std), "floor_method": found.floors[v.joint].method,
                "floor_detail": found.floors[v.joint].detail, "status": v.status,
            }
            for v in found.verdict
        },
        "findings": [_finding(f) for f in found.findings],
        "not_visible": [_unseen(a, joints) for a in found.not_visible],
        "verdict": [_verdict(v) for v in found.verdict],
        "fails_where": [
            {
                "joint": f.joint, "share_of_error": f.share, "words": f.words(),
                "regions": [
                    {"variable": r.variable, "unit": r.unit, "low": r.low, "high": r.high, "share_of_error": r.error, "share_of_rows": r.rows}
                    for r in f.regions
                ],
                "map": {key: _plain(values) for key, values in f.map.items()}, "time": {key: _plain(values) for key, values in f.time.items()},
                "frequency": {key: _plain(values) for key, values in f.frequency.items()},
            }
            for f in found.failures
        ],
        "domain": {"cutoff_hz": 15.0, "survives_hz": 8.0, "rms_test_before": dict(zip(joints, found.first.rms().tolist())), "rms_test_after": dict(zip(joints, found.last.rms().tolist()))},
        "notices": [*fit.notices, *found.notices], "logs": list(fit.logs), "versions": versions(), "run": str(run),
    }  # fmt: skip


def _finding(f: Finding) -> dict:
    effect = f.answer.candidate.effect
    return {
        "effect": f.effect, "joint": f.joint, "visible": f.answer.visible, "q_value": f.q, "rms_test_before": f.rms_before, "rms_test_after": f.rms_after,
        "misfit_removed": f.removed, "misfit_removed_se": number(f.removed_se),
        "parameters": {name: {"value": number(value), "std": number(std), "unit": unit} for name, (value, std, unit) in f.parameters.items()},
        "tied_with": list(f.tied_with), "separate_by": effect.separate_by, "options": dict(f.answer.candidate.options), "joins_as_step": None if f.step is None else f.step + 1,
    }  # fmt: skip


def _unseen(answer: Answer, joints) -> dict:
    candidate = answer.candidate
    return {
        "effect": candidate.name, "joint": "*" if candidate.joint == ROBOT else joints[candidate.joint], "visible": answer.most_visible,
        "separate_by": candidate.effect.separate_by,
    }  # fmt: skip


def _verdict(v: Verdict) -> dict:
    out: dict = {"joint": v.joint, "status": v.status}
    if v.status == "missing":
        out |= {"effect": v.effect, "tied_with": list(v.tied_with), "also": list(v.also)}
    if v.status == "unknown":
        out |= {"also": list(v.also)}
    if v.structure is not None:
        out |= {"depends_on": dependences(v.structure), "share_left": v.structure.share, "follows": list(v.structure.together), "bursts": v.structure.bursts}
    return out


def dependences(structure: Structure) -> list[dict]:
    """What a residual follows, with the held-out share that each explains, and the curve; two variables that only together
    foretell it come first, then single ones."""
    entry = lambda name, unit, share, away, curve: {  # noqa: E731
        "variable": name, "unit": unit, "share": share, "se": number(share / away if away else float("nan")), "curve": curve,
    }  # fmt: skip
    out = [
        entry(d.variable, d.unit, d.share, d.away, {"at": _plain(d.at), "mean": _plain(d.mean), "se": _plain(d.se)}) for d in structure.depends_on[:6]
    ]
    if len(structure.together) > 1 or (structure.together and not out):
        out.insert(0, entry(" and ".join(structure.together), "", structure.share, structure.away, None))
    if structure.bursts:
        out.append(entry("time, in bursts", "", structure.crowded, 0.0, None))
    return out or [entry("nothing that was tried", "", 0.0, 0.0, None)]


def _plain(values):
    array = np.asarray(values)
    return [[number(v) for v in row] for row in array.tolist()] if array.ndim == 2 else [number(v) for v in array.tolist()]
