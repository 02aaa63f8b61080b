"""The report: one file that needs nothing else, says what the diagnosis says, and shows every name as text."""

import copy
import html
import json
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import plotly.graph_objects as go
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sysid import pipeline, regressor, results, robot, robot_spec
from sysid.diagnose.diagnosis import diagnose
from sysid.report import charts, page, residual_charts, solids, torque_chart
from sysid.report.decimate import broken, kept
from sysid.report.sections import sections
from sysid.report.words import quantity
from sysid.statement.document import document
from tests.conftest import CONFIG, URDF, csv, dump, motion, put

EVIL = "<script>alert(1)</script>"
LOG = "<b>train&amp;.csv"
NAMES = (EVIL, "elbow")
ORDER = ["verdict", "torque", "steps", "failures", "suspects", "detectable", "parameters", "bodies", "provenance"]


def written(folder, hidden: float):
    """An experiment whose first joint has a name that looks like markup, and a friction that the model may lack."""
    folder.mkdir()
    (folder / "robot.urdf").write_text(URDF.replace('"shoulder"', f'"{html.escape(EVIL)}"'))
    rotor = {**CONFIG["robot"]["rotors"][0], "joint": EVIL}
    machine = robot.load(robot_spec.RobotSpec(urdf=str(folder / "robot.urdf"), rotors=[robot_spec.RotorSpec.model_validate(rotor)]))
    for name, seed in ((LOG, 0), ("test.csv", 1)):
        rng, t = np.random.default_rng(seed), np.arange(0, 8.0, 0.005)
        q, qd, qdd = motion(t, seed)
        tau = regressor.torque(machine, 1.2 * machine.prior, q, qd, qdd) + machine.damping * qd + machine.friction * np.sign(qd)
        tau[:, 0] += hidden * np.exp(-((qd[:, 0] / 1.0) ** 2)) * np.sign(qd[:, 0])
        tau += rng.normal(0.0, 0.05, q.shape)
        columns = {"t": t} | {f"q_{joint}": q[:, k] for k, joint in enumerate(NAMES)} | {f"tau_{joint}": tau[:, k] for k, joint in enumerate(NAMES)}
        (folder / name).write_text(csv(columns))
    (folder / "config.yaml").write_text("# </pre><script>alert(4)</script>\n" + dump(put(CONFIG, {"robot.rotors": [rotor], "data.train": [LOG]})))
    return folder


def examined(folder):
    found = diagnose(pipeline.load(folder))
    return found, document(found, "run")


@pytest.fixture(scope="module")
def missing(tmp_path_factory):
    return examined(written(tmp_path_factory.mktemp("report") / "missing", 1.5))


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    return examined(written(tmp_path_factory.mktemp("report") / "clean", 0.0))


@pytest.fixture(scope="module")
def text(missing):
    found, said = missing
    return page.page("an <u>experiment</u>", sections(found.fit, said, []))


class Elements(HTMLParser):
    """Every element of a page with its attributes, and the texts outside scripts and styles."""

    def __init__(self, source):
        super().__init__()
        self.found, self.texts, self._raw = [], [], False
        self.feed(source)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        self._raw = tag in ("script", "style")

    def handle_endtag(self, tag):
        if tag in ("script", "style"):
            self._raw = False

    def handle_data(self, data):
        if not self._raw:
            self.texts.append(data)


def test_page_needs_nothing_else(text):
    found = Elements(text).found
    for tag, attributes in found:
        for name in ("src", "href", "action", "data", "poster", "srcset"):
            assert attributes.get(name, "#").startswith(("#", "data:,")), (tag, attributes)
        assert not any(name.startswith("on") for name in attributes), (tag, attributes)
        assert tag not in ("iframe", "object", "embed", "base", "form"), tag
    (policy,) = [a["content"] for tag, a in found if tag == "meta" and a.get("http-equiv") == "Content-Security-Policy"]
    assert "default-src 'none'" in policy and "http" not in policy and "connect-src" not in policy
    assert "url(" not in text[text.index("<style>") : text.index("</style>")]
    assert len(text.encode()) < 8e6


