"""IGRF-14 against IAGA's program, an independent library and the trap values; the kernel against WMM2025."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import ppigrf
import pygeomag
import pytest

from magsim.earth import decimal_year, decimal_years, ecef_from_geodetic, harmonics, igrf, rot_ne_at
from magsim.earth.igrf import Model, field_of_model, igrf14
from tests.support.paths import REFERENCE_DATA

DATA = REFERENCE_DATA

# Computed with IAGA's igrf14syn: test/IGRF14_test_geodetic.txt of JuliaSpace/SatelliteToolboxGeomagneticField.jl.
# Decimal year, altitude km, colatitude deg, longitude deg (all geodetic, rounded in print); X, Y, Z nT.
IAGA_ROWS = """
1900.0  232.32 68.00 165.11 27505.75351  3089.91355  16985.87684
1971.9  372.19  4.23 244.39 -1032.48029   117.36753  48759.11091
1991.7 1517.37 34.52 186.99 10117.52040  1868.69273  25416.40305
2012.2   77.18  4.81 190.69   750.03774   394.68103  55395.16588
1990.6   34.18 34.51  24.06 16779.17251  1244.60056  46474.73203
1956.4 1120.70 53.01 334.96 14250.20463 -4216.15759  22832.79720
2014.2  864.95  8.28 235.41  1182.76234   447.65779  40091.79119
1935.4   97.80 66.25 118.16 34965.73111  -780.61590  22635.35126
1985.4 1232.12 89.19 131.52 21664.23307   807.92095  -6610.42391
2022.1  829.10 46.47 114.85 17590.40262 -1731.07191  33147.28408
2027.9  139.86 45.06 138.29 23759.41728 -4335.97718  42511.80742
2011.8  222.44  1.43 247.84  -723.44139 -1045.98675  51636.66448
"""

# Official test values of WMM2025 (NOAA/NCEI and BGS, public domain).
# Decimal year, altitude km, latitude deg, longitude deg (geodetic); X, Y, Z nT; their rates nT/yr.
WMM_ROWS = """
2025.0 28  89 -121  -255.388723 -1482.460628  56194.288771  62.723738 -21.242793  18.075146
2025.0 48  80  -96  1875.982280 -1079.269389  55623.044051  71.596398  13.214774 -12.148507
2025.0 54  82   87  1324.336929  1883.428620  56740.772059 -48.732002  -7.505574  41.134755
2025.0 65  43   93 24299.852822   210.517066  50037.923998  -3.865401  -8.437166  60.388819
2025.0 51 -33  109 21737.778822 -2090.274098 -52710.003920  32.221578  23.651711  -3.334040
2025.0 39 -59   -8 14358.095523 -4049.107540 -24389.086374  -0.095123   2.999401  54.951779
2025.0  3 -50 -103 19526.532799 10362.990980 -31437.562789 -31.417096 -30.696074  88.952383
2025.0 94 -29 -110 23275.471080  6559.046509 -19063.605287 -39.595926 -16.008811  52.018933
2025.0 66  14  143 35003.441364  -116.624818   7966.315182  10.735986 -33.689325  -0.010939
2025.0 18   0   21 29274.811882   659.800118 -14316.722540  -9.110937  15.408838  54.581250
2025.5  6 -36 -137 23781.930678  8786.698927 -32577.518648 -36.214518  -1.422651  60.968936
2025.5 63  26   81 34802.613433   308.431881  30332.056989  20.241534  11.432574  41.122831
"""


def rows_of(text: str) -> np.ndarray:
    return np.array([line.split() for line in text.strip().splitlines()], dtype=float)


def iaga_tables() -> list:
    tables = [pytest.param(rows_of(IAGA_ROWS), id="carried")]
    path = DATA / "igrf14_geodetic_200.txt"
    if path.exists():
        table = np.loadtxt(path)
        tables.append(pytest.param(table[table[:, 0] <= 2030.0, :7], id="full"))
    return tables


def wmm_tables() -> list:
    tables = [pytest.param(rows_of(WMM_ROWS), id="carried")]
    path = DATA / "wmm2025_test_values.txt"
    if path.exists():
        table = np.loadtxt(path)
        tables.append(pytest.param(table[:, [0, 1, 2, 3, 7, 8, 9, 14, 15, 16]], id="full"))
    return tables


def read_wmm2025() -> Model:
    """WMM2025 from the coefficient file in pygeomag's wheel, as two epochs five years apart."""
    path = Path(pygeomag.__file__).parent / "wmm" / "WMM_2025.COF"
    rows = [line.split() for line in path.read_text().splitlines()[1:] if not line.startswith("9999")]
    size = harmonics.index(13, 0)
    g, h, dg, dh = (np.zeros(size) for _ in range(4))
    for row in rows:
        at = harmonics.index(int(row[0]), int(row[1]))
        g[at], h[at], dg[at], dh[at] = (float(v) for v in row[2:6])
    ends = [harmonics.complex_coefficients(g + years * dg, h + years * dh) for years in (0.0, 5.0)]
    return Model("WMM2025", np.array([2025.0, 2030.0]), np.array(ends))


