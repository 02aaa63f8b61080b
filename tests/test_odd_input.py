"""Input that is odd beyond mistakes: numbers without size, files without end, tables as people export them. Nothing is read
wrongly without a word, and nothing ends as an internal error."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from sysid import pipeline, units
from sysid.errors import LogError, RobotError
from sysid.readers import open_table
from sysid.robot import load as robot_of
from sysid.robot_spec import RobotSpec
from tests.conftest import URDF, csv

ROOT = Path(__file__).resolve().parent.parent


def with_torque(factor):
    return lambda columns: {k: v * factor if k.startswith("tau") else v for k, v in columns.items()}


def held(*joints):
    return lambda columns: {k: 0.0 * v + 0.3 if k in [f"q_{j}" for j in joints] else v for k, v in columns.items()}


# ---- what a robot cannot have done


@pytest.mark.parametrize("command", ["fit", "diagnose", "discover"])
@pytest.mark.parametrize("factor", [0.0, 1e-18])
def test_a_log_without_torque_is_no_log(experiment, cli, command, factor):
    folder = experiment(train=with_torque(factor), test=with_torque(factor))
    cli(command, folder).complains("train.csv", "torque of every joint is 0")


def test_check_says_so_too(experiment, cli):
    silent = lambda columns: with_torque(0.0)(held("shoulder", "elbow")(columns))  # noqa: E731
    said = cli("check", experiment(train=silent, test=silent), "--json")
    assert said.status == 1 and {f["fault"] for f in json.loads(said.out)["faults"]} >= {"effort_missing"}


@pytest.mark.parametrize("joints", [("shoulder", "elbow"), ("elbow",)])
@pytest.mark.parametrize("command", ["fit", "diagnose"])
def test_joints_that_stand_still_are_a_log(experiment, cli, command, joints):
    said = cli(command, experiment(train=held(*joints), test=held(*joints)), "--json")
    assert said.status == 0, said.err
    json.loads(said.out, parse_constant=lambda word: pytest.fail(word))


@pytest.mark.parametrize("value", ["1e200", "1e300", "1e13", "-1e200"])
@pytest.mark.parametrize(
    "place", ['mass value="0.8"', 'ixx="0.007"', 'origin xyz="0 0 -0.4"', 'origin xyz="0 0 -0.15"', 'axis xyz="0 1 0"', 'size="0.06 0.06 0.4"', 'damping="0.1"'],
)  # fmt: skip
def test_numbers_that_no_robot_has_are_refused(tmp_path, place, value):
    numbers = place.split('"')[1].split()
    text = URDF.replace(place, place.replace(numbers[-1] if len(numbers) != 3 or "axis" not in place else "1", value, 1), 1)
    assert text != URDF
    (tmp_path / "robot.urdf").write_text(text)
    with pytest.raises(RobotError, match="at most 1e\\+12"):
        robot_of(RobotSpec(urdf=str(tmp_path / "robot.urdf")))


@pytest.mark.parametrize("value", ["1e-18", "1e-300", "5e-324"])
@pytest.mark.parametrize("what", ["mass", "inertia", "both", "place"])
def test_bodies_of_almost_nothing_have_a_usable_prior(experiment, cli, what, value):
    def small(text):
        if what in ("mass", "both"):
            text = text.replace('mass value="0.8"', f'mass value="{value}"')
        if what in ("inertia", "both"):
            text = text.replace('ixx="0.007" ixy="0" ixz="0" iyy="0.0072" iyz="0" izz="0.001"', f'ixx="{value}" ixy="0" ixz="0" iyy="{value}" iyz="0" izz="{value}"')
        return text if what != "place" else text.replace('xyz="0 0 -0.4"/><axis', f'xyz="0 0 {value}"/><axis')

    said = cli("fit", experiment(urdf=small), "--json")
    assert said.status == 0, said.err
    found = json.loads(said.out, parse_constant=lambda word: pytest.fail(word))
    assert found["physically_consistent"] and all(p["std"] is None or np.isfinite(p["std"]) for p in found["parameters"])


def test_a_rotor_of_almost_nothing_is_refused(experiment, cli):
    cli("fit", experiment(config={"robot.rotors.0.inertia.mass": 1e-300})).complains("rotor of 'shoulder'", "mass > 1e-12 kg")


@pytest.mark.parametrize("value", ["1e308", "inf"])
def test_a_limit_beyond_any_is_none(tmp_path, value):
    text = URDF.replace('upper="3"', f'upper="{value}"').replace('velocity="10"', f'velocity="{value}"')
    (tmp_path / "robot.urdf").write_text(text)
    assert np.isposinf(robot_of(RobotSpec(urdf=str(tmp_path / "robot.urdf"))).limits[:, 1]).all()


@pytest.mark.parametrize("vs", [0.02, 0.1, None])
def test_a_coefficient_that_no_number_could_make_felt_is_held(experiment, vs):
    """Every row that counts is far above the Stribeck speed: the column is down to 1e-150 of the torque."""
    folder = experiment(config={"model.effects": ["viscous", "coulomb", {"stribeck": {"vs": vs}} if vs else "stribeck"]})
    found = pipeline.fit(pipeline.load(folder))
    assert found.solution.converged and (np.abs(found.coefficients) < 1e12).all()


# ---- what stands for something else


XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace('name="arm">', f'name="arm" {XACRO}><xacro:include filename="more.xacro"/>'), ["xacro:include", "expand it"]),
        (lambda t: t.replace('<link name="base"/>', '<link name="base"/><xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'), ["include", "expand it"]),
        (lambda t: t.replace('"base"', '"${prefix}base"'), ["${prefix}base", "xacro"]),
        (lambda t: t.replace("<dynamics", '<mimic joint="nobody"/><dynamics', 1), ["mimics 'nobody'", "missing"]),
        (lambda t: t.replace('<link name="base"/>', '<link name="base">' + 90_000 * "<a>" + 90_000 * "</a>" + "</link>"), ["deep"]),
    ],
)  # fmt: skip
def test_a_urdf_that_is_not_all_there_is_refused(experiment, cli, change, words):
    cli("fit", experiment(urdf=change)).complains("robot.urdf", *words)


def test_a_name_space_that_nothing_uses_is_nothing(experiment, cli):
    assert cli("fit", experiment(urdf=lambda t: t.replace('name="arm">', f'name="arm" {XACRO}>')), "--quiet").status == 0


# ---- units in a header


BY_NUMBER = {"data.columns": {"time": 0, "position": [1, 2], "torque": [3, 4]}, "data.units": ...}


def headed(**said):
    """Columns under headers that state units."""
    return lambda columns: csv({name + said.get(name.partition("_")[0], ""): values for name, values in columns.items()})


@pytest.mark.parametrize(
    ("said", "words"),
    [({"t": " [ms]"}, ["'t [ms]' says ms", "data.units.time: ms"]), ({"q": "[deg]"}, ["says deg", "data.units.position: deg"]), ({"tau": " (mNm)"}, ["says mN m"]), ({"q": " [mm]"}, ["says mm"])],
)  # fmt: skip
def test_units_in_a_header_are_not_ignored(experiment, cli, said, words):
    cli("fit", experiment(config=BY_NUMBER, train=headed(**said))).complains("train.csv", *words)


def test_units_that_agree_and_units_that_were_meant_are_read(experiment, cli):
    same = {"t": " [s]", "q": " [rad]", "tau": " [N·m]"}
    assert cli("fit", experiment(config=BY_NUMBER, train=headed(**same), test=headed(**same)), "--quiet").status == 0
    meant = {**BY_NUMBER, "data.units": {"position": "rad"}}
    said = cli("fit", experiment(config=meant, train=headed(q="[deg]"), name="meant"), "--json")
    assert said.status == 0 and any("says deg" in note for note in json.loads(said.out)["notices"])


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [("q1 [deg]", "position", "deg"), ("axis0 [rev]", "position", "turns"), ("v (turns/s)", "position", "turns"), ("qd (deg/s)", "position", "deg"), ("q[0]", "position", ""), ("tau_a", "torque", ""), ("i [A]", "torque", "A"), ("t", "time", ""), ("tau [N m]", "torque", "N m")],
)  # fmt: skip
def test_what_a_header_states(name, quantity, unit):
    assert units.in_header(name, quantity) == unit


@pytest.mark.parametrize(
    ("stated", "taken", "agreed"),
    [("rad", "rad", True), ("m", "rad", True), ("m", "deg", True), ("mm", "rad", False), ("deg", "rad", False), ("deg", "m", False), ("N", "N m", True), ("A", "N m", False), ("N m", "A", False), ("ms", "s", False)],
)  # fmt: skip
def test_units_that_may_be_read_as_others(stated, taken, agreed):
    assert units.agree(stated, taken) is agreed


# ---- tables as people export them


def read(path, text):
    path.write_bytes(text.encode())
    table = open_table(path)
    return {name: values.tolist() for name, values in table.load(table.names).items()}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("t,q\n1,2\n3,4\n\n\n", {"t": [1, 3], "q": [2, 4]}),
        ("t,q\r\n1,2\r\n3,4\r\n\r\n", {"t": [1, 3], "q": [2, 4]}),
        ("t,q\n1,2\n3,4\n   \n \t", {"t": [1, 3], "q": [2, 4]}),
        ("  t    q\n  1.0   2\n 10.0  20\n\n", {"t": [1, 10], "q": [2, 20]}),
        ("1.0   2\n 10.0  20", {"0": [1, 10], "1": [2, 20]}),
        ('t,q,"note, free"\n1,2,3\n', {"t": [1], "q": [2], "note, free": [3]}),
        ('"t" "q x"\n1   2\n', {"t": [1], "q x": [2]}),
        ('"t";"q, x"\n1,5;2\n', {"t": [1.5], "q, x": [2]}),
        ("\ufefft,q\n1,2\n", {"t": [1], "q": [2]}),
        ("t\tq\n1\t2\n\n", {"t": [1], "q": [2]}),
    ],
)
def test_blank_lines_aligned_columns_and_quoted_names(tmp_path, text, found):
    assert read(tmp_path / "a.csv", text) == found


@pytest.mark.parametrize("text", ["t,q\n", "t,q\n\n\n", 't,"q\n1,2\n', "t,q\n1,2\n\n3,4\n", "t,q\n1,2,3\n", "\n\n"])
def test_what_is_no_table_is_said(tmp_path, text):
    with pytest.raises(LogError, match="a.csv"):
        read(tmp_path / "a.csv", text)


def test_a_table_of_twenty_thousand_columns_is_read_at_once(tmp_path):
    """Linear in the columns: the quadratic way took more than half a minute, this a fraction of a second."""
    names = ["t", *(f"c{k}" for k in range(20_000))]
    (tmp_path / "wide.csv").write_text(",".join(names) + "\n" + 5 * (",".join(["1.5"] * len(names)) + "\n"))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    table = open_table(tmp_path / "wide.csv")
    for name in names:
        table.resolve(name)
    for k in range(0, len(names), 7):
        table.resolve(k)
    assert len(table.load(["t", "c19999"])["t"]) == 5 and set(table.load(names)) == set(names)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_utime - before < 10.0


@pytest.mark.parametrize("kind", [pl.Int128, pl.UInt64, pl.Int8, pl.Decimal(20, 3), pl.List(pl.Int128), pl.Array(pl.Int128, 2)])
def test_whole_numbers_of_any_width_are_numbers(tmp_path, kind):
    nested = isinstance(kind, (pl.List, pl.Array))
    values = [[1, 2], [3, 4]] if nested else [1, 2]
    pl.DataFrame([pl.Series("x", values, dtype=kind)]).write_parquet(tmp_path / "a.parquet")
    assert open_table(tmp_path / "a.parquet").load(["x"])["x"].tolist() == values


# ---- files without end, and disks without room


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("device", ["fifo", "/dev/zero"])
@pytest.mark.parametrize(("name", "config"), [("robot.urdf", {}), ("prior.json", {"prior.source": "prior.json"}), ("train.csv", {}), ("mine.py", {"model.effects": ["mine.py:X"]})])
def test_what_never_ends_is_not_read(experiment, cli, device, name, config):
    folder = experiment(config=config)
    (folder / name).unlink(missing_ok=True)
    if device == "fifo":
        os.mkfifo(folder / name)
    else:
        (folder / name).symlink_to(device)
    cli("fit", folder).complains("a pipe or a device")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device here")
@pytest.mark.parametrize("words", [["effects", "viscous"], ["--version"], ["--help"], ["effects", "--json"]])
def test_a_full_disk_under_the_output_is_said(words):
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "sysid", *words], stdout=full, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    assert done.returncode == 1 and done.stderr == "sysid: the output cannot be written or read (No space left on device)\n"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device here")
@pytest.mark.parametrize("unbuffered", ["1", ""])
def test_where_nobody_can_be_told_the_status_tells(unbuffered):
    how = {"cwd": ROOT, "env": os.environ | {"PYTHONUNBUFFERED": unbuffered}}
    with open("/dev/full", "w") as full:
        assert subprocess.run([sys.executable, "-m", "sysid", "fit", "nothing"], stderr=full, **how).returncode == 2
