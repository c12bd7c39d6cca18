"""Simulations one after another, which share what they have in common."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from magsim.errors import RequestError
from magsim.field import Background, backgrounds_of, compute_field, compute_tow_field
from magsim.field.background import station_field
from magsim.field.situation import Passage
from magsim.flight import check_over_sea, fly
from magsim.loading import LoadedScenario
from magsim.recording import Recording
from magsim.sensors import MeasuredFlight, read_of_the_flight
from magsim.sensors.instrument import Columns
from magsim.simulation.dependence import BackgroundInputs, FieldInputs, FlightInputs
from magsim.simulation.recording import record
from magsim.threads import one_blas_thread
from magsim.trajectory import Flight
from magsim.truth import FieldTruth

Progress = Callable[[str, float], None]
"""Called with the name of the step and its share done, 0 to 1."""

Share = Callable[[float], None]
"""Called with the share of a step that is done, 0 to 1."""

T = TypeVar("T")


@dataclass
class Last(Generic[T]):
    """The last result of a stage, and the key that it was computed under."""

    key: str = ""
    result: T | None = None

    def get(self, key: str, compute: Callable[[], T]) -> T:
        """Return the result under a key: the last one, or a new one in its place."""
        if self.result is None or self.key != key:
            self.result = None  # two flights need not be held at once
            self.key, self.result = key, compute()
        return self.result


class Simulator:
    """Simulates scenarios, and flies and computes only what differs from the scenario before.

    Each recording is to the last bit the one that ``magsim.simulate`` returns. The last flight, its background and its
    field are kept under digests of all that they depend on (``magsim.simulation.dependence``): scenarios that differ
    in the magnetic aircraft share flight, background and what INS, barometer and the like read of a flight, those
    that differ in errors of instruments the field.

    Examples
    --------
    >>> simulator = Simulator()
    >>> for seed in range(10):
    ...     recording = simulator.simulate(load_scenario("calibration_c208b", [f"sensors.seed={seed}"]))
    """

    def __init__(self) -> None:
        self._flight: Last[Flight] = Last()
        self._backgrounds: Last[dict[str, Background]] = Last()
        self._truths: Last[dict[str, FieldTruth]] = Last()
        self._columns: Last[Columns] = Last()

    def simulate(self, loaded: LoadedScenario, *, progress: Progress | None = None) -> Recording:
        """Fly a scenario, compute the field at each sensor, and record the readings of the instruments.

        Parameters
        ----------
        loaded : LoadedScenario
        progress : callable, optional
            Called with the name of the step (``"flight"``, ``"field"`` or ``"sensors"``) and its share done, 0 to 1.

        Returns
        -------
        Recording

        Raises
        ------
        RequestError
            If the scenario does not fit the flight; with file and line where there is one.
        DataError
            If the flight diverges or a column is not finite.
        """
        # Solves on one BLAS thread and on two differ in their last bits.
        with one_blas_thread():
            try:
                check_over_sea(loaded.scenario, loaded.aircraft, loaded.ground)
                flight, flown = self._flown(loaded, _step(progress, "flight"))
                around = BackgroundInputs.of(loaded)
                key = f"{flown} {around.key}"
                known = self._backgrounds.get(key, lambda: backgrounds_of(around.scenario, flight, around.ground))
                truths = self._field(loaded, flight, known, key, _step(progress, "field"))
            except RequestError as error:
                raise RequestError(loaded.placed(str(error))) from None
            report = _step(progress, "sensors")
            report(0.0)
            station_n = _station(loaded, known["carrier"].passage)

            def of_the_flight(measured: MeasuredFlight) -> Columns:
                settings = f"{measured.seed} {measured.rate_hz} {measured.sensors.model_dump_json()}"
                return self._columns.get(f"{flown} {settings}", lambda: read_of_the_flight(measured))

            recording = record(loaded, flight, truths, station_n=station_n, of_the_flight=of_the_flight)
            report(1.0)
        return recording

    def _flown(self, loaded: LoadedScenario, report: Share) -> tuple[Flight, str]:
        """Return the flight of a scenario, and its key."""
        inputs = FlightInputs.of(loaded)
        flight = self._flight.get(inputs.key, lambda: fly_inputs(inputs, report))
        report(1.0)
        return flight, inputs.key

    def _field(
        self, loaded: LoadedScenario, flight: Flight, known: Mapping[str, Background], key: str, report: Share
    ) -> Mapping[str, FieldTruth]:
        """Return the true field of a flight in its background, whose key is given."""
        inputs = FieldInputs.of(loaded)
        truths = self._truths.get(f"{key} {inputs.key}", lambda: compute_inputs(inputs, flight, known, report))
        report(1.0)
        return truths


def _station(loaded: LoadedScenario, passage: Passage) -> np.ndarray | None:
    """Return the field at the base station at the times of a passage, (n, 3) [nT]; None without a station."""
    station = loaded.scenario.sensors.base
    if station is None:
        return None
    return passage.once(
        ("station", station.model_dump_json()),
        lambda: station_field(station, passage.scenario, passage.ground, passage.time_s),
    )


def fly_inputs(inputs: FlightInputs, report: Share | None = None) -> Flight:
    """Fly what a flight depends on."""
    return fly(
        inputs.scenario,
        inputs.aircraft,
        bird=inputs.bird,
        ground=inputs.ground,
        track=inputs.track,
        progress=report,
    )


def compute_inputs(
    inputs: FieldInputs, flight: Flight, backgrounds: Mapping[str, Background], report: Share | None = None
) -> dict[str, FieldTruth]:
    """Compute the true field of a flight from what it depends on."""
    scenario, aircraft, bird = inputs.scenario, inputs.aircraft, inputs.bird
    if bird is None:
        carrier = compute_field(scenario, aircraft, flight, background=backgrounds["carrier"], progress=report)
        return {"carrier": carrier}
    return compute_tow_field(scenario, aircraft, bird, flight, backgrounds=backgrounds, progress=report)


def compute_fields(loaded: LoadedScenario, flight: Flight, *, progress: Share | None = None) -> dict[str, FieldTruth]:
    """Return the true field of a finished flight by what carries the sensors: ``carrier``, and ``bird`` with a tow."""
    around = BackgroundInputs.of(loaded)
    backgrounds = backgrounds_of(around.scenario, flight, around.ground)
    return compute_inputs(FieldInputs.of(loaded), flight, backgrounds, progress)


def _step(progress: Progress | None, name: str) -> Share:
    return (lambda _share: None) if progress is None else (lambda share: progress(name, share))
