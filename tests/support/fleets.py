"""One flight for a whole population: circuit 1 calibrates, circuit 2 is a figure of merit as the SEG defines it.

Flying takes longer than the field. Load and wind of a day are left out: every individual is on the same flight.
"""

from functools import cache

import magsim
from magsim.benchmark import METRICS
from magsim.benchmark.judging import judge
from magsim.benchmark.residuals import Residuals
from magsim.compensation import TollesLawson
from magsim.flight import fly
from magsim.loading import LoadedScenario, load_scenario
from magsim.recording import Recording
from magsim.simulation import compute_fields, record
from magsim.trajectory import Flight

SENSORS = {"stinger": "sgl_mag_1", "cabin": "cabin_center"}

_SCALARS = ",".join(f'{{name="{name}",mount="{mount}"}}' for name, mount in SENSORS.items())

SETTINGS = (
    "start.lat_deg=45.3",
    "start.lon_deg=-75.7",
    "pattern.leg_m=8000.0",
    "pattern.allow_beyond_crew_g=true",
    "pattern.maneuvers[0].amplitude_deg=[5.0,5.0,5.0,5.0,2.5,2.5,2.5,2.5]",
    "pattern.maneuvers[0].period_s=[7.0,7.0,7.0,7.0,4.5,4.5,4.5,4.5]",
    "pattern.maneuvers[1].amplitude_deg=[10.0,10.0,10.0,10.0,5.0,5.0,5.0,5.0]",
    "pattern.maneuvers[1].period_s=[6.0,6.0,6.0,6.0,4.5,4.5,4.5,4.5]",
    "pattern.maneuvers[2].amplitude_deg=[5.0,5.0,5.0,5.0,2.5,2.5,2.5,2.5]",
    "pattern.maneuvers[2].period_s=[6.0,6.0,6.0,6.0,4.5,4.5,4.5,4.5]",
    "air.turbulence_severity=0",
    "air.turbulence_mps=0.6",
    "field.electronics.enabled=true",
    f"sensors.scalar=[{_SCALARS}]",
    'sensors.fluxgate[0].mount="sgl_flux_b"',
    "recording.valid_legs=[]",
    "recording.truth='sum'",
)
"""Near Ottawa. 10, 5, 5 deg of roll, pitch and yaw to calibrate; 10, 5, 5 deg peak to peak in 4.5 s for the figure of
merit; light air; the fluxgate at the base of the stinger."""

_METRICS = {metric.name: metric for metric in METRICS}


def loaded(individual: int, day: int = 0) -> LoadedScenario:
    """Return the scenario of an individual on a day."""
    return load_scenario("calibration_c208b", (*SETTINGS, f"individual={individual}", f"day={day}"))


@cache
def flight() -> Flight:
    """Return the flight that all of them are on."""
    scenario = loaded(0)
    return fly(scenario.scenario, scenario.aircraft)


def recording(individual: int, day: int = 0) -> Recording:
    """Return the recording of an individual on a day."""
    scenario = loaded(individual, day)
    return record(scenario, flight(), compute_fields(scenario, flight()))


def calibrated(rec: Recording, sensor: str) -> TollesLawson:
    """Return Tolles-Lawson with 16 terms, fitted on the labels of circuit 1."""
    return magsim.TollesLawson(terms=16).fit(rec, sensor=sensor)


def left(method: TollesLawson, rec: Recording, sensor: str) -> Residuals:
    """Return what a method leaves of circuit 2."""
    return judge(method, rec, sensor=sensor)


def score(residuals: Residuals, name: str) -> float:
    """Return a metric of the benchmark by its name."""
    return _METRICS[name].score(residuals)
