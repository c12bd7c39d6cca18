"""Scores of residuals, against published figures and sums by hand."""

import inspect

import numpy as np
import pytest
from scipy import signal

from magsim import signals
from magsim.benchmark import METRICS, Judged, Metric, Residuals, judge, scores_of
from magsim.benchmark.formulas import (
    anomaly_gain,
    distortion,
    excess_pt,
    figure_of_merit,
    gain_at,
    heading_dc,
    r_squared,
    ratio,
    rms,
    std,
)
from magsim.benchmark.judging import fourth_difference
from magsim.benchmark.metrics import BY_NAME, STANDARD, WITH_TABLE, check_scores
from magsim.compensation import create
from magsim.errors import RequestError
from tests.support import scores
from tests.support.worlds import World, calibration

RATE = 10.0
JUDGED = Judged("flight", "", "cabin", None, 0, "method")


def residuals(values, **more):
    """Residuals whose signals are all the same, but for those that are given."""
    values = np.asarray(values, dtype=float)
    names = ("reading", "compensated", "reading_high", "compensated_high", "fourth")
    table = {"time_s": np.arange(len(values)) / RATE, "piece": np.zeros(len(values)), "far": np.ones(len(values))}
    table |= dict.fromkeys(("injected", "change"), np.zeros((len(values), 3)))
    return Residuals(JUDGED, **table | dict.fromkeys(names, values) | more)


# Signatures (minimum, maximum) in nT of a figure-of-merit flight: British Geological Survey, report OR/14/014
# (TellusSW; Beamish and White 2014), appendix 3, first table, line 77110. Roll, pitch, yaw for each direction.
BGS = {
    "port": {
        0: [(-0.0435, 0.0281), (-0.0391, 0.0387), (-0.0209, 0.0080)],
        270: [(-0.0515, 0.0298), (-0.0375, 0.0436), (-0.0359, 0.0315)],
        180: [(-0.0203, 0.0342), (-0.0268, 0.0223), (-0.0439, 0.0487)],
        90: [(0.0041, 0.0210), (-0.0618, 0.0376), (-0.0196, 0.0462)],
    },
    "starboard": {
        0: [(-0.0273, 0.0418), (-0.0405, 0.0271), (-0.0099, 0.0071)],
        270: [(-0.0301, 0.0322), (-0.0760, 0.0355), (-0.0309, 0.0300)],
        180: [(-0.0952, 0.1374), (-0.0513, -0.0067), (-0.0662, 0.0883)],
        90: [(-0.0473, 0.0224), (-0.0372, -0.0007), (-0.0044, 0.0173)],
    },
    "tail": {
        0: [(-0.0150, 0.0225), (-0.0404, 0.0363), (-0.0268, 0.0289)],
        270: [(-0.0267, 0.0308), (-0.1177, 0.0272), (-0.0546, 0.0358)],
        180: [(-0.0048, 0.0535), (-0.0792, 0.0710), (-0.0468, 0.0379)],
        90: [(-0.0160, 0.0048), (-0.0241, 0.0355), (-0.0361, 0.0306)],
    },
}


def fom_flight(table):
    """Residuals whose signature in each cell runs from the minimum to the maximum, with other rows between."""
    rows = []
    for direction, cells in table.items():
        for code, (low, high) in zip((2, 1, 3), cells, strict=True):
            rows += [(direction, code, v) for v in np.linspace(low, high, 11)] + [(direction, 0, 9.0)]
    heading, maneuver, values = np.array(rows).T
    return residuals(
        np.full(len(values), 7.0), heading_deg=heading, maneuver=maneuver, error=values, interference=values
    )


