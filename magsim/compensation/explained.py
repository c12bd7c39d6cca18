"""What a method of physical terms tells beside its estimate: coefficients, shares by source, errors."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import final

import numpy as np

from magsim.compensation.terms import Term
from magsim.errors import RequestError
from magsim.recording import Recording


class Explained(ABC):
    """The part of ``Compensator`` that explains; methods that are no sum of physical terms leave it as it is."""

    name: str
    requires: Sequence[str]

    # ---- what a method gives ----------------------------------------------------------------------------------

    def _coefficients(self) -> tuple[Term, ...]:
        """Return what ``coefficients`` gives."""
        raise self._unexplained()

    def _shares(self, recording: Recording) -> dict[str, np.ndarray]:
        """Return what ``shares`` gives, from a blind copy as in ``Compensator.estimate``."""
        raise self._unexplained()

    def _uncertainty(self, recording: Recording) -> np.ndarray:
        """Return what ``uncertainty`` gives, from a blind copy as in ``Compensator.estimate``."""
        raise self._unexplained()

    def _unexplained(self) -> RequestError:
        return RequestError(f"method {self.name} has no coefficients, shares or errors: it is no sum of physical terms")

    # ---- what users call --------------------------------------------------------------------------------------

    @property
    def is_explained(self) -> bool:
        """Whether the method has coefficients, shares and errors."""
        return type(self)._coefficients is not Explained._coefficients

    @final
    def coefficients(self) -> tuple[Term, ...]:
        """Return every fitted coefficient with its unit, standard error and group.

        Raises
        ------
        RequestError
            If the method is not fitted, or has none.
        """
        self.check_fitted()
        return self._coefficients()

    @final
    def shares(self, recording: Recording) -> dict[str, np.ndarray]:
        """Return the estimated interference by source, (n,) [nT] each; their sum is ``interference``.

        Raises
        ------
        RequestError
            If the method is not fitted, has none, or a column is missing.
        """
        self.check_fitted()
        self._require(recording)
        return self._shares(recording.blind(self.requires))

    @final
    def uncertainty(self, recording: Recording) -> np.ndarray:
        """Return the standard error of the compensated reading in band that comes from the coefficients, (n,) [nT].

        Noise of the reading and what the model cannot express are not in it.

        Raises
        ------
        RequestError
            If the method is not fitted, has none, or a column is missing.
        """
        self.check_fitted()
        self._require(recording)
        return self._uncertainty(recording.blind(self.requires))

    @abstractmethod
    def check_fitted(self) -> None:
        """Refuse a method that is not fitted."""

    @abstractmethod
    def _require(self, recording: Recording) -> None:
        """Refuse a recording that has no column of a required family."""
