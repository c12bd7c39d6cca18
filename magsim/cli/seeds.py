"""Several trainings of one command at a time, one for each seed: each is that command with a seed and a folder."""

import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click

from magsim import forking
from magsim.errors import DataError, RequestError


def train_seeds(
    arguments: Sequence[str], seeds: Sequence[int], folder: Path, *, workers: int | None, resume: bool
) -> None:
    """Run ``magsim train`` once for each seed, into ``FOLDER/seed_N``, several at a time.

    Each has one thread, and its lines begin with its seed. One that fails leaves the others alone.

    Parameters
    ----------
    arguments : sequence of str
        Of ``magsim train``, without seed, output and resume.
    seeds : sequence of int
    folder : Path
    workers : int, optional
        Trainings at a time; by default one a core.
    resume : bool
        Continue those that were begun.

    Raises
    ------
    MagsimError
        If one has failed, at the end.
    """
    started: list[subprocess.Popen[str]] = []

    def run(seed: int) -> int:
        own = folder / f"seed_{seed}"
        command = [sys.executable, "-m", "magsim", "train", *arguments, "--seed", str(seed), "-o", str(own)]
        command += ["--resume"] if resume and own.exists() else []
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
            started.append(process)
            assert process.stdout is not None
            for line in process.stdout:
                click.echo(f"seed {seed}: {line.rstrip()}", err=True)
        return process.returncode

    with forking.one_thread(), ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        try:
            codes = dict(zip(seeds, pool.map(run, seeds), strict=True))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in started:
                process.terminate()
            raise
    failed = [seed for seed, code in codes.items() if code]
    if failed:
        asked_wrong = all(codes[seed] == RequestError.exit_code for seed in failed)
        msg = f"{folder}: training failed with seed {', '.join(map(str, failed))}"
        raise RequestError(msg) if asked_wrong else DataError(msg)
