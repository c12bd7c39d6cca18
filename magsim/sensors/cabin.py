"""Temperature of the instruments."""

import numpy as np

from magsim.scenario import Cabin
from magsim.signals import gauss_markov
from magsim.streams import stream


def temperature_c(cabin: Cabin, time_s: np.ndarray, seed: int) -> np.ndarray:
    """Return the temperature at given times.

    Parameters
    ----------
    cabin : Cabin
    time_s : (n,) [s]
        Evenly spaced; before 0 it is that of time 0 but for the wander.
    seed : int

    Returns
    -------
    (n,) [degC]
        ``settled + (start - settled) exp(-t / warmup)``, and a Gauss-Markov wander.
    """
    rate_hz = (len(time_s) - 1) / (time_s[-1] - time_s[0])
    approach = (cabin.start_c - cabin.settled_c) * np.exp(-np.maximum(time_s, 0.0) / cabin.warmup_s)
    random = stream(seed, "cabin/temperature")
    return cabin.settled_c + approach + gauss_markov(random, time_s.shape, cabin.wander_c, cabin.wander_s, rate_hz)
