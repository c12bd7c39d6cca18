"""What is hardly meant in a recording from elsewhere."""

import re
from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.checking import check_flight
from magsim.recording.foreign import doubts_of


def flight(wind_mps=(0.0, 0.0), **columns):
    """The flight of the checks in a wind: it drifts, and heads where it did."""
    r = check_flight()
    lat = r["ins_lat_deg"] + wind_mps[0] * r.time_s / 111_200.0
    lon = r["ins_lon_deg"] + wind_mps[1] * r.time_s / (111_200.0 * np.cos(np.radians(45.3)))
    return replace(r, data={**r.data, "ins_lat_deg": lat, "ins_lon_deg": lon, **columns})


@pytest.mark.parametrize("wind_mps", [(0.0, 0.0), (8.0, -6.0), (0.0, 12.0)])
def test_a_sound_flight_has_no_doubts_in_any_wind(wind_mps):
    assert doubts_of(flight(wind_mps)) == ()


# declination 13.0 deg west at Ottawa in 2026 (IGRF-14); zone 18 has its middle at 75 W: 0.7 deg of longitude, sin 45
@pytest.mark.parametrize(
    ("off", "text"),
    [
        (
            13.0,
            r"is \+1\d\.\d deg off the course, .*does it count from magnetic north \(grid north \+0\.5 and magnetic no",
        ),
        (-5.0, r"is -[45]\.\d deg off the course, .*is the INS turned in its mount \(.*offset: [45]\.\d"),
    ],
)
def test_a_heading_from_another_north_is_told_from_wind(off, text):
    r = flight((8.0, -6.0))
    turned = replace(r, data={**r.data, "ins_heading_deg": (r["ins_heading_deg"] + off) % 360.0})
    (doubt,) = doubts_of(turned)
    assert re.search(text, doubt), doubt
    # on one heading alone nothing can be said
    assert doubts_of(turned.take(slice(0, 600))) == ()


def test_heights_in_feet_are_found():
    r = flight()
    feet = flight(ins_alt_m=r["ins_alt_m"] / 0.3048)
    (doubt,) = doubts_of(feet)
    assert doubt.startswith("ins_alt_m is ")
    assert "is the first in feet? A map file gives columns their scale: 0.3048" in doubt
    (doubt,) = doubts_of(flight(baro_alt_m=r["baro_alt_m"] / 0.3048))
    assert doubt.startswith("baro_alt_m is ")
    low = flight(ins_alt_m=r["ins_alt_m"] - 1130.0, baro_alt_m=3.28 * (r["ins_alt_m"] - 1130.0))
    assert doubts_of(low) == ()


@pytest.mark.parametrize("stem", ["flux", "mag"])
def test_units_of_fields_and_angles_are_told_too(stem):
    r = flight()
    small = replace(
        r, data={n: v / (1e3 if n.startswith(stem) and n.endswith("nt") else 1.0) for n, v in r.data.items()}
    )
    assert all("microteslas (scale = 1000)" in doubt for doubt in doubts_of(small))
    assert doubts_of(small)
    radians = {n: np.radians(r[n]) for n in ("ins_roll_deg", "ins_pitch_deg", "ins_heading_deg")}
    assert any("are they radians?" in doubt for doubt in doubts_of(flight(**radians)))
    dead = flight(flux_flux_x_nt=np.full(len(r), 3.0))
    assert any(doubt.startswith("flux_flux_x_nt is 3 in all") for doubt in doubts_of(dead))
