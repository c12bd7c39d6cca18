"""How a kinematic helicopter moves on a straight line, beside one whose lateral derivatives are published."""

from typing import NamedTuple

import numpy as np
from scipy.signal import coherence, welch

from magsim.aircraft import load_aircraft, load_bird
from magsim.flight import fly
from tests.benchmarks.rows import Row, at_most, stated, within
from tests.support.helicopters import LINE, scenario_of
from tests.support.lateral import PILOTS, on_a_line, weighted

SEEDS = (1, 2, 3, 4)
ROW_HZ, WINDOW = 10.0, 512
"""Rate of the rows, and how many one spectrum takes."""

ROLL_RMS_DEG = (1.0, 2.0)
"""The rule of thumb for a survey line; the reference has 1.2 to 1.6 degrees with hands that add noise."""


class Attitude(NamedTuple):
    """Roll and heading [deg], rates [deg/s] and pitch [deg] on the rows of a line."""

    roll: np.ndarray
    pitch: np.ndarray
    heading: np.ndarray
    roll_rate: np.ndarray
    yaw_rate: np.ndarray


def flown(seed: int, leg_m: float) -> Attitude:
    """Fly a line with the shipped helicopter, as it sways by its own file."""
    helicopter = load_aircraft("helicopter")
    scenario = scenario_of(helicopter, load_bird("bird"), LINE | {"leg_m": leg_m}, seed=seed, flight={})
    flight = fly(scenario, helicopter)
    at = flight.carrier.at(np.arange(0.0, flight.duration_s, 1.0 / ROW_HZ))
    attitude, rates = np.degrees(at.attitude), np.degrees(at.rate_b)
    return Attitude(*attitude.T, rates[:, 0], rates[:, 2])


def rows() -> list[Row]:
    """Figures of the carrier over several lines of 7 minutes, and the range of the reference."""
    lines = [flown(seed, 12_000.0) for seed in SEEDS]
    reference = [on_a_line(gust, pilot) for gust in (0.5, 1.0, 1.5) for pilot in PILOTS]
    low, high = (pick(line.coherence for line in reference) for pick in (min, max))

    def rms(name: str) -> float:
        return float(np.sqrt(np.mean([np.var(getattr(line, name)) for line in lines])))

    spectra = [welch(line.roll, ROW_HZ, nperseg=WINDOW) for line in lines]
    together = [
        weighted(at, coherence(line.roll, line.heading, ROW_HZ, nperseg=WINDOW)[1], power)
        for line, (at, power) in zip(lines, spectra, strict=True)
    ]
    fastest = max(float(np.abs(line.roll_rate).max()) for line in lines)
    return [
        within("helicopter_roll_rms_deg", rms("roll"), "deg", *ROLL_RMS_DEG),
        stated("helicopter_roll_max_deg", max(float(np.abs(line.roll).max()) for line in lines), "deg"),
        at_most("helicopter_roll_rate_max_dps", fastest, "deg/s", 12.0),
        stated("helicopter_pitch_rms_deg", rms("pitch"), "deg"),
        stated("helicopter_heading_rms_deg", rms("heading"), "deg"),
        within("helicopter_yaw_roll_coherence", float(np.mean(together)), "1", low, high),
        stated("reference_roll_rms_least_deg", min(line.roll_deg for line in reference), "deg"),
        stated("reference_roll_rms_most_deg", max(line.roll_deg for line in reference), "deg"),
        stated("reference_roll_rate_rms_most_dps", max(line.roll_rate_dps for line in reference), "deg/s"),
    ]
