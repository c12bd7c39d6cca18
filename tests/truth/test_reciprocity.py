"""Reciprocity of the induced response: D_ik at x is the moment k that a unit dipole e_i at x induces."""

import numpy as np
import pytest

from magsim.aircraft import load_aircraft
from magsim.field.metal.steel.induced import InducedModel
from magsim.field.metal.steel.meshing import steel_parts
from magsim.field.response import load_response


@pytest.fixture(scope="module")
def model() -> InducedModel:
    return InducedModel(list(steel_parts(load_aircraft("c208b").magnetics.steel).values()))


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (-3.0, 0.0, 0.0), (-11.11, 0.0, -0.82), (0.3, 0.36, 0.55)])
def test_response_is_reciprocal(model: InducedModel, point: tuple[float, float, float]) -> None:
    ray = model.nodes - np.array(point)
    potential = ray / (4.0 * np.pi * np.linalg.norm(ray, axis=1, keepdims=True) ** 3)
    moments = model.moment(model.charge(potential)).T
    response = model.response(np.array([point]))[0]
    assert np.abs(moments - response).max() < 0.005 * np.abs(response).max()


def test_the_aircraft_runs_through_the_solver_that_is_tested_here(model: InducedModel) -> None:
    response = load_response(load_aircraft("c208b"))
    np.testing.assert_allclose(model.response(response.positions_m), response.induced, rtol=1e-9, atol=1e-13)
    assert isinstance(model, InducedModel)
