"""The contract of every compensator: fit on labeled recordings, put out the interference of blind ones."""

import inspect
import json
import zlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, final
from zipfile import BadZipFile

import numpy as np
from pydantic import BaseModel, BeforeValidator, ValidationError, create_model

from magsim import __version__, columns
from magsim.compensation import features
from magsim.config import Strict
from magsim.config.keys import show
from magsim.config.wording import complaints
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.storage import atomic_write

SETTINGS, ARRAYS = "compensator.json", "arrays.npz"
FORMAT = 1


class Compensator(ABC):
    """A method that learns the interference of an aircraft and predicts it from other instruments.

    The manners are those of scikit-learn: the constructor only stores its parameters, what ``fit`` learns ends in an
    underscore, and ``type(c)(**c.get_params())`` is an unfitted copy. Recordings come whole or with rows left out;
    time tags tell where a piece ends, and no method looks across such a gap.

    ``fit`` leaves out the rows in which the magnetometer does not read (``Recording.reads``). A filter would spread
    what is held there, so one that learns from the reading cuts it first (``reading_rows``); labels are right there
    too, and only the rows themselves are left out. ``interference`` needs no reading: it has a value for every row.

    Attributes
    ----------
    name : str
        Name in the registry.
    requires : tuple of str
        Patterns of the column families that ``interference`` reads. A method that needs the scalar reading itself
        must list it here.
    causal : bool
        Whether the estimate at a time needs nothing that comes later, but for the one row of a central difference.
    warmup_s : float [s]
        Time at the start of each piece in which the estimate may be NaN.
    resumable : bool
        Whether ``fit`` also takes ``progress`` (a callable) and ``checkpoint`` (a folder).
    presets : mapping
        Named sets of parameters.
    sensor_ : str
        The scalar magnetometer that was fitted.
    """

    name: str = ""
    requires: tuple[str, ...] = ()
    causal: bool = True
    warmup_s: float = 0.0
    resumable: ClassVar[bool] = False
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {}
    sensor_: str

    @abstractmethod
    def fit(self, train: Sequence[Recording], *, sensor: str, valid: Sequence[Recording] = (), seed: int = 0) -> Self:
        """Learn from labeled recordings.

        Parameters
        ----------
        train, valid : sequence of Recording
            ``Recording.labeled()`` copies: inputs, labels, segments. ``valid`` may guide when to stop and how large
            to be; a method without such choices may learn from it too.
        sensor : str
            Name of the scalar magnetometer.
        seed : int
            Seed of all random choices.

        Raises
        ------
        RequestError
            If a parameter, the sensor or a column is not there.
        DataError
            If the recordings are too short or not finite.
        """

    @abstractmethod
    def interference(self, recording: Recording) -> np.ndarray:
        """Estimate the interference from a ``Recording.blind()`` copy.

        Returns
        -------
        (n,) [nT]
            NaN in the declared warm-up of each piece only.
        """

    @final
    def compensate(self, recording: Recording) -> np.ndarray:
        """Scalar reading minus the estimated interference, (n,) [nT]."""
        features.require(recording, [columns.MAG.name(sensor=self.sensor_)])
        return recording[columns.MAG.name(sensor=self.sensor_)] - self.interference(recording)

    def _learned(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """What ``fit`` learned: plain values for JSON, and arrays.

        By default every attribute whose name ends in an underscore.

        Raises
        ------
        RequestError
            If one of them is neither an array of numbers nor a plain value.
        """
        values, arrays = {}, {}
        for name, value in vars(self).items():
            if not name.endswith("_") or name.startswith("_") or name == "sensor_":
                continue
            if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
                arrays[name] = value
            elif isinstance(value, bool | int | float | str | None):
                values[name] = value
            else:
                msg = (
                    f"method {self.name} cannot be saved: {name} is of type {type(value).__name__}; allowed: arrays of "
                    "numbers and plain values, or own methods _learned and _restore"
                )
                raise RequestError(msg)
        return values, arrays

    def _restore(self, values: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
        """Take back what ``_learned`` gave; a ``KeyError`` or ``ValueError`` says that the file is broken."""
        for name, value in {**values, **arrays}.items():
            if not name.endswith("_") or name.startswith("_"):
                msg = f"{name!r} is nothing that fit learns"
                raise ValueError(msg)
            setattr(self, name, value)

    def _save_more(self, folder: Path) -> None:  # noqa: B027 - most methods have no files of their own
        """Write files of the method's own beside the settings and arrays."""

    def _load_more(self, folder: Path) -> None:  # noqa: B027
        """Read what ``_save_more`` wrote; called after ``_restore``."""

    @final
    @classmethod
    def settings_model(cls) -> type[BaseModel]:
        """Strict model of the constructor's parameters, from its annotations and defaults."""
        # TOML and JSON know lists alone
        as_tuple = BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
        fields = {p.name: (Annotated[p.annotation, as_tuple], p.default) for p in cls._parameters()}
        return create_model(f"{cls.__name__}Settings", __base__=Strict, **fields)  # type: ignore[call-overload]

    @classmethod
    def _parameters(cls) -> list[inspect.Parameter]:
        """Named parameters of the constructor, without ``self`` and without what ``object`` takes."""
        kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        parameters = inspect.signature(cls.__init__, eval_str=True).parameters.values()
        return [p for p in parameters if p.name != "self" and p.kind in kinds]

    @final
    @classmethod
    def check_params(cls, params: Mapping[str, object], owner: str = "") -> dict[str, object]:
        """Checked parameters with their defaults filled in.

        Raises
        ------
        RequestError
            With one line for each parameter that is unknown or has a value that is not allowed.
        """
        table = dict(params)
        model = cls.settings_model()
        try:
            return dict(model.model_validate(table))
        except ValidationError as error:
            found = complaints(error, model, table)
            msg = "\n".join(f"method {owner or cls.name!s}: {show(c.path)}: {c.text}" for c in found)
            raise RequestError(msg) from None

    @final
    def get_params(self) -> dict[str, Any]:
        """Parameters as they were given to the constructor."""
        return {parameter.name: getattr(self, parameter.name) for parameter in self._parameters()}

    @final
    def set_params(self, **params: object) -> Self:
        """Change parameters.

        Raises
        ------
        RequestError
            If one is unknown or has a value that is not allowed.
        """
        for name, value in self.check_params({**self.get_params(), **params}, self.name).items():
            setattr(self, name, value)
        return self

    def __repr__(self) -> str:
        params = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
        return f"{type(self).__name__}({params})"

    @final
    def save(self, folder: str | Path, *, force: bool = True) -> None:
        """Write the fitted method to a folder: settings as JSON, arrays as npz, network weights as safetensors.

        Raises
        ------
        RequestError
            If it is not fitted, or the folder cannot be written.
        """
        self._require_fitted()
        folder = Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f"cannot make the folder {folder}: {error.strerror}"
            raise RequestError(msg) from None
        values, arrays = self._learned()
        settings = {
            "format": FORMAT,
            "magsim": __version__,
            "method": self.name,
            "params": self.get_params(),
            "sensor": self.sensor_,
            "learned": values,
        }
        text = json.dumps(settings, indent=2, sort_keys=True, allow_nan=False) + "\n"

        def write_arrays(path: Path) -> None:
            with path.open("wb") as file:
                np.savez(file, **arrays)

        self._save_more(folder)
        atomic_write(folder / ARRAYS, write_arrays, force=force)
        atomic_write(folder / SETTINGS, lambda path: path.write_text(text, encoding="utf-8"), force=force)

    def _require_fitted(self) -> None:
        if not hasattr(self, "sensor_"):
            msg = f"method {self.name} is not fitted yet: call fit first"
            raise RequestError(msg)


def read_settings(folder: Path) -> dict[str, Any]:
    """Settings of a saved method.

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
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        msg = f"{path} is broken: {error}"
        raise DataError(msg) from None
    if not known:
        msg = f"{path} is of format {settings['format']!r}; this version reads format {FORMAT}"
        raise DataError(msg)
    return settings


def restore(compensator: Compensator, folder: Path, settings: Mapping[str, Any]) -> Compensator:
    """Fill an unfitted method with what its folder holds.

    Raises
    ------
    DataError
        If a file is missing or broken.
    """
    try:
        # np.load forgets to close a file that it cannot read
        with np.load(BytesIO((folder / ARRAYS).read_bytes()), allow_pickle=False) as arrays:
            compensator._restore(settings["learned"], dict(arrays))
        compensator._load_more(folder)
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile, zlib.error) as error:
        msg = f"{folder}: the saved method cannot be read: {error}"
        raise DataError(msg) from None
    compensator.sensor_ = settings["sensor"]
    return compensator


def pick_fluxgate(recordings: Sequence[Recording], wanted: str | None) -> str:
    """The fluxgate to use: the wanted one, or the first of the first recording.

    Raises
    ------
    RequestError
        If a recording does not have it.
    """
    found = wanted or next(iter(recordings[0].fluxgates), None)
    for recording in recordings:
        if found is None or found not in recording.fluxgates:
            has = ", ".join(recording.fluxgates) or "none"
            msg = f"recording {recording.name!r} has no fluxgate {found or ''!r}; it has {has}"
            raise RequestError(msg)
    return str(found)


def check_recordings(recordings: Sequence[Recording], sensor: str) -> None:
    """Refuse an empty list, and recordings that do not have the scalar magnetometer.

    Raises
    ------
    RequestError
    """
    if not recordings:
        msg = "nothing to fit: no training recording was given"
        raise RequestError(msg)
    for recording in recordings:
        if sensor not in recording.scalars:
            has = ", ".join(recording.scalars) or "none"
            msg = f"recording {recording.name!r} has no scalar magnetometer {sensor!r}; it has {has}"
            raise RequestError(msg)


def reading_rows(recordings: Sequence[Recording], sensor: str) -> list[Recording]:
    """The rows in which the scalar magnetometer reads: what is left of each recording is pieces with gaps between.

    Raises
    ------
    DataError
        If it reads in none of the recordings.
    """
    masks = [recording.reads(sensor) for recording in recordings]
    pairs = zip(recordings, masks, strict=True)
    kept = [r if mask.all() else r.take(mask) for r, mask in pairs if mask.sum() >= 2]
    if recordings and not kept:
        names = ", ".join(repr(recording.name) for recording in recordings)
        msg = f"scalar magnetometer {sensor!r} does not read in any row of {names} that is to be learned from"
        raise DataError(msg)
    return kept


def labels(recording: Recording, sensor: str) -> np.ndarray:
    """Noise-free interference of a training recording, (n,) [nT].

    Raises
    ------
    RequestError
        If it has no such label: a real survey has none.
    DataError
        If a label is not finite.
    """
    name = columns.INTERFERENCE.name(sensor=sensor)
    if name not in recording:
        msg = (
            f"recording {recording.name!r} has no label {name!r}: without truth only the self-supervised methods "
            "(tl16_measured, tl18_measured, tl16_gradient) can be fitted"
        )
        raise RequestError(msg)
    values = recording[name]
    if not np.isfinite(values).all():
        when = recording.time_s[np.argmin(np.isfinite(values))]
        msg = f"recording {recording.name!r}: {name} is not finite at {when:g} s"
        raise DataError(msg)
    return values
