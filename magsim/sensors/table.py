"""The table of instruments, in the order in which they are read."""

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


INSTRUMENTS: tuple[Instrument, ...] = (
    scalar.read,
    read_cabin,
    fluxgate.read,
    base_station.read,
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
    electrical.read,
)
"""Every instrument of a recording, and every column of truth that none of them measures."""


def read_instruments(flight: MeasuredFlight) -> Columns:
    """Return the columns of all instruments.

    Raises
    ------
    DataError
        If a clock leads out of the flight's record, or the flight leaves a terrain grid.
    """
    out: Columns = {}
    for instrument in INSTRUMENTS:
        out |= instrument(flight)
    return out
