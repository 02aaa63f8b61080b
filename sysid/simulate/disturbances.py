"""What a lab does to its robot while it logs: somebody knocks it, brakes close where joints rest.

Both are in the true robot, so that its angles answer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..robot import Robot
from .part import Part
from .usual_sizes import Scales

_REST, _EARLY = 0.3, 0.1  # s from rest to a closed brake; s that it opens before the joint moves
_HOLD = 20.0  # times a joint's peak torque that its brake holds
_KNOCK, _FORCE = (0.02, 0.06), (0.5, 1.5)  # s; of the force that the joints bear at the hand
_SEEN = 3.0  # deviations of a joint's noise from which a knock is said to show on it
_TRIES = 20  # links and directions, of which a knock takes the one that shows on most joints


@dataclass(frozen=True)
class Pulse:
    """A knock: half a sine, squared, of `force` (3,) [N] of the base frame, at `point` (3,) [m] of
    a body's frame."""

    start: float
    stop: float
    row: int
    body: str
    point: np.ndarray
    force: np.ndarray


class Knocks(Part):
    """Pulses that push a link. `pulses`: list of Pulse; after a run, `most` (pulses, n) is the
    largest torque of each."""

    def settle(self, plant):
        self.most = np.zeros((len(self.pulses), plant.n))

    def force(self, plant):
        for k, pulse in enumerate(self.pulses):
            if pulse.start < plant.t < pulse.stop:
                phase = (plant.t - pulse.start) / (pulse.stop - pulse.start)
                needed = torque_of(plant.model, plant.data, plant.tree, pulse)
                push = math.sin(math.pi * phase) ** 2 * (plant.G.T @ needed)
                plant.g += push
                self.most[k] = np.maximum(self.most[k], np.abs(push))

    def events(self, robot: Robot, std) -> list[dict]:
        """When they were, and on which joints they show.

        Args:
            std: deviation (dof,) [N m] of the torque noise.
        """
        out = []
        for pulse, most in zip(self.pulses, self.most[:, : robot.dof]):
            shows = np.flatnonzero(most > _SEEN * std)
            out.append({
                "kind": "knock", "start": pulse.start, "stop": pulse.stop, "joints": shows.tolist(),
                "body": pulse.body, "force": pulse.force.tolist(), "torque": most.tolist(),
            })  # fmt: skip
        return out


def torque_of(model, data, q, pulse: Pulse) -> np.ndarray:
    """Torque (joints,) to overcome under a pulse's full force: J' f at its point."""
    # of a robot of one joint it comes without its second axis
    jacobian = pin.computeJointJacobian(model, data, q, pulse.row + 1).reshape(6, -1)
    pin.forwardKinematics(model, data, q)
    local = data.oMi[pulse.row + 1].rotation.T @ pulse.force
    return jacobian[:3].T @ local + jacobian[3:].T @ np.cross(pulse.point, local)


def draw_knocks(count: int, robot: Robot, reference, scales: Scales, rng) -> list[Pulse]:
    """Knocks of one log, each in its share of the time, where and in the direction, of several
    tried, that shows on most joints."""
    duration, data = float(reference.t[-1]), robot.model.createData()
    links = [b for b, body in enumerate(robot.bodies) if body.kind == "link"]
    G = robot.transmission
    out = []
    for k in range(count):
        start = duration * (k + rng.uniform(0.1, 0.9)) / count
        stop = start + rng.uniform(*_KNOCK)
        pose = G @ reference.q[np.searchsorted(reference.t, start)]
        size = scales.force * rng.uniform(*_FORCE)
        tried = []
        for _ in range(_TRIES):
            b = links[int(rng.integers(len(links)))]
            direction = rng.normal(size=3)
            force, body = size * direction / np.linalg.norm(direction), robot.bodies[b]
            middle = robot.prior[b, 1:4] / robot.prior[b, 0]
            pulse = Pulse(start, stop, body.row, body.name, middle, force)
            share = np.abs(G.T @ torque_of(robot.model, data, pose, pulse)) / scales.torque
            tried.append((float(np.sqrt(share).sum()), pulse))
        out.append(max(tried, key=lambda one: one[0])[1])
    return out


class Brakes(Part):
    """Friction that holds a joint still while its brake is closed. `closed` (n, dof) at the control
    periods from time `start`, `hold` (dof,) [N m]."""

    def level(self, plant, plus, minus, v, load):
        k = min(max(int((plant.t - self.start) / self.period), 0), len(self.closed) - 1)
        for j in np.flatnonzero(self.closed[k]):
            plus[j] += self.hold[j]
            minus[j] += self.hold[j]


def brakes(robot: Robot, closed, start: float, period: float, scales: Scales) -> Brakes:
    """Brakes that are `closed` (n, dof) at the control periods from time `start` [s]."""
    hold = _HOLD * scales.peak
    return Brakes(robot, -1, closed=closed, start=start, period=period, hold=hold)


def closed_at(reference, period: float) -> np.ndarray:
    """Whether each joint's brake is closed (n, dof), from 0.3 s after a rest begins until 0.1 s
    before it ends."""
    rests = (reference.qd == 0.0) & (reference.qdd == 0.0)
    out = np.zeros_like(rests)
    late, early = round(_REST / period), round(_EARLY / period)
    for j in range(rests.shape[1]):
        for first, last in runs(rests[:, j]):
            out[first + late : last if last == len(rests) else last - early, j] = True
    return out


def runs(flags) -> list[tuple[int, int]]:
    """First rows of the stretches where flags (n,) are set, and the rows after their last."""
    padded = np.concatenate([[0], np.asarray(flags, dtype=int), [0]])
    edges = np.flatnonzero(np.diff(padded))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))
