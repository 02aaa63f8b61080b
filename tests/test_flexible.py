"""What a flexible function predicts of a residual: laws that it was never told, and nothing of noise."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter
from scipy.stats import binom

from sysid import blocks
from sysid.diagnose.select import LEVEL, WORTH
from sysid.flexible import Law, Unknown, functions, pasts, products, ridge, tone, unknown
from sysid.statement.verdicts import dependences
from sysid.statement.words import followed, quantity
from sysid.view import law
from tests.evidences import viewed

STEP, N = 0.01, 2500
RNG = np.random.default_rng(0)


def _motion():
    t = np.arange(N) * STEP
    w = 2.0 * np.pi * RNG.uniform(0.1, 0.9, (5, 1, 2))
    phase = w * t[None, :, None] + RNG.uniform(0, 6, (5, 1, 2))
    a = RNG.uniform(0.1, 0.4, (5, 1, 2))
    q, qd, qdd = (a * np.sin(phase)).sum(0), (a * w * np.cos(phase)).sum(0), -(a * w**2 * np.sin(phase)).sum(0)
    known = {}
    for j, joint in enumerate(("shoulder", "elbow")):
        known |= {f"q_{joint}": q[:, j], f"qd_{joint}": qd[:, j], f"qdd_{joint}": qdd[:, j]}
        known[f"load_{joint}"] = 5.0 * np.cos(q[:, j]) + qdd[:, j]
    return known | {"time": t}


KNOWN = _motion()
FOLD = blocks.numbered(KNOWN["time"], np.zeros(N, int), shortest=np.inf, fewest=30) % 10  # as a view has them


def asked(law, *, noise: float = 0.3, seed: int = 1, use=None) -> Unknown:
    """What is found of a law on the elbow, of unit size under noise."""
    values = law(KNOWN) if callable(law) else law
    values = values / np.std(values) if np.std(values) > 0 else values
    rng = np.random.default_rng(seed)
    slow = lfilter([0.6], [1.0, -0.8], rng.normal(size=N))
    use = np.ones(N, bool) if use is None else use
    residual = np.where(use, values + noise * slow, 0.0)
    return unknown(KNOWN, "elbow", residual, use, FOLD, np.zeros(N, int), STEP, np.random.default_rng(0))


def lagged(span: float):
    keep = np.exp(-STEP / span)
    return lambda known: lfilter([1.0 - keep], [1.0, -keep], known["qd_elbow"])


LAWS = {
    "an angle": (lambda v: np.sin(5.0 * v["q_elbow"]), "q_elbow"),
    "another joint's angle": (lambda v: np.sin(3.0 * v["q_shoulder"]), "q_shoulder"),
    "another joint's speed": (lambda v: np.abs(v["qd_shoulder"]), "qd_shoulder"),
    "the past speed": (lagged(0.3), None),
    "friction that follows an angle": (lambda v: np.sign(v["qd_elbow"]) * (1.0 + np.sin(3.0 * v["q_elbow"])), None),
    "friction that follows another angle": (lambda v: np.sign(v["qd_elbow"]) * np.sin(3.0 * v["q_shoulder"]), "q_shoulder and direction"),
    "a product of two angles": (lambda v: v["q_elbow"] * v["q_shoulder"], None),
}


@pytest.mark.parametrize("name", LAWS)
def test_a_law_of_the_motion_is_predicted(name):
    law, variable = LAWS[name]
    found = asked(law)
    own = law(KNOWN) / np.std(law(KNOWN))
    assert found.gain.sum() > 0.5 * np.sum(own**2) and found.predictable(2, WORTH), found.gain.sum() / np.sum(own**2)
    # what is told is the law, on folds that it was not fitted on
    assert np.corrcoef(found.told, own)[0, 1] > 0.8
    assert found.gain.sum() <= found.total
    if variable is not None:
        assert max(found.shares, key=found.shares.get) == variable and found.shares[variable] > 0.4


@pytest.mark.parametrize("hertz", [2.7, 6.3, 13.0])
def test_a_steady_tone_is_told(hertz):
    """What comes in time and not with the motion."""
    found = asked(lambda v: np.sin(2.0 * np.pi * hertz * v["time"]))
    assert found.tone > 0.8 and found.shares["a steady tone"] == found.tone and found.predictable(2, WORTH)
    assert found.hertz == pytest.approx(hertz, abs=1.0 / 15.0)
    assert found.gain.sum() < 0.1 * found.total  # functions of the motion do not predict it
    assert asked(LAWS["an angle"][0]).tone == 0.0


def test_gain_is_what_the_prediction_takes():
    found = asked(LAWS["an angle"][0], seed=7)
    law = LAWS["an angle"][0](KNOWN)
    slow = lfilter([0.6], [1.0, -0.8], np.random.default_rng(7).normal(size=N))
    residual = law / np.std(law) + 0.3 * slow
    taken = blocks.summed(FOLD, residual**2 - (residual - found.told) ** 2)
    np.testing.assert_allclose(found.gain, taken, atol=1e-8)
    assert found.total == pytest.approx(np.sum(residual**2))


def test_an_answer_is_that_of_the_same_residual_in_other_units():
    """Of one that correlates by less than 0.99 it is none."""
    found, rng = asked(LAWS["an angle"][0], seed=7), np.random.default_rng(1)
    same = found.of(-3.0 * found.residual)
    np.testing.assert_allclose(same.told, -3.0 * found.told)
    assert same.gain.sum() == pytest.approx(9.0 * found.gain.sum()) and same.total == pytest.approx(9.0 * found.total)
    assert same.predicted == pytest.approx(found.predicted) and same.chance == found.chance
    noise = np.std(found.residual) * rng.normal(size=N)
    assert found.of(found.residual + 0.1 * noise) is not None
    assert found.of(found.residual + 0.2 * noise) is None and found.of(found.residual[1:]) is None
    # an effect that takes a part of what was predicted is no other unit
    small = asked(LAWS["an angle"][0], noise=4.0, seed=7)
    law = LAWS["an angle"][0](KNOWN) / np.std(LAWS["an angle"][0](KNOWN))
    assert 0.02 < small.predicted < 0.12
    assert small.of(small.residual - 0.6 * law) is None and small.of(small.residual + 0.6 * law) is None


def test_nothing_is_predicted_of_noise():
    """Over noises of some colour the gain stands about zero or below it, and as few are called predictable as the level says."""
    draws = 24
    found = [asked(np.zeros(N), noise=1.0, seed=seed) for seed in range(draws)]
    shares = np.array([f.gain.sum() / f.total for f in found])
    assert shares.mean() < 0.01 and shares.max() < 0.05, shares
    assert sum(f.predictable(2, WORTH) for f in found) <= binom.ppf(1.0 - 1e-3, draws, LEVEL / 2)
    assert 0.2 < np.mean([f.chance > 0.5 for f in found])  # as many questions as groups: a bound, and no certainty


def test_what_stands_beside_a_fold_does_not_predict_it():
    """Noise remembers: so a fold is predicted from rows apart from it. Wild ones next to it change nothing in it."""
    slow = lfilter([0.6], [1.0, -0.8], np.random.default_rng(0).normal(size=N))
    own = FOLD == 3
    beside = ~own & (np.convolve(own, np.ones(21), "same") > 0)  # a tenth of a second
    assert beside.sum() > 30
    spoilt = np.where(beside, 1e6, slow)
    found = unknown(KNOWN, "elbow", spoilt, np.ones(N, bool), FOLD, np.zeros(N, int), STEP, np.random.default_rng(0))
    assert np.abs(found.told[own]).max() < 5.0 < 1e4 < np.abs(found.told[~own]).max()


def test_rows_left_out_are_not_predicted():
    use = np.sin(KNOWN["time"]) > -0.5
    found = asked(LAWS["an angle"][0], use=use)
    assert not found.told[~use].any() and found.predictable(2, WORTH)


def test_a_motion_that_stands_has_no_functions():
    """A joint that never moves gives no splines, and nothing breaks."""
    still = {**KNOWN, "q_shoulder": np.zeros(N), "qd_shoulder": np.zeros(N), "qdd_shoulder": np.zeros(N)}
    law = np.sin(5.0 * KNOWN["q_elbow"])
    found = unknown(still, "elbow", law, np.ones(N, bool), FOLD, np.zeros(N, int), STEP, np.random.default_rng(0))
    assert found.gain.sum() > 0.8 * found.total and np.isfinite(found.told).all()


# ---- functions asked one by one


ALL = np.ones(N, bool)


def all_products(known, use=ALL) -> tuple[list[str], np.ndarray]:
    words, values = zip(*products(known, "elbow", use, np.zeros(N, int), STEP))
    return sum(words, []), np.concatenate(values, axis=1)


VALUES = all_products(KNOWN)[1]


def left_by(values, *, columns=None, seconds: float = 0.5):
    """A view of a model, empty or with columns (n, k) on the elbow, that leaves what is not of them of values (n,) there; blocks
    of so many seconds."""
    a = np.zeros((2, N, 1 if columns is None else columns.shape[1]))
    a[1] = 1e-6 if columns is None else columns
    torque = np.stack([np.random.default_rng(99).normal(size=N), values], axis=1)
    size = a.shape[2]
    p = SimpleNamespace(a=a, weights=np.ones(2), root=1e-3 * np.eye(size), target=np.zeros(size), tau=torque, number=np.arange(N) // round(seconds / STEP))
    rows = SimpleNamespace(use=np.ones((N, 2), bool), piece=np.zeros(N, int))
    robot = SimpleNamespace(joints=("shoulder", "elbow"))
    return SimpleNamespace(
        **{**vars(viewed(p)), "rows": rows, "step": STEP},
        variables=KNOWN,
        rough_variables=KNOWN,
        model=SimpleNamespace(robot=robot, shape_values=(), shapes=()),
    )


def coloured(seed: int, memory: float = 0.04):
    keep = np.exp(-STEP / memory)
    return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], np.random.default_rng(seed).normal(size=N))


def test_products_are_functions_of_unit_size_on_rows_that_count():
    use = np.sin(KNOWN["time"]) > -0.5
    words, values = all_products(KNOWN, use)
    assert len(words) == values.shape[1] > 500 and not values[~use].any()
    np.testing.assert_allclose(np.mean(values**2, axis=0), 1.0, rtol=1e-9)
    variables = {"time", "its past", "direction", *(f"{kind}_{joint}" for kind in ("q", "qd", "qdd", "load") for joint in ("shoulder", "elbow"))}
    assert {one for word in words for one in word.split(" and ")} == variables - {"load_shoulder"}


def test_ripples_of_a_model_are_asked_where_they_are_stronger():
    """At the periods that it has, and at no others."""
    truth = np.abs(KNOWN["qd_elbow"]) * np.sin(16.0 * KNOWN["q_elbow"])

    def nearest(ripples):
        words, columns = zip(*products(KNOWN, "elbow", ALL, np.zeros(N, int), STEP, ripples))
        values = np.concatenate(columns, axis=1)
        alike = np.abs(values.T @ truth) / np.linalg.norm(values, axis=0) / np.linalg.norm(truth)
        return float(alike.max()), sum(words, [])[int(np.argmax(alike))]

    assert nearest(()) < (0.8, "") and nearest((16.0,)) == (pytest.approx(1.0), "q_elbow and qd_elbow")


# ---- what the motion was


def loose_load(known):
    """What a load that swings at 2 Hz behind the elbow's link needs, by an integrator of steps that it chooses itself."""
    omega, damping, t = 4.0 * np.pi, 0.15, known["time"]
    push = lambda at: np.interp(at, t, known["qdd_elbow"])  # noqa: E731
    behind = solve_ivp(
        lambda at, y: [y[1], -push(at) - omega**2 * y[0] - 2.0 * damping * omega * y[1]], (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-6, max_step=STEP
    )  # fmt: skip
    return known["qdd_elbow"] + np.gradient(behind.y[1], STEP)


def dragged_load(known):
    """A hysteresis of the load: what stays where the last turn of it left it."""
    load, place = known["load_elbow"], [known["load_elbow"][0]]
    width = 0.1 * np.ptp(load)
    for value in load[1:]:
        place.append(min(max(place[-1], value - width), value + width))
    return load - np.array(place)


PASTS = {
    "a load that swings": (loose_load, "qdd_elbow and its past"),
    "a hysteresis of the load": (dragged_load, "load_elbow and its past"),
    "warmth": (lambda v: lfilter([STEP / 0.8], [1.0, STEP / 0.8 - 1.0], np.abs(v["load_elbow"])), "load_elbow and its past"),
}


@pytest.mark.parametrize("name", PASTS)
def test_what_the_motion_was_stands_out(name):
    own, variable = PASTS[name]
    held = np.column_stack([KNOWN["qdd_elbow"], np.ones(N)])  # bodies and a bias, which the model has
    own = own(KNOWN) - held @ np.linalg.lstsq(held, own(KNOWN), rcond=None)[0]
    view = left_by(own / np.std(own) + 1.5 * coloured(3), columns=held)
    found = law(view, 1)
    assert found.chance < 5e-3 and found.variables == variable
    assert found.share * np.sum(view.design.residual[:, 1] ** 2) > 0.4 * N


def test_a_dragged_place_stands_until_the_width_is_taken_up():
    values = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)])
    (place,) = pasts.dragged(values, np.array([0.2]))
    assert (np.abs(values - place) <= 0.2 + 1e-12).all() and place[:9] == pytest.approx(0.0, abs=0.02)
    assert place[49] == pytest.approx(0.8) == place[55] and place[-1] == pytest.approx(0.2)


