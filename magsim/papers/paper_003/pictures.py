"""Pictures of paper 003: its Figures 4 to 9 from one flight, and its tables over all flights."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from magsim.papers.paper import Results, found_of, values_of
from magsim.papers.paper_003.candidates import PRINTED, network_name
from magsim.papers.paper_003.published import TABLE_1, TABLE_2, TABLE_3
from magsim.plots.spread import Series, curves, spread

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TIME = "time [s]"


def figures(results: Results) -> Mapping[str, "Figure"]:
    """Return all pictures."""
    return {**_of_one_flight(results), **_of_tables(results)}


def _curve(results: Results, line: str) -> Mapping[str, list[float]]:
    (found,) = found_of(results, "judge", world="drawn", line=line, curve=True)
    kept: Mapping[str, list[float]] = found["curve"]
    return kept


def _of_one_flight(results: Results) -> dict[str, "Figure"]:
    """Return Figures 4 to 9: total field; before and after for each model; all models."""
    found = {name: _curve(results, name) for name in PRINTED}
    first = found["LSTM-BP"]
    time_s = first["time_s"]
    out = {"figure_4": curves({"total field": (time_s, first["reading"])}, _TIME, "reading [nT]")}
    for number, name in enumerate(PRINTED, 5):
        lines = {"before": (time_s, first["before"]), f"after {name}": (time_s, found[name]["after"])}
        out[f"figure_{number}"] = curves(lines, _TIME, "interference [nT]")
    after = {name: (time_s, found[name]["after"]) for name in reversed([*PRINTED])}
    out["figure_9"] = curves(after, _TIME, "interference that is left [nT]")
    return out


def _values(results: Results, world: str, lines: Iterable[str]) -> list[tuple[float, ...]]:
    return [values_of(results, "ir pp", "judge", world=world, line=name) for name in lines]


def _of_tables(results: Results) -> dict[str, "Figure"]:
    label = "improvement ratio, peak to peak"
    one = [
        Series(world, _values(results, world, TABLE_1), {k: TABLE_1[name][world] for k, name in enumerate(TABLE_1)})
        for world in ("static", "dynamic")
    ]
    two = [Series("drawn", _values(results, "drawn", map(network_name, TABLE_2)), dict(enumerate(TABLE_2.values())))]
    three = [
        Series(
            "drawn", _values(results, "drawn", TABLE_3), {k: row["ir pp"] for k, row in enumerate(TABLE_3.values())}
        ),
        Series("physical", _values(results, "physical", TABLE_3)),
    ]
    names = [network.name.replace(" / ", "\n") for network in TABLE_2]
    return {
        "table_1": spread([*TABLE_1], one, label, logarithmic=True),
        "table_2": spread(names, two, label, logarithmic=True),
        "table_3": spread([*TABLE_3], three, label, logarithmic=True),
    }
