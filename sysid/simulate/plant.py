"""The true robot in time: bodies, rotors, friction that truly sticks, and whatever is hidden in it.

    M(x) a + h(x, v) + smooth(x, v) + f = u

x are the joint coordinates, then one for the motor of each joint whose drive is not rigid. M, h and the smooth terms
are taken at the predicted middle of a control period, where an error of first order vanishes. In each step

    M (v' - v) = dt (u - h - smooth - f)

is solved for v' and the friction f together, with f = +level where the joint slides forward, -level backward, and
anything between while it sticks (Moreau's time stepping, by projected Gauss-Seidel). Nothing is regularised. A step is
half a control period, in which the command is constant; where some joint reverses, stops or breaks away in it, it is
taken again in `FINE` steps.

Source: Moreau 1988; Jean 1999; leapfrog positions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from ..robot import Robot
from .part import Part

FINE = 4  # steps in half a control period where friction changes, and always where a part asks for it
_SWEEPS, _CONVERGED = 60, 1e-11  # Gauss-Seidel passes; change of friction, as a share of its level


@dataclass(frozen=True)
class Truth:
    """What is truly there: bodies (bodies, 10), gravity (3,), viscous and Coulomb friction (dof,), and the inertia (dof,) of
    motors that the robot's description has no rotor for."""

    pi: np.ndarray
    gravity: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    armature: np.ndarray

    def with_payload(self, body: int, parameters) -> Truth:
        """With more mass on one body."""
        pi = self.pi.copy()
        pi[body] += parameters
        return replace(self, pi=pi)