def parse_errors(source: str) -> list:
    """What the standard's parser finds wrong in a page, scripts' texts left out."""
    import tinyhtml5.parser

    parser = tinyhtml5.parser.HTMLParser()
    parser.parse(re.sub(r"(<script[^>]*>).*?(?=</script>)", r"\1", source, flags=re.S))
    return parser.errors


@pytest.mark.long
def test_page_parses_without_error(text, missing, clean):
    assert not parse_errors(text) and parse_errors(text.replace("</table>", "</p>", 1))
    for found, said in (missing, clean, tied(missing)):
        made = sections(found.fit, said, [])
        assert not parse_errors(page.page("x", made))
        names = [a["id"] for _, a in Elements(page.page("x", made)).found if "id" in a]
        assert len(names) == len(set(names))


def test_policy_allows_the_two_scripts_as_they_stand(text):
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    engine = re.search(r'<script type="text/plain" id="plotly">(.*?)</script>', text, re.S)[1]
    own = re.findall(r"<script>(.*?)</script>", text, re.S)
    assert len(own) == 1
    for script in (engine, own[0]):
        assert page._hash(script) in policy


def test_sections_stand_in_order_words_before_the_engine(text):
    assert re.findall(r'<section id="(\w+)"', text) == ORDER
    assert text.index('id="provenance"') < text.index('<script type="application/json"') < text.index('id="plotly"')


def test_names_show_as_text(text, missing):
    _, said = missing
    elements = Elements(text)
    assert not any(tag in ("b", "u", "img") for tag, _ in elements.found)
    assert sum(tag == "script" for tag, _ in elements.found) == 2 + len(re.findall(r'id="figure-\w+"', text))
    shown = "".join(elements.texts)
    for name in (EVIL, LOG, "an <u>experiment</u>", "</pre><script>alert(4)</script>"):
        assert name in shown
    assert said["verdict"][0]["joint"] == EVIL
    for figure in re.findall(r'<script type="application/json" id="figure-\w+">(.*?)</script>', text, re.S):
        assert not set("<>&") & set(figure)
        # plotly reads markup in its texts: there too a name stands escaped
        assert EVIL not in json.dumps(json.loads(figure)["figure"])


@pytest.mark.parametrize(("variable", "words"), [
    ("qd_hip", "speed of hip"), ("q_rail", "position of rail"), ("q_hip", "angle of hip"), ("load_rail", "load of rail"),
    ("time", "time"), ("a steady tone", "a steady tone"), ("several variables together", "several variables together"),
    ("q_nothing", "q_nothing"),
])  # fmt: skip
def test_variables_are_said_in_words(variable, words):
    fit = SimpleNamespace(joints=("hip", "rail"), model=SimpleNamespace(robot=SimpleNamespace(prismatic=(False, True))))
    assert quantity(variable, fit) == words


def test_every_chart_has_its_place_and_every_axis_its_quantity(missing):
    found, said = missing
    made = sections(found.fit, said, [])
    assert list(made) == ORDER
    names = []
    for section in made.values():
        assert re.findall(r'data-chart="(\w+)"', section["html"]) == [c["id"] for c in section["charts"]]
        for chart in section["charts"]:
            names.append(chart["id"])
            figure = go.Figure(chart["figure"], skip_invalid=False)  # raises where plotly knows no such key
            json.dumps(chart, allow_nan=False)
            layout = chart["figure"]["layout"]
            axes = [axis for key, axis in layout.items() if re.fullmatch(r"[xy]axis\d*", key)] + [axis for key, axis in layout.get("scene", {}).items() if key.endswith("axis")]
            assert axes and figure.data
            for axis in axes:
                assert axis.get("type") == "category" or axis["title"]["text"] == "step" or re.search(r"\[.+\]$", axis["title"]["text"]), chart["id"]
    assert len(set(names)) == len(names)


