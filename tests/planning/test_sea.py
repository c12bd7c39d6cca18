"""A swell that stands where nothing can be felt of it is refused before the flight."""

import re
from pathlib import Path

import pytest

from magsim.errors import RequestError
from magsim.loading import load_scenario

SWELL = "field.swell={}"


def heights_file(folder: Path, row: str) -> Path:
    """Write ``patterns/straight`` with a swell and a grid of 3 x 3 heights around its start."""
    rows = "\n".join([row] * 3)
    header = "ncols 3\nnrows 3\nxllcenter -50000\nyllcenter -50000\ncellsize 50000\n"
    (folder / "heights.asc").write_text(header + rows + "\n")
    text = Path("scenarios/patterns/straight.toml").read_text()
    text += "\n[terrain]\nkind = 'grid'\ncoordinates = 'local'\nfile = 'heights.asc'\n\n[field.swell]\n"
    path = folder / "over.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("height_m", [80.0, -20.0])
def test_over_flat_land(height_m):
    terrain = f"terrain={{kind='flat', height_m={height_m}}}"
    message = rf"field\.swell: waves need the sea, and the ground at the start is {height_m:g} m high; allowed: over"
    with pytest.raises(RequestError, match=message):
        load_scenario("patterns/straight", ["start.alt_m=100", terrain, SWELL])
    sea = ["start.alt_m=100", terrain.replace(str(height_m), "0.0"), SWELL]
    assert load_scenario("patterns/straight", sea).scenario.field.swell


def test_over_land_of_a_grid_and_over_the_bottom_of_the_sea(tmp_path):
    low = ["start.alt_m=100"]
    with pytest.raises(RequestError, match=r"over.toml:\d+: field\.swell: .* the ground at the start is 75 m high"):
        load_scenario(heights_file(tmp_path, "50 75 100"), low)
    assert load_scenario(heights_file(tmp_path, "-50 -75 -100"), low).scenario.field.swell


def test_over_land_of_random_ground():
    ground = "terrain={kind='fractal', mean_m=500.0, relief_m=100.0}"
    with pytest.raises(RequestError, match=r"field\.swell: waves need the sea"):
        load_scenario("patterns/straight", ["start.alt_m=900", ground, SWELL])


def test_too_high_above_the_sea():
    with pytest.raises(RequestError) as caught:
        load_scenario("patterns/straight", ["start.alt_m=2500", SWELL])
    message = str(caught.value)
    found = re.search(r"field\.swell: 2500 m above the sea, .* less than 1e-06 nT; allowed: up to (\d+) m, a", message)
    assert found, message
    assert "\n" not in message
    most = int(found[1])
    assert load_scenario("patterns/straight", [f"start.alt_m={most}", SWELL]).scenario.field.swell
    with pytest.raises(RequestError, match="allowed: up to"):
        load_scenario("patterns/straight", [f"start.alt_m={most + 1}", SWELL])
    longer = [f"start.alt_m={most + 1}", "field.swell={period_s=14.0}"]
    assert load_scenario("patterns/straight", longer).scenario.field.swell


def test_heights_count_from_the_sea_and_a_swell_that_is_off_is_not_checked():
    high = ["start.alt_m=1100", "terrain={kind='flat', geoid_m=-100.0}"]
    with pytest.raises(RequestError, match=r"field\.swell: 1200 m above the sea"):
        load_scenario("patterns/straight", [*high, SWELL])
    off = load_scenario("patterns/straight", [*high, "field.swell={enabled=false}"])
    assert off.scenario.field.swell
    assert not off.scenario.field.swell.enabled


def test_the_land_and_the_heights_of_a_logged_track():
    with pytest.raises(RequestError, match=r"field\.swell: .* the ground on the track is 55 m high"):
        load_scenario("patterns/track", [SWELL])
    sea = ["terrain.height_m=0.0"]
    with pytest.raises(RequestError, match=r"field\.swell: \d+ m above the sea, the lowest height of the plan"):
        load_scenario("patterns/track", [*sea, "field.swell={period_s=4.0}"])
    assert load_scenario("patterns/track", [*sea, SWELL]).scenario.field.swell
