"""The log doctor: every fault is found where it is planted, and a clean log has none."""

import json
import re
import shutil
from itertools import product
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from scipy.signal import savgol_filter

from scripts.blind_parts.robots import experiment_of
from scripts.check_parts import faults
from sysid import check, pipeline, regressor
from sysid.check import FAULTS, written
from sysid.check.equations import Reading
from sysid.check.faults import columns, one_log
from sysid.check.look import Look, looked
from sysid.errors import ConfigError
from sysid.simulate import simulate, write
from tests.conftest import JOINTS, motion

RATE, SECONDS = 500.0, 15.0


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Makes the planar arm's logs under conditions, each once."""
    known = {}

    def make(**options):
        key = tuple(sorted(options.items()))
        if key not in known:
            folder = tmp_path_factory.mktemp("logs")
            experiment, machine = experiment_of("planar", folder)
            own = {"seed": 5, "duration": SECONDS, "rate": RATE, **options}
            write(simulate(machine, **own), experiment, folder / "logs")
            known[key] = folder / "logs"
        return known[key]

    return make


def planted(fault: str, folder, tmp_path, seed: int):
    """A copy of a folder with a fault in it, and the joints on which it may be named."""
    logs = shutil.copytree(folder, tmp_path / "logs")
    spoiled = faults.Planted(logs, ("shoulder", "elbow"), np.random.default_rng(seed))
    spoiled.step = 1.0 / RATE
    getattr(faults, fault)(spoiled)
    spoiled.save()
    return logs, {spoiled.joint} if isinstance(spoiled.joint, str) else set(spoiled.joint)


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_found_where_it_is(fault, made, tmp_path):
    if fault in faults.MADE:
        logs, joints = made(**faults.MADE[fault]), {"shoulder", "elbow", ""}
    else:
        logs, joints = planted(fault, made(), tmp_path, seed=3)
    found = check.check(pipeline.load(logs))
    own = [f for f in found if f.fault == fault]
    assert own and {f.joint for f in own} <= joints | {""}, [(f.fault, f.joint, f.says) for f in found]
    for f in own:
        assert f.says and f.do and f.severity in ("error", "warning")
        assert f.joint in ("", "shoulder", "elbow") and f.log in ("", "train.csv", "test.csv")
        assert all(np.isfinite(f.times)) and f.rows >= 0


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_a_clean_log_has_no_fault(seed, made):
    assert check.check(pipeline.load(made(seed=seed))) == []


def test_logs_that_no_fit_takes_are_refused_by_a_check(made, tmp_path):
    """Without a filter speeds and accelerations must be logged; a check that found no fault sent on to a fit that was refused."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    experiment = pipeline.load(logs)
    spec = experiment.preprocess.model_copy(update={"filter": "none"})
    with pytest.raises(ConfigError, match="filter is none"):
        check.check(experiment.model_copy(update={"preprocess": spec}))


@pytest.mark.parametrize("what", ["deg", "ms", "mNm"])
def test_a_wrong_unit_is_said_once_and_nothing_that_follows_from_it(what, made, tmp_path):
    class Drawn:
        choice = staticmethod(lambda *_: what)
        integers = staticmethod(lambda *_: 0)

    logs = shutil.copytree(made(), tmp_path / "logs")
    spoiled = faults.Planted(logs, ("shoulder", "elbow"), Drawn())
    faults.wrong_unit(spoiled)
    spoiled.save()
    found = check.check(pipeline.load(logs))
    assert {f.fault for f in found if f.severity == "error"} == {"wrong_unit"}
    assert not {f.fault for f in found} & {"joint_order", "sign_flipped", "mass_implausible", "not_excited"}


def test_one_torque_in_another_unit_is_no_mass(made, tmp_path):
    """No link is off by a thousand; the others' torques are as they were."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    spoiled = faults.Planted(logs, ("shoulder", "elbow"), np.random.default_rng(0))
    spoiled.column("tau_elbow", lambda tau: 1000.0 * tau)
    spoiled.save()
    errors = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert [(f.fault, f.joint) for f in errors] == [("wrong_unit", "elbow")] and "mN m" in errors[0].do


