"""Attitude, angular rates and products of both as network inputs."""

from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.compensation.columns.points import ChangeColumns, PointColumns

ANGLES = tuple(columns.INS_ATTITUDE.name(angle=angle) for angle in ("roll", "pitch", "heading"))

_AXES, _UNITS = tuple(f"rate {axis}" for axis in columns.AXES), ("rad/s",) * 3


@dataclass(frozen=True)
class AttitudeColumns(PointColumns):
    """Roll and pitch [rad], sine and cosine of the heading: an angle that wraps would jump."""

    columns = ANGLES
    names = ("roll", "pitch", "sin heading", "cos heading")
    units = ("rad", "rad", "1", "1")

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the columns for roll, pitch and heading [deg]; see ``PointColumns``."""
        roll, pitch, heading = np.radians(values).T
        return np.column_stack([roll, pitch, np.sin(heading), np.cos(heading)])


@dataclass(frozen=True)
class AngleColumns(PointColumns):
    """Roll, pitch and heading [rad], as paper 000 has the attitude; the heading is 0 to 2 pi and jumps in the north."""

    columns = ANGLES
    names = ("roll", "pitch", "heading")
    units = ("rad", "rad", "rad")

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the angles; see ``PointColumns``."""
        return np.radians(values)


@dataclass(frozen=True)
class GyroColumns(PointColumns):
    """Angular rates in body axes from the gyros of the INS [rad/s]."""

    columns = tuple(columns.INS_RATE.name(axis=axis) for axis in columns.AXES)
    names = _AXES
    units = _UNITS

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the rates; see ``PointColumns``."""
        return np.radians(values)


@dataclass(frozen=True)
class AttitudeRateColumns(ChangeColumns):
    """Angular rates in body axes from the attitude [rad/s], by the kinematics of roll, pitch and heading."""

    columns = ANGLES
    names = _AXES
    units = _UNITS

    def of(self, values: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Return the rates; see ``ChangeColumns``."""
        roll, pitch, _ = np.radians(values).T
        rolling, pitching, turning = np.radians(changes).T
        return np.column_stack(
            [
                rolling - turning * np.sin(pitch),
                pitching * np.cos(roll) + turning * np.sin(roll) * np.cos(pitch),
                turning * np.cos(roll) * np.cos(pitch) - pitching * np.sin(roll),
            ]
        )


@dataclass(frozen=True)
class CoupledColumns(ChangeColumns):
    """Each attitude column times each angular rate in body axes, 12 columns.

    With 18 Tolles-Lawson columns and the 4 of the attitude they are the 34 of ``ga_bp``. The abstract of its paper
    (Sensors 2025, 25(16), 5059) says "attitude angle and attitude angular rate-coupled features"; that these are
    meant is a guess.
    """

    columns = ANGLES
    names = tuple(f"{name} {rate}" for name in AttitudeColumns.names for rate in _AXES)
    units = ("rad2/s",) * 6 + ("rad/s",) * 6

    def of(self, values: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Return the products; see ``ChangeColumns``."""
        attitude, rates = AttitudeColumns().of(values), AttitudeRateColumns().of(values, changes)
        return (attitude[:, :, None] * rates[:, None, :]).reshape(len(values), -1)
