"""An aircraft as its folder describes it: facts of flight, magnetic parts, mounts, limits.

``aircraft/<name>/facts.toml`` holds geometry, mass, aerodynamics, engine, controls and limits (``Facts``);
``aircraft/<name>/magnetics.toml`` holds everything magnetic and the mounts (``Magnetics``). Each number has a unit
and a source, or is marked an estimate.
"""

import hashlib
from dataclasses import dataclass
from functools import cached_property

from pydantic import BaseModel

from magsim import assets, config
from magsim.aircraft.facts import Facts, Limits
from magsim.aircraft.magnetics import Magnetics
from magsim.errors import RequestError

__all__ = ["Aircraft", "Facts", "Limits", "Magnetics", "load_aircraft"]


@dataclass(frozen=True)
class Aircraft:
    """An aircraft, validated.

    Attributes
    ----------
    name : str
        Name of its folder.
    facts : Facts
        What flies.
    magnetics : Magnetics
        What disturbs, and where sensors are mounted.
    digest : str
        SHA-256 over the bytes of its two files, in hexadecimal.
    """

    name: str
    facts: Facts
    magnetics: Magnetics
    digest: str

    @property
    def limits(self) -> Limits:
        """What the aircraft can be asked to do."""
        return self.facts.limits

    @cached_property
    def mounts(self) -> dict[str, tuple[float, float, float]]:
        """Places for sensors by name, (3,) [m] in body axes from the datum."""
        return {name: mount.position_m for name, mount in self.magnetics.mounts.items()}


def load_aircraft(name: str) -> Aircraft:
    """Read and check one of the shipped aircraft.

    Parameters
    ----------
    name : str
        Name of a folder in ``aircraft``.

    Returns
    -------
    Aircraft

    Raises
    ------
    RequestError
        If there is no such aircraft, or its files are wrong: one line for each problem of both files.
    """
    folder = assets.aircraft_dir(name)
    parts: list[BaseModel] = []
    lines: list[str] = []
    digest = hashlib.sha256()
    for file, model in zip(assets.AIRCRAFT_FILES, (Facts, Magnetics), strict=True):
        path = folder / file
        try:
            parts.append(config.load(path, model))
            digest.update(f"{file}\0".encode() + path.read_bytes() + b"\0")
        except RequestError as error:
            lines.append(str(error))
    if lines:
        raise RequestError("\n".join(lines))
    return Aircraft(name, *parts, digest.hexdigest())
