"""The log of a flight: rows of the plant in SI units, and the tables that follow from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magsim.aircraft.engine import Engine, TurbopropEngine
from magsim.earth.atmosphere import standard_density
from magsim.earth.wgs84 import transport_rate
from magsim.flight.model.channels import COLUMN
from magsim.flight.model.engines import turning_speed
from magsim.flight.pilot.flaps import moving
from magsim.flight.pilot.measure import rows_between
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.trajectory import Trajectory


@dataclass(frozen=True)
class Log:
    """Rows of a run in SI units on the plant's clock; a column for each of ``CHANNELS``."""

    time_s: np.ndarray
    table: np.ndarray

    def __getitem__(self, name: str) -> np.ndarray:
        return self.table[:, COLUMN[name]]

    def cut(self, start_s: float, stop_s: float, zero_s: float) -> "Log":
        """Return the rows from start to stop, with the time counted from ``zero_s``."""
        rows = rows_between(self.time_s, start_s, stop_s)
        return Log(self.time_s[rows] - zero_s, self.table[rows])

    def trajectory(self, cg_b: Sequence[float]) -> Trajectory:
        """Return the motion of the center of gravity."""
        attitude = np.stack([self["roll"], self["pitch"], np.unwrap(self["heading"])], axis=-1)
        velocity_n = np.stack([self["v_north"], self["v_east"], self["v_down"]], axis=-1)
        rate_e = np.stack([self["p"], self["q"], self["r"]], axis=-1)
        # JSBSim's rates are relative to the turning Earth; the local frame turns with the motion over it.
        turning_n = transport_rate(self["lat"], self["alt"], velocity_n)
        return Trajectory(
            time_s=self.time_s,
            lat_rad=self["lat"],
            lon_rad=np.unwrap(self["lon"]),
            alt_m=self["alt"],
            velocity_n=velocity_n,
            attitude=attitude,
            rate_b=rate_e - rotate_back(rot_nb_from_attitude(attitude), turning_n),
            reference_b=np.array(cg_b),
        )

    def wind(self) -> np.ndarray:
        """Return the wind along the flight, north, east, down, (n, 3) [m/s]."""
        return np.stack([self["wind_north"], self["wind_east"], self["wind_down"]], axis=-1)

    def rotors(self, engine: Engine) -> dict[str, np.ndarray]:
        """Return the speed of the propeller [rad/s], governed or of fixed pitch at its thrust."""
        if isinstance(engine, TurbopropEngine):
            return {"propeller": self["rotor"]}
        if engine.propeller is None:
            return {}
        thrust, density = np.maximum(self["thrust"], 0.0), np.asarray(standard_density(self["alt"]))
        return {"propeller": turning_speed(engine.propeller, thrust, self["airspeed"], density)}

    def controls(self) -> dict[str, np.ndarray]:
        """Return deflections [rad] by the right-hand rule about +y, for the rudder about +z."""
        left = self["aileron"]
        deflections = {
            "elevator": self["elevator"],
            "aileron_left": left,
            "aileron_right": -left,
            "rudder": self["rudder"],
            "flap": self["flap"].copy(),
        }
        for values in deflections.values():
            values.flags.writeable = False
        return deflections

    def switches(self) -> dict[str, np.ndarray]:
        """Return the states of the electric loads, as in ``Flight.switches``."""
        return {
            "flap_motor": moving(self["flap"]),
            "autopilot": self["engaged"].copy(),
            "throttle": self["throttle"].copy(),
        }
