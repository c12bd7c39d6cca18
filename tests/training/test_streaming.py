"""Windows of many files for torch: each window once in an epoch, one order, resumed where it was left."""

import io
import pickle
import re
import time
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.utils.data import DataLoader

from magsim import Dataset
from magsim.errors import DataError, RequestError
from magsim.recording import Recording, write_recordings
from magsim.recording.windows import Windows
from magsim.storage import hdf5
from magsim.training import Position, WindowDataset, WindowLoader
from tests.support.folders import write_index_of
from tests.support.paths import ROOT

INPUTS = ("mag_a_nt", "mag_b_nt")


def flight(number: int, rows: int) -> Recording:
    """A flight whose values tell it and the row: whole numbers below 2^24, which float32 holds."""
    time_s = np.arange(rows) * 0.1 + (np.arange(rows) >= rows // 2) * (9.0 if number % 3 == 0 else 0.0)
    row = 1000.0 * number + np.arange(rows)
    split = np.where(np.arange(rows) < 0.7 * rows, 0.0, 2.0)
    data = {"mag_a_nt": row, "mag_b_nt": row + 0.5, "mag_c_nt": -row, "interference_a_nt": 2.0 * row, "split": split}
    return Recording(f"f{number:07d}", time_s, data)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Seven files of one to four flights of 20 to 60 rows."""
    path = tmp_path_factory.mktemp("sweep")
    rng, number = np.random.default_rng(3), 0
    for shard in range(7):
        count = int(rng.integers(1, 5))
        flights = [flight(number + i, int(rng.integers(20, 60))) for i in range(count)]
        write_recordings(path / f"shard_{shard:06d}.h5", flights)
        number += count
    write_index_of(path)
    return path


def dataset(folder: Path, **options) -> WindowDataset:
    options = {"rows": 5, "inputs": INPUTS, "batch": 8, "seed": 1, "block_mb": 0.1, **options}
    return WindowDataset(folder, **options)


def firsts(batches) -> list[list[float]]:
    """The first value of each window of each batch: its flight and row."""
    return [inputs[:, 0, 0].tolist() for inputs, _ in batches]


def flat(batches) -> list[float]:
    return [value for batch in firsts(batches) for value in batch]


@pytest.mark.parametrize("stride", [1, 3, 5, 11])
@pytest.mark.parametrize("splits", [("train",), ("train", "test"), None])
def test_an_epoch_has_every_window_once(folder, stride, splits):
    """By hand: all rows of all flights are gone through."""
    expected = []
    for recording in Dataset(folder):
        pieces, piece = [], []
        for row in range(len(recording)):
            jump = piece and recording.time_s[row] - recording.time_s[row - 1] > 1.0
            wanted = splits is None or (recording["split"][row] == 0.0) or "test" in splits
            if jump or not wanted:
                pieces, piece = [*pieces, piece], []
            if wanted:
                piece.append(row)
        for kept in (*pieces, piece):
            expected += [recording["mag_a_nt"][kept[at]] for at in range(0, len(kept) - 4, stride)]
    data = dataset(folder, stride=stride, splits=splits)
    found = list(data)
    assert sorted(flat(found)) == sorted(expected)
    assert data.count() == len(expected)
    assert [len(inputs) for inputs, _ in found[:-1]] == [8] * (len(found) - 1)
    for inputs, targets in found:
        assert inputs.dtype == targets.dtype == torch.float32
        assert inputs.shape[1:] == (2, 5)
        assert targets.shape[1:] == (1, 5)
        assert torch.equal(inputs[:, 1], inputs[:, 0] + 0.5)
        assert torch.equal(targets[:, 0], 2.0 * inputs[:, 0])
        assert torch.equal(inputs[:, 0].diff(dim=1), torch.ones(len(inputs), 4))
    without_last = list(dataset(folder, stride=stride, splits=splits, drop_last=True))
    assert firsts(without_last) == [batch for batch in firsts(found) if len(batch) == 8]


def test_the_order_is_that_of_seed_and_epoch(folder):
    data = dataset(folder)
    orders = {}
    for seed, epoch in ((1, 0), (1, 1), (2, 0)):
        data = dataset(folder, seed=seed)
        data.set_epoch(epoch)
        orders[seed, epoch] = flat(data)
        assert flat(data) == orders[seed, epoch]
    assert len({tuple(order) for order in orders.values()}) == 3
    assert len({tuple(sorted(order)) for order in orders.values()}) == 1
    in_order = flat(dataset(folder, shuffle=False))
    assert in_order == sorted(in_order)


def test_files_of_a_block_are_mixed_and_blocks_are_of_any_files(folder):
    data = dataset(folder, stride=1, block_mb=0.15)
    size = {path.name: path.stat().st_size for path in data.files}
    blocks = data.blocks(0)
    assert sorted(number for block in blocks for number in block) == list(range(7))
    assert blocks != data.blocks(1)
    assert 1 < len(blocks) < 7
    assert all(sum(size[data.files[n].name] for n in block) < 0.3e6 for block in blocks)
    # a block of several files: its windows come from all of them from the beginning on
    one = dataset(folder, stride=1, block_mb=1000.0)
    assert len(one.blocks(0)) == 1
    flights = [value // 1000.0 for value in flat(one)]
    assert len(set(flights[:60])) > 10
    # as many neighbors from one flight as chance has it: the sum of the squares of the shares
    shares = np.unique(flights, return_counts=True)[1] / len(flights)
    together = np.mean(np.diff(flights) == 0.0)
    assert together == pytest.approx((shares**2).sum(), abs=4.0 * np.sqrt((shares**2).sum() / len(flights)))


@settings(max_examples=30, deadline=None)
@given(
    options=st.fixed_dictionaries(
        {
            "batch": st.integers(1, 40),
            "stride": st.integers(1, 9),
            "block_mb": st.sampled_from([0.001, 0.1, 0.2, 1000.0]),
            "drop_last": st.booleans(),
        }
    ),
    before=st.integers(0, 60),
    workers=st.tuples(st.integers(1, 5), st.integers(1, 5)),
)
def test_any_number_of_workers_and_any_break_give_the_order_of_one(folder, options, before, workers):
    """Workers as torch takes from them, in turn; interrupted after any batch, continued by another number of them."""
    data = dataset(folder, **options)
    whole = list(data._batches(Position(2), 0, 1))

    def in_turn(start, count):
        makers = [data._batches(start, share, count) for share in range(count)]
        while True:
            for worker in makers:
                found = next(worker, None)
                if found is None:
                    return
                yield found

    first = list(islice(in_turn(Position(2), workers[0]), before))
    rest = list(in_turn(first[-1][0] if first else Position(2), workers[1]))
    assert [position for position, _ in first + rest] == [position for position, _ in whole]
    assert firsts(b for _, b in first + rest) == firsts(b for _, b in whole)


@pytest.mark.filterwarnings("ignore:This DataLoader will create 3 worker processes")
@pytest.mark.parametrize(("workers", "resumed_with"), [(0, 2), (2, 0), (3, 2)])
def test_a_loader_that_was_interrupted_goes_on_as_if_it_had_not_been(folder, workers, resumed_with):
    undisturbed = WindowLoader(dataset(folder))
    expected = [firsts(undisturbed) for _ in range(3)]
    assert expected[0] != expected[1]
    loader = WindowLoader(dataset(folder), workers=workers)
    assert firsts(loader) == expected[0]
    found = []
    for inputs, _ in loader:
        found.append(inputs[:, 0, 0].tolist())
        if len(found) == 4:
            break
    buffer = io.BytesIO()
    torch.save(loader.state_dict(), buffer)
    buffer.seek(0)
    state = torch.load(buffer, weights_only=True)
    other = WindowLoader(dataset(folder), workers=resumed_with)
    other.load_state_dict(state)
    assert found + firsts(other) == expected[1]
    assert firsts(other) == expected[2]
    # who breaks an epoch off without a state goes on with the next one
    assert firsts(loader) == expected[2]


def test_a_state_after_the_last_batch_goes_on_with_the_next_epoch(folder):
    loader = WindowLoader(dataset(folder))
    expected = [firsts(loader) for _ in range(2)]
    ends = WindowLoader(dataset(folder))
    states = [ends.state_dict() for _ in ends]
    for state, found in ((states[-1], [[], expected[1]]), (ends.state_dict(), [expected[1]])):
        again = WindowLoader(dataset(folder))
        again.load_state_dict(state)
        assert [firsts(again) for _ in found] == found


def test_torchs_own_loader_gives_the_same(folder):
    expected = firsts(dataset(folder))
    data = dataset(folder)
    loader = DataLoader(data, batch_size=None, num_workers=2, persistent_workers=True)
    assert firsts(loader) == expected
    assert firsts(loader) == expected
    data.set_epoch(1)
    second = firsts(loader)
    assert second != expected
    data.set_epoch(1)
    assert firsts(data) == second


def test_a_state_of_other_windows_is_refused(folder):
    state = WindowLoader(dataset(folder)).state_dict()
    for other in ({"seed": 2}, {"batch": 9}, {"stride": 2}, {"rows": 6}, {"block_mb": 9.0}, {"splits": None}):
        with pytest.raises(RequestError, match="is of other files, or of another seed, batch or order"):
            WindowLoader(dataset(folder, **other)).load_state_dict(state)


def test_the_global_generator_of_torch_is_left_alone(folder):
    before = torch.get_rng_state()
    firsts(WindowLoader(dataset(folder), workers=1))
    assert torch.equal(before, torch.get_rng_state())


def test_columns_are_standardized_before_they_are_rounded(folder):
    """50 000 nT and less than the step of float32 above it: what is left after the mean is exact."""
    plain = torch.cat([inputs for inputs, _ in dataset(folder)]).double().numpy()
    scaled = torch.cat([i for i, _ in dataset(folder, standardize={"mag_b_nt": (1e-9, 0.25)})]).numpy()
    np.testing.assert_array_equal(scaled[:, 0], plain[:, 0].astype(np.float32))
    np.testing.assert_array_equal(scaled[:, 1], ((plain[:, 1] - 1e-9) / 0.25).astype(np.float32))
    for wrong, text in (({"mag_x_nt": (0.0, 1.0)}, "no column mag_x_nt"), ({"mag_a_nt": (0.0, 0.0)}, "scale not 0")):
        with pytest.raises(RequestError, match=text):
            list(dataset(folder, standardize=wrong))


def test_nothing_is_opened_before_the_first_batch_and_copies_are_small(folder, monkeypatch):
    def refuse(path, **more):
        pytest.fail(f"{path} is opened")

    with monkeypatch.context() as patch:
        patch.setattr(hdf5, "open_untrusted", refuse)
        data = dataset(folder)
        loader = WindowLoader(data)
        copy = pickle.dumps(data)
    assert len(copy) < 5000
    assert firsts(pickle.loads(copy)) == firsts(loader)
    data.count()
    opened = pickle.dumps(data)
    assert len(opened) < 20_000
    assert len({id(places.channels) for places in data._places.values()}) == 1
    monkeypatch.setattr(hdf5, "open_untrusted", refuse)
    assert firsts(pickle.loads(opened)) == firsts(data)


def test_workers_that_are_spawned_start_and_agree(folder):
    expected = firsts(dataset(folder))
    loader = WindowLoader(dataset(folder), workers=1, multiprocessing_context="spawn")
    assert firsts(loader) == expected


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"rows": 0}, "rows 0 is not allowed; allowed: a whole number of 1 or more"),
        ({"batch": 2.5}, "batch 2.5 is not allowed"),
        ({"seed": -1}, "seed -1 is not allowed; allowed: a whole number of 0 or more"),
        ({"block_mb": 0.0}, "block_mb 0.0 is not allowed"),
        ({"inputs": ("mag_a_nt", "split")}, "are of roles input, segment; allowed: columns of one role"),
        ({"inputs": ()}, r"the columns \(none is named\) are of roles none"),
        ({"inputs": ("nothing",)}, "nothing"),
        ({"targets": ("interference_x_nt",)}, "windows have no column interference_x_nt"),
        ({"rows": 900}, "has a window of 900 rows"),
    ],
)
def test_what_is_not_allowed_is_refused(folder, options, text):
    with pytest.raises(RequestError, match=text):
        list(dataset(folder, **options))


def test_data_that_have_no_files_are_refused(folder, tmp_path):
    for wrong in (flight(0, 20), 3, []):
        with pytest.raises(RequestError, match="has no recording files; allowed: a Dataset, a folder"):
            WindowDataset(wrong, rows=5)
    with pytest.raises(RequestError, match="there is no such file or folder"):
        WindowDataset(tmp_path / "none.h5", rows=5)
    assert dataset([folder / "shard_000000.h5", Dataset(folder)]).files[0].name == "shard_000000.h5"


def test_a_file_that_changed_since_it_was_opened_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    write_recordings(path, [flight(1, 40)])
    data = WindowDataset(path, rows=5)
    data.count()
    windows = Windows(path, rows=5)
    time.sleep(0.02)
    write_recordings(path, [flight(2, 40)], force=True)
    with pytest.raises(DataError, match=r"a\.h5: has changed since it was checked"):
        list(data)
    with pytest.raises(DataError, match=r"a\.h5: has changed since it was checked"):
        windows.take([0])


def test_the_example_of_the_page_runs_and_its_state_resumes(tmp_path, monkeypatch):
    (tmp_path / "data" / "banks").mkdir(parents=True)
    rng = np.random.default_rng(0)
    names = ("mag_cabin_nt", "ins_roll_deg", "ins_pitch_deg", "interference_cabin_nt")
    flights = [
        Recording(
            f"f{number}", np.arange(700) * 0.1, {**{n: rng.normal(size=700) for n in names}, "split": np.zeros(700)}
        )
        for number in range(2)
    ]
    write_recordings(tmp_path / "data" / "banks" / "a.h5", flights)
    text = (ROOT / "docs" / "streaming.md").read_text(encoding="utf-8")
    (code,) = (block for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL) if "WindowLoader" in block)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(code, names)
    assert (names["inputs"].shape, names["targets"].shape) == ((24, 3, 320), (24, 1, 320))
    # standardized as the page says: a mean of 45 000 and a scale of 300
    assert names["inputs"][:, 0].mean() == pytest.approx(-150.0, abs=0.01)
    state = torch.load("last.pt", weights_only=True)["loader"]
    again = WindowLoader(names["windows"])
    again.load_state_dict(state)
    assert state["epoch"] == 10
    assert firsts(again) == firsts(names["loader"])
