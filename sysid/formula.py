"""A user's formula -> a torque effect: `a*sin(3*q) + b*qd**3` on the joints that it is given.

The text is parsed, every piece of the tree is compared with a list of what is allowed, and the tree is then worked out
here over arrays; it is never run as code. Names that are no variable are what is to be found: those that multiply a
term become linear coefficients, those inside a function, a divisor or a power become shape values from 1e-3 to 1e3,
tried over a geometric grid of 12 and then refined.
"""

from __future__ import annotations

import ast
import re
import warnings
from dataclasses import dataclass

import numpy as np

from .effect import Linear, Shape, TorqueEffect, called, vocabulary
from .errors import ConfigError

FUNCTIONS = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log, "sqrt": np.sqrt, "abs": np.abs, "sign": np.sign,
    "tanh": np.tanh, "sinh": np.sinh, "cosh": np.cosh, "atan": np.arctan, "min": np.minimum, "max": np.maximum,
}  # fmt: skip
VARIABLES = {
    "q": "position", "qd": "velocity", "qdd": "acceleration", "s": "sign of the velocity", "t": "time [s]", "pi": "3.14159",
    "load": "torque that the bodies need", "tau_load": "the same",
}  # fmt: skip
_OPERATIONS = {ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power}
_LONGEST, _DEEPEST, _POWER = 500, 50, 20
_OTHER = re.compile(r"(q|qd|qdd)_(\w+)")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")
_KEYS = ("formula", "joints", "name", "options")


@dataclass(frozen=True)
class Parsed:
    """A formula's tree, its coefficients, its shape values, and the other joints' variables in it."""

    tree: ast.expr
    linear: tuple[str, ...]
    bent: tuple[str, ...]
    others: tuple[str, ...]


class Formula(TorqueEffect):
    """A formula of the experiment file."""

    name = "formula"
    looks_like = "what the formula says"
    separate_by = "not stated"
    source = "the experiment file"
    options = {"formula": "the torque, every term with a coefficient of its own", "name": "its name, where a joint has several (default formula)"}

    def __init__(self, text: str, name: str = "formula"):
        if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9_]*", name) or name in vocabulary():
            raise _refused(f"the formula's name {str(name)[:40]!r}", allowed="a word of a-z, 0-9 and _ that is no effect of `sysid effects`")
        self.name, self.text, self.parsed = name, text, parse(text)
        self.equation = f"tau = {text}"
        self.uses_load = any(isinstance(node, ast.Name) and node.id in ("load", "tau_load") for node in ast.walk(self.parsed.tree))
        self.joints: tuple[str, ...] = ()

    @property
    def instantaneous(self):
        return not any(isinstance(node, ast.Name) and node.id == "t" for node in ast.walk(self.parsed.tree))

    def coefficients(self):
        return tuple(called(Linear("SI", says="coefficient of the formula"), name) for name in self.parsed.linear)

    def shapes(self):
        return tuple(called(Shape("SI", 1e-3, 1e3, grid=12, says="value inside the formula"), name) for name in self.parsed.bent)

    def bound(self, robot, joint):
        bound = self.given()
        bound.joints = tuple(re.sub(r"\W", "_", name) for name in robot.joints)
        for name in self.parsed.others:
            if bound.joints.count(_OTHER.fullmatch(name)[2]) != 1:
                raise _refused(f"{name} in the formula names no joint", allowed=", ".join(f"q_{word}" for word in bound.joints))
        return bound

    def columns(self, motion, joint, **shapes):
        known = {
            "q": motion.q[:, joint], "qd": motion.qd[:, joint], "qdd": motion.qdd[:, joint], "s": motion.direction(joint), "t": motion.t, "pi": np.pi,
            **({"load": motion.load[:, joint], "tau_load": motion.load[:, joint]} if self.uses_load else {}), **shapes,
        }  # fmt: skip
        for name in self.parsed.others:
            which, other = _OTHER.fullmatch(name).groups()
            known[name] = getattr(motion, which)[:, self.joints.index(other)]
        linear = self.parsed.linear
        out = np.empty((len(linear), len(motion.t)))
        with np.errstate(all="ignore"):
            for k in range(len(linear)):
                # linear in all of them and nothing left over: the column of one is the formula with this one alone
                values = {**known, **{name: float(name == linear[k]) for name in linear}}
                out[k] = _value(self.parsed.tree, values)
                if not np.isfinite(out[k]).all():
                    at = f"t = {motion.t[np.flatnonzero(~np.isfinite(out[k]))[0]]:g} s"
                    culprit = ast.unparse(_culprit(self.parsed.tree, values))
                    where = f"model.effects: {self.name}" + (f" on joint {self.joints[joint]}" if self.joints else "")
                    raise ConfigError(f"{culprit} in the formula is no finite number at {at}", where=where, do="keep it within its domain")
        return out


