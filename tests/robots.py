"""Random robots written as URDF text, and their rotors, for tests. Truth comes from solids, so every body is possible."""

import numpy as np

from sysid import robot, robot_spec

AXES = "revolute", "continuous", "prismatic"


def urdf(rng: np.random.Generator, links: int = 5, *, name: str = "random") -> str:
    """A random tree of boxes on random joints; a fixed link hangs on each second body."""
    parts = [f'<robot name="{name}"><link name="base"/>']
    for k in range(links):
        parent = "base" if k == 0 else f"link{rng.integers(0, k)}"
        parts.append(_link(rng, f"link{k}") + _joint(rng, f"joint{k}", AXES[rng.integers(0, 3)], parent, f"link{k}"))
        if k % 2:
            parts.append(_link(rng, f"extra{k}") + _joint(rng, f"weld{k}", "fixed", f"link{k}", f"extra{k}"))
    return "".join(parts) + "</robot>"


def _numbers(values) -> str:
    return " ".join(repr(float(v)) for v in values)


def _origin(rng) -> str:
    return f'<origin xyz="{_numbers(rng.uniform(-0.4, 0.4, 3))}" rpy="{_numbers(rng.uniform(-3, 3, 3))}"/>'


def _link(rng, name: str) -> str:
    mass, squares = rng.uniform(0.2, 5.0), rng.uniform(0.05, 0.4, 3) ** 2
    xx, yy, zz = (mass / 12.0 * (squares.sum() - squares)).tolist()
    return (
        f'<link name="{name}"><inertial>{_origin(rng)}<mass value="{mass!r}"/>'
        f'<inertia ixx="{xx!r}" ixy="0" ixz="0" iyy="{yy!r}" iyz="0" izz="{zz!r}"/></inertial></link>'
    )


def _joint(rng, name: str, kind: str, parent: str, child: str) -> str:
    limit = '<limit lower="-9" upper="9" effort="100" velocity="10"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{_origin(rng)}'
        f'<axis xyz="{_numbers(rng.normal(size=3))}"/>{limit}</joint>'
    )


def random_body(rng) -> dict:
    """A body of any orientation, as an experiment's `parameters`."""
    from tests.test_inertia import random_bodies

    return {"parameters": random_bodies(1, seed=int(rng.integers(2**31)))[0].tolist()}


def load(path, text: str, **spec) -> robot.Robot:
    """Write the URDF below `path` and load it with the given robot section."""
    file = path / "robot.urdf"
    file.write_text(text)
    return robot.load(robot_spec.RobotSpec.model_validate({"urdf": str(file), **spec}))