@pytest.fixture(scope="module")
def wmm2025() -> Model:
    return read_wmm2025()


def random_places(n: int, seed: int = 1) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    return (
        np.arcsin(rng.uniform(-1, 1, n)),
        rng.uniform(-np.pi, np.pi, n),
        rng.uniform(-500.0, 20e3, n),
        rng.uniform(1900.0, 2030.0, n),
    )


@pytest.mark.parametrize("table", iaga_tables())
def test_iaga_program(table):
    field_n = igrf(np.radians(90.0 - table[:, 2]), np.radians(table[:, 3]), table[:, 1] * 1e3, table[:, 0])
    # The printed inputs are rounded to 0.1 year, 0.01 km and 0.01 degree.
    np.testing.assert_allclose(field_n, table[:, 4:7], rtol=0, atol=0.1)


def test_ppigrf_at_a_date():
    lat, lon, alt, _ = random_places(50)
    date = datetime(2025, 3, 13)
    # ppigrf takes geodetic degrees and km and gives east, north, up.
    east, north, up = (v.ravel() for v in ppigrf.igrf(np.degrees(lon), np.degrees(lat), alt / 1e3, date))
    field_n = igrf(lat, lon, alt, decimal_year(date))
    np.testing.assert_allclose(field_n, np.stack([north, east, -up], axis=1), rtol=0, atol=0.05)


@pytest.mark.parametrize("table", wmm_tables())
def test_wmm2025_official_values(table, wmm2025):
    year, alt, lat, lon = table[:, 0], table[:, 1] * 1e3, np.radians(table[:, 2]), np.radians(table[:, 3])
    field_n = igrf(lat, lon, alt, year, model=wmm2025)
    np.testing.assert_allclose(field_n, table[:, 4:7], rtol=0, atol=0.001)
    # Linear in time: a difference over any span is the rate.
    start, stop = (igrf(lat, lon, alt, when, model=wmm2025) for when in (2025.0, 2029.0))
    np.testing.assert_allclose((stop - start) / 4.0, table[:, 7:10], rtol=0, atol=1e-5)


def test_gradient_is_symmetric_and_without_trace():
    field_n, gradient_n = igrf(*random_places(300), gradient=True)
    biggest = np.abs(gradient_n).max()
    assert np.abs(np.trace(gradient_n, axis1=1, axis2=2)).max() < 1e-12 * biggest
    assert np.abs(gradient_n - np.swapaxes(gradient_n, 1, 2)).max() < 1e-12 * biggest
    np.testing.assert_allclose(field_n, igrf(*random_places(300)), rtol=0, atol=1e-8)


def test_gradient_against_finite_differences():
    lat, lon, alt, year = random_places(40)
    rot_ne = rot_ne_at(lat, lon)
    _, gradient_n = igrf(lat, lon, alt, year, gradient=True)
    position_e = ecef_from_geodetic(lat, lon, alt)
    step = 100.0
    numeric = np.empty_like(gradient_n)
    for axis in range(3):
        ahead, behind = (
            field_of_model(position_e + sign * step * rot_ne[:, axis], year, igrf14()) for sign in (1.0, -1.0)
        )
        numeric[:, :, axis] = np.einsum("nij,nj->ni", rot_ne, (ahead - behind) / (2.0 * step))
    # The field is differenced at fixed local axes: the derivative of the vector, not of its components along the path.
    np.testing.assert_allclose(numeric, gradient_n, rtol=0, atol=1e-7 * np.abs(gradient_n).max())


def test_poles_are_finite_and_continuous():
    for pole in (np.pi / 2, -np.pi / 2):
        field_n, gradient_n = igrf(pole, 0.3, 3000.0, 2025.0, gradient=True)
        assert np.isfinite(field_n).all()
        assert np.isfinite(gradient_n).all()
        near = igrf(pole * (1.0 - 1e-9), 0.3, 3000.0, 2025.0)
        np.testing.assert_allclose(near, field_n, atol=0.001)


# Printed values of IGRF-14 at 2025.5: F nT, and the gradient of F along north, east, down in nT/km.
@pytest.mark.parametrize(
    ("place", "total", "inclination", "slope"),
    [
        ((45.3, -75.7, 300.0), 53320.0, 69.5, (3.9, -1.7, 27.1)),
        ((16.75, 112.73, 3000.0), 43012.0, 23.0, (3.6, -1.05, 23.1)),
        ((30.5, 114.3, 1000.0), 50060.0, None, (5.2, -1.6, 27.3)),
    ],
)
def test_printed_places(place, total, inclination, slope):
    lat, lon, alt = place
    field_n, gradient_n = igrf(np.radians(lat), np.radians(lon), alt, 2025.5, gradient=True)
    norm = np.linalg.norm(field_n)
    assert norm == pytest.approx(total, abs=1.0)
    if inclination is not None:
        assert np.degrees(np.arctan2(field_n[2], np.hypot(*field_n[:2]))) == pytest.approx(inclination, abs=0.06)
    assert gradient_n.T @ field_n / norm * 1e3 == pytest.approx(slope, abs=0.06)


