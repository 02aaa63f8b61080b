"""One recording written as robots' tools write it: ROS bags, LeRobot data sets, HDF5 of ALOHA and
of DROID.

columns: {"t": (n,) s, "q_<joint>": (n,), "tau_<joint>": (n,)}, as a CSV log has them.
"""

import json
from pathlib import Path

import numpy as np

EPOCH = 1_700_000_000_123_456_789  # ns: more digits than a float has
SECOND = 1_000_000_000


def joints_of(columns) -> list[str]:
    return [name.removeprefix("q_") for name in columns if name.startswith("q_")]


def stamps(columns) -> np.ndarray:
    """(n,) whole ns since 1970."""
    return EPOCH + np.round(np.asarray(columns["t"]) * 1e9).astype(np.int64)


def matrix(columns, signal: str) -> np.ndarray:
    return np.column_stack([columns[f"{signal}_{joint}"] for joint in joints_of(columns)])


def write_bag2(
    path: Path, columns, *, storage="mcap", topic="/joint_states", more=(), **layout
) -> Path:
    """A ROS 2 bag folder; returns it. more: further (topic, columns)."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    known = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        for name, own in [(topic, columns), *more]:
            _write(
                writer, known, name, own, lambda m, kind: known.serialize_cdr(m, kind), {}, **layout
            )
    return path


def write_bag1(path: Path, columns, **layout) -> Path:
    """A ROS 1 bag file; returns it."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    known = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        _write(
            writer,
            known,
            "/joint_states",
            columns,
            lambda m, kind: known.serialize_ros1(m, kind),
            {"seq": 0},
            **layout,
        )
    return path


def _write(
    writer,
    known,
    topic,
    columns,
    serialize,
    header,
    order=None,
    stamped=True,
    effort=True,
    messages=None,
):
    """messages: (row, the joints in that message) in order; by default all joints in every one.

    order: the row's joints -> the names as they stand in its message.
    """
    state, head, time = (
        known.types[t]
        for t in (
            "sensor_msgs/msg/JointState",
            "std_msgs/msg/Header",
            "builtin_interfaces/msg/Time",
        )
    )
    connection = writer.add_connection(topic, state.__msgtype__, typestore=known)
    clock, joints = stamps(columns), joints_of(columns)
    for row, own in messages or [(row, joints) for row in range(len(clock))]:
        names = order(row, own) if order else own
        stamp = int(clock[row]) if stamped else 0
        values = [
            np.array([columns[f"{s}_{name}"][row] for name in names], dtype=float)
            for s in ("q", "tau")
        ]
        message = state(
            header=head(
                stamp=time(sec=stamp // SECOND, nanosec=stamp % SECOND), frame_id="", **header
            ),
            name=list(names),
            position=values[0],
            velocity=np.zeros(len(names)),
            effort=values[1] if effort else np.zeros(0),
        )
        writer.write(connection, int(clock[row]) + 2_000_000, serialize(message, state.__msgtype__))


def write_lerobot(
    path: Path, episodes: list[dict], *, names=None, version="v3.0", fixed=True, numbers=np.float64
) -> Path:
    """A LeRobot data set; returns its folder. v3 holds all episodes in a file, v2 one in each."""
    import polars as pl

    width = len(joints_of(episodes[0]))
    kind = pl.Array(pl.Float64, width) if fixed else pl.List(pl.Float64)
    frames = []
    for k, columns in enumerate(episodes):
        n = len(columns["t"])
        lists = {"observation.state": "q", "observation.effort": "tau", "action": "q"}
        frames.append(
            pl.DataFrame(
                {
                    name: pl.Series(matrix(columns, signal).astype(numbers).tolist(), dtype=kind)
                    for name, signal in lists.items()
                }
                | {
                    "timestamp": np.asarray(columns["t"]).astype(numbers),
                    "frame_index": np.arange(n),
                }
                | {
                    "episode_index": np.full(n, k),
                    "index": np.arange(n),
                    "task_index": np.zeros(n, dtype=int),
                }
            )
        )
    chunk = path / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    (path / "meta").mkdir()
    if version.startswith("v3"):
        pl.concat(frames).write_parquet(chunk / "file-000.parquet")
    else:
        for k, frame in enumerate(frames):
            frame.write_parquet(chunk / f"episode_{k:06d}.parquet")
    said = None if names is None else names if version.startswith("v3") else {"motors": names}
    features = {
        name: {"dtype": "float32", "shape": [width], "names": said}
        for name in ("observation.state", "observation.effort", "action")
    }
    features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    (path / "meta" / "info.json").write_text(
        json.dumps({"codebase_version": version, "fps": 200, "features": features})
    )
    return path


def write_aloha(path: Path, columns) -> Path:
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["sim"] = False
        observed = file.create_group("observations")
        observed["qpos"], observed["effort"] = matrix(columns, "q"), matrix(columns, "tau")
        moves = f"qd_{joints_of(columns)[0]}" in columns
        observed["qvel"] = matrix(columns, "qd") if moves else np.zeros_like(matrix(columns, "q"))
        observed.create_group("images")["cam_high"] = np.zeros(
            (len(columns["t"]), 2, 2, 3), dtype=np.uint8
        )
        file["action"] = matrix(columns, "q")
    return path


def write_droid(path: Path, columns) -> Path:
    import h5py

    clock = stamps(columns)
    with h5py.File(path, "w") as file:
        state = file.create_group("observation/robot_state")
        state["joint_positions"], state["joint_torques_computed"] = (
            matrix(columns, "q"),
            matrix(columns, "tau"),
        )
        state["joint_velocities"], state["gripper_position"] = (
            np.zeros_like(matrix(columns, "q")),
            np.zeros(len(clock)),
        )
        stamp = file.create_group("observation/timestamp/robot_state")
        stamp["robot_timestamp_seconds"], stamp["robot_timestamp_nanos"] = (
            clock // SECOND,
            clock % SECOND,
        )
        file["action/joint_position"] = matrix(columns, "q")
    return path
