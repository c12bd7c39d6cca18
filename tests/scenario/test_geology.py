"""Geology from the scenario file to the recording: what is refused, what a file holds, what a base station is for."""

import numpy as np
import pytest

from magsim import columns
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.signals import band_pass
from magsim.simulation import simulate
from tests.support.paths import ROOT

SHORT = ("pattern.lines=1", "pattern.ties=0", "pattern.line_m=4000.0", "recording.train_circuits=[1]")


@pytest.fixture(scope="module")
def line() -> Recording:
    return simulate(load_scenario("geology_c208b", SHORT))


def vector(recording: Recording, component: str) -> np.ndarray:
    return np.column_stack([recording[f"{component}_tail_{axis}_nt"] for axis in columns.AXES])


def test_the_background_is_the_sum_of_its_parts(line):
    on = columns.components_of(line.data, "tail")
    assert set(columns.BACKGROUND) - set(on) == {"swell"}
    field = sum(vector(line, part) for part in columns.BACKGROUND if part in on)
    # The norm of filtered parts against the filtered norm: attitude moves the parts within the filter's length.
    np.testing.assert_allclose(np.linalg.norm(field, axis=1), line["clean_tail_nt"], rtol=0, atol=0.05)
    for part, size in (("crust", 10.0), ("target", 30.0), ("variation", 0.5)):
        assert np.ptp(np.linalg.norm(vector(line, part), axis=1)) > size


def test_there_is_geology_in_the_band(line):
    without = np.linalg.norm(sum(vector(line, part) for part in ("earth", "variation")), axis=1)
    crust = np.linalg.norm(sum(vector(line, part) for part in ("earth", "crust", "variation")), axis=1) - without
    assert band_pass(crust, 10.0)[50:-50].std() > 0.05


def test_the_dike_is_where_it_was_put(line):
    """Its field is strongest over its middle: from the start 2 km along the line."""
    north, east = 1900.0, 1100.0
    strength = np.linalg.norm(vector(line, "target"), axis=1)
    at = int(strength.argmax())
    lat, lon = np.radians(52.2), np.radians(9.8)
    moved = (
        (np.radians(line["true_lat_deg"][at]) - lat) * 6.377e6,
        (np.radians(line["true_lon_deg"][at]) - lon) * 6.391e6 * np.cos(lat),
    )
    # Distance from the dike's line, which passes its center on 110 degrees.
    heading = np.radians(110.0)
    across = -(moved[0] - north) * np.sin(heading) + (moved[1] - east) * np.cos(heading)
    assert abs(across) < 100.0


def test_base_station_takes_the_variation_off(line):
    base = line["base_ground_nt"]
    assert columns.role_of("base_ground_nt") == "input"
    assert columns.role_of("true_base_ground_nt") == "truth"
    assert "base_ground_nt" in line.blind().data
    assert np.std(base - line["true_base_ground_nt"]) < 0.1
    quiet = np.linalg.norm(sum(vector(line, part) for part in ("earth", "departure", "crust", "target")), axis=1)
    variation = line["clean_tail_nt"] - quiet
    left = variation - (base - base.mean())
    assert np.std(left) < 0.2 * np.std(variation)


def error_of(*overrides: str) -> str:
    with pytest.raises(RequestError) as caught:
        load_scenario("geology_c208b", overrides)
    return str(caught.value)


def test_too_long_a_shortest_wavelength_is_refused_with_the_number():
    message = error_of("field.crust.shortest_m=150.0")
    assert "field.crust.shortest_m: 150 m leaves the top of the compensation band, 0.6 Hz, without geology" in message
    assert "70 m/s; allowed: up to 116.7, or with allow_smooth = true" in message
    windy = error_of("field.crust.shortest_m=116.0", "air.wind_north_mps=-10.0")
    assert "60 m/s; allowed: up to 100, or" in windy
    load_scenario("geology_c208b", ["field.crust.shortest_m=150.0", "field.crust.allow_smooth=true"])
    load_scenario("geology_c208b", ["field.crust.shortest_m=116.0"])


TARGETS = "field.targets[1]"


@pytest.mark.parametrize(
    ("overrides", "wanted"),
    [
        (["field.crust.depth_m=-1.0"], "field.crust.depth_m: -1 is not allowed"),
        (["field.crust.longest_m=1000.0", "field.crust.shortest_m=2000.0"], "1000 is not above shortest_m = 2000"),
        ([f"{TARGETS}.name='dike'"], "'dike' is the name of another target, too"),
        ([f"{TARGETS}.kind='cube'"], "allowed: 'dipole', 'prism', 'sphere'"),
        (
            [f"{TARGETS}.lat_deg=52.0"],
            "given twice or only in part; allowed: either lat_deg and lon_deg, or north_m and",
        ),
        (["field.targets[0].susceptibility=3.0"], "susceptibility: 3 is not allowed"),
        (["field.targets[0].susceptibility=0.0", "field.targets[0].remanence_apm=[0.0, 0.0, 0.0]"], "is not magnetic"),
        (["sensors.base.delay_s=5.0"], "sensors.base.delay_s: 5 is not allowed"),
        (["sensors.base.rate_hz=0.1"], "sensors.base.rate_hz: 0.1 is not allowed"),
        (["sensors.base.north_m=5.0"], "given twice or only in part"),
        (["field.variation.drift_s=0.0"], "field.variation.drift_s: 0 is not allowed"),
    ],
)
def test_wrong_settings_are_reported(overrides, wanted):
    assert wanted in error_of(*overrides)


def test_a_target_without_a_place_is_refused(tmp_path):
    text = (ROOT / "scenarios" / "geology_c208b.toml").read_text()
    path = tmp_path / "nowhere.toml"
    path.write_text("\n".join(row for row in text.split("\n") if not row.startswith(("north_m = 4", "east_m = 1_470"))))
    with pytest.raises(RequestError, match="has no place; allowed: either lat_deg and lon_deg"):
        load_scenario(path)


PARTS = ("[field.crust]", "[[field.targets]]", "[field.variation]", "[sensors.base]")


def test_own_streams_leave_everything_else_as_it_was(line, tmp_path):
    """Without all of it the flight and the errors of all other instruments are the same to the last bit."""
    blocks = (ROOT / "scenarios" / "geology_c208b.toml").read_text().split("\n\n")
    path = tmp_path / "bare.toml"
    path.write_text("\n\n".join(block for block in blocks if not block.startswith(PARTS)))
    bare = simulate(load_scenario(path, SHORT))
    for name in bare.data:
        if name.startswith(("true_", "ins_", "radar", "earth_", "permanent_", "hinged_", "surface_")):
            np.testing.assert_array_equal(bare[name], line[name])
    np.testing.assert_allclose(bare["error_tail_nt"], line["error_tail_nt"], rtol=0, atol=1e-9)
    assert not any(name.startswith(("crust_", "target_", "variation_", "base_", "true_base_")) for name in bare.data)
