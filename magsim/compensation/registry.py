"""Methods by name: those of this package, registered ones, and those of entry point group ``magsim.compensators``."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, TypeVar

from magsim.compensation.base import Compensator, restore
from magsim.compensation.parameters import check_parameters
from magsim.compensation.saving import read_settings
from magsim.config import value_of
from magsim.config.schema import did_you_mean
from magsim.errors import RequestError

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
        """Return the class."""
        if isinstance(self.target, str):
            module, _, name = self.target.partition(":")
            return getattr(import_module(module), name)
        return self.target


_TOLLES_LAWSON = "magsim.compensation.tolles_lawson:TollesLawson"
_EXACT_NORM = "magsim.compensation.exact_norm:ExactNorm"
_NETWORKS = "magsim.compensation.networks"
_REGISTRY: dict[str, Entry] = {
    "none": Entry("magsim.compensation.tolles_lawson:Nothing"),
    "tl3": Entry(_TOLLES_LAWSON, {"terms": 3}),
    "tl8": Entry(_TOLLES_LAWSON, {"terms": 8}),
    "tl9": Entry(_TOLLES_LAWSON, {"terms": 9}),
    "tl16": Entry(_TOLLES_LAWSON, {"terms": 16}),
    "tl18": Entry(_TOLLES_LAWSON, {"terms": 18}),
    "tl3_measured": Entry(_TOLLES_LAWSON, {"terms": 3, "target": "measured"}),
    "tl8_measured": Entry(_TOLLES_LAWSON, {"terms": 8, "target": "measured"}),
    "tl9_measured": Entry(_TOLLES_LAWSON, {"terms": 9, "target": "measured"}),
    "tl16_measured": Entry(_TOLLES_LAWSON, {"terms": 16, "target": "measured"}),
    "tl18_measured": Entry(_TOLLES_LAWSON, {"terms": 18, "target": "measured"}),
    # the best of paper 002: order 3, with the height
    "tl16_gradient": Entry(_TOLLES_LAWSON, {"terms": 16, "target": "measured"}, {"order": 3, "vertical": True}),
    "tl16_ins": Entry(_TOLLES_LAWSON, {"terms": 16, "direction": "ins"}),
    "tl16_calibrated": Entry(_TOLLES_LAWSON, {"terms": 16, "direction": "calibrated"}),
    "tl16_auxiliary": Entry(
        _TOLLES_LAWSON,
        {"terms": 16},
        {"direction": "calibrated", "auxiliary": ("currents", "voltages", "surfaces")},
    ),
    "tolles_lawson": Entry(_TOLLES_LAWSON),
    "tl16_recursive": Entry("magsim.compensation.recursive:RecursiveTollesLawson"),
    "vector_tl": Entry("magsim.compensation.vector_tl:VectorTollesLawson"),
    "exact_norm": Entry(_EXACT_NORM),
    "exact_norm_model": Entry(_EXACT_NORM, {"target": "model"}),
    "exact_norm_measured": Entry(_EXACT_NORM, {"target": "measured"}),
    "exact_norm_whole": Entry(_EXACT_NORM, {"repeated": True}),
    "exact_norm_causal": Entry(_EXACT_NORM, {"lookahead": 0}, {"direction": "best"}),
    "exact_norm_adaptive": Entry("magsim.compensation.exact_norm.adaptive:ExactNormAdaptive"),
    "magtcn": Entry("magsim.compensation.networks:MagTCNCompensator"),
    "bp": Entry("magsim.compensation.networks:BPCompensator"),
    "bpnn": Entry("magsim.compensation.networks:BPNNCompensator"),
    "williams": Entry("magsim.compensation.networks:WilliamsCompensator"),
    "resnet": Entry("magsim.compensation.networks:ResNetCompensator"),
    "res_bp": Entry("magsim.compensation.networks:ResBpCompensator"),
    "subnetworks": Entry("magsim.compensation.networks:SubnetworksCompensator"),
    "lstm_bp": Entry("magsim.compensation.networks:LSTMBPCompensator"),
    "gru_bp": Entry("magsim.compensation.networks:GRUBPCompensator"),
    "lstm": Entry("magsim.compensation.networks:LSTMCompensator"),
    "pg_tlnet": Entry("magsim.compensation.networks:PGTLNetCompensator"),
    "ga_bp": Entry("magsim.compensation.networks:GABPCompensator"),
    "wavelet_bilstm": Entry("magsim.compensation.networks:WaveletBiLSTMCompensator"),
}

C = TypeVar("C", bound=Callable[..., Any])


def register(name: str, **params: object) -> Callable[[C], C]:
    """Return a decorator that makes a method known by a name, with fixed parameters if any are given.

    It takes a ``Compensator``; or a class of torch modules, or a function that returns one: ``TorchCompensator`` makes
    a method of it. What it decorates stays as it is.

    Raises
    ------
    RequestError
        If it decorates something else.
    """

    def decorate(thing: C) -> C:
        method = _method_of(thing)
        if method is None:
            msg = f"method {name!r}: {thing!r} is neither a subclass of Compensator nor makes torch modules"
            raise RequestError(msg)
        _REGISTRY[name] = Entry(method, params)
        return thing

    return decorate


def _method_of(thing: object) -> type[Compensator] | None:
    """Return the method that a class or a function stands for; None if it stands for none."""
    if isinstance(thing, type) and issubclass(thing, Compensator):
        return thing
    torch = sys.modules.get("torch")  # who has a module has imported it
    makes_modules = (
        torch is not None and issubclass(thing, torch.nn.Module) if isinstance(thing, type) else callable(thing)
    )
    return import_module(_NETWORKS).TorchCompensator.of(thing) if makes_modules else None


def _plugins() -> dict[str, Entry]:
    return {point.name: Entry(point.value) for point in entry_points(group=GROUP)}


def names() -> tuple[str, ...]:
    """Return the names of all methods: this package's and registered ones first, then those of other packages."""
    return tuple(dict.fromkeys([*_REGISTRY, *_plugins()]))


