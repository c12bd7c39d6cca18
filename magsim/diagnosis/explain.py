"""What a fitted method does to a flight: coefficients, shares, what is left, and what that follows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from magsim import columns, signals
from magsim.compensation import Compensator
from magsim.compensation.covariance import runs_of
from magsim.compensation.observability import is_constant
from magsim.compensation.terms import Term
from magsim.diagnosis.lag import FluxgateLag, fluxgate_lag
from magsim.diagnosis.signatures import SignatureTable, signatures_of
from magsim.diagnosis.spectra import BANDS_HZ, Coherence, Spectrum, coherences, spectrum
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

LATE_S = 0.05
"""Lag of a fluxgate above which it is noted: half a row at 10 Hz."""

NAMED = 8
"""Names that a note lists."""

SURE = 2.0
"""Standard errors that a coefficient must be from zero, not to be noted."""


@dataclass(frozen=True)
class Share:
    """What one source has of the estimate, in band.

    Attributes
    ----------
    group : str
    std_nt : float [nT]
    part : float
        Its covariance with the whole estimate over the variance of that: parts add up to 1, and may be negative.
    """

    group: str
    std_nt: float
    part: float


@dataclass(frozen=True)
class BandRow:
    """Deviations in one band [nT]; ``noise_nt`` is None where the truth is not known."""

    low_hz: float
    high_hz: float
    before_nt: float
    after_nt: float
    noise_nt: float | None


@dataclass(frozen=True)
class Explanation:
    """A method on a flight.

    Attributes
    ----------
    method, sensor, recording : str
    aircraft, date : str
        From the provenance; empty where that does not say.
    basis : str
        What ``before`` and ``after`` are, in words.
    rows : int
        In band, that count.
    minutes : float [min]
    before_nt, after_nt : float [nT]
        Deviations in band.
    noise_nt : float, optional [nT]
        The instrument's error in band, where the truth is known.
    uncertainty_nt : float, optional [nT]
        Root of the mean squared standard error of the reading that comes from the coefficients.
    coefficients : tuple of Term
    shares : tuple of Share
    signatures : SignatureTable
    bands : tuple of BandRow
    spectra : dict of str to Spectrum
        ``before``, ``after``, ``noise``.
    coherences : tuple of Coherence
        Of what is left with every input channel, the largest first.
    lag : FluxgateLag, optional
    dead : tuple of str
        Channels that never change.
    notes : tuple of str
        What is remarkable, and what could not be told, in words.
    """

    method: str
    sensor: str
    recording: str
    aircraft: str
    date: str
    basis: str
    rows: int
    minutes: float
    before_nt: float
    after_nt: float
    noise_nt: float | None
    uncertainty_nt: float | None
    coefficients: tuple[Term, ...]
    shares: tuple[Share, ...]
    signatures: SignatureTable
    bands: tuple[BandRow, ...]
    spectra: dict[str, Spectrum]
    coherences: tuple[Coherence, ...]
    lag: FluxgateLag | None
    dead: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def ratio(self) -> float:
        """Improvement ratio: deviation before over after."""
        return self.before_nt / self.after_nt if self.after_nt > 0.0 else float("inf")


@dataclass(frozen=True)
class _Flown:
    """Rows of a flight that count, with what a method makes of them; (n,) each."""

    recording: Recording
    judged: np.ndarray
    before: np.ndarray
    after: np.ndarray
    noise: np.ndarray | None
    estimate: np.ndarray
    basis: str

    def band(self, values: np.ndarray) -> np.ndarray:
        """Return a signal in band, on the rows that count."""
        return signals.in_band(values, self.recording.time_s, self.judged)


def explain(method: Compensator, recording: Recording, *, rows: str | None = None) -> Explanation:
    """Explain what a method does to a flight.

    Parameters
    ----------
    method : Compensator
        Fitted.
    recording : Recording
    rows : {"train", "valid", "test", "all"}, optional
        Rows that count; by default ``test`` where there are any, else all.

    Raises
    ------
    RequestError
        If the method is not fitted, a column is missing, or there are no such rows.
    DataError
        If no piece is long enough for the filter.
    """
    method.check_fitted()
    flown = _flown(method, recording, rows)
    before, after = flown.band(flown.before), flown.band(flown.after)
    if len(before) < 2:
        msg = (
            f"recording {recording.name!r}: no piece without a gap is longer than {2.0 * signals.EDGE_S:g} s, which "
            "the filter spoils at its ends"
        )
        raise DataError(msg)
    kept = signals.in_band_rows(flown.recording.time_s, flown.judged)
    segments = {name: flown.recording[name][kept] for name in flown.recording.names("segment")}
    runs = runs_of([flown.recording.time_s[flown.judged]])
    rate_hz = flown.recording.rate_hz
    lines = {"before": flown.before, "after": flown.after} | ({} if flown.noise is None else {"noise": flown.noise})
    found = {name: spectrum(values[flown.judged], runs, rate_hz) for name, values in lines.items()}
    spectra = {name: one for name, one in found.items() if one is not None}
    dead = tuple(name for name in _channels(flown.recording, method.sensor_) if is_constant([flown.recording], name))
    alive = {
        name: _smooth(flown.recording, name)[flown.judged]
        for name in _channels(flown.recording, method.sensor_)
        if name not in dead
    }
    coherent = coherences(flown.after[flown.judged], alive, runs, rate_hz)
    lag, why = _lag(flown.recording)
    whole = Explanation(
        method=method.name,
        sensor=method.sensor_,
        recording=recording.name,
        aircraft=str(recording.meta.get("aircraft") or ""),
        date=str(recording.meta.get("start_utc") or "")[:10],
        basis=flown.basis,
        rows=len(before),
        minutes=len(before) / rate_hz / 60.0,
        before_nt=float(before.std()),
        after_nt=float(after.std()),
        noise_nt=None if flown.noise is None else float(flown.band(flown.noise).std()),
        uncertainty_nt=_uncertainty(method, recording, flown),
        coefficients=method.coefficients() if method.is_explained else (),
        shares=_shares(method, recording, flown),
        signatures=signatures_of(segments, before, after),
        bands=_bands(spectra, rate_hz),
        spectra=spectra,
        coherences=coherent,
        lag=lag,
        dead=dead,
        notes=(),
    )
    return replace(whole, notes=_notes(whole, why, explained=method.is_explained))


def _flown(method: Compensator, recording: Recording, rows: str | None) -> _Flown:
    """Return the rows in which the magnetometer reads and the method answers, those that count among them."""
    sensor = method.sensor_
    recording.check_scalar(sensor)
    estimate = method.interference(recording)
    there = recording.reads(sensor) & np.isfinite(estimate)
    judged = _counted(recording, rows) & there
    if judged.sum() < 2:
        msg = f"recording {recording.name!r} has no rows {rows or 'all'!r} in which {sensor!r} reads"
        raise RequestError(msg)
    work, estimate = recording.take(there), estimate[there]
    reading, clean = work[columns.MAG.name(sensor=sensor)], columns.CLEAN.name(sensor=sensor)
    error = columns.ERROR.name(sensor=sensor)
    if clean in work:
        before, basis = reading - work[clean], "against the truth: interference before, error after"
    else:
        before, basis = reading, "readings: the geology that lies in the band is in both"
    noise = work.data.get(error)
    return _Flown(work, judged[there], before, before - estimate, noise, estimate, basis)


def _counted(recording: Recording, rows: str | None) -> np.ndarray:
    """Return the mask of the rows that are asked for."""
    if rows == "all" or columns.SPLIT.pattern not in recording:
        if rows not in (None, "all"):
            msg = f"recording {recording.name!r} has no column 'split', so there are no rows {rows!r}"
            raise RequestError(msg)
        return np.ones(len(recording), dtype=bool)
    test = recording.mask(split=rows or "test")
    return test if rows or test.any() else np.ones(len(recording), dtype=bool)


def _channels(recording: Recording, sensor: str) -> list[str]:
    """Return the input channels that a residual may follow: all but its own reading and flags."""
    own = columns.MAG.name(sensor=sensor)
    return [n for n in recording.names("input") if n != own and columns.family_of(n) is not columns.MAG_VALID]


def _smooth(recording: Recording, name: str) -> np.ndarray:
    """Return a channel without the jumps of an angle that wraps."""
    values = recording[name]
    return np.degrees(np.unwrap(np.radians(values))) if "heading" in name or "lon" in name else values


def _uncertainty(method: Compensator, recording: Recording, flown: _Flown) -> float | None:
    if not method.is_explained:
        return None
    errors = method.uncertainty(recording)[np.isin(recording.time_s, flown.recording.time_s)]
    kept = signals.in_band_rows(flown.recording.time_s, flown.judged)
    return float(np.sqrt(np.mean(errors[kept] ** 2)))


def _shares(method: Compensator, recording: Recording, flown: _Flown) -> tuple[Share, ...]:
    if not method.is_explained:
        return ()
    there = np.isin(recording.time_s, flown.recording.time_s)
    whole = flown.band(flown.estimate)
    power = float(np.mean((whole - whole.mean()) ** 2))
    out = []
    for group, values in method.shares(recording).items():
        band = flown.band(values[there])
        together = float(np.mean((band - band.mean()) * (whole - whole.mean())))
        out.append(Share(group, float(band.std()), together / power if power > 0.0 else 0.0))
    # a constant is nothing in band but rounding
    return tuple(share for share in out if share.std_nt > 1e-9 * np.sqrt(power))


def _bands(spectra: dict[str, Spectrum], rate_hz: float) -> tuple[BandRow, ...]:
    if "after" not in spectra:
        return ()
    noise = spectra.get("noise")
    return tuple(
        BandRow(
            *band,
            spectra["before"].std(*band),
            spectra["after"].std(*band),
            None if noise is None else noise.std(*band),
        )
        for band in BANDS_HZ
        if band[0] < 0.5 * rate_hz
    )


def _lag(recording: Recording) -> tuple[FluxgateLag | None, str]:
    """Return the lag of the first fluxgate, or why there is none."""
    fluxgate = next(iter(recording.fluxgates), None)
    if fluxgate is None:
        return None, "there is no fluxgate"
    try:
        return fluxgate_lag(recording, fluxgate), "no piece is long enough for the filter"
    except (RequestError, DataError) as error:
        return None, str(error)


def _notes(found: Explanation, why: str, *, explained: bool) -> tuple[str, ...]:
    """Return what is remarkable; ``why`` says why there is no lag."""
    out = []
    if not explained:
        out.append(f"{found.method} is no sum of physical terms: it has no coefficients, shares or errors to show")
    unsure = [t.name for t in found.coefficients if t.error is not None and abs(t.value) < SURE * t.error]
    if unsure:
        out.append(f"not told from zero (less than {SURE:g} standard errors): {_first(unsure)}")
    if not found.signatures.signatures:
        out.append("no maneuvers on headings are marked in the recording: no signatures, no figure of merit")
    if found.lag is None:
        out.append(f"the lag of the fluxgate is not known: {why}")
    elif abs(found.lag.lag_s) > LATE_S:
        later = "behind" if found.lag.lag_s > 0.0 else "ahead of"
        out.append(f"the fluxgate is {abs(found.lag.lag_s):.2f} s {later} the attitude of the INS")
    follows = [f"{c.channel} ({c.coherent_nt:.2g} nT)" for c in found.coherences if c.is_significant]
    if follows:
        out.append(f"what is left follows {_first(follows)}")
    if found.dead:
        out.append(f"never change, dead channels: {_first(found.dead)}")
    return tuple(out)


def _first(names: Sequence[str]) -> str:
    """Return the first names of a list, and how many more there are."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{', '.join(names[:NAMED])}{more}"
