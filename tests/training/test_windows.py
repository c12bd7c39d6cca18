"""Windows in memory, random batches of them, and overlapping windows in use."""

import numpy as np
import pytest
import torch

from magsim.recording import Recording, write_recordings
from magsim.recording.windows import Windows
from magsim.signals import spans
from magsim.training import ArrayWindows, Plan, RandomBatches, WindowSource, overlap_add, seeded, starts_of, train

PIECES = [np.arange(0.0, 50.0), np.arange(1000.0, 1008.0), np.arange(2000.0, 2030.0)]


def test_windows_of_arrays_are_all_that_a_piece_has():
    """By hand: each piece, each first row; pieces shorter than a window have none."""
    windows = ArrayWindows([p[:, None] * [1.0, 2.0] for p in PIECES], rows=10)
    expected = [piece[first : first + 10] for piece in PIECES for first in range(len(piece) - 9)]
    assert len(windows) == len(expected) == 41 + 21
    assert (windows.rows, windows.total_rows) == (10, 80)
    found = windows.take(np.arange(len(windows)))
    assert found.shape == (62, 10, 2)
    np.testing.assert_array_equal(found[:, :, 0], expected)
    np.testing.assert_array_equal(found[:, :, 1], 2.0 * np.array(expected))
    np.testing.assert_array_equal(windows.take(np.array([60, 0, 60])), found[[60, 0, 60]])
    assert ArrayWindows([np.zeros((10, 1), np.float32)], rows=10).take(np.array([0])).dtype == np.float32


def test_no_piece_is_as_long_as_a_window():
    with pytest.raises(ValueError, match="a window has 10 rows, but the longest piece without a gap has 9"):
        ArrayWindows([np.zeros((9, 1)), np.zeros((3, 1))], rows=10)
    with pytest.raises(ValueError, match="the longest piece without a gap has 0"):
        ArrayWindows([], rows=10)


def test_batches_stay_inside_their_piece_and_all_offsets_come():
    sources = (
        ArrayWindows([p[:, None] * [1.0, 2.0] for p in PIECES], rows=10),
        ArrayWindows([p[:, None] for p in PIECES], rows=10),
    )
    batches = RandomBatches(sources, batch=64)
    assert batches.rows == 80
    generator = torch.Generator().manual_seed(0)
    firsts = set()
    for _ in range(40):
        x, y = batches(generator)
        assert x.shape == (64, 2, 10)
        assert y.shape == (64, 1, 10)
        assert x.dtype == y.dtype == torch.float32
        assert torch.equal(x[:, 1], 2.0 * y[:, 0])
        assert torch.equal(y[:, 0].diff(dim=1), torch.ones(64, 9))
        firsts |= set(y[:, 0, 0].tolist())
    assert firsts == {*range(41), *range(2000, 2021)}


def test_every_window_is_as_likely_as_any_other():
    batches = RandomBatches([ArrayWindows([p[:, None] for p in PIECES], rows=10)], batch=12_400)
    (x,) = batches(torch.Generator().manual_seed(1))
    _, counts = np.unique(x[:, 0, 0].numpy(), return_counts=True)
    assert len(counts) == 62
    # 200 expected of each: chi-squared over 61 degrees of freedom, mean 61, deviation 11
    assert ((counts - 200.0) ** 2 / 200.0).sum() < 61 + 5 * 11.0


def test_sources_of_different_windows_are_refused():
    ten, nine = (ArrayWindows([np.zeros((20, 1))], rows=rows) for rows in (10, 9))
    with pytest.raises(ValueError, match="need the same windows, and have 11 of 10 rows, 12 of 9 rows"):
        RandomBatches([ten, nine], batch=1)
    longer = ArrayWindows([np.zeros((21, 1))], rows=10)
    with pytest.raises(ValueError, match="need the same windows"):
        RandomBatches([ten, longer], batch=1)


INPUTS, LABEL = ("mag_a_nt", "flux_a_x_nt"), ("interference_a_nt",)
ROWS = 16


@pytest.fixture(scope="module")
def flights():
    """Two flights with splits and a jump in time; float32 holds their values exactly or not, as it comes."""
    found = []
    for number, count in enumerate((300, 200)):
        rng = np.random.default_rng(number)
        time_s = np.arange(count) / 10.0 + 7.0 * (np.arange(count) >= 90)
        data = {name: rng.normal(size=count) for name in ("mag_a_nt", "flux_a_x_nt", "flux_a_y_nt")}
        data["interference_a_nt"] = data["mag_a_nt"] - 0.5 * data["flux_a_x_nt"]
        data["split"] = np.repeat([0.0, 1.0, 2.0], [count - 100, 40, 60])
        found.append(Recording(f"flight_{number}", time_s, data))
    return found


