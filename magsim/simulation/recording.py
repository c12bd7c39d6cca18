"""The recording of a finished flight: columns of all instruments, segments, splits and provenance."""

from collections.abc import Callable, Mapping
from dataclasses import asdict

import numpy as np

import magsim
from magsim import columns
from magsim.errors import DataError
from magsim.field.background import station_field
from magsim.loading import LoadedScenario
from magsim.recording import Recording
from magsim.scenario import RecordingSettings, ScalarSensor
from magsim.sensors import Acquisition, Counter, MeasuredFlight, read_instruments, read_of_the_flight
from magsim.sensors.instrument import Columns
from magsim.simulation.loads import times_on
from magsim.trajectory import Flight, ManeuverFlown
from magsim.truth import FieldTruth

SCHEMA = 1
"""Version of the contents of ``Recording.meta``."""


def record(
    loaded: LoadedScenario,
    flight: Flight,
    truths: Mapping[str, FieldTruth],
    *,
    station_n: np.ndarray | None = None,
    of_the_flight: Callable[[MeasuredFlight], Columns] = read_of_the_flight,
) -> Recording:
    """Record a finished flight in its true field.

    Parameters
    ----------
    loaded : LoadedScenario
    flight : Flight
    truths : mapping of str to FieldTruth
        From ``compute_fields``.
    station_n : (n, 3) [nT], optional
        The field at the base station, north, east, down, where it is known already.
    of_the_flight : callable
        See ``read_instruments``.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        If a column is not finite, or a clock leads out of the flight's record.
    """
    scenario = loaded.scenario
    settings, samples_s = scenario.recording, truths["carrier"].time_s
    acquisition = Acquisition.of(samples_s, flight.duration_s, flight.simulation_rate_hz, settings.rate_hz)
    station = scenario.sensors.base
    if station is not None and station_n is None:
        station_n = station_field(station, scenario, loaded.ground, samples_s)
    seed = scenario.seed if scenario.sensors.seed is None else scenario.sensors.seed
    measured = MeasuredFlight(
        scenario.sensors, seed, flight, truths, acquisition, ground=loaded.ground, station_n=station_n
    )
    time_s, segments = measured.time_s, flight.segment_columns(measured.time_s)
    data = read_instruments(measured, of_the_flight) | segments
    data[columns.SPLIT.name()] = split_of(segments["circuit"], segments["leg"], settings)
    _check_finite(loaded.name, time_s, data)
    names = sorted(data, key=_place_in_table)
    whole = Recording(
        loaded.name, time_s, {name: data[name] for name in names}, _meta(loaded, flight, truths, acquisition)
    )
    return whole.with_truth(settings.truth)


def _place_in_table(name: str) -> int:
    """Return the position of a column's family in ``columns.FAMILIES``."""
    family = columns.find(name)
    assert family is not None  # every instrument names its columns by the table
    return columns.FAMILIES.index(family)


def split_of(circuit: np.ndarray, leg: np.ndarray, settings: RecordingSettings) -> np.ndarray:
    """Return the code of the split of each row: training circuits but for their validation legs train, others test.

    Where the settings name one split, all rows have it.

    Parameters
    ----------
    circuit, leg : (n,)
        A turn has the number of the leg before it.
    settings : RecordingSettings

    Returns
    -------
    (n,)
        Keys of ``columns.SPLITS``.
    """
    codes = {name: code for code, name in columns.SPLITS.items()}
    if settings.split is not None:
        return np.full(np.shape(circuit), float(codes[settings.split]))
    rest = np.where(np.isin(circuit, settings.train_circuits), codes["valid"], codes["test"])
    return np.where(settings.is_for_training(circuit, leg), codes["train"], rest).astype(float)


def _check_finite(name: str, time_s: np.ndarray, data: dict[str, np.ndarray]) -> None:
    for column, values in data.items():
        bad = ~np.isfinite(values)
        if bad.any():
            msg = f"{name}: column {column} is not finite, first at {time_s[bad.argmax()]:g} s"
            raise DataError(msg)


def _meta(
    loaded: LoadedScenario, flight: Flight, truths: Mapping[str, FieldTruth], acquisition: Acquisition
) -> dict[str, object]:
    """Return the provenance in plain types: no clock, no path, no host."""
    scenario = loaded.scenario
    counters = {
        sensor.name: Counter(acquisition, sensor.counter_s).description
        + f"; readings are tagged at the {sensor.counter_tag}"
        for sensor in scenario.sensors.scalar
        if sensor.counter_s > 0.0
    }
    dead_zones = {sensor.name: _dead_zones(sensor) for sensor in scenario.sensors.scalar if sensor.can_drop_out}
    loads = times_on(loaded, flight, truths)
    return {
        "schema": SCHEMA,
        "generator": "magsim",
        "version": magsim.__version__,
        "scenario": loaded.name,
        "scenario_text": loaded.text,
        "overrides": list(loaded.overrides),
        "digest": loaded.digest,
        "aircraft": loaded.aircraft.name,
        **({} if loaded.bird is None else {"bird": loaded.bird.name}),
        "individual": scenario.individual,
        "day": scenario.day,
        "seed": scenario.seed,
        "start_utc": scenario.start.time_utc.isoformat(),
        "rate_hz": scenario.recording.rate_hz,
        "main_field": scenario.field.earth.description,
        "simulation_rate_hz": flight.simulation_rate_hz,
        "filter": acquisition.decimator.description,
        "maneuvers": [_plain(flown) for flown in flight.maneuvers],
        "notes": dict(flight.notes),
        **({"counters": counters} if counters else {}),
        **({"dead_zones": dead_zones} if dead_zones else {}),
        **({"times_on": loads} if loads else {}),
    }


def _plain(flown: ManeuverFlown) -> dict[str, object]:
    """Return a maneuver as plain tables and lists."""
    lists = {"off_axis_deg": list(flown.off_axis_deg), "scattered": [asdict(cycle) for cycle in flown.scattered]}
    return asdict(flown) | lists


def _dead_zones(sensor: ScalarSensor) -> dict[str, object]:
    """Return where a scalar magnetometer does not read, in plain types."""
    zones = {"axis_b": list(sensor.axis_b), "polar_deg": sensor.dead_polar_deg, "equator_deg": sensor.dead_equator_deg}
    return zones if sensor.range_nt is None else zones | {"range_nt": list(sensor.range_nt)}
