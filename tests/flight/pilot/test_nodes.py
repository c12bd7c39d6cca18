"""Nodes of calibration: weights, continuity, what is flown between them."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.errors import RequestError
from magsim.flight import fly
from magsim.flight.model.setup import PlantSetup
from magsim.flight.pilot.calibration import loop_response
from magsim.flight.pilot.nodes import Arrays, between_nodes, mean, nodes_around
from magsim.flight.pilot.response import mixed_responses

AT = PlantSetup(lat_rad=0.0, lon_rad=0.0, alt_m=3000.0, course=0.0, speed_mps=75.0)


def linear(at: PlantSetup) -> Arrays:
    """Something that is linear in speed and height."""
    return {"value": np.array([2.0 * at.speed_mps - 0.01 * at.alt_m + 7.0])}


@pytest.mark.parametrize("speed_mps", [50.0, 71.3, 74.999, 75.0, 88.0])
@pytest.mark.parametrize("alt_m", [500.0, 730.0, 1000.0, 2345.0, 3000.0, 6999.0])
def test_what_is_linear_is_exact_between_nodes(cessna: Aircraft, speed_mps: float, alt_m: float) -> None:
    at = replace(AT, speed_mps=speed_mps, alt_m=alt_m)
    nodes = nodes_around(cessna.facts, at)
    assert sum(node.weight for node in nodes) == pytest.approx(1.0)
    assert all(node.setup.speed_mps % 5.0 == 0.0 for node in nodes)
    assert between_nodes(cessna.facts, at, linear, mean)["value"] == pytest.approx(linear(at)["value"], rel=1e-12)


def test_at_a_node_nothing_else_is_asked(cessna: Aircraft) -> None:
    assert nodes_around(cessna.facts, AT) == [(1.0, AT)]
    drone = load_aircraft("uav")
    assert nodes_around(drone.facts, replace(AT, speed_mps=25.0, alt_m=500.0))[0].weight == 1.0


def test_outside_of_all_nodes_the_last_ones_hold(cessna: Aircraft) -> None:
    for alt_m, last_m in ((100.0, 500.0), (30_000.0, 19_000.0)):
        (node,) = nodes_around(cessna.facts, replace(AT, alt_m=alt_m))
        assert node == (1.0, replace(AT, alt_m=last_m))


def test_what_no_node_around_can_tell_is_measured_there(cessna: Aircraft) -> None:
    at = replace(AT, speed_mps=52.0)

    def slow(setup: PlantSetup) -> Arrays:
        return {} if setup.speed_mps == 50.0 else linear(setup)

    assert between_nodes(cessna.facts, at, slow, mean) == linear(at)


def test_what_cannot_be_flown_is_reported_as_at_its_own_speed(cessna: Aircraft) -> None:
    with pytest.raises(RequestError, match=r"no straight and level flight at 41 m/s and 3100 m"):
        loop_response(cessna.facts, ("roll",), replace(AT, speed_mps=41.0, alt_m=3100.0))


def test_largest_amplitudes_are_mixed_by_their_logarithms() -> None:
    parts = [
        (0.25, {"gain_roll": np.array([1.0]), "largest_deg_roll": np.array([10.0]), "bound_roll": np.array([1])}),
        (0.75, {"gain_roll": np.array([2.0]), "largest_deg_roll": np.array([160.0]), "bound_roll": np.array([4])}),
    ]
    mixed = mixed_responses(parts)
    assert mixed["gain_roll"] == pytest.approx(1.75)
    assert mixed["largest_deg_roll"] == pytest.approx(80.0)
    assert mixed["bound_roll"] == 4


def test_swings_between_nodes_are_flown_as_asked(cessna: Aircraft, scenario_of) -> None:
    trains = [{"axis": "roll", "amplitude_deg": 12.0, "period_s": 4.0}]
    pattern = {"kind": "straight", "leg_m": 4000.0, "lead_s": 5.0, "maneuvers": trains}
    flight = fly(scenario_of(pattern, start={"speed_mps": 72.5, "alt_m": 2000.0}), cessna)
    assert [flown.flown_deg for flown in flight.maneuvers] == pytest.approx([12.0], abs=0.05)
