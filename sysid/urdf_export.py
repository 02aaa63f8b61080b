"""The identified robot as a URDF: inertias about each link's centre of mass, friction in `<dynamics>`.

What a URDF cannot say stays out and is told beside it: rotors, and every effect but viscous and Coulomb friction.
Links that do not move against each other are one body to identification; the whole body stands in the link that
its joint moves, and the others lose their inertia. Locked joints become fixed at their angle.
"""

import io
import warnings

import numpy as np

from .estimate import Fit
from .inertia import pseudo


def identified_urdf(fit: Fit) -> bytes:
    """URDF text of the fit, written by yourdfpy."""
    import yourdfpy
    from yourdfpy.urdf import Dynamics, Inertial

    robot = fit.model.robot
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        document = yourdfpy.URDF.load(
            io.BytesIO(robot.source.text.encode()), build_scene_graph=False, load_meshes=False, filename_handler=lambda name: name
        )
    links = {link.name: link for link in document.robot.links}
    joints = {joint.name: joint for joint in document.robot.joints}
    for name, angle in robot.locked.items():
        _fix(joints[name], angle)
    carried = _carriers(robot)
    for name in links:
        if carried.get(name) is not None:
            links[name].inertial = None
    for body, pi in zip(robot.bodies, fit.pi):
        if body.kind != "link":
            continue
        mass, com, central = pseudo.to_central(pi)
        origin = np.eye(4)
        origin[:3, 3] = com
        links[body.name].inertial = Inertial(origin=origin, mass=float(mass), inertia=central)
    friction = {c.name: float(value) for c, value in zip(fit.model.coefficients, fit.coefficients)}
    for name in robot.joints:
        joints[name].dynamics = Dynamics(
            damping=friction.get(f"viscous.{name}.Fv", 0.0), friction=friction.get(f"coulomb.{name}.Fc", 0.0)
        )
    out = io.BytesIO()
    document.write_xml().write(out, pretty_print=True, encoding="utf-8", xml_declaration=True)
    return out.getvalue()


def _carriers(robot) -> dict[str, str | None]:
    """For every link the joint that moves it, None for links of the base."""
    parent = {joint.child: joint for joint in robot.source.joints.values()}

    def mover(link):
        while link in parent:
            joint = parent[link]
            if joint.name in robot.joints:
                return joint.name
            link = joint.parent
        return None

    return {link: mover(link) for link in robot.source.links}


def _fix(joint, angle: float) -> None:
    """Turn a locked joint into a fixed one at its position [rad or m]."""
    axis = np.array([1.0, 0.0, 0.0] if joint.axis is None else joint.axis, dtype=float)
    axis = axis / np.linalg.norm(axis)
    motion = np.eye(4)
    if joint.type == "prismatic":
        motion[:3, 3] = angle * axis
    else:
        skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        motion[:3, :3] += np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
    joint.origin = motion if joint.origin is None else joint.origin @ motion
    joint.type, joint.limit, joint.dynamics, joint.mimic, joint.axis = "fixed", None, None, None, None
