"""Everything that may be wrong with what a user gives: exit status 2, one line that says what and where, nothing written.

And what is mended instead: exit status 0, and the JSON's notices say what was done.
"""

import json
import os
import random
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import LogError
from sysid.readers import open_table
from tests.conftest import JOINTS, ROTOR, URDF, csv, matrices, write_mat5, write_mat73, write_table

INF, NAN = float("inf"), float("nan")


def changed(column: str, row: int, value: float):
    """A log with one value replaced."""

    def change(columns):
        columns[column][row] = value
        return columns

    return change


def rows(choose):
    """A log with the rows that `choose` (of t) keeps."""
    return lambda columns: {name: values[choose(columns["t"])] for name, values in columns.items()}


def without(name: str):
    """A log without a column."""
    return lambda columns: {key: values for key, values in columns.items() if key != name}


def replaced(*pairs):
    """A URDF with pieces of its text replaced."""

    def change(text):
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        return text

    return change


def decided(document) -> list[str]:
    """The notices, but for the one that every fit has: how many rows about reversals were left out."""
    every, others = [], []
    for notice in document["notices"]:
        (every if "reversals" in notice else others).append(notice)
    assert len(every) == 1
    return others


# ---- the experiment file: values

AMPERE = {"data.units.torque": "A"}
CONFIG_FAULTS = {
    "rotor with ratio 0": ({"robot.rotors.0.ratio": 0}, ["robot.rotors[0].ratio", "line", "gear ratio of 0"]),
    "rotor with an infinite ratio": ({"robot.rotors.0.ratio": INF}, ["robot.rotors[0].ratio", "line", "finite"]),
    "rotor of negative mass": ({"robot.rotors.0.inertia.mass": -0.3}, ["robot.rotors[0].inertia.mass", "line", "-0.3"]),
    "rotor of negative mass, as parameters": (
        {"robot.rotors.0.inertia": {"parameters": [-1, 0, 0, 0, 1, 1, 1, 0, 0, 0]}}, ["rotor of 'shoulder'", "impossible"]),
    "rotor without mass": ({"robot.rotors.0.inertia": {"box": [1, 1, 1]}}, ["robot.rotors[0].inertia", "line", "mass"]),
    "rotor of two shapes": ({"robot.rotors.0.inertia.cylinder": {"radius": 1, "length": 1}}, ["robot.rotors[0].inertia", "exactly one"]),
    "rotor without inertia": ({"robot.rotors.0.inertia": ...}, ["robot.rotors[0].inertia", "line", "missing"]),
    "rotor with an axis of zeros": ({"robot.rotors.0.axis": [0, 0, 0]}, ["robot.rotors[0].axis", "line", "direction"]),
    "rotor on an unknown link": ({"robot.rotors.0.on": "torso"}, ["rotor of 'shoulder'", "'torso'", "allowed: base, upper, lower"]),
    "rotor of an unknown joint": ({"robot.rotors.0.joint": "wrist"}, ["rotor of 'wrist'", "allowed: shoulder, elbow"]),
    "two rotors on a joint": ({"robot.rotors": [ROTOR, ROTOR]}, ["rotor of 'shoulder'", "two rotors"]),
    "transmission of a joint without rotor": ({"robot.transmission": {"elbow": {"elbow": 3}}},
        ["robot.transmission", "'elbow'", "allowed: shoulder"]),
    "transmission to an unknown joint": ({"robot.transmission": {"shoulder": {"wrist": 3}}},
        ["robot.transmission", "'wrist'", "allowed: shoulder, elbow"]),
    "transmission of 0": ({"robot.transmission": {"shoulder": {"elbow": 0}}}, ["robot.transmission.shoulder.elbow", "line", "0"]),
    "empty transmission": ({"robot.transmission": {"shoulder": {}}}, ["robot.transmission.shoulder", "line"]),
    "joint that the URDF lacks": ({"robot.joints": ["shoulder", "wrist"]}, ["robot.urdf", "'wrist'", "allowed: shoulder, elbow"]),
    "joint named twice": ({"robot.joints": ["elbow", "elbow"]}, ["'elbow' twice", "once"]),
    "no joint": ({"robot.joints": []}, ["robot.joints is empty", "allowed: shoulder, elbow"]),
    "unknown joint locked": ({"robot.lock": {"wrist": 0}}, ["'wrist'", "robot.lock"]),
    "every joint locked": ({"robot.lock": {"shoulder": 0, "elbow": 0}}, ["no joint is left"]),
    "joint moved and locked": ({"robot.joints": ["elbow", "shoulder"], "robot.lock": {"elbow": 0}}, ["'elbow' is in robot.joints and in robot.lock"]),
    "URDF that is not there": ({"robot.urdf": "other.urdf"}, ["other.urdf", "No such file", "check robot.urdf"]),
    "URDF that is a folder": ({"robot.urdf": "."}, ["Is a directory", "check robot.urdf"]),
    "URDF of an unknown package": ({"robot.urdf": "package://nowhere/robot.urdf"}, ["package://nowhere/robot.urdf", "allowed"]),
    "URDF of an unknown example": ({"robot.urdf": "example-robot-data://nowhere/robot.urdf"}, ["nowhere/robot.urdf", "check robot.urdf"]),
    "URDF without a name": ({"robot.urdf": ""}, ["robot.urdf", "line", "path"]),
    "gravity of two numbers": ({"robot.gravity": [0, 9.81]}, ["robot.gravity", "line", "at least 3", "not 2"]),
    "infinite gravity": ({"robot.gravity": [0, 0, -INF]}, ["robot.gravity[2]", "line", "finite"]),
    "train log that is not there": ({"data.train": ["other.csv"]}, ["other.csv", "no such file", "check data.train"]),
    "test log that is not there": ({"data.test": ["other.csv"]}, ["other.csv", "no such file", "data.test"]),
    "log without an ending": ({"data.train": ["config"]}, ["config"]),
    "log of an unknown kind": ({"data.train": ["robot.urdf"]}, ["robot.urdf", "unknown format", "allowed: .csv, .parquet, .npz, .mat"]),
    "log of an unknown data set": ({"data.train": ["emps:OTHER"]}, ["'emps'", "'OTHER'", "allowed: DATA_EMPS"]),
    "empty test list": ({"data.test": []}, ["data.test", "line", "at least 1"]),
    "empty train list": ({"data.train": []}, ["data.train", "line", "at least 1"]),
    "log that is a number": ({"data.test": [5]}, ["data.test[0]", "line", "must be a path", "given: 5"]),
    "negative start": ({"data.train": [{"file": "train.csv", "start": -1}]}, ["data.train[0].start", "line", "-1"]),
    "start after stop": ({"data.train": [{"file": "train.csv", "start": 2, "stop": 1}]}, ["data.train[0]", "line", "start 2", "stop 1"]),
    "start after the log's end": ({"data.train": [{"file": "train.csv", "start": 50}]}, ["train.csv", "start 50", "0 to 2.995 s"]),
    "time column that is not there": ({"data.columns.time": "time"}, ["train.csv", "'time'", "allowed: t, q_shoulder", "data.columns"]),
    "column number out of range": ({"data.columns.position": [1, 7]}, ["train.csv", "column 7", "allowed: 0 to 4"]),
    "one column for two joints": ({"data.columns.position": ["q_elbow"]}, ["train.csv", "1 columns for 2 joints", "shoulder, elbow"]),
    "column without a pattern for two joints": ({"data.columns.position": "q_elbow"}, ["train.csv", "'q_elbow'", "{joint}"]),
    "signal that is not there": ({"data.signals": {"heat": "T"}}, ["train.csv", "'T'", "allowed"]),
    "unknown unit": ({"data.units.time": "min"}, ["data.units.time", "line", "'s', 'ms', 'us' or 'ns'", "min"]),
    "current without constants": (AMPERE, ["train.csv", "'shoulder'", "torque constant", "data.units.torque_constant"]),
    "current without one constant": ({**AMPERE, "data.units.torque_constant": {"shoulder": 2}}, ["train.csv", "'elbow'", "torque constant"]),
    "constant of 0": ({**AMPERE, "data.units.torque_constant": {"shoulder": 2, "elbow": 0}}, ["data.units.torque_constant.elbow", "line", "0"]),
    "one constant for all": ({**AMPERE, "data.units.torque_constant": 2}, ["data.units.torque_constant", "line", "each joint"]),
    "constants for torque": ({"data.units.torque_constant": {"shoulder": 2, "elbow": 2}}, ["data.units", "line", "torque: A"]),
    "rate of 0": ({"data.rate": 0}, ["data.rate", "line", "greater than 0"]),
    "unknown filter": ({"preprocess.filter": "kalman"}, ["preprocess.filter", "line", "savitzky-golay", "kalman"]),
    "window of 0": ({"preprocess.window": 0}, ["preprocess.window", "line", "positive number or auto"]),
    "window no longer than the order": ({"preprocess.window": 0.014}, ["preprocess.window of 0.014 s", "3 samples at 200 Hz", "0.025 s"]),
    "window longer than the log": ({"preprocess.window": 9}, ["train.csv", "600 samples", "window of 1801"]),
    "cutoff above half the sampling rate": ({"preprocess.filter": "butterworth", "preprocess.cutoff": 120},
        ["preprocess.cutoff of 120 Hz", "below 100 Hz"]),
    "no filter and no velocity": ({"preprocess.filter": "none"}, ["preprocess.filter", "data.columns.velocity"]),
    "order 0": ({"preprocess.order": 0}, ["preprocess.order", "line", "greater than or equal to 1"]),
    "order 1 of a polynomial": ({"preprocess.order": 1}, ["preprocess", "line", "order 1", "2 to 12"]),
    "order 13": ({"preprocess.order": 13}, ["preprocess.order", "line", "12"]),
    "order 2.5": ({"preprocess.order": 2.5}, ["preprocess.order", "line", "whole number"]),
    "unknown standstill": ({"preprocess.standstill": "leave"}, ["preprocess.standstill", "line", "auto, keep, mask"]),
    "unknown parameterization": ({"model.inertia": "cholesky"}, ["model.inertia", "line", "'log-cholesky'"]),
    "unknown effect": ({"model.effects": ["viscous", "colomb"]}, ["model.effects[1]", "line", "'colomb'", "allowed: coulomb"]),
    "effect on an unknown joint": ({"model.effects": [{"viscous": {"joints": ["wrist"]}}]}, ["model.effects", "'wrist'", "allowed: shoulder, elbow"]),
    "effect on no joint": ({"model.effects": [{"viscous": {"joints": []}}]}, ["model.effects[0].joints", "line", "at least 1"]),
    "effect twice": ({"model.effects": ["viscous", "viscous"]}, ["model.effects", "viscous", "twice"]),
    "effect twice on one joint": ({"model.effects": ["viscous", {"viscous": {"joints": ["elbow"]}}]}, ["viscous", "twice", "'elbow'"]),
    "effect that is a number": ({"model.effects": [3]}, ["model.effects[0]", "line", "effect's name"]),
    "negative prior weight": ({"prior.weight": -0.01}, ["prior.weight", "line", "greater than or equal to 0", "-0.01"]),
    "prior weight NaN": ({"prior.weight": NAN}, ["prior.weight", "line", "nan"]),
    "infinite prior weight": ({"prior.weight": INF}, ["prior.weight", "line", "finite"]),
    "unknown divergence": ({"prior.divergence": "kl"}, ["prior.divergence", "line", "'log-det'"]),
    "prior from a run that is not there": ({"prior.source": "runs/other"}, ["prior.source", "runs/other", "allowed: urdf"]),
    "prior from something else": ({"prior.source": "train.csv"}, ["prior.source", "train.csv", "allowed: urdf"]),
    "tolerance of 1": ({"solver.tolerance": 1}, ["solver.tolerance", "line", "less than 1"]),
    "no iterations": ({"solver.max_iterations": 0}, ["solver.max_iterations", "line"]),
    # wrong types
    "text for a number": ({"prior.weight": "small"}, ["prior.weight", "line", "must be a number", "'small'"]),
    "truth for a number": ({"prior.weight": True}, ["prior.weight", "line", "must be a number", "True"]),
    "truth for a whole number": ({"preprocess.order": True}, ["preprocess.order", "line", "must be a whole number", "True"]),
    "number for a list": ({"robot.joints": 5}, ["robot.joints", "line", "must be a list", "given: 5"]),
    "text for a list": ({"data.train": "train.csv"}, ["data.train", "line", "must be a list"]),
    "number for a text": ({"robot.urdf": 5}, ["robot.urdf", "line", "must be text", "given: 5"]),
    "list for a mapping": ({"solver": [1]}, ["solver", "line", "must be a mapping"]),
    "text for a mapping": ({"robot": "robot.urdf"}, ["robot", "line", "must be a mapping"]),
    "nothing for a mapping": ({"robot": None}, ["robot", "line", "must be a mapping"]),
    "fraction for a column": ({"data.columns.position": [1.5, 2]}, ["data.columns.position", "line", "counted from 0"]),
}  # fmt: skip


