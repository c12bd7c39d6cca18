"""The foreign world: each law against its own theorem or closed form, and what a recording of it must keep."""

import numpy as np
import pytest

from magsim import columns, load_scenario, signals, simulate
from magsim.compensation import create
from magsim.ladder.foreign import ForeignAircraft
from magsim.ladder.foreign.aircraft import _Fine, _hidden_loads
from magsim.ladder.foreign.laws import backlash, dipole, langevin, loop_current, low_pass, preisach, second_order

RATE = 100.0


def test_a_dipoles_field_on_its_axis_and_across_it():
    """2e-7 m / r^3 and 1e-7 m / r^3 T, in nT."""
    gains = dipole(np.array([[0.0, 0.0, 2.0], [3.0, 0.0, 0.0]]))
    moment = np.array([0.0, 0.0, 5.0])
    np.testing.assert_allclose(gains[0] @ moment, [0.0, 0.0, 200.0 * 5.0 / 8.0])
    np.testing.assert_allclose(gains[1] @ moment, [0.0, 0.0, -100.0 * 5.0 / 27.0])
    assert np.trace(gains[0]) == pytest.approx(0.0, abs=1e-12)


RNG = np.random.default_rng(4)
HALF = RNG.uniform(2_000.0, 20_000.0, 60)
CENTER = RNG.normal(0.0, 15_000.0, 60)
RELAYS = (CENTER + HALF, CENTER - HALF, np.full(60, 1.0 / 60.0))


def test_preisachs_relays_wipe_out_what_a_larger_swing_has_passed():
    """Mayergoyz's first theorem: after a maximum that exceeds them, earlier smaller extrema leave no trace."""
    fresh = np.array([0.0, 40_000.0, -10_000.0, 5_000.0])
    used = np.array([0.0, 8_000.0, -7_000.0, 12_000.0, 40_000.0, -10_000.0, 5_000.0])
    assert preisach(fresh, *RELAYS)[-1] == preisach(used, *RELAYS)[-1]


def test_preisachs_minor_loops_are_congruent():
    """His second: loops between the same two fields have the same height, wherever the steel comes from."""
    up = preisach(np.array([0.0, -80_000.0, 6_000.0, -6_000.0, 6_000.0]), *RELAYS)
    down = preisach(np.array([0.0, 80_000.0, -6_000.0, 6_000.0, -6_000.0, 6_000.0]), *RELAYS)
    assert up[3] != down[2]
    assert up[4] - up[3] == pytest.approx(down[5] - down[4])


def test_a_whole_loop_loses_what_its_relays_lose():
    """Each relay that is switched to and fro loses its weight times twice its width, 2 w (up - down)."""
    swing = 100_000.0 * np.sin(2.0 * np.pi * np.arange(40_001) / 20_000.0)
    given = preisach(swing, *RELAYS)
    second = slice(20_000, 40_001)
    area = np.trapezoid(swing[second], given[second])
    assert area == pytest.approx(np.sum(2.0 * RELAYS[2] * (RELAYS[0] - RELAYS[1])), rel=1e-3)


def test_langevins_ends():
    assert langevin(np.array([1e-6]))[0] == pytest.approx(1e-6 / 3.0)
    assert langevin(np.array([1e-3 - 1e-9]))[0] == pytest.approx(langevin(np.array([1e-3 + 1e-9]))[0], rel=1e-5)
    assert langevin(np.array([50.0]))[0] == pytest.approx(1.0 - 1.0 / 50.0)


@pytest.mark.parametrize("tau_s", [0.01, 0.1])
@pytest.mark.parametrize("frequency_hz", [0.2, 1.0])
def test_a_loop_is_a_high_pass_of_first_order(tau_s, frequency_hz):
    """Response to a sine: -i w tau / (1 + i w tau); it lags the rate by atan(w tau)."""
    t = np.arange(0.0, 40.0, 1.0 / RATE)
    omega = 2.0 * np.pi * frequency_hz
    found = loop_current(np.sin(omega * t), tau_s, RATE)
    expected = np.imag(-1j * omega * tau_s / (1.0 + 1j * omega * tau_s) * np.exp(1j * omega * t))
    np.testing.assert_allclose(found[-2000:], expected[-2000:], rtol=0, atol=5e-4)


def test_a_loop_on_a_ramp_settles_at_tau_times_its_rate():
    found = loop_current(3.0 * np.arange(0.0, 5.0, 1.0 / RATE), 0.1, RATE)
    assert found[-1] == pytest.approx(-0.3)
    assert found[10] == pytest.approx(-0.3 * (1.0 - np.exp(-1.0)))


def test_backlash_follows_behind_its_play():
    angle = np.array([0.0, 1.0, 3.0, 2.5, 1.5, 0.0, 0.4])
    np.testing.assert_allclose(backlash(angle, 1.0), [0.0, 0.5, 2.5, 2.5, 2.0, 0.5, 0.5])


def test_the_fluxgates_filter_is_of_second_order():
    """Butterworth: 1 / (1 + i sqrt(2) x - x^2), x the warped frequency over the corner: -3 dB, 90 degrees late at 1."""
    t = np.arange(0.0, 30.0, 1.0 / RATE)
    for frequency_hz in (0.2, 1.0, 3.0, 6.0):
        wave = np.exp(2j * np.pi * frequency_hz * t)
        found = second_order(np.stack([wave.real, wave.imag], axis=1), 3.0, RATE)[-1000:]
        x = np.tan(np.pi * frequency_hz / RATE) / np.tan(np.pi * 3.0 / RATE)
        expected = wave[-1000:] / (1.0 + 1j * np.sqrt(2.0) * x - x**2)
        np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], expected, rtol=0, atol=1e-9)


