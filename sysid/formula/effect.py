"""A formula of the experiment file as a torque effect."""

from __future__ import annotations

import ast
import re

import numpy as np

from ..effect import NotFinite, TorqueEffect
from ..effect_parameters import Linear, Shape, called
from ..motion import Piece
from ..vocabulary import vocabulary
from .ranges import ranges
from .search_range import Range
from .text import OTHER, parse, refused
from .tree import culprit, names_of, signed_terms, value
from .words import near


class Formula(TorqueEffect):
    """A formula of the experiment file."""

    name = "formula"
    looks_like = "what the formula says"
    separate_by = "not stated"
    source = "the experiment file"
    options = {
        "formula": "the torque, every term with a coefficient of its own",
        "name": "its name, where a joint has several (default formula)",
    }

    def __init__(self, text: str, name: str = "formula", signals=()):
        """signals: names of logged signals, which are variables too."""
        if (
            not isinstance(name, str)
            or not re.fullmatch(r"[a-z][a-z0-9_]*", name)
            or name in vocabulary()
        ):
            raise refused(
                f"the formula's name {str(name)[:40]!r}",
                allowed="a word of a-z, 0-9 and _ that is no effect of `sysid effects`",
            )
        self.name, self.text, self.parsed = name, text, parse(text, signals)
        self.equation = f"tau = {text}"
        self._names = names_of(self.parsed.tree)
        parts = [(sign, term, names_of(term)) for sign, term in signed_terms(self.parsed.tree)]
        self._parts = [[p[:2] for p in parts if name in p[2]] for name in self.parsed.linear]
        self.uses_load = bool(self._names & {"load", "tau_load"})
        self.joints: tuple[str, ...] = ()

    @property
    def instantaneous(self):
        return "t" not in self._names and not self.parsed.signals

    def coefficients(self):
        return tuple(
            called(Linear("SI", says="coefficient of the formula"), name)
            for name in self.parsed.linear
        )

    def shapes(self):
        return tuple(
            called(Shape("SI", 1e-3, 1e3, grid=12, says="value inside the formula"), name)
            for name in self.parsed.inner
        )

    def sized(self, motion, rows, joint):
        """Where each value inside the formula can be found on this motion: see `ranges`."""
        if not self.parsed.inner:
            return ()
        known = {
            name: np.broadcast_to(x, motion.t.shape).reshape(2, -1)
            for name, x in self._known(motion, joint).items()
        }
        found = ranges(
            self.parsed.tree,
            self.parsed.inner,
            self.parsed.linear,
            known,
            rows,
            lambda values: self._columns(motion, joint, values),
        )
        return tuple(_shape(name, found[name]) for name in self.parsed.inner)

    def bound(self, robot, joint):
        bound = self.given()
        bound.joints = tuple(re.sub(r"\W", "_", name) for name in robot.joints)
        allowed = [f"{which}_{word}" for which in ("q", "qd", "qdd") for word in bound.joints]
        for name in self.parsed.others:
            if bound.joints.count(OTHER.fullmatch(name)[2]) != 1:
                raise refused(
                    f"{name} in the formula names no joint",
                    allowed=", ".join(f"q_{word}" for word in bound.joints),
                    do=_closest(name, allowed),
                )
        return bound

    def columns(self, motion, joint, **shapes):
        out = self._columns(motion, joint, shapes)
        for k, name in enumerate(self.parsed.linear):
            if not np.isfinite(out[k]).all():
                values = {**self._known(motion, joint), **shapes, **self._alone(name)}
                at = f"t = {motion.t[np.flatnonzero(~np.isfinite(out[k]))[0]]:g} s"
                with np.errstate(all="ignore"):
                    part = ast.unparse(culprit(self.parsed.tree, values))
                where = f"model.effects: {self.name}" + (
                    f" on joint {self.joints[joint]}" if self.joints else ""
                )
                raise NotFinite(
                    f"{part} in the formula is no finite number at {at}",
                    where=where,
                    do="keep it within its domain",
                )
        return out

    def _columns(self, motion: Piece, joint: int, shapes: dict) -> np.ndarray:
        """(k, n): linear in its coefficients and nothing left over, so the column of one is the
        formula with this one alone.
        """
        known, linear = self._known(motion, joint), self.parsed.linear
        out = np.empty((len(linear), len(motion.t)))
        with np.errstate(all="ignore"):
            for k, name in enumerate(linear):
                values = {**known, **shapes, **self._alone(name)}
                out[k] = sum(sign * value(term, values) for sign, term in self._parts[k])
        return out

    def _alone(self, name: str) -> dict[str, float]:
        return {other: float(other == name) for other in self.parsed.linear}

    def _known(self, motion: Piece, joint: int) -> dict:
        """The values of the formula's variables."""
        parsed = self.parsed
        known = {
            "q": motion.q[:, joint],
            "qd": motion.qd[:, joint],
            "qdd": motion.qdd[:, joint],
            "t": motion.t,
            "pi": np.pi,
        }
        if "s" in self._names:
            known["s"] = motion.direction(joint)
        if self.uses_load:
            known["load"] = known["tau_load"] = motion.load[:, joint]
        for name in parsed.others:
            which, other = OTHER.fullmatch(name).groups()
            known[name] = getattr(motion, which)[:, self.joints.index(other)]
        for name in parsed.signals:
            if name not in motion.signals:
                raise refused(
                    f"the signal {name} of the formula is not logged",
                    allowed=", ".join(motion.signals) or "none is; data.signals names them",
                )
            known[name] = motion.signals[name]
        return known


def _shape(name: str, found: Range) -> Shape:
    return called(
        Shape(
            "SI",
            found.low,
            found.high,
            says="value inside the formula",
            least=found.least,
            respaced=found.respaced,
        ),
        name,
    )


def _closest(name: str, allowed: list[str]) -> str | None:
    close = near(name, allowed)
    return f"perhaps {' or '.join(close)}" if close else None
