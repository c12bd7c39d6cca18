"""Calibration of one maneuver: the drives with which all its axes fly as commanded.

Axes that oscillate together disturb each other: bank makes the aircraft yaw, sideslip makes it roll. The maneuver is
flown in still air. The response of each axis at its own frequency, and that of roll and yaw at each other's, is
compared with the command, and the difference is subtracted from the swings through the response of that axis
alone. This is a fixed-point iteration with nearly the right slope: it settles in three to six flights of the
maneuver's length.

The remaining errors are products: pitch turns with the banked wing, and the lift that pitch adds turns the course.
They are no sines of the train's own frequency, so the fitted sine and half of the peak to peak differ; the iteration
closes their mean.

A train of one axis is calibrated in the same way if it is so large that the loops do not respond in proportion.
"""

import math
from collections.abc import Callable

import numpy as np

from magsim.errors import DataError, RequestError
from magsim.flight.pilot.measure import ANGLES, measure, middle_of, rows_between
from magsim.flight.pilot.response import FED, UNITY, Drive, LoopResponse
from magsim.flight.pilot.trains import ManeuverKey, SineTrain, trains_of_maneuver
from magsim.trajectory import ManeuverFlown, Trajectory

LEAD_S = 20.0
FLIGHTS = 10
"""Most flights of one calibration."""

CLOSED_DEG = 0.02
"""The iteration ends when every amplitude is as close, or when ``PATIENCE`` flights bring no ``BETTER_DEG``."""

PATIENCE, BETTER_DEG = 2, 0.005

ALLOWED_DEG, ALLOWED_PART = 0.2, 0.05
"""A maneuver with an amplitude that stays farther off, by degrees and this part of it, is refused."""

RIDGE = 1e-4
"""Damps neighboring frequencies, which a few cycles cannot separate."""

FlyTrains = Callable[[list[SineTrain], LoopResponse, float], Trajectory]
"""Fly trains with a response until a time."""

Components = dict[str, dict[str, complex]]
"""Complex amplitudes [rad] or responses of each axis, at its own frequency and at that of an axis fed to it."""


def calibrate_maneuver(maneuver: ManeuverKey, response: LoopResponse, fly_trains: FlyTrains) -> dict[str, Drive]:
    """Find the drives of a maneuver.

    Parameters
    ----------
    maneuver : ManeuverKey
    response : LoopResponse
        Of each axis alone.
    fly_trains : callable
        Flies trains in still air.

    Returns
    -------
    dict of str to Drive

    Raises
    ------
    RequestError
        If the maneuver cannot be flown as commanded.
    """
    trains = trains_of_maneuver(maneuver, LEAD_S + max(axis.ease_in_s for axis in maneuver))
    stop_s = max(train.stop_s + train.ease_out_s for train in trains) + 1.0
    at = {train.axis: train for train in trains}
    wanted = {axis: _wanted(train, at) for axis, train in at.items()}
    plant = {axis: _plant(axis, components, at, response) for axis, components in wanted.items()}
    command = {axis: {of: wanted[axis][of] / plant[axis][of] for of in wanted[axis]} for axis in at}
    best: dict[str, Drive] = {}
    left: dict[str, float] = {}
    worst_deg, since, text = math.inf, 0, ""
    for _ in range(FLIGHTS):
        drives = _drives(command, at)
        try:
            carrier = fly_trains(trains, LoopResponse(UNITY.period_s, {}, {}, maneuvers={maneuver: drives}), stop_s)
        except DataError as error:
            text = text or str(error)
            break
        flown = {axis: measure(train, carrier)[0] for axis, train in at.items()}
        errors = {axis: _error_deg(one) for axis, one in flown.items()}
        since = 0 if max(errors.values()) < worst_deg - BETTER_DEG else since + 1
        if max(errors.values()) < worst_deg:
            best, left, worst_deg = drives, errors, max(errors.values())
            text = ", ".join(f"{axis} is off by {error:.2f} deg" for axis, error in errors.items())
        if worst_deg < CLOSED_DEG or since == PATIENCE:
            break
        _correct(command, wanted=wanted, plant=plant, flown=flown, carrier=carrier, at=at)
    if not best or any(error > ALLOWED_DEG + ALLOWED_PART * at[axis].amplitude_deg for axis, error in left.items()):
        msg = (
            f"pattern.maneuvers: {describe(maneuver)} cannot be flown as commanded: {text}; allowed: smaller "
            "amplitudes, longer periods or more cycles"
        )
        raise RequestError(msg)
    return best


