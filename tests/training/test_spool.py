"""Rows on disk and their windows."""

import resource

import numpy as np
import pytest

from magsim.errors import RequestError
from magsim.training import ArrayWindows, Spool, SpooledWindows

LENGTHS = (30, 7, 12, 41)


@pytest.fixture
def pieces():
    rng = np.random.default_rng(1)
    return [rng.normal(size=(length, 3)).astype(np.float32) for length in LENGTHS]


@pytest.fixture
def spool(pieces, tmp_path):
    with Spool(3, tmp_path) as made:
        for piece in pieces:
            made.append(piece)
        yield made


def test_windows_are_those_of_arrays_in_memory(pieces, spool):
    """Piece 2 is on disk and not learned; piece 1 is shorter than a window."""
    learned = [0, 1, 3]
    expected = ArrayWindows([pieces[i] for i in learned], rows=8)
    places = [(int(sum(LENGTHS[:i])), LENGTHS[i]) for i in learned]
    windows = SpooledWindows(spool, places, rows=8, shift=np.zeros(3), scale=np.ones(3))
    assert len(windows) == len(expected) == 23 + 34
    assert windows.total_rows == expected.total_rows == 71
    everyone = np.arange(len(expected))[::-1]
    np.testing.assert_array_equal(windows.take(everyone), expected.take(everyone))
    scaled = SpooledWindows(spool, places, rows=8, shift=np.array([1.0, 0.0, 2.0]), scale=np.array([1.0, 4.0, 0.5]))
    np.testing.assert_allclose(
        scaled.take(everyone), (expected.take(everyone) - [1.0, 0.0, 2.0]) / [1.0, 4.0, 0.5], rtol=1e-6
    )
    with pytest.raises(ValueError, match="a window has 42 rows, but the longest piece without a gap has 41"):
        SpooledWindows(spool, places, rows=42, shift=np.zeros(3), scale=np.ones(3))


def test_the_digest_is_of_the_values_and_not_of_how_they_were_written(pieces, spool, tmp_path):
    with Spool(3, tmp_path) as whole:
        whole.append(np.concatenate(pieces))
        assert len(whole) == len(spool) == sum(LENGTHS)
        assert whole.digest == spool.digest
        whole.append(pieces[0][:1])
        assert whole.digest != spool.digest


def test_no_file_is_to_be_seen(spool, tmp_path):
    assert len(spool) == 90
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_in_one_line(tmp_path):
    """The limit of a file's size takes the place of the disk's."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, limits[1]))
    try:
        spool = Spool(100, tmp_path)
        spool.append(np.zeros((5000, 100)))
        with pytest.raises(RequestError, match=rf"cannot be kept in {tmp_path}: File too large, after 2 MB; allowed"):
            spool.append(np.zeros((5000, 100)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(tmp_path.iterdir())
    with pytest.raises(RequestError, match="nowhere: No such file or directory, after 0 MB"):
        Spool(1, tmp_path / "nowhere")
