"""What a user adds: formulas, which are worked out and never run, and classes in a file of the user's."""

import ast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid import effect, pipeline
from sysid.effect import describe
from sysid.errors import ConfigError
from sysid.formula import FUNCTIONS, Formula, parse
from sysid.model import found
from sysid.specs import EffectSpec
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
    "qdot*a": "qdot and a", "a*a*q": "a and a",
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
    assert ("".join(parsed.linear), "".join(parsed.bent)) == SORTED[text]


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
    piece, whole = small_piece(), f"a*sin(b*0 + ({text}))"
    if len(whole) > 500:
        return
    known = {"q": piece.q[:, 1], "qd": piece.qd[:, 1], "qdd": piece.qdd[:, 1], "t": piece.t, "s": np.sign(piece.qd[:, 1]), "load": piece.load[:, 1]}
    # the truth is NumPy's own, run by Python: the text is this test's
    with np.errstate(all="ignore"):
        floats = ast.unparse(_Floats().visit(ast.parse(text, mode="eval")))
        truth = np.sin(eval(floats, {"__builtins__": {}}, {**FUNCTIONS, **known, "pi": np.pi, "b": np.float64(0.8), "number": np.float64}))
    formula = Formula(whole)
    assert formula.parsed.linear == ("a",) and formula.parsed.bent == ("b",)
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
    assert [c.name for c in effect.find("stribeck").coefficients()] == ["dF"]
