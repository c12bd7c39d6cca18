"""A rope that pulls on the flight model: Newton's law for the pull, the bird in lock step, what the carrier does."""

import hashlib
import math
from collections.abc import Callable
from dataclasses import replace

import jsbsim
import numpy as np
import pytest

from magsim.aircraft import Aircraft, Bird, load_bird
from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.flight.model.aero import inertia
from magsim.flight.model.airframe import PULLS, airframe_xml, model_files
from magsim.flight.model.channels import CarrierState
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.start import start
from magsim.flight.tow import towing
from magsim.flight.tow.coupled import CoupledChain
from magsim.flight.tow.towing import tow_bird
from magsim.frames import rot_nb_from_attitude
from magsim.scenario import Gusts, Scenario
from magsim.trajectory import Flight
from magsim.units import FT, LBF

SETUP = PlantSetup(lat_rad=0.3, lon_rad=2.0, alt_m=3000.0, course=1.0, speed_mps=75.0)
SPEED_MPS, DENSITY = 55.0, 1.1116
"""Density of the standard atmosphere at 1000 m [kg/m^3]."""

CALM = {"speed_mps": 0.0}
LINE = {"kind": "straight", "leg_m": 600.0, "lead_s": 0.0}
ROLLS = {
    "kind": "straight",
    "leg_m": 1500.0,
    "lead_s": 4.0,
    "maneuvers": [{"axis": "roll", "amplitude_deg": 8.0, "period_s": 8.0, "cycles": 2, "rest_s": 0.0}],
}
WARMUP_S = 30.0

ScenarioOf = Callable[..., Scenario]


@pytest.fixture(scope="module")
def bird() -> Bird:
    return load_bird("bird")


@pytest.fixture(scope="module")
def slender(bird: Bird) -> Bird:
    """The bird without what turns it across the flow or is pressed there: it hangs as its rope pulls."""
    body = bird.facts.body
    none = {
        "volume": body.volume.model_copy(update={"value": 1e-6}),
        "cross_area": body.cross_area.model_copy(update={"value": 0.0}),
    }
    return replace(bird, facts=bird.facts.model_copy(update={"body": body.model_copy(update=none)}))


@pytest.fixture(scope="module")
def towed(scenario_of: ScenarioOf, cessna: Aircraft, bird: Bird) -> Callable[..., Flight]:
    """Fly a line with a bird that pulls and settles for 10 s, or with none that flies as long."""

    def go(tow: dict | None, pattern: dict = LINE, *, own: Bird | None = None, **tables: object) -> Flight:
        flight = {"warmup_s": WARMUP_S if tow is not None else WARMUP_S + 10.0} | tables.pop("flight", {})
        if tow is not None:
            tables["tow"] = {"coupling": "two_way", "settle_s": 10.0, "gusts": CALM} | tow
        place = {"lat_deg": 45.3, "lon_deg": -75.7, "alt_m": 1000.0, "speed_mps": SPEED_MPS}
        return fly(scenario_of(pattern, start=place, flight=flight, **tables), cessna, bird=own or bird)

    return go


@pytest.fixture(scope="module")
def untowed(towed: Callable[..., Flight]) -> Flight:
    return towed(None)


@pytest.fixture(scope="module")
def heavy(towed: Callable[..., Flight]) -> Flight:
    return towed({})


@pytest.fixture(scope="module")
def gusty(towed: Callable[..., Flight]) -> Flight:
    return towed({"gusts": {"speed_mps": 1.0}})


