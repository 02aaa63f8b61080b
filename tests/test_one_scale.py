"""One error scale: the same quantity has the same value wherever it is shown, and says what it is of."""

import json
import re
import sys

import pytest

from sysid import pipeline
from sysid.cli import main
from sysid.report.sections import sections
from sysid.report.words import level
from tests.test_report import EVIL, Elements
from tests.test_studio import previewed, rippled, studio


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """The arm diagnosed on the command line; a studio on the same folder; what the terminal said."""
    folder = rippled(tmp_path_factory.mktemp("scale") / "arm")
    run, said = folder.parent / "run", []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("builtins.print", lambda *words, **how: said.append(" ".join(map(str, words))))
        for command in ("fit", "diagnose", "report"):
            patch.setattr(sys, "argv", ["sysid", command, str(folder), "--out", str(run)])
            with pytest.raises(SystemExit) as stop:
                main()
            assert not stop.value.code
    return folder, run, studio(folder, run), "\n".join(said)


def cells(html: str, label: str) -> dict[str, list[str]]:
    """The rows of a table of a page, by their heads."""
    table = re.search(rf'aria-label="{label}">(.*?)</table>', html, re.S)[1]
    out = {}
    for row in re.findall(r"<tr[^>]*>(.*?)</tr>", table, re.S):
        first, *rest = ("".join(Elements(c).texts).strip() for c in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, re.S))
        out[first] = rest
    return out


@pytest.mark.long
@pytest.mark.parametrize("joint", [EVIL, "elbow"])
def test_a_held_out_error_is_the_same_everywhere(shown, joint):
    folder, run, own, terminal = shown
    fit = pipeline.fit(pipeline.load(folder))
    number = fit.joints.index(joint)
    error = fit.rms("test")[joint]
    found = json.loads((run / "fit.json").read_text())
    said = json.loads((run / "diagnosis.json").read_text())
    asked = {"sha": own.sha, "part": "test"}
    window = own.get("/api/window", **asked, joint=number).json()
    exact = {
        "fit.json": found["rms"]["test"][joint],
        "diagnosis.json": said["joints"][joint]["rms"]["test"],
        "chart": window["rms"], "sight": window["here"],
        "stretch": own.get("/api/stretch", **asked, **{"from": -1, "to": 1e6}).json()["joints"][number]["whole"],
        "history": own.session.history.steps()[-1]["rms_test"][joint],
        "run folder": json.loads((own.run / "fit.json").read_text())["rms"]["test"][joint],
    }  # fmt: skip
    assert exact == dict.fromkeys(exact, error)
    # in words: the page, and the studio's, which is the same
    made = sections(fit, said, [])
    page = own.get("/api/view", sha=own.sha).json()["sections"]
    for html in (made, page):
        card = next(c for c in re.findall(r"<article.*?</article>", html["verdict"]["html"], re.S) if joint in "".join(Elements(c).texts))
        assert f"held-out error {level(error)}" in "".join(Elements(card).texts)
        steps = cells(html["steps"]["html"], "held-out error after each step")
        assert steps["0: start"][number] == level(error)
        assert cells(html["torque"]["html"], "errors of each joint")[joint][1].startswith(level(error))
    # and on the terminal, of the fit and of the diagnosis
    assert len(re.findall(rf"{re.escape(joint)}.*\b{re.escape(f'{error:.4g}')}\b", terminal)) >= 2


@pytest.mark.long
def test_a_preview_a_verdict_and_an_addition_say_one_number(shown):
    _, run, own, _ = shown
    said = json.loads((run / "diagnosis.json").read_text())
    after = said["claims"][0]["rms_test_after"][EVIL]
    key = previewed(own, finding=0)
    preview = own.get("/api/window", sha=own.sha, part="test", joint=0, shown=f"preview:{key}").json()["rms"]
    assert preview == pytest.approx(after, rel=1e-6) and said["findings"][0]["rms_test_after"] == pytest.approx(after, rel=1e-12)
    card = own.get("/api/view", sha=own.sha).json()["sections"]["verdict"]["html"]
    assert f"to {level(after)}" in "".join(Elements(card).texts)
    own.post("/api/add", sha=own.sha, finding=0)
    state = own.wait()
    assert own.get("/api/window", sha=state["sha"], part="test", joint=0).json()["rms"] == preview
    falls = own.get("/api/view", sha=state["sha"]).json()["falls"]
    assert [f["to"] for f in falls if f["joint"] == EVIL] == [preview]
    own.post("/api/undo", sha=state["sha"])


def test_every_error_says_of_which_rows_and_which_band(shown):
    _, run, own, terminal = shown
    said = json.loads((run / "diagnosis.json").read_text())
    assert said["band"] == json.loads((run / "fit.json").read_text())["band"] == "torque as logged"
    assert terminal.count("over the rows that count, torque as logged") == 2
    page = own.get("/api/view", sha=own.sha).json()["sections"]
    assert "over the rows that count, torque as logged" in " ".join(page["verdict"]["html"].split())
    window = own.get("/api/window", sha=own.sha, part="test", joint=0).json()
    assert window["band"] == "torque as logged"
    # what is under a low-pass says so
    assert "low-passed" in own.get("/api/figure", sha=own.sha, id="time0").text


@pytest.mark.parametrize(("keys", "words"), [
    ({"torque": "raw"}, "torque as logged"), ({"torque": "same"}, "torque through the filter of the angles"),
    ({"torque": "low-pass", "cutoff": 12.5}, "torque under a low-pass of 12.5 Hz"),
    ({"torque": "same", "filter": "none"}, "torque as logged"),
])  # fmt: skip
def test_the_band_in_words(keys, words):
    from sysid.filters import torque_band
    from sysid.specs import PreprocessSpec

    assert torque_band(PreprocessSpec(**keys)) == words
