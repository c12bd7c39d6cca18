"""From a scenario to a recording: the only meeting place of flight, field and sensors."""

from collections.abc import Callable, Mapping
from dataclasses import asdict

import numpy as np
from threadpoolctl import threadpool_limits

import magsim
from magsim import columns
from magsim.errors import DataError, RequestError
from magsim.field import compute_field, compute_tow_field
from magsim.field.background.station import station_field
from magsim.flight import fly
from magsim.loading import LoadedScenario
from magsim.recording import Recording
from magsim.scenario import InstrumentClock, RecordingSettings, Scenario
from magsim.sensors import (
    Acquisition,
    Counter,
    baro_columns,
    base_columns,
    carrier_columns,
    carrier_ins_columns,
    electrical_columns,
    fluxgate_columns,
    ground_columns,
    inertial_columns,
    ins_columns,
    instants,
    radar_columns,
    rope_columns,
    scalar_columns,
    temperature_c,
    true_baro_columns,
    true_columns,
)
from magsim.trajectory import Flight, Trajectory
from magsim.truth import FieldTruth

SCHEMA = 1
"""Version of what ``Recording.meta`` says."""

Progress = Callable[[str, float], None]
"""Called with the name of the step and its share done, 0 to 1."""


def simulate(loaded: LoadedScenario, *, progress: Progress | None = None) -> Recording:
    """Fly a scenario, find the field at each sensor, and record what the instruments say.

    Parameters
    ----------
    loaded : LoadedScenario
        From ``load_scenario``.
    progress : callable, optional
        Told the steps ``"flight"``, ``"field"`` and ``"sensors"``.

    Returns
    -------
    Recording
        With every column of ``magsim.columns`` that the scenario has instruments for. The same scenario, aircraft
        files, version and machine give the same bits.

    Raises
    ------
    RequestError
        If what was asked does not fit the flight, with file and line.
    DataError
        If the flight diverges or a column is not finite.
    """
    scenario, aircraft = loaded.scenario, loaded.aircraft
    # Solves on one BLAS thread and on two differ in their last bits.
    with threadpool_limits(1):
        told = _step(progress, "flight")
        try:
            flight = fly(scenario, aircraft, bird=loaded.bird, ground=loaded.ground, track=loaded.track, progress=told)
            truths = compute_fields(loaded, flight, progress=_step(progress, "field"))
        except RequestError as error:
            raise RequestError(loaded.placed(str(error))) from None
        done = _step(progress, "sensors")
        done(0.0)
        recording = record(loaded, flight, truths)
        done(1.0)
    return recording


def _step(progress: Progress | None, name: str) -> Callable[[float], None]:
    return (lambda _share: None) if progress is None else (lambda share: progress(name, share))


def compute_fields(
    loaded: LoadedScenario, flight: Flight, *, progress: Callable[[float], None] | None = None
) -> dict[str, FieldTruth]:
    """The true field of a finished flight by what carries the sensors: ``carrier``, and ``bird`` where one is towed."""
    scenario, aircraft, ground = loaded.scenario, loaded.aircraft, loaded.ground
    if loaded.bird is None:
        return {"carrier": compute_field(scenario, aircraft, flight, ground=ground, progress=progress)}
    return compute_tow_field(scenario, aircraft, loaded.bird, flight, ground=ground, progress=progress)


