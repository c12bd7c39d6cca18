"""Calibration of whole maneuvers: what each axis must be asked, and fed of another, so that all fly as asked.

Axes that swing at once disturb each other: a rolled aircraft yaws, a yawed one rolls. The whole maneuver is flown in
still air. What an axis makes of its own frequency, and roll and yaw of each other's, is held against what was asked,
and the difference is taken back from the generators by the response of that axis alone. That is a fixed-point iteration
with nearly the right slope: three to six flights of the maneuver's length settle it.

What is left are products: pitch turns with the rolled wing, and the lift that pitch adds turns the course. They are no
sines of the train's own frequency, so the fitted sine and half of the peak to peak differ; their mean is closed.

A train of one axis is calibrated like that too where it is so large that the loops do not answer in proportion.
"""

import math
from collections.abc import Callable

import numpy as np

from magsim.errors import DataError, RequestError
from magsim.flight.model.autopilot import FED
from magsim.flight.pilot.measure import ANGLES, measure, middle_of
from magsim.flight.pilot.response import UNITY, Drive, LoopResponse
from magsim.flight.pilot.trains import Joint, Sweep, joint_sweeps
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
"""Damps what a few cycles cannot tell apart: neighboring frequencies."""

Flown = Callable[[list[Sweep], LoopResponse, float], Trajectory]
"""Fly trains with a response until a time."""


def close_joint(joint: Joint, response: LoopResponse, flown: Flown) -> dict[str, Drive]:
    """Find what the generators are told in a maneuver.

    Parameters
    ----------
    joint : Joint
    response : LoopResponse
        Of each axis alone.
    flown : callable
        Flies trains in still air.

    Returns
    -------
    dict of str to Drive

    Raises
    ------
    RequestError
        If the maneuver cannot be flown as it was asked.
    """
    sweeps = joint_sweeps(joint, LEAD_S + max(swing.ease_in_s for swing in joint))
    stop_s = max(sweep.stop_s + sweep.ease_out_s for sweep in sweeps) + 1.0
    at = {sweep.axis: sweep for sweep in sweeps}
    asked = {axis: _asked(sweep, at) for axis, sweep in at.items()}
    plant = {axis: _plant(axis, components, at, response) for axis, components in asked.items()}
    told = {axis: {of: asked[axis][of] / plant[axis][of] for of in asked[axis]} for axis in at}
    best, left, worst_deg, since, text = {}, {}, math.inf, 0, ""
    for _ in range(FLIGHTS):
        drives = _drives(told, at)
        try:
            carrier = flown(sweeps, LoopResponse(UNITY.period_s, {}, {}, joints={joint: drives}), stop_s)
        except DataError as error:
            text = text or str(error)
            break
        trains = {axis: measure(sweep, carrier)[0] for axis, sweep in at.items()}
        errors = {axis: _error_deg(train) for axis, train in trains.items()}
        since = 0 if max(errors.values()) < worst_deg - BETTER_DEG else since + 1
        if max(errors.values()) < worst_deg:
            best, left, worst_deg = drives, errors, max(errors.values())
            text = ", ".join(f"{axis} is off by {error:.2f} deg" for axis, error in errors.items())
        if worst_deg < CLOSED_DEG or since == PATIENCE:
            break
        for axis, sweep in at.items():
            found = _components(sweep, [at[of] for of in asked[axis]], carrier)
            train = trains[axis]
            found[axis] *= 0.5 * (1.0 + train.half_peak_to_peak_deg / train.flown_deg)
            for of, value in found.items():
                told[axis][of] += (asked[axis][of] - value) / plant[axis][of]
    if not best or any(error > ALLOWED_DEG + ALLOWED_PART * at[axis].amplitude_deg for axis, error in left.items()):
        msg = (
            f"pattern.maneuvers: {words(joint)} cannot be flown as asked: {text}; allowed: smaller amplitudes, longer "
            "periods or more cycles"
        )
        raise RequestError(msg)
    return best


