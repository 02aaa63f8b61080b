"""The sections of a page on one experiment, each its words and tables as HTML and its charts as Plotly figures.

`sysid report` puts them into one file. Words come first, charts after; a chart's place in the HTML is
`<figure class="chart" data-chart="ID">`. Every text that comes from a file or an experiment is escaped.
"""

from __future__ import annotations

import html
import math
import shlex

import numpy as np

from .. import results
from ..diagnose.diagnosis import Diagnosis
from ..effect import describe
from ..estimate import Fit
from ..inertia import PARAMETERS, UNITS
from ..loop import spelled
from ..model import ROBOT
from . import charts, solids

_MARK = {"complete": "✓", "missing": "+", "unknown": "?"}
_KEY = '<span class="key"><i class="line"></i>held-out RMS error</span> <span class="key"><i class="floor"></i>noise floor ± 2 standard errors</span>'
_KEY_AHEAD = _KEY + ' <span class="key"><i class="broken"></i>expected by the diagnosis; steps in brackets are not made</span>'
_SAID = {"complete": "complete", "missing": "missing physics", "unknown": "unknown structure"}


def sections(fit: Fit, diagnosis: Diagnosis, document: dict, history: list[dict]) -> dict[str, dict]:
    """The sections in the order of the page: {name: {"title", "html", "charts"}}.

    Args:
        document: of the diagnosis (`diagnose.document`). history: the steps made so far, oldest first; may be empty.
    """
    made = {
        "verdict": verdict(fit, diagnosis, document),
        "torque": torque(fit),
        "steps": steps(fit, diagnosis, document, history),
        "failures": failures(fit, document),
        "suspects": suspects(diagnosis, document),
        "unseen": unseen(fit, diagnosis, document),
        "parameters": parameters(fit),
        "bodies": bodies(fit, diagnosis),
        "provenance": provenance(fit, document),
    }
    return {name: {"title": title, "html": text, "charts": drawn} for name, (title, text, drawn) in made.items()}


# ---- words


def text(value) -> str:
    """Any value as text of a page."""
    return html.escape(str(value), quote=True)


