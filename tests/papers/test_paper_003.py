"""Paper 003 by its fastest run; its worlds, scores and claims against what is computed by hand."""

import numpy as np
import pytest

from magsim.papers import Effort, Task, run_paper
from magsim.papers.paper_003 import worlds
from magsim.papers.paper_003.candidates import TAPS, network_name
from magsim.papers.paper_003.claims import claims, claims_of_table_2, headlines
from magsim.papers.paper_003.published import BEST, CHOSEN, TABLE_2
from magsim.papers.paper_003.work import FULL, scores, tasks
from magsim.recording import Recording
from tests.support.papers_again import require_same_tables
from tests.support.papers_page import require_on_page

TABLE_1 = {"LSTM-BP": (19.68, 14.33), "BP": (12.69, 2.80), "LSTM": (10.83, 8.81)}
GRID = {
    "1 tanh / 1 tanh": 14.116, "1 tanh / 1 relu": 12.200, "1 sigmoid / 1 tanh": 5.496, "1 sigmoid / 1 relu": 3.943,
    "1 tanh / 2 tanh": 24.868, "1 tanh / 2 relu": 5.226, "1 sigmoid / 2 tanh": 7.909, "1 sigmoid / 2 relu": 4.310,
    "2 tanh / 1 tanh": 10.832, "2 tanh / 1 relu": 14.194, "2 sigmoid / 1 tanh": 7.422, "2 sigmoid / 1 relu": 9.665,
    "2 tanh / 2 relu": 16.667, "2 tanh / 2 tanh": 25.879, "2 sigmoid / 2 relu": 5.549, "2 sigmoid / 2 tanh": 6.166,
}  # fmt: skip
TABLE_3 = {
    "LSTM-BP": (11968.55, 478.44, 1056.53, 34.27, 25.02),
    "GRU-BP": (19718.07, 1484.378, 1729.11, 100.317, 13.28),
    "LSTM": (19718.07, 2122.51, 1568.27, 127.515, 9.29),
    "BP": (15843.31, 4632.54, 1391.39, 410.11, 3.42),
}
"""Tables 1 to 3 as the paper prints them: static, dynamic; ratio; peak to peak and STD before and after, ratio."""

RATIOS = {
    "static: LSTM-BP > BP": 19.68 / 12.69, "static: BP > LSTM": 12.69 / 10.83,
    "dynamic: LSTM-BP > LSTM": 14.33 / 8.81, "dynamic: LSTM > BP": 8.81 / 2.80,
    "drawn: LSTM-BP > GRU-BP": 25.02 / 13.28, "drawn: GRU-BP > LSTM": 13.28 / 9.29,
    "drawn: LSTM > BP": 9.29 / 3.42, "drawn: LSTM-BP > BP": 25.02 / 3.42,
}  # fmt: skip

ROWS, RATE_HZ = 2000, 10.0
COLUMNS_3 = ("pp before", "pp after", "std before", "std after", "ir pp")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("003")


@pytest.fixture(scope="module")
def run(folder):
    return run_paper("003", folder, Effort(quick=True, seeds=1))


def table_of(run, key):
    (found,) = (table for table in run.tables if table.key == key)
    return found


def published(table, *columns):
    lines = {line.name: tuple(line.cells[c].published for c in columns if c in line.cells) for line in table.lines}
    return {name: figures for name, figures in lines.items() if any(figure is not None for figure in figures)}


@pytest.mark.heavy
def test_published_figures_are_those_of_the_paper(run):
    assert published(table_of(run, "table_1"), "static", "dynamic") == TABLE_1
    assert published(table_of(run, "table_2"), "ir pp") == {name: (figure,) for name, figure in GRID.items()}
    assert published(table_of(run, "table_3"), *COLUMNS_3) == TABLE_3
    assert not published(table_of(run, "table_3_physical"), *COLUMNS_3)
    found = published(table_of(run, "claims"), "ratio")
    assert found == {name: (pytest.approx(ratio, rel=1e-12),) for name, ratio in RATIOS.items()}
    ranks = {"2 tanh / 2 tanh, the best": (1.0,), "1 tanh / 2 tanh, the paper's choice": (2.0,)}
    assert published(table_of(run, "claims_table_2"), "rank") == ranks


@pytest.mark.heavy
def test_the_page_has_them(run):
    require_on_page("003", run)


@pytest.mark.heavy
def test_all_methods_have_one_test_segment_and_the_printed_level(run):
    for key in ("table_3", "table_3_physical"):
        table = table_of(run, key)
        assert len({line.cells["pp before"].found for line in table.lines}) == 1
        floor = table.cell("noise floor", "std after").median
        assert all(floor <= line.cells["std after"].median for line in table.lines)
    # within what the test rows before the first output can hold
    assert 0.9 * 11968.55 <= table_of(run, "table_3").cell("BP", "pp before").median <= 19718.07
    assert table_of(run, "table_2").cell("1 tanh / 2 tanh", "ir pp").found == (
        table_of(run, "table_3").cell("LSTM-BP", "ir pp").found
    )
    assert {path.name for path in run.files} >= {"table_1.csv", "table_2.png", "figure_9.png", "tables.json"}


