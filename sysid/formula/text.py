"""A formula's text -> its tree, checked, with what is to be found in it.

The text is parsed, every piece of the tree is compared with a list of what is allowed, and the tree
is then worked out here over arrays; it is never run as code. Names that are no variable are what is
to be found: those that multiply a term become linear coefficients, those inside a function, a
divisor or a power become shape values.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import ConfigError
from ..warned import unheard
from .tree import OPERATIONS, names_of, operands, terms
from .words import FUNCTIONS, VARIABLES, mistyped, near

_LONGEST, _DEEPEST, _POWER = 500, 50, 20
OTHER = re.compile(r"(q|qd|qdd)_(\w+)")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")
_KEYS = ("formula", "joints", "name", "options")


@dataclass(frozen=True)
class Parsed:
    """A formula's tree, its coefficients, its shape values, and the other joints' variables and the
    logged signals in it.
    """

    tree: ast.expr
    linear: tuple[str, ...]
    inner: tuple[str, ...]
    others: tuple[str, ...]
    signals: tuple[str, ...] = ()


def parse(text: str, signals: Iterable[str] = ()) -> Parsed:
    """A formula's tree, checked.

    Args:
        signals: names of logged signals, which are variables too.

    Raises:
        ConfigError: anything that is not a sum of terms with coefficients, in the allowed words.
    """
    tree = _tree(text)
    names = dict.fromkeys(_checked(tree))
    logged = tuple(name for name in names if name in set(signals) and name not in VARIABLES)
    others = tuple(name for name in names if OTHER.fullmatch(name) and name not in logged)
    unknown = [name for name in names if name not in VARIABLES and name not in others + logged]
    for name in unknown:
        if not _NAME.fullmatch(name) or name in _KEYS:
            raise refused(
                f"the name {name[:40]!r} in the formula",
                allowed="letters, digits and single _ between them",
                do="rename the coefficient",
            )
        if name in ("tau", "torque"):
            raise refused(
                f"{name} in the formula: measured torque would explain itself",
                allowed="load, the torque that the bodies need",
            )
        if meant := mistyped(name, set(names), _beside(tree, name), signals):
            raise refused(
                f"the name {name!r} in the formula looks like a word mistyped",
                allowed=", ".join(meant),
                do="correct it, or call the value something else",
            )
    inside = _inside(tree)
    inner = tuple(name for name in unknown if name in inside)
    linear = tuple(name for name in unknown if name not in inside)
    for term in terms(tree):
        if () in _products(term, set(linear)):
            raise refused(
                f"the term {shown(term)} has no coefficient in front:"
                " a constant cannot be identified",
                do=f"write c*({shown(term)})",
            )
    for node in _outermost(tree):
        if (own := names_of(node)) & set(inner) and not own - set(unknown) - {"pi"}:
            close = list(
                dict.fromkeys(w for n in own & set(inner) for w in near(n, [*VARIABLES, *signals]))
            )
            raise refused(
                f"{shown(node)} in the formula holds nothing that changes:"
                f" {' and '.join(sorted(own))}"
                " would be to be found",
                allowed=", ".join(close) or ", ".join(VARIABLES),
            )
    return Parsed(tree, linear, inner, others, logged)


def _outermost(node: ast.expr) -> list[ast.expr]:
    """The functions and powers of a tree that stand in no other."""
    if isinstance(node, ast.Call) or (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)):
        return [node]
    return [found for part in operands(node) for found in _outermost(part)]


def _beside(node: ast.expr, name: str) -> set[str]:
    """The names that a name is added to, taken from or held against by a division."""
    out = set().union(*(_beside(part, name) for part in operands(node)))
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        parts = terms(node)
        if any(isinstance(part, ast.Name) and part.id == name for part in parts):
            out |= names_of(node)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and name in names_of(node):
        out |= names_of(node)
    return out - {name}


def refused(what: str, *, allowed: str | None = None, do: str | None = None) -> ConfigError:
    """An error of a formula, of which an experiment file has many."""
    return ConfigError(what, where="model.effects", allowed=allowed, do=do)


def shown(node: ast.AST) -> str:
    """A piece of a formula as text, cut where it is long."""
    text = ast.unparse(node)
    return text if len(text) <= 60 else text[:57] + "..."


def _tree(text) -> ast.expr:
    if not isinstance(text, str) or not text.strip():
        raise refused("the formula is empty", allowed='text such as "a*sin(3*q)"')
    if len(text) > _LONGEST:
        raise refused(f"a formula of {len(text)} characters", allowed=f"at most {_LONGEST}")
    if not text.isascii() or not text.replace("\n", " ").replace("\t", " ").isprintable():
        odd = next(c for c in text if not (c.isascii() and (c.isprintable() or c in "\n\t")))
        raise refused(f"the character {odd!r} in the formula", allowed="plain ASCII")
    nested = np.cumsum([(c in "([{") - (c in ")]}") for c in text])
    if nested.max() > _DEEPEST:
        raise refused("a formula of too many nested parentheses", allowed=f"{_DEEPEST}")
    try:
        with unheard():  # Python's own opinions of odd text; what is allowed is checked below
            return ast.parse(" ".join(text.split()), mode="eval").body
    except SyntaxError as error:
        raise refused(
            f"the formula {text[:60]!r} cannot be read ({error.msg}"
            + (f" at character {error.offset})" if error.offset else ")")
        ) from None
    except (ValueError, MemoryError, RecursionError, OverflowError):
        raise refused(f"the formula {text[:60]!r} cannot be read") from None


def _checked(tree: ast.expr) -> list[str]:
    """The names in a tree of allowed pieces, in the order of the text."""
    names: list[str] = []
    waiting = [(tree, 1)]
    while waiting:
        node, depth = waiting.pop()
        if depth > _DEEPEST:
            raise refused("a formula too deeply nested", allowed=f"{_DEEPEST} levels")
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATIONS:
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
                raise refused(
                    f"the number {shown(node)} in the formula", allowed="at most 1e12 in size"
                )
        elif isinstance(node, ast.Name):
            if node.id in FUNCTIONS:
                raise refused(
                    f"{node.id} in the formula has no argument", do=f"write {node.id}(...)"
                )
            names.append(node.id)
        else:
            raise refused(
                f"{shown(node)!r} in the formula",
                allowed=f"numbers, names, + - * / **, and {', '.join(FUNCTIONS)}",
            )
    return names


def _arguments(node: ast.Call) -> list[ast.expr]:
    name = node.func.id if isinstance(node.func, ast.Name) else None
    if name not in FUNCTIONS:
        close = near(name, FUNCTIONS) if name else []
        raise refused(
            f"the function {shown(node.func)!r} in the formula",
            allowed=", ".join(close or FUNCTIONS),
        )
    wanted = FUNCTIONS[name].nin
    if (
        node.keywords
        or len(node.args) != wanted
        or any(isinstance(argument, ast.Starred) for argument in node.args)
    ):
        raise refused(
            f"{shown(node)} in the formula", allowed=f"{name} of {wanted} value{'s' * (wanted > 1)}"
        )
    return node.args


def _check_power(exponent: ast.expr) -> None:
    if any(isinstance(node, ast.Name) for node in ast.walk(exponent)):
        return
    number = exponent.operand if isinstance(exponent, ast.UnaryOp) else exponent
    if not (
        isinstance(number, ast.Constant)
        and type(number.value) in (int, float)
        and number.value <= _POWER
    ):
        raise refused(
            f"the power {shown(exponent)} in the formula",
            allowed=f"a number from -{_POWER} to {_POWER}, written out",
        )


def _inside(node: ast.expr, within: bool = False) -> set[str]:
    """The names inside a function, a divisor or a power."""
    if isinstance(node, ast.Name):
        return {node.id} if within else set()
    if isinstance(node, ast.BinOp):
        power = within or isinstance(node.op, ast.Pow)
        return _inside(node.left, power) | _inside(
            node.right, power or isinstance(node.op, ast.Div)
        )
    if isinstance(node, ast.UnaryOp):
        return _inside(node.operand, within)
    return (
        set().union(*(_inside(argument, True) for argument in node.args))
        if isinstance(node, ast.Call)
        else set()
    )


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
        raise refused(
            f"{shown(node)} in the formula multiplies the coefficients {a} and {b}",
            allowed=f"one coefficient a term, and the variables {', '.join(VARIABLES)}",
        )
    return both
