"""Fit on training rows, judge on test rows, group by group."""

from dataclasses import replace

import numpy as np
import pytest

from magsim import columns
from magsim.benchmark import Fit, Row, evaluate, judge, rows_of
from magsim.compensation import TollesLawson, create
from magsim.dataset import MANIFEST
from magsim.errors import DataError, RequestError
from magsim.recording import read_recordings, write_recordings
from tests.support.folders import manifest_of
from tests.support.methods import stub, with_dropouts, without, zeros
from tests.support.worlds import World, calibration

WORLD = World()


@pytest.fixture(scope="module")
def recording():
    return calibration(WORLD)


@pytest.fixture(scope="module")
def short():
    """Training, validation and test rows of one circuit with 5 rows a second."""
    recording = calibration(World(circuits=1, rate_hz=5.0))
    split = np.select([recording.time_s < 320.0, recording.time_s < 400.0], [0.0, 1.0], 2.0)
    return replace(recording, data={**recording.data, "split": split})


def renamed(recording, name, factor=1.0):
    """The recording under another name, with another interference."""
    own = (factor - 1.0) * recording["interference_cabin_nt"]
    data = {**recording.data, "mag_cabin_nt": recording["mag_cabin_nt"] + own}
    data["interference_cabin_nt"] = factor * recording["interference_cabin_nt"]
    return replace(recording, name=name, data=data)


def test_nothing_and_the_noise_floor(recording):
    """White noise of 0.01 nT at 10 Hz is 0.0030 nT in band; without compensation the ratio is 1."""
    report = evaluate(recording, ["none", "noise_floor"])
    assert report.value("none", "ir") == 1.0
    assert report.value("none", "ir_paper") == 1.0
    assert report.value("noise_floor", "std_nt") == pytest.approx(0.0030, abs=0.0002)
    assert report.value("noise_floor", "rmse_nt") == pytest.approx(0.01, rel=0.03)
    assert report.value("noise_floor", "gain") == pytest.approx(1.0, abs=1e-12)
    ratio = report.value("none", "std_nt") / report.value("noise_floor", "std_nt")
    assert report.value("noise_floor", "ir") == pytest.approx(ratio)


def test_rows_are_the_scores_of_what_judging_leaves(recording):
    """One row for each recording, method, part and metric, with all that tells them apart."""
    report = evaluate(recording, ["tl16", "none"], seed=5)
    expected = []
    for method in (create("tl16"), create("none")):
        expected += rows_of(judge(method.fit(recording), recording, seed=5))
    assert report.rows == tuple(expected)
    assert Row._fields == (
        "recording", "file", "sensor", "level", "seed", "method", "segment", "metric", "value",
    )  # fmt: skip
    assert report.rows[0][:8] == ("world", "", "cabin", None, 5, "tl16", "test", "std_nt")


def test_one_method_and_one_recording_need_no_lists(recording, tmp_path):
    expected = evaluate([recording], ["tl16"])
    for data, methods in ((recording, "tl16"), (recording, create("tl16")), ([recording], ("tl16",))):
        assert evaluate(data, methods).rows == expected.rows
    recording.write(tmp_path / "flight.h5")
    for data in (tmp_path, str(tmp_path), tmp_path / "flight.h5"):
        found = evaluate(data, "tl16")
        assert found.rows == tuple(row._replace(file="flight.h5") for row in expected.rows)


def test_methods_with_settings_are_named_as_they_are_written(recording):
    texts = ["tl16_gradient:order=0:vertical=false", "tl16_gradient:order=0", "tl16_measured"]
    report = evaluate(recording, texts)
    assert report.methods == tuple(texts)
    plain, height, measured = (report.value(text, "ir") for text in texts)
    assert plain == measured
    assert height > 1.05 * plain
    assert report.about["methods"][texts[0]]["params"]["vertical"] is False


def test_methods_learn_from_labels_and_never_from_test_rows(recording):
    method = stub()
    evaluate(recording, method, seed=7)
    ((training, context),) = method.learned
    assert context.seed == 7
    (given,) = training.recordings
    assert set(given["split"]) == {0.0, 1.0}
    assert len(given) == 6400
    assert {columns.role_of(name) for name in given.data} == {"input", "label", "segment"}
    assert set(given.meta) <= {"start_utc"}


def test_a_copy_of_the_given_method_is_fitted(recording):
    method = TollesLawson(terms=3)
    before = dict(vars(method))
    report = evaluate(recording, [("mine", method), "tl16"])
    assert vars(method) == before
    assert not method.is_fitted
    assert report.methods == ("mine", "tl16")
    assert report.value("mine", "ir") < report.value("tl16", "ir")


