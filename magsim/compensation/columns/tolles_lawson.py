"""Tolles-Lawson columns, 3 to 18 of them (paper 000, eq. 26, with its typo resolved: the last entry is u3 u2')."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from magsim import columns
from magsim.compensation.columns.base import Design
from magsim.compensation.columns.direction import (
    Derivative,
    VectorField,
    direction_cosines,
    time_derivative,
    unit_vectors,
)
from magsim.recording import Recording

Terms = Literal[3, 8, 9, 16, 18]
Eddy = Literal["direction", "field"]

INDUCED_18 = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
EDDY_18 = ((0, 0), (1, 0), (2, 0), (0, 2), (1, 2), (2, 2), (0, 1), (1, 1), (2, 1))
"""Pairs (i, j) of the columns u_i u_j and u_i u_j' (paper 001)."""

INDUCED_16 = tuple(pair for pair in INDUCED_18 if pair != (1, 1))
EDDY_16 = tuple(pair for pair in EDDY_18 if pair != (1, 1))
"""The same without u2 u2 and u2 u2', which follow from u . u = 1 and u . u' = 0 (paper 000)."""


class TermPairs(NamedTuple):
    """Pairs (i, j) of the induced and of the eddy-current columns."""

    induced: tuple[tuple[int, int], ...]
    eddy: tuple[tuple[int, int], ...]


TERMS: dict[int, TermPairs] = {
    3: TermPairs((), ()),
    8: TermPairs(INDUCED_16, ()),
    9: TermPairs(INDUCED_18, ()),
    16: TermPairs(INDUCED_16, EDDY_16),
    18: TermPairs(INDUCED_18, EDDY_18),
}
"""Columns beside the 3 permanent ones, by the number of all: permanent alone; with induced; with eddy currents too."""


def tolles_lawson_columns(cosines: np.ndarray, rates: np.ndarray, strength: np.ndarray, terms: int) -> np.ndarray:
    """Form the columns in canonical order: 3 permanent, then induced, then eddy.

    Parameters
    ----------
    cosines : (n, 3)
        Direction of the field, u.
    rates : (n, 3) [1/s]
        Its derivative by time, u'.
    strength : (n,) [nT]
        Field strength, B.
    terms : {3, 8, 9, 16, 18}

    Returns
    -------
    (n, terms)
        u_i with coefficients in nT; B u_i u_j without unit; B u_i u_j' [nT/s] with coefficients in s.
    """
    pairs = TERMS[terms]
    direction, change = np.ascontiguousarray(cosines.T), np.ascontiguousarray(rates.T)
    field = strength * direction
    out = np.empty((len(cosines), terms))
    out[:, :3] = cosines
    products = [(i, direction[j]) for i, j in pairs.induced] + [(i, change[j]) for i, j in pairs.eddy]
    for column, (i, factor) in enumerate(products, start=3):
        out[:, column] = field[i] * factor
    return out


def term_names(terms: int, eddy: Eddy = "direction") -> tuple[str, ...]:
    """Return the names of the columns, (terms,)."""
    pairs = TERMS[terms]
    names = [f"u{i + 1}" for i in range(3)] + [f"B u{i + 1} u{j + 1}" for i, j in pairs.induced]
    names += [f"B u{i + 1} u{j + 1}'" if eddy == "direction" else f"u{i + 1} B{j + 1}'" for i, j in pairs.eddy]
    return tuple(names)


def term_units(terms: int) -> tuple[str, ...]:
    """Return the units of the coefficients, (terms,)."""
    pairs = TERMS[terms]
    return ("nT",) * 3 + ("1",) * len(pairs.induced) + ("s",) * len(pairs.eddy)


def term_groups(terms: int) -> tuple[str, ...]:
    """Return what each term belongs to, (terms,): permanent, induced or eddy."""
    pairs = TERMS[terms]
    return ("permanent",) * 3 + ("induced",) * len(pairs.induced) + ("eddy",) * len(pairs.eddy)


@dataclass(frozen=True)
class TollesLawsonColumns:
    """Tolles-Lawson columns from a fluxgate, or from another knowledge of the background.

    Attributes
    ----------
    terms : {3, 8, 9, 16, 18}
    fluxgate : str
        Name of the fluxgate that gives the direction cosines; not read if there is a ``field``.
    derivative : {"central", "spline"}
        How is differentiated by time.
    strength_nt : float [nT], optional
        Field strength in the induced and eddy columns; by default the length B of the vectors, row by row.
    eddy : {"direction", "field"}
        B u_i u_j' as paper 000 has them in eq. 23, or u_i B_j' as in its eq. 19.
    field : VectorField, optional
        Gives the vectors in place of the fluxgate.

    Notes
    -----
    Row by row, the three columns B u_i u_i of 9 and 18 terms add up to B itself, which holds the field that is to be
    measured: a fit can answer with a share of it and eat that share of every anomaly (95 % in the world of paper 000,
    where the residual of the reading is 0.010 nT and the true error 0.065). So a third of B is taken from each: the
    trace of the induced matrix is not fitted. With a constant strength it is a constant.
    """

    terms: Terms
    fluxgate: str
    derivative: Derivative = "central"
    strength_nt: float | None = None
    eddy: Eddy = "direction"
    field: VectorField | None = None

    @property
    def reads(self) -> tuple[str, ...]:
        """What the vectors are made of."""
        return (columns.FLUX.pattern,) if self.field is None else self.field.reads

    @property
    def lookahead_rows(self) -> int | None:
        """One row for a central difference, none without eddy columns; a spline looks ahead without limit."""
        ahead = 0 if self.field is None else self.field.lookahead_rows
        if not TERMS[self.terms].eddy:
            return ahead
        return ahead + 1 if self.derivative == "central" else None

    def vectors(self, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
        """Return direction cosines, (n, 3), and length, (n,) [nT], of the field; see ``direction_cosines``."""
        if self.field is None:
            return direction_cosines(recording, self.fluxgate)
        return unit_vectors(self.field(recording), recording, "the background")

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        cosines, length = self.vectors(recording)
        strength = length if self.strength_nt is None else np.full(len(length), self.strength_nt)
        if self.eddy == "direction":
            rates = time_derivative(cosines, recording.time_s, self.derivative)
        else:
            rates = time_derivative(cosines * length[:, None], recording.time_s, self.derivative) / strength[:, None]
        matrix = tolles_lawson_columns(cosines, rates, strength, self.terms)
        names = list(term_names(self.terms, self.eddy))
        if self.strength_nt is None and (1, 1) in TERMS[self.terms].induced:
            for i in range(3):
                column = names.index(f"B u{i + 1} u{i + 1}")
                matrix[:, column] -= length / 3.0
                names[column] = f"B (u{i + 1} u{i + 1} - 1/3)"
        return Design(tuple(names), term_units(self.terms), matrix, term_groups(self.terms))
