"""The common form of a benchmark's answer: rows of name, value, unit, goal, holds."""

import argparse
import importlib
import json
import pkgutil
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from types import ModuleType


@dataclass(frozen=True)
class Row:
    """One measured figure.

    ``goal`` is the bound of the issue as text, ``<= 3`` or ``10 .. 25``, or empty where there is none.
    """

    name: str
    value: float
    unit: str
    goal: str
    holds: bool

    def __post_init__(self) -> None:
        # json knows no numpy scalars
        object.__setattr__(self, "value", float(self.value))
        object.__setattr__(self, "holds", bool(self.holds))


def at_most(name: str, value: float, unit: str, bound: float) -> Row:
    """Figure that must not exceed a bound."""
    return Row(name, value, unit, f"<= {bound:g}", value <= bound)


def at_least(name: str, value: float, unit: str, bound: float) -> Row:
    """Figure that must reach a bound."""
    return Row(name, value, unit, f">= {bound:g}", value >= bound)


def within(name: str, value: float, unit: str, low: float, high: float) -> Row:
    """Figure that must lie between two bounds."""
    return Row(name, value, unit, f"{low:g} .. {high:g}", low <= value <= high)


def stated(name: str, value: float, unit: str) -> Row:
    """Figure without a goal."""
    return Row(name, value, unit, "", holds=True)


def finish(rows: Sequence[Row], *, as_json: bool) -> None:
    """Print the rows and leave: exit code 1 where one does not hold."""
    if as_json:
        sys.stdout.write(json.dumps([asdict(row) for row in rows], indent=2) + "\n")
    else:
        width = max(len(row.name) for row in rows)
        for row in rows:
            verdict = "" if not row.goal else f"   goal {row.goal}: {'holds' if row.holds else 'MISSED'}"
            sys.stdout.write(f"{row.name:<{width}}  {row.value:12.5g} {row.unit}{verdict}\n")
    sys.exit(0 if all(row.holds for row in rows) else 1)


def collect(package: ModuleType, description: str | None) -> None:
    """Command of a package of subjects: the rows of every module, or of those that are named."""
    subjects = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--only", default=",".join(subjects), help=f"subjects by comma: {', '.join(subjects)}")
    arguments = parser.parse_args()
    asked = arguments.only.split(",")
    unknown = sorted(set(asked) - set(subjects))
    if unknown:
        parser.error(f"no subject is called {', '.join(unknown)}; allowed: {', '.join(subjects)}")
    rows = []
    for subject in asked:
        rows += importlib.import_module(f"{package.__name__}.{subject}").rows()
    finish(rows, as_json=arguments.json)
