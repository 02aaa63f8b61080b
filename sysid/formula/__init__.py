"""A user's formula -> a torque effect: `a*sin(3*q) + b*qd**3` on the joints that it is given.

`text` parses and checks it, `words` finds mistyped names in it, `ranges` works out where the values
inside it can be found, `effect` makes columns of it.
"""

from .effect import Formula
from .text import Parsed, parse
from .words import FUNCTIONS, VARIABLES

__all__ = ["DESCRIBED", "FUNCTIONS", "VARIABLES", "Formula", "Parsed", "parse"]

#: what `sysid effects formula` says, with the keys of `vocabulary.describe`
DESCRIBED = {
    "name": "formula",
    "summary": "A law of your own: torque as a formula of the motion, whose unknown names are fitted.",
    "kind": "torque",
    "scope": "joint",
    "equation": "what is written: `sysid add EXPERIMENT formula --joint JOINT --option 'formula=a*sin(3*q) + b*qd**3'`",
    "parameters": [],
    "options": {
        "formula": "a sum of terms, each with a coefficient; variables are q, qd, qdd (angle, speed, acceleration), s (sign of the speed), "
        "t (time), load (the torque that the drive carries), q_JOINT, qd_JOINT, qdd_JOINT of other joints, and signals of data.signals; functions are "
        f"{', '.join(sorted(FUNCTIONS))}; every other name is to be found",
        "name": "what it is called in tables, as in name=bump",
    },
    "looks_like": "structure that no effect of the catalogue explains, over the variables that `sysid diagnose` names",
    "tied_with": [],
    "separate_by": "a motion in which its variables do not go together; `sysid diagnose` asks it like any effect where it stands under "
    "model.candidates of the experiment file: {formula: 'a*sin(3*q)', joints: [JOINT]}",
    "maneuvers": [],
    "source": "you",
}
