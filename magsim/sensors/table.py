"""The table of instruments."""

from collections.abc import Callable

from magsim import columns
from magsim.sensors import (
    barometer,
    base_station,
    electrical,
    fluxgate,
    inertial,
    navigation,
    radar_altimeter,
    scalar,
    surfaces,
    true_motion,
)
from magsim.sensors.instrument import Columns, Instrument, MeasuredFlight


def read_cabin(flight: MeasuredFlight) -> Columns:
    """Return the temperature of the cabin, (rows,) [degC]; none without ``[sensors.cabin]``."""
    temperature = flight.cabin_c
    return {} if temperature is None else {columns.TRUE_TEMPERATURE.name(): flight.acquisition(temperature)}


OF_THE_FIELD: tuple[Instrument, ...] = (
    scalar.read,
    read_cabin,
    fluxgate.read,
    base_station.read,
    electrical.read,
)
"""Instruments that look at the field, the currents or the cabin."""

OF_THE_FLIGHT: tuple[Instrument, ...] = (
    navigation.read_ins,
    inertial.read,
    true_motion.read_motion,
    barometer.read,
    true_motion.read_tow,
    navigation.read_carrier_ins,
    true_motion.read_ground,
    radar_altimeter.read,
    true_motion.read_wind,
    surfaces.read,
)
"""Instruments that look at the flight and the ground alone."""

INSTRUMENTS = (*OF_THE_FIELD, *OF_THE_FLIGHT)
"""Every instrument of a recording, and every column of truth that none of them measures."""


def read_of_the_flight(flight: MeasuredFlight) -> Columns:
    """Return the columns of ``OF_THE_FLIGHT``.

    Raises
    ------
    DataError
        If a clock leads out of the flight's record, or the flight leaves a terrain grid.
    """
    return _read(OF_THE_FLIGHT, flight)


def read_instruments(
    flight: MeasuredFlight, of_the_flight: Callable[[MeasuredFlight], Columns] = read_of_the_flight
) -> Columns:
    """Return the columns of all instruments.

    Parameters
    ----------
    flight : MeasuredFlight
    of_the_flight : callable
        Returns what ``read_of_the_flight`` does, of the flight without its field.

    Raises
    ------
    DataError
        If a clock leads out of the flight's record, or the flight leaves a terrain grid.
    """
    return _read(OF_THE_FIELD, flight) | of_the_flight(flight.without_field())


def _read(instruments: tuple[Instrument, ...], flight: MeasuredFlight) -> Columns:
    out: Columns = {}
    for instrument in instruments:
        out |= instrument(flight)
    return out
