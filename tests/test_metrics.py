import numpy as np
import pytest

from magsim import metrics, signals

RATE = 10.0

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
    """A signal whose signature in each cell runs from the minimum to the maximum, with other rows between."""
    rows = []
    for direction, cells in table.items():
        for code, (low, high) in zip((2, 1, 3), cells, strict=True):
            rows += [(direction, code, v) for v in np.linspace(low, high, 11)] + [(direction, 0, 9.0)]
    heading, maneuver, values = np.array(rows).T
    return values, heading, maneuver


@pytest.mark.parametrize(
    ("sensor", "printed", "redone"), [("port", 0.786, 0.7864), ("starboard", 0.948, 0.9480), ("tail", 0.903, 0.9030)]
)
def test_fom_of_the_bgs_table(sensor, printed, redone):
    cells = metrics.fom_cells(*fom_flight(BGS[sensor]))
    assert len(cells) == 12
    assert metrics.fom(cells) == pytest.approx(redone, abs=5e-5)
    assert round(metrics.fom(cells), 3) == printed
    assert cells[metrics.Cell(90, 2)] == pytest.approx(np.ptp(BGS[sensor][90][0]))


def test_fom_variants():
    # Two oscillations of 2 and 3 nT peak to peak on a drift of 1 nT.
    values = np.array([0.0, 2.0, 1.0, 4.0, 50.0])
    heading, maneuver, cycle = np.full(5, 90.0), np.array([1, 1, 1, 1, 0]), np.array([1, 1, 2, 2, 0])
    assert metrics.fom_cells(values, heading, maneuver) == {(90.0, 1): 4.0}
    assert metrics.fom_mean_cells(values, heading, maneuver, cycle) == {(90.0, 1): 2.5}
    mask = np.array([True, True, False, False, True])
    assert metrics.fom(metrics.fom_cells(values, heading, maneuver, mask)) == 2.0
    assert np.isnan(metrics.fom({}))
    assert metrics.fom([1.0, 0.5]) == 1.5


def test_std_and_rms_of_known_values():
    x = np.array([1.0, 3.0, 5.0])
    assert metrics.std(x) == pytest.approx(np.sqrt(8 / 3))
    assert metrics.rms(x) == pytest.approx(np.sqrt(35 / 3))
    assert metrics.rmse(x) ** 2 == pytest.approx(metrics.rmse_0(x) ** 2 + 9.0)
    # The offset of a total field does not spoil it.
    assert metrics.std(x * 1e-3 + 50_000.0) == pytest.approx(1e-3 * np.sqrt(8 / 3), rel=1e-6)


def flight(seconds=600.0):
    t = np.arange(0, seconds, 1 / RATE)
    interference = 300.0 + 20.0 * np.sin(2 * np.pi * 0.2 * t) + 5.0 * np.sin(2 * np.pi * 0.35 * t)
    clean = 43_000.0 + 100.0 * np.sin(2 * np.pi * 0.002 * t)
    return t, interference, clean


def test_improvement_ratio_of_a_share():
    _, interference, _ = flight()
    assert metrics.improvement_ratio(interference, 0.01 * interference, RATE) == pytest.approx(100.0)
    assert metrics.improvement_ratio(interference, interference + 7.0, RATE) == pytest.approx(1.0, abs=1e-6)
    assert metrics.improvement_ratio(interference, 0.0 * interference, RATE) == np.inf
    assert metrics.band_std(interference, RATE) == pytest.approx(np.hypot(20, 5) / np.sqrt(2), rel=0.01)


def test_only_masked_rows_count():
    t, interference, _ = flight()
    error = np.where(t < 300.0, 0.1, 1.0) * np.sin(2 * np.pi * 0.2 * t)
    early, late = (t > 60) & (t < 240), (t > 360) & (t < 540)
    ratio = metrics.improvement_ratio(interference, error, RATE, early) / metrics.improvement_ratio(
        interference, error, RATE, late
    )
    assert ratio == pytest.approx(10.0, rel=0.01)


def test_paper_ratios_reward_a_constant():
    """Why they are for comparison only: a constant output beats the perfect compensator."""
    t, interference, clean = flight()
    reading = clean + interference
    perfect = metrics.ir_paper(reading, clean, RATE)
    assert metrics.ir_paper(reading, np.full(len(t), 43_000.0), RATE) > 1e3 * perfect
    assert metrics.ir_paper(reading, reading, RATE) == 1.0
    # A sine well inside both bands that is made 50 times smaller.
    wave = np.sin(2 * np.pi * 0.2 * t)
    assert metrics.ir_003(wave, 0.02 * wave, RATE) == pytest.approx(50.0)
    # 0.06 Hz is outside the band of one and inside that of the other.
    slow = 10 * np.sin(2 * np.pi * 0.05 * t)
    assert metrics.ir_003(wave + slow, wave, RATE) > 5.0
    assert metrics.ir_paper(wave + slow, wave, RATE) == pytest.approx(1.0, abs=0.05)


def test_crop():
    t = np.arange(0.0, 100.0, 0.1) + 5.0
    kept = t[metrics.crop(t)]
    assert kept[0] == pytest.approx(35.0)
    assert kept[-1] == pytest.approx(t[-1] - signals.EDGE_S)
    assert metrics.crop(t, 0.0).all()
    assert not metrics.crop(t, 60.0).any()


def test_crop_leaves_what_the_filter_does_not_spoil():
    """The band-passed middle depends on nothing outside by more than 1 % of it."""
    rng = np.random.default_rng(0)
    x = signals.band_pass(rng.normal(size=6000), RATE)
    cut = slice(2000, 4000)
    inside = signals.band_pass(x[cut], RATE)
    kept = metrics.crop(np.arange(2000) / RATE)
    assert metrics.rms((inside - signals.band_pass(x, RATE)[cut])[kept]) < 0.01 * metrics.rms(x)


def test_the_high_pass_needs_longer_ends():
    """The same for the high-pass, with 0.1 nT on a field of 3 nT/km flown at 70 m/s: 60 s are enough, 30 s are not."""
    noise = signals.band_pass(np.random.default_rng(0).normal(size=12000), RATE)
    x = 0.1 * noise / metrics.std(noise) + 0.21 * np.arange(12000) / RATE
    whole = signals.high_pass(x, RATE)
    cut = slice(4000, 8000)
    spoilt = signals.high_pass(x[cut], RATE) - whole[cut]
    t = np.arange(4000) / RATE
    share = {edge: metrics.rms(spoilt[metrics.crop(t, edge)]) / metrics.rms(whole[cut]) for edge in (30.0, 60.0)}
    assert share[signals.HIGH_PASS_EDGE_S] < 0.01
    assert 0.02 < share[signals.EDGE_S] < 0.1


def test_too_short_to_score():
    with pytest.raises(ValueError, match="longer than 60 s"):
        metrics.band_std(np.zeros(500), RATE)
    with pytest.raises(ValueError, match="longer than 120 s"):
        metrics.ir_003(np.zeros(1000), np.zeros(1000), RATE)


def test_heading_shift():
    error = np.array([1.0, 3.0, -1.0, 0.0, 100.0])
    heading = np.array([0.0, 0.0, 90.0, 180.0, 270.0])
    assert metrics.heading_shift(error, heading, np.arange(5) < 4) == 3.0
    assert metrics.heading_shift(error, heading) == 101.0
