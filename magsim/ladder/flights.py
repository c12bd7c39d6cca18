"""The flights of a set on every level: flown once, seen in many worlds, held in memory alone.

Nothing of a set is written to a disk while methods are judged on it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from magsim import columns
from magsim.ladder.definition import HERE, LADDER, Ladder, Level, SetFlight
from magsim.ladder.draws import SetDraw, draw_set
from magsim.ladder.foreign import ForeignAircraft
from magsim.loading import LoadedScenario, load_scenario
from magsim.recording import Recording
from magsim.simulation import Simulator
from magsim.streams import integer_seed, stream

LATER_DAYS = 10
"""Days from a calibration to the flights of the track ``frozen``, on levels that do not say."""


@dataclass(frozen=True)
class LevelFlights:
    """The flights of one set on one level.

    Attributes
    ----------
    level : Level
    training : tuple of Recording
    tests : mapping
        By role.
    later : mapping
        The tests on another day, by role; empty where they were not asked for.
    """

    level: Level
    training: tuple[Recording, ...]
    tests: Mapping[str, Recording]
    later: Mapping[str, Recording]


@dataclass(frozen=True)
class _Order:
    """One recording that is to be made."""

    level: Level
    role: str
    flight: SetFlight
    place: str  # "training", "tests" or "later"
    settings: tuple[str, ...]
    flown: tuple[str, ...]  # the settings without those of the level: flights that are alike come one after another


def fly_set(
    ladder: Ladder,
    levels: Sequence[Level],
    seed: int,
    number: int,
    *,
    later: bool = False,
    report: Callable[[str], None] = lambda _line: None,
) -> dict[str, LevelFlights]:
    """Fly a set and see it on levels.

    Parameters
    ----------
    ladder : Ladder
    levels : sequence of Level
    seed, number : int
        Of the ladder, and of the set.
    later : bool
        Fly the tests on another day too.
    report : callable
        Called with the name of each flight.

    Returns
    -------
    dict of str to LevelFlights
    """
    drawn, simulator = draw_set(seed, number), Simulator()
    orders = sorted(
        (order for level in levels for order in _orders(ladder, level, drawn, seed, later=later)),
        key=lambda order: (order.role, order.level.scenario, order.flown),
    )
    made: dict[str, dict[str, dict[str, Recording]]] = {
        level.name: {"training": {}, "tests": {}, "later": {}} for level in levels
    }
    for order in orders:
        report(f"{order.role} on {order.level.name}")
        made[order.level.name][order.place][order.role] = _flown(order, drawn, simulator, seed)
    roles = list(ladder.flights)
    return {
        level.name: LevelFlights(
            level,
            tuple(recording for _, recording in sorted(made[level.name]["training"].items())),
            *(
                {role: made[level.name][place][role] for role in roles if role in made[level.name][place]}
                for place in ("tests", "later")
            ),
        )
        for level in levels
    }


def _orders(ladder: Ladder, level: Level, drawn: SetDraw, seed: int, *, later: bool) -> Iterator[_Order]:
    training = [role for role, flight in ladder.flights.items() if not flight.test][: level.boxes]
    for role, flight in ladder.flights.items():
        if not flight.test and role not in training:
            continue
        yield _order(level, role, flight, "tests" if flight.test else "training", drawn, seed)
        if flight.test and later:
            yield _order(level, role, flight, "later", drawn, seed)
    if level.updated_s:
        # another circuit of the individual that is tested, of which the first minutes are learned
        first = ladder.flights["train_1"]
        yield _order(level, "update", first, "training", drawn, seed, tested=True)


def _order(  # noqa: PLR0917 - what a recording is made of
    level: Level, role: str, flight: SetFlight, place: str, drawn: SetDraw, seed: int, *, tested: bool | None = None
) -> _Order:
    """Return the settings of one recording; ``tested`` where it is of the tests' individual."""
    tested = flight.test if tested is None else tested
    own = level.individual == "other" or (level.individual == "transferred" and tested)
    site = drawn.site
    if flight.test and level.site:
        site = drawn.elsewhere if level.site == "elsewhere" else drawn.near
    days = level.days_later if flight.test else 0
    if place == "later":
        days = level.days_later or LATER_DAYS
    further = level.flights.get(role, ())
    flown = (
        f"start.lat_deg={site.lat_deg}",
        f"start.lon_deg={site.lon_deg}",
        f"seed={integer_seed(seed, f'ladder/flight/{drawn.number}/{role}')}",
        *(text.format(**drawn.words) for text in (*flight.set, *further)),
    )
    dressed = (
        f"individual={drawn.other if own else drawn.individual}",
        f"day={drawn.day + days}",
        f"sensors.seed={integer_seed(seed, f'ladder/noise/{drawn.number}/{level.name}/{role}/{place}')}",
        *(text.format(**drawn.words) for text in level.set),
    )
    return _Order(level, role, flight, place, (*dressed, *flown), flown)


def _flown(order: _Order, drawn: SetDraw, simulator: Simulator, seed: int) -> Recording:
    loaded = load_scenario(HERE / LADDER / order.level.scenario, order.settings)
    if order.level.widths:
        loaded = with_half_widths(loaded, drawn.half_widths_nt)
    recording = replace(simulator.simulate(loaded), name=order.role)
    if order.level.foreign:
        aircraft = ForeignAircraft.draw(stream(seed, f"ladder/foreign/{drawn.number}"))
        noise = stream(seed, f"ladder/foreign/{drawn.number}/{order.role}/{order.place}")
        recording = aircraft.fly(recording, order.level.sensors[0], noise)
    if order.role == "update":
        end_s = recording.time_s[0] + order.level.updated_s
        recording = recording.take(recording.time_s < end_s)
    return kept(recording)


def with_half_widths(loaded: LoadedScenario, half_widths_nt: Sequence[float]) -> LoadedScenario:
    """Return a scenario whose aircraft's steel has other half widths of hysteresis, by size."""
    memory = loaded.aircraft.magnetics.memory
    assert memory is not None
    update = {"radii_nt": tuple(half_widths_nt)}
    magnetics = loaded.aircraft.magnetics.model_copy(update={"memory": memory.model_copy(update=update)})
    return replace(loaded, aircraft=replace(loaded.aircraft, magnetics=magnetics))


def kept(recording: Recording) -> Recording:
    """Return what judging needs: inputs, labels, segments, and the strength of the background."""

    def wanted(name: str) -> bool:
        return columns.role_of(name) in ("input", "label", "segment") or columns.find(name) is columns.CLEAN

    return replace(recording, data={name: values for name, values in recording.data.items() if wanted(name)})
