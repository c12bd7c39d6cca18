"""Populations: the individuals of a type of aircraft, and the days of an individual.

Everything that scatters is drawn from streams of the type's name and the individual's number, never of a scenario's
seed: individual 7 is the same aircraft in every scenario and on every day.
"""

from magsim.population.individuals import individual_of
from magsim.population.spreads import INDIVIDUAL, Spread

__all__ = ["INDIVIDUAL", "Spread", "individual_of"]
