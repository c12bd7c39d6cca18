"""The recording system: from samples at the simulation rate to rows."""

from dataclasses import dataclass

import numpy as np

from magsim.signals import POINTS, Decimator, between, window_mean


@dataclass(frozen=True)
class Acquisition:
    """Anti-alias filter and decimation of one recording; the same for every channel.

    Attributes
    ----------
    decimator : Decimator
    first : int
        Sample of time 0, which is row 0.
    rows : int
        Number of rows.
    """

    decimator: Decimator
    first: int
    rows: int

    @classmethod
    def of(cls, time_s: np.ndarray, duration_s: float, rate_in_hz: float, rate_out_hz: float) -> "Acquisition":
        """Return the acquisition of samples at given times.

        Parameters
        ----------
        time_s : (n,) [s]
            Evenly spaced; 0 is one of them. Reaches the filter's run-in beyond the first and the last row.
        duration_s : float [s]
            Rows run from 0 to it.
        rate_in_hz, rate_out_hz : float [Hz]
            Rate of the samples and of the rows.

        Raises
        ------
        ValueError
            If the times are no such grid, or too short for the run-in.
        """
        time_s = np.asarray(time_s, dtype=float)
        grid = time_s * rate_in_hz
        first = round(-grid[0])
        if np.abs(grid - (np.arange(len(grid)) - first)).max() > 1e-4:
            msg = f"samples are not spaced by 1/{rate_in_hz:g} s with one at time 0"
            raise ValueError(msg)
        decimator = Decimator(rate_in_hz, rate_out_hz)
        rows = int(np.floor(duration_s * rate_out_hz + 1e-6)) + 1
        if first < decimator.half or rows > decimator.rows_of(len(time_s), first):
            msg = (
                f"samples from {time_s[0]:g} to {time_s[-1]:g} s do not reach {decimator.half / rate_in_hz:g} s beyond "
                f"the rows from 0 to {duration_s:g} s"
            )
            raise ValueError(msg)
        return cls(decimator, first, rows)

    @property
    def rate_in_hz(self) -> float:
        """Samples a second."""
        return self.decimator.rate_in_hz

    @property
    def rate_out_hz(self) -> float:
        """Rows a second."""
        return self.decimator.rate_out_hz

    @property
    def time_s(self) -> np.ndarray:
        """Times of the rows, (rows,) [s], from 0."""
        return np.arange(self.rows) / self.rate_out_hz

    def __call__(self, samples: np.ndarray) -> np.ndarray:
        """Return the rows of a channel, (n, ...) to (rows, ...)."""
        return self.decimator(samples, self.first, self.rows)

    def place_of(self, instants_s: np.ndarray) -> np.ndarray:
        """Return the positions of instants among the samples, (m,) [samples]."""
        return self.first + np.asarray(instants_s, dtype=float) * self.rate_in_hz

    def at(self, samples: np.ndarray, instants_s: np.ndarray) -> np.ndarray:
        """Return the filtered signal at any instants, (n,) or (n, c) to (m,) or (m, c).

        The filter leaves nothing from half of the output rate on, so the samples determine the signal between them.

        Raises
        ------
        ValueError
            If an instant has no run-in.
        """
        samples = np.asarray(samples, dtype=float)
        if samples.ndim > 1:
            return np.stack([self.at(samples[:, k], instants_s) for k in range(samples.shape[1])], axis=1)
        return between(self.decimator.everywhere(samples), self.place_of(instants_s) - self.decimator.half)

    @property
    def reach_s(self) -> float:
        """How far around an instant samples are read [s]."""
        return (self.decimator.half + POINTS // 2) / self.rate_in_hz


@dataclass(frozen=True)
class Counter:
    """A frequency counter in place of the anti-alias filter: the mean over a window around each row.

    Attributes
    ----------
    acquisition : Acquisition
        Rows and samples.
    window_s : float [s]
        Gain at a frequency ``f``: ``sin(pi f window) / (pi f window)``. What is faster than half of the row rate folds.
    """

    acquisition: Acquisition
    window_s: float

    @property
    def rate_in_hz(self) -> float:
        """Samples a second."""
        return self.acquisition.rate_in_hz

    @property
    def time_s(self) -> np.ndarray:
        """Times of the rows, (rows,) [s]."""
        return self.acquisition.time_s

    @property
    def reach_s(self) -> float:
        """How far around an instant samples are read [s]."""
        return self.window_s / 2.0 + (POINTS // 2 + 1) / self.rate_in_hz

    @property
    def description(self) -> str:
        """The response in words, for provenance."""
        return f"mean over {self.window_s:g} s, centered on the row for labels and truth"

    def __call__(self, samples: np.ndarray) -> np.ndarray:
        """Return the rows of a channel, (n,) or (n, c) to (rows,) or (rows, c)."""
        return self.at(samples, self.time_s)

    def at(self, samples: np.ndarray, instants_s: np.ndarray) -> np.ndarray:
        """Return means over windows centered on any instants, (m,) or (m, c)."""
        place, half = self.acquisition.place_of(instants_s), self.window_s * self.rate_in_hz / 2.0
        return window_mean(samples, place - half, place + half)
