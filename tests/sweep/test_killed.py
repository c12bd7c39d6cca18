"""Drivers that are killed, and clusters whose workers are: resumed, the bytes are those of an undisturbed run."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import dask
import psutil
import pytest

from magsim import sweep as room
from magsim.errors import DataError, RequestError
from magsim.sweep.journal import Journal
from magsim.sweep.workers.cluster import LOOPBACK, cluster_workers
from tests.support.sweeps import bytes_of, fly, sweep_file


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[room.SweepPlan, Path, str]:
    """A sweep of 24 flights in twelve files, undisturbed: plan, folder, digest."""
    folder = tmp_path_factory.mktemp("flown")
    plan = room.read_sweep(sweep_file(folder, flights=24))
    return plan, folder / "out", fly(plan, folder / "out").digest


def test_a_killed_driver_is_resumed_on_another_number_of_workers(flown: tuple, tmp_path: Path) -> None:
    plan, folder, digest = flown
    command = [sys.executable, "-m", "magsim", "sweep", plan.file.source, "-o", str(tmp_path / "out"), "-w", "2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as driver:
        while not list((tmp_path / "out" / "journal").glob("*.json")) and driver.poll() is None:
            time.sleep(0.02)
        assert driver.poll() is None
        driver.send_signal(signal.SIGKILL)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("*.h5")}
    assert kept
    command = [*command[:-1], "3", "--resume"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert digest in ended.stdout
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert bytes_of(tmp_path / "out") == bytes_of(folder)


def test_a_driver_that_is_asked_to_end_ends_every_process_and_says_how_to_go_on(flown: tuple, tmp_path: Path) -> None:
    plan, _, _ = flown
    command = [sys.executable, "-m", "magsim", "sweep", plan.file.source, "-o", str(tmp_path / "out"), "-w", "2"]
    command += ["--set", "sweep.flights=2000"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as driver:
        journal = Journal(tmp_path / "out")
        while not any(journal.begun(shard) for shard in range(12)) and driver.poll() is None:
            time.sleep(0.02)
        family = psutil.Process(driver.pid).children(recursive=True)
        driver.send_signal(signal.SIGTERM)  # an interrupt is ignored where tests run in the background
        _, errors = driver.communicate(timeout=60)
    assert driver.returncode == 143
    assert "what has been flown is kept; --resume goes on with it" in errors
    assert "Traceback" not in errors
    _, alive = psutil.wait_procs(family, timeout=10)
    assert not alive


def test_a_cluster_of_two_one_of_them_killed(flown: tuple, tmp_path: Path) -> None:
    plan, folder, digest = flown
    journal = room.open_folder(plan, tmp_path / "out")
    workers = cluster_workers(None, 2)
    killed: list[int] = []

    def kill(_progress: room.SweepProgress) -> None:
        if not killed and any(number >= 0 for shard in range(12) for number in journal.begun(shard)):
            killed.append(next(iter(workers.cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    room.run(plan, journal, workers, report=kill)
    outcome = room.finish(plan, journal)
    assert killed
    assert outcome is not None
    assert outcome.digest == digest
    assert bytes_of(tmp_path / "out") == bytes_of(folder)


def test_a_cluster_listens_on_the_loopback_interface_alone() -> None:
    workers = cluster_workers(None, 1)
    try:
        family = [psutil.Process(), *psutil.Process().children(recursive=True)]
        places = [c.laddr.ip for process in family for c in process.net_connections() if c.status == psutil.CONN_LISTEN]
        # scheduler, dashboard, nanny and worker
        assert len(places) >= 4
        assert set(places) == {LOOPBACK}
    finally:
        workers.close(at_once=False)


def test_a_scheduler_that_does_not_answer_is_told() -> None:
    with pytest.raises(RequestError, match="no dask scheduler answers"):
        cluster_workers("tcp://127.0.0.1:9", None, connect_s=1.0)


def test_a_scheduler_that_is_lost_ends_the_sweep_in_one_line(flown: tuple, tmp_path: Path) -> None:
    plan, _, digest = flown
    journal = room.open_folder(plan, tmp_path / "out")
    with dask.config.set({"distributed.comm.timeouts.connect": "2s"}):
        workers = cluster_workers(None, 1)
    lost: list[bool] = []

    def lose(_progress: room.SweepProgress) -> None:
        if not lost:
            lost.append(True)
            workers.cluster.sync(workers.cluster.scheduler.close)

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "2s"}),
        pytest.raises(DataError, match="the connection to the dask scheduler was lost"),
    ):
        room.run(plan, journal, workers, report=lose)
    assert fly(plan, tmp_path / "out").digest == digest
