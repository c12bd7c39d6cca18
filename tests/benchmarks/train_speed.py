"""How fast networks train, on one thread: MagTCN beside the commit called "before", Levenberg-Marquardt beside scipy.

Run ``python tests/benchmarks/train_speed.py [--json] [--only magtcn]``. Each module of ``train_rows`` has its own
rows.
"""

from tests.benchmarks import train_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(train_rows, __doc__)
