"""The lag of a fluxgate behind the attitude of the INS: both see the direction of the field."""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from magsim import columns, signals
from magsim.compensation.background import model_along
from magsim.recording import Recording
from magsim.threads import one_blas_thread

MOST_S, STEP_S = 0.6, 0.02
"""Lags that are tried: to both sides, and their step [s]."""


class FluxgateLag(NamedTuple):
    """How late a fluxgate is."""

    lag_s: float
    """Time by which it follows the field that INS and model say; negative where the INS is later."""
    left_nt: float
    """Deviation in band of what that field, turned and scaled, leaves of the three axes [nT]."""


def fluxgate_lag(recording: Recording, fluxgate: str) -> FluxgateLag | None:
    """Find the lag at which the model field in body axes explains the fluxgate best, in band.

    Gains and turns of the three axes are fitted at every lag, so that offsets, scale errors, misalignment and induced
    fields do not matter; eddy currents near the fluxgate count as lag.

    Parameters
    ----------
    recording : Recording
        With attitude and position of the INS, and ``start_utc``.
    fluxgate : str

    Returns
    -------
    FluxgateLag or None
        None where no piece is long enough for the filter.

    Raises
    ------
    RequestError
        If the recording lacks the INS or does not say when it was flown.
    """
    model = model_along(recording).field_b
    flux = recording.vector(columns.FLUX, sensor=fluxgate)
    shifts = np.arange(round(-MOST_S / STEP_S), round(MOST_S / STEP_S) + 1) * STEP_S
    measured, moved = [], []
    for span in signals.spans(recording.time_s):
        time_s = recording.time_s[span]
        keep = signals.off_ends(time_s)
        if not keep.any():
            continue
        measured.append(signals.band_pass(flux[span], recording.rate_hz)[keep])
        band = CubicSpline(time_s, signals.band_pass(model[span], recording.rate_hz))
        moved.append([band(time_s[keep] - shift) for shift in shifts])
    if not measured:
        return None
    target = np.concatenate(measured)
    left = np.array([_left(np.concatenate(parts), target) for parts in zip(*moved, strict=True)])
    best = int(np.clip(np.argmin(left), 1, len(left) - 2))
    below, at, above = left[best - 1 : best + 2]
    bend = below - 2.0 * at + above
    beside = 0.5 * (below - above) / bend if bend > 0.0 else 0.0
    least = at - 0.25 * (below - above) * beside
    return FluxgateLag(float(shifts[best] + STEP_S * beside), float(np.sqrt(max(least, 0.0))))


def _left(model: np.ndarray, target: np.ndarray) -> float:
    """Return the mean square that three linear combinations of the model leave."""
    with one_blas_thread():
        gains = np.linalg.lstsq(model, target, rcond=None)[0]
        rest = target - model @ gains
    return float(np.mean(np.sum(rest**2, axis=1)))
