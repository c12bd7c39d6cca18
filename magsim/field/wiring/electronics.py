"""Onboard electronics: the currents in the aircraft's wiring, their field, and the voltages of the buses."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from magsim.aircraft.magnetics import Bus, Feeder, Magnetics
from magsim.aircraft.magnetics import feeders as model
from magsim.field.stepping import derivative
from magsim.field.wiring.loads import Steps, cycles, lagged, longest_cycle, pulses, shortened, switched
from magsim.scenario import Electronics, RecordingSettings
from magsim.streams import stream
from magsim.trajectory import Flight, Segment

SETTLED_S = 1e4
"""How long before the flight a load that is off has been off."""


@dataclass(frozen=True)
class Clock:
    """What loads go by: the times of the simulation, the flight, the seed.

    Attributes
    ----------
    time_s : (n,) [s]
        Evenly spaced.
    step_s : float [s]
    flight : Flight
    seed : int
    """

    time_s: np.ndarray
    step_s: float
    flight: Flight
    seed: int
    training_s: tuple[tuple[float, float], ...] = ()
    """Spans of the training rows."""
    least_times_on: int = 0
    """How often a load of kind duty is on in them at least."""

    @cached_property
    def controls(self) -> dict[str, np.ndarray]:
        """Deflections of the control surfaces, (n,) [rad] each."""
        return self.flight.controls_at(self.time_s)

    @property
    def start_s(self) -> float:
        """Beginning of the first step."""
        return float(self.time_s[0] - self.step_s)

    @property
    def stop_s(self) -> float:
        """End of the last step."""
        return float(self.time_s[-1] + self.step_s)

    def steps(self, times_s: np.ndarray, levels_a: np.ndarray, **lag: float) -> np.ndarray:
        """Return the mean over each step of a level, (n,) [A], settled on its first value before the flight."""
        return Steps(times_s, levels_a, **lag).mean(self.time_s, self.step_s)


def training_spans(segments: Sequence[Segment], settings: RecordingSettings) -> tuple[tuple[float, float], ...]:
    """Return the spans of the training rows of a flight [s], those that touch joined.

    A flight whose rows all have one split is one span, whichever it is: what is flown does not depend on it.
    """
    out: list[tuple[float, float]] = []
    for segment in segments:
        if settings.split is not None or settings.is_for_training(np.array(segment.circuit), np.array(segment.leg)):
            joins = bool(out) and segment.start_s <= out[-1][1] + 1e-6
            begin = out.pop()[0] if joins else segment.start_s
            out.append((begin, segment.stop_s))
    return tuple(out)


def _constant(load: model.ConstantLoad, feeder: str, clock: Clock) -> np.ndarray:
    return np.full(len(clock.time_s), load.current_a)


def _turns(current_a: float, times: np.ndarray, clock: Clock, **lag: float) -> np.ndarray:
    """Return the current of a load that is on from each even and off from each odd of the given times, (n,) [A]."""
    levels = np.zeros(len(times) + 1)
    levels[1::2] = current_a
    return clock.steps(np.append(clock.start_s - SETTLED_S, times), levels, **lag)


def _pulse(load: model.PulseLoad, feeder: str, clock: Clock) -> np.ndarray:
    times = pulses(clock.start_s, clock.stop_s, load.period_s, load.width_s, load.phase_s)
    return load.idle_a + _turns(load.current_a, times, clock, rise_s=load.rise_s)


def _lag_of(load: model.Inrush) -> dict[str, float]:
    return {"rise_s": load.rise_s, "inrush": load.inrush, "inrush_s": load.inrush_s}


def _duty(load: model.DutyLoad, feeder: str, clock: Clock) -> np.ndarray:
    rng = stream(clock.seed, f"electronics/{feeder}/duty")
    on_s, off_s = load.on_s, load.off_s
    if clock.least_times_on and clock.training_s:
        longest_s = longest_cycle(clock.training_s, clock.least_times_on) / (1.0 + load.jitter)
        on_s, off_s = shortened(on_s, off_s, longest_s)
    times = cycles(rng, clock.start_s, clock.stop_s, on_s=on_s, off_s=off_s, jitter=load.jitter)
    return _turns(load.current_a, times, clock, **_lag_of(load))


def _switch(load: model.SwitchLoad, feeder: str, clock: Clock) -> np.ndarray:
    logged = clock.flight.switches.get(load.switch)
    if logged is None:
        return np.full(len(clock.time_s), load.current_a if load.unlogged else 0.0)
    times, states = switched(clock.flight.carrier.time_s, logged)
    times[0] = clock.start_s - SETTLED_S
    return clock.steps(times, load.current_a * states, **_lag_of(load))


def _servo(load: model.ServoLoad, feeder: str, clock: Clock) -> np.ndarray:
    angle = clock.controls.get(load.surface)
    if angle is None:  # a surface that the flight does not move rests
        return np.full(len(clock.time_s), load.idle_a)
    moving = np.degrees(np.abs(derivative(angle, clock.step_s)))
    drawn = load.idle_a + load.per_dps_a * moving + load.per_deg_a * np.degrees(np.abs(angle))
    return lagged(drawn, load.rise_s, clock.step_s)


def _motor(load: model.MotorLoad, feeder: str, clock: Clock) -> np.ndarray:
    logged = clock.flight.switches.get("throttle")
    throttle = np.full(len(clock.time_s), load.unlogged)
    if logged is not None:
        throttle = np.clip(np.interp(clock.time_s, clock.flight.carrier.time_s, logged), 0.0, 1.0)
    drawn = load.idle_a + (load.full_a - load.idle_a) * throttle**load.exponent
    return lagged(drawn, load.rise_s, clock.step_s)


def _charge(load: model.ChargeLoad, feeder: str, clock: Clock) -> np.ndarray:
    since = clock.time_s + load.before_s
    return load.float_a + (load.current_a - load.float_a) * np.exp(-np.maximum(0.0, since) / load.decay_s)


MAKERS: Mapping[str, Callable[[Any, str, Clock], np.ndarray]] = {
    "constant": _constant,
    "pulse": _pulse,
    "duty": _duty,
    "switch": _switch,
    "servo": _servo,
    "motor": _motor,
    "charge": _charge,
}
"""What makes the current of each kind of load; ``sum`` is made from the others."""


def currents(feeders: tuple[Feeder, ...], clock: Clock, off: frozenset[str] = frozenset()) -> dict[str, np.ndarray]:
    """Return the current of each feeder: its mean over the step around each time, (n,) [A].

    Parameters
    ----------
    feeders : tuple of Feeder
        A sum stands after what it sums.
    clock : Clock
    off : frozenset of str
        Feeders that carry nothing.
    """
    out: dict[str, np.ndarray] = {}
    for feeder in feeders:
        load = feeder.load
        if feeder.name in off:
            out[feeder.name] = np.zeros(len(clock.time_s))
        elif isinstance(load, model.SumLoad):
            drawn = np.full(len(clock.time_s), load.current_a)
            for name in load.of:
                drawn += out[name]
            out[feeder.name] = lagged(drawn, load.rise_s, clock.step_s)
        else:
            out[feeder.name] = MAKERS[load.kind](load, feeder.name, clock)
    return out


def voltages(buses: tuple[Bus, ...], currents_a: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the voltage of each bus, (n,) [V]: that of its source less resistance times current.

    Parameters
    ----------
    buses : tuple of Bus
        One stands after the one that feeds it.
    currents_a : mapping of str to (n,) [A]
    """
    out: dict[str, np.ndarray] = {}
    for bus in buses:
        drop_v = bus.resistance_ohm * reduce(np.add, [currents_a[name] for name in bus.feeders])
        if bus.fed_by is not None:
            out[bus.name] = out[bus.fed_by] - drop_v
        elif bus.open_circuit_v is not None:
            out[bus.name] = bus.open_circuit_v - drop_v
    return out


@dataclass(frozen=True)
class Onboard:
    """Currents and voltages of a flight, (n,) each, by the names of feeders and buses."""

    currents_a: Mapping[str, np.ndarray] = field(default_factory=dict)
    voltages_v: Mapping[str, np.ndarray] = field(default_factory=dict)


def onboard(magnetics: Magnetics, settings: Electronics, clock: Clock) -> Onboard:
    """Return the currents and voltages of a flight.

    Parameters
    ----------
    magnetics : Magnetics
        Feeders and buses of the aircraft file.
    settings : Electronics
        What the scenario changes of them.
    clock : Clock
    """
    clock = replace(clock, least_times_on=settings.least_times_on)
    drawn = currents(settings.apply(magnetics.feeders), clock, settings.off)
    return Onboard(drawn, voltages(magnetics.buses, drawn))