@pytest.mark.parametrize(("config", "words"), CONFIG_FAULTS.values(), ids=CONFIG_FAULTS)
def test_experiment(experiment, cli, config, words):
    cli("fit", experiment(config=config)).complains(*words)


UNKNOWN_KEYS = {
    "robots": ("unknown key 'robots';", "robot"),
    "path": ("unknown key 'path';", "data"),
    "robot.joint": ("unknown key 'joint' in robot;", "joints"),
    "robot.rotors.0.ration": ("unknown key 'ration' in robot.rotors[0]", "ratio"),
    "robot.rotors.0.inertia.bocks": ("unknown key 'bocks' in robot.rotors[0].inertia", "box"),
    "data.trane": ("unknown key 'trane' in data;", "train"),
    "data.columns.torqe": ("unknown key 'torqe' in data.columns", "torque"),
    "data.units.torque_constants": ("unknown key 'torque_constants' in data.units", "torque_constant"),
    "preprocess.windows": ("unknown key 'windows' in preprocess", "window"),
    "model.effect": ("unknown key 'effect' in model", "effects"),
    "prior.wieght": ("unknown key 'wieght' in prior", "weight"),
    "solver.tolerances": ("unknown key 'tolerances' in solver", "tolerance"),
}


@pytest.mark.parametrize("key", UNKNOWN_KEYS)
def test_unknown_key(experiment, cli, key):
    said, closest = UNKNOWN_KEYS[key]
    folder = experiment(config={key: 1})
    lines = (folder / "config.yaml").read_text().splitlines()
    line = next(k for k, text in enumerate(lines, 1) if re.search(rf"\b{key.split('.')[-1]}: 1$", text))
    cli("fit", folder).complains(f"config.yaml line {line}: {said}", f"allowed: {closest}", "correct or remove")


