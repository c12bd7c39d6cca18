"""Motion of the air beside its steady wind: shear, gusts and turbulence."""

import math
from dataclasses import dataclass
from functools import cached_property

from magsim.flight.model.dryden import Strength
from magsim.scenario import Air, Gust, LinearShear, LogShear
from magsim.streams import stream


@dataclass(frozen=True)
class Weather:
    """Motion of the air beside its steady wind.

    Attributes
    ----------
    shear : LinearShear or LogShear, optional
    reference_m : float
        Where the steady wind holds: height above the ellipsoid of a linear shear, above ground of a logarithmic one.
    gusts : tuple of Gust
        Times count from the first row.
    turbulence : Strength, optional
        How strong continuous gusts are; without it there are none.
    seed : int
        The scenario's, of these gusts.
    """

    shear: LinearShear | LogShear | None = None
    reference_m: float = 0.0
    gusts: tuple[Gust, ...] = ()
    turbulence: Strength | None = None
    seed: int = 1

    @cached_property
    def slots(self) -> tuple[tuple[Gust, ...], ...]:
        """Gusts of each generator, in time order; two of one generator are at least a second apart."""
        slots: list[list[Gust]] = []
        for gust in sorted(self.gusts, key=lambda gust: gust.at_s):
            free = (slot for slot in slots if slot[-1].at_s + slot[-1].duration_s + 1.0 <= gust.at_s)
            slot = next(free, None)
            if slot is None:
                slots.append([gust])
            else:
                slot.append(gust)
        return tuple(map(tuple, slots))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Properties that Python writes during the flight."""
        return tuple(gust_property(slot, name) for slot in range(len(self.slots)) for name in GUST_INPUTS)


CALM = Weather()


GUST_INPUTS = ("start-s", "duration-s", "north-fps", "east-fps", "down-fps")


TURBULENCE_INPUTS = tuple(
    f"air/turbulence/{name}" for name in ("north-fps", "east-fps", "down-fps", "p-rad_sec", "q-rad_sec", "r-rad_sec")
)
"""Properties of the turbulence: motion of the air, near the poles in grid directions, and its rotation."""


def gust_property(slot: int, name: str) -> str:
    """Return the name of a property of a gust generator."""
    return f"air/gust-{slot}/{name}"


def drawn_gusts(air: Air, seed: int, last_s: float) -> tuple[Gust, ...]:
    """Return the gusts of a scenario, listed and random ones, up to a time from the first row.

    Parameters
    ----------
    air : Air
    seed : int
        The scenario's.
    last_s : float
        Draws end here. A later end gives the same gusts and more.
    """
    gusts, settings = list(air.gusts), air.random_gusts
    if settings is None:
        return tuple(gusts)
    rng = stream(seed, "gusts")
    time = 1.0
    while True:
        time += float(rng.exponential(settings.every_s))
        duration = float(rng.uniform(settings.shortest_s, settings.longest_s))
        speed = float(rng.uniform(0.0, settings.speed_mps))
        down, turn = float(rng.uniform(-1.0, 1.0)), float(rng.uniform(0.0, 2.0 * math.pi))
        if time > last_s:
            return tuple(gusts)
        # Uniform over the sphere: the height of a point is uniform between the poles (Archimedes).
        level = speed * math.sqrt(1.0 - down * down)
        wind = {"north_mps": level * math.cos(turn), "east_mps": level * math.sin(turn), "down_mps": speed * down}
        gusts.append(Gust(at_s=time, duration_s=duration, **wind))


def turbulence_of(air: Air) -> Strength | None:
    """Return how strong the turbulence of a scenario is, None if there is none."""
    if not air.turbulence_severity and not air.turbulence_mps:
        return None
    return Strength(air.turbulence_severity, air.turbulence_mps)


def weather_of(air: Air, seed: int, reference_m: float, last_s: float) -> Weather:
    """Return the weather of a scenario.

    Parameters
    ----------
    air : Air
    seed : int
        The scenario's.
    reference_m : float
        Where the steady wind holds, as in ``Weather``.
    last_s : float
        No gust is drawn that begins later.
    """
    return Weather(
        shear=air.shear,
        reference_m=reference_m,
        gusts=drawn_gusts(air, seed, last_s),
        turbulence=turbulence_of(air),
        seed=seed,
    )
