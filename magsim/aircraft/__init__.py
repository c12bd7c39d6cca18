"""An aircraft or a towed bird as its folder describes it: facts of flight, magnetic parts, mounts, limits.

The folder is shipped, ``aircraft/<name>``, or a user's own. The ``facts.toml`` of an aircraft holds geometry, mass,
aerodynamics, engine, controls and limits (``Facts``), or describes a carrier without a flight model
(``KinematicFacts``); the ``body.toml`` of a bird describes the towed body (``BirdFacts``). ``magnetics.toml`` holds
everything magnetic and the mounts (``Magnetics``). Each number has a unit and a source, or is marked an estimate.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import BaseModel

from magsim import assets, config
from magsim.aircraft.bird import BirdFacts
from magsim.aircraft.facts import Facts, Limits
from magsim.aircraft.hull import beyond_hull, reach_m
from magsim.aircraft.kinematic import KinematicFacts, KinematicLimits
from magsim.aircraft.magnetics import Magnetics, MeshPart
from magsim.config.document import read_text
from magsim.errors import RequestError

__all__ = [
    "Aircraft",
    "Bird",
    "BirdFacts",
    "Facts",
    "KinematicFacts",
    "Limits",
    "Magnetics",
    "Vehicle",
    "load_aircraft",
    "load_bird",
    "reach_m",
]

F = TypeVar("F", bound=BaseModel)

MESH_FILE_BYTES = 20_000_000
"""Largest file of triangles."""


@dataclass(frozen=True)
class Vehicle:
    """A body that carries magnetometers, validated.

    Attributes
    ----------
    name : str
        Name of its folder.
    facts : BaseModel
        Facts of flight.
    magnetics : Magnetics
        Everything magnetic, and the mounts of sensors.
    files : mapping of str to bytes
        Content of the files of triangles that ``magnetics.toml`` names.
    nominal : Vehicle, optional
        The type of which it is an individual (``magsim.population``); None for what its folder describes.
    """

    name: str
    facts: BaseModel
    magnetics: Magnetics
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    nominal: "Vehicle | None" = field(default=None, repr=False)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over its facts, its magnetics and its files of triangles, in hexadecimal.

        It is computed from what the vehicle holds, so that a changed copy has another one. Name, comments, order of
        keys and values that equal the default do not count.
        """
        tables = {"facts": self.facts.model_dump(mode="json"), "magnetics": self.magnetics.model_dump(mode="json")}
        digest = hashlib.sha256(json.dumps(tables, sort_keys=True).encode())
        for name in sorted(self.files):
            digest.update(f"\0{name}\0".encode() + hashlib.sha256(self.files[name]).digest())
        if self.nominal is not None:  # which gives it its mesh
            digest.update(f"\0{self.nominal.digest}".encode())
        return digest.hexdigest()

    @cached_property
    def mounts(self) -> dict[str, tuple[float, float, float]]:
        """Places for sensors by name, (3,) [m] in body axes from the datum."""
        return {name: mount.position_m for name, mount in self.magnetics.mounts.items()}


@dataclass(frozen=True)
class Aircraft(Vehicle):
    """An aircraft, or another carrier."""

    facts: Facts | KinematicFacts

    @property
    def limits(self) -> Limits | KinematicLimits:
        """Limits of what the aircraft can fly."""
        return self.facts.limits


@dataclass(frozen=True)
class Bird(Vehicle):
    """A body that is towed on a rope."""

    facts: BirdFacts


def load_aircraft(name_or_path: str | Path, base: Path | None = None) -> Aircraft:
    """Read and check an aircraft: a shipped one, or a folder of one's own.

    Parameters
    ----------
    name_or_path : str or Path
        Name of a shipped aircraft, or the path of a folder, with a slash in it (``./mine``).
    base : Path, optional
        Where a relative path begins; the working folder if left out.

    Returns
    -------
    Aircraft

    Raises
    ------
    RequestError
        If there is no such aircraft, or its files are wrong: one line for each problem of both files.
    """
    folder = assets.aircraft_dir(name_or_path, base)
    read = _read(folder, assets.AIRCRAFT_FILES, _facts_model(folder / assets.AIRCRAFT_FILES[0]))
    return Aircraft(read.name, read.facts, read.magnetics, read.files)