@pytest.mark.parametrize(
    ("change", "said", "closest"),
    [
        ({"data.train": [{"file": "train.csv", "start": 0, "stopp": 1}]}, "unknown key 'stopp' in data.train[0]", "stop"),
        ({"data.train": ["train.csv", {"fil": "train.csv"}]}, "unknown key 'fil' in data.train[1]", "file"),
        ({"model.effects": ["coulomb", {"viscous": {"jonts": ["elbow"]}}]}, "unknown key 'jonts' in model.effects[1]", "joints"),
        ({"model.effects": [{"viscous": {"limit": 1}}]}, "unknown key 'limit' in model.effects[0]", "joints"),
        ({"model.effects": [{"cogging": {"line": 2}}]}, "unknown key 'line' in model.effects[0]", "lines"),
    ],
)
def test_unknown_key_within_a_list(experiment, cli, change, said, closest):
    folder = experiment(config=change)
    key = said.split("'")[1]
    line = next(k for k, text in enumerate((folder / "config.yaml").read_text().splitlines(), 1) if f"{key}:" in text)
    cli("fit", folder).complains(f"line {line}: {said}", f"allowed: {closest}")


# ---- the experiment file: text

BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{new}: &{new} [{', '.join([f'*{old}'] * 10)}]\n" for old, new in zip("abcdefg", "bcdefgh")
)
YAML_FAULTS = {
    "unclosed bracket": ("robot: {urdf: robot.urdf\n", ["config.yaml line", "not YAML"]),
    "tabs": ("robot:\n\turdf: robot.urdf\n", ["config.yaml line 2", "not YAML"]),
    "Python object": ("robot: !!python/object/apply:os.system ['touch owned']\n", ["config.yaml line 1", "tag", "python", "remove the tag"]),
    "Python name": ("robot:\n  urdf: !!python/name:os.system\n", ["config.yaml line 2", "tag"]),
    "standard tag": ("robot: !!omap urdf\n", ["config.yaml line 1", "tag"]),
    "own tag": ("robot: !robot {urdf: robot.urdf}\n", ["config.yaml line 1", "tag !robot"]),
    "alias bomb": (BOMB, ["config.yaml line", "10000 values", "write the values out"]),
    "recursive alias": ("robot: &robot {urdf: *robot}\n", ["config.yaml line 1", "*robot"]),
    "alias to nothing": ("robot: *nothing\n", ["config.yaml line 1", "*nothing"]),
    "duplicate key": ("robot: {urdf: a.urdf}\nrobot: {urdf: b.urdf}\n", ["config.yaml line 2", "duplicate key", "robot"]),
    "list": ("- robot\n- data\n", ["config.yaml", "no mapping", "allowed: robot, data"]),
    "text": ("just words\n", ["config.yaml", "no mapping"]),
    "two documents": ("robot: {}\n---\nrobot: {}\n", ["config.yaml line 2", "not YAML"]),
    "deep nesting": ("robot: " + "[" * 5000 + "]" * 5000, ["config.yaml"]),
    "number for a key": ("5: robot\n", ["config.yaml line 1"]),
    "list for a key": ("? [robot, data]\n: 5\n", ["config.yaml line 1"]),
    "mapping for a key": ("? {robot: data}\n: 5\n", ["config.yaml line 1"]),
    "binary": (bytes(range(256)) * 4, ["config.yaml", "not UTF-8"]),
    "zeros": (bytes(64), ["config.yaml", "not YAML"]),
    "Latin-1": ("robot: {urdf: Gerät.urdf}\n".encode("latin-1"), ["config.yaml", "not UTF-8"]),
    "UTF-16": ("robot: {urdf: robot.urdf}\n".encode("utf-16"), ["config.yaml", "not UTF-8"]),
    "too large": (b"#" * 1_000_001, ["config.yaml", "1000001 bytes", "allowed: at most"]),
    "no file": (None, ["a folder without config.yaml", "sysid init"]),
}


