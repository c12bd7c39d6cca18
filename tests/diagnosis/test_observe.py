"""What a flight can tell: against fits to many draws of noise, closed forms, and lines that must be refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from magsim import signals
from magsim.cli import main
from magsim.compensation import TollesLawson
from magsim.compensation.observability import LEAST_ANGLE_DEG, angle_swept_deg
from magsim.diagnosis.maneuvers import LINE_DEG, Ambient, ambient_of, line_columns, maneuver_columns
from magsim.diagnosis.noise import band_noise, white_in_band
from magsim.diagnosis.observe import observe
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.recording.plausibility import unit_hints
from tests.support.birds import COEFFICIENTS, bird, terms
from tests.support.paths import REFERENCE_DATA
from tests.support.worlds import FIELD_NT, VECTOR, calibration

NOISE_NT = 0.05
GONDWANA = REFERENCE_DATA / "real" / "gondwana_fluxgate.dat"


def circuit() -> Recording:
    """One circuit of an airplane that is exactly Tolles-Lawson, without labels."""
    one = bird(0, vertical=0.0).take(slice(0, 6400))
    return replace(one, data={name: values for name, values in one.data.items() if not name.startswith("interference")})


def level(seconds: float = 300.0, sway_deg: float = 1.5) -> Recording:
    """A straight line on one heading, with a sway that makes the field sweep some 12 deg."""
    whole = calibration(VECTOR)
    count = round(10.0 * seconds)
    rng = np.random.default_rng(3)
    swing = signals.band_pass(rng.standard_normal((count + 600, 3)), 10.0)[300:-300]
    roll, pitch, _ = np.radians(sway_deg * swing / swing.std(axis=0)).T
    steady = whole.take(slice(0, count))
    flux = np.column_stack([41000.0 - 18000.0 * pitch, 18000.0 * roll, 18000.0 + 41000.0 * pitch])
    changed = {f"flux_cabin_{axis}_nt": flux[:, i] for i, axis in enumerate("xyz")}
    return replace(steady, data={**steady.data, **changed, "split": np.zeros(count)})


def test_expected_errors_are_those_of_fits_to_many_draws():
    clean = circuit()
    expected = observe([clean], noise_nt=NOISE_NT)
    low = signals.in_band(np.random.default_rng(9).standard_normal(len(clean)), clean.time_s).std()
    off = []
    for draw in range(60):
        white = NOISE_NT / low * np.random.default_rng(draw).standard_normal(len(clean))
        noisy = replace(clean, data={**clean.data, "mag_cabin_nt": clean["mag_cabin_nt"] + white})
        off.append(TollesLawson(target="measured").fit(noisy).coefficients_ - COEFFICIENTS)
    scatter = np.sqrt(np.mean(np.square(off), axis=0))
    stated = np.array([column.error for column in expected.columns])
    # of 60 draws a deviation is known to 9 %
    np.testing.assert_allclose(scatter, stated, rtol=0.35)
    assert np.mean(scatter / stated) == pytest.approx(1.0, abs=0.12)
    line = np.concatenate([line_columns(ambient(clean), h, 10.0, 16) for h in expected.line_errors_nt])
    there = np.sqrt(np.mean((line @ np.array(off).T) ** 2))
    assert there == pytest.approx(expected.line_error_nt, rel=0.3)
    excited = signals.in_band(terms(clean), clean.time_s).std(axis=0)
    np.testing.assert_allclose([column.std_nt for column in expected.columns], excited, rtol=0.01)
    assert expected.is_observable
    assert all(column.known and column.own_nt <= 1.01 * column.std_nt for column in expected.columns)


def ambient(recording: Recording) -> Ambient:
    return ambient_of(recording.stack([f"flux_cabin_{axis}_nt" for axis in "xyz"]))


def test_twice_the_time_takes_the_expected_error_down_by_the_root_of_two():
    whole = circuit()
    twice = replace(bird(0, seed=1, vertical=0.0), name="again").take(slice(0, 6400))
    once, both = observe([whole], noise_nt=NOISE_NT), observe([whole, twice], noise_nt=NOISE_NT)
    assert both.line_error_nt == pytest.approx(once.line_error_nt / np.sqrt(2.0), rel=0.15)
    goal = observe([whole], noise_nt=NOISE_NT, goal_nt=once.line_error_nt / 2.0)
    assert goal.minutes_enough == pytest.approx(4.0 * once.minutes, rel=1e-6)


def test_advice_is_what_the_maneuver_does_when_it_is_flown():
    """The best advice takes the most; what it promises is what least squares on the longer flight would give."""
    found = observe([circuit()], noise_nt=NOISE_NT)
    errors = [advice.line_error_nt for advice in found.advice]
    assert errors == sorted(errors)
    assert len(errors) == 12
    assert all(0.0 < advice.gain < 1.0 for advice in found.advice)
    assert errors[0] < found.line_error_nt


def test_model_lines_and_maneuvers_are_those_that_are_stated():
    """Straight up and down the field does not see yaw; along the nose not roll."""
    down, ahead = Ambient(0.0, FIELD_NT), Ambient(FIELD_NT, 0.0)
    assert np.abs(maneuver_columns(down, "east", "yaw", 10.0, 16)).max() < 1e-6 * FIELD_NT
    assert np.abs(maneuver_columns(ahead, "north", "roll", 10.0, 16)).max() < 1e-6 * FIELD_NT
    pitch = maneuver_columns(down, "north", "pitch", 10.0, 3)
    assert len(pitch) == 600
    assert np.abs(pitch[:, 0]).max() == pytest.approx(np.sin(np.radians(5.0)), rel=0.01)
    line = line_columns(down, "north", 10.0, 3)
    assert np.degrees(line[:, 1].std()) == pytest.approx(LINE_DEG["roll"], rel=0.1)
    assert np.degrees(line[:, 0].std()) == pytest.approx(LINE_DEG["pitch"], rel=0.1)


@pytest.mark.parametrize("degrees", [1e-3, 3.0, 40.0, 179.0])
def test_angle_swept_is_that_of_a_fan(degrees):
    angle = np.radians(np.linspace(-degrees / 2.0, degrees / 2.0, 101))
    fan = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]) * np.linspace(1.0, 5e4, 101)[:, None]
    assert angle_swept_deg(fan) == pytest.approx(degrees, rel=1e-6)


def test_noise_is_that_of_the_truth_or_seen_above_the_band():
    known = calibration(VECTOR)
    true = band_noise([known], "cabin")
    assert true.source.startswith("truth")
    assert true.std_nt == pytest.approx(0.01 * np.sqrt(white_power()), rel=0.1)
    seen = band_noise([known.blind()], "cabin")
    assert "1 and 3 Hz" in seen.source
    assert seen.std_nt == pytest.approx(true.std_nt, rel=0.25)
    with pytest.raises(RequestError, match=r"--noise"):
        band_noise([known.blind().take(slice(0, 60))], "cabin")


def white_power() -> float:
    """Share of white noise that the band-pass leaves, from a long draw."""
    return float(np.var(signals.band_pass(np.random.default_rng(0).standard_normal(200_000), 10.0)))


def test_correlation_of_white_noise_in_band_is_that_of_a_long_draw():
    noise = signals.band_pass(np.random.default_rng(0).standard_normal(200_000), 10.0)
    drawn = [np.mean(noise[: len(noise) - lag] * noise[lag:]) / np.var(noise) for lag in range(40)]
    np.testing.assert_allclose(white_in_band(10.0, 39), drawn, atol=0.03)


def test_level_flight_is_refused_with_reasons(tmp_path, capsys):
    line = level()
    angle = observe([line]).angle_deg
    assert 9.0 < angle < LEAST_ANGLE_DEG
    with pytest.raises(DataError, match=rf"sweeps {angle:.1f} deg .* unobservable; fly pitch, roll and yaw"):
        TollesLawson(target="measured").fit(line)
    line.write(tmp_path / "level.h5")
    assert main(["observe", str(tmp_path / "level.h5"), "--json"]) == 3
    out = capsys.readouterr()
    found = json.loads(out.out)
    assert not found["observable"]
    assert not all(column["known"] for column in found["columns"])
    assert found["line_error_nt"] > 10.0 * found["noise"]["std_nt"]
    assert any("unobservable" in reason for reason in found["reasons"])
    assert "Traceback" not in out.err
    assert main(["observe", str(tmp_path / "level.h5")]) == 3
    assert "unobservable: recording 'world'" in capsys.readouterr().out


def test_calibration_on_the_command_line(tmp_path, capsys):
    circuit().write(tmp_path / "cal.h5")
    level().write(tmp_path / "line.h5")
    assert (
        main(["observe", str(tmp_path / "cal.h5"), str(tmp_path / "line.h5"), "--noise", "0.02", "--terms", "8"]) == 0
    )
    text = capsys.readouterr().out
    for words in (
        "8 Tolles-Lawson terms",
        "survey line: world",
        "as flown",
        "min of such flying are enough",
        "on magnetic",
    ):
        assert words in text


def test_short_line_is_warned_of_and_too_short_ones_are_refused(tmp_path):
    short = circuit().take(slice(0, 1900))
    warnings = observe([short], noise_nt=NOISE_NT).warnings
    assert any("of the geology in band for interference" in text for text in warnings)
    tiny = observe([circuit().take(slice(0, 400))], noise_nt=NOISE_NT)
    assert not tiny.is_observable
    assert any("0 rows are left in band" in reason for reason in tiny.reasons)
    with pytest.raises(DataError, match="is too short"):
        observe([circuit()], noise_nt=NOISE_NT, line=[circuit().take(slice(0, 400))])
    with pytest.raises(RequestError, match="allowed: 3, 8, 16"):
        observe([circuit()], noise_nt=NOISE_NT, terms=18)


def test_units_and_dead_channels_are_seen():
    flight = calibration(VECTOR)
    tenths = {f"flux_cabin_{axis}_nt": flight[f"flux_cabin_{axis}_nt"] / 10.0 for axis in "xyz"}
    (hint,) = unit_hints(replace(flight, data={**flight.data, **tenths}))
    assert "scale = 10 " in hint
    assert list(unit_hints(flight)) == []
    dead = replace(flight, data={**flight.data, "flux_cabin_y_nt": np.full(len(flight), 123.0)})
    assert any(text.startswith("flux_cabin_y_nt never changes") for text in observe([dead]).warnings)
    with pytest.raises(DataError, match=r"'world': flux_cabin_y_nt never changes, a dead channel; leave out the rows"):
        TollesLawson().fit(dead)
    still = replace(flight, data={**flight.data, "mag_cabin_nt": np.full(len(flight), FIELD_NT)})
    with pytest.raises(DataError, match="mag_cabin_nt never changes"):
        TollesLawson(target="measured").fit(still)


@pytest.mark.skipif(not GONDWANA.exists(), reason="the public file lies beside the repository only")
def test_a_real_level_line_in_tenths_of_nt_is_unobservable(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = [line.split() for line in GONDWANA.read_text().splitlines() if not line.startswith("COMM")]
    heads = ("line", "time", "comp", "lon", "lat", "fx", "fy", "fz")
    fields = (0, 4, 6, 10, 11, 14, 15, 16)
    lines = [",".join(row[i] for i in fields) for row in rows if len(row) > 16 and row[0] == "47020"]
    (tmp_path / "gondwana.csv").write_text("\n".join([",".join(heads), *lines]) + "\n")
    names = {"mag_comp_nt": "comp", "ins_lat_deg": "lat", "ins_lon_deg": "lon"}
    names |= {f"flux_a_{axis}_nt": f"f{axis}" for axis in "xyz"}
    table = "\n".join(f'{column} = "{name}"' for column, name in names.items())
    (tmp_path / "map.toml").write_text(f'name = "gondwana"\ntime = "time"\nline = "line"\n[columns]\n{table}\n')
    assert main(["import", "gondwana.csv", "--map", "map.toml", "-o", "gondwana.h5"]) == 0
    capsys.readouterr()
    assert main(["observe", "gondwana.h5", "--json"]) == 3
    found = json.loads(capsys.readouterr().out)
    assert not found["observable"]
    assert found["angle_deg"] < LEAST_ANGLE_DEG
    assert any("scale = 10 " in text for text in found["warnings"])
    assert main(["train", "tl16_measured", "gondwana.h5", "-o", "run"]) == 3
    assert not (tmp_path / "run").exists()
