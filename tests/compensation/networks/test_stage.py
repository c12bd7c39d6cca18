"""First stages of networks, by their names."""

import numpy as np
import pytest

from magsim.compensation import create
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import first_stage
from magsim.errors import RequestError
from tests.support.inertial import flown
from tests.support.worlds import World, calibration


@pytest.mark.parametrize(
    ("name", "terms", "target", "band", "direction"),
    [
        ("tl16", 16, "interference", "broad", "ins"),
        ("tl18", 18, "interference", "broad", "ins"),
        ("tl16_measured", 16, "measured", "in", "ins"),
        ("tl18_measured", 18, "measured", "in", "ins"),
        ("tl16_calibrated", 16, "interference", "in", "calibrated"),
        ("tl16_auxiliary", 16, "interference", "in", "calibrated"),
    ],
)
def test_first_stages_are_tolles_lawson_methods(name, terms, target, band, direction):
    broad = {"stage_band": "broad"} if band == "broad" else {}
    stage = first_stage(NetworkSettings(first_stage=name, **broad, scale="sample", direction="ins", fluxgate="tail"))
    found = stage.get_params()
    expected = {"terms": terms, "target": target, "band": band, "fluxgate": "tail", "scale": "sample"}
    assert {key: found[key] for key in expected} == expected
    assert found["direction"] == direction
    assert bool(found["auxiliary"]) == (name == "tl16_auxiliary")


@pytest.mark.parametrize(
    ("name", "target"),
    [("exact_norm", "interference"), ("exact_norm_model", "model"), ("exact_norm_measured", "measured")],
)
def test_the_exact_norm_is_a_first_stage(name, target):
    stage = first_stage(NetworkSettings(first_stage=name, fluxgate="tail"))
    assert (stage.name, stage.target, stage.fluxgate, stage.direction) == (name, target, "tail", "calibrated")


def test_the_stage_none_estimates_zero():
    recording = calibration(World(circuits=1))
    stage = first_stage(NetworkSettings(first_stage="none")).fit(recording)
    assert not stage.interference(recording).any()


@pytest.mark.parametrize("name", ["none", "tl16_measured", "tl16_auxiliary", "exact_norm"])
def test_a_band_without_effect_is_refused(name):
    with pytest.raises(RequestError, match=f"stage_band 'broad' has no effect with first_stage '{name}'"):
        first_stage(NetworkSettings(first_stage=name, stage_band="broad"))


@pytest.mark.parametrize("name", ["tl16_auxiliary", "exact_norm"])
def test_an_untrained_network_is_its_first_stage(name):
    method = create(
        "bp", first_stage=name, steps=1, optimizer="adam", weight_decay=0.0, learning_rate=1e-12, folds=0
    ).fit(flown())
    expected = create(name).fit(flown()).interference(flown())
    np.testing.assert_allclose(method.interference(flown()), expected, rtol=0, atol=1e-6)
    assert set(create(name).fit(flown()).requires) <= set(method.requires)