def test_the_flow_angle_uses_the_gusts_of_the_coupled_flight(
    towed: Callable[..., Flight], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn, used = {}, []
    gust, gusts_n = CoupledChain._gust, towing.gusts_n

    def draw(self: CoupledChain, time_s: float) -> np.ndarray:
        drawn[time_s] = gust(self, time_s)
        return drawn[time_s]

    def use(gusts: Gusts, time_s: np.ndarray, begun_s: float, *more: float) -> np.ndarray:
        used.append((time_s - begun_s, gusts_n(gusts, time_s, begun_s, *more)))
        return used[-1][1]

    monkeypatch.setattr(CoupledChain, "_gust", draw)
    monkeypatch.setattr(towing, "gusts_n", use)
    towed({"gusts": {"speed_mps": 1.0}})
    ((since, found),) = used
    times = np.array(sorted(drawn))
    # a new one in every step, from the beginning on; the log begins when the autopilot has settled
    np.testing.assert_allclose(np.diff(times), times[1], rtol=0, atol=1e-9)
    assert since[0] > WARMUP_S - 5.0
    there = np.column_stack([np.interp(since, times, [drawn[time][k] for time in times]) for k in range(3)])
    np.testing.assert_allclose(found, there, rtol=0, atol=0.01)
    assert found.std() > 0.3


# ---- the pull in the flight model ------------------------------------------------------------------------------

SPEEDING = tuple(f"accelerations/{axis}dot-ft_sec2" for axis in "uvw")
TURNING = tuple(f"accelerations/{axis}dot-rad_sec2" for axis in "pqr")


def pulled(cessna: Aircraft, hook_b: tuple[float, ...], force_n: tuple[float, ...]) -> jsbsim.FGFDMExec:
    """A flight model half a second after its start, one step after a force has set in."""
    fdm = start(cessna.facts, replace(SETUP, hook_b=hook_b))
    for _ in range(60):
        fdm.run()
    for (name, _), newton in zip(PULLS, force_n, strict=True):
        fdm[f"external_reactions/{name}/magnitude"] = newton / LBF
    fdm.run()
    return fdm


@pytest.mark.parametrize("force_n", [(0.0, 0.0, 445.0), (300.0, -200.0, 445.0)])
@pytest.mark.parametrize("hook_b", [(-0.4, 0.0, 0.95), (-3.0, 2.0, -0.5)])
def test_a_known_pull_accelerates_as_newton_says(
    cessna: Aircraft, hook_b: tuple[float, ...], force_n: tuple[float, ...]
) -> None:
    """F / m and J^-1 (r x F), r from the center of gravity to the hook; force along local axes."""
    free, bound = pulled(cessna, hook_b, (0.0, 0.0, 0.0)), pulled(cessna, hook_b, force_n)
    angles = np.array([[free[f"attitude/{name}-rad"] for name in ("phi", "theta", "psi")]])
    force_b = rot_nb_from_attitude(angles)[0].T @ np.array(force_n)
    speeding = FT * np.array([bound[name] - free[name] for name in SPEEDING])
    np.testing.assert_allclose(speeding, force_b / cessna.facts.mass_kg, rtol=0, atol=1e-8)
    moments = inertia(cessna.facts)
    tensor = np.array([[moments.xx, 0.0, -moments.xz], [0.0, moments.yy, 0.0], [-moments.xz, 0.0, moments.zz]])
    moment_b = np.cross(np.array(hook_b) - cessna.facts.cg_b, force_b)
    turning = np.array([bound[name] - free[name] for name in TURNING])
    np.testing.assert_allclose(turning, np.linalg.solve(tensor, moment_b), rtol=0, atol=1e-8)


class Pull:
    """Pulls with a constant force and keeps the states."""

    def __init__(self, force_n: tuple[float, float, float]) -> None:
        self.force_n, self.states = force_n, []

    def begin(self, state: CarrierState) -> None:
        self.states.append(state)

    def step(self, state: CarrierState) -> tuple[float, float, float]:
        self.states.append(state)
        return self.force_n


def test_the_plant_passes_the_pull_on_step_by_step(cessna: Aircraft) -> None:
    free, bound = Pull((0.0, 0.0, 0.0)), Pull((-150.0, 0.0, 445.0))
    plants = [Plant(cessna.facts, replace(SETUP, hook_b=(-0.4, 0.0, 0.95)), pull) for pull in (free, bound)]
    bare = Plant(cessna.facts, SETUP)
    for plant in (*plants, bare):
        plant.run(3)
    assert [len(pull.states) for pull in (free, bound)] == [4, 4]
    # A force of nothing changes nothing.
    np.testing.assert_allclose(plants[0].row, bare.row, rtol=1e-12, atol=1e-12)
    last = bound.states[-1]
    for name in CarrierState._fields:
        assert getattr(last, name) == pytest.approx(plants[1].value(name), rel=1e-12, abs=1e-15)
    # What is found at the end of a step acts in the next one, whose motion is that of the one after it: in three steps
    # the pull has set in, which Adams and Bashforth count as one and a half steps.
    for name, newton in (("v_north", -150.0), ("v_down", 445.0)):
        change = plants[1].value(name) - plants[0].value(name)
        assert change == pytest.approx(1.5 / 120.0 * newton / cessna.facts.mass_kg, rel=1e-5)


def test_without_a_rope_the_model_has_none(cessna: Aircraft) -> None:
    """The airframe of a tow is that of any flight, and one element more."""
    bare, roped = (airframe_xml(cessna.facts, "a", hook) for hook in (None, (-0.4, 0.0, 0.95)))
    before, rest = roped.split(" <external_reactions>\n")
    inside, after = rest.split(" </external_reactions>\n")
    assert before + after == bare
    assert inside.count("<force ") == 3
    assert not any("external" in text or "tow" in text for text in model_files(cessna.facts, "a").values())


# ---- bird and carrier together ---------------------------------------------------------------------------------


def apart_m(first: Flight, second: Flight, time_s: np.ndarray) -> np.ndarray:
    paths = [flight.bird.at(time_s) for flight in (first, second)]
    one, other = (ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m) for path in paths)
    return np.linalg.norm(one - other, axis=1)


