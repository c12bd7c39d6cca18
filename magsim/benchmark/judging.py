"""From a fitted method and a recording to residuals: apart from fitting, and from reporting.

The truth is read here alone. A method sees blind copies: the inputs of the column families that it requires.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from magsim import columns, signals
from magsim.benchmark.anomaly import anomaly
from magsim.benchmark.residuals import Judged, Residuals, pooled
from magsim.compensation import Compensator
from magsim.dataset import JudgedPiece, pieces_to_judge
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

NOISE_FLOOR = "noise_floor"
"""Name of the oracle, whose estimate is the noise-free label: what is left is the instrument."""


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
    kept = [part for piece in pieces for part in _judge_piece(method, piece, judged, warmup_s)]
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


def _judge_piece(method: Compensator | None, piece: JudgedPiece, judged: Judged, warmup_s: float) -> list[Residuals]:
    """Return the residuals of each run of rows with a reading that is long enough for the filter."""
    whole = piece.whole
    after = whole.time_s >= whole.time_s[0] + warmup_s - 1e-9
    estimated = _estimates(method, whole, judged, after)
    runs = _runs(whole.time_s, piece.reads & after)
    found = [_filtered(whole.take(run), piece.judged[run], estimated.take(run), judged) for run in runs]
    return [residuals for residuals in found if residuals is not None]


def _runs(time_s: np.ndarray, rows: np.ndarray) -> list[np.ndarray]:
    """Return the row numbers of each run of marked rows without a gap between them, of 2 rows or more."""
    marked = np.flatnonzero(rows)
    if not len(marked):
        return []
    runs = np.split(marked, np.flatnonzero(np.diff(marked) > 1) + 1)
    return [run for run in runs if len(run) >= 2]


class _Estimated(NamedTuple):
    """Estimate of a piece, an anomaly in the reading, and what that changes of the estimate, (n,) [nT] each."""

    estimate: np.ndarray
    injected: np.ndarray
    change: np.ndarray

    def take(self, rows: np.ndarray) -> "_Estimated":
        """Return some rows."""
        return _Estimated(*(values[rows] for values in self))


def _estimates(method: Compensator | None, whole: Recording, judged: Judged, after: np.ndarray) -> _Estimated:
    """Return what a method makes of a piece; zero in the warm-up."""
    injected, nothing = anomaly(whole.time_s), np.zeros(len(whole))
    if method is None:
        label = columns.INTERFERENCE.name(sensor=judged.sensor)
        if label not in whole:
            msg = f"recording {judged.recording!r} has no label and truth for the row {NOISE_FLOOR}"
            raise RequestError(msg)
        return _Estimated(whole[label], injected, nothing)
    estimate = _estimate(method, whole, judged, after)
    if columns.MAG.pattern not in method.requires:
        return _Estimated(estimate, injected, nothing)
    mag = columns.MAG.name(sensor=judged.sensor)
    blind = whole.blind()
    with_anomaly = replace(blind, data={**blind.data, mag: whole[mag] + injected})
    return _Estimated(estimate, injected, _estimate(method, with_anomaly, judged, after) - estimate)


def _estimate(method: Compensator, recording: Recording, judged: Judged, after: np.ndarray) -> np.ndarray:
    """Return the estimate of a method, checked; zero in the warm-up, which does not count."""
    estimate = method.interference(recording)
    bad = after & ~np.isfinite(estimate)
    if bad.any():
        when = recording.time_s[np.argmax(bad)]
        msg = f"method {judged.method}: its estimate is not finite at {when:g} s, after its warm-up"
        raise DataError(msg)
    return np.where(after, estimate, 0.0)


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
    }
    clean = columns.CLEAN.name(sensor=judged.sensor)
    if clean in run:
        interference = reading - run[clean]
        error = interference - estimate
        out |= {"interference": band(interference), "error": band(error), "error_raw": error[keep]}
    for name, family in (
        ("heading_deg", columns.LEG_HEADING),
        ("maneuver", columns.MANEUVER),
        ("turn", columns.TURN),
    ):
        if family.pattern in run:
            out[name] = run[family.pattern][keep]
    return Residuals(judged, **out)
