"""The schedule of the flap lever, and the runs of the flap motor that follow."""

import math
from collections.abc import Sequence

import numpy as np

from magsim.errors import DataError, RequestError
from magsim.flight.path.elements import Element
from magsim.scenario import FlapMove


def check_legs(moves: Sequence[FlapMove], path: Sequence[Element], expected_s: float) -> None:
    """Check that every move has its moment.

    Parameters
    ----------
    moves : sequence of FlapMove
    path : sequence of Element
    expected_s : float
        Time that the path takes [s].

    Raises
    ------
    RequestError
        If a leg is not flown, or a time is later than the flight's end.
    """
    legs = {(element.circuit, element.leg) for element in path if not element.turn}
    for number, move in enumerate(moves):
        if move.leg is not None and (move.circuit, move.leg) not in legs:
            most = max(leg for circuit, leg in legs if circuit == move.circuit)
            msg = f"flight.flaps[{number}].leg: circuit {move.circuit} has no leg {move.leg}; allowed: 1 to {most}"
            raise RequestError(msg)
        if move.at_s is not None and move.at_s > expected_s:
            msg = (
                f"flight.flaps[{number}].at_s: {move.at_s:g} s is after the end of the flight; allowed: up to about "
                f"{expected_s:.0f}"
            )
            raise RequestError(msg)


class FlapSchedule:
    """Settings of the flap lever in time.

    Parameters
    ----------
    moves : sequence of FlapMove

    Attributes
    ----------
    made : set of int
        Numbers of the moves that have been made.
    next_s : float
        When the next move is due, as far as that is known; infinite if none is.
    """

    def __init__(self, moves: Sequence[FlapMove]) -> None:
        self._moves = tuple(moves)
        self._due: list[tuple[float, int]] = []
        self.made: set[int] = set()
        self.next_s = math.inf

    def begin(self, zero_s: float) -> None:
        """Set the time of the first row on the plant's clock."""
        self._due += [(move.at_s + zero_s, i) for i, move in enumerate(self._moves) if move.at_s is not None]
        self._look()

    def entered(self, circuit: int, leg: int, time_s: float) -> None:
        """Record a leg that has been entered, and when."""
        for i, move in enumerate(self._moves):
            if (move.circuit, move.leg) == (circuit, leg):
                self._due.append((time_s + move.after_s, i))
        self._look()

    def setting(self, time_s: float) -> float | None:
        """Return the lever's new setting [rad] if it is to be moved by a time, else None."""
        found = None
        while self.next_s <= time_s:
            found = self._due.pop(0)[1]
            self.made.add(found)
            self._look()
        return None if found is None else math.radians(self._moves[found].deflection_deg)

    def _look(self) -> None:
        self._due.sort()
        self.next_s = self._due[0][0] if self._due else math.inf

    def check(self) -> None:
        """Check that every move has been made.

        Raises
        ------
        DataError
            If one was not.
        """
        for i, move in enumerate(self._moves):
            if i not in self.made:
                msg = f"the flight ended before flight.flaps[{i}], {move}; allowed: an earlier time or a longer flight"
                raise DataError(msg)


def moving(flap_rad: np.ndarray) -> np.ndarray:
    """Whether the flap motor turns after each row of a log, (n,) of 0 and 1."""
    turning = np.diff(flap_rad) != 0.0
    return np.append(turning, turning[-1:]).astype(float)


def runs_of(time_s: np.ndarray, flap_rad: np.ndarray) -> list[dict[str, float]]:
    """Return each run of the flap motor: times from the first row [s], first and last deflection [deg]."""
    on = moving(flap_rad)
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], on, [0.0]])))
    edges = np.minimum(edges, len(time_s) - 1).tolist()
    runs = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        angles = np.degrees(flap_rad[[first, last]])
        runs.append(
            {
                "start_s": float(time_s[first]),
                "stop_s": float(time_s[last]),
                "from_deg": float(angles[0]),
                "to_deg": float(angles[1]),
            }
        )
    return runs
