"""Compiled functions depend on their own file alone.

Numba keeps what it compiled beside the source and compiles again when that file changes, but not when a function or a
constant that it took from another file changes.
"""

import ast
from pathlib import Path

import pytest

from tests.support.paths import ROOT

FILES = [path for path in sorted((ROOT / "magsim").rglob("*.py")) if "njit" in path.read_text(encoding="utf-8")]


def foreign_names(path: Path) -> set[str]:
    """Names from other files of magsim that compiled functions of a file use, annotations aside."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imported = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("magsim")
        for alias in node.names
    }
    decorators = {
        target.id
        for node in tree.body
        if isinstance(node, ast.Assign) and "njit" in ast.unparse(node.value)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    used = set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef):
            continue
        texts = [ast.unparse(decorator) for decorator in node.decorator_list]
        if any("njit" in text or text in decorators for text in texts):
            used |= {part.id for line in node.body for part in ast.walk(line) if isinstance(part, ast.Name)}
    return used & imported


def test_there_are_compiled_functions():
    assert FILES


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_compiled_function_uses_nothing_of_another_file(path):
    assert foreign_names(path) == set()
