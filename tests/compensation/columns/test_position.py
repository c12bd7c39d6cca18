"""Columns of the Earth's field along the path, against equation 11 of paper 002."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.columns import position_columns
from magsim.errors import DataError, RequestError
from tests.support.birds import PAIRS, bird, moved
from tests.support.worlds import EXACT, calibration, parts


@pytest.mark.parametrize("order", PAIRS)
@pytest.mark.parametrize("vertical", [False, True])
def test_columns_are_those_of_equation_11(order, vertical):
    r = bird(2)
    found = position_columns([r], order, vertical=vertical)
    (design,) = found.designs
    assert design.matrix.shape == (len(r), PAIRS[order] + vertical)
    lat, lon, alt = (r[name] for name in ("ins_lat_deg", "ins_lon_deg", "ins_alt_m"))
    x, y, z = (2.0 * (v - (v.min() + v.max()) / 2.0) / np.ptp(v) for v in (lat, lon, alt))
    expected, units, scale = [], [], []
    for n in range(1, order + 1):
        for k in range(n + 1):
            expected.append(x ** (n - k) * y**k)
            units.append("nT/deg" if n == 1 else f"nT/deg^{n}")
            scale.append((np.ptp(lat) / 2.0) ** (n - k) * (np.ptp(lon) / 2.0) ** k)
    expected += [z] if vertical else []
    units += ["nT/m"] if vertical else []
    scale += [np.ptp(alt) / 2.0] if vertical else []
    np.testing.assert_allclose(design.matrix, np.array(expected).T.reshape(len(r), -1), rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.scale, scale, rtol=1e-9)
    assert design.units == tuple(units)
    names = ("lat", "lon", "lat^2", "lat lon", "lon^2", "lat^3", "lat^2 lon", "lat lon^2", "lon^3", "lat^4")
    assert design.names[: min(PAIRS[order], 10)] == names[: PAIRS[order]]


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
    # those columns are the same to the last bits of a longitude
    here, far = (position_columns([x], 3, vertical=True).designs[0].matrix for x in (r, there))
    np.testing.assert_allclose(far, here, rtol=0, atol=1e-9)


def test_flights_of_one_place_share_one_field():
    """The parts of a flight, and one that is flown a little beside it."""
    train, valid, test = parts(calibration(EXACT, 0, "bird0"))
    found = position_columns([train, valid, test, moved(train, lat_deg=0.15)], 2, vertical=True)
    assert len(found.areas) == 1
    assert {design.names for design in found.designs} == {found.designs[0].names}
    assert found.designs[0].matrix.shape[1] == 6
    joined = np.concatenate([design.matrix for design in found.designs])[:, [0, 1, -1]]
    np.testing.assert_allclose([joined.min(axis=0), joined.max(axis=0)], [[-1.0] * 3, [1.0] * 3], rtol=1e-12)


def test_columns_of_another_place_are_zero():
    here, there = bird(2), moved(bird(2), lon_deg=3.0)
    found = position_columns([here, there], 1, vertical=False)
    assert found.designs[0].names == ("lat [1]", "lon [1]", "lat [2]", "lon [2]")
    (alone,) = position_columns([here], 1, vertical=False).designs
    np.testing.assert_array_equal(found.designs[0].matrix[:, :2], alone.matrix)
    assert not found.designs[0].matrix[:, 2:].any()
    assert not found.designs[1].matrix[:, :2].any()
    assert np.abs(found.designs[1].matrix[:, 2:]).max() == pytest.approx(1.0)


def test_flights_that_are_near_over_others_are_one_place():
    chain = [moved(bird(1), lat_deg=0.3 * i) for i in (0, 2, 1)]
    assert len(position_columns(chain[:2], 1, vertical=False).areas) == 2
    assert len(position_columns(chain, 1, vertical=False).areas) == 1


def test_height_alone_reads_no_position():
    r = bird(0)
    bare = replace(r, data={k: v for k, v in r.data.items() if k not in ("ins_lat_deg", "ins_lon_deg")})
    found = position_columns([bare, bare], 0, vertical=True)
    assert found.designs[0].names == ("height",)
    assert position_columns([bare], 0, vertical=False).designs[0].matrix.shape == (len(r), 0)


def test_missing_and_useless_positions_are_refused():
    r = bird(1)
    for name in ("ins_lon_deg", "ins_alt_m"):
        bare = replace(r, data={k: v for k, v in r.data.items() if k != name})
        with pytest.raises(RequestError, match=f"recording 'bird0' has no column {name}"):
            position_columns([bare], 1, vertical=True)
    broken = r["ins_lat_deg"].copy()
    broken[120] = np.nan
    with pytest.raises(DataError, match="ins_lat_deg is not finite at 12 s"):
        position_columns([replace(r, data={**r.data, "ins_lat_deg": broken})], 1, vertical=False)
    around = replace(r, data={**r.data, "ins_lon_deg": np.linspace(-180.0, 179.0, len(r))})
    with pytest.raises(DataError, match="covers 359 degrees of longitude, so a pole is near"):
        position_columns([around], 1, vertical=False)
    assert position_columns([around], 0, vertical=True).designs[0].names == ("height",)