def test_a_log_in_which_nothing_moves_accuses_no_column(made, tmp_path):
    """Columns that are exchanged cannot be told in it, nor that they are not, nor that a torque is late."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    for file in (logs / "train.csv", logs / "test.csv"):
        table = pl.read_csv(file)
        speed = sum(table[f"q_{joint}"].diff().abs().fill_null(0.0) for joint in ("shoulder", "elbow")).to_numpy()
        first = int(np.argmin(np.convolve(speed, np.ones(100), "valid")))
        table[first : first + 100].write_csv(file)
    found = check.check(pipeline.load(logs))
    assert {f.joint for f in found if f.fault == "not_excited"} and not {f.fault for f in found} & {"joint_order", "sign_flipped", "delayed_signal"}


@pytest.mark.parametrize(("column", "word"), [("q", "angle"), ("tau", "torque")])
def test_one_signal_under_two_names_is_a_warning(column, word, made, tmp_path):
    logs = shutil.copytree(made(), tmp_path / "logs")
    spoiled = faults.Planted(logs, ("shoulder", "elbow"), np.random.default_rng(0))
    train = logs / "train.csv"
    twice = spoiled.tables[train][f"{column}_shoulder"].alias(f"{column}_elbow")
    spoiled.tables[train] = spoiled.tables[train].with_columns(twice)
    spoiled.save()
    told = [f for f in check.check(pipeline.load(logs)) if "equal in every sample" in f.says]
    assert [(f.fault, f.severity, f.joint, f.log) for f in told] == [("joint_order", "warning", "elbow", "train.csv")]
    assert f"the {word} of shoulder and of elbow" in told[0].says


def test_another_reading_is_scored_as_the_log_that_it_makes(made, tmp_path):
    """Exchanged columns read exchanged leave what the right ones leave."""
    right = looked(pipeline.load(made())).equations
    logs = shutil.copytree(made(), tmp_path / "logs")
    spoiled = faults.Planted(logs, ("shoulder", "elbow"), np.random.default_rng(0))
    names = {"tau_shoulder": "tau_elbow", "tau_elbow": "tau_shoulder", "q_elbow": "q_elbow"}
    spoiled.tables = {file: table.rename(names).select(table.columns) for file, table in spoiled.tables.items()}
    spoiled.save()
    wrong = looked(pipeline.load(logs)).equations
    exchanged = Reading((0, 1), (1, 0), (1.0, 1.0), (1.0, 1.0), (0.0, 0.0))
    assert wrong.scored(exchanged).left == pytest.approx(right.scored(Reading.plain(2)).left, rel=1e-9)
    assert wrong.scored(exchanged).loss < wrong.scored(Reading.plain(2)).loss - 2.0


def test_the_command_says_it_and_exits_with_one(made, tmp_path, cli):
    said = cli("check", made(), "--json")
    assert said.status == 0 and json.loads(said.out) == {"ok": True, "faults": []}
    assert "no fault was found" in cli("check", made()).out
    logs, _ = planted("effort_missing", made(), tmp_path, seed=1)
    said = cli("check", logs, "--json")
    document = json.loads(said.out)
    assert said.status == 1 and document["ok"] is False
    keys = {"fault": str, "severity": str, "joint": (str, type(None)), "log": (str, type(None)), "times": list, "rows": int, "says": str, "do": str}
    for fault in document["faults"]:
        assert set(fault) == set(keys) and all(isinstance(fault[key], kind) for key, kind in keys.items())
    shown = cli("check", logs)
    assert shown.status == 1 and "error: effort_missing" in shown.out and "a fit of these logs would be wrong" in shown.out
    cli("check", tmp_path / "nothing", out=tmp_path / "another").complains("nothing")


@pytest.mark.parametrize(("fault", "seed", "words"), [
    ("joint_order", 1, "worse than none"), ("torque_in_amperes", 1, "implausible masses"), ("test_is_train", 1, "under another name"),
])  # fmt: skip
def test_a_fit_says_what_cannot_be_meant(fault, seed, words, made, tmp_path):
    """Nothing that can be fitted is refused, and what comes of it is not told as a fact."""
    assert not any("implausible" in notice for notice in pipeline.fit(pipeline.load(made())).notices)
    logs, _ = planted(fault, made(), tmp_path, seed)
    assert any(words in notice for notice in pipeline.fit(pipeline.load(logs)).notices)


def test_a_fit_says_which_torque_no_drive_gives(made, tmp_path):
    logs = shutil.copytree(made(), tmp_path / "logs")
    urdf = logs / "robot.urdf"
    urdf.write_text(urdf.read_text().replace('effort="100"', 'effort="0.5"'))
    assert any("the torque of elbow reaches" in notice for notice in pipeline.fit(pipeline.load(logs)).notices)


@pytest.mark.parametrize("constant", [1.5, -1.5, -0.2])
def test_a_torque_that_is_one_number_is_no_current(made, tmp_path, constant):
    """Of a joint whose torque is constant no masses tell a unit."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        (column,) = [c for c in table.columns if c.startswith("tau") and c.endswith("elbow")]
        table.with_columns(pl.lit(constant).alias(column)).write_csv(logs / name)
    found = check.check(pipeline.load(logs))
    assert {f.fault for f in found if f.joint == "elbow" and f.severity == "error"} == {"effort_missing"}


