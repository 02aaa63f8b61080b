"""The verdict on each joint, from small made inputs; and the size that a log would have shown, from logs with and without it."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scripts.blind_parts import cases, robots
from sysid import borne_out, config, mean_by_log, pipeline, unexplained, what_is_left
from sysid.blocks import Belief
from sysid.candidates import Candidate, candidates
from sysid.comparison import Difference
from sysid.diagnose.ask import Asked, ask
from sysid.diagnose.detectable import detectable
from sysid.diagnose.diagnosis import diagnose
from sysid.diagnose.select import WORTH, search
from sysid.diagnose.verdict import Verdict, verdicts
from sysid.effect import TorqueEffect
from sysid.effect_parameters import Linear
from sysid.flexible import Law, Unknown
from sysid.flexible.unknown import LEVEL
from sysid.left_open import left_open
from sysid.noise import NoiseFloor
from sysid.plausible import Reason
from sysid.refused import Refused
from sysid.simulate import simulate, write
from sysid.statement import where
from sysid.statement.laws import tone
from sysid.statement.verdicts import dependences
from sysid.statement.verdicts import verdict as entry_of
from sysid.statement.words import elsewhere
from sysid.transfer import Transfer
from sysid.unexplained import changed, smeared
from sysid.view import first_view
from sysid.vocabulary import find

# ---- verdicts, by hand

JOINTS = ("shoulder", "elbow")
NOISE = Unknown(np.array([3.0, -4.0, 1.0, -2.0, 2.0, -3.0, 1.0, -1.0, 0.0, 1.0]), np.zeros(0), {"q_elbow": 0.001}, np.full(10, 10.0))


def left(share: float) -> Unknown:
    """Functions of the motion predict a share of what is left, evenly over folds."""
    gain = 100.0 * share * (1.0 + 0.1 * np.array([1, -1, 2, -2, 0, 1, -1, 0, 1, -1]))
    return Unknown(gain, np.zeros(0), {"q_elbow": share, "time": 0.01}, np.full(10, 10.0), chance=1e-6)


def fitted(elbow: float, shoulder: float = 1.0, train: float | None = None):
    rms = {"test": {"shoulder": shoulder, "elbow": elbow}}
    rms["train"] = rms["test"] if train is None else {"shoulder": shoulder, "elbow": train}
    return SimpleNamespace(joints=JOINTS, rms=rms.get, weights=None, model=SimpleNamespace(terms=(), coefficients=()), certificate=SimpleNamespace(at_zero={}))


def looked(elbow: float, at_zero=()):
    """A view whose joints leave so much, of which the elbow's friction is held at zero or not."""
    problem = SimpleNamespace(certify=lambda x: SimpleNamespace(at_zero={*at_zero}), coordinates=SimpleNamespace(held=[False]))
    model = SimpleNamespace(coefficients=(SimpleNamespace(joint=1, effect="viscous"),))
    return SimpleNamespace(model=model, rms=lambda: np.array([1.0, elbow]), settled=SimpleNamespace(problem=problem, x=None))


SAME = looked(1.0), looked(1.0)


def claim(effect: str, joint: str, shares, after, views=SAME):
    number = -1 if joint == "*" else JOINTS.index(joint)
    head = SimpleNamespace(effect=effect, joint=joint, candidate=SimpleNamespace(joint=number), tied_with=(), command=f"sysid add x {effect}")
    return SimpleNamespace(head=head, step=SimpleNamespace(shares=np.array(shares), before=views[0], after=views[1]), after=after, set=((effect, joint, 1.0),))


def floor(value: float | None = 1.0, std: float = 0.02) -> NoiseFloor:
    return NoiseFloor(value, None if value is None else std, "spectral", "the band is narrow")


def elbow(first: float, claims=(), *, rest=NOISE, level=None, refused=(), train=None):
    """The elbow's verdict; the noise floor is one."""
    found = verdicts(fitted(first, train=train), claims, [NOISE, rest], [floor(), level or floor()], refused)
    assert [v.joint for v in found] == list(JOINTS) and found[0].status in ("complete", "explained")
    return found[1]


@pytest.mark.parametrize(
    ("fall", "told", "size", "all_", "stands"),
    [
        (0.5, 0.5, 0.001, 0.0, True), (0.006, 0.006, 0.5, 0.005, True), (0.004, 0.5, 0.5, 0.0, False), (0.001, 0.001, 0.001, 0.0, False), (-0.001, 0.5, 0.5, 0.0, False),
        (1e-5, 0.5, 0.5, 0.0, False), (0.5, 0.5, 0.5, 0.02, False), (0.5, -0.3, 0.001, 0.0, False), (0.5, -0.3, 0.5, 0.0, False), (0.5, 0.001, 0.5, 0.0, True),
        (0.019, 0.5, 0.19, 0.0, False), (0.021, 0.5, 0.19, 0.0, True), (0.019, 0.5, 0.21, 0.0, True), (0.5, 0.019, -0.19, 0.0, False),
    ],
)  # fmt: skip
def test_what_is_nothing_in_size_and_error_is_not_claimed(monkeypatch, fall, told, size, all_, stands):
    """Errors are told to 0.01, the size to 0.1. Nor what the other joints pay for.

    The fall is that under the prior of the fit before, and the one that `sysid add` shows.
    """
    after, shown = fitted(1.0, train=0.9), fitted(1.0, train=0.9)
    falls = lambda before, one: [Difference("", "", "elbow", -(told if one is shown else fall), 0.01)]  # noqa: E731
    monkeypatch.setattr(borne_out.comparison, "compare", falls)
    monkeypatch.setattr(borne_out.comparison, "together", lambda *_, **__: Difference("", "", "*", all_, 0.01))
    monkeypatch.setattr(borne_out, "size_told", lambda fit, *_: fit is shown and abs(size) > 2.0 * 0.1)
    candidate = Candidate(find("warmup"), 1, ())
    assert (borne_out.in_doubt(fitted(1.0, train=1.0), after, shown, candidate) is None) is stands


@pytest.mark.parametrize(("under", "told", "stands"), [(0.2, -0.6, True), (-0.6, 0.2, False), (-0.6, 0.005, True), (0.2, 0.1, False), (-0.6, -0.6, True)])
def test_an_effect_of_the_whole_robot_stands_under_either_prior(monkeypatch, under, told, stands):
    """A prior that held the bodies against what was missing may hold them against the effect: then what `sysid add` gives counts. Where
    that rises by more than its standard error `sysid add` would refuse it."""
    before, after, shown = fitted(1.0, train=1.0), fitted(1.0, train=0.9), fitted(1.0, train=0.9)
    monkeypatch.setattr(borne_out.comparison, "together", lambda _, one, **__: Difference("", "", "*", told if one is shown else under, 0.01))
    candidate = Candidate(find("gravity_tilt"), -1, ())
    assert (borne_out.in_doubt(before, after, shown, candidate) is None) is stands


