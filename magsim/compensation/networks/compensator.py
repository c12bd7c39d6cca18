"""A network as a compensator: parameters, estimate, files."""

from abc import abstractmethod
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import torch
from torch import nn

from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.networks.fitted import Fitted, check_rate
from magsim.compensation.networks.fitting import fit_network
from magsim.compensation.networks.inputs import inputs_from, most_lookahead, sure_reads
from magsim.compensation.networks.modules.committee import Committee
from magsim.compensation.networks.pretraining import pretrain
from magsim.compensation.networks.scaling import Standardizer
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import first_stage
from magsim.compensation.networks.streaming import network_streamer
from magsim.compensation.saving import State
from magsim.compensation.streaming import Feed, Streamer
from magsim.dataset import Training
from magsim.errors import RequestError
from magsim.recording import Recording
from magsim.training import Outcome, put_weights, reproducible, seeded

STAGE, INPUTS = "stage.", "inputs."
"""Prefixes of the arrays of the first stage and of the inputs in the file."""


@dataclass(frozen=True)
class NetworkReport:
    """What a network was fitted with.

    Attributes
    ----------
    inputs : tuple of str
        Names of its input columns.
    left_out : tuple of str
        Channels that do not change, and kinds of which there is none.
    is_start : bool
        Whether it is a start for others, without an estimate of its own.
    """

    inputs: tuple[str, ...]
    left_out: tuple[str, ...]
    is_start: bool = False

    def __str__(self) -> str:
        lines = [f"{len(self.inputs)} inputs: {', '.join(self.inputs)}"]
        lines += [f"left out, as they do not change: {', '.join(self.left_out)}"] if self.left_out else []
        if self.is_start:
            lines.append("a start for others: adapt it to a calibration flight with --init")
        return "\n".join(lines)


