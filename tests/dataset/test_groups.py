"""Which recordings belong together."""

import pytest

from magsim import Dataset
from magsim.dataset import MANIFEST, flights_of, groups_of
from magsim.errors import DataError, RequestError
from magsim.recording import write_recordings
from tests.support.folders import flight, manifest_of

BOTH, TRAIN, TEST = [0, 0, 2, 2], [0, 0, 0], [2, 2, 2]


def write(folder, **files):
    """Files by their names, each of flights by their names."""
    folder.mkdir(exist_ok=True)
    for name, flights in files.items():
        write_recordings(folder / f"{name}.h5", [flight(key, splits, rows=3) for key, splits in flights.items()])
    return folder


def names(data):
    return {group.name: [info.name for info in group.flights] for group in groups_of(data)}


def test_flights_of_all_that_may_be_given(tmp_path):
    write(tmp_path, a={"one": BOTH, "two": TEST}, b={"three": TEST})
    memory = flight("four", BOTH)
    for data, expected in (
        (memory, ["four"]),
        (tmp_path / "a.h5", ["one", "two"]),
        (str(tmp_path), ["one", "two", "three"]),
        (Dataset(tmp_path), ["one", "two", "three"]),
        ([memory, tmp_path / "b.h5", [Dataset(tmp_path)]], ["four", "three", "one", "two", "three"]),
        ((one for one in (memory,)), ["four"]),
        ([], []),
    ):
        assert [info.name for info in flights_of(data)] == expected
    for wrong in (3, None, [memory, 3]):
        with pytest.raises(RequestError, match="holds no recordings; allowed: a Recording, a Dataset, the path"):
            flights_of(wrong)
    with pytest.raises(RequestError, match="no such"):
        flights_of(tmp_path / "nothing.h5")


def test_files_that_hold_training_and_test_rows_are_groups(tmp_path):
    write(tmp_path, a={"one": TRAIN, "two": TEST}, b={"three": BOTH})
    assert names(tmp_path) == {"a": ["one", "two"], "b": ["three"]}
    assert names([tmp_path / "b.h5", tmp_path / "a.h5"]) == {"b": ["three"], "a": ["one", "two"]}
    assert names(Dataset(tmp_path)) == names(tmp_path)
    assert names(tmp_path / "a.h5") == {"a": ["one", "two"]}


@pytest.mark.parametrize("other", [TRAIN, TEST, [1, 1], None])
def test_one_file_without_training_or_test_rows_and_all_is_one_group(tmp_path, other):
    write(tmp_path, a={"one": TRAIN, "two": TEST}, b={"three": other})
    assert names(tmp_path) == {"all": ["one", "two", "three"]}


def test_recordings_in_memory_are_one_group(tmp_path):
    write(tmp_path, a={"one": BOTH})
    assert names([flight("x", BOTH), flight("y", BOTH)]) == {"all": ["x", "y"]}
    assert names([flight("x", BOTH), tmp_path]) == {"all": ["x", "one"]}
    assert names([]) == {}


def test_groups_of_a_manifest_decide(tmp_path):
    """Whatever the files hold: two files of one group, and a file with both that is grouped with another."""
    write(tmp_path, a={"one": TRAIN}, b={"two": TEST}, c={"three": BOTH}, d={"four": BOTH})
    manifest = manifest_of(
        tmp_path,
        a={"group": "first", "level": 1},
        b={"group": "first", "level": 1},
        c={"group": "second"},
        d={"group": "second", "level": 0},
    )
    (tmp_path / MANIFEST).write_text(manifest.to_json())
    assert names(tmp_path) == {"first": ["one", "two"], "second": ["three", "four"]}
    assert [(info.group, info.level) for info in flights_of(tmp_path)] == [
        ("first", 1),
        ("first", 1),
        ("second", None),
        ("second", 0),
    ]


def test_a_manifest_without_groups_leaves_it_to_the_files(tmp_path):
    write(tmp_path, a={"one": BOTH}, b={"two": BOTH})
    (tmp_path / MANIFEST).write_text(manifest_of(tmp_path, a={"level": 4}, b={"level": 5}).to_json())
    assert names(tmp_path) == {"a": ["one"], "b": ["two"]}
    assert [info.level for info in flights_of(tmp_path)] == [4, 5]
    # a file that is not listed has no group, so that the manifest does not decide
    (tmp_path / MANIFEST).write_text(manifest_of(tmp_path, a={"group": "g"}, b={"group": "g"}).to_json())
    write(tmp_path, c={"three": BOTH})
    assert names(tmp_path) == {"a": ["one"], "b": ["two"], "c": ["three"]}


def test_groups_of_one_name_in_two_folders_stay_apart(tmp_path):
    first, second = write(tmp_path / "x", a={"one": BOTH}), write(tmp_path / "y", a={"one": BOTH}, b={"two": BOTH})
    groups = groups_of([first, second])
    assert [(group.name, group.flights[0].file.parent) for group in groups] == [
        ("a", first),
        ("a (2)", second),
        ("b", second),
    ]


def test_broken_manifests_are_refused(tmp_path):
    write(tmp_path, a={"one": BOTH})
    (tmp_path / MANIFEST).write_text("{")
    with pytest.raises(DataError, match="is no manifest of a data set"):
        groups_of(tmp_path)


def test_a_named_file_has_the_group_and_level_of_the_manifest_beside_it(tmp_path):
    folder = write(tmp_path / "set", a={"one": BOTH}, b={"two": BOTH})
    manifest = manifest_of(folder)
    files = [entry.model_copy(update={"group": "g", "level": 3}) for entry in manifest.files]
    (folder / MANIFEST).write_text(manifest.model_copy(update={"files": tuple(files)}).to_json())
    assert [(info.group, info.level) for info in flights_of([folder / "b.h5", folder / "a.h5"])] == [("g", 3)] * 2
    assert names([folder / "b.h5", folder / "a.h5"]) == {"g": ["two", "one"]}
    # a manifest of something else does not matter for a file that is named
    (folder / MANIFEST).write_text('{"name": "an app"}')
    assert [(info.group, info.level) for info in flights_of(folder / "a.h5")] == [(None, None)]
    with pytest.raises(DataError, match="is no manifest of a data set"):
        flights_of(folder)
