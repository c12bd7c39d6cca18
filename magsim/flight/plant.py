"""The flight model as a machine: JSBSim, its start, its state in SI units, its checks.

After the start nothing writes a state of JSBSim: only commands, set points, wind and switches. JSBSim holds Python's
interpreter lock while it steps, so threads gain nothing; processes do.
"""

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import jsbsim
import numpy as np

from magsim.aircraft.facts import Facts, TurbopropEngine
from magsim.errors import DataError, RequestError
from magsim.flight.aero import flap_lift
from magsim.flight.air import CALM, Weather, weather_xml
from magsim.flight.autopilot import INPUTS, Sine
from magsim.flight.engines import lever_of, settling_time
from magsim.flight.model import PULLS, STILL_AIR, write_model
from magsim.flight.patterns import LocalPlane
from magsim.flight.rates import INTEGRATORS, integrators_for
from magsim.flight.tow.line import Felt
from magsim.units import FT, LB, LBF, SLUG_FT3

if TYPE_CHECKING:
    from magsim.flight.tow.coupled import Coupled

CHANNELS: tuple[tuple[str, str, float], ...] = (
    ("lat", "position/lat-geod-rad", 1.0),
    ("lon", "position/long-gc-rad", 1.0),
    ("alt", "position/geod-alt-ft", FT),
    ("v_north", "velocities/v-north-fps", FT),
    ("v_east", "velocities/v-east-fps", FT),
    ("v_down", "velocities/v-down-fps", FT),
    ("roll", "attitude/phi-rad", 1.0),
    ("pitch", "attitude/theta-rad", 1.0),
    ("heading", "attitude/psi-rad", 1.0),
    ("p", "velocities/p-rad_sec", 1.0),
    ("q", "velocities/q-rad_sec", 1.0),
    ("r", "velocities/r-rad_sec", 1.0),
    ("elevator", "fcs/elevator-pos-rad", 1.0),
    ("aileron", "fcs/left-aileron-pos-rad", 1.0),
    ("rudder", "fcs/rudder-pos-rad", 1.0),
    ("airspeed", "velocities/vt-fps", FT),
    ("alpha", "aero/alpha-rad", 1.0),
    ("beta", "aero/beta-rad", 1.0),
    ("contact", "gear/wow", 1.0),
    ("throttle", "fcs/throttle-pos-norm", 1.0),
    ("wind_north", "atmosphere/total-wind-north-fps", FT),
    ("wind_east", "atmosphere/total-wind-east-fps", FT),
    ("wind_down", "atmosphere/total-wind-down-fps", FT),
    ("flap", "fcs/flap-pos-rad", 1.0),
    ("engaged", "ap/on", 1.0),
    ("thrust", "propulsion/engine/thrust-lbs", LBF),
    ("rotor", "propulsion/engine/propeller-rpm", math.pi / 30.0),
)
"""Logged quantities: name, JSBSim's property, factor to SI."""

WITHOUT = frozenset({"propulsion/engine/propeller-rpm"})
"""Properties that a model need not have; they read 0 then."""

TO_SI = np.array([factor for _, _, factor in CHANNELS])

COLUMN = {name: i for i, (name, _, _) in enumerate(CHANNELS)}


@dataclass(frozen=True)
class Trim:
    """Straight and level flight."""

    pitch: float
    roll: float
    commands: Mapping[str, float]


@dataclass(frozen=True)
class Setup:
    """Where and how a plant begins.

    Attributes
    ----------
    lat_rad, lon_rad, alt_m : float
    course : float [rad]
        Of the motion over ground.
    speed_mps : float
        True airspeed.
    wind_mps : (float, float)
        The motion of the air to north and to east; near the poles as they are at ``grid_lon``.
    step_hz : int
    ground_m : float
        Height of the ground above the ellipsoid there.
    weather : Weather
        What the air does beside its steady wind.
    flap_rad : float
        Deflection of the flaps at the start.
    burn : bool
        Whether fuel is burned.
    grid : float
        What of the longitude is added to headings, see ``magsim.earth.grid``.
    grid_lon : float [rad]
        Longitude of the start point.
    hook_b : (3,) [m], optional
        Where a rope pulls, body axes from the datum.
    """

    lat_rad: float
    lon_rad: float
    alt_m: float
    course: float
    speed_mps: float
    wind_mps: tuple[float, float] = (0.0, 0.0)
    step_hz: int = 120
    ground_m: float = 0.0
    weather: Weather = CALM
    flap_rad: float = 0.0
    burn: bool = False
    grid: float = 0.0
    grid_lon: float = 0.0
    hook_b: tuple[float, float, float] | None = None

    @property
    def local_wind_mps(self) -> tuple[float, float]:
        """The wind to local north and east at the place."""
        north, east = self.wind_mps
        turned = -self.grid * (self.lon_rad - self.grid_lon)
        sin, cos = math.sin(turned), math.cos(turned)
        return north * cos - east * sin, north * sin + east * cos