def number(value, digits: int = 4) -> str:
    """A number as text; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}g}".replace("-", "−")


def level(value) -> str:
    """An error as text, always to four digits, so that levels can be compared by eye."""
    if value is None or not math.isfinite(value) or not 1e-3 <= abs(value) < 1e3:
        return number(value)
    return f"{value:#.4g}".rstrip(".").replace("-", "−")


def plus_minus(value, std, digits: int = 4) -> str:
    """A value with its standard deviation, rounded to two digits of the latter."""
    if value is None or not math.isfinite(value):
        return "–"
    if std is None or not math.isfinite(std) or std <= 0:
        return number(value, digits)
    places = 1 - int(math.floor(math.log10(std)))
    if -2 <= places <= 6 and abs(value) < 1e6:
        places = max(places, 0)
        return f"{value:.{places}f} ± {std:.{places}f}".replace("-", "−")
    return f"{number(value, digits)} ± {number(std, 2)}"


def unit_of(word: str) -> str:
    """A unit as text behind a number, escaped; nothing where there is none."""
    return "" if word in ("", "1") else " " + text(word.replace("^2", "²").replace("^3", "³"))


def units(fit: Fit) -> dict[str, tuple[str, str]]:
    """Of each joint the unit of what it exerts and of where it is."""
    return {joint: ("N", "m") if slides else ("N m", "rad") for joint, slides in zip(fit.joints, fit.model.robot.prismatic)}


def _place(chart: dict, caption: str = "", kind: str = "") -> str:
    below = f"<figcaption>{caption}</figcaption>" if caption else ""
    return (
        f'<figure class="chart {kind}" data-chart="{chart["id"]}" aria-label="{text(chart["label"])}" tabindex="0" style="--height:{chart["height"]}px">'
        f'<div class="plot"><p class="waiting">drawing…</p></div>{below}</figure>'
    )


def _table(heads: list[str], rows: list[list[str]], kind: str = "", label: str = "") -> str:
    head = "".join(f'<th scope="col">{h}</th>' for h in heads)
    body = "".join("<tr>" + "".join(f'<th scope="row">{c}</th>' if k == 0 else f"<td>{c}</td>" for k, c in enumerate(row)) + "</tr>" for row in rows)
    return f'<div class="scroll" tabindex="0" role="region" aria-label="{text(label)}"><table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _empty(words: str) -> str:
    return f'<p class="empty">{words}</p>'


def _listed(words) -> str:
    words = [text(w) for w in words]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " or " + words[-1]


# ---- 1, the verdict


def verdict(fit: Fit, diagnosis: Diagnosis, document: dict) -> tuple[str, str, list]:
    """What the diagnosis says of each joint, in words."""
    count = {status: sum(v["status"] == status for v in document["verdict"]) for status in _MARK}
    total, unit = len(document["verdict"]), units(fit)
    if count["complete"] == total:
        lead = f"The model says all that these logs can tell, on {'the joint' if total == 1 else f'all {total} joints'}."
    else:
        parts = []
        if count["missing"]:
            parts.append(f"physics is missing on {count['missing']} of {total} joint{'s' if total > 1 else ''}")
        if count["unknown"]:
            parts.append(f"structure that no known effect explains is left on {count['unknown']} of {total} joint{'s' if total > 1 else ''}")
        if count["complete"]:
            parts.append(f"{count['complete']} {'is' if count['complete'] == 1 else 'are'} complete")
        lead = "; ".join(parts) + "."
        lead = lead[0].upper() + lead[1:]
    cards = []
    for found in document["verdict"]:
        joint, entry = found["joint"], document["joints"][found["joint"]]
        floor, error = entry["noise_floor"], entry["rms"]["test"]
        ratio = f" ({number(error / floor, 3)} times the floor)" if floor and error is not None else ""
        cards.append(
            f'<article class="card {found["status"]}"><h3><span class="mark" aria-hidden="true">{_MARK[found["status"]]}</span>{text(joint)} <span class="status">{_SAID[found["status"]]}</span></h3>'
            f"<p>{verdict_words(found, document, diagnosis)}</p>"
            f'<p class="numbers">held-out error {level(error)} {unit[joint][0]}, noise floor {plus_minus(floor, entry["noise_floor_se"])} {unit[joint][0]}{ratio}</p></article>'
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
        return f"Structure is left that no effect of the vocabulary explains: {left or 'the held-out error is far above the noise floor, and nothing in the motion foretells it'}."
    joint, word = found["joint"], found["effect"]
    at = next((k for k, f in enumerate(document["findings"]) if f["effect"] == word and f["joint"] in (joint, "*") and f["joins_as_step"]), None)
    out = f"<strong>{text(word)}</strong> is missing"
    if at is None:
        return out + "."
    head, finding = document["findings"][at], diagnosis.findings[at]
    out += f": it removes {_share(head)} of the misfit"
    known = [f"{text(name.split('.')[-1])} = {plus_minus(p['value'], p['std'])}{unit_of(p['unit'])}" for name, p in head["parameters"].items() if p["value"] is not None]
    out += f" ({', '.join(known)})." if known else "."
    summary = describe(finding.answer.candidate.effect)["summary"].split(". ")[0].rstrip(".")
    out += f' <span class="quiet">{text(summary)}.</span>'
    if found["tied_with"]:
        out += f" These logs cannot tell it from {_listed(found['tied_with'])}. To separate them: {text(head['separate_by'])}."
    if found["also"]:
        out += f" Also missing: {text(', '.join(found['also']))}."
    if left:
        out += f" Structure is left beside it: {left}."
    return out


def structure_words(found: dict, diagnosis: Diagnosis) -> str:
    """What the structure left on a joint follows; nothing where nothing is left, or nothing foretells it."""
    said = [f"{text(d['variable'])} foretells {percentage(d['share'])} of it" for d in found.get("depends_on", [])[:3] if d["share"] >= 0.01]
    structure = next((v.structure for v in diagnosis.verdict if v.joint == found["joint"]), None)
    if structure is not None and structure.bursts:
        said.append(f"it comes in bursts, its largest tenth of rows holds {percentage(structure.crowded)} of its square")
    return "; ".join(said)


def _share(finding: dict) -> str:
    return percentage(finding["misfit_removed"], finding["misfit_removed_se"])


def percentage(share, se=None) -> str:
    """A share, with its standard error, in per cent."""
    if share is None or not math.isfinite(share):
        return "–"
    places = 0 if abs(share) >= 0.0995 else 1
    said = lambda value: f"{round(100 * value, places) + 0.0:.{places}f}"  # noqa: E731 - no minus before a zero
    return f"{said(share)}{'' if se is None or not math.isfinite(se) else f' ± {said(se)}'} %".replace("-", "−")


# ---- 2, measured and predicted


def torque(fit: Fit) -> tuple[str, str, list]:
    """Measured and predicted torque of each joint, train and test."""
    parts = {part: fit.predictions[part] for part in ("train", "test") if part in fit.predictions}
    names = {part: _log_names(fit, part) for part in parts}
    line = charts.timeline({part: (p.log, p.t, names[part]) for part, p in parts.items()})
    drawn, unit = [], units(fit)
    for j, joint in enumerate(fit.joints):
        series = {}
        for part, prediction in parts.items():
            residual = prediction.measured[:, j] - prediction.predicted[:, j]
            if prediction.use is not None:
                residual = np.where(prediction.use[:, j], residual, np.nan)
            series[part] = (prediction.measured[:, j], prediction.predicted[:, j], residual)
        drawn.append(charts.torque(f"torque{j}", joint, unit[joint][0], line, series, len(fit.joints)))
    errors = {part: p.errors() for part, p in parts.items()}
    rows = [
        [text(joint), *(f"{level(errors[part]['rms'][j])} {unit[joint][0]}" for part in parts), *(_percent(errors[part]["relative_error"][j]) for part in parts)]
        for j, joint in enumerate(fit.joints)
    ]
    table = _table(["joint", *(f"RMS, {part}" for part in parts), *(f"relative error, {part}" for part in parts)], rows, label="errors of each joint")
    tools = (
        '<div class="tools" role="group" aria-label="time axis of all joints"><button type="button" data-time="in">zoom in</button><button type="button" data-time="out">zoom out</button>'
        '<button type="button" data-time="back">←<span class="only-read"> earlier</span></button><button type="button" data-time="on">→<span class="only-read"> later</span></button>'
        '<button type="button" data-time="all">whole</button></div>'
    )
    spans = [f"{part}: {text(name)} from {number(begin, 3)} s" for part, own in line.items() for begin, _, name in own["spans"]]
    where = f'<p class="quiet">Tinted: test logs, which the fit never saw. All joints share the time axis. Long logs are thinned for display; every peak is kept. On the axis: {"; ".join(spans[:12])}{"; …" if len(spans) > 12 else ""}.</p>'
    return "Measured and predicted", table + where + tools + "".join(f"<h3>{text(joint)}</h3>{_place(c)}" for joint, c in zip(fit.joints, drawn)), drawn


def _percent(value) -> str:
    return "–" if value is None or not math.isfinite(value) else f"{number(100 * value, 3)} %"


def _log_names(fit: Fit, part: str) -> list[str]:
    named = [entry for entry in fit.logs if entry.get("part") == part]
    return [str(entry.get("log", f"log {k + 1}")).rpartition("/")[2] for k, entry in enumerate(named)]


# ---- 3, the staircase


def steps(fit: Fit, diagnosis: Diagnosis, document: dict, history: list[dict]) -> tuple[str, str, list]:
    """The held-out error of each joint over the steps, against its noise floor."""
    now, unit = {joint: entry["rms"]["test"] for joint, entry in document["joints"].items()}, units(fit)
    usable = [s for s in history if isinstance(s.get("rms_test"), dict)]
    done = usable or [{"added": None, "joint": None, "rms_test": now}]
    same = all(_close(done[-1]["rms_test"].get(joint), rms) for joint, rms in now.items())
    ahead = _expected(fit, diagnosis, document) if same else []
    names = ["start" if s.get("added") is None else f"+ {s['added']}" + ("" if s.get("joint") in (None, "*") else f" on {s['joint']}") for s in done]
    every = names + [f"(+ {word})" for word, _ in ahead]
    if not usable:
        words = "No step was made yet. "
        words += "The broken line is what the diagnosis expects of the effects that it names, added one after another." if ahead else "The diagnosis names no effect to add."
    elif not same:
        begun = all(_close(done[0]["rms_test"].get(joint), rms) for joint, rms in now.items())
        words = "Steps made by <code>sysid discover</code> or <code>sysid add</code>. " + (
            "The experiment file is the start of this staircase: it stayed as it was." if begun else "The experiment was changed since the last step: its error is not the last one here."
        )
    else:
        words = "Steps made so far." + (" The broken line is what the diagnosis expects of what it names next." if ahead else "")
    drawn = []
    for j, joint in enumerate(fit.joints):
        made = [s["rms_test"].get(joint) for s in done] + [None] * len(ahead)
        expected = [None] * (len(done) - 1) + [made[len(done) - 1]] + [rms[joint] for _, rms in ahead] if ahead else []
        entry = document["joints"][joint]
        drawn.append(charts.staircase(f"steps{j}", joint, unit[joint][0], _short(every, done, ahead), made, expected, entry["noise_floor"], entry["noise_floor_se"]))
    rows = [[f"{k}: {text(name)}", *(level(v) for v in values)] for k, (name, values) in enumerate(zip(every, [[s["rms_test"].get(j) for j in fit.joints] for s in done] + [[r[j] for j in fit.joints] for _, r in ahead]))]
    rows.append(["noise floor", *(plus_minus(document["joints"][j]["noise_floor"], document["joints"][j]["noise_floor_se"]) for j in fit.joints)])
    table = _table(["step", *(f"{text(j)} [{unit[j][0]}]" for j in fit.joints)], rows, label="held-out error after each step")
    how = "".join(f"<li>{text(j)}: {text(e['floor_detail'])}</li>" for j, e in document["joints"].items())
    return "Error against the noise floor", (
        f"<p>{words}</p>{table}<p class='quiet'>{_KEY if not ahead else _KEY_AHEAD}</p>"
        f'<div class="grid">{"".join(_place(c) for c in drawn)}</div><details><summary>how the noise floor was found</summary><ul>{how}</ul></details>'
    ), drawn


def _short(every: list[str], done: list, ahead: list) -> list[str]:
    """Names of steps on an axis: whole where they are few, else their numbers."""
    return every if len(every) <= 2 else [str(k) if k < len(done) else f"({k})" for k in range(len(done) + len(ahead))]


def _close(a, b) -> bool:
    return a is not None and b is not None and math.isclose(a, b, rel_tol=1e-9)


def _expected(fit: Fit, diagnosis: Diagnosis, document: dict) -> list[tuple[str, dict[str, float]]]:
    """What the diagnosis expects of its own steps: [(what is added, {joint: held-out RMS})]."""
    heads = [f for f in document["findings"] if f["joins_as_step"]]
    now = {joint: entry["rms"]["test"] for joint, entry in document["joints"].items()}
    out, before = [], diagnosis.first.rms()
    for head, step in zip(heads, diagnosis.steps):
        after = step.ground.rms()
        # what falls below the low-pass of the questions falls from the whole; a finding says it of its own joint itself
        now = {joint: math.sqrt(max(rms**2 - max(float(before[j] ** 2 - after[j] ** 2), 0.0), 0.0)) for j, (joint, rms) in enumerate(now.items())}
        if head["joint"] != "*":
            now[head["joint"]] = head["rms_test_after"]
        out.append((head["effect"] + ("" if head["joint"] == "*" else f" on {head['joint']}"), dict(now)))
        before = after
    return out


# ---- 4, where it fails


def failures(fit: Fit, document: dict) -> tuple[str, str, list]:
    """The residual of each joint over angle and speed, over time, over frequency, with the words."""
    drawn, parts, unit = [], [], units(fit)
    cutoff = document.get("domain", {}).get("cutoff_hz")
    for j, entry in enumerate(document["fails_where"]):
        joint = entry["joint"]
        force, base = unit[joint]
        own = [
            charts.residual_map(f"map{j}", joint, force, base, entry["map"]),
            charts.residual_time(f"time{j}", joint, force, entry["time"]),
            charts.residual_bands(f"bands{j}", joint, entry["frequency"]),
        ]
        drawn += own
        words = "".join(f"<li>{text(w)}</li>" for w in entry["words"])
        said = f"<ul>{words}</ul>" if words else '<p class="quiet">The error is spread evenly: no stretch of angle, speed or time holds much more than its share.</p>'
        share = f"{100 * entry['share_of_error']:.0f} % of the robot’s squared error, in units of each joint’s noise"
        parts.append(f'<h3>{text(joint)} <span class="quiet">{share}</span></h3>{said}<div class="grid three">{"".join(_place(c) for c in own)}</div>')
    if not parts:
        return "Where it fails", _empty("The test logs were not questioned."), []
    about = f'<p class="quiet">Test logs. Map and time: below {number(cutoff, 3)} Hz, where the model is questioned. Frequency: the whole residual. In the map, grey cells were never visited.</p>'
    return "Where it fails", about + "".join(parts), drawn


# ---- 5, suspects


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
        return "Suspects", _empty("No effect of the vocabulary is supported by held-out data: there is nothing to add."), []
    groups, path = [], text(shlex.quote(str(diagnosis.fit.experiment.path or "EXPERIMENT")))
    for family in families(diagnosis, document):
        tied = len(family) > 1
        rows = "".join(_suspect(found[k]) for k in family)
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
        body += f"<p>To add what comes first of each step:</p><pre>{chr(10).join(commands)}</pre>"
    if others:
        body += f"<h3>Also better than nothing</h3><p class='quiet'>Alone, each of these explains part of the same error; none is needed once the steps are in the model.</p>{make(others, 'other effects that explain part of the error')}"
    separate = {f["separate_by"]: None for f in found if f["tied_with"] and f["separate_by"]}
    if separate:
        body += "<h3>To separate the ties</h3><ul>" + "".join(f"<li>{text(s)}</li>" for s in separate) + "</ul>"
    return "Suspects", body, []


def _suspect(f: dict) -> str:
    known = [f"{text(name.split('.')[-1])} = {plus_minus(p['value'], p['std'])}{unit_of(p['unit'])}" for name, p in f["parameters"].items() if p["value"] is not None]
    options = ", ".join(f"{text(k)} = {text(v)}" for k, v in f["options"].items())
    small = "; ".join(w for w in (", ".join(known), options) if w)
    after = f"{level(f['rms_test_before'])} → {level(f['rms_test_after'])}"
    return (
        f'<tr><th scope="row">{text(f["effect"])}{f"<small>{small}</small>" if small else ""}</th><td>{text(f["joint"]) if f["joint"] != "*" else "whole robot"}</td>'
        f"<td>{_bar(f['misfit_removed'], f['misfit_removed_se'])}<span class='value'>{_share(f)}</span></td><td data-label='held-out RMS'>{after}</td>"
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


# ---- 6, what cannot be seen


def unseen(fit: Fit, diagnosis: Diagnosis, document: dict) -> tuple[str, str, list]:
    """Effects that the model absorbs on these logs, with the experiment that would show them; what unknown structure follows."""
    groups: dict[tuple[str, str], list[dict]] = {}
    for entry in document["not_visible"]:
        groups.setdefault((entry["effect"], entry["separate_by"]), []).append(entry)
    rows = [
        [text(effect), ", ".join("whole robot" if e["joint"] == "*" else text(e["joint"]) for e in own), f"{100 * max(e['visible'] for e in own):.1g} %", text(by)]
        for (effect, by), own in groups.items()
    ]
    body = "<p>Of these the model absorbs all but a trace on these logs: whether they are there cannot be said.</p>" + _table(
        ["effect", "on", "left visible", "the experiment that would show it"], rows, "wrap", "effects that these logs cannot show"
    ) if rows else _empty("Every effect of the vocabulary would show on these logs, were it there.")  # fmt: skip
    drawn, unit = [], units(fit)
    for j, found in enumerate(document["verdict"]):
        if "depends_on" not in found:
            continue
        beside = " beside what is named" if found["status"] == "missing" else ""
        own = []
        for k, entry in enumerate(found["depends_on"]):
            if entry.get("curve"):
                own.append(charts.dependence(f"depends{j}x{k}", found["joint"], unit[found["joint"]][0], entry))
        drawn += own
        rows = [[text(d["variable"]), percentage(d["share"], d["se"])] for d in found["depends_on"]]
        words = structure_words(found, diagnosis)
        body += f"<h3>What the residual of {text(found['joint'])} follows{beside}</h3><p>{words[0].upper() + words[1:] if words else 'Nothing in the motion foretells it'}.</p>"
        if any(d["share"] >= 0.01 for d in found["depends_on"]):
            body += _table(["variable", "share foretold"], rows, label=f"what the residual of {found['joint']} follows")
        body += f'<div class="grid three">{"".join(_place(c) for c in own)}</div><p class="quiet">Mean residual in bins of equal numbers of rows, ± 2 standard errors.</p>' if own else ""
    return "What these logs cannot show", body, drawn


# ---- 7, parameters


def parameters(fit: Fit) -> tuple[str, str, list]:
    """Parameters with uncertainty, the prior, and how much the data say."""
    known = results.document(fit)["parameters"]
    count, robot = 10 * fit.model.bodies, fit.model.robot
    drawn, parts = [], []
    spans = (("mass", 0, 1), ("first moment", 1, 4), ("second moment", 4, 10))
    for b, body in enumerate(robot.bodies):
        own, prior = known[10 * b : 10 * b + 10], fit.prior[b].tolist()
        groups = [
            {
                "unit": UNITS[a].replace("^2", "²"), "quantity": what, "names": list(PARAMETERS[a:z]), "values": [p["value"] for p in own[a:z]], "stds": [p["std"] for p in own[a:z]],
                "priors": prior[a:z], "shares": [p["from_data"] for p in own[a:z]],
            }
            for what, a, z in spans
        ]  # fmt: skip
        chart = charts.whiskers(f"body{b}", f"Inertial parameters of {body.name} against the prior", groups)
        drawn.append(chart)
        rows = [_parameter(PARAMETERS[k], entry, prior[k]) for k, entry in enumerate(own)]
        seen = sum(p["from_data"] > 0.5 for p in own)
        parts.append(
            f'<details{" open" if b == 0 else ""}><summary>{text(body.name)} <span class="quiet">{body.kind}, mass {plus_minus(own[0]["value"], own[0]["std"])} kg, {seen} of 10 from the data</span></summary>'
            f'<div class="split">{_parameter_table(rows, f"parameters of {body.name}")}{_place(chart)}</div></details>'
        )
    others = known[count:]
    if others:
        by_effect: dict[tuple[str, str], list[tuple[str, dict]]] = {}
        places = [c.joint for c in fit.model.coefficients] + [v.joint for v in fit.model.shape_values]
        for entry, place in zip(others, places):
            what = f"{entry['name'].partition('.')[0]}: {entry['name'].rpartition('.')[2]}"
            by_effect.setdefault((what, entry["unit"]), []).append(("whole robot" if place == ROBOT else fit.joints[place], entry))
        groups = []
        for (what, unit), own in by_effect.items():
            names = [joint for joint, _ in own]
            if len(set(names)) < len(names):
                names = [p["name"] for _, p in own]
            groups.append({
                "unit": unit.replace("^2", "²"), "quantity": charts.plain(what), "names": names, "values": [p["value"] for _, p in own], "stds": [p["std"] for _, p in own],
                "priors": [None] * len(own), "shares": [p["from_data"] for _, p in own],
            })  # fmt: skip
        chart = charts.whiskers("effects", "Coefficients of friction and other effects", groups)
        drawn.insert(0, chart)
        zero = {fit.model.coefficients[k].name for k in fit.certificate.at_zero}
        rows = [_parameter(entry["name"], entry, None, at_zero=entry["name"] in zero) for entry in others]
        parts.insert(0, f'<details open><summary>friction and other effects <span class="quiet">{len(others)} coefficients</span></summary><div class="split">{_parameter_table(rows, "friction and other effects")}{_place(chart)}</div></details>')
    about = (
        '<p class="quiet">± 1 standard deviation in the tables, 2 in the charts. “From data” is 1 where the measurement determines a parameter and 0 where only the prior speaks; '
        "pale dots are said by the prior. Most single inertial parameters of a robot cannot be seen in any log, only combinations of them: a low number there is no fault of the log. Moments are about the joint’s frame.</p>"
    )
    return "Parameters", about + "".join(parts), drawn


def _parameter_table(rows: list[list[str]], label: str) -> str:
    return _table(["parameter", "value", "prior", "unit", "from data"], rows, "parameters", label)


def _parameter(name: str, entry: dict, prior, at_zero: bool = False) -> list[str]:
    share = float(entry["from_data"] or 0.0)
    value = '0 <span class="quiet">at its bound</span>' if at_zero else plus_minus(entry["value"], entry["std"])
    held = ' <span class="quiet">held</span>' if entry.get("held") else ""
    meter = f'<span class="meter" style="--share:{100 * share:.0f}%" aria-hidden="true"></span>{share:.2f}'
    return [text(name), value + held, number(prior) if prior is not None else "–", unit_of(entry["unit"]) or "–", meter]


# ---- 8, the bodies


def bodies(fit: Fit, diagnosis: Diagnosis) -> tuple[str, str, list]:
    """The bodies as ellipsoids on the robot, at the middle of its motion."""
    robot = fit.model.robot
    q = [piece.q[piece.core] for piece in diagnosis.first.train.pieces]
    low, high = np.min([x.min(0) for x in q], 0), np.max([x.max(0) for x in q], 0)
    placed = solids.frames(robot, (low + high) / 2)
    now, before = solids.solids(robot, fit.pi, placed), solids.solids(robot, fit.prior, placed)
    found, rows = [], []
    for b, (body, one, other) in enumerate(zip(robot.bodies, now, before)):
        mass, prior = float(fit.pi[b, 0]), float(fit.prior[b, 0])
        found.append({"name": body.name, "kind": body.kind, "words": f"mass {number(mass)} kg", "identified": one, "prior": other})
        triple = lambda values: ", ".join(number(v, 3) for v in values)  # noqa: E731
        semi = triple(sorted(one.axes)[::-1]) if one else "not physically possible"
        rows.append([text(body.name), body.kind, number(mass), number(prior), triple(one.centre) if one else "–", semi, triple(sorted(other.axes)[::-1]) if other else "–"])
    chart = charts.bodies("solids", found, solids.skeleton(robot, placed))
    angles = ", ".join(f"{text(j)} {number(v, 3)} {'m' if slides else 'rad'}" for j, v, slides in zip(fit.joints, (low + high) / 2, robot.prismatic))
    body = (
        f"<p>Each body as the uniform ellipsoid of its mass, centre of mass and inertia, at the middle of the logged motion: {angles}.</p>{_place(chart, kind='space')}"
        + _table(["body", "kind", "mass [kg]", "prior [kg]", "centre x, y, z [m]", "semi-axes [m]", "prior [m]"], rows, label="ellipsoids of the bodies")
        + '<p class="quiet">Filled: identified. Lines: prior. What the data cannot see of a shape is free within what the prior allows: a needle is a shape that these logs do not determine, and is cut where it leaves the box.</p>'
    )
    return "Bodies", body, [chart]


# ---- 9, provenance


def provenance(fit: Fit, document: dict) -> tuple[str, str, list]:
    """Everything needed to find the same again."""
    said = results.document(fit)
    path = fit.experiment.path
    logs = [
        [text(entry.get("log", "–")), text(entry.get("part", "–")), f"<code>{text(entry.get('sha256', '–'))}</code>", text(entry.get("samples", "–")), _span(entry)]
        for entry in document["logs"]
    ]
    versions = [[text(name), text(version)] for name, version in document["versions"].items()]
    seeds = ", ".join(f"{text(k)} {text(v)}" for k, v in said["seeds"].items()) or "none: nothing in a fit or a diagnosis is random"
    command = f"sysid report {shlex.quote(str(path))}" if path else "sysid report EXPERIMENT"
    try:
        source = path.read_text(encoding="utf-8-sig") if path else ""
    except OSError:
        source = ""
    body = f"<h3>Command</h3><pre>{text(command)}</pre><h3>Logs</h3>" + _table(["log", "part", "SHA-256", "samples", "piece"], logs, label="logs")
    body += f"<h3>Versions</h3>{_table(['package', 'version'], versions, label='versions')}<p>Seeds: {seeds}.</p>"
    certificate = fit.certificate
    body += f"<p>{fit.solution.iterations} iterations, {'converged' if fit.solution.converged else 'not converged'}; objective {number(fit.objective, 8)}; certificate: stationarity {number(certificate.stationarity, 2)}, no other parameters can gain more than {number(certificate.gap, 2)}.</p>"
    body += f"<h3>Experiment</h3><pre>{text(source)}</pre>" if source else _empty("The experiment file is not at hand.")
    return "Provenance", body, []


def _span(entry: dict) -> str:
    start, stop = entry.get("start"), entry.get("stop")
    if start is None and stop is None:
        return "whole"
    return f"{number(start) if start is not None else '0'} s to {'the end' if stop is None else f'{number(stop)} s'}"
