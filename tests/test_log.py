"""One little log, written in every way that a log may be written, gives the same angles and torques; and what is mended."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from sysid import experiment_logs, log, log_spec, pipeline, regressor
from sysid.errors import LogError, SysidWarning
from sysid.full_turns import followed, unwrapped
from sysid.readers import open_table
from sysid.resampling import resampled
from tests.conftest import JOINTS, csv, matrices, motion, write_mat5, write_mat73, write_table

CONFIGS = Path(__file__).parents[1] / "configs"
MATRICES = {"columns": {"position": "q", "torque": "tau"}}
NUMBERED = {"columns": {"time": 0, "position": [1, 2], "torque": [3, 4]}}
EXACT = {"rtol": 0, "atol": 1e-12}


def read(file: Path, *, start=None, stop=None, **data) -> log.Log:
    """The log in a file, of two turning joints."""
    spec = log_spec.DataSpec.model_validate(data)
    return log.read(log_spec.LogSpec(file=str(file), start=start, stop=stop), spec, JOINTS, (False, False))


def only(found: log.Log) -> log.Segment:
    (segment,) = found.segments
    return segment


def struct(columns):
    return {"log": {"t": columns["t"], "joint": {"q": matrices(columns)["q"], "tau": matrices(columns)["tau"]}}}


def cells(columns):
    return {name: list(values) for name, values in matrices(columns).items()}


STRUCT = {"columns": {"time": "log.t", "position": "log.joint.q", "torque": "log.joint.tau"}}
SPLIT = {"columns": {"position": ["q[0]", "q[1]"], "torque": "tau"}}
#: ending, how it is written, what the experiment says of it
WAYS = {
    "csv": (".csv", write_table, {}),
    "csv by names": (".csv", write_table, {"columns": {"position": ["q_shoulder", "q_elbow"], "torque": ["tau_shoulder", "tau_elbow"]}}),
    "csv by numbers": (".csv", write_table, NUMBERED),
    "csv without header": (".csv", lambda path, c: write_table(path, c, header=False), NUMBERED),
    "csv with semicolons": (".csv", lambda path, c: write_table(path, c, separator=";"), {}),
    "csv with tabs": (".tsv", lambda path, c: path.write_text(csv(c, separator="\t")), {}),
    "csv with spaces, no header": (".txt", lambda path, c: path.write_text(csv(c, separator=" ", header=False)), NUMBERED),
    "csv with decimal commas": (".csv", lambda path, c: path.write_text(csv(c, separator=";").replace(".", ",")), {}),
    "csv with decimal commas, no header": (".csv", lambda path, c: path.write_text(csv(c, separator=";", header=False).replace(".", ",")), NUMBERED),
    "csv with a space after each comma": (".csv", lambda path, c: path.write_text(csv(c, separator=", ")), {}),
    "csv in quotes": (".csv", lambda path, c: path.write_text('"' + csv(c, separator='","').rstrip().replace("\n", '"\n"') + '"\n'), {}),
    "csv of Windows": (".CSV", lambda path, c: path.write_bytes(b"\xef\xbb\xbf" + csv(c).replace("\n", "\r\n").encode()), {}),
    "csv of Windows without header": (".csv",
        lambda path, c: path.write_bytes(b"\xef\xbb\xbf" + csv(c, header=False).replace("\n", "\r\n").encode()), NUMBERED),
    "csv without a last line end": (".csv", lambda path, c: path.write_text(csv(c).rstrip()), {}),
    "csv with other columns": (".csv", lambda path, c: path.write_text(csv({"note": np.zeros(600)} | c).replace("\n0.0,", "\nwords,")), {}),
    "parquet": (".parquet", write_table, {}),
    "parquet by numbers": (".parquet", write_table, NUMBERED),
    "npz of columns": (".npz", write_table, {}),
    "npz of matrices": (".npz", lambda path, c: write_table(path, matrices(c)), MATRICES),
    "npz of matrices, one by columns": (".npz", lambda path, c: write_table(path, matrices(c)), SPLIT),
    "npz of matrices, by numbers": (".npz", lambda path, c: write_table(path, matrices(c)), NUMBERED),
    "npz of matrices lying down": (".npz", lambda path, c: write_table(path, {k: v.T for k, v in matrices(c).items()}), MATRICES),
    "npz of one matrix": (".npz", lambda path, c: np.savez(path, np.column_stack(list(c.values()))), NUMBERED),
    "npz of one matrix, by name": (".npz", lambda path, c: np.savez(path, np.column_stack(list(c.values()))),
        {"columns": {"time": "arr_0[0]", "position": ["arr_0[1]", "arr_0[2]"], "torque": ["arr_0[3]", "arr_0[4]"]}}),
    "npz compressed": (".npz", lambda path, c: np.savez_compressed(path, **c), {}),
    "mat v5 of columns": (".mat", write_table, {}),
    "mat v5 of matrices": (".mat", lambda path, c: write_mat5(path, matrices(c)), MATRICES),
    "mat v5 uncompressed": (".mat", lambda path, c: write_mat5(path, matrices(c), compressed=False), MATRICES),
    "mat v5 of structs": (".mat", lambda path, c: write_mat5(path, struct(c)), STRUCT),
    "mat v5 of cells": (".mat", lambda path, c: write_mat5(path, cells(c)), MATRICES),
    "mat v7.3 of columns": (".mat", write_mat73, {}),
    "mat v7.3 of matrices": (".mat", lambda path, c: write_mat73(path, matrices(c)), MATRICES),
    "mat v7.3 of structs": (".mat", lambda path, c: write_mat73(path, struct(c)), STRUCT),
    "mat v7.3 of cells": (".mat", lambda path, c: write_mat73(path, cells(c)), MATRICES),
}  # fmt: skip


@pytest.mark.parametrize(("ending", "write", "data"), WAYS.values(), ids=WAYS)
def test_every_way_to_write_a_log(tmp_path, arm_logs, ending, write, data):
    file, columns = tmp_path / f"log{ending}", arm_logs[0]
    write(file, columns)
    found, expected = read(file, **data), matrices(columns)
    segment = only(found)
    for name in ("t", "q", "tau"):
        np.testing.assert_allclose(getattr(segment, name), expected[name], **EXACT)
    assert found.samples == 600 and len(found.sha256) == 64 and segment.qd is segment.qdd is None and segment.signals == {}


# ---- units


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".npz", ".mat"])
@pytest.mark.parametrize(("unit", "per_second"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_units(tmp_path, arm_logs, ending, unit, per_second):
    """Milli-, micro- and nanoseconds, degrees, and amperes; in NPZ and MAT the clock counts in whole numbers."""
    columns = dict(arm_logs[0])
    clock = np.round(columns["t"] * per_second)
    columns["t"] = clock.astype(np.int64) if ending != ".csv" else clock
    constants = {"shoulder": 1.7, "elbow": -0.4}
    for joint in JOINTS:
        columns[f"q_{joint}"] = np.degrees(columns[f"q_{joint}"])
        columns[f"tau_{joint}"] = columns[f"tau_{joint}"] / constants[joint]
    file = write_table(tmp_path / f"log{ending}", columns)
    segment, expected = only(read(file, units={"time": unit, "position": "deg", "torque": "A", "torque_constant": constants})), matrices(arm_logs[0])
    for name in ("t", "q", "tau"):
        np.testing.assert_allclose(getattr(segment, name), expected[name], **EXACT)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"position": ["q_elbow", "q_elbow"]}, ["'q_elbow'", "position of shoulder and the position of elbow"]),
        ({"torque": ["tau_shoulder", "tau_shoulder"]}, ["'tau_shoulder'", "torque of shoulder and the torque of elbow"]),
        ({"torque": "q_{joint}"}, ["'q_shoulder'", "position of shoulder and the torque of shoulder"]),
        ({"position": [1, 1], "torque": [3, 4]}, ["position of shoulder and the position of elbow"]),
    ],
)
@pytest.mark.parametrize("command", ["fit", "check"])
def test_a_column_is_one_thing(experiment, cli, command, columns, words):
    cli(command, experiment(config={"data.columns": columns})).complains(*words, "data.columns")


def test_units_of_speeds_and_of_sliding_joints(tmp_path):
    """One unit is named for all joints: degrees leave a slide's metres alone, millimetres a hinge's radians."""
    n = 20
    columns = {"t": np.arange(n) / 100, **{f"{signal}_{joint}": np.full(n, 90.0) for signal in ("q", "qd", "qdd", "tau") for joint in JOINTS}}
    file = write_table(tmp_path / "log.csv", columns)
    for unit, hinge, slide in (("deg", np.pi / 2, 90.0), ("turns", 180.0 * np.pi, 90.0), ("mm", 90.0, 0.09), ("m", 90.0, 90.0)):
        data = log_spec.DataSpec.model_validate({"columns": {"velocity": "qd_{joint}", "acceleration": "qdd_{joint}"}, "units": {"position": unit}})
        segment = only(log.read(log_spec.LogSpec(file=str(file)), data, JOINTS, (False, True)))
        for values in (segment.q, segment.qd, segment.qdd):
            np.testing.assert_allclose(values, np.tile([hinge, slide], (n, 1)), **EXACT)
        np.testing.assert_array_equal(segment.tau, 90.0)


@pytest.mark.parametrize(("ending", "whole"), [(".csv", False), (".parquet", True), (".parquet", False), (".npz", True), (".mat", True)])
def test_nanoseconds_since_1970(tmp_path, arm_logs, ending, whole):
    """2e9 s in ns have more digits than a float; whole numbers lose none, floats (steps of 256 ns) no more than theirs."""
    stamps = 2_000_000_000_123_456_789 + np.arange(600, dtype=np.int64) * 5_000_000
    file = write_table(tmp_path / f"log{ending}", arm_logs[0] | {"t": stamps if whole else stamps.astype(float)})
    segment, expected = only(read(file, units={"time": "ns"})), matrices(arm_logs[0])
    np.testing.assert_allclose(segment.t, expected["t"], rtol=0, atol=1e-12 if whole else 300e-9)
    assert segment.step == pytest.approx(0.005, rel=1e-12 if whole else 1e-6)
    for name in ("q", "tau"):
        np.testing.assert_array_equal(getattr(segment, name), expected[name])


def test_seconds_since_1970(tmp_path, arm_logs):
    file = write_table(tmp_path / "log.csv", arm_logs[0] | {"t": 2e9 + arm_logs[0]["t"]})
    np.testing.assert_allclose(only(read(file)).t, arm_logs[0]["t"], rtol=0, atol=3e-7)


# ---- pieces, gaps, clocks


def test_pieces_share_no_sample(tmp_path, arm_logs):
    file = write_table(tmp_path / "log.csv", arm_logs[0] | {"t": 7.0 + arm_logs[0]["t"]})
    expected, cuts = matrices(arm_logs[0])["q"], [None, 1.0, 1.5, None]
    parts = [only(read(file, start=start, stop=stop)).q for start, stop in zip(cuts, cuts[1:])]
    assert [len(part) for part in parts] == [200, 100, 300]
    np.testing.assert_array_equal(np.concatenate(parts), expected)


def test_gaps_split_a_log(tmp_path, arm_logs):
    t = arm_logs[0]["t"]
    keep = (t < 1.0) | ((t > 1.5) & (t < 2.0)) | (t > 2.1)
    file = write_table(tmp_path / "log.csv", {name: values[keep] for name, values in arm_logs[0].items()})
    with pytest.warns(SysidWarning, match=r"2 gap\(s\), the longest 0\.51 s, split the log into 3 segments"):
        found = read(file)
    assert [len(segment.t) for segment in found.segments] == [200, 99, 179] and found.samples == keep.sum()
    np.testing.assert_array_equal(np.concatenate([segment.q for segment in found.segments]), matrices(arm_logs[0])["q"][keep])


def test_short_hole_is_filled(tmp_path, arm_logs):
    """A few lost samples are interpolated; more than ten in a row are a gap."""
    lost = [100, 101, 300]
    file = write_table(tmp_path / "log.csv", {name: np.delete(values, lost) for name, values in arm_logs[0].items()})
    with pytest.warns(SysidWarning, match="resampled to a uniform 0.005 s"):
        segment = only(read(file))
    np.testing.assert_allclose(segment.q[lost], matrices(arm_logs[0])["q"][lost], atol=2e-4)
    np.testing.assert_allclose(np.delete(segment.q, lost, 0), np.delete(matrices(arm_logs[0])["q"], lost, 0), atol=1e-9)


def test_resampling_reconstructs_a_sine(tmp_path):
    """2 Hz of amplitude 1 on a clock of 100 Hz that stumbles by 40 %: angles to 2e-5, torque, which is moved along its slope, to 4e-3."""
    t = np.arange(500) / 100 + np.random.default_rng(0).uniform(-0.002, 0.002, 500)
    sine = np.sin(2 * np.pi * 2 * t)
    file = write_table(tmp_path / "log.csv", {"t": t, **{f"{signal}_{joint}": sine for signal in ("q", "tau") for joint in JOINTS}})
    with pytest.warns(SysidWarning, match="resampled"):
        segment = only(read(file))
    assert np.ptp(np.diff(segment.t)) < 1e-12 and segment.step == pytest.approx(0.01, rel=0.02)
    truth = np.sin(2 * np.pi * 2 * segment.t)[:, None]
    inner = slice(3, -3)
    assert np.abs(segment.q - truth)[inner].max() < 2e-5
    assert np.abs(segment.tau - truth)[inner].max() < 4e-3


def test_resampled_torque_is_as_noisy_as_logged():
    """White noise of 20 000 jittered samples keeps its deviation, 1 within three hundredths, and stays white; a linear resampling
    leaves 0.86 of it here."""
    rng = np.random.default_rng(0)
    t = 0.01 * (np.arange(20_000) + 0.4 * rng.uniform(-1.0, 1.0, 20_000))
    noise = rng.standard_normal((len(t), 2))
    _, found = resampled(t, {"tau": noise, "signals.linear": noise}, 0.01)
    assert found["tau"].std(axis=0) == pytest.approx([1.0, 1.0], abs=0.03)
    assert found["signals.linear"].std() < 0.87
    _, plain = resampled(t, {"tau": noise}, 0.01, linear=True)
    np.testing.assert_array_equal(plain["tau"], found["signals.linear"])
    assert abs(np.corrcoef(found["tau"][1:, 0], found["tau"][:-1, 0])[0, 1]) < 0.1


@pytest.mark.parametrize("height", [1.0, -50.0])
def test_resampling_leaves_a_spike_in_its_row(height):
    """Beside it nothing of it is left; a step is smeared by an eighth at most."""
    rng = np.random.default_rng(1)
    t = 0.01 * (np.arange(400) + 0.4 * rng.uniform(-1.0, 1.0, 400))
    spike, step = np.zeros((400, 1)), np.where(np.arange(400) < 200, 0.0, height)[:, None]
    spike[137] = height
    _, found = resampled(t, {"tau": np.hstack([spike, step])}, 0.01)
    assert np.count_nonzero(found["tau"][:, 0]) == 1 and found["tau"][:, 0].sum() == pytest.approx(height)
    off = np.minimum(np.abs(found["tau"][:, 1]), np.abs(found["tau"][:, 1] - height))
    assert off.max() <= abs(height) / 8.0


def test_rounded_stamps_are_uniform(tmp_path, arm_logs):
    """Stamps rounded to a hundredth of a step are no irregular sampling, and nothing is told."""
    file = write_table(tmp_path / "log.csv", arm_logs[0] | {"t": np.round(arm_logs[0]["t"] + 2e-5, 4)})
    np.testing.assert_array_equal(only(read(file)).q, matrices(arm_logs[0])["q"])


def test_rate_in_place_of_a_clock(tmp_path, arm_logs):
    columns = {name: values for name, values in arm_logs[0].items() if name != "t"}
    np.testing.assert_allclose(only(read(write_table(tmp_path / "log.csv", columns), rate=200)).t, arm_logs[0]["t"], **EXACT)


# ---- signals, several logs


@pytest.mark.parametrize("where", ["data", "columns"])
def test_other_signals(tmp_path, arm_logs, where):
    t = arm_logs[0]["t"]
    file = write_table(tmp_path / "log.csv", arm_logs[0] | {"T motor": 20 + t, "force": np.sin(t), "unused": t})
    names = {"temperature": "T motor", "push": 6}
    segment = only(read(file, **({"signals": names} if where == "data" else {"columns": {"signals": names}})))
    assert set(segment.signals) == set(names)
    np.testing.assert_array_equal(segment.signals["temperature"], 20 + t)
    np.testing.assert_array_equal(segment.signals["push"], np.sin(t))


def test_signals_go_with_their_samples(tmp_path, arm_logs):
    """Through gaps, pieces and resampling a signal stays beside the angles it was logged with."""
    t = arm_logs[0]["t"]
    keep = (t < 1.0) | (t > 2.0)
    jitter = np.random.default_rng(1).uniform(-1e-3, 1e-3, 600)
    file = write_table(tmp_path / "log.csv", {name: values[keep] for name, values in (arm_logs[0] | {"t": t + jitter, "clock": t + jitter}).items()})
    with pytest.warns(SysidWarning):
        found = read(file, start=0.5, signals={"clock": "clock"})
    assert len(found.segments) == 2
    for segment in found.segments:
        np.testing.assert_allclose(segment.signals["clock"], segment.t, atol=1e-12)


@pytest.mark.parametrize("unit, turn", [("rad", 2 * np.pi), ("deg", 360.0)])
def test_angles_that_were_logged_within_a_turn_go_on(tmp_path, arm_logs, unit, turn):
    """As they were, but for whole turns, and it is said; the first sample of a piece that another recording begins with is no jump."""
    q = {name: turn / (2 * np.pi) * (arm_logs[0][name] + 2.9) for name in ("q_shoulder", "q_elbow")}
    plain = read(write_table(tmp_path / "plain.csv", arm_logs[0] | q), units={"position": unit})
    within = q | {"q_elbow": (q["q_elbow"] + turn / 2) % turn - turn / 2}
    with pytest.warns(SysidWarning, match="'elbow' jumps by a turn") as told:
        wrapped = read(write_table(tmp_path / "within.csv", arm_logs[0] | within), units={"position": unit})
    assert len(told) == 1
    assert np.abs(np.diff(within["q_elbow"])).max() > 0.9 * turn
    turns = (only(plain).q - only(wrapped).q) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.tile(np.round(turns[0]), (len(turns), 1)), atol=1e-9)


def test_what_slides_and_what_was_recorded_anew_jumps_by_no_turn():
    """A slide of 6.3 m from sample to sample stays, and so does another recording's first angle; a glitch of one sample goes."""
    q = np.zeros((9, 2))
    q[4:, 0] = q[6:, 1] = 2 * np.pi
    q[2, 1] = -2 * np.pi
    found, joints = unwrapped(q, np.array([False, True]), [(0, 6), (6, 9)])
    np.testing.assert_array_equal(found[:, 0], q[:, 0])
    np.testing.assert_allclose(found[:, 1], [0.0] * 6 + [2 * np.pi] * 3, atol=1e-12)
    assert joints == [1]
    assert unwrapped(q, np.array([False, False]), [(0, 9)])[0] is q


