"""What a method does to a flight: against the benchmark, against what was put in, and as files."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import coherence as reference

from magsim import plots, signals
from magsim.benchmark.formulas import figure_of_merit, std
from magsim.benchmark.judging import judge
from magsim.cli import main
from magsim.compensation import TollesLawson, create
from magsim.compensation.background import model_along
from magsim.diagnosis.explain import explain
from magsim.diagnosis.explain_text import to_html, to_json, to_markdown, to_text
from magsim.diagnosis.lag import fluxgate_lag
from magsim.diagnosis.signatures import signatures_of
from magsim.diagnosis.spectra import WINDOW_S, coherence_level, coherences, spectrum
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from tests.support.methods import stub
from tests.support.worlds import VECTOR, calibration


@pytest.fixture(scope="module")
def flight() -> Recording:
    return calibration(VECTOR)


@pytest.fixture(scope="module")
def fitted(flight) -> TollesLawson:
    return create("tl16").fit(flight)


@pytest.fixture(scope="module")
def found(fitted, flight):
    return explain(fitted, flight)


def test_scores_are_those_of_the_benchmark(fitted, flight, found):
    residuals = judge(fitted, flight)
    assert found.rows == len(residuals)
    assert found.before_nt == pytest.approx(std(residuals.interference), rel=1e-9)
    assert found.after_nt == pytest.approx(std(residuals.error), rel=1e-9)
    assert found.signatures.total_nt(after=False) == pytest.approx(figure_of_merit(residuals, residuals.interference))
    assert found.signatures.total_nt(after=True) == pytest.approx(figure_of_merit(residuals, residuals.error))
    assert len(found.signatures.signatures) == 12
    assert found.noise_nt < found.after_nt < 0.02 * found.before_nt
    assert found.basis.startswith("against the truth")


def test_parts_of_the_sources_add_up_to_the_whole(found):
    assert {share.group for share in found.shares} == {"permanent", "induced", "eddy"}
    assert sum(share.part for share in found.shares) == pytest.approx(1.0, abs=1e-9)
    assert len(found.coefficients) == 17
    assert 0.0 < found.uncertainty_nt < 0.2


def test_bands_hold_the_power_of_a_known_signal():
    time_s = np.arange(6000) * 0.1
    wave = 3.0 * np.sin(2.0 * np.pi * 0.27 * time_s)
    density = spectrum(wave, [slice(0, 6000)], 10.0)
    assert density.std(0.2, 0.35) == pytest.approx(3.0 / np.sqrt(2.0), rel=0.01)
    assert density.std(0.6, 5.0) < 0.01
    assert spectrum(wave, [slice(0, 100)], 10.0) is None


def test_coherence_is_that_of_scipy_and_chance_stays_below_its_level():
    rng = np.random.default_rng(0)
    size, runs = round(WINDOW_S * 10.0), [slice(0, 6000)]
    residual, channel = rng.standard_normal((2, 6000))
    channel = channel + 0.5 * residual
    (one,) = coherences(residual, {"x": channel}, runs, 10.0)
    frequency, squared = reference(residual, channel, 10.0, nperseg=size, detrend="linear")
    rows = (frequency >= 0.1) & (frequency <= 0.6)
    assert one.peak == pytest.approx(squared[rows].max(), rel=1e-9)
    assert one.mean == pytest.approx(squared[rows].mean(), rel=1e-9)
    alarms = 0
    for draw in range(60):
        noise = np.random.default_rng(draw).standard_normal((4, 3000))
        every = coherences(noise[0], dict(zip("abc", noise[1:], strict=True)), [slice(0, 3000)], 10.0)
        alarms += every[0].is_significant
    assert alarms <= 7  # 3 are to be expected; more than 7 happen in 1 of 100 cases
    assert coherence_level(1.0, 10) == 1.0


def test_what_is_left_is_found_in_the_channel_that_it_follows(fitted, flight):
    rng = np.random.default_rng(5)
    amperes = signals.band_pass(rng.standard_normal(len(flight)), 10.0)
    amperes /= amperes.std()
    quiet = rng.standard_normal(len(flight))
    changed = {"cur_pump_a": amperes, "cur_fan_a": quiet, "cur_dead_a": np.full(len(flight), 2.0)}
    for name in ("mag_cabin_nt", "total_cabin_nt"):
        changed[name] = flight[name] + 0.3 * amperes
    told = explain(fitted, replace(flight, data={**flight.data, **changed}))
    first = told.coherences[0]
    assert first.channel == "cur_pump_a"
    assert first.is_significant
    assert first.coherent_nt == pytest.approx(0.3, rel=0.2)
    assert not next(one for one in told.coherences if one.channel == "cur_fan_a").is_significant
    assert told.dead == ("cur_dead_a",)
    assert any("cur_pump_a" in note for note in told.notes)
    assert any("dead channels: cur_dead_a" in note for note in told.notes)


@pytest.mark.parametrize("late_s", [0.15, -0.08])
def test_lag_of_the_fluxgate_is_found(flight, late_s):
    field = CubicSpline(flight.time_s, model_along(flight).field_b)(flight.time_s - late_s)
    own = np.eye(3) + np.array([[0.01, 0.02, 0.0], [-0.01, 0.0, 0.005], [0.0, 0.01, -0.02]])
    noise = np.random.default_rng(0).standard_normal(field.shape)
    flux = field @ own.T + [300.0, -200.0, 100.0] + noise
    changed = {f"flux_cabin_{axis}_nt": flux[:, i] for i, axis in enumerate("xyz")}
    lag = fluxgate_lag(replace(flight, data={**flight.data, **changed}), "cabin")
    assert lag.lag_s == pytest.approx(late_s, abs=0.003)
    assert lag.left_nt < 5.0


def test_signatures_are_peak_to_peak_of_each_maneuver_on_each_heading():
    heading = np.repeat([0.0, 90.0], 40)
    maneuver = np.tile(np.repeat([0.0, 1.0, 2.0, 0.0], 10), 2)
    before = np.arange(80.0)
    table = signatures_of({"leg_heading_deg": heading, "maneuver": maneuver}, before, 0.5 * before)
    assert [(s.heading_deg, s.maneuver, s.before_nt, s.after_nt) for s in table.signatures] == [
        (0.0, "pitch", 9.0, 4.5),
        (0.0, "roll", 9.0, 4.5),
        (90.0, "pitch", 9.0, 4.5),
        (90.0, "roll", 9.0, 4.5),
    ]
    assert table.total_nt(after=True, heading_deg=90.0) == 9.0
    assert table.maneuvers == ("pitch", "roll")
    assert signatures_of({}, before, before).signatures == ()


def test_a_method_without_terms_and_a_survey_without_truth_are_told_as_far_as_they_go(flight):
    bare = replace(flight.blind(), meta={})
    told = explain(stub().fit(flight), bare)
    assert told.coefficients == ()
    assert told.shares == ()
    assert told.noise_nt is None
    assert told.basis.startswith("readings")
    for words in ("no sum of physical terms", "no maneuvers on headings", "does not say when it was flown"):
        assert any(words in note for note in told.notes)
    text = to_text(told)
    assert "Coefficients" not in text
    assert json.loads(to_json(told))["fom_after_nt"] is None
    plots.plot_explanation(told)


def test_rows_are_picked_and_wrong_ones_refused(fitted, flight):
    assert explain(fitted, flight, rows="train").rows < explain(fitted, flight, rows="all").rows
    with pytest.raises(RequestError, match="no column 'split'"):
        explain(fitted, flight.blind(), rows="test")
    with pytest.raises(RequestError, match="has no rows 'valid'"):
        explain(fitted, flight.where(split="test"), rows="valid")
    with pytest.raises(DataError, match="longer than 60 s"):
        explain(fitted, flight.take(slice(0, 500)), rows="all")


def test_texts_hold_the_twelve_signatures(found):
    text, page = to_text(found), to_markdown(found)
    for heading in ("0", "90", "180", "270", "all"):
        assert any(line.split()[:1] == [heading] for line in text.splitlines())
        assert f"| {heading} |" in page
    assert "FOM, 12 signatures" in text
    assert to_html(found, "").count("<table>") == 6


def test_reports_are_files_of_the_same_bytes_or_none(fitted, flight, tmp_path, capsys):
    fitted.save(tmp_path / "run")
    flight.write(tmp_path / "flight.h5")
    asked = ["explain", str(tmp_path / "run"), str(tmp_path / "flight.h5")]
    starts = {".pdf": b"%PDF", ".png": b"\x89PNG", ".html": b"<!doctype html>", ".md": b"# Compensation report"}
    for ending, start in starts.items():
        files = [tmp_path / f"{name}{ending}" for name in ("ab" if ending in (".pdf", ".png") else "a")]
        for file in files:
            assert main([*asked, "-o", str(file)]) == 0
        assert files[0].read_bytes().startswith(start)
        assert files[-1].read_bytes() == files[0].read_bytes()
    capsys.readouterr()
    assert main([*asked, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["method"] == "tl16"
    before = (tmp_path / "a.md").read_bytes()
    wrong = {
        ("-o", str(tmp_path / "a.md")): "exists",
        ("-o", str(tmp_path / "a.doc")): "a report ends in .pdf, .png",
        ("--rows", "valid", "--flight", "nobody"): "nobody",
    }
    for options, words in wrong.items():
        assert main([*asked, *options]) == 2
        error = capsys.readouterr().err
        assert words in error
        assert "Traceback" not in error
    assert (tmp_path / "a.md").read_bytes() == before
    assert not (tmp_path / "a.doc").exists()
    assert main(["explain", str(tmp_path), str(tmp_path / "flight.h5")]) == 2
    assert "holds no fitted method" in capsys.readouterr().err
