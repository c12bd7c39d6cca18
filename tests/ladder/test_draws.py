"""What sets draw, against the reference model of the field and the sphere."""

import hashlib
from datetime import UTC, datetime

import numpy as np
import ppigrf
import pytest

from magsim.config import toml
from magsim.ladder.definition import read_ladder
from magsim.ladder.draws import INCLINATIONS_DEG, LINE_M, draw_set
from magsim.ladder.foreign import ForeignAircraft
from magsim.ladder.seeds import PUBLIC_SEED
from magsim.streams import stream

V1 = "51b3caac7effbfb359974f50cda0eef564ca0a38fc4b47aa816185a6c9034374"
"""SHA-256 of what the first thirty public sets of ladder v1 draw."""

FOREIGN = "bcb542caf4c5e7b6e1c731ec0346d5337a788997e9c2cb5ba39bf072add4084a"
"""SHA-256 of the foreign aircraft of the first three, to six digits."""


@pytest.fixture(scope="module")
def draws():
    return [draw_set(5, number) for number in range(24)]


def inclination_deg(site, when):
    east, north, up = (float(np.squeeze(one)) for one in ppigrf.igrf(site.lon_deg, site.lat_deg, 3.0, when))
    return abs(np.degrees(np.arctan2(-up, np.hypot(east, north))))


def test_sites_are_of_all_classes_of_inclination(draws):
    for number, drawn in enumerate(draws):
        when = datetime.fromisoformat(drawn.words["time_train_1"]).astimezone(UTC).replace(tzinfo=None)
        low, high = INCLINATIONS_DEG[number % 4]
        # 0.2 degrees for the day of the year and rounded places
        assert low - 0.2 <= inclination_deg(drawn.site, when) <= high + 0.2
        other = inclination_deg(drawn.elsewhere, when)
        assert not low + 0.2 <= other <= high - 0.2
    assert {np.sign(drawn.site.lat_deg) for drawn in draws} == {-1.0, 1.0}


def test_the_near_place_is_300_km_away(draws):
    for drawn in draws:
        a, b = (np.radians([site.lat_deg, site.lon_deg]) for site in (drawn.site, drawn.near))
        units = [np.array([np.cos(p[0]) * np.cos(p[1]), np.cos(p[0]) * np.sin(p[1]), np.sin(p[0])]) for p in (a, b)]
        assert 6371.0 * np.arccos(units[0] @ units[1]) == pytest.approx(300.0, abs=0.1)


def test_a_set_is_a_function_of_seed_and_number(draws):
    assert draw_set(5, 3) == draws[3]
    assert draw_set(6, 3).words != draws[3].words
    assert len({drawn.individual for drawn in draws} | {drawn.other for drawn in draws}) == 48


def test_half_widths_are_log_uniform():
    logs = np.log([draw_set(1, number).half_widths_nt for number in range(200)]).ravel()
    assert logs.min() >= np.log(500.0)
    assert logs.max() <= np.log(20_000.0)
    assert logs.mean() == pytest.approx((np.log(500.0) + np.log(20_000.0)) / 2.0, abs=0.15)


def test_test_flights_have_other_headings_than_training_flights(draws):
    for drawn in draws:
        first, second, test = (float(drawn.words[f"heading_{name}"]) for name in ("train_1", "train_2", "circuit"))
        # courses of a square repeat after 90 degrees
        for other in (second, test):
            assert min((first - other) % 90.0, (other - first) % 90.0) >= 19.8 or 19.8 <= (other - first) % 90.0 <= 70.2


def test_bodies_are_beside_the_line_and_of_the_peaks_that_are_said(draws):
    for drawn in draws:
        course = np.radians(float(drawn.words["heading_targets"]))
        bodies = toml.value_of(drawn.words["bodies"])
        assert len(bodies) == 8
        for body in bodies:
            along = body["north_m"] * np.cos(course) + body["east_m"] * np.sin(course)
            across = -body["north_m"] * np.sin(course) + body["east_m"] * np.cos(course)
            assert 0.0 < along < LINE_M
            # a tenth of a degree of the course, which is rounded, is 40 m at the end
            assert abs(across) < 130.0
            peak = 2e-7 * np.linalg.norm(body["moment_am2"]) / (150.0 + body["depth_m"]) ** 3 * 1e9
            assert 0.99 < peak < 50.5


def test_every_word_of_the_ladder_is_drawn_and_none_in_vain(draws):
    ladder = read_ladder()
    texts = [text for flight in ladder.flights.values() for text in flight.set]
    texts += [text for level in ladder.levels.values() for text in level.set]
    texts += [text for level in ladder.levels.values() for own in level.flights.values() for text in own]
    from string import Formatter

    used = {field for text in texts for _, field, _, _ in Formatter().parse(text) if field}
    assert used == set(draws[0].words)


def test_sets_of_the_public_seed_never_change():
    """Scores name the ladder alone, so what its sets draw is as frozen as its files."""
    text = "\n".join(f"{draw_set(PUBLIC_SEED, number)}" for number in range(30))
    assert hashlib.sha256(text.encode()).hexdigest() == V1


def test_foreign_individuals_of_the_public_seed_never_change():
    parts = []
    for number in range(3):
        aircraft = ForeignAircraft.draw(stream(PUBLIC_SEED, f"ladder/foreign/{number}"))
        for part in (aircraft.metal, aircraft.fluxgate):
            parts += [value for name in part.__dataclass_fields__ for value in np.ravel(getattr(part, name))]
    text = " ".join(f"{value:.6g}" for value in parts)
    assert hashlib.sha256(text.encode()).hexdigest() == FOREIGN
