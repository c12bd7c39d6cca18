"""What the temperature of a climb changes: a box at 2000 m on a day, by magnets and metal that were at 800 m before.

The change of the field along the background in 0.1 to 0.6 Hz on the legs of the second box, beside the same flight with
the temperature of its start.
"""

import numpy as np

from magsim.field import compute_field
from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.sensors import Acquisition
from magsim.signals import in_band
from tests.benchmarks.rows import Row, stated

MOUNTS = {"cabin": "cabin_center", "floor": "sgl_mag_2", "stinger": "sgl_mag_1"}

_SCALARS = ",".join(f'{{name="{name}",mount="{mount}"}}' for name, mount in MOUNTS.items())

_MANEUVERS = ",".join(
    f'{{axis="{axis}",amplitude_deg={amplitude},period_s={period}}}'
    for axis, amplitude, period in (("pitch", 5.0, 7.0), ("roll", 10.0, 6.0), ("yaw", 5.0, 6.0))
)

_BOX = f'kind="box",leg_m=8000.0,maneuvers=[{_MANEUVERS}]'

SETTINGS = (
    "start.lat_deg=45.3",
    "start.lon_deg=-75.7",
    "start.alt_m=800.0",
    f'pattern={{kind="sequence",parts=[{{{_BOX}}},{{alt_m=2000.0,north_m=40000.0,east_m=0.0,{_BOX}}}]}}',
    f"sensors.scalar=[{_SCALARS}]",
    "day=1",
    "air.wind_north_mps=0.0",
    "air.turbulence_mps=0.0",
    "field.variation.enabled=false",
)


def rows() -> list[Row]:
    """STD in band of the change at each mount, in all and part by part."""
    loaded = load_scenario("patterns/sequence", SETTINGS)
    still = loaded.changed(["field.temperature.enabled=false"])
    flight = fly(loaded.scenario, loaded.aircraft, ground=loaded.ground)
    truth, before = (compute_field(each.scenario, each.aircraft, flight) for each in (loaded, still))
    rate_hz = loaded.scenario.recording.rate_hz
    acquire = Acquisition.of(truth.time_s, flight.duration_s, flight.simulation_rate_hz, rate_hz)
    segments = flight.segment_columns(acquire.time_s)
    legs = (segments["turn"] == 0) & (segments["circuit"] == 2)
    out = []
    for name, mount in MOUNTS.items():
        background = truth.background(mount)
        direction = background / np.linalg.norm(background, axis=1)[:, None]
        changes = {part: truth.part(part, mount) - before.part(part, mount) for part in ("permanent", "hinged", "eddy")}
        for part, change in {"all": sum(changes.values()), **changes}.items():
            along = acquire(np.einsum("ni,ni->n", change, direction))
            size = float(np.std(in_band(along[:, None], acquire.time_s, legs)))
            out.append(stated(f"climb_band_std_{name}_{part}", size, "nT"))
    return out
