"""When each maneuver of a leg is flown."""

from dataclasses import dataclass

from magsim.scenario import Combined, LegPattern, PhasedOscillation, Train

CENTER_MARGIN_S = 2.0
"""Added to the quiet around a center when a leg is planned: its time is foreseen from the steady wind."""


@dataclass(frozen=True)
class ScheduledOscillation:
    """A swing on the clock of its leg."""

    train: int
    """Number of its train on the leg."""
    axis: str
    start_s: float
    period_s: float
    cycles: int
    amplitude_deg: float
    ease_in_s: float
    ease_out_s: float


def schedule(pattern: LegPattern, index: int, leg_s: float) -> tuple[list[ScheduledOscillation], float]:
    """Return the oscillations of a leg, in the order in which they begin to rise, and the end of the last one [s].

    Parameters
    ----------
    pattern : LegPattern
    index : int
        Of the leg, counted from 0 over the pattern.
    leg_s : float
        Time that the leg takes. Where a pattern keeps quiet around the center of its legs, a train that would reach
        into the quiet is flown after it.
    """
    trains, out, time, end = pattern.maneuvers, [], pattern.lead_s, 0.0
    middle, quiet = 0.5 * leg_s, pattern.quiet_around_center_s
    for i, train in enumerate(trains):
        before = trains[i - 1].rest_s if i else pattern.lead_s
        after = train.rest_s
        # One generator serves an axis: two trains that share one halve the rest between them.
        if i and _share(trains[i - 1], train):
            before *= 0.5
        if i + 1 < len(trains) and _share(train, trains[i + 1]):
            after *= 0.5
        length = train.length(index)
        longest = train.envelope_cycles * max(swing.period(index) for swing in train.swings)
        if quiet is not None:
            reach = quiet + CENTER_MARGIN_S
            rise, fall = min(longest, before), min(longest, after)
            if time - rise < middle + reach and time + length + fall > middle - reach:
                time, before = middle + reach + rise, rise
        for swing in train.swings:
            period = swing.period(index)
            ease = train.envelope_cycles * period
            lag = swing.lag(index) if isinstance(swing, PhasedOscillation) else 0.0
            cycles = train.cycles_of(swing, index) if isinstance(train, Combined) else train.cycles
            eases = min(ease, before), min(ease, after)
            out.append(ScheduledOscillation(i, swing.axis, time + lag, period, cycles, swing.amplitude(index), *eases))
        end = time + length
        time = end + train.rest_s
    out.sort(key=lambda planned: planned.start_s - planned.ease_in_s)
    return out, end


def _share(one: Train | Combined, other: Train | Combined) -> bool:
    """Whether two trains swing one axis."""
    return bool({swing.axis for swing in one.swings} & {swing.axis for swing in other.swings})


def needed_s(pattern: LegPattern, index: int, leg_s: float) -> float:
    """Return the time that the maneuvers of a leg take from its beginning, with the rest after the last [s]."""
    _, end = schedule(pattern, index, leg_s)
    return end + pattern.maneuvers[-1].rest_s if pattern.maneuvers else pattern.lead_s
