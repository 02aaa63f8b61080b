"""Isaac Lab: a URDF for its importer, and an actuator configuration with what PhysX knows of a
joint beside it: armature, dry friction from rest and while it moves, viscous friction, limits of
effort and speed."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np
import pinocchio as pin

from .. import robot as robots
from ..inertia import pseudo
from ..robot_spec import RobotSpec
from ..urdf_export import text, tree
from .stated import Stated

KNOWS = frozenset({"damping", "friction", "armature", "zero", "inertia"})
SHOWS = frozenset({"breakaway"})
PACKAGE = "pin"
_LIMITS = {"effort_limit_sim": "effort", "velocity_limit_sim": "velocity"}
_OPENS = '''"""{comment}

Of Isaac Lab 2.3 or newer on Isaac Sim 5 or newer:
ArticulationCfg(spawn=UrdfFileCfg(asset_path="robot.urdf", ...), actuators=ACTUATORS).
"""

from isaaclab.actuators import ImplicitActuatorCfg

ACTUATORS = {{
    "identified": ImplicitActuatorCfg(
{body}
        # gains of your controller; None: those of the USD, 0.0: torque is commanded
        stiffness={stiffness},
        damping={damping},
    ),
}}
'''


def files(said: Stated, comment: str, folder: Path) -> dict[str, bytes]:
    """{file name: content} of what is said."""
    robot, at = said.robot, said.terms
    # what PhysX knows of friction is in the configuration; the importer would take the URDF's for
    # gains
    plain = dict.fromkeys(robot.joints, (0.0, 0.0))
    urdf = text(tree(robot, said.links, plain, zero=at["zero"], folder=folder), comment)
    values = {
        "armature": at["armature"], "friction": at["friction"] + at["breakaway"],
        "dynamic_friction": at["friction"], "viscous_friction": at["damping"],
    }  # fmt: skip
    values |= {
        name: [getattr(robot.source.joints[joint], word) for joint in robot.joints]
        for name, word in _LIMITS.items()
    }
    names = [re.escape(name) for name in robot.joints]
    lines = [f"joint_names_expr={names!r},"]
    for name, numbers in values.items():
        known = {j: float(v) for j, v in zip(names, numbers) if np.isfinite(v)}
        lines += [f"{name}={{", *(f"    {j!r}: {v!r}," for j, v in known.items()), "},"]
    body = "\n".join(f"        {line}" for line in lines)
    quoted = comment.replace("\\", "/").replace('"""', "'''")
    servos = {re.escape(name): motor for name, motor in said.motors.items() if motor.servo}
    gains = {
        "stiffness": {name: motor.gain for name, motor in servos.items()} or None,
        "damping": {name: motor.damping for name, motor in servos.items()} or None,
    }
    written = _OPENS.format(comment=quoted, body=body, **gains)
    return {"robot.urdf": urdf, "actuators.py": written.encode()}


def loaded(written: dict[str, Path], said: Stated):
    """Pinocchio's inverse dynamics of the written URDF, with what the written configuration says
    of its joints; see `mjcf.loaded`.

    Raises:
        RuntimeError: yourdfpy reads other bodies from the file than those that are stated.
    """
    names = said.robot.joints
    reader = _read_alike(written["robot.urdf"], said)
    machine = robots.load(RobotSpec(urdf=str(written["robot.urdf"]), joints=list(names)))
    config = read(written["actuators.py"].read_text(encoding="utf-8"))
    keys = [re.escape(name) for name in names]
    armature, dry, wet = (
        np.array([config[word][key] for key in keys])
        for word in ("armature", "dynamic_friction", "viscous_friction")
    )
    machine.model.gravity.linear = said.gravity
    data, drive = machine.model.createData(), machine.transmission

    def torque(q, qd, qdd):
        samples = zip(q @ drive.T, qd @ drive.T, qdd @ drive.T)
        bodies = np.array([pin.rnea(machine.model, data, *sample) for sample in samples]) @ drive
        return bodies + armature * qdd + wet * qd + dry * np.sign(qd)

    by = f"pinocchio {pin.__version__}, bodies read by {reader} alike"
    return torque, f"{by} (Isaac Lab itself was not asked)"


def _read_alike(path: Path, said: Stated) -> str:
    """What else reads the file, where it finds the stated bodies: a second reader, for the importer
    is none of ours."""
    import yourdfpy

    document = yourdfpy.URDF.load(
        str(path), build_scene_graph=False, build_collision_scene_graph=False, load_meshes=False
    )
    links = {link.name: link.inertial for link in document.robot.links}
    for body, pi in zip(said.robot.bodies, said.links):
        mass, com, central = pseudo.to_central(pi)
        found = links[body.name]
        turn = found.origin[:3, :3]
        same = (
            np.allclose(found.mass, mass, rtol=1e-9)
            and np.allclose(found.origin[:3, 3], com, rtol=1e-9, atol=1e-12)
            and np.allclose(turn @ found.inertia @ turn.T, central, rtol=1e-9, atol=1e-12)
        )
        if not same:
            raise RuntimeError(f"yourdfpy reads another body of {body.name}")
    return f"yourdfpy {yourdfpy.__version__}"


def read(source: str) -> dict:
    """The values of a written configuration, by their names; nothing in it is run."""
    calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    (call,) = [node for node in calls if getattr(node.func, "id", "") == "ImplicitActuatorCfg"]
    return {word.arg: ast.literal_eval(word.value) for word in call.keywords}