def test_trap_of_geocentric_latitude():
    """Ottawa's geodetic latitude and height taken for geocentric ones: -298, +18, +85 nT; -22.6 nT in F."""
    lat, lon, alt = np.radians(45.3), np.radians(-75.7), 300.0
    right = igrf(lat, lon, alt, 2025.5)
    radius = harmonics.REFERENCE_RADIUS_M + alt
    direction = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    wrong_e = field_of_model(radius * direction[None], np.array([2025.5]), igrf14())[0]
    wrong = rot_ne_at(lat, lon) @ wrong_e
    assert wrong - right == pytest.approx((-298.0, 18.0, 85.0), abs=0.6)
    assert np.linalg.norm(wrong) - np.linalg.norm(right) == pytest.approx(-22.6, abs=0.1)


def test_trap_of_one_day():
    """One day of slip in the decimal year at Ottawa is 0.28 nT."""
    place = (np.radians(45.3), np.radians(-75.7), 300.0)
    day = np.linalg.norm(igrf(*place, 2025.5 + 1.0 / 365.0)) - np.linalg.norm(igrf(*place, 2025.5))
    assert day == pytest.approx(-0.28, abs=0.005)


def test_trap_of_sea_level():
    """34 m of geoid at Ottawa are 0.92 nT."""
    lat, lon = np.radians(45.3), np.radians(-75.7)
    step = np.linalg.norm(igrf(lat, lon, 300.0, 2025.5)) - np.linalg.norm(igrf(lat, lon, 334.0, 2025.5))
    assert step == pytest.approx(0.92, abs=0.01)


def test_years_are_paired_with_places():
    lat, lon, alt, year = random_places(20)
    one_by_one = [igrf(*place) for place in zip(lat, lon, alt, year, strict=True)]
    np.testing.assert_allclose(igrf(lat, lon, alt, year), one_by_one, rtol=0, atol=1e-8)


def test_shapes_broadcast():
    field_n, gradient_n = igrf(0.3, np.linspace(0, 1, 6).reshape(2, 3), 100.0, 2025.0, gradient=True)
    assert field_n.shape == (2, 3, 3)
    assert gradient_n.shape == (2, 3, 3, 3)
    assert igrf(0.3, 0.4, 100.0, 2025.0).shape == (3,)


def test_continuous_over_an_epoch():
    before, after = (igrf(0.5, 1.0, 0.0, year) for year in (2020.0 - 1e-9, 2020.0 + 1e-9))
    np.testing.assert_allclose(before, after, atol=1e-5)


@pytest.mark.parametrize("year", [1899.999, 2030.001, float("nan")])
def test_years_outside_are_refused(year):
    with pytest.raises(ValueError, match=f"1900 to 2030, not {year:g}"):
        igrf(0.5, 1.0, 0.0, [2000.0, year])


def test_degrees_are_refused():
    with pytest.raises(ValueError, match=r"latitude 45 rad is beyond a pole"):
        igrf(45.0, 1.0, 0.0, 2025.0)


@pytest.mark.parametrize(
    ("when", "year"),
    [
        (datetime(2025, 1, 1, tzinfo=UTC), 2025.0),
        (datetime(2024, 7, 2, tzinfo=UTC), 2024.5),
        (datetime(2025, 3, 13), 2025.0 + 71.0 / 365.0),
        (datetime(2023, 12, 31, 12, tzinfo=UTC), 2023.0 + 364.5 / 365.0),
    ],
)
def test_decimal_year(when, year):
    assert decimal_year(when) == pytest.approx(year, abs=1e-12)


def test_decimal_years_cross_new_year():
    start = datetime(2023, 12, 31, 23, 59, 0, tzinfo=UTC)
    seconds = np.array([-3e7, -1.0, 0.0, 59.0, 60.0, 61.0, 1e5, 4e7, 2e8])
    wanted = [decimal_year(start + timedelta(seconds=float(s))) for s in seconds]
    np.testing.assert_allclose(decimal_years(start, seconds), wanted, rtol=0, atol=1e-11)


def test_chunks_do_not_matter():
    lat, lon, alt, year = random_places(harmonics.CHUNK + 7)
    year[:] = 2025.3
    whole = igrf(lat, lon, alt, year)
    np.testing.assert_allclose(whole[-5:], igrf(lat[-5:], lon[-5:], alt[-5:], year[-5:]), rtol=0, atol=1e-9)
