"""What the diagnosis says: the verdict on each joint."""

from __future__ import annotations

import math

from ..diagnose.diagnosis import Diagnosis
from ..effect import describe
from ..estimate import Fit, given_shapes, said_of_shapes
from ..statement.text import designs, percent
from .words import (
    SPACE,
    chance,
    level,
    percentage,
    plus_minus,
    quantity,
    raised,
    text,
    unit_of,
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


def verdict(fit: Fit, diagnosis: Diagnosis, document: dict) -> tuple[str, str, list]:
    """What the diagnosis says of each joint, in words."""
    cards = "".join(_card(found, fit, diagnosis, document) for found in document["verdict"])
    proven = (
        "proven to be the global optimum"
        if fit.certificate.globally_optimal
        else "not proven to be the global optimum"
    )
    given = given_shapes(fit)
    proof = f"The fit is {proven}{f', {given}' if given else ''}."
    if said := said_of_shapes(fit):
        proof += f" {text('. '.join(said))}."
    if not fit.solution.converged:
        proof = "<strong>The fit did not converge: nothing below is to be trusted.</strong>"
    bodies = (
        "Every body is physically possible."
        if fit.physically_consistent
        else "<strong>Not every body is physically possible.</strong>"
    )
    body = f'<p class="lead">{_lead(document)}</p><div class="cards">{cards}</div>'
    body += f"<p>{proof} {bodies}</p>"
    if notes := "".join(f"<li>{text(n)}</li>" for n in document["notices"]):
        count = len(document["notices"])
        said = f"{count} note{'s' if count > 1 else ''} on the data and the fit"
        body += f'<details class="notes"><summary>{said}</summary><ul>{notes}</ul></details>'
    return "Verdict", body, []


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


def _card(found: dict, fit: Fit, diagnosis: Diagnosis, document: dict) -> str:
    joint, status = found["joint"], found["status"]
    entry = document["joints"][joint]
    floor, error, force = entry["noise_floor"], entry["rms"]["test"], raised(units(fit)[joint][0])
    ratio = f" ({error / floor:#.3g} times the floor)" if floor and error is not None else ""
    known = (
        "not known"
        if floor is None
        else f"{plus_minus(floor, entry['noise_floor_se'])}{SPACE}{force}{ratio}"
    )
    commands = "\n".join(text(command) for command in found.get("commands", []))
    typed = f'<div class="by-hand"><pre>{commands}</pre></div>' if commands else ""
    return (
        f'<article class="card {status}"><h3>'
        f'<span class="mark" aria-hidden="true">{_MARK[status]}</span>{text(joint)} '
        f'<span class="status">{_SAID[status]}</span></h3>'
        f"<p>{verdict_words(found, diagnosis, document)}</p>{typed}"
        f'<p class="numbers">held-out error {level(error)}{SPACE}{force}, noise floor {known}</p>'
        "</article>"
    )


def verdict_words(found: dict, diagnosis: Diagnosis, document: dict) -> str:
    """One joint's verdict as sentences of HTML."""
    words, says = _verdict_words(found, diagnosis, document), found.get("says")
    if not says or found["status"] == "unresolved":
        return words
    return f"{words} {text(says[0].upper() + says[1:])}."


def _verdict_words(found: dict, diagnosis: Diagnosis, document: dict) -> str:
    joint, status = found["joint"], found["status"]
    left = left_words(found, diagnosis.fit)
    heads = [
        c
        for command in found.get("commands", [])
        for c in diagnosis.claims
        if c.head.command == command
    ]
    named = " and ".join(
        f"<strong>{placed(c.head.effect, c.head.joint, joint)}</strong>" for c in heads
    )
    if status == "complete":
        return "No further effect is supported by these logs."
    if status == "explained":
        by = " and ".join(
            f"<strong>{placed(c['effect'], c['joint'])}</strong>" for c in found["by"]
        )
        return f"Its error comes from elsewhere: {by}. {_fall(found, diagnosis, document)}."
    if status == "unresolved":
        says = text(found["says"])
        fall = f" {_fall(found, diagnosis, document)}." if diagnosis.claims else ""
        return f"{says[0].upper()}{says[1:]}.{fall}" + (f" {left}." if left else "")
    if status == "unknown":
        also = f" Part of it looks like {named}." if named else ""
        return f"Structure is left that no effect of the catalogue explains. {left}.{also}"
    out = f"{named or text(found['effect'])} {'are' if len(heads) > 1 else 'is'} missing."
    out += f" {_fall(found, diagnosis, document)}."
    for claim in heads:
        word = f"<strong>{text(claim.head.effect)}</strong>: " if len(heads) > 1 else ""
        out += f" {word}{_claim(claim, joint, len(diagnosis.claims) > 1, document)}"
    return out + (f" {left}." if left else "")


def _fall(found: dict, diagnosis: Diagnosis, document: dict) -> str:
    """What the held-out error does with all that is claimed, and the share of the misfit."""
    joint = found["joint"]
    entry, last = (
        document["joints"][joint],
        diagnosis.claims[-1].after if diagnosis.claims else diagnosis.fit,
    )
    force = raised(units(diagnosis.fit)[joint][0])
    it = "With it" if len(diagnosis.claims) == 1 else "With all that is named"
    error, then = level(entry["rms"]["test"]), level(last.rms("test")[joint])
    fall = f"the held-out error goes from {error} to {then}{SPACE}{force}"
    if entry["noise_floor"] is None or found.get("explained") is None:
        return f"{it} {fall}"
    share = _share(found["explained"])
    return f"{it} {share} of the misfit is explained, {fall}"


def _share(value: float) -> str:
    """A share of the misfit, as the terminal says it."""
    return percent(max(value, 0.0)).replace(" ", SPACE)


def _claim(claim, joint: str, several: bool, document: dict) -> str:
    """One effect that is named: what it takes and is, its parameters, what is tied with it."""
    head = claim.head
    known = [
        f"{text(name.split('.')[-1])}{SPACE}={SPACE}{plus_minus(value, std)}{unit_of(unit)}"
        for name, (value, std, unit) in head.parameters.items()
        if math.isfinite(value)
    ]
    out, takes = "", ""
    if several:
        found = next(f for f in document["findings"] if f["command"] == head.command)
        where = "" if head.joint == joint else " on all joints"
        takes = f"It takes {_share(found['misfit_removed'])} of what was left{where}"
    if takes or known:
        out = ": ".join(part for part in (takes, ", ".join(known)) if part) + ". "
    summary = describe(head.candidate.effect)["summary"].replace("`", "").split(". ")[0].rstrip(".")
    out += f'<span class="quiet">{text(summary)}.</span>'
    others = [(e, j, p) for e, j, p in claim.set if (e, j) != (head.effect, head.joint)]
    if others:
        words = " or ".join(f"{placed(e, j, head.joint)}{SPACE}({chance(p)})" for e, j, p in others)
        out += f" These logs cannot tell it ({chance(head.probability)}) from {words}."
        typed = designs(head.command, (head.effect, head.joint), others)
        out += f" To separate them: {text(head.candidate.effect.separate_by)}; or the motion of "
        out += f'<span class="by-hand"><code>{text(typed)}</code></span>.'
    return out


def placed(effect: str, joint: str, here: str = "") -> str:
    """An effect with its joint, where that is not `here`, escaped."""
    where = "" if joint == here else " of the whole robot" if joint == "*" else f" on {joint}"
    return text(effect + where)


def left_words(found: dict, fit: Fit) -> str:
    """How much of what is left the motion predicts, and which variables; empty where nothing."""
    if "depends_on" not in found:
        return ""
    alone = [
        f"{_named(d['variable'], fit)} alone {percentage(d['share'])}"
        for d in found["depends_on"][:3]
        if d["variable"] != "several variables together"
    ]
    whole = f"The motion predicts {percentage(found['share_left'])} of what is left"
    return whole + (f" ({', '.join(alone)})" if alone else "")


def _named(variable: str, fit: Fit) -> str:
    """A variable that a residual follows, escaped, with the article that a sentence needs."""
    words = quantity(variable, fit)
    return text(words if words == variable else f"the {words}")
