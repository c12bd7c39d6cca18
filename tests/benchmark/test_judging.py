"""From a fitted method and a recording to residuals."""

from dataclasses import replace

import numpy as np
import pytest

from magsim import columns, signals
from magsim.benchmark import NOISE_FLOOR, Judged, judge
from magsim.benchmark.judging import residuals_of
from magsim.benchmark.residuals import TWINS
from magsim.benchmark.twins import PEAKS_NT, Twin, twin_of
from magsim.compensation import create
from magsim.errors import DataError, RequestError
from magsim.streams import stream
from tests.support.methods import Stub, stub, with_dropouts, without, zeros
from tests.support.worlds import World, calibration

WORLD = World()


@pytest.fixture(scope="module")
def recording():
    return calibration(WORLD)


@pytest.fixture(scope="module")
def test_rows(recording):
    return recording.where(split="test")


def smooth(recording):
    reading = recording["mag_cabin_nt"]
    return reading - reading.mean()


def injected(recording, seed=0):
    """Return the anomalies of the three twins, (n, 3)."""
    rngs = [stream(seed, f"twin/{recording.name}/{peak}") for peak in PEAKS_NT]
    twins = [twin_of(recording, "cabin", rng, peak) for rng, peak in zip(rngs, PEAKS_NT, strict=True)]
    return np.stack([twin.injected for twin in twins], axis=1)


