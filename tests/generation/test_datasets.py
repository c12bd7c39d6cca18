"""Data sets from recipe to verdict: the same bytes whoever flies, and every difference found and named."""

import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from magsim import Dataset, assets
from magsim.cli import main
from magsim.dataset import MANIFEST
from magsim.generation import builder as building
from magsim.generation import flying
from magsim.generation.description import samples, statistics
from magsim.generation.description.samples import SAMPLES
from magsim.recording import Recording, read_recordings, write_recordings
from tests.support.paths import ROOT

SCENARIO = """\
schema = 1
seed = 5
aircraft = "c208b"
[start]
lat_deg = 16.7
lon_deg = 112.7
alt_m = 3000.0
speed_mps = 75.0
heading_deg = 60.0
[pattern]
kind = "straight"
leg_m = 3_000.0
lead_s = 0.0
[field.memory]
enabled = false
[[sensors.scalar]]
name = "cabin"
mount = "cabin_center"
[recording]
train_circuits = [1]
valid_legs = []
"""

RECIPE = """\
schema = 1
title = "Tiny"
description = "Three short lines."
date = 2026-01-02
keywords = ["lines"]
uses = ["Tests."]
limits = ["Nothing can be learned from it."]
samples = 30

[[shards]]
name = "one"
note = "both"
flights = [
    { name = "learn", scenario = "line.toml", splits = ["train"] },
    { name = "judge", scenario = "line.toml", set = ["seed=6", "recording.train_circuits=[]"], splits = ["test"] },
]

[[shards]]
name = "two"
set = ["recording.train_circuits=[]"]
flights = [{ name = "more", scenario = "line.toml", set = ["seed=7"], splits = ["test"] }]
"""

FLOWN: dict[str, Recording] = {}
"""What the recipe ``tiny`` has flown."""

ELSEWHERE = "1.0 of another machine"


def write_recipe(folder: Path) -> Path:
    folder.mkdir()
    (folder / "line.toml").write_text(SCENARIO)
    (folder / "recipe.toml").write_text(RECIPE)
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A folder with the recipe ``tiny``, its manifest, and the data that belong to it in ``data``."""
    base = tmp_path_factory.mktemp("made")
    write_recipe(base / "tiny")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flying, "fly", lambda task, fly=flying.fly: FLOWN.setdefault(task.name, fly(task)))
        code = main(["dataset", "build", f"{base}/tiny", "-o", f"{base}/data", "--renew", "--quiet"])
    assert code == 0
    return base


@pytest.fixture
def here(made, tmp_path, monkeypatch) -> Path:
    """A copy of it, where nothing is flown again."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(flying, "fly", lambda task: FLOWN[task.name])
    return tmp_path


def elsewhere(monkeypatch) -> None:
    """The machine that builds is of another kind than the manifest's."""
    real = building.fingerprint()
    monkeypatch.setattr(building, "fingerprint", lambda: real | {"numpy": ELSEWHERE})


def change(monkeypatch, name: str, column: str, how) -> None:
    """One column of one flight comes out otherwise."""
    before = flying.fly

    def fly(task) -> Recording:
        recording = before(task)
        if task.name != name:
            return recording
        values = np.array(recording[column])
        how(values)
        return replace(recording, data={**recording.data, column: values})

    monkeypatch.setattr(flying, "fly", fly)


def run(capsys, *args: str) -> tuple[int, str, str]:
    code = main(["dataset", *args])
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return code, out.out, out.err


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_what_a_build_writes(made):
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