def in_memory(flights, names):
    """Training and validation rows, which touch, cut where time jumps."""
    pieces = []
    for flight in flights:
        learned = flight.take(flight["split"] < 2.0)
        pieces += [learned.stack(names)[span] for span in spans(learned.time_s)]
    return ArrayWindows(pieces, rows=ROWS)


@pytest.fixture(scope="module")
def sources(flights, tmp_path_factory):
    """Inputs and labels, in memory and mapped from a file."""
    path = tmp_path_factory.mktemp("shards") / "shard.h5"
    write_recordings(path, flights)
    both = ("train", "valid")
    mapped = (
        Windows(path, rows=ROWS, names=INPUTS, splits=both),
        Windows(path, rows=ROWS, role="label", names=LABEL, splits=both),
    )
    return (in_memory(flights, INPUTS), in_memory(flights, LABEL)), mapped


def test_mapped_windows_are_those_in_memory_bit_for_bit(sources):
    for array, mapped in zip(*sources, strict=True):
        one: WindowSource = array
        other: WindowSource = mapped
        # two pieces of each flight: 240 and 140 rows are learned
        assert len(one) == len(other) == 380 - 4 * (ROWS - 1)
        assert one.total_rows == other.total_rows == 380
        assert one.rows == other.rows == ROWS
        indices = np.arange(len(one))
        assert one.take(indices).tobytes() == other.take(indices).tobytes()


def test_mapped_windows_give_the_same_batches(sources):
    array, mapped = (RandomBatches(pair, batch=8) for pair in sources)
    assert array.rows == mapped.rows
    generators = [torch.Generator().manual_seed(3) for _ in range(2)]
    for _ in range(20):
        for one, other in zip(array(generators[0]), mapped(generators[1]), strict=True):
            assert one.dtype == other.dtype == torch.float32
            assert one.is_contiguous()
            assert torch.equal(one, other)


def test_mapped_windows_train_a_network_to_the_same_weights(sources):
    weights = []
    for pair in sources:
        with seeded(0):
            module = torch.nn.Conv1d(2, 1, 3, padding=1)
        watched = [
            torch.from_numpy(source.take(np.arange(50)).transpose(0, 2, 1).astype(np.float32)) for source in pair
        ]

        def losses(network, batch, step):
            inputs, targets = batch
            return [((network(inputs) - targets) ** 2).mean()]

        def measure(network, watched=watched):
            inputs, targets = watched
            return float(((network(inputs) - targets) ** 2).mean())

        with torch.no_grad():
            start = measure(module)
        outcome = train(module, RandomBatches(pair, batch=8), losses, measure, Plan(60, 0.05, every=20), seed=4)
        assert outcome.best_value < 0.1 * start
        weights.append(torch.nn.utils.parameters_to_vector(module.parameters()))
    assert torch.equal(*weights)


@pytest.mark.parametrize(
    ("rows", "expected"), [(5, [0]), (10, [0]), (11, [0, 1]), (25, [0, 5, 10, 15]), (27, [0, 5, 10, 15, 17])]
)
def test_windows_cover_a_piece(rows, expected):
    assert starts_of(rows, 10, 5) == expected


@pytest.mark.parametrize("rows", [3, 20, 63, 200])
def test_overlapping_windows_of_a_memoryless_function_give_the_function(rows):
    x = np.random.default_rng(0).normal(size=(rows, 3)).astype(np.float32)
    got = overlap_add(lambda windows: windows.sum(axis=1), x, length=20, stride=5, batch=3)
    np.testing.assert_allclose(got, x.sum(axis=1), rtol=1e-5, atol=1e-5)


def test_overlapping_windows_are_weighted_by_their_middle():
    """A function that is wrong at the ends of its window hurts little where windows overlap."""

    def edges(windows):
        out = np.zeros((len(windows), windows.shape[2]))
        out[:, [0, -1]] = 1.0
        return out

    got = overlap_add(edges, np.zeros((100, 1)), length=20, stride=5)
    assert got[[0, -1]] == pytest.approx([1.0, 1.0])
    assert got[20:80].max() < 0.02