@pytest.mark.parametrize(
    ("sensor", "printed", "redone"), [("port", 0.786, 0.7864), ("starboard", 0.948, 0.9480), ("tail", 0.903, 0.9030)]
)
def test_figure_of_merit_of_the_bgs_table(sensor, printed, redone):
    flight = fom_flight(BGS[sensor])
    assert len(flight.cells) == 12
    fom = BY_NAME["fom_nt"].of(flight)
    assert fom == pytest.approx(redone, abs=5e-5)
    assert round(fom, 3) == printed
    found = {(part, metric): value for part, metric, value in scores_of(flight)}
    assert found["heading 90 roll", "peak_nt"] == pytest.approx(np.ptp(BGS[sensor][90][0]))
    assert found["test", "fom_nt"] == fom
    # of the compensated reading, which is constant here
    assert found["test", "fom_paper_nt"] == 0.0


def test_figure_of_merit_is_of_the_whole_signature_of_each_maneuver():
    """Two oscillations of 2 and 3 nT peak to peak on a drift: 4 nT, not their mean."""
    values = np.array([0.0, 2.0, 1.0, 4.0, 50.0, 1.0, 2.5])
    heading, maneuver = np.array([90.0] * 5 + [180.0] * 2), np.array([1, 1, 1, 1, 0, 1, 1])
    flight = residuals(values, heading_deg=heading, maneuver=maneuver)
    assert figure_of_merit(flight, values) == 4.0 + 1.5
    assert not residuals(values).has("cells")
    assert BY_NAME["fom_paper_nt"].of(residuals(values)) is None


def test_spread_of_known_values():
    x = np.array([1.0, 3.0, 5.0])
    assert std(x) == pytest.approx(np.sqrt(8 / 3))
    assert rms(x) == pytest.approx(np.sqrt(35 / 3))
    # The offset of a total field does not spoil it.
    assert std(x * 1e-3 + 50_000.0) == pytest.approx(1e-3 * np.sqrt(8 / 3), rel=1e-6)
    found = residuals(np.zeros(3), error_raw=x)
    assert BY_NAME["rmse_nt"].of(found) ** 2 == pytest.approx(BY_NAME["rmse0_nt"].of(found) ** 2 + 9.0)


def test_ratio_at_its_ends():
    assert ratio(3.0, 2.0) == 1.5
    assert ratio(3.0, 0.0) == np.inf
    assert np.isnan(ratio(0.0, 0.0))


def test_gain_is_the_share_of_an_anomaly_that_is_left():
    wave = np.sin(np.arange(100.0))
    injected = np.stack([0.1 * wave, wave, 0.0 * wave], axis=1)

    def found(change):
        return residuals(wave, injected=injected, change=change)

    share = found(injected * [0.3, 0.9, 1.0])
    assert [gain_at(share, height) for height in (0, 1)] == pytest.approx([0.3, 0.9])
    assert np.isnan(gain_at(share, 2))
    # the worst of those that there are
    assert anomaly_gain(share) == pytest.approx(0.3)
    assert BY_NAME["gain_1"].of(share) == pytest.approx(0.9)
    beside = found(injected + np.cos(np.arange(100.0))[:, None])
    assert gain_at(beside, 1) == pytest.approx(1.0, abs=0.02)
    assert np.isnan(anomaly_gain(residuals(np.zeros(5))))


def test_distortion_is_what_is_no_copy_of_the_anomaly():
    wave = np.sin(2.0 * np.pi * np.arange(100.0) / 20.0)
    beside = np.cos(2.0 * np.pi * np.arange(100.0) / 20.0)
    injected = np.stack([wave, 20.0 * wave, 0.0 * wave], axis=1)
    share = residuals(wave, injected=injected, change=0.5 * injected)
    assert distortion(share) == pytest.approx(0.0, abs=1e-12)
    # a quarter of it, a quarter of a period late; rows at its zeros are not near
    moved = injected + np.stack([0.25 * beside, 0.0 * wave, 0.0 * wave], axis=1)
    late = residuals(wave, injected=injected, change=moved)
    near = np.abs(wave) > 1e-3
    assert distortion(late) == pytest.approx(0.25 * rms(beside[near]) / rms(wave[near]))
    assert np.isnan(distortion(residuals(wave)))


