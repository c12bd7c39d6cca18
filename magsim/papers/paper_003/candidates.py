"""The methods of paper 003 and those beside them: method, preset, and what of the preset is changed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from magsim.papers.paper_003.published import CHOSEN, TABLE_2, Network
from magsim.papers.tables import BESIDE

TAPS = 10
"""Rows that an output is made from, 1 s. The paper does not print its window; the presets' 50 rows cost five times as
much, and what is drawn has no memory."""

EPOCHS = 100.0
"""Training iterations, as the paper prints them, read as passes over all windows of the training rows."""

QUICK_EPOCHS, QUICK_STEPS = 0.05, 10
"""Of the quick run: of what is trained as printed, and steps of the networks' preset ``quick``."""

_WINDOWS = {"window": TAPS, "taps": TAPS}


@dataclass(frozen=True)
class Candidate:
    """A method as it is fitted.

    Attributes
    ----------
    method : str
        In the registry; ``noise_floor`` for the oracle.
    preset : str, optional
    params : mapping
        In which it differs from the preset.
    printed : bool
        Trained as the paper trains: as many epochs as it prints.
    """

    method: str
    preset: str | None = None
    params: Mapping[str, Any] = field(default_factory=dict)
    printed: bool = False


def _recurrent(method: str, **params: Any) -> Candidate:
    return Candidate(method, "paper", {**_WINDOWS, **params}, printed=True)


def network_name(network: Network) -> str:
    """Return the name of the candidate of a cell of Table 2: the paper's choice is its LSTM-BP."""
    return "LSTM-BP" if network == CHOSEN else f"LSTM-BP {network.name}"


def _cell(network: Network) -> Candidate:
    """Return the candidate of a cell of Table 2."""
    return _recurrent(
        "lstm_bp",
        layers=network.lstm_layers,
        activation=network.lstm_activation,
        dense=(64, 32)[: network.dense_layers],
        dense_activation=network.dense_activation,
    )


PRINTED: Mapping[str, Candidate] = {
    "LSTM-BP": _recurrent("lstm_bp"),
    "GRU-BP": _recurrent("gru_bp"),
    "LSTM": _recurrent("lstm"),
    "BP": Candidate("bp", "paper003", printed=True),
}
"""The models of Table 3, in its order."""

GRID: Mapping[str, Candidate] = {
    network_name(network): _cell(network) for network in TABLE_2 if network_name(network) not in PRINTED
}
"""The cells of Table 2 but the paper's choice."""

VARIANTS: Mapping[str, Candidate] = {
    "LSTM-BP on T-L": _recurrent("lstm_bp", first_stage="tl18", stage_band="broad"),
    "LSTM-BP without time": _recurrent("lstm_bp", inputs=("tl16", "angles")),
}
"""Readings of the paper: the network on what Tolles-Lawson leaves, and without the input that a test lies beyond."""

DEFAULTS: Mapping[str, Candidate] = {
    f"{name}, default": Candidate(method, "default")
    for name, method in (("LSTM-BP", "lstm_bp"), ("GRU-BP", "gru_bp"), ("LSTM", "lstm"), ("BP", "bp"))
}

LINEAR: Mapping[str, Candidate] = {
    "tl16": Candidate("tl16"),
    "tl16, broadband": Candidate("tl16", None, {"band": "broad"}),
    "tl18, broadband": Candidate("tl18", None, {"band": "broad"}),
    **{name: Candidate(method) for method, name in BESIDE.items()},
}

CANDIDATES: Mapping[str, Candidate] = {**PRINTED, **GRID, **VARIANTS, **DEFAULTS, **LINEAR}

FEW: tuple[str, ...] = ("tl16, broadband", "tl18, broadband", *BESIDE.values())
"""Of the added ones those that stand below Tables 1 and 2."""
