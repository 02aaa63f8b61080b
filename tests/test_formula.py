"""What a user adds: formulas, which are worked out and never run, and classes in a file of the user's."""

import ast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid import pipeline, vocabulary
from sysid.errors import ConfigError
from sysid.formula import FUNCTIONS, Formula, parse
from sysid.listed_effects import found
from sysid.specs import EffectSpec
from sysid.trusted import trust
from sysid.vocabulary import describe
from tests.test_effects import moving, small_piece

REFUSED = {
    "__import__('os')": "function '__import__'", "a*__import__('os').system('x')": "function", "(1).__class__": "'1 .__class__'",
    "q.__class__": "'q.__class__'", "a*q.__class__.__mro__": "__mro__", "open('x')": "function 'open'", "eval('1')": "function 'eval'",
    "[x for x in q]": "for x in", "(x for x in q)": "for x in", "{x: 1 for x in q}": "for x in", "q[0]": "q[0]", "lambda: 0": "lambda", '"a"*9': "'a'",
    "b'a'*9": "'a'", "9**9**9": "power 9 ** 9", "a*9**9**9": "power", "a*q**21": "power 21", "a*q**-21": "power -21", "a*q**(10+11)": "power",
    "a*(q**20)**(99)": "power 99", "\uff41*q": "character", "a*q\u200b": "character", "\u0430*q": "character", "a\0*q": "character", "a*q\x1b": "character",
    "(" * 60 + "a" + ")" * 60: "nested", "-" * 400 + "a": "nested", "a*" + "sin(" * 55 + "q" + ")" * 55: "nested", "a*q+" * 200 + "a": "characters",
    "**".join("qqqqqq" * 20): "nested", "a if q else b": "if q else", "a < q": "a < q", "a and q": "and", "not a": "not a", "~a": "~a", "a @ q": "@",
    "a // q": "//", "a % q": "%", "a << 9": "<<", "a := 3": "cannot be read", "a = 3": "cannot be read", "a; q": "cannot be read", "import os": "cannot be read",
    "yield a": "cannot be read", "await a": "await", "f'{a}'": "f'", "...": "...", "None": "None", "a*True": "True", "a*1j": "1j", "a*1e13": "number",
    "a*1e999": "number", "a*" + "9" * 400: "number", "(a, q)": "(a, q)", "{a}": "{a}", "*a": "cannot be read", "a*sin": "no argument", "a*sin(q, q)": "1 value",
    "a*sin(x=q)": "1 value", "a*sin(*q)": "1 value", "a*max(q)": "2 values", "a*foo(q)": "function 'foo'", "a*sin(q)(q)": "function 'sin(q)'",
    "": "empty", "   ": "empty", "a*(q": "cannot be read", "_a*q": "'_a'", "a__b*q": "'a__b'", "joints*q": "'joints'", "a*tau": "tau",
    "a*q + 3": "the term 3", "sin(q)": "the term sin(q)", "a*q + exp(-b*qd)": "the term exp(-b * qd)", "a*b*q": "coefficients a and b", "a*(q - q0)": "a and q0",
    "qdot*a": "'qdot' in the formula looks like a word mistyped; allowed: qd", "a*a*q": "a and a",
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_refused(text):
    with pytest.raises(ConfigError) as error:
        parse(text)
    said = str(error.value)
    assert REFUSED[text] in said and "model.effects" in said and "\n" not in said and len(said) < 400


@pytest.mark.parametrize("text", [3, None, ["a*q"], {"a": 1}, b"a*q"])
def test_refused_where_no_text(text):
    with pytest.raises(ConfigError, match="empty"):
        parse(text)


SORTED = {
    "a*sin(3*q) + b*qd**3": ("ab", ""), "a*exp(-b*qd)*s + c": ("ac", "b"), "-(a + b*q)*qd/2 - c": ("abc", ""), "a/b*q": ("a", "b"), "a*abs(qd)**b*s": ("a", "b"),
    "a*sin(k*q + p)": ("a", "kp"), "+a*min(q, b)": ("a", "b"), "a*q + a*qd": ("a", ""), "a*load*s": ("a", ""), "a\n * q": ("a", ""), "a*q**-2": ("a", ""),
    "+".join(["a*q"] * 100): ("a", ""),
}  # fmt: skip


@pytest.mark.parametrize("text", SORTED)
def test_linear_or_not(text):
    parsed = parse(text)
    assert ("".join(parsed.linear), "".join(parsed.inner)) == SORTED[text]


def test_columns():
    piece = small_piece()
    q, qd, load = piece.q[:, 1], piece.qd[:, 1], piece.load[:, 1]
    formula = Formula("a*sin(3*q) - b*qd**3/2 + c*exp(-abs(qd)/v)*s + d*load + pi*e + f*t")
    columns = formula.columns(piece, 1, v=0.7)
    wanted = [np.sin(3 * q), -(qd**3) / 2, np.exp(-np.abs(qd) / 0.7) * np.sign(qd), load, np.pi + 0 * q, piece.t]
    np.testing.assert_allclose(columns, wanted, atol=1e-14)
    assert [c.name for c in formula.coefficients()] == list("abcdef") and [s.name for s in formula.shapes()] == ["v"] and formula.uses_load
    (v,) = formula.shapes()
    assert (v.low, v.high, len(v.values(v.low, v.high))) == (1e-3, 1e3, 12)
    said = describe(formula)
    assert said["equation"].startswith("tau = a*sin") and said["summary"]


def test_other_joints():
    machine, piece = moving()
    formula = Formula("a*q_rail + b*qd_rail*qdd_hinge").bound(machine, 1)
    np.testing.assert_allclose(formula.columns(piece, 1), [piece.q[:, 0], piece.qd[:, 0] * piece.qdd[:, 1]])
    with pytest.raises(ConfigError, match="qd_hip in the formula names no joint; allowed: q_rail, q_hinge"):
        Formula("a*qd_hip").bound(machine, 0)


@pytest.mark.parametrize("text, culprit", [("a*sin(q + log(q - 1))", "log(q - 1)"), ("a/qd + b", "a / qd"), ("a*exp(exp(99*qd))", "exp(exp(99 * qd))"), ("a*q + b*sqrt(0-2)", "sqrt(0 - 2)")])
def test_what_is_no_number_is_named(text, culprit):
    formula = Formula(text)
    if culprit == "a / qd":
        text, formula = "a*(1/qd)", Formula("a*(1/qd)")
        culprit = "1 / qd"
    with pytest.raises(ConfigError) as error:
        formula.columns(small_piece(), 1)
    assert str(error.value).startswith(f"model.effects: formula: {culprit} in the formula is no finite number at t = ")


# ---- any allowed expression is worth what Python makes of it

_LEAVES = st.sampled_from(["q", "qd", "qdd", "t", "s", "load", "pi", "b", "0.5", "2", "3e-1"])


def _grown(inner):
    return st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map(lambda x: f"({x[0]} {x[1]} {x[2]})"),
        inner.map(lambda x: f"-{x}"),
        st.tuples(inner, st.sampled_from(["2", "3", "-1", "0.5", "b"])).map(lambda x: f"({x[0]})**{x[1]}"),
        st.tuples(st.sampled_from([name for name, f in FUNCTIONS.items() if f.nin == 1]), inner).map(lambda x: f"{x[0]}({x[1]})"),
        st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(lambda x: f"{x[0]}({x[1]}, {x[2]})"),
    )


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.recursive(_LEAVES, _grown, max_leaves=10))
def test_worth_what_python_makes_of_it(text):
    piece, whole = small_piece(), f"a*sin((b + q)*0 + ({text}))"
    if len(whole) > 500:
        return
    known = {"q": piece.q[:, 1], "qd": piece.qd[:, 1], "qdd": piece.qdd[:, 1], "t": piece.t, "s": np.sign(piece.qd[:, 1]), "load": piece.load[:, 1]}
    # the truth is NumPy's own, run by Python: the text is this test's
    with np.errstate(all="ignore"):
        floats = ast.unparse(_Floats().visit(ast.parse(text, mode="eval")))
        truth = np.sin(eval(floats, {"__builtins__": {}}, {**FUNCTIONS, **known, "pi": np.pi, "b": np.float64(0.8), "number": np.float64}))
    formula = Formula(whole)
    assert formula.parsed.linear == ("a",) and formula.parsed.inner == ("b",)
    if np.isfinite(truth).all():
        np.testing.assert_allclose(formula.columns(piece, 1, b=0.8)[0], np.broadcast_to(truth, 4), rtol=1e-12, atol=1e-12)
    else:
        with pytest.raises(ConfigError, match="no finite number"):
            formula.columns(piece, 1, b=0.8)


