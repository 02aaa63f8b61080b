"""A base that does not stand level."""

from dataclasses import replace

import numpy as np

from ..effect import MotionEffect
from ..effect_parameters import Shape
from ..urdf import rotation_rpy


class GravityTilt(MotionEffect):
    """The base is mounted turned by roll about x, then pitch about y, so that gravity points elsewhere in its axes."""

    name = "gravity_tilt"
    equation = "g -> R(roll, pitch)' g"
    looks_like = "sine and cosine of the pose on the first joints"
    tied_with = ("torque_bias", "encoder_offset", "centre of mass of the first links")
    separate_by = "level the base, or turn the first joint through a full circle"
    source = "elementary; no reference"
    mimics_mass = True
    scope = "robot"
    simulators = {"gravity": "*"}

    g = (0.0, 0.0, -9.81)
    roll = Shape("rad", -0.5, 0.5, start=0.0, says="turn of the base about its x axis")
    pitch = Shape("rad", -0.5, 0.5, start=0.0, says="turn of the base about its y axis, after the roll")

    def bound(self, robot, joint):
        bound = self.given()
        bound.g = tuple(float(x) for x in robot.gravity)
        return bound

    def moved(self, motion, joint, roll, pitch):
        before = np.array(self.g if motion.gravity is None else motion.gravity)
        return replace(motion, gravity=rotation_rpy((roll, pitch, 0.0)).T @ before)
