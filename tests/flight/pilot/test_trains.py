"""Trains: their times, their easing, their measure."""

import math
from itertools import pairwise

import numpy as np
import pytest

from magsim.flight.path.elements import PathLabel
from magsim.flight.pilot.calibration import GRID_PERIODS_S
from magsim.flight.pilot.measure import fit_sine
from magsim.flight.pilot.response import BOUNDS, LoopResponse
from magsim.flight.pilot.trains import SineTrain, trains_of_leg, trains_of_maneuver
from magsim.scenario import Box, Cloverleaf, Combined


def test_fit_finds_a_sine_under_offset_and_slope() -> None:
    time = np.arange(0.0, 15.0, 1.0 / 30.0) + 100.0
    omega = 2.0 * math.pi / 6.0
    values = 0.2 * np.sin(omega * (time - 98.5) + 0.7) + 0.05 - 0.01 * time
    fit = fit_sine(time, values, omega, 98.5)
    assert fit.amplitude == pytest.approx(0.2, rel=1e-9)
    assert fit.phase == pytest.approx(0.7, rel=1e-9)
    assert fit.residual_rms < 1e-12


def test_fit_tells_what_is_no_sine() -> None:
    time = np.linspace(0.0, 12.0, 361)
    omega = 2.0 * math.pi / 6.0
    third = 0.03 * np.sin(3.0 * omega * time)
    fit = fit_sine(time, np.sin(omega * time) + third, omega, 0.0)
    assert fit.residual_rms == pytest.approx(0.03 / math.sqrt(2.0), rel=0.02)


def test_trains_follow_each_other() -> None:
    trains = [
        {"axis": "pitch", "amplitude_deg": [5.0, 8.0], "period_s": 6.0, "cycles": 3, "rest_s": 7.0},
        {"axis": "roll", "amplitude_deg": 10.0, "period_s": [5.0, 10.0], "cycles": 2, "rest_s": 4.0},
        {"axis": "roll", "amplitude_deg": 4.0, "period_s": 8.0, "cycles": 1, "rest_s": 1.0},
    ]
    box = Box(lead_s=2.0, maneuvers=trains)
    first, second, third = trains_of_leg(box, PathLabel(1, 2, False, 90.0, leg_index=1), 100.0, 133.0)
    assert (first.start_s, first.stop_s, first.amplitude_deg) == (102.0, 120.0, 8.0)
    assert (second.start_s, second.stop_s, second.period_s) == (127.0, 147.0, 10.0)
    assert (third.start_s, third.stop_s) == (151.0, 159.0)
    # Easing takes half a period where there is room; two trains of one axis share the rest between them.
    assert (first.ease_in_s, first.ease_out_s) == (2.0, 3.0)
    assert (second.ease_in_s, second.ease_out_s) == (5.0, 2.0)
    assert (third.ease_in_s, third.ease_out_s) == (2.0, 1.0)


def test_easing_leaves_the_integral_without_mean() -> None:
    # The integral of A sin(omega t) swings about zero if it stands at -A / omega when the first cycle begins.
    train = SineTrain("roll", 1, 1, 10.0, 6.0, 3, 12.0, 3.0, 3.0)
    time = np.linspace(0.0, 40.0, 40001)
    angle = np.array([train.angle(t) for t in time])
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (angle[1:] + angle[:-1]) * np.diff(time))])
    inside = (time >= 10.0) & (time < 28.0)
    swing = math.radians(12.0) / train.omega
    assert integral[inside].mean() == pytest.approx(0.0, abs=1e-3 * swing)
    assert integral[-1] == pytest.approx(0.0, abs=1e-3 * swing)
    assert np.abs(integral[inside]).max() == pytest.approx(swing, rel=1e-3)


def test_response_is_smooth_between_the_periods_that_were_flown() -> None:
    x = np.array(GRID_PERIODS_S)
    response = LoopResponse(x, {"roll": 1.0 + 0.1 * np.log(x)}, {"roll": -0.3 / x})
    gain, phase = response.at("roll", 6.5)
    assert gain == pytest.approx(1.0 + 0.1 * math.log(6.5), rel=1e-9)
    assert phase == pytest.approx(-0.3 / 6.5, rel=1e-3)
    assert response.at("roll", 30.0)[0] == pytest.approx(response.gain["roll"][-1])
    back = LoopResponse.from_arrays(response.arrays())
    assert back.at("roll", 6.5) == (gain, phase)


COMBINED = {
    "axis": "combined",
    "cycles": 2,
    "swings": [
        {"axis": "roll", "amplitude_deg": [8.0, 4.0], "period_s": 6.0, "phase_deg": 90.0},
        {"axis": "pitch", "amplitude_deg": 3.0, "period_s": 10.0},
    ],
}


