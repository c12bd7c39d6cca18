"""What input columns are of, by their names."""

import pytest

from magsim.compensation.columns import TollesLawsonColumns
from magsim.compensation.networks.parts import part_of, places, refuse
from magsim.errors import RequestError
from tests.support.worlds import World, calibration


@pytest.mark.parametrize("terms", [16, 18])
@pytest.mark.parametrize("eddy", ["direction", "field"])
@pytest.mark.parametrize("strength_nt", [None, 45_000.0])
def test_terms_of_tolles_and_lawson_are_known_as_the_columns_name_them(terms, eddy, strength_nt):
    design = TollesLawsonColumns(terms, "cabin", eddy=eddy, strength_nt=strength_nt)(calibration(World(circuits=1)))
    assert tuple(map(part_of, design.names)) == design.groups
    assert set(design.groups) == {"permanent", "induced", "eddy"}


def test_places_of_parts():
    names = ("lat", "u1", "roll", "B u1 u2'", "time", "lon", "B u1 u2")
    assert places(names, "position") == (0, 5)
    assert places(names, "other", "permanent") == (1, 2)
    assert [places(names, part) for part in ("time", "eddy", "induced", "travel")] == [(4,), (3,), (6,), ()]


def test_columns_that_nobody_reads_are_named():
    refuse(("u1", "time"), "position", reader="mode tl", allowed="others")
    with pytest.raises(RequestError, match=r"inputs: mode tl reads no column lat, lon; allowed: others"):
        refuse(("lat", "u1", "lon"), "position", "time", reader="mode tl", allowed="others")