class _Floats(ast.NodeTransformer):
    """Numbers as NumPy's, which divide by zero as arrays do."""

    def visit_Constant(self, node):
        return ast.Call(ast.Name("number", ast.Load()), [node], [])


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.text(alphabet="aq(+-*/.,)[]{}'\"_:=<>~@%&|^!#\\ 019", max_size=40))
def test_any_text_is_a_formula_or_one_line(text):
    try:
        formula = Formula(text)
        assert formula.columns(small_piece(), 1, **{shape.name: 1.0 for shape in formula.shapes()}).shape == (len(formula.coefficients()), 4)
    except ConfigError as error:
        assert "\n" not in str(error)


# ---- words that look mistyped

MISTYPED = {
    "a*sgn(qd)": "sign", "a*q*exp(-sgn)": "sign", "a*sin(qdot*b)": "qd", "a*exp(-abs(Q)/w)": "q", "a*qdd1": "qdd", "a*exp(-qdd1*b)": "qdd", "a*exp(-abs(tauu)/b)": "tau",
    "a*sin(k*dq)": "qd", "a*laod": "load", "a*sin(Load*b)": "load", "a*q + velocity": "qd", "a*exp(-time/T)": "t", "a*sin(q1)": "q", "a*tanhh(q)": "tanh", "a*arctan(q)": "atan",
    "a*sin(temprature*k)": "temperature", "a*q*cos(ddq)": "qdd", "a*sin(2*PI*q*b)": "pi",
}  # fmt: skip


