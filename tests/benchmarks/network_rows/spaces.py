"""What is searched for the ``default`` preset of each network: a range for each parameter, everything else as it is."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from magsim.streams import stream


@dataclass(frozen=True)
class OneOf:
    """Some values, each as likely."""

    values: tuple[Any, ...]

    def draw(self, rng: np.random.Generator) -> Any:
        """Return one of them."""
        return self.values[int(rng.integers(len(self.values)))]


@dataclass(frozen=True)
class LogUniform:
    """A range of positive numbers, of which the logarithm is uniform; drawn to three digits."""

    low: float
    high: float

    def draw(self, rng: np.random.Generator) -> float:
        """Return a number of the range."""
        return float(f"{np.exp(rng.uniform(np.log(self.low), np.log(self.high))):.2e}")


Space = Mapping[str, OneOf | LogUniform]

_RATE = LogUniform(1e-3, 3e-2)
_HIDDEN = OneOf(([8], [16], [32], [16, 16], [32, 32], [64, 32]))
_BAND = OneOf((0.0, 1.0, 10.0))
_COLUMNS = OneOf((["tl16"], ["tl16", "attitude"]))
_BATCH = OneOf((8, 16, 32))
_SHORT, _LONG = OneOf((200, 400, 800)), OneOf((1000, 2000, 4000))

_ADAM: Space = {"learning_rate": _RATE, "batch": _BATCH, "steps": _LONG, "band_weight": _BAND, "inputs": _COLUMNS}
_RECURRENT: Space = {
    "learning_rate": _RATE,
    "batch": _BATCH,
    "steps": _SHORT,
    "inputs": _COLUMNS,
    "hidden": OneOf((8, 16, 32)),
    "layers": OneOf((1, 2)),
    "taps": OneOf((10, 20, 40)),
}
_DENSE = OneOf(([16], [32], [32, 16]))

SPACES: Mapping[str, Space] = {
    "bp": {**_ADAM, "hidden": _HIDDEN, "activation": OneOf(("tanh", "gelu", "relu"))},
    "bpnn": {
        "learning_rate": _RATE,
        "batch": OneOf((64, 128, 256)),
        "steps": _LONG,
        "inputs": _COLUMNS,
        "hidden": _HIDDEN,
        "activation": OneOf(("tanh", "gelu", "relu")),
        "window": OneOf((10, 20, 40, 80)),
    },
    "williams": {**_ADAM, "hidden": OneOf((8, 16, 32)), "taps": OneOf((1, 3, 9))},
    "resnet": {
        **_ADAM,
        "steps": OneOf((300, 600, 1000)),
        "width": OneOf((8, 16)),
        "blocks": OneOf((2, 3, 4)),
        "kernel": OneOf((3, 5, 9)),
        "normalize": OneOf((True, False)),
    },
    "magtcn": {
        **_ADAM,
        "steps": OneOf((500, 1000, 1500)),
        "width": OneOf((4, 8)),
        "kernel": OneOf((11, 25, 51)),
        "expansion": OneOf((1, 2)),
    },
    "res_bp": {**_ADAM, "width": OneOf((16, 32, 64)), "layers": OneOf((1, 2, 3))},
    "subnetworks": {
        "taps": OneOf((1, 2, 3, 5)),
        "steps": OneOf((50, 100, 200, 400)),
        "optimizer": OneOf(("adam", "lm")),
    },
    "lstm_bp": {**_RECURRENT, "dense": _DENSE},
    "gru_bp": {**_RECURRENT, "dense": _DENSE},
    "lstm": _RECURRENT,
    "pg_tlnet": {**_ADAM, "hidden": _HIDDEN, "nonlinear": OneOf(("residual", "coefficients"))},
    "ga_bp": {
        "learning_rate": _RATE,
        "batch": _BATCH,
        "steps": _LONG,
        "band_weight": _BAND,
        "hidden": OneOf(([8], [16], [32])),
    },
    "wavelet_bilstm": {
        "learning_rate": _RATE,
        "batch": _BATCH,
        "steps": _SHORT,
        "inputs": _COLUMNS,
        "hidden": OneOf((8, 12, 24)),
        "levels": OneOf((2, 4, 5)),
    },
}
"""By method. Sizes are such that most points stay below the time limit of a fit on one core."""


def trial(method: str, number: int, seed: int) -> dict[str, Any]:
    """Return the parameters of a trial; trial 0 is the preset as it is.

    Each parameter is drawn from a stream of its own name: one more of them changes none of the others.
    """
    if number == 0:
        return {}
    return {
        key: values.draw(stream(seed, f"networks/tuning/{method}/{number}/{key}"))
        for key, values in SPACES[method].items()
    }
