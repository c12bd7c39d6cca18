"""Paper 004 as it is re-run: Table 6, what the nets of the field find, the claims."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from magsim.papers.claims import Claim, claims_table, ratios
from magsim.papers.paper import Paper, Results, values_of
from magsim.papers.paper_004.published import TABLE_6
from magsim.papers.paper_004.work import FIELD_NETS, METHODS, flights, tasks, work
from magsim.papers.tables import BESIDE, Cell, Column, Line, PaperTable, counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPERS = ("least_squares", "aircraft", "all_nets")
"""The methods of the paper, as its Table 6 has them."""

NAMES: Mapping[str, str] = {
    "least_squares": "LS",
    "aircraft": "Z3-Z5",
    "all_nets": "all",
    "least_squares_broad": "LS, label unfiltered",
    "default": "Z3-Z5, our default",
    **BESIDE,
}
"""Of each method in the tables."""

COLUMNS = (
    Column("raw other", "raw", "nT"),
    Column("left other", "STD", "nT"),
    Column("left learned", "STD, learned circuit", "nT"),
    Column("left_reading other", "STD, aircraft alone", "nT"),
    Column("error other", "STD, truth", "nT"),
    Column("ir", "IR in band, truth", "", 2),
)

REMARKS: Mapping[str, str] = {
    "UAV2, LS": "fitted on the reading in band, which needs no truth; how the paper fits is not printed",
    "UAV2, Z3-Z5": "100 steps of Levenberg-Marquardt (estimate: how long the paper trains is not printed)",
    "UAV2, all": "the paper takes off what all nets explain. Of the same nets, those of the aircraft alone leave more "
    "than least squares (STD, aircraft alone): the nets of the field have learned a part of the aircraft",
    "UAV3, all": "no better than Z3-Z5, as in the paper: there is no field to find",
    "SCSS1, LS": "the paper's is an eighth of the raw data, more than 16 columns leave of any part of this aircraft; "
    "its filter and its solver are not printed",
    "SCSS2, LS": "as SCSS1: the paper's is more than a third of the raw data",
}
NOTES = (
    (
        "STD of circuit 2, learned on circuit 1, unfiltered, without mean, of the reading less the change of the model "
        "field along the flight. The paper's landing page does not say what its STD is of, nor which rows it learns "
        "and judges: the learned circuit stands beside. Under all, what the nets of the field explain is taken off; "
        "STD, aircraft alone subtracts Z3 to Z5 of the same nets and no more."
    ),
    (
        "Raw levels are met by individuals of the two types, chosen among some tens by that alone; that SCSS flew a "
        "manned aircraft is a guess. SCSS2 is the nearest that the middle of a Cessna's cabin came."
    ),
)


def _values(results: Results, figure: str, code: str, method: str) -> tuple[float, ...]:
    return values_of(results, figure, "judge", experiment=code, method=method)


def _over(results: Results) -> str:
    count = len(_values(results, "ir", "UAV2", "noise_floor"))
    return counted(count, "flights of each experiment")


def table_6(results: Results) -> PaperTable:
    """Return Table 6, and below it the methods that are not the paper's."""
    lines = []
    for added in (False, True):
        for code, printed in TABLE_6.items():
            for method in METHODS:
                if (method not in PAPERS) != added:
                    continue
                name = f"{code}, {NAMES[method]}"
                published = {} if added else {"raw other": printed.raw, "left other": getattr(printed, method)}
                cells = {
                    column.key: Cell(published.get(column.key), _values(results, column.key, code, method))
                    for column in COLUMNS
                }
                lines.append(Line(name, cells, REMARKS.get(name, ""), added=added))
    title = "Table 6: standard deviation of compensation"
    return PaperTable("table_6", title, COLUMNS, tuple(lines), _over(results), NOTES)


