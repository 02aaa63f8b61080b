"""In 80 columns and in a file: no name is cut, and the progress of long work is told."""

import re
import time

import pytest

from sysid import progress
from sysid.progress import Course
from sysid.terminal import watched
from tests.conftest import CONFIG, JOINTS, csv, dump, put

LONG = {"shoulder": "left_shoulder_lateral_rotation", "elbow": "left_elbow_flexion_and_extensio"}


@pytest.fixture
def narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("LINES", "24")


def renamed(text: str) -> str:
    for short, long in LONG.items():
        text = re.sub(rf"\b{short}\b", long, text)
    return text


@pytest.fixture
def long_names(experiment):
    """The little arm, its joints under names of thirty letters."""
    return long_named(experiment, lambda columns: columns)


def long_named(experiment, change):
    text = lambda columns: re.sub(r"_(shoulder|elbow)\b", lambda m: f"_{LONG[m[1]]}", csv(change(columns)))  # noqa: E731
    return experiment(config=renamed(dump(put(CONFIG, {}))), urdf=renamed, train=text, test=text)


def whole(out: str, names) -> None:
    """Every name stands whole in a line, and where a name begins it also ends."""
    assert "…" not in out and "..." not in out.replace("LOG...", "")
    for name in names:
        assert any(name in line for line in out.splitlines()), (name, out)
        for k in range(6, len(name)):
            for line in out.splitlines():
                assert not re.search(rf"(?<!\w){re.escape(name[:k])}\W*$", line), (name, line)


@pytest.mark.long
@pytest.mark.parametrize(
    "command", [["fit"], ["diagnose"], ["add", "cogging", "--force"], ["discover", "--max-steps", "1"], ["compare"], ["history"]], ids=lambda c: c[0]
)  # fmt: skip
def test_no_command_cuts_a_name(narrow, long_names, cli, command):
    if command == ["history"]:
        cli("add", long_names, "cogging", "--force", "--quiet")
    said = cli(command[0], long_names, *command[1:])
    assert said.status == 0, said.err
    whole(said.out, LONG.values())


def test_nor_does_check(narrow, experiment, cli):
    said = cli("check", long_named(experiment, lambda columns: {k: 0 * v if k.startswith("tau") else v for k, v in columns.items()}))
    assert said.status == 1
    whole(said.out, LONG.values())


ROBOTS = {
    "ur10e": "example-robot-data://ur_description/urdf/ur10_robot.urdf",
    "panda": "example-robot-data://panda_description/urdf/panda.urdf",
}


@pytest.mark.long
@pytest.mark.parametrize("robot", ROBOTS)
def test_no_command_cuts_a_name_of_an_arm(narrow, cli, tmp_path, robot):
    file = tmp_path / f"{robot}.yaml"
    joints = "" if robot == "ur10e" else ", joints: [panda_joint1, panda_joint2, panda_joint3, panda_joint4, panda_joint5, panda_joint6, panda_joint7]"
    file.write_text(f"robot: {{urdf: '{ROBOTS[robot]}'{joints}}}\n")
    logs = tmp_path / "logs"
    said = cli("simulate", file, "--duration", "4", "--rate", "200", out=logs)
    assert said.status == 0, said.err
    names = re.findall(r"q_(\w+)", (logs / "train.csv").read_text().split("\n", 1)[0])
    whole(said.out, names)
    for command in (["fit"], ["add", "torque_bias", "--joint", names[1], "--force"], ["history"], ["compare"]):
        said = cli(command[0], logs, *command[1:])
        assert said.status == 0, said.err
        whole(said.out, names)


# ---- progress


def test_a_course_never_falls_and_is_never_over_before_it_is():
    fit = list(progress.FIT)
    for course, stages in (
        (Course(), fit), (Course(3), fit * 3), (Course(3), fit * 2), (Course(asks=True), [*fit, "ask", "ask, with x", "compress", "ask, with y", "drawing"]),
        (Course(3), ["train_1", "train_2", "test"]), (Course(), ["bodies"]),
    ):  # fmt: skip
        shares = [course.tell(stage, share)[1] for stage in stages for share in (0.0, 0.5, 1.0)]
        assert shares == sorted(shares) and shares[-1] <= 0.99
        assert shares[len(shares) // 2] < 0.95  # half of the run is no standing still at the end
    assert Course(3).tell("train", 1.0) == ("train", pytest.approx(1 / 3))
    assert Course().tell("filters", 0.5)[0] == "comparing filters"
    asking = Course(asks=True)
    asking.tell("ask", 0.5)
    assert asking.tell("compress", 0.5)[0] == "trying a suspect, fitting"


def test_times_are_spoken():
    assert [progress.spoken(s) for s in (0.2, 40, 200, 7800)] == ["1 s", "40 s", "3 min", "2 h 10 min"]
    assert progress.left(0.5, 10.0) == 10.0 and progress.left(0.001, 10.0) is None


def test_a_log_tells_stage_and_time_left(monkeypatch, capfd):
    monkeypatch.setattr(watched, "_QUIET", 0.0)
    monkeypatch.setattr(watched, "_EVERY", 0.1)
    with watched.progress_lines(Course()) as report:
        report("filters", 0.5)
        time.sleep(1.2)
        report("compress", 0.5)
    out, lines = capfd.readouterr()
    assert out == "" and all(re.fullmatch(r"sysid: [\w ]+, \d+ %, (about )?\d+ (s|min) (left|so far)", line) for line in lines.splitlines()), lines
    assert lines.startswith("sysid: comparing filters, ") and "sysid: fitting, " in lines and "left" in lines


def test_short_work_says_nothing(experiment, cli):
    said = cli("fit", experiment())
    assert said.err == "" and set(JOINTS) <= set(said.out.split())


def test_a_fit_tells_every_stage(experiment):
    from sysid import pipeline

    told = []
    pipeline.fit(pipeline.load(experiment()), progress=lambda stage, share: told.append(stage))
    assert list(dict.fromkeys(told)) == list(progress.FIT)
