"""What the diagnosis says: the verdict on each joint."""

from __future__ import annotations

from ..addition import LIKELY, apart, designs, likely
from ..estimate import Fit
from ..given_shapes import given_shapes, said_of_shapes
from ..statement import text, where
from ..statement.words import either, near, option, otherwise, percent, refused, untold
from .left import left_words
from .section import Section
from .words import (
    SPACE,
    band,
    chance,
    known,
    level,
    placed,
    plus_minus,
    raised,
    units,
)

_MARK = {"complete": "✓", "missing": "+", "explained": "→", "unknown": "?", "unresolved": "…"}
_SAID = {
    "complete": "complete",
    "missing": "missing physics",
    "explained": "explained elsewhere",
    "unknown": "unknown structure",
    "unresolved": "unresolved",
}
_LEAD = {
    "missing": "physics is missing",
    "unknown": "structure that no known effect explains is left",
    "unresolved": "error is left that these logs do not explain",
    "explained": "what is missing on another joint explains the error",
}


def verdict(fit: Fit, document: dict) -> Section:
    """What the diagnosis says of each joint, in words."""
    proven = "proven" if fit.certificate.globally_optimal else "not proven"
    given = given_shapes(fit)
    proof = f"The fit is {proven} to be the global optimum{f', {given}' if given else ''}."
    if said := said_of_shapes(fit):
        proof += f" {'. '.join(said)}."
    values = {
        "lead": _lead(document),
        "cards": [_card(found, fit, document) for found in document["verdict"]],
        "converged": fit.solution.converged,
        "proof": proof,
        "consistent": fit.physically_consistent,
        "notices": document["notices"],
        "made": document.get("made", ""),
        "next_log": document.get("next_log"),
        "needing": where.needing(document) if document.get("next_log") else "",
        "another": text.ANOTHER,
        "own_law": _first(text.OWN).replace("`", ""),
        "begin": text.BEGIN,
        "trying": text.TRIED,
        "band": band(fit),
    }
    return Section("Verdict", "verdict", values)


def _lead(document: dict) -> str:
    statuses = [v["status"] for v in document["verdict"]]
    total, count = len(statuses), {status: statuses.count(status) for status in _MARK}
    if count["complete"] == total:
        where = "the joint" if total == 1 else f"all {total} joints"
        return f"No further effect is supported by these logs, on {where}."
    on = lambda n: f" on {n} of {total} joints" if total > 1 else ""  # noqa: E731
    parts = [words + on(count[status]) for status, words in _LEAD.items() if count[status]]
    if count["complete"]:
        parts.append(f"{count['complete']} {'is' if count['complete'] == 1 else 'are'} complete")
    lead = "; ".join(parts) + "."
    return lead[0].upper() + lead[1:]


def _card(found: dict, fit: Fit, document: dict) -> dict:
    """One joint: its status, the parts of the sentences on it, its figures."""
    joint, status = found["joint"], found["status"]
    entry = document["joints"][joint]
    floor, error, force = entry["noise_floor"], entry["rms"]["test"], raised(units(fit)[joint][0])
    ratio = f" ({error / floor:#.3g} times the floor)" if floor and error is not None else ""
    stands = "not known"
    if floor is not None:
        stands = f"{plus_minus(floor, entry['noise_floor_se'])}{SPACE}{force}{ratio}"
    commands = found.get("commands", [])
    findings, claims = document["findings"], document["claims"]
    told = [(findings[c["findings"][0]], c["set"]) for c in claims]
    heads = [one for command in commands for one in told if one[0]["command"] == command]
    names = [either(head, document, joint) for head, _ in heads]
    if status == "explained":
        names = [either(c, document) for c in found["by"]]
    fall = ""
    last = document["claims"][-1]["rms_test_after"] if claims else {}
    falls = status == "unresolved" and last and otherwise(joint, document["joints"], last)
    if status in ("explained", "missing") or heads or falls:
        fall = _fall(found, fit, document)
    several = len(claims) > 1
    says = found.get("says") or ""
    return {
        "joint": joint,
        "status": status,
        "mark": _MARK[status],
        "said": _SAID[status],
        "names": names,
        "effect": found.get("effect", ""),
        "claims": [_claim(*one, joint, several) for one in heads],
        "fall": fall,
        "left": left_words(found, fit),
        "near": near(found, document) + refused(joint, document) if status == "complete" else "",
        "tried": found.get("may_be"),
        "law": found.get("law"),
        "blind": joint in where.blind(document),
        "says": _first(says),
        "commands": commands,
        "error": f"{level(error)}{SPACE}{force}",
        "floor": stands,
    }


def _first(words: str) -> str:
    """Words that begin a sentence."""
    return words[:1].upper() + words[1:]


def _fall(found: dict, fit: Fit, document: dict) -> str:
    """What the held-out error does with all that is claimed, and the share of the misfit."""
    joint = found["joint"]
    entry, claims = document["joints"][joint], document["claims"]
    last = claims[-1]["rms_test_after"] if claims else fit.rms("test")
    force = raised(units(fit)[joint][0])
    it = _first(text.together(found, document))
    error, then = level(entry["rms"]["test"]), level(last[joint])
    fall = f"the held-out error goes from {error} to {then}{SPACE}{force}"
    if entry["noise_floor"] is None or found.get("explained") is None:
        return f"{it} {fall}"
    share = _share(found["explained"])
    return f"{it} {share} of the misfit is explained, {fall}"


def _share(value: float) -> str:
    """A share of the misfit, as the terminal says it."""
    return percent(max(value, 0.0)).replace(" ", SPACE)


def _claim(head: dict, tied: list[dict], joint: str, several: bool) -> dict:
    """One effect that is named: what it takes and is, its parameters, what is tied with it."""
    values = [
        known(name, p["value"], p["std"], p["unit"])
        for name, p in head["parameters"].items()
        if p["value"] is not None
    ]
    effect = head["effect"], head["joint"]
    takes = ""
    if several and head["misfit_known"]:
        where = "" if head["joint"] == joint else " on all joints"
        takes = f"It takes {_share(head['misfit_removed'])} of what was left{where}"
    summary = head["summary"].replace("`", "").split(". ")[0].rstrip(".")
    every = [(one["effect"], one["joint"], one["probability"]) for one in tied]
    others = [one for one in every if one[:2] != effect]
    told = likely(others)
    return {
        "effect": head["effect"],
        "figures": ": ".join(part for part in (takes, ", ".join(values)) if part),
        "options": [
            f"{n} {option(v)}: {head['options_say'][n]}" for n, v in head["options"].items()
        ],
        "untold": "" if head["size_told"] else _first(untold(head["parameters"])),
        "summary": summary,
        "from": _first(text.untold_from(head["probability"])).replace(" %", f"{SPACE}%"),
        "others": [f"{placed(e, j, head['joint'])}{SPACE}({chance(p)})" for e, j, p in told],
        "few": [placed(e, j, head["joint"]) for e, j, p in others if p < LIKELY],
        "separate_by": head["separate_by"],
        "design": designs(head["command"], effect, told) if told else "",
        "separate": ",".join(apart(effect, told)) if told else "",
    }
