"""What stands between the robot and its log: late and wrong readings, drives that saturate or lag."""

from __future__ import annotations

import math

import numpy as np

from .part import Part


class CurrentLag(Part):
    """The motor's torque follows what is asked for and logged through a first-order lag T."""

    def settle(self, plant):
        self.y = None

    def drive(self, command, duration):
        asked = float(command[self.j])
        if self.y is None:
            self.y = asked
        gone = math.exp(-duration / self.T)
        command = command.copy()
        command[self.j] = asked + (self.y - asked) * (1.0 - gone) * self.T / duration
        self.y = asked + (self.y - asked) * gone
        return command


class Delay(Part):
    """Torque is logged d seconds late."""

    def sense(self, tau, period):
        t = period * np.arange(len(tau))
        return np.interp(t - self.d, t, tau)


class TorqueGain(Part):
    """(1 + e) times the torque is logged."""

    def sense(self, tau, period):
        return (1.0 + self.e) * tau


class TorqueSaturation(Part):
    """Torque beyond the limit reads flat. (`reports: actual`)"""

    def sense(self, tau, period):
        return np.clip(tau, -self.limit, self.limit)


class SaturatedDrive(Part):
    """No torque beyond the limit acts, and what was asked for is logged. (`reports: command`)"""

    def drive(self, command, duration):
        command = command.copy()
        command[self.j] = min(max(float(command[self.j]), -self.limit), self.limit)
        return command


class TorqueBias(Part):
    """b more is logged."""

    def sense(self, tau, period):
        return tau + self.b


class EncoderOffset(Part):
    """The true angle is the logged one plus d."""

    def read(self, angle):
        return angle - self.d


class EncoderEccentricity(Part):
    """The true angle is the logged one plus d sin(logged + phi)."""

    def read(self, angle):
        logged = angle
        for _ in range(12):  # a contraction by d each time
            logged = angle - self.d * math.sin(logged + self.phi)
        return logged
