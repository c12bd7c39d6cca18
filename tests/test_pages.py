"""What pages and scenarios tell a reader to run or open is there: commands, options, settings, files, benchmarks."""

import ast
import importlib
import importlib.util
import itertools
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import click
import pytest

from magsim import cli
from tests.support.paths import ROOT

PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("README.md", "CONTRIBUTING.md", "docs/*.md", "aircraft/*/README.md", "datasets/**/*.md")
    for path in ROOT.glob(pattern)
)
SCENARIOS = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "scenarios").rglob("*.toml"))


def text_of(name: str) -> str:
    """A page with continued lines joined; of a scenario, the lines that are comments as a whole."""
    text = (ROOT / name).read_text(encoding="utf-8")
    if name.endswith(".toml"):
        text = "\n".join(re.findall(r"^# ?(.*)$", text, flags=re.MULTILINE))
    return re.sub(r"\\\n\s*", "", text)


def commands(text: str, program: str) -> Iterator[list[str]]:
    """Words of each command line of a program: in blocks of code, indented, and between backticks."""
    name = rf"(?:\.venv/bin/)?{program} "
    fenced = "\n".join(re.findall(r"```\n(.*?)```", text, flags=re.DOTALL))
    lines = re.findall(rf"^{name}(.+)$", fenced, flags=re.MULTILINE)
    lines += re.findall(rf"^\s{{2,}}{name}(.+)$", text, flags=re.MULTILINE)
    for line in [*lines, *re.findall(rf"`{name}([^`]+)`", text)]:
        # a remark follows behind a mark or behind spaces
        yield shlex.split(re.split(r"\s+#|\s{3,}|\s\|\s", line)[0])


def check(words: list[str]) -> None:
    """Parse the words of a ``magsim`` command line without running it."""
    command: click.Command = cli.cli
    context = click.Context(command)
    while isinstance(command, click.Group) and words and not words[0].startswith("-"):
        found = command.get_command(context, words[0])
        assert found is not None, f"there is no command {words[0]}"
        command, words = found, words[1:]
        context = click.Context(command)
    command.make_parser(context).parse_args(list(words))


@pytest.mark.parametrize("page", [*PAGES, *SCENARIOS])
def test_commands_of_a_page_are_those_of_the_program(page: str) -> None:
    for words in commands(text_of(page), "magsim"):
        try:
            check(words)
        except click.UsageError as error:
            pytest.fail(f"{page}: magsim {' '.join(words)}: {error.format_message()}")


@pytest.mark.parametrize("page", [*PAGES, *SCENARIOS])
def test_files_that_a_page_names_exist(page: str) -> None:
    """Paths from the root of the repository, whole or of a scenario without its ending."""
    for path in re.findall(
        r"(?<![\w/.])(?:tests|magsim|scenarios|aircraft|docs|datasets|findings)/[\w/.-]+", text_of(page)
    ):
        stem = path.rstrip(".")
        assert (ROOT / stem).exists() or (ROOT / f"{stem}.toml").exists(), f"{page}: {path}"


@pytest.mark.parametrize("page", PAGES)
def test_benchmarks_of_a_page_have_the_options_and_subjects_that_it_names(page: str) -> None:
    for words in commands(text_of(page), "python"):
        if not words[0].startswith("tests/benchmarks/"):
            continue
        source = Path(ROOT / words[0]).read_text(encoding="utf-8")
        common = {"collect(": "rows.py", "add_options(": "network_rows/command.py"}
        files = [ROOT / "tests" / "benchmarks" / name for call, name in common.items() if call in source]
        shared = "".join(file.read_text(encoding="utf-8") for file in files)
        for word, value in itertools.pairwise([*words[1:], ""]):
            if word.startswith("--"):
                assert f'"{word}"' in source + shared, f"{page}: {words[0]} has no option {word}"
            if word == "--only":
                rows = re.search(r"import (\w+_rows)", source)
                assert rows, f"{page}: {words[0]} has no subjects"
                for subject in value.split(","):
                    assert (ROOT / "tests" / "benchmarks" / rows[1] / f"{subject}.py").exists(), f"{page}: {subject}"


@pytest.mark.parametrize("page", PAGES)
def test_names_that_a_page_imports_are_there(page: str) -> None:
    for code in re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), flags=re.DOTALL):
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("magsim"):
                module = importlib.import_module(node.module)
                missing = [name.name for name in node.names if not _is_in(module, name.name)]
                assert not missing, f"{page}: {node.module} has no {', '.join(missing)}"


def _is_in(module: ModuleType, name: str) -> bool:
    """Whether ``from module import name`` works: a module in a package need not have been imported before."""
    return hasattr(module, name) or importlib.util.find_spec(f"{module.__name__}.{name}") is not None
