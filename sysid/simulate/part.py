"""What every simulated effect may do: change the truth, a force, friction's level, a command, a reading."""

from __future__ import annotations

from ..robot import Robot


class Part:
    """Does nothing. A part overrides the hooks that it needs.

    fine: it needs the fine steps always. uses_load: its `level` looks at the load.
    """

    fine = False
    uses_load = False

    def __init__(self, robot: Robot, joint: int, **values):
        self.j = joint
        vars(self).update(values)

    def has(self, hook: str) -> bool:
        """Whether it overrides a hook."""
        return getattr(type(self), hook) is not getattr(Part, hook)

    def truth(self, truth):
        """Bodies, gravity and friction with this part in them."""
        return truth

    def loosens(self, joint: int) -> bool:
        """Whether the joint's motor and link move apart."""
        return False

    def settle(self, plant) -> None:
        """Once, before anything moves: constant inertia into plant.extra (n, n)."""

    def rest(self, plant) -> None:
        """Once, at the start: where it leaves the links at rest."""

    def force(self, plant) -> None:
        """Each period: a smooth force to overcome, added to plant.g (n,), from plant.xm, vm, t."""

    def level(self, plant, plus: list[float], minus: list[float], v, load) -> None:
        """Each step: the friction level of each joint forward and backward, changed in place."""

    def push(self, plant, r, x, v, dt: float) -> None:
        """Each step: a force that changes within a period, taken from r (n,)."""

    def commit(self, plant, before, dt: float) -> None:
        """After each step: remember."""

    def drive(self, command, duration: float):
        """The torque (dof,) that acts where `command` was asked for."""
        return command

    def read(self, angle: float) -> float:
        """What the encoder reads at an angle."""
        return angle

    def sense(self, tau, period: float):
        """What is logged of the joint's torque tau (n,), sampled every `period`."""
        return tau
