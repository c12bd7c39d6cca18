"""Comparisons of keys that a flight of a sweep must meet: arithmetic of numbers, and nothing else of Python."""

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from magsim.config import keys
from magsim.errors import RequestError

_OPERATORS: Mapping[type, Callable[..., np.ndarray]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.true_divide,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_COMPARISONS: Mapping[type, Callable[..., np.ndarray]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_FUNCTIONS: Mapping[str, Callable[..., np.ndarray]] = {"abs": np.abs}

ALLOWED = "a comparison of key paths and numbers with + - * / abs() and parentheses, such as 'start.alt_m > 300'"


@dataclass(frozen=True)
class Constraint:
    """One comparison.

    Attributes
    ----------
    text : str
        As the file writes it.
    names : frozenset of str
        Key paths in it.
    """

    text: str
    names: frozenset[str]
    _tree: ast.Compare

    def holds(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return whether flights meet it, (n,) or a scalar.

        Parameters
        ----------
        values : mapping of str to (n,) or float
            Of every name; what is NaN meets no comparison but !=.
        """
        with np.errstate(all="ignore"):
            left = _value(self._tree.left, values)
            out: np.ndarray = np.asarray(True)
            for comparison, node in zip(self._tree.ops, self._tree.comparators, strict=True):
                right = _value(node, values)
                out = out & _COMPARISONS[type(comparison)](left, right)
                left = right
        return out


def read_constraint(text: str) -> Constraint:
    """Return the constraint that a text means.

    Raises
    ------
    RequestError
        If it is no such comparison; without file and line.
    """
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        tree = None
    if not isinstance(tree, ast.Compare):
        raise _refused(text)
    names: set[str] = set()
    for node in (tree.left, *tree.comparators):
        _check(node, names, text)
    if not all(type(comparison) in _COMPARISONS for comparison in tree.ops):
        raise _refused(text)
    return Constraint(text, frozenset(names), tree)


def _refused(text: str) -> RequestError:
    return RequestError(f"{text!r:.80} cannot be understood; allowed: {ALLOWED}")


def _check(node: ast.expr, names: set[str], text: str) -> None:
    """Collect the names of an expression, or raise an error for anything but arithmetic."""
    name = _name(node)
    if name is not None:
        names.add(name)
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        _check(node.left, names, text)
        _check(node.right, names, text)
    elif isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        _check(node.operand, names, text)
    elif _is_call(node):
        _check(node.args[0], names, text)  # type: ignore[attr-defined]
    elif not (isinstance(node, ast.Constant) and _is_number(node.value)):
        raise _refused(text)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _is_call(node: ast.expr) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in _FUNCTIONS
        and len(node.args) == 1
        and not node.keywords
    )


def _name(node: ast.expr) -> str | None:
    """Return the key path that names and indices make, or None."""
    parts: list[str | int] = []
    while True:
        if isinstance(node, ast.Attribute):
            parts.append(node.attr)
            node = node.value
        elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant) and type(node.slice.value) is int:
            parts.append(node.slice.value)
            node = node.value
        elif isinstance(node, ast.Name):
            return keys.show((node.id, *reversed(parts)))
        else:
            return None


def _value(node: ast.expr, values: Mapping[str, np.ndarray]) -> np.ndarray:
    name = _name(node)
    if name is not None:
        return values[name]
    if isinstance(node, ast.Constant):
        return np.asarray(float(node.value))  # type: ignore[arg-type]
    if isinstance(node, ast.BinOp):
        return _OPERATORS[type(node.op)](_value(node.left, values), _value(node.right, values))
    if isinstance(node, ast.UnaryOp):
        return _OPERATORS[type(node.op)](_value(node.operand, values))
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    return _FUNCTIONS[node.func.id](_value(node.args[0], values))