def ground_speed(speed_mps: float, course: float, wind_mps: tuple[float, float]) -> float:
    """Speed over ground [m/s] that an airspeed gives along a course [rad] in wind."""
    along, right = _wind_along(course, wind_mps)
    return along + math.sqrt(max(0.0, speed_mps**2 - right**2))


def crab_heading(speed_mps: float, course: float, wind_mps: tuple[float, float]) -> float:
    """Heading [rad] that keeps a course in wind."""
    _, right = _wind_along(course, wind_mps)
    return course - math.asin(max(-1.0, min(1.0, right / speed_mps)))


def _wind_along(course: float, wind_mps: tuple[float, float]) -> tuple[float, float]:
    """Wind along and to the right of a course [m/s]."""
    north, east = wind_mps
    sin, cos = math.sin(course), math.cos(course)
    return north * cos + east * sin, east * cos - north * sin


@lru_cache(maxsize=1)
def silence() -> None:
    """Stop JSBSim's own printing, once in a process and before its first instance."""
    logger = jsbsim.DefaultLogger()
    logger.set_min_level(jsbsim.LogLevel.FATAL)
    jsbsim.set_logger(logger)


def load(
    facts: Facts,
    step_hz: int,
    *,
    twin: bool = False,
    air_xml: str = STILL_AIR,
    hook_b: tuple[float, float, float] | None = None,
) -> jsbsim.FGFDMExec:
    """A fresh instance of an aircraft's flight model, or of its twin with direct thrust, for trim and linearization.

    Its step rate is set before its filters are built.

    ``air_xml`` is the system of shear and gusts; without it the air has neither. ``hook_b`` is where a rope pulls.
    """
    silence()
    with tempfile.TemporaryDirectory(prefix="magsim-") as name:
        folder = Path(name).resolve()
        write_model(facts, folder, "aircraft", twin=twin, air_xml=air_xml, hook_b=hook_b)
        return load_from(folder, "aircraft", 1.0 / step_hz, integrators_for(facts, step_hz))


def load_from(folder: Path, name: str, step_s: float, integrators: Mapping[str, int] = INTEGRATORS) -> jsbsim.FGFDMExec:
    """A fresh instance of the model ``aircraft/<name>/<name>.xml`` below a folder, with accurate integrators."""
    silence()
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.set_dt(step_s)
    loaded = fdm.load_model_with_paths(name, str(folder / "aircraft"), str(folder / "engine"), str(folder / "systems"))
    if not loaded or not math.isclose(fdm.get_delta_t(), step_s, rel_tol=1e-12):
        msg = f"JSBSim {fdm.get_version()} did not load the flight model of {name}"
        raise DataError(msg)
    fdm.disable_output()
    for group, order in integrators.items():
        fdm[f"simulation/integrator/{group}"] = order
    return fdm


def trimmed_twin(facts: Facts, setup: Setup) -> jsbsim.FGFDMExec:
    """The twin with direct thrust, trimmed for straight and level flight in still air by JSBSim's full trim.

    Raises
    ------
    RequestError
        If the aircraft cannot fly like that.
    """
    fdm = load(facts, setup.step_hz, twin=True)
    _initial_place(fdm, setup)
    fdm["ic/psi-true-deg"] = math.degrees(setup.course)
    fdm["ic/gamma-deg"] = 0.0
    fdm["ic/vt-fps"] = setup.speed_mps / FT
    fdm["propulsion/fuel_freeze"] = 1.0
    fdm.run_ic()
    _set_flaps(fdm, facts, setup.flap_rad)
    fdm["propulsion/set-running"] = -1
    try:
        fdm.do_trim(1)
    except jsbsim.TrimFailureError:
        msg = (
            f"start.speed_mps: {facts.title} finds no straight and level flight at {setup.speed_mps:g} m/s "
            f"and {setup.alt_m:g} m; allowed: a speed above the stall and below full power at that height"
        )
        raise RequestError(msg) from None
    return fdm


