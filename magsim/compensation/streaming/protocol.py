"""What passes between a stream and a method: the estimate of a row, what is known of the rows, the method's part."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

T_co = TypeVar("T_co", covariant=True)


class Estimate(NamedTuple):
    """What a stream gives for one row.

    Attributes
    ----------
    time_s : float [s]
        Time tag of the row that it is for.
    interference_nt : float [nT]
        NaN in the declared warm-up of a piece.
    compensated_nt : float [nT]
        Reading minus interference.
    """

    time_s: float
    interference_nt: float
    compensated_nt: float


@dataclass(frozen=True)
class Feed:
    """What is known of rows before the first one comes.

    Attributes
    ----------
    rate_hz : float [Hz]
        Rows a second.
    columns : tuple of str
        Input columns of the families that the method requires.
    start_utc : str, optional
        Instant of time 0, as the provenance of a recording states it.
    """

    rate_hz: float
    columns: tuple[str, ...] = ()
    start_utc: str | None = None


class RowWise(Protocol[T_co]):
    """Makes something of each row of a piece, a fixed number of rows later.

    A piece is a run of rows without a gap in time. No filter and no derivative reaches over a gap; what a method has
    learned in flight may.
    """

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns in the order in which ``push`` takes their values; ``time_s`` where time is needed."""

    @property
    def lookahead_rows(self) -> int:
        """Rows after its own that the result of a row needs."""

    def push(self, values: np.ndarray) -> T_co | None:
        """Take the next row of a piece.

        Parameters
        ----------
        values : (c,)
            Finite. A row that is refused must leave everything as it was.

        Returns
        -------
        The result of the row ``lookahead_rows`` before; None until there is one.

        Raises
        ------
        DataError
            If the values are not possible.
        """

    def finish(self) -> Sequence[T_co]:
        """End the piece: return the results of its last ``lookahead_rows`` rows, or fewer, and be ready for another."""


Streamer = RowWise[float]
"""A method's part of a stream: its results are the interference [nT], NaN in the warm-up of a piece."""