@pytest.mark.parametrize("seed", [1, 2])
def test_a_channel_that_nothing_was_connected_to_is_no_torque(made, tmp_path, seed):
    """Noise about a constant; and what follows the motion, however little of it there is, is one."""
    rng = np.random.default_rng(seed)
    for scale in (None, 0.05):
        logs = shutil.copytree(made(), tmp_path / f"logs{scale}")
        for name in ("train.csv", "test.csv"):
            table = pl.read_csv(logs / name)
            (column,) = [c for c in table.columns if c.startswith("tau") and c.endswith("elbow")]
            own = table[column].to_numpy()
            other = 0.3 + 0.02 * rng.normal(size=len(own)) if scale is None else scale * own
            table.with_columns(pl.Series(column, other)).write_csv(logs / name)
        found = check.check(pipeline.load(logs))
        errors = {f.fault for f in found if f.joint == "elbow" and f.severity == "error"}
        assert errors == ({"effort_missing"} if scale is None else set())
        if scale is None:
            assert not any(f.fault == "mass_implausible" for f in found)


def turned(logs, file: str, column: str):
    """A log of a folder with a column of the other sign."""
    table = pl.read_csv(logs / file)
    table.with_columns(-pl.col(column)).write_csv(logs / file)


@pytest.mark.parametrize("wrong", [["train_2.csv"], ["test.csv"], ["train_1.csv", "train_3.csv"], []])
def test_a_torque_that_one_log_has_with_the_other_sign_is_named_with_its_log(wrong, made, tmp_path):
    """Of two against two those are wrong against which friction drives."""
    logs = shutil.copytree(made(logs=3, duration=6.0), tmp_path / "logs")
    for file in wrong:
        turned(logs, file, "tau_elbow")
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert {(f.fault, f.joint, f.log) for f in found} == {("sign_flipped", "elbow", file) for file in wrong}


@pytest.mark.parametrize("what", ["load", "offset"])
def test_a_load_or_an_offset_that_turns_a_torque_is_no_wrong_sign(what, made, tmp_path):
    """Most of the torque has the other sign in one log, and friction brakes there as in the others."""
    logs = shutil.copytree(made(logs=3, duration=6.0), tmp_path / "logs")
    for file, sign in (("train_1.csv", 1.0), ("train_2.csv", -1.0), ("train_3.csv", 1.0), ("test.csv", 1.0)):
        table = pl.read_csv(logs / file)
        more = 40.0 * np.sin(table["q_shoulder"] + table["q_elbow"]) if what == "load" else pl.lit(16.0)
        table.with_columns((pl.col("tau_elbow") + sign * more).alias("tau_elbow")).write_csv(logs / file)
    assert not [f for f in check.check(pipeline.load(logs)) if f.fault in ("sign_flipped", "joint_order") and f.log]