def test_methods_that_come_fitted_are_judged_as_they_are_and_marked(recording):
    method = create("tl16").fit(recording.where(split="train"))
    before = method.coefficients_.copy()
    test_rows = recording.where(split="test")
    report = evaluate(test_rows, [("trained", method)])
    np.testing.assert_array_equal(method.coefficients_, before)
    assert report.methods == ("trained",)
    assert report.fits == (Fit("trained", "", (), 0, 0, given=True),)
    assert "given as fitted: trained" in report.to_text()
    assert report.fit_s == {}
    with pytest.raises(RequestError, match="was trained for the sensor 'cabin', not 'wing'"):
        evaluate(test_rows, method, sensor="wing")


def test_the_sensor_is_that_of_a_fitted_method(recording):
    two = replace(recording, data={"mag_wing_nt": recording["mag_cabin_nt"], **recording.data})
    method = create("tl16").fit(two, sensor="cabin")
    assert {row.sensor for row in evaluate(two, ["none", ("fitted", method)]).rows} == {"cabin"}
    assert {row.sensor for row in evaluate(two, "none").rows} == {"wing"}
    assert {row.sensor for row in evaluate(two, "none", sensor="cabin").rows} == {"cabin"}


def test_what_methods_were_fitted_on_is_in_the_report(recording):
    other = calibration(WORLD, 1, "other")
    report = evaluate([recording, other], ["none", "tl16", "noise_floor"])
    fitted = Fit("none", "all", ("world", "other"), 9600, 3200, given=False)
    assert report.fits == (fitted, fitted._replace(method="tl16"))
    assert set(report.fit_s) == {("none", "all"), ("tl16", "all")}
    assert "fitted on 9600 training and 3200 validation rows of world, other: none, tl16" in report.to_text()
    assert report.about["groups"] == {"all": ["world", "other"]}


def test_several_recordings_in_memory_are_learned_together_and_judged_each(recording):
    other = calibration(WORLD, 1, "other")
    method = stub()
    report = evaluate([recording, other], ["none", method])
    assert report.recordings == ("world", "other")
    ((training, _),) = method.learned
    assert len(training.recordings) == 2
    assert report.value("none", "std_nt", recording="other") != report.value("none", "std_nt", recording="world")
    only = evaluate([recording.where(circuit=1), other], ["none"])
    assert only.recordings == ("other",)


def test_files_that_hold_training_and_test_rows_are_groups(short, tmp_path):
    """As the ladder of levels: each file is fitted alone, although flights of other files are in the folder."""
    train, test = short.take(short["split"] < 2.0), short.where(split="test")
    for level in range(3):
        pair = [renamed(r, f"level_{level}_{r['split'].max():g}", 1.0 + level) for r in (train, test)]
        write_recordings(tmp_path / f"level_{level}.h5", pair)
    method = stub()
    report = evaluate(tmp_path, ["tl16", method])
    assert len(method.learned) == 3
    alone = [evaluate(tmp_path / f"level_{level}.h5", ["tl16", stub()]) for level in range(3)]
    assert report.rows == tuple(row for one in alone for row in one.rows)
    assert [fit.recordings for fit in report.fits if fit.method == "tl16"] == [(f"level_{i}_1",) for i in range(3)]
    assert [fit.group for fit in report.fits if fit.method == "tl16"] == [f"level_{i}" for i in range(3)]
    # fitted together they are worse
    together = evaluate(read_recordings(tmp_path), "tl16")
    assert together.value("tl16", "ir", recording="level_0_2") < 0.1 * report.value("tl16", "ir", recording="level_0_2")


def test_groups_and_levels_of_a_manifest_are_in_the_report(short, tmp_path):
    """Training and test flights in files of their own: the manifest joins them."""
    files = {}
    for level, factor in ((2, 1.0), (5, 2.0)):
        for word, rows in (("train", short["split"] < 2.0), ("test", short["split"] == 2.0)):
            name = f"{word}_{level}"
            renamed(short.take(rows), name, factor).write(tmp_path / f"{name}.h5")
            files[name] = {"group": f"world_{level}", "level": level}
    (tmp_path / MANIFEST).write_text(manifest_of(tmp_path, **files).to_json())
    report = evaluate(tmp_path, "tl16")
    assert {(row.recording, row.file, row.level) for row in report.rows} == {
        ("test_2", "test_2.h5", 2),
        ("test_5", "test_5.h5", 5),
    }
    assert {(fit.group, fit.recordings) for fit in report.fits} == {
        ("world_2", ("train_2",)),
        ("world_5", ("train_5",)),
    }
    assert set(report.fit_s) == {("tl16", "world_2"), ("tl16", "world_5")}
    assert report.about["groups"] == {"world_2": ["test_2", "train_2"], "world_5": ["test_5", "train_5"]}
    alone = evaluate([tmp_path / "train_5.h5", tmp_path / "test_5.h5"], "tl16")
    assert report.value("tl16", "ir", recording="test_5") == alone.value("tl16", "ir")


