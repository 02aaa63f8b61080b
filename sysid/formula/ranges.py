"""Where the values inside a formula can be found, worked out from the tree and the log.

One principle: a value can be told only where it matters beside what it stands with, so its size is
that of what it stands with.

- Added to or taken from a signal (`q - q0`): a place on that signal. Its range on the log, and half
  its span on either side.
- Multiplied with a signal, or dividing it, inside a function (`tanh(qd/v)`): a scale. The product's
  greatest size goes from a tenth, where a function is all but a straight line, to where what it
  makes is no wider than ten of the log's samples.
- The same within sin, cos or tan (`sin(k*q)`): a count of cycles, up to a quarter of one between
  two samples, in steps that cannot miss one (a quarter of a cycle over the signal's span), at most
  2000 of them; what is added to it there is a phase.
- In an exponent: from -6 to 6, of a base that comes near zero above 0.05.
- What must not vanish (a divisor, the argument of log or sqrt) keeps the sign that it has on the
  log.
- Both signs of a scale are searched unless turning it, alone or with others, leaves every column
  what it was (`signs`).

Wanted sizes go down the tree: exp wants 1, (.)**2 the root of what is wanted of it, a sum what
stands beside.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from . import search_range
from .search_range import CYCLES, SMALL, Range
from .signs import one_sided
from .tree import names_of, signed_terms, value

_LEAST = 0.1  # of an argument
_WIDE = 30.0  # of an argument that only other such values are beside
_STEEP, _FLAT = 6.0, 0.05  # exponents
_SEEN = 10  # samples that a detail must hold
_FINEST = 1e3  # parts of a signal's size that a detail may be one of
_NEAR_ZERO = 1e-2  # of a signal's size


@dataclass(frozen=True)
class Wanted:
    """What a function wants of its argument: its greatest size from `least` to `most` (None: as
    fine as the log tells), with cycles over it, or that it does not vanish. Nothing where a
    coefficient in front takes any size."""

    least: float | None = None
    most: float | None = None
    cycles: bool = False
    apart: bool = False

    def scaled(self, factor: float, power: float = 1.0) -> Wanted:
        """(what is wanted * factor) ** power."""
        own = {key: at for key in ("least", "most") if (at := getattr(self, key)) is not None}
        return replace(self, **{key: float((at * factor) ** power) for key, at in own.items()})


_ANY, _APART, _PLAIN = Wanted(), Wanted(apart=True), Wanted(_LEAST)
_TURNS = Wanted(_LEAST, cycles=True)
_WANTED = {
    "sin": _TURNS, "cos": _TURNS, "tan": replace(_TURNS, most=1.4),
    "log": _APART, "sqrt": _APART, "sign": _ANY,
}  # fmt: skip


@dataclass(frozen=True)
class _Search:
    """What a tree is looked at with, and the ranges `found` so far; the rest as in `ranges`."""

    known: dict
    rows: int
    inner: frozenset[str]
    linear: frozenset[str]
    found: dict[str, Range] = field(default_factory=dict)

    def put(self, name: str, range_: Range) -> None:
        self.found[name] = self.found[name].united(range_) if name in self.found else range_

    def worth(self, node: ast.expr) -> np.ndarray:
        """A tree's values (2, n), those that are to be found as placed so far, coefficients 1."""
        middle = {name: r.typical for name, r in self.found.items()}
        with np.errstate(all="ignore"):
            got = value(node, {**{n: 1.0 for n in names_of(node)}, **middle, **self.known})
        got = np.broadcast_to(np.asarray(got, dtype=float), np.shape(self.known["t"]))
        return np.where(np.isfinite(got), got, 0.0)

    def multiplied(self, factors: list[tuple[int, ast.expr]]) -> np.ndarray:
        """The product (2, n) of trees with their exponents."""
        with np.errstate(all="ignore"):
            out = np.prod([self.worth(f) ** e for e, f in factors], axis=0)
        out = out * np.ones_like(self.known["t"])
        return np.where(np.isfinite(out), out, 0.0)

    def open(self, node: ast.expr) -> bool:
        """Whether something in a tree is to be found."""
        return bool(names_of(node) & self.inner)


def ranges(
    tree: ast.expr, inner, linear, known: dict, rows: int, columns: Callable[[dict], np.ndarray]
) -> dict[str, Range]:  # fmt: skip
    """Where each value inside a formula can be found.

    Args:
        inner, linear: the names of the values to place, and of the coefficients.
        known: {name: (2, n)} values of the variables on rows of the log, and on the rows after
            them; rows: how many the log has.
        columns: called with values by name, gives the formula's columns (k, n), not finite where
            it cannot.
    """
    search = _Search(known, rows, frozenset(inner), frozenset(linear))
    _visit(tree, _ANY, search)
    for name in inner:
        search.found.setdefault(name, search_range.size(1e-3, 1e3))
    return one_sided(search.found, columns)


