"""YAML -> Experiment: defaults, the contract's own example, and that a line is named wherever something is wrong."""

import dataclasses

import pytest

from sysid import config, experiment_logs, pipeline, specs
from sysid.errors import ConfigError

CONTRACT = """
robot:
  urdf: ../data/cheetah3/leg.urdf     # or example-robot-data://ur_description/urdf/ur5_robot.urdf
  joints: [abad, hip, knee]           # optional: default every moving joint; others are locked (lock: {name: angle})
  gravity: [0, 0, -9.81]              # optional, world frame of the URDF base
  rotors:                             # optional: one full rigid body (10 parameters) per motor rotor
    - {joint: abad, ratio: 10.604, on: base, xyz: [0, -0.128, 0], rpy: [0, 0, 0], axis: [1, 0, 0],
       inertia: {mass: 0.5, com: [0, 0, 0], box: [0.0225, 0.09, 0.09]}}
  transmission: {}                    # optional: motor speeds as a linear map of joint speeds, for coupled (belt, differential) joints
data:
  train: [../data/cheetah3/train.parquet] # a path, a public dataset (emps:DATA_EMPS), or {file: ..., start: 0, stop: 12} in seconds
  test: [../data/cheetah3/test.parquet]   # held out; never used to fit
  columns: {time: t, position: "q_{joint}", torque: "tau_{joint}"}   # these are the defaults; a pattern, a list of names or of column numbers
  units: {time: s, position: rad, torque: N m}                       # also ms, us, ns; deg; A with torque_constant per joint
preprocess: {filter: savitzky-golay, order: 4, window: 0.1}          # window in seconds, or auto (held-out choice)
model:
  inertia: log-cholesky               # log-cholesky | exponential | eigenvalue | linear
  effects: [viscous, coulomb]         # a name = on every joint; or {stribeck: {joints: [hip]}}
prior: {divergence: log-det, weight: 1.0e-2, source: urdf}           # log-det | pullback | euclidean
solver: {tolerance: 1.0e-8, max_iterations: 200}
"""


def load(tmp_path, text: str) -> specs.Experiment:
    file = tmp_path / "experiment.yaml"
    file.write_text(text)
    return config.load(file)


def test_contract_example(tmp_path):
    found = load(tmp_path, CONTRACT)
    assert found.name == "experiment" and found.folder == tmp_path
    assert found.robot.rotors[0].ratio == 10.604 and found.robot.rotors[0].inertia.box == [0.0225, 0.09, 0.09]
    assert found.robot.transmission == {} and found.prior.weight == 0.01 and found.solver.tolerance == 1e-8
    # everything that the example says of columns, units, filter, model, prior and solver is a default
    empty = load(tmp_path, "")
    for section in ("preprocess", "model"):
        assert getattr(found, section) == getattr(empty, section)
    # but for joints' weights, which go with a weight of the prior that nobody gives
    assert empty.solver.weighting == "noise" and found.solver == empty.solver.model_copy(update={"weighting": "none"})
    assert empty.prior.weight == "auto" and empty.prior.model_copy(update={"weight": 0.01}) == found.prior
    assert found.data.columns == empty.data.columns and found.data.units == empty.data.units and found.robot.gravity == empty.robot.gravity


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "{}", "---\n", "\ufeff", "robot: {}\ndata: {}\nmodel: {}"])
def test_defaults(tmp_path, text):
    found = load(tmp_path, text)
    assert found.robot.urdf == "robot.urdf" and found.robot.joints is None and found.robot.rotors == []
    assert [log.file for log in found.data.train] == ["train.csv"] and [log.file for log in found.data.test] == ["test.csv"]
    assert (found.preprocess.filter, found.preprocess.order, found.preprocess.window, found.preprocess.torque) == ("savitzky-golay", 4, 0.1, "raw")
    assert [effect.name for effect in found.model.effects] == ["viscous", "coulomb"]


