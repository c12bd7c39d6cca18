"""The protocol for real surveys, on a survey whose errors are known."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.recording import Recording
from magsim.signals import band_pass, in_band
from tests.benchmarks import survey_protocol as protocol
from tests.support.surveys import EAST_M, NORTH_M, model
from tests.support.worlds import LAT_DEG, LON_DEG

LINES, TIES, LINE_S, TURN_S = 8, 8, 150.0, 30.0
SPEED_MPS, SPACING_M, RATE_HZ = 60.0, 500.0, 10.0


def flown(heading_nt: float, attitude_nt: float, noise_nt: float = 0.01, seed: int = 1) -> np.ndarray:
    """An error that goes with heading and roll, over the survey of ``survey``, (n,) [nT]."""
    r = place()
    noise = noise_nt * np.random.default_rng(seed).normal(size=len(r))
    return (
        heading_nt * np.cos(np.radians(r["ins_heading_deg"]))
        + attitude_nt * np.sin(np.radians(r["ins_roll_deg"])) / np.sin(np.radians(3.0))
        + noise
    )


def place() -> Recording:
    """Eight lines to the north and eight tie lines to the east, with gusts of 3 degrees of roll."""
    rows = round(LINE_S * RATE_HZ)
    along = SPEED_MPS * np.arange(rows) / RATE_HZ
    middle = 0.5 * along[-1]
    parts = []
    for number in range(LINES + TIES):
        is_line, k = number < LINES, number % LINES
        aside = (k - 0.5 * (LINES - 1)) * SPACING_M
        back = -1.0 if k % 2 else 1.0
        ahead = back * (along - middle)
        north, east = (ahead, np.full(rows, aside)) if is_line else (np.full(rows, aside), ahead)
        heading = (0.0 if is_line else 90.0) + (180.0 if back < 0.0 else 0.0)
        time_s = number * (LINE_S + TURN_S) + np.arange(rows) / RATE_HZ
        parts.append((time_s, north, east, np.full(rows, heading), np.full(rows, number + 1.0)))
    time_s, north, east, heading, circuit = (np.concatenate(column) for column in zip(*parts, strict=True))
    rng = np.random.default_rng(0)
    gusts = band_pass(rng.normal(size=len(time_s)), RATE_HZ)
    data = {
        "ins_lat_deg": LAT_DEG + north / NORTH_M,
        "ins_lon_deg": LON_DEG + east / EAST_M,
        "ins_alt_m": np.full(len(time_s), 500.0),
        "ins_roll_deg": 3.0 * gusts / np.std(gusts),
        "ins_pitch_deg": rng.normal(size=len(time_s)),
        "ins_heading_deg": heading + 0.1 * rng.normal(size=len(time_s)),
        "circuit": circuit,
        "split": np.full(len(time_s), 2.0),
    }
    data["ins_heading_deg"] %= 360.0
    return Recording("survey", time_s, data, {"start_utc": "2025-03-13T00:00:00Z"})


def survey(contractor: np.ndarray, method: np.ndarray) -> Recording:
    """The survey with the errors of two channels; the raw one has ten times the heading error."""
    r = place()
    field = model(r) + 4.0 * np.cos(2e-3 * (r["ins_lat_deg"] - LAT_DEG) * NORTH_M)
    data = {
        **r.data,
        "mag_port_nt": field + flown(5.0, 1.0),
        "compensated_contractor_nt": field + contractor,
        "compensated_port_nt": field + method,
    }
    return replace(r, data=data)


def figures(contractor: np.ndarray, method: np.ndarray) -> dict[str, float]:
    return {row.name: row.value for row in protocol.judge([survey(contractor, method)], "port")}


def test_the_figures_are_those_that_were_put_in():
    found = figures(flown(0.5, 0.2), flown(0.1, 0.05, seed=2))
    assert found["lines"] == LINES + TIES
    assert found["crossings"] == LINES * TIES
    # a north line and a tie of heading 90 differ by the error's cosine: +-0.5 nT, whatever drift is free
    assert found["misclosure_contractor"] == pytest.approx(1.4826 * 0.5, rel=0.2)
    assert found["misclosure_method"] == pytest.approx(1.4826 * 0.1, rel=0.3)
    assert found["misclosure_raw"] > 5.0 * found["misclosure_contractor"]
    # roll of 3 degrees (STD) makes what it was given; the band takes none of its waves
    r = place()
    share = in_band(np.sin(np.radians(r["ins_roll_deg"][:1500])), r.time_s[:1500]).std() / np.sin(np.radians(3.0))
    assert found["coherent_contractor"] == pytest.approx(0.2 * share, rel=0.1)
    assert found["coherent_method"] == pytest.approx(0.05 * share, rel=0.1)
    assert found["fourth_difference_method"] == pytest.approx(0.01 * np.sqrt(70.0) / 16.0, rel=0.1)


def test_verdicts():
    better = figures(flown(0.5, 0.2), flown(0.1, 0.05, seed=2))
    assert better["verdict_better"] == 1.0
    assert better["coherent_ratio_upper95"] < 1.0
    worse = figures(flown(0.1, 0.05), flown(0.5, 0.2, seed=2))
    assert worse["verdict_worse"] == 1.0
    alike = figures(flown(0.3, 0.1), flown(0.3, 0.1, seed=2))
    assert alike["verdict_as_good"] + alike["verdict_undecided"] == 1.0
    assert protocol.verdict((0.5, 0.9), (0.7, 1.2)) == "undecided"
    assert protocol.verdict((0.9, 1.1), (0.85, 1.2)) == "as good"


def test_chance_is_taken_off():
    """A channel that knows nothing of the attitude has no coherence to speak of."""
    found = figures(flown(0.0, 0.0, 0.5), flown(0.0, 0.0, 0.5, seed=2))
    inside = 0.5 * np.sqrt(2.0 * 0.5 / RATE_HZ)
    assert found["coherent_method"] < 0.3 * inside