@pytest.mark.parametrize("text", MISTYPED)
def test_a_mistyped_word_is_refused_with_what_it_may_mean(text):
    with pytest.raises(ConfigError) as error:
        parse(text, ["temperature"])
    allowed = str(error.value).partition("allowed: ")[2].partition(";")[0].split(", ")
    assert allowed[0] == MISTYPED[text], error.value


NAMES_OF_THEIR_OWN = ["h*exp(-((q-q0)/w)**2)", "a*exp(-t/T)", "a*tanh(qd/qd0)", "a*tanh((qdd-qdd1)/w)", "Fc*tanh(qd/vs) + Fv*qd", "k1*q + k2*q**3", "a*sin(k*q + phi)",
                      "a*exp(-abs(qd/vs)**delta)*s", "mass*qdd + stiffness*q", "a*max(q-qmax, 0)", "amp*sin(omega*t + phase)", "a*exp(-abs(temperature - T0)/w)*s", "kd*qd + kp*q", "a/b*q"]  # fmt: skip


@pytest.mark.parametrize("text", NAMES_OF_THEIR_OWN)
def test_names_that_people_mean_are_free(text):
    parse(text, ["temperature"])


def test_what_never_changes_is_refused():
    with pytest.raises(ConfigError, match=r"exp\(-b\) in the formula holds nothing that changes: b would be to be found"):
        parse("a*q*exp(-b)")


def test_a_logged_signal_is_a_variable():
    from dataclasses import replace

    piece = replace(small_piece(), signals={"heat": np.array([20.0, 21.0, 22.0, 23.0])})
    formula = Formula("a*exp(-heat/b)*s", signals=["heat"])
    assert formula.parsed.linear == ("a",) and formula.parsed.inner == ("b",)
    np.testing.assert_allclose(formula.columns(piece, 1, b=10.0)[0], np.exp(-piece.signals["heat"] / 10.0) * np.sign(piece.qd[:, 1]))
    with pytest.raises(ConfigError, match="signal heat of the formula is not logged"):
        formula.columns(replace(piece, signals={}), 1, b=10.0)


# ---- where values inside a formula are searched


def swing(n: int = 2000):
    """q from -1 to 0.6, of one joint, for 10 s; as `Effect.sized` is asked: rows, then those after them."""
    from sysid.motion import Piece

    t = np.arange(n) * 10.0 / n
    q = (-0.2 + 0.8 * np.sin(2 * np.pi * 0.7 * t))[:, None]
    qd, zero = np.gradient(q, t, axis=0), np.zeros(1)
    two = np.concatenate([np.arange(n - 1), np.arange(1, n)])
    q, qd, t = q[two], qd[two], t[two]
    return Piece(0, 10.0 / n, t, q, qd, 0 * q, q, q, {}, None, None, slice(0, len(t)), zero, zero)