@pytest.mark.heavy
def test_work_that_is_done_again_gives_the_same_tables(run, folder):
    require_same_tables("003", folder, every=12)


def path_of(seed=5):
    """A flight without an aircraft's field: a direction that swings, a strength that drifts, white noise."""
    random = np.random.default_rng(seed)
    time_s = np.arange(ROWS) / RATE_HZ
    angles = [0.3 * np.sin(2.0 * np.pi * f * time_s + p) for f, p in ((0.11, 0.0), (0.17, 1.0), (0.013, 2.0))]
    x, y, z = np.cos(angles[0] + 3.0 * angles[2]), np.sin(angles[1]) + 0.4, 1.0 + angles[2] * angles[0]
    strength = 50_000.0 + 5.0 * np.sin(time_s / 90.0)
    field = strength[:, None] * np.column_stack([x, y, z]) / np.sqrt(x**2 + y**2 + z**2)[:, None]
    noise = 0.01 * random.standard_normal(ROWS)
    data = {f"earth_boom_{axis}_nt": field[:, k] for k, axis in enumerate("xyz")}
    data |= {"clean_boom_nt": strength, "total_boom_nt": strength, "mag_boom_nt": strength + noise}
    data |= {"interference_boom_nt": np.zeros(ROWS), "projection_boom_nt": np.zeros(ROWS), "error_boom_nt": noise}
    return worlds.split_by_time(Recording("path", time_s, data))


def terms_of(path):
    """Columns of the paper's eq. 2 to 5 for the mean strength: 3 permanent, 6 induced, 9 of eddy currents."""
    field = np.column_stack([path[f"earth_boom_{axis}_nt"] for axis in "xyz"])
    strength = np.linalg.norm(field, axis=1)
    u = field / strength[:, None]
    rates = np.array([np.gradient(u[:, k], 1.0 / RATE_HZ) for k in range(3)]).T
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    induced = np.column_stack([strength.mean() * u[:, i] * u[:, j] for i, j in pairs])
    eddy = np.column_stack([strength.mean() * u[:, i] * rates[:, j] for i in range(3) for j in range(3)])
    return u, induced, eddy


def test_the_last_fifth_is_the_test_and_a_fifth_before_tells_when_to_stop():
    split = path_of()["split"]
    assert (split[:1280] == 0.0).all()
    assert (split[1280:1600] == 1.0).all()
    assert (split[1600:] == 2.0).all()


def test_what_is_drawn_is_the_papers_equations():
    path = path_of()
    u, induced, eddy = terms_of(path)
    for world, columns in (
        ("drawn", np.column_stack([u, induced, eddy])),
        ("static", np.column_stack([u, induced])),
        ("dynamic", eddy),
    ):
        flight = worlds.drawn(path, 7, world)
        found = flight["interference_boom_nt"]
        scale = np.linalg.norm(columns, axis=0)
        coefficients = np.linalg.lstsq(columns / scale, found, rcond=1e-13)[0]
        np.testing.assert_allclose(columns / scale @ coefficients, found, rtol=0, atol=1e-6)
        assert 11968.55 <= np.ptp(found[1600:]) <= 19718.07
    # the parts that do not turn with the rates are no answer to the world of rates
    still = np.column_stack([u, induced])
    left = found - still @ np.linalg.lstsq(still, found, rcond=None)[0]
    assert left.std() > 0.5 * found.std()


def test_parts_of_what_is_drawn_are_equally_strong():
    path = path_of()
    u, induced, eddy = terms_of(path)
    found = worlds.drawn_interference(path, 7, "drawn")
    groups = [u, induced, eddy]
    solution = np.linalg.lstsq(np.column_stack(groups), found, rcond=1e-13)[0]
    parts = np.split(solution, [3, 9])
    spread = [(group @ part).std() for group, part in zip(groups, parts, strict=True)]
    np.testing.assert_allclose(spread, spread[0], rtol=1e-6)