def test_verdict_and_suspects_say_what_the_diagnosis_says(text, missing):
    _, said = missing
    shown = " ".join("".join(Elements(text).texts).split())
    verdict = said["verdict"][0]
    assert verdict["status"] == "missing" and f"{verdict['effect']} is missing" in shown
    head = said["findings"][0]
    assert f"{100 * head['misfit_removed']:.0f} ± {100 * head['misfit_removed_se']:.0f} %" in shown
    # the folder says it as well as the file in it
    assert head["command"] == f"sysid add {missing[0].fit.experiment.folder} {verdict['effect']} --joint '{EVIL}'"
    assert shown.count(head["command"]) == 2  # in the card and beside the suspect
    assert f"{100 * head['probability']:.0f}" in shown
    assert said["detectable"] and said["absorbed"]
    for entry in said["absorbed"]:
        assert entry["separate_by"] in shown
    for log in said["logs"]:
        assert log["sha256"] in shown


def tied(missing):
    """The diagnosis and its document, were backlash tied with what is missing, and an effect that was not fitted as well."""
    found, said = missing
    (claim,) = found.claims
    pair = replace(
        claim, findings=(claim.head, claim.head),
        set=((claim.head.effect, EVIL, 0.6), ("backlash", EVIL, 0.3), ("gravity_tilt", "*", 0.1)),
    )  # fmt: skip
    every = [{"effect": e, "joint": j, "probability": p} for e, j, p in pair.set]
    first = {**said["findings"][0], "tied_with": ["backlash", "gravity_tilt on *"], "probability": 0.6}
    other = {**first, "effect": "backlash", "joins_as_step": None, "probability": 0.3, "command": "sysid add x backlash"}
    return replace(found, claims=(pair,)), {**said, "findings": [first, other], "claims": [{**said["claims"][0], "findings": [0, 1], "set": every}]}


def test_ties_stand_in_one_bracket(missing):
    twice, told = tied(missing)
    made = sections(twice.fit, told, [])
    (bracket,) = re.findall(r'<tbody class="tied">(.*?)</tbody>', made["suspects"]["html"], re.S)
    assert "cannot tell them apart" in bracket and "backlash" in bracket and bracket.count("<svg") == 2
    assert "Not fitted here: gravity_tilt of the whole robot" in bracket
    card = "".join(Elements(made["verdict"]["html"]).texts)
    assert "cannot tell it" in card and "backlash\u00a0(30\u00a0%) or gravity_tilt of the whole robot\u00a0(10\u00a0%)" in card


def judged(said, **more):
    """The document with another verdict on the first joint."""
    return {**said, "verdict": [{"joint": EVIL, **more}, *said["verdict"][1:]]}


LEFT = {"depends_on": [{"variable": f"qd_{EVIL}", "share": 0.3}, {"variable": "time", "share": 0.1}], "share_left": 0.4}


@pytest.mark.parametrize("more, words", [
    ({"status": "complete"}, "No further effect is supported by these logs."),
    ({"status": "explained", "by": [{"effect": "joint_coupling", "joint": "elbow"}], "explained": 0.93}, "joint_coupling on elbow. With all that is named 93\u00a0% of the misfit is explained"),
    ({"status": "unresolved", "says": "its noise floor is not known (<b>why</b>)"}, "Its noise floor is not known (<b>why</b>)."),
    ({"status": "unresolved", "says": "so it is", **LEFT}, f"The motion predicts 40\u00a0% of what is left (the speed of {EVIL} alone 30\u00a0%, time alone 10\u00a0%)."),
    ({"status": "unknown", "also": [], **LEFT}, "No effect of the catalogue explains what is left. The motion predicts 40\u00a0% of what is left"),
])  # fmt: skip
def test_every_status_has_its_card(clean, more, words):
    found, said = clean
    made = sections(found.fit, judged(said, **more), [])
    cards = re.findall(r'<article class="card (\w+)[ \w]*">(.*?)</article>', made["verdict"]["html"], re.S)
    assert cards[0][0] == more["status"] and words in "".join(Elements(cards[0][1]).texts)
    assert ("What the residual of" in made["detectable"]["html"]) == ("depends_on" in more)


