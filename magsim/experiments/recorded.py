"""What sets the strengths of an aircraft's sources along a recorded flight."""

from collections.abc import Sequence
from datetime import datetime

import numpy as np

from magsim import columns, signals
from magsim.aircraft.magnetics import ControlDipole, HingedDipole, Magnetics, Memory
from magsim.earth import decimal_years, igrf
from magsim.errors import RequestError
from magsim.field.load import load_g
from magsim.field.metal.eddy import Modes, slow_states
from magsim.field.sources.memory import remembered
from magsim.field.sources.rotors import ShaftDipole, mean_moment
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.recording import Recording
from magsim.scenario import FieldSettings


class RecordedExcitation:
    """The excitation of a recorded flight, with the main field as the only background.

    Currents and deflections are those of the truth where it is known, else those of the instruments. Feeders whose
    current is not recorded carry none, surfaces whose deflection is not recorded rest. Of a rotor the mean over whole
    turns counts: its tones are far above the band.

    Parameters
    ----------
    recording : Recording
        With attitude and position, by truth where it is known, else by the INS.
    magnetics : Magnetics
        Of the aircraft.
    settings : FieldSettings
        Which parts are on, and how.

    Raises
    ------
    RequestError
        If the recording lacks attitude, position, height or date.
    """

    def __init__(self, recording: Recording, magnetics: Magnetics, settings: FieldSettings) -> None:
        self.magnetics, self.settings, self._recording = magnetics, settings, recording
        self.ambient_b = background(recording)
        self.step_s = 1.0 / recording.rate_hz
        self._rate_b = signals.spline_derivative(self.ambient_b, recording.rate_hz)
        self._curve_b = signals.spline_derivative(self._rate_b, recording.rate_hz)
        currents = {f.name: _first(recording, _CURRENT, feeder=f.name) for f in magnetics.feeders}
        self.currents_a = {feeder: current for feeder, current in currents.items() if current is not None}
        surfaces = {dipole.surface for dipole in magnetics.hinged} | {dipole.surface for dipole in magnetics.controls}
        angles = {surface: _first(recording, _DEFLECTION, surface=surface) for surface in sorted(surfaces)}
        self._angles = {surface: np.radians(angle) for surface, angle in angles.items() if angle is not None}

    @property
    def warmth(self) -> None:
        """Temperatures stay those of the start's height."""
        return

    def eddy_states(self, modes: Modes) -> np.ndarray:
        """Return the states of the eddy-current modes to first order in their time constants, (n, k)."""
        return slow_states(modes, self._rate_b, self._curve_b)

    def deflection(self, dipole: HingedDipole) -> tuple[np.ndarray, np.ndarray]:
        """Return cosine and sine of a dipole's deflection, (n,) each, or (1,) each where it is not recorded."""
        angle = self._angles.get(dipole.surface, np.zeros(1))
        return np.cos(angle), np.sin(angle)

    def angle(self, dipole: ControlDipole) -> np.ndarray:
        """Return the deflection of the surface of a control, (n,) [rad], or (1,) where it is not recorded."""
        return self._angles.get(dipole.surface, np.zeros(1))

    def load_g(self, place_b: np.ndarray) -> np.ndarray:
        """Return the recorded specific force less that of the parked aircraft, (n, 3) [g]: the same at every place."""
        del place_b
        for family in (columns.TRUE_ACCELERATION, columns.INS_ACCELERATION):
            names = [family.name(axis=axis) for axis in columns.AXES]
            if all(name in self._recording for name in names):
                return load_g(np.column_stack([self._recording[name] for name in names]))
        return np.zeros((len(self.ambient_b), 3))

    def posture(self, person: str) -> np.ndarray:
        """Return that of a person who sits still, (1, 4): no recording holds more."""
        del person
        return np.zeros((1, 4))

    def remembered(self, memory: Memory) -> np.ndarray:
        """Return the field that steel with a memory answers beside the ambient one, (n, 3) [nT]."""
        return remembered(memory, self.ambient_b, self.step_s, self.settings.memory)

    def moment(self, source: ShaftDipole, rotor: str) -> np.ndarray:
        """Return the mean moment of a source on the shaft of a rotor, (n, 3) [A m^2]."""
        del rotor
        return mean_moment(source, self.ambient_b)


_CURRENT = (columns.TRUE_CURRENT, columns.CURRENT)
_DEFLECTION = (columns.TRUE_SURFACE, columns.SURFACE)


def _first(recording: Recording, families: Sequence[columns.Family], **fields: str) -> np.ndarray | None:
    """Return the column of the first of some families that a recording has; None if it has none."""
    names = [family.name(**fields) for family in families]
    return next((recording[name] for name in names if name in recording), None)


def _angle(recording: Recording, name: str) -> np.ndarray:
    for family in (columns.TRUE_ATTITUDE, columns.INS_ATTITUDE):
        column = family.name(angle=name)
        if column in recording:
            return np.radians(recording[column])
    msg = f"recording {recording.name!r} has no {name}; a map needs attitude and position"
    raise RequestError(msg)


def background(recording: Recording) -> np.ndarray:
    """Return IGRF-14 along a recording in body axes, (n, 3) [nT].

    Raises
    ------
    RequestError
        If the recording lacks attitude, position, height or date.
    """
    attitude = np.column_stack([_angle(recording, name) for name in ("roll", "pitch", "heading")])
    lat, lon = _angle(recording, "lat"), _angle(recording, "lon")
    heights = [name for name in (columns.TRUE_ALTITUDE.pattern, columns.INS_ALTITUDE.pattern) if name in recording]
    begun = recording.meta.get("start_utc")
    if not heights or not isinstance(begun, str):
        msg = f"recording {recording.name!r} has no {'height' if not heights else 'start_utc'}; a map needs it"
        raise RequestError(msg)
    year = decimal_years(datetime.fromisoformat(begun), recording.time_s)
    field_n = igrf(lat, lon, recording[heights[0]], year)
    return rotate_back(rot_nb_from_attitude(attitude), field_n)
