"""Signatures of maneuvers on headings: the table of a figure of merit, before and after compensation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.recording.segments import cells


class Signature(NamedTuple):
    """One maneuver on one heading."""

    heading_deg: float
    maneuver: str
    before_nt: float
    """Maximum minus minimum in band [nT]."""
    after_nt: float

    @property
    def ratio(self) -> float:
        """Before over after; infinite where nothing is left."""
        return self.before_nt / self.after_nt if self.after_nt > 0.0 else float("inf")


@dataclass(frozen=True)
class SignatureTable:
    """Signatures in order of heading, then maneuver.

    Attributes
    ----------
    signatures : tuple of Signature
    """

    signatures: tuple[Signature, ...]

    @property
    def headings_deg(self) -> tuple[float, ...]:
        """Headings, rising."""
        return tuple(sorted({one.heading_deg for one in self.signatures}))

    @property
    def maneuvers(self) -> tuple[str, ...]:
        """Maneuvers, in the order of ``columns.MANEUVERS``."""
        flown = {one.maneuver for one in self.signatures}
        return tuple(word for word in columns.MANEUVERS.values() if word in flown)

    def total_nt(self, *, after: bool, heading_deg: float | None = None, maneuver: str | None = None) -> float:
        """Return the sum of the signatures [nT]: the figure of merit, or that of a heading or a maneuver."""
        return sum(
            one.after_nt if after else one.before_nt
            for one in self.signatures
            if heading_deg in (None, one.heading_deg) and maneuver in (None, one.maneuver)
        )

    def at(self, heading_deg: float, maneuver: str) -> Signature | None:
        """Return one signature, if it was flown."""
        found = [one for one in self.signatures if (one.heading_deg, one.maneuver) == (heading_deg, maneuver)]
        return found[0] if found else None


def signatures_of(data: Mapping[str, np.ndarray], before: np.ndarray, after: np.ndarray) -> SignatureTable:
    """Return the signatures of rows.

    Parameters
    ----------
    data : mapping of str to (n,)
        With the segment columns ``leg_heading_deg`` and ``maneuver``; without them there are none.
    before, after : (n,) [nT]
        In band.
    """
    out = []
    for cell in cells(data):
        heading = float(data[columns.LEG_HEADING.pattern][np.argmax(cell.rows)])
        maneuver = columns.MANEUVERS[int(data[columns.MANEUVER.pattern][np.argmax(cell.rows)])]
        out.append(Signature(heading, maneuver, float(np.ptp(before[cell.rows])), float(np.ptp(after[cell.rows]))))
    return SignatureTable(tuple(out))
