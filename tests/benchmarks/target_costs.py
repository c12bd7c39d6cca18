"""What it costs to fit without labels: each target beside the label, on flights that no fit has seen.

    python tests/benchmarks/target_costs.py [--json] [--sets FOLDER]

Own flights over one ground with a strong crust and a departure of the main field from its model: a calibration (figure
of merit) at 300 m above ground, another at 3000 m, and two surveys of six lines and three tie lines at 120 m with a
base station. The lines of one cross for target ``crossings``, the other is judged. The map is the total-field anomaly
of that ground on a grid of 100 m at the height of the surveys. With ``--sets`` (a folder that
``tests/benchmarks/physics_rows`` has flown) the medians over the sets of some levels are printed too, fitted on two
flights and judged on a third.

``std`` is that of the error in 0.1 to 0.6 Hz, ``slow`` that of the error unfiltered with its mean removed: what is left
of the heading.
"""

import argparse
import statistics
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import magsim
from magsim.compensation import Compensator, create
from magsim.earth import decimal_year, ecef_from_geodetic, igrf, rot_ne_at
from magsim.field.background.crust import crust_of
from magsim.field.background.departure import departure_of
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.signals import in_band
from tests.benchmarks.physics_rows.sets import sets
from tests.benchmarks.rows import Row, at_most, finish, stated

SCENARIO = "geology_c208b"
COMMON: dict[str, object] = {
    "start.heading_deg": 0.0,
    "field.crust.seed": 7,
    "field.crust.shortest_m": 110.0,
    "field.electronics.enabled": False,
    "field.targets": [],
    "recording.train_circuits": [1],
    "recording.split": "train",
}
SURVEY: dict[str, object] = {
    "kind": "survey",
    "lines": 6,
    "line_m": 3000.0,
    "spacing_m": 500.0,
    "ties": 3,
    "tie_spacing_m": 1200.0,
    "tie_overlap_m": 300.0,
}
LOW_M, HIGH_M, SURVEY_M = 424.0, 3000.0, 244.0
METHODS: dict[str, dict[str, object]] = {
    "label": {"target": "interference"},
    "label_broad": {"target": "interference", "band": "broad"},
    "measured": {"target": "measured"},
    "measured_gradient": {"target": "measured", "order": 1, "vertical": True},
    "model": {"target": "model"},
    "model_broad": {"target": "model", "band": "broad"},
}
GOALS = (("crossings", "slow", "model", 0.6), ("map", "std", "label", 1.1), ("reference", "std", "label", 1.1))
"""Target, score, the target beside it, and the most that their ratio may be, fitted on calibration and survey."""
LEVELS = ("0", "3", "5", "6")
"""Of the sets: nothing in the way, crust and time variation, a bad fluxgate, all at once."""


def fly(pattern: dict[str, object], alt_m: float, seed: int) -> Recording:
    """Fly a pattern over the common ground, all rows for training."""
    return magsim.simulate(SCENARIO, seed=seed, set={"pattern": pattern, "start.alt_m": alt_m, **COMMON})


def write_map(path: Path, height_m: float, flights: Sequence[Recording], step_m: float = 100.0) -> None:
    """Write the anomalies of the common ground at a height, under some flights, as a grid in degrees."""
    loaded = load_scenario(SCENARIO, [f"{key}={value}" for key, value in COMMON.items() if "crust" in key])
    start, crust = loaded.scenario.start, crust_of(loaded.scenario, loaded.ground)
    step = step_m / 111_200.0
    lat, lon = (_around([flight[name] for flight in flights], step) for name in ("ins_lat_deg", "ins_lon_deg"))
    at = [np.radians(v).ravel() for v in np.meshgrid(lat, lon, indexing="ij")]
    height = np.full(len(at[0]), height_m)
    main = igrf(*at, height, decimal_year(start.time_utc))
    place_e = ecef_from_geodetic(*at, height)
    added_e = crust.field_e(place_e) + departure_of(loaded.scenario).expanded(place_e)[0]
    added = np.einsum("nij,nj->ni", rot_ne_at(*at), added_e)
    anomaly = np.linalg.norm(main + added, axis=1) - np.linalg.norm(main, axis=1)
    rows = "\n".join(" ".join(f"{v:.3f}" for v in row) for row in anomaly.reshape(len(lat), len(lon))[::-1])
    head = f"ncols {len(lon)}\nnrows {len(lat)}\nxllcenter {float(lon[0])!r}\nyllcenter {float(lat[0])!r}\n"
    path.write_text(f"{head}cellsize {step!r}\n{rows}\n", encoding="ascii")


