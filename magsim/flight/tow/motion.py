"""The motion of a towed body under its hook over a flight."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class BirdMotion:
    """One flight of a body under its rope, relative to the tow point, along the common axes.

    Attributes
    ----------
    time_s : (m,) [s]
    place_m, velocity_mps : (m, 3)
        Center of gravity of the body.
    quaternion : (m, 4)
        From the body's axes to the common ones.
    rate_b : (m, 3) [rad/s]
        TowedBody's axes.
    bridle_m : (m, 3)
        Lower end of the rope.
    tension_n : (m, 2) [N]
        Of the first and of the last link.
    least_n, most_n : float [N]
        Over all links and steps.
    begun_s : float [s]
        Start of the motion: before the first row if the log was cut.
    slack_s, lost_s : float or None
        Time of the first compression of a link, which a rope cannot bear; time of the first NaN.
    """

    time_s: np.ndarray
    place_m: np.ndarray
    velocity_mps: np.ndarray
    quaternion: np.ndarray
    rate_b: np.ndarray
    bridle_m: np.ndarray
    tension_n: np.ndarray
    least_n: float
    most_n: float
    begun_s: float
    slack_s: float | None
    lost_s: float | None

    @classmethod
    def of(
        cls,
        time_s: np.ndarray,
        table: np.ndarray,
        *,
        least_n: float,
        most_n: float,
        begun_s: float,
        slack_s: float | None,
        lost_s: float | None,
    ) -> "BirdMotion":
        """Build from times (m,) and logged rows (m, 18): place, velocity, rate, quaternion, bridle, tensions."""
        place, velocity, rate, quaternion, bridle, tension = np.split(table, [3, 6, 9, 13, 16], axis=1)
        return cls(
            time_s,
            place,
            velocity,
            quaternion,
            rate,
            bridle,
            tension,
            least_n=least_n,
            most_n=most_n,
            begun_s=begun_s,
            slack_s=slack_s,
            lost_s=lost_s,
        )