def test_the_same_machine_must_give_the_same_bytes(here, monkeypatch, capsys):
    assert run(capsys, "build", "./tiny", "-o", "again", "-q")[:2] == (
        0,
        "again: 2 files, identical in every byte to the manifest\n",
    )
    rows = samples.sampled_rows(401, 30)
    assert {0, 400} < set(rows.tolist())
    row = int(rows[7])
    later = lambda values: values.__setitem__(slice(row, None), values[row:] + 3e-6)  # noqa: E731
    change(monkeypatch, "judge", "mag_cabin_nt", later)
    code, out, err = run(capsys, "build", "./tiny", "-o", "other", "-q")
    assert (code, out) == (3, "")
    assert err.startswith("one.h5: is not identical in every byte, though the same kind of machine made it; flight ")
    assert f"; flight judge, column mag_cabin_nt: row {row} is " in err
    assert err.endswith("so this is not the data set of tiny/manifest.json\n")
    assert not (here / "other").exists()
    assert not list(here.glob(".*"))


def test_the_same_machine_finds_a_bit_between_the_samples(here, monkeypatch, capsys):
    between = next(row for row in range(401) if row not in samples.sampled_rows(401, 30))
    bit = lambda values: values.__setitem__(between, np.nextafter(values[between], 0.0))  # noqa: E731
    change(monkeypatch, "more", "clean_cabin_nt", bit)
    code, _, err = run(capsys, "build", "./tiny", "-o", "other", "-q")
    assert code == 3
    assert "flight more, column clean_cabin_nt: by less than the digits of the rows that are kept, or between" in err
    assert "one.h5" not in err


@pytest.mark.parametrize(("by", "code"), [(5e-5, 0), (-9e-5, 0), (1.2e-4, 3), (-1.0, 3)])
def test_another_machine_must_come_close(here, monkeypatch, capsys, by, code):
    elsewhere(monkeypatch)
    change(monkeypatch, "judge", "mag_cabin_nt", lambda values: values.__iadd__(by))
    found, out, err = run(capsys, "build", "./tiny", "-o", "other", "-q")
    assert found == code
    if code:
        assert f"one.h5: flight judge, column mag_cabin_nt: row 0 is {abs(by):.3g} nT from the manifest's" in err
        assert f"made on another kind of machine: numpy {ELSEWHERE}, not " in err
        assert not (here / "other").exists()
    else:
        assert f"samples of every column agree, the largest difference is {abs(by):.2g} nT of 0.0001 allowed" in out
        assert f"another kind of machine made the manifest (numpy {ELSEWHERE}, not " in out
        assert (here / "other" / MANIFEST).read_bytes() != (here / "tiny" / MANIFEST).read_bytes()
        assert run(capsys, "check", "other", "--recipe", "./tiny")[0] == 0


@pytest.mark.parametrize(("by", "code"), [(0.005, 0), (0.05, 3)])
def test_another_machine_is_held_to_the_rows_between_by_their_sum(here, monkeypatch, capsys, by, code):
    """401 rows: 6 x 1e-4 nT x sqrt(401) = 0.012 nT."""
    elsewhere(monkeypatch)
    between = next(row for row in range(401) if row not in samples.sampled_rows(401, 30))
    change(monkeypatch, "more", "total_cabin_nt", lambda values: values.__setitem__(between, values[between] + by))
    found, _, err = run(capsys, "build", "./tiny", "-o", "other", "-q")
    assert found == code
    if code:
        assert f"two.h5: flight more, column total_cabin_nt: the sum of all rows is {by:.3g} nT from" in err


def test_segments_must_be_exact_on_any_machine(here, monkeypatch, capsys):
    elsewhere(monkeypatch)
    change(monkeypatch, "more", "leg", lambda values: values.__setitem__(-1, 2.0))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other", "-q")
    assert code == 3
    assert "two.h5: flight more, column leg: row 400 is 1 1 from the manifest's; allowed: 0" in err


def test_splits_that_the_recipe_does_not_say(here, monkeypatch, capsys):
    change(monkeypatch, "more", "split", lambda values: values.__setitem__(slice(100), 0.0))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other", "-q")
    assert code == 3
    assert err.startswith("flight more: its rows have the splits test, train; the recipe says test (")