def parse(text: str) -> Parsed:
    """A formula's tree, checked.

    Raises:
        ConfigError: anything that is not a sum of terms with coefficients, in the allowed words.
    """
    tree = _tree(text)
    names = dict.fromkeys(_checked(tree))
    others = tuple(name for name in names if _OTHER.fullmatch(name))
    unknown = [name for name in names if name not in VARIABLES and name not in others]
    for name in unknown:
        if not _NAME.fullmatch(name) or name in _KEYS:
            raise _refused(f"the name {name[:40]!r} in the formula", allowed="letters, digits and single _ between them", do="rename the coefficient")
        if name in ("tau", "torque"):
            raise _refused(f"{name} in the formula: measured torque would explain itself", allowed="load, the torque that the bodies need")
    inside = _inside(tree)
    bent = tuple(name for name in unknown if name in inside)
    linear = tuple(name for name in unknown if name not in inside)
    for term in _sum(tree):
        if () in _products(term, set(linear)):
            raise _refused(f"the term {_shown(term)} has no coefficient in front: a constant cannot be identified", do=f"write c*({_shown(term)})")
    return Parsed(tree, linear, bent, others)


def option_names(text: str) -> list[str]:
    """The keys that a formula may have beside `joints`: its own two, and its shape values, which may be held. Raises ConfigError."""
    return ["formula", "name", *parse(text).bent]


def _refused(what: str, *, allowed: str | None = None, do: str | None = None) -> ConfigError:
    return ConfigError(what, where="model.effects", allowed=allowed, do=do)


def _shown(node: ast.AST) -> str:
    text = ast.unparse(node)
    return text if len(text) <= 60 else text[:57] + "..."


