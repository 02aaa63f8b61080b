"""What the diagnosis says: the verdict on each joint, the suspects with their ties, and what the logs cannot show."""

from __future__ import annotations

import math
import shlex

import numpy as np

from ..diagnose.diagnosis import Diagnosis
from ..effect import describe
from ..estimate import Fit
from ..loop import spelled
from ..model import ROBOT
from . import charts
from .words import SPACE, breaking, drawing, either, empty, level, number, percentage, plus_minus, quantity, raised, table, text, unit_of, units

_MARK = {"complete": "✓", "missing": "+", "unknown": "?"}
_SAID = {"complete": "complete", "missing": "missing physics", "unknown": "unknown structure"}



def verdict(fit: Fit, diagnosis: Diagnosis, document: dict) -> tuple[str, str, list]:
    """What the diagnosis says of each joint, in words."""
    count = {status: sum(v["status"] == status for v in document["verdict"]) for status in _MARK}
    total, unit = len(document["verdict"]), units(fit)
    if count["complete"] == total:
        lead = f"The model says all that these logs can tell, on {'the joint' if total == 1 else f'all {total} joints'}."
    else:
        parts = []
        if count["missing"]:
            parts.append("physics is missing" + (f" on {count['missing']} of {total} joints" if total > 1 else ""))
        if count["unknown"]:
            parts.append("structure that no known effect explains is left" + (f" on {count['unknown']} of {total} joints" if total > 1 else ""))
        if count["complete"]:
            parts.append(f"{count['complete']} {'is' if count['complete'] == 1 else 'are'} complete")
        lead = "; ".join(parts) + "."
        lead = lead[0].upper() + lead[1:]
    cards = []
    for found in document["verdict"]:
        joint, entry = found["joint"], document["joints"][found["joint"]]
        floor, error, force = entry["noise_floor"], entry["rms"]["test"], raised(unit[joint][0])
        ratio = f" ({error / floor:#.3g} times the floor)" if floor and error is not None else ""
        cards.append(
            f'<article class="card {found["status"]}"><h3><span class="mark" aria-hidden="true">{_MARK[found["status"]]}</span>{text(joint)} <span class="status">{_SAID[found["status"]]}</span></h3>'
            f"<p>{verdict_words(found, document, diagnosis)}</p>"
            f'<p class="numbers">held-out error {level(error)}{SPACE}{force}, noise floor {plus_minus(floor, entry["noise_floor_se"])}{SPACE}{force}{ratio}</p></article>'
        )
    notes = "".join(f"<li>{text(n)}</li>" for n in document["notices"])
    proof = "The fit is proven to be the global optimum." if fit.certificate.globally_optimal else "The fit is not proven to be the global optimum."
    if not fit.solution.converged:
        proof = "<strong>The fit did not converge: nothing below is to be trusted.</strong>"
    bodies = "Every body is physically possible." if fit.physically_consistent else "<strong>Not every body is physically possible.</strong>"
    body = f'<p class="lead">{lead}</p><div class="cards">{"".join(cards)}</div><p>{proof} {bodies}</p>'
    return "Verdict", body + (f'<details class="notes"><summary>{len(document["notices"])} note{"s" if len(document["notices"]) > 1 else ""} on the data and the fit</summary><ul>{notes}</ul></details>' if notes else ""), []


def verdict_words(found: dict, document: dict, diagnosis: Diagnosis) -> str:
    """One joint's verdict as a sentence of HTML."""
    if found["status"] == "complete":
        return "Nothing is left that held-out data support."
    left = structure_words(found, diagnosis)
    if found["status"] == "unknown":
        also = f" Part of it looks like {text(', '.join(found['also']))}." if found["also"] else ""
        return f"Structure is left that no effect of the vocabulary explains: {left or 'the held-out error is far above the noise floor, and nothing in the motion foretells it'}.{also}"
    joint, word = found["joint"], found["effect"]
    places = [k for k, f in enumerate(document["findings"]) if f["effect"] == word and f["joint"] in (joint, "*")]
    at = next((k for k in places if document["findings"][k]["joins_as_step"]), places[0] if places else None)
    out = f"<strong>{text(word)}</strong> is missing"
    if at is None:
        return out + "."
    head, finding = document["findings"][at], diagnosis.findings[at]
    out += f": it removes {removed(head)} of the misfit"
    known = [f"{text(name.split('.')[-1])}{SPACE}={SPACE}{plus_minus(p['value'], p['std'])}{unit_of(p['unit'])}" for name, p in head["parameters"].items() if p["value"] is not None]
    out += f" ({', '.join(known)})." if known else "."
    summary = describe(finding.answer.candidate.effect)["summary"].replace("`", "").split(". ")[0].rstrip(".")
    out += f' <span class="quiet">{text(summary)}.</span>'
    if found["tied_with"]:
        out += f" These logs cannot tell it from {either(found['tied_with'])}. To separate them: {text(head['separate_by'])}."
    if found["also"]:
        out += f" Also missing: {text(', '.join(found['also']))}."
    if left:
        out += f" Structure is left beside it: {left}."
    return out


