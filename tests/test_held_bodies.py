"""A body that `prior.known` holds and that is not as the URDF states it looks like an effect of its joint."""

import pytest

from sysid import config, pipeline
from sysid.diagnose.diagnosis import diagnose


def held(folder, *links: str):
    """The experiment of a simulated folder, whose bodies are not those of its URDF, with links held."""
    path = folder / "config.yaml"
    found = config.loads(path.read_text(), path)
    return found.model_copy(update={"prior": found.prior.model_copy(update={"known": list(links)})})


@pytest.mark.parametrize(("link", "joint"), [("upper", "shoulder"), ("fore", "elbow")])
@pytest.mark.parametrize("hide", [(), ("stribeck:elbow:size=2",)])
def test_what_may_be_a_body_that_is_held_is_said(simulated, hide, link, joint):
    """Of the last link a load on it is claimed, and of the other one a cable; nobody says that these are not there."""
    folder = simulated(f"held {len(hide)}", *hide, seed=8, duration=12.0)
    found = diagnose(held(folder, link))
    said = [notice for notice in found.notices if "`known` under `prior:` holds" in notice]
    if hide and link == "fore":  # friction is left where the body is let go
        assert not any("on elbow" in notice for notice in said)
        return
    assert len(said) == 1 and f"holds {link}: let go" in said[0] and f"on {joint}" in said[0]
    # the figures are those of the fit without
    free = pipeline.fit(pipeline.load(folder), filters=found.fit.filters)
    assert f"to {free.rms('test')[joint]:.4g} N m on {joint}" in said[0]


def test_where_no_body_is_held_nothing_is_said(diagnosed):
    assert not any("let go" in notice for notice in diagnosed("held by nobody", "stribeck:elbow:size=2", seed=8).notices)