def trim(facts: Facts, setup: Setup) -> Trim:
    """Attitude and commands of straight and level flight; raises as ``trimmed_twin`` does."""
    fdm = trimmed_twin(facts, setup)
    names = (
        "fcs/throttle-cmd-norm",
        "fcs/pitch-trim-cmd-norm",
        "fcs/elevator-cmd-norm",
        "fcs/aileron-cmd-norm",
        "fcs/roll-trim-cmd-norm",
        "fcs/rudder-cmd-norm",
        "fcs/yaw-trim-cmd-norm",
    )
    commands = {name: fdm[name] for name in names}
    if isinstance(facts.engine, TurbopropEngine):
        # The twin's lever is a part of the thrust, the turbine's one of the power.
        thrust, density = fdm["propulsion/engine/thrust-lbs"] * LBF, fdm["atmosphere/rho-slugs_ft3"] * SLUG_FT3
        commands["fcs/throttle-cmd-norm"] = lever_of(facts.engine, thrust, setup.speed_mps, density)
    return Trim(fdm["attitude/theta-rad"], fdm["attitude/phi-rad"], commands)


def _initial_place(fdm: jsbsim.FGFDMExec, setup: Setup) -> None:
    fdm["ic/terrain-elevation-ft"] = setup.ground_m / FT
    fdm["ic/lat-geod-deg"] = math.degrees(setup.lat_rad)
    fdm["ic/long-gc-deg"] = math.degrees(setup.lon_rad)
    fdm["ic/h-sl-ft"] = setup.alt_m / FT


def _set_flaps(fdm: jsbsim.FGFDMExec, facts: Facts, flap_rad: float) -> None:
    """Flaps at rest at a deflection, with their lift a part of the trim."""
    fdm["fcs/flap-pos-rad"] = flap_rad
    fdm["ap/flap-rad"] = flap_rad
    fdm["ap/flap-lift-norm"] = flap_lift(facts, flap_rad)


def start(facts: Facts, setup: Setup) -> jsbsim.FGFDMExec:
    """An instance that flies along its course, trimmed, in wind, with the autopilot on.

    Trim is found in still air on an instance of its own; the flight begins with the same attitude to the air and with
    the velocity over ground that the wind gives. An engine that has to run up first does so on the way to the start:
    the instance begins that much earlier on its course, and what it flies until then is thrown away.
    """
    trimmed = trim(facts, setup)
    settling_s = settling_time(facts.engine)
    begun = _earlier(setup, settling_s)
    north, east = wind = begun.local_wind_mps
    heading = crab_heading(setup.speed_mps, begun.course, wind)
    air_xml = weather_xml(setup.weather, setup.wind_mps, setup.grid, setup.grid_lon)
    fdm = load(facts, setup.step_hz, air_xml=air_xml, hook_b=setup.hook_b)
    _initial_place(fdm, begun)
    fdm["ic/phi-rad"] = trimmed.roll
    fdm["ic/theta-rad"] = trimmed.pitch
    fdm["ic/psi-true-rad"] = heading % (2.0 * math.pi)
    fdm["ic/vn-fps"] = (setup.speed_mps * math.cos(heading) + north) / FT
    fdm["ic/ve-fps"] = (setup.speed_mps * math.sin(heading) + east) / FT
    fdm["ic/vd-fps"] = 0.0
    fdm["propulsion/fuel_freeze"] = 1.0
    fdm["simulation/randomseed"] = setup.weather.seed
    fdm.run_ic()
    _set_flaps(fdm, facts, setup.flap_rad)
    for name, value in trimmed.commands.items():
        fdm[name] = value
    fdm["propulsion/set-running"] = -1
    fdm["fcs/advance-cmd-norm"] = 1.0
    fdm["ap/theta-rad"] = trimmed.pitch
    fdm["ap/height-ft"] = setup.alt_m / FT
    fdm["ap/speed-fps"] = setup.speed_mps / FT
    fdm["ap/grid-norm"] = setup.grid
    fdm["ap/heading-rad"] = (heading + setup.grid * begun.lon_rad) % (2.0 * math.pi)
    fdm["ap/hold-height"] = 1.0
    fdm["ap/hold-heading"] = 1.0
    fdm["ap/on"] = 1.0
    if not setup.grid:
        fdm["atmosphere/wind-north-fps"] = north / FT
        fdm["atmosphere/wind-east-fps"] = east / FT
    for name, value in setup.weather.turbulence_properties().items():
        fdm[name] = value
    for _ in range(round(settling_s * setup.step_hz)):
        fdm.run()
    fdm["propulsion/fuel_freeze"] = 0.0 if setup.burn else 1.0
    return fdm


