"""Sizes of the presets ``paper``: those that paper 000 prints, and those that the page tells."""

import re

import pytest
import torch

from magsim.compensation import create
from magsim.compensation.networks.counting import multiply_accumulates, parameters
from magsim.compensation.networks.inputs import fit_inputs
from magsim.dataset import flights_of, read_training
from tests.support.inertial import flown
from tests.support.paths import ROOT

PAPERS = (
    *("magtcn", "williams", "bpnn", "resnet", "bp", "res_bp", "subnetworks", "lstm_bp", "gru_bp", "lstm"),
    *("pg_tlnet", "ga_bp", "wavelet_bilstm"),
)


@pytest.fixture(scope="module")
def training():
    return read_training(flights_of(flown(name="world")))


def sizes(name, preset, training):
    """Inputs, parameters and multiply-accumulates of an output in a stream, or of a window."""
    method = create(name, preset=preset)
    settings = method.settings
    names = fit_inputs(settings, training)(training.recordings[0]).names
    with torch.random.fork_rng():
        module = method.make_module(names)
    rows = settings.context or settings.window
    return len(names), parameters(module), multiply_accumulates(module, len(names), rows)


@pytest.mark.parametrize(
    ("name", "million"), [("williams", 0.238), ("bpnn", 0.684), ("resnet", 105.541), ("magtcn", 95.722)]
)
def test_presets_of_paper_000_have_the_sizes_that_it_prints(name, million, training):
    """Its Table 6, to 2 %, with the 19 inputs that the preset reads."""
    inputs, _, products = sizes(name, "paper", training)
    assert inputs == 19
    assert products / 1e6 == pytest.approx(million, rel=0.02)


def table():
    text = (ROOT / "docs" / "networks.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| (\d+) \| ([\d,]+) \| ([\d,]+) \| [^|]*\|$", text, flags=re.MULTILINE)
    return {name: tuple(int(number.replace(",", "")) for number in numbers) for name, *numbers in rows}


@pytest.mark.parametrize("name", PAPERS)
def test_the_page_tells_the_sizes(name, training):
    assert sizes(name, "paper", training) == table()[name]