@pytest.mark.parametrize("hook_m", [None, (-3.0, 1.0, 0.5)])
def test_the_bird_in_lock_step_swings_as_under_the_finished_flight(
    towed: Callable[..., Flight],
    scenario_of: ScenarioOf,
    cessna: Aircraft,
    bird: Bird,
    hook_m: tuple[float, ...] | None,
) -> None:
    """The same carrier's path, in a cubic spline through its rows, and the equations stepped after the fact."""
    given = {} if hook_m is None else {"hook_m": hook_m}
    both = towed(given, ROLLS)
    tow = given | {"settle_s": 0.0, "gusts": CALM}
    place = {"lat_deg": 45.3, "lon_deg": -75.7, "alt_m": 1000.0, "speed_mps": SPEED_MPS}
    after = tow_bird(replace(both, bird=None, rope={}), scenario_of(ROLLS, start=place, tow=tow), cessna, bird)
    # It begins in its equilibrium 4 s before the first row, when the other has swung in: that difference dies away.
    time = np.arange(4.0, both.duration_s + 3.0, 0.1)
    assert apart_m(both, after, time).max() < 0.01
    turned = both.bird.at(time).attitude - after.bird.at(time).attitude
    assert np.degrees(np.abs(turned)).max() < 0.02
    assert np.degrees(np.ptp(both.bird.at(time).attitude[:, 0])) > 15.0
    tensions = [flight.rope_at(time)["tension_n"] for flight in (both, after)]
    assert np.abs(tensions[0] - tensions[1]).max() < 0.01 * np.mean(tensions[0])
    for name in ("trail_rad", "side_rad"):
        np.testing.assert_allclose(both.rope_at(time)[name], after.rope_at(time)[name], rtol=0, atol=5e-4)


def test_the_pull_is_what_hangs_on_it(towed: Callable[..., Flight], slender: Bird) -> None:
    """Weight of bird and rope, and the bird's drag along its axis, which is pitched as its rope pulls."""
    flight = towed({"rope": {"diameter_m": 1e-4}, "body": {"fin_area_m2": 2e-4}}, own=slender)
    pitch = flight.bird.attitude[:, 1].mean()
    drag = 0.5 * DENSITY * SPEED_MPS**2 * 0.06 * math.cos(pitch)
    weight = (80.0 + 0.12 * (30.0 - 1.5)) * 9.803  # the upper half of the first link hangs on the hook itself
    expected = math.hypot(weight + drag * math.sin(pitch), drag * math.cos(pitch))
    assert flight.rope["tension_n"].mean() == pytest.approx(expected, rel=2e-3)
    assert np.ptp(flight.rope["tension_n"]) < 1.0
    assert flight.notes["tow"]["coupling"] == "two_way"


def test_the_carrier_holds_the_bird_up(heavy: Flight, untowed: Flight) -> None:
    """740 N at 27 degrees aft: more lift by 2 % of the weight and more thrust; nothing else."""
    rows = slice(0, 300)
    pitch = math.degrees(heavy.carrier.attitude[rows, 1].mean() - untowed.carrier.attitude[rows, 1].mean())
    down = heavy.rope["tension_n"].mean() * math.cos(heavy.rope["trail_rad"].mean())
    # Lift slope of the whole aircraft about 5 on its 26 m^2.
    lifted = math.degrees(down / (0.5 * DENSITY * SPEED_MPS**2 * 26.0 * 5.0))
    assert pitch == pytest.approx(lifted, rel=0.35)
    throttle = heavy.switches["throttle"][rows].mean() - untowed.switches["throttle"][rows].mean()
    assert 0.02 < throttle < 0.15
    np.testing.assert_allclose(heavy.carrier.alt_m[rows], 1000.0, rtol=0, atol=0.5)
    assert np.abs(heavy.carrier.attitude[rows, 0] - untowed.carrier.attitude[rows, 0]).max() < math.radians(0.05)