def test_signs_of_all_are_those_of_the_joints_that_tell():
    """A joint that stands, or whose torque is not used, has no sign that is wrong."""
    made = [reading for reading, _ in columns._of_all(Reading.plain(3), [0, 2])]
    assert [one.torque_factor for one in made] == [(-1.0, 1.0, -1.0), (1.0, 1.0, 1.0)]
    assert [one.angle_factor for one in made] == [(1.0, 1.0, 1.0), (-1.0, 1.0, -1.0)]
    assert not [*columns._of_all(Reading.plain(3), [1])]


@pytest.mark.parametrize("key", ["tau", "q"])
def test_all_torques_or_all_angles_of_the_other_sign_are_told_as_that(key, made, tmp_path):
    """One joint at a time gravity or an angle would turn round instead; what is written is right."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    for file, joint in product(("train.csv", "test.csv"), ("shoulder", "elbow")):
        turned(logs, file, f"{key}_{joint}")
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    word = {"tau": "torque", "q": "angle"}[key]
    assert [(f.fault, f.joint) for f in found] == [("sign_flipped", "shoulder"), ("sign_flipped", "elbow")]
    assert all(f.says.startswith(f"the {word} of") for f in found)


@pytest.mark.parametrize("files", [["test.csv"], ["train_2.csv"], ["train_1.csv", "train_3.csv"], ["train_1.csv", "test.csv"]])
@pytest.mark.parametrize("factor, said", [(1000.0, "1000 times"), (1.0 / 60.0, "1/60 of")])
def test_the_torques_of_logs_in_another_unit_are_told_with_these(factor, said, files, made, tmp_path):
    """Of as many that have it as have not, those are wrong that the URDF's masses are far from."""
    logs = shutil.copytree(made(logs=3, duration=6.0), tmp_path / "logs")
    for file in files:
        pl.read_csv(logs / file).with_columns(pl.col("tau_shoulder", "tau_elbow") * factor).write_csv(logs / file)
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert {(f.fault, f.log, f.joint) for f in found} == {("wrong_unit", file, "") for file in files}
    assert all(f.says.startswith(f"the torques in {f.log} are {said} what the other logs tell") and f.log in f.do for f in found)


@pytest.mark.parametrize("file", ["train.csv", "test.csv"])
def test_of_two_logs_the_one_that_the_urdf_is_far_from_is_in_another_unit(file, made, tmp_path):
    logs = shutil.copytree(made(), tmp_path / "logs")
    pl.read_csv(logs / file).with_columns(pl.col("tau_shoulder", "tau_elbow") * 1000.0).write_csv(logs / file)
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert [(f.fault, f.log) for f in found] == [("wrong_unit", file)] and "what the other log tells" in found[0].says


def test_a_heavy_load_in_one_log_is_no_other_unit(made, tmp_path):
    """Twice the arm's own mass on its last link makes all torques four times as large."""
    logs = shutil.copytree(made(logs=3, duration=6.0), tmp_path / "logs")
    arm = pipeline.build(pipeline.load(logs))[0]
    table = pl.read_csv(logs / "train_2.csv")
    q = table.select("q_shoulder", "q_elbow").to_numpy()
    qd, qdd = (savgol_filter(q, 31, 4, deriv=k, delta=float(table["t"][1] - table["t"][0]), axis=0) for k in (1, 2))
    pi = np.zeros_like(arm.prior)
    pi[1] = [12.0, 12.0 * 0.3, 0.0, 0.0, 0.02, 12.0 * 0.09 + 0.02, 12.0 * 0.09 + 0.02, 0.0, 0.0, 0.0]
    more = regressor.torque(arm, pi, q, qd, qdd)
    table.with_columns(tau_shoulder=table["tau_shoulder"] + more[:, 0], tau_elbow=table["tau_elbow"] + more[:, 1]).write_csv(logs / "train_2.csv")
    assert not [f for f in check.check(pipeline.load(logs)) if f.fault == "wrong_unit" and f.log]


