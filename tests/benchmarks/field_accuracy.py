"""Every figure of the field against its exact reference.

Run ``python tests/benchmarks/field_accuracy.py [--json] [--only earth,skin]``. Each module of ``field_rows`` has its
own rows; the meshes here are finer than those of the tests, so a whole run takes a minute or two.
"""

from tests.benchmarks import field_rows
from tests.benchmarks.rows import collect

if __name__ == "__main__":
    collect(field_rows, __doc__)
