"""Rope and bird against exact references and other codes, what they cost, and how hard a rope may be whipped.

Run ``python tests/benchmarks/tow_accuracy.py [--json] [--only steady,speed]``. Each module of ``tow_rows`` has its own
rows; a whole run takes about two minutes.
"""

from tests.benchmarks import tow_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(tow_rows, __doc__)
