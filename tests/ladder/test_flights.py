"""Flights of a set: what a level says is in them, and what they share is the same."""

import numpy as np
import pytest

from magsim import columns
from magsim.dataset import training_rows
from magsim.ladder.definition import Ladder, SetFlight, read_ladder
from magsim.ladder.flights import fly_set, kept, with_half_widths
from magsim.ladder.tracks import TRACKS, blind_of, chosen_tracks, judged_flights, training_of
from magsim.loading import load_scenario

SEED = 7


@pytest.fixture(scope="module")
def ladder():
    """One training flight, and a short line as the test."""
    whole = read_ladder()
    line = "pattern={{kind='straight', leg_m=6000.0}}"
    flights = {
        "train_1": whole.flights["train_1"],
        "line": SetFlight(
            set=(line, "recording={{rate_hz=10, split='test'}}", "start.heading_deg={heading_line}"), test=True
        ),
    }
    return Ladder(whole.name, whole.title, flights, whole.levels, whole.quick, whole.networks, whole.texts)


@pytest.fixture(scope="module")
def flown(ladder):
    levels = ladder.chosen(("L0", "L0c", "L4", "L9_10", "L10b2"))
    return fly_set(ladder, levels, SEED, 3, later=True)


def test_levels_are_seen_from_one_flight(flown):
    attitude = [flown[name].tests["line"]["ins_roll_deg"] for name in ("L0", "L4")]
    # another noise of the INS, the same flight
    assert 0.0 < np.abs(attitude[0] - attitude[1]).max() < 0.1
    assert np.std(attitude[0]) > 0.2
    clean = [flown[name].tests["line"]["clean_cabin_nt"] for name in ("L0", "L4")]
    np.testing.assert_array_equal(*clean)
    label = [flown[name].tests["line"]["interference_cabin_nt"] for name in ("L0", "L4")]
    assert np.abs(label[0] - label[1]).max() > 1.0
    assert columns.CURRENT.name(feeder="avionics") in flown["L4"].tests["line"]
    assert columns.CURRENT.name(feeder="avionics") not in flown["L0"].tests["line"]


def test_a_fluxgate_in_one_place_with_the_scalar_sensor_has_its_length(flown):
    def off(name):
        recording = flown[name].tests["line"]
        length = np.linalg.norm(recording.vector(columns.FLUX, sensor="flux"), axis=1)
        return np.std(length - recording["mag_cabin_nt"])

    # the fluxgate's noise, and that of a place elsewhere
    assert off("L0c") < 0.2
    assert off("L0") > 0.3


def test_another_day_and_another_individual_change_the_tests_alone(flown):
    def first(name, place="training"):
        flights = getattr(flown[name], place)
        return flights[0] if place == "training" else flights["line"]

    for name in ("L9_10", "L10b2"):
        day = {place: first(name, place).meta["day"] for place in ("training", "tests")}
        individual = {place: first(name, place).meta["individual"] for place in ("training", "tests")}
        assert (day["tests"] - day["training"]) == (10 if name == "L9_10" else 0)
        assert (individual["tests"] == individual["training"]) == (name == "L9_10")
    update = flown["L10b2"].training[-1]
    assert update.meta["individual"] == first("L10b2", "tests").meta["individual"]
    assert update.time_s[-1] - update.time_s[0] == pytest.approx(120.0, abs=0.11)
    assert len(flown["L10b2"].training) == 2
    later = flown["L0"].later["line"]
    assert later.meta["day"] - flown["L0"].tests["line"].meta["day"] == 10


def test_nothing_but_what_judging_needs_is_kept(flown):
    roles = {columns.role_of(name) for name in flown["L4"].tests["line"].data}
    assert roles == {"input", "label", "segment", "truth"}
    truth = [name for name in flown["L4"].tests["line"].data if columns.role_of(name) == "truth"]
    assert truth == ["clean_cabin_nt", "clean_stinger_nt"]
    assert kept(flown["L0"].tests["line"]) == flown["L0"].tests["line"]


def test_the_same_set_is_the_same_whatever_else_is_seen(ladder, flown):
    alone = fly_set(ladder, ladder.chosen(("L4",)), SEED, 3)
    assert alone["L4"].tests["line"] == flown["L4"].tests["line"]
    other = fly_set(ladder, ladder.chosen(("L4",)), SEED, 4)
    assert other["L4"].tests["line"] != flown["L4"].tests["line"]


def test_half_widths_are_those_of_the_aircraft_that_is_flown():
    loaded = load_scenario("calibration_c208b", ["individual=3"])
    changed = with_half_widths(loaded, (700.0, 900.0, 5000.0))
    assert changed.aircraft.magnetics.memory.radii_nt == (700.0, 900.0, 5000.0)
    assert changed.aircraft.magnetics.memory.weights == loaded.aircraft.magnetics.memory.weights
    assert changed.digest != loaded.digest


def test_a_track_gives_what_it_says_and_no_other_magnetometer(flown):
    flights = flown["L4"]
    families = {}
    for name, track in TRACKS.items():
        seen = training_of(track, flights, "cabin")
        assert len(seen) == 1
        has = {columns.family_of(column).pattern for column in seen[0].data}
        families[name] = has
        assert "mag_stinger_nt" not in seen[0].data
        assert "clean_cabin_nt" not in seen[0].data
        assert (columns.INTERFERENCE.pattern in has) == (track.label != "none")
        blind = blind_of(track, judged_flights(track, flights)["line"], "cabin")
        assert {columns.role_of(column) for column in blind.data} == {"input"}
        assert "mag_stinger_nt" not in blind.data
    assert families["classic"] < families["closed"] < families["open"]
    assert families["open"] - families["no-labels"] == {columns.INTERFERENCE.pattern}
    assert columns.INS_ATTITUDE.pattern not in families["classic"]
    assert columns.CURRENT.pattern not in families["closed"]
    assert judged_flights(TRACKS["frozen"], flights)["line"].meta["day"] != flights.training[0].meta["day"]


def test_the_label_of_the_reference_track_is_the_stingers(flown):
    flights = flown["L4"]
    (truth,), (reference,) = (training_of(TRACKS[name], flights, "cabin") for name in ("open", "reference"))
    off = reference["interference_cabin_nt"] - truth["interference_cabin_nt"]
    whole = flights.training[0]
    stinger = whole["interference_stinger_nt"]
    # the label's error is that of the stinger: the field between the places, what is left of its interference, noise
    left = off - (whole["clean_cabin_nt"] - whole["clean_stinger_nt"])
    assert 0.0 < np.std(left) < 2.0 * np.std(stinger)
    assert training_of(TRACKS["reference"], flights, "stinger") is None
    assert training_rows([reference], "cabin").sensor == "cabin"


def test_tracks_come_in_the_boards_order():
    assert list(TRACKS)[:2] == ["no-labels", "frozen"]
    assert [track.name for track in chosen_tracks(("open", "no-labels"))] == ["no-labels", "open"]
