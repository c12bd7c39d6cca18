"""The contract of every compensator: fit on labeled rows, estimate the interference of blind ones."""

from abc import abstractmethod
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Self, final

import numpy as np
from pydantic import BaseModel

from magsim import __version__, columns
from magsim.compensation import saving
from magsim.compensation.columns import require
from magsim.compensation.context import FitContext
from magsim.compensation.explained import Explained
from magsim.compensation.parameters import check_parameters, parameters_of, settings_model
from magsim.compensation.saving import State
from magsim.compensation.streaming import Feed, Stream, Streamer, make_stream
from magsim.dataset import Data, FlightInfo, Training, flights_of, open_training, read_training
from magsim.errors import DataError, RequestError
from magsim.recording import MissingColumnError, Recording

__all__ = ["Compensator", "FitContext", "restore"]


class Compensator(Explained):
    """A method that learns the interference of an aircraft and estimates it from other instruments.

    A method of your own is a subclass with two functions: ``learn`` and ``estimate``. The manners are those of
    scikit-learn: the constructor only stores its parameters under their names, what ``learn`` finds is kept in
    attributes that end in an underscore, and ``type(c)(**c.get_params())`` is an unfitted copy. A method whose findings
    are more than arrays and plain values gives ``state`` and ``set_state`` as well.

    Attributes
    ----------
    name : str
        Name in the registry and in tables.
    requires : tuple of str
        Patterns of the column families that ``estimate`` reads (``magsim.columns``): it is given no others. A method
        that needs the scalar reading itself must list it here.
    lookahead_rows : int, optional
        Rows after its own that an estimate needs, within a piece; None where that has no limit. 1 by default: a central
        difference.
    memory_rows : int, optional
        Rows before its own that an estimate needs, within a piece; None where that has no limit or is not declared. A
        method that declares both can be streamed.
    warmup_s : float [s]
        Time at the start of each piece in which the estimate may be NaN.
    adapts : bool
        Whether it learns while it estimates: what it has learned of one piece stays in the next of the same recording.
    trains : bool
        Whether it learns in steps, so that device, logs and start weights of a ``FitContext`` have an effect.
    one_by_one : bool
        Whether it learns from one flight after another, so that no more than one needs to be in memory.
    presets : mapping
        Named sets of parameters.
    settings_type : type, optional
        A frozen dataclass whose fields are the parameters, for methods with many: the constructor takes them by keyword
        and keeps one in ``settings``.
    sensor_ : str
        The scalar magnetometer that was fitted.
    """

    name: str = ""
    requires: tuple[str, ...] = ()
    lookahead_rows: int | None = 1
    memory_rows: int | None = None
    warmup_s: float = 0.0
    adapts: bool = False
    trains: bool = False
    one_by_one: bool = False
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {}
    settings_type: ClassVar[type | None] = None
    settings: Any
    sensor_: str
    _fitted_on: Feed | None = None

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if "causal" in cls.__dict__:
            msg = f"{cls.__name__}.causal follows from lookahead_rows; set that instead, None where it has no limit"
            raise TypeError(msg)

    @final
    @property
    def causal(self) -> bool:
        """Whether an estimate needs no more than ``lookahead_rows`` rows that come later."""
        return self.lookahead_rows is not None

    # ---- what a method gives ----------------------------------------------------------------------------------

    @abstractmethod
    def learn(self, training: Training, context: FitContext) -> None:
        """Learn from labeled rows.

        Rows in which the magnetometer does not read (``Recording.reads``) must not be learned. A filter would spread
        what is held there, so a method that learns from the reading cuts it first (``targets.reading_rows``); labels
        are right there too, and only the rows themselves are left out. No method may look across a gap in time.

        Parameters
        ----------
        training : Training
            Labeled recordings, which of their rows are for validation, and the name of the magnetometer.
        context : FitContext
            Seed, progress, checkpoint and, for methods that train in steps, device, logs and start weights.

        Raises
        ------
        RequestError
            If a parameter or a column is missing.
        DataError
            If the recordings are too short or not finite.
        """

    @abstractmethod
    def estimate(self, recording: Recording) -> np.ndarray:
        """Estimate the interference.

        Parameters
        ----------
        recording : Recording
            A blind copy with the column families of ``requires`` alone.

        Returns
        -------
        (n,) [nT]
            NaN in the declared warm-up of each piece only.
        """

    def state(self) -> State:
        """Return what was learned, for files: by default every attribute whose name ends in an underscore.

        Raises
        ------
        RequestError
            If one of them is neither an array of numbers nor a plain value.
        """
        return saving.state_of(self, self.name)

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned; a ``KeyError`` or ``ValueError`` means that the file is broken."""
        saving.set_attributes(self, state)

    def check_settings(self) -> None:
        """Refuse parameters that do not go together, by a ``RequestError``, before anything is read."""

    def _streamer(self, feed: Feed) -> Streamer | None:
        """Return the method's own part of a stream, for methods that are faster or remember more than a few rows.

        Without one, a method that declares ``memory_rows`` is streamed by ``estimate`` on the rows around each row.
        """
        return None

    # ---- what users call --------------------------------------------------------------------------------------

    @final
    def fit(self, data: Data, *, sensor: str | None = None, context: FitContext | None = None) -> Self:
        """Fit the method.

        Parameters
        ----------
        data : Recording, Dataset, Path, str, or several of them
            Of recordings with a column ``split`` the rows ``train`` and ``valid`` are learned, else all rows.
        sensor : str, optional
            The scalar magnetometer; the first one of the first recording if not given.
        context : FitContext, optional
            Seed, progress, checkpoint, device, logs, start weights.

        Raises
        ------
        RequestError
            If a parameter, the sensor or a column is missing, or there is no training row.
        DataError
            If the recordings are too short or not finite.
        """
        return self.fit_rows(self.read_rows(flights_of(data), sensor), context)

    @final
    def read_rows(self, flights: Iterable[FlightInfo], sensor: str | None = None) -> Training:
        """Return the rows to learn from; of a method that learns ``one_by_one``, each flight is read when asked for."""
        self.check_settings()
        return (open_training if self.one_by_one else read_training)(flights, sensor)

    @final
    def fit_rows(self, training: Training, context: FitContext | None = None) -> Self:
        """Fit the method to training rows that have been taken already; see ``fit``."""
        if context is not None and not isinstance(context, FitContext):
            msg = f"context is of type {type(context).__name__}; allowed: a FitContext, as in FitContext(seed=3)"
            raise RequestError(msg)
        context = context or FitContext()
        if not self.trains:
            context.refuse_without_effect(self.name)
        self.__dict__.pop("sensor_", None)
        check_parameters(type(self), self.get_params(), self.name)
        self.check_settings()
        training = training.checked(self._require)
        with context.logged() as context:
            self.learn(training, context)
        self.sensor_ = training.sensor
        first = training.recordings[0]
        self._fitted_on = Feed(first.rate_hz, first.blind(self.requires).names("input"))
        return self

    @final
    def interference(self, recording: Recording) -> np.ndarray:
        """Estimate the interference of a recording from the columns that the method requires.

        Returns
        -------
        (n,) [nT]
            NaN in the declared warm-up of each piece only.

        Raises
        ------
        RequestError
            If the method is not fitted, or a column is missing.
        DataError
            If the estimate has another shape.
        """
        self.check_fitted()
        if not isinstance(recording, Recording):
            msg = f"method {self.name} estimates the interference of a Recording, not of {type(recording).__name__}"
            raise RequestError(msg)
        self._require(recording)
        return self._estimate(recording.blind(self.requires))

    def _estimate(self, visible: Recording) -> np.ndarray:
        """Return the estimate for a blind copy, checked."""
        try:
            estimate = np.asarray(self.estimate(visible), dtype=float)
        except MissingColumnError as error:
            needs = ", ".join(self.requires) or "none"
            msg = f"method {self.name}: {error}; estimate is given the column families of requires alone: {needs}"
            raise RequestError(msg) from None
        if estimate.shape != (len(visible),):
            msg = f"method {self.name} returned shape {estimate.shape} for {len(visible)} rows"
            raise DataError(msg)
        return estimate

    @final
    def compensate(self, recording: Recording) -> np.ndarray:
        """Return the scalar reading minus the estimated interference, (n,) [nT]."""
        self.check_fitted()
        require(recording, [columns.MAG.name(sensor=self.sensor_)])
        return recording[columns.MAG.name(sensor=self.sensor_)] - self.interference(recording)

    @final
    def stream(self, *, rate_hz: float | None = None, start_utc: str | None = None) -> Stream:
        """Return a stream: one row in, one compensated row out, ``lookahead_rows`` later.

        Parameters
        ----------
        rate_hz : float [Hz], optional
            Rows a second; those of the training by default.
        start_utc : str, optional
            Instant of time 0, for methods that know the date.

        Raises
        ------
        RequestError
            If the method is not fitted, needs rows without limit, or does not declare how many.
        """
        self.check_fitted()
        return make_stream(self, self.sensor_, self._fitted_on, rate_hz=rate_hz, start_utc=start_utc)

    @final
    def input_columns(self, available: Collection[str]) -> tuple[str, ...]:
        """Return the columns that an estimate reads.

        Parameters
        ----------
        available : collection of str
            Columns of a recording. Of the families that the method requires, those that it was fitted with count where
            it does not tell which it reads.

        Raises
        ------
        RequestError
            If the method is not fitted.
        """
        self.check_fitted()
        known = self._fitted_on or Feed(1.0)
        # only its columns are asked for: any date will do
        own = None if self.lookahead_rows is None else self._streamer(replace(known, start_utc="2000-01-01"))
        names = [name for name in known.columns if name in available] if own is None else own.columns
        return tuple(name for name in names if name != columns.TIME)

    @property
    def is_fitted(self) -> bool:
        """Whether the method has been fitted."""
        return hasattr(self, "sensor_")

    @final
    def check_fitted(self) -> None:
        """Refuse a method that is not fitted.

        Raises
        ------
        RequestError
        """
        if not self.is_fitted:
            msg = f"method {self.name} is not fitted yet: call fit first"
            raise RequestError(msg)

    def _require(self, recording: Recording) -> None:
        """Refuse a recording that has no column of a required family."""
        has = {columns.family_of(name).pattern for name in recording.data}
        for pattern in self.requires:
            if pattern not in has:
                msg = f"recording {recording.name!r} has no column {pattern}, which method {self.name} requires"
                raise RequestError(msg)

    @final
    @classmethod
    def settings_model(cls) -> type[BaseModel]:
        """Return a strict model of the parameters, from their annotations and defaults."""
        return settings_model(cls)

    @final
    def get_params(self) -> dict[str, Any]:
        """Return the parameters as they were given to the constructor."""
        holder = self if self.settings_type is None else self.settings
        return {parameter.name: getattr(holder, parameter.name) for parameter in parameters_of(type(self))}

    @final
    def set_params(self, **params: object) -> Self:
        """Change parameters.

        Raises
        ------
        RequestError
            If one is unknown or has a value that is not allowed.
        """
        checked = check_parameters(type(self), {**self.get_params(), **params}, self.name)
        if self.settings_type is not None:
            self.settings = self.settings_type(**checked)
        else:
            for name, value in checked.items():
                setattr(self, name, value)
        return self

    @final
    def unfitted(self) -> Self:
        """Return an unfitted copy of the same name and parameters."""
        copy = type(self)(**self.get_params())
        copy.name = self.name
        return copy

    def __repr__(self) -> str:
        defaults = {p.name: p.default for p in parameters_of(type(self))}
        changed = {name: value for name, value in self.get_params().items() if value != defaults[name]}
        shown = ", ".join(f"{name}={value!r}" for name, value in changed.items())
        return f"{type(self).__name__}({shown})" + (f" fitted for {self.sensor_!r}" if self.is_fitted else "")

    @final
    def save(self, folder: str | Path, *, force: bool = True) -> None:
        """Write the fitted method to a folder; ``magsim.compensation.load`` reads it.

        Raises
        ------
        RequestError
            If it is not fitted, or the folder cannot be written.
        """
        self.check_fitted()
        settings = {
            "magsim": __version__,
            "method": self.name,
            "params": self.get_params(),
            "sensor": self.sensor_,
            "rows": None
            if self._fitted_on is None
            else {"rate_hz": self._fitted_on.rate_hz, "columns": list(self._fitted_on.columns)},
        }
        saving.write(Path(folder), settings, self.state(), force=force)


def restore(compensator: Compensator, folder: Path, settings: Mapping[str, Any]) -> Compensator:
    """Fill an unfitted method with what its folder holds.

    Raises
    ------
    DataError
        If a file is missing or broken.
    """
    state = saving.read_state(folder, settings)
    try:
        compensator.set_state(state)
        rows = settings.get("rows")
        fitted_on = None if rows is None else Feed(float(rows["rate_hz"]), tuple(map(str, rows["columns"])))
    except (KeyError, ValueError, TypeError) as error:
        raise saving.unreadable(folder, error) from None
    compensator.sensor_ = settings["sensor"]
    compensator._fitted_on = fitted_on
    return compensator