def _tree(text) -> ast.expr:
    if not isinstance(text, str) or not text.strip():
        raise _refused("the formula is empty", allowed='text such as "a*sin(3*q)"')
    if len(text) > _LONGEST:
        raise _refused(f"a formula of {len(text)} characters", allowed=f"at most {_LONGEST}")
    if not text.isascii() or not text.replace("\n", " ").replace("\t", " ").isprintable():
        odd = next(c for c in text if not (c.isascii() and (c.isprintable() or c in "\n\t")))
        raise _refused(f"the character {odd!r} in the formula", allowed="plain ASCII")
    nested = np.cumsum([(c in "([{") - (c in ")]}") for c in text])
    if nested.max() > _DEEPEST:
        raise _refused("a formula of too many nested parentheses", allowed=f"{_DEEPEST}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python's own opinions of odd text; what is allowed is checked below
            return ast.parse(" ".join(text.split()), mode="eval").body
    except SyntaxError as error:
        raise _refused(f"the formula {text[:60]!r} cannot be read ({error.msg}" + (f" at character {error.offset})" if error.offset else ")")) from None
    except (ValueError, MemoryError, RecursionError, OverflowError):
        raise _refused(f"the formula {text[:60]!r} cannot be read") from None


def _checked(tree: ast.expr) -> list[str]:
    """The names in a tree of allowed pieces, in the order of the text."""
    names: list[str] = []
    waiting = [(tree, 1)]
    while waiting:
        node, depth = waiting.pop()
        if depth > _DEEPEST:
            raise _refused("a formula too deeply nested", allowed=f"{_DEEPEST} levels")
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
            if isinstance(node.op, ast.Pow):
                _check_power(node.right)
            # a chain of sums or products leans to the left and is one level
            chain = isinstance(node.left, ast.BinOp) and not isinstance(node.op, ast.Pow)
            waiting += [(node.right, depth + 1), (node.left, depth + (not chain))]
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
            waiting.append((node.operand, depth + 1))
        elif isinstance(node, ast.Call):
            waiting += [(argument, depth + 1) for argument in reversed(_arguments(node))]
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            if not abs(node.value) <= 1e12:
                raise _refused(f"the number {_shown(node)} in the formula", allowed="at most 1e12 in size")
        elif isinstance(node, ast.Name):
            if node.id in FUNCTIONS:
                raise _refused(f"{node.id} in the formula has no argument", do=f"write {node.id}(...)")
            names.append(node.id)
        else:
            raise _refused(f"{_shown(node)!r} in the formula", allowed=f"numbers, names, + - * / **, and {', '.join(FUNCTIONS)}")
    return names


def _arguments(node: ast.Call) -> list[ast.expr]:
    name = node.func.id if isinstance(node.func, ast.Name) else None
    if name not in FUNCTIONS:
        raise _refused(f"the function {_shown(node.func)!r} in the formula", allowed=", ".join(FUNCTIONS))
    wanted = FUNCTIONS[name].nin
    if node.keywords or len(node.args) != wanted or any(isinstance(argument, ast.Starred) for argument in node.args):
        raise _refused(f"{_shown(node)} in the formula", allowed=f"{name} of {wanted} value{'s' * (wanted > 1)}")
    return node.args


def _check_power(exponent: ast.expr) -> None:
    if any(isinstance(node, ast.Name) for node in ast.walk(exponent)):
        return
    number = exponent.operand if isinstance(exponent, ast.UnaryOp) else exponent
    if not (isinstance(number, ast.Constant) and type(number.value) in (int, float) and number.value <= _POWER):
        raise _refused(f"the power {_shown(exponent)} in the formula", allowed=f"a number from -{_POWER} to {_POWER}, written out")


def _inside(node: ast.expr, within: bool = False) -> set[str]:
    """The names inside a function, a divisor or a power."""
    if isinstance(node, ast.Name):
        return {node.id} if within else set()
    if isinstance(node, ast.BinOp):
        power = within or isinstance(node.op, ast.Pow)
        return _inside(node.left, power) | _inside(node.right, power or isinstance(node.op, ast.Div))
    if isinstance(node, ast.UnaryOp):
        return _inside(node.operand, within)
    return set().union(*(_inside(argument, True) for argument in node.args)) if isinstance(node, ast.Call) else set()


def _sum(node: ast.expr) -> list[ast.expr]:
    """The terms of a sum."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        return _sum(node.left) + _sum(node.right)
    return _sum(node.operand) if isinstance(node, ast.UnaryOp) else [node]


def _products(node: ast.expr, linear: set[str]) -> set[tuple[str, ...]]:
    """The coefficients that multiply each term of a tree, written out as a sum of products."""
    if isinstance(node, ast.Name):
        return {(node.id,)} if node.id in linear else {()}
    if isinstance(node, ast.UnaryOp):
        return _products(node.operand, linear)
    if not isinstance(node, ast.BinOp) or isinstance(node.op, ast.Pow):
        return {()}
    left, right = _products(node.left, linear), _products(node.right, linear)
    if isinstance(node.op, (ast.Add, ast.Sub)):
        return left | right
    if isinstance(node.op, ast.Div):
        return left
    both = {a + b for a in left for b in right}
    if twice := [product for product in both if len(product) > 1]:
        a, b = sorted(twice)[0]
        raise _refused(f"{_shown(node)} in the formula multiplies the coefficients {a} and {b}", allowed=f"one coefficient a term, and the variables {', '.join(VARIABLES)}")
    return both


def _operands(node: ast.expr) -> list[ast.expr]:
    if isinstance(node, ast.BinOp):
        return [node.left, node.right]
    return [node.operand] if isinstance(node, ast.UnaryOp) else node.args if isinstance(node, ast.Call) else []


def _value(node: ast.expr, known: dict):
    """What a tree is worth, with the names' values."""
    if isinstance(node, ast.Constant):
        return float(node.value)
    if isinstance(node, ast.Name):
        return known[node.id]
    parts = [_value(part, known) for part in _operands(node)]
    if isinstance(node, ast.UnaryOp):
        return np.negative(parts[0]) if isinstance(node.op, ast.USub) else parts[0]
    return (FUNCTIONS[node.func.id] if isinstance(node, ast.Call) else _OPERATIONS[type(node.op)])(*parts)


def _culprit(node: ast.expr, known: dict) -> ast.expr:
    """The smallest part of a tree that is not finite."""
    for part in _operands(node):
        if not np.isfinite(_value(part, known)).all():
            return _culprit(part, known)
    return node
