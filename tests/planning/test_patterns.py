"""Courses and parts of patterns."""

import pytest

from magsim.loading import load_scenario
from magsim.scenario import parts_of
from tests.support.scenarios import BARE, problems


@pytest.mark.parametrize(
    ("kind", "heading", "allowed"),
    [("fom", 45.0, "0, 90, 180, 270"), ("fom_peak_to_peak", 1.0, "0, 90"), ("diamond", 0.0, "45, 135, 225, 315")],
)
def test_patterns_of_named_headings_have_them(write, kind, heading, allowed):
    text = BARE.replace('"box"', f'"{kind}"')
    (line,) = problems(write(text), f"start.heading_deg={heading}")
    assert f"the first leg of a {kind} cannot have the course {heading:g} deg" in line
    assert f"allowed: {allowed}" in line


def test_parts_of_a_sequence_are_checked_each(write):
    text = BARE.replace(
        '[pattern]\nkind = "box"',
        """[pattern]
kind = "sequence"
[[pattern.parts]]
kind = "box"
[[pattern.parts]]
kind = "diamond"
heading_deg = 45.0
leg_m = 1000.0
[[pattern.parts.maneuvers]]
axis = "roll"
amplitude_deg = 10.0""",
    )
    (line,) = problems(write(text), "pattern.parts[0].turn=up")
    assert line == "--set pattern.parts[0].turn: 'up' is not allowed; allowed: 'right', 'left'"
    (line,) = problems("s.toml")
    assert line.startswith("s.toml:19: pattern.parts[1].maneuvers: leg 1 needs 39 s for its maneuvers")
    pattern = load_scenario("s.toml", ["pattern.parts[1].leg_m=5000"]).scenario.pattern
    assert (pattern.circuits, pattern.legs, len(parts_of(pattern))) == (2, 4, 2)
