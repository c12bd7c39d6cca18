"""The sources behind a module are those that a parser of Python finds, and any change of them shows."""

import ast
import re
import shutil
from pathlib import Path

import pytest

from magsim.storage.sources import ROOT, dependencies, source_digest

CACHING = sorted(
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
    for path in ROOT.rglob("*.py")
    if "storage" not in path.relative_to(ROOT).parts and re.search(r"\bcached\(", path.read_text(encoding="utf-8"))
)
"""Modules whose results are stored."""

FAR = ("units.py", "frames.py", "errors.py", "aircraft/__init__.py", "earth/wgs84.py", "earth/igrf14.txt")
"""Files that all of them depend on, outside their own packages."""

NOT_USED = ("cli/__init__.py", "plots/figures.py", "exchange/mit.py", "generation/recipe.py")


def imports_of(path: Path, known: set[str]) -> set[str]:
    """Modules of the package that a file imports, found by Python's own parser."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports are not followed"
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    parents = {".".join(name.split(".")[:k]) for name in names for k in range(1, name.count(".") + 1)}
    return (names | parents) & known


def file_of(module: str) -> Path:
    path = ROOT.joinpath(*module.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def test_results_are_stored_in_field_and_flight():
    assert {module.split(".")[1] for module in CACHING} == {"field", "flight"}


def test_the_sources_of_a_module_are_those_that_a_parser_finds():
    known = {".".join(path.relative_to(ROOT.parent).with_suffix("").parts) for path in ROOT.rglob("*.py")}
    known = {name.removesuffix(".__init__") for name in known}
    imports: dict[str, set[str]] = {}
    for module in CACHING:
        wanted: set[str] = set()
        waiting = {module, *(".".join(module.split(".")[:k]) for k in range(1, module.count(".") + 1))}
        while waiting:
            name = waiting.pop()
            wanted.add(name)
            if name not in imports:
                imports[name] = imports_of(file_of(name), known)
            waiting |= imports[name] - wanted
        files = {file_of(name).relative_to(ROOT).as_posix() for name in wanted}
        found = {file for file in dependencies(module) if file.endswith(".py")}
        # text in a docstring that reads like an import may add a file, but none may be missing
        assert found >= files, (module, files - found)
        assert len(found - files) <= 3, (module, found - files)


WAYS = {
    "plain": "from magsim import far\n",
    "renamed": "import magsim.far as near\n",
    "second of a list": "import os, magsim.far\n",
    "in a block": "from magsim import (\n    near,  # (the first)\n    far,\n)\n",
    "continued": "from magsim import near, \\\n    far\n",
    "late": "def f():\n    if True:\n        from magsim.far import x\n",
    "for type checkers": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from magsim.far import x\n",
    "of its package": "from magsim.room import other\n",
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_import_counts(tmp_path, way):
    (tmp_path / "room").mkdir()
    (tmp_path / "__init__.py").write_text("")
    (tmp_path / "room" / "__init__.py").write_text("import magsim.far\n" if way == "of its package" else "")
    (tmp_path / "room" / "other.py").write_text("")
    (tmp_path / "near.py").write_text("")
    (tmp_path / "far.py").write_text("from magsim.farther import y\n")
    (tmp_path / "farther.py").write_text("")
    (tmp_path / "own.py").write_text(WAYS[way])
    found = dependencies("magsim.own", tmp_path)
    assert {"__init__.py", "own.py", "far.py", "farther.py"} <= set(found)
    assert ("near.py" in found) == ("near," in WAYS[way])


@pytest.fixture(scope="module")
def tree(tmp_path_factory) -> Path:
    """A copy of the package."""
    copy = tmp_path_factory.mktemp("tree") / "magsim"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns("__pycache__", "_assets"))
    return copy


def fresh_digest(module: str, root: Path) -> str:
    """The digest that another process would find: nothing of an earlier look is kept."""
    from magsim.storage import sources

    for function in (sources.source_digest, sources._tree, sources._scan):
        function.cache_clear()
    return source_digest(module, root)


def digests_after(tree: Path, file: str) -> dict[str, str]:
    """Digests of all modules whose results are stored, with one more comment in a file."""
    path = tree / file
    content = path.read_bytes()
    path.write_bytes(content + b"# one more line\n")
    digests = {module: fresh_digest(module, tree) for module in CACHING}
    path.write_bytes(content)
    return digests


def test_a_change_far_away_changes_the_digest_and_one_of_what_is_not_used_does_not(tree):
    before = {module: fresh_digest(module, tree) for module in CACHING}
    for file in FAR:
        after = digests_after(tree, file)
        assert all(after[module] != before[module] for module in CACHING), file
    for file in NOT_USED:
        assert digests_after(tree, file) == before, file


def test_an_unknown_module_has_no_sources():
    assert dependencies("magsim.no_such_module") == []
