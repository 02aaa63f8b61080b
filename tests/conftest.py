"""A little experiment of our own making, and the command line run inside the test process.

The robot is a planar arm of two joints with a rotor on its shoulder; its logs are 3 s at 200 Hz, computed by the
model itself (other masses than the URDF's, friction, noise from a fixed seed). A test says only what differs:

    folder = experiment(config={"prior.weight": -1}, urdf=lambda text: ..., train=lambda columns: ...)
    said = cli("fit", folder)
"""

import copy
import io
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from sysid import regressor, robot, robot_spec

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0 0 -0.2"/><mass value="1.5"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.021" iyz="0" izz="0.003"/></inertial>
    <collision><origin xyz="0 0 -0.2"/><geometry><box size="0.06 0.06 0.4"/></geometry></collision>
  </link>
  <link name="lower">
    <inertial><origin xyz="0 0 -0.15"/><mass value="0.8"/><inertia ixx="0.007" ixy="0" ixz="0" iyy="0.0072" iyz="0" izz="0.001"/></inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/><dynamics damping="0.3" friction="0.2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/><dynamics damping="0.1" friction="0.15"/>
  </joint>
</robot>
"""
JOINTS = ("shoulder", "elbow")
ROTOR = {"joint": "shoulder", "ratio": 9.0, "on": "base", "xyz": [0, 0, 1], "axis": [0, 1, 0], "inertia": {"mass": 0.3, "box": [0.05, 0.02, 0.05]}}
CONFIG = {
    "robot": {"urdf": "robot.urdf", "rotors": [ROTOR]},
    "data": {"train": ["train.csv"], "test": ["test.csv"], "columns": {"time": "t"}, "units": {"time": "s"}},
    "preprocess": {"filter": "savitzky-golay"},
    "model": {"effects": ["viscous", "coulomb"]},
    "prior": {"weight": 1.0e-2},
}
RATE, SECONDS = 200.0, 3.0


def motion(t, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Exciting q, qd, qdd (n, 2): three sines on each joint, differentiated by hand."""
    rng = np.random.default_rng(seed)
    amplitude, phase = rng.uniform(0.15, 0.4, (3, 2)), rng.uniform(0, 2 * np.pi, (3, 2))
    w = 2 * np.pi * np.array([0.5, 1.0, 1.7])[:, None]
    angle = w * np.asarray(t)[:, None, None] + phase
    terms = amplitude * np.sin(angle), amplitude * w * np.cos(angle), -amplitude * w**2 * np.sin(angle)
    return tuple(term.sum(axis=1) for term in terms)


def logged(machine, seed: int) -> dict[str, np.ndarray]:
    """Columns of one log, as a robot with other masses than its URDF would have written it."""
    rng = np.random.default_rng(100 + seed)
    t = np.arange(int(SECONDS * RATE)) / RATE
    q, qd, qdd = motion(t, seed)
    tau = regressor.torque(machine, 1.2 * machine.prior, q, qd, qdd) + machine.damping * qd + machine.friction * np.sign(qd)
    tau += rng.normal(0.0, 0.05, q.shape)
    q = q + rng.normal(0.0, 1e-5, q.shape)
    columns = {"t": t}
    columns |= {f"q_{joint}": q[:, k] for k, joint in enumerate(JOINTS)}
    return columns | {f"tau_{joint}": tau[:, k] for k, joint in enumerate(JOINTS)}


def csv(columns: dict[str, np.ndarray], *, header: bool = True, separator: str = ",") -> str:
    """CSV text that reads back to the last bit."""
    rows = [separator.join(columns)] * header
    rows += [separator.join(map(repr, row)) for row in np.column_stack(list(columns.values())).tolist()]
    return "\n".join(rows) + "\n"


def dump(tree) -> str:
    """A tree as YAML."""
    stream = io.StringIO()
    YAML().dump(tree, stream)
    return stream.getvalue()


def put(tree: dict, changes: dict) -> dict:
    """The tree with values at dotted paths set ("robot.rotors.0.ratio"); numbers are places in lists, ... removes."""
    tree = copy.deepcopy(tree)
    for path, value in changes.items():
        *steps, last = (int(step) if step.isdigit() else step for step in path.split("."))
        node = tree
        for step in steps:
            node = node[step] if isinstance(node, list) else node.setdefault(step, {})
        if value is ...:
            del node[last]
        else:
            node[last] = value
    return tree


