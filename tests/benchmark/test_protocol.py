from dataclasses import replace

import numpy as np
import pytest

from magsim import columns, signals
from magsim.benchmark import evaluate
from magsim.benchmark.anomaly import anomaly, gain
from magsim.compensation import Compensator, create
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from tests.support import scores
from tests.support.worlds import World, calibration

WORLD = World()


class Stub(Compensator):
    """A method made of one function of the blind recording; remembers what it was given."""

    name = "stub"

    def __init__(self, *, function=None, warmup=0.0):
        self.function = function
        self.warmup = warmup
        self.seen = []

    @property
    def warmup_s(self):
        return self.warmup

    def fit(self, train, *, sensor, valid=(), seed=0):
        self.sensor_ = sensor
        self.given = (train, valid, seed)
        return self

    def interference(self, recording):
        self.seen.append(recording)
        return self.function(recording)

    def _learned(self):
        return {}, {}

    def _restore(self, values, arrays):
        pass


def zeros(recording):
    return np.zeros(len(recording))


def without(recording, *stems):
    data = {k: v for k, v in recording.data.items() if not k.startswith(stems)}
    return replace(recording, data=data)


@pytest.fixture(scope="module")
def recording():
    return calibration(WORLD)


def test_nothing_and_the_noise_floor(recording):
    """White noise of 0.01 nT at 10 Hz is 0.0030 nT in band; without compensation the ratio is 1."""
    report = evaluate([recording], ["none", "noise_floor"])
    assert report.value("none", "ir") == 1.0
    assert report.value("none", "ir_paper") == 1.0
    assert report.value("noise_floor", "std_nt") == pytest.approx(0.0030, abs=0.0002)
    assert report.value("noise_floor", "rmse_nt") == pytest.approx(0.01, rel=0.03)
    assert report.value("noise_floor", "gain") == pytest.approx(1.0, abs=1e-12)
    ratio = report.value("none", "std_nt") / report.value("noise_floor", "std_nt")
    assert report.value("noise_floor", "ir") == pytest.approx(ratio)


def test_scores_are_those_of_the_definition(recording):
    """By hand: the error against B_t - B_e, whole test part filtered, 30 s cropped at both ends."""
    report = evaluate([recording], ["tl16"])
    test = recording.where(split="test")
    method = create("tl16").fit(
        [recording.where(split="train").labeled()], sensor="cabin", valid=[recording.where(split="valid").labeled()]
    )
    reading = test["mag_cabin_nt"]
    interference = reading - test["clean_cabin_nt"]
    estimate = method.interference(test.blind())
    error = interference - estimate
    keep = slice(300, len(test) - 300)
    bands = {k: signals.band_pass(v, 10.0)[keep] for k, v in {"e": error, "i": interference, "t": reading}.items()}
    assert report.value("tl16", "std_nt") == pytest.approx(np.std(bands["e"]), rel=1e-12)
    assert report.value("tl16", "ir") == pytest.approx(np.std(bands["i"]) / np.std(bands["e"]), rel=1e-12)
    assert report.value("tl16", "rmse_nt") == pytest.approx(np.sqrt(np.mean(error[keep] ** 2)), rel=1e-12)
    assert report.value("tl16", "rmse0_nt") == pytest.approx(np.std(error[keep]), rel=1e-12)
    compensated = signals.band_pass(reading - estimate, 10.0)[keep]
    assert report.value("tl16", "std_paper_nt") == pytest.approx(np.std(compensated), rel=1e-9)
    assert report.value("tl16", "ir_paper") == pytest.approx(np.std(bands["t"]) / np.std(compensated), rel=1e-9)
    cells = metrics.fom_cells(bands["e"], test["leg_heading_deg"][keep], test["maneuver"][keep])
    assert len(cells) == 12
    assert report.value("tl16", "fom_nt") == pytest.approx(sum(cells.values()), rel=1e-12)
    roll = test["maneuver"][keep] == 2
    assert report.value("tl16", "std_nt", segment="roll") == pytest.approx(np.std(bands["e"][roll]), rel=1e-12)
    leg = roll & (test["leg_heading_deg"][keep] == 90.0)
    assert report.value("tl16", "peak_nt", segment="heading 90 roll") == pytest.approx(np.ptp(bands["e"][leg]))
    straight = (test["leg_heading_deg"][keep] == 180.0) & (test["turn"][keep] == 0.0)
    assert report.value("tl16", "ir", segment="heading 180") == pytest.approx(
        np.std(bands["i"][straight]) / np.std(bands["e"][straight]), rel=1e-12
    )


