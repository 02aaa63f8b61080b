"""The identified robot as a URDF: inertias about each link's centre of mass, friction in
`<dynamics>`.

What a URDF cannot say stays out and is told in a comment at its head: rotors, and every effect but
viscous and Coulomb friction. Links that do not move against each other are one body to
identification; the whole body stands in the link that its joint moves, and the others lose their
inertia. Locked joints become fixed at their angle.
"""

import io
import os
from pathlib import Path

import numpy as np

from .drives import DRIVE_EFFECTS
from .estimate import Fit
from .inertia import pseudo
from .model_parameters import place
from .urdf import rotation_rpy, rpy_of

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


#: What a URDF is to identification: other elements (transmissions, those of one simulator) say
#: things of a robot that was not identified.
_KEPT = {
    "robot": ("link", "joint", "material"),
    "link": ("inertial", "visual", "collision"),
    "joint": (
        "parent", "child", "origin", "axis", "limit", "dynamics", "mimic", "calibration",
        "safety_controller",
    ),
}  # fmt: skip


def tree(
    robot, links, dynamics: dict[str, tuple[float, float]], *, zero=None, folder: Path | None = None
):
    """The robot's URDF with other bodies and friction (an lxml tree); what it says beside these
    stands as in the source.

    Args:
        links: (dof, 10) about the joints' frames. dynamics: damping and friction by joint.
        zero: (dof,) that the joints stand ahead of their encoders, put into their origins.
        folder: as for `identified_urdf`.
    """
    from lxml import etree

    def named(file: str) -> str:
        if folder is None or "://" in file or os.path.isabs(file):
            return file
        return Path(
            os.path.relpath((robot.source.path.parent / file).resolve(), Path(folder).resolve())
        ).as_posix()

    # no white space of the source, so that the whole is indented alike
    parser = etree.XMLParser(remove_blank_text=True, resolve_entities=False, no_network=True)
    root = etree.fromstring(robot.source.text.encode(), parser)
    for owner in [root, *root.findall("link"), *root.findall("joint")]:
        for element in [one for one in owner if one.tag not in _KEPT[owner.tag]]:
            owner.remove(element)
    for mesh in root.iter("mesh"):
        mesh.set("filename", named(mesh.get("filename")))
    links_there = {link.get("name"): link for link in root.findall("link")}
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    for name, angle in robot.locked.items():
        joint = joints[name]
        _move(joint, angle)
        joint.set("type", "fixed")
        _without(joint, "axis", "limit", "dynamics", "mimic")
    carried = _carriers(robot)
    for name, link in links_there.items():
        if carried.get(name) is not None:
            _without(link, "inertial")
    for body, pi in zip(robot.bodies, links):
        _set_inertial(links_there[body.name], pi)
    for name, ahead in zip(robot.joints, np.zeros(robot.dof) if zero is None else zero):
        damping, friction = dynamics[name]
        _without(joints[name], "dynamics")
        said = {"damping": _word(damping), "friction": _word(friction)}
        etree.SubElement(joints[name], "dynamics", attrib=said)
        if ahead:
            _move(joints[name], float(ahead))
    return etree.ElementTree(root)


def _word(*values) -> str:
    return " ".join(repr(float(value)) for value in values)


def _without(element, *tags: str) -> None:
    for one in [one for one in element if one.tag in tags]:
        element.remove(one)


def _set_inertial(link, pi) -> None:
    """Put the parameters (10,) about its frame in the place of what a link's element states."""
    from lxml import etree

    mass, com, central = pseudo.to_central(pi)
    _without(link, "inertial")
    inertial = etree.Element("inertial")
    link.insert(0, inertial)
    etree.SubElement(inertial, "origin", attrib={"xyz": _word(*com), "rpy": "0 0 0"})
    etree.SubElement(inertial, "mass", attrib={"value": _word(mass)})
    axes = [(f"i{a}{b}", (i, j)) for i, a in enumerate("xyz") for j, b in enumerate("xyz") if i <= j]
    etree.SubElement(inertial, "inertia", attrib={key: _word(central[at]) for key, at in axes})


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
            name = f"{effect.name}.{place(joint, robot.joints)}"
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


def _move(joint, angle: float) -> None:
    """Let a joint's element stand at an angle [rad or m] where it now stands at zero."""
    from lxml import etree

    numbers = lambda element, key, none: [  # noqa: E731
        float(word) for word in (none if element is None else element.get(key, none)).split()
    ]
    axis = np.array(numbers(joint.find("axis"), "xyz", "1 0 0"))
    axis = axis / np.linalg.norm(axis)
    origin = joint.find("origin")
    xyz, turn = np.array(numbers(origin, "xyz", "0 0 0")), rotation_rpy(numbers(origin, "rpy", "0 0 0"))
    if joint.get("type") == "prismatic":
        xyz = xyz + turn @ (angle * axis)
    else:
        skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        turn = turn @ (np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew)
    origin = etree.SubElement(joint, "origin") if origin is None else origin
    origin.set("xyz", _word(*xyz))
    origin.set("rpy", _word(*rpy_of(turn)))
