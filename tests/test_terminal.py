"""What `sysid diagnose` prints: status first, no name cut, every command on a line of its own."""

from types import SimpleNamespace

import pytest

from sysid.statement import sizes, tables, text
from sysid.statement.words import untold
from sysid.terminal.diagnosis import show_diagnosis
from sysid.terminal.steps import show_discovery

JOINTS = ("shoulder_pan_joint_of_the_left_arm", "rail", "j3", "j4", "j5")
FIRST, RAIL = JOINTS[:2]
COMMAND = (
    f"sysid add 'a folder/with a long name/{'x' * 60}' cogging --joint {FIRST} --option ratio=101"
)


def finding(effect, joint, command, step, **more):
    return {
        "effect": effect,
        "joint": joint,
        "probability": 0.6,
        "q_value": 0.001,
        "rms_test_before": 0.4,
        "rms_test_after": 0.1,
        "misfit_removed": 0.94,
        "misfit_removed_se": 0.02,
        "parameters": {},
        "tied_with": [],
        "separate_by": "creep",
        "command": command,
        "joins_as_step": step,
        "options": {},
        "options_say": {},
        "or_options": [],
        "size_told": True,
        "misfit_known": True,
    } | more


def document(**more):
    """Every status on a robot of five joints, whose second one slides and has no floor."""
    parameters = {
        f"cogging.{FIRST}.a1": {"value": 1.23456, "std": 0.0123, "unit": "N m"},
        f"cogging.{FIRST}.k": {"value": 101.0, "std": None, "unit": "1/rad"},
    }
    joints = {
        joint: {
            "rms": {"train": 0.3, "test": 0.4},
            "noise_floor": 0.1,
            "noise_floor_se": 0.002,
            "floor_detail": "residual above 5 Hz, white",
        }
        for joint in JOINTS
    }
    joints[RAIL] |= {
        "noise_floor": None,
        "noise_floor_se": None,
        "floor_detail": "not determined: 2 s are too short",
    }
    return {
        "band": "torque as logged",
        "joints": joints,
        "findings": [
            finding("cogging", FIRST, COMMAND, 1, parameters=parameters),
            finding("spring", FIRST, "sysid add x spring", None, probability=0.3),
            finding("payload", "*", "sysid add x payload", 2),
        ],
        "not_claimed": [],
        "claims": [
            {"findings": [0, 1], "rms_test_after": dict.fromkeys(JOINTS, 0.4)},
            {"findings": [2], "rms_test_after": dict.fromkeys(JOINTS, 0.4)},
        ],
        "verdict": [
            {
                "joint": FIRST,
                "status": "missing",
                "effect": "cogging",
                "commands": [COMMAND, "sysid add x payload"],
                "explained": 0.95,
                "depends_on": [{"variable": f"qd_{FIRST}", "share": 0.02}],
                "share_left": 0.03,
            },
            {
                "joint": RAIL,
                "status": "missing",
                "effect": "payload",
                "commands": ["sysid add x payload"],
                "explained": 1.0,
            },
            {
                "joint": "j3",
                "status": "explained",
                "by": [{"effect": "cogging", "joint": FIRST}],
                "explained": 1.0,
            },
            {
                "joint": "j4",
                "status": "unknown",
                "also": [],
                "depends_on": [{"variable": "several variables together", "share": 0.4}],
                "share_left": 0.4,
            },
            {
                "joint": "j5",
                "status": "unresolved",
                "says": "its error is 3 times the noise floor, and nothing predicts the rest",
            },
        ],
        "detectable": [
            {
                "effect": "spring",
                "joint": j,
                "parameter": "k",
                "size": 0.0123 * 10**k,
                "unit": "N m/rad",
                "power": 0.9,
                "at": {},
            }
            for k, j in enumerate(JOINTS)
        ]
        + [
            {
                "effect": "gravity_tilt",
                "joint": "*",
                "parameter": "roll",
                "size": 0.011,
                "unit": "rad",
                "power": 0.9,
                "at": {},
            }
        ],
        "absorbed": [
            {"effect": "elasticity", "joint": j, "separate_by": "lock it"} for j in JOINTS
        ],
        "events": [
            {
                "kind": "knock",
                "log": "day 1/a.csv",
                "start": 4.08,
                "stop": 4.22,
                "joints": list(JOINTS),
            },
            {"kind": "spike", "log": "b.csv", "start": 1.0, "stop": 1.0, "joints": [RAIL]},
        ],
        "fails_where": [{"joint": j, "words": [f"much of {j}"]} for j in JOINTS],
        "notices": ["take note"],
        "run": "runs/x",
    } | more


