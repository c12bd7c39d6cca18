"""Populations: the individuals of a type of aircraft, and the days of an individual.

Everything that scatters is drawn from streams of the type's name and the individual's number, never of a scenario's
seed: individual 7 is the same aircraft in every scenario, and its day 3 the same day.
"""

from magsim.population.days import on_day
from magsim.population.flown import aircraft_of, what_is_flown
from magsim.population.individuals import individual_of
from magsim.population.spreads import DAY, INDIVIDUAL, MAGNETS, SEATED, Spread

__all__ = [
    "DAY",
    "INDIVIDUAL",
    "MAGNETS",
    "SEATED",
    "Spread",
    "aircraft_of",
    "individual_of",
    "on_day",
    "what_is_flown",
]