def test_a_feather_has_no_effect(towed: Callable[..., Flight], slender: Bird, heavy: Flight, untowed: Flight) -> None:
    """Half a kilogram on a thread: all of its effect is that of the bird, in the ratio of the pulls."""
    rope = {"length_m": 10.0, "diameter_m": 1e-4, "mass_kgpm": 5e-3, "links": 2}
    body = {"mass_kg": 0.5, "drag_area_m2": 1e-4, "fin_area_m2": 1e-3}
    light = towed({"rope": rope, "body": body}, own=slender)
    assert 4.0 < light.rope["tension_n"].mean() < 6.0
    rows = slice(0, min(len(flight.carrier) for flight in (light, heavy, untowed)))
    for name, limit in (("attitude", math.radians(0.003)), ("velocity_n", 5e-4), ("alt_m", 5e-3)):
        free, thread, cable = (getattr(flight.carrier, name)[rows] for flight in (untowed, light, heavy))
        assert np.abs(thread - free).max() < limit
        assert np.abs(cable - free).max() > 10.0 * limit


def test_gusts_at_the_bird_do_not_depend_on_the_step(towed: Callable[..., Flight], gusty: Flight) -> None:
    other = towed({"gusts": {"speed_mps": 1.0}}, flight={"step_hz": 60})
    time = np.arange(-3.0, gusty.duration_s, 0.25)
    hangs = []
    for flight in (gusty, other):
        above, below = flight.carrier.at(time), flight.bird.at(time)
        places = [ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m) for path in (above, below)]
        hangs.append(np.einsum("nij,nj->ni", rot_ne_at(above.lat_rad, above.lon_rad), places[1] - places[0]))
    assert np.ptp(hangs[0], axis=0).max() > 1.0
    np.testing.assert_allclose(hangs[0], hangs[1], rtol=0, atol=0.01)


def test_the_same_tow_has_the_same_bits(towed: Callable[..., Flight], gusty: Flight, heavy: Flight) -> None:
    def digest(flight: Flight) -> str:
        arrays = [
            getattr(path, name)
            for path in (flight.carrier, flight.bird)
            for name in ("time_s", "lat_rad", "lon_rad", "alt_m", "velocity_n", "attitude", "rate_b")
        ]
        return hashlib.sha256(b"".join(a.tobytes() for a in [*arrays, *flight.rope.values()])).hexdigest()

    assert digest(towed({"gusts": {"speed_mps": 1.0}})) == digest(gusty)
    assert digest(heavy) != digest(gusty)


# ---- messages -----------------------------------------------------------------------------------------------------


def test_steps_that_are_too_few_for_the_rope_are_reported(towed: Callable[..., Flight], slender: Bird) -> None:
    thread = {"length_m": 10.0, "diameter_m": 1e-4, "mass_kgpm": 1e-3}
    body = {"mass_kg": 3.1, "drag_area_m2": 1e-4, "fin_area_m2": 1e-3}
    with pytest.raises(
        RequestError,
        match=r"^flight\.step_hz: 120 steps a second bear 29 N in a rope of 10 links, but it took 29 N; allowed",
    ):
        towed({"rope": thread, "body": body}, own=slender)
    with pytest.raises(
        DataError,
        match=r"^the flight lost the motion of its bird \(allowed: a larger flight\.step_hz, fewer links, a heavier "
        r"rope\) at t = -(39|40)\.\d s: height 1000 m",
    ):
        towed({"rope": {"mass_kgpm": 1e-3}})


def test_a_bird_that_is_too_light_is_reported_before_the_flight(towed: Callable[..., Flight]) -> None:
    with pytest.raises(
        RequestError,
        match=r"^tow\.body\.mass_kg: 2 kg are too light for their drag and that of the rope: at 55 m/s the bird trails "
        r"\d+ deg behind the hook; allowed: up to 70 deg, that is at least \d\.?\d? kg, or up to \d\d\.\d m/s, or "
        r"a shorter or thinner rope$",
    ):
        towed({"body": {"mass_kg": 2.0}})


def test_a_bird_must_be_given(scenario_of: ScenarioOf, cessna: Aircraft) -> None:
    with pytest.raises(RequestError, match=r"^tow\.bird: bird is read by load_scenario only$"):
        fly(scenario_of(LINE, start={"speed_mps": SPEED_MPS}, tow={}), cessna)
