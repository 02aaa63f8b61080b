"""Simulated friction: what resists a motor's turning."""

from __future__ import annotations

import math
from dataclasses import replace

from .part import Part

_EVEN = 0.01  # rad/s over which coupled friction changes sign: it is a second contact, whose sticking is not followed


class Viscous(Part):
    """Fv qd."""

    def truth(self, truth):
        viscous = truth.viscous.copy()
        viscous[self.j] += self.Fv
        return replace(truth, viscous=viscous)


class Coulomb(Part):
    """Fc sign(qd)."""

    def level(self, plant, plus, minus, v, load):
        plus[self.j] += self.Fc
        minus[self.j] += self.Fc


class AsymmetricCoulomb(Part):
    """Fc + dF/2 forward, Fc - dF/2 backward."""

    def level(self, plant, plus, minus, v, load):
        plus[self.j] += 0.5 * self.dF
        minus[self.j] -= 0.5 * self.dF


class AsymmetricViscous(Part):
    """Fv + dFv/2 forward, Fv - dFv/2 backward."""

    def force(self, plant):
        m = plant.motor[self.j]
        plant.g[m] += 0.5 * self.dFv * abs(plant.vm[m])


class Stribeck(Part):
    """dF exp(-(qd/vs)^2) more Coulomb friction."""

    def level(self, plant, plus, minus, v, load):
        more = self.dF * math.exp(-((v[plant.motor[self.j]] / self.vs) ** 2))
        plus[self.j] += more
        minus[self.j] += more


class QuadraticDrag(Part):
    """c |qd| qd."""

    def force(self, plant):
        m = plant.motor[self.j]
        plant.g[m] += self.c * abs(plant.vm[m]) * plant.vm[m]


class SublinearViscous(Part):
    """Fa |qd|^a more Coulomb friction: its slope at rest is infinite, as a contact's."""

    def level(self, plant, plus, minus, v, load):
        more = self.Fa * abs(v[plant.motor[self.j]]) ** self.a
        plus[self.j] += more
        minus[self.j] += more


class Presliding(Part):
    """Dahl: z' = (qd - |qd| z) / x0, torque F z; and `share` of the Coulomb friction gone."""

    fine = True

    def settle(self, plant):
        self.z = 0.0

    def level(self, plant, plus, minus, v, load):
        plus[self.j] *= 1.0 - self.share
        minus[self.j] *= 1.0 - self.share

    def _after(self, way: float) -> float:
        s = math.copysign(1.0, way)
        return s + (self.z - s) * math.exp(-abs(way) / self.x0)

    def push(self, plant, r, x, v, dt):
        m = plant.motor[self.j]
        r[m] -= self.F * self._after(0.5 * dt * plant.v[m])

    def commit(self, plant, before, dt):
        m = plant.motor[self.j]
        self.z = self._after(0.5 * dt * (before[m] + plant.v[m]))


class LoadFriction(Part):
    """mu |load| more Coulomb friction."""

    uses_load = True

    def level(self, plant, plus, minus, v, load):
        more = self.mu * abs(load[self.j])
        plus[self.j] += more
        minus[self.j] += more


class DirectionalEfficiency(Part):
    """e load more torque while the joint drives its load: friction forward under a positive load, backward under a negative."""

    uses_load = True

    def level(self, plant, plus, minus, v, load):
        plus[self.j] += self.e * max(load[self.j], 0.0)
        minus[self.j] += self.e * max(-load[self.j], 0.0)


class PositionFriction(Part):
    """sum a_k cos kq + b_k sin kq more Coulomb friction, of which there is enough (`truth.rubbing`): beside another effect on it
    none is below zero. `waves`: [(k, a_k, b_k)]."""

    def level(self, plant, plus, minus, v, load):
        q = plant.xm[plant.motor[self.j]]
        more = sum(a * math.cos(k * q) + b * math.sin(k * q) for k, a, b in self.waves)
        plus[self.j] = max(plus[self.j] + more, 0.0)
        minus[self.j] = max(minus[self.j] + more, 0.0)


class Warmup(Part):
    """Coulomb and viscous friction times 1 + a exp(-t/T)."""

    def _more(self, t: float) -> float:
        return self.a * math.exp(-max(t, 0.0) / self.T)

    def force(self, plant):
        m = plant.motor[self.j]
        plant.g[m] += self._more(plant.t) * plant.viscous[m] * plant.vm[m]

    def level(self, plant, plus, minus, v, load):
        factor = 1.0 + self._more(plant.t)
        plus[self.j] *= factor
        minus[self.j] *= factor


class JointCoupling(Part):
    """Ia qdd_i + Fv qd_i + Fs sign(qd_i + qd_j) + Fd sign(qd_i - qd_j) in the equation of joint j; `i` the other joint."""

    def settle(self, plant):
        plant.extra[plant.motor[self.j], plant.motor[self.i]] += self.Ia

    def force(self, plant):
        vj, vi = plant.vm[plant.motor[self.j]], plant.vm[plant.motor[self.i]]
        together = self.Fs * math.tanh((vi + vj) / _EVEN) + self.Fd * math.tanh((vi - vj) / _EVEN)
        plant.g[plant.motor[self.j]] += self.Fv * vi + together
