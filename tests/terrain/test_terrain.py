"""Surfaces against exact shapes, their slopes against differences, and grid files that are wrong."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from magsim.earth import radii_of_curvature
from magsim.errors import DataError, RequestError
from magsim.streams import stream
from magsim.terrain import Flat, Fractal, Ground, TangentPlane, TerrainSurface, read_grid

LAT, LON = np.radians(46.5), np.radians(8.0)
PLANE = TangentPlane(LAT, LON)


def fractal(seed: int = 1, **change: float) -> Fractal:
    settings = {"mean_m": 500.0, "relief_m": 400.0, "longest_m": 8000.0, "shortest_m": 250.0, "hurst": 0.8}
    return Fractal(PLANE, stream(seed, "test"), **(settings | change))


def places(count: int = 400, reach_m: float = 4000.0) -> tuple[np.ndarray, np.ndarray]:
    north, east = stream(5, "places").uniform(-reach_m, reach_m, (2, count))
    return PLANE.geodetic(north, east)


def check_slope(surface: TerrainSurface, lat: np.ndarray, lon: np.ndarray, step_m: float = 0.05) -> None:
    meridian, normal = radii_of_curvature(lat)
    up, right = step_m / meridian, step_m / (normal * np.cos(lat))
    north = (surface.height(lat + up, lon) - surface.height(lat - up, lon)) / (2.0 * step_m)
    east = (surface.height(lat, lon + right) - surface.height(lat, lon - right)) / (2.0 * step_m)
    for slope, expected in zip(surface.slope(lat, lon), (north, east), strict=True):
        np.testing.assert_allclose(slope, expected, atol=2e-6)


def text_of(heights: np.ndarray, header: str) -> str:
    """An ESRI ASCII grid; heights from the south, as arrays count, to the north first, as the file counts."""
    rows = "\n".join(" ".join(repr(float(v)) for v in row) for row in heights[::-1])
    return f"ncols {heights.shape[1]}\nnrows {heights.shape[0]}\n{header}\n{rows}\n"


@pytest.fixture
def grid(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        path = tmp_path / "g.asc"
        path.write_bytes(text.encode("latin-1"))
        return path

    return write


def test_the_plane_and_its_way_back():
    north, east = stream(2, "plane").uniform(-30_000.0, 30_000.0, (2, 50))
    for alt in (0.0, 3000.0):
        plane = TangentPlane(LAT, LON, alt)
        lat, lon = plane.geodetic(north, east)
        back = plane.place(lat, lon)
        np.testing.assert_allclose(back, (north, east), atol=1e-6)


def test_flat_ground_and_the_three_heights():
    ground = Ground(Flat(120.0), geoid_m=48.0)
    lat, lon = places(7)
    np.testing.assert_array_equal(ground.height(lat, lon), np.full(7, 168.0))
    assert ground.above_sea(np.array(1048.0)) == 1000.0
    assert ground.highest_m == 168.0
    assert ground.level
    assert all(not np.any(slope) for slope in ground.slope(lat, lon))


def test_fractal_ground_is_its_seed():
    lat, lon = places()
    height = fractal().height(lat, lon)
    np.testing.assert_array_equal(height, fractal().height(lat, lon))
    assert np.abs(height - fractal(2).height(lat, lon)).max() > 50.0
    # one place alone has the height that it has among others
    assert fractal().height(lat[3], lon[3]) == height[3]


def test_fractal_ground_has_its_relief_and_its_power_law():
    lat, lon = places(20_000, 60_000.0)
    surface = fractal()
    height = surface.height(lat, lon)
    assert 4.0 * height.std() == pytest.approx(400.0, rel=0.05)
    assert height.mean() == pytest.approx(500.0, abs=10.0)
    assert height.max() < surface.highest_m
    wavelength, amplitude = surface.waves
    slope = np.polyfit(np.log(wavelength), np.log(amplitude), 1)[0]
    assert slope == pytest.approx(0.8, abs=1e-9)
    assert 250.0 < wavelength.min() < 260.0
    assert 7700.0 < wavelength.max() < 8000.0


def test_fractal_structure_function_is_self_affine():
    """Mean square of height differences over a distance d grows as d^(2 H) between the end wavelengths."""
    lat, lon = places(40_000, 50_000.0)
    surface = fractal(longest_m=100_000.0, shortest_m=30.0, hurst=0.6)
    meridian, _ = radii_of_curvature(LAT)
    base, squares = surface.height(lat, lon), []
    for distance in (300.0, 1200.0):
        squares.append(np.mean((surface.height(lat + distance / meridian, lon) - base) ** 2))
    assert np.log(squares[1] / squares[0]) / np.log(4.0) == pytest.approx(1.2, abs=0.12)


def test_fractal_slope():
    check_slope(fractal(), *places())


def test_a_local_grid_gives_parabolas_back(grid):
    x, y = np.meshgrid(np.arange(-5000.0, 5001.0, 250.0), np.arange(-4500.0, 4501.0, 250.0))

    def shape(east: np.ndarray, north: np.ndarray) -> np.ndarray:
        return 300.0 + 0.02 * east - 0.05 * north + 1e-5 * (east**2 - north * east) + 2e-5 * north**2

    header = "xllcenter -5000\nyllcenter -4500\ncellsize 250"
    surface = read_grid(grid(text_of(shape(x, y), header)), plane=PLANE)
    lat, lon = places(reach_m=4200.0)
    north, east = PLANE.place(lat, lon)
    np.testing.assert_allclose(surface.height(lat, lon), shape(east, north), atol=1e-8)
    check_slope(surface, lat, lon)


def test_a_geographic_grid_stands_where_it_says(grid):
    heights = np.arange(20.0).reshape(4, 5)
    header = "XLLCORNER 179.9\nYLLCORNER -10.0\nCELLSIZE 0.05\nNODATA_value -9999"
    surface = read_grid(grid(text_of(heights, header)))
    # centers of cells, the last two beyond the date line
    lat = np.radians(-10.0 + 0.025 + 0.05 * np.arange(4))
    lon = np.radians(179.9 + 0.025 + 0.05 * np.arange(5))
    lon = np.where(lon > np.pi, lon - 2.0 * np.pi, lon)
    found = surface.height(lat[:, None], lon[None, :])
    np.testing.assert_allclose(found, heights, atol=1e-6)
    check_slope(surface, np.radians([-9.93, -9.9]), np.radians([179.98, -179.95]))


def test_the_grid_is_smooth_across_its_lines(grid):
    heights = stream(8, "rough").uniform(0.0, 100.0, (9, 9))
    surface = read_grid(grid(text_of(heights, "xllcenter 0\nyllcenter 0\ncellsize 100")), plane=PLANE)
    assert surface.heights_m.max() <= surface.highest_m
    for line in (200.0, 500.0):
        at = PLANE.geodetic(np.array([line - 1e-4, line + 1e-4]), np.array([333.0, 333.0]))
        for values in (surface.height(*at), *surface.slope(*at)):
            assert abs(values[1] - values[0]) < 1e-3
    lat, lon = PLANE.geodetic(*stream(9, "p").uniform(1.0, 799.0, (2, 5000)))
    assert surface.height(lat, lon).max() <= surface.highest_m


def test_outside_of_the_grid(grid):
    surface = read_grid(grid(text_of(np.zeros((3, 3)), "xllcenter 0\nyllcenter 0\ncellsize 100")), plane=PLANE)
    with pytest.raises(DataError, match=r"leaves the terrain grid at latitude 46\.5.*from 0 to 200"):
        surface.height(*PLANE.geodetic(np.array([100.0, 100.0]), np.array([100.0, 201.0])))


def test_points_without_data(grid):
    heights = np.full((3, 3), 7.0)
    heights[1, 1] = -9999.0
    header = "xllcenter 0\nyllcenter 0\ncellsize 100\nnodata_value -9999"
    path = grid(text_of(heights, header))
    with pytest.raises(RequestError, match=r"g\.asc:8: value 2 is the mark of a point without data"):
        read_grid(path, plane=PLANE)
    assert read_grid(path, plane=PLANE, nodata_m=0.0).heights_m[1, 1] == 0.0


GOOD = "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 1\n1 2\n3 4\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ":1: is not an ESRI ASCII grid"),
        ("\x89HDF\r\n\x1a\n", "is not an ESRI ASCII grid"),
        ("1 2 3\n", "is not an ESRI ASCII grid"),
        (GOOD.replace("cellsize 1\n", ""), ":5: the header is not complete: cellsize is missing"),
        (GOOD.replace("xllcenter 0", "xllcenter 0\nxllcorner 0"), "xllcorner or xllcenter are both given"),
        (GOOD.replace("ncols 2", "ncols 2\nncols 2"), ":2: ncols is given twice"),
        (GOOD.replace("ncols 2", "ncols 2 3"), ":1: ncols has 2 values"),
        (GOOD.replace("ncols 2", "ncols 15000000"), "points are too many"),
        (GOOD.replace("ncols 2", "ncols 2.5"), ":1: ncols: '2.5' is not allowed"),
        (GOOD.replace("ncols 2", "ncols -2"), ":1: ncols: '-2' is not allowed"),
        (GOOD.replace("ncols 2", "ncols 1" + "0" * 400), ":1: ncols"),
        (GOOD.replace("cellsize 1", "cellsize 0"), "cellsize: 0 is not allowed"),
        (GOOD.replace("cellsize 1", "cellsize nan"), ":5: cellsize: 'nan' is not a number"),
        (GOOD.replace("cellsize 1", "depth 1"), ":5: 'depth' is no key of the header"),
        (GOOD.replace("cellsize 1", "cellsize 100"), "no degrees of longitude and latitude"),
        (GOOD.replace("3 4", "3"), ":7: the file ends after 3 of 2 x 2 heights"),
        (GOOD.replace("3 4", "3 4 5"), ":7: there are more than 2 x 2 heights"),
        (GOOD.replace("3 4", "3 x"), ":7: value 2: 'x' is not a number"),
        (GOOD.replace("3 4", "3 1,5"), ":7: value 2: '1,5' is not a number"),
        (GOOD.replace("3 4", "3 1_5"), ":7: value 2: '1_5' is not a number"),
        (GOOD.replace("3 4", "3 inf"), ":7: value 2: 'inf' is not a number"),
        (GOOD.replace("3 4", "3 1e300"), ":7: value 2: 1e+300 m is no height"),
        (GOOD.replace("3 4", "3 \xff\x00"), ":7: value 2:"),
    ],
)
def test_wrong_grids(grid, text, message):
    with pytest.raises(RequestError) as caught:
        read_grid(grid(text))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_grid_files_that_are_none(tmp_path):
    for path in (tmp_path, tmp_path / "none.asc", tmp_path / ("x" * 300), Path("a\0b")):
        with pytest.raises(RequestError):
            read_grid(path)
