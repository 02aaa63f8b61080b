"""The verdict on each joint as lines of plain text. A name or a command is never cut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..addition import LIKELY, designs, likely
from ..refused import LOW_PASS
from . import where
from .laws import predicted, tone
from .rivals import as_little, other_options, rivals
from .words import (
    all_of,
    either,
    elsewhere,
    listed,
    near,
    option,
    otherwise,
    percent,
    placed,
    quantity,
    refused,
    untold,
    untold_from,
    valued,
    wrapped,
)

if TYPE_CHECKING:
    from ..diagnose.diagnosis import Diagnosis

ANOTHER = "a motion that tells most of what these logs leave open"
ASKED = "whether a load, a zero or friction changed before the test logs were taken is asked by"
TRIED = "to try it, and see the held-out error before and after"
NO_MORE = "no further effect is supported by these logs"
OWN = "a law of your own can be tried: `sysid effects formula`"
FILTERED = f"with {LOW_PASS} it goes, where it is faster than the cutoff"
BEGIN = "to begin with, a polynomial in what it follows"


@dataclass(frozen=True)
class Told:
    """A document with what else the lines need.

    units: {joint: N m or N}. after: {joint: held-out RMS with all that is named}. sets: of each
    command that adds what is named, the set that this stands in: (effect, joint, probability).
    little: the (effect, joint) in these sets that leave as little as their heads.
    """

    document: dict
    units: dict[str, str]
    after: dict[str, float]
    sets: dict[str, tuple[tuple[str, str, float], ...]]
    little: dict[str, set[tuple[str, str]]]


def told(found: Diagnosis, document: dict) -> Told:
    """A diagnosis and its document."""
    fit = found.fit
    last = found.claims[-1].after if found.claims else fit
    units = {j: "N" if s else "N m" for j, s in zip(fit.joints, fit.model.robot.prismatic)}
    sets = {claim.head.command: claim.set for claim in found.claims}
    return Told(document, units, last.rms("test"), sets, as_little(found))


def verdict(of: Told, width: int) -> list[tuple[str, list[str]]]:
    """What is said of each joint: [(joint and status, lines that begin with these)]."""
    said: dict[str, str] = {}  # under which joint a command stands already
    out = [
        (f"{v['joint']}: {v['status']}", _joint(v, of, width, said)) for v in of.document["verdict"]
    ]
    if of.document.get("next_log"):
        words = f"{where.needing(of.document)}; {ANOTHER} is designed by"
        out.append(("", [*wrapped(words, width, "  "), of.document["next_log"]]))
    if asks := of.document.get("asks_tests"):
        out.append(("", [*wrapped(ASKED, width, "  "), asks]))
    return out


def _joint(v: dict, of: Told, width: int, said: dict[str, str]) -> list[str]:
    joint, status = v["joint"], v["status"]
    falls = otherwise(joint, of.document["joints"], of.after)
    known = {f["command"]: f for f in of.document["findings"]}
    heads = [known[command] for command in v.get("commands", []) if command in known]
    words = [either(f, of.document, joint) for f in heads]
    # what comes in the place of the same effect with other options is named by these
    words = [
        word.replace(f["effect"], _with_options(f), 1) if word in words[:k] else word
        for k, (word, f) in enumerate(zip(words, heads))
    ]
    named = all_of(words) if heads else ""
    first = {
        "complete": lambda: NO_MORE + near(v, of.document) + refused(joint, of.document),
        "explained": lambda: (
            f"by {all_of([either(c, of.document) for c in v['by']])}; {_fall(v, of)}"
        ),
        "unresolved": lambda: v["says"] + (f"; {_fall(v, of)}" if of.sets and falls else ""),
        "missing": lambda: f"{named or v['effect']}; {_fall(v, of)}",
        "unknown": lambda: (
            "no effect of the catalogue explains what is left"
            + (f"; part of it looks like {named}; {_fall(v, of)}" if named else "")
        ),
    }[status]()
    lines = wrapped(f"{joint}: {status}: {first}", width, "  ")
    left = predicted(v, quantity, percent)
    rest = wrapped(f"  {left}", width, "    ") if left else []
    if status == "unknown":
        lines += rest
    for head in heads:
        lines += _head(head, of, joint, width, said)
    lines += rest if status != "unknown" else []
    if status != "unresolved" and v.get("says"):
        lines += wrapped(f"  {v['says']}", width, "    ")
    if "may_be" in v and said.setdefault(v["may_be"]["command"], joint) == joint:
        lines += [f"  {TRIED}", v["may_be"]["command"]]
    if words := where.struck(v, of.document):
        lines += wrapped(f"  {words}", width, "    ")
    if status == "unknown":
        law = v.get("law")
        own = FILTERED if tone(v) else f"{OWN}{f'; {BEGIN}' if law else ''}"
        lines += wrapped(f"  {own}", width, "    ")
        lines += [law["command"]] if law else []
    return lines


def _fall(v: dict, of: Told) -> str:
    """Which share of the misfit all that is named explains, and what the held-out error does."""
    joint, entry = v["joint"], of.document["joints"][v["joint"]]
    error = f"{entry['rms']['test']:.4g} to {of.after[joint]:.4g} {of.units[joint]}"
    also = elsewhere(joint, of.document["joints"], of.after, of.units) if "commands" in v else ""
    fall = f"the held-out error goes from {error}{also}"
    it = together(v, of.document)
    if entry["noise_floor"] is None or v.get("explained") is None:
        return f"{it} {fall}"
    return f"{it} {percent(max(v['explained'], 0.0))} of the misfit is explained, {fall}"


def together(v: dict, document: dict) -> str:
    """What a joint's error falls with: all that is named, or the one effect, by name where it is
    another joint's."""
    heads = [document["findings"][claim["findings"][0]] for claim in document["claims"]]
    if len(heads) != 1:
        return "with all that is named"
    own = "commands" in v or "by" in v
    return "with it" if own else f"with {placed(heads[0]['effect'], heads[0]['joint'])}"