def test_two_folders_with_groups_of_one_name_are_both_judged(short, tmp_path):
    for folder, factor in (("x", 1.0), ("y", 3.0)):
        (tmp_path / folder).mkdir()
        renamed(short, f"in_{folder}", factor).write(tmp_path / folder / "flight.h5")
    report = evaluate([tmp_path / "x", tmp_path / "y"], "tl16")
    assert [(fit.group, fit.recordings) for fit in report.fits] == [("flight", ("in_x",)), ("flight (2)", ("in_y",))]
    assert report.about["groups"] == {"flight": ["in_x"], "flight (2)": ["in_y"]}
    for folder in ("x", "y"):
        expected = evaluate(tmp_path / folder, "tl16").value("tl16", "std_nt")
        assert report.value("tl16", "std_nt", recording=f"in_{folder}") == expected


def test_all_methods_are_judged_on_the_rows_after_the_longest_warmup(recording):
    def late(r):
        return np.where(r.time_s - r.time_s[0] < 50.0, np.nan, 0.0)

    test = recording.where(split="test")
    train = recording.where(split="train")
    alone = evaluate([train, test], ["none"])
    both = evaluate([train, test], ["none", stub(late, 50.0)])
    assert both.value("none", "std_nt") == both.value("stub", "std_nt")
    assert both.value("none", "std_nt") != alone.value("none", "std_nt")
    assert both.about["warmup_s"] == 50.0
    expected = rows_of(judge(create("none").fit(train), test, warmup_s=50.0))
    assert [row for row in both.rows if row.method == "none"] == expected


def test_rows_without_a_reading_are_neither_learned_nor_judged(recording):
    """Scores and coefficients are those of the recording without these rows."""
    spans = (slice(2500, 2510), slice(9000, 9003), slice(11_000, 11_001))
    holed = with_dropouts(recording, *spans)
    rows = holed["mag_cabin_valid"] == 1.0
    methods = ["none", "noise_floor"]
    report, wanted = evaluate(holed, methods), evaluate(recording.take(rows), methods)
    assert report.rows == wanted.rows
    one, other = (create("tl16_measured").fit(r) for r in (holed, recording.take(rows)))
    np.testing.assert_array_equal(one.coefficients_, other.coefficients_)
    # an estimate needs no reading, so that its derivatives run through dropouts, but not through gaps
    fitted, wanted = (evaluate(r, [("fitted", one)]) for r in (holed, recording.take(rows)))
    assert fitted.value("fitted", "std_nt") == pytest.approx(wanted.value("fitted", "std_nt"), rel=1e-3)
    assert report.value("noise_floor", "std_nt") == pytest.approx(0.0030, abs=0.0003)
    (note,) = report.notes
    assert note.startswith("recording 'world': 4 test rows in which 'cabin' does not read are left out, and 30 s on")
    # Held through, the dropouts would be all that is seen.
    ignored = evaluate(without(holed, "mag_cabin_valid"), ["none"])
    assert ignored.value("none", "std_nt") > 30.0 * report.value("none", "std_nt")


def test_a_magnetometer_that_always_reads_changes_no_bit(recording):
    methods = ["none", "tl16", "tl18_measured", "noise_floor"]
    plain, declared = evaluate(recording, methods), evaluate(with_dropouts(recording), methods)
    assert declared.to_json() == plain.to_json()


def test_a_magnetometer_that_never_reads_is_refused(recording):
    silent = with_dropouts(recording, slice(None))
    with pytest.raises(RequestError, match="no row of 'world' has split = test and a reading of 'cabin'"):
        evaluate(silent, "none")
    with pytest.raises(DataError, match="'cabin' does not read in any row of 'world' that is to be learned"):
        evaluate(with_dropouts(recording, slice(0, 6400)), "tl16_measured")
    report = evaluate([recording, replace(silent, name="other")], "none")
    assert report.recordings == ("world",)
    assert any(note.startswith("recording 'other': 6400 test rows") for note in report.notes)


def test_without_truth_only_the_papers_scores(recording):
    survey = without(recording, "clean", "total", "error", *columns.COMPONENTS, "interference", "projection")
    report = evaluate(survey, ["none", "tl16_measured", "noise_floor"])
    assert report.methods == ("none", "tl16_measured")
    found = {row.metric for row in report.rows}
    papers = {"std_paper_nt", "ir_paper", "ir_003", "fom_paper_nt", "peak_paper_nt", "fourth_nt"}
    assert found == papers | {"gain", "gain_0.1", "gain_1", "gain_20", "distortion"}
    assert report.value("tl16_measured", "ir_paper") > 50.0
    assert "recording 'world' has no label and truth for the row noise_floor" in report.notes
    assert "note: recording 'world' has no truth" in report.to_text()
    bare = without(survey, "leg", "maneuver", "turn", "cycle", "circuit")
    assert {row.segment for row in evaluate(bare, "none").rows} == {"test"}