def _correct(
    command: Components,
    *,
    wanted: Components,
    plant: Components,
    flown: dict[str, ManeuverFlown],
    carrier: Trajectory,
    at: dict[str, SineTrain],
) -> None:
    """Subtract the errors of a flight from the commands, through the response of each axis alone."""
    for axis, train in at.items():
        found = _components(train, [at[of] for of in wanted[axis]], carrier)
        found[axis] *= 0.5 * (1.0 + flown[axis].half_peak_to_peak_deg / flown[axis].flown_deg)
        for of, value in found.items():
            command[axis][of] += (wanted[axis][of] - value) / plant[axis][of]


def describe(maneuver: ManeuverKey) -> str:
    """Describe a maneuver in words."""
    axes = ", ".join(f"{axis.axis} {axis.amplitude_deg:g} deg in {axis.period_s:g} s" for axis in maneuver)
    return f"{'a combined maneuver' if len(maneuver) > 1 else 'a train'} of {axes}"


def _wanted(own: SineTrain, at: dict[str, SineTrain]) -> dict[str, complex]:
    """Return the components of an axis [rad]: its own amplitude, and zero at the frequency of one that is fed to it."""
    out = {own.axis: complex(math.radians(own.amplitude_deg))}
    other = at.get(FED.get(own.axis, ""))
    if other is not None and not math.isclose(other.omega, own.omega):
        out[other.axis] = 0j
    return out


def _plant(
    axis: str, components: dict[str, complex], at: dict[str, SineTrain], response: LoopResponse
) -> dict[str, complex]:
    """Return the response of an axis at the frequency of each component."""
    out = {}
    for of in components:
        gain, phase = response.at(axis, at[of].period_s)
        out[of] = gain * complex(math.cos(phase), math.sin(phase))
    return out


def _drives(command: Components, at: dict[str, SineTrain]) -> dict[str, Drive]:
    """Return amplitudes, phases and feeds of the swings.

    With the other swing at ``Im[z e^(i x)]`` and its derivative ``omega Re[z e^(i x)]``, a component
    ``Im[u e^(i x)]`` is the first by ``Re(u / z)`` and the second by ``Im(u / z) / omega``.
    """
    out = {}
    for axis, components in command.items():
        own, feed = components[axis], None
        other = FED.get(axis, "")
        if other in components:
            ratio = components[other] / command[other][other]
            feed = (ratio.real, ratio.imag / at[other].omega)
        gain = math.radians(at[axis].amplitude_deg) / abs(own)
        out[axis] = Drive(gain, math.atan2(own.imag, own.real), feed)
    return out


def _error_deg(flown: ManeuverFlown) -> float:
    """Return the error of the amplitude, by the worse of its two measures."""
    return max(abs(flown.flown_deg - flown.asked_deg), abs(flown.half_peak_to_peak_deg - flown.asked_deg))


def _components(own: SineTrain, parts: list[SineTrain], carrier: Trajectory) -> dict[str, complex]:
    """Fit sines of several frequencies to an angle over the middle cycles, each on the clock of its train [rad]."""
    low, high = middle_of(own)
    rows = rows_between(carrier.time_s, low, high)
    time, values = carrier.time_s[rows], carrier.attitude[rows, ANGLES[own.axis]]
    columns = [np.ones_like(time), (time - 0.5 * (low + high)) / (0.5 * (high - low))]
    for part in parts:
        angle = part.omega * (time - part.start_s)
        columns += [np.sin(angle), np.cos(angle)]
    basis = np.stack(columns)
    # Normal equations by einsum, as in ``fit_sine``; about the command, so that the ridge pulls towards it.
    aim = math.radians(own.amplitude_deg) * np.sin(own.omega * (time - own.start_s))
    gram = np.einsum("in,jn->ij", basis, basis) + RIDGE * len(time) * np.eye(len(basis))
    solution = np.linalg.solve(gram, np.einsum("in,n->i", basis, values - values.mean() - aim))
    out = {p.axis: complex(solution[2 + 2 * i], solution[3 + 2 * i]) for i, p in enumerate(parts)}
    out[own.axis] += math.radians(own.amplitude_deg)
    return out


def drives_to_arrays(drives: dict[str, Drive]) -> dict[str, np.ndarray]:
    """Return plain arrays for the cache: gain, lead, and the two factors of a feed if there is one."""
    return {axis: np.array([drive.gain, drive.lead, *(drive.feed or ())]) for axis, drive in drives.items()}


def drives_from_arrays(arrays: dict[str, np.ndarray]) -> dict[str, Drive]:
    """Restore drives from the result of ``drives_to_arrays``."""
    out = {}
    for axis, values in arrays.items():
        gain, lead, *feed = values.tolist()
        out[axis] = Drive(gain, lead, (feed[0], feed[1]) if feed else None)
    return out
