"""The studio: what the page's requests do to the experiment file, and who may make them."""

import copy
import html
import json
import math
import shutil
import socket
import subprocess
import sys
import threading
import time
import types
from dataclasses import replace

import anyio
import httpx
import numpy as np
import pytest

from sysid import loop
from sysid.diagnose.diagnosis import diagnose
from sysid.errors import SysidError
from sysid.statement.document import document
from sysid.studio import cache, history, page, security
from sysid.studio.app import application
from sysid.studio.diagnosed import Diagnosed
from sysid.studio.experiments import Experiments, beside
from sysid.studio.history import History, hashed
from sysid.studio.jobs import Cancelled, Job, Worker
from sysid.studio.rows import same_rows
from sysid.studio.serve import serve
from sysid.studio.session import Session
from sysid.studio.turn import Turn
from sysid.studio.workspace import Workspace
from sysid.vocabulary import vocabulary
from tests.test_report import EVIL, Elements, parse_errors, written

PORT, CSRF = 8765, "of-this-start"
HOME = f"http://127.0.0.1:{PORT}"


def rippled(folder):
    """An arm whose first joint has a name that looks like markup, and a ripple over its angle that its model lacks."""
    written(folder, 0.0)
    for file in folder.glob("*.csv"):
        head, *rows = file.read_text().splitlines()
        q, tau = (head.split(",").index(f"{column}_{EVIL}") for column in ("q", "tau"))
        rows = [row.split(",") for row in rows]
        for row in rows:
            # three periods: one and a half are as well a polynomial of the angle, which is another effect
            row[tau] = repr(float(row[tau]) + 0.5 * math.sin(12.0 * float(row[q])))
        file.write_text("\n".join([head, *(",".join(row) for row in rows)]) + "\n")
    return folder


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The folder of that arm, and what is found on it."""
    folder = rippled(tmp_path_factory.mktemp("studio") / "arm")
    experiment = loop.pipeline.load(folder)
    found = diagnose(experiment)
    return folder, Diagnosed(hashed((folder / "config.yaml").read_text()), found.fit, json.loads(json.dumps(document(found))))


def told(session, job, text, view):
    """What a job finds, from a diagnosis made before."""
    own = copy.copy(view)
    own.sha, own._charts, own.fit = hashed(text), dict(view._charts), replace(view.fit, experiment=session.history.experiment(text))
    own.workspace = Workspace(own.fit)
    job.tell("compress", 0.5)
    session.keep(cache.key(hashed(text), session.history.experiment(text)), text, own)


@pytest.fixture
def opened(arm, tmp_path, monkeypatch):
    """A studio on a copy of the folder whose jobs are done at once: (session, client, post, file)."""
    folder = shutil.copytree(arm[0], tmp_path / "arm")
    monkeypatch.setattr(Session, "_work", lambda self, job, text: told(self, job, text, arm[1]))
    return studio(folder, tmp_path / "run")


class TestClient:
    """Requests to an application, each in an event loop of its own, so that threads may make them; cookies are kept."""

    __test__ = False

    def __init__(self, app, base_url=HOME):
        self.app, self.base_url, self.cookies = app, base_url, httpx.Cookies()

    def request(self, method, path, follow_redirects=True, **more):
        async def ask():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(self.app), base_url=self.base_url, cookies=self.cookies, follow_redirects=follow_redirects) as client:
                answer = await client.request(method, path, **more)
                self.cookies.update(client.cookies)
                return answer

        return anyio.run(ask)

    def __getattr__(self, method):
        return lambda path, **more: self.request(method.upper(), path, **more)


class studio:
    def __init__(self, folder, run, *, begin=True, **more):
        self.file, self.run = folder / "config.yaml", run
        self.session = Session(folder, run)
        self.client = TestClient(application(self.session, port=PORT, csrf=CSRF, **more), base_url=HOME)
        if begin:
            self.session.run()
            self.wait()

    def get(self, path, **words):
        return self.client.get(path, params=words)

    def post(self, path, headers=(), **body):
        return self.client.post(path, json=body, headers={"x-sysid-csrf": CSRF, **dict(headers)})

    @property
    def sha(self):
        return self.get("/api/state").json()["sha"]

    def wait(self, seconds=60.0):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            state = self.get("/api/state").json()
            if state["job"] is None or state["job"]["state"] not in ("running", "cancelling"):
                return state
            time.sleep(0.02)
        raise AssertionError("the job does not end")


# ---- the way a user goes


@pytest.mark.long
def test_add_for_real_error_falls_and_undo_is_at_hand(arm, tmp_path):
    folder = shutil.copytree(arm[0], tmp_path / "arm")
    before = (folder / "config.yaml").read_bytes()
    own = studio(folder, tmp_path / "run")
    state = own.wait()
    assert state["job"]["state"] == "done" and state["ready"]
    first = own.get("/api/view", sha=state["sha"]).json()
    assert first["offered"][0] == {"finding": 0, "step": 1, "effect": "cogging", "joint": EVIL}
    added = own.post("/api/add", sha=state["sha"], finding=0).json()
    assert added["sha"] != state["sha"] and added["undo"] == f"cogging on {EVIL}"
    assert b"cogging" in own.file.read_bytes() and b"alert(4)" in own.file.read_bytes()
    assert own.wait()["ready"]
    second = own.get("/api/view", sha=added["sha"]).json()
    assert "missing" not in [v["status"] for v in second["verdict"]] and second["steps"] == ["start", f"+ cogging on {EVIL}"]
    found = own.get("/api/compare", **{"from": 0, "to": 1}).json()["joints"][0]
    assert found["delta"] < -0.1 and found["se"] < -0.2 * found["delta"]
    steps = loop.read_history(own.run)
    assert [s["added"] for s in steps] == [None, "cogging"] and steps[1]["rms_test"][EVIL] < steps[0]["rms_test"][EVIL]
    start = time.monotonic()
    state = own.post("/api/undo", sha=added["sha"]).json()
    assert state["ready"] and own.file.read_bytes() == before
    assert own.get("/api/view", sha=state["sha"]).json()["steps"] == ["start"]
    assert time.monotonic() - start < 1.0
    assert (own.run / "fit.json").is_file() and (own.run / "diagnosis.json").is_file()


@pytest.mark.long
def test_all_steps_that_are_named_are_one_change(arm, tmp_path):
    folder = shutil.copytree(arm[0], tmp_path / "arm")
    before = (folder / "config.yaml").read_bytes()
    own = studio(folder, tmp_path / "run")
    state = own.wait()
    view = own.session.diagnosed(state["sha"])
    named = [view.said["findings"][k]["effect"] for _, k in view.offered()]
    added = own.post("/api/add", sha=state["sha"], steps=True).json()
    model = own.session.history.experiment(own.file.read_text()).model
    assert named and set(named) <= {e.name for e in model.effects} and added["undo"] == ", ".join(named)
    state = own.post("/api/undo", sha=added["sha"]).json()
    assert own.file.read_bytes() == before and own.wait()
    # of what is complete nothing is named
    view.offered = list
    assert "no step to add" in own.post("/api/add", sha=state["sha"], steps=True).json()["error"]


def test_charts_are_answered_before_the_diagnosis(arm, tmp_path, monkeypatch):
    """A fit can be looked at from all sides while its diagnosis is at work."""
    begun, go_on = threading.Event(), threading.Event()
    from sysid.studio import session

    def waiting(*args, **more):
        begun.set()
        assert go_on.wait(60.0)
        return diagnose(*args, **more)

    monkeypatch.setattr(session, "diagnose", waiting)
    folder = shutil.copytree(arm[0], tmp_path / "arm")
    client_of = Session(folder, tmp_path / "run")
    client = TestClient(application(client_of, port=PORT, csrf=CSRF), base_url=HOME)
    client_of.run()
    assert begun.wait(60.0)
    client_of.state()
    state = client.get("/api/state").json()
    assert state["fitted"] and not state["ready"] and state["job"]["state"] == "running"
    page = client.get("/api/fitted", params={"sha": state["sha"]}).json()
    assert [j["name"] for j in page["joints"]] == [EVIL, "elbow"] and page["steps"] == ["start"]
    asked = {"sha": state["sha"], "joint": 0, "part": "test"}
    assert client.get("/api/window", params=asked).json()["joint"] == EVIL
    assert client.get("/api/cloud", params=asked).json()["t"]
    assert client.get("/api/film", params=asked).json()["names"] == [EVIL, "elbow"]
    assert client.get("/export/rows.csv", params=asked).text.startswith("log,t [s],measured")
    assert client.get("/api/window", params={**asked, "part": "both"}).status_code == 422
    assert client.get("/api/window", params={**asked, "beside": "step:5"}).status_code == 422
    assert {"cogging", "payload"} <= {e["effect"] for e in page["vocabulary"]} and "suspects" in page["order"]
    go_on.set()


@pytest.mark.long
def test_a_preview_does_not_wait_for_the_end_of_the_diagnosis(arm, tmp_path, monkeypatch):
    begun, seen, told = threading.Event(), threading.Event(), []
    from sysid.studio import session

    def asking(*args, progress, **more):
        begun.set()
        for k in range(3000):
            progress("ask, with delay on elbow", k / 3000)
            if seen.wait(0.02):
                break
        told.append(k)
        return diagnose(*args, progress=progress, **more)

    monkeypatch.setattr(session, "diagnose", asking)
    own = studio(shutil.copytree(arm[0], tmp_path / "arm"), tmp_path / "run", begin=False)
    own.session.run()
    assert begun.wait(60.0)
    key = previewed(own, effect="cogging", joint=EVIL, options={"lines": "2"})
    state = own.session.state()
    assert state["job"]["state"] == "running" and state["job"]["found"] == ["delay on elbow"] and not state["ready"]
    shown = own.get("/api/window", sha=own.sha, joint=0, part="test", shown=f"preview:{key}", beside="now").json()
    assert shown["rms"] < shown["beside"]
    seen.set()
    assert own.wait()["ready"] and told[0] < 2999


def test_undo_and_redo_are_found_again_after_a_restart(opened, tmp_path):
    before = opened.file.read_text()
    sha = opened.post("/api/add", sha=opened.sha, effect="stribeck", joint="elbow").json()["sha"]
    opened.wait()
    after = opened.file.read_text()
    sha = opened.post("/api/undo", sha=sha).json()["sha"]
    again = studio(opened.file.parent, opened.run)
    state = again.wait()
    assert state["sha"] == sha and state["undo"] is None and state["redo"] == "stribeck on elbow"
    sha = again.post("/api/redo", sha=sha).json()["sha"]
    assert again.file.read_text() == after
    assert [step["added"] for step in loop.read_history(opened.run)] == [None, "stribeck"]
    again = studio(opened.file.parent, opened.run)
    assert again.get("/api/view", sha=again.sha).json()["steps"] == ["start", "+ stribeck on elbow"]
    again.post("/api/undo", sha=sha)
    assert again.file.read_text() == before and [step["added"] for step in loop.read_history(opened.run)] == [None]


def test_two_studios_on_one_experiment_share_its_steps(opened):
    other = studio(opened.file.parent, opened.run)
    sha = opened.post("/api/add", sha=opened.sha, effect="stribeck", joint="elbow").json()["sha"]
    opened.wait()
    assert other.sha == sha and other.get("/api/state").json()["undo"] == "stribeck on elbow"
    sha = other.post("/api/add", sha=sha, formula="a*sin(3*q)", joint="elbow").json()["sha"]
    other.wait()
    assert opened.get("/api/state").json()["undo"] == "a*sin(3*q) on elbow"
    sha = opened.post("/api/undo", sha=sha).json()["sha"]
    assert other.get("/api/state").json()["redo"] == "a*sin(3*q) on elbow" and other.sha == sha


def test_an_undo_that_was_spoilt_begins_anew(opened):
    (opened.run / "studio" / "undo.json").write_text('{"items": [{}], "at": 7}')
    again = studio(opened.file.parent, opened.run)
    assert again.wait()["ready"] and again.get("/api/state").json()["undo"] is None


# ---- two tabs, an editor


def test_what_was_thought_for_another_text_is_refused(opened):
    seen = opened.sha
    assert opened.post("/api/add", sha=seen, effect="stribeck", joint="elbow").status_code == 200
    text = opened.file.read_text()
    for path, body in (("add", {"finding": 0}), ("add", {"effect": "armature", "joint": "elbow"}), ("add", {"formula": "a*q"}), ("undo", {}), ("redo", {}), ("run", {})):
        answer = opened.post(f"/api/{path}", sha=seen, **body)
        assert answer.status_code == 409 and answer.json()["changed"] and "reload" in answer.json()["error"]
    assert opened.file.read_text() == text


def test_an_edit_elsewhere_is_noticed_and_can_be_taken_back(opened):
    seen, before = opened.sha, opened.file.read_text()
    opened.file.write_text(before + "# by hand\n")
    assert opened.post("/api/add", sha=seen, finding=0).status_code == 409
    state = opened.get("/api/state").json()
    assert state["sha"] != seen and state["undo"] == "edit by hand" and not state["ready"]
    opened.post("/api/undo", sha=state["sha"])
    assert opened.file.read_text() == before
    state = opened.get("/api/state").json()
    opened.post("/api/redo", sha=state["sha"])
    assert opened.file.read_text().endswith("# by hand\n")


def test_a_log_that_changed_makes_the_results_stale(opened):
    assert opened.get("/api/state").json()["ready"]
    log = opened.file.parent / "test.csv"
    log.write_text(log.read_text() + "\n")
    state = opened.get("/api/state").json()
    assert not state["ready"] and state["sha"] == opened.sha
    assert opened.post("/api/run", sha=state["sha"]).json()["job"]["number"] == 2 and opened.wait()["ready"]


def test_many_tabs_at_once_make_one_change(opened):
    seen, answers = opened.sha, []
    work = lambda k: answers.append(opened.post("/api/add", sha=seen, formula=f"a*sin({k}*q)", joint="elbow").status_code)  # noqa: E731
    threads = [threading.Thread(target=work, args=(k,)) for k in range(2, 8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(answers) == [200] + [409] * 5
    assert opened.file.read_text().count("sin(") == 1
    opened.session.history.experiment(opened.file.read_text())


# ---- what is refused, with the file as it was


@pytest.mark.parametrize(
    "body, words",
    [
        ({"formula": "import os", "joint": "elbow"}, "formula"), ({"formula": "__import__('os')", "joint": "elbow"}, ""), ({"formula": " "}, "no formula"), ({"formula": "a*q", "joint": "nowhere"}, "nowhere"),
        ({"formula": "a*q: [", "joint": "elbow"}, ""), ({"effect": "../../etc/passwd:Thing", "joint": "elbow"}, "no such effect"), ({"effect": "own.py:Thing"}, "no such effect"),
        ({"effect": "viscous", "joint": "elbow"}, "already"), ({"finding": 99}, "no such suspect"), ({"finding": -1}, "no such suspect"), ({"finding": True}, "number"), ({"finding": "0"}, "number"),
        ({"effect": 3}, "text"), ({}, "effect must be"),
    ],
)  # fmt: skip
def test_bad_additions_say_so_in_one_line(opened, body, words):
    before = opened.file.read_bytes()
    answer = opened.post("/api/add", sha=opened.sha, **body)
    assert answer.status_code == 422 and words in answer.json()["error"] and "\n" not in answer.json()["error"]
    assert opened.file.read_bytes() == before and opened.get("/api/state").json()["undo"] is None


def test_a_law_to_begin_with_goes_into_the_file_as_its_card_has_it(opened):
    law = {"effect": "formula", "joint": "elbow", "options": {"formula": "a*q + b*q**2 + c*q**3", "name": "law_of_q"}}
    answer = opened.post("/api/add", sha=opened.sha, **law)
    assert answer.status_code == 200, answer.text
    (entry,) = [e for e in opened.session.history.experiment(opened.file.read_text()).model.effects if e.name == "formula"]
    assert entry.options == law["options"] and entry.joints == ["elbow"]


def test_a_formula_goes_into_the_file(opened):
    opened.post("/api/add", sha=opened.sha, formula="a*sin(3*q)", joint="elbow")
    (entry,) = [e for e in opened.session.history.experiment(opened.file.read_text()).model.effects if e.name == "formula"]
    assert entry.options["formula"] == "a*sin(3*q)" and entry.joints == ["elbow"]
    assert opened.wait()["undo"] == "a*sin(3*q) on elbow"


def test_an_effect_that_is_no_suspect_goes_into_the_file(opened):
    known = {e["effect"]: e for e in opened.get("/api/view", sha=opened.sha).json()["vocabulary"]}
    assert tuple(known) == vocabulary() and known["payload"]["scope"] == "robot" and all(e["says"] and "`" not in e["says"] for e in known.values())
    opened.post("/api/add", sha=opened.sha, effect="quadratic_drag", joint="elbow")
    opened.wait()
    opened.post("/api/add", sha=opened.sha, effect="gravity_tilt", joint=None)
    opened.wait()
    *_, drag, tilt = opened.session.history.experiment(opened.file.read_text()).model.effects
    assert (drag.name, drag.joints) == ("quadratic_drag", ["elbow"]) and (tilt.name, tilt.joints) == ("gravity_tilt", None)
    said = opened.post("/api/add", sha=opened.sha, effect="quadratic_drag", joint="elbow").json()["error"]
    assert said.startswith("quadratic_drag is in the model already on elbow") and "config.yaml" not in said


def test_the_state_is_answered_while_an_addition_is_checked(opened, monkeypatch):
    built, checked = threading.Event(), threading.Event()
    monkeypatch.setattr(history.pipeline, "build", lambda experiment: (checked.set(), built.wait(10)))
    sha = opened.sha
    thread = threading.Thread(target=lambda: opened.post("/api/add", sha=sha, effect="armature", joint="elbow"))
    thread.start()
    assert checked.wait(10)
    start = time.monotonic()
    assert opened.get("/api/state").json()["sha"] == sha and time.monotonic() - start < 2
    built.set()
    thread.join()
    assert opened.sha != sha


def test_while_it_works_the_state_needs_no_file_and_yet_hears_of_edits(opened, monkeypatch):
    go = threading.Event()
    monkeypatch.setattr(Session, "_work", lambda self, job, text: (job.tell("compress", 0.5), go.wait(20)))
    sha = opened.post("/api/add", sha=opened.sha, effect="armature", joint="elbow").json()["sha"]
    reads, read = [], history.History.text
    monkeypatch.setattr(history.History, "text", lambda self: (reads.append(threading.current_thread()), read(self))[1])
    waiting = []
    found = opened.session.glance(waiting.append)
    assert found["sha"] == sha and found["job"]["state"] == "running" and not reads and len(waiting) == 1
    assert opened.session.glance(waiting.append) == found and len(waiting) == 1  # one look at a time
    waiting[0]()
    opened.file.write_text(opened.file.read_text() + "# by hand\n")
    end = time.monotonic() + 10
    while opened.sha == sha and time.monotonic() < end:
        time.sleep(0.05)
    assert opened.sha != sha and opened.get("/api/state").json()["undo"] == "edit by hand"
    go.set()
    opened.wait()


def test_a_job_that_ends_while_it_is_asked_for_is_not_done_with_nothing_ready(opened, monkeypatch):
    go = threading.Event()
    monkeypatch.setattr(Session, "_work", lambda self, job, text: (job.tell("compress", 0.5), go.wait(20)))
    opened.post("/api/add", sha=opened.sha, effect="armature", joint="elbow")
    assert opened.session.glance(lambda look: None)["job"]["state"] == "running"
    said = Job.document
    monkeypatch.setattr(Job, "document", lambda self: (setattr(self, "state", "done"), said(self))[1])
    assert opened.session.glance(lambda look: None) is None
    go.set()


# ---- several experiments


@pytest.fixture
def experiments(arm, tmp_path, monkeypatch):
    """Two folders with the same experiment file and one file beside them, and requests to the studio on all."""
    for name in ("one", "two"):
        shutil.copytree(arm[0], tmp_path / "all" / name)
    (tmp_path / "all" / "lone.yml").write_text((arm[0] / "config.yaml").read_text())
    (tmp_path / "all" / "notes.yaml").write_text("shopping: [milk]\n")
    monkeypatch.setattr(Session, "_work", lambda self, job, text: told(self, job, text, arm[1]))
    own = Experiments(beside(tmp_path / "all" / "config.yaml"), tmp_path / "run")
    own.folder, own.client = tmp_path / "all", TestClient(application(own, port=PORT, csrf=CSRF))
    return own


def test_a_folder_offers_its_experiments(experiments):
    assert experiments.names == ["lone", "one", "two"]
    for number, name in enumerate(experiments.names):
        shown = experiments.client.get(f"/{number}/").text
        assert f"<h1>{name}</h1>" in shown and [a["href"] for tag, a in Elements(shown).found if tag == "a" and a.get("href", "").endswith("/")] == ["/0/", "/1/", "/2/"]
        assert experiments.client.get(f"/{number}/api/state").json()["name"] == name
    assert experiments.client.get("/api/state").json()["name"] == "lone" and experiments.client.get("/2").status_code == 200
    for path in ("/3/", "/-1/", "/99999999999999999999/api/state", "/one/", "/../notes.yaml", "/1/../../notes.yaml"):
        assert experiments.client.get(path).status_code == 404, path
    assert beside(experiments.folder / "one" / "config.yaml") == [experiments.folder / "one" / "config.yaml"]
    assert beside(experiments.folder / "lone.yml") == [experiments.folder / "lone.yml"]
    assert beside(experiments.folder / "nothing.yaml") == [experiments.folder / "nothing.yaml"]


def test_experiments_with_the_same_text_are_kept_apart(experiments):
    post = lambda number, act, **body: experiments.client.post(f"/{number}/api/{act}", json=body, headers={"x-sysid-csrf": CSRF}).json()  # noqa: E731
    state = lambda number: experiments.client.get(f"/{number}/api/state").json()  # noqa: E731
    sha = state(1)["sha"]
    assert state(2)["sha"] == sha
    post(1, "run")
    end = time.monotonic() + 10
    while not state(1)["ready"] and time.monotonic() < end:
        time.sleep(0.02)
    assert state(1)["ready"] and not state(2)["ready"]
    before = (experiments.folder / "two" / "config.yaml").read_text()
    post(1, "add", sha=sha, effect="armature", joint="elbow")
    assert state(1)["undo"] == "armature on elbow" and state(2)["undo"] is None and (experiments.folder / "two" / "config.yaml").read_text() == before
    assert experiments.session(1).history.run != experiments.session(2).history.run != experiments.session(0).history.run


def test_an_experiment_of_the_same_name_elsewhere_does_not_undo_into_this_one(opened, arm, tmp_path):
    opened.post("/api/add", sha=opened.sha, effect="stribeck", joint="elbow")
    opened.wait()
    other = studio(shutil.copytree(arm[0], tmp_path / "elsewhere" / "arm"), opened.run)
    assert other.get("/api/state").json()["undo"] is None and other.get("/api/state").json()["redo"] is None


def test_a_job_that_waits_for_its_turn_can_be_cancelled():
    turn, go = Turn(), threading.Event()
    first, second = Worker(turn), Worker(turn)
    first.start("a", lambda job: go.wait(10))
    waiting = second.start("b", lambda job: None)
    second.cancel()
    end = time.monotonic() + 5
    while waiting.state == "running" and time.monotonic() < end:
        time.sleep(0.01)
    assert waiting.state == "cancelled" and first.job.state == "running"
    go.set()


def test_a_short_job_is_let_by_where_a_long_one_tells_how_far_it_is():
    """One at a time: the short ones go ahead of a long one that waits, and between two reports of the one at work."""
    turn, go, at_work, order = Turn(), threading.Event(), [], []

    def long(job):
        for k in range(400):
            assert not at_work
            at_work.append(job)
            time.sleep(0.002)
            assert at_work == [job]
            at_work.clear()
            job.tell("ask", k / 400)
            if go.is_set() and k > 20:
                break
        order.append(job.sha)

    def short(job):
        assert not at_work
        at_work.append(job)
        job.tell("compress", 0.5)
        time.sleep(0.02)
        assert at_work == [job]
        at_work.clear()
        order.append(job.sha)

    first, other, ahead, aside = Worker(turn), Worker(turn), Worker(turn, ahead=True), Worker(turn, ahead=True)
    first.start("a", long)
    other.start("b", long)
    for worker, name in ((ahead, "c"), (aside, "d")):
        worker.start(name, short)
    ended(ahead), ended(aside)
    assert sorted(order) == ["c", "d"] and first.job.state == other.job.state == "running"
    go.set()
    ended(first), ended(other)
    assert order[2:] in (["a", "b"], ["b", "a"]) and {w.job.state for w in (first, other, ahead, aside)} == {"done"}


def ended(worker):
    end = time.monotonic() + 30
    while worker.job.state == "running" and time.monotonic() < end:
        time.sleep(0.002)
    assert worker.job.state == "done", worker.job


def test_a_file_that_cannot_be_meant_is_said_on_the_page(opened):
    opened.file.write_text("modle: {}\n")
    answer = opened.post("/api/run")
    assert answer.status_code == 200
    state = opened.wait()
    assert state["job"]["state"] == "failed" and "modle" in state["job"]["error"] and not state["ready"]
    opened.file.unlink()
    state = opened.get("/api/state").json()
    assert state["sha"] is None and "cannot be read" in state["error"]
    assert opened.get("/").status_code == 200


def test_unknown_things_are_not_found(opened):
    sha = opened.sha
    for path, words in (("view", {"sha": "x"}), ("window", {"sha": sha, "joint": 9, "part": "test"}), ("window", {"sha": sha, "joint": "x", "part": "test"}), *(("window", {"sha": sha, "joint": 0, "part": "test", "beside": b}) for b in ("step:9", "step:x", "preview:x", "run:../../etc", "x")), ("cloud", {"sha": sha, "joint": 0, "part": "test", "shown": "preview:x"}), ("cloud", {"sha": sha, "joint": 0, "part": "test", "shown": "run:x"}), ("stretch", {"sha": sha, "from": "nan", "to": 1}), ("compare", {"from": 0, "to": 9})):
        assert opened.get(f"/api/{path}", **words).status_code == 422, path
    assert opened.get("/api/figure", sha=sha, id="../../etc/passwd").status_code == 404
    for path in ("/../pyproject.toml", "/api", "/export/../../x", "/%2e%2e/%2e%2e/etc/passwd", "/studio/undo.json"):
        assert opened.get(path).status_code == 404


# ---- answers without a refit


def previewed(own, **body):
    """The hash of a preview, once it is there."""
    answer = own.post("/api/preview", sha=own.sha, **body).json()
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        state = own.get("/api/state").json()
        if any(one["sha"] == answer["preview"] for one in state["previews"]):
            return answer["preview"]
        assert state["aside"]["state"] in ("running", "done"), state["aside"]
        time.sleep(0.02)
    raise AssertionError("the preview does not come")


def test_a_preview_is_the_fit_that_the_addition_gives(opened, monkeypatch):
    before = opened.file.read_bytes()
    key = previewed(opened, finding=0)
    assert opened.file.read_bytes() == before and opened.get("/api/state").json()["undo"] is None
    asked = {"sha": opened.sha, "joint": 0, "part": "test"}
    shown = opened.get("/api/window", **asked, shown=f"preview:{key}", beside="now").json()
    found = opened.get("/api/view", sha=opened.sha).json()
    said = opened.session.diagnosed(opened.sha).said
    assert shown["beside"] == said["joints"][EVIL]["rms"]["test"] == opened.get("/api/window", **asked).json()["rms"]
    assert shown["rms"] == pytest.approx(said["claims"][0]["rms_test_after"][EVIL], rel=1e-9) and shown["laid"]
    names = [trace["name"] for trace in shown["chart"]["figure"]["data"]]
    assert {"predicted beside", "residual beside", "difference"} <= set(names) and found["offered"]
    # what is then added is this very fit, and the text this very text
    fits = []
    monkeypatch.setattr(Session, "_work", lambda self, job, text: fits.append(self.aside.previews.fit(hashed(text), cache.key(hashed(text), self.history.experiment(text)))))
    assert opened.post("/api/add", sha=opened.sha, finding=0).json()["sha"] == key
    opened.wait()
    assert fits[0] is opened.session.aside.previews.find(key).fit


def test_any_effect_and_any_formula_is_previewed_and_what_cannot_be_is_said(opened):
    first = previewed(opened, effect="cogging", joint=EVIL, options={"lines": "2"})
    second = previewed(opened, formula="a*sin(3*q)", joint="elbow")
    words = {one["sha"]: one["words"] for one in opened.get("/api/state").json()["previews"]}
    assert words == {first: f"cogging on {EVIL}", second: "a*sin(3*q) on elbow"}
    for body, said in (({"formula": "import os", "joint": "elbow"}, "formula"), ({"effect": "viscous", "joint": "elbow"}, "already"), ({"effect": "cogging", "joint": "elbow", "options": {"lines": "[many"}}, "lines"), ({"effect": "cogging", "joint": "elbow", "options": {"lines": "many"}}, "lines"), ({"effect": "cogging", "options": 3}, "options")):
        answer = opened.post("/api/preview", sha=opened.sha, **body)
        assert answer.status_code == 422 and said in answer.json()["error"], answer.json()
    assert opened.post("/api/preview", sha="another", finding=0).status_code == 422
    # options go into the file
    opened.post("/api/add", sha=opened.sha, effect="cogging", joint="elbow", options={"lines": "2", "k": ""})
    assert "cogging: {joints: [elbow], lines: 2}" in opened.file.read_text()


def test_a_stretch_of_time_names_the_preview_that_takes_it(opened):
    key = previewed(opened, finding=0)
    ask = lambda low, high: opened.get("/api/stretch", sha=opened.sha, part="test", **{"from": low, "to": high}).json()  # noqa: E731
    whole = ask(-1.0, 1e6)
    assert (first := whole["previews"][0])["sha"] == key and first["joint"] == EVIL and first["share"] > 0.5
    for entry in whole["joints"]:
        assert entry["here"] == pytest.approx(entry["whole"])
    half = ask(4.0, 2.0)
    assert half["from"] == 2.0 and 0 < half["rows"] < whole["rows"]
    assert ask(50.0, 60.0)["rows"] == 0 and ask(50.0, 60.0)["previews"] == []


def test_a_stretch_is_masked_on_its_logs_own_clock(opened):
    before = opened.file.read_text()
    mask = {"part": "test", "from": 2.0, "to": 3.0, "joint": 1}
    opened.post("/api/add", sha=opened.sha, mask=mask)
    state = opened.wait()
    (own,) = opened.session.history.experiment(opened.file.read_text()).preprocess.mask
    first = opened.session.workspace(opened.sha).prediction("test").t[0]
    assert own.log == "test.csv" and own.joints == ["elbow"] and own.start == pytest.approx(2.0 + first, abs=0.006)
    assert state["undo"].startswith("mask 2.0") and state["undo"].endswith("on elbow")
    opened.post("/api/add", sha=state["sha"], mask={**mask, "joint": None})
    assert len(opened.session.history.experiment(opened.file.read_text()).preprocess.mask) == 2
    state = opened.wait()
    for wrong in (3, {"part": "both", "from": 0, "to": 1}, {**mask, "from": "x"}, {**mask, "joint": 9}, {**mask, "joint": "x"}, {**mask, "from": 90, "to": 91}):
        assert opened.post("/api/add", sha=state["sha"], mask=wrong).status_code == 422, wrong
    state = opened.post("/api/undo", sha=state["sha"]).json()
    opened.post("/api/undo", sha=state["sha"])
    assert opened.file.read_text() == before


def test_a_motion_is_designed_with_its_files_to_take_along(opened, monkeypatch):
    from sysid.studio import designs

    asked = []

    def design(experiment, *, separate, duration, processes, progress, diagnosis):
        asked.append((experiment.name, separate, duration))
        progress("searching", 0.5)
        return "found"

    def write(found, folder):
        folder.mkdir(parents=True)
        said = {"duration": 20.0, "separates": [{"a": "cogging:elbow", "b": "cable:elbow", "probability": 0.97, "if_a": 0.97, "if_b": 0.97}], "expected_std": {}}
        (folder / "design.json").write_text(json.dumps(said))
        (folder / "trajectory.csv").write_text("t,q\n")

    monkeypatch.setattr(designs.designing, "design", design)
    monkeypatch.setattr(designs.designing, "write", write)
    answer = opened.post("/api/design", sha=opened.sha, separate=["cogging:elbow", "payload:*"]).json()
    end = time.monotonic() + 10
    while not (found := opened.get("/api/state").json()["designs"]) and time.monotonic() < end:
        time.sleep(0.02)
    assert asked == [("arm", [("cogging", "elbow"), ("payload", "*")], 20.0)]
    assert found == [{"name": answer["design"], "says": "20 s of motion; cogging:elbow and cable:elbow will be told apart with probability 0.97"}]
    assert answer["design"] == "cogging-elbow-against-payload-robot"
    assert opened.get("/export/design", name=answer["design"], file="trajectory.csv").text == "t,q\n"
    for name, file in (("../..", "design.json"), (answer["design"], "../../fit.json"), ("x", "trajectory.csv")):
        assert opened.get("/export/design", name=name, file=file).status_code == 422
    for body in ({"separate": "a"}, {"separate": [1]}, {"separate": ["a"]}, {"duration": "x"}):
        assert opened.post("/api/design", sha=opened.sha, **body).status_code == 422


def test_another_run_is_laid_over_this_one(opened):
    fit = opened.session.diagnosed(opened.sha).fit
    found = fit.predictions["test"]
    worse = replace(fit, predictions={**fit.predictions, "test": replace(found, predicted=found.predicted + 0.1)})
    loop.results.write(worse, opened.run.parent / "other")
    loop.results.write(fit, opened.run / "steps" / "00-start")
    assert opened.get("/api/view", sha=opened.sha).json()["runs"] == ["steps/00-start", "other"]
    asked = {"sha": opened.sha, "joint": 1, "part": "test"}
    told = opened.get("/api/window", **asked, beside="run:other").json()
    assert told["laid"] and told["beside"] == pytest.approx(worse.rms("test")["elbow"], rel=1e-12)
    same = opened.get("/api/window", **asked, beside="run:steps/00-start").json()
    assert same["beside"] == same["rms"]


def _model(times, logs, *, seed):
    """What can be laid beside another: rows with values of their own."""
    values = np.random.default_rng(seed).normal(size=(3, len(times)))
    return types.SimpleNamespace(
        times=lambda part: times,
        columns=lambda part, joint: values,
        prediction=lambda part: types.SimpleNamespace(log=logs),
    )


@pytest.mark.parametrize("gap", [slice(0, 0), slice(40, 42)])
def test_rows_of_a_model_with_other_edges_are_laid_where_they_belong(gap):
    """Two logs on clocks of their own, shorter at both ends, and once with rows missing between."""
    t, logs = np.tile(np.arange(100) * 0.01, 2), np.repeat([0, 1], 100).astype(np.int16)
    there = np.ones(200, dtype=bool)
    there[[0, 1, 98, 99, 100, 198, 199]] = False
    there[gap] = False
    mine, other = _model(t, logs, seed=0), _model(t[there], logs[there], seed=1)
    for laid, values in zip(same_rows(other, mine, "train", 0), other.columns("train", 0)[1:]):
        assert np.isnan(laid[~there]).all()
        np.testing.assert_array_equal(laid[there], values)


@pytest.mark.long
def test_a_diagnosis_that_stands_is_not_made_again(arm, tmp_path, monkeypatch):
    from sysid.statement import kept
    from sysid.studio import session

    folder, count = shutil.copytree(arm[0], tmp_path / "arm"), []
    monkeypatch.setattr(session, "diagnose", lambda *a, **k: (count.append(1), diagnose(*a, **k))[1])
    first = studio(folder, tmp_path / "run")
    said = first.session.diagnosed(first.sha).said
    again = studio(folder, tmp_path / "run")
    assert len(count) == 1 and again.session.diagnosed(again.sha).said == said
    assert kept.found(again.session.history.experiment(again.file.read_text()), again.session.diagnosed(again.sha).fit, tmp_path / "run") == said
    again.file.write_text(again.file.read_text().replace("weight: 0.01", "weight: 0.02"))
    studio(folder, tmp_path / "run")
    assert len(count) == 2


# ---- jobs


def test_a_job_stops_where_it_tells_and_the_next_one_runs():
    worker, begun, done = Worker(), threading.Event(), []

    def endless(job):
        while True:
            begun.set()
            job.tell("ask", 0.5)
            time.sleep(0.005)

    first = worker.start("a", endless)
    assert begun.wait(5) and worker.start("a", endless) is first
    worker.start("b", lambda job: done.append(1))
    ended(worker)
    assert first.state == "cancelled" and worker.job.state == "done" and done == [1]


def test_shares_of_a_job_only_rise():
    job, shares = Job(1, "x"), []
    for stage, share in [("starting", 0), ("compress", 0.5), ("compress", 1), ("compress", 0.2), ("ask", 0.5), ("ask", 1), ("ask, with stribeck", 0.1), ("ask, with stribeck", 1), ("ask, with x", 0.5), ("drawing", 0)]:
        job.tell(stage, share)
        shares.append(job.share)
    assert shares == sorted(shares) and shares[-1] < 1 and shares[0] == 0
    job.stop.set()
    with pytest.raises(Cancelled):
        job.tell("ask", 1)


def test_cancel_keeps_the_page_answering_and_the_file_whole(arm, tmp_path):
    own = studio(shutil.copytree(arm[0], tmp_path / "arm"), tmp_path / "run", begin=False)
    before = own.file.read_bytes()
    assert own.post("/api/run").json()["job"]["state"] == "running"
    own.post("/api/cancel")
    state = own.wait()
    assert state["job"]["state"] == "cancelled" and not state["ready"] and own.file.read_bytes() == before
    assert own.post("/api/run", sha=state["sha"]).json()["job"]["number"] == 2
    own.post("/api/cancel")
    own.wait()


def test_a_mistake_of_ours_ends_the_job_not_the_studio(opened, monkeypatch, capsys):
    monkeypatch.setattr(Session, "_work", lambda self, job, text: 1 / 0)
    opened.post("/api/add", sha=opened.sha, effect="stribeck", joint="elbow")
    state = opened.wait()
    assert state["job"]["state"] == "failed" and "ZeroDivisionError" in state["job"]["error"] and state["undo"]
    assert opened.post("/api/undo", sha=state["sha"]).json()["ready"]


# ---- who may ask


async def chunks():
    yield b"{}"


@pytest.mark.parametrize("headers", [{"host": "evil.example"}, {"host": "evil.example:8765"}, {"host": "127.0.0.1"}, {"host": "127.0.0.1:80"}, {"host": "localhost:8765.evil.example"}, {"origin": "http://evil.example"}, {"origin": "null"}, {"origin": "http://127.0.0.1:9999"}, {"origin": "https://127.0.0.1:8765"}, {"sec-fetch-site": "cross-site"}, {"sec-fetch-site": "same-site"}])  # fmt: skip
def test_other_pages_are_refused(opened, headers):
    for path in ("/", "/api/state", "/studio.js", "/export/experiment.yaml"):
        assert opened.client.get(path, headers=headers).status_code == 403
    before = opened.file.read_bytes()
    assert opened.post("/api/add", headers, sha=opened.sha, finding=0).status_code == 403
    assert opened.file.read_bytes() == before


@pytest.mark.parametrize("host", ["127.0.0.1:8765", "localhost:8765", "LOCALHOST:8765", "[::1]:8765"])
def test_this_machine_s_names_are_welcome(opened, host):
    assert opened.client.get("/", headers={"host": host, "sec-fetch-site": "none"}).status_code == 200
    assert opened.client.get("/api/state", headers={"host": host, "origin": f"http://{host.lower()}", "sec-fetch-site": "same-origin"}).status_code == 200


def test_changes_need_post_json_and_the_header(opened):
    sha, good = opened.sha, {"x-sysid-csrf": CSRF}
    before = opened.file.read_bytes()
    for path in ("run", "cancel", "undo", "redo", "add"):
        path = f"/api/{path}"
        assert opened.client.get(path).status_code == 405
        for method in ("put", "delete", "patch", "options"):
            assert getattr(opened.client, method)(path, headers=good).status_code == 405
        assert opened.client.post(path, json={"sha": sha}).status_code == 403
        assert opened.client.post(path, json={"sha": sha}, headers={"x-sysid-csrf": "guess"}).status_code == 403
        for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
            assert opened.client.post(path, content=json.dumps({"sha": sha}), headers={**good, "content-type": kind}).status_code == 415
        for bad in ("[]", "{", "7", '"x"', "[" * 30000):
            assert opened.client.post(path, content=bad, headers={**good, "content-type": "application/json"}).status_code == 400
        assert opened.client.post(path, content=b"x" * 70000, headers={**good, "content-type": "application/json"}).status_code == 413
        assert opened.client.post(path, content=chunks(), headers={**good, "content-type": "application/json"}).status_code == 413
    assert opened.file.read_bytes() == before


def test_a_token_is_asked_of_everyone(opened):
    app = application(opened.session, host="192.0.2.7", port=PORT, token="geheim", csrf=CSRF)
    home = f"http://192.0.2.7:{PORT}"
    for path in ("/", "/?token=wrong", "/api/state", "/studio.js", "/api/state?token=geheim"):
        assert TestClient(app, base_url=home).get(path).status_code == 401, path
    assert TestClient(app, base_url=home).post("/api/run", json={}, headers={"x-sysid-csrf": CSRF}).status_code == 401
    client = TestClient(app, base_url=home)
    first = client.get("/?token=geheim", follow_redirects=False)
    assert first.status_code == 303 and first.headers["location"] == "/"
    assert {"HttpOnly", "SameSite=Strict"} <= {part.strip() for part in first.headers["set-cookie"].split(";")}
    assert client.get("/").status_code == 200 and client.get("/api/state").status_code == 200
    assert TestClient(app, base_url=home).get("/api/state", headers={"authorization": "Bearer geheim"}).status_code == 200
    assert client.get("/", headers={"host": "evil.example:8765"}).status_code == 403


@pytest.mark.parametrize("token", [None, "", "with space", "semi;colon", "ümlaut"])
def test_no_address_is_served_to_others_without_a_token(opened, token):
    with pytest.raises((ValueError, SysidError)):
        application(opened.session, host="0.0.0.0", port=PORT, token=token)
    if token is not None:
        with pytest.raises(SysidError, match="token"):
            serve(opened.file, host="127.0.0.1", port=0, token=token, out=opened.run)


def test_bound_to_every_address_names_of_others_are_refused(opened):
    app = application(opened.session, host="0.0.0.0", port=PORT, token="geheim")
    auth = {"authorization": "Bearer geheim"}
    for host, status in (("192.0.2.7:8765", 200), ("[2001:db8::1]:8765", 200), (f"{socket.gethostname()}:8765", 200), ("evil.example:8765", 403), ("192.0.2.7:80", 403), ("192.0.2.7", 403)):
        assert TestClient(app).get("/api/state", headers={"host": host, **auth}).status_code == status, host


def test_every_answer_carries_the_policy(opened):
    for path in ("/", "/studio.js", "/studio.css", "/plotly.js", "/api/state", "/nowhere"):
        answer = opened.get(path)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy and "script-src 'self' 'unsafe-eval';" in policy and "http:" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
    assert opened.client.get("/", headers={"host": "evil"}).headers["content-security-policy"] == security.POLICY


# ---- names are text


def test_the_empty_page_parses_without_error():
    assert not parse_errors(page.shell("a <u>name</u>", "x\"y", ["a", EVIL], 1)) and not parse_errors(page.shell("a", "b"))


def test_names_show_as_text(opened, arm):
    shell = page.shell(EVIL, '"><b>')
    assert EVIL not in shell and html.escape(EVIL) in shell and '"><b>' not in shell
    assert [tag for tag, _ in Elements(shell).found].count("script") == 1
    assert "innerHTML" not in page.script().replace("section.innerHTML = part.html;", "")
    view = opened.get("/api/view", sha=opened.sha).json()
    for name, section in view["sections"].items():
        assert EVIL not in section["html"], name
        assert not [1 for tag, a in Elements(section["html"]).found if tag in ("script", "iframe", "object") or any(k.startswith("on") for k in a)]
    for joint in range(2):
        chart = opened.get("/api/window", sha=opened.sha, joint=joint, part="test")
        assert "<b>" not in chart.text and chart.headers["content-type"] == "application/json"


def test_exports_are_the_report_and_the_file(opened):
    report = opened.get("/export/report.html", sha=opened.sha)
    assert report.status_code == 200 and "attachment" in report.headers["content-disposition"]
    assert '<section id="verdict"' in report.text and EVIL not in report.text.partition("<script")[0]
    yaml = opened.get("/export/experiment.yaml")
    assert yaml.content == opened.file.read_bytes() and "attachment" in yaml.headers["content-disposition"]


# ---- the command


def test_a_port_that_is_taken_is_one_line(cli, experiment):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        said = cli("studio", experiment(), "--port", taken.getsockname()[1], "--no-browser")
    assert said.status == 2 and len(said.err.splitlines()) == 1 and "--port" in said.err


def test_an_experiment_that_is_not_there_is_one_line(cli, tmp_path):
    said = cli("studio", tmp_path / "nothing.yaml", "--no-browser")
    assert said.status == 2 and "cannot be read" in said.err and len(said.err.splitlines()) == 1


def test_without_the_extra_it_says_what_to_install(cli, experiment, monkeypatch):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    said = cli("studio", experiment(), "--no-browser")
    assert said.status == 2 and "sysid[studio]" in said.err and len(said.err.splitlines()) == 1


def test_the_command_serves_until_interrupted(experiment, tmp_path):
    import signal
    import urllib.request

    folder = experiment()
    run = [sys.executable, "-m", "sysid", "studio", str(folder), "--port", "0", "--token", "t", "--json", "--out", str(tmp_path / "run")]
    with subprocess.Popen(run, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            address = json.loads(process.stdout.readline())["studio"]
            assert address.startswith("http://127.0.0.1:") and address.endswith("?token=t")
            asked = urllib.request.Request(address.partition("?")[0] + "api/state", headers={"authorization": "Bearer t"})
            with urllib.request.urlopen(asked, timeout=10) as answer:
                assert json.load(answer)["name"] == "experiment"
        finally:
            process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 0 and err == "" and out == ""


def test_the_history_refuses_a_run_folder_that_cannot_be(arm, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SysidError):
        History(arm[0], tmp_path / "file" / "run")


def test_the_joint_of_the_last_addition_is_told_first():
    """Then where the error moved most, up or down; a joint without an error is not told."""
    from types import SimpleNamespace

    from sysid.studio.beside import led

    steps = [{"sha": "a", "added": None, "joint": None, "rms_test": {"hip": 1.0, "knee": 1.0, "abad": 1.0, "toe": 0.0}}]
    fit = SimpleNamespace(
        joints=("abad", "hip", "knee", "toe"), predictions={"test": SimpleNamespace(units=("N m",) * 4)},
        rms=lambda part: {"abad": 1.3, "hip": 0.9, "knee": 0.5, "toe": 0.0},
    )  # fmt: skip
    of = lambda last: [f["joint"] for f in led(steps, "b", last, fit)["falls"]]  # noqa: E731
    assert of("+ stribeck on hip") == ["hip", "knee", "abad"]
    assert of("+ stribeck on abad, hip") == ["abad", "hip", "knee"]
    assert of("+ gravity_tilt") == ["knee", "abad", "hip"]
