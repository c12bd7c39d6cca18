"""Claims of a paper as a table: how much better one method is than another, in how many flights, and by what chance."""

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.stats import binomtest

from magsim.papers.tables import Cell, Column, Line, PaperTable


@dataclass(frozen=True)
class Claim:
    """One method is better than another.

    Attributes
    ----------
    name : str
        In words.
    ratios : tuple of float
        How many times better, flight by flight: above 1 where the claim holds.
    published : float, optional
        The ratio that the paper prints, or that follows from what it prints.
    remark : str
    added : bool
        Not of the paper: stands below its claims.
    """

    name: str
    ratios: tuple[float, ...]
    published: float | None = None
    remark: str = ""
    added: bool = False

    @property
    def share(self) -> float:
        """Share of the flights in which the claim holds; NaN without flights."""
        return sum(ratio > 1.0 for ratio in self.ratios) / len(self.ratios) if self.ratios else float("nan")

    @property
    def p_value(self) -> float:
        """Chance of a share at least this uneven, either way, were neither method better: the exact sign test.

        Flights in which both are equal say nothing and are left out (Conover, Practical Nonparametric Statistics,
        section 3.4).
        """
        uneven = [ratio for ratio in self.ratios if ratio != 1.0]
        return float(binomtest(sum(ratio > 1.0 for ratio in uneven), len(uneven)).pvalue) if uneven else 1.0


def ratios(first: Sequence[float], second: Sequence[float]) -> tuple[float, ...]:
    """Return first over second, flight by flight.

    Raises
    ------
    ValueError
        If there are more of one than of the other.
    """
    return tuple(a / b for a, b in zip(first, second, strict=True))


def claims_table(claims: Sequence[Claim], over: str, notes: tuple[str, ...] = ()) -> PaperTable:
    """Return claims as a table."""
    columns = (Column("ratio", "ratio"), Column("share", "holds in", "%", 0), Column("p", "p of the sign test"))
    lines = [
        Line(
            claim.name,
            {
                "ratio": Cell(claim.published, claim.ratios),
                "share": Cell(None, (100.0 * claim.share,)),
                "p": Cell(None, (claim.p_value,)),
            },
            claim.remark,
            claim.added,
        )
        for claim in claims
    ]
    return PaperTable("claims", "Claims", columns, tuple(lines), over, notes)