@pytest.mark.parametrize(
    "column, factor, said", [("q_", 180.0 / np.pi, "if test.csv alone is, give it in rad"), ("t", 1e3, "in another unit than the other logs'")]
)
def test_another_unit_of_one_log_is_not_set_for_all(column, factor, said, made, tmp_path):
    logs = shutil.copytree(made(), tmp_path / "logs")
    own = [name for name in pl.read_csv(logs / "test.csv").columns if name.startswith(column)]
    own = own if column != "t" else ["t"]
    pl.read_csv(logs / "test.csv").with_columns(pl.col(*own) * factor).write_csv(logs / "test.csv")
    errors = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert {f.fault for f in errors} == {"wrong_unit"} and {f.log for f in errors} == {"test.csv"}
    assert all(said in f.do for f in errors)


def test_a_log_in_degrees_beside_one_in_turns_is_told(made, tmp_path):
    """The experiment says `position: turns`, as it should."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    for name, factor in (("train.csv", 0.5 / np.pi), ("test.csv", 180.0 / np.pi)):
        pl.read_csv(logs / name).with_columns(pl.col("^q_.*$") * factor).write_csv(logs / name)
    experiment = pipeline.load(logs)
    data = experiment.data.model_copy(update={"units": experiment.data.units.model_copy(update={"position": "turns"})})
    errors = [f for f in check.check(experiment.model_copy(update={"data": data})) if f.severity == "error"]
    assert {(f.fault, f.log, f.joint) for f in errors} == {("wrong_unit", "test.csv", joint) for joint in JOINTS}
    assert all(f.do == "give the angles in test.csv in turns, as in the others" for f in errors)


@pytest.mark.parametrize("file", ["train_2.csv", "test.csv"])
@pytest.mark.parametrize("keys, word", [(["tau"], "the torque columns"), (["q"], "the angle columns"), (["q", "tau"], "the columns")])
def test_columns_that_one_log_has_in_another_order_are_named_with_it(keys, word, file, made, tmp_path):
    logs = shutil.copytree(made(logs=3, duration=6.0), tmp_path / "logs")
    names = {f"{key}_{a}": f"{key}_{b}" for key in keys for a, b in (("shoulder", "elbow"), ("elbow", "shoulder"))}
    pl.read_csv(logs / file).rename(names).write_csv(logs / file)
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert {(f.fault, f.joint, f.log) for f in found} == {("joint_order", joint, file) for joint in ("shoulder", "elbow")}
    assert all(f.says.startswith(f"{word} of shoulder and elbow look exchanged in {file} alone") for f in found)


def test_an_angle_and_its_torque_that_one_log_has_with_the_other_sign_are_named_with_it(made, tmp_path):
    """Friction brakes as before: gravity alone tells it."""
    logs = shutil.copytree(made(logs=3, duration=6.0), tmp_path / "logs")
    for column in ("q_elbow", "tau_elbow"):
        turned(logs, "train_1.csv", column)
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert [(f.fault, f.joint, f.log) for f in found] == [("sign_flipped", "elbow", "train_1.csv")]
    assert "the angle and torque of elbow has in train_1.csv alone" in found[0].says


@pytest.mark.parametrize(
    ("joint", "zero", "turn"), [("shoulder", 0.5 * np.pi, "a quarter turn"), ("elbow", -0.5 * np.pi, "a quarter turn back"), ("shoulder", np.pi, "half a turn")]
)
def test_a_zero_that_is_a_quarter_turn_off_is_said_and_mended(joint, zero, turn, made, tmp_path):
    logs = shutil.copytree(made(), tmp_path / "logs")
    for file in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / file)
        table.with_columns(pl.col(f"q_{joint}") - zero).write_csv(logs / file)
    (told,) = [f for f in check.check(pipeline.load(logs)) if "zero" in f.says]
    assert (told.fault, told.joint) == ("limit_exceeded", joint) and f"looks {turn} from the URDF's" in told.says
    wanted = told.do.partition("write data.zero: ")[2].partition(";")[0]
    assert wanted == f"{{{joint}: {zero:.6g}}}"
    text = (logs / "config.yaml").read_text()
    assert "\ndata:\n" in text
    (logs / "config.yaml").write_text(text.replace("\ndata:\n", f"\ndata:\n  zero: {wanted}\n"))
    assert not [f for f in check.check(pipeline.load(logs)) if "zero" in f.says]
    assert check.misread(pipeline.load(logs)) == []


@pytest.mark.parametrize("wrong", ["train_1.csv", "train_2.csv"])
def test_a_log_without_torque_has_no_vote(wrong, made, tmp_path):
    logs = shutil.copytree(made(logs=2, duration=6.0), tmp_path / "logs")
    turned(logs, wrong, "tau_elbow")
    table = pl.read_csv(logs / "test.csv")
    table.with_columns((0.0 * pl.col("tau_elbow")).alias("tau_elbow")).write_csv(logs / "test.csv")
    assert {(f.joint, f.log) for f in check.check(pipeline.load(logs)) if f.fault == "sign_flipped"} == {("elbow", wrong)}


@pytest.mark.parametrize("joint, what", [("shoulder", "size"), ("elbow", "size"), ("elbow", "negative"), ("shoulder", "lifted"), ("elbow", "lifted")])
def test_a_torque_without_a_sign_is_named(joint, what, made, tmp_path):
    """A torque that is never below zero as an offset lifts it has its sign."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    how = {"size": pl.Expr.abs, "negative": lambda tau: -tau.abs(), "lifted": lambda tau: tau - tau.min()}[what]
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        table.with_columns(how(pl.col(f"tau_{joint}")).alias(f"tau_{joint}")).write_csv(logs / name)
    found = [(f.joint, "without its sign" in f.says) for f in check.check(pipeline.load(logs)) if f.fault == "sign_flipped"]
    assert found == ([] if what == "lifted" else [(joint, True)])


