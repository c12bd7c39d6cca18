"""Windows per second and memory of the torch loader over 1000 flights, beside MosaicML Streaming on the same windows.

Run ``python tests/benchmarks/loader_speed.py [--json] [--flights N] [--environment FOLDER]``. One short flight is
simulated and written 1000 times, under other names and with noise, as the shards of a sweep with their index. Streaming
wants an older numpy, so pip installs it into a temporary folder, from a package index, or it is in FOLDER already.

Both give batches of 256 windows of 320 rows, 10 inputs and a target in float32, from files in the system's cache, by
two workers that stay alive. Both shuffle files first and then the windows of blocks of the same size (``py1br``).
Streaming reads samples that were cut, picked and rounded before; magsim cuts them out of the recordings, in which
windows overlap. Each run is a process of its own, in turn; the first epoch of each warms up, and its windows must be
the same. The ratio is the median of the ratios of the pairs of runs. Memory is the median over an epoch of what the
process and its workers have in sum (PSS), and it may not grow with the number of flights.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.dataset import parquet, split_rows
from magsim.loading import load_scenario
from magsim.recording import Recording, write_recordings
from magsim.recording.windows import Windows
from magsim.simulation import simulate
from magsim.storage.checksum import checksum_state
from magsim.streams import stream
from tests.benchmarks.rows import Row, at_least, at_most, finish, stated
from tests.support.paths import ROOT
from tests.support.tiny_dataset import SCENARIO

PACKAGES = ("torch=={torch}+cpu", "mosaicml-streaming==0.13.0")
ROWS, STRIDE, BATCH, WORKERS, EPOCHS, EACH = 320, 32, 256, 2, 3, 50
INPUTS = ("mag_cabin_nt", "ins_pitch_deg", "ins_roll_deg", "ins_heading_deg")
INPUTS += tuple(f"ins_{kind}_{axis}_{unit}" for kind, unit in (("acc", "mps2"), ("rate", "dps")) for axis in "xyz")
TARGETS = ("interference_cabin_nt",)
EPOCHS_FILE = Path(__file__).with_name("loader_rows") / "epochs.py"


def flights(recording: Recording, numbers: range) -> Iterator[Recording]:
    """Copies of a flight with other names and noise on the reading and the label."""
    for number in numbers:
        rng = stream(number, "loader_speed")
        noisy = {name: recording[name] + rng.normal(size=len(recording)) for name in (INPUTS[0], *TARGETS)}
        yield replace(recording, name=f"f{number:07d}", data={**recording.data, **noisy})


def write_folder(folder: Path, recording: Recording, count: int) -> None:
    """Write shards of 50 flights and their index."""
    folder.mkdir()
    splits = split_rows(recording[columns.SPLIT.pattern])
    about = {f"{split}_rows": splits.get(split, 0) for split in columns.SPLITS.values()}
    about |= {"rows": len(recording), "duration_s": float(np.ptp(recording.time_s)), "digest": "", "seed": 0}
    index = []
    for shard, first in enumerate(range(0, count, EACH)):
        numbers = range(first, min(first + EACH, count))
        path = folder / f"shard_{shard:06d}.h5"
        write_recordings(path, flights(recording, numbers))
        place = {"file": path.name, "sha256": checksum_state(path).digest, "flown": True, "failure": None}
        for number in numbers:
            index.append({"flight": number, "name": f"f{number:07d}", "number": number - first, **place, **about})
    parquet.write_index(folder / parquet.INDEX, index, {})


def write_arrays(folder: Path, data: Path) -> int:
    """Write all windows as arrays, (n, c, rows) float32, for Streaming's own shards."""
    files = sorted(data.glob("*.h5"))
    for name, role, names in (("x", "input", INPUTS), ("y", "label", TARGETS)):
        windows = Windows(files, rows=ROWS, role=role, names=names, stride=STRIDE)
        shape = (len(windows), len(names), ROWS)
        out = np.lib.format.open_memmap(folder / f"{name}.npy", "w+", np.float32, shape)
        for at in range(0, len(windows), 1000):
            part = np.arange(at, min(at + 1000, len(windows)))
            windows.take(part, out[part[0] : part[-1] + 1].transpose(0, 2, 1))
        out.flush()
    return len(windows)


