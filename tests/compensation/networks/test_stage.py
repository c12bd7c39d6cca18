"""Inputs and first stages of networks, by their names."""

import numpy as np
import pytest

from magsim.compensation.columns import AttitudeColumns, TollesLawsonColumns
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import first_stage, network_columns
from tests.support.worlds import World, calibration


def test_inputs_are_the_named_column_sets_side_by_side():
    recording = calibration(World(circuits=1))
    settings = NetworkSettings(inputs=("attitude", "tl18"))
    design = network_columns(settings, "cabin", 45_000.0)(recording)
    expected = [AttitudeColumns()(recording), TollesLawsonColumns(18, "cabin", strength_nt=45_000.0)(recording)]
    np.testing.assert_array_equal(design.matrix, np.hstack([part.matrix for part in expected]))
    assert network_columns(settings, "cabin", None).reads == ("ins_{angle}_deg", "flux_{sensor}_{axis}_nt")
    assert network_columns(NetworkSettings(inputs=("tl16",)), "cabin", None)(recording).matrix.shape[1] == 16


@pytest.mark.parametrize(
    ("name", "terms", "target", "band"),
    [
        ("tl16", 16, "interference", "broad"),
        ("tl18", 18, "interference", "broad"),
        ("tl16_measured", 16, "measured", "in"),
        ("tl18_measured", 18, "measured", "in"),
    ],
)
def test_first_stages_are_tolles_lawson_methods(name, terms, target, band):
    stage = first_stage(NetworkSettings(first_stage=name, stage_band="broad", scale="sample"), "tail")
    found = stage.get_params()
    expected = {"terms": terms, "target": target, "band": band, "fluxgate": "tail", "scale": "sample"}
    assert {key: found[key] for key in expected} == expected


def test_the_stage_none_estimates_zero():
    recording = calibration(World(circuits=1))
    stage = first_stage(NetworkSettings(first_stage="none"), None).fit(recording)
    assert not stage.interference(recording).any()