def structure_words(found: dict, diagnosis: Diagnosis) -> str:
    """What the structure left on a joint follows; nothing where nothing is left, or nothing foretells it."""
    said = [f"{_named(d, diagnosis.fit)} foretells {percentage(d['share'])} of it" for d in found.get("depends_on", [])[:3] if d["share"] >= 0.01 and d["variable"] != "time, in bursts"]
    structure = next((v.structure for v in diagnosis.verdict if v.joint == found["joint"]), None)
    if structure is not None and structure.bursts:
        said.append(f"it comes in bursts, its largest tenth of rows holds {percentage(structure.crowded)} of its square")
    return "; ".join(said)


def _named(entry: dict, fit: Fit) -> str:
    """A variable that a residual follows, escaped, with the article that a sentence needs."""
    words = quantity(entry["variable"], fit)
    return text(words if words == entry["variable"] else f"the {words}")


def removed(finding: dict) -> str:
    """The misfit that a finding removes, in per cent."""
    return percentage(finding["misfit_removed"], finding["misfit_removed_se"])


# ---- the suspects



def families(diagnosis: Diagnosis, document: dict) -> list[list[int]]:
    """Places in the document's findings, those that the logs cannot tell apart together, in its order."""
    out, at = [], 0
    for step in diagnosis.steps:
        out.append(list(range(at, at + len(step.family))))
        at += len(step.family)
    return out + [[k] for k in range(at, len(document["findings"]))]


def suspects(diagnosis: Diagnosis, document: dict) -> tuple[str, str, list]:
    """The effects that held-out data support, with the misfit that each removes; ties in one bracket."""
    found = document["findings"]
    if not found:
        return "Suspects", empty("No effect of the vocabulary is supported by held-out data: there is nothing to add."), []
    groups, path = [], text(shlex.quote(str(diagnosis.fit.experiment.path or "EXPERIMENT")))
    for family in families(diagnosis, document):
        tied = len(family) > 1
        rows = "".join(_suspect(k, found[k]) for k in family)
        head = found[family[0]]
        word = f"step {head['joins_as_step']}" if head["joins_as_step"] else ""
        if tied:
            word += f": these {len(family)} are tied, the logs cannot tell them apart"
        named = f'<tr class="family"><th colspan="6" scope="rowgroup"><span>{word}</span></th></tr>' if word else ""
        groups.append((head["joins_as_step"] is not None, f'<tbody class="{"tied" if tied else "alone"}">{named}{rows}</tbody>'))
    steps_, others = [g for joined, g in groups if joined], [g for joined, g in groups if not joined]
    head = "<thead><tr><th scope='col'>effect</th><th scope='col'>joint</th><th scope='col'>misfit removed, ± 1 standard error</th><th scope='col'>held-out RMS</th><th scope='col'>visible</th><th scope='col'>q-value</th></tr></thead>"
    make = lambda parts, label: f'<div class="scroll" tabindex="0" role="region" aria-label="{label}"><table class="suspects">{head}{"".join(parts)}</table></div>'  # noqa: E731
    body = '<p class="quiet">Each added to the model alone, everything refitted, judged on the test logs. Misfit is the squared error above the noise floor. q-value: expected share of false finds. Visible: the share of the signature that the model cannot absorb.</p>'
    if steps_:
        body += make(steps_, "effects that join the model, with their ties")
    commands = []
    for step in diagnosis.steps:
        candidate = step.head.candidate
        name, joints, options = spelled(candidate, "*" if candidate.joint == ROBOT else diagnosis.fit.joints[candidate.joint])
        words = ["sysid add", path, text(shlex.quote(name)), *(f"--joint {text(shlex.quote(j))}" for j in joints or []), *(f"--option {text(shlex.quote(f'{k}={v}'))}" for k, v in options.items())]
        commands.append(" ".join(words))
    if commands:
        body += f"<div class='by-hand'><p>To add what comes first of each step:</p><pre>{chr(10).join(commands)}</pre></div>"
    if others:
        after = "none is needed once the steps are in the model" if steps_ else "none is sure enough to join the model"
        body += f"<h3>Others that were tried</h3><p class='quiet'>Alone, each of these explains some of the same error, or hardly any; {after}.</p>{make(others, 'other effects that explain part of the error')}"
    separate = {f["separate_by"]: None for f in found if f["tied_with"] and f["separate_by"]}
    if separate:
        body += "<h3>To separate the ties</h3><ul>" + "".join(f"<li>{text(s)}</li>" for s in separate) + "</ul>"
    return "Suspects", body, []


