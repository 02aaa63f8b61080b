"""The suspects, step by step, each with what could stand in its place."""

from __future__ import annotations

import math

import numpy as np

from ..diagnose.diagnosis import Diagnosis
from .verdict import placed
from .words import SPACE, chance, empty, level, number, percentage, plus_minus, text, unit_of


def families(diagnosis: Diagnosis) -> list[list[int]]:
    """Places in the findings, those of each claim together, in its order."""
    out, at = [], 0
    for claim in diagnosis.claims:
        out.append(list(range(at, at + len(claim.findings))))
        at += len(claim.findings)
    return out


def suspects(diagnosis: Diagnosis, document: dict) -> tuple[str, str, list]:
    """The effects that these logs support, step by step; what is tied in one bracket."""
    found = document["findings"]
    refused = "".join(
        f"<li>{placed(r['effect'], r['joint'])}: {text(r['why'])}</li>"
        for r in document["not_claimed"]
    )
    refused = f"<h3>Looked at and not claimed</h3><ul>{refused}</ul>" if refused else ""
    if not found:
        nothing = "No effect of the vocabulary is supported by these logs: there is nothing to add."
        return "Suspects", empty(nothing) + refused, []
    groups = []
    for step, (claim, family) in enumerate(zip(diagnosis.claims, families(diagnosis)), start=1):
        named = _step_words(step, claim.set, [found[k] for k in family])
        rows = "".join(_suspect(k, found[k]) for k in family)
        kind = "tied" if len(claim.set) > 1 else "alone"
        span = f'<tr class="family"><th colspan="5" scope="rowgroup"><span>{named}</span></th></tr>'
        groups.append(f'<tbody class="{kind}">{span}{rows}</tbody>')
    removed = "misfit removed, ± 1 standard error"
    heads = ("effect", "joint", "probability", removed, "held-out RMS")
    head = "".join(f"<th scope='col'>{h}</th>" for h in heads)
    body = (
        '<p class="quiet">Each is what <code>sysid add</code> gives on top of the steps before it, '
        "everything refitted. The training logs choose, by blocks of time held apart; the test "
        "logs report the error. Misfit is the squared error above the noise floor. "
        "Probability: of being the best of its set, which holds the truth nine times in ten.</p>"
        '<div class="scroll" tabindex="0" role="region" aria-label="suspects, step by step">'
        f'<table class="suspects"><thead><tr>{head}'
        f"</tr></thead>{''.join(groups)}</table></div>"
    )
    separate = {f["separate_by"]: None for f in found if f["tied_with"] and f["separate_by"]}
    if separate:
        body += (
            "<h3>To separate what is tied</h3><ul>"
            + "".join(f"<li>{text(s)}</li>" for s in separate)
            + "</ul>"
        )
    return "Suspects", body + refused, []


def _step_words(step: int, tied, findings: list[dict]) -> str:
    words = f"step {step}, family-wise p {_p(findings[0]['q_value'])}"
    if len(tied) > 1:
        words += f": these {len(tied)} are tied, the logs cannot tell them apart"
    listed = {(f["effect"], f["joint"]) for f in findings}
    rest = [f"{placed(e, j)} ({chance(p)})" for e, j, p in tied if (e, j) not in listed]
    return words + (f". Not fitted here: {', '.join(rest)}" if rest else "")


def _suspect(k: int, f: dict) -> str:
    known = [
        f"{text(name.split('.')[-1])}{SPACE}={SPACE}"
        f"{plus_minus(p['value'], p['std'])}{unit_of(p['unit'])}"
        for name, p in f["parameters"].items()
        if p["value"] is not None
    ]
    options = ", ".join(f"{text(k)} = {text(v)}" for k, v in f["options"].items())
    small = "; ".join(w for w in (", ".join(known), options) if w)
    command = f'<small class="by-hand"><code>{text(f["command"])}</code></small>'
    after = f"{level(f['rms_test_before'])} → {level(f['rms_test_after'])}"
    removed = percentage(f["misfit_removed"], f["misfit_removed_se"])
    return (
        f'<tr data-finding="{k}"><th scope="row">{text(f["effect"])}'
        f"{f'<small>{small}</small>' if small else ''}{command}</th>"
        f"<td>{text(f['joint']) if f['joint'] != '*' else 'whole robot'}</td>"
        f"<td data-label='probability'>{chance(f['probability'])}</td>"
        f"<td>{_bar(f['misfit_removed'], f['misfit_removed_se'])}"
        f"<span class='value'>{removed}</span></td>"
        f"<td data-label='held-out RMS'>{after}</td></tr>"
    )


def _p(value) -> str:
    return "–" if value is None or not math.isfinite(value) else number(value, 2)


def _bar(share, se) -> str:
    """A bar of the misfit removed with its standard error, drawn without a script."""
    share = float(np.clip(share, 0.0, 1.0)) if math.isfinite(share) else 0.0
    whisker = ""
    if se is not None and math.isfinite(se):
        low, high = (100 * float(np.clip(v, 0.0, 1.0)) for v in (share - se, share + se))
        whisker = (
            f'<path class="whisker" d="M{low:.2f} 7H{high:.2f}M{low:.2f} 4V10M{high:.2f} 4V10"/>'
        )
    return (
        '<svg class="bar" viewBox="0 0 100 14" preserveAspectRatio="none" aria-hidden="true">'
        '<rect class="ground" width="100" height="14"/>'
        f'<rect class="fill" y="2" width="{100 * share:.2f}" height="10"/>{whisker}</svg>'
    )