def sized(text: str, n: int = 2000) -> dict:
    return {shape.name: shape for shape in Formula(text).sized(swing(n), n, 0)}


def test_an_offset_is_searched_where_its_signal_is():
    for text, low, high in (("h*exp(-((q-c)/w)**2)", -1.8, 1.4), ("h*exp(-((q+c)/w)**2)", -1.4, 1.8), ("h*max(c-q, 0)", -1.8, 1.4), ("h*tanh((2*q-c)/w)", -3.6, 2.8)):
        c = sized(text)["c"]
        np.testing.assert_allclose([c.low, c.high], [low, high], atol=1e-3)


def test_a_scale_goes_with_its_signals_size():
    for text in ("h*tanh(q/w)", "h*exp(-abs(q)/w)*s", "h*tanh(q*w)"):
        w, twice = sized(text)["w"], sized(text.replace("q", "(2*q)"))["w"]
        factor = 0.5 if "*w" in text else 2.0
        np.testing.assert_allclose([twice.low, twice.high], [factor * w.low, factor * w.high])
        assert min(abs(at) for at in w.values(w.low, w.high)) <= 0.1 <= 1.0 <= w.high


def test_a_sign_is_searched_where_it_matters():
    low = lambda text, name: sized(text)[name].low  # noqa: E731
    assert low("h*exp(-((q-c)/w)**2)", "w") > 0 and low("h*tanh((q-c)/w)", "w") > 0 and low("h*sin(k*q+p)", "k") > 0
    assert low("h*exp(r*q)", "r") < 0 and low("h/(1+exp(-(q-c)/w))", "w") < 0 and low("h*exp(-b*abs(qd))*s", "b") < 0
    assert low("h*log(b+abs(qd))", "b") > 0 and low("h*qd/(v+abs(qd))", "v") > 0  # what must not vanish


def test_cycles_are_counted_by_span_and_sampling():
    k = sized("h*sin(k*q + p)")["k"]
    steps = np.diff(k.values(k.low, k.high))
    assert np.all(steps * 1.6 <= 0.5 * np.pi * 1.01)  # none is missed
    travel = np.sqrt(np.mean(np.diff(swing().q[:1999, 0]) ** 2))
    assert k.high == pytest.approx(0.5 * np.pi / travel, rel=0.01)
    assert sized("h*sin(k*t + p)", 4000)["k"].high <= 2000 * 0.5 * np.pi / 10.0 * 1.01


def test_exponents():
    assert (sized("h*abs(q)**n*s")["n"].low, sized("h*abs(q)**n*s")["n"].high) == (0.05, 6.0)
    assert sized("h*(2+q)**n")["n"].low == -6.0  # of what stays clear of zero


def test_every_formula_has_ranges_that_can_be_tried():
    for text in ["a*atan(b*q+c)", "a*q/sqrt(q**2+w**2)", "a*exp(b*sin(k*q))", "a*cos(q/p)", "a*min(max(q,l),u)", "a*2**(k*q)", "a*(1+b*q)**n", "a*log(b*q+c)", "a/b*q", "a*sqrt(q+b)"]:
        formula = Formula(text)
        shapes = formula.sized(swing(), 2000, 0)
        for shape in shapes:
            tried = shape.values(shape.low, shape.high)
            assert shape.low < shape.high and len(tried) >= 5 and tried.min() >= shape.low - 1e-9 and tried.max() <= shape.high + 1e-9, (text, shape)
            narrow = shape.values(*sorted((tried[1], tried[-2])))
            assert len(narrow) >= 2 and narrow.min() >= tried[1] - 1e-9


# ---- found


def bump(columns, q0=-0.23, w=0.12, h=0.8):
    return {**columns, "tau_elbow": columns["tau_elbow"] + h * np.exp(-(((columns["q_elbow"] - q0) / w) ** 2))}


FORMULA = {"formula": "h*exp(-((q-q0)/w)**2)", "joints": ["elbow"]}


def fitted(said) -> tuple[dict, dict]:
    import json

    assert said.status == 0, said.err
    document = json.loads(said.out)
    return {entry["name"].rpartition(".")[2]: entry for entry in document["parameters"] if entry["name"].startswith("formula.")}, document["certificate"]


