"""Checks of a folder on demand: every byte of every file against the index."""

import pytest

from magsim import Dataset
from magsim.cli import main
from magsim.dataset import MANIFEST, index_differences
from magsim.errors import DataError, RequestError
from magsim.recording import write_recordings
from tests.support.folders import flight, manifest_of, write_index_of


@pytest.fixture
def folder(tmp_path):
    write_recordings(tmp_path / "a.h5", [flight("one", [0] * 5 + [1] * 3), flight("two", [2] * 4)])
    write_recordings(tmp_path / "b.h5", [flight("three", [2] * 6)])
    write_recordings(tmp_path / "c.h5", [flight("four", [2] * 6)])
    write_index_of(tmp_path, failed=1)
    return tmp_path


def test_a_folder_as_its_index_lists_it(folder, capsys):
    assert index_differences(folder) == []
    Dataset(folder, check=True)
    assert main(["dataset", "check", str(folder)]) == 0
    out = capsys.readouterr()
    assert out.out == f"{folder}: as index.parquet lists it: 4 flights; there is no recipe to compare with\n"
    assert out.err.splitlines() == [f"{folder / n}.h5: file {i} of 3" for i, n in enumerate("abc", start=1)]


def test_every_difference_is_a_line_and_the_exit_code_is_3(folder, capsys):
    (folder / "b.h5").unlink()
    write_recordings(folder / "d.h5", [flight("five", [2] * 6)])
    # another file of the same size
    whole = bytearray((folder / "a.h5").read_bytes())
    write_recordings(folder / "a.h5", [flight("one", [0] * 5 + [1] * 3), flight("two", [0] * 4)], force=True)
    assert (folder / "a.h5").stat().st_size == len(whole)
    broken = bytearray((folder / "c.h5").read_bytes())
    broken[len(broken) // 2] ^= 1
    (folder / "c.h5").write_bytes(broken)
    expected = [
        f"{folder / 'index.parquet'}: b.h5 is missing",
        f"{folder / 'index.parquet'}: d.h5 is not listed",
        f"{folder / 'a.h5'}: is not the file that index.parquet lists: its sha256 differs",
        f"{folder / 'c.h5'}: is damaged: its bytes are not those that were written (the checksum at its end differs)",
    ]
    assert index_differences(folder) == expected
    assert main(["dataset", "check", "-q", str(folder)]) == 3
    assert capsys.readouterr().err.splitlines() == expected
    with pytest.raises(DataError) as caught:
        Dataset(folder, check=True)
    assert str(caught.value).splitlines() == expected


def test_rows_of_the_index_that_are_not_those_of_the_file_are_found(folder):
    write_index_of(folder, values=lambda name: {"test_rows": 5} if name == "three" else {})
    assert index_differences(folder) == [
        f"{folder / 'b.h5'}: has other flights, rows or splits than index.parquet lists"
    ]


def test_a_folder_with_index_and_manifest_is_compared_with_both(folder):
    (folder / MANIFEST).write_text(manifest_of(folder).to_json())
    Dataset(folder, check=True)
    write_recordings(folder / "b.h5", [flight("three", [0] * 6)], force=True)
    with pytest.raises(DataError) as caught:
        Dataset(folder, check=True)
    assert str(caught.value).splitlines() == [
        f"{folder / 'b.h5'}: is not the file that {name} lists: its sha256 differs"
        for name in ("index.parquet", "manifest.json")
    ]


def test_a_folder_with_neither_cannot_be_checked(folder, capsys):
    (folder / "index.parquet").unlink()
    with pytest.raises(RequestError, match=r"manifest\.json: there is no such file"):
        Dataset(folder, check=True)
    assert main(["dataset", "check", str(folder)]) == 2
    assert "manifest.json: there is no such file" in capsys.readouterr().err
