"""Logs that other people measured, where they are: `sysid fetch`, or SYSID_DATA_DIR."""

import functools
import hashlib
import http.server
import os
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid import pipeline
from sysid.addition import grown
from sysid.datasets import DATASETS
from sysid.transfer import transfers

CONFIGS = Path(__file__).resolve().parent.parent / "configs"


def fitted(name: str):
    missing = DATASETS[name].missing()
    if missing:
        pytest.skip(f"{name}: {missing[0]} is not in the data folder; `sysid fetch {name}` brings it, or SYSID_DATA_DIR names where it is")
    return sysid.fit(sysid.load(CONFIGS / f"{name}.yaml"))


def values(fit) -> dict[str, float]:
    return dict(zip(fit.model.names, fit.x))


def relative_error(fit, part: str) -> float:
    return fit.predictions[part].errors()["total"][1]


def proven(fit) -> None:
    assert fit.solution.converged and fit.certificate.globally_optimal and fit.physically_consistent


def test_emps_agrees_with_its_published_reference():
    fit = fitted("emps")
    proven(fit)
    found = values(fit)
    np.testing.assert_allclose(found["carriage.m"], 95.1089, rtol=0.01)
    np.testing.assert_allclose(found["viscous.slider.Fv"], 203.5034, rtol=0.01)
    np.testing.assert_allclose(found["coulomb.slider.Fc"], 20.3935, rtol=0.01)
    np.testing.assert_allclose(found["torque_bias.slider.b"], -3.1648, atol=0.1)
    assert fit.model.units[-3:] == ["N s/m", "N", "N"]


def test_panda_is_within_its_published_error():
    fit = fitted("panda")
    proven(fit)
    # published for this trajectory: 1.41 % by classical least squares, fitted and judged on all of it
    whole = fit.experiment.data.model_copy(update={"train": [log("panda:exciting_trajectory_1")], "test": [log("panda:exciting_trajectory_1")]})
    everything = sysid.fit(fit.experiment.model_copy(update={"data": whole}))
    proven(everything)
    assert relative_error(everything, "train") <= 0.0141
    assert relative_error(fit, "train") <= 0.0141
    # a half that the fit never saw
    assert relative_error(fit, "test") <= 0.0141


def folder(name: str) -> Path:
    """An experiment folder of the data."""
    found = Path(os.environ.get("SYSID_DATA_DIR") or "nowhere") / name
    if not (found / "config.yaml").exists():
        pytest.skip(f"{name} is not in the folder that SYSID_DATA_DIR names")
    return found


def diagnosed(name: str):
    """The document of a diagnosis of an experiment folder of the data, and its fit."""
    from sysid.diagnose.diagnosis import diagnose
    from sysid.statement.document import document

    found = diagnose(sysid.load(folder(name)))
    return document(found), found.fit


@pytest.mark.long
def test_kinova_without_its_spikes_and_bursts_has_less_than_half_of_the_error():
    experiment = sysid.load(folder("kinova"))
    kept = experiment.model_copy(update={"preprocess": experiment.preprocess.model_copy(update={"events": "keep"})})
    fit = sysid.fit(experiment)
    assert fit.rms("test")["joint_1"] < 0.5 * sysid.fit(kept).rms("test")["joint_1"]
    # most joints ring twice in the test log, where several spike at once
    first, second = [e for e in fit.events if e["kind"] == "knock" and e["part"] == "test"]
    for event, at in ((first, 1.07), (second, 1.57)):
        assert event["start"] < at < event["stop"] and len(event["joints"]) >= 4


@pytest.mark.long
def test_odrive_ripples_at_7_14_and_28_periods_a_turn():
    """Known of the motor from static maps: 0.87, 0.29 and 0.46 A at 0.03 turns/s, at 0.04 N m/A; of it alone, as the command adds it."""
    said, fit = diagnosed("odrive")
    last = [f for f in said["findings"] if f["joins_as_step"] and f["effect"] == "cogging"][-1]
    assert "lines=" in last["command"] and last["parameters"]["cogging.axis0.k"]["value"] == pytest.approx(7.0, abs=0.05)
    after = sysid.fit(grown(fit.experiment, "cogging", ["axis0"], last["options"]))
    values = {name.split(".")[-1]: value for name, (value, *_) in after.parameters_of("cogging", 0).items()}
    size = {round(line * values["k"], 1): np.hypot(values[f"a{line}"], values[f"b{line}"]) for line in range(1, last["options"]["lines"] + 1)}
    for periods, ampere in ((7, 0.87), (14, 0.29), (28, 0.46)):
        (own,) = [a for k, a in size.items() if abs(k - periods) < 0.1 * periods / 7]
        assert own == pytest.approx(0.04 * ampere, rel=0.15)