def test_the_rows_filter_has_no_delay():
    t = np.arange(0.0, 40.0, 1.0 / RATE)
    wave = np.sin(2.0 * np.pi * 0.5 * t)
    np.testing.assert_allclose(low_pass(wave, RATE, 3.5)[500:-500], wave[500:-500], rtol=0, atol=1e-4)
    assert np.std(low_pass(np.sin(2.0 * np.pi * 8.0 * t), RATE, 3.5)[500:-500]) < 2e-3


@pytest.fixture(scope="module")
def recording():
    settings = ["pattern.circuits=1", "pattern.leg_m=7000.0", "field.electronics.least_times_on=1"]
    return simulate(load_scenario("crew_c208b", settings))


@pytest.fixture(scope="module")
def aircraft():
    return ForeignAircraft.draw(np.random.default_rng(2))


@pytest.fixture(scope="module")
def flown(recording, aircraft):
    return aircraft.fly(recording, "cabin", np.random.default_rng(5))


def test_columns_add_up_as_in_every_recording(recording, flown):
    reading, label, clean = (flown[name] for name in ("mag_cabin_nt", "interference_cabin_nt", "clean_cabin_nt"))
    np.testing.assert_allclose(reading, flown["total_cabin_nt"] + flown["error_cabin_nt"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(flown["total_cabin_nt"] - clean, label, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(clean, recording["clean_cabin_nt"])
    np.testing.assert_array_equal(flown["error_cabin_nt"], recording["error_cabin_nt"])
    np.testing.assert_array_equal(flown["ins_roll_deg"], recording["ins_roll_deg"])
    kept = {columns.family_of(name).pattern for name in flown.data}
    assert not kept & {columns.PART.pattern, columns.PROJECTION.pattern, columns.TRUE_CURRENT.pattern}


def size_in_band(values):
    return float(np.std(signals.band_pass(values, 10.0)[300:-300]))


@pytest.fixture(scope="module")
def individuals(recording):
    return [
        ForeignAircraft.draw(np.random.default_rng(seed)).fly(recording, "cabin", np.random.default_rng(100 + seed))
        for seed in range(8)
    ]


def test_interference_is_of_the_size_of_ours(recording, individuals):
    own = size_in_band(recording["interference_cabin_nt"])
    ratios = np.array([size_in_band(one["interference_cabin_nt"]) for one in individuals]) / own
    assert 0.5 < np.exp(np.mean(np.log(ratios))) < 2.0
    assert ratios.min() > 0.25
    assert ratios.max() < 4.0


def left_by(method, recording):
    """Return what a method leaves in band of the rows that it has learned, labels without noise."""
    estimate = create(method).fit(recording.labeled(), sensor="cabin").interference(recording.blind())
    return size_in_band(recording["interference_cabin_nt"] - estimate)


def test_methods_leave_more_of_it_than_of_ours(recording, individuals):
    """Even of rows that they have learned: the exact norm knows our laws and comes near the noise there, not here."""
    floor = size_in_band(recording["error_cabin_nt"])
    ours = {method: left_by(method, recording) for method in ("tl16", "exact_norm")}
    assert ours["exact_norm"] < 5.0 * floor
    theirs = {method: np.array([left_by(method, one) for one in individuals[2:6]]) for method in ours}
    assert np.exp(np.mean(np.log(theirs["tl16"]))) > 1.5 * ours["tl16"]
    assert theirs["exact_norm"].min() > max(10.0 * ours["exact_norm"], 20.0 * floor)


def test_flights_share_the_aircraft_and_not_what_its_hidden_loads_do(recording, aircraft, flown):
    again = ForeignAircraft.draw(np.random.default_rng(2)).fly(recording, "cabin", np.random.default_rng(5))
    assert again == flown
    label = [flown["interference_cabin_nt"]]
    label.append(aircraft.fly(recording, "cabin", np.random.default_rng(6))["interference_cabin_nt"])
    other = ForeignAircraft.draw(np.random.default_rng(3)).fly(recording, "cabin", np.random.default_rng(5))
    apart = [size_in_band(one - label[0]) for one in (label[1], other["interference_cabin_nt"])]
    assert 0.0 < apart[0] < 0.2 * apart[1]


def test_three_tenths_of_the_loads_power_in_band_have_no_channel(recording):
    """Of the vector of the loads, on average of individuals: what currents explain, and the rest.

    What a load makes belongs to the aircraft, so the share is that of its wires and of what is switched on in a flight.
    """
    fine = _Fine(recording.time_s)
    hidden, half = _hidden_loads(fine.time_s, np.random.default_rng(5)), np.full(len(fine.time_s), 0.5)
    # with an even share the known part is a sum of the currents, which least squares finds
    currents = [fine(v) for name, v in recording.data.items() if columns.find(name) is columns.TRUE_CURRENT]

    basis = np.linalg.qr(signals.band_pass(np.stack(currents, axis=1), RATE))[0]
    shares = []
    for seed in range(12):
        aircraft = ForeignAircraft.draw(np.random.default_rng(seed))
        whole = aircraft._loads(recording, fine, "cabin", aircraft._hidden_size("cabin") * hidden, half)
        in_band = signals.band_pass(whole, RATE)
        left = in_band - basis @ (basis.T @ in_band)
        shares.append(np.var(left, axis=0).sum() / np.var(in_band, axis=0).sum())
    assert np.mean(shares) == pytest.approx(0.3, abs=0.06)
    assert min(shares) > 0.1
    assert max(shares) < 0.6