def field_share(results: Results) -> PaperTable:
    """Return what the nets of the field make of it in ``all``, beside the field that there is."""
    columns = (
        Column("field_found other", "Z1 + Z2 + Z6", "nT"),
        Column("field other", "field", "nT"),
        Column("field_missed other", "field less Z1 + Z2 + Z6", "nT"),
        *(Column(f"{net} other", net, "nT") for net in FIELD_NETS),
    )
    lines = []
    for code, printed in TABLE_6.items():
        cells = {
            column.key: Cell(
                printed.field_nt if column.key == "field_found other" else None,
                _values(results, column.key, code, "all_nets"),
            )
            for column in columns
        }
        lines.append(Line(code, cells, SHARE_REMARKS.get(code, "")))
    note = (
        "STD of circuit 2. The paper's share is derived: the root of the difference of squares of its STD with Z3 to "
        "Z5 and with all. Field is the true one less its model."
    )
    title = "The field's share of all"
    return PaperTable("field_share", title, columns, tuple(lines), _over(results), (note,))


SHARE_REMARKS: Mapping[str, str] = {
    "UAV3": "there is no field to find here. Z6 reads the changes of latitude and longitude, which tell the heading, "
    "and most of what the aircraft does to the reading goes by heading",
}


def _better(results: Results, code: str, first: str, second: str) -> tuple[float, ...]:
    """Return how many times more the second leaves than the first, flight by flight."""
    return ratios(*(_values(results, "left other", code, method) for method in (second, first)))


def claims(results: Results) -> PaperTable:
    """Return the order of Table 6, and what becomes of it where the nets of the field are not taken off."""
    found = []
    for first, second in (("aircraft", "least_squares"), ("all_nets", "aircraft")):
        for code, printed in TABLE_6.items():
            ratio = getattr(printed, second) / getattr(printed, first)
            name = f"{code}: {NAMES[first]} over {NAMES[second]}"
            found.append(Claim(name, _better(results, code, first, second), ratio))
    for code in TABLE_6:
        errors = (_values(results, "error other", code, method) for method in ("least_squares", "all_nets"))
        found.append(Claim(f"{code}: all over LS, truth", ratios(*errors), added=True))
    note = "STD with the second over STD with the first; truth: error of what is subtracted as the aircraft's."
    return claims_table(found, _over(results), (note,))


def _mean_ratio(rows: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    """Return the geometric mean over the experiments, flight by flight."""
    return tuple(math.exp(sum(map(math.log, flight)) / len(flight)) for flight in zip(*rows, strict=True))


def headlines(results: Results) -> dict[str, Cell]:
    """Return ratios that the paper stands for, geometric means over its four experiments."""
    out = {}
    for name, first, second in (
        ("z345_over_ls", "aircraft", "least_squares"),
        ("all_over_z345", "all_nets", "aircraft"),
    ):
        printed = [(getattr(one, second) / getattr(one, first),) for one in TABLE_6.values()]
        ours = [_better(results, code, first, second) for code in TABLE_6]
        out[name] = Cell(_mean_ratio(printed)[0], _mean_ratio(ours))
    return out


def tables(results: Results) -> list[PaperTable]:
    """Return Table 6, the field's share, and the claims."""
    return [table_6(results), field_share(results), claims(results)]


def figures(results: Results) -> Mapping[str, "Figure"]:
    """Return Table 6 as a picture."""
    from magsim.plots.spread import Series, spread

    series = []
    for method in PAPERS:
        values = [_values(results, "left other", code, method) for code in TABLE_6]
        published = {k: getattr(printed, method) for k, printed in enumerate(TABLE_6.values())}
        series.append(Series(NAMES[method], values, published))
    values = [_values(results, "left_reading other", code, "all_nets") for code in TABLE_6]
    series.append(Series("all, aircraft alone", values))
    return {"table_6": spread([*TABLE_6], series, "STD [nT]", logarithmic=True)}


PAPER = Paper(
    "004",
    "Sub-networks for the parts of the field",
    "L. Liu, Q. Xu, H. Gu, L. Zhou, Z. Liu and L. Cao: Aeromagnetic Compensation Algorithm Based on Levenberg-Marquard "
    "Neural Network, J. Geod. Geoinf. Sci. 2021, 4(4), 74-83",
    flights,
    tasks,
    work,
    headlines,
    tables,
    figures,
)