def test_reading_labels_and_truth_of_a_drawn_flight_agree():
    path = path_of()
    flight, other = (worlds.drawn(path, seed, "drawn") for seed in (1, 2))
    assert flight == worlds.drawn(path, 1, "drawn")
    assert np.ptp(flight["interference_boom_nt"] - other["interference_boom_nt"]) > 1000.0
    total = flight["clean_boom_nt"] + flight["interference_boom_nt"]
    np.testing.assert_array_equal(flight["total_boom_nt"], total)
    np.testing.assert_allclose(flight["mag_boom_nt"], total + flight["error_boom_nt"], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(flight["projection_boom_nt"], flight["interference_boom_nt"])
    assert "earth_boom_x_nt" not in flight


def test_scores_are_the_papers_of_the_error_against_truth():
    flight = worlds.drawn(path_of(), 1, "drawn")
    found = scores(None, flight)
    first = 1600 + TAPS - 1
    before, noise = (flight["mag_boom_nt"] - flight["clean_boom_nt"])[first:], flight["error_boom_nt"][first:]
    assert found["pp before"] == pytest.approx(before.max() - before.min(), rel=1e-12)
    assert found["std before"] == pytest.approx(np.sqrt(np.mean((before - before.mean()) ** 2)), rel=1e-12)
    assert found["pp after"] == pytest.approx(noise.max() - noise.min(), abs=1e-9)
    assert found["std after"] == pytest.approx(noise.std(), abs=1e-9)
    assert found["ir pp"] == pytest.approx(found["pp before"] / found["pp after"], rel=1e-12)
    assert found["ir band"] > 1e4


def result(world, line, number, ratio):
    return Task("judge", ("a",), {"world": world, "line": line}, seed=number), {"ir pp": ratio}


def test_claims_about_the_grid_are_ranks():
    """In one flight as printed, in another with the two best exchanged, in a third upside down."""
    lines = {network_name(network): value for network, value in TABLE_2.items()}
    best, chosen = network_name(BEST), network_name(CHOSEN)
    exchanged = {**lines, best: lines[chosen], chosen: lines[best]}
    flights = [lines, exchanged, {name: 1.0 / value for name, value in lines.items()}]
    results = [
        result("drawn", name, number, value) for number, flight in enumerate(flights) for name, value in flight.items()
    ]
    table = claims_of_table_2(results)
    assert table.cell("2 tanh / 2 tanh, the best", "rank").found == (1.0, 2.0, 16.0)
    assert table.cell("1 tanh / 2 tanh, the paper's choice", "rank").found == (2.0, 1.0, 15.0)
    assert table.cell("2 tanh / 2 tanh, the best", "best").found == (pytest.approx(100.0 / 3.0),)
    # once or more in three throws of a die with 16 sides
    assert table.cell("2 tanh / 2 tanh, the best", "p").found == (pytest.approx(1.0 - (15.0 / 16.0) ** 3),)
    # one of 120 pairs is turned round
    assert table.cell("order of all 16 cells", "tau").found == pytest.approx((1.0, 118.0 / 120.0, -1.0))


def models(values):
    """Results of Table 3's models in every world."""
    return [
        result(world, line, number, ratio)
        for world in ("drawn", "physical", "static", "dynamic")
        for line, ratios in values.items()
        for number, ratio in enumerate(ratios)
    ]


def test_claims_about_models_are_ratios_flight_by_flight():
    values = {"LSTM-BP": (8.0, 9.0), "GRU-BP": (4.0, 18.0), "LSTM": (2.0, 3.0), "BP": (1.0, 6.0)}
    table = claims(models(values))
    assert table.cell("drawn: LSTM-BP > GRU-BP", "ratio").found == (2.0, 0.5)
    assert table.cell("drawn: LSTM-BP > GRU-BP", "share").found == (50.0,)
    assert table.cell("dynamic: LSTM > BP", "ratio").found == (2.0, 0.5)
    assert table.cell("physical: LSTM-BP > BP", "p").found == (0.5,)
    assert table.cell("physical: LSTM-BP > BP", "ratio").published is None
    assert [line.name for line in table.lines if line.added] == [
        f"physical: {pair}" for pair in ("LSTM-BP > GRU-BP", "GRU-BP > LSTM", "LSTM > BP", "LSTM-BP > BP")
    ]


def test_headlines_are_those_of_the_claims():
    """Cells as printed but for the best, which is so in one of two flights."""
    values = {"LSTM-BP": (24.0, 24.0), "GRU-BP": (4.0, 18.0), "LSTM": (2.0, 3.0), "BP": (1.0, 6.0)}
    grid = {network_name(network): (ratio, ratio) for network, ratio in TABLE_2.items()} | {network_name(BEST): (30, 5)}
    cells = [result("drawn", name, k, pair[k]) for name, pair in grid.items() for k in (0, 1) if name not in values]
    found = headlines(models(values) + cells)
    assert (found["best_cell_is_2tanh"].published, found["best_cell_is_2tanh"].found) == (1.0, (1.0, 0.0))
    assert found["ratio_lstmbp_over_bp"].found == (24.0, 4.0)
    assert found["ratio_lstmbp_over_bp"].published == pytest.approx(25.02 / 3.42)
    assert found["ratio_lstm_over_bp"].found == (2.0, 0.5)
    # of 120 pairs those of the best with the cells above 5 are turned round
    below = sum(ratio > 5.0 for name, ratio in GRID.items() if name != "2 tanh / 2 tanh")
    assert found["grid_kendall_tau"].found == pytest.approx((1.0, 1.0 - 2.0 * below / 120.0))


def test_the_full_run_trains_as_many_epochs_as_printed():
    full = tasks(Effort())
    assert {task.params["epochs"] for task in full if "epochs" in task.params} == {100.0}
    assert len({task.key for task in full}) == len(full)
    grid = [task for task in full if task.params["world"] == "drawn" and task.params["line"].startswith("LSTM-BP ")]
    assert len({task.params["line"] for task in grid} & {network_name(network) for network in TABLE_2}) == 15
    assert len({task.seed for task in full}) == FULL
