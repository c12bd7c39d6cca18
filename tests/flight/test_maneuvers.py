"""Trains: their times, their easing, their measure."""

import math

import numpy as np
import pytest

from magsim.flight.maneuvers import GRID_PERIODS_S, LoopResponse, Sweep, fit_sine, sweeps_of_leg
from magsim.scenario import Box


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
    first, second, third = sweeps_of_leg(box, 1, 1, 2, 100.0)
    assert (first.start_s, first.stop_s, first.amplitude_deg) == (102.0, 120.0, 8.0)
    assert (second.start_s, second.stop_s, second.period_s) == (127.0, 147.0, 10.0)
    assert (third.start_s, third.stop_s) == (151.0, 159.0)
    # Easing takes half a period where there is room; two trains of one axis share the rest between them.
    assert (first.ease_in_s, first.ease_out_s) == (2.0, 3.0)
    assert (second.ease_in_s, second.ease_out_s) == (5.0, 2.0)
    assert (third.ease_in_s, third.ease_out_s) == (2.0, 1.0)


def test_easing_leaves_the_integral_without_mean() -> None:
    # The integral of A sin(omega t) swings about zero if it stands at -A / omega when the first cycle begins.
    sweep = Sweep("roll", 1, 1, 10.0, 6.0, 3, 12.0, 3.0, 3.0)
    time = np.linspace(0.0, 40.0, 40001)
    angle = np.array([sweep.angle(t) for t in time])
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (angle[1:] + angle[:-1]) * np.diff(time))])
    inside = (time >= 10.0) & (time < 28.0)
    swing = math.radians(12.0) / sweep.omega
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
