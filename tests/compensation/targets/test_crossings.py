"""Pairs of rows at one place, and what they add to the equations in band."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import create
from magsim.compensation.targets import Crossings
from magsim.compensation.targets.pairs import Track, find_pairs
from magsim.errors import DataError
from tests.support.birds import COEFFICIENTS, terms
from tests.support.surveys import EAST_M, NORTH_M, model, survey
from tests.support.worlds import LAT_DEG, LON_DEG

SPEED_MPS = 70.0


def line(start_m, course_deg, begin_s):
    """A straight line at 70 m/s, 10 rows a second."""
    rows = 400
    along = SPEED_MPS * np.arange(rows) / 10.0
    north = start_m[0] + along * np.cos(np.radians(course_deg))
    east = start_m[1] + along * np.sin(np.radians(course_deg))
    time_s = begin_s + np.arange(rows) / 10.0
    return Track(LAT_DEG + north / NORTH_M, LON_DEG + east / EAST_M, np.full(rows, 500.0), time_s)


def joined(*lines):
    """One recording of several lines."""
    columns = [
        np.concatenate([getattr(one, key) for one in lines]) for key in ("lat_deg", "lon_deg", "alt_m", "time_s")
    ]
    seen = [one.station_nt for one in lines]
    return Track(*columns, None if seen[0] is None else np.concatenate(seen))


LINES = [line((-1400.0, 500.0 * i), 0.0, 100.0 * i) for i in range(3)]
TIES = [line((400.0 * i, -900.0), 90.0, 400.0 + 100.0 * i) for i in range(3)]


def test_lines_and_ties_cross_where_geometry_says():
    pairs = find_pairs([joined(*LINES, *TIES)], 20.0, 20.0)
    assert len(pairs) == 9
    found = []
    for first, second in pairs.rows:
        i, j = first // 400, second // 400 - 3
        # line i is at 500 i east, tie j at 400 j north
        found.append((i, j))
        assert abs((first % 400) * 7.0 - 1400.0 - 400.0 * j) <= 7.0
        assert abs((second % 400) * 7.0 - 900.0 - 500.0 * i) <= 7.0
    assert sorted(found) == [(i, j) for i in range(3) for j in range(3)]
    assert (np.diff(pairs.rows, axis=1) > 0).all()


def test_another_recording_another_height_and_another_course():
    apart = find_pairs([joined(*LINES), joined(*TIES)], 20.0, 20.0)
    assert len(apart) == 9
    assert (apart.recordings == [0, 1]).all()
    higher = [replace(tie, alt_m=tie.alt_m + 30.0) for tie in TIES]
    assert len(find_pairs([joined(*LINES, *higher)], 20.0, 20.0)) == 0
    assert len(find_pairs([joined(*LINES, *higher)], 20.0, 31.0)) == 9
    # the same line again on the same course says nothing of the heading; the other way round it does, every 5 s
    again = line((-1400.0, 0.0), 0.0, 300.0)
    assert len(find_pairs([joined(LINES[0], again)], 20.0, 20.0)) == 0
    back = line((1400.0, 0.0), 180.0, 300.0)
    assert 7 <= len(find_pairs([joined(LINES[0], back)], 20.0, 20.0)) <= 10


def test_drifts_and_the_time_variation_of_a_base_station_cancel():
    track = joined(*LINES, *TIES)
    pairs = find_pairs([track], 20.0, 20.0)
    drift = 3.0 + 0.01 * track.time_s
    np.testing.assert_allclose(pairs.target([drift]), 0.0, atol=1e-12)
    assert (pairs.drift.shape, pairs.free) == ((9, 1), 8)

    def seen(time_s):
        return 5.0 * np.sin(time_s / 40.0)

    lines = [[replace(one, station_nt=seen(one.time_s)) for one in kind] for kind in (LINES, TIES)]
    for tracks in ([joined(*lines[0], *lines[1])], [joined(*lines[0]), joined(*lines[1])]):
        pairs = find_pairs(tracks, 20.0, 20.0)
        # the constant between two recordings stays free; a single one has none
        assert pairs.drift.shape[1] == len(tracks) - 1
        left = pairs.target([seen(one.time_s) + 11.0 * i for i, one in enumerate(tracks)])
        np.testing.assert_allclose(left, 0.0, atol=1e-12)
        assert np.abs(pairs.differences([seen(one.time_s) for one in tracks])).max() > 1.0


def turned(recording, angle_deg=40.0):
    """The flight with its path turned about its middle: headings and fluxgate stay, so that only places change."""
    north = (recording["ins_lat_deg"] - LAT_DEG) * NORTH_M
    east = (recording["ins_lon_deg"] - LON_DEG) * EAST_M
    middle = north.mean(), east.mean()
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    there = middle[0] + c * (north - middle[0]) - s * (east - middle[1])
    here = middle[1] + s * (north - middle[0]) + c * (east - middle[1])
    moved = {"ins_lat_deg": LAT_DEG + there / NORTH_M, "ins_lon_deg": LON_DEG + here / EAST_M}
    return replace(recording, data={**recording.data, **moved})


@pytest.fixture(scope="module")
def flights():
    """Two flights over a plain field whose paths cross, with something in the band that no term is meant for."""
    out = []
    for seed in (0, 1):
        r = survey(geology=False, seed=seed)
        r = r if seed == 0 else turned(r)
        own = r["interference_cabin_nt"]
        rng = np.random.default_rng(seed)
        # a disturbance that goes with the maneuvers, as gusts on a moving surface do
        leak = 5.0 * np.sin(np.radians(r["ins_pitch_deg"] - 2.0)) + 0.01 * rng.normal(size=len(r))
        out.append(replace(r, data={**r.data, "mag_cabin_nt": model(r) + own + leak + 2.0 * r.time_s / r.time_s[-1]}))
    return out


def test_the_equations_hold_for_the_true_coefficients(flights):
    pairs = Crossings().pairs(flights, "cabin")
    own = [terms(r) @ COEFFICIENTS for r in flights]
    reading = [one + model(r) + 4.0 + 2.0 * r.time_s / 1280.0 for one, r in zip(own, flights, strict=True)]
    bare = [replace(r, data={**r.data, "mag_cabin_nt": v}) for r, v in zip(flights, reading, strict=True)]
    values = [Crossings().values(r, "cabin") for r in bare]
    np.testing.assert_allclose(pairs.differences(own), pairs.target(values), atol=1e-9)
    assert pairs.free >= 6


def test_crossings_fix_what_the_band_leaves_open(flights):
    error = {}
    for target in ("model", "crossings"):
        method = create("tl16", target=target).fit(flights)
        error[target] = [float(np.std(r["interference_cabin_nt"] - method.interference(r))) for r in flights]
    assert max(error["crossings"]) < 0.5 * max(error["model"])


def test_too_few_crossings_are_refused_with_what_would_do():
    with pytest.raises(DataError, match=r"target 'crossings': 'survey0' have \d crossings within 20 m and 20 m of hei"):
        create("tl16", target="crossings").fit(survey(geology=False).take(slice(0, 3000)))