def test_a_negative_value_inside_a_formula_is_found(experiment, cli):
    folder = experiment(config={"model.effects": ["viscous", "coulomb", FORMULA]}, train=bump, test=bump)
    values, certificate = fitted(cli("fit", folder, "--json"))
    assert certificate["globally_optimal"]
    for name, truth in (("q0", -0.23), ("w", 0.12), ("h", 0.8)):
        assert abs(values[name]["value"] - truth) < 5 * values[name]["std"] < 0.2
    given = {entry["name"]: entry for entry in certificate["given"]}
    assert set(given) == {"formula.elbow.q0", "formula.elbow.w"}
    assert all(entry["starts"] > 100 and entry["profile"] > 10 and not entry["at_edge"] and not entry["held"] for entry in given.values())
    said = cli("fit", folder)
    assert "proven given the shape values" in said.out and "started from" in said.out and "the profile over each was checked" in said.out


def test_a_formula_is_fitted_up_to_the_end_of_its_domain(experiment, cli):
    """Of sqrt(q - b) no b above the least angle is a number: begun there or led there, the search goes on where it is one."""
    entry = {"formula": "g*sqrt(q-b)", "joints": ["elbow"], "name": "root"}
    end = {}

    def rooted(columns):
        end.setdefault("b", columns["q_elbow"].min() - 0.002)
        return {**columns, "tau_elbow": columns["tau_elbow"] + 0.9 * np.sqrt(np.maximum(columns["q_elbow"] - end["b"], 0.0))}

    config = {"model.effects": ["viscous", "coulomb", entry], "data.test": [{"file": "train.csv", "start": 1}], "prior.weight": "auto"}
    document = json_of(cli("fit", experiment(config=config, train=rooted), "--json"))
    value = next(p for p in document["parameters"] if p["name"] == "root.elbow.b")
    assert end["b"] - 0.1 < value["value"] < end["b"] + 0.004 and document["converged"]


def json_of(said) -> dict:
    import json

    assert said.status == 0, said.err
    return json.loads(said.out)


def test_start_and_within(experiment, cli):
    entry = {**FORMULA, "q0": {"start": 0.1, "within": [-1, 1]}, "w": {"within": [0.2, 0.5]}}
    folder = experiment(config={"model.effects": ["viscous", "coulomb", entry]}, train=bump, test=bump)
    values, certificate = fitted(cli("fit", folder, "--json"))
    given = {e["name"]: e for e in certificate["given"]}
    assert given["formula.elbow.q0"]["range"] == [-1, 1] and given["formula.elbow.w"]["range"] == [0.2, 0.5]
    assert abs(values["q0"]["value"] + 0.23) < 0.05 and values["w"]["value"] == pytest.approx(0.2) and given["formula.elbow.w"]["at_edge"]
    said = cli("fit", folder)
    assert "formula.elbow.w = 0.2 SI is at the edge of its range, 0.2 to 0.5" in said.out
    assert pipeline.load(said.run / "experiment.yaml").model == pipeline.load(folder).model


def test_other_effects_are_searched_where_the_user_says(experiment, cli):
    written = ["viscous", "coulomb", {"stribeck": {"joints": ["elbow"], "vs": {"within": [0.3, 0.4]}}}, {"delay": {"joints": ["elbow"], "d": {"within": [-0.001, 0.002]}}}]
    folder = experiment(config={"model.effects": written})
    import json

    given = {e["name"]: e for e in json.loads(cli("fit", folder, "--json").out)["certificate"]["given"]}
    assert given["stribeck.elbow.vs"]["range"] == [0.3, 0.4] and given["delay.elbow.d"]["range"] == [-0.001, 0.002]


def test_a_candidate_is_questioned_where_it_can_be_found(experiment, cli):
    """Its values are placed as in a fit; what is held stays so, in the model and in the command; what is no number at most values says nothing."""
    import json

    candidates = [{**FORMULA, "w": 0.12}, {"formula": "g*log(q-b)", "name": "odd"}]
    config = {"model.candidates": candidates, "data.train": ["train.csv"], "data.test": ["test.csv"]}
    said = json.loads(cli("diagnose", experiment(config=config, train=bump, test=bump), "--json").out)
    best = next(f for f in said["findings"] if f["joint"] == "elbow")
    assert best["effect"] == "formula" and abs(best["parameters"]["formula.elbow.q0"]["value"] + 0.23) < 0.02
    assert "--option w=0.12" in best["command"] and best["parameters"]["formula.elbow.w"]["value"] == 0.12


