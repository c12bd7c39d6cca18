"""The Earth's gradient beside Tolles-Lawson: a bird that swings through a field that is exactly a polynomial."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from magsim.compensation.features import Inputs, tolles_lawson
from magsim.compensation.gradient import gradient

from magsim.benchmark import evaluate
from magsim.compensation import TollesLawson, create, load
from magsim.errors import DataError, RequestError
from magsim.signals import in_band
from tests.support import scores
from tests.support.worlds import EXACT, FIELD_NT, World, calibration, parts

COEFFICIENTS = np.concatenate(
    [
        [-60.0, 45.0, 90.0],
        [9e-3, -2e-3, 4e-3, 3e-3, -5e-3],
        [1.2e-3, 0.3e-3, -0.5e-3, 0.6e-3, -0.4e-3, 1.5e-3, -0.7e-3, 0.2e-3],
    ]
)
VERTICAL_NT_M = 0.02
PAIRS = {0: 0, 1: 2, 2: 5, 3: 9, 4: 14}


def swing(recording):
    """The flight with a swing of 10 m in its position, inside of the band, without a whole period."""
    t = recording.time_s
    lat = recording["ins_lat_deg"] + 1e-4 * np.sin(0.8 * t + 0.3 * np.sin(0.05 * t))
    lon = recording["ins_lon_deg"] + 1e-4 * np.sin(0.9 * t + 0.5 * np.sin(0.04 * t) + 1.0)
    return replace(recording, data={**recording.data, "ins_lat_deg": lat, "ins_lon_deg": lon})


@cache
def bird(order, seed=0, vertical=VERTICAL_NT_M):
    """A reading of Tolles-Lawson terms and a polynomial of latitude and longitude from the first row on, eq. 11.

    Each term of the polynomial comes to some 30 nT at the other end of the flight.
    """
    r = swing(calibration(EXACT, seed, f"bird{seed}"))
    lat, lon = r["ins_lat_deg"], r["ins_lon_deg"]
    north, east = (lat - lat[0]) / np.ptp(lat), (lon - lon[0]) / np.ptp(lon)
    rng = np.random.default_rng(seed)
    field = vertical * (r["ins_alt_m"] - r["ins_alt_m"][0])
    for n in range(1, order + 1):
        for k in range(n + 1):
            field = field + 30.0 * rng.normal() * north ** (n - k) * east**k
    own = tolles_lawson(r, Inputs("cabin", strength_nt=FIELD_NT), 16).matrix @ COEFFICIENTS
    clean = FIELD_NT + field
    changed = {"mag_cabin_nt": clean + own, "clean_cabin_nt": clean, "interference_cabin_nt": own}
    return replace(r, data={**r.data, **changed})


def moved(recording, lat_deg=0.0, lon_deg=0.0, turn=0.0):
    """The same flight elsewhere; longitudes in [-180, 180), or in [turn - 180, turn + 180)."""
    lon = (recording["ins_lon_deg"] + lon_deg + 180.0 - turn) % 360.0 - 180.0 + turn
    return replace(
        recording,
        data={**recording.data, "ins_lat_deg": recording["ins_lat_deg"] + lat_deg, "ins_lon_deg": lon},
    )


def fitted(*recordings, **params):
    return TollesLawson(**{"target": "measured", **params}).fit([r.labeled() for r in recordings], sensor="cabin")


def off_nt(method, recording):
    """Largest in-band RMS that the error of one coefficient makes."""
    matrix = tolles_lawson(recording, Inputs("cabin", strength_nt=FIELD_NT), 16).matrix
    size = np.sqrt(np.mean(in_band(matrix, recording.time_s) ** 2, axis=0))
    return float(np.abs((method.coefficients_ - COEFFICIENTS) * size).max())


@pytest.mark.parametrize("order", PAIRS)
@pytest.mark.parametrize("vertical", [False, True])
def test_columns_are_those_of_equation_11(order, vertical):
    r = bird(2)
    found = gradient([r], order, vertical=vertical)
    (design,) = found.designs
    assert design.matrix.shape == (len(r), PAIRS[order] + vertical)
    lat, lon, alt = (r[name] for name in ("ins_lat_deg", "ins_lon_deg", "ins_alt_m"))
    x, y, z = (2.0 * (v - (v.min() + v.max()) / 2.0) / np.ptp(v) for v in (lat, lon, alt))
    expected, units = [], []
    for n in range(1, order + 1):
        for k in range(n + 1):
            expected.append(x ** (n - k) * y**k)
            units.append("nT/deg" if n == 1 else f"nT/deg^{n}")
    expected += [z] if vertical else []
    units += ["nT/m"] if vertical else []
    np.testing.assert_allclose(design.matrix, np.array(expected).T.reshape(len(r), -1), rtol=0, atol=1e-9)
    assert design.units == tuple(units)
    names = ("lat", "lon", "lat^2", "lat lon", "lon^2", "lat^3", "lat^2 lon", "lat lon^2", "lon^3", "lat^4")
    assert design.names[: min(PAIRS[order], 10)] == names[: PAIRS[order]]


@pytest.mark.parametrize("order", PAIRS)
def test_terms_are_recovered_exactly_with_the_right_order_and_biased_below_it(order):
    r = bird(order)
    assert off_nt(fitted(r, order=order, vertical=True), r) < 1e-9
    assert off_nt(fitted(r, order=4, vertical=True), r) < 1e-9
    assert off_nt(fitted(r, order=order), r) > 1e-2
    if order:
        assert off_nt(fitted(r, order=order - 1, vertical=True), r) > 3e-4


@pytest.mark.parametrize("order", [1, 3])
def test_the_report_tells_the_field_in_physical_units(order):
    """Summed up by hand, the terms of the report are the field but for its constant."""
    r = bird(order)
    report = fitted(r, order=order, vertical=True).report_
    ((lat0, lon0),) = report.origins_deg
    north, east = r["ins_lat_deg"] - lat0, r["ins_lon_deg"] - lon0
    exponents = [(n - k, k) for n in range(1, order + 1) for k in range(n + 1)]
    *horizontal, height = report.gradient
    told = sum(term.value * north**a * east**b for term, (a, b) in zip(horizontal, exponents, strict=True))
    assert height.value == pytest.approx(VERTICAL_NT_M, rel=1e-6)
    rest = r["clean_cabin_nt"] - told - height.value * r["ins_alt_m"]
    assert np.std(r["clean_cabin_nt"]) > 2.0
    assert np.std(rest) < 1e-3
    text = str(report)
    assert f"about latitude and longitude {lat0:.4f}, {lon0:.4f} (fitted, never taken away):" in text
    assert "    height  2.000000e-02 nT/m" in text


def test_without_gradient_terms_nothing_is_told_of_it():
    report = fitted(bird(0)).report_
    assert report.gradient == ()
    assert report.origins_deg == ()
    assert "gradient" not in str(report)


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "turn", "jumps"),
    [
        (0.0, 180.0 - 112.75, 0.0, True),
        (0.0, 180.0 - 112.75, 180.0, False),
        (0.0, -112.75, 180.0, True),
        (55.0, 20.0, 0.0, False),
    ],
    ids=["date line", "date line, 0 to 360", "Greenwich, 0 to 360", "far north"],
)
def test_place_does_not_matter(*, lat_deg, lon_deg, turn, jumps):
    r = bird(3)
    there = moved(r, lat_deg, lon_deg, turn)
    assert (np.ptp(there["ins_lon_deg"]) > 300.0) == jumps
    method = fitted(there, order=3, vertical=True)
    assert off_nt(method, r) < 1e-9
    # those columns are the same to the last bits of a longitude
    here, far = (gradient([x], 3, vertical=True).designs[0].matrix for x in (r, there))
    np.testing.assert_allclose(far, here, rtol=0, atol=1e-9)


def test_flights_of_one_place_share_one_field():
    """The parts of a flight, and one that is flown a little beside it."""
    r = bird(2)
    train, valid, test = parts(r)
    beside = moved(train, lat_deg=0.15)
    found = gradient([train, valid, test, beside], 2, vertical=True)
    assert len(found.places) == 1
    assert {design.names for design in found.designs} == {found.designs[0].names}
    assert found.designs[0].matrix.shape[1] == 6
    joined = np.concatenate([design.matrix for design in found.designs])[:, [0, 1, -1]]
    np.testing.assert_allclose([joined.min(axis=0), joined.max(axis=0)], [[-1.0] * 3, [1.0] * 3], rtol=1e-12)


@pytest.mark.parametrize("lon_deg", [3.0, 180.0 - 112.75])
def test_another_place_has_its_own_field(lon_deg):
    """Two flights in different fields, 300 km apart and on the date line: no common polynomial fits both."""
    here, there = bird(2), moved(bird(2, seed=1, vertical=0.03), lon_deg=lon_deg)
    method = fitted(here, there, order=2, vertical=True)
    assert off_nt(method, here) < 1e-9
    gradients = {term.name: term.value for term in method.report_.gradient}
    assert len(gradients) == 12
    assert gradients["height [1]"] == pytest.approx(0.02, rel=1e-6)
    assert gradients["height [2]"] == pytest.approx(0.03, rel=1e-6)
    assert len(method.report_.origins_deg) == 2
    swapped = fitted(there, here, order=2, vertical=True)
    np.testing.assert_allclose(swapped.coefficients_, method.coefficients_, rtol=1e-8)


def test_flights_that_are_near_over_others_are_one_place():
    chain = [moved(bird(1), lat_deg=0.3 * i) for i in (0, 2, 1)]
    assert len(gradient(chain[:2], 1, vertical=False).places) == 2
    assert len(gradient(chain, 1, vertical=False).places) == 1


def test_height_alone_reads_no_position():
    r = bird(0)
    bare = replace(r, data={k: v for k, v in r.data.items() if k not in ("ins_lat_deg", "ins_lon_deg")})
    method = fitted(bare, bare, vertical=True)
    assert off_nt(method, r) < 1e-9
    assert [term.name for term in method.report_.gradient] == ["height"]
    assert method.report_.origins_deg == ()


def test_a_height_that_never_changes_tells_nothing():
    r = bird(1)
    level = replace(r, data={**r.data, "ins_alt_m": np.full(len(r), 3000.0)})
    method, without = (fitted(level, order=1, vertical=vertical) for vertical in (True, False))
    np.testing.assert_allclose(method.coefficients_, without.coefficients_, rtol=1e-12)
    assert method.report_.gradient[-1].value == 0.0


def test_only_the_terms_of_the_platform_are_taken_away():
    """The field stays in the compensated reading, and the position is not even read to compensate."""
    r = bird(3)
    method = fitted(r, order=3, vertical=True)
    terms = tolles_lawson(r, Inputs("cabin", strength_nt=FIELD_NT), 16).matrix
    np.testing.assert_allclose(method.interference(r.blind()), terms @ method.coefficients_ + method.offset_nt_)
    np.testing.assert_allclose(method.compensate(r.blind()), r["clean_cabin_nt"], rtol=0, atol=1e-6)
    assert np.std(r["clean_cabin_nt"]) > 5.0
    blind = r.blind()
    bare = replace(blind, data={k: v for k, v in blind.data.items() if not k.startswith("ins")})
    np.testing.assert_array_equal(method.interference(bare), method.interference(blind))
    assert not any(pattern.startswith("ins") for pattern in method.requires)


def test_an_anomaly_passes_whole():
    report = evaluate([bird(3)], ["tl16_gradient", "tl16_measured"])
    for name in report.methods:
        assert report.value(name, "gain") == pytest.approx(1.0, abs=1e-9)
    assert report.value("tl16_gradient", "ir") > 100.0 * report.value("tl16_measured", "ir")


def test_labels_leave_nothing_for_the_gradient():
    r = bird(2)
    plain, beside = (fitted(r, target="interference", order=n, vertical=bool(n)) for n in (0, 2))
    assert off_nt(plain, r) < 1e-9
    assert off_nt(beside, r) < 1e-9
    gradients = {term.name: term.value for term in beside.report_.gradient}
    assert abs(gradients["height"]) < 1e-9
    assert abs(gradients["lat"]) < 1e-5


def test_the_vertical_gradient_is_what_leaks_into_a_self_supervised_fit():
    """Pitch changes the height inside of the band: with the column the fit is as good as one on the label."""
    train, valid, test = parts(calibration(World()))

    def ratio(method):
        method.fit([train], sensor="cabin", valid=[valid])
        truth = test["interference_cabin_nt"]
        return scores.improvement_ratio(truth, truth - method.interference(test.blind()), 10.0)

    label, plain = ratio(create("tl16")), ratio(create("tl16_measured"))
    assert plain < 0.95 * label
    assert ratio(create("tl16_gradient", order=0)) > 0.98 * label


def test_saved_and_loaded_tells_the_same(tmp_path):
    method = fitted(bird(2), moved(bird(2, seed=1), lat_deg=5.0), order=2, vertical=True)
    method.save(tmp_path)
    back = load(tmp_path)
    assert back.report_ == method.report_
    assert len(back.report_.gradient) == 12


def test_the_name_has_defaults_that_may_be_changed():
    method = create("tl16_gradient")
    assert (method.terms, method.target, method.order, method.vertical) == (16, "measured", 3, True)
    assert create("tl16_gradient", order=1, vertical=False).get_params()["order"] == 1
    plain = create("tl16_gradient", order=0, vertical=False)
    assert plain.get_params() == create("tl16_measured").get_params()
    assert plain.name == "tl16_measured"
    assert create("tl16", order=2).name == "tl16"
    with pytest.raises(RequestError, match="target is 'measured' by its name; it cannot be 'interference'"):
        create("tl16_gradient", target="interference")
    with pytest.raises(RequestError, match=r"method tl16_gradient: order: 5 is not allowed; allowed: .*from 0 to 4"):
        create("tl16_gradient", order=5)
    with pytest.raises(RequestError, match="order: true is not allowed"):
        create("tl16_gradient", order=True)


def test_what_does_not_fit_is_told():
    r = bird(1)
    for name in ("ins_lon_deg", "ins_alt_m"):
        bare = replace(r, data={k: v for k, v in r.data.items() if k != name})
        with pytest.raises(RequestError, match=f"recording 'bird0' has no column {name}"):
            fitted(bare, order=1, vertical=True)
    broken = r["ins_lat_deg"].copy()
    broken[120] = np.nan
    with pytest.raises(DataError, match="ins_lat_deg is not finite at 12 s"):
        fitted(replace(r, data={**r.data, "ins_lat_deg": broken}), order=1)
    around = replace(r, data={**r.data, "ins_lon_deg": np.linspace(-180.0, 179.0, len(r))})
    with pytest.raises(DataError, match="covers 359 degrees of longitude, so a pole is near"):
        fitted(around, order=1)
    fitted(around, vertical=True)
    for params in ({"order": 1}, {"vertical": True}):
        with pytest.raises(RequestError, match="order and vertical need band 'in'"):
            fitted(r, target="interference", band="broad", **params)
    with pytest.raises(RequestError, match="target 'measured' needs band 'in'"):
        fitted(r, band="broad")
    with pytest.raises(DataError, match=r"tl16_gradient needs at least 310 training rows.*has 301"):
        fitted(r.take(slice(0, 901)), order=4, vertical=True)