def _visit(node: ast.expr, wanted: Wanted, search: _Search) -> None:
    if not search.open(node):
        return
    if isinstance(node, ast.Name):
        search.put(node.id, search_range.size(wanted.least or 1e-3, wanted.most or 1e3))
    elif isinstance(node, ast.UnaryOp):
        _visit(node.operand, wanted, search)
    elif isinstance(node, ast.Call) and len(node.args) == 2:  # min, max: one against the other
        _sum([(1.0, node.args[0]), (-1.0, node.args[1])], replace(wanted, apart=False), search)
    elif isinstance(node, ast.Call):
        own = wanted if node.func.id == "abs" else _WANTED.get(node.func.id, _PLAIN)
        _visit(node.args[0], own, search)
    elif isinstance(node.op, (ast.Add, ast.Sub)):
        _sum(signed_terms(node), wanted, search)
    elif isinstance(node.op, ast.Pow):
        _power(node, wanted, search)
    else:
        _product(_factors(node), wanted, search)


def _power(node: ast.BinOp, wanted: Wanted, search: _Search) -> None:
    base, exponent = node.left, node.right
    if not search.open(exponent):
        number = float(np.median(search.worth(exponent)))
        root = wanted.scaled(1.0, 1.0 / number) if number > 0 else wanted
        clear = wanted.apart or number <= 0 or number != round(number)
        _visit(base, replace(root, apart=clear), search)
        return
    _visit(base, _PLAIN if wanted.least else replace(_PLAIN, apart=True), search)
    worth = search.worth(base)
    if not search.open(base) and np.ptp(worth) == 0.0:
        return _visit(exponent, _PLAIN, search)  # 2**(k*q) is exp
    near = np.abs(worth).min() < _NEAR_ZERO * np.abs(worth).max()
    least = _FLAT if near else -_STEEP
    if isinstance(exponent, ast.Name):
        search.put(exponent.id, Range(least, _STEEP, "even", _FLAT).within(least, _STEEP))
    else:
        _visit(exponent, Wanted(_FLAT, _STEEP), search)


def _sum(terms: list, wanted: Wanted, search: _Search) -> None:
    if any(names_of(term) & search.linear for _, term in terms):
        for _, term in terms:  # each has a coefficient of its own
            _visit(term, _ANY, search)
        return
    named = lambda t: isinstance(t, ast.Name)  # noqa: E731
    rest = [(s, t) for s, t in terms if search.open(t) and not named(t)]
    closed = [s * search.worth(t) for s, t in terms if not search.open(t)]
    beside = sum(closed, np.zeros(1))
    size, span = float(np.max(np.abs(beside))), float(np.ptp(beside))
    for _, term in rest:
        if size == 0.0:
            own = wanted if wanted.least else replace(_PLAIN, most=_WIDE)
        else:  # a constant is passed by what grows past it; a signal is matched by what is as large
            own = Wanted(SMALL * size, _WIDE * size) if span else Wanted(_LEAST * size)
        _visit(term, own, search)
    moving = beside if span else sum((s * search.worth(t) for s, t in rest), beside)
    for sign, name in terms:
        if not (named(name) and search.open(name)):
            continue
        if wanted.cycles:
            search.put(name.id, search_range.phase())
        elif wanted.apart:
            search.put(name.id, search_range.clear_of(sign * moving))
        elif np.ptp(moving) > 0.0 and (span or not wanted.least):
            search.put(name.id, search_range.place(-sign * moving))
        elif rest:
            most = wanted.most or _WIDE
            search.put(name.id, Range(-most, most, "even", _LEAST).within(-most, most))
        else:
            _visit(name, Wanted(_LEAST * (size or 1.0), _WIDE * (size or 1.0)), search)


def _product(factors: list, wanted: Wanted, search: _Search) -> None:
    names = [(e, f) for e, f in factors if isinstance(f, ast.Name) and search.open(f)]
    rest = [(e, f) for e, f in factors if search.open(f) and not isinstance(f, ast.Name)]
    closed = [(e, f) for e, f in factors if not search.open(f)]
    around = float(np.max(np.abs(search.multiplied(closed)))) or 1.0
    for k, (exponent, factor) in enumerate(rest):
        if names or k or not wanted.least or exponent < 0:
            _visit(factor, _APART if exponent < 0 else _ANY, search)
        else:
            _visit(factor, wanted.scaled(1.0 / around), search)
    signal = search.multiplied([*closed, *rest])
    for exponent, name in names:
        search.put(name.id, _multiple(signal, exponent, wanted, search.rows))


def _multiple(signal: np.ndarray, exponent: int, wanted: Wanted, rows: int) -> Range:
    """Of a value that multiplies a signal (2, n), or divides it."""
    size, span = float(np.max(np.abs(signal))) or 1.0, float(np.ptp(signal)) or 1.0
    least = wanted.least or _LEAST
    if wanted.cycles:
        quarter = 0.5 * np.pi
        travel = float(np.sqrt(np.mean((signal[1] - signal[0]) ** 2))) or span
        most = max(min(quarter / travel, CYCLES * quarter / span), 2.0 * least / size)
        return search_range.count(least / size, most, quarter / span, exponent)
    finest = max(float(np.clip(rows / _SEEN, _WIDE, _FINEST)), 10.0 * least)
    most = wanted.most or finest
    ends = (least / size, most / size) if exponent > 0 else (size / most, size / least)
    return search_range.size(*ends)


def _factors(node: ast.expr, exponent: int = 1) -> list[tuple[int, ast.expr]]:
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
        other = exponent if isinstance(node.op, ast.Mult) else -exponent
        return _factors(node.left, exponent) + _factors(node.right, other)
    if isinstance(node, ast.UnaryOp):
        return _factors(node.operand, exponent)
    return [(exponent, node)]
