"""What the commands about networks have in common: where flights and results lie, how much is worked at once."""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from magsim.storage.sources import source_digest
from tests.benchmarks.network_rows.journal import Journal
from tests.benchmarks.network_rows.measuring import Case, measured, networks
from tests.benchmarks.physics_rows.shown import tell


def cache(name: str) -> Path:
    """Return the folder of a command's flights; other sources make other flights."""
    root = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return root / "magsim_benchmarks" / name / source_digest("magsim.simulation")[:12]


def sources() -> str:
    """Return a digest of all that the result of a fit depends on, beside its flights."""
    return source_digest("magsim.compensation.networks") + source_digest("magsim.benchmark.judging")


def add_options(parser: argparse.ArgumentParser, folder: Path) -> None:
    """Add the options of all commands."""
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--methods", help="networks by comma; default all")
    parser.add_argument("--workers", type=int, default=1, help="fits at once, each on one thread")
    parser.add_argument("--minutes", type=float, help="begin no fit after so many; call again to go on")
    parser.add_argument(
        "--folder",
        type=Path,
        default=folder,
        help="of flights and results; what is there is taken as it is",
    )


def listed(parser: argparse.ArgumentParser, option: str, given: str | None, known: Sequence[str]) -> tuple[str, ...]:
    """Return names by comma, all that are known if there are none; others are refused."""
    if given is None:
        return tuple(known)
    asked = tuple(name.strip() for name in given.split(",") if name.strip())
    if unknown := sorted(set(asked) - set(known)):
        parser.error(f"{option}: unknown {', '.join(unknown)}; allowed: {', '.join(known)}")
    if not asked:
        parser.error(f"{option}: none is named; allowed: {', '.join(known)}")
    return asked


def methods_of(parser: argparse.ArgumentParser, given: str | None) -> tuple[str, ...]:
    """Return networks by comma."""
    return listed(parser, "--methods", given, networks())


@dataclass(frozen=True)
class Bench:
    """Where fits are made and kept.

    Attributes
    ----------
    folder : Path
        Holds the flights.
    journal : Journal
    workers : int
    until : float, optional
        Instant of ``time.monotonic`` after which no fit begins.
    """

    folder: Path
    journal: Journal
    workers: int
    until: float | None

    @classmethod
    def of(cls, arguments: argparse.Namespace, folder: Path, journal: str) -> "Bench":
        """Return the bench that the options ask for."""
        kept = Journal(folder / journal, sources())
        if kept.stale:
            tell(f"{folder / journal}: {kept.stale} results of other sources are left aside")
        until = None if arguments.minutes is None else time.monotonic() + 60.0 * arguments.minutes
        return cls(folder, kept, arguments.workers, until)

    def results(
        self, cases: Sequence[Case], limit_s: float | None = None
    ) -> tuple[list[tuple[Case, dict[str, Any]]], bool]:
        """Return what is known of cases after working on them, and whether it is all."""
        unique = {case.key for case in cases}
        found = [*measured(cases, self.folder, self.journal, workers=self.workers, until=self.until, limit_s=limit_s)]
        return found, len(found) == len(unique)


def unfinished() -> None:
    """Leave without figures: they would be of a part."""
    tell("not all was measured; the same command goes on")
    sys.exit(1)
