"""Read an ASEG-GDF2 export with a public reader, ``aseg_gdf2``, in an environment of its own.

Run ``python tests/benchmarks/foreign_gdf2.py [--json]``. It needs an older pandas and dask than the rest here, so it
is no dependency: pip installs it into a temporary folder, from a package index. Every number must be read within half
of its last printed digit.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

import magsim
from magsim import columns
from magsim.exchange import export
from tests.benchmarks.rows import Row, at_most, finish, stated

PACKAGE = "aseg_gdf2==0.8"
READER = """\
import json, sys
import aseg_gdf2, numpy
opened = aseg_gdf2.read(sys.argv[1])
table = opened.df()
numpy.save(sys.argv[2], table.to_numpy(dtype=float))
(kind,) = opened.record_types.values()
json.dump([[field["name"], field["format"], field["unit"]] for field in kind["fields"]], open(sys.argv[3], "w"))
"""


def measured(folder: Path) -> list[Row]:
    """Export a flight of the shipped calibration, have it read, compare."""
    recording = magsim.simulate(magsim.load_scenario("calibration_c208b"))
    dat, _ = export([(1, recording)], "gdf2", folder / "flight.dat")
    venv.create(folder / "venv", with_pip=True)
    python = folder / "venv" / "bin" / "python"
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", PACKAGE]
    subprocess.run(pip, check=True, stdout=sys.stderr)
    names = ["values.npy", "fields.json"]
    subprocess.run([str(python), "-W", "ignore", "-c", READER, str(dat), *names], check=True, cwd=folder)
    values = np.load(folder / names[0], allow_pickle=False)
    fields = json.loads((folder / names[1]).read_text())
    places = {name: int(form.partition(".")[2] or 0) for name, form, _ in fields}
    read = dict(zip(places, values.T, strict=True))
    wanted = {"time_s": recording.time_s} | {name: recording[name] for name in recording.data}
    missing = len(set(wanted) ^ (set(read) - {"line"}))
    worst = max(np.abs(read[n] - true).max() / (0.5 * 10.0 ** -places[n]) for n, true in wanted.items() if n in read)
    units = sum((unit or "1") != columns.find(n).unit for n, _, unit in fields if n in recording.data)
    return [
        stated("fields", len(fields), "1"),
        stated("rows", len(values), "1"),
        at_most("rows_missing", abs(len(values) - len(recording)), "1", 0),
        at_most("fields_missing", missing, "1", 0),
        at_most("units_that_differ", units, "1", 0),
        # a millionth for what the printing itself rounds
        at_most("largest_error_in_half_digits", worst, "1", 1.000001),
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = measured(Path(folder))
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
