"""Targets that take a known field from the reading: the main field's model, and a map at the heights flown."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import create
from magsim.compensation.targets import KnownField
from magsim.compensation.targets.anomaly_map import AnomalyMap
from magsim.errors import DataError, RequestError
from tests.support.surveys import MAP_HEIGHT_M, anomaly, grid_text, survey
from tests.support.worlds import LAT_DEG, LON_DEG


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    file = tmp_path_factory.mktemp("map") / "anomalies.asc"
    file.write_text(grid_text(0.002))
    return file


def left(method, recording):
    return recording["interference_cabin_nt"] - method.interference(recording)


def test_over_the_model_alone_the_fit_is_exact_in_band_and_unfiltered():
    r = survey(geology=False)
    np.testing.assert_allclose(KnownField().values(r, "cabin"), r["interference_cabin_nt"], rtol=0, atol=1e-9)
    blind = replace(r, data={n: v for n, v in r.data.items() if not n.startswith("interference")})
    for band in ("in", "broad"):
        method = create("tl16", target="model", band=band).fit(blind)
        assert np.ptp(left(method, r)) < 1e-4, band
    # the vertical gradient of the main field is what the reading itself mistakes for interference
    assert np.ptp(left(create("tl16", target="measured").fit(blind), r)) > 0.1


def test_the_constant_is_that_of_an_unfiltered_target():
    r = survey(geology=False)
    higher = replace(r, data={n: v + 7.0 * (n == "mag_cabin_nt") for n, v in r.data.items() if n[:5] != "inter"})
    method = create("tl16", target="model", band="broad").fit(higher)
    assert np.mean(left(method, r)) == pytest.approx(-7.0, abs=1e-4)
    assert create("tl16", target="model").fit(higher).offset_nt_ == 0.0


def test_a_map_is_continued_to_the_heights_that_were_flown(path):
    r = survey()
    known = AnomalyMap.read(path, MAP_HEIGHT_M)
    lat, lon, alt = r["ins_lat_deg"], r["ins_lon_deg"], r["ins_alt_m"]
    assert np.ptp(alt) > 20.0
    error = known.at(lat, lon, alt, r.name) - anomaly(lat, lon, alt)
    assert np.abs(error).max() < 0.1  # of 48 nT, by cells of 220 m and waves of 1800 m
    # without its height it is taken as it is, as for a map of the flown surface
    flat = AnomalyMap.read(path).at(lat, lon, alt, r.name)
    np.testing.assert_allclose(flat, anomaly(lat, lon, MAP_HEIGHT_M), rtol=0, atol=0.1)
    assert np.abs(flat - anomaly(lat, lon, alt)).max() > 5.0


def test_a_little_downward_is_continued_and_more_is_refused(path, tmp_path):
    lat, lon = np.full(3, LAT_DEG), LON_DEG + np.array([0.0, 0.01, 0.02])
    known = AnomalyMap.read(path, MAP_HEIGHT_M)
    down = np.full(3, MAP_HEIGHT_M - 100.0)
    np.testing.assert_allclose(known.at(lat, lon, down, "f"), anomaly(lat, lon, down), rtol=0, atol=0.1)
    with pytest.raises(DataError, match=r"'f' goes 400 m below the map's height of 2800 m; allowed: 21\d m, one cell"):
        known.at(lat, lon, np.full(3, MAP_HEIGHT_M - 400.0), "f")


def test_with_its_map_a_survey_is_fitted_as_without_geology(path):
    r = survey()
    error = {}
    for name, more in {"model": {}, "map": {"map": str(path), "map_height_m": MAP_HEIGHT_M}}.items():
        method = create("tl16", target=name, band="broad", **more).fit(r)
        error[name] = np.std(left(method, r))
    assert error["map"] < 0.02
    assert error["model"] > 20.0 * error["map"]


def test_wrong_maps_and_places_are_refused(path, tmp_path):
    known = AnomalyMap.read(path)
    one = np.zeros(1)
    with pytest.raises(DataError, match=r"asc: recording 'f' leaves the map at latitude 17\.7\d*, longitude 112\.7"):
        known.at(one + LAT_DEG + 1.0, one + LON_DEG, one, "f")
    holed = tmp_path / "holed.asc"
    holed.write_text(grid_text(0.05).replace("nodata_value -1e32\n", "nodata_value -1e32\n-1e32 ", 1).rsplit(" ", 1)[0])
    AnomalyMap.read(holed).at(one + LAT_DEG, one + LON_DEG, one, "f")  # the hole is elsewhere
    with pytest.raises(DataError, match="'f' flies over or near points without data; allowed: a map without holes"):
        AnomalyMap.read(holed).at(one + LAT_DEG + 0.149, one + LON_DEG - 0.149, one, "f")
    wrong = tmp_path / "wrong.asc"
    wrong.write_text("ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 1\n1 2\n3 1e30\n")
    with pytest.raises(RequestError, match=r"wrong\.asc:7: value 2: 1e\+30 nT is no anomaly; allowed: up to 200000 nT"):
        AnomalyMap.read(wrong)
    wrong.write_text("ncols 2\nnrows 2\nxllcenter 500000\nyllcenter 0\ncellsize 1\n1 2\n3 1\n")
    with pytest.raises(RequestError, match=r"no degrees of longitude and latitude; allowed: those$"):
        AnomalyMap.read(wrong)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"target": "map"}, "target 'map' needs the parameter map"),
        ({"target": "reference"}, "target 'reference' needs the parameter reference"),
        ({"target": "model", "map": "x"}, r"map has no effect with target 'model'; allowed: target = 'map' beside it"),
        ({"crossing_m": 5.0}, "crossing_m has no effect with target 'interference'"),
        ({"target": "measured", "band": "broad"}, "target 'measured' needs band 'in'"),
        ({"target": "crossings", "band": "broad"}, "target 'crossings' needs band 'in'"),
        ({"target": "map", "map": "/nowhere/x.asc"}, "/nowhere/x.asc: there is no such file"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(settings, text):
    with pytest.raises(RequestError, match=text):
        create("tl16", **settings).fit(survey())


def test_what_only_learning_reads_is_named_with_the_method():
    r = survey()
    for stem, column in (("ins_alt", "ins_alt_m"), ("ins_lat", "ins_lat_deg")):
        bare = replace(r, data={n: v for n, v in r.data.items() if not n.startswith(stem)})
        with pytest.raises(RequestError, match=rf"'survey0' has no column {column}, which method tl16 reads while it"):
            create("tl16", target="model").fit(bare)
    with pytest.raises(RequestError, match="'survey0' has no start_utc, which the model of the main field needs"):
        create("tl16", target="model").fit(replace(r, meta={}))
    late = replace(r, meta={"start_utc": "2041-01-01T00:00:00Z"})
    with pytest.raises(DataError, match="'survey0': IGRF-14 covers the years 1900 to 2030, not 2041"):
        create("tl16", target="model").fit(late)


def test_an_estimate_reads_no_position_and_no_map(path):
    r = survey()
    method = create("tl16", target="map", map=str(path)).fit(r)
    assert method.requires == ("flux_{sensor}_{axis}_nt",)
    bare = replace(r, data={n: v for n, v in r.data.items() if n.startswith("flux")})
    np.testing.assert_array_equal(method.interference(bare), method.interference(r))


def test_the_recursive_fit_takes_the_same_targets(path):
    settings = {"target": "map", "map": str(path), "map_height_m": MAP_HEIGHT_M}
    one, other = (create(name, **settings).fit(survey()) for name in ("tl16", "tl16_recursive"))
    np.testing.assert_array_equal(one.coefficients_, other.coefficients_)
