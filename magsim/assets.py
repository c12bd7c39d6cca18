"""Locations of the shipped aircraft, scenarios and data sets. Nothing is ever written there."""

import os
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path

from magsim.errors import RequestError

_PACKAGE = Path(__file__).parent

ROOT = _PACKAGE / "_assets" if (_PACKAGE / "_assets").is_dir() else _PACKAGE.parent
"""Folder that holds ``aircraft``, ``scenarios`` and ``datasets``: inside the installed package, else the checkout."""

AIRCRAFT_FILES = ("facts.toml", "magnetics.toml")
"""Files that make a folder of ``aircraft`` an aircraft."""

BIRD_FILES = ("body.toml", "magnetics.toml")
"""Files that make a folder of ``aircraft`` a towed bird."""


def list_aircraft() -> tuple[str, ...]:
    """Return the names of the shipped aircraft, sorted."""
    return _list(AIRCRAFT_FILES)


def list_birds() -> tuple[str, ...]:
    """Return the names of the shipped birds, sorted."""
    return _list(BIRD_FILES)


def _list(files: tuple[str, ...]) -> tuple[str, ...]:
    folders = (ROOT / "aircraft").glob("*")
    return tuple(sorted(folder.name for folder in folders if all((folder / file).is_file() for file in files)))


def aircraft_dir(name_or_path: str | Path, base: Path | None = None) -> Path:
    """Return the folder of an aircraft: the name of a shipped one, or a path.

    Parameters
    ----------
    name_or_path : str or Path
        Text with a slash in it is a path, such as ``./mine``; without one it is a name. A ``Path`` is a path.
    base : Path, optional
        Folder that a relative path is relative to; by default the working folder.

    Raises
    ------
    RequestError
        If there is no such aircraft: the message lists the names, or the files that the folder lacks.
    """
    return _vehicle_dir("aircraft", name_or_path, base, list_aircraft(), AIRCRAFT_FILES)


def bird_dir(name_or_path: str | Path, base: Path | None = None) -> Path:
    """Return the folder of a towed bird; see ``aircraft_dir``.

    Raises
    ------
    RequestError
        If there is no such bird: the message lists the names, or the files that the folder lacks.
    """
    return _vehicle_dir("bird", name_or_path, base, list_birds(), BIRD_FILES)


def _vehicle_dir(
    what: str, name_or_path: str | Path, base: Path | None, known: tuple[str, ...], files: tuple[str, ...]
) -> Path:
    check_path(what, name_or_path)
    if isinstance(name_or_path, Path) or any(slash in name_or_path for slash in {"/", os.sep}):
        return _own_vehicle((base or Path()) / name_or_path, known, files)
    if name_or_path in known:
        return ROOT / "aircraft" / name_or_path
    msg = (
        f"there is no {what} '{name_or_path[:60]}'; allowed: {', '.join(known)}, or a folder of your own by its path "
        f"with a slash, such as ./mine{_hint(name_or_path, known)}"
    )
    raise RequestError(msg)


def _own_vehicle(folder: Path, known: tuple[str, ...], files: tuple[str, ...]) -> Path:
    why = "there is no such folder"
    # a path that is too long or holds a zero byte does not exist
    with suppress(OSError, ValueError):
        if folder.is_dir():
            lacking = [file for file in files if not (folder / file).is_file()]
            if not lacking:
                return folder
            why = f"has no {' and no '.join(lacking)}"
    shown = str(folder)[:200]
    shown = shown if shown.isprintable() else ascii(shown)
    msg = f"{shown}: {why}; allowed: a folder with {' and '.join(files)}, or the name of {' or '.join(known)}"
    raise RequestError(msg)


def check_path(what: str, value: object) -> None:
    """Refuse what is neither text nor a path.

    Raises
    ------
    RequestError
    """
    if not isinstance(value, str | Path):
        msg = f"{what}: is of type {type(value).__name__}; allowed: a name or a path, as text or as pathlib.Path"
        raise RequestError(msg)


