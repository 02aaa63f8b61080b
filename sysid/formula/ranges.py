"""Where the values inside a formula can be found, worked out from the tree and the log.

One principle: a value can be told only where it matters beside what it stands with, so its size is that
of what it stands with.

- Added to or taken from a signal (`q - q0`): a place on that signal. Its range on the log, and half its span
  on either side.
- Multiplied with a signal, or dividing it, inside a function (`tanh(qd/v)`): a scale. The product's greatest
  size goes from a tenth, where a function is all but a straight line, to where what it makes is no wider
  than ten of the log's samples.
- The same within sin, cos or tan (`sin(k*q)`): a count of cycles, up to a quarter of one between two samples,
  in steps that cannot miss one (a quarter of a cycle over the signal's span), at most 2000 of them; what is added to it
  there is a phase.
- In an exponent: from -6 to 6, of a base that comes near zero above 0.05.
- What must not vanish (a divisor, the argument of log or sqrt) keeps the sign that it has on the log.
- Both signs of a scale are searched unless turning it, alone or with others, leaves every column what it was.

Wanted sizes go down the tree: exp wants 1, (.)**2 the root of what is wanted of it, a sum what stands beside.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field, replace

import numpy as np

from .signs import one_sided
from .text import names_of, value

_LEAST, _WIDE, _STEEP = (
    0.1,
    30.0,
    6.0,
)  # of an argument; of an offset that only arguments are beside; exponents
_PLACES, _DECADE, _CYCLES, _PHASES = 25, 4, 2000, 8  # how many are tried
_SEEN = 10  # samples that a detail must hold
_FINEST = 1e3  # parts of a signal's size
_SMALL = (
    1e-4  # of a signal, what is added to it and still matters: a hundredth, which may be squared
)


@dataclass(frozen=True)
class Range:
    """Where a value is searched: from `low` to `high`, first at `tried`. `least`: what it may differ by and change little.

    spacing: "even", "ratio" (by equal ratios, on either side of zero where both signs count) or "cycles" (by `step`).
    """

    low: float
    high: float
    spacing: str
    least: float
    step: float = 0.0
    tried: tuple[float, ...] = ()

    def within(self, low: float, high: float) -> Range:
        """The same kind of values within other bounds."""
        if self.spacing == "cycles" and (high - low) / self.step <= _CYCLES:
            tried = np.linspace(low, high, 2 + int((high - low) / self.step))
        elif self.spacing == "even" or (low <= 0.0 <= high and self.least >= max(-low, high)):
            tried = np.linspace(low, high, _PLACES)
        else:
            tried = _ratios(low, high, min(self.least, 0.1 * (high - low)))
        return replace(
            self, low=low, high=high, tried=tuple(tried.tolist()), least=min(self.least, high - low)
        )

    def respaced(self, low: float, high: float) -> np.ndarray:
        """Values to try between two bounds, ascending."""
        return np.array(
            self.tried if (low, high) == (self.low, self.high) else self.within(low, high).tried
        )

    def united(self, other: Range) -> Range:
        """Of a value that stands in two places."""
        tried = tuple(sorted({*self.tried, *other.tried}))
        return replace(
            self,
            low=min(self.low, other.low),
            high=max(self.high, other.high),
            least=min(self.least, other.least),
            tried=tried,
        )

    @property
    def typical(self) -> float:
        """The value in the middle of those tried, of the greater sign where both are."""
        own = [at for at in self.tried if at > 0] if self.spacing != "even" else list(self.tried)
        own = own or list(self.tried)
        return float(own[len(own) // 2])


def _ratios(low: float, high: float, least: float) -> np.ndarray:
    sides = []
    for sign, near, far in ((-1.0, -high, -low), (1.0, low, high)):
        near = max(near, least)
        if far > near:
            sides.append(sign * np.geomspace(near, far, 2 + int(_DECADE * np.log10(far / near))))
    return np.unique(np.concatenate(sides)) if sides else np.linspace(low, high, 2)


def _scale(least: float, most: float) -> Range:
    """A size of either sign."""
    return Range(-most, most, "ratio", least).within(-most, most)


@dataclass(frozen=True)
class Wanted:
    """What a function wants of its argument: its greatest size from `least` to `most` (None: as fine as the log tells), with
    cycles over it, or that it does not vanish. Nothing where a coefficient in front takes any size."""

    least: float | None = None
    most: float | None = None
    cycles: bool = False
    apart: bool = False


ANY, APART, PLAIN, CYCLES = (
    Wanted(),
    Wanted(apart=True),
    Wanted(_LEAST),
    Wanted(_LEAST, cycles=True),
)
_WANTED = {
    "sin": CYCLES,
    "cos": CYCLES,
    "tan": replace(CYCLES, most=1.4),
    "log": APART,
    "sqrt": APART,
    "sign": ANY,
}


@dataclass(frozen=True)
class Search:
    """What a tree is looked at with. known: {name: (2, n)} values of the variables on rows of the log and on the rows after
    them; rows: how many the log has; inner: the names to place; linear: the coefficients;
    `found` so far."""

    known: dict
    rows: int
    inner: frozenset[str]
    linear: frozenset[str]
    found: dict = field(default_factory=dict)

    def put(self, name: str, range_: Range) -> None:
        """Keep where a name may be."""
        self.found[name] = self.found[name].united(range_) if name in self.found else range_

    def worth(self, node: ast.expr) -> np.ndarray:
        """A tree's values (2, n), those that are to be found as they were placed, coefficients 1."""
        middle = {name: r.typical for name, r in self.found.items()}
        with np.errstate(all="ignore"):
            got = value(node, {**{n: 1.0 for n in names_of(node)}, **middle, **self.known})
        got = np.broadcast_to(np.asarray(got, dtype=float), np.shape(self.known["t"]))
        return np.where(np.isfinite(got), got, 0.0)

    def open(self, node: ast.expr) -> bool:
        """Whether something in a tree is to be found."""
        return bool(names_of(node) & self.inner)


