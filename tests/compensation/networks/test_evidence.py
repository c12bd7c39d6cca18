"""How much of a network to use, from rows that it has not learned."""

import numpy as np
import pytest

from magsim.compensation.networks.evidence import Unit, share_of


def units(share, noise, count=12, rows=200, seed=0):
    """Runs in which a share of the output holds."""
    random = np.random.default_rng(seed)
    outputs = random.standard_normal((count, rows))
    rests = share * outputs + noise * random.standard_normal((count, rows))
    return [Unit(rest, output) for rest, output in zip(rests, outputs, strict=True)]


def test_the_share_is_that_of_least_squares_where_it_is_certain():
    found = units(0.7, 1e-3)
    rest, output = (np.concatenate(parts) for parts in zip(*found, strict=True))
    assert share_of(found) == pytest.approx(np.linalg.lstsq(output[:, None], rest, rcond=None)[0][0], rel=1e-4)
    assert share_of(units(1.0, 0.0)) == pytest.approx(1.0)
    assert share_of(units(1.6, 0.0)) == 1.0


def test_output_that_holds_nothing_gets_no_share():
    """The share of pure noise is 0 with a mean error of some hundredths: nearly always nothing is left of it."""
    found = [share_of(units(0.0, 1.0, seed=seed)) for seed in range(200)]
    assert np.mean(np.array(found) == 0.0) > 0.8
    assert max(found) < 0.08
    assert share_of(units(-0.5, 0.1)) == 0.0
    assert share_of([Unit(np.ones(5), np.zeros(5))] * 4) == 0.0


def test_a_share_that_one_leg_alone_supports_is_shrunk():
    """By hand: shares without each leg 0, 0.9/3, 0.9/3, 0.9/3 of equal squares; variance 3/4 * sum of squares."""
    ones = np.ones(10)
    found = [Unit(0.9 * ones, ones), Unit(0.0 * ones, ones), Unit(0.0 * ones, ones), Unit(0.0 * ones, ones)]
    without = np.array([0.0, 0.3, 0.3, 0.3])
    variance = 0.75 * np.sum((without - without.mean()) ** 2)
    expected = 0.225 * max(0.0, 1.0 - variance / 0.225**2)
    assert share_of(found) == pytest.approx(expected, abs=1e-12)
    even = [Unit(0.225 * ones, ones)] * 4
    assert share_of(even) == pytest.approx(0.225)


def test_one_run_is_no_evidence():
    assert share_of(units(1.0, 0.0, count=1)) == 0.0
