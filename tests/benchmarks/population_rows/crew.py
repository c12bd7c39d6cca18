"""People who move in their seats: what it adds to the reading in 0.1 to 0.6 Hz on forty days of the nominal aircraft.

Tolles-Lawson takes nothing of it away: it is no function of the attitude.
"""

import numpy as np

from magsim.field import load_response
from magsim.field.composition import with_background
from magsim.field.excitation import FlightExcitation
from magsim.field.parts import PARTS
from magsim.field.situation import Situation
from magsim.sensors import Acquisition
from magsim.signals import in_band
from tests.benchmarks.rows import Row, stated
from tests.support import fleets

DAYS = 40

MOUNTS = {"cabin": "cabin_center", "floor": "sgl_mag_2", "stinger": "sgl_mag_1"}


def rows() -> list[Row]:
    """5th, 50th and 95th percentile over the days of the STD on the legs."""
    flight, scenario = fleets.flight(), fleets.loaded(0).scenario
    found: dict[str, list[float]] = {name: [] for name in MOUNTS}
    nominal = fleets.loaded(0).aircraft
    response = load_response(nominal)
    situation = Situation.of(scenario, nominal.magnetics, flight, response, mounts=tuple(MOUNTS.values()))
    background = with_background(situation).ambient_b
    direction = background / np.linalg.norm(background, axis=1)[:, None]
    rate_hz = scenario.recording.rate_hz
    acquire = Acquisition.of(situation.time_s, flight.duration_s, flight.simulation_rate_hz, rate_hz)
    legs = flight.segment_columns(acquire.time_s)["turn"] == 0
    for day in range(1, DAYS + 1):
        today = fleets.loaded(0, day)
        aboard = Situation.of(today.scenario, today.aircraft.magnetics, flight, response, mounts=tuple(MOUNTS.values()))
        crew = PARTS["crew"].field(FlightExcitation(aboard), response, aboard.rows)
        assert crew is not None
        band = in_band(acquire(np.einsum("nsi,ni->ns", crew, direction)), acquire.time_s, legs)
        for name, values in zip(MOUNTS, band.T, strict=True):
            found[name].append(float(np.std(values)))
    out = []
    for name, sizes in found.items():
        for percent in (5, 50, 95):
            size = float(np.percentile(sizes, percent))
            out.append(stated(f"crew_band_std_{name}_p{percent:02d}", size, "nT"))
    return out