def test_a_servos_command_goes_on_with_its_angle():
    """Late by some samples, so that the two jump in different rows: what the servo is behind by is what it was."""
    angle = np.linspace(0.0, 20.0, 2000)
    command = angle + 0.3
    wrap = lambda x: (x + np.pi) % (2 * np.pi) - np.pi
    q, asked = followed(wrap(angle), wrap(command))
    np.testing.assert_allclose(asked - q, 0.3, atol=1e-9)
    assert np.abs(np.diff(q)).max() < 0.02 and np.abs(np.diff(asked)).max() < 0.02
    plain = followed(angle, command)
    assert plain[0] is angle and plain[1] is command


def test_several_logs(experiment, arm_logs):
    """Two logs and a piece in train, two in test: every sample counts once, and no filter sees across a border."""
    config_ = {
        "data.train": ["train.csv", {"file": "test.csv", "start": 0, "stop": 1}, "more.parquet"],
        "data.test": [{"file": "test.csv", "start": 1}, {"file": "test.csv", "start": 1, "stop": 2}],
    }
    folder = experiment(config=config_)
    write_table(folder / "more.parquet", {name: values[:300] for name, values in arm_logs[1].items()})
    found = pipeline.fit(pipeline.load(folder))
    edges = 20  # rows that a window of 21 takes off a log
    assert found.samples == {"train": 600 + 200 + 300 - 3 * edges, "test": 400 + 200 - 2 * edges}
    assert [(entry["part"], entry["log"], entry["samples"]) for entry in found.logs] == [
        ("train", "train.csv", 600), ("train", "test.csv", 200), ("train", "more.parquet", 300), ("test", "test.csv", 400), ("test", "test.csv", 200),
    ]  # fmt: skip
    assert np.bincount(found.predictions["train"].log).tolist() == [580, 180, 280] and found.solution.converged


