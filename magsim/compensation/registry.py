"""Methods by name: those of this package, registered ones, and those of entry point group ``magsim.compensators``."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeVar

from magsim.compensation.base import Compensator, read_settings, restore
from magsim.config import value_of
from magsim.config.schema import did_you_mean
from magsim.errors import DataError, RequestError

GROUP = "magsim.compensators"
"""Entry point group: each point names a ``Compensator`` class."""


@dataclass(frozen=True)
class Entry:
    """One method: a class, or the place of one (``module:name``) that is imported when asked for.

    ``params`` are fixed by the name; ``defaults`` are where the name differs from the class and may be changed.
    """

    target: type[Compensator] | str
    params: dict[str, object] = field(default_factory=dict)
    defaults: dict[str, object] = field(default_factory=dict)

    def load(self) -> type[Compensator]:
        """The class."""
        if isinstance(self.target, str):
            module, _, name = self.target.partition(":")
            return getattr(import_module(module), name)
        return self.target


_TL = "magsim.compensation.tolles_lawson:TollesLawson"
_REGISTRY: dict[str, Entry] = {
    "none": Entry("magsim.compensation.tolles_lawson:Nothing"),
    "tl16": Entry(_TL, {"terms": 16}),
    "tl18": Entry(_TL, {"terms": 18}),
    "tl16_measured": Entry(_TL, {"terms": 16, "target": "measured"}),
    "tl18_measured": Entry(_TL, {"terms": 18, "target": "measured"}),
    # The best of paper 002: order 3, with the height.
    "tl16_gradient": Entry(_TL, {"terms": 16, "target": "measured"}, {"order": 3, "vertical": True}),
    "magtcn": Entry("magsim.compensation.networks:MagTCNCompensator"),
    "bp": Entry("magsim.compensation.networks:BPCompensator"),
}

C = TypeVar("C", bound=type[Compensator])


def register(name: str, **params: object) -> Callable[[C], C]:
    """Class decorator that makes a method known by a name, with fixed parameters if any are given."""

    def decorate(cls: C) -> C:
        _REGISTRY[name] = Entry(cls, params)
        return cls

    return decorate


def _plugins() -> dict[str, Entry]:
    return {point.name: Entry(point.value) for point in entry_points(group=GROUP)}


def names() -> tuple[str, ...]:
    """Names of all methods: this package's and registered ones first, then those of other packages."""
    return tuple(dict.fromkeys([*_REGISTRY, *_plugins()]))


def lookup(name: str) -> Entry:
    """Entry of a method.

    Raises
    ------
    RequestError
        If no method has that name; the message lists those that there are.
    """
    entry = _REGISTRY.get(name) or _plugins().get(name)
    if entry is None:
        known = names()
        msg = f"unknown method {name!r}{did_you_mean(name, known)}; known: {', '.join(known)}"
        raise RequestError(msg)
    return entry


def create(name: str, /, *, preset: str | None = None, **params: object) -> Compensator:
    """An unfitted method.

    Parameters
    ----------
    name : str
        One of ``names()``.
    preset : str, optional
        One of the method's presets; parameters that are given beside it win.
    **params
        Parameters of the method's constructor.

    Raises
    ------
    RequestError
        If the name, the preset, a parameter or its value is not known.
    """
    entry = lookup(name)
    cls = entry.load()
    chosen = {**entry.params, **entry.defaults, **preset_params(name, preset), **params}
    for key, value in entry.params.items():
        if chosen[key] != value:
            msg = f"method {name}: {key} is {value!r} by its name; it cannot be {chosen[key]!r}"
            raise RequestError(msg)
    checked = cls.check_params(chosen, name)
    return cls(**checked)


def parse_method(text: str) -> tuple[str, dict[str, object]]:
    """Name and settings, as ``create`` takes them, of a method written in one line: ``name:key=value:key=value``.

    Values are those of TOML; what is no TOML value is text. The name itself is not looked up.

    Raises
    ------
    RequestError
        If a part is no ``key=value``, or a key is given twice.
    """
    name, *parts = (part.strip() for part in text.split(":"))
    settings: dict[str, object] = {}
    for part in parts:
        key, equals, value = (piece.strip() for piece in part.partition("="))
        if not (key and equals and value):
            msg = f"method {text}: {part!r} is not of the form key=value, as in tl16_gradient:order=2:vertical=false"
            raise RequestError(msg)
        if key in settings:
            msg = f"method {text}: {key} is given twice"
            raise RequestError(msg)
        settings[key] = value if key == "preset" else value_of(value)
    return name, settings


def preset_params(name: str, preset: str | None) -> dict[str, object]:
    """Parameters of a preset; none without one.

    Raises
    ------
    RequestError
        If the method has no such preset.
    """
    if preset is None:
        return {}
    presets = lookup(name).load().presets
    if preset not in presets:
        has = ", ".join(presets) or "none"
        msg = f"method {name} has no preset {preset!r}{did_you_mean(preset, presets)}; it has {has}"
        raise RequestError(msg)
    return dict(presets[preset])


def load(folder: str | Path) -> Compensator:
    """A fitted method from the folder that ``Compensator.save`` wrote.

    Raises
    ------
    RequestError
        If the folder holds none, or its method is not known here.
    DataError
        If a file in it is broken.
    """
    folder = Path(folder)
    settings = read_settings(folder)
    name, params = settings["method"], settings["params"]
    if not isinstance(name, str) or not isinstance(params, dict):
        msg = f"{folder}: the settings of the saved method are broken"
        raise DataError(msg)
    return restore(create(name, **params), folder, settings)
