"""Individuals and days: what they leave as it was, whether they scatter as stated, what their fields are like.

Run ``python tests/benchmarks/population.py [--json] [--only scatter]``. Each module of ``population_rows`` has its own
rows; ``fleet`` and ``later`` fly once and compute the field of every individual on that flight.
"""

from tests.benchmarks import population_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(population_rows, __doc__)