def test_samples_that_were_taken_beside_their_even_stamps_are_told(made, tmp_path):
    """The logger writes an even time."""
    folder = made(rate=100.0, jitter=1.0)
    logs = shutil.copytree(folder, tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        even = np.linspace(table["t"].min(), table["t"].max(), len(table)).round(6)
        table.with_columns(pl.Series("t", even)).write_csv(logs / name)
    told = {f.log: f.says for f in check.check(pipeline.load(logs)) if f.fault == "clock_jitter"}
    assert set(told) == {"train.csv", "test.csv"} and all("even" in says for says in told.values())
    assert not [f for f in check.check(pipeline.load(made(rate=100.0))) if f.fault == "clock_jitter"]


def test_an_angle_that_goes_farther_than_its_limits_may_be_the_motor_s(made, tmp_path):
    """Nine times the elbow's, and a ninth of its torque."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        table.with_columns(pl.col("q_elbow") * 9.0, pl.col("tau_elbow") / 9.0).write_csv(logs / name)
    told = [f.do for f in check.check(pipeline.load(logs)) if (f.fault, f.joint) == ("limit_exceeded", "elbow") and "moves at" not in f.says]
    assert told and all("may be the motor's, before its gear" in do for do in told)


def test_messages_that_did_not_arrive_are_told(made, tmp_path):
    """All values of a log stay for 16 and for 44 ms while the arm moves."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    table = pl.read_csv(logs / "train.csv")
    rows = np.arange(len(table))
    for first, count in ((2000, 8), (5100, 22)):
        rows[first : first + count] = first - 1
    pl.concat([table.select("t"), table.drop("t")[rows]], how="horizontal").write_csv(logs / "train.csv")
    (found,) = check.check(pipeline.load(logs))
    assert (found.fault, found.severity, found.log) == ("values_held", "warning", "train.csv")
    assert "2 times, for 44 ms at most, first at 4 s: messages that did not arrive" in found.says and found.rows == 30
    for often in (5, 20):  # of a log that was written so many times faster than it was measured
        table = pl.read_csv(made() / "train.csv")
        rows = np.arange(len(table)) // often * often
        pl.concat([table.select("t"), table.drop("t")[rows]], how="horizontal").write_csv(logs / "train.csv")
        told = [f.says for f in check.check(pipeline.load(logs)) if f.log == "train.csv"]
        assert any("only repeat the row before" in says for says in told) and not any("did not arrive" in says for says in told)


def test_one_joint_s_torque_before_its_gear_is_worth_a_word(made, tmp_path):
    """A sixth of what the masses need, on one joint of two: its unit, or the URDF's masses."""
    logs = shutil.copytree(made(), tmp_path / "logs")
    for name in ("train.csv", "test.csv"):
        table = pl.read_csv(logs / name)
        table.with_columns(pl.col("tau_elbow") / 6.0).write_csv(logs / name)
    (found,) = [f for f in check.check(pipeline.load(logs)) if f.fault == "wrong_unit"]
    assert (found.joint, found.severity) == ("elbow", "warning") and "gear" in found.do


def test_what_is_told_of_columns_is_the_reading_that_came_out():
    """Not the steps to it: a sign that was turned back is none, and three columns in a ring are told once."""
    reading = Reading((0, 1, 2), (1, 2, 0), (1, 1, 1), (1, 1, -1), zero=(0.0, np.pi, 0.0))
    assert [*columns._differences(reading)] == [("joint_order", (0, 1, 2), "torque"), ("sign_flipped", (2,), "torque"), ("limit_exceeded", (1,), 2)]
    both = Reading((1, 0, 2), (1, 0, 2), (-1, 1, 1), (-1, 1, 1), zero=(0.0, 0.0, 0.0))
    assert [*columns._differences(both)] == [("joint_order", (0, 1), ""), ("sign_flipped", (0,), "angle and torque")]


def test_a_zero_is_of_the_angle_as_it_is_read():
    data = SimpleNamespace(zero={"a": 0.3}, torque={"b": {"x": -1}}, position={})
    look = SimpleNamespace(robot=SimpleNamespace(joints=("a", "b")), experiment=SimpleNamespace(data=data), column=lambda key, joint: f"{key}_{joint}")
    turned = Reading((0, 1), (0, 1), (-1, 1), (-1, 1), zero=(np.pi / 2, 0.0))
    said = {fault.fault: fault.do for told in columns._differences(turned) for fault in written.told(look, turned, *told)}
    assert "write data.zero: {a: 1.2708}" in said["sign_flipped"] and "write data.zero: {a: 1.2708}" in said["limit_exceeded"]
    assert "write data.position: {a: {position_a: -1}}; add to data.torque: {a: {torque_a: -1}}" in said["sign_flipped"]


@pytest.mark.parametrize(("left", "told"), [(0.2, False), (0.004, True)])
def test_a_log_is_read_otherwise_only_where_the_others_then_predict_it(left, told, monkeypatch):
    """To a fifth of its square alone it falls by chance, where short logs tell little of each other: of a robot that stops and goes, with
    a bias hidden in it, a wrist's sign was turned so in one log of four, and nothing was diagnosed any more."""
    n, robot = 200, SimpleNamespace(dof=2)
    rows = SimpleNamespace(log=np.repeat([0, 1], n), use=np.ones((2 * n, 2), bool), tau=np.zeros((2 * n, 2)), columns=np.zeros((2, 2 * n, 3)))
    look = SimpleNamespace(robot=robot, asked=lambda use: [0, 1])
    monkeypatch.setattr(one_log, "told_by", lambda rows, model, use: (np.zeros(3), np.array([0.05, 0.1])))
    turned = lambda read: isinstance(read, Reading) and read.torque_factor[0] < 0.0 < read.angle_factor[0]
    plain, better = np.array([1.0, 0.01]), np.array([left, 0.01])
    monkeypatch.setattr(one_log, "_squares", lambda first, *rest: better if turned(first) else plain)
    monkeypatch.setattr(one_log, "as_read", lambda seen, reading, k: (reading, None, None))
    found = one_log._read_otherwise(look, SimpleNamespace(rows=rows, model=None), 0)
    assert (found is not None) is told and (not told or found[2:5] == ("sign_flipped", (0,), "torque"))


@pytest.mark.parametrize("late", [0.0, 0.02])
def test_coarse_angles_are_no_delay(experiment, late):
    """Of angles in steps of 2 mrad the accelerations are noise, and torque that is read early would make up for the inertia that is
    missing then; a delay that is there is told all the same."""

    def coarse(columns):
        t = np.arange(0.0, 40.0, 0.01)
        q, qd, qdd = motion(t, 3)
        out = {"t": t}
        for j, joint in enumerate(JOINTS):
            tau = 0.3 * qd[:, j] + 0.08 * np.sign(qd[:, j]) + 0.06 * qdd[:, j]
            tau = np.interp(t - late, t, tau) + 0.02 * np.random.default_rng(j).standard_normal(len(t))
            out |= {f"q_{joint}": np.round(q[:, j] / 0.002) * 0.002, f"tau_{joint}": tau}
        return out

    free = {"robot.gravity": [0.0, 0.0, 0.0], "model.effects": ["viscous", "coulomb", "armature"]}
    found = [f for f in check.check(pipeline.load(experiment(config=free, train=coarse, test=coarse))) if f.fault == "delayed_signal"]
    assert {f.joint for f in found} == (set(JOINTS) if late else set())


@pytest.mark.parametrize(
    "files, says, do", [(["train.csv"], "exchanged in train", "that file"), (["train.csv", "test.csv"], "as in every log", "data.columns.position")]
)
def test_angles_and_torques_that_changed_places_are_told_and_nothing_of_them(files, says, do, made, tmp_path):
    logs = shutil.copytree(made(), tmp_path / "logs")
    for file in files:
        frame = pl.read_csv(logs / file)
        pairs = [(f"q_{joint}", f"tau_{joint}") for joint in JOINTS]
        frame.rename({a: b for pair in pairs for a, b in (pair, pair[::-1])}).write_csv(logs / file)
    found = [f for f in check.check(pipeline.load(logs)) if f.severity == "error"]
    assert [(f.fault, f.log) for f in found] == [("joint_order", file) for file in files]
    assert all(says in f.says and do in f.do for f in found)


def test_an_inertia_of_the_robot_s_file_that_no_body_has_is_told(made, tmp_path):
    logs = shutil.copytree(made(), tmp_path / "logs")
    (urdf,) = logs.glob("*.urdf")
    text = urdf.read_text()
    mass = re.findall(r'<mass value="([^"]+)"', text)[-1]
    urdf.write_text(text.replace(f'<mass value="{mass}"', f'<mass value="-{mass}"'))
    (fault,) = [f for f in check.check(pipeline.load(logs)) if "impossible inertia" in f.says]
    assert fault.fault == "mass_implausible" and "correct the file" in fault.do


def test_a_joint_that_goes_far_however_slowly_is_excited(made):
    """A telescope turns at 0.04 rad/s, and gravity tells what it carries."""
    slow = SimpleNamespace(part="train", step=0.01, samples=20_000, tally=SimpleNamespace(travel=np.array([0.9])), speeds=lambda j: np.full(100, 0.039))
    near = SimpleNamespace(**{**vars(slow), "tally": SimpleNamespace(travel=np.array([0.2]))})
    robot = SimpleNamespace(prismatic=[False], dof=1)
    assert Look(None, robot, (slow,)).excited[0].enough and not Look(None, robot, (near,)).excited[0].enough
