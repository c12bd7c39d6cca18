"""Figures: drawn from a recording alone, written whole, and refused in plain words."""

import numpy as np
import pytest

from magsim import plots
from magsim.errors import RequestError
from magsim.plots.figures import part_projections
from magsim.recording import Recording

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("kind", [kind for kind in plots.KINDS if kind not in {"electronics", "tow"}])
def test_every_kind_is_drawn_and_written(kind, calibration, tmp_path):
    target = tmp_path / f"{kind}.png"
    plots.save(plots.KINDS[kind](calibration, None), target)
    assert target.read_bytes().startswith(PNG)
    assert target.stat().st_size > 20_000
    assert list(tmp_path.iterdir()) == [target]


def test_the_same_recording_gives_the_same_figure(calibration, tmp_path):
    for name in ("a.svg", "b.svg"):
        plots.save(plots.plot_field(calibration), tmp_path / name)
    first, second = ((tmp_path / name).read_bytes() for name in ("a.svg", "b.svg"))
    assert first == second


def test_a_flight_without_truth_is_drawn_from_the_instruments(calibration, tmp_path):
    plots.save(plots.plot_flight(calibration.blind()), tmp_path / "flight.png")
    plots.save(plots.plot_field(calibration.blind()), tmp_path / "field.png")


def test_parts_along_the_background_add_up_to_the_projection_label(calibration):
    total = np.sum(list(part_projections(calibration, "cabin").values()), axis=0)
    # The label is filtered after the product, the parts before: a difference of second order in what the filter takes.
    np.testing.assert_allclose(total, calibration["projection_cabin_nt"], atol=5e-3)


def test_the_track_is_that_of_the_aircraft(calibration):
    axes = plots.plot_flight(calibration).axes[0]
    east = np.concatenate([line.get_xdata() for line in axes.lines])
    north = np.concatenate([line.get_ydata() for line in axes.lines])
    # A square of 10 km legs with turns of about 1.3 km radius, north first, then to the right.
    assert 12.0 < np.ptp(east) < 13.5
    assert 12.0 < np.ptp(north) < 13.5
    assert east.max() > 12.0


def test_an_unknown_sensor_is_named_with_the_known_ones(calibration):
    with pytest.raises(RequestError, match=r"'kitchen'.*allowed: cabin"):
        plots.plot_field(calibration, "kitchen")


def test_interference_needs_truth(calibration):
    with pytest.raises(RequestError, match="truth"):
        plots.plot_interference(calibration.blind())


def test_electronics_needs_currents(calibration):
    with pytest.raises(RequestError, match=r"no currents.*field\.electronics"):
        plots.plot_electronics(calibration)


def test_electronics_draws_varying_currents(calibration, tmp_path):
    time = calibration.time_s
    pump, volts = 4.0 * (np.sin(0.1 * time) > 0.0), 28.0 - 0.01 * np.sin(time)
    extra = {"cur_pump_a": pump, "cur_radio_a": np.full(len(time), 18.0), "vol_main_v": volts}
    loaded = Recording(calibration.name, time, {**calibration.data, **extra})
    figure = plots.plot_electronics(loaded)
    labels = [axes.get_ylabel().split("\n")[0] for axes in figure.axes]
    assert labels == ["pump", "buses less"]
    np.testing.assert_array_equal(figure.axes[0].lines[0].get_ydata(), pump)
    plots.save(figure, tmp_path / "electronics.png")
    plots.save(plots.plot_electronics(loaded.blind()), tmp_path / "blind.png")


def swinging(seconds: float) -> Recording:
    """A bird that swings aside with 0.09 Hz and yaws with 0.4 Hz behind a carrier that flies north; a turn ends it."""
    time = np.arange(round(10.0 * seconds)) / 10.0
    side, yaw = 5.0 * np.sin(2.0 * np.pi * 0.09 * time), 2.0 * np.sin(2.0 * np.pi * 0.4 * time)
    data = {
        "mag_bird_nt": 53_000.0 + 0.1 * side,
        "ins_roll_deg": side,
        "clean_bird_nt": np.full(len(time), 53_000.0),
        "swing_bird_nt": 0.1 * side,
        "true_roll_deg": side,
        "true_pitch_deg": np.full(len(time), 15.0),
        "true_heading_deg": (359.0 + yaw) % 360.0,
        "true_alt_m": np.full(len(time), 1220.0),
        "true_carrier_heading_deg": np.full(len(time), 0.5),
        "true_carrier_alt_m": np.full(len(time), 1250.0),
        "true_rope_trail_deg": np.full(len(time), 9.0),
        "true_rope_side_deg": side,
        "true_rope_tension_n": np.full(len(time), 750.0),
        "turn": (time > 0.9 * seconds).astype(float),
    }
    return Recording("swings", time, data)


def test_a_tow_is_drawn_as_it_swings(tmp_path):
    recording = swinging(400.0)
    figure = plots.plot_tow(recording)
    *_, spectrum, above = figure.axes
    yaw = next(line for axes in figure.axes for line in axes.lines if line.get_label() == "bird, yaw")
    # 359 degrees and a half degree are 1.5 degrees apart, over north.
    assert yaw.get_ydata().min() == pytest.approx(-3.5, abs=0.05)
    assert yaw.get_ydata().max() == pytest.approx(0.5, abs=0.05)
    peaks = {line.get_label(): line.get_xdata()[np.argmax(line.get_ydata())] for line in spectrum.lines}
    assert peaks["rope, side"] == peaks["bird, roll"] == pytest.approx(0.09, abs=0.006)
    assert peaks["bird, yaw"] == pytest.approx(0.4, abs=0.006)
    legs = next(line for line in above.lines if line.get_label() == "legs")
    assert len(legs.get_xdata()) == 3601
    assert legs.get_xdata().max() == pytest.approx(np.tan(np.radians(5.0)), rel=1e-3)
    np.testing.assert_allclose(legs.get_ydata(), -np.tan(np.radians(9.0)))
    plots.save(figure, tmp_path / "tow.png")
    short = plots.plot_tow(swinging(40.0)).axes[-2]
    assert [text.get_text() for text in short.texts] == ["no leg of 50 s"]


def test_a_tow_needs_a_rope(calibration):
    with pytest.raises(RequestError, match=r"has no rope; this figure needs a simulated tow with its truth"):
        plots.plot_tow(calibration)


def test_only_png_svg_and_pdf_are_written(calibration, tmp_path):
    with pytest.raises(RequestError, match=r"\.png, \.svg or \.pdf"):
        plots.save(plots.plot_field(calibration), tmp_path / "field.bmp")


def test_an_existing_figure_stays(calibration, tmp_path):
    target = tmp_path / "field.png"
    target.write_bytes(b"mine")
    with pytest.raises(RequestError, match="--force"):
        plots.save(plots.plot_field(calibration), target)
    assert target.read_bytes() == b"mine"
