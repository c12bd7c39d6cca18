"""Sets of flights that physics methods are shown on: flown by the sweep files beside this module, and read back."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from magsim import columns, sweep
from magsim.recording import Recording, read_recordings

HERE = Path(__file__).parent

LEVELS = ("0", "1", "2", "3", "4", "5", "6", "0c", "1c", "7", "8", "6m")
"""Worlds of ``levels.toml`` in its order."""

ROLES = ("train", "train2", "test")

HARD = (
    "field.crust.enabled=true",
    "field.crust.rms_nt=60.0",
    "field.crust.depth_m=100.0",
    "field.variation.enabled=true",
    "field.electronics.enabled=true",
    "sensors.scalar[0].noise_nt_rthz=0.0045",
    "sensors.fluxgate[0].noise_nt_rthz=0.045",
    "sensors.fluxgate[0].offset_nt=[40.0, -50.0, 60.0]",
    "sensors.fluxgate[0].scale_error=[0.01, -0.008, 0.006]",
    "sensors.fluxgate[0].nonorthogonality_deg=[0.5, -0.4, 0.6]",
    "sensors.fluxgate[0].misalignment_deg=[0.6, -0.5, 0.8]",
    "sensors.fluxgate[0].skew_s=0.15",
)
"""What level 6m of ``levels.toml`` has beyond ``calibration_c208b``."""

STINGER = (
    'sensors.scalar=[{name="cabin", mount="cabin_center", noise_nt_rthz=0.004}, {name="stinger", mount="sgl_mag_1"}]'
)


DEPARTURE = "field.earth.departure.enabled=true"


class World(NamedTuple):
    """What ``honest.toml`` is flown with, and the scalar magnetometers that are judged."""

    scenario: str
    settings: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ("cabin",)


WORLDS: Mapping[str, World] = {
    "calibration": World("calibration_c208b", (STINGER,), ("cabin", "stinger")),
    "calm": World("calibration_c208b_calm"),
    "electronics": World("electronics_c208b", (), ("cabin", "ceiling", "stinger")),
    "gusty": World("gusty_c208b"),
    "fom": World("papers/001_fom", ("pattern.circuits=2",), ("boom",)),
    "6m": World("calibration_c208b", HARD),
}


class Draw(NamedTuple):
    """Seed of the sweeps, how many sets of the levels and of a world, a world's first individual and first seed."""

    seed: int
    sets: int
    honest_sets: int
    individual: int
    flight: int


DRAWS: Mapping[str, Draw] = {"tune": Draw(1401, 6, 6, 101, 1001), "show": Draw(1402, 12, 8, 1, 2001)}
"""``tune``: what settings are chosen on; ``show``: what figures come from, as the sweep files stand."""


class Triple(NamedTuple):
    """Flights of one set in one world: two to learn from, one to be judged on."""

    train: Recording
    train2: Recording
    test: Recording


class Days(NamedTuple):
    """Flights of one honest set, each with a circuit to learn from and one to be judged on.

    The nominal aircraft as it is shipped, without anybody aboard; an individual with people in it, the same on another
    day, and another individual.
    """

    nominal: Recording
    first: Recording
    later: Recording
    other: Recording


Report = Callable[[str], None]


def fly_levels(folder: Path, draw: Draw, report: Report, *, workers: int = 1) -> Path:
    """Fly the sets of all levels into a folder, or go on where that was broken off; return the folder.

    A finished folder is taken as it is.
    """
    size = len(LEVELS) * len(ROLES)
    settings = [f"sweep.seed={draw.seed}", f"sweep.flights={draw.sets * size}"]
    return _fly("levels.toml", settings, folder, report, workers)


def fly_world(folder: Path, world: str, draw: Draw, report: Report, *, workers: int = 1) -> Path:
    """Fly the sets of one honest world into two folders of a folder, ``nominal`` and ``days``; see ``fly_levels``."""
    for part, settings in (("nominal", nominal_settings(world, draw)), ("days", days_settings(world, draw))):
        _fly("honest.toml", settings, folder / part, report, workers)
    return folder


def days_settings(world: str, draw: Draw) -> list[str]:
    """Return what makes an honest world of ``honest.toml``: individuals, each on two days."""
    numbers = range(2 * draw.honest_sets)
    return _settings(
        WORLDS[world],
        draw.seed,
        individuals=[draw.individual + number // 2 for number in numbers],
        on_days=[1 + number % 2 for number in numbers],
        seeds=[draw.flight + number for number in numbers],
    )


def nominal_settings(world: str, draw: Draw) -> list[str]:
    """Return what makes an honest world of ``honest.toml``: the nominal aircraft, one flight in each file."""
    zeros, numbers = [0] * draw.honest_sets, range(draw.honest_sets)
    seeds = [draw.flight + 100 + number for number in numbers]
    return [*_settings(WORLDS[world], draw.seed, individuals=zeros, on_days=zeros, seeds=seeds), "sweep.shard=1"]


def _settings(
    world: World, seed: int, *, individuals: Sequence[int], on_days: Sequence[int], seeds: Sequence[int]
) -> list[str]:
    return [
        f"sweep.scenario={world.scenario}",
        f"sweep.set={json.dumps([DEPARTURE, *world.settings])}",
        f"sweep.seed={seed}",
        f"sweep.flights={len(seeds)}",
        f"sweep.axes[0].list={individuals}",
        f"sweep.axes[1].list={on_days}",
        f"sweep.axes[2].list={seeds}",
    ]


def _fly(name: str, settings: Sequence[str], folder: Path, report: Report, workers: int) -> Path:
    if (folder / "index.parquet").exists():
        return folder
    report(f"flying {name} into {folder}")
    plan = sweep.read_sweep(HERE / name, settings)
    outcome = sweep.fly(plan, folder, workers=workers, resume=folder.exists())
    assert outcome is not None  # it was not flown in parts
    return folder


def sets(folder: Path, level: str, count: int | None = None) -> Iterator[Triple]:
    """Yield the sets of one level, all or the first ones, one after another."""
    digit = LEVELS.index(level)
    for number, path in enumerate(_files(folder)[:count]):
        first = number * len(LEVELS) * len(ROLES) + digit
        names = [f"f{first + role * len(LEVELS):08d}" for role in range(len(ROLES))]
        train, train2, test = read_recordings(path, names)
        yield Triple(train, train2, judged(test))


def days(folder: Path, count: int | None = None) -> Iterator[Days]:
    """Yield the sets of an honest world, all or the first ones; the other individual is that of the next set."""
    files = _files(folder / "days")
    for number, (path, beside) in enumerate(zip(files, _files(folder / "nominal"), strict=True)):
        if number == count:
            return
        (nominal,) = read_recordings(beside)
        first, later = read_recordings(path)
        other, _ = read_recordings(files[(number + 1) % len(files)])
        yield Days(nominal, first, later, other)


def judged(recording: Recording) -> Recording:
    """Return a recording all rows of which are for testing."""
    code = next(number for number, word in columns.SPLITS.items() if word == "test")
    return replace(recording, data={**recording.data, "split": np.full(len(recording), float(code))})


def _files(folder: Path) -> list[Path]:
    return sorted(folder.glob("shard_*.h5"))