def record(loaded: LoadedScenario, flight: Flight, truths: Mapping[str, FieldTruth]) -> Recording:
    """Record a finished flight in its true field.

    Parameters
    ----------
    loaded : LoadedScenario
    flight : Flight
    truths : mapping of str to FieldTruth
        From ``compute_fields``.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        If a column is not finite.
    """
    scenario = loaded.scenario
    settings, seed = scenario.recording, scenario.seed
    samples_s = truths["carrier"].time_s
    acquisition = Acquisition.of(samples_s, flight.duration_s, flight.simulation_rate_hz, settings.rate_hz)
    time_s, moved = acquisition.time_s, flight.instruments
    path = moved.at(time_s)
    data: dict[str, np.ndarray] = {}
    bodies = {"carrier": flight.carrier, "bird": flight.bird}
    turning = {sensor.body for sensor in scenario.sensors.scalar if sensor.gyro_shift}
    rates_b = {body: motion.at(samples_s).rate_b for body, motion in bodies.items() if body in turning and motion}
    for sensor in scenario.sensors.scalar:
        data |= scalar_columns(sensor, truths[sensor.body], acquisition, seed, rates_b.get(sensor.body))
    cabin, warmth_c = scenario.sensors.cabin, None
    if cabin is not None:
        warmth_c = temperature_c(cabin, samples_s, seed)
        data[columns.TRUE_TEMPERATURE.name()] = acquisition(warmth_c)
    for sensor in scenario.sensors.fluxgate:
        data |= fluxgate_columns(sensor, truths[sensor.body], acquisition, seed, warmth_c)
    base = scenario.sensors.base
    if base is not None:
        field_n = station_field(base, scenario, loaded.ground, samples_s)
        data |= base_columns(base, samples_s, field_n, acquisition, seed)
    ins = scenario.sensors.ins
    data |= ins_columns(ins, _path_of(ins, "ins", moved, path, seed), settings.rate_hz, seed)
    data |= inertial_columns(ins, moved, acquisition, seed)
    data |= true_columns(path)
    barometer = scenario.sensors.barometer
    if barometer is not None:
        felt = _path_of(barometer, "baro", moved, path, seed)
        data |= baro_columns(barometer, moved, felt, ground=loaded.ground, rate_hz=settings.rate_hz, seed=seed)
        data |= true_baro_columns(barometer, path, loaded.ground)
    if flight.bird is not None:
        data |= _tow_columns(scenario, flight, time_s)
    if loaded.ground is not None:
        data |= ground_columns(path, loaded.ground)
        if scenario.sensors.radar is not None:
            heard = _path_of(scenario.sensors.radar, "radar", moved, path, seed)
            data |= radar_columns(scenario.sensors.radar, heard, loaded.ground, seed)
    wind_n = flight.wind_at(time_s)
    if wind_n is not None:
        data |= {columns.TRUE_WIND.name(direction=name): wind_n[:, k] for k, name in enumerate(columns.DIRECTIONS)}
    for name, angle in flight.controls_at(time_s).items():
        data[columns.SURFACE.name(surface=name)] = np.degrees(angle)
    for truth in truths.values():
        data |= electrical_columns(scenario.sensors.electrical, truth, acquisition, seed)
    segments = flight.segment_columns(time_s)
    data |= segments
    data[columns.SPLIT.name()] = split_of(segments["circuit"], segments["leg"], settings)
    _check_finite(loaded.name, time_s, data)
    order = {family: place for place, family in enumerate(columns.FAMILIES)}
    names = sorted(data, key=lambda name: order[columns.find(name)])
    whole = Recording(loaded.name, time_s, {name: data[name] for name in names}, _meta(loaded, flight, acquisition))
    return whole.with_truth(settings.truth)


def _tow_columns(scenario: Scenario, flight: Flight, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """The carrier beside its bird, and the rope between them."""
    carrier, ins = flight.carrier.at(time_s), scenario.sensors.carrier_ins
    out = carrier_columns(carrier) | rope_columns(flight.rope_at(time_s))
    if ins is None:
        return out
    seen = _path_of(ins, "carrier_ins", flight.carrier, carrier, scenario.seed)
    return out | carrier_ins_columns(ins, seen, scenario.recording.rate_hz, scenario.seed)


def _path_of(clock: InstrumentClock, name: str, moved: Trajectory, path: Trajectory, seed: int) -> Trajectory:
    """The motion that an instrument with a clock of its own saw at the rows."""
    taken = instants(clock, path.time_s, name, seed, (moved.time_s[0], moved.time_s[-1]))
    return path if taken is None else moved.at(taken)


def split_of(circuit: np.ndarray, leg: np.ndarray, settings: RecordingSettings) -> np.ndarray:
    """Code of the split of each row: training circuits but for their validation legs train; other circuits test.

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
    trained = np.isin(circuit, settings.train_circuits)
    kept = np.isin(leg, settings.valid_legs)
    return np.where(trained, np.where(kept, codes["valid"], codes["train"]), codes["test"]).astype(float)


def _check_finite(name: str, time_s: np.ndarray, data: dict[str, np.ndarray]) -> None:
    for column, values in data.items():
        bad = ~np.isfinite(values)
        if bad.any():
            msg = f"{name}: column {column} is not finite, first at {time_s[bad.argmax()]:g} s"
            raise DataError(msg)


def _meta(loaded: LoadedScenario, flight: Flight, acquisition: Acquisition) -> dict[str, object]:
    """Provenance in plain types: no clock, no path, no host."""
    scenario = loaded.scenario
    counters = {
        sensor.name: Counter(acquisition, sensor.counter_s).description
        + f"; readings are tagged at the {sensor.counter_tag}"
        for sensor in scenario.sensors.scalar
        if sensor.counter_s > 0.0
    }
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
        "seed": scenario.seed,
        "start_utc": scenario.start.time_utc.isoformat(),
        "rate_hz": scenario.recording.rate_hz,
        "simulation_rate_hz": flight.simulation_rate_hz,
        "filter": acquisition.decimator.description,
        "maneuvers": [asdict(flown) | {"off_axis_deg": list(flown.off_axis_deg)} for flown in flight.maneuvers],
        "notes": dict(flight.notes),
    } | ({"counters": counters} if counters else {})
