"""Shares, variables and effects of a statement in words, and lines that break between words."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Sequence

from ..flexible import DIRECTION
from ..refused import not_claimed
from ..units import behind

Members = Sequence[tuple[str, str, float]]  # (effect, joint, probability) of a set
_DIRECTION = "the direction of motion"
_ROUNDING = 1e-20  # in any unit: what is left of a number that is held at nought
_HARDLY = 0.01  # of an error
SURE = 0.9  # the set holds the truth so often
NEVER = 0.05  # probability below which a motion is no answer


def followed(entry: dict, word: Callable[[str], str]) -> str:
    """What a residual follows, alone or with other variables, in words."""
    first, other = word(entry["variable"]), entry.get("with")
    first += f" of {entry['hertz']:.3g} Hz" if "hertz" in entry else ""
    if not other:
        return f"{first} alone"
    told = [_DIRECTION if one == DIRECTION else word(one) for one in other.split(" and ")]
    return f"{first} with {listed(told, 'and')}"


def named(head: tuple[str, str], members: Members) -> list[tuple[str, str]]:
    """The head of a set, with as many of those that the logs cannot tell it from as make the name
    likelier right than wrong: (effect, joint) of each."""
    chances: dict[tuple[str, str], float] = {head: 0.0}
    for *who, p in members:  # with whatever options
        chances[tuple(who)] = chances.get(tuple(who), 0.0) + p
    out, chance = [head], chances.pop(head)
    for who, p in sorted(chances.items(), key=lambda one: -one[1]):
        if round(chance, 2) > 0.5:
            break
        out.append(who)
        chance += p
    return out


def either(own: dict, document: dict, here: str = "") -> str:
    """The effect and joint that a verdict has, or a finding with its command, with what else its
    claim is `named`, said of the joint `here`."""
    out = [(own["effect"], own["joint"])]
    for claim in reversed(document["claims"]):
        told = [(n["effect"], n["joint"]) for n in claim.get("named", ())]
        head = document["findings"][claim["findings"][0]] if "command" in own else own
        if told[:1] == out[:1] and head.get("command") == own.get("command"):
            out = told
    effects, joints = zip(*out)
    if len(set(joints)) == 1:
        return placed(listed(effects, "or"), joints[0], here)
    return listed([placed(*who, here) for who in out], "or")


def all_of(words: Sequence[str]) -> str:
    """Words that hold together, some of which are alternatives."""
    apart = len(words) > 1
    return listed([f"({word})" if apart and " or " in word else word for word in words], "and")


def untold_from(probability: float) -> str:
    """How sure an effect's name is, before what else it may be."""
    if probability >= SURE:
        return f"it is {percent(probability)} likely; these logs do not rule out"
    return f"these logs cannot tell it ({percent(probability)}) from"


def quantity(variable: str) -> str:
    """A variable of the motion in words."""
    kind, _, joint = variable.partition("_")
    word = {"q": "position", "qd": "speed", "qdd": "acceleration", "load": "load"}.get(kind)
    return f"the {word} of {joint}" if word and joint else variable


def option(value) -> str:
    """The value of an option."""
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)


def valued(name: str, p: dict) -> str:
    """A parameter {value, std, unit} with its deviation and its unit, where it has these; without
    a deviation the logs do not tell it from the rest of the model, or it is given."""
    std, held = ("", " (held)") if p["std"] is None else (f" +- {p['std']:.2g}", "")
    value = p["value"] if abs(p["value"]) > _ROUNDING else 0.0
    return f"{name} = {value:.4g}{std}{behind(p['unit'])}{held}"


def untold(parameters: dict[str, dict]) -> str:
    """What is said of an effect that is there and whose parameters {name: {value, std, unit}} are
    nothing beside their deviations, or of which none is known."""
    words = "the held-out error says that it is there, and these logs tell "
    if len(parameters) > 1 and all(p["std"] is None for p in parameters.values()):
        return words + "what its coefficients do together, and none of them alone"
    return words + "its size badly"


def placed(effect: str, joint: str, here: str = "") -> str:
    """An effect with its joint, where that is not `here`."""
    return (
        effect
        if joint == here
        else f"{effect} of the whole robot"
        if joint == "*"
        else f"{effect} on {joint}"
    )


def listed(words: Sequence[str], last: str) -> str:
    """Words as 'a, b or c'."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"


def percent(share: float) -> str:
    """A share or a probability; little is not said to be nothing, nor nearly all to be all."""
    return (
        "less than 1 %"
        if share < 0.005
        else f"{100 if share > 0.9999 else min(round(100 * share), 99)} %"
    )


def wrapped(words: str, width: int, indent: str) -> list[str]:
    """Lines of at most `width`; no word is broken, and no number stands away from its unit."""
    tied = re.sub(r"(?<=\d) (?=%|N\b|s\b|rad|Hz)|(?<=N) (?=m\b)", "\u00a0", words)
    lines = textwrap.wrap(
        tied,
        max(width, 40),
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace("\u00a0", " ") for line in lines]


def otherwise(joint: str, joints: dict[str, dict], after: dict[str, float]) -> bool:
    """Whether a joint's held-out error is another, for a reader, with all that is named.

    Args:
        joints: the document's. after: {joint: held-out RMS with it}.
    """
    before = joints[joint]["rms"]["test"]
    return bool(before) and abs(1.0 - after[joint] / before) >= _HARDLY


def elsewhere(joint: str, joints: dict[str, dict], after: dict[str, float], units) -> str:
    """The joint whose held-out error falls most with an effect on another, where that one's own
    hardly does: what moves a joint may show in the torque of those that it carries.

    Args:
        joints: the document's. after: {joint: held-out RMS with it}. units: {joint: N m or N}.
    """
    before = {j: entry["rms"]["test"] for j, entry in joints.items() if entry["rms"]["test"]}
    falls = {j: 1.0 - after[j] / rms for j, rms in before.items()}
    most = max(falls, key=falls.get, default=joint)
    if most == joint or falls[most] < _HARDLY or falls.get(joint, 0.0) >= _HARDLY:
        return ""
    return f", that of {most} from {before[most]:.4g} to {after[most]:.4g} {units[most]}"


def refused(joint: str, document: dict) -> str:
    """What was looked at on a joint and is not claimed, behind what is said of it."""
    own = (r for r in document["not_claimed"] if r["joint"] == joint)
    return "".join(f"; {not_claimed(r['effect'], r['why'])}" for r in own)


def near(v: dict, document: dict) -> str:
    """How far above its noise floor a joint's error is that is at it, as near as that is known."""
    entry = document["joints"][v["joint"]]
    floor, error = entry["noise_floor"], entry["rms"]["test"]
    if error is not None and document["claims"]:  # with all that is named
        error = document["claims"][-1]["rms_test_after"][v["joint"]]
    if not floor or (error or 0.0) < 1.05 * floor:
        return ""
    times = f"{error / floor:#.3g} times the noise floor"
    known = "; a floor is known to a tenth and two standard errors" if not v.get("says") else ""
    return f"; its error is {times}{known}"


def apart(pair: dict) -> str:
    """How likely a designed motion tells two suspects from each other, as `design.json` has it."""
    both, chance = f"{pair['a']} and {pair['b']}", pair["probability"]
    if chance < NEVER:
        return f"{both}: no motion within these limits is likely to tell them apart"
    said = f"{both} will be told apart with probability {chance:.2f}"
    (less, never), (more, told) = sorted((pair.get(f"if_{k}", chance), pair[k]) for k in "ab")
    if less >= NEVER:
        return said
    return f"{said}: {more:.2f} if it is {told}, hardly ever if it is {never}"
