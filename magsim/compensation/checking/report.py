"""What a check of a method found."""

from dataclasses import dataclass
from typing import Literal

from magsim.errors import DataError

Outcome = Literal["passed", "failed", "skipped"]


@dataclass(frozen=True)
class Check:
    """One check.

    Attributes
    ----------
    name : str
    outcome : {"passed", "failed", "skipped"}
    text : str
        What was seen, or why it was skipped.
    """

    name: str
    outcome: Outcome
    text: str


@dataclass(frozen=True)
class CheckReport:
    """All checks of a method.

    Attributes
    ----------
    method : str
    checks : tuple of Check
    """

    method: str
    checks: tuple[Check, ...]

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return tuple(check for check in self.checks if check.outcome == "failed")

    @property
    def passed(self) -> bool:
        """Whether none failed."""
        return not self.failures

    def __getitem__(self, name: str) -> Check:
        """Return the check of a name."""
        return next(check for check in self.checks if check.name == name)

    def raise_for_failures(self) -> None:
        """Raise where a check failed.

        Raises
        ------
        DataError
            With a line for each failure.
        """
        if self.failures:
            lines = [f"method {self.method}: {check.name}: {check.text}" for check in self.failures]
            raise DataError("\n".join(lines))

    def __str__(self) -> str:
        width = max(len(check.name) for check in self.checks)
        lines = [f"{check.outcome:<8} {check.name:<{width}}  {check.text}" for check in self.checks]
        count = len(self.failures)
        return "\n".join([*lines, f"{self.method}: {len(lines)} checks, {count} failed"])