def test_pieces_that_are_too_short_for_the_high_pass_lack_its_score(recording):
    rows = np.r_[0:4000, 6400 : 6400 + 1100]
    report = evaluate(recording.take(rows), ["none"])
    assert report.value("none", "ir") == 1.0
    assert "ir_003" not in {row.metric for row in report.rows}
    assert "recording 'world' has no ir_003: no test piece is longer than the 120 s" in report.to_text()
    assert report.about["high_pass_edge_s"] == 60.0


def test_an_anomaly_must_pass(recording):
    """A method that takes the reading itself for interference removes the signal with it."""

    def smooth(r):
        reading = r["mag_cabin_nt"]
        return reading - reading.mean()

    report = evaluate(recording, [("constant", stub(smooth)), ("honest", stub())])
    assert abs(report.value("constant", "gain")) < 1e-9
    # the papers' ratio is deceived
    assert report.value("constant", "ir_paper") > 1e6
    assert report.value("honest", "gain") == pytest.approx(1.0, abs=1e-12)


def test_the_report_is_the_same_twice_but_for_times(recording):
    one, two = (evaluate(recording, ["none", "tl16", "tl18", "noise_floor"]) for _ in range(2))
    assert one.to_json() == two.to_json()
    assert one.to_text(times=False) == two.to_text(times=False)
    assert "fit_s" not in one.to_json()
    assert set(one.fit_s) == {("none", "all"), ("tl16", "all"), ("tl18", "all")}


def test_steps_are_reported(recording):
    lines = []
    evaluate(recording, ["tl16", "noise_floor"], progress=lines.append)
    assert lines == ["fitting tl16", "tl16 on world", "noise_floor on world"]


@pytest.mark.parametrize(
    ("change", "methods", "options", "error", "text"),
    [
        (lambda r: r.where(circuit=1), ["none"], {}, RequestError, "no test rows: no row of 'world' has split = test"),
        (
            lambda r: r.where(circuit=2),
            ["tl16"],
            {},
            RequestError,
            "no training rows: no row of 'world' has split = tr",
        ),
        (lambda r: r, ["none"], {"sensor": "wing"}, RequestError, "no scalar magnetometer 'wing'; it has cabin"),
        (lambda r: without(r, "split"), ["none"], {}, RequestError, "has no column 'split'"),
        (lambda r: without(r, "flux"), ["tl16"], {}, RequestError, "has no column flux_.*, which method tl16 requires"),
        (lambda r: without(r, "ins_heading"), ["magtcn"], {}, RequestError, "no column ins_heading_deg"),
        (lambda r: without(r, "mag"), ["none"], {}, RequestError, "has no scalar magnetometer"),
        (lambda r: r, ["none", "none"], {}, RequestError, "none is given twice"),
        (lambda r: r, [], {}, RequestError, "no method"),
        (lambda r: r, ["nun"], {}, RequestError, "unknown method 'nun'"),
        (
            lambda r: r,
            [3],
            {},
            RequestError,
            "3 is no method; allowed: a name such as 'tl16', a compensator, or a pair",
        ),
        (lambda r: r, [("tl16", "tl18")], {}, RequestError, "is no method"),
        (lambda r: r, ["noise_floor:seed=1"], {}, RequestError, "noise_floor has no settings; .* gives seed"),
        (lambda r: without(r, "ins_alt"), ["tl16_gradient"], {}, RequestError, "no column ins_alt_m"),
        (lambda r: r, [stub(lambda r: np.zeros(3))], {}, DataError, r"returned shape \(3,\) for 12800 rows"),
        (lambda r: r, [stub(lambda r: r.time_s * np.nan)], {}, DataError, "not finite at 0 s"),
    ],
)
def test_what_cannot_be_judged_is_refused(recording, *, change, methods, options, error, text):
    with pytest.raises(error, match=text):
        evaluate(change(recording), methods, **options)


def test_test_rows_are_looked_for_before_the_fit(recording):
    method = stub()
    with pytest.raises(RequestError, match="no test rows"):
        evaluate(recording.where(circuit=1), method)
    assert method.learned == []
    with pytest.raises(RequestError, match="no recording was given"):
        evaluate([], "none")


def test_the_recording_is_not_changed(recording):
    before = {name: column.copy() for name, column in recording.data.items()}
    evaluate(recording, ["tl16", stub(zeros)])
    for name, column in before.items():
        np.testing.assert_array_equal(recording[name], column)
