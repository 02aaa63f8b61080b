"""Simulated transmissions: a spring or play between a motor and its link."""

from __future__ import annotations

import math

import numpy as np

from .part import Part

_CONTACT = 2.0 * math.pi * 80.0  # rad/s: what the teeth of a gear with play swing at when they touch


_CONTACT_DAMPING = 0.4


class Elasticity(Part):
    """Motor and link apart, K (theta - q) + D (theta' - q') between them."""

    fine = True

    def loosens(self, joint):
        return joint == self.j

    def rest(self, plant):
        plant.x[self.j] -= plant.h[self.j] / self.K

    def push(self, plant, r, x, v, dt):
        j, m = self.j, plant.motor[self.j]
        torque = self.K * (x[m] - x[j]) + self.D * (v[m] - v[j])
        r[m] -= torque
        r[j] += torque


class Backlash(Part):
    """Motor and link apart by up to b/2 to either side, then teeth that touch: stiff, damped, and never pulling."""

    fine = True

    def loosens(self, joint):
        return joint == self.j

    def rest(self, plant):
        j, m = self.j, plant.motor[self.j]
        link, motor = plant.M[j, j], plant.M[m, m]
        reduced = link * motor / (link + motor)
        self.K, self.D = _CONTACT**2 * reduced, 2.0 * _CONTACT_DAMPING * _CONTACT * reduced
        plant.x[j] -= plant.h[j] / self.K + 0.5 * self.b * np.sign(plant.h[j])

    def push(self, plant, r, x, v, dt):
        j, m = self.j, plant.motor[self.j]
        apart = x[m] - x[j]
        deep = apart - 0.5 * self.b if apart > 0.0 else apart + 0.5 * self.b
        if deep * apart <= 0.0:
            return
        torque = self.K * deep + self.D * (v[m] - v[j])
        if torque * apart > 0.0:
            r[m] -= torque
            r[j] += torque
