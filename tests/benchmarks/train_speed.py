"""How fast networks train, on one thread: an epoch of Levenberg-Marquardt beside a step of scipy's.

Run ``python tests/benchmarks/train_speed.py [--json] [--only levenberg]``. Each module of ``train_rows`` has its own
rows.
"""

from tests.benchmarks import train_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(train_rows, __doc__)
