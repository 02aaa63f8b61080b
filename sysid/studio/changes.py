"""What a click means: one change of the experiment's text, with what it is called."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from .. import effect_entry, yaml_edit, yaml_text
from ..errors import SysidError
from ..vocabulary import find, vocabulary
from .diagnosed import Diagnosed
from .workspace import Workspace

Part = tuple[str, list[str] | None, dict]  # an effect's word, its joints, its options


@dataclass(frozen=True)
class Change:
    """An edit of the text of an experiment file.

    make: gives the new text. said: what it adds, in a word or a few; where: on which joints, `*`
    for all of them.
    """

    make: Callable[[str], str]
    said: str
    where: str

    @property
    def words(self) -> str:
        """What it adds, and where."""
        return self.said + ("" if self.where == "*" else f" on {self.where}")


def meant(body: dict, found: Callable[[], Diagnosed], seen: Callable[[], Workspace], path: Path):
    """The change that a request asks for.

    Args:
        body: of the request: `finding`, a number; `steps`, true; `mask`, a stretch of time; or
            `effect` or `formula`, with `joint` and `options`.
        found, seen: give what was diagnosed, and the fit's workspace, where it is needed.
        path: of the experiment file.

    Raises:
        SysidError: it asks for nothing that can be done.
    """
    if "finding" in body:
        return of_effects([_suspect(found(), body["finding"])], path)
    if body.get("steps") is True:
        named = [_adds(found().said["findings"][k]) for _, k in found().offered()]
        if not named:
            raise SysidError("the diagnosis names no step to add", do="reload")
        return of_effects(named, path, "*")
    if "mask" in body:
        return of_mask(body["mask"], seen(), path)
    return of_effects([_own(body)], path)


def of_effects(parts: Sequence[Part], path: Path, where: str | None = None) -> Change:
    """Effects that join the model, all in one change.

    Args:
        where: the joints as the change is called; by default those of the first.
    """

    def make(text: str) -> str:
        for effect, joints, options in parts:
            text = effect_entry.with_effect(text, effect, joints, options, str(path))
        return text

    words = ", ".join(e if e != "formula" else options["formula"] for e, _, options in parts)
    first = parts[0][1]
    return Change(make, words, where or ("*" if first is None else ", ".join(first)))


def of_mask(asked: dict, seen: Workspace, path: Path) -> Change:
    """A stretch of the logs that is left out, on the clock of each log that it touches.

    Args:
        asked: {"part", "from", "to" [s] on the axis of the logs end to end, "joint": number, or
            None for every joint}.
    """
    if not isinstance(asked, dict):
        raise SysidError("mask must be {part, from, to, joint}")
    ends = [asked.get(key) for key in ("from", "to")]
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in ends):
        raise SysidError("a stretch of time needs two numbers")
    joint = asked.get("joint")
    if joint is not None and (isinstance(joint, bool) or not isinstance(joint, int)):
        raise SysidError("joint must be a number")
    name = None if joint is None else seen.joint(joint)
    stretches = seen.own_clocks(str(asked.get("part")), *map(float, ends))
    if not stretches:
        raise SysidError("no row of these logs lies there")
    masks = [
        {"log": log, "start": low, "stop": high, **({} if name is None else {"joints": [name]})}
        for log, low, high in stretches
    ]
    make = partial(yaml_edit.edited, edit=lambda tree: _mask(tree, masks), where=str(path))
    span = ", ".join(f"{m['start']:.4g} to {m['stop']:.4g} s of {m['log']}" for m in masks)
    return Change(make, f"mask {span}", name or "*")


def _mask(tree, masks: list[dict]) -> None:
    own = tree.setdefault("preprocess", {})
    if own.get("mask") is None:
        own["mask"] = []
    own["mask"].extend(yaml_edit.flow(mask) for mask in masks)


def _suspect(found: Diagnosed, number) -> Part:
    if isinstance(number, bool) or not isinstance(number, int):
        raise SysidError("finding must be a number")
    if not 0 <= number < len(found.said["findings"]):
        raise SysidError("there is no such suspect", do="reload")
    return _adds(found.said["findings"][number])


def _adds(finding: dict) -> Part:
    adds = finding["adds"]
    return adds["effect"], adds["joints"], adds["options"]


def _own(body: dict) -> Part:
    """An effect of the vocabulary, or a formula of the user's own."""
    joint = body.get("joint")
    if not isinstance(joint, str | None):
        raise SysidError("joint must be a text")
    joints = None if joint in (None, "*") else [joint]
    if "formula" in body:
        formula = body["formula"]
        if not isinstance(formula, str) or not formula.strip():
            raise SysidError("there is no formula", do="write one, such as a*sin(3*q)")
        return "formula", joints, {"formula": formula.strip()}
    effect = body.get("effect")
    if not isinstance(effect, str):
        raise SysidError("effect must be a text")
    if effect == "formula":  # as a diagnosis spells a law: with its name
        return effect, joints, _options(body.get("options", {}))
    if effect not in vocabulary():
        raise SysidError("there is no such effect", allowed=", ".join(vocabulary()))
    joints = None if find(effect).scope == "robot" else joints
    return effect, joints, _options(body.get("options", {}))


def _options(given) -> dict:
    """Options as they were typed, each in YAML; what was left empty is not given."""
    if not isinstance(given, dict) or not all(isinstance(v, str) for v in given.values()):
        raise SysidError("options must be {name: text}")
    typed = {name: text for name, text in given.items() if text.strip()}
    return {n: yaml_text.plain(yaml_text.parse_yaml(text, where=n)) for n, text in typed.items()}
