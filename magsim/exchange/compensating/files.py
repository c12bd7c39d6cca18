"""A method on a survey file: fitted on some lines, applied to others."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from magsim import columns
from magsim.compensation import Compensator
from magsim.errors import DataError, RequestError
from magsim.exchange.compensating.lines import PickedLines
from magsim.exchange.compensating.survey import Survey, check_channels, compensated
from magsim.recording import Recording


def picked(surveys: Sequence[Survey], lines: PickedLines | None, option: str) -> list[np.ndarray]:
    """Return the rows of each survey that are on lines, (n,) bool; all without lines.

    Raises
    ------
    RequestError
        If no survey has such rows.
    """
    masks = []
    errors: list[RequestError] = []
    for survey in surveys:
        try:
            masks.append(survey.picked(lines, option))
        except RequestError as error:
            masks.append(np.zeros(len(survey), dtype=bool))
            errors.append(error)
    if len(errors) == len(surveys):
        raise errors[0]
    return masks


def compensate(
    compensator: Compensator, surveys: Sequence[Survey], lines: PickedLines | None, option: str
) -> list[np.ndarray]:
    """Compensate the rows on lines; see ``compensated``.

    Returns
    -------
    list of (n, 2) [nT]

    Raises
    ------
    DataError
        If no row gets an estimate.
    """
    found = [
        compensated(compensator, survey, mask) if lines is None or mask.any() else np.full((len(survey), 2), np.nan)
        for survey, mask in zip(surveys, picked(surveys, lines, option), strict=True)
    ]
    if not any(np.isfinite(table[:, 1]).any() for table in found):
        msg = (
            f"{surveys[0].where}: no row gets an estimate; {compensator.name} gives none in the first "
            f"{compensator.warmup_s:g} s of each piece without a gap"
        )
        raise DataError(msg)
    return found


def calibrate(
    compensator: Compensator, surveys: Sequence[Survey], lines: PickedLines, sensor: str | None, option: str
) -> Compensator:
    """Fit a method on lines; rows are learned whole, whatever a column ``split`` says.

    Raises
    ------
    RequestError
        If there are no such lines, or a column is missing.
    DataError
        If there are too few rows, or a channel is dead or in another unit.
    """
    recordings = []
    for survey, mask in zip(surveys, picked(surveys, lines, option), strict=True):
        if not mask.any():
            continue
        scalars = columns.sensors_of(survey.data, columns.MAG)
        found = sensor or next(iter(scalars), "")
        needed = _known_for(compensator, survey, found)
        pieces = survey.pieces(mask, needed)
        if not pieces:
            msg = f"{survey.where}: {option} {lines.text}: has no two rows in a row with values of {', '.join(needed)}"
            raise DataError(msg)
        check_channels(survey, pieces, needed)
        recordings += [_unsplit(piece.recording) for piece in pieces]
    return compensator.fit(recordings, sensor=sensor)


def _known_for(compensator: Compensator, survey: Survey, sensor: str) -> tuple[str, ...]:
    """Return the columns of the required families and the reading."""
    reading = columns.MAG.name(sensor=sensor)
    if reading not in survey.data:
        has = ", ".join(columns.sensors_of(survey.data, columns.MAG)) or "none"
        msg = f"{survey.where}: there is no scalar magnetometer {sensor!r}; there is {has}; --map names columns"
        raise RequestError(msg)
    names = [name for name in survey.data if columns.family_of(name).pattern in compensator.requires]
    return tuple(dict.fromkeys([*names, reading]))


def _unsplit(recording: Recording) -> Recording:
    data = {name: values for name, values in recording.data.items() if name != columns.SPLIT.pattern}
    return replace(recording, data=data)