def _around(places: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Return the coordinates of a grid that reaches 30 cells beyond some places."""
    low, high = min(p.min() for p in places), max(p.max() for p in places)
    return np.arange(low - 30.0 * step, high + 30.0 * step, step)


def error_of(method: Compensator, flight: Recording) -> tuple[float, float]:
    """Return the in-band STD of the error and its STD unfiltered [nT]."""
    error = flight[f"interference_{method.sensor_}_nt"] - method.interference(flight)
    return float(in_band(error, flight.time_s).std()), float(error.std())


def own_flights() -> list[Row]:
    """Fit every target on the own flights and judge it on the survey that no fit has seen."""
    low, high = fly({"kind": "fom"}, LOW_M, 21), fly({"kind": "fom"}, HIGH_M, 22)
    crossed, judged = fly(SURVEY, SURVEY_M, 23), fly(SURVEY, SURVEY_M, 24)
    rows = []
    interference = judged["interference_cabin_nt"]
    rows.append(stated("raw_std", float(in_band(interference, judged.time_s).std()), "nT"))
    rows.append(stated("raw_slow", float(interference.std()), "nT"))
    with tempfile.TemporaryDirectory() as folder:
        grid, stinger = Path(folder, "map.asc"), Path(folder, "stinger")
        write_map(grid, SURVEY_M, [low, crossed])
        create("tl16", target="model").fit(high, sensor="tail").save(stinger)
        known = {"target": "map", "map": str(grid), "map_height_m": SURVEY_M}
        raw = {"target": "reference", "reference": "tail"}
        more: dict[str, dict[str, object]] = {
            "map": known,
            "map_broad": {**known, "band": "broad"},
            "reference_raw": raw,
            "reference_raw_broad": {**raw, "band": "broad"},
            "reference": {**raw, "reference_model": str(stinger)},
            "reference_broad": {**raw, "reference_model": str(stinger), "band": "broad"},
        }
        fits: dict[str, tuple[list[Recording], dict[str, object]]] = {}
        for name, settings in {**METHODS, **more}.items():
            fits[f"low_{name}"] = ([low], settings)
            if not name.startswith("map"):
                fits[f"high_{name}"] = ([high], settings)
            fits[f"survey_{name}"] = ([low if name.startswith("map") else high, crossed], settings)
        fits["survey_crossings"] = ([high, crossed], {"target": "crossings"})
        for name, (flights, settings) in fits.items():
            std, slow = error_of(create("tl16", **settings).fit(flights, sensor="cabin"), judged)
            rows += [stated(f"{name}_std", std, "nT"), stated(f"{name}_slow", slow, "nT")]
    found = {row.name: row.value for row in rows}
    for name, score, beside, most in GOALS:
        ratio = found[f"survey_{name}_{score}"] / found[f"survey_{beside}_{score}"]
        rows.append(at_most(f"{name}_over_{beside}_{score}", ratio, "1", most))
    return rows


def of_sets(folder: Path) -> list[Row]:
    """Return medians over the sets of some levels."""
    rows = []
    for level in LEVELS:
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in METHODS}
        for train, train2, test in sets(folder, level):
            for name, settings in METHODS.items():
                found[name].append(error_of(create("tl16", **settings).fit([train, train2]), test))
        for name, errors in found.items():
            std, slow = (statistics.median(one) for one in zip(*errors, strict=True))
            rows += [stated(f"level_{level}_{name}_std", std, "nT"), stated(f"level_{level}_{name}_slow", slow, "nT")]
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--sets", type=Path, metavar="FOLDER", help="sets of levels, flown by physics_rows")
    arguments = parser.parse_args()
    rows = own_flights()
    if arguments.sets is not None:
        rows += of_sets(arguments.sets)
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