def test_add_takes_start_and_within(experiment, cli):
    import shlex

    folder = experiment(train=bump, test=bump)
    options = ["formula=h*exp(-((q-q0)/w)**2)", "q0={start: 0.1, within: [-1, 1]}"]
    said = cli("add", folder, "formula", "--joint", "elbow", *(word for option in options for word in ("--option", option)))
    assert said.status == 0, said.err
    entry = pipeline.load(folder).model.effects[-1]
    assert entry.options["q0"] == {"start": 0.1, "within": [-1, 1]}
    from sysid.addition import command

    words = shlex.split(command(folder / "config.yaml", "formula", ["elbow"], entry.options))
    from sysid.effect_entry import options as read

    given = read([word for before, word in zip(words, words[1:]) if before == "--option"])
    assert given == entry.options


# ---- through the experiment file


def entries(folder, run=None):
    from sysid.results import _relocated

    return _relocated(pipeline.load(folder), run or folder)["model"]["effects"]


def test_formulas_in_an_experiment(experiment, cli):
    written = [
        "viscous", {"formula": "c*s", "joints": ["shoulder"]}, {"formula": "a*sin(3*q) + d*sin(b*q)", "joints": ["elbow"], "name": "my_ripple", "b": 5.0},
        {"formula": "a*q_elbow", "name": "spring_between"},
    ]  # fmt: skip
    folder = experiment(config={"model.effects": written})
    said = cli("fit", folder, "--json")
    assert said.status == 0, said.err
    import json

    found = {entry["name"]: entry["value"] for entry in json.loads(said.out)["parameters"]}
    assert {"formula.shoulder.c", "my_ripple.elbow.a", "my_ripple.elbow.b", "my_ripple.elbow.d", "spring_between.shoulder.a"} <= set(found)
    assert found["my_ripple.elbow.b"] == 5.0 and abs(found["formula.shoulder.c"] - 0.2) < 0.05
    again = pipeline.load(said.run / "experiment.yaml")
    assert again.model == pipeline.load(folder).model
    assert sorted(map(str, entries(folder))) == sorted(map(str, [{**({"joints": e.pop("joints")} if "joints" in e else {}), **e} if isinstance(e, dict) else e for e in written]))


