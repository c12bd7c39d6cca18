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

_COLUMNS = OneOf((["tl16"], ["tl16", "attitude"]))
_BAND = OneOf((0.0, 1.0, 10.0))
_ACTIVATION = OneOf(("tanh", "gelu", "relu"))
_HIDDEN = OneOf(([8], [16], [32], [16, 16], [32, 32]))
_UNITS = OneOf((8, 16, 32))
_TAPS = OneOf((1, 3, 9))

_ADAM: Space = {
    "optimizer": OneOf(("adam",)),
    "learning_rate": LogUniform(1e-3, 3e-2),
    "batch": OneOf((4, 8, 16)),
    "steps": OneOf((200, 400, 800, 1600)),
    "every": OneOf((50,)),
    "band_weight": _BAND,
    "inputs": _COLUMNS,
}
_LM: Space = {
    "optimizer": OneOf(("lm",)),
    "steps": OneOf((15, 30, 60)),
    "every": OneOf((1,)),
    "band_weight": _BAND,
    "inputs": _COLUMNS,
}
_RECURRENT: Space = {
    **{key: values for key, values in _ADAM.items() if key != "band_weight"},
    "batch": OneOf((8, 16, 32)),
    "steps": OneOf((100, 200, 400)),
    "hidden": _UNITS,
    "layers": OneOf((1, 2)),
    "taps": OneOf((10, 20, 40)),
    "stage_band": OneOf(("in", "broad")),
}
_RECURRENT_LM: Space = {
    **_LM,
    "steps": OneOf((10, 20)),
    "hidden": OneOf((2, 3, 4)),
    "taps": OneOf((5, 8)),
    "stage_band": OneOf(("in", "broad")),
}
_DENSE = OneOf(([16], [32], [32, 16]))
_FEW = OneOf(([], [4]))
_BPNN: Space = {"hidden": OneOf(([4], [8], [16])), "activation": _ACTIVATION, "window": OneOf((5, 10, 20, 40))}


def _both(own: Space) -> tuple[Space, ...]:
    """Return a space of a network that either optimizer takes."""
    return {**_ADAM, **own}, {**_LM, **own}


SPACES: Mapping[str, tuple[Space, ...]] = {
    "bp": _both({"hidden": _HIDDEN, "activation": _ACTIVATION}),
    "bpnn": (
        {**_ADAM, **_BPNN, "band_weight": OneOf((0.0,)), "batch": OneOf((64, 128, 256))},
        {**_LM, **_BPNN},
    ),
    "williams": _both({"hidden": _UNITS, "taps": _TAPS}),
    "resnet": (
        {
            **_ADAM,
            "width": OneOf((8, 16)),
            "blocks": OneOf((2, 3, 4)),
            "kernel": OneOf((3, 5, 9)),
            "normalize": OneOf((True, False)),
        },
    ),
    "magtcn": ({**_ADAM, "width": OneOf((4, 8)), "kernel": OneOf((11, 25, 51)), "expansion": OneOf((1, 2))},),
    "res_bp": _both({"width": OneOf((8, 16, 32)), "layers": OneOf((1, 2, 3))}),
    "subnetworks": _both({"inputs": OneOf((["tl16"], ["tl18"])), "taps": OneOf((1, 2, 3, 5))}),
    "lstm_bp": ({**_RECURRENT, "dense": _DENSE}, {**_RECURRENT_LM, "dense": _FEW}),
    "gru_bp": ({**_RECURRENT, "dense": _DENSE}, {**_RECURRENT_LM, "dense": _FEW}),
    "lstm": (_RECURRENT, _RECURRENT_LM),
    "pg_tlnet": _both({"hidden": _HIDDEN, "nonlinear": OneOf(("residual", "coefficients"))}),
    "ga_bp": _both({"inputs": OneOf((["tl18", "attitude", "coupled"],)), "hidden": OneOf(([8], [16], [32]))}),
    "wavelet_bilstm": (
        {
            **{key: values for key, values in _RECURRENT.items() if key not in ("taps", "layers")},
            "levels": OneOf((2, 4, 5)),
        },
    ),
}
"""By method; of several spaces each is searched in its turn. Sizes are such that most points stay below the time
limit of a fit on one core."""


def trial(method: str, number: int, seed: int) -> dict[str, Any]:
    """Return the parameters of a trial; trial 0 is the preset as it is.

    Each parameter is drawn from a stream of its own name: one more of them changes none of the others.
    """
    if number == 0:
        return {}
    spaces = SPACES[method]
    return {
        key: values.draw(stream(seed, f"networks/tuning/{method}/{number}/{key}"))
        for key, values in spaces[number % len(spaces)].items()
    }