def ranges(tree: ast.expr, inner, linear, known: dict, rows: int, columns) -> dict[str, Range]:
    """Where each value inside a formula can be found.

    Args:
        known, rows, inner, linear: as in `Search`.
        columns: called with values by name, gives the formula's columns (k, n), not finite where it cannot.
    """
    search = Search(known, rows, frozenset(inner), frozenset(linear))
    _visit(tree, ANY, search)
    for name in inner:
        search.found.setdefault(name, _scale(1e-3, 1e3))
    return one_sided(search.found, columns)


def _visit(node: ast.expr, wanted: Wanted, search: Search) -> None:
    if not search.open(node):
        return
    if isinstance(node, ast.Name):
        search.put(node.id, _scale(wanted.least or 1e-3, wanted.most or 1e3))
    elif isinstance(node, ast.UnaryOp):
        _visit(node.operand, wanted, search)
    elif isinstance(node, ast.Call):
        if len(node.args) == 2:  # min and max hold one against the other
            _sum([(1.0, node.args[0]), (-1.0, node.args[1])], replace(wanted, apart=False), search)
        else:
            _visit(
                node.args[0],
                wanted if node.func.id == "abs" else _WANTED.get(node.func.id, PLAIN),
                search,
            )
    elif isinstance(node.op, (ast.Add, ast.Sub)):
        _sum(_terms(node), wanted, search)
    elif isinstance(node.op, ast.Pow):
        _power(node, wanted, search)
    else:
        _product(_factors(node), wanted, search)


def _power(node: ast.BinOp, wanted: Wanted, search: Search) -> None:
    base, exponent = node.left, node.right
    if not search.open(exponent):
        number = float(np.median(search.worth(exponent)))
        root = replace(
            wanted,
            **{
                k: v ** (1.0 / number)
                for k in ("least", "most")
                if (v := getattr(wanted, k)) and number > 0
            },
        )
        whole = number == round(number)
        _visit(
            base,
            root
            if number > 0 and whole and not wanted.apart
            else replace(root, least=root.least or None, apart=True),
            search,
        )
        return
    _visit(base, PLAIN if wanted.least else replace(PLAIN, apart=True), search)
    if not search.open(base) and np.ptp(search.worth(base)) == 0.0:
        return _visit(exponent, PLAIN, search)  # 2**(k*q) is exp
    size = np.abs(search.worth(base))
    least = 0.05 if size.min() < 1e-2 * size.max() else -_STEEP
    if isinstance(exponent, ast.Name):
        search.put(exponent.id, Range(least, _STEEP, "even", 0.05).within(least, _STEEP))
    else:
        _visit(exponent, Wanted(0.05, _STEEP), search)


def _sum(terms: list, wanted: Wanted, search: Search) -> None:
    if any(
        names_of(term) & search.linear for _, term in terms
    ):  # each has a coefficient of its own
        for _, term in terms:
            _visit(term, ANY, search)
        return
    closed = [(s, t) for s, t in terms if not search.open(t)]
    names = [(s, t) for s, t in terms if isinstance(t, ast.Name) and search.open(t)]
    rest = [(s, t) for s, t in terms if search.open(t) and not isinstance(t, ast.Name)]
    beside = sum((s * search.worth(t) for s, t in closed), np.zeros(1))
    size, span = float(np.max(np.abs(beside))), float(np.ptp(beside))
    for _, term in rest:
        if size == 0.0:
            _visit(term, wanted if wanted.least else replace(PLAIN, most=_WIDE), search)
        else:
            # a constant is passed by what grows past it; a signal is matched by what is as large
            _visit(
                term, Wanted(_SMALL * size, _WIDE * size) if span else Wanted(_LEAST * size), search
            )
    moving = beside if span else sum((s * search.worth(t) for s, t in rest), beside)
    for sign, name in names:
        if wanted.cycles:
            search.put(name.id, _phase())
        elif wanted.apart:
            search.put(name.id, _apart(sign * moving))
        elif np.ptp(moving) > 0.0 and (span or not wanted.least):
            search.put(name.id, _place(-sign * moving))
        elif rest:
            most = wanted.most or _WIDE
            search.put(name.id, Range(-most, most, "even", _LEAST).within(-most, most))
        else:
            _visit(name, Wanted(_LEAST * (size or 1.0), _WIDE * (size or 1.0)), search)


