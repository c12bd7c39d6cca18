"""What Tolles-Lawson leaves: one physical effect at a time, added to a world that it can express exactly.

Run ``python tests/benchmarks/tl_residuals.py [--json | --markdown]``. Two figure-of-merit flights of the C208B near
Ottawa, 3000 m: 10, 5, 5 degrees of roll, pitch, yaw at 5 s a cycle to fit, 6, 8, 4 degrees at 5.9 s to test. The
18 terms are fitted in 0.1 to 0.6 Hz on the legs, turns left out. "True vector": direction cosines of the background
itself; "own vector": of a perfect fluxgate at the same place, which feels the aircraft as well.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from magsim import signals
from magsim.compensation.columns.tolles_lawson import EDDY_18, INDUCED_18
from magsim.field import compute_field
from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.sensors import Acquisition
from magsim.signals import in_band
from magsim.streams import stream
from magsim.trajectory import Flight
from magsim.truth import FieldTruth
from tests.benchmarks.rows import Row, finish, stated

SCENARIO = "patterns/fom"
MOUNTS = {"cabin": "cabin_center", "stinger": "sgl_mag_1", "floor": "sgl_mag_2"}
SENSORS = ",".join(f'{{name="{name}",mount="{mount}"}}' for name, mount in MOUNTS.items())
SITE = (
    "start.lat_deg=45.3",
    "start.lon_deg=-75.7",
    "start.alt_m=3000.0",
    "pattern.leg_m=8000.0",
    "pattern.allow_beyond_crew_g=true",
    f"sensors.scalar=[{SENSORS}]",
)
FLIGHTS = (
    ("pattern.roll_deg=10.0", "pattern.pitch_deg=5.0", "pattern.yaw_deg=5.0", "pattern.period_s=5.0"),
    ("pattern.roll_deg=6.0", "pattern.pitch_deg=8.0", "pattern.yaw_deg=4.0", "pattern.period_s=5.9"),
)

LINEAR = (
    "field.earth.along_path=false",
    "field.eddy.lag=false",
    "field.hinged.enabled=false",
    "field.propeller.enabled=false",
    "field.memory.enabled=false",
    "field.electronics.enabled=false",
)
"""A world whose projection is exactly the sum of the Tolles-Lawson terms."""

LARMOR_HZ_PER_NT = 3.498572
"""Precession frequency of cesium 133 per field strength, as its magnetometers use it."""


Extra = Callable[[Flight, FieldTruth, str], np.ndarray]
"""What an instrument at a mount adds to the reading, (n,) [nT]."""


@dataclass(frozen=True)
class Effect:
    """One row of the table: settings laid over the linear world, and what becomes of the field in the reading."""

    name: str
    overrides: tuple[str, ...] = ()
    exact: bool = False
    """Whether the reading is the length of the sum; else the projection on the background."""
    measured: bool = False
    """Whether the reading itself is fitted, background included, as where no label is known."""
    extra: Extra | None = None


def heading_error(_: Flight, truth: FieldTruth, mount: str) -> np.ndarray:
    """0.15 cos + 0.1 cos 2 of the angle between the field and an axis that looks forward and down."""
    total_b = truth.total(mount)
    cosine = np.einsum("ni,i->n", total_b, [0.5**0.5, 0.0, 0.5**0.5]) / np.linalg.norm(total_b, axis=1)
    return 0.15 * cosine + 0.1 * (2.0 * cosine**2 - 1.0)


def gyro_shift(flight: Flight, truth: FieldTruth, mount: str) -> np.ndarray:
    """Body rate along the field over 2 pi times the precession constant."""
    total_b = truth.total(mount)
    along = np.einsum("ni,ni->n", flight.carrier.at(truth.time_s).rate_b, total_b) / np.linalg.norm(total_b, axis=1)
    return along / (2.0 * np.pi * LARMOR_HZ_PER_NT)


def white_noise(flight: Flight, truth: FieldTruth, mount: str) -> np.ndarray:
    """4 pT per root hertz."""
    rng = stream(len(truth.time_s), f"tl_residuals/{mount}")
    return rng.normal(size=len(truth.time_s)) * 0.004 * np.sqrt(0.5 * flight.simulation_rate_hz)


def everything(flight: Flight, truth: FieldTruth, mount: str) -> np.ndarray:
    """All that instruments add."""
    return sum(part(flight, truth, mount) for part in (heading_error, gyro_shift, white_noise))


GRADIENT = ("field.earth.along_path=true", "field.earth.departure.enabled=false")
"""The model's main field along the track and at each mount's own place."""

DEPARTURE = ("field.earth.along_path=true",)
"""The main field as it is: the model and its departure."""

WIRING = ("field.electronics.enabled=true",)
"""Currents of the loads, the flap motor at rest."""

CRUST = ("field.crust={rms_nt=60.0}",)
"""Geology 3000 m below."""

WHOLE = (
    "field.eddy.lag=true",
    "field.earth.along_path=true",
    "field.hinged.enabled=true",
    "field.propeller.enabled=true",
    "field.memory.enabled=true",
    "field.flex.enabled=true",
    "field.controls.enabled=true",
    "field.suspension.enabled=true",
    *WIRING,
)
"""Every part on."""

EFFECTS = (
    Effect("linear T-L world (numerical floor)"),
    Effect("exact length of the sum", exact=True),
    Effect("the same, permanent moments three times", ("field.permanent.scale=3.0",), exact=True),
    Effect("eddy lag", ("field.eddy.lag=true",)),
    Effect("exact length and eddy lag", ("field.eddy.lag=true",), exact=True),
    Effect("main-field gradient, interference known", GRADIENT),
    Effect("main-field gradient, reading fitted", GRADIENT, measured=True),
    Effect("departure from the model, reading fitted", DEPARTURE, measured=True),
    Effect("crust of 60 nT rms on the ground, reading fitted", CRUST, measured=True),
    Effect("moving control surfaces", ("field.hinged.enabled=true",)),
    Effect("propeller", ("field.propeller.enabled=true",)),
    Effect("hysteresis, play 6 %", ("field.memory.enabled=true", "field.memory.viscosity=false")),
    Effect("viscosity, 0.2 % a decade", ("field.memory.enabled=true", "field.memory.hysteresis=false")),
    Effect("bending mounts", ("field.flex.enabled=true",)),
    Effect("steel of the controls", ("field.controls.enabled=true",)),
    Effect("engine on rubber mounts", ("field.suspension.enabled=true",)),
    Effect("crew in their seats, on day 1", ("day=1", "field.variation.enabled=false")),
    Effect("onboard electronics", WIRING),
    Effect("heading error 0.15 cos + 0.1 cos 2", extra=heading_error),
    Effect("gyro shift", extra=gyro_shift),
    Effect("white noise, 4 pT/sqrt(Hz)", extra=white_noise),
    Effect("everything, interference known", WHOLE, exact=True, extra=everything),
    Effect("everything, reading fitted", WHOLE, exact=True, measured=True, extra=everything),
)


@cache
def flown(number: int) -> Flight:
    """One of the two flights; the fields of all worlds are computed along the same path."""
    loaded = load_scenario(SCENARIO, [*SITE, *FLIGHTS[number]])
    return fly(loaded.scenario, loaded.aircraft, ground=loaded.ground)


@dataclass(frozen=True)
class Table:
    """Rows in band of one flight at one mount: Tolles-Lawson columns by either vector, and what they shall explain."""

    true_vector: np.ndarray
    own_vector: np.ndarray
    label: np.ndarray


def terms(vector: np.ndarray, rate_hz: float) -> np.ndarray:
    """The 18 Tolles-Lawson columns of a vector field, (rows, 18)."""
    length = np.linalg.norm(vector, axis=1)
    cosines = vector / length[:, None]
    rates = signals.spline_derivative(cosines, rate_hz)
    induced = [length * cosines[:, i] * cosines[:, j] for i, j in INDUCED_18]
    eddy = [length * cosines[:, i] * rates[:, j] for i, j in EDDY_18]
    return np.column_stack([cosines, *induced, *eddy])


def tables(effect: Effect, number: int) -> dict[str, Table]:
    """Both mounts of one flight in the world of one effect."""
    settings = load_scenario(SCENARIO, [*SITE, *FLIGHTS[number], *LINEAR, *effect.overrides])
    scenario, flight = settings.scenario, flown(number)
    truth = compute_field(scenario, settings.aircraft, flight, ground=settings.ground)
    rate_hz = scenario.recording.rate_hz
    acquire = Acquisition.of(truth.time_s, flight.duration_s, flight.simulation_rate_hz, rate_hz)
    segments = flight.segment_columns(acquire.time_s)
    legs = segments["turn"] == 0
    out = {}
    for place, mount in MOUNTS.items():
        background, total = truth.background(mount), truth.total(mount)
        strength = np.linalg.norm(background, axis=1)
        if effect.exact:
            label = np.linalg.norm(total, axis=1) - strength
        else:
            label = np.einsum("ni,ni->n", total - background, background) / strength
        if effect.measured:
            label = label + strength
        if effect.extra is not None:
            label = label + effect.extra(flight, truth, mount)
        true_vector, own_vector = terms(acquire(background), rate_hz), terms(acquire(total), rate_hz)
        rows = in_band(np.column_stack([true_vector, own_vector, acquire(label)]), acquire.time_s, legs)
        out[place] = Table(rows[:, :18], rows[:, 18:36], rows[:, 36])
    return out


def left(fit: Table, test: Table, regressors: str) -> tuple[float, float]:
    """STD [nT] of what the fit leaves of the flight that it was made on, and of the other one."""
    scale = getattr(fit, regressors).std(axis=0)
    weights = np.linalg.lstsq(getattr(fit, regressors) / scale, fit.label, rcond=1e-12)[0] / scale
    return tuple(np.std(flight.label - getattr(flight, regressors) @ weights) for flight in (fit, test))


def measure() -> list[tuple[str, str, float, tuple[float, float], tuple[float, float]]]:
    """Effect, place, raw STD of the test flight, and (fit, test) by the true and by the own vector [nT]."""
    out = []
    for effect in EFFECTS:
        first, second = tables(effect, 0), tables(effect, 1)
        for place in MOUNTS:
            fit, test = first[place], second[place]
            left_both = (left(fit, test, "true_vector"), left(fit, test, "own_vector"))
            out.append((effect.name, place, np.std(test.label), *left_both))
    return out


def markdown(found: list[tuple[str, str, float, tuple[float, float], tuple[float, float]]]) -> str:
    """One table for each place, as docs/physics.md has it."""
    lines = []
    for place in MOUNTS:
        lines += [
            f"| {place}: fit / test [nT] | raw | true vector | own vector |",
            "|---|---|---|---|",
            *(
                f"| {name} | {raw:.2g} | {true[0]:.2g} / {true[1]:.2g} | {own[0]:.2g} / {own[1]:.2g} |"
                for name, where, raw, true, own in found
                if where == place
            ),
            "",
        ]
    return "\n".join(lines)


def rows(found: list[tuple[str, str, float, tuple[float, float], tuple[float, float]]]) -> list[Row]:
    """What is left of the test flight by the true vector."""
    return [stated(f"{place}: {name}", true[1], "nT") for name, place, _, true, _ in found]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--markdown", action="store_true", help="print the tables of docs/physics.md")
    arguments = parser.parse_args()
    found = measure()
    if arguments.markdown:
        sys.stdout.write(markdown(found))
        return
    finish(rows(found), as_json=arguments.json)


if __name__ == "__main__":
    main()