def lookup(name: str) -> Entry:
    """Return the entry of a method.

    Raises
    ------
    RequestError
        If no method has that name; the message lists those that there are.
    """
    entry = _REGISTRY.get(name) or _plugins().get(name)
    if entry is None:
        known = names()
        msg = (
            f"unknown method {name!r}{did_you_mean(name, known)}; known: {', '.join(known)}, or a class of your own as "
            "my_file.py:MyMethod"
        )
        raise RequestError(msg)
    return entry


def register_file(path: Path, class_name: str) -> str:
    """Import a method from a Python file of the user's own and make it known.

    The file is run: this is for a file that the user names, never for a name that another file holds.

    Parameters
    ----------
    path : Path
        Ends with ``.py``.
    class_name : str
        A subclass of ``Compensator`` in it; or a class of torch modules, or a function that returns one.

    Returns
    -------
    str
        Name that the method is known by from now on, ``my_file.py:MyMethod``.

    Raises
    ------
    RequestError
        If there is no such file or class, or the file cannot be imported.
    """
    if not path.is_file():
        msg = f"{path}: there is no such file"
        raise RequestError(msg)
    spec = spec_from_file_location(f"magsim_method_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses and pickles look their module up
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[spec.name]
        msg = f"{path}: cannot be imported: {type(error).__name__}: {error}"
        raise RequestError(msg) from error
    method = _method_of(getattr(module, class_name, None))
    if method is None:
        there = [n for n, v in vars(module).items() if callable(v) and getattr(v, "__module__", "") == module.__name__]
        msg = (
            f"{path}: has no compensator {class_name!r}; allowed: a subclass of Compensator, a class of torch modules, "
            f"or a function that returns one; it has {there or 'none'}"
        )
        raise RequestError(msg)
    name = f"{path.name}:{class_name}"
    _REGISTRY[name] = Entry(method)
    return name


def create(name: str, /, *, preset: str | None = None, **params: object) -> Compensator:
    """Return an unfitted method.

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
    made = cls(**check_parameters(cls, chosen, name))
    made.name = name
    return made


def parse_method(text: str) -> tuple[str, dict[str, object]]:
    """Read a method that is written in one line, ``name:key=value:key=value`` or ``file.py:Class:key=value``.

    Values are those of TOML; what is no TOML value is text. A name is not looked up; a file is imported.

    Returns
    -------
    name : str
    settings : dict
        As ``create`` takes them.

    Raises
    ------
    RequestError
        If a part is not of the form ``key=value``, a key is given twice, or a file cannot be imported.
    """
    name, *parts = (part.strip() for part in text.split(":"))
    if name.endswith(".py"):
        if not parts or "=" in parts[0]:
            msg = f"method {text}: a file needs the name of a class in it, as in my_file.py:MyMethod"
            raise RequestError(msg)
        name = register_file(Path(name), parts.pop(0))
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


def make(text: str) -> Compensator:
    """Return an unfitted method from one line, ``name:key=value:preset=name``.

    Raises
    ------
    RequestError
        As ``parse_method`` and ``create``.
    """
    name, settings = parse_method(text)
    preset = settings.pop("preset", None)
    return create(name, preset=None if preset is None else str(preset), **settings)


def presets_of(name: str) -> Mapping[str, Mapping[str, object]]:
    """Return the named sets of parameters of a method.

    Raises
    ------
    RequestError
        If no method has that name.
    """
    return lookup(name).load().presets


def preset_params(name: str, preset: str | None) -> dict[str, object]:
    """Return the parameters of a preset; none without one.

    Raises
    ------
    RequestError
        If the method has no such preset.
    """
    if preset is None:
        return {}
    presets = presets_of(name)
    if preset not in presets:
        has = ", ".join(presets) or "none"
        msg = f"method {name} has no preset {preset!r}{did_you_mean(preset, presets)}; it has {has}"
        raise RequestError(msg)
    return dict(presets[preset])


def load(folder: str | Path) -> Compensator:
    """Read a fitted method from the folder that ``Compensator.save`` wrote.

    Raises
    ------
    RequestError
        If the folder holds none, or its method is not known here: a class of one's own must be registered, or named as
        ``my_file.py:MyMethod`` before.
    DataError
        If a file in it is broken.
    """
    folder = Path(folder)
    settings = read_settings(folder)
    return restore(create(settings["method"], **settings["params"]), folder, settings)
