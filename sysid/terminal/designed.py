"""A designed motion: what it tells, what it stays clear of, how to play it."""

from pathlib import Path

from ..addition import typed
from ..statement.words import NEVER, apart
from ..units import behind
from .next_steps import next_step
from .tables import show_notices

_SHOWN_STD, _FALLS = 20, 0.95  # parameters whose deviation falls most; by less than this it stays what it is


_SEEN = 0.01  # rad or m: what less of a maneuver does is none


def show_design(document: dict, experiment) -> None:
    """What a designed motion promises, and what is left of its limits."""
    best = document["criterion"]["random_best"]
    beside = "" if best is None else f"; of the best random motion that it began from: {best:.1f}"
    print(f"{document['duration']:g} s of motion; what it tells of all parameters (log det of the information): {document['criterion']['log_det']:.1f}{beside}")
    for own in document.get("maneuvers", ()):
        moved = [f"{joint} {size:+.2g}" for joint, size in own["joints"].items() if abs(size) > _SEEN]
        print(f"from {own['start']:g} s on a maneuver of {own['duration']:g} s, {own['kind']}: {', '.join(moved) or 'left out'}")
    left = [f"{name} {100 * share:.1f} %" for name, share in document["margins"].items() if name != "collision"]
    near = document["margins"].get("collision")
    print(f"unused of each limit: {', '.join(left)}" + ("" if near is None else f"; links keep {near:.3g} m apart"))
    never = [pair for pair in document["separates"] if pair["probability"] < NEVER]
    for pair in document["separates"]:
        print(apart(pair))
    told = [(name, s) for name, s in document["expected_std"].items() if s["now"] and s["after"] < _FALLS * s["now"]]
    told.sort(key=lambda one: one[1]["after"] / one[1]["now"])
    if told:
        print("standard deviations that fall most, now and after:")
        for name, s in told[:_SHOWN_STD]:
            print(f"  {name}  {s['now']:.2g} -> {s['after']:.2g}{behind(s['unit'])}")
    show_notices(document)
    print(f"folder: {document['run']}")
    if never and len(never) == len(document["separates"]):  # it was asked for nothing else
        print("another motion is no answer to what was asked; what else may be stands under `separate by`")
        next_step("effects", never[0]["a"].partition(":")[0])
        return
    motion = Path(document["run"]) / "trajectory.csv"
    said = f"play {motion} on the robot, and list its log beside the others in data.train of {experiment.path}"
    next_step("diagnose", typed(experiment.path), first=said)
