"""Try whether mutated and crafted recording files crash or hang the reader, or make it read other files.

Run ``python tests/benchmarks/hostile_files.py [--json] [--mutated N] [--untouched N]``. Readers are processes of their
own, which read a hundred files each: one that dies by a signal stands for a crash of a user's process. Secret files are
watched with inotify, so any open of them is counted. A file may take the limit of the child and 10 s more. A third of
the mutated files keep a checksum that no longer fits, a third have none, and a third have one that fits.
"""

import argparse
import ctypes
import multiprocessing
import os
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from magsim.errors import MagsimError
from magsim.recording import file, read_recordings
from magsim.storage import inspection
from tests.benchmarks.rows import at_least, at_most, finish, stated
from tests.support.crafted import CANARY, crafted, digest_of, mutate, recording

LIMIT_S = inspection.TIMEOUT_S + 10.0
BATCH = 100
_IN_ACCESS, _IN_OPEN, _IN_NONBLOCK = 0x1, 0x20, 0o4000


class Watch:
    """Counts how often files of a folder are opened or read, by any process."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        libc = ctypes.CDLL(None, use_errno=True)
        self._handle = libc.inotify_init1(_IN_NONBLOCK)
        for path in [*folder.iterdir()]:
            if libc.inotify_add_watch(self._handle, os.fsencode(path), _IN_ACCESS | _IN_OPEN) < 0:
                raise OSError(ctypes.get_errno(), "inotify_add_watch")
        next(iter(folder.iterdir())).read_bytes()
        if not self.seen():
            raise OSError("inotify sees nothing here")

    def seen(self) -> int:
        """Return the bytes of events since the last call; 0 if nothing was opened."""
        total = 0
        while True:
            try:
                total += len(os.read(self._handle, 65536))
            except BlockingIOError:
                return total


@dataclass
class Tally:
    """Results of reading files."""

    read: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    crashes: list[str] = field(default_factory=list)
    hangs: list[str] = field(default_factory=list)
    unclear: list[str] = field(default_factory=list)
    canaries: list[str] = field(default_factory=list)


def _read_all(paths: list[str], out: "multiprocessing.connection.Connection") -> None:
    """Read files, and send [path, result, text, seconds] for each."""
    inspection.inspect_many([Path(path) for path in paths])
    for path in paths:
        start = time.monotonic()
        try:
            found = read_recordings(Path(path))
            result = ["read", "".join(map(digest_of, found))]
            if any(np.any(column == CANARY) for flight in found for column in flight.data.values()):
                result[0] = "canary"
        except MagsimError as error:
            clear = str(error).startswith(path) and len(str(error)) > len(path) + 5 and "\n" not in str(error)
            result = ["refused" if clear else "unclear", str(error)]
        except BaseException as error:
            result = ["unclear", repr(error)]
        out.send([path, *result, time.monotonic() - start])
    out.send(None)


def _read_apart(paths: list[Path], tally: Tally) -> None:
    """Have a process read the files, and a new one the rest after a file over which it dies or hangs."""
    context = multiprocessing.get_context("spawn")
    left = [str(path) for path in paths]
    # the inspection ahead of all files of a batch may take the limit for each that hangs
    wait_s = LIMIT_S + len(left) * inspection.TIMEOUT_S
    while left:
        ours, theirs = context.Pipe(duplex=False)
        reader = context.Process(target=_read_all, args=(left, theirs))
        reader.start()
        theirs.close()
        try:
            while ours.poll(wait_s):
                answer = ours.recv()
                if answer is None:
                    left = []
                    break
                path, result, text, seconds = answer
                left.remove(path)
                if seconds > LIMIT_S:
                    tally.hangs.append(path)
                {"read": tally.read, "refused": tally.refused}.get(result, {})[path] = text
                if result in ("unclear", "canary"):
                    (tally.unclear if result == "unclear" else tally.canaries).append(f"{path}: {text[:200]}")
            else:
                tally.hangs.append(left.pop(0))
        except EOFError:
            tally.crashes.append(left.pop(0))
        reader.kill()
        reader.join()


def read_apart(paths: list[Path], readers: int = 2) -> Tally:
    """Read files in processes of their own."""
    tally = Tally()
    batches = [paths[start : start + BATCH] for start in range(0, len(paths), BATCH)]
    with ThreadPoolExecutor(readers) as pool:
        list(pool.map(lambda batch: _read_apart(batch, tally), batches))
    return tally


def write_mutated(folder: Path, count: int, seed: int = 0) -> list[Path]:
    """Write mutated copies of twenty files, of single recordings and shards."""
    rng = np.random.default_rng(seed)
    bases = []
    for number in range(20):
        path = folder / "base.h5"
        file.write(path, [recording(number + k) for k in range(1 + number % 3)])
        bases.append(path.read_bytes())
        path.unlink()
    paths = []
    for number in range(count):
        path = folder / f"mutated_{number:05d}.h5"
        path.write_bytes(mutate(bases[number % len(bases)], rng))
        paths.append(path)
    return paths


def main() -> None:
    """Write all files, shuffle them, read them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--mutated", type=int, default=4000)
    parser.add_argument("--untouched", type=int, default=200)
    arguments = parser.parse_args()
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bad = crafted(folder)
        mutated = write_mutated(folder, arguments.mutated)
        untouched = {folder / f"untouched_{number}.h5": recording(number) for number in range(arguments.untouched)}
        for path, wrote in untouched.items():
            wrote.write(path)
        paths = [*bad.values(), *mutated, *untouched]
        order = np.random.default_rng(1).permutation(len(paths))
        watch = Watch(folder / "secrets")
        tally = read_apart([paths[i] for i in order])
        opened = watch.seen()
        exact = sum(tally.read.get(str(path)) == digest_of(wrote) for path, wrote in untouched.items())
        accepted = [name for name, path in bad.items() if str(path) not in tally.refused]
        names = Counter("read" if str(path) in tally.read else "refused" for path in mutated)
        for text in [*tally.crashes, *tally.hangs, *tally.unclear, *tally.canaries, *accepted]:
            sys.stderr.write(text + "\n")
    finish(
        [
            at_most("crashes", len(tally.crashes), "1", 0),
            at_most("foreign_reads", len(tally.canaries) + opened, "1", 0),
            at_most("hangs", len(tally.hangs), "1", 0),
            at_least("untouched_read_ok", exact, "1", arguments.untouched),
            at_most("refusals_without_a_clear_message", len(tally.unclear), "1", 0),
            at_most("crafted_accepted", len(accepted), "1", 0),
            stated("crafted", len(bad), "1"),
            stated("mutated_refused", names["refused"], "1"),
            stated("mutated_read", names["read"], "1"),
            stated("elapsed_s", time.perf_counter() - start, "s"),
        ],
        as_json=arguments.json,
    )


if __name__ == "__main__":
    main()
