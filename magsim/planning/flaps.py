"""Checks of flap moves with the speed and the legs that are flown."""

from collections.abc import Iterator

from magsim.aircraft import Aircraft
from magsim.scenario import FlapMove
from magsim.scenario.flaps import flap_problem


def check_moves(
    moves: tuple[FlapMove, ...],
    aircraft: Aircraft | None,
    *,
    speed_mps: float,
    alt_m: float,
    circuits: int,
    legs: int,
) -> Iterator[tuple[str, str]]:
    """Yield the problems of flap moves: key within ``flight``, and text.

    Parameters
    ----------
    moves : tuple of FlapMove
    aircraft : Aircraft, optional
    speed_mps, alt_m : float
        True airspeed and least height of the flight.
    circuits, legs : int
        Circuits of the flight, and legs of the circuit that has most.
    """
    for i, move in enumerate(moves):
        text = flap_problem(aircraft, move.deflection_deg, speed_mps, alt_m) if aircraft else ""
        if aircraft and aircraft.facts.flap is None:
            text = f"{aircraft.name} has no flaps; allowed: none"
        if text:
            yield f"flaps[{i}].deflection_deg", text
        if move.leg is not None and move.circuit > circuits:
            yield f"flaps[{i}].circuit", f"{move.circuit} is not flown; allowed: 1 to {circuits}"
        if move.leg is not None and move.leg > legs:
            yield f"flaps[{i}].leg", f"{move.leg} is not flown; allowed: 1 to {legs}"
