"""Calibration of combined maneuvers against a coupled plant whose exact inverse is known."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from magsim.errors import DataError, RequestError
from magsim.flight.pilot.combined import calibrate_maneuver, drives_from_arrays, drives_to_arrays
from magsim.flight.pilot.measure import ANGLES
from magsim.flight.pilot.response import Drive, LoopResponse
from magsim.flight.pilot.trains import ManeuverAxis, ManeuverKey, SineTrain, trains_of_maneuver
from magsim.trajectory import Trajectory

OWN = {"roll": 0.9, "pitch": 0.8, "yaw": 0.7}
COUPLING = {"roll": ("yaw", 0.2), "yaw": ("roll", -0.3)}
"""What an axis makes of the command of another one, beside what it makes of its own."""

ALONE = LoopResponse(
    np.array([3.0, 6.0, 12.0, 30.0]),
    {axis: np.full(4, gain) for axis, gain in OWN.items()},
    {axis: np.zeros(4) for axis in OWN},
)


def commands(trains: list[SineTrain], drives: dict[str, Drive], time: np.ndarray) -> dict[str, np.ndarray]:
    """Commands of the axes as drives and their feeds are defined, without envelopes."""
    sines, rates = {}, {}
    for s in trains:
        amplitude, angle = math.radians(s.amplitude_deg) / drives[s.axis].gain, s.omega * (time - s.start_s)
        sines[s.axis] = amplitude * np.sin(angle + drives[s.axis].lead)
        rates[s.axis] = amplitude * s.omega * np.cos(angle + drives[s.axis].lead)
    out = dict(sines)
    for axis, sine in sines.items():
        if drives[axis].feed is not None:
            other, (direct, quadrature) = COUPLING[axis][0], drives[axis].feed
            out[axis] = sine + direct * sines[other] + quadrature * rates[other]
    return out


def flown_by(bend: Callable[[np.ndarray], np.ndarray]) -> Callable[..., Trajectory]:
    def fly(trains: list[SineTrain], response: LoopResponse, stop_s: float) -> Trajectory:
        time = np.arange(0.0, stop_s + 1e-9, 1.0 / 30.0)
        command = commands(trains, next(iter(response.maneuvers.values())), time)
        attitude = np.zeros((len(time), 3))
        for axis, angle in command.items():
            other, factor = COUPLING.get(axis, ("", 0.0))
            attitude[:, ANGLES[axis]] = bend(OWN[axis] * angle + factor * command.get(other, np.zeros_like(time)))
        still = np.zeros(len(time))
        return Trajectory(time, still, still, still, np.zeros((len(time), 3)), attitude, attitude, np.zeros(3))

    return fly


def maneuver(*axes: tuple[str, float, float]) -> ManeuverKey:
    return tuple(
        ManeuverAxis(axis, 0.4 * i, period, 5, amplitude, 0.5 * period, 0.5 * period)
        for i, (axis, amplitude, period) in enumerate(axes)
    )


@pytest.mark.parametrize(
    "combination",
    [
        maneuver(("roll", 8.0, 6.0), ("yaw", 4.0, 6.0)),
        maneuver(("roll", 8.0, 6.0), ("yaw", 4.0, 9.0)),
        maneuver(("pitch", 5.0, 8.0), ("roll", 10.0, 5.0), ("yaw", 6.0, 7.0)),
    ],
)
def test_the_inverse_of_a_coupled_plant_is_found(combination: ManeuverKey) -> None:
    drives = calibrate_maneuver(combination, ALONE, flown_by(lambda angle: angle))
    trains = trains_of_maneuver(combination, 100.0)
    time = np.arange(100.0, 130.0, 0.05)
    command = commands(trains, drives, time)
    wanted = {s.axis: math.radians(s.amplitude_deg) * np.sin(s.omega * (time - s.start_s)) for s in trains}
    if "pitch" in wanted:
        np.testing.assert_allclose(command["pitch"], wanted["pitch"] / OWN["pitch"], atol=math.radians(0.05))
    # Both commands by the inverse of the plant's matrix.
    matrix = np.array([[OWN["roll"], COUPLING["roll"][1]], [COUPLING["yaw"][1], OWN["yaw"]]])
    exact = np.linalg.solve(matrix, np.stack([wanted["roll"], wanted["yaw"]]))
    np.testing.assert_allclose(command["roll"], exact[0], atol=math.radians(0.05))
    np.testing.assert_allclose(command["yaw"], exact[1], atol=math.radians(0.05))


def test_drives_are_kept_as_arrays() -> None:
    drives = {"pitch": Drive(0.8, 0.1), "roll": Drive(0.9, -0.2, (0.3, 0.4))}
    assert drives_from_arrays(drives_to_arrays(drives)) == drives


def test_what_cannot_be_closed_is_refused() -> None:
    combination = maneuver(("roll", 8.0, 6.0), ("yaw", 4.0, 6.0))
    stop = math.radians(3.0)
    message = (
        r"roll 8 deg in 6 s, yaw 4 deg in 6 s cannot be flown as commanded: .*roll is off by \d\.\d\d deg.*; allowed: "
    )
    with pytest.raises(RequestError, match=message):
        calibrate_maneuver(combination, ALONE, flown_by(lambda angle: np.clip(angle, -stop, stop)))


def test_a_flight_that_ends_early_is_reported() -> None:
    def crash(*_: object) -> Trajectory:
        msg = "the flight stalled at t = 31.0 s"
        raise DataError(msg)

    with pytest.raises(
        RequestError, match=r"cannot be flown as commanded: the flight stalled at t = 31\.0 s; allowed: "
    ):
        calibrate_maneuver(maneuver(("roll", 8.0, 6.0), ("pitch", 4.0, 6.0)), ALONE, crash)
