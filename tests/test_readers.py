"""The same recording as every kind of file gives the same parameters; what several files, topics
and episodes mean."""

import gzip
import json
import shutil

import numpy as np
import pytest

from sysid import log, log_spec, pipeline
from sysid.errors import LogError, SysidWarning
from sysid.readers import listed, open_table
from tests.conftest import JOINTS, csv, write_table
from tests.log_formats import (
    SECOND,
    stamps,
    write_aloha,
    write_bag1,
    write_bag2,
    write_droid,
    write_lerobot,
)


def turned(row, names):
    """Another order of the joints in every other message."""
    return list(reversed(names)) if row % 2 else list(names)


def with_bag(path, columns, storage):
    """The file of a bag alone, without its metadata.yaml."""
    folder = write_bag2(path.with_suffix(""), columns, storage=storage, order=turned)
    (file,) = [entry for entry in folder.iterdir() if entry.suffix != ".yaml"]
    return shutil.copy(file, path)


#: file or folder, how it is written, what the experiment says of it
FORMATS = {
    "mcap": ("{}.mcap", lambda p, c: with_bag(p, c, "mcap"), {}),
    "db3": ("{}.db3", lambda p, c: with_bag(p, c, "sqlite3"), {}),
    "bag folder": ("{}", lambda p, c: write_bag2(p, c, storage="mcap", order=turned), {}),
    "ROS 1 bag": ("{}.bag", lambda p, c: write_bag1(p, c, order=turned), {}),
    "LeRobot v3": (
        "{}",
        lambda p, c: write_lerobot(p, [c], names=[f"{joint}.pos" for joint in JOINTS]),
        {},
    ),
    "LeRobot v2, lists": (
        "{}",
        lambda p, c: write_lerobot(p, [c], version="v2.1", fixed=False),
        {},
    ),
    "ALOHA": ("{}.hdf5", write_aloha, {"data.rate": 200.0}),
    "DROID": ("{}.h5", write_droid, {}),
    "gzip": ("{}.csv.gz", lambda p, c: p.write_bytes(gzip.compress(csv(c).encode())), {}),
}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, arm_logs):
    """The parameters that the CSV logs give."""
    from tests.conftest import CONFIG, URDF, dump

    folder = tmp_path_factory.mktemp("csv")
    for name, content in {
        "config.yaml": dump(CONFIG),
        "robot.urdf": URDF,
        "train.csv": csv(arm_logs[0]),
        "test.csv": csv(arm_logs[1]),
    }.items():
        (folder / name).write_text(content)
    return pipeline.fit(pipeline.load(folder))


@pytest.mark.long
@pytest.mark.parametrize(("name", "write", "config"), FORMATS.values(), ids=FORMATS)
def test_the_same_recording_gives_the_same_parameters(
    experiment, arm_logs, fitted, name, write, config
):
    names = {part: name.format(part) for part in ("train", "test")}
    folder = experiment(
        config={f"data.{part}": [file] for part, file in names.items()}
        | {"data.columns": ..., "data.units": ...}
        | config
    )
    for part, columns in zip(names, arm_logs):
        write(folder / names[part], columns)
    found = pipeline.fit(pipeline.load(folder))
    assert (
        found.model.names == fitted.model.names
        and found.samples == fitted.samples
        and found.notices == fitted.notices
    )
    scale = np.maximum(
        np.abs(fitted.x), np.where(np.isfinite(fitted.uncertainty.std), fitted.uncertainty.std, 0.0)
    )
    assert np.abs((found.x - fitted.x) / np.maximum(scale, 1e-12)).max() < 1e-6
    assert [len(entry["sha256"]) for entry in found.logs] == [64, 64]


def read(
    file, *, joints=JOINTS, topic=None, episode=None, start=None, stop=None, **data
) -> log.Log:
    entry = {"files": [str(f) for f in file]} if isinstance(file, list) else {"file": str(file)}
    spec = log_spec.LogSpec.model_validate(
        entry | {"topic": topic, "episode": episode, "start": start, "stop": stop}
    )
    return log.read(spec, log_spec.DataSpec.model_validate(data), joints, [False] * len(joints))


# ---- bags