@pytest.mark.parametrize(("text", "words"), YAML_FAULTS.values(), ids=YAML_FAULTS)
def test_yaml(experiment, cli, text, words, tmp_path):
    cli("fit", experiment(config=text)).complains(*words)
    assert not list(tmp_path.rglob("owned"))


# ---- the robot

LAUGHS = '<!DOCTYPE robot [<!ENTITY a "ha">' + "".join(f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in zip("abcdefgh", "bcdefghi")) + "]>"
UPPER = '<link name="upper">'
URDF_FAULTS = {
    "empty": ("", ["not XML", "give a URDF"]),
    "not XML": ("link: base\n", ["not XML", "line 1"]),
    "broken off": (lambda text: text[: len(text) // 2], ["not XML", "line"]),
    "binary": (bytes(range(256)), ["not XML"]),
    "xacro": (lambda text: text.replace("</robot>", '<xacro:include filename="x"/></robot>'), ["not XML", "run xacro"]),
    "other XML": ("<html><body/></html>", ["<html>", "allowed: <robot>"]),
    "no links": ('<robot name="arm"/>', ["no link"]),
    "document type": (replaced(("<robot", "<!DOCTYPE robot><robot")), ["document type", "remove"]),
    "billion laughs": (replaced(("<robot", LAUGHS + "<robot"), ('value="1.5"', 'value="&i;"')), ["document type", "remove"]),
    "file read through an entity": (replaced(("<robot", '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot')), ["document type"]),
    "loop: two parents": (
        replaced(("</robot>", '<joint name="brace" type="fixed"><parent link="base"/><child link="lower"/></joint></robot>')),
        ["'lower' hangs on two joints", "'elbow' and 'brace'", "loop", "cut"]),
    "loop: back to the root": (
        replaced(("</robot>", '<joint name="brace" type="fixed"><parent link="lower"/><child link="base"/></joint></robot>')), ["loop", "cut"]),
    "loop: a link on itself": (replaced(('<child link="lower"/>', '<child link="upper"/>')), ["loop", "'upper'"]),
    "parent that is missing": (replaced(('<parent link="upper"/>', '<parent link="torso"/>')),
        ["'elbow'", "parent link 'torso'", "missing", "allowed: base, upper, lower"]),
    "child that is missing": (replaced(('<child link="lower"/>', '<child link="hand"/>')), ["'elbow'", "child link 'hand'", "missing"]),
    "joint without a child": (replaced(('<child link="lower"/>', "")), ["'elbow'", "no child"]),
    "two roots": (replaced(("</robot>", '<link name="table"/></robot>')), ["base, table", "one root"]),
    "link twice": (replaced(("</robot>", '<link name="lower"/></robot>')), ["link 'lower' appears twice", "rename"]),
    "joint twice": (replaced(('name="elbow"', 'name="shoulder"')), ["joint 'shoulder' appears twice", "rename"]),
    "link without a name": (replaced(('<link name="lower">', "<link>")), ["<link> has no name"]),
    "joint without a name": (replaced(('name="elbow" ', "")), ["<joint> has no name"]),
    "joint of an unknown type": (replaced(('name="elbow" type="revolute"', 'name="elbow" type="hinge"')),
        ["'elbow'", "'hinge'", "allowed: revolute"]),
    "floating joint": (replaced(('name="elbow" type="revolute"', 'name="elbow" type="floating"')), ["'elbow' is floating", "allowed: revolute"]),
    "axis of zeros": (replaced(('xyz="0 0 -0.4"/><axis xyz="0 1 0"/>', 'xyz="0 0 -0.4"/><axis xyz="0 0 0"/>')), ["'elbow'", "axis 0 0 0"]),
    "mass that is no number": (replaced(('value="1.5"', 'value="heavy"')), ["link 'upper'", "value='heavy'", "a finite number"]),
    "mass that is not finite": (replaced(('value="1.5"', 'value="inf"')), ["link 'upper'", "value='inf'", "finite"]),
    "inertia that is no number": (replaced(('ixx="0.02"', 'ixx="1,5"')), ["link 'upper'", "ixx='1,5'"]),
    "origin of two numbers": (replaced(('xyz="0 0 -0.4"', 'xyz="0 0"')), ["joint 'elbow'", "xyz='0 0'", "3 finite numbers"]),
    "axis that is no number": (replaced(('xyz="0 0 -0.4"/><axis xyz="0 1 0"/>', 'xyz="0 0 -0.4"/><axis xyz="x"/>')), ["joint 'elbow'", "xyz='x'"]),
    "damping that is no number": (replaced(('damping="0.1"', 'damping="some"')), ["joint 'elbow'", "damping='some'"]),
    "limit that is no number": (replaced(('lower="-3"', 'lower="low"')), ["joint 'shoulder'", "lower='low'"]),
    "box that is no number": (replaced(('size="0.06 0.06 0.4"', 'size="0.06 0.06"')), ["link 'upper'", "size='0.06 0.06'"]),
    "effort that is no number": (replaced(('effort="50" velocity="10"/><dynamics damping="0.1"', 'effort="much"/><dynamics damping="0.1"')),
        ["joint 'elbow'", "effort='much'"]),
    "colour that is no number": (
        replaced((UPPER, UPPER + '<visual><geometry><box size="1 1 1"/></geometry><material name="m"><color rgba="red"/></material></visual>')),
        ["link 'upper'", "rgba='red'", "4 finite numbers"]),
    "mesh without a file": (replaced((UPPER, UPPER + "<visual><geometry><mesh/></geometry></visual>")), ["link 'upper'", "<mesh>", "filename"]),
    "shape without a shape": (replaced((UPPER, UPPER + "<visual><geometry/></visual>")), ["link 'upper'", "<geometry>", "allowed: box"]),
    "empty attribute": (replaced(('xyz="0 0 -0.4"', 'xyz=""')), ["joint 'elbow'", "xyz=''", "3 finite numbers"]),
    "no file": (None, ["robot.urdf", "No such file", "check robot.urdf"]),
}  # fmt: skip


@pytest.mark.parametrize(("urdf", "words"), URDF_FAULTS.values(), ids=URDF_FAULTS)
def test_urdf(experiment, cli, urdf, words):
    cli("fit", experiment(urdf=urdf)).complains("robot.urdf", *words)


# ---- logs

LOG_FAULTS = {
    "no column for a joint": (without("q_elbow"), ["joint 'elbow' has no column", "'q_elbow'", "allowed: t, q_shoulder"]),
    "no torque for a joint": (without("tau_elbow"), ["joint 'elbow' has no column", "'tau_elbow'"]),
    "no time": (without("t"), ["no column 't'", "allowed: q_shoulder"]),
    "NaN in an angle": (changed("q_elbow", 7, NAN), ["q of joint 'elbow' is nan", "row 7", "t = 0.035 s"]),
    "infinity in an angle": (changed("q_shoulder", 0, -INF), ["q of joint 'shoulder' is -inf", "row 0"]),
    "infinity in a torque": (changed("tau_elbow", 7, INF), ["tau of joint 'elbow' is inf", "row 7"]),
    "a number that no sensor reads": (changed("tau_elbow", 7, 1e200), ["tau of joint 'elbow' is 1e+200", "row 7"]),
    "NaN in time": (changed("t", 7, NAN), ["time is not a finite number", "row 7"]),
    "NaN in the first time": (changed("t", 0, NAN), ["time is not a finite number", "row 0"]),
    "infinity in time": (changed("t", 0, INF), ["time is not a finite number", "row 0"]),
    "time backwards": (changed("t", 7, 0.01), ["time runs backwards", "row 7", "0.03 s, then 0.01 s", "increasing"]),
    "time standing still": (lambda c: {name: np.where(np.arange(len(v)) == 7, v[6], v) for name, v in c.items()}, ["time stands still", "row 7", "0.03 s, then 0.03 s"]),
    "time a constant": (lambda c: c | {"t": np.zeros(600)}, ["time stands still", "row 1"]),
    "fewer samples than the window": (rows(lambda t: t < 0.1), ["20 samples", "window of 21", "longer log"]),
    "one sample": (rows(lambda t: t < 0.001), ["one sample", "longer log"]),
    "header only": (lambda c: csv(c).splitlines()[0] + "\n", ["a header and no row"]),
    "empty": ("", ["empty"]),
    "blank": ("\n\n", ["empty"]),
    "words in a cell": (lambda c: csv(c).replace("0.035,", "0.035,bad", 1), ["line 9", "'q_shoulder'", "'bad", "is no number"]),
    "empty cell": (lambda c: re.sub("0.035,[^,]*,", "0.035,,", csv(c), count=1), ["line 9", "'q_shoulder'", "empty"]),
    "short row within": (lambda c: re.sub(r"0.035,.*\n", "0.035\n", csv(c), count=1), ["line 9", "empty"]),
    "long row": (lambda c: csv(c).replace("0.035,", "0.035,1,2,3,", 1), ["line 9 (8 cells, the first line has 5)", "cannot be read as CSV"]),
    "column twice": (lambda c: csv(c).replace("q_elbow", "q_shoulder", 1), ["two columns are named 'q_shoulder'", "rename"]),
    "no header for names": (lambda c: csv(c, header=False), ["'q_shoulder' is not there", "allowed: 0, 1, 2, 3, 4"]),
    "binary": (bytes(range(256)) * 10, ["not text"]),
    "UTF-16": (lambda c: csv(c).encode("utf-16"), ["text in UTF-16", "save it as UTF-8"]),
    "no file": (None, ["no such file"]),
}


@pytest.mark.parametrize(("log", "words"), LOG_FAULTS.values(), ids=LOG_FAULTS)
def test_train_log(experiment, cli, log, words):
    cli("fit", experiment(train=log)).complains("train.csv", *words)


@pytest.mark.parametrize("fault", ["NaN in an angle", "fewer samples than the window", "no file"])
def test_test_log(experiment, cli, fault):
    """Found only after the fit; still nothing is written."""
    log, words = LOG_FAULTS[fault]
    cli("fit", experiment(test=log)).complains("test.csv", *words)


def test_row_within_a_piece(experiment, cli):
    """Rows are counted in the file, also where a piece of it is read."""
    config = {"data.train": [{"file": "train.csv", "start": 1.0}]}
    cli("fit", experiment(config=config, train=changed("q_elbow", 300, NAN))).complains("row 300 counted from 0, t = 1.5 s")


def damaged(data: bytes, how: str) -> bytes:
    """A file as accidents leave it."""
    half = len(data) // 2
    return {
        "empty": b"", "broken off early": data[:40], "broken off": data[: 9 * len(data) // 10],
        "words": b"these are only words\n" * 200, "zeros": bytes(len(data)),
        "a hole": data[: half - 128] + bytes(256) + data[half + 128 :],
    }[how]  # fmt: skip


DAMAGES = ["empty", "broken off early", "broken off", "words", "zeros", "a hole"]
FORMATS = {  # ending, and how the columns are written so that a hole is noticed (plain numbers have no checksum)
    "parquet": (".parquet", lambda path, columns: write_table(path, columns)),
    "npz": (".npz", lambda path, columns: write_table(path, columns)),
    "npz compressed": (".npz", lambda path, columns: np.savez_compressed(path, **columns)),
    "mat v5": (".mat", lambda path, columns: write_mat5(path, {name: list(values) for name, values in columns.items()}, compressed=False)),
    "mat v5 compressed": (".mat", lambda path, columns: write_mat5(path, columns)),
    "mat v7.3": (".mat", lambda path, columns: write_mat73(path, {"t": columns["t"], "s": matrices(columns)})),
}


@pytest.mark.parametrize("how", DAMAGES)
@pytest.mark.parametrize("kind", FORMATS)
def test_corrupt(experiment, cli, arm_logs, kind, how):
    ending, write = FORMATS[kind]
    folder = experiment(config={"data.train": [f"train{ending}"]})
    file = folder / f"train{ending}"
    write(file, arm_logs[0])
    if kind == "mat v7.3" and how == "a hole":  # in what HDF5 keeps about the file
        file.write_bytes(file.read_bytes()[:600] + bytes(1000) + file.read_bytes()[1600:])
    else:
        file.write_bytes(damaged(file.read_bytes(), how))
    cli("fit", folder).complains(f"train{ending}")


def test_npz_member_corrupt(experiment, cli, arm_logs):
    """The archive opens, and one byte in the middle of a member is wrong: its CRC tells."""
    import zipfile

    folder = experiment(config={"data.train": ["train.npz"]})
    file = write_table(folder / "train.npz", arm_logs[0])
    data, start = bytearray(file.read_bytes()), file.read_bytes().index(b"tau_elbow.npy")
    data[start + 2000] ^= 0xFF
    file.write_bytes(data)
    with zipfile.ZipFile(file) as archive:
        assert "tau_elbow.npy" in archive.namelist()
    cli("fit", folder).complains("train.npz", "CRC")


class Owned:
    """Pickled, it would write a file when loaded."""

    def __reduce__(self):
        return Path.touch, (Path("owned"),)


def test_npz_pickled(experiment, cli, arm_logs, tmp_path):
    folder = experiment(config={"data.train": ["train.npz"]})
    np.savez(folder / "train.npz", **(arm_logs[0] | {"q_elbow": np.array([Owned()], dtype=object)}))
    cli("fit", folder).complains("train.npz", "pickle", "plain arrays")
    assert not list(tmp_path.rglob("owned"))


OTHER_VALUES = {
    "text": np.full(600, "0.5"), "complex": np.full(600, 0.5 + 0.1j), "too short": np.zeros(599), "a matrix": np.zeros((600, 2)),
    "a NaN": np.full(600, NAN), "three axes": np.zeros((600, 2, 2)), "one number": np.array(0.5),
}  # fmt: skip


@pytest.mark.parametrize("values", OTHER_VALUES.values(), ids=OTHER_VALUES)
@pytest.mark.parametrize("ending", [".npz", ".mat"])
def test_other_values(experiment, cli, arm_logs, values, ending):
    folder = experiment(config={"data.train": [f"train{ending}"]})
    write_table(folder / f"train{ending}", arm_logs[0] | {"q_elbow": values})
    cli("fit", folder).complains(f"train{ending}")


@pytest.mark.parametrize(
    ("values", "said"), [(["x"] * 600, "String"), ([None] + [0.5] * 599, "missing"), ([NAN] * 600, "nan"), ([["x"]] * 600, "List"), ([[1.0]] * 599 + [[1.0, 2.0]], "a list of 2 numbers")]
)
def test_other_values_parquet(experiment, cli, arm_logs, values, said):
    folder = experiment(config={"data.train": ["train.parquet"]})
    write_table(folder / "train.parquet", arm_logs[0] | {"q_elbow": values})
    cli("fit", folder).complains("train.parquet", "elbow", said)


@pytest.mark.parametrize("kind", [kind for kind in FORMATS if kind != "parquet"])  # Polars may abort on a page of 2^61 numbers
def test_any_damage_is_a_log_error(tmp_path, arm_logs, kind):
    """Sixty random accidents a format: an error that says so or, where no checksum can tell, numbers."""
    ending, write = FORMATS[kind]
    file = tmp_path / f"log{ending}"
    write(file, {name: values[:60] for name, values in arm_logs[0].items()})
    data, chance = file.read_bytes(), random.Random(0)
    for _ in range(60):
        spoilt = bytearray(data)
        start = chance.randrange(len(data))
        match chance.randrange(4):
            case 0:
                spoilt = spoilt[:start]
            case 1:
                spoilt[start] = chance.randrange(256)
            case 2:
                spoilt[start : start + 32] = chance.randbytes(len(spoilt[start : start + 32]))
            case 3:
                spoilt[start:start] = spoilt[:16]
        file.write_bytes(spoilt)
        try:
            table = open_table(file)
            loaded = table.load([table.resolve(name) for name in table.names])
        except LogError as error:
            assert len(str(error).splitlines()) == 1
        else:
            assert all(values.dtype.kind in "iuf" for values in loaded.values())


# ---- the command line and the run folder


@pytest.mark.parametrize("inside", ["", "deeper", "deeper/still"])
def test_run_folder_that_cannot_be_written(experiment, cli, tmp_path, inside):
    (tmp_path / "taken").write_text("a file\n")
    said = cli("fit", experiment(), out=tmp_path / "taken" / inside)
    said.complains("taken", "run folder cannot be written", "--out")
    assert (tmp_path / "taken").read_text() == "a file\n"


def test_experiment_that_is_not_there(cli):
    cli("fit", "nowhere.yaml").complains("nowhere.yaml", "No such file", "check its name")


@pytest.mark.parametrize(
    ("words", "said"),
    [(["fitt", "x"], "'fitt'"), (["fit"], "EXPERIMENT"), (["fit", "x", "--jsn"], "--jsn"), (["fit", "x", "y"], "y"),
     (["compare"], "EXPERIMENT"), (["effects", "colomb"], "coulomb")],
)  # fmt: skip
def test_mistyped(cli, words, said):
    cli(*words).complains(said)


def test_compare_names_the_experiment_at_fault(experiment, cli):
    good, bad = experiment(name="good"), experiment(name="bad", config={"prior.weight": -1})
    cli("compare", good, bad, "--json").complains("bad/config.yaml line", "prior.weight")


def test_in_a_process_of_its_own(experiment, tmp_path, arm_logs):
    """As a user runs it. The Parquet file makes Rust panic, which must not be seen."""
    folder = experiment(config={"data.train": ["train.parquet"]})
    file = write_table(folder / "train.parquet", arm_logs[0], compression="uncompressed")
    good = file.read_bytes()
    command = [sys.executable, "-m", "sysid", "fit", str(folder), "--json", "--out", str(tmp_path / "run")]
    run = lambda: subprocess.run(command, capture_output=True, text=True, env=os.environ | {"RUST_BACKTRACE": "1"}, timeout=60)  # noqa: E731
    said = run()
    assert (said.returncode, said.stderr) == (0, "") and set(json.loads(said.stdout)["rms"]["test"]) == set(JOINTS)
    for path in (tmp_path / "run").iterdir():
        path.unlink()
    file.write_bytes(good[:11] + b"\x01" + good[12:])  # a page is longer than its header says
    said = run()
    assert said.returncode == 2 and said.stdout == "" and not list((tmp_path / "run").iterdir())
    assert len(said.stderr.splitlines()) == 1 and said.stderr.startswith("sysid: ") and "train.parquet" in said.stderr


# ---- what is mended, with a notice


def fitted(said) -> dict:
    """The JSON of a fit that ended well, every body possible."""
    assert (said.status, said.err) == (0, "")
    document = json.loads(said.out)
    assert document["physically_consistent"]
    return document


def degrees(columns):
    return {name: np.degrees(values) if name.startswith("q_") else values for name, values in columns.items()}


def standing(columns):
    return columns | {"q_elbow": np.full(600, 0.3)}


def jittered(columns):
    """A clock that stumbles by a fifth of its step; angles stay those of the true times."""
    return columns | {"t": columns["t"] + np.random.default_rng(3).uniform(-5e-4, 5e-4, 600)}


NOTICES = {
    "degrees under rad": (degrees, ["angles reach shoulder ", ", elbow ", "data.units.position: deg"]),
    "truncated last row": (lambda c: csv(c)[:-30], ["the last row is truncated and was dropped"]),
    "last cell broken off": (lambda c: csv(c).rsplit(",", 1)[0] + ",-", ["the last row is truncated and was dropped"]),
    "stamps of arrival": (jittered, ["samples were taken evenly"]),
    "gap": (rows(lambda t: (t < 1.0) | (t > 1.4)), ["1 gap(s), the longest 0.41 s", "2 segments"]),
    "segment shorter than the window": (rows(lambda t: (t < 2.5) & ((t < 1.0) | (t > 1.4)) | (t > 2.95)),
        ["2 gap(s)", "1 segment(s) shorter than the filter's window were left out"]),
}  # fmt: skip


@pytest.mark.parametrize(("log", "words"), NOTICES.values(), ids=NOTICES)
def test_log_is_mended(experiment, cli, log, words):
    document = fitted(cli("fit", experiment(train=log), "--json"))
    for word in words:
        assert any(word in notice and "train.csv" in notice for notice in document["notices"]), document["notices"]


def test_joint_that_never_moves(experiment, cli):
    document = fitted(cli("fit", experiment(train=standing), "--json"))
    assert any("'elbow' never moves" in notice and "held at its prior" in notice for notice in document["notices"])
    held = {entry["name"]: entry["value"] for entry in document["parameters"] if entry.get("held")}
    assert held == pytest.approx({"viscous.elbow.Fv": 0.1, "coulomb.elbow.Fc": 0.15})


LOWER = re.search(r'<link name="lower">.*?</link>', URDF, re.DOTALL).group()
INERTIAL = re.search("<inertial>.*</inertial>", LOWER).group()
SHAPE = '<collision><geometry><cylinder radius="0.03" length="0.3"/></geometry></collision>'


def stating(**numbers):
    """The lower link's inertial with numbers replaced."""
    text = INERTIAL
    for name, value in numbers.items():
        text = re.sub(rf'(<mass value|{name})="[^"]*"' if name == "mass" else rf'({name})="[^"]*"', rf'\1="{value}"', text)
    return text


ZERO = dict(ixx=0, iyy=0, izz=0)
REPAIRS = {
    "nothing stated": ("", "states no inertia", "ball of 1.5 kg"),
    "nothing stated, with a shape": (SHAPE, "states no inertia", "uniform solid of its shapes"),
    "zero": (stating(mass=0, **ZERO), "states no inertia", "ball of 1.5 kg"),
    "zero, with a shape": (stating(mass=0, **ZERO) + SHAPE, "states no inertia", "uniform solid"),
    "a mesh is no shape": (
        '<collision><geometry><mesh filename="package://none/none.stl"/></geometry></collision>',
        "states no inertia",
        "ball of 1.5 kg",
    ),
    "point mass": (stating(**ZERO), "impossible", "ball of 0.8 kg"),
    "point mass, with a shape": (stating(**ZERO) + SHAPE, "impossible", "0.8 kg"),
    "negative mass": (stating(mass=-0.8), "impossible", "ball of 1.5 kg"),
    "negative mass, with a shape": (stating(mass=-0.8) + SHAPE, "impossible", "uniform solid"),
    "negative moment": (stating(izz=-0.001), "impossible", "mass and centre of mass are kept"),
    "all moments negative": (stating(ixx=-1, iyy=-1, izz=-1), "impossible", "ball of 0.8 kg"),
    "triangle violated": (stating(izz=1), "impossible", "mass and centre of mass are kept"),
    "product too large": (stating(ixy=0.5), "impossible", "mass and centre of mass are kept"),
    "a rod without thickness": (stating(ixx=0.006, iyy=0.006, izz=0), "impossible", "mass and centre of mass are kept"),
}


@pytest.mark.parametrize(("inertial", "problem", "remedy"), REPAIRS.values(), ids=REPAIRS)
def test_inertia_is_repaired(experiment, cli, inertial, problem, remedy):
    document = fitted(cli("fit", experiment(urdf=replaced((LOWER, f'<link name="lower">{inertial}</link>'))), "--json"))
    (notice,) = decided(document)
    assert "body 'lower'" in notice and problem in notice and remedy in notice


@pytest.mark.parametrize("command", ["diagnose", "add"])
def test_what_is_repaired_is_a_note_and_no_warning_of_python(experiment, cli, command):
    inertial = stating(izz=1)
    given = experiment(urdf=replaced((LOWER, f'<link name="lower">{inertial}</link>')))
    said = cli(command, given, *(["stribeck", "--joint", "elbow", "--force"] if command == "add" else []))
    assert said.status == 0 and "body 'lower'" in said.out + said.err
    assert "SysidWarning" not in said.out + said.err and "link_priors" not in said.err


def test_mimic_joint_is_locked(experiment, cli):
    finger = (
        '<link name="finger"><inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>'
        '<joint name="grip" type="revolute"><parent link="lower"/><child link="finger"/><axis xyz="1 0 0"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/><mimic joint="elbow" multiplier="2"/></joint></robot>'
    )
    document = fitted(cli("fit", experiment(urdf=replaced(("</robot>", finger))), "--json"))
    assert any("grip moves with elbow" in notice and "holds it still" in notice for notice in document["notices"])
    assert set(document["rms"]["test"]) == set(JOINTS)


def test_rotor_whose_name_is_taken(experiment, cli):
    taken = replaced(('name="elbow"', 'name="shoulder_rotor"'))
    cli("fit", experiment(urdf=taken)).complains("rotor of 'shoulder'", "shoulder_rotor", "rename")


UNNEEDED = {
    "limits without effort and speed": (('<limit lower="-3" upper="3" effort="50" velocity="10"/>', '<limit lower="-3" upper="3"/>'),),
    "no limits": (('<limit lower="-3" upper="3" effort="50" velocity="10"/>', ""),),
    "no name of the robot": (('<robot name="arm">', "<robot>"),),
    "a mesh that is not there": ((UPPER, UPPER + '<visual><geometry><mesh filename="package://none/none.dae"/></geometry></visual>'),),
    "a material that is not there": ((UPPER, UPPER + '<visual><geometry><box size="1 1 1"/></geometry><material name="m"/></visual>'),),
    "elements of others": (("</robot>", "<gazebo/><transmission/><ros2_control/><material/></robot>"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><safety_controller/>')),
}  # fmt: skip


@pytest.mark.parametrize("pairs", UNNEEDED.values(), ids=UNNEEDED)
def test_urdf_is_read_for_what_is_needed(experiment, cli, pairs):
    """What identification does not use may be missing or wrong."""
    assert decided(fitted(cli("fit", experiment(urdf=replaced(*pairs)), "--json"))) == []


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_urdf_in_another_encoding(experiment, cli, encoding):
    names = replaced(
        ('<?xml version="1.0"?>', f'<?xml version="1.0" encoding="{encoding.removesuffix("-sig")}"?>'),
        ("lower", "Gerät"),
        ('Gerät="-3"', 'lower="-3"'),
    )
    document = fitted(cli("fit", experiment(urdf=names(URDF).encode(encoding)), "--json"))
    assert "Gerät.m" in [entry["name"] for entry in document["parameters"]]


@pytest.mark.parametrize(("variable", "place"), [("ROS_PACKAGE_PATH", "my_robot"), ("ROS_PACKAGE_PATH", ""), ("AMENT_PREFIX_PATH", "")])
def test_urdf_of_a_package(experiment, cli, tmp_path, monkeypatch, variable, place):
    """A package stands below a folder of the path, is named by it, or stands below an installation's share."""
    package = tmp_path / "ws" / ("share" if variable == "AMENT_PREFIX_PATH" else "") / "my_robot"
    (package / "urdf").mkdir(parents=True)
    (package / "urdf/arm.urdf").write_text(URDF)
    monkeypatch.setenv(variable, f"/nowhere{os.pathsep}{tmp_path / 'ws' / place}")
    fitted(cli("fit", experiment(urdf=None, config={"robot.urdf": "package://my_robot/urdf/arm.urdf"}), "--json"))


@pytest.mark.parametrize("scheme", ["package", "example-robot-data"])
def test_urdf_of_an_example(scheme):
    from sysid import urdf, urdf_files

    assert len(urdf.read(urdf_files.locate(f"{scheme}://ur_description/urdf/ur5_robot.urdf", Path())).joints) > 6


def test_notices_come_once_and_good_input_has_none(experiment, cli):
    assert decided(fitted(cli("fit", experiment(), "--json"))) == []


@pytest.mark.parametrize(("name", "word"), [("log.csv", "a log"), ("day.mcap", "a log"), ("arm.urdf", "a robot"), ("arm.xml", "a robot")])
def test_a_file_that_is_no_experiment_is_told_what_to_do(name, word, cli, tmp_path):
    (tmp_path / name).write_text("t,q\n")
    cli("fit", tmp_path / name).complains(name, f"{word}, not an experiment", "`sysid init URDF LOG...` writes one")


def test_the_bare_command_says_what_to_type(monkeypatch, capfd):
    import sys

    from sysid import cli as commands

    for words, status, says in (([], 2, "which command?"), (["--version"], 0, "sysid 0.")):
        monkeypatch.setattr(sys, "argv", ["sysid", *words])
        with pytest.raises(SystemExit) as stop:
            commands.main()
        said = capfd.readouterr()
        assert int(stop.value.code or 0) == status and says in said.out + said.err and len((said.out + said.err).splitlines()) == 1