FAULTS = {
    "twice": ([{"formula": "a*q"}, {"formula": "a*qd"}], ["formula stands twice", "a `name` of its own"]),
    "bad formula": (["viscous", {"formula": "a*q[0]"}], ["line", "model.effects[1]", "'q[0]'"]),
    "formula alone": (["formula"], ["line", "model.effects[0]", "{formula:"]),
    "formula of options": ([{"formula": {"joints": ["elbow"]}}], ["line", "model.effects[0]", "{formula:"]),
    "unknown key": ([{"formula": "a*q", "jonts": ["elbow"]}], ["line", "unknown key 'jonts'", "joints"]),
    "no such joint": ([{"formula": "a*q_wrist"}], ["q_wrist", "q_shoulder, q_elbow"]),
    "name taken": ([{"formula": "a*q", "name": "viscous"}], ["name 'viscous'"]),
    "name of nothing": ([{"formula": "a*q", "name": "../x"}], ["name '../x'"]),
    "name no text": ([{"formula": "a*q", "name": 3}], ["name '3'"]),
    "nothing asked": ([{"formula": "a*sin(b*q)", "b": {}}], ["formula.b", "neither start nor within", "{start: number, within: [low, high]}"]),
    "asked oddly": ([{"formula": "a*sin(b*q)", "b": {"begin": 3}}], ["formula.b", "'begin'", "within: [low, high]"]),
    "no range": ([{"formula": "a*sin(b*q)", "b": {"within": 3}}], ["formula.b.within", "[low, high]"]),
    "range the wrong way": ([{"formula": "a*sin(b*q)", "b": {"within": [3, 1]}}], ["formula.b.within", "the low below the high"]),
    "start outside": ([{"formula": "a*sin(b*q)", "b": {"start": 4, "within": [1, 3]}}], ["formula.b.start is 4", "outside [1.0, 3.0]"]),
    "a coefficient": ([{"formula": "a*sin(b*q)", "a": 3}], ["a is a coefficient of the formula", "line", "formula, name, b, joints"]),
    "not in the formula": ([{"formula": "a*sin(bb*q)", "b": {"start": 3}}], ["unknown key 'b'", "bb", "line"]),
    "below zero": ([{"stribeck": {"vs": {"within": [-1, 1]}}}], ["stribeck.vs may be -1", "above zero"]),
    "mistyped": ([{"formula": "a*sin(qdot*b)"}], ["'qdot'", "qd", "line"]),
    "held by text": ([{"formula": "a*sin(b*q)", "b": "x"}], ["formula.b", "'x'"]),
    "not finite": ([{"formula": "a*log(0 - q**2)"}], ["log(0 - q ** 2)", "no finite number"]),
    "idle value": ([{"warmup": {"signal": "heat", "T": 3}}], ["warmup", "no T"]),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_of_entries(experiment, cli, name):
    written, words = FAULTS[name]
    cli("fit", experiment(config={"model.effects": written})).complains("model.effects", *words)


# ---- a user's own file

OWN = '''
import numpy as np
from sysid.effect import Linear, MotionEffect, SensorEffect, Shape, TorqueEffect, WrenchEffect
from dataclasses import dataclass, replace

class MySqueak(TorqueEffect):
    """It squeaks."""
    options = {"power": "of the speed"}
    power = 3
    c = Linear("N m", says="size")
    k = Shape("1/rad", 0.5, 2.0, even=True)
    def columns(self, motion, joint, k):
        return motion.direction(joint)[None] * np.sin(k * motion.q[None, :, joint]) ** self.power

class Shift(MotionEffect):
    d = Shape("rad", -1, 1, start=0.0)
    def moved(self, motion, joint, d):
        return replace(motion, q=motion.q + d)

class Half(SensorEffect):
    e = Shape("1", -1, 1, start=0.0)
    def sensed(self, torque, step, e):
        return (1 + e) * torque

class Push(WrenchEffect):
    name = "my_push"
    f = Linear("N")
    def columns(self, motion, robot):
        return np.ones((robot.dof, 1, len(motion.t)))

class Unfinished(TorqueEffect):
    pass

class Taken(TorqueEffect):
    name = "viscous"
    def columns(self, motion, joint):
        return motion.qd[None, :, joint]

class Wide(TorqueEffect):
    c = Linear("N m")
    def columns(self, motion, joint):
        return motion.qd

class Divides(TorqueEffect):
    c = Linear("N m")
    def columns(self, motion, joint):
        return 1 / motion.qd[None, :, joint]

class Fails(TorqueEffect):
    c = Linear("N m")
    def columns(self, motion, joint):
        return motion.nothing

class Heated(TorqueEffect):
    c = Linear("N m")
    def columns(self, motion, joint):
        return motion.signals["heat"][None]

class Wants(TorqueEffect):
    def __init__(self, size):
        pass
    def columns(self, motion, joint):
        return motion.qd[None, :, joint]

@dataclass
class Plain:
    x: "int" = 3

thing = 5
'''  # noqa: S105


def own(experiment, *written, text=OWN, **more):
    folder = experiment(config={"model.effects": list(written), **more})
    (folder / "mine.py").write_text(text)
    trust(folder / "mine.py")
    return folder


def test_own_effects_in_an_experiment(experiment, cli):
    written = ["viscous", "coulomb", {"mine.py:MySqueak": {"joints": ["elbow"], "power": 1, "k": 1.5}}, {"mine.py:Half": {"joints": ["elbow"]}}, "mine.py:Push"]
    folder = own(experiment, *written)
    _, model, _ = pipeline.build(pipeline.load(folder))
    names = [c.name for c in model.coefficients] + [v.name for v in model.shape_values]
    assert {"my_squeak.elbow.c", "my_squeak.elbow.k", "half.elbow.e", "my_push.*.f"} <= set(names)
    squeak = describe(model.terms[2][0])
    assert squeak["summary"] == "It squeaks." and squeak["source"] == squeak["equation"] == "not stated"
    assert model.terms[2][0].power == 1
    said = cli("fit", folder)
    assert said.status == 0, said.err
    again = pipeline.load(said.run / "experiment.yaml")
    assert [e.name for e in again.model.effects][2] == "../experiment/mine.py:MySqueak"
    assert [c.name for c in pipeline.build(again)[1].coefficients] == [c.name for c in model.coefficients]
    assert not (folder / "__pycache__").exists()


def test_own_effects_travel_to_other_processes(experiment):
    import pickle

    cloudpickle = pytest.importorskip("cloudpickle")  # what joblib sends tasks with

    folder = own(experiment, "mine.py:MySqueak")
    _, model, _ = pipeline.build(pipeline.load(folder))
    copy = pickle.loads(cloudpickle.dumps(model.terms[0][0]))
    machine, piece = moving()
    np.testing.assert_array_equal(copy.columns(piece, 1, k=1.0), model.terms[0][0].columns(piece, 1, k=1.0))


def test_a_changed_file_is_read_again(experiment):
    folder = own(experiment, "mine.py:MySqueak")
    spec = EffectSpec(name="mine.py:MySqueak")
    before = found(spec, folder)
    assert found(spec, folder).__class__ is before.__class__
    (folder / "mine.py").write_text(OWN.replace("It squeaks", "It squeals"))
    trust(folder / "mine.py")
    assert describe(found(spec, folder))["summary"] == "It squeals."


OWN_FAULTS = {
    "no file": ("theirs.py:Squeak", ["theirs.py", "No such file"]),
    "no class": ("mine.py:Squeek", ["mine.py", "'Squeek'", "MySqueak", "Push"]),
    "no class named": ("mine.py", ["line", "mine.py:Name"]),
    "a number": ("mine.py:thing", ["mine.py: thing", "not an effect"]),
    "a plain class": ("mine.py:Plain", ["mine.py: Plain", "not an effect"]),
    "the base itself": ("mine.py:TorqueEffect", ["columns"]),
    "abstract": ("mine.py:Unfinished", ["does not define columns"]),
    "a name that is taken": ("mine.py:Taken", ["'viscous'", "rename"]),
    "wrong shape": ("mine.py:Wide", ["Wide.columns", "(40, 2)", "(1, 40)"]),
    "not finite": ("mine.py:Divides", ["Divides.columns", "not finite", "at rest"]),
    "failing": ("mine.py:Fails", ["mine.py line", "Fails.columns fails", "AttributeError", "nothing"]),
    "an unknown option": ({"mine.py:MySqueak": {"size": 3}}, ["no option 'size'", "joints, power"]),
    "a signal that is not logged": ("mine.py:Heated", ["Heated.columns fails", "KeyError", "heat"]),
    "arguments": ("mine.py:Wants", ["Wants cannot be made", "TypeError"]),
}


@pytest.mark.parametrize("name", OWN_FAULTS)
def test_faults_of_own_effects(experiment, cli, name):
    written, words = OWN_FAULTS[name]
    cli("fit", own(experiment, written)).complains(*words)


@pytest.mark.parametrize(
    "text, words",
    [("def x(:\n", ["line 1", "SyntaxError"]), ("\nimport nothing_of_that_name\n", ["line 2", "ModuleNotFoundError"]),
     ("x = 1\nraise SystemExit(3)\n", ["line 2", "SystemExit"]), ("\0", ["mine.py", "cannot be run"]), ("\n\n1/0", ["line 3", "ZeroDivisionError"])],
)  # fmt: skip
def test_files_that_cannot_be_run(experiment, cli, text, words):
    cli("fit", own(experiment, "mine.py:X", text=text)).complains("mine.py", *words)


def test_an_own_effect_may_build_on_another(experiment):
    text = "from sysid.effects.stribeck import Stribeck\nfrom sysid.effect import Linear\nclass More(Stribeck):\n    name = 'more'\n    x = Linear('N m', says='x')\n    def columns(self, motion, joint, vs):\n        import numpy as np\n        return np.concatenate([super().columns(motion, joint, vs), motion.qd[None, :, joint]])\n"
    _, model, _ = pipeline.build(pipeline.load(own(experiment, {"mine.py:More": {"joints": ["elbow"]}}, text=text)))
    assert [c.name for c in model.coefficients] == ["more.elbow.dF", "more.elbow.x"]
    assert [c.name for c in vocabulary.find("stribeck").coefficients()] == ["dF"]