# ---- MAT files


def test_mat_v5_of_every_number_type(tmp_path):
    """Against SciPy, which wrote the file: every class, both byte orders of the bits that matter, and what is left out."""
    from scipy.io import savemat
    from scipy.sparse import eye_array

    variables = {kind: np.arange(6).reshape(3, 2).astype(kind) for kind in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8")}
    left_out = {"text": "words", "complex": np.array([1j, 2]), "sparse": eye_array(3), "mixed": np.array([1, "a", [1, 2]], dtype=object)}
    savemat(tmp_path / "log.mat", variables | left_out | {"truth": np.array([True, False]), "scalar": 2.5, "empty": np.zeros((0, 3))})
    table = open_table(tmp_path / "log.mat")
    assert not set(left_out) & set(table.names)
    for name, values in variables.items():
        loaded = table.load([name])[name]
        np.testing.assert_array_equal(loaded, values)
        assert loaded.dtype.kind == ("f" if values.dtype.kind == "f" else values.dtype.kind)


def test_mat_v5_big_endian(tmp_path):
    """Written by hand after the format's description: a 2 x 1 double named q, on a machine of the other byte order."""
    import struct as pack

    element = lambda kind, data: pack.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)  # noqa: E731
    matrix = (
        element(6, pack.pack(">II", 6, 0)) + element(5, pack.pack(">ii", 2, 1)) + pack.pack(">HH", 1, 1) + b"q\0\0\0" + element(9, pack.pack(">dd", 1.5, -2.0))
    )
    (tmp_path / "log.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + pack.pack(">H", 0x0100) + b"MI" + element(14, matrix))
    np.testing.assert_array_equal(open_table(tmp_path / "log.mat").load(["q"])["q"], [1.5, -2.0])


@pytest.mark.parametrize("write", [write_mat5, write_mat73])
def test_mat_struct_arrays_and_uneven_cells(tmp_path, write):
    """Cells of one size are a matrix; of several they are no column, and other variables are read all the same."""
    write(tmp_path / "log.mat", {"even": [np.full(3, k) for k in range(4)], "uneven": [np.ones(3), np.zeros(2)], "t": np.arange(4.0)})
    table = open_table(tmp_path / "log.mat")
    np.testing.assert_array_equal(table.load(["t"])["t"], np.arange(4.0))
    np.testing.assert_array_equal(table.load(["even"])["even"], np.repeat(np.arange(4.0)[:, None], 3, 1))
    with pytest.raises(LogError, match="uneven"):
        table.load([table.resolve("uneven")])


# ---- the public log of Cheetah 3


def cheetah(n: int) -> dict[str, list[np.ndarray]]:
    """Variables as CheetahSysID.mat has them, from the leg of our own configuration: N x 1 cells of 3 x 1."""
    machine, _, prior = pipeline.build(pipeline.load(CONFIGS / "cheetah3_mit.yaml"))
    t = np.arange(n) / 1000
    q, qd, qdd = (np.column_stack([a, b[:, 0]]) for a, b in zip(motion(t, 5), motion(t, 6)))
    friction = 0.5 * qd + 2.0 * np.sign(qd)
    tau = regressor.torque(machine, 1.1 * prior, q, qd, qdd) + friction + np.random.default_rng(0).normal(0.0, 1.45, q.shape)
    return {name: list(values) for name, values in zip(("q", "qd", "qdd", "tau"), (q, qd, qdd, tau))}


NO_LEG = not (CONFIGS / "../data/cheetah3/leg.urdf").exists()


@pytest.mark.long
@pytest.mark.skipif(NO_LEG, reason="data/cheetah3/leg.urdf is not there")
@pytest.mark.parametrize("write", [write_mat5, write_mat73])
def test_public_log(tmp_path, cli, write):
    """configs/cheetah3_mit.yaml on a file of that structure; 1.6 s for its 28, cut at 1.2 s for 20."""
    text = (CONFIGS / "cheetah3_mit.yaml").read_text()
    assert "stop: 20}" in text and "start: 20}" in text and "fb71202" in text and "e17340a4392e752d4b99fd71ab4337cb382e18b2" in text
    for folder in ("configs", "data/cheetah3"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "configs/cheetah3_mit.yaml").write_text(text.replace("stop: 20}", "stop: 1.2}").replace("start: 20}", "start: 1.2}"))
    shutil.copy(CONFIGS / "../data/cheetah3/leg.urdf", tmp_path / "data/cheetah3")
    variables = cheetah(1601)
    write(tmp_path / "data/cheetah3/CheetahSysID.mat", variables | {"Y": [np.zeros((3, 60))] * 3})
    experiment = pipeline.load(tmp_path / "configs/cheetah3_mit.yaml")
    machine = pipeline.build(experiment)[0]
    found = [experiment_logs.read(experiment, machine, logs)[0].segments[0] for logs in (experiment.data.train, experiment.data.test)]
    for name, values in variables.items():
        np.testing.assert_allclose(np.concatenate([getattr(segment, name) for segment in found]), values, **EXACT)
    said = cli("fit", experiment.path, "--json")
    document = json.loads(said.out)
    assert (said.status, said.err, document["notices"]) == (0, "", [])
    assert document["samples"] == {"train": 1200, "test": 401} and len(document["parameters"]) == 66
    assert all(1.2 < rms < 1.8 for rms in document["rms"]["test"].values())


@pytest.mark.skipif(NO_LEG, reason="data/cheetah3/leg.urdf is not there")
def test_public_log_not_there(cli, tmp_path):
    text = (CONFIGS / "cheetah3_mit.yaml").read_text().replace("../data", str(CONFIGS.parent / "data"))
    (tmp_path / "cheetah3_mit.yaml").write_text(text.replace("CheetahSysID", "NotShipped"))
    cli("fit", tmp_path / "cheetah3_mit.yaml").complains("NotShipped.mat", "no such file")


@pytest.mark.skipif(not (CONFIGS / "cheetah3.yaml").exists(), reason="configs/cheetah3.yaml is not there")
def test_both_configurations_are_of_one_leg():
    ours, theirs = (pipeline.load(CONFIGS / f"{name}.yaml") for name in ("cheetah3", "cheetah3_mit"))
    for section in ("robot", "model", "prior", "solver"):
        assert getattr(ours, section) == getattr(theirs, section)


@pytest.mark.parametrize(("rate", "digits"), [(128.0, 3), (300.0, 3), (1000.0, 3), (400.0, 4)])
def test_rounded_stamps_are_a_steady_clock(rate, digits, recwarn):
    """Stamps rounded to milliseconds are not irregular sampling: nothing is interpolated."""
    from sysid.log import _segments

    t = np.round(np.arange(3000) / rate, digits)
    q = np.random.default_rng(0).normal(size=(3000, 2))
    (segment,) = _segments(t, {"q": q, "tau": q}, "made")
    np.testing.assert_array_equal(segment.q, q)
    np.testing.assert_allclose(segment.step, 1 / rate, rtol=1e-3)
    assert not recwarn.list


@pytest.mark.parametrize("n", [2, 3, 10, 300])
@pytest.mark.parametrize("quantum", [1.0, 1e-3])
def test_how_far_stamps_are_off_a_line_is_what_a_linear_program_says(n, quantum):
    """The hull of the stamps tells the best line in Chebyshev's sense."""
    from scipy.optimize import linprog

    from sysid.rounded_stamps import off_line

    rng = np.random.default_rng(n)
    values = 10.0 * np.arange(n) + quantum * rng.normal(size=n)
    rows = np.stack([np.ones(n), np.arange(n)], axis=1)
    signs = np.concatenate([rows, -rows])
    best = linprog(
        [0.0, 0.0, 1.0], np.column_stack([signs, -np.ones(2 * n)]), np.concatenate([values, -values]), bounds=[(None, None), (None, None), (0, None)]
    )
    assert off_line(values) == pytest.approx(best.fun, abs=1e-6 * quantum)


def test_stamps_that_jitter_by_what_they_are_rounded_to_are_put_right():
    """A logger that is early or late by 0.5 ms and writes milliseconds has every stamp within one of a steady clock; the angles tell them apart."""
    from sysid.log import _segments

    rng = np.random.default_rng(3)
    steady = 0.01 * np.arange(400)
    taken = steady + np.clip(5e-4 * rng.standard_normal(400), -1.4e-3, 1.4e-3)
    taken[[0, -1]] = steady[[0, -1]]
    stamps = np.round(taken, 3)
    assert np.abs(stamps - steady).max() < 1.01e-3 < np.abs(np.diff(stamps) - 0.01).max()
    at = lambda t: np.stack([np.sin(5.0 * t), np.cos(3.0 * t), np.sin(4.0 * t + 1.0)], axis=1)  # noqa: E731
    q = at(taken)
    with pytest.warns(SysidWarning) as told:
        (segment,) = _segments(stamps, {"q": q, "tau": q}, "made")
    said = str([str(one.message) for one in told])
    assert "the time stamps are off" in said and "at the ends" in said and "up to 0." in said
    # at the ends of the log the angles do not tell its clock
    assert 0.02 < segment.t[0] < 0.4 and 0.02 < stamps[-1] - segment.t[-1] < 0.4
    assert len(segment.t) == len(segment.clock.below) > 320
    rms = lambda x: np.sqrt(np.mean(np.square(x[20:-20])))  # noqa: E731
    assert rms(segment.q - at(segment.t)) < 0.4 * rms(q - at(steady))
    # where nothing moves fast enough to tell, they are a steady clock's
    slow = at(0.02 * taken) + 1e-4 * rng.standard_normal((400, 3))
    (segment,) = _segments(stamps, {"q": slow, "tau": slow}, "made")
    np.testing.assert_array_equal(segment.q, slow)
