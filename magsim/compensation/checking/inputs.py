"""Checks of what an estimate depends on: declared families alone, no labels, no future, no other piece."""

from dataclasses import replace

import numpy as np

from magsim import columns
from magsim.compensation.checking.case import (
    SAME_NT,
    Case,
    changed,
    expect_same,
    fail,
    is_read,
    off,
    skip,
    warming,
)
from magsim.errors import RequestError
from magsim.recording import Recording
from magsim.signals import spans

TIMES = 8
"""Times after which the future is changed."""

LATER_S = 1000.0
"""How much later the same rows are flown once more: no drift that a method may know of counts for so long."""


def shape(case: Case) -> str:
    """Check for one number in each row, NaN in the warm-up alone."""
    estimate = case.estimate
    if estimate.shape != (len(case.probe),) or estimate.dtype != np.float64:
        fail(f"the estimate has shape {estimate.shape} and type {estimate.dtype}")
    late = ~warming(case.probe, case.fitted.warmup_s)
    bad = late & ~np.isfinite(estimate)
    if bad.any():
        at = case.probe.time_s[np.argmax(bad)]
        fail(f"the estimate is not finite at {at:g} s, beyond the warm-up of {case.fitted.warmup_s:g} s")
    return f"{len(estimate)} finite numbers after a warm-up of {case.fitted.warmup_s:g} s"


def declared_inputs(case: Case) -> str:
    """Check that columns of other families do not matter."""
    random = case.random("inputs")

    def shuffled(name: str, values: np.ndarray) -> np.ndarray:
        return values if is_read(case.fitted, name) else random.permutation(values)

    def empty(name: str, values: np.ndarray) -> np.ndarray:
        return values if is_read(case.fitted, name) else np.full(len(values), np.nan)

    for change, what in ((shuffled, "shuffled"), (empty, "NaN")):
        got = case.fitted.interference(changed(case.probe, change))
        expect_same(case.estimate, got, f"estimates with the undeclared columns as they are and {what}")
    names = list(case.probe.data)[::-1]
    got = case.fitted.interference(replace(case.probe, data={name: case.probe[name] for name in names}))
    expect_same(case.estimate, got, "estimates with the columns in one order and in the other")
    for pattern in case.fitted.requires:
        less = {n: v for n, v in case.probe.data.items() if columns.family_of(n).pattern != pattern}
        try:
            case.fitted.interference(replace(case.probe, data=less))
        except RequestError:
            continue
        fail(f"it estimates without {pattern}, which it requires")
    return f"columns other than {', '.join(case.fitted.requires) or 'none'} do not matter"


def labels(case: Case) -> str:
    """Check that labels and truth of what is estimated do not matter, wherever they lie in memory."""
    later = replace(case.probe, time_s=case.probe.time_s + LATER_S)
    wave = 50.0 + 5.0 * np.sin(0.7 * later.time_s)

    def wrong(name: str, values: np.ndarray) -> np.ndarray:
        return values + wave if columns.role_of(name) in ("label", "truth") else values

    without = case.fitted.interference(later.blind())
    got = case.fitted.interference(changed(later, wrong))
    expect_same(without, got, "estimates of a recording without labels and of one with wrong ones")
    return "the estimate of a recording is the same with wrong labels and without any"


def clock(case: Case) -> str:
    """Check that name and time tags are no inputs: nothing that was learned is found again by them."""
    allowed = 1e-3 * case.size_nt + 1e-3
    for recording in (case.probe, case.flights[0]):
        expected = case.fitted.interference(recording)
        other = replace(recording, name=f"{recording.name}_again", time_s=recording.time_s + LATER_S)
        expect_same(expected, case.fitted.interference(other), "estimates of the same rows at another time", allowed)
    inputs = changed(case.flights[0], lambda n, v: v[::-1] if is_read(case.fitted, n) else v)
    if case.fitted.requires and case.size_nt > SAME_NT:
        apart = off(case.fitted.interference(case.flights[0]), case.fitted.interference(inputs))
        if apart <= SAME_NT:
            fail("rows that were learned get the estimate of their times, whatever their inputs")
    return f"the same rows {LATER_S:g} s later get the same estimate within {allowed:.2g} nT"


def causality(case: Case) -> str:
    """Check that what comes later than the declared look-ahead does not matter."""
    ahead = case.fitted.lookahead_rows
    if ahead is None:
        skip("it looks ahead without limit (lookahead_rows is None)")
    count = min(len(case.probe), 2000)
    part = case.probe.take(slice(0, count))
    expected = case.fitted.interference(part)
    random = case.random("causality")
    for last in np.sort(random.integers(count // 4, count - ahead - 10, TIMES)).tolist():
        keep = last + ahead + 1

        def other(name: str, values: np.ndarray, keep: int = keep) -> np.ndarray:
            inputs = columns.role_of(name) == "input" and not columns.MAG_VALID.match(name)
            return np.concatenate([values[:keep], values[keep:][::-1]]) if inputs else values

        got = case.fitted.interference(changed(part, other))
        apart = off(expected[: last + 1], got[: last + 1])
        if apart > SAME_NT:
            fail(
                f"lookahead_rows is {ahead}, but the estimate up to row {last} changes by {apart:.3g} nT with what "
                f"comes after row {last + ahead}"
            )
    return f"rows more than {ahead} later do not matter, at {TIMES} times"


def gaps(case: Case) -> str:
    """Check that nothing reaches across a gap in time."""
    if case.fitted.adapts:
        skip("it learns in flight (adapts), and what it has learned stays over a gap")
    count = len(case.probe)
    rows = np.ones(count, dtype=bool)
    rows[count // 3 : count // 3 + 40] = False
    holed = case.probe.take(rows)
    whole = case.fitted.interference(holed)
    for span in spans(holed.time_s):
        piece = case.fitted.interference(holed.take(span))
        expect_same(piece, whole[span], "estimates of a piece alone and beside another one", SAME_NT)
    return "pieces between gaps are estimated as if each were alone"


def dropouts(case: Case) -> str:
    """Check that rows in which the magnetometer does not read are not learned, and are estimated."""
    found = []
    for nonsense in (0.0, 1e5):
        found.append(case.fit(tuple(_holed(r, case.sensor, nonsense) for r in case.flights)))
    estimates = [fitted.interference(case.probe) for fitted in found]
    expect_same(estimates[0], estimates[1], "fits to recordings with one nonsense in their dropouts and with another")
    if case.reads_mag:
        return "rows in which the magnetometer does not read are not learned"
    holed = _holed(case.probe, case.sensor, 0.0)
    expect_same(case.estimate, case.fitted.interference(holed), "estimates with and without dropouts")
    return "rows in which the magnetometer does not read are not learned, and are estimated"


def _holed(recording: Recording, sensor: str, nonsense_nt: float) -> Recording:
    """Return a recording with a dropout of a second every 100 s, the reading in it nonsense; labels are right there."""
    away = np.arange(len(recording)) % round(100.0 * recording.rate_hz) < round(recording.rate_hz)
    mag = columns.MAG.name(sensor=sensor)
    data = {**recording.data, mag: np.where(away, nonsense_nt, recording[mag])}
    name = columns.MAG_VALID.name(sensor=sensor)
    valid = data.get(name, np.ones(len(recording)))
    return replace(recording, data={**data, name: np.where(away, 0.0, valid)})