def test_the_ratio_above_3_hundredths_hz_is_that_of_the_metric(recording):
    """On all test rows and on each heading, 60 s from the ends; the rest of the rows have the other scores."""
    test = recording.where(split="test")
    method = create("tl16_measured").fit([recording.where(split="train").labeled()], sensor="cabin")
    report = evaluate([recording.where(split="test")], [("tl", method), "noise_floor"])
    reading, rate_hz = test["mag_cabin_nt"], test.rate_hz
    compensated = reading - method.interference(test.blind())
    assert report.value("tl", "ir_003") == pytest.approx(scores.ir_003(reading, compensated, rate_hz), rel=1e-12)
    into = test.time_s - test.time_s[0]
    far = (into >= 60.0 - 1e-9) & (into <= into[-1] - 60.0 + 1e-9)
    found = {}
    for heading in (0, 90, 180, 270):
        rows = far & (test["turn"] == 0.0) & (test["leg_heading_deg"] == heading)
        found[heading] = report.value("tl", "ir_003", segment=f"heading {heading}")
        expected = scores.ir_003(reading, compensated, rate_hz, rows)
        assert found[heading] == pytest.approx(expected, rel=1e-12)
    assert len(set(found.values())) == 4
    assert report.value("tl", "ir_003", segment="roll") > 1.0
    floor = scores.ir_003(reading, reading - test["interference_cabin_nt"], rate_hz)
    assert report.value("noise_floor", "ir_003") == pytest.approx(floor, rel=1e-12)
    assert report.about["high_pass_edge_s"] == 60.0


def test_pieces_that_are_too_short_for_the_high_pass_lack_its_score(recording):
    short = recording.take(slice(0, 6400 + 1100))
    report = evaluate([short], ["none"])
    assert report.value("none", "ir") == 1.0
    assert "ir_003" not in {row.metric for row in report.rows}
    assert "recording 'world' has no ir_003: no test piece is longer than the 120 s" in report.to_text()


def test_methods_with_settings_are_called_as_they_are_written(recording):
    texts = ["tl16_gradient:order=0:vertical=false", "tl16_gradient:order=0", "tl16_measured"]
    report = evaluate([recording], texts)
    assert report.methods == tuple(texts)
    plain, height, measured = (report.value(text, "ir") for text in texts)
    assert plain == measured
    assert height > 1.05 * plain
    assert report.about["methods"][texts[0]]["params"]["vertical"] is False


def test_methods_learn_from_labels_and_are_judged_blind(recording):
    stub = Stub(function=zeros)
    evaluate([recording], [stub], seed=7)
    (train,), (valid,), seed = stub.given
    assert seed == 7
    for given, split in ((train, 0), (valid, 1)):
        assert set(given["split"]) == {split}
        assert {columns.role_of(name) for name in given.data} == {"input", "label", "segment"}
        assert set(given.meta) <= {"start_utc"}
    assert len(stub.seen) == 2
    for seen in stub.seen:
        assert {columns.role_of(name) for name in seen.data} == {"input"}
        assert set(seen.meta) <= {"start_utc"}
        assert seen.time_s[0] == recording.where(split="test").time_s[0]


def test_an_anomaly_must_pass():
    """A method that takes the reading itself for interference removes the signal with it."""
    recording = calibration(WORLD)

    def smooth(r):
        reading = r["mag_cabin_nt"]
        return reading - reading.mean()

    report = evaluate([recording], [("constant", Stub(function=smooth)), ("honest", Stub(function=zeros))])
    assert abs(report.value("constant", "gain")) < 1e-9
    # the papers' ratio falls for it
    assert report.value("constant", "ir_paper") > 1e6
    assert report.value("honest", "gain") == pytest.approx(1.0, abs=1e-12)


def test_gain_of_a_scaled_anomaly():
    time_s = np.arange(6000) / 10.0
    injected = signals.band_pass(anomaly(time_s), 10.0)
    assert np.std(injected) > 0.5
    assert anomaly(time_s).max() == pytest.approx(20.0, rel=1e-3)
    assert gain(0.3 * injected, injected) == pytest.approx(0.3)


