"""Fitted methods in folders: settings as JSON, arrays as npz, network weights as safetensors; nothing is pickled."""

import hashlib
import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from magsim.errors import DataError, RequestError
from magsim.storage import atomic_text, atomic_write

SETTINGS, ARRAYS, WEIGHTS = "compensator.json", "arrays.npz", "weights.safetensors"
"""Files of a fitted method; the last one of networks alone."""

FILES = (SETTINGS, ARRAYS, WEIGHTS)

FORMAT = 2
"""Version of the files."""


@dataclass(frozen=True)
class State:
    """What a method learned.

    Attributes
    ----------
    values : mapping
        Plain values for JSON.
    arrays : mapping of str to array
        Arrays of numbers.
    weights : mapping of str to array
        Parameters of a network, as ``state_dict`` names them. Needs safetensors (``aeromagsim[train]``).
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)
    weights: Mapping[str, np.ndarray] = field(default_factory=dict)


def state_of(fitted: object, owner: str) -> State:
    """Collect the attributes of a fitted method whose names end in an underscore.

    Raises
    ------
    RequestError
        If one of them is neither an array of numbers nor a plain value.
    """
    values, arrays = {}, {}
    for name, value in vars(fitted).items():
        if not name.endswith("_") or name.startswith("_") or name == "sensor_":
            continue
        if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
            arrays[name] = value
        elif isinstance(value, bool | int | float | str | None):
            values[name] = value
        else:
            msg = (
                f"method {owner} cannot be saved: {name} is of type {type(value).__name__}; allowed: arrays of numbers "
                "and plain values, or own methods state and set_state"
            )
            raise RequestError(msg)
    return State(values, arrays)


def set_attributes(unfitted: object, state: State) -> None:
    """Set the attributes that ``state_of`` collected.

    Raises
    ------
    ValueError
        If a name is not that of something learned.
    """
    for name, value in {**state.values, **state.arrays}.items():
        if not name.endswith("_") or name.startswith("_"):
            msg = f"{name!r} is nothing that fit learns"
            raise ValueError(msg)
        setattr(unfitted, name, value)


def write(folder: Path, settings: Mapping[str, Any], state: State, *, force: bool) -> None:
    """Write a fitted method to a folder, which is made if need be.

    Parameters
    ----------
    folder : Path
    settings : mapping
        Method, parameters, sensor, version.
    state : State
    force : bool
        Replace a method that is there.

    Raises
    ------
    RequestError
        If the folder cannot be made, or a file exists and ``force`` is not set.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"cannot make the folder {folder}: {error.strerror}"
        raise RequestError(msg) from None
    whole = {"format": FORMAT, **settings, "learned": state.values}
    weights = _weights_file(state) if state.weights else b""
    if weights:
        # safetensors has no checksum
        whole["weights_sha256"] = hashlib.sha256(weights).hexdigest()
    text = json.dumps(whole, indent=2, sort_keys=True, allow_nan=False) + "\n"

    def write_arrays(path: Path) -> None:
        with path.open("wb") as file:
            np.savez(file, **state.arrays)  # type: ignore[arg-type]

    if weights:
        atomic_write(folder / WEIGHTS, lambda path: path.write_bytes(weights), force=force)
    atomic_write(folder / ARRAYS, write_arrays, force=force)
    atomic_text(folder / SETTINGS, text, force=force)


def read_settings(folder: Path) -> dict[str, Any]:
    """Read the settings of a saved method.

    Raises
    ------
    RequestError
        If the folder holds none.
    DataError
        If they are broken or of a format that this version does not know.
    """
    path = folder / SETTINGS
    if not path.is_file():
        msg = f"{folder} holds no fitted method: {SETTINGS} is missing"
        raise RequestError(msg)
    try:
        settings = json.loads(path.read_text(encoding="utf-8"))
        known = settings["format"] == FORMAT and {"method", "params", "sensor", "learned"} <= settings.keys()
        known = known and isinstance(settings["method"], str) and isinstance(settings["params"], dict)
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        msg = f"{path} is broken: {error}"
        raise DataError(msg) from None
    if not known:
        msg = f"{path} is of format {settings['format']!r} or broken; this version reads format {FORMAT}"
        raise DataError(msg)
    return settings


def read_state(folder: Path, settings: Mapping[str, Any]) -> State:
    """Read what a saved method learned.

    Raises
    ------
    DataError
        If a file is missing or broken.
    """
    try:
        # np.load forgets to close a file that it cannot read
        with np.load(BytesIO((folder / ARRAYS).read_bytes()), allow_pickle=False) as file:
            arrays = dict(file)
        weights = _read_weights(folder / WEIGHTS, settings.get("weights_sha256"))
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile, zlib.error) as error:
        raise unreadable(folder, error) from None
    return State(settings["learned"], arrays, weights)


def unreadable(folder: Path, error: Exception) -> DataError:
    """Return the error of a saved method that cannot be read."""
    return DataError(f"{folder}: the saved method cannot be read: {error}")


def _weights_file(state: State) -> bytes:
    from safetensors.numpy import save

    # its writer takes the memory of an array as it lies: in C order alone the values come back right
    return save({name: np.asarray(array, order="C") for name, array in state.weights.items()})


def _read_weights(path: Path, sha256: str | None) -> dict[str, np.ndarray]:
    if sha256 is None and not path.exists():
        return {}
    from safetensors import SafetensorError
    from safetensors.numpy import load

    data = path.read_bytes()
    try:
        weights = load(data)
    except SafetensorError as error:
        msg = f"{path.name}: {error}"
        raise ValueError(msg) from None
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        msg = f"{path.name}: the weights are not those that were written"
        raise ValueError(msg)
    return weights
