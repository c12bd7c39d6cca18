"""Gates: limits by hand, set by set."""

import pytest

from magsim.benchmark.gates import gate_failures

GOOD = {"gain_0.1": 1.0, "gain_1": 0.99, "gain_20": 1.01, "distortion": 0.05, "slow_nt": 0.9}


def test_what_keeps_to_the_limits_passes():
    assert gate_failures([GOOD, GOOD], [GOOD, GOOD]) == ()
    assert gate_failures([GOOD], []) == ()


@pytest.mark.parametrize(
    ("changed", "adaptive", "failures"),
    [
        ({"gain_0.1": 0.979}, False, ("gain 0.979 at 0.1 nT",)),
        ({"gain_0.1": 0.979}, True, ()),
        ({"gain_20": 1.06, "gain_1": 0.0}, True, ("gain 0.000 at 1 nT", "gain 1.060 at 20 nT")),
        ({"distortion": 0.1}, False, ("distortion 0.1",)),
        ({"slow_nt": 1.01}, False, ("slow error 1.01 nT, allowed 1",)),
        # a flight without anomalies of a height says nothing of it
        ({"gain_1": float("nan")}, False, ()),
    ],
)
def test_each_gate_is_named_with_its_value(changed, adaptive, failures):
    assert gate_failures([{**GOOD, **changed}], [], adaptive=adaptive) == failures


def test_one_set_is_enough_to_fail():
    """What a method takes on one set is not made up for by what it adds on another."""
    sets = [{**GOOD, "gain_1": 0.9}, {**GOOD, "gain_1": 1.09}, GOOD, GOOD]
    assert gate_failures(sets, []) == ("gain 0.900 at 1 nT",)


def test_slow_error_is_held_against_the_baseline():
    slow = {**GOOD, "slow_nt": 4.4}
    assert gate_failures([slow], [{"slow_nt": 3.0}]) == ()
    assert gate_failures([slow], [{"slow_nt": 2.9}]) == ("slow error 4.4 nT, allowed 4.35",)