@pytest.mark.parametrize(
    ("effect", "all_", "stands"), [("encoder_offset", -0.03, True), ("encoder_offset", -0.008, False), ("encoder_offset", 0.0, False), ("warmup", -0.03, False)]
)
def test_what_moves_a_joint_may_show_in_the_torque_of_another(monkeypatch, effect, all_, stands):
    """The error of its own joint hardly falls, that of all together by three standard errors, or less than one."""
    monkeypatch.setattr(borne_out.comparison, "compare", lambda *_: [Difference("", "", "elbow", -0.001, 0.01)])
    monkeypatch.setattr(borne_out.comparison, "together", lambda *_, **__: Difference("", "", "*", all_, 0.01))
    monkeypatch.setattr(borne_out, "size_told", lambda *_: True)
    after = fitted(1.0, train=0.9)
    candidate = Candidate(find(effect), 1, ())
    assert (borne_out.in_doubt(fitted(1.0, train=1.0), after, after, candidate) is None) is stands


@pytest.mark.parametrize(
    ("elbow", "wrist", "said"),
    [(0.999, 1.8, ", that of wrist from 2 to 1.8 N m"), (0.9, 1.8, ""), (0.999, 1.999, ""), (0.999, 2.1, "")],
)  # fmt: skip
def test_the_joint_whose_error_falls_in_its_place_is_told(elbow, wrist, said):
    joints = {joint: {"rms": {"test": rms}} for joint, rms in (("elbow", 1.0), ("wrist", 2.0), ("still", None))}
    assert elsewhere("elbow", joints, {"elbow": elbow, "wrist": wrist, "still": None}, {"wrist": "N m"}) == said


@pytest.mark.parametrize(
    ("share", "words"), [(-2.6e-15, "+0 %"), (-0.0023, "-0.23 %"), (0.23, "+23 %"), (0.9949, "+99 %"), (1.0, "+100 %"), (11.8, "+1180 %"), (-1e-7, "+0 %")]
)  # fmt: skip
def test_a_change_is_told_in_per_cent(share, words):
    assert changed(share) == words


@pytest.mark.parametrize("error", [1.0, 1.3])
def test_what_does_not_carry_over_is_said_whatever_the_verdict(error):
    found = verdicts(
        fitted(error, train=1.0), (), [NOISE, NOISE], [floor(), floor()],
        carried=[Transfer("shoulder", 1.2, 0.1, (3.0,)), Transfer("elbow", 1.5, 0.1, (2.0, 4.0))],
    )  # fmt: skip
    shoulder, own = (entry_of(v) for v in found)
    assert "says" not in shoulder and own["status"] == ("complete" if error == 1.0 else "unresolved")
    assert own["says"].endswith("(places, motions, forces): its error there is 1.50 +- 0.1 times as large")
    assert "carries_over" not in shoulder and own["carries_over"] is False
    assert where.apart({"verdict": [shoulder, own]}) == ([] if error == 1.0 else ["elbow"])


def test_at_the_floor_it_is_complete():
    found = elbow(1.05)
    assert found.status == "complete" and not found.claims and found.left is None and found.says == ""
    # a floor in doubt counts to its doubt: a tenth, and two deviations
    assert elbow(1.139).status == "complete" and elbow(1.141).status == "unresolved"
    assert elbow(1.3, level=floor(std=0.11)).status == "complete"


def test_an_error_that_no_row_has_measured_is_not_at_the_floor():
    """A joint that rests, or is braked, on all test logs."""
    found = elbow(0.0, train=0.9)
    assert found.status == "unresolved" and "none of its rows on the test logs counts" in found.says


def test_an_effect_on_it_is_missing():
    bias = claim("torque_bias", "elbow", [0.0, 0.8], fitted(1.1))
    found = elbow(2.0, [bias])
    assert found.status == "missing" and found.claims == (bias,)
    # of 3 above the floor's square, 4 - 1.21 is taken
    assert found.explained == pytest.approx(2.79 / 3.0)
    said = entry_of(found)
    assert said["effect"] == "torque_bias" and said["set"] == [{"effect": "torque_bias", "joint": "elbow", "probability": 1.0}]
    assert said["command"] == "sysid add x torque_bias" and said["also"] == [] and said["explained"] == found.explained


@pytest.mark.parametrize("share, only", [(0.19, True), (0.3, False)])
def test_a_tone_that_is_all_that_is_left_is_no_law_of_the_motion(share, only):
    left = {"depends_on": [{"variable": "a steady tone", "share": 0.19, "hertz": 13.0}], "share_left": share}
    assert bool(tone(left)) is only and (not only or tone(left).startswith("a steady tone of 13 Hz holds 19 % of what is left: a hum"))
    assert tone({"depends_on": [{"variable": "q_elbow", "share": 0.4}], "share_left": 0.4}) == tone({}) == ""


@pytest.mark.parametrize("at_zero, status", [((), "unknown"), ((0,), "missing")])
def test_what_friction_that_may_be_negative_takes_is_counted_where_a_fit_holds_it_at_zero(at_zero, status):
    """In slow motion negative friction is most of a Stribeck effect: that takes a third of a design's squares and all of a fit's."""
    stribeck = claim("stribeck", "elbow", [0.0, 0.3], fitted(1.1), (looked(4.0, at_zero), looked(0.5)))
    assert elbow(4.0, [stribeck], rest=left(0.5)).status == status


def test_two_effects_stand_in_their_order():
    first, second = claim("torque_bias", "elbow", [0.0, 0.5], fitted(1.5)), claim("spring", "elbow", [0.0, 0.3], fitted(1.0))
    found = elbow(2.0, [first, second])
    assert found.claims == (first, second) and entry_of(found)["also"] == ["spring"] and len(entry_of(found)["commands"]) == 2
    assert found.explained == pytest.approx(1.0)


def test_what_another_joint_s_effect_explains_is_explained():
    """The elbow's error falls to its floor with an effect of the shoulder: the elbow lacks nothing of its own."""
    other = claim("stribeck", "shoulder", [0.9, 0.3], fitted(1.02, 1.0))
    found = verdicts(fitted(1.5, 3.0), [other], [NOISE] * 2, [floor()] * 2)
    assert [v.status for v in found] == ["missing", "explained"]
    assert found[1].claims == (other,) and found[1].explained == pytest.approx((1.5**2 - 1.02**2) / (1.5**2 - 1.0))
    assert entry_of(found[1])["by"] == [{"effect": "stribeck", "joint": "shoulder"}]
    # one that was at its floor before is complete, whatever else joined
    found = verdicts(fitted(1.05, 3.0), [other], [NOISE] * 2, [floor()] * 2)
    assert [v.status for v in found] == ["missing", "complete"]


def test_an_effect_of_the_robot_is_missing_where_it_matters():
    tilt = claim("gravity_tilt", "*", [0.8, 0.5 * WORTH], fitted(1.0, 1.0))
    found = verdicts(fitted(1.02, 3.0), [tilt], [NOISE] * 2, [floor()] * 2)
    assert [v.status for v in found] == ["missing", "complete"]


def test_an_effect_of_the_robot_is_no_name_for_a_joint_whose_error_stays():
    """A load that another joint carries: by a twentieth of a per cent the elbow's error falls in any case."""
    load = claim("payload", "*", [0.9, 0.5], fitted(1.999, 1.0))
    found = verdicts(fitted(2.0, 3.0), [load], [NOISE] * 2, [floor()] * 2)
    assert [v.status for v in found] == ["missing", "unresolved"] and not found[1].claims


def test_at_a_joint_that_is_complete_nothing_is_asked_of_the_test_logs_alone():
    asked = []
    few = lambda j, least, soft: asked.append(JOINTS[j])  # noqa: E731
    verdicts(fitted(1.05, 2.0), [], [NOISE] * 2, [floor()] * 2, few=few)
    assert asked == ["shoulder"]
    verdicts(fitted(1.05, 2.0), [], [NOISE, left(0.6)], [floor()] * 2, few=few)
    assert asked == ["shoulder", "shoulder", "elbow"]