def test_check_tells_what_was_changed(here, capsys):
    assert run(capsys, "check", "data", "--recipe", "./tiny")[:2] == (
        0,
        "data: 2 files, identical in every byte to the manifest\n",
    )
    assert run(capsys, "check", "data")[:2] == (
        0,
        "data: as manifest.json beside the files lists them; there is no recipe to compare with\n",
    )
    data = bytearray((here / "data" / "two.h5").read_bytes())
    data[-5000] ^= 1
    (here / "data" / "two.h5").write_bytes(data)
    code, _, err = run(capsys, "check", "data")
    assert code == 3
    assert err.startswith("data/two.h5: is damaged: ")


def test_check_finds_a_change_that_was_sealed_again(here, capsys):
    first, second = read_recordings(here / "data" / "one.h5")
    values = np.array(second["mag_cabin_nt"])
    values[400] += 1e-3
    forged = replace(second, data={**second.data, "mag_cabin_nt": values})
    write_recordings(here / "data" / "one.h5", [first, forged], force=True)
    code, _, err = run(capsys, "check", "data", "--recipe", "./tiny")
    assert code == 3
    assert "one.h5: is not identical" in err
    assert "flight judge, column mag_cabin_nt: row 400 is " in err
    code, _, err = run(capsys, "check", "data")
    assert code == 3
    assert "data/one.h5: is not the file that manifest.json lists: its sha256 differs" in err


def test_check_finds_files_that_are_missing_or_odd(here, capsys):
    (here / "data" / "two.h5").rename(here / "data" / "three.h5")
    code, _, err = run(capsys, "check", "data", "--recipe", "./tiny")
    assert code == 3
    assert err.splitlines()[:2] == ["two.h5: is missing", "three.h5: is not part of it"]
    code, _, err = run(capsys, "check", "data")
    assert code == 3
    assert "two.h5: is missing, manifest.json lists it" in err


def test_check_finds_statistics_of_other_data(here, capsys):
    path = here / "data" / statistics.STATISTICS
    path.write_text(path.read_text().replace(",401,", ",402,", 1))
    assert run(capsys, "check", "data")[0] == 3


def test_a_recipe_that_was_changed_since_is_told_before_anything_is_flown(here, monkeypatch, capsys):
    monkeypatch.setattr(flying, "fly", None)
    text = (here / "tiny" / "recipe.toml").read_text()
    (here / "tiny" / "recipe.toml").write_text(text.replace("seed=7", "seed=8"))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other")
    assert code == 3
    assert "was made from another recipe, scenario or aircraft than those of now (flight more)" in err
    assert "magsim dataset build tiny --renew" in err


def test_renewing_writes_what_the_next_build_is_held_against(here, monkeypatch, capsys):
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


def test_too_little_space_is_told_before_anything_is_flown(here, monkeypatch, capsys):
    monkeypatch.setattr(flying, "fly", None)
    monkeypatch.setattr(building.shutil, "disk_usage", lambda _path: shutil._ntuple_diskusage(10, 9, 1000))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other")
    assert code == 2
    target = re.escape(str(here / "other"))
    assert re.fullmatch(rf"cannot write {target}: it needs \d\.\d MB, and 0.0 MB are free\n", err)


