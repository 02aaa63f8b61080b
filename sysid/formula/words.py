"""The words of a formula, and what looks like one of them mistyped.

A name that is no word of this list is a value to be found, so a mistyped word would be fitted
without a sound. What a slip looks like, and is refused with the names it may have meant:

- another case (`Q`, `Load`); but `T` beside `t` is a time constant, so where the word itself stands
  in the formula too the two are meant to be different;
- a letter doubled or two neighbours exchanged (`tauu`, `dq`), and in words of four letters or more
  one letter more, less or other (`lod`, `sigm`): of shorter words that makes names which people
  mean;
- a word with a number (`qdd1`), unless it is added to that word or taken from it: `q0` in `q - q0`;
- what other programs call these things (`qdot`, `velocity`, `sgn`).
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

import numpy as np

FUNCTIONS = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log,
    "sqrt": np.sqrt, "abs": np.abs, "sign": np.sign, "tanh": np.tanh, "sinh": np.sinh,
    "cosh": np.cosh, "atan": np.arctan, "min": np.minimum, "max": np.maximum,
}  # fmt: skip
VARIABLES = {
    "q": "position", "qd": "velocity", "qdd": "acceleration",
    "s": "sign of the velocity", "t": "time [s]", "pi": "3.14159",
    "load": "torque that the bodies need", "tau_load": "the same",
}  # fmt: skip
# measured torque, which no formula may use, is still a word that may be mistyped
_WORDS = (*VARIABLES, *FUNCTIONS, "tau", "torque")
_LONG = 4  # letters of which one may be wrong

_ELSEWHERE = {
    "q": ("pos", "position", "angle", "qpos"),
    "qd": ("qdot", "q_dot", "qp", "vel", "velocity", "qvel", "speed"),
    "qdd": ("qddot", "q_ddot", "ddq", "qpp", "acc", "acceleration", "qacc"),
    "t": ("time",),
    "load": ("torque_load",),
    "sign": ("sgn", "signum"), "atan": ("arctan",), "log": ("ln",), "abs": ("fabs",),
    "max": ("maximum",), "min": ("minimum",),
}  # fmt: skip
_MEANT = {alias: word for word, aliases in _ELSEWHERE.items() for alias in aliases}


def near(name: str, words: Iterable[str]) -> list[str]:
    """Words that a name may have meant, likeliest first; none where it is like none."""
    words = list(words)
    lowered = {word.lower(): word for word in words}
    first = [_MEANT[name.lower()]] if _MEANT.get(name.lower()) in words else []
    stem = re.sub(r"_?\d+$", "", name)
    likely = [w for w in words if _slip(name, w) or stem == w]
    rest = [lowered[w] for w in difflib.get_close_matches(name.lower(), lowered, n=3, cutoff=0.6)]
    return list(dict.fromkeys([*first, *likely, *rest]))[:3]


def mistyped(
    name: str, present: set[str], beside: set[str], signals: Iterable[str] = ()
) -> list[str]:
    """The words that a free name looks like; empty where it is a name of its own.

    Args:
        present: all names of the formula. beside: the variables in the sums that the name is a
            term of. signals: names of logged signals.
    """
    words = [*_WORDS, *signals]
    if name in words:
        return []
    if name.lower() in _MEANT:
        return near(name, words)
    for word in words:
        if name.lower() == word.lower():
            if word not in present:
                return near(name, words)
        elif _slip(name, word):
            return near(name, words)
    stem = re.sub(r"_?\d+$", "", name)
    return near(name, words) if stem != name and stem in words and stem not in beside else []


def _slip(name: str, word: str) -> bool:
    """Whether a name is a word of at least two letters with one slip of the fingers."""
    a, b = name.lower(), word.lower()
    if a == b:
        return name != word
    if len(a) == len(b) + 1 and any(a == b[: k + 1] + b[k:] for k in range(len(b))):
        return True
    if len(b) < 2:
        return False
    if any(a == b[:k] + b[k + 1] + b[k] + b[k + 2 :] for k in range(len(b) - 1)):
        return True
    if len(b) < _LONG or a.rstrip("0123456789") == b:
        return False
    longer, shorter = (a, b) if len(a) > len(b) else (b, a)
    if len(longer) == len(shorter):
        return sum(x != y for x, y in zip(a, b)) == 1
    return len(longer) == len(shorter) + 1 and any(
        longer[:k] + longer[k + 1 :] == shorter for k in range(len(longer))
    )