def test_a_floor_that_is_not_known_is_said_so(missing):
    found, said = missing
    said = copy.deepcopy(said)
    for entry in said["joints"].values():
        entry.update(noise_floor=None, noise_floor_se=None, floor_detail="not determined: it is <i>too</i> short")
    made = sections(found.fit, said, [])
    card, steps = ("".join(Elements(made[name]["html"]).texts) for name in ("verdict", "steps"))
    assert "noise floor not known" in card and "of the misfit is explained" not in card  # a share of what nobody knows
    assert "not known" in steps and "it is <i>too</i> short" in steps
    assert levels(made["steps"], "noise floor")[charts.plain(EVIL)] is None


def test_events_are_listed_and_shaded_where_their_log_stands(missing):
    found, said = missing
    events = [
        {"kind": "knock", "log": LOG, "start": 2.0, "stop": 2.2, "joints": [EVIL, "elbow"]},
        {"kind": "spike", "log": "test.csv", "start": 3.0, "stop": 3.0, "joints": ["elbow"]},
        {"kind": "spike", "log": "another.csv", "start": 3.0, "stop": 3.0, "joints": ["elbow"]},
    ]  # fmt: skip
    made = sections(found.fit, {**said, "events": events}, [])["torque"]
    assert "1 knock, 2 torque spikes in these logs" in made["html"]
    shaded = [[(s["x0"], s["x1"]) for s in c["figure"]["layout"]["shapes"] if s["fillcolor"] == charts.ORANGE] for c in made["charts"]]
    line = charts.timeline({part: (p.log, p.t, [part]) for part, p in found.fit.predictions.items()})
    (begin, _, _), first = line["test"]["spans"][0], line["test"]["starts"][0]
    assert [len(s) for s in shaded] == [1, 2]
    (low, high), (spike, end) = shaded[1]
    assert low == pytest.approx(2.0 - line["train"]["starts"][0], abs=1e-3) and high - low == pytest.approx(0.2, abs=1e-3)
    assert (spike + end) / 2 == pytest.approx(begin + 3.0 - first, abs=1e-3) and end > spike  # wide enough to be seen


def test_spans_that_touch_are_one():
    found = charts.joined([(5.0, 6.0), (1.0, 1.0), (1.05, 1.05)], 0.2)
    np.testing.assert_allclose(found, [(0.9, 1.15), (5.0, 6.0)])


def levels(section, trace: str) -> dict:
    """{joint: y} of one trace of the staircases."""
    return {c["figure"]["layout"]["title"]["text"]: next((t["y"] for t in c["figure"]["data"] if t.get("name") == trace), None) for c in section["charts"] if "title" in c["figure"]["layout"]}


def test_staircase_is_the_history(missing):
    found, said = missing
    now = {joint: entry["rms"]["test"] for joint, entry in said["joints"].items()}
    history = [
        {"added": None, "joint": None, "rms_test": now, "rms_train": now, "folder": "steps/00-start"},
        {"added": "stribeck", "joint": EVIL, "rms_test": {EVIL: 0.06, "elbow": 0.05}, "rms_train": now, "folder": "steps/01"},
        {"added": "spring", "joint": "*", "rms_test": {EVIL: 0.055, "elbow": None}, "rms_train": now, "folder": "steps/02"},
    ]  # fmt: skip
    section = sections(found.fit, said, history)["steps"]
    made = levels(section, "held-out error")
    assert made[charts.plain(EVIL)] == [now[EVIL], 0.06, 0.055] and made["elbow"] == [now["elbow"], 0.05, None]
    assert levels(section, "expected by the diagnosis")["elbow"] is None
    floor = levels(section, "noise floor")["elbow"]
    np.testing.assert_allclose(floor, said["joints"]["elbow"]["noise_floor"], rtol=1e-4)