def test_pasts_are_those_of_their_closed_forms():
    late = pasts.fading(np.ones(400), STEP)
    for own, span in zip(late, (0.1, 0.3, 1.0, 3.0)):
        np.testing.assert_allclose(own, 1.0 - np.exp(-STEP * np.arange(1, 401) / span), rtol=1e-9)
    t = STEP * np.arange(3000)
    for own, hertz in zip(pasts.swinging(np.sin(0.4 * np.pi * t), STEP), (1.0, 2.0, 4.0, 8.0)):
        slow = 1.0 / (1.0 - (0.2 / hertz) ** 2)  # far below its own frequency it follows
        assert np.abs(own[1500:]).max() == pytest.approx(slow, rel=0.02)
    swung = pasts.swinging(np.sin(4.0 * np.pi * t), STEP)[1]
    assert np.abs(swung[1500:]).max() == pytest.approx(np.hypot(1.0, 0.3) / 0.3, rel=0.1)  # at it
    turned = pasts.turned(np.stack([np.sin(t), np.cos(t)]), STEP)
    age = np.where(t < 0.5 * np.pi, t, (t - 0.5 * np.pi) % np.pi)
    np.testing.assert_allclose(turned[1][t > 1.6], np.exp(-age / 0.2)[t > 1.6], atol=0.06)
    assert not turned[:, t < 1.5].any()
    np.testing.assert_allclose(turned[3][t > 1.6], (np.sin(t) - np.sin(t - age))[t > 1.6], atol=0.02)


