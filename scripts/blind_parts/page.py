"""The benchmark's page of docs/, as Markdown."""

from __future__ import annotations

from . import conditions
from .claims import family
from .fourth_laws import FOURTH
from .hidden import ABSORBED, OUTSIDE
from .new_laws import NEW
from .old_laws import OLD
from .robots import SECONDS
from .scoring import CATEGORIES, EXPLAINED, MEANS, NAMED
from .third_laws import THIRD
from .wording import listed, lowered_by, page_name, percent, quantiles, span, spelled, table


def page(found: dict, records: list[dict], settings: dict, notes: str = "") -> str:
    """The page of docs/, as Markdown."""
    bars, cases_, under = found["bars"], found["cases"], settings.get("conditions", "clean")
    name, mark = page_name(under), "" if under == "clean" else f" --conditions {under}"
    hidden = sum(n for kind, n in cases_.items() if kind != "control")
    command = (
        f"python scripts/blind_benchmark.py --cases {settings['cases']} --seed {settings['seed']}{mark}"
        + "".join(f" --only {w}" for w in settings["only"])
        + (f" --limit {settings['limit']}" if settings["limit"] else "")
    )
    met = [
        [
            b["says"],
            ("at most " if b["most"] else "at least ")
            + (f"{b['bound']}" if isinstance(b["reached"], int) else f"{100 * b['bound']:.0f} %"),
            b["reached"] if isinstance(b["reached"], int) else percent(b["reached"]),
            "yes" if b["met"] else "**no**",
        ]
        for b in bars
    ]
    short = [c for c in CATEGORIES if c != "error" or found["errors"]]
    by = lambda entry: [entry[c] for c in short]  # noqa: E731
    total = lambda entry: sum(entry[c] for c in CATEGORIES)  # noqa: E731
    rows = found["rows"]
    misnamed = [
        r
        for r in rows
        if r["kind"] in ("one", "two")
        and r["visible"]
        and r["effect"] not in ABSORBED
        and r["category"] not in NAMED
    ]
    accused = [
        (r, v)
        for r in records
        if r["kind"] == "control" and r["error"] is None
        for v in r["verdict"]
        if v["status"] != "complete"
    ]
    outside = [
        r
        for r in rows
        if r["kind"] == "outside" and r["visible"] and r["category"] not in ("unknown", "explained")
    ]
    far = [
        r
        for r in rows
        if r["kind"] in ("one", "two")
        and r["visible"]
        and r["category"] in NAMED
        and not r["within"]
    ]
    invisible = [r for r in rows if r["kind"] in ("one", "two") and not r["visible"]]
    parts = [
        "# Blind benchmark: is the missing effect found?",
        "This page is written by `scripts/blind_benchmark.py` from its results; nothing in it is edited by hand except the notes at its end.",
        f"    {command} --jobs 2 --publish",
        f"{hidden} simulated experiments with something hidden ({cases_['one']} with one effect of the catalogue, {cases_['two']} with two, {cases_['outside']} with one "
        f"that the catalogue does not have) and {cases_['control']} controls with nothing hidden; two logs of {min(SECONDS.values()):g} to {max(SECONDS.values()):g} s each, one to train and one held out; "
        f"base seed {settings['seed']}, from which every case draws a seed of its own. `sysid discover` sees the folder that `sysid simulate` writes and nothing of "
        "the truth. Joints, sizes (log-uniform from 0.3 to 3 times the simulator's default), masses, friction, motion and the colour of the noise are drawn.",
        conditions.SAYS[under],
        "An effect is **visible** when the true model, refitted, lowers the held-out RMS of its joint by at least 10 % (of any joint for an effect of the whole robot; "
        "of two effects, against the model that has the other one). Intervals are Wilson's, 95 %.",
        "## What was asked and what was reached",
        table(["", "asked", "reached", "met"], met),
        "## Visible effects",
        table(["", *short, "visible"], [
            ["all", *by(found["visible"]["all"]), total(found["visible"]["all"])], ["one hidden", *by(found["visible"]["one"]), total(found["visible"]["one"])],
            ["two hidden", *by(found["visible"]["two"]), total(found["visible"]["two"])], *[[robot, *by(entry), total(entry)] for robot, entry in found["robots"].items()],
        ]),
        "\n".join(f"- {c}: {MEANS[c]}." for c in short),
        f"Of the named, {percent(found['named_with_extras'])} have a further effect on the same joint that is not there. With anything hidden, "
        f"{percent(found['innocent_joints'])} of the cases accuse a joint in which nothing is hidden.",
        "### By effect",
        table(["hidden", "cases", "visible", *short], [[e, entry["hidden"], total(entry), *by(entry)] for e, entry in found["effects"].items()]),
        f"![Naming by effect and by visibility](figures/{name}_effects.png)",
        f"![Confusion matrix](figures/{name}_confusion.png)",
        "### By visibility",
        table(["the true model takes away, of the RMS", "named", "alone", "another named"], [[span(b), percent(b["named"]), percent(b["alone"]), percent(b["wrong"])] for b in found["by_lowered"]]),
        f"Hidden and not visible: {len(invisible)}; of these " + ", ".join(f"{n} {c}" for c in CATEGORIES if (n := sum(r["category"] == c for r in invisible))) + "." if invisible else "",
        "Not visible, although the same logs without the effect have a held-out RMS at least 10 % lower: here the catalogue's own model of the effect, refitted, does not "
        "describe what the simulator does, or its values are not found.",
        table(["case", "hidden", "on", "size", "RMS lower without the effect", "lowered by the true model", "outcome", "named"], [
            [f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", f"{100 * r['hurts']:.0f} %", lowered_by(r), r["category"], r["named"]] for r in found["true_fails"]
        ]) if found["true_fails"] else "None.",
        "Payload in every log is the last link's own inertia, and pushes come at other times in the held-out log: no model can predict either, so they count as not visible. "
        + "; ".join(f"{e}: " + (", ".join(f"{n} {c}" for c, n in entry.items() if n) or "none run") for e, entry in found["absorbed"].items()) + ".",
        "## Controls",
        f"Accused: {percent(found['controls']['accused'])}. Called unknown on some joint: {percent(found['controls']['unknown'])}. White and coloured noise (5 to 300 ms), "
        "encoders from exact enough to coarse, speeds from half to 1.25 times the usual.",
        table(["robot", "controls", "accused", "unknown"], [[robot, *entry.values()] for robot, entry in found["controls"]["by_robot"].items()]),
        f"Unresolved on some joint, which is no accusation: {percent(found['controls']['unresolved'])}.",
        "## Claims that are not there, and the noise floor",
        f"Claims are the (effect, joint) pairs that first verdicts name, on the joint of an outside law excepted. Not there: {percent(found['claims']['false'])}; "
        f"as the verdict's first line says it, \"a or b\" where a is no likelier right than wrong: {percent(found['claims']['false_as_said'])}; "
        f"where the family or set is counted with it: {percent(found['claims']['false_families_too'])}."
        + (f" Effects in a set that names something: {found['claims']['members']:.1f} on average." if found["claims"]["members"] else ""),
        "True noise is what torque noise, encoder and clock add to the residual of the first fit, over all logs; spikes and closed brakes are none.",
        f"Noise floor within 25 % of the true noise, or null: {percent(found['floors']['good'])} of the joints; null: {percent(found['floors']['null'])}."
        + (f" Floor over true noise: {quantiles(found['floors']['ratio'])}." if found["floors"]["ratio"] else ""),
        table(["case", "claimed", "on", "its family holds what is hidden"], [[f"`{c['key']}`", c["effect"], c["joint"], "yes" if c["held"] else "no"] for c in found["claims"]["list"]])
        if found["claims"]["list"] else "",
        "## Effects outside the catalogue",
        f"{listed(OLD)} are old: they were known when the method was last tuned. {listed(NEW)} were written before the method was changed, which is never done for one of them. "
        f"{listed(THIRD)} were written later, before it was changed again, by somebody who had not seen it; {listed(FOURTH)} last of all, by another one.",
        table(["torque", "cases", "visible", "unknown", f"explained ({100 * EXPLAINED:.0f} % of the misfit)", "wrong", "of these, structure left is said", "unresolved", "missed"],
               [[f"{kind}: {OUTSIDE[kind][0]}", e["hidden"], e["visible"], e["unknown"], e["explained"], e["wrong"], e["admits"], e["unresolved"], e["missed"]] for kind, e in found["outside"].items()]),
        f"To be read beside the controls, of whose joints {percent(found['controls']['unknown_joints'])} are called unknown with nothing hidden: the word is worth what they leave of it.",
        "## The error before, after, and with the true model",
        f"![Held-out error](figures/{name}_errors.png)",
        f"Discovered models that beat the true one, refitted, by more than 5 % of the RMS: {', '.join(f'`{k}`' for k in found['true_beaten']) or 'none'}.",
        "## What went wrong, case by case",
        f"Each can be looked at again: `python scripts/blind_benchmark.py --seed {settings['seed']}{mark} --only KEY --verbose`.",
        "### Visible effects not named",
        table(["case", "hidden", "on", "size", "RMS taken away by the true model", "outcome", "named", "RMS after / true"], [
            [f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", lowered_by(r), r["category"], r["named"], f"{r['after'] / r['true']:.2f}" if r.get("true") else "–"] for r in misnamed
        ]) if misnamed else "None.",
        "### Named, and yet farther than 5 % from the true model",
        table(["case", "hidden", "on", "size", "RMS taken away by the true model", "RMS after / true"], [[f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", lowered_by(r), f"{r['after'] / r['true']:.2f}"] for r in far]) if far else "None.",
        "### Controls that are not complete",
        table(["case", "joint", "verdict", "noise's colour [s]", "encoder [bits]", "pace", "nuisances"], [
            [f"`{r['key']}`", v["joint"], " ".join([v["effect"], *(f"(or {t})" for t in family(v, v["joint"]))]) if v["status"] == "missing" else v["status"], *(str(r["conditions"][k] or "–") for k in ("colour", "encoder", "pace")), spelled(r["conditions"].get("nuisances"))]
            for r, v in accused
        ]) if accused else "None.",
        "### Outside the catalogue, neither unknown nor explained",
        table(["case", "hidden", "on", "size", "RMS taken away without it", "named", "misfit removed", "structure left is said"], [
            [f"`{r['key']}`", r["effect"], r["joint"], f"{r['size']:.2f}", lowered_by(r), r["named"], f"{100 * r['removed']:.0f} %" if r.get("removed") is not None else "–", "yes" if r.get("admits") else "no"] for r in outside
        ]) if outside else "None.",
        "### Crashes",
        "\n".join(f"- `{e['key']}` in {e['stage']}: {e['message']}" for e in found["errors"]) or "None.",
        "## Time",
        table(["robot", "cases", "median [s]", "longest [s]"], [[robot, e["cases"], f"{e['median']:.1f}", f"{e['most']:.1f}"] for robot, e in found["seconds"].items()]),
        "One case is two simulated logs, one or more fits of the true model, and `sysid discover`, in one process of several on a shared machine.",
        f"Package source {settings['source']}; " + ", ".join(f"{name} {version}" for name, version in settings["versions"].items()) + ".",
        notes.strip(),
    ]  # fmt: skip
    return "\n\n".join(part for part in parts if part) + "\n"