def test_what_the_motion_predicts_and_no_effect_does_is_unknown():
    found = elbow(2.0, rest=left(0.6))
    assert found.status == "unknown" and found.left is not None
    said = entry_of(found)
    assert said["depends_on"] == [{"variable": "q_elbow", "share": 0.6}] and said["share_left"] == pytest.approx(0.6) and said["also"] == []
    # nothing above the floor is left: it predicts the noise's own colour at most
    assert elbow(1.01, rest=left(0.6)).status == "complete"
    # at the floor as far as that is known, and not by its standard error
    assert elbow(1.08, rest=left(0.6)).status == "unknown"
    assert elbow(1.08).status == "complete"
    assert elbow(2.0, rest=left(0.6 * WORTH)).status == "unresolved"


@pytest.mark.parametrize(
    ("taken", "share", "status"),
    [(0.2, 0.5, "unknown"), (0.6, 0.5, "unknown"), (0.7, 0.5, "unknown"), (0.9, 0.3, "missing"), (0.2, 0.05, "unknown"), (0.4, 0.05, "missing")],
)
def test_nearly_all_gives_the_name(taken, share, status):
    """An effect took a share of all; of the rest functions of the motion predict a share still, which may be a tenth of that: another
    law that an effect only resembles leaves more."""
    found = elbow(3.0, [claim("cogging", "elbow", [0.0, taken], fitted(1.6))], rest=left(share))
    assert found.status == status and found.left is not None
    said = entry_of(found)
    assert (said["effect"] == "cogging") if status == "missing" else (said["also"] == ["cogging"] and "effect" not in said)


@pytest.mark.parametrize(
    ("first", "then", "train", "noise", "status", "says"),
    [
        (3.0, 2.5, 2.5, 1.0, "unknown", "its error is 2.5 times the noise floor"), (3.0, 1.7, 1.7, 1.0, "unknown", ""), (3.0, 1.6, 1.6, 1.0, "missing", ""), (1.6, 1.4, 1.4, 1.0, "unknown", "its error is 1.4 times the noise floor"),
        (1.6, 1.25, 1.25, 1.0, "missing", ""), (1.2, 1.12, 1.12, 1.0, "missing", ""), (1.2, 1.1, 1.1, 1.0, "missing", ""), (1.4, 1.39, 1.39, 1.0, "unknown", ""),
        (3.0, 2.5, 1.1, 1.0, "missing", ""), (3.0, 2.5, 1.2, 1.0, "unknown", ""), (3.0, 2.5, 2.5, None, "unknown", "its noise floor is not known (the band is narrow)"), (3.0, 1.3, 1.3, None, "missing", ""),
    ],
)  # fmt: skip
def test_what_leaves_more_than_a_fifth_is_no_name_for_the_misfit(first, then, train, noise, status, says):
    """Four fifths of what stands above the floor, or what leaves mostly noise and no more above it than it took, or brings the training logs to it; where the floor is not known, of all. What takes less than half of it in both is small."""
    found = elbow(first, [claim("presliding", "elbow", [0.0, 0.5], fitted(then, train=train))], level=floor(noise))
    said = entry_of(found)
    assert found.status == status and says in found.says and found.small is (then == 1.12)
    assert found.explained == pytest.approx((first**2 - then**2) / (first**2 - (noise or 0.0) ** 2))
    if status == "unknown":
        assert said["also"] == ["presliding"] and said["depends_on"] == [] and said["commands"] == ["sysid add x presliding"]


@pytest.mark.parametrize(
    ("about", "train", "status"), [(2.6, 2.5, "missing"), (2.4, 2.5, "missing"), (1.2, 2.5, "unknown"), (None, 2.5, "unknown"), (2.4, 1.0, "unknown")]
)
def test_what_may_be_noise_is_not_held_against_a_name(about, train, status):
    """Where the floor is not known, the best estimate of it says how much of what an effect leaves is misfit; no noise is louder than what the training logs leave."""
    level = NoiseFloor(None, None, "none", "the log is too short", 0.5, 2.7, about)
    found = elbow(3.0, [claim("cogging", "elbow", [0.0, 0.3], fitted(2.5, train=train))], level=level)
    assert found.status == status and found.explained == pytest.approx((9.0 - 6.25) / (9.0 - 0.25))


def test_error_above_the_floor_that_nothing_predicts_is_unresolved():
    found = elbow(2.0)
    assert found.status == "unresolved" and "2 times the noise floor" in found.says
    refused = Refused(effect="backlash", joint="elbow", why="its parameters are nothing")
    assert "backlash was looked at and is not claimed: its parameters are nothing" in elbow(2.0, refused=[refused]).says
    assert "backlash" not in elbow(2.0, refused=[Refused(effect="backlash", joint="shoulder", why="x")]).says


@pytest.mark.parametrize(
    ("joint", "share", "status"), [("elbow", 0.9, "unresolved"), ("*", 0.9, "unresolved"), ("elbow", 0.1, "unknown"), ("shoulder", 0.9, "unknown")]
)
def test_what_test_logs_bear_out_under_the_low_pass_and_no_fit_does_is_not_called_a_law_that_nobody_knows(joint, share, status):
    """What functions of the motion predict then is that effect: half of it at least."""
    what = SimpleNamespace(name="elasticity", joint=1)
    refused = Refused("elasticity", joint, "the error on the test logs does not fall", what, 0.001, np.array([0.9, share]))
    found = elbow(3.0, rest=left(0.5), refused=[refused])
    assert found.status == status and found.may is None
    assert ("takes 90 %" in refused.told) is (share == 0.9)  # not what it takes of the other joint
    assert "torque: low-pass" not in refused.told  # the fit sees both sides so, or nothing stands there
    assert ("torque: low-pass" in replace(refused, raw=True).told) is (share == 0.9)
    assert ("what is left may be elasticity, though no fit with it bore that out" in found.says) is (status == "unresolved")


@pytest.mark.parametrize(("weighed", "train", "told"), [(1.05, 2.0, True), (1.6, 2.0, False), (1.05, 1.0, True), (2.0, 2.0, False)])
def test_what_only_the_weights_of_the_joints_leave_is_said_to_be_theirs(weighed, train, told):
    """Where most of what stands above the floor goes when each joint counts by its noise."""
    fit, floors = fitted(2.0, train=train), [floor(), floor()]
    says = verdicts(fit, (), [NOISE, NOISE], floors, weighed={"elbow": weighed})[1].says
    assert ("`weighting: noise` under `solver:`" in says) is told and "2 times the noise floor" in says or not told
    fit.weights = np.ones(2)  # they do count so
    assert "weighting" not in verdicts(fit, (), [NOISE, NOISE], floors, weighed={"elbow": weighed})[1].says


@pytest.mark.parametrize("level", [floor(None), floor()])
def test_whose_misfit_bends_a_quiet_joint_is_told_though_its_floor_is_not_known(level):
    """The shoulder's misfit is nine times the elbow's, whatever its own noise is: the joint that others are asked to blame."""
    says = verdicts(fitted(2.0, shoulder=6.0), (), [NOISE, NOISE], [level, floor()], weighed={"elbow": 1.05, "shoulder": 6.0})[1].says
    assert "the greater one of shoulder bends the bodies" in says