SWEEPS = ("sweeps/", "tuning/")
"""Beginnings of the names of shipped sweeps; those for tuning are what the settings of networks are chosen on."""


def list_scenarios() -> tuple[str, ...]:
    """Return the names of the shipped scenarios, sorted: ``calibration_c208b``, ``papers/000_simulated``."""
    return tuple(name for name in _list_files() if not name.startswith(SWEEPS))


def list_sweeps() -> tuple[str, ...]:
    """Return the names of the shipped sweeps, sorted: ``sweeps/air``, ``tuning/levels``."""
    return tuple(name for name in _list_files() if name.startswith(SWEEPS))


def _list_files() -> tuple[str, ...]:
    folder = ROOT / "scenarios"
    return tuple(sorted(path.relative_to(folder).with_suffix("").as_posix() for path in folder.rglob("*.toml")))


def scenario_path(name_or_path: str | Path) -> Path:
    """Return the file of a scenario or a sweep: a path, or the name of a shipped one with or without ``.toml``.

    An existing file takes precedence over a shipped one of the same name.

    Raises
    ------
    RequestError
        If it is neither; the message lists the shipped scenarios.
    """
    check_path("scenario", name_or_path)
    path = Path(name_or_path)
    folder = False
    # a name that is too long or holds a zero byte is no path, and no shipped scenario either
    with suppress(OSError, ValueError):
        folder = path.is_dir()
        if path.exists() and not folder:
            return path
    name = path.as_posix().removeprefix("scenarios/").removesuffix(".toml")
    known = _list_files()
    if name in known:
        return ROOT / "scenarios" / f"{name}.toml"
    what = "it is a folder" if folder else "there is no such file"
    shown = str(name_or_path)[:200]
    shown = shown if shown and shown.isprintable() else ascii(shown)
    shipped = f"no shipped scenario has that name{_hint(name, known)}; shipped: {_by_folder(known)}"
    msg = f"{shown}: {what}, and {shipped}"
    raise RequestError(msg)


def _by_folder(names: tuple[str, ...]) -> str:
    """Return names as text, those in a folder behind its name: ``air, papers/(000_lines, 001_fom)``."""
    folders: dict[str, list[str]] = {}
    for name in names:
        folder, slash, own = name.rpartition("/")
        folders.setdefault(folder + slash, []).append(own)
    inside = [f"{folder}({', '.join(own)})" for folder, own in folders.items() if folder]
    return ", ".join([*folders.get("", []), *inside])


def list_datasets() -> tuple[str, ...]:
    """Return the names of the shipped data sets, sorted: folders of ``datasets`` with a recipe."""
    return tuple(sorted(path.parent.name for path in (ROOT / "datasets").glob("*/recipe.toml")))


def dataset_dir(name_or_path: str | Path) -> Path:
    """Return the folder of a data set's recipe: the name of a shipped one, or a path.

    Text with a slash in it is a path, such as ``./mine``; without one it is a name. A ``Path`` is a path.

    Raises
    ------
    RequestError
        If there is none; the message lists the names.
    """
    check_path("data set", name_or_path)
    known = list_datasets()
    own = isinstance(name_or_path, Path) or any(slash in name_or_path for slash in {"/", os.sep})
    if not own and name_or_path in known:
        return ROOT / "datasets" / name_or_path
    if own:
        # a path that is too long or holds a zero byte does not exist
        with suppress(OSError, ValueError):
            if (Path(name_or_path) / "recipe.toml").is_file():
                return Path(name_or_path)
    shown = str(name_or_path)[:200]
    shown = shown if shown and shown.isprintable() else ascii(shown)
    what = f"{shown}: there is no such folder with a recipe.toml" if own else f"there is no data set {shown!r}"
    msg = (
        f"{what}; allowed: {', '.join(known)}, or a folder of your own by its path with a slash, such as ./mine"
        f"{_hint(shown, known)}"
    )
    raise RequestError(msg)


def _hint(name: str, known: tuple[str, ...]) -> str:
    close = get_close_matches(name[:100], known, n=1, cutoff=0.5)
    return f" (did you mean '{close[0]}'?)" if close else ""
