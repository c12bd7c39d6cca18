"""Wind, shear and gusts against the airspeed."""

import pytest

from magsim.loading import load_scenario
from tests.support.scenarios import GOOD, problems

GUST = "{ at_s = 9.0, duration_s = 5.0, north_mps = 18.0 }"


@pytest.mark.parametrize(
    ("air", "text"),
    [
        (
            "wind_north_mps = 60.0\nwind_east_mps = -45.0\n",
            "air.wind_north_mps: a wind of 75 m/s is no slower than the airspeed of 75 m/s; allowed: together less",
        ),
        (
            'wind_east_mps = 70.0\n[air.shear]\nkind = "linear"\neast_per_s = 0.05\n',
            "air.shear: a wind that shear brings to 80.0 m/s at 3200 m is no slower than the airspeed of 75 m/s",
        ),
        (
            f"wind_east_mps = 40.0\ngusts = [{GUST}, {GUST.replace('9.0', '12.0')}]\n",
            "air.gusts: a wind of 40.0 m/s with gusts of 36.0 m/s is no slower than the airspeed of 75 m/s",
        ),
        (
            "wind_east_mps = -50.0\n[air.random_gusts]\nevery_s = 10.0\nspeed_mps = 30.0\n",
            "air.random_gusts: a wind of 50.0 m/s with gusts of 30.0 m/s is no slower than the airspeed of 75 m/s",
        ),
        (
            "[air.random_gusts]\nevery_s = 10.0\nspeed_mps = 3.0\nshortest_s = 5.0\nlongest_s = 4.0\n",
            "air.random_gusts.longest_s: 4 s is shorter than shortest_s; allowed: 5 or more",
        ),
        ('[air.shear]\nkind = "cubic"\n', "air.shear.kind: 'cubic' is not allowed; allowed: 'linear', 'log'"),
        ('turbulence_model = "tustin"\n', "air.turbulence_model: unknown key"),
        ("turbulence_wind_mps = 5.0\n", "air.turbulence_wind_mps: unknown key"),
        (
            "turbulence_severity = 2\nturbulence_mps = 0.5\n",
            "air.turbulence_mps: 0.5 m/s and turbulence_severity = 2 are two strengths; allowed: one, the other 0",
        ),
        ("turbulence_mps = -0.5\n", "air.turbulence_mps: -0.5 is not allowed"),
        ("[[air.gusts]]\nat_s = 0.0\nduration_s = 5.0\n", "air.gusts[0].at_s: 0 is not allowed"),
    ],
)
def test_impossible_air(write, air, text):
    (line,) = problems(write(f"{GOOD}[air]\n{air}"))
    assert text in line


def test_gusts_that_do_not_meet_are_not_added(write):
    apart = "[[air.gusts]]\nat_s = 10.0\nduration_s = 2.0\neast_mps = 30.0\n"
    air = f"[air]\nwind_east_mps = 40.0\n{apart}{apart.replace('10.0', '12.0')}"
    loaded = load_scenario(write(GOOD + air))
    assert loaded.scenario.air.strongest_gust_mps() == 30.0