def _earlier(setup: Setup, time_s: float) -> Setup:
    """The same start a time earlier on its course, which is another one there where the meridians converge."""
    distance = time_s * ground_speed(setup.speed_mps, setup.course, setup.local_wind_mps)
    plane = LocalPlane(setup.lat_rad, setup.lon_rad, setup.alt_m)
    lat, lon = plane.geodetic(-distance * math.cos(setup.course), -distance * math.sin(setup.course))
    return replace(setup, lat_rad=lat, lon_rad=lon, course=setup.course - plane.north_at(lat, lon))


class Plant:
    """An aircraft in flight.

    Parameters
    ----------
    facts : Facts
    setup : Setup
    coupled : Coupled, optional
        What pulls on the hook of the setup.

    Attributes
    ----------
    row : list of float
        The last logged row in the order of ``CHANNELS``, as JSBSim gives it; times ``TO_SI`` it is SI.
    time_s : float
        Time since the plant's start.
    """

    def __init__(self, facts: Facts, setup: Setup, coupled: "Coupled | None" = None) -> None:
        self._fdm = start(facts, setup)
        self._run = self._fdm.run
        self._step_s = 1.0 / setup.step_hz
        self._steps = 0
        manager = self._fdm.get_property_manager()
        self._readers = [_reader(manager, name) for _, name, _ in CHANNELS]
        self._writers = {name: _node(manager, name).set_double_value for name in (*_writable(), *setup.weather.inputs)}
        self._outside = _envelope(facts)
        self._set_ground = _node(manager, "position/terrain-elevation-asl-ft").set_double_value
        self._floor_ft = setup.ground_m / FT
        self._clock_s = self._fdm["simulation/sim-time-sec"]
        self.row: list[float] = [read() for read in self._readers]
        self._coupled = coupled
        if coupled is not None:
            self._pulls = [_node(manager, f"external_reactions/{name}/magnitude").set_double_value for name, _ in PULLS]
            coupled.begin(self._felt())

    @property
    def time_s(self) -> float:
        """Time since the start [s]."""
        return self._steps * self._step_s

    @property
    def clock_s(self) -> float:
        """The same moment on the clock of the sine generators [s]."""
        return self._clock_s + self.time_s

    def run(self, steps: int) -> list[float]:
        """Fly a number of steps and log a row; returns ``row``.

        Raises
        ------
        DataError
            If the flight has diverged, touched the ground or left the flight model's envelope.
        """
        run = self._run
        if self._coupled is None:
            for _ in range(steps):
                run()
        else:
            for _ in range(steps):
                run()
                self._pull(self._coupled.step(self._felt()))
        self._steps += steps
        self.row = row = [read() for read in self._readers]
        trouble = self._outside(row, self._floor_ft)
        if trouble:
            raise FlightTroubleError(trouble, row, self.time_s)
        return row

    def _felt(self) -> Felt:
        """The state that a line under the aircraft feels."""
        return Felt(*[self._readers[index]() * factor for index, factor in _FELT])

    def _pull(self, force_n: tuple[float, float, float]) -> None:
        """Pull on the hook in the next step."""
        if not math.isfinite(sum(force_n)):
            self.row = [read() for read in self._readers]
            trouble = "lost the swing of its bird (allowed: a larger flight.step_hz, fewer links, a heavier rope)"
            raise FlightTroubleError(trouble, self.row, self.time_s)
        for write, force in zip(self._pulls, force_n, strict=True):
            write(force / LBF)

    def ground(self, height_m: float) -> None:
        """Tell the height of the ground below, above the ellipsoid, at which it is touched."""
        self._floor_ft = height_m / FT
        self._set_ground(self._floor_ft)

    def value(self, name: str) -> float:
        """A quantity of the last row, in SI units."""
        index = COLUMN[name]
        return self.row[index] * CHANNELS[index][2]

    def motion(self) -> tuple[float, ...]:
        """What guidance needs of the last row: the quantities of ``MOTION``, in SI units."""
        row = self.row
        return tuple([row[index] * factor for index, factor in _MOTION])

    @property
    def fuel_kg(self) -> float:
        """Fuel in the tanks."""
        return float(self._fdm["propulsion/total-fuel-lbs"]) * LB

    def command(self, name: str, value: float) -> None:
        """Write a command or set point of the autopilot."""
        self._writers[name](value)