@pytest.mark.parametrize(
    ("took", "rest", "status"), [(0.85, NOISE, "missing"), (0.75, NOISE, "unknown"), (0.85, left(0.6), "unknown"), (None, NOISE, "unknown")]
)
def test_what_takes_nearly_all_where_all_joints_count_alike_stands(took, rest, status):
    """A louder joint bends the bodies of a quiet one, whose error falls by little in a fit that weighs all alike, and whose floor nobody knows:
    under the low-pass, each joint weighed by its own, one effect takes more than four fifths of it."""
    known = {} if took is None else {"took": [0.0, took]}
    claims = [claim("stribeck", "elbow", [0.0, 0.5], fitted(2.5))]
    found = verdicts(fitted(3.0), claims, [NOISE, rest], [floor(), floor(None)], **known)
    assert found[1].status == status
    # where the floor is known, other weights would have said so
    assert verdicts(fitted(3.0), claims, [NOISE, rest], [floor(), floor()], **known)[1].status == "unknown"


def test_what_is_left_with_other_weights_may_still_be_unknown():
    """With `weighting: noise` the error would be 1.35 times the floor, and the motion predicts half of that; not where it would be no more than noise."""
    known = {"weighed": {"elbow": 1.35}}
    assert verdicts(fitted(2.0), (), [NOISE, left(0.5)], [floor(), floor()], **known)[1].status == "unknown"
    assert verdicts(fitted(2.0), (), [NOISE, left(0.5)], [floor(), floor()], weighed={"elbow": 1.01})[1].status == "unresolved"
    found = verdicts(fitted(2.0), (), [NOISE, NOISE], [floor(), floor()], **known)[1]
    assert found.status == "unresolved" and "it would be 1.4 times the noise floor" in found.says


@pytest.mark.long
def test_the_weights_do_what_the_verdict_says_of_them(tmp_path):
    """An elbow six times as quiet as the shoulder, in slow noise: what is said of its error holds when it is done."""
    experiment, machine = robots.experiment_of("planar", tmp_path)
    case = next(c for c in cases.cases(53912, "full", "clean") if c.key == "planar/control/12")
    options = {"seed": case.seed, "duration": 20.0, "rate": 500.0, "colour": case.colour, "encoder": case.encoder}
    write(simulate(machine, **options), experiment, tmp_path / "logs")
    experiment = pipeline.load(tmp_path / "logs")
    experiment = experiment.model_copy(update={"solver": experiment.solver.model_copy(update={"weighting": "none"})})
    found = diagnose(experiment)
    (verdict,) = (v for v in found.verdict if v.joint == "elbow")
    assert verdict.even and verdict.may is None
    said = re.search(r"`weighting: noise` .* it would be (at|[0-9.]+ times) the noise floor", verdict.says)[1]
    times = 1.0 if said == "at" else float(said.split()[0])
    solver = experiment.solver.model_copy(update={"weighting": "noise"})
    after = pipeline.fit(experiment.model_copy(update={"solver": solver}))
    error = max(after.rms(part)["elbow"] for part in ("train", "test"))
    assert error == pytest.approx(times * found.floors["elbow"].rms, rel=0.1) and error < 0.9 * found.fit.rms("test")["elbow"]


def test_a_floor_that_nobody_knows_leaves_it_unresolved():
    found = elbow(1.0, level=floor(None))
    assert found.status == "unresolved" and "noise floor is not known (the band is narrow)" in found.says
    # what is there is named all the same, and what it explains is told of what can be known
    found = elbow(2.0, [claim("torque_bias", "elbow", [0.0, 0.8], fitted(0.8))], level=floor(None))
    assert found.status == "missing" and found.explained == pytest.approx((4.0 - 0.64) / 4.0)
    assert elbow(2.0, rest=left(0.6), level=floor(None)).status == "unknown"


def test_training_logs_explained_and_test_logs_not():
    found = elbow(2.0, train=1.0)
    assert found.status == "unresolved" and "does not carry over" in found.says


def test_an_error_at_the_floor_on_test_logs_alone_is_not_complete():
    """The training logs fail, so the floor is not reached."""
    assert elbow(1.0, train=2.0).status == "unresolved"


def test_dependences_are_sorted_and_say_something():
    found = Unknown(np.full(10, 20.0), np.zeros(0), {"a": 0.05, "b": 0.3, "c": 0.01}, np.full(10, 10.0))
    assert dependences(found) == [{"variable": "b", "share": 0.3}, {"variable": "a", "share": 0.05}]
    alone = Unknown(np.full(10, 20.0), np.zeros(0), {"a": 0.0}, np.full(10, 10.0))
    assert dependences(alone) == [{"variable": "several variables together", "share": pytest.approx(0.2)}]


def test_predictable_is_a_level_and_a_share():
    asked = lambda found, joints: found.predictable(joints, WORTH)  # noqa: E731
    assert asked(left(0.3), 2) and not asked(NOISE, 2) and not asked(left(0.9 * WORTH), 2)
    by_chance = replace(left(0.3), chance=0.3 * LEVEL)  # half of it for each of two questions
    assert asked(by_chance, 1) and not asked(by_chance, 2)  # a level for all joints together
    assert asked(replace(NOISE, tone=2.0 * WORTH), 2) and not asked(replace(NOISE, tone=0.9 * WORTH), 2)


@pytest.mark.parametrize(
    ("first", "then", "taken", "rest", "status"),
    [(3.0, 1.1, 0.99, 0.05, "explained"), (3.0, 1.2, 0.9, 0.05, "explained"), (3.0, 1.2, 0.8, 0.9, "unknown"), (3.0, 1.9, 0.6, 0.05, "unknown"), (1.2, 1.12, 0.9, 0.05, "explained")],
)  # fmt: skip
def test_a_joint_that_anothers_effect_explains_but_for_a_little_is_explained(first, then, taken, rest, status):
    """And not `complete`, be it that its error before is near to the floor."""
    found = elbow(first, [claim("cogging", "shoulder", [0.5, taken], fitted(then))], rest=left(rest))
    assert found.status == status
    if status == "explained":
        assert entry_of(found)["by"] == [{"effect": "cogging", "joint": "shoulder"}] and 0.0 < entry_of(found)["explained"] <= 1.0


@pytest.mark.parametrize("low", [0.5, 2.0, 3.5])
def test_a_share_that_is_told_is_one(low):
    """Where the floor is not known, or all of the error may be noise."""
    level = replace(floor(None), low=low, about=low)
    found = elbow(3.0, [claim("cogging", "shoulder", [0.5, 0.9], fitted(1.1))], rest=left(0.05), level=level)
    assert found.status == "explained" and 0.0 < entry_of(found)["explained"] <= 1.0
    own = elbow(3.0, [claim("cogging", "elbow", [0.0, 0.95], fitted(1.1))], level=level)
    assert own.status == "missing" and 0.0 < entry_of(own)["explained"] <= 1.0