def environment(folder: Path) -> Path:
    """Make an environment with Streaming; return its Python."""
    import torch

    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    wanted = [package.format(torch=torch.__version__.partition("+")[0]) for package in PACKAGES]
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted]
    subprocess.run(pip, check=True, stdout=sys.stderr)
    return python


def run(python: Path | str, kind: str, folder: Path, about: dict[str, object]) -> dict:
    """Run one kind in a process of its own."""
    one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT) if kind == "magsim" else ""}
    command = [str(python), "-W", "ignore", str(EPOCHS_FILE), kind, str(folder), json.dumps(about)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env={**os.environ, **one})
    return json.loads(done.stdout.splitlines()[-1]) if done.stdout.strip() else {}


def measured(folder: Path, count: int, pairs: int, given: Path | None) -> list[Row]:
    """Write the data, run both loaders in turn, compare."""
    (folder / "line.toml").write_text(SCENARIO.replace("3_000.0", "12_000.0"))
    recording = simulate(load_scenario(folder / "line.toml"))
    write_folder(folder / "data", recording, count)
    write_folder(folder / "tenth", recording, count // 10)
    windows = write_arrays(folder, folder / "data")
    size_mb = sum(path.stat().st_size for path in (folder / "data").glob("*.h5")) / 1e6
    # a third of the windows are shuffled together
    about: dict[str, object] = {"rows": ROWS, "stride": STRIDE, "batch": BATCH, "inputs": INPUTS, "targets": TARGETS}
    about |= {"workers": WORKERS, "epochs": EPOCHS, "block_mb": size_mb / 3.0, "shuffled": windows // 3}
    about["arrays"] = str(folder)
    python = environment(folder / "venv") if given is None else given / "bin" / "python"
    run(python, "shards", folder / "shards", about)
    ours, theirs = [], []
    for _ in range(pairs):
        ours.append(run(sys.executable, "magsim", folder / "data", about))
        theirs.append(run(python, "streaming", folder / "shards", about))
    # a block of the size that it has among all flights
    few = run(sys.executable, "magsim", folder / "tenth", about)
    one, other = ours[0], theirs[0]
    same = one["digest"] == other["digest"] and one["shapes"] == other["shapes"] and one["windows"] == windows
    rate, their_rate = ([statistics.median(found["rates"]) for found in runs] for runs in (ours, theirs))
    memory, their_memory = (statistics.median(found["memory_mb"] for found in runs) for runs in (ours, theirs))
    return [
        stated("flights", count, "1"),
        stated("data_mb", size_mb, "MB"),
        stated("windows", windows, "1"),
        at_most("windows_that_differ", 0 if same else 1, "1", 0),
        stated("windows_per_s", statistics.median(rate), "1/s"),
        stated("streaming_windows_per_s", statistics.median(their_rate), "1/s"),
        at_least(
            "windows_over_streaming",
            statistics.median(own / other for own, other in zip(rate, their_rate, strict=True)),
            "1",
            1.0,
        ),
        stated("first_batch_s", statistics.median(found["first_s"] for found in ours), "s"),
        stated("streaming_first_batch_s", statistics.median(found["first_s"] for found in theirs), "s"),
        stated("memory_mb", memory, "MB"),
        stated("streaming_memory_mb", their_memory, "MB"),
        at_most("memory_growth_mb", memory - few["memory_mb"], "MB", 20.0),
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--flights", type=int, default=1000)
    parser.add_argument("--pairs", type=int, default=3, help="runs of each, in turn")
    parser.add_argument("--environment", type=Path, help="a virtual environment that has MosaicML Streaming")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = measured(Path(folder), arguments.flights, arguments.pairs, arguments.environment)
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
