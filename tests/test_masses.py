"""Links far from their URDF's masses, and what brings them back."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sysid import masses, pipeline, regressor
from sysid.check import check
from sysid.errors import SysidWarning
from sysid.estimate import identify
from sysid.held_apart import chosen
from sysid.listed_effects import build
from sysid.model import moving_coefficients
from sysid.prior_weight import with_weight
from tests.conftest import JOINTS, URDF, motion
from tests.problems import arm, fourier_motion
from tests.test_prior_weight import auto, compressed

MOTORS = np.array([10.0, 15.0, 7.5, 2.0, 1.5, 1.0])  # kg m^2, behind their gears


def driven(extra, *effects: str):
    """A UR5 as its URDF says, with torque that is not in it, extra(q, qd, qdd) (n, 6): its fit with more effects, and its motion."""
    experiment, structure, *_, prior = arm()
    t, q, qd, qdd = fourier_motion(np.random.default_rng(3), 20.0, 200.0, 6)
    tau = regressor.torque(structure.robot, prior, q, qd, qdd) + 2.0 * qd + np.sign(qd)
    tau += extra(q, qd, qdd) + 0.3 * np.random.default_rng(1).normal(size=q.shape)
    specs = [
        *experiment.model.effects,
        *(experiment.model.effects[0].model_copy(update={"name": e}) for e in effects),
    ]
    structure = build(structure.robot, specs)
    _, model, seen, data, _ = compressed(experiment, structure, t, q, tau)
    moving = moving_coefficients(model, seen)
    strength = chosen(auto(experiment), model, data, moving, prior)
    fit = identify(with_weight(experiment, strength.value), model, seen, data, prior)
    return replace(fit, strength=strength), seen


@pytest.mark.long
@pytest.mark.parametrize(
    ("extra", "effect"),
    [
        (lambda q, qd, qdd: MOTORS * qdd, "armature"),
        (lambda q, qd, qdd: q * [0.0, 60.0, 0.0, 0.0, 0.0, 0.0], "spring"),
    ],
)
def test_what_is_missing_is_named_and_brings_the_masses_back(extra, effect):
    fit, seen = driven(extra)
    found = masses.implausible(fit, seen)
    assert found.effect == effect and found.joints is None and found.weight is None
    assert found.command == f"sysid add experiment.yaml {effect}" and found.command in found.says
    for link, _, mass, urdf in found.far:
        assert link in found.says and not 1.0 / 3.0 < mass / urdf < 3.0
    cured, seen = driven(extra, effect)
    assert masses.implausible(cured, seen) is None
    assert np.abs(np.log(cured.pi[:, 0] / cured.prior[:, 0])).max() < np.log(1.1)


def test_the_motors_come_out_of_the_links():
    cured, _ = driven(lambda q, qd, qdd: MOTORS * qdd, "armature")
    own = [k for k, c in enumerate(cured.model.coefficients) if c.effect == "armature"]
    assert cured.coefficients[own] == pytest.approx(MOTORS, abs=0.3)


def test_a_robot_as_its_urdf_says_is_left_in_peace():
    fit, seen = driven(lambda q, qd, qdd: 0.0 * q)
    assert masses.implausible(fit, seen) is None and masses.document(None) == {}


def test_where_nothing_is_looked_for_none_is_named():
    fit, _ = driven(lambda q, qd, qdd: MOTORS * qdd)
    found = masses.implausible(fit, None)
    assert found.far and not found.effect and "sysid check" in found.says


def test_a_weak_prior_is_told_to_choose():
    """Hardly moving wrists under a weight of 1e-6: their masses are noise, and a weight that is chosen is all they need."""
    experiment, structure, *_, prior = arm()
    sizes = np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02])
    t, q, qd, qdd = (x if x.ndim == 1 else x * sizes for x in fourier_motion(np.random.default_rng(3), 20.0, 200.0, 6))
    tau = regressor.torque(structure.robot, prior, q, qd, qdd) + 2.0 * qd + np.sign(qd)
    tau += np.random.default_rng(1).normal(size=q.shape)
    _, model, seen, data, _ = compressed(experiment, structure, t, q, tau)
    found = masses.implausible(identify(with_weight(experiment, 1e-6), model, seen, data, prior), seen)
    assert found.far and not found.effect and found.weight > 1e3 and "`prior.weight: auto`" in found.says


def test_a_link_without_a_stated_mass_is_far_from_none(experiment):
    """Its prior is a guess; the other's mass is what the URDF says."""
    parts = URDF.partition('<link name="lower">')
    bare = parts[0] + parts[1] + parts[2].partition("</inertial>")[2]
    folder = experiment(urdf=bare)
    with pytest.warns(SysidWarning, match="'lower' states no inertia"):
        machine, *_ = pipeline.build(pipeline.load(folder))
    assert masses.far(machine, 10.0 * machine.prior) == [0]


