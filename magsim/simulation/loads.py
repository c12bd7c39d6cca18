"""How often electric loads are on where a compensator learns."""

from collections.abc import Iterator, Mapping

import numpy as np

from magsim.aircraft.magnetics.feeders import DutyLoad, Feeder, PulseLoad, SwitchLoad
from magsim.loading import LoadedScenario
from magsim.trajectory import Flight
from magsim.truth import FieldTruth

ON_SHARE = 0.05
"""Part of its current above which a load is on."""


def times_on(loaded: LoadedScenario, flight: Flight, truths: Mapping[str, FieldTruth]) -> dict[str, int]:
    """Return how often each load that is switched is on in training rows, by the name of its feeder.

    Parameters
    ----------
    loaded : LoadedScenario
    flight : Flight
    truths : mapping of str to FieldTruth
        With the currents, by what carries the feeders.

    Returns
    -------
    dict of str to int
        Loads that go on and off in the recording; one that rests or is on throughout is a constant current, which need
        not be learned by itself. Empty without training rows.
    """
    out: dict[str, int] = {}
    for body, truth in truths.items():
        if not truth.currents_a:
            continue
        recorded = (truth.time_s >= 0.0) & (truth.time_s <= flight.duration_s)
        labels = flight.segment_columns(truth.time_s[recorded])
        train = loaded.scenario.recording.is_for_training(labels["circuit"], labels["leg"])
        for feeder, rest_a, drawn_a in _switched(loaded, body) if train.any() else ():
            if feeder.name not in truth.currents_a:
                continue
            on = np.abs(truth.currents_a[feeder.name][recorded] - rest_a) > ON_SHARE * abs(drawn_a)
            if on.any() and not on.all():
                out[feeder.name] = spans_touched(on, train)
    return out


def spans_touched(on: np.ndarray, wanted: np.ndarray) -> int:
    """Return how many runs of samples that are on hold at least one that is wanted, (n,) bool each."""
    number = np.cumsum(np.diff(on, prepend=False) & on)
    return len(np.unique(number[on & wanted]))


def _switched(loaded: LoadedScenario, body: str) -> Iterator[tuple[Feeder, float, float]]:
    """Yield the feeders of a body whose loads go on and off, their currents at rest, and what on adds to them [A]."""
    vehicle = loaded.bird if body == "bird" else loaded.aircraft
    if vehicle is None:
        return
    for feeder in loaded.scenario.field.electronics.apply(vehicle.magnetics.feeders):
        load = feeder.load
        if isinstance(load, DutyLoad | PulseLoad | SwitchLoad):
            yield feeder, load.idle_a if isinstance(load, PulseLoad) else 0.0, load.current_a
