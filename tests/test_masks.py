"""`preprocess.mask`: stretches of a log that count in no fit and in no error."""

import numpy as np
import pytest
import yaml

from sysid import config, experiment_logs, pipeline, results, yaml_text
from sysid.errors import ConfigError, SysidWarning
from tests.test_report import EVIL, LOG, written


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return written(tmp_path_factory.mktemp("masks") / "arm", 0.0)


def with_mask(folder, *masks, **more):
    found = yaml_text.plain(yaml_text.parse_yaml((folder / "config.yaml").read_text(), where=""))
    # the motion is prescribed, so friction bends no reversal of it: every row but the masked counts
    found["preprocess"] = {**found.get("preprocess", {}), "standstill": "keep", "mask": list(masks), **more}
    return config.experiment(found, folder / "config.yaml")


def used(experiment, part="train"):
    fit = pipeline.fit(experiment)
    found = fit.predictions[part]
    return fit, found.t, np.ones(found.measured.shape, bool) if found.use is None else found.use


def test_rows_of_a_mask_count_nowhere(arm):
    stretch = {"start": 2.0, "stop": 3.0}
    every = {"log": LOG, **stretch}
    one = {"log": "test.csv", "joints": ["elbow"], **stretch}
    for events in ("mask", "keep"):
        experiment = with_mask(arm, every, one, events=events)
        fit, t, use = used(experiment)
        inside = (t >= 2.0) & (t <= 3.0)
        assert not use[inside].any() and use[~inside].all()
        found = fit.predictions["test"]
        inside = (found.t >= 2.0) & (found.t <= 3.0)
        assert found.use[:, 0].all() and not found.use[inside, 1].any()
        left = (found.measured - found.predicted)[~inside, 1]
        assert fit.rms("test")["elbow"] == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-12)
        assert any("masked: 1 masked stretch" in notice for notice in fit.notices)
        assert [e["kind"] for e in fit.events] == ["mask", "mask"]


def test_what_is_masked_does_not_move_the_parameters(arm):
    """Wrong torque in a masked stretch: the fit is the one without it."""
    experiment = with_mask(arm, {"log": LOG, "start": 2.0, "stop": 3.0})
    read = experiment_logs.read_all(experiment)
    clean = pipeline.fit(experiment, measured=read)
    (segment,) = read.train[0].segments
    segment.tau[(segment.t >= 2.0) & (segment.t <= 3.0)] += 5.0
    np.testing.assert_allclose(pipeline.fit(experiment, measured=read).x, clean.x, rtol=1e-9)


@pytest.mark.parametrize(("mask", "said"), [
    ({"log": "tset.csv", "start": 0, "stop": 1}, "no such log in data.train or data.test; near: test.csv"),
    ({"log": "test.csv", "start": 2, "stop": 1}, "start 2 must be before stop 1"),
    ({"log": "test.csv", "start": 0}, "stop"),
    ({"log": "test.csv", "start": 0, "stop": 1, "joint": "elbow"}, "joint"),
])  # fmt: skip
def test_a_mask_that_cannot_be_meant(arm, mask, said):
    with pytest.raises(ConfigError, match=said):
        with_mask(arm, mask)


def test_a_joint_that_is_not_there_and_a_time_that_is_not_there(arm):
    with pytest.raises(ConfigError, match=r"preprocess.mask names the joint 'elbo'.*elbow"):
        pipeline.fit(
            with_mask(arm, {"log": "test.csv", "start": 0.0, "stop": 1.0, "joints": ["elbo"]})
        )
    fit = pipeline.fit(with_mask(arm, {"log": "test.csv", "start": 90.0, "stop": 91.0}))
    assert any("has no row from 90 to 91 s" in notice for notice in fit.notices)
    assert issubclass(SysidWarning, Warning) and EVIL in fit.joints


def test_the_run_folder_fits_the_same_again(arm, tmp_path):
    fit = pipeline.fit(with_mask(arm, {"log": LOG, "start": 2.0, "stop": 3.0}))
    results.write(fit, tmp_path / "run")
    (mask,) = yaml.safe_load((tmp_path / "run" / "experiment.yaml").read_text())["preprocess"]["mask"]
    assert (tmp_path / "run" / mask["log"]).resolve() == (arm / LOG).resolve()
    again = pipeline.fit(pipeline.load(tmp_path / "run" / "experiment.yaml"))
    np.testing.assert_allclose(again.x, fit.x, rtol=1e-9)