def test_a_tone_alone_is_unknown_and_its_share_is_said():
    hum = replace(NOISE, tone=0.4, hertz=7.3, shares={"a steady tone": 0.4})
    found = elbow(2.0, rest=hum)
    assert found.status == "unknown"
    said = entry_of(found)
    assert said["depends_on"] == [{"variable": "a steady tone", "share": 0.4, "hertz": 7.3}] and said["share_left"] == pytest.approx(0.4)
    # and it is weighed against what effects took
    assert elbow(3.0, [claim("cogging", "elbow", [0.0, 0.1], fitted(1.6))], rest=hum).status == "unknown"
    assert elbow(3.0, [claim("cogging", "elbow", [0.0, 0.78], fitted(1.6))], rest=hum).status == "unknown"  # 0.088 beside 0.78
    assert elbow(3.0, [claim("cogging", "elbow", [0.0, 0.82], fitted(1.6))], rest=hum).status == "missing"


def test_a_joint_at_its_floor_that_drifts_with_time_alone_is_complete():
    """Noise that is slower than the blocks looks like a law of time; friction that changes with time goes with the direction, too."""
    drift = replace(left(0.3), shares={"time": 0.3})
    assert elbow(1.08, rest=drift).status == "complete"
    assert elbow(2.0, rest=drift).status == "unknown"  # no drift that a floor holds
    assert elbow(1.08, rest=replace(drift, shares={"time and direction": 0.3, "time": 0.1})).status == "unknown"
    assert elbow(1.08, rest=replace(drift, tone=0.1)).status == "unknown"


# ---- what a log could have shown


class Crosstalk(TorqueEffect):
    """The first joint's angle pulls."""

    name = "crosstalk"
    c = Linear("N m", says="size")
    times = 1.0

    def columns(self, motion, joint):
        return self.times * np.sin(2.0 * motion.q[None, :, 0])


class Doubled(Crosstalk):
    """Twice the same."""

    name = "doubled"
    times = 2.0


@pytest.fixture(scope="module")
def control(simulated):
    """The view of a robot in which nothing is hidden, and its answers."""
    experiment = pipeline.load(simulated("control"))
    view = first_view(experiment, pipeline.fit(experiment))
    extra = [Crosstalk().bound(view.model.robot, 1), Doubled().bound(view.model.robot, 1)]
    return view, extra, ask(view, extra)


def sizes(control) -> dict:
    view, extra, asked = control
    return {d.candidate.key: d for d in detectable(view, asked, candidates(view.model, extra))}


def test_the_smallest_size_is_as_the_inverse_of_the_column(control):
    found = sizes(control)
    for joint in range(2):
        one, two = found["crosstalk", joint], found["doubled", joint]
        assert one.size == pytest.approx(2.0 * two.size, rel=1e-6) and one.size > 0
        assert (one.parameter, one.unit, one.power) == ("c", "N m", 0.9)


def test_every_effect_has_its_size_or_is_absorbed(control):
    view, extra, _ = control
    found = sizes(control)
    assert set(found) == {c.key for c in candidates(view.model, extra) if c.parameters}
    assert found["payload", -1].size is None  # the last link's own inertia is a payload
    known = [d.size for d in found.values() if d.size is not None]
    assert len(known) > 20 and np.isfinite(known).all() and min(known) > 0
    # what has a shape says at which, and what has none says nothing
    assert set(found["stribeck", 0].at) == {"vs"} and found["stribeck", 0].at["vs"] > 0
    assert found["quadratic_drag", 0].at == found["delay", 0].at == {}


@pytest.mark.long
@pytest.mark.parametrize(("effect", "joint", "values"), [("quadratic_drag", 0, "c={}"), ("spring", 1, "k={},q0=0")])
def test_twice_the_size_is_found_and_a_fifth_is_not(control, simulated, effect, joint, values):
    """The set holds it: at that size more than one effect may explain it."""
    size, named = sizes(control)[effect, joint].size, {}
    for times in (0.2, 2.0):
        hide = f"{effect}:{JOINTS[joint]}:{values.format(f'{times * size:.6g}')}"
        experiment = pipeline.load(simulated(f"{effect}-{times}", hide))
        steps, *_ = search(first_view(experiment, pipeline.fit(experiment)), most=1)
        named[times] = [(m.candidate.name, m.candidate.joint) for s in steps for m, _ in s.choice.members]
    assert named[0.2] == [] and (effect, joint) in named[2.0], (size, named)


# ---- asked once more, of joints above their floors


def asked_of_elbow(error: float, *, gain: float = 0.3, chance: float = 1e-3, near=None, weighed=None, beyond=None, **more):
    """The elbow's verdict where ridge regression says nothing; the joints that were asked what their blocks agree on."""
    seen = []

    def agreed(j: int) -> Law:
        seen.append(j)
        return Law(chance, "q_elbow and qd_shoulder", gain)

    found = verdicts(
        fitted(error), [], [NOISE, NOISE], [floor(), floor()], (), (), weighed, agreed, lambda j, own, there: near if own > 0 else None, beyond=beyond, **more
    )
    return found[1], seen


def test_blocks_are_asked_of_joints_above_their_floors_alone():
    found, seen = asked_of_elbow(3.0)
    assert found.status == "unknown" and seen == [1] and found.left.single == pytest.approx(0.3)
    found, seen = asked_of_elbow(1.0)
    assert found.status == "complete" and seen == []
    # at the floor as far as that is known, and a law stands out all the same
    found, seen = asked_of_elbow(1.08)
    assert found.status == "unknown" and seen == [1]
    # nor where the weights of the fit are all of it
    found, seen = asked_of_elbow(3.0, weighed={"shoulder": 1.0, "elbow": 1.01})
    assert found.status == "unresolved" and seen == []


def test_what_training_logs_show_in_too_few_places_is_asked_of_the_test_logs():
    """A law stands out on both, and no effect of the training logs' blocks: what takes half as much on the test logs may be it."""
    stribeck, asked = Candidate(find("stribeck"), 1, ()), []

    def few(j: int, least: float, soft: bool):
        assert not soft  # where the motion predicts the rest, it is no joint that swings unseen
        asked.append((j, least))
        return (stribeck, 1.0) if least <= 0.15 else None

    found, _ = asked_of_elbow(3.0, gain=0.3, few=few)
    assert asked == [(1, pytest.approx(0.15))] and (found.status, found.may) == ("unresolved", stribeck)
    found, _ = asked_of_elbow(3.0, gain=0.5, few=few)
    assert (found.status, found.may) == ("unknown", None)
    asked.clear()
    asked_of_elbow(1.0, few=few)
    asked_of_elbow(3.0, near=(stribeck, 0.02), few=few)
    assert asked == []  # at the floor, and where blocks say what it may be


@pytest.mark.parametrize(("before", "after", "status"), [(1.15, 1.02, "explained"), (1.15, 1.14, "complete"), (1.09, 1.0, "complete")])
def test_a_joint_near_its_floor_whose_error_another_claim_lowers_is_explained(before, after, status):
    """Above a tenth, within two standard errors; worth having is what lowers an error by 1.5 %."""
    other, level = claim("stribeck", "shoulder", [0.9, 0.3], fitted(after, 1.0)), replace(floor(), std=0.05)
    assert verdicts(fitted(before, 3.0), [other], [NOISE] * 2, [floor(), level])[1].status == status


@pytest.mark.parametrize(("louder", "status"), [(2.8, "complete"), (1.0, "unresolved")])
def test_noise_that_is_louder_in_the_test_logs_is_no_misfit(louder, status):
    loud = Transfer("elbow", 3.0, 0.1, (20.0,), 15.0, louder)
    found = verdicts(fitted(3.0, train=1.0), (), [NOISE] * 2, [floor()] * 2, carried=[loud])[1]
    assert found.status == status and "what is faster than 15 Hz" in found.carries.says
    # nor does a claim of another joint, which takes nothing of it, explain it
    other = claim("stribeck", "shoulder", [0.9, 0.0], fitted(3.0, 1.0, train=1.0))
    found = verdicts(fitted(3.0, 3.0, train=1.0), [other], [NOISE] * 2, [floor()] * 2, carried=[loud])[1]
    assert found.status == status


