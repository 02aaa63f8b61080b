"""What changes of the torque where a joint's link stands apart from its motor."""

from collections.abc import Sequence

import numpy as np

from .regressor import CHUNK, handed_down, heavy_of, wrenches
from .robot import Robot
from .tree import frames_of, of_rows, to_base


def standing_apart(
    robot: Robot,
    pi,
    q,
    qd,
    qdd,
    joints: Sequence[int],
    nudges: Sequence[float],
    *,
    gravity=None,
    deflection=None,
) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """{joint: (torque (dof, n) of what its link carries, slopes (3, dof, n) of that in how far the link stands behind its motor in
    position, speed and acceleration)}, by differences over `nudges`. Other arguments: see `regressor.body_motions`.

    What hangs on other links stays as it is, and is looked at once for all joints.
    """
    q, qd, qdd = (np.asarray(x, dtype=float) for x in (q, qd, qdd))
    heavy, bearing = heavy_of(robot, pi)
    out = {
        joint: (np.zeros((robot.dof, len(q))), np.zeros((len(nudges), robot.dof, len(q))))
        for joint in joints
    }
    links = {}
    for joint in joints:
        root = robot.bodies[joint].row
        carried = {i for i in bearing if root in to_base(robot, i)}
        own = [one for one in heavy if one[1] in carried]
        # children before their parents, and then what bears the link
        links[joint] = (
            root,
            carried,
            own,
            [*sorted(carried, reverse=True), *to_base(robot, root)[1:]],
        )
    for start in range(0, len(q), CHUNK):
        part = slice(start, start + CHUNK)
        stand = of_rows(
            robot, q[part], qd[part], qdd[part], None if deflection is None else deflection[:, part]
        )
        found = frames_of(robot, stand, gravity, bearing)
        each = wrenches(heavy, found)
        for joint, (base, slopes) in out.items():
            root, carried, own, rows = links[joint]
            handed_down(
                robot, found, rows, {i: list(each[i]) for i in carried if i in each}, base[:, part]
            )
            for order, nudge in enumerate(nudges):
                moved = [values.copy() if k == order else values for k, values in enumerate(stand)]
                moved[order][root] -= nudge
                nudged = frames_of(
                    robot, moved, gravity, carried, found, root if order == 0 else -1
                )
                slope = slopes[order, :, part]
                handed_down(robot, nudged, rows, wrenches(own, nudged), slope)
                slope -= base[:, part]
                slope /= nudge
    return out