def of(said):
    units = dict.fromkeys(JOINTS, "N m") | {RAIL: "N"}
    sets = {
        COMMAND: (("cogging", FIRST, 0.6), ("spring", FIRST, 0.3), ("payload", "*", 0.1)),
        "sysid add x payload": (("payload", "*", 1.0),),
    }
    return text.Told(said, units, dict.fromkeys(JOINTS, 0.11), sets, {command: {("spring", FIRST)} for command in sets})


def printed(monkeypatch, capsys, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr(text, "told", lambda found, said: of(said))
    show_diagnosis(SimpleNamespace(fit=SimpleNamespace(joints=JOINTS)), document())
    return capsys.readouterr().out


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_no_name_is_cut_and_commands_are_whole(monkeypatch, capsys, columns):
    out = printed(monkeypatch, capsys, columns)
    assert COMMAND in out.splitlines() and "sysid add x payload" in out.splitlines()
    assert "…" not in out and "\u00a0" not in out
    said = document()
    wide = {
        COMMAND,
        *tables.errors(of(said), columns),
        *tables.suspects(said, columns),
        *sizes.shown(said, JOINTS, columns),
    }
    wide |= {line for line in out.splitlines() if line.startswith("sysid design ")}
    assert any("--separate" in line for line in wide)
    assert not [line for line in out.splitlines() if len(line) > columns and line not in wide]
    for entry in said["verdict"]:
        assert f"{entry['joint']}: {entry['status']}" in " ".join(out.split())
    for block in (tables.errors(of(said), columns), sizes.shown(said, JOINTS, columns)):
        assert all(any(name in line for line in block) for name in JOINTS)


def test_each_joint_is_said_in_a_paragraph():
    paragraphs = {
        lead.partition(":")[0]: " ".join(" ".join(lines).split())
        for lead, lines in text.verdict(of(document()), 80)
    }
    first = paragraphs[FIRST]
    assert first.startswith(
        f"{FIRST}: missing: cogging and payload of the whole robot; "
        "with all that is named 95 % of the misfit is explained"
    )
    assert "from 0.4 to 0.11 N m" in first and "cogging takes 94 % of what was left; with all that is named a1" in first
    assert "payload takes 94 % of what was left on all joints add it with" in first
    assert "add x spring" not in first and "a1 = 1.235 +- 0.012 N m, k = 101 1/rad" in first
    assert (
        "cannot tell it (60 %) from spring (30 %) or payload of the whole robot (10 %) "
        "to separate them: creep; or, if a motion can, by sysid design " in first
    )
    assert f"--separate 'cogging:{FIRST},spring:{FIRST},payload:*' --out next add it with" in first
    assert (
        first.index("sysid add")
        < first.index("the motion predicts 3 % of what is left")
        < first.index(f"the speed of {FIRST} alone 2 %")
    )
    # nobody knows a share of the misfit where the floor is not known; nothing is said twice
    assert paragraphs[RAIL].startswith(
        "rail: missing: payload of the whole robot; with all that is named the held-out error goes "
        "from 0.4 to 0.11 N"
    )
    assert "payload: see " + FIRST in paragraphs[RAIL] and "sysid add" not in paragraphs[RAIL]
    assert paragraphs["j3"].startswith(
        f"j3: explained: by cogging on {FIRST}; "
        "with all that is named 100 % of the misfit is explained"
    )
    assert (
        "no effect of the catalogue explains what is left the motion predicts 40 % of what is left"
        in paragraphs["j4"]
    )
    assert (
        paragraphs["j5"]
        == "j5: unresolved: its error is 3 times the noise floor, and nothing predicts the rest; "
        "with all that is named the held-out error goes from 0.4 to 0.11 N m"
    )
    (_, lines), *_ = text.verdict(of(document(verdict=[{"joint": "j3", "status": "complete"}])), 80)
    assert " ".join(map(str.strip, lines)) == (
        "j3: complete: no further effect is supported by these logs; its error is 4.00 times the "
        "noise floor; a floor is known to a tenth and two standard errors"
    )
    louder = document(verdict=[{"joint": "j3", "status": "complete", "says": "the noise of the test logs is louder"}])
    (_, lines), *_ = text.verdict(of(louder), 80)
    assert " ".join(map(str.strip, lines)).endswith("its error is 4.00 times the noise floor the noise of the test logs is louder")
    close = document(verdict=[{"joint": "j3", "status": "complete"}])
    close["joints"]["j3"]["noise_floor"] = 0.39
    (_, lines), *_ = text.verdict(of(close), 80)
    assert lines == ["j3: complete: no further effect is supported by these logs"]
    close["not_claimed"] = [{"effect": "spring", "joint": "j3", "why": "the error rises"}]
    (_, lines), *_ = text.verdict(of(close), 200)
    assert lines == ["j3: complete: no further effect is supported by these logs; spring was looked at and is not claimed: the error rises"]


def test_what_a_verdict_told_is_no_note_again(monkeypatch, capsys):
    said = document()
    said["not_claimed"] = [
        {"effect": "cable", "joint": "j5", "why": "its size is nothing"},
        {"effect": "spring", "joint": "j3", "why": "the error rises"},
    ]
    said["notices"] = [
        "cable on j5 is not claimed: its size is nothing",
        "spring on j3 is not claimed: the error rises",
    ]
    unresolved = {"joint": "j5", "status": "unresolved", "says": "cable: its size is nothing"}
    said["verdict"] = [*(v for v in said["verdict"] if v["joint"] != "j5"), unresolved]
    monkeypatch.setattr(text, "told", lambda found, said: of(said))
    show_diagnosis(SimpleNamespace(fit=SimpleNamespace(joints=JOINTS)), said)
    out = capsys.readouterr().out
    assert "note spring on j3 is not claimed" in out and "note cable" not in out


def test_tables_say_what_is_not_known():
    said = document()
    errors = tables.errors(of(said), 200)
    (rail,) = [line.split() for line in errors if line.startswith("  rail ")]
    assert rail == ["rail", "N", "0.3", "0.4", "0.11", "not", "known"]
    assert "  noise floor of rail: not determined: 2 s are too short" in errors
    shown = sizes.shown(said, JOINTS, 80)
    rows = [line for line in shown if line.startswith("  spring k [N m/rad]")]
    # in parts, each with the effect's name
    assert [row.removeprefix("  spring k [N m/rad]").split() for row in rows] == [
        ["0.012", "0.12", "1.2", "12"],
        ["120"],
    ]
    assert (
        "  of the whole robot: gravity_tilt roll [rad] 0.011" in shown
        and "  at no size on any joint: elasticity" in shown
    )
    events = tables.events(said, 80)
    assert (
        "knock, day 1/a.csv, 4.08 to 4.22 s: " in " ".join(" ".join(events).split())
        and events[-1] == "  torque spike, b.csv, 1.00 s: rail"
    )
    assert tables.events(document(events=[]), 80) == []
    # many of a kind in a log are one line, with how many each joint has
    _, *told = tables.events(document(events=said["events"] * 30), 200)
    assert len(told) == 2 and told[1] == (
        "  30 torque spikes, b.csv, 1.00 to 1.00 s: rail 30; each in diagnosis.json"
    )
    few = [{**e, "log": f"{k}.csv"} for k in range(12) for e in said["events"]]
    told = tables.events(document(events=few), 200)
    assert len(told) == 22 and told[-1] == "  and 4 more: see diagnosis.json"
    assert tables.suspects(document(findings=[]), 80) == []


@pytest.mark.parametrize(
    "share, words",
    [
        (0.0, "less than 1 %"),
        (1e-4, "less than 1 %"),
        (0.0051, "1 %"),
        (0.5, "50 %"),
        (0.998, "99 %"),
        (1.0, "100 %"),
    ],
)
def test_shares_are_not_rounded_to_nothing_or_all(share, words):
    assert text.percent(share) == words


@pytest.mark.parametrize(
    ("stds", "words"),
    [((0.5, None), "and these logs tell its size badly"), ((None,), "its size badly"), ((None, None), "do together, and none of them alone")],
)  # fmt: skip
def test_what_is_there_and_has_no_numbers_is_said(stds, words):
    parameters = {f"position_friction.rail.a{k}": {"value": -2.5e6, "std": std, "unit": "N"} for k, std in enumerate(stds)}
    assert untold(parameters).endswith(words) and untold(parameters).startswith("the held-out error says that it is there")


def test_a_discovery_ends_with_the_verdict_and_what_was_refused(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(text, "told", lambda found, said: of(said))
    refused = [{"effect": "cable", "joint": RAIL, "why": "the error rises"}]
    show_discovery({"refused": refused, "run": "runs/x"}, None, document())
    out = capsys.readouterr().out
    assert out.startswith("not claimed: cable on rail: the error rises\n") and out.endswith(
        "steps and experiment files: runs/x/steps\n"
    )
    assert f"{FIRST}: missing" in out
