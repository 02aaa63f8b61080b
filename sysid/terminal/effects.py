"""The vocabulary: every effect with its parameters."""

from collections.abc import Iterator

from ..statement import text
from ..units import behind
from .tables import terminal_width


def show_effects(found: list[dict]) -> None:
    """The catalogue, a line an effect; of one alone all that is known."""
    if len(found) > 1:
        left = max(len(effect["name"]) for effect in found)
        for effect in found:
            words = f"{effect['name']:<{left}}  {effect['summary'].partition('. ')[0].rstrip('.')}"
            print("\n".join(text.wrapped(words, terminal_width(), " " * (left + 2))))
        print("next: sysid effects NAME")
        return
    for effect in found:
        for line in _described(effect):
            print("\n".join(text.wrapped(line, terminal_width(), " " * _LEFT)))


_LEFT = 15  # columns before what is said


def _described(effect: dict) -> Iterator[str]:
    yield f"{effect['name']}: {effect['summary']}"
    yield f"  kind         {effect['kind']}, of {'the whole robot' if effect['scope'] == 'robot' else 'a joint'}"
    yield f"  equation     {effect['equation']}"
    for parameter in effect["parameters"]:
        yield f"  {parameter['name']:<12}{behind(parameter['unit'])}{_bounds(parameter)}: {parameter['says']}"
    for option, says in effect["options"].items():
        yield f"  {option + ':':<12} {says}"
    yield f"  looks like   {effect['looks_like']}"
    yield f"  tied with    {', '.join(effect['tied_with']) or 'nothing known'}"
    yield f"  separate by  {effect['separate_by']}"
    if effect.get("maneuvers"):
        yield f"  maneuvers    {', '.join(effect['maneuvers'])}: `sysid design --separate` tries them"
    yield f"  source       {effect['source']}"


_SHARES = {"speed": "times the joint's top speed", "torque": "times its greatest torque", "angle": "times the angle it travels", "softness": "times the angle it travels over its greatest torque", "duration": "times the longest log"}


def _bounds(parameter: dict) -> str:
    """What a parameter may be, in words."""
    if "upper" not in parameter:
        return ", not negative" if parameter["lower"] == 0 else ""
    share = _SHARES.get(parameter["share_of"])
    return f", {parameter['lower']:g} to {parameter['upper']:g}" + (f" {share}" if share else "")
