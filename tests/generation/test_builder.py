"""Builds of data sets: the same bytes for any number of processes, completely or not at all."""

import os
import re
import shutil
import subprocess
import sys
import time

from magsim import Dataset, assets
from magsim.dataset import MANIFEST
from magsim.generation import builder as building
from magsim.generation import flying
from magsim.generation.description import statistics
from magsim.generation.description.samples import SAMPLES
from tests.support.paths import ROOT
from tests.support.tiny_dataset import FLOWN, bytes_of, change, run


def test_the_files_of_a_build(made):
    assert sorted(bytes_of(made / "data")) == [
        "README.md",
        "croissant.json",
        "manifest.json",
        "one.h5",
        "statistics.csv",
        "two.h5",
    ]
    for name in ("README.md", "croissant.json", "manifest.json", "statistics.csv"):
        assert (made / "data" / name).read_bytes() == (made / "tiny" / name).read_bytes()
    dataset = Dataset(made / "data", check=True)
    assert {name: dict(info.splits) for name, info in dataset.flights.items()} == {
        "learn": {"train": 401},
        "judge": {"test": 401},
        "more": {"test": 401},
    }
    assert [dataset[name].meta["seed"] for name in dataset.flights] == [5, 6, 7]
    text = b"".join(bytes_of(made / "data").values()) + b"".join(bytes_of(made / "tiny").values())
    assert str(made).encode() not in text


def test_two_processes_write_the_same_bytes(made, tmp_path, capsys):
    code, out, err = run(capsys, "build", f"{made}/tiny", "-o", f"{tmp_path}/data", "--jobs", "2")
    assert (code, out) == (0, f"{tmp_path}/data: 2 files, identical in every byte to the manifest\n")
    assert err.splitlines() == [f"{n}/3 {name}: 401 rows, 40 s of flight" for n, name in enumerate(FLOWN, start=1)]
    assert bytes_of(tmp_path / "data") == bytes_of(made / "data")


def test_splits_that_the_recipe_does_not_list(here, monkeypatch, capsys):
    change(monkeypatch, "more", "split", lambda values: values.__setitem__(slice(100), 0.0))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other", "-q")
    assert code == 3
    assert err.startswith("flight more: its rows have the splits test, train; the recipe states test (")


def test_renewing_writes_the_reference_of_the_next_build(here, monkeypatch, capsys):
    before = bytes_of(here / "tiny")
    change(monkeypatch, "more", "mag_cabin_nt", lambda values: values.__iadd__(1.0))
    assert run(capsys, "build", "./tiny", "-o", "other", "-q")[0] == 3
    assert bytes_of(here / "tiny") == before
    assert run(capsys, "build", "./tiny", "-o", "other", "-q", "--renew")[0] == 0
    after = bytes_of(here / "tiny")
    changed = {name for name in before if after[name] != before[name]}
    assert changed == {MANIFEST, SAMPLES, statistics.STATISTICS, "croissant.json", "README.md"}
    assert run(capsys, "build", "./tiny", "-o", "third", "-q")[0] == 0


def test_an_installed_package_is_never_written_to(here, monkeypatch, capsys):
    package = here / "site" / "magsim" / "_assets"
    shutil.copytree(here / "tiny", package / "datasets" / "tiny")
    (package / "aircraft").symlink_to(assets.ROOT / "aircraft")
    monkeypatch.setattr(assets, "ROOT", package)
    before = bytes_of(package / "datasets" / "tiny")
    code, _, err = run(capsys, "build", "tiny", "--renew")
    assert code == 2
    assert "is part of the installed package; --renew is for a checkout" in err
    assert bytes_of(package / "datasets" / "tiny") == before
    assert not (here / "data" / "tiny").exists()


def test_a_target_with_other_files_is_never_replaced(here, capsys):
    code, _, err = run(capsys, "build", "./tiny", "-o", "data", "-q")
    assert (code, err) == (2, f"{here / 'data'} exists already; --force replaces it\n")
    assert run(capsys, "build", "./tiny", "-o", "data", "-q", "--force")[0] == 0
    (here / "data" / "thesis.txt").write_text("mine")
    code, _, err = run(capsys, "build", "./tiny", "-o", "data", "-q", "--force")
    assert code == 2
    assert "holds files that no build of a data set wrote: thesis.txt" in err
    assert (here / "data" / "thesis.txt").read_text() == "mine"


def test_too_little_space_is_reported_before_anything_is_flown(here, monkeypatch, capsys):
    monkeypatch.setattr(flying, "fly", None)
    monkeypatch.setattr(building.shutil, "disk_usage", lambda _path: shutil._ntuple_diskusage(10, 9, 1000))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other")
    assert code == 2
    target = re.escape(str(here / "other"))
    assert re.fullmatch(rf"cannot write {target}: it needs \d\.\d MB, and 0.0 MB are free\n", err)


def test_a_flight_that_fails_leaves_nothing(here, monkeypatch, capsys):
    monkeypatch.undo()
    monkeypatch.chdir(here)
    shutil.rmtree(here / "data")
    for name in (MANIFEST, SAMPLES):
        (here / "tiny" / name).unlink()
    recipe = (here / "tiny" / "recipe.toml").read_text()
    far = '"seed=7", "flight.flaps=[{deflection_deg=10.0, leg=1, after_s=3000.0}]"'
    (here / "tiny" / "recipe.toml").write_text(recipe.replace('"seed=7"', far))
    code, out, err = run(capsys, "build", "./tiny", "-q")
    assert (code, out) != (0, "")
    assert all(line.startswith("flight more: ") for line in err.splitlines()), err
    assert [path.name for path in (here / "data").iterdir()] == []


def test_a_killed_build_leaves_no_partial_data_and_no_process(made, here, capsys):
    code = (
        "import multiprocessing, threading, time\n"
        "from magsim.cli import main\n"
        "def report():\n"
        "    while len(multiprocessing.active_children()) < 2: time.sleep(0.02)\n"
        "    print('both fly', flush=True)\n"
        "threading.Thread(target=report, daemon=True).start()\n"
        "main(['dataset', 'build', './tiny', '-o', 'other', '--jobs', '2', '-q'])"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    builder = subprocess.Popen(
        [sys.executable, "-c", code], cwd=here, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert builder.stdout.readline() == b"both fly\n"
    time.sleep(0.5)
    builder.kill()
    # its processes hold the other end of the pipe: this ends when the last of them is gone
    assert builder.communicate(timeout=60.0)[0] == b""
    assert not (here / "other").exists()
    assert len(list(here.glob(".*.part"))) == 1
    assert run(capsys, "build", "./tiny", "-o", "other", "-q")[0] == 0
    assert not list(here.glob(".*"))
    assert bytes_of(here / "other") == bytes_of(made / "data")
