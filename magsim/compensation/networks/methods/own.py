"""Any torch module as a method: ``TorchCompensator``."""

import inspect
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

import numpy as np
import torch
from torch import Tensor, nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.modules.adapter import Adapter
from magsim.compensation.networks.settings import Count, NetworkSettings
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.signals import spans

Factory = Callable[..., nn.Module]
"""Makes a network for a number of channels, or for channels and window: a class of modules, or a function."""


@dataclass(frozen=True, kw_only=True)
class TorchSettings(NetworkSettings):
    """Parameters of ``TorchCompensator``.

    Attributes
    ----------
    out : {"last", "seq"}
        What the module returns for a window: its last sample, (b, 1) or (b,), which is causal; or every sample, (b, t)
        or (b, 1, t), of which overlapping windows are blended.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    out: Literal["last", "seq"] = "last"
    batch: Count = 64

    @property
    def context(self) -> int | None:
        """The window where its last sample alone is returned."""
        return self.window if self.out == "last" else None


class TorchCompensator(NetworkCompensator):
    """A torch module of your own on what a first stage leaves; parameters: ``TorchSettings``.

    ``TorchCompensator(Net, window=64)`` is a method; ``TorchCompensator.of(Net)`` is its class, for ``register``.

    Parameters
    ----------
    factory : callable
        Returns a ``torch.nn.Module`` on windows (b, c, t) with its start weights: ``factory(channels)`` or
        ``factory(channels, window)``, as its signature says.
    **parameters
        Of ``TorchSettings``.

    Raises
    ------
    RequestError
        If the factory is none. When the method is fitted: if it raises, if what it returns is no module, or if the
        module raises or returns what is not wanted.
    """

    settings_type = TorchSettings
    settings: TorchSettings
    factory: ClassVar[Factory | None] = None
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        # seconds on one core
        "quick": {"steps": 300, "every": 50},
    }

    def __new__(cls, factory: Factory | None = None, **_parameters: Any) -> Self:
        """Return an object of the class that belongs to the factory."""
        return super().__new__(cls if factory is None else cls.of(factory))

    def __init__(self, factory: Factory | None = None, **parameters: Any) -> None:
        if type(self).factory is None:
            msg = "TorchCompensator needs a factory: a class of torch modules, or a function that returns one"
            raise RequestError(msg)
        super().__init__(**parameters)

    @classmethod
    def of(cls, factory: Factory) -> type[Self]:
        """Return the method that trains what a factory makes, a class of its name.

        Raises
        ------
        RequestError
            If it is none.
        """
        if isinstance(factory, nn.Module) or not callable(factory):
            kind = type(factory).__name__
            msg = f"{kind} is no factory; allowed: a class of torch modules, or a function that returns one"
            raise RequestError(msg)
        name = getattr(getattr(factory, "func", factory), "__name__", type(factory).__name__)
        return type(name, (cls,), {"factory": staticmethod(factory), "name": name, "__module__": cls.__module__})

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a module of the factory with its start weights.

        Raises
        ------
        RequestError
            See ``TorchCompensator``.
        """
        factory = type(self).factory
        assert factory is not None
        module = _made(factory, self.name, len(names), self.settings.window)
        adapter = Adapter(module)
        _check(module, self.name, len(names), self.settings)
        return adapter

    @property
    def module_(self) -> nn.Module:
        """The trained module as the factory made it, without the factor that starts it at zero."""
        self.check_fitted()
        return self._fitted.module.module  # type: ignore[return-value]

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return first stage plus network, (n,) [nT]; see ``NetworkCompensator``.

        Raises
        ------
        DataError
            If the module returns what is not finite.
        """
        out = super().estimate(recording)
        bad = ~np.isfinite(out)
        for span in spans(recording.time_s):
            bad[span.start : min(span.start + self._warmup_rows, span.stop)] = False
        if bad.any():
            row = int(np.argmax(bad))
            msg = (
                f"recording {recording.name!r}: the network of method {self.name} returned {out[row]} at "
                f"{recording.time_s[row]:g} s for finite inputs"
            )
            raise DataError(msg)
        return out

    @property
    def _warmup_rows(self) -> int:
        return (self.settings.context or 1) - 1


def _made(factory: Factory, name: str, channels: int, window: int) -> nn.Module:
    """Call a factory.

    Raises
    ------
    RequestError
        If it raises, takes something else, or returns no module.
    """
    takes_window, by_name = _takes_window(factory, name)
    given: tuple[Any, ...] = (channels, window) if takes_window and not by_name else (channels,)
    try:
        made = factory(*given, **({"window": window} if by_name else {}))
    except Exception as error:
        with_window = f" and a window of {window}" if takes_window else ""
        msg = f"{name} raised {type(error).__name__} for {channels} channels{with_window}: {error}"
        raise RequestError(msg) from error
    if not isinstance(made, nn.Module):
        msg = f"{name} returned {type(made).__name__}; allowed: a torch.nn.Module"
        raise RequestError(msg)
    return made


def _takes_window(factory: Factory, name: str) -> tuple[bool, bool]:
    """Return whether a factory takes the window too, and whether by its name."""
    try:
        parameters = inspect.signature(factory).parameters
    except (TypeError, ValueError):
        return False, False
    kinds = inspect.Parameter
    free = [p for p in parameters.values() if p.kind in (kinds.POSITIONAL_ONLY, kinds.POSITIONAL_OR_KEYWORD)]
    must = [p.name for p in free if p.default is kinds.empty]
    must += [p.name for p in parameters.values() if p.kind is kinds.KEYWORD_ONLY and p.default is kinds.empty]
    by_name = any(p.name == "window" and p.kind is not kinds.POSITIONAL_ONLY for p in parameters.values())
    others = [parameter for parameter in must if parameter != "window"] if by_name else must
    takes_any = any(p.kind is kinds.VAR_POSITIONAL for p in parameters.values())
    if len(others) > (1 if by_name else 2) or not (free or takes_any):
        has = ", ".join(parameters) or "nothing"
        msg = f"{name} takes {has}; allowed: {name}(channels) or {name}(channels, window), what is beside with defaults"
        raise RequestError(msg)
    return by_name or len(must) == 2, by_name


def _check(module: nn.Module, name: str, channels: int, settings: TorchSettings) -> None:
    """Try a module on two windows, in evaluation mode.

    Raises
    ------
    RequestError
        If it raises, or returns another shape than is wanted, what is not finite, or for a window what depends on the
        other; or if its state is no tensors.
    """
    window = settings.window
    windows = torch.sin(torch.arange(2.0 * channels * window)).reshape(2, channels, window)
    _check_shape(_tried(module, name, windows), name, windows, settings)
    for key, value in module.state_dict().items():
        if not isinstance(value, Tensor):
            msg = (
                f"{name}: {key} of its state_dict is of type {type(value).__name__}; allowed: tensors, which are saved"
            )
            raise RequestError(msg)
    # estimates are made in double precision, so that a stream gives what a whole recording gives
    double = deepcopy(module).double()
    both = _tried(double, name, windows.double())
    if not both.isfinite().all():
        msg = f"{name} returned {both[~both.isfinite()][0].item()} for finite windows"
        raise RequestError(msg)
    alone = _tried(double, name, windows[:1].double())
    if not torch.allclose(alone.reshape(-1), both[:1].reshape(-1), rtol=1e-6, atol=1e-9):
        msg = f"{name}: what it returns for a window depends on the other windows of its batch"
        raise RequestError(msg)


def _tried(module: nn.Module, name: str, windows: Tensor) -> Tensor:
    """Return what a module makes of windows."""
    shape, kind = tuple(windows.shape), str(windows.dtype).removeprefix("torch.")
    try:
        with torch.no_grad():
            out = module.eval()(windows)
    except Exception as error:
        msg = f"{name} raised {type(error).__name__} for {kind} windows of shape {shape}: {error}"
        raise RequestError(msg) from error
    if not isinstance(out, Tensor):
        msg = f"{name} returned {type(out).__name__} for windows of shape {shape}; allowed: a tensor"
        raise RequestError(msg)
    return out


def _check_shape(out: Tensor, name: str, windows: Tensor, settings: TorchSettings) -> None:
    count, _, rows = windows.shape
    shapes = {"last": [(count, 1), (count,)], "seq": [(count, rows), (count, 1, rows)]}
    wanted = shapes[settings.out]
    if tuple(out.shape) in wanted:
        return
    allowed = " or ".join(map(str, wanted))
    other = "seq" if settings.out == "last" else "last"
    hint = f"; that is out {other!r}" if tuple(out.shape) in shapes[other] else ""
    msg = (
        f"{name} returned shape {tuple(out.shape)} for windows of shape {tuple(windows.shape)}; allowed with out "
        f"{settings.out!r}: {allowed}{hint}"
    )
    raise RequestError(msg)