class NetworkCompensator(Compensator):
    """A network on what a closed-form first stage leaves; see ``magsim.compensation.networks.fitting``.

    Subclasses name their settings, a frozen dataclass whose fields are the parameters, and make the network.

    Attributes
    ----------
    settings : NetworkSettings
    outcomes_ : dict of str to Outcome
        Result of each training run, by its name: ``fold 1``, ..., ``all``.
    """

    trains: bool = True

    settings_type: ClassVar[type[NetworkSettings]] = NetworkSettings

    def __init__(self, **parameters: Any) -> None:
        self.settings = self.settings_type(**parameters)

    @abstractmethod
    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return the network with its start weights for the named input columns; it has ``start_at_zero``."""

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """Families that inputs and first stage read; those of channels and gyros once the training has found them."""
        if self.is_fitted:
            reads = (*self._fitted.columns.reads, *self._fitted.stage.requires)
        else:
            reads = (*sure_reads(self.settings), *first_stage(self.settings).requires)
        return tuple(dict.fromkeys(reads))

    @property
    def lookahead_rows(self) -> int | None:  # type: ignore[override]
        """Those of the columns where an output sees no later row; overlapping windows look ahead without limit."""
        if self.settings.context is None:
            return None
        if self.is_fitted:
            found = self._fitted.columns.lookahead_rows, self._fitted.stage.lookahead_rows
        else:
            found = most_lookahead(self.settings), first_stage(self.settings).lookahead_rows
        known = [rows for rows in found if rows is not None]
        return max(known) if len(known) == len(found) else None

    @property
    def one_by_one(self) -> bool:  # type: ignore[override]
        """Whether each flight has a first stage of its own."""
        return self.settings.stage_for == "flight"

    @property
    def warmup_s(self) -> float:  # type: ignore[override]
        """The rows before the first output; taken at 10 Hz before ``fit`` has seen a rate."""
        rate_hz = self._fitted.rate_hz if hasattr(self, "_fitted") else 10.0
        return ((self.settings.context or 1) - 1) / rate_hz

    def check_settings(self) -> None:
        """Refuse settings that do not go together; see ``Compensator.check_settings``."""
        self.settings.check()
        self.settings.refuse_of_adam(self.presets)

    def learn(self, training: Training, context: FitContext) -> None:
        """Train; see ``Compensator.learn``."""
        identity = {"method": self.name, "params": self.get_params()}
        fit = pretrain if self.one_by_one else fit_network
        # what judges between trainings too; these have their own say on determinism
        with reproducible(self.settings.threads, deterministic=False):
            self._fitted, self.outcomes_ = fit(self.settings, self.make_module, training, context, identity=identity)

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return first stage plus network, (n,) [nT].

        Of networks that are streamed in double precision: rows by themselves give what rows in batches give.
        """
        fitted = self._with_estimate()
        check_rate(recording, fitted.rate_hz)
        inputs, module = fitted.inputs(recording), fitted.module
        if self.settings.context is not None:
            inputs, module = fitted.standardizer(fitted.columns(recording).matrix), deepcopy(module).double()
        with reproducible(self.settings.threads):
            out = fitted.output(module, inputs, recording.time_s, platform=True)
        return fitted.stage.interference(recording) + fitted.mean + fitted.gain_nt * out

    @property
    def report_(self) -> NetworkReport:
        """The inputs that were found, and what was left out."""
        self.check_fitted()
        return NetworkReport(self._fitted.names, self._fitted.columns.left_out, self._fitted.is_start)

    def _streamer(self, feed: Feed) -> Streamer | None:
        """Return stage and network row by row; see ``Compensator``."""
        context = self.settings.context
        return None if context is None else network_streamer(self._with_estimate(), feed, context=context)

    def _with_estimate(self) -> Fitted:
        """Return what was fitted; refuse what is a start for others."""
        if self._fitted.is_start:
            msg = (
                f"method {self.name} was trained on flights with a first stage each (stage_for 'flight') and has none "
                f"for this one; adapt it to a calibration flight: magsim train {self.name} FLIGHT --init RUN"
            )
            raise RequestError(msg)
        return self._fitted

    def state(self) -> State:
        """Return scales, first stage and weights; see ``Compensator.state``."""
        fitted = self._fitted
        stage, inputs = fitted.stage.state(), fitted.columns.state()
        arrays = {f"{STAGE}{name}": array for name, array in stage.arrays.items()}
        arrays |= {f"{INPUTS}{name}": array for name, array in inputs.arrays.items()}
        arrays |= {"input_mean": fitted.standardizer.mean, "input_scale": fitted.standardizer.scale}
        outcomes = {
            name: {"best_step": o.best_step, "best_value": o.best_value, "steps": o.steps}
            for name, o in self.outcomes_.items()
        }
        values = {
            "stage": stage.values,
            "rate_hz": fitted.rate_hz,
            "inputs": inputs.values,
            "names": list(fitted.names),
            "mean_nt": fitted.mean,
            "scale_nt": fitted.scale,
            "weight": fitted.weight,
            "is_start": fitted.is_start,
            "members": len(fitted.module.members) if isinstance(fitted.module, Committee) else None,
            "outcomes": outcomes,
        }
        return State(values, arrays, {name: tensor.numpy() for name, tensor in fitted.module.state_dict().items()})

    def _untrained(self, names: tuple[str, ...], members: int | None) -> nn.Module:
        return (
            self.make_module(names) if members is None else Committee([self.make_module(names) for _ in range(members)])
        )

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned."""
        values, arrays = state.values, state.arrays
        stage = first_stage(self.settings)
        stage.set_state(State(values["stage"], _under(STAGE, arrays)))
        stage.sensor_ = ""
        names = tuple(values["names"])
        standardizer = Standardizer(arrays["input_mean"], arrays["input_scale"])
        if standardizer.mean.shape != (len(names),) or standardizer.scale.shape != (len(names),):
            msg = f"input scales of shape {standardizer.mean.shape} for {len(names)} inputs"
            raise ValueError(msg)
        with seeded(0):
            module = self._untrained(names, values["members"])
        if self.settings.optimizer == "lm":
            module.double()
        load_weights(module, state.weights)
        columns = inputs_from(self.settings, State(values["inputs"], _under(INPUTS, arrays)))
        if columns.count != len(names):
            msg = f"{columns.count} input columns for {len(names)} names"
            raise ValueError(msg)
        mean, scale, weight = float(values["mean_nt"]), float(values["scale_nt"]), float(values["weight"])
        rate_hz, is_start = float(values["rate_hz"]), bool(values["is_start"])
        self._fitted = Fitted(
            self.settings, stage, columns, names, standardizer, mean, scale, module, rate_hz, weight, is_start
        )
        self.outcomes_ = {name: Outcome(**kept, history=()) for name, kept in values["outcomes"].items()}


def _under(prefix: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the arrays whose names begin with a prefix, without it."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def load_weights(module: nn.Module, weights: Mapping[str, np.ndarray]) -> None:
    """Set the parameters of a network.

    Raises
    ------
    ValueError
        If names or shapes are not those of the network.
    """
    put_weights(module, {name: torch.from_numpy(array.copy()) for name, array in weights.items()})
    module.eval()
