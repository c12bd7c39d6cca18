"""A swell is refused where the path that will be flown crosses land, before it is flown."""

import pytest

from magsim.errors import RequestError
from magsim.flight import check_over_sea
from magsim.loading import load_scenario
from magsim.simulation import simulate
from tests.planning.test_sea import heights_file


def test_a_path_that_reaches_land_is_refused_before_it_is_flown(tmp_path):
    """Water of 50 m at the start, land of 100 m 50 km to the east, and a line to the east-north-east."""
    path = heights_file(tmp_path, "-50 -50 100")
    message = r"over.toml:\d+: field\.swell: .* leg 1 of circuit 1 crosses land, up to [\d.]+ m high; allowed"
    with pytest.raises(RequestError, match=message):
        simulate(path, set={"start.alt_m": 100.0, "pattern.leg_m": 40_000.0})
    short = load_scenario(path, ["start.alt_m=100", "pattern.leg_m=10000.0"])
    check_over_sea(short.scenario, short.aircraft, short.ground)
