"""The ground under a flight: its height in JSBSim, contact, heights in the recording, wrong scenarios."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.loading import load_scenario
from magsim.scenario import Scenario, ground_of
from magsim.simulation import simulate
from magsim.terrain import Flat, Ground
from magsim.units import FT

ScenarioOf = Callable[..., Scenario]
LEG = {"kind": "straight", "leg_m": 8000.0}
HILLS = {"kind": "fractal", "mean_m": 300.0, "relief_m": 400.0, "geoid_m": -20.0}


def test_jsbsim_knows_the_ground(cessna: Aircraft):
    plant = Plant(cessna.facts, PlantSetup(0.3, 0.5, 1000.0, 0.0, 75.0, ground_m=200.0))
    above = plant._fdm.get_property_manager().get_node("position/h-agl-ft").get_double_value
    plant.run(12)
    assert above() * FT == pytest.approx(plant.value("alt") - 200.0, abs=1.0)
    plant.ground(650.0)
    plant.run(12)
    assert above() * FT == pytest.approx(plant.value("alt") - 650.0, abs=1.0)


def test_level_ground_far_below_changes_no_bit(cessna: Aircraft, scenario_of: ScenarioOf):
    plain = fly(scenario_of(LEG), cessna).carrier
    ground = fly(scenario_of(LEG, terrain={"kind": "flat", "height_m": 0.0}), cessna).carrier
    assert plain.attitude.tobytes() == ground.attitude.tobytes()


def test_the_ground_is_touched_at_its_height(cessna: Aircraft, scenario_of: ScenarioOf):
    scenario = scenario_of({"kind": "straight", "leg_m": 6000.0}, start={"alt_m": 420.0}, terrain=HILLS)
    ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    with pytest.raises(DataError, match="touched the ground at t =") as caught:
        fly(scenario, cessna)
    time = float(str(caught.value).split("t = ")[1].split(" s")[0])
    # the same flight high above the hills follows the same path
    high = scenario_of(scenario.pattern.model_dump(), start={"alt_m": 420.0}, terrain=HILLS | {"mean_m": -200.0})
    path = fly(high, cessna).carrier
    rows = path.time_s <= time
    height = ground.height(path.lat_rad[rows], path.lon_rad[rows])
    assert np.all(height[:-60] < path.alt_m[rows][:-60])
    assert abs(height[-1] - path.alt_m[rows][-1]) < 8.0


def test_a_start_under_the_ground(cessna: Aircraft, scenario_of: ScenarioOf):
    scenario = scenario_of(LEG, terrain={"kind": "flat", "height_m": 2990.0, "geoid_m": 15.0})
    with pytest.raises(RequestError, match=r"start.alt_m: 3000 m is not above the ground .* 3005.0 m above"):
        fly(scenario, cessna)


def test_a_flight_below_the_ellipsoid_over_a_deep_basin(cessna: Aircraft, scenario_of: ScenarioOf):
    """The Dead Sea: ground at -430 m, geoid at 20 m."""
    terrain = {"kind": "flat", "height_m": -430.0, "geoid_m": 20.0}
    assert fly(scenario_of(LEG, start={"alt_m": 20.0, "lat_deg": 31.5}, terrain=terrain), cessna).duration_s > 100.0


SCENARIO = """\
schema = 1
seed = 3
aircraft = "c208b"

[start]
lat_deg = 46.5
lon_deg = 8.0
alt_m = 1000.0
speed_mps = 75.0

[terrain]
kind = "grid"
file = "hills.asc"
geoid_m = 50.0

[pattern]
kind = "box"
leg_m = 2000.0

[[sensors.scalar]]
name = "cabin"
mount = "cabin_center"