def test_excess_is_what_the_instrument_does_not_explain():
    rng = np.random.default_rng(1)
    floor, own = rng.normal(size=(2, 10_000))
    own -= floor * (own @ floor) / (floor @ floor)
    found = residuals(floor, error=0.003 * floor + 0.004 * own, floor=0.003 * floor)
    assert excess_pt(found) == pytest.approx(4.0, rel=0.05)
    assert excess_pt(residuals(floor, error=0.002 * floor, floor=0.003 * floor)) == 0.0


def test_scores_of_the_whole_error():
    interference = np.array([3.0, -1.0, 5.0, 1.0])
    found = residuals(interference, interference_raw=interference, error_raw=np.array([0.5, 0.5, -0.5, 0.5]))
    assert r_squared(found) == pytest.approx(1.0 - 1.0 / 20.0)
    assert BY_NAME["ir_pp"].of(found) == 6.0
    legs = {"heading_deg": np.array([0.0, 0.0, 90.0, 90.0]), "turn": np.zeros(4), "maneuver": np.zeros(4)}
    turned = residuals(interference, error_raw=np.array([0.5, 0.7, -0.5, 0.5]), **legs)
    assert heading_dc(turned) == pytest.approx(0.6)


def test_the_slow_error_is_of_the_rows_that_have_one():
    """A piece that is too short has none; where no piece is long enough there is no score."""
    slow = np.array([np.nan, 3.0, 5.0, np.nan])
    found = residuals(np.zeros(4), error_raw=np.zeros(4), slow=slow)
    assert BY_NAME["slow_nt"].of(found) == 1.0
    assert BY_NAME["slow_nt"].of(found.take(np.array([0, 3]))) is None


def test_the_fourth_difference_of_noise_has_its_published_size():
    """Of white noise: the root of 70, the sum of the squares of 1, 4, 6, 4, 1, over 16."""
    noise = np.random.default_rng(0).normal(size=200_000)
    assert np.std(fourth_difference(noise)) == pytest.approx(np.sqrt(70.0) / 16.0, rel=0.01)
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.3, 0.01])(np.arange(50.0))
    assert np.abs(fourth_difference(cubic)).max() < 1e-9


def flight(seconds=600.0):
    t = np.arange(0, seconds, 1 / RATE)
    interference = 300.0 + 20.0 * np.sin(2 * np.pi * 0.2 * t) + 5.0 * np.sin(2 * np.pi * 0.35 * t)
    clean = 43_000.0 + 100.0 * np.sin(2 * np.pi * 0.002 * t)
    return t, interference, clean


def band(values, rate_hz=RATE):
    return signals.band_pass(values, rate_hz)[scores.off_ends(len(values), rate_hz)]


def test_improvement_ratio_of_a_share():
    _, interference, _ = flight()
    found = residuals(band(interference), interference=band(interference), error=band(0.01 * interference))
    assert BY_NAME["ir"].of(found) == pytest.approx(100.0)
    shifted = residuals(band(interference), interference=band(interference), error=band(interference + 7.0))
    assert BY_NAME["ir"].of(shifted) == pytest.approx(1.0, abs=1e-6)
    perfect = residuals(band(interference), interference=band(interference), error=0.0 * band(interference))
    assert BY_NAME["ir"].of(perfect) == np.inf
    assert BY_NAME["std_nt"].of(shifted) == pytest.approx(np.hypot(20, 5) / np.sqrt(2), rel=0.01)


