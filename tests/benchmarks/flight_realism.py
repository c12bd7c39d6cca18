"""How close flights are to what crews fly: gusts at every height, joints between maneuvers, turns, a helicopter's sway.

Run ``python tests/benchmarks/flight_realism.py [--json] [--only gusts]``. Each module of ``realism_rows`` has its own
rows.
"""

from tests.benchmarks import realism_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(realism_rows, __doc__)