[sensors.radar]
noise_m = 0.5
noise_relative = 0.0
max_range_m = 640.0
max_tilt_deg = 20.0
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A scenario beside its grid: ground that rises 30 m a hundredth of a degree to the east."""
    columns = 41
    row = " ".join(f"{300 + 30 * k}" for k in range(columns))
    header = f"ncols {columns}\nnrows 41\nxllcenter 7.8\nyllcenter 46.3\ncellsize 0.01\n"
    (tmp_path / "hills.asc").write_text(header + f"{row}\n" * 41)
    (tmp_path / "s.toml").write_text(SCENARIO)
    return tmp_path


def test_heights_above_ground_sea_and_ellipsoid(folder: Path):
    loaded = load_scenario(folder / "s.toml", ["terrain.file=hills.asc", "start.alt_m=1600"])
    recording = simulate(loaded)
    ground = 50.0 + 300.0 + 3000.0 * (recording["true_lon_deg"] - 7.8)
    np.testing.assert_allclose(recording["true_ground_m"], ground, atol=1e-6)
    np.testing.assert_allclose(recording["true_agl_m"], recording["true_alt_m"] - ground, atol=1e-6)
    np.testing.assert_allclose(recording["true_msl_m"], recording["true_alt_m"] - 50.0, atol=1e-9)

    radar, height = recording["radar_alt_m"], recording["true_agl_m"]
    tilt = np.cos(np.radians(recording["true_roll_deg"])) * np.cos(np.radians(recording["true_pitch_deg"]))
    echo = (height <= 640.0) & (tilt >= np.cos(np.radians(20.0)))
    assert 0.1 < echo.mean() < 0.9
    np.testing.assert_array_equal(radar[~echo], -1.0)
    error = (radar - height)[echo]
    assert error.std() == pytest.approx(0.5, rel=0.15)
    assert abs(error.mean()) < 0.15

    # the radar has a stream of its own: the magnetometer reads the same without it
    other = simulate(load_scenario(folder / "s.toml", ["start.alt_m=1600", "sensors.radar.noise_m=9.0"]))
    assert np.array_equal(other["mag_cabin_nt"], recording["mag_cabin_nt"])


def test_the_grid_belongs_to_the_digest(folder: Path):
    first = load_scenario(folder / "s.toml").digest
    assert load_scenario(folder / "s.toml").digest == first
    text = (folder / "hills.asc").read_text()
    (folder / "hills.asc").write_text(text[:-5] + "1501\n")
    assert load_scenario(folder / "s.toml").digest != first


def problems(path: Path, *overrides: str) -> str:
    with pytest.raises(RequestError) as caught:
        load_scenario(path, overrides)
    return str(caught.value)


def test_wrong_grids_are_reported_with_the_line_of_the_scenario(folder: Path):
    (folder / "bad.asc").write_text("ncols 2\nnrows 2\nxllcenter 7\nyllcenter 46\ncellsize 1\n1 2\n3 x\n")
    text = problems(folder / "s.toml", "terrain.file=bad.asc")
    assert text.startswith("--set terrain.file: ")
    assert text.endswith("bad.asc:7: value 2: 'x' is not a number")
    (folder / "hills.asc").unlink()
    assert "s.toml:13: terrain.file: " in problems(folder / "s.toml")
    assert "there is no such file" in problems(folder / "s.toml")


def test_a_flight_that_leaves_its_grid(folder: Path):
    loaded = load_scenario(folder / "s.toml", ["pattern.leg_m=30000", "start.alt_m=1900", "start.lat_deg=46.66"])
    with pytest.raises(DataError, match="leaves the terrain grid at latitude"):
        fly(loaded.scenario, loaded.aircraft, ground=loaded.ground)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("terrain.kind=hilly", "terrain.kind"),
        ("terrain.geoid_m=500", "500 is not allowed"),
        ('terrain={kind="fractal", longest_m=1000.0, shortest_m=1000.0}', "is not below longest_m = 1000"),
        ('terrain={kind="fractal", relief_m=-1.0}', "relief_m"),
        ('terrain={kind="fractal", hurst=9.0}', "hurst"),
        ('terrain={kind="flat", height_m=1e9}', "height_m"),
        ('terrain={kind="grid"}', "file"),
        ("sensors.radar.max_range_m=-5", "max_range_m"),
        ("sensors.radar.max_tilt_deg=91", "max_tilt_deg"),
    ],
)
def test_wrong_settings(folder: Path, override: str, message: str):
    assert message in problems(folder / "s.toml", override)


def test_a_radar_needs_the_ground(folder: Path):
    text = SCENARIO.replace('[terrain]\nkind = "grid"\nfile = "hills.asc"\ngeoid_m = 50.0\n', "")
    (folder / "s.toml").write_text(text)
    assert "s.toml:20: sensors.radar: a radar altimeter needs the ground" in problems(folder / "s.toml")


def test_a_grid_needs_its_file(cessna: Aircraft, scenario_of: ScenarioOf):
    with pytest.raises(RequestError, match="can be read only where the scenario is a file"):
        fly(scenario_of(LEG, terrain={"kind": "grid", "file": "a.asc"}), cessna)


def test_ground_is_level_only_where_it_is():
    assert Ground(Flat(3.0)).level