@pytest.mark.long
def test_kr300_has_no_warmth_in_ten_seconds():
    """It stands, breaks away and stops: friction at low speed, which friction that falls with time can imitate."""
    said, _ = diagnosed("kr300")
    named = {f["effect"] for f in said["findings"] if f["joins_as_step"]}
    assert not named - {"stribeck", "presliding"}
    assert "warmup" not in {m["effect"] for v in said["verdict"] for m in v.get("set", [])}


@pytest.mark.long
def test_schunk_s_short_runs_do_not_carry_the_model_over():
    folder = Path(os.environ.get("SYSID_DATA_DIR") or "nowhere") / "schunk"
    if not folder.exists():
        pytest.skip("no schunk in SYSID_DATA_DIR")
    fit = pipeline.fit(pipeline.load(folder))
    brakes = {joint for event in fit.events if event["kind"] == "brake" for joint in event["joints"]}
    assert {"j2", "j3", "j4", "j5"} <= brakes
    words = {found.joint: found.says for found in transfers(fit)}
    carried = [joint for joint, says in words.items() if "do not carry the model" in says]
    assert {"j2", "j4"} <= set(carried) and all("the training logs (10 of 2" in words[joint] for joint in carried)


def log(name: str):
    from sysid.log_spec import LogSpec

    return LogSpec(file=name)


def test_ur10e_on_another_motion():
    fit = fitted("ur10e")
    proven(fit)
    assert fit.experiment.data.units.torque_constant["shoulder_pan_joint"] == 14.87
    assert fit.experiment.preprocess.torque == "raw"
    assert relative_error(fit, "test") <= 0.059
    assert any("resampled" in notice for notice in fit.notices)


def test_a_changed_file_is_refused(tmp_path, monkeypatch):
    if DATASETS["emps"].missing():
        pytest.skip("emps is not in the data folder; `sysid fetch emps` brings it")
    from sysid.datasets import data_folder, reference

    content = bytearray((data_folder() / "emps" / "DATA_EMPS.mat").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "emps").mkdir()
    (tmp_path / "emps" / "DATA_EMPS.mat").write_bytes(content)
    monkeypatch.setenv("SYSID_DATA_DIR", str(tmp_path))
    with pytest.raises(sysid.SysidError, match="SHA-256"):
        reference("emps:DATA_EMPS").locate()
    with pytest.raises(sysid.SysidError, match="sysid fetch panda"):
        reference("panda:exciting_trajectory_1").locate()


def test_fetch_downloads_checks_and_keeps(tmp_path, monkeypatch):
    """Against a server of our own on localhost: what is wrong is refused, what is there is not fetched again."""
    (tmp_path / "source").mkdir()
    (tmp_path / "source" / "a.mat").write_bytes(b"measured")
    handler = functools.partial(_Quiet, directory=str(tmp_path / "source"))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setenv("SYSID_DATA_DIR", str(tmp_path / "data"))
    try:
        good = hashlib.sha256(b"measured").hexdigest()
        made = replace(DATASETS["emps"], source=f"http://127.0.0.1:{server.server_port}", files={"a.mat": ("a.mat", good)})
        (path,) = made.fetch()
        assert path.read_bytes() == b"measured" and not made.missing()
        (tmp_path / "source" / "a.mat").write_bytes(b"tampered")
        assert made.fetch() == [path] and path.read_bytes() == b"measured"
        path.unlink()
        with pytest.raises(sysid.SysidError, match="could not be fetched"):
            made.fetch()
        assert not path.exists()
    finally:
        server.shutdown()
        server.server_close()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        """Say nothing."""