def test_all_methods_are_judged_on_the_rows_after_the_longest_warmup(recording):
    def late(r):
        return np.where(r.time_s - r.time_s[0] < 50.0, np.nan, 0.0)

    alone = evaluate([recording], ["none"])
    both = evaluate([recording], ["none", Stub(function=late, warmup=50.0)])
    assert both.value("none", "std_nt") == both.value("stub", "std_nt")
    assert both.value("none", "std_nt") != alone.value("none", "std_nt")
    test = recording.where(split="test")
    rest = test.take(slice(500, None))
    interference = rest["mag_cabin_nt"] - rest["clean_cabin_nt"]
    expected = np.std(signals.band_pass(interference, 10.0)[300:-300])
    assert both.value("none", "std_nt") == pytest.approx(expected, rel=1e-12)


def test_pieces_are_filtered_each_by_itself(recording):
    """A hole in the test rows: scores are those of the two pieces together."""
    rows = np.ones(len(recording), dtype=bool)
    rows[9000:9400] = False
    holed = recording.take(rows)
    report = evaluate([holed], ["none"])
    kept = []
    for piece in holed.where(split="test").pieces():
        interference = piece["mag_cabin_nt"] - piece["clean_cabin_nt"]
        kept.append(signals.band_pass(interference, 10.0)[300:-300])
    assert len(kept) == 2
    assert report.value("none", "std_nt") == pytest.approx(np.std(np.concatenate(kept)), rel=1e-12)


def with_dropouts(recording, *spans):
    """Rows without a reading: the column says so, reading and labels there are nonsense."""
    valid = np.ones(len(recording))
    for span in spans:
        valid[span] = 0.0
    wrong = {name: np.where(valid == 1.0, recording[name], 0.0) for name in ("mag_cabin_nt", "interference_cabin_nt")}
    return replace(recording, data={**recording.data, **wrong, "mag_cabin_valid": valid})


def test_rows_without_a_reading_are_neither_learned_nor_judged(recording):
    """Scores and coefficients are those of the recording without these rows."""
    spans = (slice(2500, 2510), slice(9000, 9003), slice(11_000, 11_001))
    holed = with_dropouts(recording, *spans)
    rows = holed["mag_cabin_valid"] == 1.0
    methods = ["none", "tl16_measured", "noise_floor"]
    report, wanted = evaluate([holed], methods), evaluate([recording.take(rows)], methods)
    assert [(row, row.value) for row in report.rows] == [(row, row.value) for row in wanted.rows]
    assert report.value("noise_floor", "std_nt") == pytest.approx(0.0030, abs=0.0003)
    (note,) = report.notes
    assert note.startswith("recording 'world': 4 test rows in which 'cabin' does not read are left out, and 30 s on")
    # Held through, the dropouts would be all that is seen.
    ignored = evaluate([without(holed, "mag_cabin_valid")], ["none"])
    assert ignored.value("none", "std_nt") > 30.0 * report.value("none", "std_nt")


def test_a_magnetometer_that_always_reads_changes_no_bit(recording):
    methods = ["none", "tl16", "tl18_measured", "noise_floor"]
    plain, told = evaluate([recording], methods), evaluate([with_dropouts(recording)], methods)
    assert told.to_json() == plain.to_json()


def test_a_magnetometer_that_never_reads_is_told(recording):
    silent = with_dropouts(recording, slice(None))
    with pytest.raises(RequestError, match="no row of 'world' has split = test and a reading of 'cabin'"):
        evaluate([silent], ["none"])
    with pytest.raises(DataError, match="'cabin' does not read in any row of 'world', 'world' that is to be learned"):
        evaluate([with_dropouts(recording, slice(0, 6400))], ["tl16"])
    often = with_dropouts(recording, slice(None, None, 500))
    with pytest.raises(DataError, match=r"longest test piece without a dropout lasts 49\.8 s"):
        evaluate([often], ["none"])
    other = replace(silent, name="other")
    report = evaluate([recording, other], ["none"])
    assert report.recordings == ("world",)
    assert any(note.startswith("recording 'other': 6400 test rows") for note in report.notes)


def test_several_recordings_are_learned_together_and_judged_each(recording):
    other = calibration(WORLD, 1, "other")
    stub = Stub(function=zeros)
    report = evaluate([recording, other], ["none", stub])
    assert report.recordings == ("world", "other")
    assert [len(side) for side in stub.given[:2]] == [2, 2]
    assert report.value("none", "std_nt", recording="other") != report.value("none", "std_nt", recording="world")
    only = evaluate([recording.where(circuit=1), other], ["none"])
    assert only.recordings == ("other",)