def _head(f: dict, of: Told, joint: str, width: int, said: dict[str, str]) -> list[str]:
    """One effect that is named: what it takes, its parameters, its ties, the command."""
    if f["command"] in said:
        return wrapped(f"  {f['effect']}: see {said[f['command']]}", width, "    ")
    said[f["command"]] = joint
    told = [(name.rpartition(".")[2], p) for name, p in f["parameters"].items()]
    values = [valued(name, p) for name, p in told if p["value"] is not None]
    takes, beside = "", "with all that is named " if len(of.sets) > 1 else ""
    if beside and f["misfit_known"]:
        where = "" if f["joint"] == joint else " on all joints"
        takes = f" takes {percent(max(f['misfit_removed'], 0.0))} of what was left{where}"
    numbers = f"{';' if takes else ':'} {beside}{', '.join(values)}" if values else ""
    words = f"  {f['effect']}{takes}{numbers}"
    out = wrapped(words, width, "    ") if takes or values else []
    for name, value in f["options"].items():
        out += wrapped(f"  {name} {option(value)}: {f['options_say'][name]}", width, "    ")
    if (link := f.get("link")) and "link" not in f["options"]:
        words = f"  on the last link, {link}; `--option link=NAME` asks it of another"
        out += wrapped(words, width, "    ")
    if others := other_options(f["or_options"]):
        words = f"  with {listed(others, 'or')} it does as well, for all that these logs tell"
        out += wrapped(words, width, "    ")
    if not f["size_told"]:
        out += wrapped(f"  {untold(f['parameters'])}", width, "    ")
    others = [m for m in of.sets[f["command"]] if m[:2] != (f["effect"], f["joint"])]
    if told := likely(others):
        rest = listed(rivals(told, f, of.little[f["command"]]), "or")
        words = f"  {untold_from(f['probability'])} {rest}"
        out += wrapped(words, width, "    ")
        line = designs(f["command"], (f["effect"], f["joint"]), told)
        more = "; or, if a motion can, by" if line else ""
        out += wrapped(f"  to separate them: {f['separate_by']}{more}", width, "    ")
        out += [line] if line else []
    if few := [placed(e, j, f["joint"]) for e, j, p in others if p < LIKELY]:
        words = f"  not ruled out, though less than 1 % likely: {listed(few, 'and')}"
        out += wrapped(words, width, "    ")
    printed = {line for v in of.document["verdict"] for line in v.get("commands", ())}
    first = [
        placed(one["effect"], one["joint"])
        for one in of.document["findings"]
        if 0 < (one["joins_as_step"] or 0) < (f["joins_as_step"] or 0)
        if one["command"] in printed and one["command"] not in said
    ]  # what is told further down
    after = f", after {listed(first, 'and')}," if first else ""
    return [*out, *wrapped(f"  add it{after} with", width, "    "), f["command"]]


def _with_options(f: dict) -> str:
    own = [f"{name} {option(value)}" for name, value in f["options"].items()]
    return f"{f['effect']} with {listed(own or ['none'], 'and')}"