def _suspect(k: int, f: dict) -> str:
    known = [f"{text(name.split('.')[-1])}{SPACE}={SPACE}{plus_minus(p['value'], p['std'])}{unit_of(p['unit'])}" for name, p in f["parameters"].items() if p["value"] is not None]
    options = ", ".join(f"{text(k)} = {text(v)}" for k, v in f["options"].items())
    small = "; ".join(w for w in (", ".join(known), options) if w)
    after = f"{level(f['rms_test_before'])} → {level(f['rms_test_after'])}"
    return (
        f'<tr data-finding="{k}"><th scope="row">{text(f["effect"])}{f"<small>{small}</small>" if small else ""}</th><td>{text(f["joint"]) if f["joint"] != "*" else "whole robot"}</td>'
        f"<td>{_bar(f['misfit_removed'], f['misfit_removed_se'])}<span class='value'>{removed(f)}</span></td><td data-label='held-out RMS'>{after}</td>"
        f"<td data-label='visible'>{number(f['visible'], 2)}</td><td data-label='q'>{_q(f['q_value'])}</td></tr>"
    )


def _q(value) -> str:
    return "–" if value is None or not math.isfinite(value) else "&lt; 1e−16" if value < 1e-16 else number(value, 2)


def _bar(share, se) -> str:
    """A bar of the misfit removed with its standard error, drawn without a script."""
    share = float(np.clip(share, 0.0, 1.0)) if math.isfinite(share) else 0.0
    whisker = ""
    if se is not None and math.isfinite(se):
        low, high = (float(np.clip(v, 0.0, 1.0)) for v in (share - se, share + se))
        whisker = f'<path class="whisker" d="M{100 * low:.2f} 7H{100 * high:.2f}M{100 * low:.2f} 4V10M{100 * high:.2f} 4V10"/>'
    return f'<svg class="bar" viewBox="0 0 100 14" preserveAspectRatio="none" aria-hidden="true"><rect class="ground" width="100" height="14"/><rect class="fill" y="2" width="{100 * share:.2f}" height="10"/>{whisker}</svg>'


# ---- what cannot be seen



def _trace(share: float) -> str:
    return percentage(share) if share >= 0.001 else "&lt; 0.1 %"


def unseen(fit: Fit, diagnosis: Diagnosis, document: dict) -> tuple[str, str, list]:
    """Effects that the model absorbs on these logs, with the experiment that would show them; what unknown structure follows."""
    groups: dict[tuple[str, str], list[dict]] = {}
    for entry in document["not_visible"]:
        groups.setdefault((entry["effect"], entry["separate_by"]), []).append(entry)
    rows = [
        [breaking(effect), ", ".join("whole robot" if e["joint"] == "*" else breaking(e["joint"]) for e in own), _trace(max(e["visible"] for e in own)), text(by)]
        for (effect, by), own in groups.items()
    ]
    body = "<p>Of these the model absorbs all but a trace on these logs: whether they are there cannot be said.</p>" + table(
        ["effect", "on", "left visible", "the experiment that would show it"], rows, "wrap", "effects that these logs cannot show"
    ) if rows else empty("Every effect of the vocabulary would show on these logs, were it there.")  # fmt: skip
    drawn, unit = [], units(fit)
    for j, found in enumerate(document["verdict"]):
        if "depends_on" not in found:
            continue
        beside = " beside what is named" if found["status"] == "missing" else ""
        own = []
        for k, entry in enumerate(found["depends_on"]):
            if entry.get("curve"):
                own.append(charts.dependence(f"depends{j}x{k}", found["joint"], unit[found["joint"]][0], quantity(entry["variable"], fit), entry))
        drawn += own
        rows = [[text(quantity(d["variable"], fit)), percentage(d["share"], d["se"])] for d in found["depends_on"]]
        words = structure_words(found, diagnosis)
        body += f"<h3>What the residual of {text(found['joint'])} follows{beside}</h3><p>{words[0].upper() + words[1:] if words else 'Nothing in the motion foretells it'}.</p>"
        if any(d["share"] >= 0.01 for d in found["depends_on"]):
            body += table(["variable", "share foretold"], rows, label=f"what the residual of {found['joint']} follows")
        body += f'<div class="grid three">{"".join(drawing(c) for c in own)}</div><p class="quiet">Mean residual in bins of equal numbers of rows, ± 2 standard errors.</p>' if own else ""
    return "What these logs cannot show", body, drawn
