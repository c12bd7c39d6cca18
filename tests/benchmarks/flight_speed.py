"""What a flight costs beside a bare JSBSim run, how two processes share it, and what its rates leave out.

Run ``python tests/benchmarks/flight_speed.py [--json] [--repeat N] [--seconds S] [--flights N]``.

``cpu_over_bare_jsbsim``: CPU time of the whole flight half with its log over a bare run of the same model, rate and
length, side by side. ``two_process_scaling``: flights a second of two spawned processes over those of one, which shows
something only where two cores are free; the row by CPU time leaves out what other work takes from them.
``interpolation_error_deg``: attitude between the rows of the log at its default rate against a log of every step, in
turbulence of severity 3, of the Cessna at 3000 m and of the drone at 100 m. ``rate_convergence_deg``: attitude at
120 Hz against 960 Hz over 100 s of maneuvers. ``memory_growth_mb``: resident memory after many short flights in one
process, over that after the first tenth of them; 1000 of them with ``--flights 1000``.
"""

import argparse
import math
import multiprocessing
import statistics
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from magsim.aircraft import Aircraft, load_aircraft
from magsim.flight import fly
from magsim.flight.model.dryden import Strength
from magsim.flight.model.rates import log_rate_hz
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.weather import Weather
from magsim.flight.path.patterns import path_of
from magsim.flight.path.plane import LocalPlane
from magsim.flight.pilot.pilot import Pilot
from magsim.flight.pilot.response import UNITY
from magsim.flight.pilot.trains import SineTrain
from magsim.loading import LoadedScenario, load_scenario
from magsim.scenario import Box, Scenario
from tests.benchmarks.rows import Row, at_least, at_most, finish, stated
from tests.support.bare import bare_run, cpu_s

MEMORY = Path("/proc/self/statm")
"""File with the memory of a process, in pages, on Linux."""
STRAIGHT = PlantSetup(lat_rad=0.29, lon_rad=1.97, alt_m=3000.0, course=0.0, speed_mps=75.0)
LOW = PlantSetup(lat_rad=0.29, lon_rad=1.97, alt_m=100.0, course=0.0, speed_mps=25.0)
"""Where the drone flies."""
TRAINS = (("pitch", 5.0, 10.0), ("roll", 10.0, 33.0), ("yaw", 5.0, 56.0))
"""Axis, amplitude [deg] and start [s] of the maneuvers of the comparison of rates: a figure-of-merit set, 5 s each."""


def speed_rows(loaded: LoadedScenario, repeat: int) -> list[Row]:
    """CPU time of a flight beside a bare run, in turn."""
    carrier = fly(loaded.scenario, loaded.aircraft).carrier
    duration_s = loaded.scenario.flight.warmup_s + float(carrier.time_s[-1])
    pairs = []
    for _ in range(repeat):
        bare = cpu_s(lambda: bare_run(loaded, duration_s))
        pairs.append((cpu_s(lambda: fly(loaded.scenario, loaded.aircraft)), bare))
    flown, bare = (statistics.median(pair[i] for pair in pairs) for i in (0, 1))
    return [
        at_most("cpu_over_bare_jsbsim", statistics.median(a / b for a, b in pairs), "1", 2.0),
        stated("simulated_s_per_cpu_s", duration_s / flown, "1"),
        stated("bare_simulated_s_per_cpu_s", duration_s / bare, "1"),
    ]


def _work(name: str, seconds: float, barrier: object, out: object) -> None:
    """Fly repeatedly for a time; return the flights of this process by second of the clock and of CPU."""
    loaded = load_scenario(name)
    fly(loaded.scenario, loaded.aircraft)
    barrier.wait()
    start, start_cpu, count = time.perf_counter(), time.process_time(), 0
    while time.perf_counter() - start < seconds:
        fly(loaded.scenario, loaded.aircraft)
        count += 1
    out.put((count / (time.perf_counter() - start), count / (time.process_time() - start_cpu)))


def throughput(name: str, processes: int, seconds: float) -> np.ndarray:
    """Flights of some spawned processes together, by second of the clock and of CPU of each, (2,)."""
    context = multiprocessing.get_context("spawn")
    barrier, out = context.Barrier(processes), context.Queue()
    workers = [context.Process(target=_work, args=(name, seconds, barrier, out)) for _ in range(processes)]
    for worker in workers:
        worker.start()
    total = np.sum([out.get() for _ in workers], axis=0)
    for worker in workers:
        worker.join()
    return total


def scaling_rows(name: str, repeat: int, seconds: float) -> list[Row]:
    """Medians of two processes over one, in turn; beside it what both would do with a core each of their own."""
    ratios = [throughput(name, 2, seconds) / throughput(name, 1, seconds) for _ in range(repeat)]
    clock, cpu = np.median(ratios, axis=0)
    return [
        at_least("two_process_scaling", float(clock), "1", 1.8),
        stated("two_process_scaling_by_cpu_time", float(cpu), "1"),
    ]


