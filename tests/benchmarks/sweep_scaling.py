"""What a sweep costs beside its flights, what it keeps when it is killed, and how it grows.

Run ``python tests/benchmarks/sweep_scaling.py [--json] [--only scaling]``; all of it takes about half an hour.
"""

from tests.benchmarks import sweep_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(sweep_rows, __doc__)
