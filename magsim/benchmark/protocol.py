"""Who learns from what, and who is judged on what.

Methods are fitted once, on the rows with split ``train`` (and ``valid``) of all recordings, from ``labeled`` copies;
and judged on the rows with split ``test`` of each, from ``blind`` copies. The truth is read here alone.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from magsim import __version__, columns, metrics, signals
from magsim.benchmark.anomaly import anomaly, gain
from magsim.benchmark.report import WHOLE, Report, Row
from magsim.compensation import Compensator, create, parse_method
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

NOISE_FLOOR = "noise_floor"
"""Row of the oracle, whose estimate is the noise-free label: what is left is the instrument."""


@dataclass(frozen=True)
class _Part:
    """A contiguous piece of test rows: the whole for the judge and what the methods see."""

    whole: Recording
    blind: Recording


def benchmark(
    recordings: Sequence[Recording],
    methods: Sequence[str | Compensator | tuple[str, Compensator]],
    *,
    sensor: str | None = None,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Report:
    """Fit methods on the training rows and judge them on the test rows.

    Parameters
    ----------
    recordings : sequence of Recording
        With the segment column ``split``.
    methods : sequence
        Names of methods, ``noise_floor`` among them, with settings if need be (``name:key=value``, read by
        ``magsim.compensation.parse_method``); compensators, which are fitted if they are not yet; or pairs of a name
        for the table and a compensator.
    sensor : str, optional
        The scalar magnetometer; by default that of a fitted compensator, else the first of the first recording.
    seed : int
        Seed of the fits.
    progress : callable, optional
        Told what happens, one line at a time.

    Returns
    -------
    Report

    Raises
    ------
    RequestError
        If a method, the sensor, a column, the training rows or the test rows are not there.
    DataError
        If a part is too short to be filtered, or a method puts out what it must not.
    """
    say = progress or (lambda text: None)
    if not recordings:
        msg = "nothing to benchmark: no recording was given"
        raise RequestError(msg)
    named = _named(methods)
    sensor = _pick_sensor(recordings, [c for _, c in named if c is not None], sensor)
    for recording in recordings:
        _check(recording, sensor)
    parts_of = [_parts(recording, sensor) for recording in recordings]
    if not any(parts_of):
        names = ", ".join(repr(recording.name) for recording in recordings)
        silent = any(recording.mask(split="test").any() for recording in recordings)
        msg = f"no test rows: no row of {names} has split = test" + (f" and a reading of {sensor!r}" if silent else "")
        raise RequestError(msg)
    fit_s = _fit(recordings, named, sensor, seed, say)

    warmup_s = max([0.0, *(compensator.warmup_s for _, compensator in named if compensator is not None)])
    rows: list[Row] = []
    notes: list[str] = []
    judged: dict[str, dict[str, object]] = {}
    for recording, parts in zip(recordings, parts_of, strict=True):
        silent = recording.mask(split="test") & ~recording.reads(sensor)
        if silent.any():
            notes.append(
                f"recording {recording.name!r}: {silent.sum()} test rows in which {sensor!r} does not read are left "
                f"out, and {signals.EDGE_S:g} s on both sides of each dropout"
            )
        if not parts:
            continue
        truth = columns.CLEAN.name(sensor=sensor) in recording
        if not truth:
            notes.append(f"recording {recording.name!r} has no truth: only the papers' scores, of the reading itself")
        judged[recording.name] = {"rows": sum(len(part.whole) for part in parts), "truth": truth}
        for name, compensator in named:
            if compensator is None and (not truth or columns.INTERFERENCE.name(sensor=sensor) not in recording):
                notes.append(f"recording {recording.name!r} has no label and truth for the row {NOISE_FLOOR}")
                continue
            say(f"{name} on {recording.name}")
            rows += _judge(name, compensator, parts, sensor, warmup_s)
        if not any(row.metric == "ir_003" for row in rows if row.recording == recording.name):
            notes.append(
                f"recording {recording.name!r} has no ir_003: no test piece is longer than the "
                f"{2.0 * signals.HIGH_PASS_EDGE_S:g} s that the high-pass needs"
            )
    about = {
        "magsim": __version__,
        "seed": seed,
        "band_hz": list(signals.BAND_HZ),
        "edge_s": signals.EDGE_S,
        "high_pass_hz": signals.HIGH_PASS_HZ,
        "high_pass_edge_s": signals.HIGH_PASS_EDGE_S,
        "warmup_s": warmup_s,
        "methods": {name: {"method": c.name, "params": c.get_params()} for name, c in named if c is not None},
        "recordings": judged,
    }
    return Report(sensor, tuple(rows), about, tuple(notes), fit_s)


def _named(
    methods: Sequence[str | Compensator | tuple[str, Compensator]],
) -> list[tuple[str, Compensator | None]]:
    """Names for the table with their compensators; the noise floor has none."""
    out: list[tuple[str, Compensator | None]] = []
    for method in methods:
        if isinstance(method, tuple):
            out.append(method)
        elif isinstance(method, Compensator):
            out.append((method.name, method))
        else:
            out.append((method, _create(method)))
    names = [name for name, _ in out]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        msg = f"method {', '.join(twice)} is given twice"
        raise RequestError(msg)
    if not out:
        msg = "no method to benchmark was given"
        raise RequestError(msg)
    return out


def _create(text: str) -> Compensator | None:
    """A method from its name and settings; none for the noise floor."""
    name, settings = parse_method(text)
    if name != NOISE_FLOOR:
        return create(name, **settings)
    if settings:
        msg = f"{NOISE_FLOOR} has no settings; {text!r} gives {', '.join(settings)}"
        raise RequestError(msg)
    return None


def _pick_sensor(recordings: Sequence[Recording], compensators: Sequence[Compensator], sensor: str | None) -> str:
    fitted = {c.sensor_: c for c in compensators if hasattr(c, "sensor_")}
    sensor = sensor or next(iter(fitted), None) or next(iter(recordings[0].scalars), None)
    other = next((name for name in fitted if name != sensor), None)
    if other is not None:
        msg = f"method {fitted[other].name} was trained for the sensor {other!r}, not {sensor!r}"
        raise RequestError(msg)
    if sensor is None:
        msg = f"recording {recordings[0].name!r} has no scalar magnetometer"
        raise RequestError(msg)
    return sensor


def _check(recording: Recording, sensor: str) -> None:
    if sensor not in recording.scalars:
        has = ", ".join(recording.scalars) or "none"
        msg = f"recording {recording.name!r} has no scalar magnetometer {sensor!r}; it has {has}"
        raise RequestError(msg)
    if columns.SPLIT.pattern not in recording:
        msg = (
            f"recording {recording.name!r} has no column 'split', which tells training rows from test rows; "
            "magsim import makes it with --train and --test"
        )
        raise RequestError(msg)


def rows_of(recordings: Sequence[Recording], split: str) -> list[Recording]:
    """Labeled copies of the rows of one split; recordings without such rows are left out."""
    masks = [recording.mask(split=split) for recording in recordings]
    return [r.take(mask).labeled() for r, mask in zip(recordings, masks, strict=True) if mask.sum() >= 2]


def _fit(
    recordings: Sequence[Recording],
    named: Sequence[tuple[str, Compensator | None]],
    sensor: str,
    seed: int,
    say: Callable[[str], None],
) -> dict[str, float]:
    """Fit what is not fitted; CPU seconds of each fit."""
    train, valid = rows_of(recordings, "train"), rows_of(recordings, "valid")
    seconds = {}
    for name, compensator in named:
        if compensator is None or hasattr(compensator, "sensor_"):
            continue
        if not train:
            names = ", ".join(repr(recording.name) for recording in recordings)
            msg = f"no training rows for {name}: no row of {names} has split = train"
            raise RequestError(msg)
        say(f"fitting {name}")
        started = time.process_time()
        compensator.fit(train, sensor=sensor, valid=valid, seed=seed)
        seconds[name] = time.process_time() - started
    return seconds


def _parts(recording: Recording, sensor: str) -> list[_Part]:
    """Contiguous pieces of the test rows; a dropout of the magnetometer ends a piece."""
    mask = recording.mask(split="test") & recording.reads(sensor)
    if mask.sum() < 2:
        return []
    return [_Part(piece, piece.blind()) for piece in recording.take(mask).pieces()]


def _judge(
    name: str,
    compensator: Compensator | None,
    parts: Sequence[_Part],
    sensor: str,
    warmup_s: float,
) -> list[Row]:
    """Every score of one method on one recording."""
    recording = parts[0].whole.name
    kept = [k for part in parts if (k := _measure(name, compensator, part, sensor, warmup_s)) is not None]
    if not kept:
        longest = max(float(np.ptp(part.whole.time_s)) for part in parts)
        whole = " without a dropout" if columns.MAG_VALID.name(sensor=sensor) in parts[0].whole else ""
        msg = (
            f"recording {recording!r}: the longest test piece{whole} lasts {longest:g} s; after a warm-up of "
            f"{warmup_s:g} s the filter needs more than {2.0 * signals.EDGE_S:g} s"
        )
        raise DataError(msg)
    pooled = {key: np.concatenate([part[key] for part in kept]) for key in kept[0]}
    found = [(WHOLE, _scores(pooled))]
    found += [
        (segment, _spreads({key: values[mask] for key, values in pooled.items()}))
        for segment, mask in _segments(pooled)
    ]
    found += _peaks(pooled)
    return [Row(name, recording, segment, metric, v) for segment, scores in found for metric, v in scores.items()]


def _measure(
    name: str, compensator: Compensator | None, part: _Part, sensor: str, warmup_s: float
) -> dict[str, np.ndarray] | None:
    """Filtered and cropped signals of one part; None where it is too short to leave any row."""
    whole = part.whole
    after = whole.time_s >= whole.time_s[0] + warmup_s - 1e-9
    time_s = whole.time_s[after]
    if len(time_s) < 2 or not metrics.crop(time_s).any():
        return None
    keep = metrics.crop(time_s)
    rate_hz = whole.rate_hz

    def band(values: np.ndarray) -> np.ndarray:
        return signals.band_pass(values[after], rate_hz)[keep]

    mag = columns.MAG.name(sensor=sensor)
    reading = whole[mag]
    if compensator is None:
        estimate, change = whole[columns.INTERFERENCE.name(sensor=sensor)], np.zeros(len(whole))
    else:
        estimate = _estimate(name, compensator, part.blind, after)
        added = reading + anomaly(whole.time_s)
        with_anomaly = replace(part.blind, data={**part.blind.data, mag: added})
        change = _estimate(name, compensator, with_anomaly, after) - estimate
    injected = anomaly(whole.time_s)
    out = {
        "reading": band(reading),
        "compensated": band(reading - estimate),
        "injected": band(injected),
        "change": band(injected - change),
        "reading_003": signals.high_pass(reading[after], rate_hz)[keep],
        "compensated_003": signals.high_pass((reading - estimate)[after], rate_hz)[keep],
        "rows_003": metrics.crop(time_s, signals.HIGH_PASS_EDGE_S)[keep],
    }
    clean = columns.CLEAN.name(sensor=sensor)
    if clean in whole:
        interference = reading - whole[clean]
        out |= {"interference": band(interference), "error": band(interference - estimate)}
        out["broadband"] = (interference - estimate)[after][keep]
    for family in (columns.LEG_HEADING, columns.MANEUVER, columns.TURN):
        if family.pattern in whole:
            out[family.pattern] = whole[family.pattern][after][keep]
    return out


def _estimate(name: str, compensator: Compensator, blind: Recording, after: np.ndarray) -> np.ndarray:
    """Estimate of a method, checked; zero in the warm-up, which does not count."""
    estimate = np.asarray(compensator.interference(blind), dtype=float)
    if estimate.shape != (len(blind),):
        msg = f"method {name} put out shape {estimate.shape} for {len(blind)} rows"
        raise DataError(msg)
    bad = after & ~np.isfinite(estimate)
    if bad.any():
        msg = f"method {name}: its estimate is not finite at {blind.time_s[np.argmax(bad)]:g} s, after its warm-up"
        raise DataError(msg)
    return np.where(after, estimate, 0.0)


def _spreads(pooled: dict[str, np.ndarray]) -> dict[str, float]:
    """Scores of some rows by their spread: in band, and above 0.03 Hz on the rows that are far enough from the ends."""
    out = {}
    if "error" in pooled:
        out["std_nt"] = metrics.std(pooled["error"])
        out["ir"] = metrics.ratio(metrics.std(pooled["interference"]), out["std_nt"])
    out["std_paper_nt"] = metrics.std(pooled["compensated"])
    out["ir_paper"] = metrics.ratio(metrics.std(pooled["reading"]), out["std_paper_nt"])
    far = pooled["rows_003"]
    if far.any():
        before, after = (metrics.std(pooled[key][far]) for key in ("reading_003", "compensated_003"))
        out["ir_003"] = metrics.ratio(before, after)
    return out


def _scores(pooled: dict[str, np.ndarray]) -> dict[str, float]:
    """All scores of a recording, without those that need what it does not have."""
    out = _spreads(pooled)
    if "error" in pooled:
        out["rmse_nt"] = metrics.rmse(pooled["broadband"])
        out["rmse0_nt"] = metrics.rmse_0(pooled["broadband"])
    peaks = _peaks(pooled)
    for total, single in (("fom_nt", "peak_nt"), ("fom_paper_nt", "peak_paper_nt")):
        cells = [scores[single] for _, scores in peaks if single in scores]
        if cells:
            out[total] = metrics.fom(cells)
    out["gain"] = gain(pooled["change"], pooled["injected"])
    return out


def _segments(pooled: dict[str, np.ndarray]) -> list[tuple[str, np.ndarray]]:
    """Names and rows of the headings (straight legs) and of the maneuvers."""
    if not _flown(pooled):
        return []
    heading, maneuver = pooled[columns.LEG_HEADING.pattern], pooled[columns.MANEUVER.pattern]
    straight = pooled.get(columns.TURN.pattern, np.zeros(len(heading))) == 0.0
    found = [(f"heading {value:g}", straight & (heading == value)) for value in np.unique(heading[straight])]
    found += [(word, maneuver == number) for number, word in columns.MANEUVERS.items() if number != 0]
    return [(name, mask) for name, mask in found if mask.any()]


def _peaks(pooled: dict[str, np.ndarray]) -> list[tuple[str, dict[str, float]]]:
    """Maximum minus minimum of each maneuver on each heading: the terms of the figure of merit."""
    if not _flown(pooled):
        return []
    heading, maneuver = pooled[columns.LEG_HEADING.pattern], pooled[columns.MANEUVER.pattern]
    out: dict[str, dict[str, float]] = {}
    for metric, key in (("peak_nt", "error"), ("peak_paper_nt", "compensated")):
        if key in pooled:
            for cell, value in metrics.fom_cells(pooled[key], heading, maneuver).items():
                name = f"heading {cell.heading:g} {columns.MANEUVERS[int(cell.maneuver)]}"
                out.setdefault(name, {})[metric] = value
    return list(out.items())


def _flown(pooled: dict[str, np.ndarray]) -> bool:
    return columns.LEG_HEADING.pattern in pooled and columns.MANEUVER.pattern in pooled
