"""Whether fifty individuals, and the days of one, scatter as stated."""

from magsim.aircraft import load_aircraft
from magsim.population import individual_of
from tests.benchmarks.rows import Row, at_least
from tests.support.populations import day_p_values, individual_p_values

INDIVIDUALS = 50


def rows() -> list[Row]:
    """Probability by Kolmogorov and Smirnov (by chi squared of whole notches), quantity by quantity."""
    nominal = load_aircraft("c208b")
    fleet = [individual_of(nominal, number) for number in range(1, INDIVIDUALS + 1)]
    found = individual_p_values(nominal, fleet) | day_p_values(fleet[0], 1, INDIVIDUALS)
    return [at_least(f"ks_p_{name}", p, "1", 0.01) for name, p in found.items()]