def test_another_mean_in_each_log_is_no_law():
    """What functions of the motion predict by saying which log it is."""
    found, _ = asked_of_elbow(3.0, means={"elbow": Reason("another mean in each log")})
    assert found.status == "unresolved" and found.says.startswith("another mean in each log") and found.left is not None
    found, _ = asked_of_elbow(3.0, means={"shoulder": Reason("another mean in each log")})
    assert found.status == "unknown"
    quiet, _ = asked_of_elbow(3.0, chance=0.5, means={"elbow": Reason("another mean")})
    assert "another mean" not in quiet.says  # nothing is predicted that it would be
    found, _ = asked_of_elbow(3.0, near=(Candidate(find("stribeck"), 1, ()), 0.02), means={"elbow": Reason("another mean")})
    assert found.status == "unresolved" and found.says.startswith("what is left may be stribeck")
    # where about its means the error is noise, nothing else need be there, and no log carries a zero
    all_of_it = {"elbow": Reason("what is left is another mean in each log", settles=True)}
    for near in (None, (Candidate(find("stribeck"), 1, ()), 0.02)):
        found, _ = asked_of_elbow(3.0, near=near, means=all_of_it)
        assert found.status == "unresolved" and found.says == all_of_it["elbow"].says and found.reason is all_of_it["elbow"] and found.may is None
    moved = [Transfer("elbow", 3.0, 0.1, (20.0,))]
    for means, carries in ((all_of_it, False), ({}, True)):
        found = verdicts(fitted(3.0, train=1.0), (), [NOISE] * 2, [floor()] * 2, carried=moved, means=means)[1]
        assert found.status == "unresolved" and bool(found.carries) is carries


@pytest.mark.parametrize(
    ("square", "floor", "said"), [(0.5, 0.9, True), (0.5, 0.5, True), (0.2, 0.5, False), (0.2, None, False), (0.6, None, True), (0.2, 1.1, False)]
)
def test_a_mean_by_log_is_told_where_it_is_most_of_what_is_no_noise(monkeypatch, square, floor, said):
    monkeypatch.setattr(mean_by_log, "other_means", lambda fit, logs, still: {"elbow": (square / 1.0, square, "+1 in a.csv")})
    fit = SimpleNamespace(joints=("shoulder", "elbow"), logs=(), rms=lambda part: {"elbow": {"train": 1.0, "test": 0.5}[part]})
    for left, begins in ((0.9, "what is left is another mean"), (2.0, "most of what is left is another mean")):
        monkeypatch.setattr(mean_by_log, "centred", lambda fit: SimpleNamespace(rms=lambda part: {"elbow": left}, predictions={}))  # noqa: B023
        level = SimpleNamespace(rms=None if floor is None else floor**0.5, low=None, reached=lambda error: error < 1.0)
        found = mean_by_log.by_log(fit, [None, level])
        assert list(found) == ["elbow"] * said
        begins = begins if floor else "most of what is left is another mean"  # nobody knows whether more is missing
        assert not said or ("+1 in a.csv" in found["elbow"].says and found["elbow"].says.startswith(begins))
        assert not said or found["elbow"].settles == begins.startswith("what")


@pytest.mark.parametrize(
    ("effect", "starts", "told"),
    [("friction_change", (0.0, 0.2, 0.0), True), ("friction_change", (0.0, 70.0, 140.0), False), ("stribeck", (0.0, 0.0, 0.0), False)],
)
def test_friction_that_is_another_in_each_log_may_be_warmth_over_one_clock(effect, starts, told):
    """Three logs of a cold, a warmer and a warm robot, each with a clock of its own, hide that time goes on."""

    def logs(own):
        t = np.concatenate([start + np.arange(0.0, 50.0, 0.5) for start in own])
        return SimpleNamespace(t=t, log=np.repeat(np.arange(len(own)), 100), thinned=lambda most: logs(own))

    after = SimpleNamespace(predictions={"train": logs(starts[:2]), "test": logs(starts[2:])})
    claims = [SimpleNamespace(head=SimpleNamespace(effect=effect, joint="elbow"), after=after)]
    found = unexplained.clocks_anew(claims)
    assert len(found) == told and (not told or "`warmup`" in found[0])


def test_of_those_that_test_logs_alone_can_ask_the_one_that_takes_most(monkeypatch):
    groups = [SimpleNamespace(candidate=SimpleNamespace(kind=kind, swings=kind in "sx", blows=kind == "x"), signed=signed, testable=testable, taken=taken) for kind, signed, testable, taken in (
        ("a", True, False, 1.0), ("a", True, False, 2.0), ("b", True, False, -3.0), ("c", True, True, 9.0), ("d", False, False, 9.0), ("e", True, False, 0.0), ("x", True, True, 1.0), ("s", True, True, 1.0)
    )]  # fmt: skip
    shares = {"a": 0.2, "b": 0.6}
    monkeypatch.setattr(unexplained, "HeldOut", lambda settled, test: settled)
    monkeypatch.setattr(unexplained, "fallen", lambda before, after: [0.0, shares[after]])
    seen = []

    def refitted(group):
        seen.append((group.candidate.kind, group.taken))
        kind = group.candidate.kind
        return SimpleNamespace(candidate=kind, view=SimpleNamespace(settled=kind)) if kind in shares else None

    without = SimpleNamespace(test="test")
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.5) == ("b", 1.0)
    assert sorted(seen) == [("a", 2.0), ("b", -3.0), ("e", 0.0), ("s", 1.0)]  # slopes say little of what swings
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.7) is None
    seen.clear()
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.5, soft=False) == ("b", 1.0)
    assert sorted(seen) == [("a", 2.0), ("b", -3.0), ("e", 0.0)]
    assert unexplained.of_few_blocks([], refitted, without, 1, 0.0) is None
    # about reversals, which a low-pass shows none of, a fit may say more
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.7, {"b": 0.8}.get) == ("b", 1.0)
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.7, {"b": 0.4}.get) is None
    seen.clear()
    shares["s"], shares["x"] = 0.2, 0.9  # play is asked where a soft gear takes some
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.5) == ("x", 1.0) and seen[-1] == ("x", 1.0)
    del shares["s"], shares["x"]
    shares["b"] = 0.05
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.7, {"a": 0.9}.get) == ("a", 1.0)
    shares["a"] = 0.05
    assert unexplained.of_few_blocks(groups, refitted, without, 1, 0.7, {"a": 0.9}.get) is None


def test_a_soft_gear_is_asked_for_where_the_training_logs_would_show_it(monkeypatch):
    """Of seven joints at their noise each would take as long as all else."""
    seen = []
    monkeypatch.setattr(what_is_left, "of_few_blocks", lambda *_, soft: seen.append(soft))
    floors = [NoiseFloor(1.0, 0.02, "spectral", "", 0.9, 1.1)] * 2
    fit = SimpleNamespace(joints=("quiet", "loud"), rms=lambda part: {"quiet": 1.05, "loud": 1.5})
    left = what_is_left.Left(None, fit, None, floors, [SimpleNamespace(by_joint={})], None, max, {})
    for j, soft in ((0, True), (1, True), (1, False)):
        left.few(j, 0.5, soft)
    assert seen == [False, True, False]