def test_staircase_without_history_is_what_the_diagnosis_expects(missing):
    found, said = missing
    section = sections(found.fit, said, [])["steps"]
    assert "No step was made yet" in section["html"]
    expected = levels(section, "expected by the diagnosis")[charts.plain(EVIL)]
    heads = [f for f in said["findings"] if f["joins_as_step"]]
    assert expected[0] == said["joints"][EVIL]["rms"]["test"] and expected[1] == pytest.approx(heads[0]["rms_test_after"]) and expected[1] < expected[0]


def test_nothing_missing_is_said_plainly(clean):
    found, said = clean
    assert all(v["status"] == "complete" for v in said["verdict"])
    made = sections(found.fit, said, [])
    assert "on all 2 joints" in made["verdict"]["html"] and "there is nothing to add" in made["suspects"]["html"]
    assert "names no effect to add" in made["steps"]["html"]


def test_numbers_that_are_not_there(clean):
    """Without standard errors, with empty maps, a floor of zero and NaN in the residual, the page is written all the same."""
    found, said = clean
    said = copy.deepcopy(said)
    for entry in said["joints"].values():
        entry.update(noise_floor_se=None, noise_floor=0.0)
    for entry in said["fails_where"]:
        entry["map"]["mean"] = [[None] * len(row) for row in entry["map"]["mean"]]
        entry["time"] = {"log": [], "start": [], "rms": []}
        entry["words"] = []
    said["detectable"] = said["absorbed"] = []
    fit = copy.copy(found.fit)
    prediction = copy.copy(fit.predictions["test"])
    measured = np.array(prediction.measured)
    measured[:100] = np.nan
    object.__setattr__(prediction, "measured", measured)
    object.__setattr__(fit, "predictions", {**fit.predictions, "test": prediction})
    made = sections(fit, said, [{"added": None, "joint": None, "rms_test": {EVIL: float("nan")}}])
    source = page.page("x", made)
    assert not re.search(r"\bnan\b|\bNone\b|Infinity", "".join(Elements(source).texts))
    for section in made.values():
        for chart in section["charts"]:
            json.dumps(chart, allow_nan=False)


