import numpy as np
import pytest

from magsim.arrays import readonly


def test_a_writable_array_is_copied():
    source = np.arange(6.0)
    kept = readonly(source)
    source[0] = 99.0
    assert kept[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0
    assert source.flags.writeable


def test_a_read_only_view_of_a_writable_array_is_copied():
    source = np.arange(6.0)
    view = source[1:]
    view.flags.writeable = False
    kept = readonly(view)
    source[1] = 99.0
    assert kept[0] == 1.0


def test_foreign_memory_is_copied():
    memory = bytearray(np.arange(3.0).tobytes())
    view = np.frombuffer(memory)
    view.flags.writeable = False
    kept = readonly(view)
    memory[:8] = np.array([99.0]).tobytes()
    assert kept[0] == 0.0


def test_what_nobody_can_change_is_shared():
    source = np.arange(6.0)
    source.flags.writeable = False
    assert np.shares_memory(readonly(source), source)
    assert np.shares_memory(readonly(source[2:]), source)
    assert readonly(readonly([1, 2])).tolist() == [1.0, 2.0]


@pytest.mark.parametrize("source", [[1, 2, 3], np.arange(3), np.arange(6.0)[::2], np.ones((3, 2), order="F")])
def test_always_c_ordered_float64(source):
    kept = readonly(source)
    assert kept.dtype == np.float64
    assert kept.flags.c_contiguous
    assert not kept.flags.writeable
    np.testing.assert_array_equal(kept, source)
