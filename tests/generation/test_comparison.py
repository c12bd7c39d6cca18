"""Comparison of data sets with their manifests: every difference is found and named."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.dataset import MANIFEST
from magsim.generation import flying
from magsim.generation.description import samples, statistics
from magsim.recording import read_recordings, write_recordings
from tests.support.tiny_dataset import ELSEWHERE, change, elsewhere, run


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
    assert "flight more, column clean_cabin_nt: by less than the digits of the sampled rows, or between" in err
    assert "one.h5" not in err


@pytest.mark.parametrize(("by", "code"), [(5e-5, 0), (-9e-5, 0), (1.2e-4, 3), (-1.0, 3)])
def test_another_machine_must_agree_within_tolerances(here, monkeypatch, capsys, by, code):
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
def test_rows_between_the_samples_are_compared_by_their_sum(here, monkeypatch, capsys, by, code):
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


def test_check_reports_changes(here, capsys):
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


def test_check_finds_a_change_with_a_new_checksum(here, capsys):
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


def test_check_finds_missing_and_foreign_files(here, capsys):
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


def test_a_recipe_that_has_changed_is_refused_before_anything_is_flown(here, monkeypatch, capsys):
    monkeypatch.setattr(flying, "fly", None)
    text = (here / "tiny" / "recipe.toml").read_text()
    (here / "tiny" / "recipe.toml").write_text(text.replace("seed=7", "seed=8"))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other")
    assert code == 3
    assert "was made from another recipe, scenario or aircraft than the present ones (flight more)" in err
    assert "magsim dataset build tiny --renew" in err
