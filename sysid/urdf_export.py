"""The identified robot as a URDF: inertias about each link's centre of mass, friction in
`<dynamics>`.

What a URDF cannot say stays out and is told in a comment at its head: rotors, and every effect but
viscous and Coulomb friction. Links that do not move against each other are one body to
identification; the whole body stands in the link that its joint moves, and the others lose their
inertia. Locked joints become fixed at their angle.
"""

import io
import os
import warnings
from pathlib import Path

import numpy as np

from .drives import DRIVE_EFFECTS
from .estimate import Fit
from .inertia import pseudo

SAYS = frozenset({"damping", "friction"})  # of `Effect.simulators`


def identified_urdf(fit: Fit, folder: Path | None = None) -> bytes:
    """URDF text of the fit.

    Args:
        folder: where it will stand; meshes that the source names relative to itself are named from
        there.
    """
    robot = fit.model.robot
    known = {c.name: float(value) for c, value in zip(fit.model.coefficients, fit.coefficients)}
    dynamics = {
        name: (known.get(f"viscous.{name}.Fv", 0.0), known.get(f"coulomb.{name}.Fc", 0.0))
        for name in robot.joints
    }
    return text(tree(robot, fit.pi[: robot.dof], dynamics, folder=folder), _unsaid(fit))


def tree(
    robot, links, dynamics: dict[str, tuple[float, float]], *, zero=None, folder: Path | None = None
):
    """The robot's URDF with other bodies and friction, as yourdfpy writes it (an lxml tree).

    Args:
        links: (dof, 10) about the joints' frames. dynamics: damping and friction by joint.
        zero: (dof,) that the joints stand ahead of their encoders, put into their origins.
        folder: as for `identified_urdf`.
    """
    import yourdfpy
    from yourdfpy.urdf import Dynamics, Inertial

    def named(file: str) -> str:
        if folder is None or "://" in file or os.path.isabs(file):
            return file
        return Path(
            os.path.relpath((robot.source.path.parent / file).resolve(), Path(folder).resolve())
        ).as_posix()

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        document = yourdfpy.URDF.load(
            io.BytesIO(robot.source.text.encode()),
            build_scene_graph=False,
            load_meshes=False,
            filename_handler=named,
        )
    links_there = {link.name: link for link in document.robot.links}
    joints = {joint.name: joint for joint in document.robot.joints}
    for name, angle in robot.locked.items():
        joint = joints[name]
        joint.origin = _moved(joint, angle)
        joint.type, joint.axis = "fixed", None
        joint.limit, joint.dynamics, joint.mimic = None, None, None
    carried = _carriers(robot)
    for name, link in links_there.items():
        if carried.get(name) is not None:
            link.inertial = None
    for body, pi in zip(robot.bodies, links):
        mass, com, central = pseudo.to_central(pi)
        origin = np.eye(4)
        origin[:3, 3] = com
        links_there[body.name].inertial = Inertial(origin=origin, mass=float(mass), inertia=central)
    for name, ahead in zip(robot.joints, np.zeros(robot.dof) if zero is None else zero):
        joints[name].dynamics = Dynamics(*dynamics[name])
        if ahead:
            joints[name].origin = _moved(joints[name], float(ahead))
    return document.write_xml()


def text(written, said: str) -> bytes:
    """An XML tree as a file, a comment before it."""
    from lxml import etree

    written.getroot().addprevious(etree.Comment(harmless(said)))
    out = io.BytesIO()
    written.write(out, pretty_print=True, encoding="utf-8", xml_declaration=True)
    return out.getvalue()


def harmless(said: str) -> str:
    """Text that may stand in an XML comment."""
    kept = "".join(c if c.isprintable() or c == "\n" else "?" for c in said)
    while "--" in kept:
        kept = kept.replace("--", "- -")
    return f" {kept} "


def _unsaid(fit: Fit) -> str:
    """What a URDF cannot say of a fit, in lines."""
    model, robot = fit.model, fit.model.robot
    values = [*zip(model.coefficients, fit.coefficients), *zip(model.shape_values, model.shapes)]
    left = []
    for term, (effect, joints) in enumerate(model.terms):
        known = effect.simulators and set(effect.simulators) <= SAYS
        if known or isinstance(effect, DRIVE_EFFECTS):
            continue
        for joint in joints:
            name = f"{effect.name}.{'*' if joint < 0 else robot.joints[joint]}"
            own = ", ".join(
                f"{one.name.rpartition('.')[2]} = {at:.6g} {one.unit}"
                for one, at in values
                if (one.term, one.joint) == (term, joint)
            )
            left.append(f"  {name}: {own}")
    for body, pi in zip(robot.bodies[robot.dof :], fit.pi[robot.dof :]):
        axis = robot.subspaces[body.row, 3:]
        about = float(axis @ pseudo.rotational_inertia(pi) @ axis)
        felt = [
            f"{about * ratio**2:.6g} kg m^2 about {joint}"
            for joint, ratio in zip(robot.joints, robot.transmission[body.row])
            if ratio
        ]
        left.append(f"  {body.name}: {pi[0]:.6g} kg, reflected {', '.join(felt)}")
    if not left:
        return f"{robot.name}, as sysid identified it."
    first = f"{robot.name}, as sysid identified it. A URDF cannot say:"
    return "\n".join([first, *left, "`sysid export` says more of it to a simulator.\n"])


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


def _moved(joint, angle: float) -> np.ndarray:
    """The origin (4, 4) of a joint that stands at an angle [rad or m] where it now stands at
    zero."""
    axis = np.array([1.0, 0.0, 0.0] if joint.axis is None else joint.axis, dtype=float)
    axis = axis / np.linalg.norm(axis)
    motion = np.eye(4)
    if joint.type == "prismatic":
        motion[:3, 3] = angle * axis
    else:
        skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        motion[:3, :3] += np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
    return motion if joint.origin is None else joint.origin @ motion