def test_paper_ratios_reward_a_constant():
    """Why they are for comparison only: a constant output beats the perfect compensator."""
    t, interference, clean = flight()
    reading = clean + interference

    def paper(before, after):
        return BY_NAME["ir_paper"].of(residuals(band(before), compensated=band(after)))

    def high(before, after):
        before, after = (signals.high_pass(values, RATE) for values in (before, after))
        far = np.zeros(len(before))
        far[scores.off_ends(len(before), RATE, 60.0)] = 1.0
        return BY_NAME["ir_003"].of(residuals(before, reading_high=before, compensated_high=after, far=far))

    perfect = paper(reading, clean)
    assert paper(reading, np.full(len(t), 43_000.0)) > 1e3 * perfect
    assert paper(reading, reading) == 1.0
    # A sine well inside both bands that is made 50 times smaller.
    wave = np.sin(2 * np.pi * 0.2 * t)
    assert high(wave, 0.02 * wave) == pytest.approx(50.0)
    # 0.05 Hz is outside the band of one and inside that of the other.
    slow = 10 * np.sin(2 * np.pi * 0.05 * t)
    assert high(wave + slow, wave) > 5.0
    assert paper(wave + slow, wave) == pytest.approx(1.0, abs=0.05)


def test_every_metric_is_whole():
    """A name with its unit as suffix, a unit, a meaning, and one function of residuals."""
    assert len(BY_NAME) == len(METRICS)
    for metric in METRICS:
        assert metric.unit in ("nT", "pT", "1")
        for unit in ("nT", "pT"):
            assert metric.name.endswith(f"_{unit.lower()}") == (metric.unit == unit)
        assert len(metric.meaning) > 10
        assert metric.better in ("less", "more", "one")
        assert set(metric.needs) <= {*Residuals.__dataclass_fields__, "cells"}
        assert set(metric.scopes) <= {"test", "segment", "cell"}
        assert metric.scopes
        assert len(inspect.signature(metric.score).parameters) == 1
        # parts of a flight have a table, and nothing else has
        assert bool(metric.table) == (metric.scopes != ("test",))
        assert metric.stands_in_for in ("", *WITH_TABLE)
    assert set(STANDARD) <= set(WITH_TABLE)


def test_scores_are_pure():
    recording = calibration(World())
    found = judge(create("tl16").fit(recording), recording)
    before = {name: values.copy() for name, values in found._signals().items()}
    assert scores_of(found) == scores_of(found)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(found, name), values)


@pytest.fixture(scope="module")
def judged():
    """A fitted method on the test rows alone, and what it is made of by hand."""
    recording = calibration(World())
    test = recording.where(split="test")
    method = create("tl16_measured").fit(recording)
    return test, method.interference(test), {k[:2]: k[2] for k in scores_of(judge(method, test))}


def test_scores_of_all_test_rows_are_those_of_the_definition(judged):
    """By hand: the error against B_t - B_e, the whole test part filtered, 30 s cropped at both ends."""
    test, estimate, found = judged
    rate_hz = test.rate_hz
    reading = test["mag_cabin_nt"]
    interference = reading - test["clean_cabin_nt"]
    error, compensated = interference - estimate, reading - estimate
    keep = scores.off_ends(len(test), rate_hz)
    noise = interference - test["interference_cabin_nt"]
    line = np.polynomial.Polynomial.fit(test.time_s, error, 1)
    sos = signal.butter(2, [0.005, 0.1], "bandpass", fs=rate_hz, output="sos")
    slow = signal.sosfiltfilt(sos, error - line(test.time_s))
    heading, straight = test["leg_heading_deg"][keep], test["turn"][keep] == 0.0
    expected = {
        "std_nt": scores.band_std(error, rate_hz),
        "ir": scores.improvement_ratio(interference, error, rate_hz),
        "rmse_nt": scores.rmse(error[keep]),
        "rmse0_nt": np.std(error[keep]),
        "fom_nt": sum(scores.peaks(band(error, rate_hz), test["leg_heading_deg"][keep], test["maneuver"][keep])),
        "excess_pt": 1e3 * np.sqrt(scores.band_std(error, rate_hz) ** 2 - scores.band_std(noise, rate_hz) ** 2),
        "slow_nt": np.std(slow[keep]),
        "heading_dc_nt": np.ptp([error[keep][straight & (heading == course)].mean() for course in (0, 90, 180, 270)]),
        "r2": 1.0 - np.sum(error[keep] ** 2) / np.sum((interference[keep] - interference[keep].mean()) ** 2),
        "ir_pp": np.ptp(interference[keep]) / np.ptp(error[keep]),
        "fourth_nt": np.std(np.diff(np.pad(compensated, 2), 4)[keep] / 16.0),
        **dict.fromkeys(("gain", "gain_0.1", "gain_1", "gain_20"), 1.0),
        "distortion": 0.0,
        "std_paper_nt": scores.band_std(compensated, rate_hz),
        "ir_paper": scores.improvement_ratio(reading, compensated, rate_hz),
        "ir_003": scores.ir_003(reading, compensated, rate_hz),
        "fom_paper_nt": sum(
            scores.peaks(band(compensated, rate_hz), test["leg_heading_deg"][keep], test["maneuver"][keep])
        ),
    }
    assert {metric for part, metric in found if part == "test"} == set(expected)
    for name, value in expected.items():
        assert found["test", name] == pytest.approx(value, rel=1e-9, abs=1e-10), name