def test_stamps_of_a_bag_are_exact_and_jitter_is_told(tmp_path, arm_logs):
    jitter = np.random.default_rng(0).uniform(-1e-3, 1e-3, 600)
    columns = arm_logs[0] | {"t": arm_logs[0]["t"] + jitter}
    table = open_table(write_bag2(tmp_path / "run", columns))
    np.testing.assert_array_equal(table.load(["t"])["t"], stamps(columns))
    np.testing.assert_array_equal(
        table.load(["t_received"])["t_received"], stamps(columns) + 2_000_000
    )
    with pytest.warns(SysidWarning) as told:
        read(tmp_path / "run")
    assert any("samples were taken evenly" in str(w.message) for w in told)


def test_jittered_stamps_are_mended_alike(tmp_path, arm_logs):
    """The same whole ns in Parquet and in an mcap whose messages name the joints in any order."""
    jitter = np.random.default_rng(0).normal(0.0, 5e-4, 600)
    columns = arm_logs[0] | {"t": arm_logs[0]["t"] + jitter}
    bag = write_bag2(tmp_path / "run", columns, order=turned)
    table = write_table(tmp_path / "log.parquet", columns | {"t": stamps(columns)})
    with pytest.warns(SysidWarning):
        (one,), (other,) = read(bag).segments, read(table, units={"time": "ns"}).segments
    for name in ("t", "q", "tau"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_an_arm_and_a_gripper_on_one_topic(tmp_path, arm_logs):
    """Messages of the gripper alone, between those of the arm, are no rows of the arm."""
    columns = arm_logs[0] | {"q_finger": np.zeros(600), "tau_finger": np.zeros(600)}
    messages = [(row, names) for row in range(600) for names in (JOINTS, ("finger",))]
    path = write_bag2(tmp_path / "run", columns, messages=messages)
    (segment,) = read(path).segments
    np.testing.assert_array_equal(
        segment.q, np.column_stack([columns["q_shoulder"], columns["q_elbow"]])
    )
    with pytest.raises(LogError, match="no message holds all of position_shoulder"):
        read(path, joints=(*JOINTS, "finger"))


def test_a_message_that_lacks_a_joint_is_left_out_and_told(tmp_path, arm_logs):
    messages = [(row, JOINTS if row % 100 else JOINTS[:1]) for row in range(600)]
    path = write_bag2(tmp_path / "run", arm_logs[0], messages=messages)
    with pytest.warns(SysidWarning) as told:
        read(path)
    assert any("6 of 600 messages lack some of the joints" in str(w.message) for w in told)


def test_headers_without_stamps(tmp_path, arm_logs):
    with pytest.warns(SysidWarning, match="the headers have no stamps"):
        (segment,) = read(write_bag2(tmp_path / "run", arm_logs[0], stamped=False)).segments
    np.testing.assert_allclose(segment.t, arm_logs[0]["t"], rtol=0, atol=1e-9)


def test_topics(tmp_path, arm_logs):
    path = write_bag2(tmp_path / "run", arm_logs[0], more=[("/right/joint_states", arm_logs[1])])
    with pytest.raises(
        LogError,
        match="2 topics have joint states; allowed: /joint_states, /right/joint_states; name one",
    ):
        read(path)
    for topic, columns in (("/joint_states", arm_logs[0]), ("/right/joint_states", arm_logs[1])):
        np.testing.assert_array_equal(
            read(path, topic=topic).segments[0].q[:, 0], columns["q_shoulder"]
        )
    with pytest.raises(LogError, match="no topic '/left'"):
        read(path, topic="/left")


def test_bags_that_hold_no_log(tmp_path, arm_logs):
    with pytest.raises(LogError, match="'effort_shoulder' is not there"):
        read(write_bag2(tmp_path / "run", arm_logs[0], effort=False))
    for name in ("a.mcap", "a.db3", "a.bag"):
        (tmp_path / name).write_bytes(b"\x89MCAP0\r\n" + bytes(200))
        with pytest.raises(LogError, match="cannot be read as a ROS bag"):
            read(tmp_path / name)
    with pytest.raises(LogError, match="a topic is named, and this is no ROS bag"):
        read(tmp_path / "a.csv", topic="/joint_states")


def test_without_rosbags(tmp_path, experiment, cli, arm_logs, monkeypatch):
    folder = experiment(config={"data.train": ["train.mcap"]})
    (folder / "train.mcap").write_bytes(b"")
    monkeypatch.setitem(__import__("sys").modules, "rosbags.rosbag1", None)
    cli("fit", folder).complains("train.mcap", "pip install 'sysid[ros]'")


# ---- episodes


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_episodes_are_segments(tmp_path, arm_logs, version):
    """Their clocks start anew, and nothing is joined across; one may be named, or several."""
    cut = [
        {name: values[:n] for name, values in arm_logs[k].items()}
        for k, n in ((0, 200), (1, 300), (0, 100))
    ]
    path = write_lerobot(tmp_path / "set", cut, version=version)
    found = read(path)
    assert [len(segment.t) for segment in found.segments] == [200, 300, 100]
    for segment, columns in zip(found.segments, cut):
        np.testing.assert_array_equal(segment.q[:, 1], columns["q_elbow"])
        assert segment.step == pytest.approx(0.005)
    assert np.all(np.diff(np.concatenate([segment.t for segment in found.segments])) > 0)
    assert [len(s.t) for s in read(path, episode=1).segments] == [300]
    assert [len(s.t) for s in read(path, episode=[0, 2]).segments] == [200, 100]
    assert [len(s.t) for s in read(path, episode=[0, 1], start=0.5, stop=1.5).segments] == [
        100,
        100,
    ]
    assert len(found.hashes) == (1 if version == "v3.0" else 3)
    with pytest.raises(LogError, match="there is no episode 3; allowed: 0, 1, 2"):
        read(path, episode=3)


def test_one_file_of_a_data_set_knows_its_names(tmp_path, arm_logs):
    path = (
        write_lerobot(tmp_path / "set", [arm_logs[0]], names=["elbow.pos", "shoulder.pos"])
        / "data/chunk-000/file-000.parquet"
    )
    (segment,) = read(path, joints=("elbow", "shoulder")).segments
    np.testing.assert_array_equal(
        segment.q[:, 0], arm_logs[0]["q_shoulder"]
    )  # as the data set says, not as the file is ordered
    with pytest.raises(LogError, match="joint 'wrist' has no column: 'observation.state.wrist'"):
        read(path, joints=("wrist", "shoulder"))
    (segment,) = read(
        path, columns={"position": "observation.state", "torque": "observation.effort"}
    ).segments
    np.testing.assert_array_equal(segment.q[:, 0], arm_logs[0]["q_shoulder"])


def test_float32_as_lerobot_writes(tmp_path, arm_logs):
    (segment,) = read(write_lerobot(tmp_path / "set", [arm_logs[0]], numbers=np.float32)).segments
    np.testing.assert_allclose(segment.q[:, 0], arm_logs[0]["q_shoulder"], atol=1e-6)


# ---- several files


def test_files_of_one_recording(tmp_path, arm_logs):
    """A clock that goes on joins them; one that starts anew, or a gap between them, does not."""
    halves = [
        {name: values[rows] for name, values in arm_logs[0].items()}
        for rows in (slice(0, 250), slice(250, 600))
    ]
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path, columns in zip(paths, halves):
        path.write_text(csv(columns))
    found = read(paths)
    (segment,) = found.segments
    np.testing.assert_array_equal(segment.q[:, 0], arm_logs[0]["q_shoulder"])
    assert (
        list(found.hashes) == [str(path) for path in paths]
        and len(set(found.hashes.values()) | {found.sha256}) == 3
    )
    paths[1].write_text(csv(halves[1] | {"t": halves[1]["t"] + 1.0}))
    with pytest.warns(SysidWarning, match="1 gap"):
        assert [len(s.t) for s in read(paths).segments] == [250, 350]
    paths[1].write_text(csv(halves[1] | {"t": halves[1]["t"] - halves[1]["t"][0]}))
    with pytest.warns(SysidWarning, match="the clock starts anew in 1 of 2 files"):
        assert [len(s.t) for s in read(paths).segments] == [250, 350]
    assert [len(s.t) for s in read(paths, rate=200.0).segments] == [250, 350]


def test_bags_of_one_recording_keep_whole_nanoseconds(tmp_path, arm_logs):
    halves = [
        {name: values[rows] for name, values in arm_logs[0].items()}
        for rows in (slice(0, 250), slice(250, 600))
    ]
    paths = [
        write_bag2(tmp_path / name, columns) for name, columns in zip(("run_0", "run_1"), halves)
    ]
    (segment,) = read(paths).segments
    np.testing.assert_allclose(segment.t, np.arange(600) / 200, rtol=0, atol=1e-12)


def test_patterns_and_folders(tmp_path, arm_logs):
    runs = tmp_path / "runs"
    runs.mkdir()
    for name in ("run_10.csv", "run_2.csv", "run_1.csv.gz", "notes.md", ".hidden.csv"):
        (runs / name).write_text("t\n")
    write_bag2(runs / "run_3", arm_logs[0])
    write_lerobot(runs / "run_4", [arm_logs[0]])
    everything = ["run_1.csv.gz", "run_2.csv", "run_3", "run_4", "run_10.csv"]
    assert (
        listed("runs", tmp_path)
        == listed("runs/*", tmp_path)
        == [f"runs/{name}" for name in everything]
    )
    assert listed("runs/*.csv", tmp_path) == ["runs/run_2.csv", "runs/run_10.csv"]
    assert listed("runs/run_3", tmp_path) == ["runs/run_3"] and listed("**/*.mcap", tmp_path) == [
        "runs/run_3/run_3.mcap"
    ]
    assert listed("runs/*.bag", tmp_path) == ["runs/*.bag"]


def test_patterns_in_an_experiment(experiment, cli, arm_logs):
    folder = experiment(
        config={
            "data.train": ["parts/*.csv"],
            "data.test": [{"files": ["test_*.csv"], "start": 0.5}],
        }
    )
    (folder / "parts").mkdir()
    rows = {
        "parts/1.csv": (0, slice(0, 300)),
        "parts/2.csv": (0, slice(300, 600)),
        "test_1.csv": (1, slice(0, 200)),
        "test_2.csv": (1, slice(200, 600)),
    }
    for name, (k, own) in rows.items():
        (folder / name).write_text(
            csv({column: values[own] for column, values in arm_logs[k].items()})
        )
    said = cli("fit", folder, "--json")
    logs = json.loads(said.out)["logs"]
    assert [(entry["log"], entry["samples"]) for entry in logs] == [
        ("parts/1.csv", 300),
        ("parts/2.csv", 300),
        ("test_1.csv + test_2.csv", 500),
    ]
    assert list(logs[2]["files"]) == ["test_1.csv", "test_2.csv"]
    again = cli("fit", said.run / "experiment.yaml", "--json", out=said.run.parent / "again")
    assert json.loads(again.out)["objective"] == json.loads(said.out)["objective"]


def test_a_pattern_that_matches_nothing(experiment, cli):
    cli("fit", experiment(config={"data.train": ["runs/*.mcap"]})).complains(
        "runs/*.mcap", "no file matches"
    )


def test_a_test_log_that_is_a_part_of_the_training_recording(experiment, arm_logs):
    folder = experiment(config={"data.train": [{"files": ["train.csv", "test.csv"]}]})
    found = pipeline.fit(pipeline.load(folder))
    assert any("test log test.csv overlaps a training log" in notice for notice in found.notices)


def test_checking_episodes(experiment, arm_logs):
    """Where episodes meet, an angle jumps and the clock does not: that is no fault."""
    import sysid

    folder = experiment(config={"data.train": ["set"], "data.columns": ...})
    jump = {
        name: values + (2 * np.pi if name == "q_elbow" else 0.0)
        for name, values in arm_logs[1].items()
    }
    write_lerobot(folder / "set", [arm_logs[0], jump])
    assert not {fault.fault for fault in sysid.check(pipeline.load(folder))} & {
        "angle_wrap",
        "clock_gap",
        "clock_jitter",
    }


# ---- HDF5


def test_hdf5_opens_no_other_file(tmp_path, arm_logs):
    import h5py

    secret = write_aloha(tmp_path / "secret.h5", arm_logs[0])
    for name, make in {
        "link": lambda file: file.__setitem__("more", h5py.ExternalLink(str(secret), "/action")),
        "virtual": lambda file: file.create_virtual_dataset("more", _virtual(secret)),
        "stored": lambda file: file.create_dataset(
            "more", (600, 2), "f8", external=[(str(secret), 0, 9600)]
        ),
    }.items():
        path = write_aloha(tmp_path / f"{name}.h5", arm_logs[0])
        with h5py.File(path, "r+") as file:
            make(file)
        with pytest.raises(LogError, match="'more' is .* which would open another file"):
            read(path, rate=200.0)


def _virtual(path):
    import h5py

    layout = h5py.VirtualLayout(shape=(600, 2), dtype="f8")
    layout[:] = h5py.VirtualSource(str(path), "action", shape=(600, 2))
    return layout


def test_hdf5_that_turns_on_itself_or_promises_too_much(tmp_path, arm_logs):
    import h5py

    path = write_aloha(tmp_path / "log.h5", arm_logs[0])
    with h5py.File(path, "r+") as file:
        file["observations/again"] = file["observations"]
        file["soft"] = h5py.SoftLink("/action")
        file.create_dataset("huge", (10**12,), "f8", chunks=(1024,))
    table = open_table(path)
    assert set(table.names) == {
        f"{name}{k}"
        for name in ("observations/qpos", "observations/qvel", "observations/effort", "action")
        for k in ("", "[0]", "[1]")
    }
    assert read(path, rate=200.0, columns={"position": "/observations/qpos"}).samples == 600
    with pytest.raises(LogError, match="no column 't' for time.*data.rate"):
        read(path)
    (tmp_path / "short.h5").write_bytes(path.read_bytes()[:3000])
    with pytest.raises(LogError, match="cannot be read"):
        read(tmp_path / "short.h5", rate=200.0)


def test_droid_has_a_clock_of_whole_nanoseconds(tmp_path, arm_logs):
    path = write_droid(tmp_path / "trajectory.h5", arm_logs[0])
    name = "observation/timestamp/robot_state/robot_timestamp"
    np.testing.assert_array_equal(open_table(path).load([name])[name], stamps(arm_logs[0]))
    assert stamps(arm_logs[0])[0] > 2**53 and SECOND == 10**9
    import h5py

    with h5py.File(
        path, "r+"
    ) as file:  # the robot's stamps were not kept, those of the computer were
        group = file["observation/timestamp/robot_state"]
        del group["robot_timestamp_nanos"]
        group["read_start"] = stamps(arm_logs[0]) // 1_000_000
    (segment,) = read(path).segments
    np.testing.assert_allclose(segment.t, arm_logs[0]["t"], rtol=0, atol=1e-3)


# ---- packed files


def test_packed_files(tmp_path, arm_logs):
    import bz2
    import lzma

    text = csv(arm_logs[0]).encode()
    for ending, pack in ((".gz", gzip.compress), (".bz2", bz2.compress), (".xz", lzma.compress)):
        (tmp_path / f"a.csv{ending}").write_bytes(pack(text))
        np.testing.assert_array_equal(
            read(tmp_path / f"a.csv{ending}").segments[0].q[:, 0], arm_logs[0]["q_shoulder"]
        )
        (tmp_path / f"b.csv{ending}").write_bytes(pack(text)[:1000])
        with pytest.raises(LogError, match=f"b.csv{ending}: cannot be unpacked"):
            read(tmp_path / f"b.csv{ending}")
    (tmp_path / "c.csv.gz").write_bytes(gzip.compress(b"t,q_shoulder\n0,x\n"))
    with pytest.raises(LogError, match=r"c\.csv\.gz: joint 'elbow' has no column"):
        read(tmp_path / "c.csv.gz")


@pytest.mark.parametrize("kind", [k for k in FORMATS if k not in ("bag folder", "LeRobot v3")])
def test_corrupt_files_end_in_one_line(tmp_path, arm_logs, kind):
    """Bytes turned over or cut off anywhere: the file is read, or refused as a log."""
    name, write, _ = FORMATS[kind]
    short = {column: values[:40] for column, values in arm_logs[0].items()}
    path = tmp_path / name.format("whole")
    write(path, short)
    if path.is_dir():
        (path,) = path.rglob("*.parquet")
    whole, rng = path.read_bytes(), np.random.default_rng(4)
    for trial in range(40):
        data = np.frombuffer(whole, dtype=np.uint8).copy()
        data[rng.integers(len(data), size=1 + trial % 9)] = rng.integers(256, dtype=np.uint8)
        cut = rng.integers(1, len(data)) if trial % 4 == 0 else len(data)
        broken = tmp_path / f"{trial}{''.join(path.suffixes)}"
        broken.write_bytes(data[:cut].tobytes())
        try:
            table = open_table(broken)
            table.load([column for column in table.names if table.width(column) == 1][:6])
        except LogError as error:
            assert len(str(error).splitlines()) == 1 and str(tmp_path) in str(error)
