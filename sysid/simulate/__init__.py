"""Simulated logs of a robot that has more in it than its model: closed loop in time, sticking, sensors, hidden effects.

    simulation = simulate(robot, hide=[hidden("stribeck:hip:dF=2,vs=0.1")], seed=1)
    simulation.train.q, simulation.train.tau, simulation.truth
    write(simulation, experiment, "out")
"""

from .folder import load, prepare, write
from .hidden import Hidden, defaults, hidden
from .run import simulate
from .simulated import SimulatedLog, Simulation
from .trajectory import Played, read_trajectory
from .usual_sizes import Scales

__all__ = [
    "Hidden", "Played", "Scales", "SimulatedLog", "Simulation", "defaults", "hidden", "load", "prepare", "read_trajectory", "simulate",
    "write",
]  # fmt: skip
