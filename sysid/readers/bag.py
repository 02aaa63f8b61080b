"""ROS bags: sensor_msgs/JointState of one topic, joint by joint, from ROS 1, ROS 2 sqlite3 and
mcap.

A message says which joint each of its numbers belongs to, in an order of its own; here every number
goes to its joint's column. Message definitions that a bag carries are not used, as that would
generate code from them: JointState has had the same fields in every ROS.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import LogError
from ..warned import warn
from .table import Table

_TYPE = "sensor_msgs/msg/JointState"
_SIGNALS = ("position", "velocity", "effort")
_SECOND = 1_000_000_000  # ns


class BagTable(Table):
    """Columns `position_<joint>`, `velocity_<joint>`, `effort_<joint>` of a topic, `t` from the
    header and `t_received` from the recorder, both whole ns since 1970. Rows are the messages that
    hold every column asked for: an arm and a gripper may share a topic, message by message."""

    usual = {
        "time": "t",
        "position": "position_{joint}",
        "velocity": "velocity_{joint}",
        "torque": "effort_{joint}",
    }
    clock = "ns"

    def __init__(self, path: Path, topic: str | None = None):
        self.path = path
        reader, decode = _tools(path)
        try:
            with reader(path) as bag:
                found = [c for c in bag.connections if c.msgtype == _TYPE and c.msgcount]
                kept = [c for c in found if c.topic == self._topic(found, bag, topic)]
                rows = [(at, decode(raw)) for _, at, raw in bag.messages(kept)]
            self._collect(rows)
        except LogError:
            raise
        except Exception as error:  # corrupt bytes: whatever struct, SQLite or lz4 raise
            said = (str(error).splitlines() or [type(error).__name__])[0]
            raise LogError(
                f"cannot be read as a ROS bag ({said})", where=str(path),
                do="record it again, or repair it with `ros2 bag reindex` or `rosbag reindex`",
            ) from None  # fmt: skip

    @property
    def files(self) -> tuple[Path, ...]:
        if self.path.is_file():
            return (self.path,)
        return tuple(
            sorted(p for p in self.path.iterdir() if p.suffix in (".mcap", ".db3", ".zstd"))
        )

    def _topic(self, found, bag, asked: str | None) -> str:
        topics = sorted({connection.topic for connection in found})
        if not topics:
            types = sorted({connection.msgtype for connection in bag.connections})
            shown = ", ".join(types[:8]) + (" ..." if len(types) > 8 else "")
            raise LogError(
                f"the bag has no message of {_TYPE}, only {shown or 'nothing'}",
                where=str(self.path),
                do="record the topic /joint_states",
            )
        if asked is not None and asked not in topics:
            raise LogError(
                f"no topic {asked!r} with joint states",
                where=str(self.path),
                allowed=", ".join(topics),
                do="correct topic in data.train or data.test",
            )
        if asked is None and len(topics) > 1:
            raise LogError(
                f"{len(topics)} topics have joint states",
                where=str(self.path),
                allowed=", ".join(topics),
                do=f"name one: {{file: {self.path.name}, topic: {topics[0]}}}",
            )
        return asked or topics[0]

    def _collect(self, rows) -> None:
        """Stamps (n,), and each column with the rows that hold it: (index (m,), values (m,))."""
        received = np.array([at for at, _ in rows], dtype=np.int64)
        stamps = np.array(
            [m.header.stamp.sec * _SECOND + m.header.stamp.nanosec for _, m in rows], dtype=np.int64
        )
        if not stamps.any():
            self._tell("the headers have no stamps; the recorder's times stand in for them")
            stamps = received
        self._stamps = {"t": stamps, "t_received": received}
        # messages with the same names in the same order fill their columns together
        layouts: dict[tuple, list[int]] = {}
        for row, (_, message) in enumerate(rows):
            sizes = tuple(len(getattr(message, signal)) for signal in _SIGNALS)
            layouts.setdefault((tuple(message.name), sizes), []).append(row)
        parts: dict[str, list] = {}
        for (names, sizes), own in layouts.items():
            if len(set(names)) < len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise LogError(f"a message names the joint {twice!r} twice", where=str(self.path))
            for signal, size in zip(_SIGNALS, sizes):
                if size != len(names):
                    continue  # empty: the driver does not report it
                values = np.array([getattr(rows[row][1], signal) for row in own], dtype=float)
                for k, name in enumerate(names):
                    parts.setdefault(f"{signal}_{name}", []).append((np.array(own), values[:, k]))
        self._columns = {}
        for name, entries in parts.items():
            index = np.concatenate([index for index, _ in entries])
            order = np.argsort(index, kind="stable")
            self._columns[name] = index[order], np.concatenate([v for _, v in entries])[order]
        self.names = [*self._stamps, *sorted(self._columns, key=_by_signal)]

    def load(self, names, empty=()):
        asked = [name for name in names if name not in self._stamps]
        counts = np.zeros(len(self._stamps["t"]), dtype=int)
        for name in asked:
            counts[self._columns[name][0]] += 1
        rows = np.flatnonzero(counts == len(asked))
        if not rows.size:
            raise LogError(
                f"no message holds all of {', '.join(asked[:8])}{' ...' if len(asked) > 8 else ''}",
                where=str(self.path),
                do="leave a joint out with robot.joints, or name another topic",
            )
        if partly := int(np.sum((counts > 0) & (counts < len(asked)))):
            self._tell(
                f"{partly} of {len(counts)} messages lack some of the joints and were left out"
            )
        stamps = self._stamps["t"][rows]
        again = np.concatenate([[False], np.diff(stamps) == 0])
        if again.any():
            self._tell(
                f"{again.sum()} messages repeat the stamp of the one before and were left out"
            )
            rows = rows[~again]
        out = {}
        for name in names:
            if name in self._stamps:
                out[name] = self._stamps[name][rows]
            else:
                index, values = self._columns[name]
                out[name] = values[np.searchsorted(index, rows)]
        return out

    def _tell(self, text: str) -> None:
        warn(f"{self.path}: {text}", above=3)


def _by_signal(column: str) -> tuple[int, str]:
    return _SIGNALS.index(column.partition("_")[0]), column


def _tools(path: Path):
    """What opens the bag, and what decodes one message of it."""
    try:
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise LogError(
            "reading a ROS bag needs the package rosbags",
            where=str(path),
            do="pip install 'sysid[ros]'",
        ) from None
    if path.suffix.lower() == ".bag":
        known = get_typestore(Stores.ROS1_NOETIC)
        return Reader1, lambda raw: known.deserialize_ros1(raw, _TYPE)
    known = get_typestore(Stores.ROS2_HUMBLE)
    return Reader2, lambda raw: known.deserialize_cdr(raw, _TYPE)