def words(joint: Joint) -> str:
    """A maneuver in words."""
    swings = ", ".join(f"{swing.axis} {swing.amplitude_deg:g} deg in {swing.period_s:g} s" for swing in joint)
    return f"{'a combined maneuver' if len(joint) > 1 else 'a train'} of {swings}"


def _asked(own: Sweep, at: dict[str, Sweep]) -> dict[str, complex]:
    """Components of an axis's swing: its own frequency, and none of another one that is fed to it [rad]."""
    out = {own.axis: complex(math.radians(own.amplitude_deg))}
    other = at.get(FED.get(own.axis, ""))
    if other is not None and not math.isclose(other.omega, own.omega):
        out[other.axis] = 0j
    return out


def _plant(
    axis: str, components: dict[str, complex], at: dict[str, Sweep], response: LoopResponse
) -> dict[str, complex]:
    """Response of an axis at the frequency of each component."""
    out = {}
    for of in components:
        gain, phase = response.at(axis, at[of].period_s)
        out[of] = gain * complex(math.cos(phase), math.sin(phase))
    return out


def _drives(told: dict[str, dict[str, complex]], at: dict[str, Sweep]) -> dict[str, Drive]:
    """Generators' amplitudes, phases and feeds.

    With the other generator at ``Im[z e^(i x)]`` and its derivative ``omega Re[z e^(i x)]``, a component
    ``Im[u e^(i x)]`` is the first by ``Re(u / z)`` and the second by ``Im(u / z) / omega``.
    """
    out = {}
    for axis, components in told.items():
        own, feed = components[axis], None
        other = FED.get(axis, "")
        if other in components:
            ratio = components[other] / told[other][other]
            feed = (ratio.real, ratio.imag / at[other].omega)
        gain = math.radians(at[axis].amplitude_deg) / abs(own)
        out[axis] = Drive(gain, math.atan2(own.imag, own.real), feed)
    return out


def _error_deg(train: ManeuverFlown) -> float:
    """How far the amplitude is from what was asked, by the worse of its two measures."""
    return max(abs(train.flown_deg - train.asked_deg), abs(train.half_peak_to_peak_deg - train.asked_deg))


def _components(own: Sweep, parts: list[Sweep], carrier: Trajectory) -> dict[str, complex]:
    """An angle over the middle cycles as sines of several frequencies, each on the clock of its train [rad]."""
    low, high = middle_of(own)
    rows = (carrier.time_s >= low - 1e-9) & (carrier.time_s <= high + 1e-9)
    time, values = carrier.time_s[rows], carrier.attitude[rows, ANGLES[own.axis]]
    columns = [np.ones_like(time), (time - 0.5 * (low + high)) / (0.5 * (high - low))]
    for part in parts:
        angle = part.omega * (time - part.start_s)
        columns += [np.sin(angle), np.cos(angle)]
    basis = np.stack(columns)
    # Normal equations by einsum, as in ``fit_sine``; about what was asked, so that the ridge pulls towards it.
    aim = math.radians(own.amplitude_deg) * np.sin(own.omega * (time - own.start_s))
    gram = np.einsum("in,jn->ij", basis, basis) + RIDGE * len(time) * np.eye(len(basis))
    solution = np.linalg.solve(gram, np.einsum("in,n->i", basis, values - values.mean() - aim))
    out = {p.axis: complex(solution[2 + 2 * i], solution[3 + 2 * i]) for i, p in enumerate(parts)}
    out[own.axis] += math.radians(own.amplitude_deg)
    return out


def drives_to_arrays(drives: dict[str, Drive]) -> dict[str, np.ndarray]:
    """As plain arrays for the cache: gain, lead, and the two factors of a feed where there is one."""
    return {axis: np.array([drive.gain, drive.lead, *(drive.feed or ())]) for axis, drive in drives.items()}


def drives_from_arrays(arrays: dict[str, np.ndarray]) -> dict[str, Drive]:
    """From what ``drives_to_arrays`` gave."""
    out = {}
    for axis, values in arrays.items():
        gain, lead, *feed = values.tolist()
        out[axis] = Drive(gain, lead, (feed[0], feed[1]) if feed else None)
    return out
