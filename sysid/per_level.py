"""An effect at one level of a group of logs: there it is what it is, and elsewhere nothing.

Its columns are zero on the rows of logs at other levels, so that its coefficients are told by the
logs of its own level alone, beside everything that all logs share, and one triangle holds them all.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from .deflection import Deflection
from .effect import Effect, MotionEffect, SensorEffect, TorqueEffect, WrenchEffect
from .errors import SysidError

_OWN = ("group", "level", "levels")


class AtLevel:
    """What an effect at a level adds to its kind. group, level: its own; levels: all of the
    group's."""

    group: str
    level: str
    levels: tuple[str, ...]
    simulators = {}  # a robot's description is of one robot
    instantaneous = False  # q, qd and qdd do not say the level

    @property
    def plain(self) -> Effect:
        """The effect without its level."""
        own = {key: value for key, value in vars(self).items() if key not in _OWN}
        return _made(type(self).__bases__[1], own)

    def __reduce_ex__(self, protocol):  # the class is made here, and is no module's
        return at_level, (self.plain, self.group, self.level, self.levels)

    def present(self, motion) -> bool:
        """Whether a motion's log is at this level.

        Raises:
            SysidError: it is at none.
        """
        if self.group not in motion.levels:
            raise SysidError(
                f"{self.name} is per {self.group}, and this log is at no level of it",
                where=motion.source or None, allowed=", ".join(self.levels),
                do=f"list it in data.groups, or give {self.group}=LEVEL",
            )  # fmt: skip
        return motion.levels[self.group] == self.level


class _AddsTorque(AtLevel):
    def columns(self, motion, where, **shapes):
        if self.present(motion):
            return super().columns(motion, where, **shapes)
        rows = (len(self.coefficients()), len(motion.t))
        return np.zeros((where.dof, *rows) if isinstance(self, WrenchEffect) else rows)

    def columns_at(self, motion, joint, tried):
        if self.present(motion):
            return super().columns_at(motion, joint, tried)
        return TorqueEffect.columns_at(self, motion, joint, tried)


class _Moves(AtLevel):
    def moved(self, motion, joint, **how):
        return super().moved(motion, joint, **how) if self.present(motion) else motion


class _Deflects(_Moves):
    def several(self, cases):
        here = [self.present(motion) for _, _, motion, _ in cases]
        made = iter(super().several([case for case, own in zip(cases, here) if own]))
        return [next(made) if own else np.zeros((3, len(c[0]))) for own, c in zip(here, cases)]


class _Senses(AtLevel):
    pass


_KINDS = (
    (Deflection, _Deflects), (MotionEffect, _Moves), (SensorEffect, _Senses),
    (TorqueEffect, _AddsTorque), (WrenchEffect, _AddsTorque),
)  # fmt: skip


@cache
def _kind(plain: type[Effect]) -> type[Effect]:
    (mixin, *_) = (own for kind, own in _KINDS if issubclass(plain, kind))
    return type(plain.__name__, (mixin, plain), {"__doc__": plain.__doc__})


def at_level(effect: Effect, group: str, level: str, levels: tuple[str, ...]) -> Effect:
    """The effect at one level of a group of logs.

    Args:
        levels: all levels of the group.
    """
    own = {"group": group, "level": level, "levels": levels}
    return _made(_kind(type(effect)), {**vars(effect), **own})


def _made(kind: type[Effect], own: dict) -> Effect:
    out = kind.__new__(kind)
    vars(out).update(own)
    return out
