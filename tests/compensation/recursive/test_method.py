"""The recursive method: tl16 where it does not follow, better for another aircraft; what is signal stays."""

import numpy as np
import pytest

from magsim import signals
from magsim.benchmark.twins import PEAKS_NT, twin_of
from magsim.compensation import create
from magsim.errors import RequestError
from tests.support.worlds import INDUCED, PERMANENT_NT, World, calibration

OTHER = World(permanent_nt=tuple(1.3 * PERMANENT_NT), induced=tuple(map(tuple, 0.8 * INDUCED)), gradient=False)


@pytest.fixture(scope="module")
def recording():
    return calibration(World(gradient=False))


@pytest.fixture(scope="module")
def method(recording):
    return create("tl16_recursive").fit(recording)


@pytest.fixture(scope="module")
def other():
    """Another individual of the type: the first circuit is flown to be learned, the second is judged."""
    return calibration(OTHER, seed=1)


def left_nt(recording, estimate):
    """Deviation in band of what is left on the second circuit."""
    error = recording["interference_cabin_nt"] - estimate
    return signals.in_band(error, recording.time_s, recording.mask(split="test")).std()


def test_without_following_it_is_tl16(recording, other):
    fixed = create("tl16_recursive", adapt=False).fit(recording)
    plain = create("tl16").fit(recording)
    assert fixed.requires == plain.requires
    np.testing.assert_array_equal(fixed.interference(other), plain.interference(other))
    assert create("tl16_recursive").requires == (*plain.requires, "mag_{sensor}_nt")


def test_it_follows_another_aircraft(recording, method, other):
    plain = create("tl16").fit(recording)
    assert left_nt(other, method.interference(other)) < 0.35 * left_nt(other, plain.interference(other))


def test_it_does_no_harm_to_its_own(recording, method):
    rows = recording.where(split="test")
    plain = create("tl16").fit(recording)
    assert left_nt(rows, method.interference(rows)) < 1.1 * left_nt(rows, plain.interference(rows))


@pytest.mark.parametrize("peak_nt", PEAKS_NT)
@pytest.mark.parametrize("whose", ["own", "other"])
def test_anomalies_are_left(whose, peak_nt, recording, method, other):
    """Robust weights spare what is large; what is small is followed, most of all on an aircraft far from the fit."""
    allowed = 0.1 if whose == "other" and peak_nt < 20.0 else 0.05
    rows = recording.where(split="test") if whose == "own" else other
    twin = twin_of(rows, "cabin", np.random.default_rng(1), peak_nt)
    change = method.compensate(twin.recording) - method.compensate(rows)
    wanted = signals.in_band(twin.injected, rows.time_s)
    gain = signals.in_band(change, rows.time_s) @ wanted / (wanted @ wanted)
    assert gain == pytest.approx(1.0, abs=allowed)


def test_shares_are_of_the_coefficients_of_each_row(method, other):
    shares = method.shares(other)
    np.testing.assert_allclose(sum(shares.values()), method.interference(other), rtol=0.0, atol=1e-9)


def test_calls_do_not_know_of_each_other(method, other):
    first = method.interference(other)
    method.interference(other.take(slice(0, 1000)))
    np.testing.assert_array_equal(method.interference(other), first)


def test_settings_are_checked():
    for wrong in ({"forgetting_s": 0.0}, {"anchor_s": -1.0}, {"target": "maps"}, {"terms": 16}):
        with pytest.raises(RequestError, match=next(iter(wrong))):
            create("tl16_recursive", **wrong)
