"""From a fitted method and a recording to residuals: apart from fitting, and from reporting.

The truth is read here alone. A method sees blind copies: the inputs of the column families that it requires.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magsim import columns, signals
from magsim.benchmark.residuals import Judged, Residuals, pooled
from magsim.benchmark.twins import PEAKS_NT, Twin, twin_of
from magsim.compensation import Compensator
from magsim.dataset import JudgedPiece, pieces_to_judge
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.streams import stream

NOISE_FLOOR = "noise_floor"
"""Name of the oracle, whose estimate is the noise-free label: what is left is the instrument."""

LONGEST_WARMUP_S = 60.0
"""Longest warm-up that a method may declare [s]: rows that it takes are taken from all that are judged beside it."""


class _Estimated(NamedTuple):
    """Estimate of a piece, (n,), anomalies by height, and what they change of the estimate, (n, 3) [nT]."""

    estimate: np.ndarray
    injected: np.ndarray
    change: np.ndarray

    def take(self, rows: np.ndarray) -> "_Estimated":
        """Return some rows."""
        return _Estimated(*(values[rows] for values in self))


def judge(
    method: Compensator | None,
    recording: Recording,
    *,
    sensor: str | None = None,
    name: str = "",
    warmup_s: float | None = None,
    file: str = "",
    level: int | None = None,
    seed: int = 0,
    twins: bool = True,
) -> Residuals:
    """Estimate the interference of a recording's test rows and return what is left.

    Parameters
    ----------
    method : Compensator or None
        Fitted; None is the noise floor.
    recording : Recording
        With the segment column ``split``.
    sensor : str, optional
        The scalar magnetometer; that of the method, or the first one, if not given.
    name : str
        Name of the method in tables; its own by default.
    warmup_s : float [s], optional
        Time at the start of each piece that does not count; the method's own by default.
    file, level, seed
        Carried into ``Judged``.
    twins : bool
        Whether the method is asked for the flight's twins too, three more estimates; without, no gain is known.

    Returns
    -------
    Residuals

    Raises
    ------
    RequestError
        If the method is not fitted, there is no such sensor, or there are no test rows.
    DataError
        If no test piece is long enough to be filtered, or the estimate is not finite.
    """
    if method is not None:
        method.check_fitted()
    sensor = sensor or (method.sensor_ if method else next(iter(recording.scalars), ""))
    name = name or (method.name if method else NOISE_FLOOR)
    warmup_s = warmup_s if warmup_s is not None else (method.warmup_s if method else 0.0)
    pieces = pieces_to_judge(recording, sensor)
    if not pieces:
        msg = f"recording {recording.name!r} has no test rows: no row has split = test and a reading of {sensor!r}"
        raise RequestError(msg)
    judged = Judged(recording.name, file, sensor, level, seed, name)
    kept = [part for piece in pieces for part in _judge_piece(method, piece, judged, warmup_s, twins=twins)]
    if not kept:
        raise _too_short(pieces, judged, warmup_s)
    return pooled(kept)


def _too_short(pieces: Sequence[JudgedPiece], judged: Judged, warmup_s: float) -> DataError:
    longest = max(
        float(np.ptp(piece.whole.time_s[run])) for piece in pieces for run in _runs(piece.whole.time_s, piece.reads)
    )
    valid = columns.MAG_VALID.name(sensor=judged.sensor)
    whole = " without a dropout" if valid in pieces[0].whole else ""
    msg = (
        f"recording {judged.recording!r}: the longest test piece{whole} lasts {longest:g} s; after a warm-up of "
        f"{warmup_s:g} s the filter needs more than {2.0 * signals.EDGE_S:g} s"
    )
    return DataError(msg)


def _judge_piece(
    method: Compensator | None, piece: JudgedPiece, judged: Judged, warmup_s: float, *, twins: bool
) -> list[Residuals]:
    """Return the residuals of each run of rows with a reading that is long enough for the filter."""
    whole = piece.whole
    after = whole.time_s >= whole.time_s[0] + warmup_s - 1e-9
    return _of_piece(piece, _estimates(method, whole, judged, after, twins=twins), judged, after)


def _of_piece(piece: JudgedPiece, estimated: _Estimated, judged: Judged, after: np.ndarray) -> list[Residuals]:
    """Return the residuals of a piece: of each run of rows with a reading, after the warm-up, that is long enough."""
    runs = _runs(piece.whole.time_s, piece.reads & after)
    found = [_filtered(piece.whole.take(run), piece.judged[run], estimated.take(run), judged) for run in runs]
    return [residuals for residuals in found if residuals is not None]


def _runs(time_s: np.ndarray, rows: np.ndarray) -> list[np.ndarray]:
    """Return the row numbers of each run of marked rows without a gap between them, of 2 rows or more."""
    marked = np.flatnonzero(rows)
    if not len(marked):
        return []
    runs = np.split(marked, np.flatnonzero(np.diff(marked) > 1) + 1)
    return [run for run in runs if len(run) >= 2]


def _estimates(
    method: Compensator | None, whole: Recording, judged: Judged, after: np.ndarray, *, twins: bool
) -> _Estimated:
    """Return what a method makes of a piece and of its three twins; zero in the warm-up.

    That is four estimates; one alone of a method that reads neither the scalar magnetometer nor a fluxgate, for which
    all four are the same.
    """
    drawn = [
        twin_of(whole, judged.sensor, stream(judged.seed, f"twin/{judged.recording}/{peak}"), peak if twins else 0.0)
        for peak in PEAKS_NT
    ]
    injected = np.stack([twin.injected for twin in drawn], axis=1)
    nothing = np.zeros_like(injected)
    if method is None:
        label = columns.INTERFERENCE.name(sensor=judged.sensor)
        if label not in whole:
            msg = f"recording {judged.recording!r} has no label and truth for the row {NOISE_FLOOR}"
            raise RequestError(msg)
        return _Estimated(whole[label], injected, nothing)
    estimate = _estimate(method, whole, judged, after)
    if not twins or not {columns.MAG.pattern, columns.FLUX.pattern} & set(method.requires):
        return _Estimated(estimate, injected, nothing)
    changed = [_estimate(method, twin.recording.blind(), judged, after) - estimate for twin in drawn]
    return _Estimated(estimate, injected, np.stack(changed, axis=1))


def residuals_of(
    recording: Recording,
    *,
    sensor: str,
    estimate: np.ndarray,
    twin: Twin,
    twin_estimate: np.ndarray,
    judged: Judged,
    crop_s: float,
) -> Residuals:
    """Return what is left of the test rows of a recording, from estimates that were made elsewhere.

    Parameters
    ----------
    recording : Recording
        With truth, and the segment column ``split``.
    sensor : str
        The scalar magnetometer.
    estimate : (n,) [nT]
        Of its interference.
    twin : Twin
        Of the recording.
    twin_estimate : (n,) [nT]
        Of the interference, from the twin.
    judged : Judged
    crop_s : float [s]
        Time at the start of each piece that does not count.

    Raises
    ------
    RequestError
        If there are no test rows.
    DataError
        If no test piece is long enough to be filtered.
    """
    pieces = pieces_to_judge(recording, sensor)
    if not pieces:
        msg = f"recording {recording.name!r} has no test rows: no row has split = test and a reading of {sensor!r}"
        raise RequestError(msg)
    mine = np.array([peak == twin.peak_nt for peak in PEAKS_NT], dtype=float)
    whole = _Estimated(estimate, twin.injected[:, None] * mine, (np.asarray(twin_estimate) - estimate)[:, None] * mine)
    kept = []
    for piece in pieces:
        rows = np.searchsorted(recording.time_s, piece.whole.time_s)
        after = piece.whole.time_s >= piece.whole.time_s[0] + crop_s - 1e-9
        kept += _of_piece(piece, whole.take(rows), judged, after)
    if not kept:
        raise _too_short(pieces, judged, crop_s)
    return pooled(kept)


def _estimate(method: Compensator, recording: Recording, judged: Judged, after: np.ndarray) -> np.ndarray:
    """Return the estimate of a method, checked; zero in the warm-up, which does not count."""
    estimate = method.interference(recording)
    bad = after & ~np.isfinite(estimate)
    if bad.any():
        when = recording.time_s[np.argmax(bad)]
        msg = f"method {judged.method}: its estimate is not finite at {when:g} s, after its warm-up"
        raise DataError(msg)
    return np.where(after, estimate, 0.0)


def fourth_difference(values: np.ndarray) -> np.ndarray:
    """Return the fourth difference over 16, (n,); 0 at the two rows at each end, which have none.

    Noise of a reading without any trend: surveys refuse lines with more than 0.05 nT of it (defaults of AirMagTools,
    after the practice of the Geological Survey of Canada).
    """
    out = np.zeros(len(values))
    if len(values) >= 5:
        out[2:-2] = np.diff(values, 4) / 16.0
    return out


def _filtered(run: Recording, rows: np.ndarray, estimated: _Estimated, judged: Judged) -> Residuals | None:
    """Filter a run of rows as one and keep the test rows that are far enough from its ends; None where none is."""
    keep = signals.off_ends(run.time_s) & rows
    if not keep.any():
        return None
    rate_hz = run.rate_hz

    def band(values: np.ndarray) -> np.ndarray:
        return signals.band_pass(values, rate_hz)[keep]

    def high(values: np.ndarray) -> np.ndarray:
        return signals.high_pass(values, rate_hz)[keep]

    reading = run[columns.MAG.name(sensor=judged.sensor)]
    estimate, injected, change = estimated
    out = {
        "time_s": run.time_s[keep],
        "piece": np.zeros(int(keep.sum())),
        "reading": band(reading),
        "compensated": band(reading - estimate),
        "injected": band(injected),
        "change": band(injected - change),
        "reading_high": high(reading),
        "compensated_high": high(reading - estimate),
        "far": signals.off_ends(run.time_s, signals.HIGH_PASS_EDGE_S)[keep].astype(float),
        "fourth": fourth_difference(reading - estimate)[keep],
    }
    clean, label = columns.CLEAN.name(sensor=judged.sensor), columns.INTERFERENCE.name(sensor=judged.sensor)
    if clean in run:
        interference = reading - run[clean]
        error = interference - estimate
        out |= {
            "interference": band(interference),
            "error": band(error),
            "slow": signals.slow_part(error, rate_hz)[keep],
        }
        out |= {"interference_raw": interference[keep], "error_raw": error[keep]}
        if label in run:
            out["floor"] = band(interference - run[label])
    for name, family in (
        ("heading_deg", columns.LEG_HEADING),
        ("maneuver", columns.MANEUVER),
        ("turn", columns.TURN),
    ):
        if family.pattern in run:
            out[name] = run[family.pattern][keep]
    return Residuals(judged, **out)
