"""Keys that a maneuver does not have are refused with what is allowed."""

import pytest

from magsim.errors import RequestError
from magsim.loading import load_scenario

ALIKE = "the cycles of a combined maneuver are alike; allowed: for trains on one axis"


def test_a_combined_maneuver_does_not_scatter_and_has_no_roll_part():
    swings = '[{axis="pitch", amplitude_deg=3.0, period_scatter=0.1}, {axis="yaw", amplitude_deg=3.0, roll_part=0.3}]'
    setting = f'pattern.maneuvers=[{{axis="combined", amplitude_scatter=0.1, swings={swings}}}]'
    with pytest.raises(RequestError) as caught:
        load_scenario("patterns/box", [setting])
    text = str(caught.value)
    assert f"pattern.maneuvers[0].amplitude_scatter: {ALIKE}" in text
    assert f"pattern.maneuvers[0].swings[0].period_scatter: {ALIKE}" in text
    assert "pattern.maneuvers[0].swings[1].roll_part: the roll of a combined maneuver is a swing of its own" in text
    assert len(text.splitlines()) == 3
