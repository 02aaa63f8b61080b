"""A formula's tree: its parts, its names, and what it is worth over arrays."""

from __future__ import annotations

import ast

import numpy as np

from .words import FUNCTIONS

OPERATIONS = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
}


def names_of(node: ast.expr) -> set[str]:
    """The names in a tree, but not its functions'."""
    if isinstance(node, ast.Name):
        return {node.id}
    return set().union(*(names_of(part) for part in operands(node)))


def terms(node: ast.expr) -> list[ast.expr]:
    """The terms of a sum."""
    return [term for _, term in signed_terms(node)]


def signed_terms(node: ast.expr, sign: float = 1.0) -> list[tuple[float, ast.expr]]:
    """The terms of a sum, each with the sign before it."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        other = sign if isinstance(node.op, ast.Add) else -sign
        return signed_terms(node.left, sign) + signed_terms(node.right, other)
    if isinstance(node, ast.UnaryOp):
        return signed_terms(node.operand, -sign if isinstance(node.op, ast.USub) else sign)
    return [(sign, node)]


def operands(node: ast.expr) -> list[ast.expr]:
    """The parts of a piece of a tree."""
    if isinstance(node, ast.BinOp):
        return [node.left, node.right]
    return (
        [node.operand]
        if isinstance(node, ast.UnaryOp)
        else node.args
        if isinstance(node, ast.Call)
        else []
    )


def value(node: ast.expr, known: dict):
    """What a tree is worth, with the names' values."""
    if isinstance(node, ast.Constant):
        return float(node.value)
    if isinstance(node, ast.Name):
        return known[node.id]
    parts = [value(part, known) for part in operands(node)]
    if isinstance(node, ast.UnaryOp):
        return np.negative(parts[0]) if isinstance(node.op, ast.USub) else parts[0]
    return (FUNCTIONS[node.func.id] if isinstance(node, ast.Call) else OPERATIONS[type(node.op)])(
        *parts
    )


def culprit(node: ast.expr, known: dict) -> ast.expr:
    """The smallest part of a tree that is not finite."""
    for part in operands(node):
        if not np.isfinite(value(part, known)).all():
            return culprit(part, known)
    return node