def test_what_may_come_of_another_joints_effect_is_left_open():
    """Bodies bent by what one joint lacks leave error on others, which is no law that the catalogue lacks."""
    stribeck = Candidate(find("stribeck"), 1, ())
    some, takes = left(0.4), lambda j, candidate: 0.5
    open_ = lambda laws: SimpleNamespace(beyond=laws, fitted=takes, strength=lambda j: None, moments={})  # noqa: E731
    joint = lambda name, status, may=None, claims=(): Verdict(name, status, claims, says="was", may=may, left=some)  # noqa: E731
    said = [joint("a", "unknown"), joint("b", "unresolved", stribeck), joint("c", "unknown"), joint("d", "unknown", claims=(1,)), joint("e", "unknown")]
    laws = {0: Law(1.0, "", 0.0), 2: Law(1e-9, "q_c", 0.3), 3: Law(1.0, "", 0.0), 4: None}
    found = left_open(said, open_(lambda j, candidate: laws[j]), WORTH)
    assert [one.status for one in found] == ["unresolved", "unresolved", "unknown", "unknown", "unknown"]
    assert "may come of stribeck on b" in found[0].says and found[0].may is stribeck and found[0].left is None
    assert found[1:] == said[1:]
    assert left_open(said[2:], open_(lambda j, candidate: laws[0]), WORTH) == said[2:]  # nothing may be there
    tilt = Candidate(find("gravity_tilt"), -1, ())
    (found, _) = left_open([said[0], joint("b", "unresolved", tilt)], open_(lambda j, candidate: laws[0]), WORTH)
    assert "gravity_tilt of the whole robot" in found.says


def test_what_may_be_there_and_takes_nothing_of_a_fit_is_not_to_be_tried():
    """A delay of a joint under a low-pass, of which the fit that would be added makes none."""
    delay = Candidate(find("delay"), 1, ())
    says = unexplained.may_be(delay, in_vain=False) + "; its neighbour is louder"
    said = [Verdict("a", "unknown", left=left(0.4)), Verdict("b", "unresolved", says=says, may=delay)]
    asked = []
    for share, stays in ((0.5, True), (0.0, False)):
        takes = lambda j, one: asked.append((j, one)) or share  # noqa: B023, E731
        found = left_open(said, SimpleNamespace(beyond=lambda j, one: None, fitted=takes, strength=lambda j: None, moments={}), WORTH)
        assert found[0] == said[0] and (found[1] == said[1]) is stays
    assert asked == [(1, delay)] * 2 and found[1].may is None
    assert found[1].says.startswith("what is left may be delay, though no fit with it bore that out") and found[1].says.endswith("its neighbour is louder")


def test_what_is_a_small_part_of_all_that_it_is_claimed_of_is_no_name():
    """An effect of the whole robot is asked on every joint that it is a name for, or a part of one."""
    own, wide = (SimpleNamespace(head=SimpleNamespace(effect=e, joint=j), number=k) for k, (e, j) in enumerate((("cable", "a"), ("gravity_tilt", "*"))))
    on = lambda joint, small, *claims, status="missing": Verdict(joint, status, claims, small=small)  # noqa: E731
    gone = lambda *verdicts: {k: (r.effect, r.joint) for k, r in unexplained.no_names((own, wide), verdicts).items()}  # noqa: E731
    assert gone(on("a", False, own), on("b", False, wide)) == {}
    assert gone(on("a", True, own), on("b", False, wide)) == {0: ("cable", "a")}
    assert gone(on("a", False, own), on("b", True, wide)) == {1: ("gravity_tilt", "*")}
    assert gone(on("a", False, own), on("b", True, wide), on("c", False, wide, status="unknown")) == {}
    smear = NoiseFloor(1.0, 0.02, "spectral", "", 0.9, 1.1, halved=(0.05, 1.05, 1.05))
    assert unexplained.a_part((2.0, 1.7), (2.0, 1.7), replace(smear, halved=None)) and not unexplained.a_part((2.0, 1.7), (2.0, 1.7), smear)


def test_what_is_louder_in_some_of_the_motion_is_told():
    """Of joints that are unresolved for no other reason; accelerations are what filters smear."""
    stribeck = Candidate(find("stribeck"), 3, ())
    said = [Verdict(name, "unresolved", says="nobody can say") for name in "abc"]
    said += [Verdict("d", "unresolved", says="may be", may=stribeck), Verdict("e", "complete"), Verdict("f", "unresolved", even=True)]
    laws = {0: Law(1e-9, "qd_a", 0.3), 1: Law(1e-9, "qdd_b", 0.3), 2: Law(1e-4, "q_c", 0.3)}
    found = left_open(said, SimpleNamespace(beyond=lambda j, one: None, fitted=lambda j, one: 0.5, strength=laws.__getitem__, moments={}), WORTH)
    assert [one.status for one in found] == [one.status for one in said] and found[1:] == said[1:]
    entry = entry_of(found[0])
    assert entry["strength"] == {"follows": "qd_a", "share": 0.3} and "depends_on" not in entry
    assert entry["says"].startswith("nobody can say; how strong what is left is") and "the speed of a" in entry["says"]


def test_a_law_stands_beside_what_is_claimed():
    """Ridge regression says little of what an effect left, one function much: the effect is not all."""
    some = [claim("torque_gain", "elbow", [0.0, 0.8], fitted(1.3))]
    by = lambda share: verdicts(fitted(3.0), some, [NOISE, left(0.2)], [floor(), floor()], law=lambda j: Law(1e-9, "q_elbow and q_shoulder", share))[1]  # noqa: E731
    assert by(0.3).status == "missing" and by(0.9).status == "unknown" and by(0.9).left.share == pytest.approx(0.9)


def test_at_a_floor_what_follows_an_acceleration_is_no_law():
    """It is what inertia makes of the angles' noise, or what a filter leaves; clearly above the floor it may be anything."""
    by = lambda error, of: verdicts(fitted(error), (), [NOISE, NOISE], [floor(), floor()], law=lambda j: Law(1e-9, of, 0.05))[1].status  # noqa: E731
    assert [by(1.08, of) for of in ("qdd_elbow", "qdd_elbow and qd_shoulder", "qd_elbow")] == ["complete", "complete", "unknown"]
    assert by(1.5, "qdd_elbow") == "unknown"


def test_what_explains_the_training_logs_alone_may_be_another_law():
    """At the floor there, and far above it on the test logs, where a function of the motion predicts all that is left."""
    some = [claim("joint_coupling", "elbow", [0.0, 0.87], fitted(1.9, train=1.02))]
    by = lambda share: verdicts(fitted(3.2, train=1.9), some, [NOISE, left(0.2)], [floor(), floor()], law=lambda j: Law(1e-9, "qd_elbow", share))[1]  # noqa: E731
    assert by(0.99).status == "unknown" and by(0.99).explained == pytest.approx(0.72, abs=0.01)
    assert by(0.2).status == "missing"


@pytest.mark.parametrize(("gain", "chance"), [(0.3, 0.2), (0.5 * WORTH, 1e-3)])
def test_blocks_that_agree_by_chance_or_on_little_say_nothing(gain, chance):
    assert asked_of_elbow(3.0, gain=gain, chance=chance)[0].status == "unresolved"