@settings(max_examples=60, deadline=None)
@given(arrays(float, st.integers(1, 3000), elements=st.floats(-1e6, 1e6) | st.just(float("nan"))), st.integers(4, 300))
def test_thinning_keeps_every_peak(y, most):
    index = kept(y, most)
    assert len(index) <= max(most, 4) or len(y) <= most
    assert (np.diff(index) > 0).all() and index[0] == 0 and index[-1] == len(y) - 1
    if np.isfinite(y).any():
        assert np.nanmax(y[index]) == np.nanmax(y) and np.nanmin(y[index]) == np.nanmin(y)
    buckets = max((most - 2) // 2, 1)
    size = -(-len(y) // buckets)
    for a in range(0, len(y), size):
        own = y[a : a + size]
        there = y[index[(index >= a) & (index < a + size)]]
        if np.isfinite(own).any():
            assert np.nanmax(there) == np.nanmax(own) and np.nanmin(there) == np.nanmin(own)


def test_no_line_is_drawn_across_a_gap():
    t = np.append(np.arange(5.0), np.arange(100.0, 105.0))
    at, y = broken(t, np.ones(10), [5])
    assert np.isnan(at[5]) and np.isnan(y[5]) and len(at) == 11
    line = charts.timeline({"train": (np.repeat([0, 1], 5), np.tile(np.arange(5.0), 2), ["a", "b"]), "test": (np.zeros(10), t, ["c"])})
    assert [span[2] for span in line["train"]["spans"]] == ["a", "b"] and (np.diff(line["train"]["t"]) > 0).all()
    assert line["test"]["breaks"].tolist() == [5] and line["test"]["t"][0] > line["train"]["t"][-1]


def test_forty_joints_still_fit():
    rng = np.random.default_rng(0)
    t = np.arange(100_000) / 1000.0
    line = charts.timeline({"train": (np.zeros(len(t)), t, ["a"]), "test": (np.zeros(len(t)), t, ["b"])})
    noise = rng.normal(size=len(t))
    one = torque_chart.torque("torque0", "x", "N m", line, {"train": (noise,) * 3, "test": (noise,) * 3}, 40)
    assert 40 * len(page.embedded(one["figure"])) < 2.6e6


def test_ellipsoid_has_the_body_s_inertia(missing):
    """The uniform ellipsoid's second moments m a^2 / 5 give back the rotational inertia about the centre of mass."""
    from sysid.inertia import pseudo

    found, _ = missing
    machine = found.fit.model.robot
    placed = solids.frames(machine, np.zeros(machine.dof))
    for body, pi, solid in zip(machine.bodies, found.fit.pi, solids.solids(machine, found.fit.pi, placed)):
        mass, com, inertia = pseudo.to_central(pi)
        turned = placed[body.row].rotation @ inertia @ placed[body.row].rotation.T
        spread = solid.directions @ np.diag(mass * solid.axes**2 / 5) @ solid.directions.T
        np.testing.assert_allclose(np.trace(spread) * np.eye(3) - spread, turned, atol=1e-9)
        np.testing.assert_allclose(solid.centre, placed[body.row].act(com), atol=1e-12)
        points, _ = solid.surface()
        np.testing.assert_allclose((((points - solid.centre) @ solid.directions / solid.axes) ** 2).sum(1), 1.0, atol=1e-6)
    impossible = solids.solids(machine, -found.fit.pi, placed)
    assert impossible == [None] * len(machine.bodies)


def test_sliding_joints_have_newtons_and_metres(missing):
    found, said = missing
    slides = residual_charts.residual_map("m", "x", "N", "m", said["fails_where"][0]["map"])["figure"]["layout"]
    assert slides["xaxis"]["title"]["text"] == "position q [m]" and slides["yaxis"]["title"]["text"] == "speed qd [m/s]"
    assert torque_chart.torque("t", "x", "N", {}, {}, 1)["figure"]["layout"]["yaxis"]["title"]["text"] == "force [N]"


def test_command_writes_the_page(clean, tmp_path, monkeypatch, capsys):
    """The command, with the diagnosis at hand."""
    from sysid import cli
    from sysid.statement import kept

    found, _ = clean
    monkeypatch.setattr(kept, "diagnose", lambda spec, progress=None: found)
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(sys, "argv", ["sysid", "report", str(found.fit.experiment.folder), "--out", str(tmp_path / "run"), "--json", "--open"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    said = json.loads(capsys.readouterr().out)
    path = tmp_path / "run" / "report.html"
    assert opened == [path.as_uri()]
    assert stop.value.code in (0, None) and said["report"] == str(path) and said["bytes"] == path.stat().st_size
    assert (tmp_path / "run" / "diagnosis.json").is_file() and (tmp_path / "run" / "fit.json").is_file()


def test_a_diagnosis_of_another_fit_does_not_stay(clean, tmp_path):
    fit, run = clean[0].fit, tmp_path / "run"
    results.write(fit, run)
    (run / "diagnosis.json").write_text("{}")
    results.write(fit, run)  # the same fit again
    assert (run / "diagnosis.json").is_file()
    results.write(replace(fit, x=fit.x * 1.01), run)
    assert not (run / "diagnosis.json").exists()


@given(arrays(float, st.integers(1, 40), elements=st.floats(allow_nan=True, allow_infinity=True, width=64)), st.integers(2, 8))
@settings(max_examples=200, deadline=None)
def test_rounded_numbers_are_what_a_format_makes_of_them(values, digits):
    for value, said in zip(values.tolist(), charts.rounded(values, digits)):
        if not np.isfinite(value):
            assert said is None
            continue
        wanted = float(f"{value:.{digits}g}")
        # a value half way between two may go to either
        assert said == wanted or abs(said - value) <= abs(wanted - value) * (1 + 1e-9)
        assert said == float(f"{said:.{digits}g}")