def load_bird(name_or_path: str | Path, base: Path | None = None) -> Bird:
    """Read and check a towed bird: a shipped one, or a folder of one's own; see ``load_aircraft``.

    Raises
    ------
    RequestError
        If there is no such bird, or its files are wrong: one line for each problem of both files.
    """
    read = _read(assets.bird_dir(name_or_path, base), assets.BIRD_FILES, BirdFacts)
    return Bird(read.name, read.facts, read.magnetics, read.files)


def _facts_model(path: Path) -> type[Facts | KinematicFacts]:
    """Return the model of a ``facts.toml``: that of a kinematic carrier where its ``kind`` names one."""
    try:
        kinematic = _is_kinematic(read_text(path, str(path)), str(path))
    except RequestError:
        return Facts  # reported when the whole file is read
    return KinematicFacts if kinematic else Facts


@dataclass(frozen=True)
class _FolderRead(Generic[F]):
    """Contents of the folder of a vehicle."""

    name: str
    facts: F
    magnetics: Magnetics
    files: Mapping[str, bytes]


def _read(folder: Path, names: tuple[str, str], model: type[F]) -> _FolderRead[F]:
    """Return the contents of the two files of a folder, and of those that they name."""
    facts, facts_problems = _file(folder / names[0], model)
    magnetics, problems = _file(folder / names[1], Magnetics)
    if facts is None or magnetics is None:
        raise RequestError("\n".join(filter(None, (facts_problems, problems))))
    assert isinstance(facts, Facts | KinematicFacts | BirdFacts)
    off_hull = [f"{folder / names[1]}: {key}: {text}" for key, text in beyond_hull(magnetics, facts)]
    if off_hull:
        raise RequestError("\n".join(off_hull))
    return _FolderRead(folder.resolve().name, facts, magnetics, mesh_files(folder, magnetics))


def _file(path: Path, model: type[F]) -> tuple[F | None, str]:
    """Return the settings of a file, or its problems."""
    try:
        settings = _settings(read_text(path, str(path)), str(path), model)
    except RequestError as error:
        return None, str(error)
    assert isinstance(settings, model)
    return settings, ""


@lru_cache(maxsize=32)
def _settings(text: str, source: str, model: type[BaseModel]) -> BaseModel:
    """Return the settings of a text; the text of a file that has not changed is read and checked once."""
    return config.load(text, model, source=source)


@lru_cache(maxsize=16)
def _is_kinematic(text: str, source: str) -> bool:
    """Return whether the text of a ``facts.toml`` names a kind of carrier."""
    return config.parse(text, source=source).table.get("kind") is not None


def mesh_files(folder: Path, magnetics: Magnetics) -> dict[str, bytes]:
    """Return the content of the files of triangles that steel parts name, by name.

    Raises
    ------
    RequestError
        If a file is not there, lies elsewhere, or is too large.
    """
    out: dict[str, bytes] = {}
    for part in magnetics.steel:
        if not isinstance(part, MeshPart) or part.file in out:
            continue
        path, what = folder / part.file, f"{folder / assets.AIRCRAFT_FILES[1]}: steel part {part.name!r}: {part.file}"
        try:
            if not path.is_file():
                msg = f"{what}: there is no such file beside it"
                raise RequestError(msg)
            if path.resolve().parent != folder.resolve():
                msg = f"{what}: lies elsewhere; allowed: a file in the folder of the aircraft"
                raise RequestError(msg)
            if path.stat().st_size > MESH_FILE_BYTES:
                msg = f"{what}: has {path.stat().st_size} bytes; allowed: up to {MESH_FILE_BYTES}"
                raise RequestError(msg)
            out[part.file] = path.read_bytes()
        except OSError as error:
            msg = f"{what}: cannot be read ({error.strerror})"
            raise RequestError(msg) from None
    return out