def test_signals_are_those_of_the_definition(recording, test_rows):
    """By hand: test rows with all that was flown before them, filtered whole and cropped."""
    method = create("tl16").fit(recording)
    found = judge(method, recording, level=3, seed=5, file="a.h5")
    assert found.judged == Judged("world", "a.h5", "cabin", 3, 5, "tl16")
    estimate = method.interference(recording)
    reading, clean = recording["mag_cabin_nt"], recording["clean_cabin_nt"]
    # the test rows are the second half, the last one of which ends the recording
    keep = slice(6400, 12_500)

    def band(values):
        return signals.band_pass(values, recording.rate_hz)[keep]

    expected = {
        "time_s": recording.time_s[keep],
        "piece": np.zeros(6100),
        "reading": band(reading),
        "compensated": band(reading - estimate),
        "interference": band(reading - clean),
        "error": band(reading - clean - estimate),
        "error_raw": (reading - clean - estimate)[keep],
        "injected": band(injected(recording, seed=5)),
        "change": band(injected(recording, seed=5)),
        "slow": signals.slow_part(reading - clean - estimate, recording.rate_hz)[keep],
        "fourth": np.convolve(reading - estimate, np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 16.0, mode="same")[keep],
        "floor": band(reading - clean - recording["interference_cabin_nt"]),
        "interference_raw": (reading - clean)[keep],
        "reading_high": signals.high_pass(reading, recording.rate_hz)[keep],
        "compensated_high": signals.high_pass(reading - estimate, recording.rate_hz)[keep],
        "far": (recording.time_s[keep] <= recording.time_s[-1] - 60.0 + 1e-9).astype(float),
        "heading_deg": recording["leg_heading_deg"][keep],
        "maneuver": recording["maneuver"][keep],
        "turn": recording["turn"][keep],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(getattr(found, name), values, rtol=0, atol=1e-9, err_msg=name)
    assert len(found) == 6100


def test_the_lead_in_is_filtered_with_the_test_rows_but_not_judged(recording, test_rows):
    alone, joined = judge(stub().fit(recording), test_rows), judge(stub().fit(recording), recording)
    assert (len(alone), len(joined)) == (5800, 6100)
    np.testing.assert_array_equal(joined.time_s[300:], alone.time_s)
    # one and the same rows, but for what is left of the filter's run-in
    np.testing.assert_allclose(joined.interference[-3000:], alone.interference[-3000:], rtol=0, atol=1e-3)


def test_a_method_sees_blind_rows_up_to_the_last_test_row(recording):
    method = stub().fit(recording)
    cut = recording.take(slice(0, 12_000))
    judge(method, replace(cut, data={**cut.data, "split": np.where(cut.time_s < 1100.0, cut["split"], 0.0)}))
    # once as it was flown, once with anomalies of each height in the reading
    assert len(method.seen) == 4
    for seen in method.seen:
        assert set(seen.data) == {"mag_cabin_nt"}
        assert set(seen.meta) <= {"start_utc"}
        np.testing.assert_array_equal(seen.time_s, recording.time_s[:11_000])
    expected = injected(recording.take(slice(0, 11_000)))
    for height, seen in enumerate(method.seen[1:]):
        found = seen["mag_cabin_nt"] - method.seen[0]["mag_cabin_nt"]
        np.testing.assert_allclose(found, expected[:, height], rtol=0, atol=1e-6)


class Attitude(Stub):
    requires = ("ins_{angle}_deg",)


class Fluxgate(Stub):
    requires = ("flux_{sensor}_{axis}_nt",)


def test_a_method_that_sees_no_field_is_asked_once(recording):
    method = Attitude(function=zeros).fit(recording)
    found = judge(method, recording)
    assert len(method.seen) == 1
    np.testing.assert_array_equal(found.change, found.injected)


def test_what_a_method_removes_by_the_length_of_a_fluxgate_shows(recording):
    """The anomaly is in the fluxgate as in the reading."""

    def length(seen):
        return np.linalg.norm(seen.vector(columns.FLUX, sensor="cabin"), axis=1) / 4.0

    method = Fluxgate(function=length).fit(recording)
    found = judge(method, recording)
    assert len(method.seen) == 4
    np.testing.assert_allclose(found.change, 0.75 * found.injected, rtol=0, atol=1e-8)


def test_estimates_that_were_made_elsewhere_leave_what_the_judge_finds(recording):
    """With a hole in the recording, of which the first piece is training rows."""
    rows = np.ones(len(recording), dtype=bool)
    rows[9000:9400] = False
    holed = recording.take(rows)
    method = create("tl16_measured").fit(recording)
    expected = judge(method, holed, warmup_s=60.0)
    twin = Twin(holed, np.sin(holed.time_s), 1.0)
    estimate = method.interference(holed)
    found = residuals_of(
        holed,
        sensor="cabin",
        estimate=estimate,
        twin=twin,
        twin_estimate=estimate + 0.25 * twin.injected,
        judged=expected.judged,
        crop_s=60.0,
    )
    assert found.judged == expected.judged
    for name, values in expected._signals().items():
        if name not in TWINS:
            # the estimate of a piece differs from that of the whole by rounding
            np.testing.assert_allclose(getattr(found, name), values, rtol=0, atol=1e-8, err_msg=name)
    # the twin has one height of three
    assert not found.injected[:, [0, 2]].any()
    assert not found.change[:, [0, 2]].any()
    assert found.injected[:, 1].std() > 0.5
    np.testing.assert_allclose(found.change[:, 1], 0.75 * found.injected[:, 1], rtol=0, atol=1e-9)
    plain = residuals_of(
        holed,
        sensor="cabin",
        estimate=estimate,
        twin=Twin(holed, np.zeros(len(holed)), 0.0),
        twin_estimate=estimate,
        judged=expected.judged,
        crop_s=60.0,
    )
    assert not plain.injected.any()
    assert not plain.change.any()


def test_what_a_method_removes_of_an_anomaly_is_in_the_change(recording):
    """A method that takes the reading itself for interference removes the signal with it."""
    found = judge(stub(smooth).fit(recording), recording)
    assert np.abs(found.change).max() < 1e-9
    third = judge(stub(lambda r: r["mag_cabin_nt"] / 3.0).fit(recording), recording)
    np.testing.assert_allclose(third.change, third.injected * 2.0 / 3.0, rtol=0, atol=1e-9)


def test_the_noise_floor_is_the_label(recording):
    found = judge(None, recording)
    assert found.judged.method == NOISE_FLOOR
    assert found.judged.sensor == "cabin"
    error = recording["mag_cabin_nt"] - recording["clean_cabin_nt"] - recording["interference_cabin_nt"]
    np.testing.assert_array_equal(found.error_raw, error[6400:12_500])
    np.testing.assert_array_equal(found.change, found.injected)
    with pytest.raises(RequestError, match="recording 'world' has no label and truth for the row noise_floor"):
        judge(None, without(recording, "interference"))


def test_without_truth_and_segments_these_signals_are_missing(recording):
    survey = without(recording, "clean", "total", "error", *columns.COMPONENTS, "interference", "projection")
    found = judge(stub().fit(survey), survey)
    for name in ("interference", "error", "error_raw"):
        assert getattr(found, name) is None
        assert not found.has(name)
    np.testing.assert_array_equal(found.reading, judge(stub().fit(recording), recording).reading)
    bare = judge(stub().fit(survey), without(survey, "leg", "maneuver", "turn"))
    assert (bare.heading_deg, bare.maneuver, bare.turn) == (None, None, None)
    assert bare.segments == []


def test_rows_of_the_warmup_are_not_filtered(recording, test_rows):
    """What comes before counts for nothing: the piece begins after the warm-up."""

    def late(r):
        return np.where(r.time_s - r.time_s[0] < 50.0, np.nan, 0.0)

    for options in ({}, {"warmup_s": 50.0}):
        method = stub(late, 50.0) if not options else stub(zeros)
        found = judge(method.fit(recording), test_rows, **options)
        rest = test_rows.take(slice(500, None))
        interference = rest["mag_cabin_nt"] - rest["clean_cabin_nt"]
        np.testing.assert_array_equal(found.time_s, rest.time_s[300:-300])
        np.testing.assert_allclose(found.error, signals.band_pass(interference, 10.0)[300:-300], rtol=0, atol=1e-9)
    with pytest.raises(DataError, match=r"method stub: its estimate is not finite at 640 s, after its warm-up"):
        judge(stub(late).fit(recording), test_rows)


def test_pieces_are_filtered_separately(recording):
    """A hole in the test rows: each piece is filtered whole and cropped, with what was flown before it."""
    rows = np.ones(len(recording), dtype=bool)
    rows[9000:9400] = False
    found = judge(stub().fit(recording), recording.take(rows))
    interference = recording["mag_cabin_nt"] - recording["clean_cabin_nt"]
    parts = [(slice(0, 9000), slice(6400, 8700)), (slice(9400, None), slice(300, -300))]
    expected = [signals.band_pass(interference[piece], 10.0)[keep] for piece, keep in parts]
    np.testing.assert_allclose(found.error, np.concatenate(expected), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(found.piece, np.repeat([0.0, 1.0], [len(part) for part in expected]))


def test_a_dropout_ends_a_piece_as_a_gap_does(recording):
    """The rows without a reading are left out, and 30 s on both sides of them."""
    rows = np.ones(len(recording), dtype=bool)
    rows[9000:9003] = False
    holed = with_dropouts(recording, slice(9000, 9003))
    found, wanted = (judge(stub().fit(recording), r) for r in (holed, recording.take(rows)))
    for name in ("time_s", "error", "reading", "compensated", "far"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name), err_msg=name)
    gap = np.diff(found.time_s)
    assert gap.max() == pytest.approx(60.0 + 0.4)


def test_estimates_run_through_dropouts(recording):
    """By hand: the estimate is of the whole recording, then what is left is cut at the dropout and filtered."""
    holed = with_dropouts(recording, slice(9000, 9003))
    method = create("tl16").fit(recording)
    error = recording["mag_cabin_nt"] - recording["clean_cabin_nt"] - method.interference(recording)
    parts = [(slice(0, 9000), slice(6400, 8700)), (slice(9003, None), slice(300, -300))]
    expected = [signals.band_pass(error[piece], recording.rate_hz)[keep] for piece, keep in parts]
    np.testing.assert_allclose(judge(method, holed).error, np.concatenate(expected), rtol=0, atol=1e-9)


def test_pieces_too_short_for_the_filter_are_left_out(recording):
    """A stretch of 55 s gives no row; the others are judged."""
    rows = np.ones(len(recording), dtype=bool)
    rows[9000:9400] = rows[9950:9960] = False
    found = judge(stub().fit(recording), recording.take(rows))
    assert not ((found.time_s > 930.0) & (found.time_s < 996.0)).any()


def test_the_sensor_is_that_of_the_method_unless_named(recording):
    two = replace(recording, data={"mag_wing_nt": recording["mag_cabin_nt"] + 1.0, **recording.data})
    assert judge(None, two, sensor="cabin").judged.sensor == "cabin"
    method = stub().fit(two, sensor="cabin")
    assert judge(method, two).judged.sensor == "cabin"
    found = judge(method, two, sensor="wing", name="mine")
    assert (found.judged.sensor, found.judged.method) == ("wing", "mine")
    # no truth for this one
    assert found.error is None


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        (
            lambda r: r.where(circuit=1),
            RequestError,
            "recording 'world' has no test rows: no row has split = test and a",
        ),
        (lambda r: without(r, "split"), RequestError, "has no column 'split'"),
        (lambda r: without(r, "mag"), RequestError, "no scalar magnetometer 'cabin'"),
        (lambda r: with_dropouts(r, slice(None)), RequestError, "a reading of 'cabin'"),
        (
            lambda r: r.take(slice(6400, 6950)),
            DataError,
            r"the longest test piece lasts 54\.9 s; after a warm-up of 0 s",
        ),
        (lambda r: with_dropouts(r, slice(None, None, 500)), DataError, r"test piece without a dropout lasts 49\.8 s"),
    ],
)
def test_what_cannot_be_judged_is_refused(recording, change, error, text):
    method = create("none").fit(recording)
    with pytest.raises(error, match=text):
        judge(method, change(recording))


def test_unfitted_methods_are_refused(recording):
    with pytest.raises(RequestError, match="method tl16 is not fitted yet"):
        judge(create("tl16"), recording)


def test_a_method_is_not_asked_for_twins_where_nobody_wants_them(recording):
    method = stub().fit(recording)
    found, whole = judge(method, recording, twins=False), judge(method, recording)
    assert len(method.seen) == 1 + 4
    assert not found.injected.any()
    assert not found.change.any()
    np.testing.assert_array_equal(found.error, whole.error)
