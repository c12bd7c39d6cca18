"""What a calibration flight can tell about an aircraft: excitation, errors to expect, and what to fly more of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from magsim import columns, signals
from magsim.compensation.columns import Terms, TollesLawsonColumns, mean_strength, pick_fluxgate
from magsim.compensation.linear import ROWS_PER_TERM
from magsim.compensation.observability import LEAST_ANGLE_DEG, angle_swept_deg, is_constant, unobservable
from magsim.dataset.rows import pick_sensor, training_rows
from magsim.diagnosis.maneuvers import AMPLITUDES_DEG, HEADINGS, ambient_of, line_columns, maneuver_columns
from magsim.diagnosis.noise import BandNoise, band_noise
from magsim.diagnosis.prediction import Advice, ColumnExcitation, ExcitedColumns, ExpectedErrors, excitation, predict
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.recording.plausibility import unit_hints

MOST_EATEN = 0.1
"""Share of the geology in band that a fit to the reading may take for interference, at most (estimate)."""

LEVEL_LINE = "straight and level in light air (vertical gusts of 0.7 m/s), 5 min on each of four magnetic headings"
"""The survey line that is assumed."""

FLAGS = (columns.MAG_VALID,)
"""Channels that may be constant."""

ONE_SIDED = 10.0
"""Ratio of the expected errors on the worst and the best heading above which a flight is one-sided (estimate)."""


@dataclass(frozen=True)
class Observability:
    """What a flight can tell.

    Attributes
    ----------
    recordings : tuple of str
    sensor, fluxgate : str
    terms : int
    minutes : float [min]
        Of rows with a reading.
    rows, effective_rows : float
        In band, and how many independent ones would tell as much; 0 where no piece is long enough for the filter.
    angle_deg : float [deg]
        Largest angle between two directions of the field in the axes of the aircraft.
    inclination_deg : float [deg]
        Of the field, from the fluxgate.
    condition : float, optional
        Ratio of the largest to the smallest singular value of the scaled columns; None without rows in band.
    noise : BandNoise
    columns : tuple of ColumnExcitation
    line : str
        What the survey line is.
    line_errors_nt : mapping of str to float [nT]
        Expected standard error of the compensated reading in band on that line, by heading.
    line_error_nt : float, optional [nT]
        The same over all headings.
    goal_nt : float [nT]
    minutes_enough : float, optional [min]
        Of flying like this, for an error on the line below the goal.
    advice : tuple of Advice
        Best first.
    reasons : tuple of str
        Why the coefficients are unobservable; empty where they are observable.
    warnings : tuple of str
    """

    recordings: tuple[str, ...]
    sensor: str
    fluxgate: str
    terms: int
    minutes: float
    rows: int
    angle_deg: float
    inclination_deg: float
    noise: BandNoise
    line: str
    goal_nt: float
    reasons: tuple[str, ...]
    warnings: tuple[str, ...]
    effective_rows: float = 0.0
    condition: float | None = None
    columns: tuple[ColumnExcitation, ...] = ()
    line_errors_nt: Mapping[str, float] = field(default_factory=dict)
    line_error_nt: float | None = None
    minutes_enough: float | None = None
    advice: tuple[Advice, ...] = ()

    @property
    def is_observable(self) -> bool:
        """Whether a fit is worth its name."""
        return not self.reasons


def observe(
    recordings: Sequence[Recording],
    *,
    sensor: str | None = None,
    fluxgate: str | None = None,
    terms: Terms = 16,
    line: Sequence[Recording] | None = None,
    noise_nt: float | None = None,
    goal_nt: float | None = None,
) -> Observability:
    """Predict what a fit of Tolles-Lawson terms to a flight could know.

    Parameters
    ----------
    recordings : sequence of Recording
        Of those with a column ``split`` the rows ``train`` and ``valid``; all rows where there is none of them.
    sensor, fluxgate : str, optional
        The first ones if not given.
    terms : {3, 8, 16}
    line : sequence of Recording, optional
        The survey line; by default straight level lines in light air on four headings.
    noise_nt : float, optional [nT]
        Deviation in band of the reading's noise; by default that of the truth, else from 1 to 3 Hz of the reading.
    goal_nt : float, optional [nT]
        Error on the survey line that is good enough; by default the noise.

    Raises
    ------
    RequestError
        If a sensor, a fluxgate, or the noise is missing, or the terms depend on each other.
    DataError
        If the line is too short for the filter.
    """
    if terms not in (3, 8, 16):
        msg = f"terms {terms} is not allowed; allowed: 3, 8, 16, which do not depend on each other"
        raise RequestError(msg)
    sensor = pick_sensor(recordings, sensor)
    learned = _rows_to_learn(recordings, sensor)
    fluxgate = pick_fluxgate(learned, fluxgate)
    make = TollesLawsonColumns(terms, fluxgate, strength_nt=mean_strength(learned, fluxgate))
    fluxes = [recording.vector(columns.FLUX, sensor=fluxgate) for recording in learned]
    ambient = ambient_of(np.concatenate(fluxes))
    noise = band_noise(recordings, sensor, noise_nt)
    goal_nt = goal_nt or noise.std_nt
    excited = excitation(learned, make, sensor)
    lines = {heading: line_columns(ambient, heading, excited.rate_hz, terms) for heading in HEADINGS}
    described = LEVEL_LINE
    if line is not None:
        described = ", ".join(recording.name for recording in line)
        lines = {"as flown": excitation(line, make, pick_sensor(line)).matrix}
        if not len(lines["as flown"]):
            msg = f"survey line {described!r} is too short: {signals.EDGE_S:g} s at each end of each piece do not count"
            raise DataError(msg)
    minutes = sum(int(r.reads(sensor).sum()) / r.rate_hz for r in learned) / 60.0
    angle = angle_swept_deg(np.concatenate(fluxes))
    whole = Observability(
        recordings=tuple(recording.name for recording in learned),
        sensor=sensor,
        fluxgate=fluxgate,
        terms=terms,
        minutes=minutes,
        rows=len(excited.matrix),
        angle_deg=angle,
        inclination_deg=ambient.inclination_deg,
        noise=noise,
        line=described,
        goal_nt=goal_nt,
        reasons=_reasons(excited, angle, learned),
        warnings=_doubts(learned),
    )
    if len(excited.matrix) < ROWS_PER_TERM * terms:
        return whole
    found = predict(excited, noise.std_nt)
    moves = {
        (heading, axis): maneuver_columns(ambient, heading, axis, excited.rate_hz, terms)
        for heading in HEADINGS
        for axis in AMPLITUDES_DEG
    }
    errors = {heading: found.line_error_nt(matrix) for heading, matrix in lines.items()}
    error_nt = float(np.sqrt(np.mean(np.square(list(errors.values())))))
    return replace(
        whole,
        effective_rows=found.effective_rows,
        condition=found.condition,
        columns=found.columns,
        line_errors_nt=errors,
        line_error_nt=error_nt,
        minutes_enough=minutes * (error_nt / goal_nt) ** 2,
        advice=found.advice(list(lines.values()), moves),
        warnings=(*whole.warnings, *_cautions(found, errors, terms)),
    )


def _rows_to_learn(recordings: Sequence[Recording], sensor: str) -> tuple[Recording, ...]:
    """Return training and validation rows; all rows where there are none, as on a test flight."""
    try:
        return tuple(training_rows(recordings, sensor).recordings)
    except RequestError:
        return tuple(recordings)


def _reasons(excited: ExcitedColumns, angle_deg: float, learned: Sequence[Recording]) -> tuple[str, ...]:
    """Return why the coefficients are unobservable."""
    names, needed = ", ".join(repr(recording.name) for recording in learned), ROWS_PER_TERM * excited.matrix.shape[1]
    out = [unobservable(angle_deg, names)] if angle_deg < LEAST_ANGLE_DEG else []
    if len(excited.matrix) < needed:
        longest = max(float(np.ptp(r.time_s[span])) for r in learned for span in signals.spans(r.time_s))
        out.append(
            f"{len(excited.matrix)} rows are left in band, and {excited.matrix.shape[1]} coefficients need {needed}: "
            f"the longest piece lasts {longest:.1f} s, and the filter spoils {signals.EDGE_S:g} s at each of its ends"
        )
    return tuple(out)


def _doubts(learned: Sequence[Recording]) -> tuple[str, ...]:
    """Return what is doubtful about the channels."""
    hints = [f"{recording.name}: {hint}" for recording in learned for hint in unit_hints(recording)]
    dead = [
        name for name in learned[0].names("input") if is_constant(learned, name) and columns.find(name) not in FLAGS
    ]
    return (*hints, *(f"{name} never changes: a dead channel?" for name in dead))


def _cautions(found: ExpectedErrors, errors_nt: Mapping[str, float], terms: int) -> tuple[str, ...]:
    """Return what a fit to these rows must be used with care for."""
    out = []
    eaten = terms / found.effective_rows
    if eaten > MOST_EATEN:
        out.append(
            f"a fit of {terms} coefficients to the reading itself takes some {100.0 * min(eaten, 1.0):.0f} % of the "
            f"geology in band for interference: these rows count as {found.effective_rows:.0f} independent ones; fly "
            "longer, or high above the geology"
        )
    worst, best = max(errors_nt.values()), min(errors_nt.values())
    if worst > ONE_SIDED * best:
        heading = max(errors_nt, key=lambda name: errors_nt[name])
        out.append(
            f"the expected error is {worst:.3g} nT on a line to the {heading} and {best:.3g} nT on the best heading: "
            "the coefficients hold for the headings that were flown alone"
        )
    return tuple(out)