def test_a_combined_maneuver_swings_several_axes_in_their_phases() -> None:
    box = Box(lead_s=12.0, maneuvers=[COMBINED, {"axis": "yaw", "amplitude_deg": 5.0, "period_s": 5.0}])
    pitch, roll, yaw = trains_of_leg(box, PathLabel(1, 2, False, 90.0, leg_index=1), 100.0, 133.0)
    # Two cycles of the longest period; three whole ones of the other fit, a quarter of a period late.
    assert (pitch.axis, pitch.kind, pitch.start_s, pitch.stop_s, pitch.amplitude_deg) == (
        "pitch",
        "combined",
        112.0,
        132.0,
        3.0,
    )
    assert (roll.axis, roll.kind, roll.start_s, roll.cycles, roll.amplitude_deg) == ("roll", "combined", 113.5, 3, 4.0)
    assert (yaw.axis, yaw.kind, len(yaw.maneuver), yaw.start_s) == ("yaw", "yaw", 1, 138.0)
    # Sine against minus cosine: at its quarter period the one peaks where the other passes zero.
    assert roll.angle(113.5) == pytest.approx(0.0, abs=1e-12)
    assert roll.angle(115.0) == pytest.approx(math.radians(4.0))


def test_the_same_combined_maneuver_is_the_same_request_wherever_it_is_flown() -> None:
    box = Box(lead_s=12.0, maneuvers=[COMBINED])
    first, again = (
        trains_of_leg(box, PathLabel(1, leg, False, 90.0, leg_index=leg), at_s, 133.0)
        for leg, at_s in ((1, 0.1), (3, 777.7))
    )
    other = trains_of_leg(box, PathLabel(1, 2, False, 90.0, leg_index=2), 0.1, 133.0)
    assert first[0].maneuver == first[1].maneuver == again[0].maneuver != other[0].maneuver
    pitch, roll = first[0].maneuver
    assert (pitch.axis, pitch.lag_s, roll.axis, roll.lag_s, roll.amplitude_deg) == ("pitch", 0.0, "roll", 1.5, 4.0)
    flown = trains_of_maneuver(first[0].maneuver, 50.0)
    for mine, theirs in zip(flown, first, strict=True):
        assert mine.start_s - 50.0 == pytest.approx(theirs.start_s - first[0].start_s)
        assert mine.angle(55.5) == pytest.approx(theirs.angle(5.5 + first[0].start_s))


def test_the_largest_amplitude_is_reported_with_its_reason() -> None:
    period = np.array([3.0, 6.0, 12.0])
    response = LoopResponse(
        period,
        {},
        {},
        {"yaw": np.array([10.0, 20.0, 40.0])},
        {"yaw": np.array([2.0, 2.0, float(BOUNDS.index("beta"))])},
    )
    # In proportion to the period, so straight between the logarithms too.
    assert response.largest_at("yaw", 4.0) == (pytest.approx(40.0 / 3.0), "rudder")
    assert response.largest_at("yaw", 11.0) == (pytest.approx(110.0 / 3.0), "beta")
    assert response.nearest_s("yaw", 15.0, 3.2) == 4.5
    assert response.nearest_s("yaw", 15.0, 7.0) == 7.0
    assert response.nearest_s("yaw", 41.0, 5.0) is None


def test_an_envelope_of_none_starts_at_once() -> None:
    hard = Box(maneuvers=[{"axis": "roll", "amplitude_deg": 5.0, "envelope_cycles": 0.0}])
    (train,) = trains_of_leg(hard, PathLabel(1, 1, False, 0.0), 0.0, 133.0)
    assert (train.ease_in_s, train.ease_out_s) == (0.0, 0.0)
    assert train.angle(train.start_s - 0.01) == 0.0
    slow = Box(maneuvers=[{"axis": "roll", "amplitude_deg": 5.0, "period_s": 4.0, "envelope_cycles": 1.5}])
    (train,) = trains_of_leg(slow, PathLabel(1, 1, False, 0.0), 0.0, 133.0)
    assert (train.ease_in_s, train.ease_out_s) == (6.0, 6.0)


@pytest.mark.parametrize("leg_s", [110.0, 133.0, 160.0])
def test_nothing_swings_near_a_center(leg_s: float) -> None:
    trains = [{"axis": axis, "amplitude_deg": 5.0, "period_s": 5.0, "rest_s": 5.0} for axis in ("pitch", "roll", "yaw")]
    clover = Cloverleaf(lead_s=10.0, quiet_s=10.0, maneuvers=trains)
    trains = trains_of_leg(clover, PathLabel(1, 1, False, 0.0), 0.0, leg_s)
    assert [train.axis for train in trains] == ["pitch", "roll", "yaw"]
    assert any(train.stop_s < 0.5 * leg_s for train in trains)
    for train in trains:
        begin, end = train.start_s - train.ease_in_s, train.stop_s + train.ease_out_s
        assert end <= 0.5 * leg_s - 12.0 + 1e-9 or begin >= 0.5 * leg_s + 12.0 - 1e-9
    for before, after in pairwise(trains):
        assert after.start_s >= before.stop_s + 5.0 - 1e-9


def test_an_axis_stands_once_in_a_combined_maneuver() -> None:
    twice = COMBINED | {"swings": [COMBINED["swings"][0]] * 2}
    with pytest.raises(ValueError, match="roll, roll: an axis is given twice"):
        Combined.model_validate(twice)
