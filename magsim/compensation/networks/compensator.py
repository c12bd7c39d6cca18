"""A network as a compensator: parameters, estimate, files."""

from abc import abstractmethod
from collections.abc import Mapping
from copy import deepcopy
from typing import Any, ClassVar

import numpy as np
import torch
from torch import nn

from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.columns import Joined
from magsim.compensation.networks.residual import Fitted, check_rate, fit_residual
from magsim.compensation.networks.scaling import Standardizer
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import first_stage, network_columns
from magsim.compensation.networks.streaming import network_streamer
from magsim.compensation.saving import State
from magsim.compensation.streaming import Feed, Streamer
from magsim.dataset import Training
from magsim.recording import Recording
from magsim.training import Outcome, reproducible, seeded

STAGE = "stage."
"""Prefix of the first stage's arrays in the file."""


class NetworkCompensator(Compensator):
    """A network on what a closed-form first stage leaves; see ``magsim.compensation.networks.residual``.

    Subclasses name their settings, a frozen dataclass whose fields are the parameters, and make the network.

    Attributes
    ----------
    settings : NetworkSettings
    is_windowed : bool
        Whether an output depends on other rows of its window.
    outcomes_ : dict of str to Outcome
        Result of each training run: ``select`` and ``refit``.
    """

    is_windowed: bool = True

    settings_type: ClassVar[type[NetworkSettings]] = NetworkSettings

    def __init__(self, **parameters: Any) -> None:
        self.settings = self.settings_type(**parameters)

    @abstractmethod
    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return the network with its start weights for the named input columns; it has ``start_at_zero``."""

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """Patterns of the column families that are read."""
        return tuple(dict.fromkeys((*self._columns("", None).reads, *first_stage(self.settings, None).requires)))

    def _columns(self, fluxgate: str, strength_nt: float | None) -> Joined:
        return network_columns(self.settings, fluxgate, strength_nt)

    @property
    def lookahead_rows(self) -> int | None:  # type: ignore[override]
        """Those of the columns where windows end at the output; overlapping windows look ahead without limit."""
        if self.is_windowed and not self.settings.last:
            return None
        return max(self._columns("", None).lookahead_rows or 0, first_stage(self.settings, None).lookahead_rows or 0)

    @property
    def warmup_s(self) -> float:  # type: ignore[override]
        """One window where only its last sample is returned; taken at 10 Hz before ``fit`` has seen a rate."""
        rate_hz = self._fitted.rate_hz if hasattr(self, "_fitted") else 10.0
        return (self.settings.window - 1) / rate_hz if self.settings.last else 0.0

    def learn(self, training: Training, context: FitContext) -> None:
        """Train; see ``Compensator.learn``."""
        identity = {"method": self.name, "params": self.get_params()}
        self._fitted, self.outcomes_ = fit_residual(
            self.settings, self.make_module, training, context, identity=identity
        )

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return first stage plus network, (n,) [nT].

        In double precision: rows by themselves give what rows in batches give, as a stream needs it.
        """
        fitted = self._fitted
        check_rate(recording, fitted.rate_hz)
        inputs = fitted.standardizer(fitted.columns(recording).matrix)
        with reproducible(self.settings.threads):
            out = fitted.output(deepcopy(fitted.module).double(), inputs, recording.time_s)
        return fitted.stage.interference(recording) + fitted.mean + fitted.scale * out

    def _streamer(self, feed: Feed) -> Streamer | None:
        """Return stage and network row by row; see ``Compensator``."""
        return network_streamer(self._fitted, feed, window=self.settings.window if self.is_windowed else 1)

    def state(self) -> State:
        """Return scales, first stage and weights; see ``Compensator.state``."""
        fitted = self._fitted
        stage = fitted.stage.state()
        arrays = {f"{STAGE}{name}": array for name, array in stage.arrays.items()}
        arrays |= {"input_mean": fitted.standardizer.mean, "input_scale": fitted.standardizer.scale}
        outcomes = {
            name: {"best_step": o.best_step, "best_value": o.best_value, "steps": o.steps}
            for name, o in self.outcomes_.items()
        }
        values = {
            "stage": stage.values,
            "rate_hz": fitted.rate_hz,
            "fluxgate": fitted.fluxgate,
            "strength_nt": fitted.strength_nt,
            "names": list(fitted.names),
            "mean_nt": fitted.mean,
            "scale_nt": fitted.scale,
            "outcomes": outcomes,
        }
        return State(values, arrays, {name: tensor.numpy() for name, tensor in fitted.module.state_dict().items()})

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned."""
        values, arrays = state.values, state.arrays
        stage = first_stage(self.settings, values["fluxgate"])
        own = {name.removeprefix(STAGE): array for name, array in arrays.items() if name.startswith(STAGE)}
        stage.set_state(State(values["stage"], own))
        stage.sensor_ = ""
        names = tuple(values["names"])
        standardizer = Standardizer(arrays["input_mean"], arrays["input_scale"])
        if standardizer.mean.shape != (len(names),) or standardizer.scale.shape != (len(names),):
            msg = f"input scales of shape {standardizer.mean.shape} for {len(names)} inputs"
            raise ValueError(msg)
        with seeded(0):
            module = self.make_module(names)
        load_weights(module, state.weights)
        fluxgate, strength_nt = values["fluxgate"], values["strength_nt"]
        mean, scale, rate_hz = float(values["mean_nt"]), float(values["scale_nt"]), float(values["rate_hz"])
        columns = self._columns(fluxgate, strength_nt)
        self._fitted = Fitted(
            self.settings, stage, columns, fluxgate, strength_nt, names, standardizer, mean, scale, module, rate_hz
        )
        self.outcomes_ = {name: Outcome(**kept, history=()) for name, kept in values["outcomes"].items()}


def load_weights(module: nn.Module, weights: Mapping[str, np.ndarray]) -> None:
    """Set the parameters of a network.

    Raises
    ------
    ValueError
        If names or shapes are not those of the network.
    """
    try:
        module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in weights.items()})
    except (RuntimeError, TypeError) as error:
        msg = f"the weights do not fit the network: {error}"
        raise ValueError(msg) from None
    module.eval()