def test_every_piece_has_a_past_of_its_own():
    half = {name: values[: N // 2] for name, values in KNOWN.items()}
    twice = {name: np.concatenate([values, values]) for name, values in half.items()}
    number = np.repeat([0, 1], N // 2)
    found = list(pasts.pasts(twice, "elbow", number, STEP))
    for (word, own), (same, alone) in zip(found, pasts.pasts(half, "elbow", number[: N // 2], STEP)):
        assert word == same and word.endswith("and its past")
        np.testing.assert_allclose(own, np.concatenate([alone, alone]), atol=1e-12)


def test_a_joint_that_stands_has_no_products_of_its_own():
    still = {**KNOWN, "q_shoulder": np.zeros(N), "qd_shoulder": np.zeros(N), "qdd_shoulder": np.zeros(N)}
    words, values = all_products(still)
    assert np.isfinite(values).all() and not any(word.endswith("qd_shoulder") for word in words)


@pytest.mark.long
@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_nearly_one_of_the_products_and_stands_out_of_noise_that_is_larger(name):
    own, variable = LAWS[name]
    own = own(KNOWN) / np.std(own(KNOWN))
    alike = np.abs(own @ VALUES) / np.linalg.norm(own) / np.sqrt(N)
    assert alike.max() > 0.8, alike.max()
    view = left_by(own + 1.5 * coloured(3))
    found = law(view, 1)
    assert found.chance < 2e-3
    assert variable is None or variable.partition(" and ")[0] in found.variables.split(" and ")
    assert found.share <= 1.3 * np.sum(own**2) / np.sum(view.design.residual[:, 1] ** 2)  # of the law, not of the noise


@pytest.mark.long
def test_nothing_stands_out_of_noise():
    """As often as the level says, white or coloured, of noise that remembers a tenth of a block and less."""
    for memory in (0.001, 0.04, 0.1):
        chances = [law(left_by(coloured(seed, memory), seconds=1.0), 1).chance for seed in range(20)]
        assert sum(c < 0.05 for c in chances) <= binom.ppf(1.0 - 1e-3, 20, 0.05), (memory, chances)


def test_what_the_model_holds_is_nothing_that_stands_out():
    """A column of the model's, whatever its size, is off the residual and off every function."""
    own = np.column_stack([np.sin(5.0 * KNOWN["q_elbow"]), KNOWN["qd_elbow"]])
    without = law(left_by(coloured(5), columns=own), 1)
    with_it = law(left_by(coloured(5) + own @ [30.0, 20.0], columns=own), 1)
    assert with_it.chance == pytest.approx(without.chance, rel=1e-6) and with_it.variables == without.variables
    assert with_it.share == pytest.approx(without.share, rel=1e-3)


def test_where_nothing_can_be_asked_nothing_is_there():
    still = {name: np.zeros(N) for name in KNOWN}
    view = left_by(coloured(1))
    view.variables = view.rough_variables = still
    assert law(view, 1) == Law(1.0, "", 0.0)


def test_a_function_alone_is_said_with_its_variables():
    found = asked(LAWS["a product of two angles"][0])
    seen = replace(found, chance=0.5, gain=np.zeros(10), shares={}).with_law(Law(1e-3, "q_elbow and q_shoulder", 0.4), 2, 0.03)
    assert seen.predictable(2, WORTH) and seen.share == pytest.approx(0.4)
    (entry,) = dependences(seen)
    assert entry == {"variable": "q_elbow", "with": "q_shoulder", "share": pytest.approx(0.4)}
    assert followed(entry, quantity) == "the position of elbow with the position of shoulder"


def test_a_function_times_the_direction_says_so_and_a_tone_its_frequency():
    """Friction that goes with an angle is no function of the angle: who writes the formula needs to know."""
    entry = {"variable": "q_y", "with": "direction", "share": 0.9}
    assert followed(entry, quantity) == "the position of y with the direction of motion"
    entry = {"variable": "load_y", "with": "its past and direction", "share": 0.9}
    assert followed(entry, quantity) == "the load of y with its past and the direction of motion"
    assert followed({"variable": "a steady tone", "hertz": 7.31, "share": 0.4}, quantity) == "a steady tone of 7.31 Hz alone"


@pytest.mark.parametrize("law", ["an angle", "the past speed", "noise"])
def test_ridges_are_climbed_to_the_one_that_a_look_at_all_of_them_finds(law, monkeypatch):
    rng = np.random.default_rng(4)
    y = rng.normal(size=N) + (0.0 if law == "noise" else LAWS[law][0](KNOWN) / np.std(LAWS[law][0](KNOWN)))
    use, spans = np.ones(N, bool), ridge.stretches(FOLD, KNOWN["time"], np.zeros(N, int))
    every = functions.groups(KNOWN, "elbow", np.zeros(N, int), STEP, rng)["*"]
    asked, solved = [], ridge._solved
    monkeypatch.setattr(ridge, "_solved", lambda system, ridges, right: asked.append(len(ridges)) or solved(system, ridges, right))
    climbed, few = ridge.predicted(every, y, use, spans), sum(asked)
    monkeypatch.setattr(ridge, "_FIRST", tuple(range(len(ridge._RIDGES))))
    for found, best in zip(climbed, ridge.predicted(every, y, use, spans)):
        np.testing.assert_allclose(found, best, atol=1e-9 * N)
    assert few <= 0.7 * len(ridge._RIDGES) * len(spans)


@pytest.mark.parametrize(("least", "close"), [(1e-4, 1e-3), (1e-9, 1e-8)])
def test_ridges_are_solved_in_single_precision_where_that_is_enough(least, close):
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(N, 3)) @ rng.normal(size=(3, 120)) + 0.05 * rng.normal(size=(N, 120))  # three of 120 say nearly all
    rows /= np.sqrt(np.mean(rows**2, axis=0))
    system, right = rows.T @ rows, rows.T @ (rows[:, 0] + 0.1 * rng.normal(size=N))
    ridges = N * np.array([least, 1e-2, 3.0])
    found = ridge._solved(system, ridges, right)
    for own, strength in zip(found.T, ridges):
        told = rows @ np.linalg.solve(system + strength * np.eye(120), right)
        assert np.max(np.abs(rows @ own - told)) < close * np.std(told)


@pytest.mark.parametrize(("lasts", "steady"), [(2.0, False), (1e3, True)])
def test_what_rings_down_is_no_steady_tone(lasts, steady):
    """A link on a soft gear that is loaded for a while; a filter of what is faster takes none of it."""
    t = STEP * np.arange(N)
    ringing = 3.0 * np.exp(-np.abs(t - 12.0) / lasts) * np.sin(2.0 * np.pi * 4.02 * t)
    share, chance, hertz = tone.steady(ringing + 0.05 * np.random.default_rng(3).normal(size=N), np.zeros(N), STEP)
    assert (chance < tone.TONE) is steady and share > 0.2 and hertz == pytest.approx(4.0, abs=0.2)


def test_a_tone_that_the_angles_noise_has_as_well_is_none_of_the_torque():
    """A coarse encoder at a steady speed makes a line, and makes it again in another phase where its rounding is drawn once more."""
    rng = np.random.default_rng(3)
    line = lambda phase: 0.5 * np.sin(2.0 * np.pi * 7.3 * KNOWN["time"] + phase)  # noqa: E731
    residual, use = rng.normal(size=N) + line(0.4), np.ones(N, bool)
    ask = lambda noise: unknown(KNOWN, "elbow", residual, use, FOLD, np.zeros(N, int), STEP, np.random.default_rng(0), noise)  # noqa: E731
    assert ask(0.1 * rng.normal(size=N)).tone == pytest.approx(0.11, abs=0.03)
    assert ask(0.1 * rng.normal(size=N) + line(2.0)).tone == 0.0
