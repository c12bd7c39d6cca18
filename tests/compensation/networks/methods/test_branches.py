"""Which branch reads which column: WilliamsNN and the sub-networks."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import create
from magsim.compensation.columns.tolles_lawson import term_names
from magsim.compensation.networks.counting import parameters
from magsim.errors import RequestError
from tests.support.worlds import World, calibration

TL16 = term_names(16)
EARTH = ("time", "lat", "lon", "d lat", "d lon")


def columns(module):
    return {name: tuple(found) for name, found in module.columns.items()}


def test_williams_has_a_branch_each_for_permanent_induced_and_eddy_columns():
    """Attitude and all else go with the permanent columns: 6, 5 and 8 features with the inputs of paper 000."""
    module = create("williams").make_module((*TL16, "roll", "pitch", "heading"))
    expected = {"permanent": (0, 1, 2, 16, 17, 18), "induced": tuple(range(3, 8)), "eddy": tuple(range(8, 16))}
    assert columns(module) == expected
    assert module.platform_branches == ("permanent", "induced", "eddy")
    assert module.taps == 1


def test_williams_of_1993_subtracts_what_the_aircraft_explains():
    module = create("williams", mode="field", taps=1, hidden=5).make_module(("roll", "lat", "cur_a", "time", "lon"))
    assert columns(module) == {"local": (1, 4), "diurnal": (3,), "interference": (0, 2)}
    assert module.platform_branches == ("interference",)
    assert parameters(module) == (5 * 2 + 5 + 6) + (5 + 5 + 6) + (5 * 2 + 5 + 6)
    without = create("williams", mode="field").make_module(("roll", "time"))
    assert columns(without) == {"diurnal": (1,), "interference": (0,)}


@pytest.mark.parametrize(
    ("mode", "names", "message"),
    [
        ("tl", (*TL16, "time"), "mode tl reads no column time; allowed: Tolles-Lawson columns and"),
        ("tl", ("roll", "pitch"), "mode tl has a branch each for .*; allowed: inputs with tl16 or tl18"),
        ("field", ("roll", "pitch"), "mode field has a branch each for .*; allowed: inputs with position or time"),
        ("field", ("lat", "time"), "position and time are none of these"),
        ("field", ("roll", "time", "d lat"), "mode field reads no column d lat; allowed: position, time and"),
    ],
)
def test_inputs_that_do_not_fit_the_mode_are_refused(mode, names, message):
    with pytest.raises(RequestError, match=message):
        create("williams", mode=mode).make_module(names)


def test_taps_beyond_the_window_are_refused():
    for name in ("williams", "subnetworks"):
        with pytest.raises(RequestError, match="window: 4 rows are fewer than the 5 that an output is made from"):
            create(name, taps=5, window=4, stride=1).fit(calibration(World(circuits=1)))


def test_subnetworks_are_those_of_the_inputs():
    """478 parameters of the aircraft, 534 with the field's."""
    own, all_six = (create("subnetworks").make_module(names) for names in (TL16, (*TL16, *EARTH)))
    assert columns(own) == {"Z3": (0, 1, 2), "Z4": tuple(range(3, 8)), "Z5": tuple(range(8, 16))}
    assert parameters(own) == 478
    assert columns(all_six) == {"Z1": (16,), "Z2": (17, 18), **columns(own), "Z6": (19, 20)}
    assert all_six.platform_branches == ("Z3", "Z4", "Z5")
    sizes = {name: (net[0].in_features, net[0].out_features) for name, net in all_six.perceptrons.items()}
    assert sizes == {"Z1": (3, 1), "Z2": (6, 3), "Z3": (9, 4), "Z4": (15, 7), "Z5": (24, 12), "Z6": (6, 3)}
    assert parameters(all_six) == 534


def test_columns_without_a_subnetwork_are_refused():
    with pytest.raises(RequestError, match="subnetworks reads no column roll; allowed: Tolles-Lawson columns, time"):
        create("subnetworks").make_module((*TL16, "roll"))
    with pytest.raises(RequestError, match="subnetworks subtracts what Tolles-Lawson columns explain"):
        create("subnetworks").make_module(EARTH)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("subnetworks", {"inputs": ("tl16", "time", "position", "travel"), "optimizer": "adam"}),
        ("williams", {"mode": "field", "inputs": ("attitude", "time", "position")}),
    ],
)
def test_what_models_the_field_is_fitted_and_not_subtracted(name, settings):
    """Every branch learns; elsewhere and at another hour, attitude and fluxgate give the same estimate."""
    recording = calibration(World(circuits=1))
    method = create(name, **settings, target="measured", first_stage="none", steps=6, every=3, folds=0).fit(recording)
    module = method._fitted.module
    trained = {branch: net[-1].weight.abs().max() > 0.0 for branch, net in module.perceptrons.items()}
    assert all(trained.values())
    elsewhere = {"ins_lat_deg": recording["ins_lat_deg"] + 0.3, "ins_lon_deg": recording["ins_lon_deg"] - 0.2}
    later = {**recording.meta, "start_utc": "2025-03-13T09:00:00Z"}
    moved = replace(recording, data={**recording.data, **elsewhere}, meta=later)
    np.testing.assert_array_equal(method.interference(moved), method.interference(recording))


def test_a_causal_resnet_needs_a_head_for_each_row_and_rows_to_reach_back():
    with pytest.raises(RequestError, match="causal: has no effect with head 'last'"):
        create("resnet", head="last", causal=True).settings.check()
    with pytest.raises(RequestError, match="window: 20 rows are fewer than the 21 that an output is made from"):
        create("resnet", window=20, causal=True).settings.check()
    assert create("resnet", window=21, causal=True).settings.outputs == 1


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"head": "last"}, "causal: has no effect with head 'last'"),
        ({"head": "flat"}, "causal: does not go with head 'flat', which sees the whole window"),
        ({"revin": True}, "causal: does not go with revin, whose statistics are those of the whole window"),
        ({"window": 50}, "window: 50 rows are fewer than the 51 that an output is made from"),
    ],
)
def test_a_causal_magtcn_sees_no_whole_window(settings, message):
    with pytest.raises(RequestError, match=message):
        create("magtcn", causal=True, **settings).settings.check()


def test_subnetworks_tell_what_each_of_them_makes():
    """Those of the aircraft add up to the estimate but for a constant, and those of the field are beside it."""
    recording = calibration(World())
    method = create("subnetworks", preset="paper", steps=2, every=1, folds=0).fit(recording)
    parts = method.parts(recording)
    assert [*parts] == ["Z1", "Z2", "Z3", "Z4", "Z5", "Z6"]
    rest = method.interference(recording) - parts["Z3"] - parts["Z4"] - parts["Z5"]
    assert np.isnan(rest[:2]).all()
    np.testing.assert_allclose(rest[2:], rest[2], atol=1e-4)
    assert min(np.std(parts[name][2:]) for name in ("Z1", "Z2", "Z6")) > 0.0
