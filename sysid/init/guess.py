"""What was guessed, and why: every entry of the experiment that nobody stated, and all of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any


@dataclass(frozen=True)
class Guess:
    """One entry of the experiment: its key ("data.units.time"), its value, and why. doubt: what to
    look at where it may well be wrong, "" where it is as good as stated. alone: of a unit, the one
    joint that may have another."""

    key: str
    value: Any
    why: str
    doubt: str = ""
    alone: str = ""

    def __str__(self) -> str:
        return self.why + (f"; LOOK: {self.doubt}" if self.doubt else "")


@dataclass(frozen=True)
class Draft:
    """An experiment that nobody stated. urdf: the robot's file from its folder; guesses: by the key
    of each entry; notes: what to look at; rest: columns that nothing was made of."""

    urdf: str
    guesses: dict[str, Guess]
    notes: tuple[str, ...]
    rest: tuple[str, ...]

    def having(self, *guesses: Guess) -> Draft:
        """The draft with these guesses in place of others of the same key."""
        return replace(self, guesses=self.guesses | {guess.key: guess for guess in guesses})

    @property
    def tree(self) -> dict:
        """The experiment file as plain values."""
        out: dict = {"robot": {"urdf": self.urdf}, "data": {}, "actuator": {}, "preprocess": {}}
        for key, guess in self.guesses.items():
            *path, last = key.split(".")
            node = out
            for step in path:
                node = node.setdefault(step, {})
            node[last] = guess.value
        return out
