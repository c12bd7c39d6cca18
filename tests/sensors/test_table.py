"""The table of instruments: what each returns, alone and together."""

from dataclasses import replace

import numpy as np
import pytest

from magsim import columns
from magsim.scenario import Cabin, Sensors
from magsim.sensors import INSTRUMENTS, Acquisition, MeasuredFlight, read_instruments
from magsim.terrain import Flat, Ground
from tests.support.measured import flight, loaded, truth


@pytest.fixture(scope="module")
def measured() -> MeasuredFlight:
    settings, field, flown = loaded().scenario.sensors, truth(16.0), flight(16.0)
    rows = Acquisition.of(field.time_s, flown.duration_s, flown.simulation_rate_hz, 10.0)
    return MeasuredFlight(settings, 5, flown, {"carrier": field}, rows)


def test_every_column_has_one_instrument(measured: MeasuredFlight) -> None:
    names = [name for instrument in INSTRUMENTS for name in instrument(measured)]
    assert len(set(names)) == len(names)
    assert set(names) == set(read_instruments(measured))
    assert all(columns.find(name) is not None for name in names)


def test_every_column_has_the_rows_of_the_recording(measured: MeasuredFlight) -> None:
    assert {values.shape for values in read_instruments(measured).values()} == {(161,)}


def test_what_is_not_on_board_returns_nothing(measured: MeasuredFlight) -> None:
    silent = [instrument for instrument in INSTRUMENTS if not instrument(measured)]
    # cabin, base station, barometer, tow, second INS, ground, radar altimeter, wind, electrical sensors
    assert len(silent) == 9


def test_an_instrument_adds_its_columns_alone(measured: MeasuredFlight) -> None:
    before = read_instruments(measured)
    warm = measured.sensors.model_copy(update={"cabin": Cabin(settled_c=40.0)})
    assert isinstance(warm, Sensors)
    after = read_instruments(replace(measured, sensors=warm, ground=Ground(Flat(100.0), 0.0)))
    assert set(after) - set(before) == {"true_cabin_c", "true_msl_m", "true_agl_m", "true_ground_m"}
    for name, values in before.items():
        np.testing.assert_array_equal(after[name], values, err_msg=name)


def test_a_flight_is_sampled_once(measured: MeasuredFlight) -> None:
    assert measured.path is measured.path
    assert measured.rate_b("carrier") is measured.rate_b("carrier")
    np.testing.assert_array_equal(measured.time_s, np.arange(161) / 10)
