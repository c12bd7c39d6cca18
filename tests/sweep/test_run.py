"""Sweeps that are flown: the same bytes however they are flown, and nothing lost."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from magsim import Dataset, simulate
from magsim import sweep as room
from magsim.errors import DataError, RequestError
from magsim.loading import load_scenario
from magsim.recording import read_recordings
from tests.support.sweeps import bytes_of, fly, sweep_file


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[room.SweepPlan, Path, str]:
    """A sweep of eight flights, undisturbed: plan, folder, digest."""
    folder = tmp_path_factory.mktemp("flown")
    plan = room.read_sweep(sweep_file(folder))
    return plan, folder / "out", fly(plan, folder / "out").digest


def test_the_folder_is_a_data_set_of_the_flights_that_were_asked_for(flown: tuple) -> None:
    plan, folder, _ = flown
    dataset = Dataset(folder, check=True)
    flights = {flight.name: flight for flight in plan.space.flights(0, 8)}
    assert list(dataset.flights) == list(flights)
    for recording in dataset:
        flight = flights[recording.name]
        assert recording.meta["overrides"] == list(plan.overrides(flight))


def test_a_flight_is_the_one_that_generate_flies_with_its_settings(flown: tuple, tmp_path: Path) -> None:
    _, folder, _ = flown
    recording = read_recordings(folder / "shard_00000001.h5")[1]
    text = tmp_path / "line.toml"
    text.write_text(recording.meta["scenario_text"], encoding="utf-8")
    again = simulate(load_scenario(text, recording.meta["overrides"]))
    assert again.meta["digest"] == recording.meta["digest"]
    for name in recording.data:
        np.testing.assert_array_equal(again[name], recording[name])


def test_the_index_tells_what_varied_and_where_it_lies(flown: tuple) -> None:
    plan, folder, _ = flown
    index = pd.read_parquet(folder / "index.parquet")
    assert list(index["flight"]) == [flight.number for flight in plan.space.flights(0, 8)]
    for row in index.to_dict("records"):
        recording = read_recordings(folder / row["file"])[row["number"]]
        assert recording.name == row["name"]
        assert len(recording) == row["rows"] == row["train_rows"]
        assert f"start.heading_deg={row['start.heading_deg']!r}" in recording.meta["overrides"]
        assert row["interference_std_nt.cabin"] == np.std(recording["interference_cabin_nt"])


@pytest.mark.parametrize(("workers", "parts"), [(1, 1), (2, 3)])
def test_workers_and_parts_leave_the_same_bytes(flown: tuple, tmp_path: Path, workers: int, parts: int) -> None:
    plan, folder, digest = flown
    journal = room.open_folder(plan, tmp_path / "out", shared=True)
    for part in range(parts, 1, -1):
        room.run(plan, journal, room.LocalWorkers(workers), part=(part, parts))
        assert room.finish(plan, journal) is None
    assert fly(plan, tmp_path / "out", workers=workers, part=(1, parts)).digest == digest
    assert bytes_of(tmp_path / "out") == bytes_of(folder)


def test_what_is_finished_is_not_flown_again(flown: tuple, tmp_path: Path) -> None:
    plan, folder, digest = flown
    journal = room.open_folder(plan, tmp_path / "out")
    begun: list[int] = []

    class Stop(Exception):
        """Ends a run from its report."""

    def stop(progress: room.SweepProgress) -> None:
        begun.append(progress.done)
        if progress.done >= 2:
            raise Stop

    with pytest.raises(Stop):
        room.run(plan, journal, room.LocalWorkers(1), report=stop)
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("*.h5")}
    assert kept
    assert fly(plan, tmp_path / "out").digest == digest
    assert {name: (tmp_path / "out" / name).stat().st_mtime_ns for name in kept} == kept
    assert bytes_of(tmp_path / "out") == bytes_of(folder)


def test_a_worker_that_is_killed_costs_its_shard_alone(flown: tuple, tmp_path: Path) -> None:
    plan, folder, digest = flown
    journal = room.open_folder(plan, tmp_path / "out")
    workers = room.LocalWorkers(2)
    first = workers.processes

    def kill() -> None:
        while not any(number >= 0 for shard in range(4) for number in journal.begun(shard)):
            time.sleep(0.01)
        os.kill(first[0], signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    room.run(plan, journal, workers)
    killer.join()
    outcome = room.finish(plan, journal)
    assert outcome is not None
    assert outcome.digest == digest
    assert bytes_of(tmp_path / "out") == bytes_of(folder)


def test_a_flight_on_which_processes_die_is_a_failure_and_the_others_are_flown(flown: tuple, tmp_path: Path) -> None:
    plan, _, _ = flown
    journal = room.open_folder(plan, tmp_path / "out")
    workers = room.LocalWorkers(1)
    killed: list[int] = []
    done = threading.Event()

    def kill() -> None:
        while not done.is_set():
            for shard in range(4):
                begun = journal.begun(shard)
                if begun and begun[-1] == 3 and len(killed) < 3:
                    killed.append(workers.processes[0])
                    os.kill(killed[-1], signal.SIGKILL)
                    while not done.is_set() and workers.processes[0] == killed[-1]:
                        time.sleep(0.005)
            time.sleep(0.002)

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        room.run(plan, journal, workers)
    finally:
        done.set()
        killer.join()
    outcome = room.finish(plan, journal)
    assert outcome is not None
    assert len(killed) == 3
    failures = pd.read_csv(tmp_path / "out" / "failures.csv")
    assert failures[["flight", "kind"]].to_numpy().tolist() == [[3, "killed"]]
    assert outcome.tally.flown == 7


def test_flights_that_cannot_be_flown_are_told_and_do_not_end_the_sweep(tmp_path: Path) -> None:
    tail = '\n[[sweep.axes]]\nkey = "start.speed_mps"\ngrid = [75.0, 30.0]\n'
    plan = room.read_sweep(sweep_file(tmp_path, tail, flights=4))
    outcome = fly(plan, tmp_path / "out")
    failures = pd.read_csv(tmp_path / "out" / "failures.csv")
    assert outcome.tally.flown == 2
    assert failures["start.speed_mps"].tolist() == [30.0, 30.0]
    assert (failures["kind"] == "refused").all()
    assert failures["reason"].str.contains("start.speed_mps").all()
    index = pd.read_parquet(tmp_path / "out" / "index.parquet")
    assert index["flown"].tolist() == [True, True, False, False]
    with pytest.raises(DataError, match=r"2 flights failed; allowed: at most 1 \(--max-failures\)"):
        fly(plan, tmp_path / "bounded", workers=1, max_failures=1)


def test_another_sweep_does_not_go_on_in_the_folder(flown: tuple, tmp_path: Path) -> None:
    plan, folder, _ = flown
    with pytest.raises(RequestError, match="holds a sweep already; --resume goes on with it"):
        room.open_folder(plan, folder)
    other = room.read_sweep(sweep_file(tmp_path), ["sweep.seed=6"])
    with pytest.raises(DataError, match="was begun with another sweep file"):
        room.open_folder(other, folder, resume=True)
    fewer = room.read_sweep(sweep_file(tmp_path), ["sweep.flights=4"])
    with pytest.raises(DataError, match="was begun with 8 flights, not 4; allowed: as many, or more"):
        room.open_folder(fewer, folder, resume=True)
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "mine.txt").write_text("text", encoding="utf-8")
    with pytest.raises(RequestError, match="notes holds something else than a sweep"):
        room.open_folder(plan, tmp_path / "notes", resume=True)


def test_more_flights_are_added_to_a_finished_sweep(flown: tuple, tmp_path: Path) -> None:
    small = room.read_sweep(sweep_file(tmp_path, flights=6, shard=4))
    fly(small, tmp_path / "grown")
    large = room.read_sweep(sweep_file(tmp_path, flights=8, shard=4))
    grown = fly(large, tmp_path / "grown").digest
    assert grown == fly(large, tmp_path / "whole").digest
    assert bytes_of(tmp_path / "grown") == bytes_of(tmp_path / "whole")


LIMITED = """
import resource, signal, sys
from pathlib import Path
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY))
from magsim import sweep as room
from magsim.errors import MagsimError
plan = room.read_sweep(sys.argv[1])
folder = room.open_folder(plan, Path(sys.argv[2]))
try:
    room.run(plan, folder, room.LocalWorkers(1))
except MagsimError as error:
    print(error)
    sys.exit(error.exit_code)
"""
"""Flies a sweep whose files cannot grow beyond 60 kB: a write fails as it does on a full disk."""


def test_a_full_disk_ends_the_sweep_and_what_is_there_stays(flown: tuple, tmp_path: Path) -> None:
    plan, _, digest = flown
    command = [sys.executable, "-c", LIMITED, plan.file.source, str(tmp_path / "out")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2, ended.stderr
    assert "cannot write" in ended.stdout
    assert not list((tmp_path / "out").glob("*.h5"))
    assert not list((tmp_path / "out").glob(".*.part"))
    assert fly(plan, tmp_path / "out").digest == digest