def pilot_of(aircraft: Aircraft, setup: PlantSetup, log_hz: int, trains: list[SineTrain]) -> Pilot:
    """A pilot on a small box around the plane's origin."""
    path = path_of(Box(leg_m=6000.0), math.degrees(setup.course), setup.speed_mps, 4.0)
    plane = LocalPlane(setup.lat_rad, setup.lon_rad, setup.alt_m)
    return Pilot(
        aircraft.facts, setup, plane=plane, path=path, along_m=0.0, log_hz=log_hz, response=(UNITY,), trains=trains
    )


def attitude(
    aircraft: Aircraft, setup: PlantSetup, log_hz: int, duration_s: float, trains: list[SineTrain]
) -> np.ndarray:
    """Roll, pitch, heading [rad] of a flight, (n, 3)."""
    log = pilot_of(aircraft, setup, log_hz, trains).fly(lambda pilot: pilot.plant.time_s >= duration_s)
    return log.trajectory(aircraft.facts.cg_b).attitude


def interpolation_error_deg(
    aircraft: Aircraft, log_hz: int | None = None, seeds: int = 3, place: PlantSetup = STRAIGHT
) -> float:
    """Largest difference between the interpolant of a log, at its default rate if none, and the log of every step."""
    worst = 0.0
    log_hz = log_hz or log_rate_hz(aircraft.facts, place.step_hz)
    for seed in range(1, seeds + 1):
        setup = replace(place, weather=Weather(turbulence=Strength(3), seed=seed))
        pilot = pilot_of(aircraft, setup, setup.step_hz, [])
        full = pilot.fly(lambda pilot: pilot.plant.time_s >= 120.0).trajectory(aircraft.facts.cg_b)
        every = setup.step_hz // log_hz
        moderate = type(full)(
            *(getattr(full, name)[::every] for name in ("time_s", "lat_rad", "lon_rad", "alt_m")),
            *(getattr(full, name)[::every] for name in ("velocity_n", "attitude", "rate_b")),
        )
        inner = (full.time_s > 1.0) & (full.time_s < moderate.time_s[-1] - 1.0)
        found = moderate.at(full.time_s[inner]).attitude
        worst = max(worst, float(np.degrees(np.abs(found - full.attitude[inner]).max())))
    return worst


def rate_convergence_deg(aircraft: Aircraft) -> float:
    """Largest difference of attitude between 120 and 960 Hz over 100 s of maneuvers and a turn."""
    trains = [SineTrain(axis, 1, 1, start, 5.0, 3, size, 2.5, 2.5) for axis, size, start in TRAINS]
    coarse, fine = (attitude(aircraft, replace(STRAIGHT, step_hz=hz), 30, 100.0, trains) for hz in (120, 960))
    return float(np.degrees(np.abs(coarse - fine).max()))


def resident_mb() -> float:
    """Resident memory of this process [MB], where the system provides it."""
    pages = MEMORY.read_text(encoding="ascii").split()[1]
    return int(pages) * 4096 / 1e6


def memory_growth_mb(loaded: LoadedScenario, flights: int) -> float:
    """Growth of memory from the first tenth of many short flights to the last."""
    raw = loaded.scenario.model_dump(by_alias=True)
    raw["pattern"] = {"kind": "straight", "leg_m": 500.0, "lead_s": 0.0}
    raw["flight"] = raw["flight"] | {"warmup_s": 30.0}
    raw["recording"] = raw["recording"] | {"train_circuits": [1], "valid_legs": []}
    short = Scenario.model_validate(raw, context={"aircraft": loaded.aircraft})
    before = 0.0
    for count in range(1, flights + 1):
        fly(short, loaded.aircraft)
        if count == max(1, flights // 10):
            before = resident_mb()
    return resident_mb() - before


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--scenario", default="calibration_c208b_calm")
    parser.add_argument("--repeat", type=int, default=5, help="pairs of runs of which the medians are taken")
    parser.add_argument("--seconds", type=float, default=5.0, help="time that each count of processes flies")
    parser.add_argument("--flights", type=int, default=50, help="short flights for the memory row")
    arguments = parser.parse_args()

    loaded = load_scenario(arguments.scenario)
    rows = speed_rows(loaded, arguments.repeat)
    rows += scaling_rows(arguments.scenario, arguments.repeat, arguments.seconds)
    rows.append(at_most("interpolation_error_deg", interpolation_error_deg(loaded.aircraft), "deg", 0.002))
    drone = interpolation_error_deg(load_aircraft("uav"), place=LOW)
    rows.append(at_most("interpolation_error_uav_deg", drone, "deg", 0.002))
    rows.append(at_most("rate_convergence_deg", rate_convergence_deg(loaded.aircraft), "deg", 0.05))
    if MEMORY.exists():
        rows.append(at_most("memory_growth_mb", memory_growth_mb(loaded, arguments.flights), "MB", 5.0))
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
