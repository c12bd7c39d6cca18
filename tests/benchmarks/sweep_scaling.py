"""What a sweep costs beside its flights, what it keeps when it is killed, and how it grows.

Run ``python tests/benchmarks/sweep_scaling.py [--json] [--only scaling]``; all of it takes about 45 minutes.

``two_workers_over_one``: 200 lines of 1000 s with one worker over two, all of the time from the first import to the
index; ``two_bare_loops_over_one`` is what the machine's two cores give. ``overhead_over_bare_loop_pct``: processor time
of 104 lines of 7 s in a sweep over that in a loop, each less that of 8 lines.
"""

from tests.benchmarks import sweep_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(sweep_rows, __doc__)