def test_scores_of_parts_are_those_of_their_rows(judged):
    test, estimate, found = judged
    rate_hz = test.rate_hz
    reading = test["mag_cabin_nt"]
    interference = reading - test["clean_cabin_nt"]
    keep = scores.off_ends(len(test), rate_hz)
    heading, maneuver, turn = (test[name][keep] for name in ("leg_heading_deg", "maneuver", "turn"))
    error, before = band(interference - estimate, rate_hz), band(interference, rate_hz)
    parts = {f"heading {value}": (turn == 0.0) & (heading == value) for value in (0, 90, 180, 270)}
    parts |= {word: maneuver == code for code, word in ((1, "pitch"), (2, "roll"), (3, "yaw"))}
    compensated = reading - estimate
    far = np.zeros(len(test), dtype=bool)
    far[keep] = True
    for name, rows in parts.items():
        assert found[name, "std_nt"] == pytest.approx(np.std(error[rows]), rel=1e-9)
        assert found[name, "ir"] == pytest.approx(np.std(before[rows]) / np.std(error[rows]), rel=1e-9)
        far[keep] = rows
        assert found[name, "ir_003"] == pytest.approx(scores.ir_003(reading, compensated, rate_hz, far), rel=1e-9)
    cells = {
        f"heading {course} {word}": rows & (heading == course)
        for word, rows in list(parts.items())[4:]
        for course in (0, 90, 180, 270)
    }
    for name, rows in cells.items():
        assert found[name, "peak_nt"] == pytest.approx(np.ptp(error[rows]), rel=1e-9)
        assert found[name, "peak_paper_nt"] == pytest.approx(np.ptp(band(compensated, rate_hz)[rows]), rel=1e-9)
    assert {part for part, _ in found} == {"test", *parts, *cells}
    assert {metric for part, metric in found if part in cells} == {"peak_nt", "peak_paper_nt"}


@pytest.mark.parametrize(
    ("better", "value", "text"),
    [
        ("less", 0.123456, "0.1235"),
        ("less", None, "-"),
        ("less", np.nan, "-"),
        ("more", np.inf, "inf"),
        ("more", 9.994, "9.99"),
        ("more", 123.456, "123.5"),
        ("one", 0.99949, "0.999"),
    ],
)
def test_values_as_text(better, value, text):
    assert Metric("x", "1", "some meaning", better, (), lambda r: 0.0, ("test",)).show(value) == text


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["ir_03"], r"there is no table of 'ir_03' \(did you mean 'ir_003'\?\); allowed: std_nt, ir, peak_nt, std_pap"),
        (["std_nt", "gain"], "there is no table of 'gain'; allowed: std_nt"),
        ([], "no score is named; allowed: std_nt"),
    ],
)
def test_scores_without_a_table_are_refused(names, text):
    with pytest.raises(RequestError, match=text):
        check_scores(names)
