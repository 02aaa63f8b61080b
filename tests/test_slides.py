"""Rows on which a second contact may stick say nothing of its friction."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from sysid import pipeline, vocabulary
from sysid.config import load
from sysid.motion import Blur
from sysid.slides import counted
from sysid.standstill import sliding

from .test_select import edited


def piece(qd, step=0.01):
    """Speeds (n, 2) with the row before and after a reversal left out."""
    qd = np.asarray(qd, dtype=float)
    qdd = np.gradient(qd, step, axis=0)
    blur = Blur(reach=2, stop=0.0, look=1)
    return SimpleNamespace(t=np.arange(len(qd)) * step, q=np.cumsum(qd, axis=0) * step, qd=qd, qdd=qdd, noise=np.zeros(2), step=step, blur=blur, use=None, kept={})


def test_rows_about_a_sum_of_speeds_that_turns_are_left_out():
    n = np.arange(40)
    own = piece(np.column_stack([np.full(40, 1.0), -2.0 + 0.1 * n]))  # their sum turns at row 10, their difference at 30
    over = np.array([[1.0, 1.0], [1.0, -1.0]])
    out = np.flatnonzero(~sliding(own, over))
    np.testing.assert_array_equal(out, [*range(7, 13), *range(27, 33)])
    assert sliding(own, np.array([[1.0, 0.0]])).all()  # the first joint never turns
    own.blur = None  # the experiment keeps what stands still
    assert sliding(own, over).all()


def test_only_the_coupled_joint_loses_rows():
    n = np.arange(40)
    own = piece(np.column_stack([np.full(40, 1.0), -2.0 + 0.1 * n]))
    coupling = vocabulary.find("joint_coupling").bound(SimpleNamespace(joints=("a", "b")), 1)
    model = SimpleNamespace(terms=[(vocabulary.find("viscous"), (0, 1)), (coupling, (1,))])
    use = counted(model, own)
    assert use[:, 0].all() and 0 < (~use[:, 1]).sum() < 20
    assert counted(SimpleNamespace(terms=model.terms[:1]), own) is None


@pytest.mark.long
def test_friction_of_a_second_contact_is_within_its_deviation(simulated):
    """Where both joints' speeds sum to nothing the contact sticks for a while: counted, it would have less friction than it has."""
    folder = simulated("coupled", "joint_coupling:elbow:Ia=0.2,Fv=0.1,Fs=0.4,Fd=0", seed=4, duration=20.0)
    file = edited(folder, "with", model={"effects": ["viscous", "coulomb", "armature", {"joint_coupling": {"joints": ["elbow"]}}]})
    fit = pipeline.fit(load(file))
    (truth,) = json.loads((folder / "truth.json").read_text())["hidden"]
    found = fit.parameters_of("joint_coupling", 1)
    for word in ("Ia", "Fv", "Fs", "Fd"):
        value, std, _ = found[f"joint_coupling.elbow.{word}"]
        assert abs(value - truth["values"][word]) < 3.0 * std, (word, value, std)
    assert found["joint_coupling.elbow.Fs"][1] < 0.05 * truth["values"]["Fs"]
