"""Reconstructions of newer networks: their inputs, and what a fit gives."""

import numpy as np
import pytest
import torch

from magsim.compensation import create
from magsim.compensation.networks.inputs import fit_inputs
from magsim.dataset import flights_of, read_training
from magsim.errors import RequestError
from tests.support import scores
from tests.support.worlds import World, calibration

WORLD = World(eddy_tau_s=0.01)


@pytest.fixture(autouse=True)
def _seed():
    with torch.random.fork_rng():
        yield


@pytest.fixture(scope="module")
def recording():
    return calibration(WORLD)


def names_of(method, recording):
    return fit_inputs(method.settings, read_training(flights_of(recording)))(recording).names


def test_ga_bp_reads_34_columns_of_which_18_are_tolles_and_lawson_s(recording):
    for preset in ("paper", "default", "quick"):
        method = create("ga_bp", preset=preset)
        names = names_of(method, recording)
        assert len(set(names)) == 34
        assert names[:18] == names_of(create("bp", inputs=("tl18",)), recording)
        assert len([layer for layer in method.make_module(names).layers if isinstance(layer, torch.nn.Linear)]) == 2


def test_pg_tlnet_gives_each_part_of_tolles_and_lawson_a_branch(recording):
    method = create("pg_tlnet")
    names = names_of(method, recording)
    module = method.make_module(names)
    assert module.branches == (tuple(range(3)), tuple(range(3, 8)), tuple(range(8, 16)))
    with pytest.raises(RequestError, match="pg_tlnet has linear branches of Tolles-Lawson columns; allowed: inputs w"):
        method.make_module(("roll", "pitch"))


ADAM = {"optimizer": "adam", "refit": True, "folds": 3, "weight_decay": 0.0, "learning_rate": 0.01, "hidden": (32,)}


@pytest.mark.parametrize(("name", "settings"), [("pg_tlnet", {}), ("ga_bp", ADAM)])
def test_on_the_residual_they_beat_tolles_lawson(name, settings, recording):
    test = recording.where(split="test")
    truth = test["interference_cabin_nt"]
    methods = (create("tl16"), create(name, preset="quick", steps=300, every=50, **settings))
    first, second = (
        scores.improvement_ratio(truth, truth - method.fit(recording).interference(test), 10.0) for method in methods
    )
    assert second > 1.2 * first


def test_a_wavelet_bilstm_has_an_output_for_every_row(recording):
    method = create("wavelet_bilstm", hidden=2, steps=2, every=2).fit(recording)
    assert not method.causal
    assert np.isfinite(method.interference(recording.take(slice(0, 300)))).all()