def _place(signal: np.ndarray) -> Range:
    low, high = float(signal.min()), float(signal.max())
    span = high - low
    return Range(low, high, "even", 0.01 * span).within(low - 0.5 * span, high + 0.5 * span)


def _phase() -> Range:
    tried = tuple((-np.pi + 2.0 * np.pi * np.arange(_PHASES) / _PHASES).tolist())
    return Range(-2.0 * np.pi, 2.0 * np.pi, "even", 0.1, tried=tried)


def _apart(signal: np.ndarray) -> Range:
    """Added to a signal without the sum's vanishing."""
    low, high = float(signal.min()), float(signal.max())
    size = max(-low, high) or 1.0
    if low >= 0.0:
        return Range(0.0, 0.0, "ratio", _SMALL * size).within(_SMALL * size, 10.0 * size)
    if high <= 0.0:
        return Range(0.0, 0.0, "ratio", _SMALL * size).within(-10.0 * size, -_SMALL * size)
    span = high - low
    above, below = (
        -low + span * np.geomspace(1e-2, 10.0, 13),
        -high - span * np.geomspace(1e-2, 10.0, 13),
    )
    return Range(
        float(below.min()),
        float(above.max()),
        "even",
        0.01 * span,
        tried=tuple(sorted([*below.tolist(), *above.tolist()])),
    )


def _product(factors: list, wanted: Wanted, search: Search) -> None:
    names = [(e, f) for e, f in factors if isinstance(f, ast.Name) and search.open(f)]
    rest = [(e, f) for e, f in factors if search.open(f) and not isinstance(f, ast.Name)]
    closed = [(e, f) for e, f in factors if not search.open(f)]

    def worth(parts) -> np.ndarray:
        with np.errstate(all="ignore"):
            out = np.prod([search.worth(f) ** e for e, f in parts], axis=0) * np.ones_like(
                search.known["t"]
            )
        return np.where(np.isfinite(out), out, 0.0)

    around = float(np.max(np.abs(worth(closed)))) or 1.0
    for k, (exponent, factor) in enumerate(rest):
        if names or k or not wanted.least or exponent < 0:
            _visit(factor, APART if exponent < 0 else ANY, search)
        else:
            scaled = {
                key: float(v / around) for key in ("least", "most") if (v := getattr(wanted, key))
            }
            _visit(factor, replace(wanted, **scaled), search)
    signal = worth([*closed, *rest])
    for exponent, name in names:
        search.put(name.id, _multiple(signal, exponent, wanted, search.rows))


def _multiple(signal: np.ndarray, exponent: int, wanted: Wanted, rows: int) -> Range:
    """Of a value that multiplies a signal (2, n), or divides it."""
    size, span = float(np.max(np.abs(signal))) or 1.0, float(np.ptp(signal)) or 1.0
    least = wanted.least or _LEAST
    if wanted.cycles:
        travel = float(np.sqrt(np.mean((signal[1] - signal[0]) ** 2))) or span
        most = max(min(0.5 * np.pi / travel, _CYCLES * 0.5 * np.pi / span), 2.0 * least / size)
        step = 0.5 * np.pi / span
        found = Range(least / size, most, "cycles", step, step).within(least / size, most)
        if exponent < 0:
            tried = tuple(1.0 / at for at in reversed(found.tried))
            found = Range(1.0 / most, size / least, "ratio", 1.0 / most, tried=tried)
        tried = tuple(sorted({*found.tried, *(-at for at in found.tried)}))
        return replace(found, low=-found.high, tried=tried)
    most = wanted.most or max(float(np.clip(rows / _SEEN, _WIDE, _FINEST)), 10.0 * least)
    return _scale(least / size, most / size) if exponent > 0 else _scale(size / most, size / least)


def _terms(node: ast.expr, sign: float = 1.0) -> list:
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        return _terms(node.left, sign) + _terms(
            node.right, sign if isinstance(node.op, ast.Add) else -sign
        )
    if isinstance(node, ast.UnaryOp):
        return _terms(node.operand, -sign if isinstance(node.op, ast.USub) else sign)
    return [(sign, node)]


def _factors(node: ast.expr, exponent: int = 1) -> list:
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
        return _factors(node.left, exponent) + _factors(
            node.right, exponent if isinstance(node.op, ast.Mult) else -exponent
        )
    if isinstance(node, ast.UnaryOp):
        return _factors(node.operand, exponent)
    return [(exponent, node)]