def geared(seed: int):
    """A change of a log's torque: motors behind gears, which the URDF of `experiment` does not have."""

    def changed(columns):
        _, _, qdd = motion(columns["t"], seed)
        for k, joint in enumerate(JOINTS):
            columns[f"tau_{joint}"] = columns[f"tau_{joint}"] + (3.0, 2.0)[k] * qdd[:, k]
        return columns

    return changed


@pytest.mark.long
def test_a_fit_and_a_check_name_armature_and_adding_it_cures(experiment, cli):
    folder = experiment(
        config={"prior.weight": "auto", "robot.rotors": [], "preprocess.window": 0.1},
        train=geared(0),
        test=geared(1),
    )
    said = cli("fit", folder, "--json")
    document = json.loads(said.out)
    found = document["implausible_masses"]
    assert found["effect"] == "armature" and found["command"] == f"sysid add {folder} armature"
    assert any(found["command"] in notice for notice in document["notices"])
    faults = [f for f in check(pipeline.load(folder)) if f.fault == "mass_implausible"]
    assert {f.joint for f in faults} >= {link["joint"] for link in found["far"]}
    assert all(f.severity == "warning" and found["command"] in f.do for f in faults)
    cured = cli(*found["command"].split()[1:], "--json")
    assert cured.status == 0, cured.err
    after = json.loads((cured.run / "fit.json").read_text())
    assert after["implausible_masses"] is None
    values = {p["name"]: p["value"] for p in after["parameters"]}
    assert values["armature.shoulder.Ia"] == pytest.approx(3.0, abs=0.3)
    assert values["armature.elbow.Ia"] == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize(("least", "expected"), [(30.0, 1000.0), (3000.0, None)])
def test_a_stronger_prior_is_told_where_it_hardly_costs_anything(least, expected):
    """Squares held apart that grow by 1e-5 of themselves with the weight: 2010 makes one per cent of the error."""
    rows = np.full((5, 2), 100)
    apart = SimpleNamespace(squares=lambda weight: rows * (1.0 + 1e-5 * weight), rows=rows)
    found = SimpleNamespace(strength=SimpleNamespace(value=1.0))
    told = masses._stronger(SimpleNamespace(apart=apart, found=found, plausible=lambda weight: weight >= least))
    assert told.stronger == expected
    said = replace(told, far=(("link", "joint", 9.0, 2.0),)).says
    assert ("prior.weight: 1000" in said and "0.5 %" in said) if expected else "columns or units may be wrong" in said


def test_of_a_fit_that_is_worse_than_none_columns_come_before_what_brings_masses_back():
    far = masses.Masses((("forearm", "elbow", 0.1, 1.0),), effect="spring", command="sysid add there spring")
    assert masses.doubted(far, False) is far and masses.doubted(None, True) is None
    told = masses.document(masses.doubted(far, True))
    assert told["command"] is None and told["far"] == masses.document(far)["far"]
    assert "sysid check" in told["says"] and "sysid add" not in told["says"]
