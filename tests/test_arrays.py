import numpy as np
import pytest

from magsim.arrays import frozen, given_up, readonly


@pytest.mark.parametrize("view", [lambda a: a, lambda a: a[1:], lambda a: a[:, None]])
def test_values_stay_when_the_source_changes(view):
    source = np.arange(6.0)
    kept = readonly(view(source))
    expected = kept.copy()
    source[:] = 99.0
    np.testing.assert_array_equal(kept, expected)
    assert source.flags.writeable


def test_a_read_only_array_that_owns_its_memory_is_copied():
    source = np.arange(6.0)
    source.flags.writeable = False
    kept = readonly(source)
    source.flags.writeable = True
    source[0] = 99.0
    assert kept[0] == 0.0


def test_foreign_memory_is_copied():
    memory = bytearray(np.arange(3.0).tobytes())
    view = np.frombuffer(memory)
    view.flags.writeable = False
    kept = readonly(view)
    memory[:8] = np.array([99.0]).tobytes()
    assert kept[0] == 0.0


@pytest.mark.parametrize("part", [lambda a: a, lambda a: a[2:], lambda a: a.reshape(2, 3), lambda a: a.view()])
def test_there_is_no_way_to_make_it_writable(part):
    kept = part(readonly(np.arange(6.0)))
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0
    with pytest.raises(ValueError, match="cannot set WRITEABLE flag"):
        kept.flags.writeable = True
    with pytest.raises(ValueError, match="cannot set WRITEABLE flag"):
        kept.setflags(write=True)


def test_an_immutable_array_is_shared():
    source = readonly(np.arange(6.0))
    assert np.shares_memory(readonly(source), source)
    assert np.shares_memory(readonly(source[2:]), source)
    assert readonly(readonly([1, 2])).tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    "source", [[1, 2, 3], np.arange(3), np.arange(6.0)[::2], np.ones((3, 2), order="F"), np.zeros((0, 3)), []]
)
def test_always_c_ordered_float64(source):
    kept = readonly(source)
    assert kept.dtype == np.float64
    assert kept.flags.c_contiguous
    assert kept.flags.aligned
    assert not kept.flags.writeable
    np.testing.assert_array_equal(kept, source)


@pytest.mark.parametrize(
    "part",
    [
        lambda a: a,
        lambda a: a[1:],
        lambda a: np.swapaxes(a, 0, 1),
        lambda a: np.broadcast_to(a[:1], a.shape),
        lambda a: a.T[::2],
        np.asfortranarray,
    ],
)
def test_what_is_given_up_stays_where_it_lies_and_cannot_be_written_to(part):
    source = np.arange(24.0).reshape(4, 3, 2)
    mine = part(source)
    expected = mine.copy()
    kept = given_up(mine)
    np.testing.assert_array_equal(kept, expected)
    assert kept.strides == mine.strides
    assert np.shares_memory(kept, mine)
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0
    with pytest.raises(ValueError, match="cannot set WRITEABLE flag"):
        kept.flags.writeable = True
    assert frozen(kept) is kept
    assert given_up(kept) is kept


def test_what_can_be_written_to_is_copied_when_it_is_frozen():
    source = np.arange(6.0).reshape(2, 3)
    kept = frozen(source.T)
    source[:] = 9.0
    assert kept.tolist() == [[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]]
    assert given_up(np.zeros((0, 3))).shape == (0, 3)