def test_without_truth_only_the_papers_scores(recording):
    survey = without(recording, "clean", "total", "error", *columns.COMPONENTS, "interference", "projection")
    report = evaluate([survey], ["none", "tl16_measured", "noise_floor"])
    assert report.methods == ("none", "tl16_measured")
    found = {row.metric for row in report.rows}
    assert found == {"std_paper_nt", "ir_paper", "ir_003", "fom_paper_nt", "peak_paper_nt", "gain"}
    assert report.value("tl16_measured", "ir_paper") > 50.0
    assert any("has no truth" in note for note in report.notes)
    assert "note: recording 'world' has no truth" in report.to_text()
    bare = without(survey, "leg", "maneuver", "turn", "cycle", "circuit")
    assert {row.segment for row in evaluate([bare], ["none"]).rows} == {"test"}


def test_fitted_methods_are_judged_as_they_are(recording):
    method = create("tl16").fit([recording.where(split="train").labeled()], sensor="cabin")
    before = method.coefficients_.copy()
    test_rows = recording.where(split="test")
    report = evaluate([test_rows], [("trained", method)])
    np.testing.assert_array_equal(method.coefficients_, before)
    assert report.methods == ("trained",)
    assert "trained" not in report.fit_s
    with pytest.raises(RequestError, match="was trained for the sensor 'cabin', not 'wing'"):
        evaluate([test_rows], [method], sensor="wing")


def test_report_is_the_same_twice_but_for_times(recording):
    one, two = (evaluate([recording], ["none", "tl16", "tl18", "noise_floor"]) for _ in range(2))
    assert one.to_json() == two.to_json()
    assert one.to_text(times=False) == two.to_text(times=False)
    assert "fit_s" not in one.to_json()
    assert set(one.fit_s) == {"none", "tl16", "tl18"}


@pytest.mark.parametrize(
    ("change", "methods", "options", "error", "text"),
    [
        (lambda r: r.where(circuit=1), ["none"], {}, RequestError, "no test rows: no row of 'world' has split = test"),
        (lambda r: r.where(circuit=2), ["tl16"], {}, RequestError, "no training rows for tl16"),
        (lambda r: r, ["none"], {"sensor": "wing"}, RequestError, "no scalar magnetometer 'wing'; it has cabin"),
        (lambda r: without(r, "split"), ["none"], {}, RequestError, "has no column 'split'"),
        (lambda r: without(r, "flux"), ["tl16"], {}, RequestError, "has no fluxgate"),
        (lambda r: without(r, "ins_heading"), ["magtcn"], {}, RequestError, "no column ins_heading_deg"),
        (lambda r: without(r, "mag"), ["none"], {}, RequestError, "has no scalar magnetometer"),
        (lambda r: r, ["none", "none"], {}, RequestError, "none is given twice"),
        (lambda r: r, [], {}, RequestError, "no method"),
        (lambda r: r, ["nun"], {}, RequestError, "unknown method 'nun'"),
        (lambda r: r, ["noise_floor:seed=1"], {}, RequestError, "noise_floor has no settings; .* gives seed"),
        (lambda r: without(r, "ins_alt"), ["tl16_gradient"], {}, RequestError, "no column ins_alt_m"),
        (lambda r: r.take(slice(0, 6950)), ["none"], {}, DataError, "longest test piece lasts 54.9 s"),
        (lambda r: r, [Stub(function=lambda r: np.zeros(3))], {}, DataError, r"put out shape \(3,\) for 6400 rows"),
        (lambda r: r, [Stub(function=lambda r: r.time_s * np.nan)], {}, DataError, "not finite at 640 s"),
    ],
)
def test_what_cannot_be_judged_is_told(recording, *, change, methods, options, error, text):
    with pytest.raises(error, match=text):
        evaluate([change(recording)], methods, **options)
    with pytest.raises(RequestError, match="no recording was given"):
        evaluate([], methods)


def test_recording_is_not_changed(recording):
    assert isinstance(recording, Recording)
    before = {name: column.copy() for name, column in recording.data.items()}
    evaluate([recording], ["tl16"])
    for name, column in before.items():
        np.testing.assert_array_equal(recording[name], column)
