"""Whether a log moves a joint that the robot's file, or the experiment, does not move."""

from __future__ import annotations

from collections.abc import Iterator

from ... import beyond, locked_joints
from ...errors import LogError
from ...recording import table_of
from ..fault import ERROR, WARNING, Fault
from ..look import Look

AFTER, SENSELESS = 1, ()
_MOST = 2**20  # rows: a longer log is read span by span, and not for columns that nobody uses


def find(look: Look) -> Iterator[Fault]:
    """joint_order, of columns that belong to no joint of the robot that moves."""
    data, robot = look.experiment.data, look.robot
    for named in (False, True):
        if locks := locked_joints.elsewhere(look.experiment, robot, named=named):
            moved = [joint for joint, own in locks.items() if own.moves]
            borne = [beyond.carries(robot.source.joints, joint, robot.joints) for joint in moved]
            yield Fault("joint_order", ERROR if any(borne) else WARNING, *locked_joints.says(locks))
    patterns = data.columns.position, data.columns.torque
    log = min(look.logs, key=lambda one: one.samples)
    if log.samples > _MOST or not all(isinstance(one, str) for one in patterns):
        return
    known, told = {*robot.joints, *robot.locked, *data.position, *data.torque}, {}
    for name in log.spec.names:
        try:
            table = table_of(name, log.spec, look.experiment.folder)
            columns = beyond.beyond(table.names, *patterns, known)
            values = table.load(list(columns.values())) if columns else {}
        except LogError:  # of what nobody asked for
            continue
        told |= {
            joint: columns[joint] for joint in beyond.moving(columns, values, data.units.position)
        }
    for joint, column in told.items():
        severity = ERROR if beyond.carries(robot.source.joints, joint, robot.joints) else WARNING
        yield Fault("joint_order", severity, *beyond.says(joint, column, robot.source.joints))
