"""Folders of many flights are fitted and judged with one flight in memory beside the training rows."""

import weakref

import numpy as np
import pytest

from magsim import Dataset, TollesLawson, evaluate
from magsim.dataset import FlightInfo, flights_of, read_training
from magsim.errors import RequestError
from magsim.recording import Recording, write_recordings
from tests.support.folders import write_index_of


def flown(number: int, split: list[float]) -> Recording:
    """A flight of 120 s for each split, with an interference that Tolles-Lawson can learn, and truth."""
    rows = 1200 * len(split)
    rng, time_s = np.random.default_rng(number), np.arange(rows) * 0.1
    angle = 0.1 * np.sin(2.0 * np.pi * np.outer([0.2, 0.3, 0.15], time_s) + rng.uniform(0.0, 6.0, (3, 1)))
    direction = np.array([0.6, 0.0, 0.8])[:, None] + angle
    direction /= np.linalg.norm(direction, axis=0)
    interference = np.array([4.0, -3.0, 5.0]) @ direction
    data = {f"flux_a_{axis}_nt": 50_000.0 * part for axis, part in zip("xyz", direction, strict=True)}
    data |= {"interference_a_nt": interference, "clean_a_nt": np.full(rows, 50_000.0)}
    data |= {"mag_a_nt": 50_000.0 + interference, "split": np.repeat(split, 1200)}
    return Recording(f"f{number:07d}", time_s, data)


@pytest.fixture
def alive(monkeypatch):
    """For each flight that is read, its name and how many that were read before are still in memory."""
    read, found, counts = FlightInfo.read, [], []

    def counting(self):
        counts.append((self.name, sum(one() is not None for one in found)))
        recording = read(self)
        found.append(weakref.ref(recording))
        return recording

    monkeypatch.setattr(FlightInfo, "read", counting)
    return counts


def write(folder, splits):
    for shard in range(2):
        numbers = range(3 * shard, 3 * shard + 3)
        write_recordings(folder / f"shard_{shard:06d}.h5", [flown(number, splits(number)) for number in numbers])
    write_index_of(folder)
    return folder


def test_training_rows_are_read_flight_by_flight_and_only_where_there_are_some(tmp_path, alive):
    folder = write(tmp_path, lambda number: [2.0] if number % 2 else [0.0, 1.0])
    training = read_training(flights_of(folder))
    assert [recording.name for recording in training.recordings] == ["f0000000", "f0000002", "f0000004"]
    assert [name for name, _ in alive] == ["f0000000", "f0000002", "f0000004"]
    # the one before is let go of when the next one has come
    assert max(count for _, count in alive) <= 1
    assert not any("clean_a_nt" in recording for recording in training.recordings)
    alive.clear()
    TollesLawson().fit(Dataset(folder))
    assert max(count for _, count in alive) <= 1


def test_test_flights_alone_have_nothing_to_learn(tmp_path, alive):
    folder = write(tmp_path, lambda number: [2.0])
    with pytest.raises(RequestError, match="no training rows: no row of 'f0000000', 'f0000001'"):
        read_training(flights_of(folder))


@pytest.mark.parametrize(
    ("splits", "groups"),
    [
        (lambda number: [0.0, 2.0], {f"f{number:07d}": [f"f{number:07d}"] for number in range(6)}),
        (lambda number: [2.0] if number % 2 else [0.0, 1.0], {"all": [f"f{number:07d}" for number in range(6)]}),
    ],
    ids=["flight by flight", "all together"],
)
def test_flights_are_judged_one_at_a_time_with_the_scores_of_memory(tmp_path, alive, splits, groups):
    folder = write(tmp_path, splits)
    report = evaluate(folder, ["none", "tl16"])
    assert report.about["groups"] == groups
    assert max(count for _, count in alive) <= 1
    assert report.summary()["std_nt"].xs("tl16", level="method").max() < 1e-3
    alive.clear()
    in_memory = [
        evaluate([flown(int(n[1:]), splits(int(n[1:]))) for n in names], ["none", "tl16"]) for names in groups.values()
    ]
    expected = {(row.recording, row.method, row.segment, row.metric): row.value for r in in_memory for row in r.rows}
    found = {(row.recording, row.method, row.segment, row.metric): row.value for row in report.rows}
    assert found == expected


def test_a_trained_method_is_judged_without_reading_training_flights(tmp_path, alive):
    folder = write(tmp_path, lambda number: [2.0] if number % 2 else [0.0, 1.0])
    method = TollesLawson().fit(folder)
    alive.clear()
    evaluate(folder, [method], sensor="a")
    assert {name for name, _ in alive} == {"f0000001", "f0000003", "f0000005"}