def test_the_catalogue_is_not_said_to_lack_what_an_effect_of_it_may_be():
    found, _ = asked_of_elbow(3.0, near=(SimpleNamespace(name="stribeck"), 0.02))
    assert found.may.name == "stribeck"
    assert found.status == "unresolved" and "what is left may be stribeck or a law" in found.says
    assert found.left is not None  # the variables are told all the same
    # what stands above the level was fitted: it is named, and not to be tried again
    found, _ = asked_of_elbow(3.0, near=(SimpleNamespace(name="warmup"), 0.004))
    assert found.status == "unresolved" and found.may is None
    assert "may be warmup, though no fit with it bore that out, or a law" in found.says


@pytest.mark.parametrize(
    ("further", "status"), [(Law(1e-6, "q_elbow", 0.2), "unknown"), (Law(0.2, "q_elbow", 0.2), "unresolved"), (Law(1e-6, "q_elbow", 0.01), "unresolved"), (None, "unresolved")]
)  # fmt: skip
def test_where_a_law_stands_out_with_the_effect_in_the_model_too_the_effect_is_not_all(further, status):
    """None: the effect cannot join at all, by its sign. Nothing is said of the effect, but that it is not all."""
    stribeck, asked = SimpleNamespace(name="stribeck"), []

    def beyond(j, candidate):
        asked.append((j, candidate))
        return further

    found, _ = asked_of_elbow(3.0, near=(stribeck, 0.02), beyond=beyond)
    assert found.status == status and asked == [(1, stribeck)]
    told = "stribeck may be part of what is left, but not all: with stribeck in the model, the motion still predicts 20 % of the rest"
    assert (found.says == told) is (status == "unknown")
    assert (found.may is None) is (status == "unknown") and found.left.single == pytest.approx(0.3)
    # what ridges predicted without it is nothing that they predict with it
    ridged = verdicts(
        fitted(3.0), [], [NOISE, left(0.5)], [floor(), floor()], near=lambda j, own, there: (stribeck, 0.02), beyond=lambda *_: Law(1e-6, "q", 0.001)
    )
    assert ridged[1].status == "unresolved"
    # where no law stands out without it, nobody looks for one with it
    asked_of_elbow(3.0, chance=0.5, near=(stribeck, 0.02), beyond=beyond)
    assert len(asked) == 1


def test_an_effect_that_may_be_there_is_told_where_nothing_else_predicts_the_rest():
    """It takes half of all that is left then."""
    asked = []

    def near(j: int, own: float, there: bool):
        asked.append((j, own))
        return SimpleNamespace(name="torque_saturation"), 0.012

    for level, says in ((floor(), True), (floor(None), True), (floor(3.0), False)):
        found = verdicts(fitted(3.0), [], [NOISE, NOISE], [floor(), level], near=near)[1]
        assert (found.status, found.may is not None) == (("unresolved", True) if says else ("complete", False))
        assert ("what is left may be torque_saturation or a law" in found.says) is says
    assert {own for _, own in asked} == {NOISE.total}


def test_the_group_of_a_candidate_is_the_best_of_the_sign_it_may_have():
    """Whoever asked: every `ask` makes candidates of its own."""
    group = lambda kind, taken, signed=True: SimpleNamespace(candidate=SimpleNamespace(kind=kind), taken=taken, signed=signed)  # noqa: E731
    groups = [group("spring", 1.0), group("spring", 3.0), group("spring", 5.0, signed=False), group("cable", 9.0)]
    asked = Asked({0: (groups, np.zeros(4), np.zeros(4), np.zeros(3))}, Belief())
    assert asked.of(SimpleNamespace(kind="spring")) is groups[1] and asked.of(SimpleNamespace(kind="lag")) is None


def test_an_effect_is_near_that_stands_at_five_per_cent_and_takes_half():
    maxima = np.linspace(0.0, 4.0, 401)
    group = lambda name: SimpleNamespace(candidate=SimpleNamespace(name=name), signed=name != "payload")  # noqa: E731
    groups = [group("spring"), group("cable"), group("cogging"), group("payload")]  # whose sign forbids the last
    one = (groups, np.array([3.9, 3.95, 3.0, 3.99]), np.array([6.0, 4.0, 9.0, 9.0]), maxima)
    asked = Asked({0: one}, Belief())
    assert asked.near(0, 10.0, False)[0].name == "spring"  # cable takes less than half, cogging may be chance
    assert asked.near(0, 7.0, False)[0].name == "cable" and asked.near(0, 20.0, False) is None is asked.near(1, 10.0, True)
    # where something is there, it is asked among those of its joint alone
    louder = {0: one, 1: ([], np.zeros(0), np.zeros(0), maxima + 1.0)}
    asked = Asked(louder, Belief())
    assert asked.near(0, 10.0, False) is None and asked.near(0, 10.0, True)[0].name == "spring"
    assert asked.near(0, 14.0, True) is None  # cogging may be chance there as well
    assert asked.near(0, 10.0, True)[1] > 0.05  # its family-wise p-value is that among all


# ---- angles that are smoothed over too long


@pytest.mark.parametrize(
    "errors, halves, said",
    # both above the floor of 1 and mostly gone; one at it anyway; one that stays; more than before; half of it
    [
        ((2.0, 3.0), (1.1, 1.2), True),
        ((1.0, 3.0), (1.0, 1.2), True),
        ((2.0, 3.0), (1.1, 2.9), False),
        ((2.0, 3.0), (2.2, 3.1), False),
        ((1.0, 3.0), (1.0, 5.0**0.5), False),
    ],
)
def test_what_smoothing_makes_of_an_error(errors, halves, said):
    floor = NoiseFloor(1.0, 0.01, "spectral", "", 0.9, 1.1)
    assert smeared(errors, replace(floor, halved=(0.05, *halves))) == said
    assert not smeared(errors, floor) and not smeared((1.0, 1.0), replace(floor, halved=(0.05, 1.0, 1.0)))
    assert not smeared(errors, replace(floor, rms=None, halved=(0.05, *halves)))


@pytest.mark.long
def test_a_window_that_is_too_long_is_said_and_the_one_that_is_said_will_do(simulated):
    """Speeds that are trapezoids, with nothing hidden: acceleration jumps, and 0.2 s smear it where rows about jumps count."""
    path = simulated("trapezoids", seed=1, duration=20.0, motion="moves") / "config.yaml"
    text = path.read_text().replace("preprocess:\n", "preprocess:\n  window: 0.2\n")
    found = diagnose(config.loads(text.replace("standstill: auto", "standstill: mask"), path))
    assert not found.claims and {v.status for v in found.verdict} == {"unresolved"}
    for one in found.verdict:
        assert "smoothed over 0.2 s" in one.says and "`window: 0.1`" in one.says
    (shorter,) = {re.search(r"`window: (\S+)`", v.says)[1] for v in found.verdict}
    text = text.replace("window: 0.2", f"window: {shorter}")
    then = pipeline.fit(config.loads(text.replace("standstill: auto", "standstill: mask"), path))
    for joint, floor in found.floors.items():  # what was told came: it was told of the bodies as they were
        assert then.rms("test")[joint] == pytest.approx(floor.halved[2], rel=0.1)
    assert {v.status for v in diagnose(config.loads(text, path)).verdict} == {"complete"}
