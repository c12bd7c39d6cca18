"""Every figure of the field against its exact reference.

Run ``python tests/benchmarks/field_accuracy.py [--json] [--only earth,skin]``. Each module of ``field_rows`` has its
own rows; the meshes here are finer than those of the tests, so a whole run takes a minute or two.
"""

import argparse
import importlib
import pkgutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.benchmarks import field_rows
from tests.benchmarks.rows import finish


def main() -> None:
    """Collect the rows of every module, or of those that are named."""
    subjects = sorted(module.name for module in pkgutil.iter_modules(field_rows.__path__))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--only", default=",".join(subjects), help=f"subjects by comma: {', '.join(subjects)}")
    arguments = parser.parse_args()
    asked = arguments.only.split(",")
    unknown = sorted(set(asked) - set(subjects))
    if unknown:
        parser.error(f"no subject is called {', '.join(unknown)}; allowed: {', '.join(subjects)}")
    rows = []
    for subject in asked:
        rows += importlib.import_module(f"tests.benchmarks.field_rows.{subject}").rows()
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
