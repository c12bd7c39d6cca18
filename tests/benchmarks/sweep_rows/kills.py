"""Workers and drivers that are killed at random moments: what is flown again, and what comes out."""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import psutil

from magsim.sweep.journal import JOURNAL, Journal
from tests.benchmarks.rows import Row, at_least, at_most
from tests.support.paths import ROOT
from tests.support.sweep_runs import run
from tests.support.sweeps import bytes_of, sweep_file

KILLS = 20
FLIGHTS = 240
SHARD = 2


def rows() -> Sequence[Row]:
    """Kill a worker, then a driver, in turn, and resume."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = sweep_file(folder, flights=FLIGHTS, shard=SHARD)
        first = run(path, folder / "whole", workers=2)
        killed = _disturbed(path, folder / "killed", random.Random(7))
        last = run(path, folder / "killed", workers=2)
        redone = _redone(folder / "killed")
        same = last.digest == first.digest and bytes_of(folder / "killed") == bytes_of(folder / "whole")
    return [
        at_least("kills", killed, "processes, workers and drivers in turn", KILLS),
        at_most("kill_digests_that_differ", float(not same), "", 0),
        at_most("shards_redone_per_kill", redone / killed, "1", 1.0),
    ]


def _redone(folder: Path) -> int:
    """Count how often a shard was begun again."""
    journal = Journal(folder)
    records = [journal.read(shard) for shard in journal.shards()]
    return sum(record.attempts - 1 for record in records if record is not None)


def _disturbed(path: Path, folder: Path, chance: random.Random) -> int:
    """Kill until enough is killed, or all is flown; return how often."""
    kills, driver = 0, None
    while kills < KILLS and len(Journal(folder).shards()) < FLIGHTS // SHARD:
        if driver is None or driver.poll() is not None:
            driver = _start(path, folder)
        time.sleep(chance.uniform(0.3, 2.0))
        workers = [
            process
            for process in psutil.Process(driver.pid).children(recursive=True)
            if any(descriptor.path.endswith(".log") for descriptor in _files(process))
        ]
        if kills % 2 == 0:
            if not workers:
                continue
            os.kill(chance.choice(workers).pid, signal.SIGKILL)
        else:
            driver.kill()
            driver.wait()
        kills += 1
    if driver is not None:
        driver.kill()
        driver.wait()
    return kills


def _start(path: Path, folder: Path) -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-m", "magsim", "sweep", str(path), "-o", str(folder), "-w", "2", "-q", "--resume"]
    driver = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=ROOT)
    while driver.poll() is None and not list(folder.glob(f"{JOURNAL}/*.log")):
        time.sleep(0.05)
    return driver


def _files(process: psutil.Process) -> list:
    try:
        return process.open_files()
    except psutil.Error:
        return []