@pytest.fixture(scope="session", autouse=True)
def _state(tmp_path_factory):
    """Locks, and what is trusted, of these tests alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="session")
def arm_logs(tmp_path_factory) -> tuple[dict, dict]:
    """Columns of the training log and of the test log."""
    file = tmp_path_factory.mktemp("arm") / "robot.urdf"
    file.write_text(URDF)
    machine = robot.load(robot_spec.RobotSpec(urdf=str(file), rotors=[robot_spec.RotorSpec.model_validate(ROTOR)]))
    return logged(machine, 0), logged(machine, 1)


@pytest.fixture
def experiment(tmp_path, arm_logs):
    """Writes the experiment into a folder and returns it.

    config: {dotted path: value} changed in CONFIG, or the file's whole text or bytes. urdf: text -> text, or text or
    bytes. train, test: columns -> columns, or text or bytes. None leaves the file out.
    """

    def write(*, config=(), urdf=URDF, train=lambda c: c, test=lambda c: c, name="experiment") -> Path:
        folder = tmp_path / name
        folder.mkdir()
        contents = {
            "config.yaml": dump(put(CONFIG, dict(config))) if isinstance(config, (dict, tuple)) else config,
            "robot.urdf": urdf(URDF) if callable(urdf) else urdf,
            "train.csv": train(copy.deepcopy(arm_logs[0])) if callable(train) else train,
            "test.csv": test(copy.deepcopy(arm_logs[1])) if callable(test) else test,
        }
        for file, content in contents.items():
            content = csv(content) if isinstance(content, dict) else content
            if content is not None:
                (folder / file).write_bytes(content if isinstance(content, bytes) else content.encode())
        return folder

    return write


@dataclass(frozen=True)
class Said:
    """What a command left: its exit status, what it printed, and the run folder."""

    status: int
    out: str
    err: str
    run: Path

    def complains(self, *words: str) -> None:
        """Bad input as promised: status 2, one line on standard error with these words, and nothing else anywhere."""
        assert self.status == 2, (self.status, self.err)
        assert self.out == ""
        lines = self.err.splitlines()
        assert len(lines) == 1 and lines[0].startswith("sysid: ") and "Traceback" not in self.err, self.err
        for word in words:
            assert word in self.err, (word, self.err)
        assert not self.run.is_dir() or not any(self.run.iterdir())


@pytest.fixture
def cli(monkeypatch, capfd, tmp_path):
    """Runs `sysid` here, not in a process of its own (which takes a second to start); what C++ prints counts too."""
    from sysid import cli as commands

    def run(*words, out=None) -> Said:
        out = tmp_path / "run" if out is None else out
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["sysid", *map(str, words), "--out", str(out)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as stop:
            commands.main()
        said = capfd.readouterr()
        return Said(int(stop.value.code or 0), said.out, said.err, Path(out))

    return run


# ---- robots with something hidden, simulated once


@pytest.fixture(scope="session")
def planar(tmp_path_factory) -> robot.Robot:
    """The planar arm of the blind benchmark: shoulder and elbow."""
    return robot.load(robot_spec.RobotSpec(urdf=str(_planar(tmp_path_factory))))


def _planar(tmp_path_factory) -> Path:
    from scripts.blind_parts.robots import PLANAR

    file = tmp_path_factory.getbasetemp() / "planar.urdf"
    file.write_text(PLANAR)
    return file


@pytest.fixture(scope="session")
def simulated(tmp_path_factory, planar):
    """Writes a folder with something hidden in the planar arm, once for each name; returns it.

    hide: EFFECT:JOINT:VALUES, or the torque of an effect that no catalogue has.
    """
    from sysid import simulate, specs

    made = {}

    def make(name: str, *hide, seed: int = 1, duration: float = 12.0, rate: float = 500.0, **more) -> Path:
        if name not in made:
            told = [simulate.hidden(h) if isinstance(h, str) else h for h in hide]
            found = simulate.simulate(planar, hide=told, seed=seed, duration=duration, rate=rate, **more)
            made[name] = tmp_path_factory.mktemp("simulated") / name
            spec = robot_spec.RobotSpec(urdf=str(_planar(tmp_path_factory)))
            simulate.write(found, specs.Experiment(robot=spec), made[name])
        return made[name]

    return make


@pytest.fixture(scope="session")
def diagnosed(simulated):
    """The diagnosis of a simulated folder, made once; takes what `simulated` takes."""
    from sysid import pipeline
    from sysid.diagnose.diagnosis import diagnose

    made = {}

    def make(name: str, *hide, **more):
        if name not in made:
            made[name] = diagnose(pipeline.load(simulated(name, *hide, **more)))
        return made[name]

    return make


def matrices(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """t (n,), q and tau (n, 2) of a log's columns."""
    return {"t": columns["t"], **{name: np.column_stack([columns[f"{name}_{joint}"] for joint in JOINTS]) for name in ("q", "tau")}}


def write_mat73(path: Path, variables: dict) -> None:
    """A file as MATLAB's `save -v7.3` writes it: arrays transposed, a list as an N x 1 cell, a dict as a struct."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        cells = file.create_group("#refs#")

        def store(place, name, value):
            if isinstance(value, dict):
                struct = place.create_group(name)
                struct.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, inner in value.items():
                    store(struct, key, inner)
            elif isinstance(value, list):
                references = np.empty((1, len(value)), dtype=h5py.ref_dtype)
                for k, item in enumerate(value):
                    cell = f"{name}_{k}"
                    store(cells, cell, item)
                    references[0, k] = cells[cell].ref
                place.create_dataset(name, data=references).attrs["MATLAB_class"] = np.bytes_("cell")
            else:
                array = np.atleast_1d(value)
                array = array[:, None] if array.ndim == 1 else array
                place.create_dataset(name, data=array.T).attrs["MATLAB_class"] = np.bytes_("double")

        for name, value in variables.items():
            store(file, name, value)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema 1.00 .".ljust(116) + bytes(8) + b"\x00\x02IM")


def write_mat5(path: Path, variables: dict, *, compressed: bool = True) -> None:
    """The same through SciPy; a list becomes an N x 1 cell."""
    from scipy.io import savemat

    def told(value):
        if isinstance(value, dict):
            return {key: told(inner) for key, inner in value.items()}
        if isinstance(value, list):
            cells = np.empty((len(value), 1), dtype=object)
            cells[:, 0] = [np.reshape(item, (-1, 1)) for item in value]
            return cells
        return np.asarray(value)

    savemat(path, told(variables), do_compression=compressed, oned_as="column")


def write_table(path: Path, columns: dict[str, np.ndarray], **options) -> Path:
    """The columns as the format that the path's ending names."""
    if path.suffix == ".csv":
        path.write_text(csv(columns, **options))
    elif path.suffix == ".parquet":
        import polars

        polars.DataFrame(columns).write_parquet(path, **options)
    elif path.suffix == ".npz":
        np.savez(path, **columns)
    else:
        write_mat5(path, columns, **options)
    return path