class Plant:
    """The state of the true robot, one control period at a time.

    motor (dof,): the coordinate that each joint's motor and friction act on, its own unless the drive is not rigid.
    Public to parts: x, v, a (n,) of the coordinates; g (n,) the forces to overcome; xm, vm, t of the period's middle.
    """

    def __init__(self, robot: Robot, truth: Truth, parts: list[Part], q):
        """At rest with the motors at q (dof,)."""
        for part in parts:
            truth = part.truth(truth)
        self.dof, self.parts = robot.dof, parts
        self.model = robot.with_inertias(truth.pi)
        self.model.gravity.linear = np.array(truth.gravity)
        self.data = self.model.createData()
        loose = [j for j in range(robot.dof) if any(part.loosens(j) for part in parts)]
        self.motor = [robot.dof + loose.index(j) if j in loose else j for j in range(robot.dof)]
        n = self.n = robot.dof + len(loose)
        self.G = self._tree(robot)
        self.rigid = self.G.shape == (n, n) and np.array_equal(self.G, np.eye(n))
        self.extra = np.zeros((n, n))
        self.extra[self.motor, self.motor] = truth.armature
        for part in parts:
            part.settle(self)
        self.symmetric = np.array_equal(self.extra, self.extra.T)
        self.viscous = np.zeros(n)
        self.viscous[self.motor] = truth.viscous
        self.plus, self.minus = truth.coulomb.tolist(), truth.coulomb.tolist()
        self.forces, self.levels, self.pushes = ([p for p in parts if p.has(hook)] for hook in ("force", "level", "push"))
        self.commits = [p for p in parts if p.has("commit")]
        self.drives = [p for p in parts if p.has("drive")]
        self.uses_load = any(part.uses_load for part in parts)
        self.fine = any(part.fine for part in parts)
        self.eye = np.eye(n, order="F")
        self.x, self.v, self.a = np.zeros(n), np.zeros(n), np.zeros(n)
        self.x[: self.dof] = q
        for j in loose:
            self.x[self.motor[j]] = q[j]
        self.sign = [0] * self.dof  # 1 or -1 sliding, 0 sticking
        self.held = [0.0] * self.dof  # friction of each joint [N m]
        self.t = 0.0
        self.freeze(0.0, 0.0)
        for part in parts:
            part.rest(self)

    def _tree(self, robot: Robot) -> np.ndarray:
        """Speeds of the full tree from those of the coordinates: links follow links, rotors follow motors."""
        G = np.zeros((robot.transmission.shape[0], self.n))
        for body in robot.bodies:
            for j in np.flatnonzero(robot.transmission[body.row]):
                G[body.row, self.motor[j] if body.kind == "rotor" else j] = robot.transmission[body.row, j]
        return G

    def freeze(self, t: float, ahead: float) -> None:
        """Take mass matrix and smooth forces at time t [s], `ahead` seconds from now."""
        self.t = t
        xm = self.xm = self.x + ahead * self.v + (0.5 * ahead * ahead) * self.a
        vm = self.vm = self.v + ahead * self.a
        if self.rigid:
            self.tree = xm
            M = pin.crba(self.model, self.data, xm)
            h = pin.nonLinearEffects(self.model, self.data, xm, vm)
        else:
            G = self.G
            self.tree = G.dot(xm)
            M = G.T.dot(pin.crba(self.model, self.data, self.tree)).dot(G)
            h = G.T.dot(pin.nonLinearEffects(self.model, self.data, self.tree, G.dot(vm)))
        self.bodies, self.h, self.M = M, h, M + self.extra
        self.W = dposv(self.M, self.eye)[1] if self.symmetric else np.linalg.inv(self.M)
        if self.forces:
            self.g = h.copy()
            for part in self.forces:
                part.force(self)
        else:
            self.g = h

    def load(self, a) -> np.ndarray:
        """Torque (dof,) that the bodies alone need at the period's middle with accelerations a (n,)."""
        needed = self.bodies.dot(a) + self.h
        if self.n == self.dof:
            return needed
        load = needed[: self.dof].copy()
        for j, m in enumerate(self.motor):
            if m != j:
                load[j] += needed[m]
        return load

    def advance(self, command, duration: float) -> None:
        """Move on by half a control period under constant motor torque (dof,)."""
        for part in self.drives:
            command = part.drive(command, duration)
        if self.n == self.dof:
            u = command
        else:
            u = np.zeros(self.n)
            u[self.motor] = command
        if self.fine or not self._step(u, duration, False):
            for _ in range(FINE):
                self._step(u, duration / FINE, True)

    def _step(self, u, dt: float, settle: bool) -> bool:
        """One step; where `settle` is not set and a joint changes between sliding and sticking, leave all as it was."""
        half, v, W = 0.5 * dt, self.v, self.W
        vm = v + half * self.a
        r = u - self.g - self.viscous * vm
        if self.pushes:
            xm = self.x + half * v
            for part in self.pushes:
                part.push(self, r, xm, vm, dt)
        if self.levels:
            a = self.a
            for _ in range(3 if self.uses_load else 1):
                plus, minus = self._levels(vm, a)
                f, sign, a, v1, changed = self._slide(r, plus, minus, v, W, dt)
        else:
            f, sign, a, v1, changed = self._slide(r, self.plus, self.minus, v, W, dt)
        if changed and not settle:
            return False
        self.x = self.x + half * (v + v1)
        self.v, self.a, self.held, self.sign = v1, a, f, sign
        for part in self.commits:
            part.commit(self, v, dt)
        return True

    def _levels(self, vm, a) -> tuple[list[float], list[float]]:
        plus, minus = self.plus[:], self.minus[:]
        load = self.load(a).tolist() if self.uses_load else None
        for part in self.levels:
            part.level(self, plus, minus, vm, load)
        return plus, minus

    def _slide(self, r, plus, minus, v, W, dt: float):
        """Friction, signs, acceleration and speed after dt, and whether a joint changed between sliding and sticking."""
        before, motor = self.sign, self.motor
        f = [plus[j] if s > 0 else -minus[j] if s < 0 else self.held[j] for j, s in enumerate(before)]
        if self.n == self.dof:
            a = W.dot(r - f)
        else:
            spread = np.zeros(self.n)
            spread[motor] = f
            a = W.dot(r - spread)
        v1 = v + dt * a
        speeds = v1.tolist()
        active = [j for j, s in enumerate(before) if s * speeds[motor[j]] <= 0.0]
        if not active:
            return f, before, a, v1, False
        diagonal = W.diagonal().tolist()
        for _ in range(_SWEEPS):
            moved = 0.0
            for j in active:
                m = motor[j]
                compliance = dt * diagonal[m]
                new = min(max(f[j] + speeds[m] / compliance, -minus[j]), plus[j])
                if (change := new - f[j]) != 0.0:
                    v1 = v1 - (dt * change) * W[:, m]
                    speeds = v1.tolist()
                    f[j] = new
                    moved = max(moved, abs(change) / (plus[j] + minus[j]))
            for j, s in enumerate(before):
                if s * speeds[motor[j]] < 0.0 and j not in active:
                    active.append(j)
                    moved = 1.0
            if moved < _CONVERGED:
                break
        sign = before[:]
        for j in active:
            if -minus[j] < f[j] < plus[j]:
                sign[j] = 0
                v1[motor[j]] = 0.0
            else:
                sign[j] = 1 if f[j] > 0.0 else -1
        return f, sign, (v1 - v) / dt, v1, sign != before
