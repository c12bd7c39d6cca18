"""Where the shipped aircraft, scenarios and data sets lie. Nothing is ever written there."""

from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path

from magsim.errors import RequestError

_PACKAGE = Path(__file__).parent

ROOT = _PACKAGE / "_assets" if (_PACKAGE / "_assets").is_dir() else _PACKAGE.parent
"""Folder that holds ``aircraft``, ``scenarios`` and ``datasets``: inside the installed package, else the checkout."""

AIRCRAFT_FILES = ("facts.toml", "magnetics.toml")
"""Files that make a folder of ``aircraft`` an aircraft."""


def list_aircraft() -> tuple[str, ...]:
    """Names of the shipped aircraft, sorted."""
    return tuple(
        sorted(
            folder.name
            for folder in (ROOT / "aircraft").glob("*")
            if all((folder / file).is_file() for file in AIRCRAFT_FILES)
        )
    )


def aircraft_dir(name: str) -> Path:
    """Folder of a shipped aircraft.

    Raises
    ------
    RequestError
        If there is no aircraft with that name; the message lists those that there are.
    """
    known = list_aircraft()
    if name in known:
        return ROOT / "aircraft" / name
    msg = f"there is no aircraft '{name[:60]}'; allowed: {', '.join(known)}{_hint(name, known)}"
    raise RequestError(msg)


def list_scenarios() -> tuple[str, ...]:
    """Names of the shipped scenarios, sorted: ``calibration_c208b``, ``papers/000_simulated``."""
    folder = ROOT / "scenarios"
    return tuple(sorted(path.relative_to(folder).with_suffix("").as_posix() for path in folder.rglob("*.toml")))


def scenario_path(name_or_path: str | Path) -> Path:
    """File of a scenario: a path, or the name of a shipped scenario with or without ``.toml``.

    A file that is there wins over a shipped scenario of the same name.

    Raises
    ------
    RequestError
        If it is neither; the message lists the shipped scenarios.
    """
    path = Path(name_or_path)
    folder = False
    # a name that is too long or holds a zero byte is no path, and no shipped scenario either
    with suppress(OSError, ValueError):
        folder = path.is_dir()
        if path.exists() and not folder:
            return path
    name = path.as_posix().removeprefix("scenarios/").removesuffix(".toml")
    known = list_scenarios()
    if name in known:
        return ROOT / "scenarios" / f"{name}.toml"
    what = "it is a folder" if folder else "there is no such file"
    shown = str(name_or_path)[:200]
    shown = shown if shown and shown.isprintable() else ascii(shown)
    shipped = f"no shipped scenario has that name{_hint(name, known)}; shipped: {', '.join(known)}"
    msg = f"{shown}: {what}, and {shipped}"
    raise RequestError(msg)


def _hint(name: str, known: tuple[str, ...]) -> str:
    close = get_close_matches(name[:100], known, n=1, cutoff=0.5)
    return f" (did you mean '{close[0]}'?)" if close else ""
