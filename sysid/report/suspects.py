"""The suspects, step by step, each with what could stand in its place."""

from __future__ import annotations

import math

import numpy as np

from ..statement.words import option
from .section import Section
from .words import chance, known, level, number, percentage, placed


def suspects(document: dict) -> Section:
    """The effects that these logs support, step by step; what is tied in one bracket."""
    found = document["findings"]
    groups = [
        {
            "words": _step_words(step, claim["set"], [found[k] for k in claim["findings"]]),
            "tied": len(claim["set"]) > 1,
            "suspects": [_suspect(k, found[k]) for k in claim["findings"]],
        }
        for step, claim in enumerate(document["claims"], start=1)
    ]
    tied = [k for claim in document["claims"] if len(claim["set"]) > 1 for k in claim["findings"]]
    separate = {found[k]["separate_by"]: None for k in tied if found[k]["separate_by"]}
    refused = [(placed(r["effect"], r["joint"]), r["why"]) for r in document["not_claimed"]]
    values = {"groups": groups if found else [], "separate": list(separate), "refused": refused}
    return Section("Suspects", "suspects", values)


def _step_words(step: int, tied, findings: list[dict]) -> str:
    words = f"step {step}, family-wise p {_p(findings[0]['q_value'])}"
    if len(tied) > 1:
        words += f": these {len(tied)} are tied, the logs cannot tell them apart"
    listed = {(f["effect"], f["joint"]) for f in findings}
    rest = [
        f"{placed(one['effect'], one['joint'])} ({chance(one['probability'])})"
        for one in tied
        if (one["effect"], one["joint"]) not in listed
    ]
    return words + (f". Not fitted here: {', '.join(rest)}" if rest else "")


def _suspect(k: int, f: dict) -> dict:
    values = [
        known(name, p["value"], p["std"], p["unit"])
        for name, p in f["parameters"].items()
        if p["value"] is not None
    ]
    options = [f"{name} = {option(value)}" for name, value in f["options"].items()]
    return {
        "number": k,
        "effect": f["effect"],
        "joint": f["joint"] if f["joint"] != "*" else "whole robot",
        "small": "; ".join(w for w in (", ".join(values), ", ".join(options)) if w),
        "command": f["command"],
        "probability": chance(f["probability"]),
        "bar": _bar(f["misfit_removed"], f["misfit_removed_se"]),
        "removed": percentage(f["misfit_removed"], f["misfit_removed_se"]),
        "before": level(f["rms_test_before"]),
        "after": level(f["rms_test_after"]),
    }


def _p(value) -> str:
    return "–" if value is None or not math.isfinite(value) else number(value, 2)


def _bar(share, se) -> dict:
    """Ends of a bar of the misfit removed and of its standard error, in per cent of the width."""
    share = float(np.clip(share, 0.0, 1.0)) if math.isfinite(share) else 0.0
    whisker = None
    if se is not None and math.isfinite(se):
        ends = (100 * float(np.clip(v, 0.0, 1.0)) for v in (share - se, share + se))
        whisker = [f"{end:.2f}" for end in ends]
    return {"width": f"{100 * share:.2f}", "whisker": whisker}