@pytest.mark.parametrize(
    ("old", "new", "lines"),
    [
        (
            'date = 2026-01-02\nkeywords = ["lines"]',
            'dat = 2026-01-02\nkeywords = "lines"',
            [
                "tiny/recipe.toml:1: date: is missing; allowed: a date such as 2025-03-13 (when this version",
                "tiny/recipe.toml:4: dat: unknown key (did you mean 'date'?)",
                "tiny/recipe.toml:5: keywords: 'lines' is text; allowed: a list",
            ],
        ),
        (
            'name = "more", scenario = "line.toml", set = ["seed=7"], splits = ["test"]',
            'name = "learn", scenario = "lin.toml", splits = ["tset"]',
            [
                "tiny/recipe.toml:21: shards[1].flights[0].name: 'learn' is the name of another flight; allowed: each",
                "tiny/recipe.toml:21: shards[1].flights[0].splits[0]: 'tset' is not allowed; allowed: 'train', 'valid'",
            ],
        ),
        (
            'name = "more", scenario = "line.toml"',
            'name = "learn", scenario = "lin.toml"',
            [
                "tiny/recipe.toml:21: shards[1].flights[0].name: 'learn' is the name of another flight",
                "tiny/recipe.toml:21: shards[1].flights[0].scenario: tiny/lin.toml: there is no such file",
            ],
        ),
        (
            'set = ["seed=7"]',
            'set = ["seed=-7", "start.alt=3"]',
            [
                "tiny/recipe.toml:21: shards[1].flights[0].scenario: --set seed: -7 is not allowed",
                "tiny/recipe.toml:21: shards[1].flights[0].scenario: --set start.alt: unknown key (did you mean",
            ],
        ),
    ],
)
def test_mistakes_of_a_recipe_are_told_with_file_and_line(here, capsys, old, new, lines):
    text = (here / "tiny" / "recipe.toml").read_text()
    assert old in text
    (here / "tiny" / "recipe.toml").write_text(text.replace(old, new))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other")
    assert code == 2
    found = err.splitlines()
    assert [line[: len(told)] for line, told in zip(found, lines, strict=True)] == lines


def test_names_that_are_no_data_sets(here, capsys):
    (here / "Bad-Name").mkdir()
    shutil.copy(here / "tiny" / "recipe.toml", here / "Bad-Name")
    shutil.copy(here / "tiny" / "line.toml", here / "Bad-Name")
    for name, text in (
        (
            "c208b_calibratio",
            "there is no data set 'c208b_calibratio'; allowed: c208b_calibration, ladder_small, or a folder",
        ),
        ("./no", "./no: there is no such folder with a recipe.toml; allowed: "),
        ("./Bad-Name", "Bad-Name/recipe.toml:2: title: the folder's name 'Bad-Name' cannot name a data set"),
    ):
        code, _, err = run(capsys, "build", name, "-o", "other")
        assert code == 2
        assert err.startswith(text)


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


def test_a_build_that_is_killed_leaves_nothing_half_and_nobody_running(made, here, capsys):
    code = (
        "import multiprocessing, threading, time\n"
        "from magsim.cli import main\n"
        "def tell():\n"
        "    while len(multiprocessing.active_children()) < 2: time.sleep(0.02)\n"
        "    print('both fly', flush=True)\n"
        "threading.Thread(target=tell, daemon=True).start()\n"
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


def test_statistics_are_those_of_the_splits(made):
    table = statistics.read(made / "data" / statistics.STATISTICS)
    dataset = Dataset(made / "data")
    for (file, split), names in {("one.h5", "train"): ["learn"], ("one.h5", "test"): ["judge"]}.items():
        values = np.concatenate([dataset[name]["mag_cabin_nt"] for name in names])
        found = table[file, split, "mag_cabin_nt"]
        assert found.rows == len(values)
        assert found.mean == pytest.approx(values.mean(), rel=1e-8)
        assert found.std == pytest.approx(values.std(), rel=1e-8)
    assert not any(split == "valid" for _, split, _ in table)


def test_a_folder_is_trained_and_judged_on(tmp_path, monkeypatch, capsys):
    """By the commands that take folders; a file that is being written does not disturb."""
    from tests.support.worlds import World, calibration

    monkeypatch.chdir(tmp_path)
    (tmp_path / "set").mkdir()
    write_recordings(tmp_path / "set" / "a.h5", [calibration(World(circuits=2))])
    (tmp_path / "set" / ".b.part.h5").write_text("being written")
    assert main(["train", "tl16", "set", "-q"]) == 0
    assert main(["benchmark", "set", "--methods", "none,runs/tl16", "-q"]) == 0
    assert capsys.readouterr().out.count("world, sensor cabin") == 1