class FlightTroubleError(DataError):
    """The flight went wrong; knows when, on the plant's clock, so that the caller can name its own time."""

    def __init__(self, trouble: str, row: list[float], time_s: float) -> None:
        self.trouble, self.row, self.time_s = trouble, row, time_s
        super().__init__(self.told(time_s))

    def told(self, time_s: float) -> str:
        """One line that names time and state."""
        value = {name: self.row[i] * CHANNELS[i][2] for name, i in COLUMN.items()}
        return (
            f"the flight {self.trouble} at t = {time_s:.1f} s: height {value['alt']:.0f} m, airspeed "
            f"{value['airspeed']:.1f} m/s, roll {math.degrees(value['roll']):.1f}, pitch "
            f"{math.degrees(value['pitch']):.1f}, angle of attack {math.degrees(value['alpha']):.1f}, sideslip "
            f"{math.degrees(value['beta']):.1f} deg"
        )


MOTION = ("lat", "lon", "v_north", "v_east", "v_down", "heading", "airspeed")
"""Quantities that guidance reads on every tick."""

_FELT = tuple((COLUMN[name], CHANNELS[COLUMN[name]][2]) for name in Felt._fields)

_MOTION = tuple((COLUMN[name], CHANNELS[COLUMN[name]][2]) for name in MOTION)


def _writable() -> tuple[str, ...]:
    return (*INPUTS, *(name for axis in ("pitch", "roll", "yaw") for name in Sine(axis).inputs))


def _node(manager: jsbsim.FGPropertyManager, name: str) -> jsbsim.FGPropertyNode:
    node = manager.get_node(name)
    if node is None:
        msg = f"JSBSim has no property {name}"
        raise DataError(msg)
    return node


def _reader(manager: jsbsim.FGPropertyManager, name: str) -> Callable[[], float]:
    if name in WITHOUT and manager.get_node(name) is None:
        return float
    return _node(manager, name).get_double_value


def _envelope(facts: Facts) -> Callable[[list[float], float], str]:
    """Check of a row over a ground of some height [ft]: what is wrong with it, or nothing."""
    limits = facts.limits
    alpha_low, alpha_high = (math.radians(v) for v in limits.angle_of_attack.value)
    beta, bank, pitch = (math.radians(v.value) for v in (limits.sideslip, limits.bank, limits.pitch))
    i_alpha, i_beta, i_roll, i_pitch = (COLUMN[n] for n in ("alpha", "beta", "roll", "pitch"))
    i_alt, i_contact = COLUMN["alt"], COLUMN["contact"]

    def outside(row: list[float], floor: float) -> str:
        # Comparisons are written so that a NaN fails them.
        if not math.isfinite(sum(row)):
            return "diverged (not a number)"
        if not (row[i_alt] > floor and row[i_contact] == 0.0):
            return "touched the ground"
        if not alpha_low < row[i_alpha] < alpha_high:
            return "stalled"
        if not (abs(row[i_beta]) < beta and abs(row[i_roll]) < bank and abs(row[i_pitch]) < pitch):
            return "diverged"
        return ""

    return outside


def bare_steps(facts: Facts, setup: Setup, steps: int) -> float:
    """Step a plant and do nothing else; returns the last height [m], so that the work has a result."""
    fdm = start(facts, setup)
    run = fdm.run
    for _ in range(steps):
        run()
    return float(np.float64(fdm["position/geod-alt-ft"]) * FT)
