"""What one joint's moving otherwise changes of a torque, against inverse dynamics done twice."""

from dataclasses import replace

import numpy as np
import pytest

from sysid import vocabulary
from sysid.listed_effects import build
from sysid.preprocess import prepare
from sysid.rows import NUDGES
from sysid.source import Source
from sysid.specs import EffectSpec, PreprocessSpec

from . import robots
from .problems import arm_log, leg


def leg_source() -> Source:
    """The leg, a rotor at every joint, with friction."""
    _, model, motion, _, prior = leg()
    c = [c for effect, joints in model.terms for _ in joints for c in np.full(len(effect.coefficients()), 0.3)]
    return Source(model, np.concatenate([prior.ravel(), c]), motion, 5, np.ones((motion.samples, 3), bool))


def coupled_source(path, on: str) -> Source:
    """Five joints; the second one's motor, which stands on the first link, turns with another as well."""
    rng = np.random.default_rng(5)
    text = robots.urdf(rng)
    plain = robots.load(path, text)
    joints = plain.joints
    rotor = {"joint": joints[1], "ratio": 7.0, "on": "link0", "xyz": [0.1, 0, 0], "axis": [0, 0.6, 0.8], "inertia": robots.random_body(rng)}
    machine = robots.load(path, text, rotors=[rotor], transmission={joints[1]: {joints[1]: 7, on: -3}})
    model = build(machine, [EffectSpec(name="viscous"), EffectSpec(name="load_friction")])
    log = arm_log(machine, rng, seconds=3.0, noise=0.0)
    motion = prepare([log], PreprocessSpec(), joints)
    c = rng.uniform(0.1, 0.5, model.size - 10 * model.bodies)
    return Source(model, np.concatenate([machine.prior.ravel(), c]), motion, 5, np.ones((motion.samples, 5), bool))


@pytest.mark.parametrize("case", ["leg", "coupled", "coupled further out", "moved"])
def test_slopes_in_a_joints_motion(case, tmp_path):
    source = {"leg": leg_source, "moved": leg_source}.get(case, lambda: coupled_source(tmp_path, "joint3" if case == "coupled" else "joint0"))()
    if case == "moved":
        model = source.model.with_effect(vocabulary.find("encoder_offset"), (1,)).with_shapes([0.2])
        source = replace(source, model=model)
    bodies, rest = np.split(source.x, [10 * source.model.bodies])
    needed = lambda piece: source.model.torque(piece, bodies.reshape(-1, 10), rest)  # noqa: E731
    for joint in range(source.model.robot.dof):
        for piece, found in zip(source.motion.pieces, source.shifted(joint)):
            whole = replace(piece, smoother=None, core=slice(0, len(piece.t)))
            for own, name, nudge in zip(found, ("q", "qd", "qdd"), NUDGES):
                moved = replace(whole, **{name: getattr(whole, name) + nudge * (np.arange(source.model.robot.dof) == joint)})
                slope = (needed(moved) - needed(whole)).T / nudge
                # a step forth and one back differ by the torque's curvature over the step
                np.testing.assert_allclose(own, slope, rtol=0, atol=2e-3 * max(np.abs(slope).max(), 1.0))
