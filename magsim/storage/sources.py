"""What a module of magsim depends on: the source files that it imports, directly or indirectly, and a digest of them.

Files are read and searched for import statements; nothing is imported. Every statement counts, also those inside
functions, where heavy libraries and optional parts are imported late, and those for type checkers alone: a file too
many costs a result that is computed again, a file too few would return an old result.
"""

import hashlib
import os
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""Folder of the package ``magsim``."""

_FROM = re.compile(r"from[ \t]+([\w.]+)[ \t]+import[ \t]*(?:\(((?:[^)#]|#[^\n]*)*)\)|([^\n#;]+))")
_IMPORT = re.compile(r"import[ \t]+([^\n#;]+)")
_COMMENT = re.compile(r"#[^\n]*")


@lru_cache(maxsize=64)
def source_digest(module: str, root: Path = ROOT) -> str:
    """Return a digest of everything of the package that a module depends on.

    Parameters
    ----------
    module : str
        Full name, such as ``magsim.field.response``.
    root : Path
        Folder of the package that the name begins with.

    Returns
    -------
    str
        SHA-256 of the names and contents of ``dependencies``; of nothing where there is no such module.
    """
    digest = hashlib.sha256()
    for file in dependencies(module, root):
        digest.update(f"{file}\0".encode() + _scan(root, file).digest)
    return digest.hexdigest()


def dependencies(module: str, root: Path = ROOT) -> list[str]:
    """Return the files that a module depends on.

    Parameters
    ----------
    module : str
        Full name, such as ``magsim.field.response``.
    root : Path
        Folder of the package that the name begins with.

    Returns
    -------
    list of str
        Paths below ``root``, sorted: the module's own file, those of every module of the package that it imports
        directly or indirectly, of the packages that these are in, and the data files beside them.
    """
    package = module.partition(".")[0]
    modules, data = _tree(root, package)
    found: list[str] = []
    waiting = [module]
    seen = set(waiting)
    while waiting:
        name = waiting.pop()
        if name not in modules:  # a function or a class
            continue
        found += [modules[name], *data.get(name, ())]
        imported = {other for other in _scan(root, modules[name]).imported if _is_of(other, package)}
        needed = {*imported, name.rpartition(".")[0]} - seen
        seen |= needed
        waiting.extend(needed)
    return sorted(found)


@lru_cache(maxsize=4)
def _tree(root: Path, package: str) -> tuple[dict[str, str], dict[str, list[str]]]:
    """Return the files of all modules by name, and the data files of all packages; paths below the root."""
    modules: dict[str, str] = {}
    data: dict[str, list[str]] = {}
    for folder, below, files in os.walk(root):
        if "__init__.py" not in files:
            below.clear()
            continue
        parts = Path(folder).relative_to(root).parts
        name = ".".join((package, *parts))
        for file in files:
            path = "/".join((*parts, file))
            if not file.endswith(".py"):
                data.setdefault(name, []).append(path)
            elif file == "__init__.py":
                modules[name] = path
            else:
                modules[f"{name}.{file[:-3]}"] = path
    return modules, data


@dataclass(frozen=True)
class _Scan:
    """SHA-256 of a file, and every name that its import statements mention, modules or not."""

    digest: bytes
    imported: frozenset[str]


@lru_cache(maxsize=2048)
def _scan(root: Path, file: str) -> _Scan:
    with open(f"{root}/{file}", "rb") as opened:  # noqa: PTH123 - a tenth of the time is spent in Path
        content = opened.read()
    digest = hashlib.sha256(content).digest()
    return _Scan(digest, _imported(content.decode("utf-8")) if file.endswith(".py") else frozenset())


def _imported(text: str) -> frozenset[str]:
    text = text.replace("\\\n", " ")
    names: set[str] = set()
    for statement in _FROM.finditer(text):
        if _begins_line(text, statement.start()):
            origin, block, listed = statement.groups()
            names.add(origin)
            names.update(f"{origin}.{name}" for name in _first_words(listed if block is None else block))
    for statement in _IMPORT.finditer(text):
        if _begins_line(text, statement.start()):
            names.update(_first_words(statement[1]))
    return frozenset(names)


def _is_of(name: str, package: str) -> bool:
    return name == package or name.startswith(f"{package}.")


def _begins_line(text: str, start: int) -> bool:
    """Return whether only blanks stand before a place in its line."""
    return not text[text.rfind("\n", 0, start) + 1 : start].strip()


def _first_words(listed: str) -> list[str]:
    """Return the names of a list such as ``a, b as c,  # why``, each without what it is bound to."""
    return [words[0] for words in (part.split() for part in _COMMENT.sub("", listed).split(",")) if words]