def test_folder_with_an_empty_config(experiment):
    folder = experiment(config="")
    found = pipeline.load(folder)
    assert found.name == "experiment" and found.path == folder / "config.yaml"
    machine, model, prior = pipeline.build(found)
    assert machine.joints == ("shoulder", "elbow") and model.bodies == len(prior) == 2
    assert [log.samples for log in experiment_logs.read(found, machine, found.data.test)] == [600]
    assert dataclasses.is_dataclass(pipeline.fit(found))


def test_what_may_be_written(tmp_path):
    found = load(
        tmp_path,
        """
data:
  train: [a.csv, {file: b.csv, start: 1}, {file: "emps:DATA_EMPS", start: 0, stop: 12.5}]
  columns: {time: 0, position: [1, 2], torque: [tau a, tau b], signals: {heat: 5}}
  signals: {volts: U}
  units: {time: ns, position: deg, torque: A, torque_constant: {hip: -1.5}}
  rate: 1000
preprocess: {window: auto, standstill: 0.02}
model: {effects: [viscous, coulomb: {joints: [hip]}, {torque_bias: {}}]}
prior: {weight: 0}
""",
    )
    assert [(log.file, log.start, log.stop) for log in found.data.train] == [
        ("a.csv", None, None),
        ("b.csv", 1.0, None),
        ("emps:DATA_EMPS", 0.0, 12.5),
    ]
    assert [(effect.name, effect.joints) for effect in found.model.effects] == [("viscous", None), ("coulomb", ["hip"]), ("torque_bias", None)]
    assert found.data.columns.position == [1, 2] and found.data.units.torque_constant == {"hip": -1.5} and found.preprocess.window == "auto"


def test_anchors_and_merge_keys(tmp_path):
    found = load(
        tmp_path,
        """
robot:
  rotors:
    - &motor {joint: a, ratio: 9, on: base, inertia: &body {mass: 0.3, box: [0.1, 0.1, 0.1]}}
    - {<<: *motor, joint: b}
    - {joint: c, ratio: 3, on: base, inertia: *body}
""",
    )
    assert [(rotor.joint, rotor.ratio, rotor.inertia.mass) for rotor in found.robot.rotors] == [("a", 9.0, 0.3), ("b", 9.0, 0.3), ("c", 3.0, 0.3)]


@pytest.mark.parametrize("key", ["on", "link", "true", '"on"'])
def test_the_link_of_a_rotor(tmp_path, key):
    """`on` is a boolean to tools of YAML 1.1: what they write back reads as it was meant."""
    text = "robot: {rotors: [{joint: a, ratio: 9, KEY: base, inertia: {mass: 1, box: [1, 1, 1]}}]}".replace("KEY", key)
    assert load(tmp_path, text).robot.rotors[0].on == "base"


def test_a_rotor_on_two_links(tmp_path):
    text = "robot: {rotors: [{joint: a, ratio: 9, on: base, link: hip, inertia: {mass: 1, box: [1, 1, 1]}}]}"
    with pytest.raises(ConfigError, match="line 1: robot.rotors.0.: on and link say the same"):
        load(tmp_path, text)


def test_resolved_experiment_reads_back(tmp_path):
    """What a run folder states of its experiment is an experiment file, with the same meaning."""
    from sysid.results import _relocated, _yaml

    found = load(tmp_path, CONTRACT)
    again = load(tmp_path, _yaml(_relocated(found, tmp_path)))
    assert again.model_copy(update={"robot": found.robot, "data": found.data}) == found
    assert again.robot.rotors == found.robot.rotors and again.data.columns == found.data.columns


@pytest.mark.parametrize("value", ["1" + "0" * 400, ".inf", "-.inf", ".nan", "1e400", "true", "'4'", "[]", "{}"])
@pytest.mark.parametrize("key", ["preprocess.window", "preprocess.cutoff", "preprocess.order", "prior.weight", "solver.tolerance", "data.rate"])
def test_no_number_gets_past(tmp_path, key, value):
    section, name = key.split(".")
    with pytest.raises(ConfigError, match=rf"line 2: {section}\.{name}: ") as error:
        load(tmp_path, f"{section}:\n  {name}: {value}\n")
    assert len(str(error.value)) < 400
